"""A full disk: every command that writes ends with exit status 3, one sentence, and every file as it was before."""

import errno
import os
import sqlite3
import sys
from pathlib import Path
from typing import Any

import pytest

from sosmith.cli import main
from sosmith.model.text_files import to_json
from tests.commands.command_line import FILTER, reloadable
from tests.gen.report.reports import report
from tests.instrument.calibration.measuring import readings, write_csv

ROOT = Path(__file__).parents[2]
MESSAGE = os.strerror(errno.ENOSPC)


class Disk:
    """The disk of one folder; it can be full for all files, or for those of one name."""

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.full = False
        self.full_for: str | None = None
        for name in ("write_bytes", "write_text"):
            self._limit(name, patch)
        real = Path.open

        def opened(path: Path, mode: str = "r", *arguments: Any, **options: Any) -> Any:
            if "w" in mode and self._is_full(path):
                raise OSError(errno.ENOSPC, MESSAGE, str(path))
            return real(path, mode, *arguments, **options)

        patch.setattr(Path, "open", opened)

    def _is_full(self, path: Path) -> bool:
        return (self.full or path.name == self.full_for) and path.absolute().is_relative_to(self.folder)

    def _limit(self, name: str, patch: pytest.MonkeyPatch) -> None:
        """Let a method of `Path` write only half of its data while the disk is full."""
        real = getattr(Path, name)

        def limited(path: Path, data: Any, *arguments: Any, **options: Any) -> int:
            if not self._is_full(path):
                return int(real(path, data, *arguments, **options))
            with patch.context() as half:
                half.setattr(self, "full", False)
                half.setattr(self, "full_for", None)
                real(path, data[: len(data) // 2], *arguments, **options)
            raise OSError(errno.ENOSPC, MESSAGE, str(path))

        patch.setattr(Path, name, limited)

    def files(self) -> dict[str, bytes]:
        """Return all files with their contents."""
        return {str(path): path.read_bytes() for path in self.folder.rglob("*") if path.is_file()}


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Disk:
    """Start in a folder with the inputs of all commands."""
    monkeypatch.chdir(tmp_path)
    Path("plain.toml").write_text(FILTER, encoding="utf-8")
    Path("core.toml").write_text(reloadable("100.0"), encoding="utf-8")
    Path("next.toml").write_text(reloadable("105.0").replace('"faithful"', "0.0006"), encoding="utf-8")
    Path("report.json").write_text(to_json(report()), encoding="utf-8")
    write_csv(Path("a.csv"), readings(400))
    write_csv(Path("b.csv"), readings(400, seed=2))
    Path("examples").symlink_to(ROOT / "examples")
    return Disk(tmp_path, monkeypatch)


def status(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Carry out a command; return its exit status."""
    monkeypatch.setattr(sys, "argv", ["sosmith", *arguments])
    with pytest.raises(SystemExit) as exit_of:
        main()
    return int(exit_of.value.code or 0)


COMMANDS = {
    "init": "init out.toml",
    "generate": "generate plain.toml -o out",
    "reload": "reload core.toml next.toml -o out.json",
    "simulate": "simulate plain.toml --simulator icarus -o out",
    "emulate": "emulate plain.toml noise -o out.csv",
    "compare": "compare report.json report.json -o out.html",
    "calibrate export": "calibrate export --store examples.db -o out.toml",
    "calibrate plot": "calibrate plot --store examples.db -o out.svg",
    "spectrum": "spectrum ramp.csv -o out.toml",
    "vehicle": "vehicle --model linear -o out.csv",
    "vehicle plot": "vehicle --model linear --plot out.svg",
    "vehicle parameters": "vehicle --write-parameters out.toml",
    "wear": "wear examples/wear/wheel.csv --initial 1.5 --warning 7 --limit 9 --plot out.svg",
    "paper": "paper -o out.md",
    "demo": "demo -o out",
}
"""The last word of each is the folder or the file that it writes; such a file is there before."""


@pytest.mark.sweep(3)
@pytest.mark.parametrize("line", COMMANDS.values(), ids=list(COMMANDS))
def test_a_command_on_a_full_disk(
    line: str, disk: Disk, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if "examples.db" in line:
        assert status(monkeypatch, "calibrate", "add", "a.csv", "--store", "examples.db") == 0
    if "ramp.csv" in line:
        example = "examples/flange_wear_locomotive.toml"
        way = ("emulate", example, "wear_ramp", "--core", "calibration", "--seconds", "300", "-o", "ramp.csv")
        assert status(monkeypatch, *way) == 0
    output = line.rsplit(maxsplit=1)[-1]
    if "." in output and not line.startswith("init"):
        Path(output).write_text("what was there before")
    before = disk.files()
    disk.full = True
    capsys.readouterr()
    assert status(monkeypatch, *line.split()) == 3
    folder = output if "." not in output else "."
    messages = [line for line in capsys.readouterr().err.splitlines() if line.startswith("sosmith: ")]
    assert messages == [f"sosmith: error: {folder}: the disk must take the output files, not: {MESSAGE}"]
    assert disk.files() == before


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ["sent.npy", "report.json"])
def test_a_disk_that_becomes_full_during_a_simulation(
    name: str, disk: Disk, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sosmith.cli.silence_stdout", lambda: None)  # it would take the tests' own stdout
    disk.full_for = name
    assert status(monkeypatch, "simulate", "plain.toml", "--simulator", "icarus", "--seconds", "0.1", "-o", "out") == 3
    assert capsys.readouterr().err.endswith(f"not: {MESSAGE}\n")
    assert not Path("out/report.json").exists()
    assert not Path("out/report.html").exists()


def let_stores_grow(monkeypatch: pytest.MonkeyPatch, pages: int) -> None:
    """Let a new store have that many pages at most, and an existing one no more than it has."""
    real = sqlite3.connect

    def connect(*arguments: Any, **options: Any) -> sqlite3.Connection:
        connection = real(*arguments, **options)
        connection.execute(f"PRAGMA max_page_count = {pages}")
        return connection

    monkeypatch.setattr(sqlite3, "connect", connect)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("pages", [1, 5, 20])
def test_a_new_store_on_a_full_disk_is_no_store(
    pages: int, disk: Disk, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = disk.files()
    with monkeypatch.context() as patch:
        let_stores_grow(patch, pages)
        assert status(monkeypatch, "calibrate", "add", "a.csv", "--store", "s.db") == 3
    message = "sosmith: error: s.db: the store must be readable and writable, not: database or disk is full"
    assert capsys.readouterr().err.splitlines()[-1] == message
    assert disk.files() == before
    assert status(monkeypatch, "calibrate", "add", "a.csv", "--store", "s.db") == 0


def test_a_store_on_a_full_disk_stays_as_it_is(
    disk: Disk, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status(monkeypatch, "calibrate", "add", "a.csv", "--store", "s.db") == 0
    before = disk.files()
    let_stores_grow(monkeypatch, 1)
    assert status(monkeypatch, "calibrate", "add", "b.csv", "--store", "s.db") == 3
    message = "sosmith: error: s.db: the store must be readable and writable, not: database or disk is full"
    assert capsys.readouterr().err.splitlines()[-1] == message
    assert disk.files() == before
