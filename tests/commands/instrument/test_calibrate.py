"""`sosmith calibrate` as a user meets it: what it prints, what it refuses, what it writes."""

from __future__ import annotations

import json
import re
import tomllib
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commands.invocation import Invocation
from tests.gen.designs import EXAMPLES
from tests.instrument.calibration.measuring import readings, write_csv

from sosmith.commands.instrument.calibrate import calibrate
from sosmith.gen.calibration.day_room import with_day_room
from sosmith.gen.calibration.fit import fit, read_measurements
from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import example, load
from sosmith.instrument.calibration.measurement_store import open_store
from sosmith.instrument.calibration.self_updating import Addition, add, refused_first_file
from sosmith.instrument.uncertainty.instrument_budget import instrument_of
from sosmith.interface.specification import Specification
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import EQUATION_5A, Polynomial

INVOCATION = Invocation("calibrate", columns=100)
run, good, refused = INVOCATION.run, INVOCATION.good, INVOCATION.refused

DAY = ("--date", "2024-03-01")
PAPER = ("--method", "paper")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Start in an empty folder with the measurements a.csv and b.csv."""
    monkeypatch.chdir(tmp_path)
    write_csv(Path("a.csv"), readings(60))
    write_csv(Path("b.csv"), readings(60, seed=2))
    return tmp_path


def test_add_reports_the_fit() -> None:
    printed = good("add", "a.csv", *DAY, *PAPER, "--required-r", "0.999")
    assert "sosmith: stored 60 measurements from a.csv in calibration.db\n" in printed.stderr
    shown = re.sub(r" {2,}", "  ", printed.stdout)
    for row in (
        "Sensor sensor, version 1 of 2024-03-01: new",
        "  measurements  60",
        "  orders  2 in voltage, 1 in temperature; to reach r = 0.999",
    ):
        assert row in shown
    for row in ("adjusted r", "residual, rms", "cross-validated error", "covered", "leverage", "Largest residuals"):
        assert row in shown
    assert "drift" not in shown
    assert "drift from version 1" in good("add", "b.csv", *DAY, *PAPER, "--required-r", "0.999").stdout


def test_add_as_json() -> None:
    added = json.loads(good("add", "a.csv", *DAY, *PAPER, "--json").stdout)
    assert (added["file"], added["kept"], added["refused"], added["shortfall"]) == ("a.csv", 60, [], "")
    made = added["calibration"]
    assert (made["version"], made["measurements"], made["new"], made["orders"]) == (1, 60, True, [1, 1])
    expected = fit(read_measurements(Path("a.csv")))
    assert made["coefficients"] == [[float(a) for a in row] for row in expected.polynomial.coefficients]
    assert made["rms_mm"] == expected.rms
    assert made["rms_mm"] < made["cross_validated_mm"]
    assert 0.3 < made["coverage"]["share_of_range"] < 0.6
    assert made["leverage"]["mean"] == 3 / 60
    assert len(made["largest_residuals"]) == 5


@pytest.mark.slow
def test_add_tells_the_shift_and_a_step_of_the_voltage() -> None:
    first = good("add", "a.csv", *DAY)
    assert "health   no alarm; the first day, held against nothing" in first.stdout
    assert "reads differently by" not in first.stdout
    write_csv(Path("b.csv"), [(d, round(V - 1, 4), T) for d, V, T in readings(60, seed=2) if V > 1.1])
    second = good("add", "b.csv", "--date", "2024-03-08")
    shown = re.sub(r"\s+", " ", second.stdout)
    assert re.search(
        r"reads differently by -0\.\d+ mm; the sensor reads 0\.\d+ mm less than by version 1 of 2024-03-01, ±0\.\d+ mm",
        shown,
    )
    assert re.search(
        r"^sosmith: warning: 2024-03-08: the offset stepped up; .* among the explanations\)$", second.stderr, re.M
    )
    as_json = json.loads(good("add", "a.csv", "--sensor", "right", *DAY, "--json").stdout)
    assert (as_json["shift"], as_json["alarms"], as_json["warnings"]) == (None, 0, [])
    as_json = json.loads(good("add", "b.csv", "--sensor", "right", "--date", "2024-03-08", "--json").stdout)
    assert -1.2 < as_json["shift"]["reads_more_by_mm"] < -0.6
    assert as_json["shift"]["from_version"] == 1
    assert as_json["alarms"] >= 1
    assert "the offset stepped up" in as_json["warnings"][0]


@pytest.mark.slow
def test_a_shift_beyond_the_warning_limit_is_said_and_is_no_alarm() -> None:
    good("add", "a.csv", *DAY)
    write_csv(Path("b.csv"), [(d, round(V - 0.2, 4), T) for d, V, T in readings(60, seed=2) if V > 1.1])
    second = good("add", "b.csv", "--date", "2024-03-08")
    said = re.search(
        r"^sosmith: warning: (2024-03-08: the sensor reads 0\.\d+ mm less than the days before predict, .*)$",
        second.stderr,
        re.M,
    )
    assert said is not None
    assert "one day in 20 is beyond 2 by chance; if the sensor has stepped, intervals may not hold" in said[1]
    shown = good("health")
    assert shown.stdout.startswith("Sensor sensor: no alarm; ")
    assert said[1] in " ".join(shown.stdout.split())
    notice = json.loads(good("health", "--json").stdout)["notice"]
    assert (notice["date"], notice["sentence"]) == ("2024-03-08", said[1])
    assert -0.4 < notice["reads_more_by_mm"] < -0.1
    assert -4.5 < notice["deviations"] < -2.0
    assert json.loads(good("health", "--since", "2024-03-08", "--json").stdout)["notice"] == notice
    good("reference", "--reading", "2.2", "1.8", "21", "--date", "2024-03-09")


def test_inches_are_refused_unless_they_are_said_to_be_right() -> None:
    write_csv(Path("a.csv"), [(d / 25.4, V, T) for d, V, T in readings(60)])
    result = run("add", "a.csv", *DAY)
    assert isinstance(result.exception, SpecificationError)
    assert re.fullmatch(
        r"a\.csv: clearance_mm must be in millimetres, not in inches: the rms residual against the type equation_5a is "
        r"\d\.\d+ mm as it is, and 0\.\d+ mm with that undone; --surprising stores them as they are",
        str(result.exception),
    )
    assert not Path("calibration.db").exists()
    assert "stored 60 measurements" in run("add", "a.csv", "--surprising", *DAY).stderr


@pytest.mark.slow
def test_a_day_far_from_the_measurements_is_warned_of() -> None:
    good("add", "a.csv", *DAY)
    assert "warning" not in good("fit", "--date", "2024-08-20").stderr
    fitted = good("fit", "--date", "2030-03-01")
    assert "version 3 of 2030-03-01: new" in fitted.stdout  # the intervals are others, if not the polynomial
    far = good("fit", "--date", "2030-03-01").stderr
    assert (
        "sosmith: warning: 2030-03-01 is 6.0 years after the last measurement, of 2024-03-01: the intervals assume a "
        "drift of 0.47 V and 4.7 % of the gain since then, as standard deviations\n"
    ) in far
    before = good("fit", "--date", "2024-02-01").stderr
    assert "sosmith: warning: 2024-02-01 is before the last measurement: the calibration is for 2024-03-01\n" in before


@pytest.mark.slow
def test_one_temperature_is_enough_for_a_sensor_of_a_known_type() -> None:
    write_csv(
        Path("a.csv"),
        [(round(float(EQUATION_5A(np.array(V), np.array(20.0))), 3), V, 20.0) for _, V, _ in readings(30)],
    )
    shown = good("add", "a.csv", *DAY).stdout
    assert re.search(r"coverage of the range +0\.0 % lies between measurements", shown)
    assert len(re.findall(r"^  20   ", shown, re.M)) == 1
    for command in ("export", "plot", "health"):
        good(command)
    assert "1 of 1" in good("history", "--verify").stderr


@pytest.mark.slow
def test_reference_targets_by_hand_and_from_a_file() -> None:
    good("add", "a.csv", *DAY)
    by_hand = ("--reading", "2.2", "2", "25", "--reading", "4.6", "5", "25", "--reading", "8.1", "8", "25")
    shown = good("reference", *by_hand, "--date", "2024-03-02").stdout
    assert "Sensor sensor, 2024-03-02: 3 targets, lengths in mm" in shown
    assert re.search(r"^  2\.2 +0\.02 +2 +25 +[+-]0\.\d{3} +0\.\d+ +[+-]0\.0\d\d +0\.\d+$", shown, re.M)
    for title in ("Curve of the day, version 2, mm", "95 % interval of a reading, ± mm"):
        assert title in shown
    Path("gauges.csv").write_text(
        "clearance_mm,voltage_V,temperature_C,uncertainty_mm\n2.2,2.01,25,0.01\n4.6,5.01,25,\n8.1,8.01,25,0.03\n"
    )
    made = json.loads(
        good("reference", "gauges.csv", "--uncertainty", "0.05mm", "--date", "2024-03-03", "--json").stdout
    )
    assert [one["uncertainty_mm"] for one in made["targets"]] == [0.01, 0.05, 0.03]
    assert all(one["now_half_width_mm"] < one["before_half_width_mm"] for one in made["targets"])
    assert made["calibration"]["version"] == 3
    good("export", "--format", "csv", "-o", "out.csv")
    assert Path("out.csv").read_text().splitlines()[-3:] == [
        "2.2,2.01,25.0,2024-03-03,0.01,,",
        "4.6,5.01,25.0,2024-03-03,0.05,,",
        "8.1,8.01,25.0,2024-03-03,0.03,,",
    ]
    for arguments in (("reference", *DAY), ("reference", "gauges.csv", *by_hand, *DAY)):
        refused("targets must be given by a file, by --reading, or live by --port, one of them", *arguments)


def test_bad_rows_are_listed_and_only_kept_out_on_request() -> None:
    with Path("a.csv").open("a") as file:
        file.write("1,2 V,20\n" + "1,2,300\n" * 25)
    message = "a.csv: every row must be valid, or skipped with --keep-good, not 26 of 86 refused"
    lines = [line for line in refused(message, "add", "a.csv", *DAY).stderr.splitlines() if line.startswith("sosmith:")]
    assert lines[:2] == [
        "sosmith: a.csv, line 62: voltage_V must be a finite number, not the text '2 V'",
        "sosmith: a.csv, line 63: temperature_C must be 0 to 128 C, not 300 (in kelvins?)",
    ]
    assert lines[20:] == ["sosmith: ... and 6 more lines; --json lists all"]
    listed = json.loads(run("add", "a.csv", *DAY, "--json").stdout)
    assert (listed["kept"], len(listed["refused"]), listed["calibration"]) == (0, 26, None)
    note = good("add", "a.csv", "--keep-good", *DAY).stderr
    assert "sosmith: stored 60 measurements from a.csv in calibration.db, 26 rows skipped\n" in note


def test_a_refused_first_file_leaves_no_store() -> None:
    Path("bad.csv").write_text(Path("a.csv").read_text() + "1,2 V,20\n")
    Path("header.csv").write_text("mm,voltage_V,temperature_C\n1,2,20\n")
    refused("bad.csv: every row must be valid, or skipped with --keep-good, not 1 of 61 refused", "add", "bad.csv")
    for arguments in (("header.csv",), ("none.csv",), ("a.csv", "--sensor", ""), ("a.csv", "--date", "today")):
        assert isinstance(run("add", *arguments).exception, SpecificationError)
    assert not Path("calibration.db").exists()
    good("add", "bad.csv", "--keep-good")
    with open_store(Path("calibration.db")) as opened:
        assert len(opened.measurements("sensor")) == 60


@pytest.mark.slow
def test_a_store_that_another_process_makes_meanwhile_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The file is read before the store is opened, and checked against it again once it is."""

    def meanwhile(*arguments: Any, **options: Any) -> Addition | None:
        with open_store(Path("calibration.db"), create=True) as opened:
            add(opened, "sensor", Path("a.csv"), "2024-03-01")
        return refused_first_file(*arguments, **options)

    monkeypatch.setattr("sosmith.interface.instrument.calibration_store.refused_first_file", meanwhile)
    refused("a.csv must hold new measurements, not those already added as a.csv", "add", "a.csv")
    Path("calibration.db").unlink()
    good("add", "b.csv")
    with open_store(Path("calibration.db")) as opened:
        assert len(opened.measurements("sensor")) == 120
    Path("calibration.db").unlink()
    Path("b.csv").write_text("1,2,3\n")
    assert isinstance(run("add", "b.csv").exception, SpecificationError)
    with open_store(Path("calibration.db")) as opened:
        assert len(opened.measurements("sensor")) == 60


def test_one_of_them_is_no_plural() -> None:
    Path("one.csv").write_text("clearance_mm,voltage_V,temperature_C\n1,2,30\n1,x,30\n")
    result = run("add", "one.csv", "--keep-good", *DAY)
    assert "sosmith: stored 1 measurement from one.csv in calibration.db, 1 row skipped\n" in result.stderr


@pytest.mark.slow
def test_a_shortfall_keeps_the_measurements_and_says_so() -> None:
    message = (
        "calibration.db, sensor sensor: adjusted r must reach 0.99999 with a polynomial up to order 6, not at most "
    )
    result = run("add", "a.csv", *DAY, *PAPER, "--required-r", "0.99999")
    assert isinstance(result.exception, ShortfallError)
    assert str(result.exception).startswith(message)
    assert "sosmith: stored 60 measurements" in result.stderr
    assert json.loads(good("fit", *DAY, "--json").stdout)["measurements"] == 60


def test_history_lists_and_verifies() -> None:
    good("add", "a.csv", *DAY, *PAPER)
    good("add", "b.csv", *PAPER, "--date", "2024-03-08", "--robust", "--required-r", "0.999")
    result = good("history", "--verify")
    assert "sosmith: every version is reproduced bit for bit: 2 of 2\n" in result.stderr
    assert re.search(r"1 +2024-03-01 +60 +1, 1 +0\.\d{5} ", result.stdout)
    assert re.search(r"2 +2024-03-08 +120 +2, 1 robust +0\.999\d\d ", result.stdout)
    listed = json.loads(good("history", "--json").stdout)
    assert [(one["version"], one["robust"], one["required_r"]) for one in listed] == [
        (1, False, 0.975),
        (2, True, 0.999),
    ]
    assert listed[0]["drift_from_previous_mm"] is None
    assert listed[1]["drift_from_previous_mm"] > 0


def test_a_file_is_withdrawn_and_the_list_says_who_did_it_and_why() -> None:
    good("add", "a.csv", *DAY, *PAPER)
    good("add", "b.csv", "--date", "2024-03-08", *PAPER)
    gone = good("withdraw", "b.csv", "--author", "A. Smith", "--reason", "gauge 4 was worn", "--date", "2024-03-09")
    assert "sosmith: withdrew 60 measurements of b.csv in calibration.db\n" in gone.stderr
    assert "Sensor sensor, version 3 of 2024-03-09: new" in gone.stdout
    shown = good("files").stdout
    assert re.search(r"^  1 +a\.csv +60 +2024-03-01 +counts$", shown, re.M)
    assert re.search(r"^  2 +b\.csv +60 +2024-03-08 +withdrawn$", shown, re.M)
    assert "b.csv was withdrawn on 2024-03-09 by A. Smith: gauge 4 was worn" in shown
    first, second = json.loads(good("files", "--json").stdout)
    assert (first["number"], first["measurements"], first["withdrawn"]) == (1, 60, None)
    assert second["withdrawn"] == {"date": "2024-03-09", "author": "A. Smith", "reason": "gauge 4 was worn"}
    assert "3 of 3" in good("history", "--verify").stderr
    result = run("withdraw", "1", "--author", "A", "--reason", "r", *DAY, "--json")
    assert isinstance(result.exception, ShortfallError)
    last = json.loads(result.stdout)
    assert last["calibration"] is None
    assert last["shortfall"] == "calibration.db, sensor sensor must hold a file that counts, not none"


def test_exports_feed_a_specification_and_give_the_same_polynomial() -> None:
    for name in ("a.csv", "b.csv"):
        good("add", name, "--sensor", "left", *DAY, *PAPER)
    good("export", "--sensor", "left", "-o", "left.toml")
    good("export", "--sensor", "left", "--format", "csv", "-o", "left.csv")
    table = good("export", "--sensor", "left").stdout
    assert table == Path("left.toml").read_text()
    assert table.startswith("# Sensor left, version 2 of 2024-03-01: 120 measurements.\n# Hash over them: ")
    coefficients = json.loads(good("history", "--sensor", "left", "--json").stdout)[-1]["coefficients"]
    made = tomllib.loads(table)["calibration"]
    assert made["coefficients"] == coefficients
    assert len(made["uncertainty"]["covariance"]) == sum(map(len, coefficients))
    fitted = fit(read_measurements(Path("left.csv"))).polynomial
    assert [[float(a) for a in row] for row in fitted.coefficients] == coefficients

    (given,) = re.findall(r"^\[calibration\]\n.*?^coefficients = .*?\n(?=#|\n|\[)", example(), flags=re.M | re.S)
    Path("spec.toml").write_text(example().replace(given, table))
    made = design_core(load(Path("spec.toml")), core="calibration")
    assert made.quantized.polynomial is not None
    assert [[float(a) for a in row] for row in made.quantized.polynomial.coefficients] == coefficients


def test_an_export_with_room_is_the_curve_to_design_hardware_with() -> None:
    good("add", "a.csv", "--sensor", "left", *DAY, *PAPER)
    own = Polynomial.from_numbers(
        tomllib.loads(good("export", "--sensor", "left").stdout)["calibration"]["coefficients"]
    )
    text = good("export", "--sensor", "left", "--room", "1").stdout
    ports = ((Fraction(0), Fraction(10)), (Fraction(0), Fraction(128)))
    expected, far = with_day_room(own, ports, Fraction(1))
    assert tomllib.loads(text) == {
        "calibration": {"coefficients": [[float(a) for a in row] for row in expected.coefficients]}
    }
    first, second, *_ = text.splitlines()
    assert first == (
        f"# To design hardware with, not to measure with: off by up to {float(far):.3g} mm until a set is loaded."
    )
    assert second == "# Every curve within 1 mm of sensor left, version 1 of 2024-03-01, fits."


def test_room_is_for_coefficients() -> None:
    good("add", "a.csv", *DAY, *PAPER)
    refused("--format must be toml with --room, not csv", "export", "--room", "1", "--format", "csv")


def test_an_older_version_can_be_exported() -> None:
    good("add", "a.csv", *DAY, *PAPER)
    before = good("export").stdout
    good("add", "b.csv", *DAY, *PAPER)
    assert good("export", "--version", "1").stdout == before != good("export").stdout
    refused("the version of sensor sensor must be 1 to 2, not 3", "export", "--version", "3")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "start"), [("p.svg", b"<?xml"), ("p.png", b"\x89PNG")])
def test_plots_are_the_same_bytes_twice(name: str, start: bytes) -> None:
    good("add", "a.csv", *DAY, *PAPER, "--robust")
    good("add", "b.csv", *DAY, *PAPER)
    drawn = []
    for _ in range(2):
        good("plot", "-o", name)
        drawn.append(Path(name).read_bytes())
    assert drawn[0] == drawn[1]
    assert drawn[0].startswith(start)
    if name == "p.svg":
        for text in ("Coverage: ", "Residuals: ", "Leverage of each", "History", "version 2 of 2024-03-01"):
            assert text in drawn[0].decode()


@pytest.mark.slow
def test_a_bayesian_calibration_says_what_it_is_worth() -> None:
    good("add", "a.csv", *DAY)
    shown = re.sub(r" {2,}", "  ", good("add", "b.csv", "--date", "2024-03-08").stdout)
    for row in (
        "  method  bayes, type equation_5a, for 2024-03-08, with the day's own curve",
        "  orders  2 in voltage, 1 in temperature",
        "95 % interval of a reading, ± mm",
    ):
        assert row in shown
    assert re.search(r"95 % interval of a reading  ±0\.0\d+ to ±0\.0\d+ mm where there are measurements", shown)
    assert re.search(r"inside their 95 % intervals  \d+\.\d % of 1[12]\d measurements, each from other days", shown)
    made = json.loads(good("fit", "--date", "2024-03-08", "--json").stdout)
    assert (made["method"], made["type"], made["new"], made["warnings"]) == ("bayes", "equation_5a", False, [])
    worth = made["uncertainty"]
    assert 0.04 < worth["scatter_mm"] < 0.06
    assert worth["day_curve"] is True
    assert worth["lack_of_fit"]["structured"] is False
    assert 0.85 < worth["over_days"]["inside"] <= 1
    half, error = worth["plane"]["half_width_mm"], worth["plane"]["standard_error_mm"]
    assert [len(row) for row in half] == [6] * 4
    assert all(h > e > 0 for some, others in zip(half, error, strict=True) for h, e in zip(some, others, strict=True))
    low, high = worth["half_width_mm"]["smallest"], worth["half_width_mm"]["largest"]
    assert 0 < low < high < 0.2
    assert "2 of 2" in good("history", "--verify").stderr
    assert "2, 1 bayes" in good("history").stdout


@pytest.mark.slow
def test_a_fit_with_a_curve_in_its_residuals_is_warned_of() -> None:
    """The linear polynomial that reaches r = 0.975 misses the curve of the sensor."""
    warned = good("add", "a.csv", *DAY, *PAPER)
    assert re.search(
        r"^sosmith: warning: the residuals follow a curve along the voltage of about 0\.3\d* mm rms that the fit "
        r"misses: neighbours differ by a scatter of 0\.\d+ mm rms only$",
        warned.stderr,
        re.M,
    )
    (warning,) = json.loads(good("fit", *DAY, *PAPER, "--json").stdout)["warnings"]
    assert warning in warned.stderr
    assert "warning" not in good("fit", *DAY).stderr


def test_acceptance_in_millimetres_raises_the_orders() -> None:
    printed = good("add", "a.csv", *DAY, *PAPER, "--accept", "0.2mm").stdout
    shown = re.sub(r" {2,}", "  ", printed)
    assert "  orders  2 in voltage, 1 in temperature" in shown
    assert "  accepted  ±0.2 mm or less" in shown
    assert "1 of 1" in good("history", "--verify").stderr


@pytest.mark.parametrize("method", ["paper", "bayes"])
def test_a_calibration_that_is_not_good_enough_in_millimetres_is_not_accepted(method: str) -> None:
    result = run("add", "a.csv", *DAY, "--method", method, "--accept", "0.001mm")
    assert isinstance(result.exception, ShortfallError)
    assert re.fullmatch(
        r"calibration\.db, sensor sensor: the calibration must hold 95 % of the clearances within 0\.001 mm wherever "
        r"there are measurements, not within 0\.0\d+ mm only",
        str(result.exception),
    )


@pytest.mark.slow
def test_the_type_of_a_sensor_is_kept() -> None:
    Path("own.toml").write_text('name = "own"\ncurve = [1.2, 0.37, -0.004, 0.0007, 0.058]\ngain = 0.1\n')
    first = json.loads(good("add", "a.csv", *DAY, "--type", "own.toml", "--json").stdout)["calibration"]
    assert first["type"] == "own"
    assert json.loads(good("fit", *DAY, "--json").stdout)["new"] is False
    other = json.loads(good("fit", *DAY, "--type", "equation_4", "--json").stdout)
    assert (other["type"], other["version"], other["new"]) == ("equation_4", 2, True)
    assert other["coefficients"] != first["coefficients"]
    assert "2 of 2" in good("history", "--verify").stderr


@pytest.mark.slow
def test_advice_reaches_what_it_promises() -> None:
    good("add", "a.csv", *DAY)
    call = ("advise", "2mm", "4 mm", "--within", "0.05mm", "--temperature", "60", "--date", "2024-03-02")
    shown = good(*call).stdout
    assert re.search(r"^Sensor sensor, 2024-03-02: \d+ measurements$", shown, re.M)
    told = json.loads(good(*call, "--json").stdout)
    assert told["reached"] is True
    assert sum(one["count"] for one in told["measurements"]) < 20
    assert [one["clearance_mm"] for one in told["half_width_mm"]] == [2, 4]
    assert all(one["with"] <= 0.05 < one["without"] for one in told["half_width_mm"])
    result = run(*call, "--most", "1")
    assert isinstance(result.exception, ShortfallError)
    assert re.fullmatch(
        r"the intervals must be within 0\.05 mm, and 1 measurement brings them to 0\.\d+ mm only", str(result.exception)
    )
    enough = good("advise", "2mm", "--within", "1mm", "--date", "2024-03-02").stdout
    assert enough.startswith("Sensor sensor, 2024-03-02: nothing to measure, all are within ±1 mm\n")
    assert "times" not in enough


@pytest.mark.slow
def test_a_sensor_mounted_anew_raises_an_alarm_until_it_is_accepted() -> None:
    generator = np.random.default_rng(1)
    rows = []
    for day in range(1, 13):
        V, T = generator.uniform(0.5, 9.5, 12), generator.uniform(20, 90, 12)
        d = EQUATION_5A(V, T) + generator.normal(0, 0.05, 12) + (0.8 if day >= 8 else 0.0)
        rows += [
            f"{a!r},{b!r},{c!r},2024-03-{day:02}" for a, b, c in zip(d.tolist(), V.tolist(), T.tolist(), strict=True)
        ]
    Path("days.csv").write_text("\n".join(["clearance_mm,voltage_V,temperature_C,date", *rows, ""]))
    good("add", "days.csv", "--date", "2024-03-12")
    result = run("health", "--plot", "health.svg")
    assert isinstance(result.exception, ShortfallError)
    assert re.search(r"^Sensor sensor: \d alarms?; 11 days on the charts, to 2024-03-12", result.stdout, re.M)
    assert "the offset stepped up; all clearances stepped alike" in " ".join(result.stdout.split())
    assert Path("health.svg").read_bytes().startswith(b"<?xml")
    told = json.loads(run("health", "--json").stdout)
    first = told["alarms"][0]
    assert (first["chart"], first["date"], first["explanation"]) == ("offset step", "2024-03-08", "mounted anew")
    assert len(told["days"]) == 12
    assert good("health", "--since", "2024-03-11").stdout.startswith("Sensor sensor: no alarm; 2 days on the charts")


@pytest.mark.slow
def test_health_says_which_measurements_it_leaves_out() -> None:
    """Those of `add` are others: off the polynomial of all days."""
    for number, month in enumerate(("march", "april"), start=3):
        file = EXAMPLES / "measurements" / f"{month}.csv"
        good("add", str(file), "--date", f"2024-0{number}-01")
    shown = " ".join(good("health").stdout.split())
    assert "1 day on the charts" in shown
    assert re.search(r"; \d+ of 90 measurements left out, off the plane of their own day", shown)


@pytest.mark.slow
def test_an_export_carries_what_the_calibration_is_worth(tmp_path: Path) -> None:
    good("add", "a.csv", *DAY)
    table = tomllib.loads(good("export").stdout)["calibration"]
    assert len(table["uncertainty"]["covariance"]) == 5
    spec = Specification.example().replaced(calibration=table)
    found = instrument_of(spec.checked)
    assert found is not None
    assert 0 < found.budget(np.array([5.0]), np.array([50.0])).expanded.item() < 0.2


UNFIT = {
    "no store": (
        ("history",),
        "calibration.db must be an existing store of measurements; sosmith calibrate add creates one",
    ),
    "no file": (("add", "none.csv"), "none.csv must be a readable CSV or XLSX file (no such file or directory)"),
    "r of the other method": (
        ("add", "a.csv", "--required-r", "0.99"),
        "--required-r must go with --method paper, not with --method bayes",
    ),
    "robust of the other method": (
        ("add", "a.csv", "--robust"),
        "--robust must go with --method paper, not with --method bayes",
    ),
    "no length": (("add", "a.csv", "--accept", "0.2"), "--accept must be a length such as 0.2mm, not '0.2'"),
    "no clearance": (("advise", "two"), "CLEARANCE must be a length such as 0.2mm, not 'two'"),
    "no type": (
        ("add", "a.csv", "--type", "coil"),
        "the type of a sensor must be one of equation_5a, equation_4, or a TOML file, not 'coil'",
    ),
    "no day": (("add", "a.csv", "--date", "yesterday"), "date must be a date such as 2024-03-01, not 'yesterday'"),
    "range upside down": (
        ("add", "a.csv", "--voltage-range", "10", "0"),
        "--voltage-range must be two numbers, the lower one first, not 10 0",
    ),
    "r that is none": (("fit", "--required-r", "nan"), "--required-r must be 0 or more and less than 1, not nan"),
    "r that nothing reaches": (("fit", "--required-r", "1"), "--required-r must be 0 or more and less than 1, not 1"),
    "sensor without a name": (("add", "a.csv", "--sensor", " "), "the sensor's name must be printable text, not ' '"),
    "kind of plot": (("plot", "-o", "p.pdf"), "p.pdf: the plot's name must end in .svg or .png, not .pdf"),
}


@pytest.mark.parametrize(("arguments", "message"), UNFIT.values(), ids=UNFIT)
def test_refusals(arguments: tuple[str, ...], message: str) -> None:
    refused(message, *arguments)


def test_an_unknown_sensor_is_told_which_there_are() -> None:
    for sensor in ("left", "right"):
        good("add", "a.csv", "--sensor", sensor, *DAY)
    for command in ("fit", "history", "export", "plot"):
        refused("calibration.db: the sensor must be one of left, right, not up", command, "--sensor", "up")


def test_help_shows_every_command_and_its_options() -> None:
    assert list(calibrate.commands) == [
        *("add", "reference", "fit", "files", "withdraw", "history", "export", "plot", "advise", "health")
    ]
    for command in calibrate.commands:
        shown = good(command, "--help").stdout
        for option in ("--store", "--sensor"):
            assert option in shown
    assert "--keep-good" in good("add", "--help").stdout
