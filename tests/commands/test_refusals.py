"""What the command line refuses: usage, specifications and files, each with one sentence."""

import re
from pathlib import Path

import pytest
from tests.commands.command_line import INSTRUMENT, Command, refused
from tests.gen.specification.bad_specifications import BAD, with_fault

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
        "scenario for a plain filter must be one of worst_case, worst_case_errors, step, sweep, noise, passband_sweep, "
        "tone, multitone, pink_noise, not 'drive'",
    ),
    "scenario of the other kind": (
        ("simulate", "demo.toml", "--trace", "sweep"),
        "scenario for an instrument must be one of bench_43_50, bench_92_96, temperature_ramp, wear_ramp, worst_case, "
        "worst_case_errors, not 'sweep'",
    ),
    "unknown scenario to emulate": (
        ("emulate", "plain.toml", "drive"),
        "the scenario must be one of worst_case, worst_case_errors, step, sweep, noise, passband_sweep, tone, "
        "multitone, pink_noise, or a file whose name ends in "
        ".toml, not drive",
    ),
    "simulator without netlists": (
        ("simulate", "missing.toml", "--simulator", "cxxrtl", "--gates", "icebreaker"),
        "simulator of a netlist must be verilator or icarus, not cxxrtl",
    ),
    "unknown board": (
        ("simulate", "plain.toml", "--gates", "basys3"),
        "the board must be one of icebreaker, upduino, ice40_hx8k_b_evn, icestick, ulx3s_12f, ulx3s_25f, "
        "ulx3s_45f, ulx3s_85f, colorlight_i5, orangecrab_25f, ecp5_evn, olimex_gatemate, not basys3",
    ),
    "netlist without models": (
        ("simulate", "plain.toml", "--gates", "tang-nano-9k"),
        "the board must be one of icebreaker, upduino, ice40_hx8k_b_evn, icestick, ulx3s_12f, ulx3s_25f, "
        "ulx3s_45f, ulx3s_85f, colorlight_i5, orangecrab_25f, ecp5_evn, olimex_gatemate, not tang-nano-9k",
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
        "none: a report.json, or a folder that holds one, must be a readable file, not: no such file or directory",
    ),
    "report that is none": (
        ("compare", "plain.toml", "plain.toml"),
        "plain.toml must be a report.json of sosmith, not text that is no JSON",
    ),
}


@pytest.mark.sweep(11)
@pytest.mark.parametrize(("arguments", "message"), UNFIT.values(), ids=UNFIT)
def test_what_does_not_fit_is_refused(arguments: tuple[str, ...], message: str, sosmith: Command) -> None:
    before = {path.name: path.read_bytes() for path in Path().iterdir()}
    refused(sosmith(*arguments), message)
    assert {path.name: path.read_bytes() for path in Path().iterdir()} == before


# Bad specifications and files.


@pytest.mark.sweep(70)
@pytest.mark.parametrize(("old", "new", "sentence"), [pytest.param(*case, id=subject) for subject, *case in BAD])
def test_a_bad_specification_ends_with_one_sentence(old: str, new: str, sentence: str, sosmith: Command) -> None:
    Path("spec.toml").write_text(with_fault(old, new), encoding="utf-8")
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
    "long row": ("plain", "x_code\n1\n2,3\n", "trace.csv, line 3: row must have 1 cell, not 2"),
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


@pytest.mark.sweep(10)
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
        "data.csv, line 1: column must be one of clearance_mm, voltage_V, temperature_C, date, "
        "uncertainty_mm, uncertainty_V, uncertainty_C, not 'voltage_mV'",
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
