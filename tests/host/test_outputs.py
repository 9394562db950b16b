"""What is made of results: alarms, hooks, lines for InfluxDB, plots, the live view, and the check of an identity."""

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from tests.host.lines import device_of
from tests.interface.small import INSTRUMENT, filter_design, instrument_design

import sosmith
from sosmith.gen.output.identity import identity as identity_of
from sosmith.host.alarms import Alarm, Alarms, Hook
from sosmith.host.board import Results
from sosmith.host.identity_check import check_files, folder_of
from sosmith.host.line_protocol import influx_lines
from sosmith.host.live_view import plot, render
from sosmith.host.readings import History, Readings
from sosmith.model.errors import ShortfallError, SpecificationError, ToolError
from sosmith.model.link.identity import Identity

FLAGS = {"wear_warning": 3, "wear_critical": 4}


def identity(design: sosmith.Design) -> Identity:
    return device_of(design)._identity


def results(values: Any, status: Any) -> Results:
    shown = np.asarray(values, dtype=np.float64)
    return Results(shown, (shown * 256).astype(np.int64), np.asarray(status, dtype=np.uint8), FLAGS)


def test_every_rise_of_a_flag_is_one_alarm() -> None:
    alarms = Alarms(["wear_critical"], FLAGS, 10.0)
    assert alarms.rises(results([1.0, 2.0, 3.0, 4.0], [0, 16, 24, 8]), 100, 1000.0) == [
        Alarm("wear_critical", 0, 101, 2.0, 1010.1)
    ]
    assert alarms.rises(results([5.0, 6.0], [16, 16]), 104, 1000.0) == [Alarm("wear_critical", 0, 104, 5.0, 1010.4)]
    assert alarms.rises(results([7.0], [16]), 106, 1000.0) == []


def test_channels_and_flags_have_alarms_of_their_own() -> None:
    alarms = Alarms(["wear_critical", "wear_warning"], FLAGS, 10.0)
    found = alarms.rises(results([[1, 2], [3, 4]], [[0, 8], [16, 8]]), 0, 0.0)
    assert found == [Alarm("wear_warning", 1, 0, 2.0, 0.0), Alarm("wear_critical", 0, 1, 3.0, 0.1)]


def test_an_alarm_is_a_flag_of_the_board() -> None:
    expected = (
        r"^an alarm must be one of wear_warning, wear_critical, not wear_critcal \(did you mean wear_critical\?\)$"
    )
    with pytest.raises(SpecificationError, match=expected):
        Alarms(["wear_critcal"], FLAGS, 10.0)


def test_a_hook_is_told_what_has_happened(tmp_path: Path) -> None:
    code = "import os, pathlib, sys; pathlib.Path(sys.argv[1]).write_text(os.environ['SOSMITH_FLAG']"
    code += "+ ' '.join(os.environ['SOSMITH_' + key] for key in ('', 'CHANNEL', 'SAMPLE', 'VALUE', 'UNIT') if key))"
    hook = Hook(f"{sys.executable} -c \"{code}\" '{tmp_path}/told here'", "mm")
    hook.run(Alarm("fault", 2, 77, 1.25, 0.0))
    hook.finish()
    assert (tmp_path / "told here").read_text() == "fault2 77 1.25 mm"


def test_a_hook_that_cannot_be_run() -> None:
    with pytest.raises(ToolError, match=r"^the hook must be a command that can be run, not /none: No such file or "):
        Hook("/none", "mm").run(Alarm("fault", 0, 0, 0.0, 0.0))


def test_lines_for_influxdb() -> None:
    about = identity(instrument_design())
    lines = list(influx_lines(about, results([[1.5, 2.0], [1.0, 2.25]], [[0, 8], [16, 0]]), 50, 1000.0))
    assert lines == [
        "gauge,channel=0 clearance=1.5,code=384i,wear_warning=false,wear_critical=false 1000500000000",
        "gauge,channel=1 clearance=2.0,code=512i,wear_warning=true,wear_critical=false 1000500000000",
        "gauge,channel=0 clearance=1.0,code=256i,wear_warning=false,wear_critical=true 1000510000000",
        "gauge,channel=1 clearance=2.25,code=576i,wear_warning=false,wear_critical=false 1000510000000",
    ]


def test_a_plot_runs_from_the_lowest_to_the_highest_value() -> None:
    assert plot([0, 1, 2, 3], 10, 2) == ["  ▃█", "▁▆██"]
    assert plot([1, 1], 10, 1) == ["▄▄"]
    assert plot([], 10, 2) == ["", ""]
    assert [len(row) for row in plot(range(1000), 40, 3)] == [40, 40, 40]


def shown(readings: Readings) -> str:
    console = Console(width=80, file=None, record=True, quiet=False, force_terminal=False)
    with console.capture() as capture:
        console.print(render(readings, 80))
    return capture.get()


def test_the_live_view() -> None:
    about = identity(instrument_design()).model_copy(update={"flags": FLAGS})
    manifest = {"spec": {"wear": {"initial": [1.0, 1.5]}}}
    view = Readings(about, manifest, "/dev/ttyUSB1")
    values = np.stack([1.0 + np.arange(300) / 3600, np.full(300, 2.0)], axis=1)
    view.add(results(values, np.stack([np.zeros(300), np.full(300, 8)], axis=1)), 0)
    text = shown(view)
    assert text.startswith("gauge at /dev/ttyUSB1: connected, 300 samples, 3.0 s")
    rows = [line.split() for line in text.splitlines() if line.split()[:1] in (["0"], ["1"])]
    assert rows[0] == ["0", "1.0831", "0.083", "+100.000", "-"]
    assert rows[1] == ["1", "2.0000", "0.500", "+0.000", "wear", "warning"]
    assert "channel 1" in text


def test_the_live_view_without_wear_and_with_much_to_show() -> None:
    view = Readings(identity(filter_design()).model_copy(update={"flags": FLAGS}), None, "port")
    for first in range(0, 20_000, 1000):
        view.add(results(np.linspace(first, first + 999, 1000) / 1000, np.zeros(1000)), first)
    view.state, view.alarms = "lost", 2
    text = shown(view)
    assert text.startswith("plain at port: lost, 20,000 samples, 20.0 s, 2 alarms")
    assert "/h" not in text  # the output of a plain filter has no rate of wear
    assert "+3600.000" not in text
    assert "█" in text


def test_the_live_view_obeys_nobody() -> None:
    """Even if such an identity had passed the gate."""
    evil = "\x1b]0;owned\x07\x1b[2J\r\x9b"
    good = identity(filter_design())
    output = (evil, *good.output[1:5], evil)
    about = good.model_copy(update={"name": evil, "output": output, "flags": {evil: 3}})
    view = Readings(about, None, evil)
    view.add(results(np.ones(10), np.full(10, 8)), 0)
    text = shown(view)
    assert "x1b]0;owned" in text
    assert all(line.isprintable() for line in text.split("\n"))


def test_the_live_view_of_a_measured_quantity_has_its_change_per_hour() -> None:
    view = Readings(identity(instrument_design()).model_copy(update={"flags": FLAGS}), None, "port")
    values = np.stack([np.linspace(0, 1, 101), np.zeros(101)], axis=1)
    view.add(results(values, np.zeros((101, 2))), 0)
    text = shown(view)
    assert "mm/h" in text
    assert "+3600.000" in text


def test_a_history_that_is_thinned_out_keeps_the_flags() -> None:
    history = History()
    status = np.zeros(9000, dtype=np.uint8)
    status[[0, 4321, 8999]] = 1, 8, 16
    for first in range(0, 9000, 7):
        history.add(first, np.arange(first, min(first + 7, 9000)) / 2, status[first : first + 7])
    assert history.numbers.tolist() == list(range(0, 9000, 8))
    assert history.values.tolist() == [number / 2 for number in range(0, 9000, 8)]
    assert np.flatnonzero(history.status).tolist() == [0, 541]
    history.add(9000, np.zeros(1), np.zeros(1, dtype=np.uint8))
    assert history.status[-1] == 16
    numbers, values, flags = history.thinned(100)
    assert (len(numbers), numbers[-1], values[-1], sorted(set(flags.tolist()))) == (100, 9000, 0.0, [0, 1, 8, 16])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("files")
    instrument_design().generate(place)
    return place


def made_identity(folder: Path) -> Identity:
    return identity_of(instrument_design().core, (folder / "gauge.sv").read_text(), baud=1, clock=1.0)


def test_an_identity_fits_its_files(folder: Path) -> None:
    assert check_files(made_identity(folder), folder)["name"] == "gauge"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"design": "0" * 64}, "the board's design must be .*, not 000000000000; its core is gauge"),
        ({"channels": 3}, "the board's channels must be 2, not 3; its core is gauge"),
        ({"core": "filter"}, "the board's core must be instrument, not filter; its core is gauge"),
        ({"flags": {}}, r"the board's flags must be \{.*\}, not \{\}; its core is gauge"),
    ],
)
def test_an_identity_that_does_not_fit(change: dict[str, Any], message: str, folder: Path) -> None:
    with pytest.raises(ShortfallError, match=f"^{message}$"):
        check_files(made_identity(folder).model_copy(update=change), folder)


@pytest.mark.slow
def test_the_files_of_a_board_are_found_among_those_of_several(folder: Path, tmp_path: Path) -> None:
    """As `sosmith generate` and `sosmith build` for two boards leave them."""
    about = made_identity(folder)
    assert folder_of(about, tmp_path) is None
    other = sosmith.design(INSTRUMENT | {"hardware": {"realization": "df1", "architecture": "parallel"}})
    other.generate(tmp_path)
    other.generate(tmp_path / "icebreaker")
    expected = (
        rf"^one of the folders {re.escape(str(tmp_path))}, {re.escape(str(tmp_path))}/icebreaker must have the files "
        rf"of the board's core, gauge with the design {about.design[:12]}, not of other designs only: run `sosmith "
        r"generate` on its specification with the options of the board, or name the folder with --files$"
    )
    with pytest.raises(ShortfallError, match=expected):
        folder_of(about, tmp_path)
    instrument_design().generate(tmp_path / "ulx3s_25f")
    assert folder_of(about, tmp_path) == tmp_path / "ulx3s_25f"


def test_files_that_are_none(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(SpecificationError, match=r"gauge.json: the manifest must be a readable file, not: "):
        check_files(made_identity(folder), tmp_path)
    (tmp_path / "gauge.json").write_text("[]")
    with pytest.raises(SpecificationError, match=r"gauge.json: the manifest must be JSON, an object, not something"):
        check_files(made_identity(folder), tmp_path)
    (tmp_path / "gauge.json").write_text(json.dumps({}))
    (tmp_path / "gauge.certificate.json").write_text((folder / "gauge.certificate.json").read_text())
    with pytest.raises(SpecificationError, match=r": the manifest must have its keys, not be without 'streams'$"):
        check_files(made_identity(folder), tmp_path)
