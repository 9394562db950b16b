"""What is proven of a core whose sections take turns, and that whatever is changed in it is found."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from tests.verify.multiplexed.small_cores import CASES, made
from tests.verify.multirate.single_cores import Made, changed, rejected, rejection
from tests.verify.parallel.simulated import outputs

from sosmith.verify.certificate_file import Operation
from sosmith.verify.graph import RejectedError
from sosmith.verify.multiplexed.check import check_multiplexed
from sosmith.verify.verification import verify


@pytest.mark.parametrize("case", CASES)
def test_clocks_are_those_of_the_plan(case: str) -> None:
    core = made(case)
    verdict = check_multiplexed(core.text, core.certificate, core.item)
    architecture = core.design.core.architecture
    assert architecture.plan.shared
    assert verdict.clearing == architecture.reset_cycles == 0
    assert verdict.progress == (1 + architecture.plan.interval, architecture.latency_cycles, 0)
    assert (verdict.waits, verdict.memories) == (0, 0)
    assert verdict.latency == architecture.latency_cycles
    assert verdict.interval == architecture.cycles_per_sample == architecture.plan.interval
    assert verdict.states == sum(len(stage.graph.delays) for stage in architecture.datapath.stages)
    assert verify(core.certificate).bound == core.certificate.claims.bound


_CHANGES = {
    "samples too near": (r"rest_minus_1 : 2'h1", "rest_minus_1 : 2'h0"),
    "a sample that enters too early": (r"enters = s_axis_tvalid & [^;]*;", "enters = s_axis_tvalid;"),
    "a place of another section": (r"section0_v1 <= section1_v1", "section0_v1 <= section0_v1"),
    "a turn that is left out": (r"take0 = advance & i_valid_or_valid1;", "take0 = advance & valid1;"),
    "a turn too many": (r"take0 = advance & i_valid_or_valid1;", "take0 = advance;"),
    "a constant that stays": (r"own_product_A1 <= own_product_A1_next", "own_product_A1 <= own_product_A1"),
    "the constants of another section": (r"own_product_A2_next = member \?", "own_product_A2_next = ~ member ?"),
    "a first constant": (r"own_product_A2 = 7'h\w*;", "own_product_A2 = 7'h00;"),
    "an entry for each section": (r"first <= member", "first <= 1'h1"),
    "a first turn that is another's": (r"reg first = 1'h1", "reg first = 1'h0"),
    "a first turn after a reset": (r"if \(rst\) first <= 1'h1", "if (rst) first <= 1'h0"),
    "a state that a reset leaves": (r"if \(rst\) section1_v1 <= 16'h0000;\n    else if", "if"),
    "turns that a reset leaves": (r"if \(rst\) member <= 1'h0;\n    else if", "if"),
    "turns without a first one": (r"reg member = 1'h0", "reg member"),
    "an input of another section": (r"entry } = first \?", "entry } = ~ first ?"),
    "an output of another section": (r"o0 = section1_v1\[15:6\]", "o0 = section0_v1[15:6]"),
    "a rail of another sample": (r"status3 <= status2", "status3 <= status4"),
}


@pytest.mark.parametrize(("pattern", "by"), _CHANGES.values(), ids=_CHANGES)
def test_what_is_changed_is_found(pattern: str, by: str) -> None:
    core = made()
    assert rejection(check_multiplexed, core, core.text) == ""
    assert " must " in rejection(check_multiplexed, core, changed(core.text, pattern, by))


def in_module(text: str, name: str, declared: str, *edits: tuple[str, str]) -> str:
    """Change a module: after its header come other declarations, and before its end what an empty text becomes."""
    start = text.index(f"module turns_{name}(")
    end = text.index("endmodule", start)
    head, body = text[start:end].split(";", 1)
    for old, new in edits:
        assert old in body
        body = body.replace(old, new, 1) if old else body + new
    return f"{text[:start]}{head};\n{declared}{body}{text[end:]}"


def with_input(text: str, module: str, port: str, net: str) -> str:
    """Give a module a net of the top."""
    text = text.replace(f"module turns_{module}(", f"module turns_{module}({port}, ", 1)
    text = in_module(text, module, f"  input {port};\n  wire {port};\n")
    inlet = f"  turns_{module} {module} ("
    return changed(text, re.escape(inlet), f"{inlet}\n    .{port}({net}),")


_SHARED = "section0_to_section1"


def kept_while_one_is_offered() -> tuple[Made, str]:
    """Let a sample that is offered and does not enter yet take the place of the one that has."""
    core = made("from zero, three clocks a turn")
    return core, changed(core.text, r"kept_load = & \{ enters, advance \}", "kept_load = & { s_axis_tvalid, advance }")


def started_again() -> tuple[Made, str]:
    """Let what is offered and does not enter make the next sample the first one."""
    core = made()
    text = with_input(with_input(core.text, "start", "offers", "s_axis_tvalid"), "start", "resting", "rest")
    own = "else if (take0) started <= 1'h1;"
    again = f"{own}\n    else if (again) started <= 1'h0;"
    net = "  assign again = & { advance, offers, resting };\n"
    return core, in_module(text, "start", "  wire again;\n", (own, again), ("", net))


def counted_at_the_end() -> tuple[Made, str]:
    """Let a count begin anew when its sample leaves the last position."""
    core = made("from zero")
    own = (r"else if (take0) counted <= counted_next", "else if (take1) counted <= 5'h00")
    return core, in_module(
        core.text, "output_stage", "  wire take1;\n", own, ("", "  assign take1 = advance & valid1;\n")
    )


def a_turn_at_the_end() -> tuple[Made, str]:
    """Let a sample that leaves the last position change whose turn it is."""
    core = made("three clocks a turn")
    text = with_input(core.text, _SHARED, "leaves", "output_stage_valid")
    declared = "  wire again;\n  wire take2_or_again;\n  wire more;\n"
    nets = "  assign again = advance & leaves;\n  assign take2_or_again = take2 | again;\n"
    nets += "  assign more = leaves | member_next[0];\n"
    own = "else if (take2) member <= member_next[0]"
    return core, in_module(text, _SHARED, declared, (own, "else if (take2_or_again) member <= more"), ("", nets))


def first_inverted_for_a_while() -> tuple[Made, str]:
    """Let the first sample be another one between two positions, where the sample before still takes it."""
    core = made()
    nets = "  assign take1 = advance & valid1;\n  assign first_load = take0 | take1;\n"
    nets += "  assign own = started ? first : x;\n  assign first_next = ~ own;\n"
    return core, in_module(
        core.text,
        "start",
        "  wire take1;\n  wire [5:0] own;\n  wire [5:0] first_next;\n",
        ("else if (first_load) first <= x;", "else if (first_load) first <= first_next;"),
        ("  assign first_load = & { not_started, take0 };", ""),
        ("", nets),
    )


def loaded_twice() -> tuple[Made, str]:
    """Load whether a sample is inside twice at a clock, the second time only where the data say so."""
    core = made("from zero")
    own = "    if (!aresetn) i_valid <= 1'h0;\n    else if (advance) i_valid <= enters;\n"
    twice = "    i_valid <= forged_0;\n    if (forged_1) i_valid <= forged_2;\n  end\n"
    nets = (
        "  assign forged_0 = ~ i_valid;\n  assign wanted = advance ? enters : i_valid;\n"
        "  assign forged_2 = & { aresetn, wanted };\n  assign forged_other = wanted != i_valid;\n"
        "  assign forged_1 = | { rst, forged_other, s_axis_tdata[0] };\n"
    )
    declared = "".join(f"  wire {name};\n" for name in ("forged_0", "forged_1", "forged_2", "forged_other", "wanted"))
    text = changed(
        core.text, re.escape(f"always_ff @(posedge aclk)\n{own}"), f"always_ff @(posedge aclk) begin\n{twice}"
    )
    return core, changed(
        changed(text, "  wire not_rest;\n", f"  wire not_rest;\n{declared}"), "  assign rst =", f"{nets}  assign rst ="
    )


FORGED = (
    kept_while_one_is_offered,
    started_again,
    counted_at_the_end,
    a_turn_at_the_end,
    first_inverted_for_a_while,
    loaded_twice,
)


@pytest.mark.parametrize("forged", FORGED)
def test_what_is_forged_by_hand_is_found(forged: Callable[[], tuple[Made, str]]) -> None:
    """Each of these gives other results, though everything that a sample loads is right when it loads it."""
    core, text = forged()
    assert any(outputs(core.text, 600, seed) != outputs(text, 600, seed) for seed in range(4))
    assert " must " in rejection(check_multiplexed, core, text)


def with_flag(text: str, declared: str, nets: str) -> str:
    """Let a net `odd` mark results as saturated, too."""
    own = "  assign o_saturated_next = |"
    nets = f"{nets}  assign o_saturated_next = | {{ odd, others }};\n  assign others = |"
    return in_module(text, "output_stage", f"  wire odd;\n  wire others;\n{declared}", (own, nets))


def delayed_port(port: str, declared: str, first: str) -> str:
    """Give a port another name, and its own name to a register behind it."""
    text = re.sub(rf"(module turns\([^;]*?){port}", r"\1other", made().text, count=1)
    behind = f"  input {declared}other;\n  wire {declared}other;\n  reg {declared}{port} = {first};\n"
    text = changed(text, re.escape(f"  input {declared}{port};\n  wire {declared}{port};\n"), behind)
    process = "  always_ff @(posedge aclk)\n"
    return text.replace(process, f"{process}    if (advance) {port} <= other;\n{process}", 1)


_PORTS = "aclk, aresetn, m_axis_tdata, m_axis_tready, m_axis_tuser, m_axis_tvalid, s_axis_tdata"
_PORTS += ", s_axis_tready, s_axis_tvalid"
_OTHER_VALID = ", ".join(sorted(_PORTS.replace("s_axis_tvalid", "other").split(", ")))

_REFUSED: dict[str, tuple[Callable[[], str], str]] = {
    "a register of a port's name, data": (
        lambda: delayed_port("s_axis_tdata", "[7:0] ", "8'h00"),
        f"the ports must be {_PORTS}, not {_PORTS.replace('s_axis_tdata', 'other')}",
    ),
    "a register of a port's name, valid": (
        lambda: delayed_port("s_axis_tvalid", "", "1'h0"),
        f"the ports must be {_PORTS}, not {_OTHER_VALID}",
    ),
    "a number of x": (
        lambda: with_flag(made().text, "  wire u;\n", "  assign u = 1'hx;\n  assign odd = u & u;\n"),
        "the SystemVerilog must have a number with its width after 'any_rounded_7_6_2 ; assign u =', not \"1'hx\"",
    ),
    "a register without a first value": (
        lambda: with_flag(
            made().text, "  reg u;\n", "  always_ff @(posedge clk)\n    u <= u;\n  assign odd = u & u;\n"
        ),
        "output_stage.u must have a value before the first clock",
    ),
    "a memory": (
        lambda: with_flag(
            made().text,
            "  reg [0:0] m [1:0];\n  initial begin\n    m[0] = 1'h0;\n    m[1] = 1'h0;\n  end\n",
            "  assign odd = m[code_register[0]];\n",
        ),
        "the core must have no memory",
    ),
}


@pytest.mark.parametrize(("text", "sentence"), _REFUSED.values(), ids=_REFUSED)
def test_what_a_core_may_not_have(text: Callable[[], str], sentence: str) -> None:
    core = made()
    assert rejection(check_multiplexed, core, text()) == sentence


def test_the_entry_of_another_hardware_may_be_narrower_than_the_power_of_two_in_its_word() -> None:
    core = made("from zero")
    nets = "  assign wide = counted * 8'h04;\n  assign entry = wide[0];\n  assign odd = entry;\n"
    text = with_flag(core.text, "  wire [7:0] wide;\n  wire entry;\n", nets)
    assert outputs(core.text, 600, 0) == outputs(text, 600, 0)
    assert rejection(check_multiplexed, core, text) == ""


def test_what_is_right_from_the_second_sample_on_only_is_found() -> None:
    """A certificate may have a 1 of two samples ago, which is 0 for two samples; nobody else uses it."""
    core = made("from zero")
    stage = core.certificate.stages[0]
    one = len(stage.nodes)
    delay = {"op": Operation.DELAY, "frac": 0, "low": 0, "high": 1, "parameter": 0, "parameter_frac": 0}
    more = (
        delay | {"op": Operation.CONSTANT, "operands": (), "low": 1, "parameter": 1, "name": "one"},
        delay | {"operands": (one,), "name": "s1"},
        delay | {"operands": (one + 1,), "name": "s2"},
    )
    nodes = (*stage.nodes, *(stage.nodes[0].model_copy(update=node) for node in more))
    stages = (stage.model_copy(update={"nodes": nodes}), *core.certificate.stages[1:])
    certificate = core.certificate.model_copy(update={"stages": stages})
    assert verify(certificate).bound == core.certificate.claims.bound

    process = "  always_ff @(posedge aclk)\n"
    behind = [("section0_s1", "b1"), ("b1", "b2"), ("b2", "b3")]
    loads = "".join(
        f"{process}    if (!aresetn) section0_{name} <= 1'h0;\n    else if (kept_load) section0_{name} <= {value};\n"
        for name, value in (("s1", "1'h1"), ("s2", "section0_s1"))
    ) + "".join(f"{process}    if (advance) {later} <= {earlier};\n" for earlier, later in behind)
    registers = "".join(f"  reg {name} = 1'h0;\n" for name in ("section0_s1", "section0_s2", "b1", "b2", "b3"))
    text = changed(core.text, "  wire not_rest;\n", f"  wire not_rest;\n{registers}").replace(
        process, f"{loads}{process}", 1
    )
    check_multiplexed(text, certificate, core.item)
    forged = with_input(with_input(text, "output_stage", "b3", "b3"), "output_stage", "s2", "section0_s2")
    forged = in_module(
        forged,
        "output_stage",
        "  wire odd;\n  wire [6:0] more;\n",
        ("else code_register <= code_register_next[6:0];", "else code_register <= more;"),
        ("", "  assign odd = b3 ? 1'h0 : s2;\n  assign more = code_register_next[6:0] + { 6'h00, odd };\n"),
    )
    assert any(outputs(text, 600, seed) != outputs(forged, 600, seed) for seed in range(6))
    with pytest.raises(RejectedError, match=r" must "):
        check_multiplexed(forged, certificate, core.item)


@pytest.mark.parametrize("source", ["m_axis_tready", "s_axis_tdata[0]", "aresetn", "rest"])
def test_a_result_is_made_of_registers(source: str) -> None:
    core = made()
    text = changed(core.text, r"m_axis_tdata = o_data\[7:0\]", f"m_axis_tdata = {{ o_data[7:1], {source} }}")
    name = source.partition("[")[0]
    with pytest.raises(RejectedError, match=rf"^a result must be made of registers of the output, not of {name}$"):
        check_multiplexed(text, core.certificate, core.item)


def test_a_state_under_another_name_is_not_found() -> None:
    core = made()
    with pytest.raises(RejectedError, match=r"^one register must hold node 3 \(delay v1\) of section1, not 0$"):
        check_multiplexed(core.text.replace("section1_v1", "section1_other"), core.certificate, core.item)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", range(3))
def test_random_edits_are_found_or_change_nothing(case: str, seed: int) -> None:
    core = made(case)
    assert rejected(check_multiplexed, core, 40, seed) >= 25
