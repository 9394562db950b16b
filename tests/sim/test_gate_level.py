"""The netlists of cores in the bench of the cores themselves: bit-exact for every FPGA, and broken ones are found."""

import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.fpga.boards import Board, find_board
from sosmith.gen.fpga.synthesis import Netlist, synthesize
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.page import render_page
from sosmith.gen.report.report import summarise
from sosmith.gen.specification.specification import load
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.errors import ShortfallError, ToolError
from sosmith.sim import simulation
from sosmith.sim.gate_level import with_cell_models
from sosmith.sim.simulation import simulate

SMALL = """
name = "little"
sample_rate = 48000.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { family = "butterworth", kind = "lowpass", order = 2, cutoff = 4000.0 }
output = { bits = 8, signed = true, range = [-1.0, 1.0], max_error = 0.01 }
hardware = { architecture = "ARCHITECTURE", realization = "df1_ef2", start = "START", clock = 48.0e6 }
"""


def little(architecture: str, folder: Path, start: str = "steady") -> CoreDesign:
    """Design a small filter."""
    path = folder / "little.toml"
    path.write_text(SMALL.replace("ARCHITECTURE", architecture).replace("START", start), encoding="utf-8")
    return design_core(load(path))


def run(made: CoreDesign, board: str, folder: Path, *, samples: int, simulator: str = "icarus") -> Evidence:
    """Run the part of the worst case where the sign pattern turns over."""
    traces = traces_for(made, "worst_case", seed=5)
    start = max(0, len(traces[0].codes) // 2 - samples // 2)
    short = [replace(t, codes=t.codes[start : start + samples], truth=None, reading=None) for t in traces]
    return simulate(made, short, folder, simulator=simulator, seed=5, idle=0.1, stall=0.1, gates=find_board(board))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("board", "architecture", "simulator", "kinds"),
    [
        ("icebreaker", "folded", "icarus", {"SB_LUT4", "SB_CARRY", "SB_DFFESR", "SB_MAC16", "SB_RAM40_4K"}),
        pytest.param(
            "ulx3s_25f", "parallel", "verilator", {"LUT4", "CCU2C", "TRELLIS_FF", "MULT18X18D"}, marks=pytest.mark.slow
        ),
        ("olimex_gatemate", "folded", "verilator", {"CC_L2T4", "CC_ADDF", "CC_DFF", "CC_MULT", "CC_BRAM_20K"}),
    ],
)
def test_a_netlist_computes_what_the_integer_model_does(
    board: str, architecture: str, simulator: str, kinds: set[str], tmp_path: Path
) -> None:
    evidence = run(little(architecture, tmp_path), board, tmp_path, samples=24, simulator=simulator)
    assert (evidence.run.mismatches, evidence.run.samples) == (0, 24)
    assert evidence.gates is not None
    assert evidence.gates.cells.keys() >= kinds
    report = summarise(evidence)
    assert report["passed"]
    assert report["gates"] == board
    assert report["tools"].keys() == {simulator, "cocotb", "python", "yosys"}
    title = find_board(board).title
    page = render_page(evidence, report)
    assert f"The simulated netlist for the {title} agrees with its integer model bit for bit" in page
    assert f"the netlist for the {title}, {find_board(board).device.title}: " in page


EXAMPLES_IN = [
    (f"{example}.toml", architecture, board)
    for example in ("audio_lowpass", "flange_wear_bench", "flange_wear_locomotive")
    for architecture in ("parallel", "folded", "serial")
    for board in ("icebreaker", "ice40_hx8k_b_evn", "ulx3s_25f", "olimex_gatemate")
]


def made_in(example: str, architecture: str, *, channels: int = 1) -> CoreDesign:
    spec = load(EXAMPLES / example)
    hardware = replace(spec.hardware, architecture=architecture, clock=Fraction(200_000_000), realization="df1_ef2")
    return design_core(replace(spec, hardware=hardware, channels=channels))


@pytest.mark.slow
@pytest.mark.parametrize(("example", "architecture", "board"), EXAMPLES_IN)
def test_every_example_in_every_architecture(example: str, architecture: str, board: str, tmp_path: Path) -> None:
    made = made_in(example, architecture)
    evidence = run(made, board, tmp_path, samples=2000 if architecture == "parallel" else 100, simulator="verilator")
    assert evidence.run.mismatches == 0
    assert summarise(evidence)["passed"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("architecture", "channels"), [("parallel", 3), ("parallel", 17), ("folded", 3), ("serial", 3)]
)
@pytest.mark.parametrize("board", ["icebreaker", "ulx3s_25f"])
def test_several_channels(board: str, architecture: str, channels: int, tmp_path: Path) -> None:
    made = made_in("audio_lowpass.toml", architecture, channels=channels)
    evidence = run(made, board, tmp_path, samples=40, simulator="icarus")
    assert (evidence.run.mismatches, evidence.run.samples) == (0, 40 * channels)


Break = Callable[[str], str]


def flipped(pattern: str, bits: int = 1) -> Break:
    """Flip bits of the hexadecimal digits that are the first group of the first match; the lowest one if not said."""

    def apply(text: str) -> str:
        found = re.search(pattern, text)
        assert found is not None, pattern
        digits = found[1]
        return f"{text[: found.start(1)]}{int(digits, 16) ^ bits:0{len(digits)}x}{text[found.end(1) :]}"

    return apply


def break_netlist(break_it: Break, monkeypatch: pytest.MonkeyPatch) -> None:
    """Break the netlist between synthesis and simulation."""

    def broken(sv: Path, top: str, board: Board, folder: Path) -> Netlist:
        netlist = synthesize(sv, top, board, folder)
        path = folder / "broken.v"
        path.write_text(break_it(netlist.path.read_text(encoding="utf-8")), encoding="utf-8")
        return replace(netlist, path=path)

    monkeypatch.setattr(simulation, "synthesize", broken)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("gates")


WRONG = {
    "a table of a section's LUT4": flipped(r"\bLUT4 #\(\s*\.INIT\(16'h(\w+)\)\s*\) \\section0\."),
    "an operand of a multiplier": flipped(r"\n  MULT18X18D [^;]*?\.B0\(1'h(\w)\)"),
    # Of a table of a carry, rows with D = 0 are never asked for, so all of it is flipped.
    "a table of a section's carry": flipped(r"\n  CCU2C #\([^;]*?\.INIT0\(16'h(\w+)\)[^;]*?\) \\section0\.", 0xFFFF),
}


@pytest.mark.slow
@pytest.mark.parametrize("break_it", WRONG.values(), ids=WRONG)
def test_a_wrong_bit_in_the_netlist_is_found(break_it: Break, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    break_netlist(break_it, monkeypatch)
    evidence = run(little("parallel", folder), "ulx3s_25f", folder, samples=80)
    report = summarise(evidence)
    assert not report["passed"]
    assert not report["bit_exact"]
    assert report["mismatches"] > 0


@pytest.mark.slow
def test_a_flip_flop_without_its_reset_is_found(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def without_reset(text: str) -> str:
        broken, count = re.subn(r"(\.LSR\()[^)]*(\),\s*\.Q\(\\section0\.v1 )", r"\g<1>1'h0\g<2>", text)
        assert count
        return broken

    break_netlist(without_reset, monkeypatch)
    message = "little in icarus: the first results after a reset must not depend on what came before it"
    with pytest.raises(ShortfallError, match=f"^{message}$"):
        run(little("parallel", folder, "zero"), "ulx3s_25f", folder, samples=80)


@pytest.mark.slow
def test_a_use_of_a_cell_that_its_model_has_not_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    break_netlist(
        lambda text: text.replace("\n  MULT18X18D ", '\n  MULT18X18D #(\n    .REG_PIPELINE_CLK("CLK0")\n  ) ', 1),
        monkeypatch,
    )
    with pytest.raises(ToolError, match="MULT18X18D must have no other register and no bypass, unlike little"):
        run(little("parallel", folder), "ulx3s_25f", folder, samples=80)


def test_a_cell_without_a_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "netlist.v"
    netlist = Netlist(find_board("ulx3s_25f"), path, {"LUT4": 1, "ALU54B": 1}, "0")
    message = "every cell of ECP5 LFE5U-25F in a netlist must have a model, which ALU54B has not"
    with pytest.raises(ToolError, match=f"^{message}$"):
        with_cell_models(netlist, scrambled=True)
    path.write_text("module little;\n  LUT4 #(\n    .INIT(16'h1234),\n    .SPEED(2'h1)\n  ) lut4 ();\nendmodule\n")
    message = "the model of LUT4 must know what a netlist sets of the cell, as SPEED"
    with pytest.raises(ToolError, match=f"^{message}$"):
        with_cell_models(replace(netlist, cells={"LUT4": 1}), scrambled=True)
