"""Compilers that run side by side end with what started them, with all that they started."""

import os
import subprocess
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest
from tests.commands.command_line import processes_with, wait_for

from sosmith.sim.compilers import Compilers

HANGS = ("sh", "-c", 'touch "$TMPDIR/$$"; sleep 60 & sleep 60')


def test_an_interrupt_ends_all_of_them(tmp_path: Path) -> None:
    compilers = Compilers(os.environ, None, alone=True)

    def started() -> bool:
        return len(list(tmp_path.iterdir())) == 2 and len(processes_with("TMPDIR", tmp_path)) >= 4

    futures: list[Future[None]] = []

    def interrupted() -> None:
        with ThreadPoolExecutor(2) as pool, compilers.ended_at_once():
            futures.extend(pool.submit(compilers.run, HANGS, tmp_path) for _ in range(2))
            wait_for(started)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    for future in futures:
        assert isinstance(future.exception(), subprocess.CalledProcessError)
    wait_for(lambda: not processes_with("TMPDIR", tmp_path))
    with pytest.raises(subprocess.CalledProcessError):  # a thread that comes late starts none
        compilers.run(HANGS, tmp_path)


@pytest.mark.parametrize("alone", [True, False])
def test_one_that_fails_is_told(alone: bool, tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    with log.open("w", encoding="utf-8") as output:
        compilers = Compilers(os.environ, output, alone=alone)
        compilers.run((sys.executable, "-c", "print('good')"), tmp_path)
        with pytest.raises(subprocess.CalledProcessError, match="exit status 3"):
            compilers.run((sys.executable, "-c", "raise SystemExit(3)"), tmp_path)
    assert log.read_text(encoding="utf-8") == "good\n"
