"""The folded and serial architectures in simulation, sample for sample the integer model."""

from dataclasses import replace
from pathlib import Path

import pytest
from tests.gen.architectures.one_filter import design_in

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.fpga.boards import find_board
from sosmith.hdl.plan.folded_clocks import reset_cycles
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.sim.simulation import simulate

FOLDABLE = ("df1", "df1_ef1", "df1_ef2", "df2t", "delta", "state_space")
FAST = {
    ("audio_lowpass", "folded", "df1_ef2", "verilator"),
    ("flange_wear_bench", "folded", "state_space", "icarus"),
    ("flange_wear_bench", "serial", "delta", "icarus"),
}
CASES = [
    pytest.param(*case, marks=[] if case in FAST else [pytest.mark.slow])
    for example in ("audio_lowpass", "flange_wear_bench", "flange_wear_locomotive")
    for architecture in ("folded", "serial")
    for realization in FOLDABLE
    for simulator in ("verilator", "icarus")
    for case in [(example, architecture, realization, simulator)]
    if simulator == "verilator" or case in FAST
]


def made_in(example: str, architecture: str, realization: str, board: str | None = None) -> CoreDesign:
    base = design_in(architecture, f"{example}.toml").spec
    wanted = replace(base, hardware=replace(base.hardware, realization=realization))
    return design_core(wanted, board=None if board is None else find_board(board))


@pytest.mark.slow
@pytest.mark.parametrize(("example", "architecture", "realization", "simulator"), CASES)
def test_hardware_equals_the_integer_model(
    example: str, architecture: str, realization: str, simulator: str, tmp_path: Path
) -> None:
    check(made_in(example, architecture, realization), simulator, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("example", ["audio_lowpass", "flange_wear_bench", "flange_wear_locomotive"])
def test_digits_of_17_bits(example: str, tmp_path: Path) -> None:
    made = made_in(example, "folded", "df1_ef2", board="ulx3s_25f")
    assert made.architecture.program is not None
    assert made.architecture.program.digit_bits == 17
    check(made, "verilator", tmp_path)


def check(made: CoreDesign, simulator: str, tmp_path: Path) -> None:
    """Hold the core against the integer model, with random handshakes."""
    (trace,) = traces_for(made, "worst_case", seed=5)
    start = max(0, len(trace.codes) // 2 - 30)  # where the sign pattern turns over
    trace = replace(trace, codes=trace.codes[start : start + 60], truth=None, reading=None)
    evidence = simulate(made, [trace], tmp_path, seed=5, simulator=simulator)
    assert evidence.run.mismatches == 0
    assert evidence.run.samples == 60


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "serial"])
def test_samples_come_at_the_rate_that_is_stated(architecture: str, tmp_path: Path) -> None:
    made = design_in(architecture)
    (trace,) = traces_for(made, "noise", seed=1)
    trace = replace(trace, codes=trace.codes[:40], truth=None, reading=None)
    evidence = simulate(made, [trace], tmp_path, seed=1, idle=0.0, stall=0.0)
    program = made.architecture.program
    assert program is not None
    # The memory is cleared first, a word a clock. Without a product of two values serial takes just what is stated.
    stated = made.architecture
    after_the_last = stated.latency_cycles - stated.cycles_per_sample
    cleared = reset_cycles(program, 1)
    assert evidence.run.cycles == cleared + 1 + stated.cycles_per_sample * evidence.run.samples + after_the_last
