"""Several samples a clock: all lanes are proven against the certificate's graph, and each wrong one is rejected."""

import json
import re
from pathlib import Path

import pytest
from tests.gen.blocks.specifications import designed
from tests.gen.verifier.parallel.cores import ODD, Made, made, small
from tests.gen.verifier.parallel.test_check import NODE, rejection, sweep
from tests.gen.verifier.small_specifications import INSTRUMENT, PLAIN, STEADY, STEADY_INSTRUMENT

from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.verifier.generated_files import fixed_architecture
from sosmith.hdl.plan.parallel_clocks import block_latency_cycles


def accept(core: Made) -> None:
    found = core.check()
    assert found.latency == block_latency_cycles(core.design.datapath, core.lanes, look_ahead=False)
    assert found.states == sum(len(stage.graph.delays) for stage in core.design.datapath.stages) > 0


@pytest.mark.parametrize("realization", REALIZATIONS)
def test_every_realization(realization: str) -> None:
    accept(small(ODD if realization == "lattice_wdf" else PLAIN, realization, lanes=2))


@pytest.mark.parametrize("spec", [STEADY, STEADY_INSTRUMENT, INSTRUMENT])
def test_starts_and_a_calibration(spec: str) -> None:
    accept(small(spec, lanes=4))


@pytest.mark.parametrize("lanes", [2, 4])
def test_an_example(lanes: int) -> None:
    accept(made(designed(lanes, pipeline="plain"), lanes=lanes))


@pytest.mark.slow
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_many_lanes(realization: str) -> None:
    accept(small(ODD if realization == "lattice_wdf" else PLAIN, realization, lanes=8))


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


@pytest.mark.parametrize(
    ("samples", "width", "name"), [(8, 16, "parallel"), (1, 12, "parallel"), (16, 16, None), (2, 12, None)]
)
def test_up_to_eight_lanes_of_whole_bytes_are_read(samples: int, width: int, name: str | None, tmp_path: Path) -> None:
    path = tmp_path / "core.json"
    streams = {"m_axis": {"samples": samples, "fields": [{"width": width}]}}
    manifest = {"reload": None, "protect": "none", "architecture": "parallel", "channels": 1, "streams": streams}
    path.write_text(json.dumps(manifest), encoding="utf-8")
    assert fixed_architecture(path) == (name, 1, samples)


def test_forty_edits() -> None:
    found = sweep(small(lanes=2), 40, seed=4, clocks=150)
    assert found["accepted"] + found["rejected"] == 40
    assert found["rejected"] > 20


@pytest.mark.slow
@pytest.mark.parametrize(("realization", "lanes"), [("df1_ef1", 2), ("state_space", 4), ("lattice_wdf", 2)])
def test_hundreds_of_edits(realization: str, lanes: int) -> None:
    spec = STEADY_INSTRUMENT if lanes == 2 else PLAIN
    found = sweep(small(spec, realization, lanes=lanes), 200, seed=5, clocks=400)
    assert found["accepted"] + found["rejected"] == 200
    assert found["rejected"] > 100
