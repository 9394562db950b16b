"""Commands that talk to a board: streamed traces, and the accuracy suite over a port."""

from __future__ import annotations

import os
import re
import wave
from functools import partial
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest
from tests.commands.invocation import Invocation
from tests.host.ports import plugged
from tests.interface.small import filter_design, instrument_design

import sosmith
from sosmith.gen.output.generate import generated
from sosmith.host.board import Board
from sosmith.host.model_line import ModelLine, model_of
from sosmith.host.page import LivePage
from sosmith.host.port_run import run_on
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.errors import ShortfallError, SpecificationError, ToolError
from sosmith.model.link.device import Device
from sosmith.model.traces.trace_file import write_traces
from sosmith.sim.simulation import simulate

STREAM = Invocation("stream")


def board_of(design: sosmith.Design) -> Device:
    return model_of(design.core, generated(design.core)[f"{design.name}.sv"])


def test_a_trace_goes_through_a_board(tmp_path: Path) -> None:
    made = filter_design()
    (trace,) = traces_for(made.core, "sweep", seed=1, seconds=0.5)
    write_traces(tmp_path / "sweep.csv", [trace])
    with plugged(model_of(made.core)) as port:
        printed = STREAM.good(port, str(tmp_path / "sweep.csv")).stdout
        STREAM.good(port, str(tmp_path / "sweep.csv"), "-o", str(tmp_path / "out.csv"))
    assert printed == (tmp_path / "out.csv").read_text()
    header, *lines = printed.splitlines()
    assert header == "time_s,y,y_code,status"
    codes = made.core.datapath.compute(trace.codes)
    values = made.core.datapath.output.decode(codes).tolist()
    status = made.core.datapath.compute_status(trace.codes)
    expected = zip(trace.time.tolist(), values, codes.tolist(), status.tolist(), strict=True)
    assert lines == [",".join(map(str, row)) for row in expected]


def test_sound_goes_through_a_board_and_comes_out_as_sound(tmp_path: Path) -> None:
    made = filter_design()
    trace = made.trace("sweep", seconds=0.1)
    trace.write(tmp_path / "in.wav")
    with plugged(model_of(made.core)) as port:
        STREAM.good(port, str(tmp_path / "in.wav"), "-o", str(tmp_path / "out.wav"))
    with wave.open(str(tmp_path / "out.wav")) as file:
        assert (file.getframerate(), file.getnchannels()) == (made.specification.sample_rate, 1)
        played = np.frombuffer(file.readframes(1000), "<i2")
    output = made.core.datapath.output
    assert played.tolist() == (made.run_codes(x=trace.coded[0].codes[:, 0]) << (16 - output.bits)).tolist()


def test_one_trace_drives_all_channels(tmp_path: Path) -> None:
    made = instrument_design()
    (first, second) = traces_for(made.core, "wear_ramp", seed=1, seconds=1)
    write_traces(tmp_path / "ramp.csv", [first])
    with plugged(model_of(made.core)) as port:
        header, *lines = STREAM.good(port, str(tmp_path / "ramp.csv")).stdout.splitlines()
    assert header == "time_s,channel,clearance_mm,clearance_code,status"
    codes = np.stack([first.codes, first.delayed(1).codes], axis=1)
    assert [int(line.split(",")[3]) for line in lines] == made.core.datapath.compute(codes).reshape(-1).tolist()
    assert [line.split(",")[1] for line in lines] == ["0", "1"] * len(first)
    assert second.codes.shape == first.codes.shape


@pytest.mark.parametrize("command", ["stream", "monitor"])
def test_a_trace_is_not_replaced_by_its_results(tmp_path: Path, command: str) -> None:
    trace = tmp_path / "a.csv"
    trace.write_text("x\n1\n")
    expected = f"{trace}: the output file must be another than what is read, not the same"
    given = (str(trace),) if command == "stream" else ("--trace", str(trace))
    Invocation(command).refused(expected, "/dev/nothing", *given, "-o", str(trace))
    assert trace.read_text() == "x\n1\n"


@pytest.mark.parametrize("command", ["stream", "monitor"])
def test_a_device_or_a_fifo_is_no_output(tmp_path: Path, command: str) -> None:
    given = ("x.csv",) if command == "stream" else ("--trace", "x.csv")
    os.mkfifo(tmp_path / "fifo")
    for path, kind in ((Path("/dev/full"), "a device"), (tmp_path / "fifo", "a pipe")):
        expected = f"{path}: the output file must be a file, not {kind}"
        Invocation(command).refused(expected, "/dev/nothing", *given, "-o", str(path))


def test_a_port_without_a_board(tmp_path: Path) -> None:
    (tmp_path / "ramp.csv").write_text("x\n1\n")
    expected = "/dev/nothing must be a serial port that is free, not: No such file or directory"
    STREAM.refused(expected, "/dev/nothing", str(tmp_path / "ramp.csv"), kind=ToolError)


def test_a_board_that_computes_what_it_must(tmp_path: Path) -> None:
    made = filter_design()
    traces = traces_for(made.core, "sweep", seed=1, seconds=0.5)
    with Board.on(ModelLine(board_of(made))) as client:
        evidence = simulate(made.core, traces, tmp_path / "out", hardware=partial(run_on, client))
    assert (evidence.run.mismatches, evidence.run.samples, evidence.simulator) == (0, 500, "board")


@pytest.mark.slow
def test_the_accuracy_suite_over_a_port(tmp_path: Path) -> None:
    made = filter_design()
    with plugged(board_of(made)) as port:
        report = made.simulate(folder=tmp_path / "out", seconds=0.5, port=port)
    assert report.passed
    assert report.bit_exact
    assert report.summary["simulator"] == "board"
    assert report.summary["samples"] == len(report.hardware_codes) == 500
    assert (tmp_path / "out" / "report.html").exists()


def test_a_board_that_computes_something_else_falls_short(tmp_path: Path) -> None:
    made = filter_design()
    board = board_of(made)
    feed = board._core.feed
    board._core.feed = lambda channel, samples: feed(channel, samples)[:-2] + b"\x01\x00"  # type: ignore[method-assign]
    traces = traces_for(made.core, "sweep", seed=1, seconds=0.5)
    with Board.on(ModelLine(board)) as client:
        evidence = simulate(made.core, traces, tmp_path / "out", hardware=partial(run_on, client))
    assert evidence.run.mismatches > 0


@pytest.mark.slow
def test_a_board_with_another_core_is_not_tried(tmp_path: Path) -> None:
    made = filter_design()
    expected = r"^the board's design must be [0-9a-f]{12}, not [0-9a-f]{12}; its core is gauge$"
    with plugged(board_of(instrument_design())) as port, pytest.raises(ShortfallError, match=expected):
        made.simulate(folder=tmp_path / "out", seconds=0.5, port=port)


def test_a_port_needs_no_simulator(tmp_path: Path) -> None:
    Invocation("simulate").refused(
        "--port must come without --gates and --waves, which need a simulator",
        "x.toml",
        "--port",
        "/dev/nothing",
        "--waves",
        kind=SpecificationError,
    )


MONITOR = Invocation("monitor")


@pytest.fixture
def ramp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write a trace of two channels whose voltage ends at the rail, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    voltage = np.repeat(np.linspace(0, 4095, 100).astype(int), 2)
    rows = [f"{n % 2},{code},512" for n, code in enumerate(voltage.tolist())]
    (tmp_path / "ramp.csv").write_text("\n".join(["channel,voltage_code,temperature_code", *rows]) + "\n")
    return tmp_path / "ramp.csv"


def test_monitor_records_and_tells_alarms(ramp: Path) -> None:
    made = instrument_design()
    arguments = ("--trace", "ramp.csv", "--speed", "0", "-o", "out.csv", "--alarm", "input_at_rail", "--influx")
    with plugged(model_of(made.core)) as port:
        result = MONITOR.run(port, *arguments)
    assert result.exit_code == 1
    voltage = np.linspace(0, 4095, 100).astype(int)
    codes = np.stack([voltage, np.full(100, 512)], axis=1)[:, np.newaxis].repeat(2, axis=1)
    expected = made.core.datapath.compute(codes)
    values = made.core.datapath.output.decode(expected)
    assert result.stderr.splitlines() == [
        f"sosmith: the board has the core gauge; it was not checked, as there is no {Path('build/gauge')}: see --files",
        *(
            f"sosmith: alarm: input_at_rail of channel {channel} at {n / 100:.3f} s, {values[n, channel]:g} mm"
            for n in (0, 99)
            for channel in (0, 1)
        ),
    ]
    header, *lines = (ramp.parent / "out.csv").read_text().splitlines()
    assert header == "utc,time_s,run,session,channel,clearance_mm,clearance_code,status,board"
    assert [int(line.split(",")[6]) for line in lines] == expected.reshape(-1).tolist()
    assert {tuple(line.split(",")[2:4]) for line in lines} == {("1", "1")}
    assert len(result.stdout.splitlines()) == 200
    assert result.stdout.startswith("gauge,channel=0 clearance=")


def test_monitor_without_an_alarm(ramp: Path) -> None:
    with plugged(model_of(instrument_design().core)) as port:
        result = MONITOR.good(port, "--trace", "ramp.csv", "--speed", "0")
    assert result.stdout == ""


def test_monitor_tells_where_its_page_is_and_keeps_it(ramp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def stay(page: LivePage) -> None:
        """Come after the trace has ended, as a browser may."""
        with urlopen(page.address) as answer:
            seen.append((page.address, answer.status))

    monkeypatch.setattr(LivePage, "stay", stay)
    with plugged(model_of(instrument_design().core)) as port:
        result = MONITOR.good(port, "--trace", "ramp.csv", "--speed", "0", "--page")
    told = re.search(
        r"^sosmith: the live view is at (http://127\.0\.0\.1:\d+/[\w-]{32}/)$", result.stderr, re.MULTILINE
    )
    assert told is not None
    assert seen == [(told[1], 200)]
    assert result.stderr.endswith("sosmith: the trace has ended; the live view stays until Ctrl-C\n")


def test_monitor_checks_the_board(ramp: Path) -> None:
    filter_design().generate(ramp.parent / "files")
    expected = ramp.parent / "files" / "gauge.json"
    with plugged(model_of(instrument_design().core)) as port:
        result = MONITOR.run(port, "--trace", "ramp.csv", "--files", str(ramp.parent / "files"))
    assert isinstance(result.exception, SpecificationError)
    assert str(result.exception).startswith(f"{expected}: the manifest must be a readable file, not: ")


def test_monitor_needs_samples() -> None:
    with plugged(model_of(instrument_design().core)) as port:
        MONITOR.refused("--trace must be given: the board takes its samples over the link", port)
