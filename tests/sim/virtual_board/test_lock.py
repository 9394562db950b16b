"""The lock of the reload port on a board: `sosmith reload --lock` closes it, and no later session opens it."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.commands.invocation import Invocation
from tests.interface.small import FILTER

import sosmith
from sosmith.host.board import Board
from sosmith.sim.virtual_board.netlist import build
from sosmith.sim.virtual_board.terminal import Terminal

HARDWARE = {"realization": "df1_ef1", "architecture": "folded", "reload": True, "reload_lock": True}
RELOAD = Invocation("reload")


@pytest.mark.slow
def test_a_locked_board_keeps_its_set_from_session_to_session(tmp_path: Path) -> None:
    running = FILTER | {"hardware": HARDWARE}
    second, third = (running | {"filter": FILTER["filter"] | {"cutoff": cutoff}} for cutoff in (90.0, 80.0))
    for name, tree in (("first", running), ("second", second), ("third", third)):
        (tmp_path / f"{name}.toml").write_text(sosmith.Specification.load(tree).toml())
    spec, *others = (str(tmp_path / f"{name}.toml") for name in ("first", "second", "third"))
    made = sosmith.design(running)
    codes = np.random.default_rng(1).integers(-512, 512, (300, 1))
    with Terminal() as terminal, build(made.core, tmp_path, clock=Fraction(4_000_000), baud=1_000_000).at(terminal.end):
        port = terminal.path
        given = ("--port", port, "--baud", "1000000", "-o", str(tmp_path / "set.json"))
        locked = RELOAD.good(spec, others[0], *given, "--lock").stderr
        assert f"locked on {port}: no set can be loaded until a reset" in locked
        expected = "the board must be reset before a set can be loaded, for it is locked"
        RELOAD.refused(expected, spec, others[1], *given, kind=sosmith.RefusedError)
        with Board(port) as board:
            results = board.run_codes(codes)
    assert np.array_equal(results.codes, sosmith.design(second).core.datapath.compute(codes))
