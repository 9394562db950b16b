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
    STOPPING,
    Command,
    Outcome,
    Start,
    processes_with,
)

from sosmith.cli import main


@pytest.fixture
def sosmith(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Command]:
    """Run commands in this process, in an empty folder with the specifications plain.toml and demo.toml."""
    monkeypatch.chdir(tmp_path)
    Path("plain.toml").write_text(FILTER, encoding="utf-8")
    Path("demo.toml").write_text(INSTRUMENT, encoding="utf-8")
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}

    def run(*arguments: str) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["cli.py", *arguments])
        capsys.readouterr()
        with pytest.raises(SystemExit) as exit_of:
            main()
        printed = capsys.readouterr()
        return Outcome(int(exit_of.value.code or 0), printed.out, printed.err)

    yield run
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.fixture
def process(tmp_path: Path) -> Iterator[Start]:
    """Start commands as processes of their own, in the test's folder; nothing they start outlives the test.

    They take signals as they do by default, even where the tests themselves ignore some: under nohup, or in a shell's
    background.
    """
    mark = {"SOSMITH_TEST": str(tmp_path)}
    with contextlib.ExitStack() as started:

        def start(*arguments: str, **options: Any) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "sosmith.cli", *arguments]
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
            # A signal ignored here would be ignored by the child too; one with a handler is at its default there.
            before = {number: signal.signal(number, signal.default_int_handler) for number in STOPPING}
            try:
                return started.enter_context(
                    subprocess.Popen(command, cwd=tmp_path, text=True, env=os.environ | mark, **pipes)
                )
            finally:
                for number, handler in before.items():
                    signal.signal(number, handler)

        yield start
        while left := processes_with("SOSMITH_TEST", tmp_path):
            for number in left:
                with contextlib.suppress(ProcessLookupError):  # it has ended meanwhile
                    os.kill(number, signal.SIGKILL)
            time.sleep(0.02)
