"""`sosmith wear` and its files as a user meets them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from tests.commands.invocation import Invocation

from sosmith.gen.specification.specification import example
from sosmith.instrument.wear.record_file import moment_text, parse_moment, read_wear_record
from sosmith.model.errors import SpecificationError

INVOCATION = Invocation("wear", columns=100)
run, good, refused = INVOCATION.run, INVOCATION.good, INVOCATION.refused

LIMITS = ("--initial", "1.5", "--limit", "9")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Start in a folder with records of 0.1 mm a day in several times."""
    monkeypatch.chdir(tmp_path)
    clearances = [f"{1.5 + 0.1 * k:.6g}" for k in range(80)]
    for name, header, times in (
        ("days", "days", [str(k) for k in range(80)]),
        ("seconds", "time_s", [str(86400 * k) for k in range(80)]),
        ("hours", "hours", [str(24 * k) for k in range(80)]),
        ("dates", "date", [moment_text(19_783 + k)[:10] for k in range(80)]),
    ):
        rows = [f"{time},{clearance},driver {time}" for time, clearance in zip(times, clearances, strict=True)]
        Path(f"{name}.csv").write_text("\n".join([f"{header},clearance_mm,remark", *rows]) + "\n")
    return tmp_path


@pytest.mark.parametrize("name", ["days", "seconds", "hours", "dates"])
def test_times_of_all_kinds_give_the_same(name: str) -> None:
    tree = json.loads(good(f"{name}.csv", *LIMITS, "--warning", "7", "--json").stdout)
    assert tree["rate_mm_per_day"]["value"] == pytest.approx(0.1)
    assert tree["duration_days"] == pytest.approx(79)
    assert tree["wear_mm"] == pytest.approx(7.9)
    assert tree["life_days"]["value"] == pytest.approx(11)
    assert tree["state"] == "warning"
    assert tree["first_warning_days"] - tree["duration_days"] in (pytest.approx(-9), pytest.approx(19_783 - 9))


def test_the_table_names_units_and_dates() -> None:
    shown = re.sub(r" {2,}", "  ", good("dates.csv", *LIMITS, "--warning", "7").stdout)
    for row in (
        "Wear by dates.csv: warning",
        "  record  80 readings over 79 days",
        "  wear  7.9 mm",
        "  remaining  1.1 mm to the limit of 9 mm",
        "  rate  0.1 mm a day (0.1 to 0.1 at 95 %), 36.5 mm a year",
        "  first warning  2024-05-10 00:00; 1 of the 1 readings of the last block",
    ):
        assert row in shown


def test_the_limits_of_a_specification() -> None:
    Path("my.toml").write_text(
        example().replace("channels = 1", "channels = 2")
        + "\n[wear]\ninitial = [1.5, 2.5]\nwarning = 6.0\nlimit = 9.0\nsensor_range = 10.5\n"
    )
    first, second = (
        json.loads(good("days.csv", "--spec", "my.toml", "--channel", channel, "--json").stdout)
        for channel in ("0", "1")
    )
    assert (first["wear_mm"], second["wear_mm"]) == (pytest.approx(7.9), pytest.approx(6.9))
    assert second["limits_mm"]["critical_clearance"] == 10.5
    end = good("days.csv", "--spec", "my.toml", "--channel", "1").stdout
    assert "to the end of the sensor's range, 10.5 mm, which comes before the limit" in end
    refused("my.toml: channel must be below 2, the count of channels, not 2", "days.csv", "--spec", "my.toml",
            "--channel", "2")  # fmt: skip
    refused("the limits must be given by --spec or one by one, not both", "days.csv", "--spec", "my.toml", *LIMITS)


def test_limits_of_all_channels_hold_for_each() -> None:
    Path("all.toml").write_text(
        example().replace("channels = 1", "channels = 2") + "\n[wear]\ninitial = 1.5\nwarning = 6.0\nlimit = 9.0\n"
    )
    first, second = (good("days.csv", "--spec", "all.toml", "--channel", channel).stdout for channel in ("0", "1"))
    assert first == second
    refused("all.toml: channel must be below 2, the count of channels, not 2", "days.csv", "--spec", "all.toml",
            "--channel", "2")  # fmt: skip
    refused("--channel must come with --spec or with a column channel, not without both", "days.csv", *LIMITS,
            "--channel", "1")  # fmt: skip


def test_a_turned_wheel_is_told() -> None:
    rows = [f"{day},{5 + 0.1 * day - 3 * (day >= 25):.6g}" for day in range(40)]
    Path("turned.csv").write_text("\n".join(["days,clearance_mm", *rows]) + "\n")
    shown = re.sub(r"\s+", " ", good("turned.csv", *LIMITS).stdout)
    assert "fall 3 mm, 14.5 days ago, as after turning a wheel or remounting a sensor" in shown
    assert "use --window 14.5 to take the rate from there on" in shown
    assert json.loads(good("turned.csv", *LIMITS, "--json").stdout)["fall"]["window_days"] == 14.5
    after = json.loads(good("turned.csv", *LIMITS, "--window", "14.5", "--json").stdout)
    assert after["fall"] is None
    assert after["rate_mm_per_day"]["value"] == pytest.approx(0.1)


def test_the_channels_of_a_record_are_told_apart() -> None:
    rows = [f"{day},{channel},{1.5 + (channel + 1) * 0.1 * day:.6g}" for day in range(20) for channel in (0, 1)]
    Path("two.csv").write_text("\n".join(["days,channel,clearance_mm", *rows]) + "\n")
    for channel in (0, 1):
        tree = json.loads(good("two.csv", *LIMITS, "--channel", str(channel), "--json").stdout)
        assert tree["samples"] == 20
        assert tree["rate_mm_per_day"]["value"] == pytest.approx(0.1 * (channel + 1))
    assert "20 readings of channel 0 over 19 days" in good("two.csv", *LIMITS).stdout
    refused("two.csv must have rows of channel 2, not only of 0, 1", "two.csv", *LIMITS, "--channel", "2")


def test_a_specification_in_another_unit_is_refused() -> None:
    Path("um.toml").write_text(
        example().replace('unit = "mm"', 'unit = "um"') + "\n[wear]\ninitial = 1.5\nwarning = 6.0\nlimit = 9.0\n"
    )
    refused("um.toml: output.unit must be 'mm' for --spec, not 'um'", "days.csv", "--spec", "um.toml")


@pytest.mark.slow
def test_plots() -> None:
    for name in ("a.svg", "b.svg", "c.png"):
        assert f"sosmith: wrote {name}\n" in good("days.csv", *LIMITS, "--plot", name).stderr
    assert Path("a.svg").read_bytes() == Path("b.svg").read_bytes()
    assert Path("c.png").read_bytes().startswith(b"\x89PNG")


def test_refusals() -> None:
    refused("the limits must be given by --initial and --limit, or by --spec, not left out", "days.csv")
    refused("f.pdf: the plot's name must end in .svg or .png, not .pdf", "days.csv", *LIMITS, "--plot", "f.pdf")
    Path("plain.toml").write_text(example())
    refused("plain.toml: the specification must have a table [wear] for --spec, not none", "days.csv", "--spec",
            "plain.toml")  # fmt: skip
    refused("days.csv must have a clearance column (z_mm), not only days, clearance_mm, remark", "days.csv",
            *LIMITS, "--column", "z_mm")  # fmt: skip
    refused("days.csv: the clearance column must differ from the time column, not be days too", "days.csv", *LIMITS,
            "--column", "days")  # fmt: skip
    Path("um.csv").write_text("days,clearance_um\n0,1500\n1,1501\n")
    refused("um.csv: the clearance column must be in mm, not clearance_um", "um.csv", *LIMITS, "--column",
            "clearance_um")  # fmt: skip
    refused("window must be at least 1 days, from the last reading to one before it, not 0.5 days", "days.csv", *LIMITS,
            "--window", "0.5")  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", " must hold a header line and rows of numbers, not be empty"),
        (
            "when,clearance_mm\n1,2\n",
            " must have a time column (time_s, date, days, time_days, time_d, hours, time_h), not only when, "
            "clearance_mm",
        ),
        (
            "days;clearance_mm\n1;2\n",
            ", line 1: cells must be separated by commas, with decimal points, not by semicolons",
        ),
        ("days,clearance_mm\n1,2\n0.5,2\n", ", line 3: days must be no earlier than in the previous row, not go back"),
        ("days,clearance_mm\n1,worn\n", ", line 2: clearance_mm must be a finite number, not 'worn'"),
        (
            "date,clearance_mm\n2024-13-01,2\n",
            ", line 2: date must be a date such as 2024-03-01 or 2024-03-01T06:30, not '2024-13-01'",
        ),
    ],
)
def test_files_that_are_refused(text: str, message: str) -> None:
    path = Path("bad.csv")
    path.write_text(text)
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read_wear_record(path)


def test_moments() -> None:
    assert parse_moment("2024-03-01") == 19_783
    assert parse_moment("2024-03-01T12:00+01:00") == pytest.approx(19_783 + 11 / 24)
    assert moment_text(parse_moment("2024-03-01T06:30")) == "2024-03-01 06:30"


def test_wear_is_followed_over_days_and_a_jump_is_told() -> None:
    rows = [f"{k},{1.5 + 0.1 * k - 0.5 * (k >= 60) + 0.02 * (-1) ** k:.6g}" for k in range(66)]
    Path("jump.csv").write_text("\n".join(["days,clearance_mm", *rows]) + "\n")
    call = ("jump.csv", *LIMITS, "--risk", "0.05", "--day-error", "0.02")
    shown = re.sub(r" {2,}", "  ", good(*call).stdout)
    assert "  past the limit  with a probability of 0: not critical at a risk of 0.05" in shown
    assert re.search(
        r"^  told  a jump of about -0\.[45]\d* mm at day 60, seen at day 60 with a probability of 1$", shown, re.M
    )
    tree = json.loads(good(*call, "--json").stdout)["over_days"]
    assert tree["clearance_mm"]["value"] == pytest.approx(7.5, abs=0.03)
    assert [(one["what"], one["days"]) for one in tree["told"]] == [("jump", 60.0)]
    assert tree["day_error_mm"] == 0.02
    assert json.loads(good("jump.csv", *LIMITS, "--json").stdout)["over_days"] is None


def test_wear_is_critical_before_the_reading_is_past_the_limit() -> None:
    call = ("days.csv", "--initial", "1.5", "--limit", "7.95", "--risk", "0.05", "--day-error", "0.2")
    tree = json.loads(good(*call, "--json").stdout)
    assert (tree["state"], tree["over_days"]["critical"]) == ("good", True)
    assert 0.05 < tree["over_days"]["probability_past_the_limit"] < 0.5


def test_an_error_of_a_day_goes_with_a_risk() -> None:
    refused("--day-error must go with --risk, not without it", "days.csv", *LIMITS, "--day-error", "0.1")


@pytest.mark.slow
def test_the_known_sum_of_an_axle_narrows_both_wheels() -> None:
    errors = [0.2 * (-1) ** (k // 2) for k in range(40)]
    rows = [f"{k},{2 + 0.05 * k + off:.6g},{3 + 0.05 * k + off:.6g},{5 + 0.1 * k:.6g}" for k, off in enumerate(errors)]
    Path("axle.csv").write_text("\n".join(["days,clearance_mm,right_mm,both_mm", *rows]) + "\n")
    call = ("axle.csv", *LIMITS, "--risk", "0.05", "--day-error", "0.2", "--other-wheel", "right_mm")
    alone, summed = (
        json.loads(good(*call, *more, "--json").stdout)["over_days"] for more in ((), ("--sum", "both_mm"))
    )
    for found, widest in ((alone, 0.5), (summed, 0.35)):
        left, right = found["clearance_mm"], found["other_wheel_mm"]
        assert left["low"] < 3.95 < left["high"]
        assert right["low"] < 4.95 < right["high"]
        assert left["high"] - left["low"] < widest
    assert summed["clearance_mm"]["standard"] < 0.85 * alone["clearance_mm"]["standard"]
    assert "  other wheel" in good(*call, "--sum", "both_mm", "--sum-error", "0.05").stdout
    refused(
        "the sum of both clearances must come with that of the other wheel, not without it",
        *call[:7],
        "--sum",
        "both_mm",
    )
    refused("total_error must be 0.001 mm or more, not 0 mm", *call, "--sum", "both_mm", "--sum-error", "0")
    refused("--other-wheel must go with --risk, not without it", "axle.csv", *LIMITS, "--other-wheel", "right_mm")
