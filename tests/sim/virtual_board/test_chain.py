"""The board of a chain in Verilator: a result for each sample, and coefficients of a stage that are loaded."""

import copy
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.chain.chains import GUARDED
from tests.gen.chain.rising import UP
from tests.sim.virtual_board.running import running

import sosmith
from sosmith.gen.chain.board import chain_item
from sosmith.host.board import Board
from sosmith.host.identity_check import check_files, folder_of
from sosmith.model.errors import ShortfallError
from sosmith.sim.virtual_board.line_damage import LineDamage
from sosmith.sim.virtual_board.netlist import build
from sosmith.sim.virtual_board.terminal import Terminal


def tree() -> dict[str, Any]:
    table = copy.deepcopy(GUARDED) | {"channels": 1}
    table["output"] = table["output"] | {"max_error": 0.01}
    return table


@pytest.mark.slow
def test_a_board_with_a_chain_gives_a_result_for_each_sample_and_takes_coefficients(tmp_path: Path) -> None:
    chain = sosmith.design_chain(tree())
    other = tree()
    other["stage"][2]["taps"] = [-0.25, 0.5, -0.25]
    chain.generate(tmp_path / "files")
    codes = np.random.default_rng(1).integers(-128, 128, (1000, 1))
    netlist = build(chain_item(chain.core), tmp_path, clock=Fraction(4_000_000), baud=1_000_000)
    proven = chain.reload(other, reset=True)
    with Terminal() as terminal, netlist.at(terminal.end):
        with Board(terminal.path) as board:
            assert check_files(board.identity, tmp_path / "files")["core"] == "chain"
            assert folder_of(board.identity, tmp_path) == tmp_path / "files"
            before = board.run_codes(codes)
            assert set(board.counters().values()) == {0}
            board.load(proven.writes)
        with Board(terminal.path) as board:
            after = board.run_codes(codes)
            sosmith.design_chain(other | {"sample_rate": 16000.0}).generate(tmp_path / "others")
            with pytest.raises(ShortfallError, match=r"^the board's design must be "):
                check_files(board.identity, tmp_path / "others")
    results, status = chain.core.compute_with_status(codes[:, None, :])
    assert np.array_equal(before.codes, np.repeat(results[:, 0], chain.factor))
    assert np.array_equal(before.status, np.repeat(status[:, 0], chain.factor))
    exact = sosmith.design_chain(other).run_exact(x=codes[:, 0] / 128)
    error = np.abs(after.codes[:: chain.factor] * float(chain.core.stages[-1].output.lsb) - exact).max()
    assert error <= proven.bound < np.abs(after.codes - before.codes).max() * float(chain.core.stages[-1].output.lsb)


@pytest.mark.slow
def test_a_board_keeps_the_results_of_each_channel(tmp_path: Path) -> None:
    chain = sosmith.design_chain(GUARDED)
    codes = np.random.default_rng(1).integers(-128, 128, (400, 2, 1))
    netlist = build(chain_item(chain.core), tmp_path, clock=Fraction(4_000_000), baud=1_000_000)
    with Terminal() as terminal, netlist.at(terminal.end), Board(terminal.path) as board:
        got = board.run_codes(codes)
        assert set(board.counters().values()) == {0}
    results, status = chain.core.compute_with_status(codes)
    assert np.array_equal(got.codes, np.repeat(results, chain.factor, axis=0))
    assert np.array_equal(got.status, np.repeat(status, chain.factor, axis=0))


@pytest.mark.slow
@pytest.mark.parametrize(
    "decimate", [{"taps": [0.25, 0.5, 0.25]}, {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 100.0}]
)
def test_a_board_keeps_the_results_of_each_channel_of_a_core(decimate: dict[str, Any], tmp_path: Path) -> None:
    plain = {key: GUARDED[key] for key in ("name", "sample_rate", "input", "output")}
    core = sosmith.design(plain | {"channels": 3, "filter": decimate | {"decimate": 4}}).core
    codes = np.random.default_rng(1).integers(-128, 128, (203, 3, 1))
    netlist = build(core, tmp_path, clock=Fraction(4_000_000), baud=1_000_000)
    with Terminal() as terminal, netlist.at(terminal.end), Board(terminal.path) as board:
        got = board.run_codes(codes)
        assert set(board.counters().values()) == {0}
    results, status = core.datapath.compute_with_status(codes)
    assert np.array_equal(got.codes, results[np.arange(203) // 4])
    assert np.array_equal(got.status, status[np.arange(203) // 4])


RISING = {"name": "fill", "kind": "fir", "interpolate": 3, "taps": [0.2, 0.5, 0.9, 1.0, 0.7, 0.3, 0.1]}
HALF = {"name": "half", "kind": "cic", "order": 2, "decimate": 2}
FOUR = {"name": "four", "kind": "cic", "order": 1, "interpolate": 4}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stages", "channels", "damaged"),
    [([RISING], 1, True), ([RISING], 3, False), ([FOUR, HALF], 3, False), ([HALF, FOUR], 1, False)],
)
def test_a_board_has_all_results_of_a_sample(
    stages: list[dict[str, Any]], channels: int, damaged: bool, tmp_path: Path
) -> None:
    """In each session from reset, whatever the line does."""
    chain = sosmith.design_chain(UP | {"stage": stages, "channels": channels})
    codes = np.random.default_rng(1).integers(-128, 128, (200, channels, 1))
    netlist = build(chain_item(chain.core), tmp_path, clock=Fraction(4_000_000), baud=1_000_000)
    shape = (-1,) if channels == 1 else (-1, channels)
    results, status = (column.reshape(shape) for column in chain.core.compute_with_status(codes))
    with running(netlist, LineDamage(500, 1) if damaged else None) as port:
        for count in (78, 150):
            with Board(port) as board:
                parts = [board.run_codes(codes[:count]), board.run_codes(codes[count:])]
                mended = sum(board.faults.values())
            assert (mended > 0) is damaged
            assert np.array_equal(np.concatenate([part.codes for part in parts]), results)
            assert np.array_equal(np.concatenate([part.status for part in parts]), status)
