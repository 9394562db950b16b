"""Several samples a clock: all lanes are proven against the certificate's graph, and each wrong one is rejected."""

import re

import pytest
from tests.gen.block_specifications import designed
from tests.verify.parallel.cores import ODD, Made, made, small, specified
from tests.verify.parallel.rejections import NODE, rejection, sweep
from tests.verify.small_specifications import INSTRUMENT, PLAIN, STEADY, STEADY_INSTRUMENT, WIDE

from sosmith.gen.core import design_core
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.hdl.plan.parallel_clocks import block_latency_cycles

HIGH = """
name = "high"
sample_rate = 1.0e6
input.x = { bits = 11, range = [0.0, 4.0] }
filter = { family = "butterworth", kind = "highpass", order = 6, cutoff = 9331.34210448237 }
output = { bits = 9, range = [0.0, 4.0], unit = "V", max_error = "faithful" }
hardware = { realization = "df1_ef2", samples_per_clock = 2, clock = 500.0e6, start = "zero" }
"""


def with_output(bits: int) -> str:
    before, after = PLAIN.split("output = { bits = 8")
    return f"{before}output = {{ bits = {bits}{after}"


def accept(core: Made) -> None:
    found = core.check()
    assert found.latency == block_latency_cycles(core.design.datapath, core.lanes)
    assert found.states == sum(len(stage.graph.delays) for stage in core.design.datapath.stages) > 0


@pytest.mark.sweep(1)
@pytest.mark.parametrize("realization", SECTIONS)
def test_every_realization(realization: str) -> None:
    accept(small(ODD if realization == "lattice_wdf" else PLAIN, realization, lanes=2))


@pytest.mark.slow
@pytest.mark.parametrize("spec", [STEADY, STEADY_INSTRUMENT, INSTRUMENT])
def test_starts_and_a_calibration(spec: str) -> None:
    accept(small(spec, lanes=4))


def test_an_output_with_more_bits_than_the_input() -> None:
    accept(small(WIDE, "df1", lanes=2))


@pytest.mark.slow
def test_a_product_of_what_the_lane_before_takes_the_upper_bits_of() -> None:
    """The sum whose upper bits are y is computed to the bits that its range needs, not to those of all its operands."""
    core = made(design_core(specified(HIGH)), lanes=2)
    assert re.search(r"assign \{ \w+\[\d+:\d+\], v_0\[23:8\], \w+ \} = \$signed\(add_27\) \+ ", core.text)
    accept(core)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("lanes", [2, 4, pytest.param(16, marks=pytest.mark.slow)])
def test_an_example(lanes: int) -> None:
    accept(made(designed(lanes, pipeline="plain"), lanes=lanes))


@pytest.mark.slow
@pytest.mark.parametrize("realization", SECTIONS)
@pytest.mark.parametrize("lanes", [8, 16])
def test_many_lanes(realization: str, lanes: int) -> None:
    accept(small(ODD if realization == "lattice_wdf" else PLAIN, realization, lanes=lanes))


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("bits", "realization", "lanes"), [(12, "df1_ef1", 2), (10, "state_space", 4), (13, "df2t", 16), (7, "normal", 2)]
)
def test_outputs_of_no_whole_bytes(bits: int, realization: str, lanes: int) -> None:
    """Between the lanes signs are repeated, in the words of the output buffer too."""
    accept(small(with_output(bits), realization, lanes=lanes))


@pytest.mark.slow
def test_a_port_narrower_than_a_limited_sum() -> None:
    """Each word of the buffer is loaded for itself, and one of them with zeros only."""
    core = small(STEADY_INSTRUMENT, lanes=2)
    assert len(re.findall(r"reg \[\d+:0\] o_(?:data|next)_(?:parts|\d+_\d+)\w*", core.text)) > 1
    accept(core)


BREAKS = {
    "lanes of the input swapped": (
        r"\(s_axis_tdata\)",
        "({ s_axis_tdata[7:0], s_axis_tdata[15:8] })",
        rf"(section0\.\w+ must .*{NODE}section0 in lane \d.*|bit \d of m_axis_tuser must be input_at_rail.*)",
    ),
    "lanes of the output swapped": (
        r"m_axis_tdata = o_data\[15:0\]",
        "m_axis_tdata = { o_data[7:0], o_data[15:8] }",
        rf"sample 0 of m_axis_tdata must be {NODE}output_stage in lane 0, not another value",
    ),
    "flags of another lane": (
        r"(m_axis_tuser = \{ 2'h0, )o_data\[21\]",
        r"\1o_data[18]",
        rf"bit 13 of m_axis_tuser must be settling, as the ports and {NODE}output_stage in lane 1 say, not another "
        "value",
    ),
    "a state of another lane": (
        r"(if \(take0\) x1_0 <= \w+)\[15:8\]",
        r"\1[7:0]",
        rf"section0\.x1_0 must hold {NODE}section0 in lane 0 and take over {NODE}section0 in lane 1, not another value",
    ),
    "a state that no reset clears": (
        r"if \(rst\) x1_0 <= 8'h00;\n *else if",
        "if",
        rf"section0\.x1_0 must hold {NODE}section0 in lane 0, which is 0 after a reset, not another value",
    ),
    "a coefficient in one lane": (
        r"(product_A2_1 = .*\* \$signed\(\d+'h\w*)(\w)\)",
        r"\g<1>0)",
        rf"section0\.product_A2_1 must be {NODE}section0 in lane 1, not another value",
    ),
}


@pytest.mark.parametrize("kind", BREAKS)
def test_each_kind_of_break_is_named(kind: str) -> None:
    core = small(lanes=2)
    old, new, sentence = BREAKS[kind]
    text, count = re.subn(old, new, core.text)
    assert count == 1
    assert re.fullmatch(sentence, rejection(core, text)), rejection(core, text)


def test_the_number_of_lanes_is_held_against_the_ports() -> None:
    two, one = small(lanes=2), small()
    assert rejection(one._replace(lanes=2), one.text) == "the port s_axis_tdata must have 16 bits, not 8"
    assert rejection(two._replace(lanes=1), two.text) == "the port s_axis_tdata must have 8 bits, not 16"


WIDE_BREAKS = {
    "a sign of another bit": (
        r"(o_next <= .*)(output_stage_code_\d)\[11\], \2\[11\], \2 ",
        r"\1\2[11], \2[10], \2 ",
        rf"(sample \d of m_axis_tdata must be {NODE}output_stage in lane \d, not another value"
        r"|\S*o_data\S* must take over the same from the pipeline and from the second place)",
    ),
    "a sign of another lane": (
        r"(m_axis_tdata = )o_data\[31:0\]",
        r"\1{ o_data[15], o_data[30:0] }",
        rf"sample 1 of m_axis_tdata must be {NODE}output_stage in lane 1, not another value",
    ),
    "a flag of lane 1 from lane 0": (
        r"(m_axis_tuser = \{ .*)o_data\[35\]",
        r"\1o_data[32]",
        rf"bit 8 of m_axis_tuser must be input_at_rail, as the ports and {NODE}output_stage in lane 1 say, not another "
        "value",
    ),
    "a flag that comes a beat late": (
        r"status(\d+) <= status(\d+);",
        r"status\1 <= { status\2[1], status\1[0] };",
        r"status\d+\[0\] must .*",
    ),
    "a stale beat in one lane": (
        r"if \(o_valid_load\) o_data <= o_data_next;",
        r"if (o_valid_load) o_data <= { o_data_next[37:16], o_data[15:0] };",
        r"output_buffer\.o_data\S* must .*",
    ),
    "lanes swapped in the second place": (
        r"(o_next <= \{.*), (output_stage_code_1\[11\].*), (output_stage_code_0\[11\].*) \};",
        r"\1, \3, \2 };",
        r"output_buffer\.o_data\S* must take over the same from the pipeline and from the second place",
    ),
}


@pytest.mark.parametrize("kind", WIDE_BREAKS)
def test_each_kind_of_break_between_bytes_is_named(kind: str) -> None:
    core = small(with_output(12), lanes=2)
    old, new, sentence = WIDE_BREAKS[kind]
    text, count = re.subn(old, new, core.text, count=1)
    assert count == 1
    assert re.fullmatch(sentence, rejection(core, text)), rejection(core, text)


def test_a_second_sample_moves_whether_another_one_comes_or_not() -> None:
    core = small(with_output(12), lanes=2)
    same = re.sub(
        r"if \(o_valid_load\) (o_data <= o_data_next;)", r"if (o_valid_load) if (i_valid) \1 else \1", core.text
    )
    assert rejection(core, same) == ""
    waits = re.sub(r"if \(o_valid_load\) (o_data <= o_data_next;)", r"if (o_valid_load) if (i_valid) \1", core.text)
    sentence = r"output_buffer\.o_data\S* must take over the second sample when the first leaves"
    assert re.fullmatch(sentence, rejection(core, waits)), rejection(core, waits)


@pytest.mark.slow
@pytest.mark.parametrize(("bits", "lanes", "count"), [(8, 2, 40), (12, 2, 20), (10, 2, 20), (12, 16, 2)], ids=str)
def test_edits(bits: int, lanes: int, count: int) -> None:
    found = sweep(small(with_output(bits), lanes=lanes), count, seed=4, clocks=150)
    assert found["accepted"] + found["rejected"] == count
    assert found["rejected"] >= count // 2


@pytest.mark.slow
@pytest.mark.parametrize(("bits", "realization", "lanes"), [(12, "df1_ef1", 2), (10, "df2t", 4), (12, "normal", 16)])
def test_hundreds_of_edits_between_bytes(bits: int, realization: str, lanes: int) -> None:
    count = 200 if lanes < 16 else 15
    found = sweep(small(with_output(bits), realization, lanes=lanes), count, seed=6, clocks=300)
    assert found["accepted"] + found["rejected"] == count
    assert found["rejected"] > count // 2


@pytest.mark.slow
@pytest.mark.parametrize(("realization", "lanes"), [("df1_ef1", 2), ("state_space", 4), ("lattice_wdf", 2)])
def test_hundreds_of_edits(realization: str, lanes: int) -> None:
    spec = STEADY_INSTRUMENT if lanes == 2 else PLAIN
    found = sweep(small(spec, realization, lanes=lanes), 200, seed=5, clocks=400)
    assert found["accepted"] + found["rejected"] == 200
    assert found["rejected"] > 100
