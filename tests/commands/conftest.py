"""Fixtures of the command line: commands in this process, and as processes of their own."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.commands.command_line import (
    FILTER,
    INSTRUMENT,
    Command,
    Outcome,
    Start,
    processes_with,
)

from sosmith.cli import main


@pytest.fixture
def sosmith(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Run commands in this process, in an empty folder with the specifications plain.toml and demo.toml."""
    monkeypatch.chdir(tmp_path)
    Path("plain.toml").write_text(FILTER, encoding="utf-8")
    Path("demo.toml").write_text(INSTRUMENT, encoding="utf-8")

    def run(*arguments: str) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["cli.py", *arguments])
        capsys.readouterr()
        with pytest.raises(SystemExit) as exit_of:
            main()
        printed = capsys.readouterr()
        return Outcome(int(exit_of.value.code or 0), printed.out, printed.err)

    return run


@pytest.fixture
def process(tmp_path: Path) -> Iterator[Start]:
    """Start commands as processes of their own, in the test's folder; nothing they start outlives the test."""
    mark = {"SOSMITH_TEST": str(tmp_path)}
    with contextlib.ExitStack() as started:

        def start(*arguments: str, **options: Any) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "sosmith.cli", *arguments]
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
            return started.enter_context(
                subprocess.Popen(command, cwd=tmp_path, text=True, env=os.environ | mark, **pipes)
            )

        yield start
        while left := processes_with("SOSMITH_TEST", tmp_path):
            for number in left:
                with contextlib.suppress(ProcessLookupError):  # it has ended meanwhile
                    os.kill(number, signal.SIGKILL)
            time.sleep(0.02)
