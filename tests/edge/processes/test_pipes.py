"""A pipe without a writer, or a device without an end, where a file is read: told at once, by every command."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import click
import pytest

import sosmith
from sosmith.cli import main
from sosmith.model.errors import SpecificationError
from sosmith.verify.graph import RejectedError
from tests.commands.command_line import QUICK
from tests.edge.processes.every_command import paths_read
from tests.gen.specification.bad_specifications import BASE, COEF

SECONDS = 60
"""An end within this time, on however busy a machine."""

PIPE = "a pipe, where a regular file is needed"

NEEDED = {"board": "icebreaker", "clearances": "2mm", "sample_rate": "1000", "reason": "worn", "author": "A"}
"""What commands need besides files."""


@contextmanager
def an_end() -> Iterator[None]:
    """Stop what waits for ever."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise AssertionError("waits without an end")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def line(name: str, command: click.Command, parameter: click.Parameter, path: str) -> list[str]:
    """Return a command's line with `path` for one parameter, and any word for the others that it needs."""
    words = name.split()
    for one in command.params:
        if one is parameter and isinstance(one, click.Option):
            words += [one.opts[-1], path]
        elif isinstance(one, click.Argument) and (one.required or one is parameter):
            words.append(path if one is parameter else NEEDED.get(one.name or "", "plain.toml"))
        elif one.required:
            words += [one.opts[-1], NEEDED[one.name or ""]]
    return words


CASES = [pytest.param(*case, id=f"{case[0]} {case[2].name}") for case in paths_read()]


def test_all_commands_that_read_are_among_them() -> None:
    names = {name for name, _, _ in paths_read()}
    assert {"design", "verify", "stream", "monitor", "compare", "calibrate add", "wear", "studio"} < names
    assert len(names) > 20


@pytest.mark.parametrize(("name", "command", "parameter"), CASES)
@pytest.mark.parametrize("kind", ["a pipe", "a device"])
def test_what_may_never_end_is_told(
    name: str,
    command: click.Command,
    parameter: click.Parameter,
    kind: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.toml").write_text(QUICK, encoding="utf-8")
    path = Path("given.csv")
    if kind == "a pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    monkeypatch.setattr(sys, "argv", ["sosmith", *line(name, command, parameter, str(path))])
    with an_end(), pytest.raises(SystemExit) as end:
        main()
    told = capsys.readouterr().err
    assert (end.value.code, told) == (2, f"sosmith: error: {path}: the input must be a regular file, not {kind}\n")


def test_files_that_a_specification_names(tmp_path: Path) -> None:
    path = tmp_path / "given.csv"
    os.mkfifo(path)
    sections = QUICK.replace('family = "butterworth"\nkind = "lowpass"\norder = 2\ncutoff = 100.0\n', "{}")
    for text, sentence in (
        (sections.format('sos_file = "given.csv"\n'), f"{path}: the filter must be a readable file, not: {PIPE}"),
        (BASE.replace(COEF, 'data = "given.csv"'), f"{path} must be a readable CSV file ({PIPE})"),
    ):
        (tmp_path / "plain.toml").write_text(text, encoding="utf-8")
        with an_end(), pytest.raises(SpecificationError) as caught:
            sosmith.design(tmp_path / "plain.toml")
        assert str(caught.value) == sentence


def test_files_beside_a_certificate(tmp_path: Path) -> None:
    design = sosmith.design(sosmith.Specification.from_toml(QUICK))
    design.generate(tmp_path)
    certificate = sosmith.Certificate.load(tmp_path / "plain.certificate.json")
    core = tmp_path / "plain.sv"
    core.unlink()
    os.mkfifo(core)
    with an_end(), pytest.raises(RejectedError) as caught:
        certificate.verify(files=tmp_path)
    assert str(caught.value) == f"{core} must be a file that can be read, not: it is no regular file"
