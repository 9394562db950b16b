"""The command line as a user or a script meets it: exit status, stdout, stderr, files."""

import json
import re
from pathlib import Path

import pytest
from tests.commands.command_line import FILTER, Command, Outcome, refused, reloadable
from tests.gen.report.pictures import unpainted

from sosmith import __version__
from sosmith.gen.specification.specification import example
from sosmith.interface.specification import Specification

NEEDED = {
    "init": ("[FILE]", "flange_wear.toml", "--example NAME", "--list", "--force"),
    "import": ("FILE", "--sample-rate", "--signs", "--range", "disagree on the signs"),
    "combinations": ("go together", "--markdown", "--json"),
    "design": ("SPEC", "--core", "--realization", "--widths-of", "--silicon", "--plot", "--json"),
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
        "--trace FILE.csv|wav|toml|SCENARIO",
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


def test_help_of_all_lists_the_commands_by_their_subject(sosmith: Command) -> None:
    outcome = sosmith("--help")
    assert outcome.status == 0
    listed = re.findall(r"^(?:  ([a-z]+)  .*|([A-Z][a-z]+):)$", outcome.stdout, flags=re.MULTILINE)
    titles = [title for _, title in listed if title]
    assert titles == ["Options", "Filter", "Hardware", "Board", "Instrument", "Evidence"]
    assert sorted(name for name, _ in listed if name) == sorted(NEEDED)
    assert [name for name, _ in listed if name][:3] == ["init", "import", "design"]
    assert "\n      sosmith design my.toml      show the filter" in outcome.stdout


def test_version(sosmith: Command) -> None:
    assert sosmith("--version").stdout == f"sosmith, version {__version__}\n"


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
    for phrase in ("demo: instrument", "Error budget", "output rounding", "multipliers", "Cost of the core, estimated"):
        assert phrase in outcome.stdout
    lines = outcome.stdout.splitlines()
    assert len(lines) <= 42
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


def test_a_design_that_cannot_meet_its_specification_falls_short(sosmith: Command) -> None:
    Path("plain.toml").write_text(FILTER.replace('"faithful"', "0.00024414062500000001"), encoding="utf-8")
    outcome = sosmith("design", "plain.toml")
    assert (outcome.status, outcome.stdout) == (1, "")
    (message,) = outcome.messages
    assert re.fullmatch(
        r"sosmith: error: plain\.toml: none of the \d realizations meets the specification: (with df1_ef2, )?"
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


@pytest.mark.parametrize(
    ("start", "sentence"),
    [("steady", "in the steady state of its next sample"), ("zero", "from zero; it flags "), (None, None)],
)
def test_reload_says_how_a_core_restarts_that_judges_wear(
    sosmith: Command, start: str | None, sentence: str | None
) -> None:
    wear = "" if start is None else f'start = "{start}"\n[wear]\ninitial = 0.1\nwarning = 0.2\nlimit = 0.3\n'
    Path("core.toml").write_text(reloadable("100.0") + wear, encoding="utf-8")
    outcome = sosmith("reload", "core.toml", "core.toml")
    assert outcome.status == 0
    assert ("the core restarts" in outcome.stdout) == (start is not None)
    assert sentence is None or sentence in outcome.stdout


def test_reload_refuses_a_set_that_breaks_the_bound(sosmith: Command) -> None:
    Path("core.toml").write_text(reloadable("100.0"), encoding="utf-8")
    Path("next.toml").write_text(reloadable("105.0").replace('"faithful"', "0.00025"), encoding="utf-8")
    outcome = sosmith("reload", "core.toml", "next.toml")
    assert (outcome.status, outcome.stdout) == (1, "")
    (message,) = outcome.messages
    assert re.fullmatch(
        r"sosmith: error: next\.toml: the set must keep its error within 250 × 10⁻⁶, and is proven to [\d.]+ × 10⁻⁶ "
        "only: nothing is to be loaded",
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


PASSING = ("scenario", "notes", "wall_seconds", "cycles_per_second")
"""Keys of a report that differ between two runs on the same codes: a file may have been measured."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "scenario"), [("demo", "wear_ramp"), pytest.param("plain", "noise", marks=pytest.mark.slow)]
)
def test_a_scenario_by_way_of_a_file_gives_the_same_result(spec: str, scenario: str, sosmith: Command) -> None:
    options = ["--simulator", "icarus", "--seed", "0", "--json"]
    direct = sosmith("simulate", f"{spec}.toml", "--trace", scenario, "--seconds", "0.5", *options)
    assert direct.status == 0
    assert direct.messages == [f"sosmith: report: {Path(f'build/{spec}/report.html').resolve().as_uri()}"]
    sosmith("emulate", f"{spec}.toml", scenario, "--seconds", "0.5", "--seed", "0", "-o", "a [/b] trace.csv")
    by_file = sosmith("simulate", f"{spec}.toml", "--trace", "a [/b] trace.csv", "-o", "else where", *options)
    assert by_file.status == 0
    first, second = json.loads(direct.stdout), json.loads(by_file.stdout)
    assert json.loads(Path(f"build/{spec}/report.json").read_text(encoding="utf-8")) == first
    assert (first["scenario"], second["scenario"]) == (scenario, "b] trace")
    for report in (first, second):  # of the simulation, the facts tell the speed
        report["facts"] = [group for group in report["facts"] if group["title"] != "The simulation"]
    assert {k: v for k, v in first.items() if k not in PASSING} == {k: v for k, v in second.items() if k not in PASSING}
    assert "else where" in by_file.messages[0].replace("%20", " ")
    assert Path("else where/report.html").exists()


@pytest.mark.slow
@unpainted
def test_reports_side_by_side(sosmith: Command) -> None:
    """The unit ``[/x]`` would end a style of the tables that never began: texts of the user are no markup."""
    Path("plain.toml").write_text(FILTER + 'unit = "[/x]"\n[hardware]\narchitecture = "parallel"\n', encoding="utf-8")
    for realization in ("df1", "df1_ef2"):
        options = ["--realization", realization, "--trace", "noise", "--seconds", "0.1", "--simulator", "icarus"]
        simulated = sosmith("simulate", "plain.toml", *options, "-o", realization)
        assert (simulated.status, simulated.messages[1:]) == (0, [])
        assert "[/x]" in simulated.stdout
    table = sosmith("compare", "df1", "df1_ef2/report.json")
    assert (table.status, table.messages) == (0, [])
    assert "[/x]" in table.stdout
    assert "What differs" in table.stdout
    words = " ".join(table.stdout.split())
    assert re.search(r"df1(_ef2)? is the cheapest of both: .* LUT4 equivalents, .*; its error limit is ", words)
    compared = sosmith("compare", "df1", "df1_ef2", "--json", "-o", "pages/both.html")
    assert compared.status == 0
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
    designs = {"accuracy": ("df1_ef1", '"faithful"'), "broken": ("df1", "0.01"), "better": ("df1", "0.0004")}
    outcomes: dict[str, Outcome] = {}
    for name, (realization, max_error) in designs.items():
        Path("filter.toml").write_text(FILTER.replace('"faithful"', max_error) + parallel, encoding="utf-8")
        folder = name if name == "accuracy" else "build/filter"
        assert sosmith("simulate", "filter.toml", "--realization", realization, *quick, "-o", folder).status == 0
        if name != "accuracy":
            outcomes[name] = sosmith(*command.split())
    assert (outcomes["broken"].status, outcomes["better"].status) == (1, 0)
    assert outcomes["broken"].messages[-1] == (
        "sosmith: error: no report must be worse than the baseline, or impossible to judge, not filter"
    )
    assert outcomes["broken"].stdout.startswith("## ❌ filter falls short beside the baseline\n\n- largest error: ")
    assert outcomes["better"].stdout.startswith("## ✅ filter is not worse than the baseline")
    assert Path("build/comparison.html").exists()


def test_the_table_of_combinations_is_the_same_in_all_forms(sosmith: Command) -> None:
    shown = sosmith("combinations")
    assert (shown.status, shown.stderr) == (0, "")
    assert "folded with multipliers 0: its program needs one\n" in shown.stdout
    rows = json.loads(sosmith("combinations", "--json").stdout)
    assert rows == [each._asdict() for each in Specification.combinations()]
    text = sosmith("combinations", "--markdown").stdout
    row = "| multipliers 0 | ok | refused | ok | refused | not yet | ok | decimate by FIR (not yet); "
    assert f"{row}reload in parallel (refused) |\n" in text
    assert "- folded with multipliers 0: its program needs one\n" in text


def test_the_table_of_combinations_in_one_form_at_a_time(sosmith: Command) -> None:
    refused(sosmith("combinations", "--json", "--markdown"), "--markdown must come without --json, not with it")
