"""The hardware of parallel cores: proven against the certificate's graph, rejected when it computes anything else."""

import re

import pytest
from tests.gen.designs import ALL, parallel_design
from tests.verify.parallel.cores import ODD, Made, made, small, specified
from tests.verify.parallel.rejections import NODE, rejection, sweep
from tests.verify.parallel.simulated import outputs
from tests.verify.small_specifications import INSTRUMENT, PLAIN, STEADY_INSTRUMENT, UNSIGNED

from sosmith.gen.core import design_core
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.hdl.plan.parallel_clocks import latency_cycles
from sosmith.verify.certificate_file import AboutEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.check import check_hardware

# What the generator writes is accepted.


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ALL)
def test_examples(name: str) -> None:
    accept(made(parallel_design(name, realization="df1_ef2")))


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", SECTIONS)
def test_every_realization(realization: str) -> None:
    accept(small(ODD if realization == "lattice_wdf" else PLAIN, realization))


@pytest.mark.slow
@pytest.mark.parametrize("realization", SECTIONS)
def test_every_realization_behind_a_calibration(realization: str) -> None:
    accept(small(INSTRUMENT, realization))


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("realization", "channels"), [("df1_ef1", 2), ("df1_ef1", 17), ("lattice_wdf", 5)])
def test_several_channels(realization: str, channels: int) -> None:
    accept(small(ODD if realization == "lattice_wdf" else PLAIN, realization, channels))


def test_a_calibration_of_several_channels() -> None:
    """Nothing holds its samples back, as it has no states."""
    core = made(design_core(specified(INSTRUMENT), core="calibration"), 3)
    found = core.check()
    assert (found.states, found.latency) == (0, latency_cycles(core.design.datapath, 3))


def test_an_output_that_saturates_far_from_its_ends() -> None:
    accept(small(UNSIGNED, "df1_ef1", 5))


@pytest.mark.slow
@pytest.mark.parametrize("channels", [2, 3, 16, 17, 64])
@pytest.mark.parametrize("realization", SECTIONS)
def test_every_realization_for_several_channels(realization: str, channels: int) -> None:
    accept(small(ODD if realization == "lattice_wdf" else PLAIN, realization, channels))


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_examples_for_several_channels(name: str) -> None:
    accept(made(parallel_design(name, realization="df1_ef2"), 12))


def test_a_word_of_the_calibration_that_is_negative() -> None:
    """Its signs are extended differently in the hardware, where the next stage takes it over."""
    negative = STEADY_INSTRUMENT.replace("bits = 12, range = [0.0, 10.0]", "bits = 24, range = [0.0, 10.0]")
    accept(small(negative.replace("[0.05812]", "[-0.05812]")))


def accept(core: Made) -> None:
    found = core.check()
    assert found.latency == latency_cycles(core.design.datapath, core.channels)
    assert found.progress.given == found.latency + 2 * found.waits
    assert found.progress.cleared == (core.channels if core.channels > 1 else 0)
    assert found.states == sum(len(stage.graph.delays) for stage in core.design.datapath.stages) > 0


def test_registers_are_counted_but_for_those_of_the_control() -> None:
    core = small()
    names = re.findall(r"^ *reg (?:\[\d+:0\] )?([^\s;]+)", core.text, re.MULTILINE)
    control = [name for name in names if re.fullmatch(r"full|o_valid|valid\d|bank\d", name)]
    assert core.check().registers == len(names) - len(control) > len(control) > 4


# What is not the graph of the certificate is rejected.


def test_another_certificate_is_rejected() -> None:
    with pytest.raises(RejectedError, match=r"^section0\.\w+ must .*node \d+ \(.+\) of section0.*$"):
        check_hardware(small().text, small(PLAIN, "df2t").certificate)


def test_reloadable_cores_are_refused() -> None:
    text = made(small().design, reload=True).text
    with pytest.raises(RejectedError, match=r"^the constants must be fixed to be checked, not loadable at run time$"):
        small().check(text)


BREAKS = {
    "a coefficient": (
        r"(product_A2 = .*\* \$signed\(\d+'h\w*)(\w)\)",
        r"\g<1>0)",
        rf"section\d\.product_A2 must be {NODE}.*",
    ),
    "no sign": (
        r"(assign product_A2 = )\$signed\((.*)\) \* \$signed",
        r"\1\2 * $signed",
        rf"section\d\.product_A2 must be {NODE}.*",
    ),
    "a tap": (r"else if \(take2\) v2 <= v1;", "else if (take2) v2 <= v2;", rf"section\d\.v2 must hold {NODE}.*"),
    "an enable": (
        r"else if \(take2\) v1 <=",
        "else if (advance) v1 <=",
        r"section\d\.v1 must be loaded by one valid bit, not by none",
    ),
    "a stall": (
        r"assign take1 = advance & valid1;",
        "assign take1 = valid1;",
        r"(section\d\.\w+ must be node .*, but )?section\d\.\w+ must keep what it holds while its sample stays",
    ),
    "a reset": (
        r"if \(rst\) valid2 <= 1'h0;",
        "if (rst) valid2 <= 1'h1;",
        r"section\d\.valid2 must be 0 after a clock with aresetn = 0",
    ),
    "a first value": (
        r"reg (\[\d+:0\]) v1 = (\d+)'h0+;",
        r"reg \1 v1 = \2'h1;",
        rf"section\d\.v1 must hold {NODE}section\d, which is 0 at first, not 1",
    ),
    "a limit": (
        r"code_register <= 8'h80",
        "code_register <= 8'h81",
        rf"output_stage\.code_register must be {NODE}output_stage, not another value",
    ),
    "a queue": (
        r"(o_valid_next )= full \? 1'h1 : i_valid",
        r"\1= full ? 1'h0 : i_valid",
        r"output_buffer\.o_valid must be 1 after a clock with .*",
    ),
    "a second sample": (
        r"= full \? \{ o_next.*? \} : (.*);",
        r"= full ? \1 : \1;",
        r"output_stage\.code_register must be loaded whenever a sample leaves position 4",
    ),
    "a field": (
        r"\.x\(s_axis_tdata\)",
        ".x({ s_axis_tdata[6:0], s_axis_tdata[7] })",
        rf"section0\.\w+ must .*{NODE}section0.*",
    ),
    "an output": (
        r"m_axis_tdata = o_data\[7:0\]",
        "m_axis_tdata = o_data[8:1]",
        rf"m_axis_tdata must be {NODE}output_stage, not another value",
    ),
    "a flag": (
        r"m_axis_tuser = \{ 2'h0, o_data\[13:8\] \}",
        "m_axis_tuser = { 2'h0, o_data[13:11], 1'h0, o_data[9:8] }",
        rf"bit 2 of m_axis_tuser must be output_saturated, as the ports and {NODE}output_stage say, "
        "not another value",
    ),
    "a wider port": (
        r"output \[7:0\] m_axis_tuser;\n  wire \[7:0\] m_axis_tuser;",
        "output [8:0] m_axis_tuser;\n  wire [8:0] m_axis_tuser;",
        "the port m_axis_tuser must have 8 bits, not 9",
    ),
    "a clock": (
        r"always_ff @\(posedge clk\)\n(    if \(take1\))",
        r"always_ff @(posedge rst)\n\1",
        r"the clock rst of plain must be an input of it",
    ),
    "a driver": (
        r"assign take2 = advance & valid2;",
        "assign take2 = advance & valid2;\n  assign take2 = advance;",
        r"each bit of take2 in plain_section0 must be driven once",
    ),
    "a core that takes nothing": (
        r"(assign advance = ).*full;",
        r"\g<1>1'h0;",
        "not s_axis_tready must be one register, not logic of 0 signals",
    ),
    "a core that waits for its sink": (
        r"(assign advance = ).*full;",
        r"\1o_ready & not_full;",
        "not s_axis_tready must be one register, not logic of 2 signals",
    ),
    "a source": (
        r"\.i_valid\(s_axis_tvalid\)",
        ".i_valid(1'h1)",
        r"what section0\.valid1 takes over must be one register, not logic of 0 signals",
    ),
    "a loop": (
        r"assign take2 = advance & valid2;",
        "assign take2 = take2 & valid2;",
        r".*section\d\.take2 must not depend on itself within a clock",
    ),
}


IN_FRONT = "for a sample in front while none of those that it may wait for is in the pipeline"

CHANNEL_BREAKS = {
    "an address in time": (
        r"(assign \w+_write_address =.* : )channel3;",
        r"\1clear_channel;",
        rf"section0\.\w+_memory must hold {NODE}section0 and be written for the channel of the sample",
    ),
    "a ready of its own": (
        r"(assign s_axis_tready = ).*& (.*);",
        r"\1\2;",
        "s_axis_tready must be 0 just while nothing fits",
    ),
    "an address for a reason of its own": (
        r"(assign \w+_write_address =) clear \?",
        r"\1 valid1 ?",
        rf"section0\.\w+_memory must hold {NODE}section0, and section0\.valid1 must not count for what is written",
    ),
    "an address": (
        r"(x1_memory_read <= x1_memory\[\w+)\[1:0\]",
        r"\1[2:1]",
        rf"section0\.x1_memory must hold {NODE}section0 and be read for the channel of the sample, not for another one",
    ),
    "a word": (
        r"(assign \w+_write_data = clear \? \d+'h0+)0 :",
        r"\g<1>1 :",
        rf"section0\.\w+_memory must hold {NODE}section0 and be cleared to 0",
    ),
    "a word written twice": (
        r"( +if \(x1_memory_write_enable\)\n +x1_memory\[)(x1_memory_write_address)(\] <= .*;\n)",
        r"\1\2\3\1clear_channel\3",
        r"section0\.x1_memory must be written in one place",
    ),
    "too few words": (
        r"(clear_channel == 2'h)2;",
        r"\g<1>1;",
        "clearing must be 1 after a clock with aresetn = 1, clearing = 1, clear_channel = 1",
    ),
    "a channel": (
        r"s_axis_tdest < 2'h3",
        "s_axis_tdest < 2'h2",
        r"input_buffer\.i_valid must be s_axis_tvalid for the 3 channels that exist, and 0 for others",
    ),
    "a distance": (
        r"near0 & ",
        "near1 & ",
        rf"section0\.\w+_memory must hold {NODE}section0 and be read at most 0 positions before it is written, not \d",
    ),
    "a sample that stays": (
        r"(assign o_ready = advance)( & .*);",
        r"\1;",
        r"input_buffer\.o_ready must be 1 just when valid is",
    ),
    "a sample that never enters": (
        r"(assign valid = o_valid|assign o_ready = advance) & \w+;",
        r"\1 & 1'h0;",
        rf"valid must be 1 {IN_FRONT}",
    ),
    "a sample that waits for its data": (
        r"(assign valid = o_valid|assign o_ready = advance) & \w+;",
        r"\1 & s_axis_tdata[0];",
        rf"valid must be 1 {IN_FRONT}",
    ),
    "a label": (
        r"(m_axis_tdest = .*)\[15:14\]",
        r"\1[14:13]",
        "m_axis_tdest must be the channel of the sample, not another value",
    ),
}


@pytest.mark.parametrize("kind", CHANNEL_BREAKS)
def test_each_kind_of_break_of_several_channels_is_named(kind: str) -> None:
    core = small(channels=3)
    old, new, sentence = CHANNEL_BREAKS[kind]
    text, count = re.subn(old, new, core.text)
    assert count >= 1
    assert re.fullmatch(sentence, rejection(core, text)), rejection(core, text)


@pytest.mark.parametrize("kind", BREAKS)
def test_each_kind_of_break_is_named(kind: str) -> None:
    core = small()
    old, new, sentence = BREAKS[kind]
    text, count = re.subn(old, new, core.text, count=1)
    assert count == 1
    assert re.fullmatch(sentence, rejection(core, text)), rejection(core, text)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (r"= \{ 2'h0, ", "= { 2'h1, ", "bit 6 of m_axis_tuser must be 0, as there is no such flag, not another value"),
        (r"= \{ 2'h0, ", "= { 2'h2, ", "bit 7 of m_axis_tuser must be 0, as there is no such flag, not another value"),
        (
            r"o_data\[13:8\] \};",
            "o_data[13:10], o_data[8], o_data[8] };",
            "bit 1 of m_axis_tuser must be 0, as there is no such flag, not another value",
        ),
        (
            "  wire rst;",
            r"  wire rst;\n  wire \\section0.rst ;",
            "the SystemVerilog must be made of its plain subset, not have .*",
        ),
        (
            r"(\n  reg \[11:0\] (\w+) = .*;)",
            r"\1\n  wire \\\2[10] ;",
            r"the SystemVerilog must be made of its plain subset, not have .*",
        ),
        (
            r"(\n  reg full = 1'h0;)",
            r"\1\n  initial begin\n    full[0] = 1'h1;\n  end",
            r"full must be a memory with the words 0\.\.0",
        ),
    ],
)
def test_what_no_node_says_is_checked(old: str, new: str, sentence: str) -> None:
    core = small()
    text, count = re.subn(old, new, core.text, count=1)
    assert count == 1
    assert re.fullmatch(sentence, rejection(core, text))


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "~ aresetn;",
            f"{'{ ' * 30_000}aresetn;",
            "expressions and statements of plain must not be nested as deep as that",
        ),
        ("full = 1'h0;", "full = 99999999999999'h1;", "a number must have at most 8192 bits, not 99999999999999"),
        ("  reg full ", "  reg [2:0] words [999999999:0];\n  reg full ", "words must have at most 1048576 words"),
    ],
)
def test_a_text_that_asks_for_much_is_refused(old: str, new: str, sentence: str) -> None:
    core = small()
    assert re.fullmatch(sentence, rejection(core, core.text.replace(old, new, 1)))


def in_buffer(text: str, declared: str, old: str, new: str, nets: str = "") -> str:
    """Change the output buffer of a core: declarations after its header, a text in it, and what comes at its end."""
    start = text.index("module plain_output_buffer(")
    end = text.index("endmodule", start)
    head, body = text[start:end].split(";", 1)
    assert body.count(old) == 1
    return f"{text[:start]}{head};\n{declared}{body.replace(old, new)}{nets}{text[end:]}"


def test_of_two_loads_at_a_clock_the_first_one_counts_where_data_leave_out_the_second() -> None:
    core = small()
    own = "  always_ff @(posedge clk)\n    if (full_reset) full <= 1'h0;\n    else if (!full) full <= i_valid;\n"
    names = ("filled", "wanted", "inverted", "changes", "stay", "load")
    nets = (
        "  assign filled = full | i_valid;\n  assign stay = ~ full_reset;\n  assign wanted = & { stay, filled };\n"
        "  assign inverted = ~ full;\n  assign changes = wanted != full;\n"
        "  assign load = | { rst, changes, output_stage_code[0] };\n"
        "  always_ff @(posedge clk) begin\n    full <= inverted;\n    if (load) full <= wanted;\n  end\n"
    )
    text = in_buffer(core.text, "".join(f"  wire {name};\n" for name in names), own, nets)
    assert outputs(core.text, 400, 0) != outputs(text, 400, 0)
    assert re.fullmatch(r"output_buffer\.full must be 0 after a clock with .*", rejection(core, text))


def test_control_without_a_first_value_is_refused() -> None:
    core = small()
    text = in_buffer(
        core.text,
        "  reg u;\n  wire not_u;\n  wire odd;\n  wire next_or_odd;\n",
        "o_valid <= o_valid_next;",
        "o_valid <= next_or_odd;",
        "  always_ff @(posedge clk)\n    u <= u;\n  assign not_u = ~ u;\n  assign odd = u & not_u;\n"
        "  assign next_or_odd = o_valid_next | odd;\n",
    )
    sentence = "output_buffer.u must have a value before the first clock, as it counts for what moves"
    assert rejection(core, text) == sentence


def test_without_wear_its_flags_are_0() -> None:
    core = small()
    text = core.text.replace("o_data[13:8] };", "o_data[13:12], 1'h1, o_data[10:8] };")
    assert text != core.text
    assert rejection(core, text) == ""  # the specification is not there, which would say whether there is wear
    for specification, place in ((PLAIN, 3), (PLAIN + "[wear]", None)):
        about = AboutEntry(
            specification=specification, sha256="0" * 64, options={}, files=(), versions={}, certificate="0" * 64
        )
        stated = core._replace(certificate=core.certificate.model_copy(update={"about": about}))
        none = "must be 0, as there is no such flag, not another value"
        assert rejection(stated, text) == (f"bit {place} of m_axis_tuser {none}" if place else "")


def test_bits_beside_a_field_may_be_anything() -> None:
    """Even a single one: the eighth bit of seven counts as 0 nowhere."""
    core = small(PLAIN.replace("bits = 8", "bits = 7", 1))
    assert rejection(core, core.text) == ""
    word = "wire [6:0] word;\n  assign word = s_axis_tdata[6:0] + s_axis_tdata[7];"
    text = core.text.replace(".x(s_axis_tdata[6:0])", ".x(word)")
    text = text.replace("wire [7:0] s_axis_tdata;", f"wire [7:0] s_axis_tdata;\n  {word}", 1)
    assert re.fullmatch(rf"section0\.\w+ must be {NODE}section0, not another value", rejection(core, text))


def test_names_of_registers_do_not_make_a_proof() -> None:
    core = small()
    swapped = re.sub(r"\bv([12])\b", lambda found: f"v{3 - int(found[1])}", core.text)
    assert swapped != core.text
    assert re.fullmatch(rf"section0\.taps_A2 must be {NODE}section0, not another value", rejection(core, swapped))


# Random edits.


@pytest.mark.slow
def test_random_edits_of_a_calibration_of_several_channels() -> None:
    core = made(design_core(specified(INSTRUMENT), core="calibration"), 3)
    assert sweep(core, 15, seed=8, clocks=200)["rejected"] > 7


@pytest.mark.slow
@pytest.mark.parametrize("count", [20, pytest.param(60, marks=pytest.mark.slow)])
def test_edits(count: int) -> None:
    found = sweep(small(), count, seed=1, clocks=200)
    assert found["accepted"] + found["rejected"] == count
    assert found["rejected"] > count // 2
    assert found["rejected, a node named"] > count // 5


@pytest.mark.slow
def test_a_hundred_edits_of_several_channels() -> None:
    found = sweep(small(channels=3), 100, seed=3, clocks=400)
    assert found["accepted"] + found["rejected"] == 100
    assert found["rejected"] > 50


@pytest.mark.slow
@pytest.mark.parametrize(("realization", "channels"), [("df1_ef1", 1), ("df2t", 1), ("normal", 1), ("lattice_wdf", 3)])
def test_a_thousand_edits(realization: str, channels: int) -> None:
    found = sweep(small(INSTRUMENT, realization, channels), 250, seed=2, clocks=600)
    assert found["accepted"] + found["rejected"] == 250
    assert found["rejected"] > 150
    assert found["rejected, a node named"] > 50
