"""What the tests of the command line share: specifications, outcomes, processes."""

import re
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.gen.specification.bad_specifications import BASE

FILTER = """\
name = "plain"
sample_rate = 1000.0

[input.x]
bits = 12
signed = true
range = [-1.0, 1.0]

[filter]
family = "butterworth"
kind = "lowpass"
order = 2
cutoff = 100.0

[output]
bits = 12
signed = true
range = [-1.0, 1.0]
max_error = "faithful"
"""

QUICK = f'{FILTER}\n[hardware]\nrealization = "df1"\narchitecture = "parallel"\n'
"""The same without a search: for tests of what stands around a design."""

INSTRUMENT = BASE.replace("order = 7", "order = 1").replace(
    "[[1.16, -0.0036], [0.3672]]", "[[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]"
)

HANGS = 1200
"""Seconds after which a process is taken to hang, on however busy a machine."""

PROGRESS = re.compile(r"^\[\d+:\d\d\] ")
"""The elapsed time, with which every line of progress begins where no terminal is."""


@dataclass(frozen=True)
class Outcome:
    """What a command left behind."""

    status: int
    stdout: str
    stderr: str

    @property
    def messages(self) -> list[str]:
        """Lines of stderr that are not progress."""
        return [line for line in self.stderr.splitlines() if line.strip() and not PROGRESS.search(line)]


Command = Callable[..., Outcome]
Start = Callable[..., subprocess.Popen[str]]


def processes_with(variable: str, folder: Path) -> list[int]:
    """List the processes with `folder` in that variable of their environment; dead ones have none and do not count."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            environment = (entry / "environ").read_bytes()
        except OSError:  # it has ended, or belongs to someone else
            continue
        if f"{variable}={folder}".encode() in environment.split(b"\0"):
            found.append(int(entry.name))
    return found


def wait_for(condition: Callable[[], Any], seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def refused(outcome: Outcome, message: str, status: int = 2) -> None:
    """Check for one sentence for each fault on stderr and nothing else: no data, no traceback, no output folder."""
    assert outcome.messages == f"sosmith: error: {message}".split("\n")
    assert (outcome.status, outcome.stdout) == (status, "")
    assert not Path("out").exists()
    assert not Path("build").exists()


def reloadable(cutoff: str) -> str:
    """Return the filter in hardware that can be reloaded, with another cutoff."""
    hardware = '[hardware]\nrealization = "df1_ef2"\narchitecture = "folded"\nreload = true\n'
    return FILTER.replace("cutoff = 100.0", f"cutoff = {cutoff}") + hardware
