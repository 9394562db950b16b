"""`sosmith board`: the port's path comes first, a host works with it, and an interruption ends it."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.commands.command_line import FILTER
from tests.commands.invocation import Invocation

import sosmith
from sosmith.gen.output.board_top import schedule_of
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.sim.converters.values import fed_codes

BOARD = Invocation("board")
CONVERTED = FILTER + "[converter.x]\ndevice = 'mcp3202'\nrange = [-1.0, 1.0]\n"
SMALL = FILTER + '[hardware]\nrealization = "df1_ef1"\narchitecture = "parallel"\n'


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        pytest.param(["--model", "--fault", "1000", "--seed", "4"], id="damaged model"),
        pytest.param([], id="netlist", marks=pytest.mark.slow),
        pytest.param(["--fault", "1000"], id="damaged netlist", marks=pytest.mark.slow),
    ],
)
def test_a_board_serves_a_host_until_it_is_interrupted(options: list[str], tmp_path: Path) -> None:
    (tmp_path / "spec.toml").write_text(SMALL, encoding="utf-8")
    design = sosmith.design(tmp_path / "spec.toml")
    codes = np.random.default_rng(1).integers(-500, 500, (2000, 1))
    # A shell makes what it runs in the background ignore SIGINT, this test included.
    command = [
        "env",
        "--default-signal=INT",
        sys.executable,
        "-m",
        "sosmith.cli",
        "board",
        "spec.toml",
        "--virtual",
        *options,
    ]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        path = process.stdout.readline().strip()
        try:
            for _ in range(2):  # a host may leave, and another one come
                with sosmith.Board(path) as board:
                    assert np.array_equal(board.run_codes(codes).codes, design.core.datapath.compute(codes))
                    found = board.faults["damaged"] + board.faults["gaps"]  # on a busy machine, time-outs are no fault
                    assert found == 0 or "--fault" in options
        finally:
            process.send_signal(signal.SIGINT)
        out, err = process.communicate()
    assert (process.returncode, out) == (130, "")
    assert f"{path}; Ctrl-C ends it" in err
    assert err.endswith("sosmith: interrupted\n")


def test_what_is_refused() -> None:
    BOARD.refused("--virtual must be given: a real board is made by `sosmith build`", "spec.toml")
    result = BOARD.run("spec.toml", "--virtual", "--speed", "0")
    assert result.exit_code == 2
    assert "'0' is neither max nor a factor of real time, such as 1" in result.stderr


def test_converters_and_traces_go_together(tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(FILTER, encoding="utf-8")
    expected = "--trace must come with [converter.NAME] tables in SPEC, or be given to `monitor`"
    BOARD.refused(expected, str(spec), "--virtual", "--trace", "sweep")
    spec.write_text(CONVERTED, encoding="utf-8")
    BOARD.refused("--model must be left out for a board with converters", str(spec), "--virtual", "--model")


@pytest.mark.slow
def test_a_board_measures_a_trace_by_itself(tmp_path: Path) -> None:
    (tmp_path / "spec.toml").write_text(CONVERTED, encoding="utf-8")
    command = ["env", "--default-signal=INT", sys.executable, "-m", "sosmith.cli", "board", "spec.toml", "--virtual"]
    command += ["--trace", "sweep", "--clock", "4e6", "--speed", "0.05"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        path = process.stdout.readline().strip()
        try:
            monitor = [*command[:5], "monitor", path, "-o", "record.csv"]
            with subprocess.Popen(monitor, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as watching:
                deadline = time.monotonic() + 120
                while time.monotonic() < deadline and len(record(tmp_path)) < 60:
                    time.sleep(0.2)
                watching.send_signal(signal.SIGINT)
        finally:
            process.send_signal(signal.SIGINT)
    design = sosmith.design(tmp_path / "spec.toml")
    (trace,) = traces_for(design.core, "sweep", seed=1)
    fed = fed_codes(schedule_of(design.core, Fraction(4_000_000)), trace.codes[:, np.newaxis])[:, 0]
    codes = design.core.datapath.compute(fed[:60])
    assert record(tmp_path)[:60] == codes.tolist()


def record(folder: Path) -> list[int]:
    """Read the codes that a monitor has recorded so far."""
    file = folder / "record.csv"
    rows = file.read_text().splitlines()[1:] if file.exists() else []
    return [int(row.split(",")[5]) for row in rows if row.count(",") == 7]


def test_kinds_of_damage_that_do_not_exist(tmp_path: Path) -> None:
    (tmp_path / "spec.toml").write_text(FILTER, encoding="utf-8")
    expected = "a fault must be one of flip, drop, insert, not lose"
    BOARD.refused(expected, str(tmp_path / "spec.toml"), "--virtual", "--fault", "9", "--fault-kinds", "lose")


def test_what_plays_nothing_is_refused(tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(CONVERTED, encoding="utf-8")
    heard = str(tmp_path / "heard.wav")
    BOARD.refused("--heard must come with a table [converter.output] in SPEC", str(spec), "--virtual", "--heard", heard)
    BOARD.refused(
        "--clock must be left out with --board, which has its own",
        *(str(spec), "--virtual", "--board", "ulx3s-25f", "--clock", "1e6"),
    )
