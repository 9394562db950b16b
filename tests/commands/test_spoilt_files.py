"""No file, however spoilt, brings a command down: it ends with a documented status, and a refusal in a sentence."""

from __future__ import annotations

import io
import json
import math
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import openpyxl
import pytest
import scipy.io
from tests.commands.command_line import FILTER, INSTRUMENT
from tests.commands.spoilt_files import Spoil, spoilt, spoilt_store, spoilt_workbook
from tests.gen.report.reports import report
from tests.house import ROOT
from tests.instrument.scenarios.scenario_texts import CALIBRATION, FAULT, PLAIN

from sosmith.cli import main
from sosmith.instrument.vehicle.parameters import built_in_text
from sosmith.model.errors import ShortfallError
from sosmith.sim import simulation

DEMO = f'{INSTRUMENT}realization = "df1"\n'
FITTED = re.sub(r"coefficients = .*", 'data = "measured.csv"', DEMO)
WORN = f"{DEMO}\n[wear]\ninitial = 1.5\nwarning = 7.0\nlimit = 9.0\nsensor_range = 10.5\n"
SECTIONS = [[0.25, 0.5, 0.25, 1.0, -0.9, 0.5], [0.5, 0.5, 0.0, 1.0, -0.2, 0.0]]
DF1 = f"{FILTER}\n[hardware]\nrealization = 'df1'\n"
RELOADED = f"{FILTER}\n[hardware]\nrealization = 'df1'\nreload = true\n"


@dataclass(frozen=True)
class Subject:
    """A file to spoil, and the commands that read it.

    Attributes
    ----------
    file : str
        Its name in the folder of valid files.
    commands : tuple of str
        Commands with their arguments, apart from the ways to spoil it.
    share : int
        Of how many spoilt files of it the fast test tries every third.
    spoil : Spoil
        How to spoil it.
    """

    file: str
    commands: tuple[str, ...]
    share: int
    spoil: Spoil = spoilt


SUBJECTS = (
    Subject("plain.toml", ("design plain.toml --realization df1 --json",), 30),
    Subject("plain.toml", ("design plain.toml", "generate plain.toml -o generated"), 2),
    Subject("demo.toml", ("design demo.toml", "emulate demo.toml wear_ramp --seconds 1"), 8),
    Subject("worn.toml", ("wear record.csv --spec worn.toml", "spectrum ride.csv --into worn.toml"), 5),
    Subject("other.toml", ("reload reloaded.toml other.toml -o out.json",), 6),
    Subject("measured.csv", ("design fitted.toml",), 15),
    Subject("measured.csv", ("calibrate add measured.csv --store new.db --keep-good --date 2024-03-01",), 12),
    Subject("book.xlsx", ("calibrate add book.xlsx --store new.db --keep-good",), 30, spoilt_workbook),
    Subject(
        "kept.db",
        (
            "calibrate history --store kept.db --verify",
            "calibrate export --store kept.db --format csv",
            "calibrate add book.xlsx --store kept.db --keep-good",
        ),
        20,
        spoilt_store,
    ),
    *(
        Subject(file, (f"import {file} --sample-rate 100",), 15, how)
        for file, how in (
            ("sections.csv", spoilt),
            ("sections.npy", spoilt),
            ("sections.npz", spoilt_workbook),
            ("sections.mat", spoilt),
            ("sections.json", spoilt),
            ("biquads.txt", spoilt),
            ("prototype.toml", spoilt),
        )
    ),
    *(
        Subject(f"filed.{kind}", (f"design {kind}.toml", f"verify {kind}.certificate.json --spec {kind}.toml"), 4)
        for kind in ("npy", "csv", "mat")
    ),
    Subject("trace.csv", ("spectrum trace.csv", "simulate demo.toml --trace trace.csv"), 8),
    Subject("song.wav", ("simulate plain.toml --trace song.wav --realization df1",), 5),
    Subject("ride.csv", ("spectrum ride.csv",), 5),
    Subject("record.csv", ("wear record.csv --initial 1.5 --limit 9 --warning 7",), 20),
    Subject(
        "days.toml",
        ("emulate demo.toml days.toml -o out.csv", "emulate demo.toml days.toml --measurements -o out.csv"),
        8,
    ),
    Subject("short.toml", ("vehicle short.toml --sample-rate 50",), 3),
    Subject("plain.certificate.json", ("verify plain.certificate.json", "verify plain.certificate.json --json"), 50),
    Subject(
        "report.json",
        ("compare report.json other.json -o out.html", "compare report.json --baseline other.json --json"),
        20,
    ),
    Subject("plain.json", ("verify plain.json", "compare plain.json plain.json"), 5),
)


@dataclass(frozen=True)
class Outcome:
    """What a command left behind."""

    status: int
    stdout: str
    stderr: str


def carried_out(command: str, **renamed: str) -> Outcome:
    """Run a command line in this process, on streams as strict as those of a terminal, with some files `renamed`."""
    arguments = [renamed.get(argument, argument) for argument in command.split()]
    streams = [io.TextIOWrapper(io.BytesIO(), "utf-8", errors) for errors in ("strict", "backslashreplace")]
    before = sys.argv, sys.stdout, sys.stderr
    sys.argv, sys.stdout, sys.stderr = ["sosmith", *arguments], *streams
    status: Any = 0
    try:
        main()
    except SystemExit as ended:
        status = ended.code or 0
    finally:
        sys.argv, sys.stdout, sys.stderr = before
    for stream in streams:
        stream.flush()
    out, err = (stream.buffer.getvalue().decode() for stream in streams)  # type: ignore[attr-defined]
    return Outcome(status, out, err)


def _ride() -> Iterator[str]:
    """Yield rows of a slow signal with a disturbance of 1.5 Hz."""
    for k in range(2000):
        truth = 4 + k / 8000
        yield f"{k / 100},{truth + 0.4 * math.sin(0.03 * math.pi * k):.4f},{truth}"


def write_valid_files(folder: Path) -> None:
    """Fill the current `folder` with valid files of every kind that a command reads."""
    texts = {
        "plain.toml": FILTER,
        "demo.toml": DEMO,
        "worn.toml": WORN,
        "fitted.toml": FITTED,
        "reloaded.toml": RELOADED,
        "other.toml": RELOADED.replace("cutoff = 100.0", "cutoff = 90.0"),
        "days.toml": PLAIN + FAULT + CALIBRATION,
        "short.toml": built_in_text()
        .replace("curve = { value = 300.0", "curve = { value = 20.0")
        .replace("run_out = { value = 200.0", "run_out = { value = 0.0"),
        "report.json": json.dumps(report(), indent=1),
        "other.json": json.dumps(report(name="other")),
        "sections.csv": "\n".join(",".join(map(str, row)) for row in SECTIONS),
        "sections.json": json.dumps({"sos": SECTIONS}),
        "biquads.txt": "biquad1,\nb0=0.25,\nb1=0.5,\nb2=0.25,\na1=0.2,\na2=-0.2\n",
        "prototype.toml": "poles = [[-15.0, 22.0], [-15.0, -22.0], -30.0]\ngain = 4.5\nprewarp = 3.0\n",
        "ride.csv": "\n".join(("time_s,value_mm,truth", *_ride())),
        "record.csv": "\n".join((ROOT / "examples/wear/wheel.csv").read_text(encoding="utf-8").splitlines()[:40]),
        "measured.csv": (ROOT / "examples/measurements/march.csv").read_text(encoding="utf-8"),
    }
    for kind in ("npy", "csv", "mat"):
        table = f'[filter]\nsos_file = "filed.{kind}"\n\n[output]'
        texts[f"{kind}.toml"] = re.sub(r"\[filter\].*\[output\]", table, DF1, flags=re.DOTALL).replace("plain", kind)
    np.save(folder / "sections.npy", SECTIONS)
    np.savez(folder / "sections.npz", sos=SECTIONS)
    scipy.io.savemat(folder / "sections.mat", {"SOS": SECTIONS, "G": [[0.5]]})
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    for kind in ("npy", "csv", "mat"):
        shutil.copy(folder / f"sections.{kind}", folder / f"filed.{kind}")
    book = openpyxl.Workbook()
    book.active.append(["clearance_mm", "voltage_V", "temperature_C", "date"])
    for k in range(1, 13):
        book.active.append([k / 2, 0.4 + k / 2 + k % 3 / 10, 20.5 + 7 * (k % 4), "2024-03-01"])
    book.save(folder / "book.xlsx")
    for command in (
        "emulate demo.toml wear_ramp --seconds 2 -o trace.csv",
        "emulate plain.toml noise --seconds 0.1 -o song.wav",
        "generate plain.toml --realization df1 -o .",
        "calibrate add measured.csv --store kept.db --date 2024-03-01",
        *(f"generate {kind}.toml -o ." for kind in ("npy", "csv", "mat")),
    ):
        assert carried_out(command).status == 0, command


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("valid")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        write_valid_files(folder)
    return folder


@pytest.fixture(autouse=True)
def folder(valid: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Start in a copy of the valid files, where a simulation ends as soon as its trace is read."""

    def left_out(*_: Any, **__: Any) -> None:
        raise ShortfallError("the simulation must not be left out, as it is here")

    monkeypatch.setattr(simulation, "simulate", left_out)
    shutil.copytree(valid, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


SENTENCE = re.compile(r"^(sosmith: error|Error): \S.*\S$", re.MULTILINE)


STEP = re.compile(r"^\[\d+:\d\d\] (.*)$", re.MULTILINE)


def fit_for_a_log(command: str, outcome: Outcome) -> None:
    """Where no terminal is: no bars, no blanks at an end of a line, and each step once."""
    for text in (outcome.stdout, outcome.stderr):
        assert not {"\r", "━"} & set(text), (command, text)
        assert [line for line in text.splitlines() if line != line.rstrip()] == [], command
    steps = STEP.findall(outcome.stderr)
    assert len(steps) == len(set(steps)), (command, steps)


def check(commands: Sequence[str], kept: Path) -> list[int]:
    """Carry out commands on a spoilt file; `kept` is what they may change, and is put back before each."""
    content = kept.read_bytes() if kept.is_file() else None
    statuses = []
    for command in commands:
        for made in ("new.db", "new.db-wal", "new.db-shm"):
            Path(made).unlink(missing_ok=True)
        if content is not None:
            kept.write_bytes(content)
        outcome = carried_out(command)
        assert outcome.status in {0, 1, 2}, (command, outcome)  # 3 is for tools, and none is in play
        assert outcome.status == 0 or SENTENCE.search(outcome.stderr), (command, outcome)
        assert all(c.isprintable() or c in "\n\t" for c in outcome.stderr), (command, outcome)
        fit_for_a_log(command, outcome)
        statuses.append(outcome.status)
    return statuses


def try_spoilt(subject: Subject, folder: Path, numbers: range) -> None:
    path = folder / subject.file
    content = path.read_bytes()
    for number in numbers:
        path.write_bytes(subject.spoil(content, Random(f"{subject.file} {number}")))
        try:
            check(subject.commands, path)
        except BaseException as error:
            error.add_note(f"{subject.file}, number {number}, spoilt: {path.read_bytes()[:3000]!r}")
            raise


NAMES = [f"{subject.commands[0].split()[0]}-{subject.file}" for subject in SUBJECTS]


def expected(command: str) -> int:
    """Return the exit status of a command on valid files."""
    if command in {"verify plain.json", "compare plain.json plain.json"}:
        return 2  # a manifest is neither a certificate nor a report
    # The trace needs no filter, and nothing is simulated here.
    return 1 if command.startswith(("spectrum trace.csv", "simulate")) else 0


@pytest.mark.sweep(4)
@pytest.mark.parametrize("subject", SUBJECTS, ids=NAMES)
def test_files_as_they_were(subject: Subject, folder: Path) -> None:
    assert check(subject.commands, folder / subject.file) == [expected(command) for command in subject.commands]


@pytest.mark.sweep(6)
@pytest.mark.parametrize("subject", SUBJECTS, ids=NAMES)
def test_nothing_but_messages_when_quiet(subject: Subject, folder: Path) -> None:
    outcome = carried_out(f"{subject.commands[0]} --quiet")
    assert outcome.status == expected(subject.commands[0])
    assert STEP.findall(outcome.stderr) == []


@pytest.mark.sweep(3)
@pytest.mark.parametrize("subject", SUBJECTS, ids=NAMES)
def test_a_name_that_is_no_text(subject: Subject, folder: Path) -> None:
    name = subject.file.replace(".", "\udcff.", 1)  # a byte that UTF-8 does not have
    for command in subject.commands:
        shutil.copy(subject.file, name)
        Path("new.db").unlink(missing_ok=True)
        outcome = carried_out(command, **{subject.file: name})
        assert outcome.status == expected(command), (command, outcome)


@pytest.mark.sweep(3)
@pytest.mark.parametrize("subject", SUBJECTS, ids=NAMES)
def test_spoilt_files(subject: Subject, folder: Path) -> None:
    try_spoilt(subject, folder, range(0, subject.share, 3))


@pytest.mark.parametrize("subject", SUBJECTS, ids=NAMES)
def test_no_file_an_empty_one_and_a_folder(subject: Subject, folder: Path) -> None:
    path = folder / subject.file
    path.unlink()
    for make in (lambda: None, path.touch, lambda: (path.unlink(missing_ok=True), path.mkdir())):
        make()
        for command in subject.commands:
            outcome = carried_out(command)
            if path.suffix == ".db":  # which is made where there is none, and must be a file as for any tool
                assert outcome.status in {0, 1, 2, 3}
            else:
                assert outcome.status == 2
            assert outcome.status == 0 or SENTENCE.search(outcome.stderr), (command, outcome)


@pytest.mark.slow
@pytest.mark.parametrize("subject", SUBJECTS, ids=NAMES)
def test_many_spoilt_files(subject: Subject, folder: Path) -> None:
    try_spoilt(subject, folder, range(subject.share))
    try_spoilt(subject, folder, range(1000, 1000 + 40 * subject.share))
