"""`sosmith calibrate reference --port`: prompts, what is read, and a store that an interruption leaves as it was."""

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner, Result
from tests.host.ports import plugged
from tests.instrument.calibration.measuring import readings, write_csv
from tests.interface.instrument.live.gauging import GAUGE, GaugingDevice

import sosmith
from sosmith.cli import cli
from sosmith.model.errors import LinkError, SpecificationError

VOLTAGES = {2.2: 2.0, 4.6: 5.0, 8.1: 8.0}
"""What the sensor reads at each target."""


@pytest.fixture(scope="module")
def design() -> sosmith.Design:
    return sosmith.design(GAUGE)


@pytest.fixture(scope="module")
def folder(design: sosmith.Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files of the board, beside a store of a sensor."""
    made = tmp_path_factory.mktemp("targets")
    write_csv(made / "a.csv", readings(60))
    added = call("add", str(made / "a.csv"), "--store", str(made / "calibration.db"), "--date", "2024-03-01")
    assert added.exit_code == 0
    design.generate(made / "build" / "targets")
    return made


@pytest.fixture
def device(design: sosmith.Design, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> GaugingDevice:
    """Return the board, in a copy of its folder."""
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    made = GaugingDevice(design, time.monotonic, lambda t: made.voltage)
    made._measured = int(time.monotonic() * 1000)
    made.voltage, made.temperature = 2.0, 25.0  # type: ignore[attr-defined]
    return made


@pytest.fixture
def port(device: GaugingDevice) -> Iterator[str]:
    with plugged(device) as path:
        yield path


def call(*arguments: str, typed: str | None = None) -> Result:
    return CliRunner(env={"COLUMNS": "100"}).invoke(cli, ["calibrate", *arguments], input=typed)


def live(port: str, *more: str, targets: tuple[float, ...] = tuple(VOLTAGES)) -> tuple[str, ...]:
    asked = [text for one in targets for text in ("--target", f"{one:g}mm")]
    return (
        "reference",
        "--port",
        port,
        *asked,
        "--temperature",
        "25",
        "--seconds",
        "0.1",
        "--date",
        "2024-03-02",
        *more,
    )


def put_when_asked(device: Any, monkeypatch: pytest.MonkeyPatch, *answers: str) -> None:
    """Put each target before the sensor when it is asked for."""
    given = iter(answers)

    def prompt(question: str, **options: Any) -> str:
        found = re.match(
            r"target of ([\d.]+) mm: put it before the sensor, then Enter, or s and Enter without", question
        )
        assert found is not None
        device.voltage = VOLTAGES[float(found[1])]
        return next(given, "")

    monkeypatch.setattr(click, "prompt", prompt)


@pytest.mark.slow
def test_targets_are_read_one_after_the_other(
    device: GaugingDevice, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_when_asked(device, monkeypatch)
    result = call(*live(port, "--json"))
    assert (result.exit_code, result.exception) == (0, None)
    made = json.loads(result.stdout)
    assert [one["clearance_mm"] for one in made["live"]] == list(VOLTAGES)
    assert [one["voltage_V"] for one in made["live"]] == pytest.approx(list(VOLTAGES.values()), abs=0.002)
    assert [one["results"] for one in made["live"]] == [100] * 3
    assert made["calibration"]["version"] == 2
    assert "sosmith: 2.2 mm: " in result.stderr
    csv = call("export", "--format", "csv").stdout.splitlines()
    assert [row.split(",")[0] for row in csv[-3:]] == ["2.2", "4.6", "8.1"]
    assert all(0 < float(row.split(",")[5]) < 0.001 for row in csv[-3:])
    assert "read live, 2024-03-02.csv" in call("files").stdout
    assert call("history", "--verify").exit_code == 0


@pytest.mark.slow
def test_a_target_may_be_left_out_or_read_again(
    device: GaugingDevice, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_when_asked(device, monkeypatch, "", "s", "")
    shown = call(*live(port))
    assert shown.exit_code == 0
    assert "2 targets, lengths in mm" in shown.stdout
    assert "Read at the targets" in shown.stdout
    VOLTAGES[9.9] = 0.0
    put_when_asked(device, monkeypatch, "", "s")
    refused = call(*live(port, targets=(9.9,)))
    del VOLTAGES[9.9]
    assert str(refused.exception) == "at least one target must be read, not all of them left out"
    message = (
        "sosmith: not read: the result must stand still for 0.1 s, not be with the flag input_at_rail after 40 tries"
    )
    assert message in refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize("typed", ["", "\n", "\n\n"])
def test_an_end_of_the_input_leaves_the_store_as_it_was(port: str, typed: str) -> None:
    before = Path("calibration.db").read_bytes()
    result = call(*live(port), typed=typed)
    assert isinstance(result.exception, SystemExit)
    assert Path("calibration.db").read_bytes() == before
    assert len(list(Path().glob("calibration*"))) == 1


@pytest.mark.slow
def test_an_interruption_leaves_the_store_as_it_was(port: str) -> None:
    before = Path("calibration.db").read_bytes()
    command = ["env", "--default-signal=INT", sys.executable, "-m", "sosmith.cli", "calibrate", *live(port)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        process.stdin.write("\n")
        process.stdin.flush()
        while not process.stderr.readline().startswith("sosmith: 2.2 mm: "):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
    assert (process.returncode, out) == (130, "")
    assert err.endswith("sosmith: interrupted\n")
    assert Path("calibration.db").read_bytes() == before
    assert len(list(Path().glob("calibration*"))) == 1


def test_a_board_that_is_lost_leaves_the_store_as_it_was(
    device: GaugingDevice, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = Path("calibration.db").read_bytes()
    put_when_asked(device, monkeypatch)
    monkeypatch.setattr(device, "feed", lambda data: b"")
    assert isinstance(call(*live(port)).exception, LinkError)
    assert Path("calibration.db").read_bytes() == before


def test_what_does_not_go_together_is_refused(port: str) -> None:
    together = "--port must come with --target, once for each target, and with --temperature"
    alone = "--target, --temperature, --channel, --files and --active must come with --port"
    once = "targets must be given by a file, by --reading, or live by --port, one of them"
    reading = ("--reading", "2.2", "2", "25")
    for message, arguments in (
        (together, ("reference", "--port", port, "--target", "2mm")),
        (together, ("reference", "--port", port, "--temperature", "21")),
        (alone, ("reference", *reading, "--target", "2mm")),
        (alone, ("reference", *reading, "--channel", "0")),
        (once, ("reference",)),
        (once, ("reference", *reading, "--port", port)),
        (once, ("reference", "a.csv", *reading)),
        ("calibration.db: the sensor must be one of sensor, not right", live(port, "--sensor", "right")),
    ):
        result = call(*arguments)
        assert isinstance(result.exception, SpecificationError)
        assert str(result.exception) == message
