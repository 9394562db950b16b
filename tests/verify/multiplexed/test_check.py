"""What is proven of a core whose sections take turns, and that whatever is changed in it is found."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from tests.verify.multiplexed.small_cores import CASES, made
from tests.verify.multirate.single_cores import Made, changed, rejected, rejection
from tests.verify.parallel.simulated import outputs

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


FORGED = (
    kept_while_one_is_offered,
    started_again,
    counted_at_the_end,
    a_turn_at_the_end,
    first_inverted_for_a_while,
)


@pytest.mark.parametrize("forged", FORGED)
def test_what_is_forged_by_hand_is_found(forged: Callable[[], tuple[Made, str]]) -> None:
    """Each of these gives other results, though everything that a sample loads is right when it loads it."""
    core, text = forged()
    assert any(outputs(core.text, 600, seed) != outputs(text, 600, seed) for seed in range(4))
    assert " must " in rejection(check_multiplexed, core, text)


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
