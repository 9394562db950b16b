"""Reports side by side: what is best, what is refused, and the page."""

from __future__ import annotations

import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from sosmith.gen.report.comparison import (
    Row,
    column_names,
    compare,
    comparison_json,
    comparison_page,
    load_report,
)
from sosmith.model.errors import SpecificationError


def report(**changes: Any) -> dict[str, Any]:
    """Report with the keys a comparison needs; an entry of `changes` with a dot goes one level down."""
    made: dict[str, Any] = {
        "name": "flange_wear",
        "realization": "df1_ef2",
        "simulator": "verilator",
        "passed": True,
        "bit_exact": True,
        "samples": 20000,
        "cycles_per_sample": 3.0,
        "error": {"unit": "mm", "max_abs": 0.00012, "max_lsb": 0.5, "rms": 0.00007, "bound": 0.0002},
        "sqnr_db": 99.0,
        "accuracy_percent": {"unfiltered": 95.0, "golden": 98.0, "hardware": 98.0},
    }
    for key, value in changes.items():
        *path, last = key.split(".")
        place = made
        for part in path:
            place = place[part]
        place[last] = value
    return made


def rows_of(*reports: dict[str, Any]) -> dict[str, Row]:
    return {row.key: row for row in compare(reports)}


PLAIN = {"realization": "df1", "passed": False, "error.max_abs": 0.42, "error.max_lsb": 1700.0, "sqnr_db": 30.0}


def test_rows_show_values_with_units() -> None:
    rows = rows_of(report(), report(**PLAIN))
    assert rows["error.max_abs"].values == (0.00012, 0.42)
    assert rows["error.max_abs"].cells == ("120 nm", "420 µm")
    assert rows["error.max_lsb"].cells == ("0.500 LSB", "1,700 LSB")
    assert rows["passed"].cells == ("passed", "falls short")
    assert rows["accuracy_percent.hardware"].cells == ("98.0000 %", "98.0000 %")
    assert rows["samples"].cells == ("20,000", "20,000")


def test_best_is_smallest_error_and_largest_ratio() -> None:
    rows = rows_of(report(**PLAIN), report(), report(**PLAIN))
    assert rows["error.max_abs"].best == (1,)
    assert rows["sqnr_db"].best == (1,)


def test_equal_values_have_no_best() -> None:
    """Equal to the digits shown: 3.0001 and 3 cycles per sample are both 3.00."""
    rows = rows_of(report(), report(cycles_per_sample=3.0001))
    assert rows["error.max_abs"].best == ()
    assert rows["cycles_per_sample"].best == ()


def test_best_is_shared() -> None:
    assert rows_of(report(), report(), report(**PLAIN))["error.max_abs"].best == (0, 1)


def test_no_best_across_units() -> None:
    rows = rows_of(report(), report(**PLAIN, **{"error.unit": "V"}))
    assert {row.best for row in rows.values()} == {()}
    assert rows["error.max_abs"].cells == ("120 nm", "420 mV")


def test_unknown_values_never_win() -> None:
    rows = rows_of(report(sqnr_db=None), report(sqnr_db=10.0), report(sqnr_db=20.0))
    assert rows["sqnr_db"].cells == ("—", "10.00 dB", "20.00 dB")
    assert rows["sqnr_db"].best == (2,)


def test_nothing_to_compare() -> None:
    with pytest.raises(ValueError, match=r"^reports must hold at least one report, not none$"):
        compare([])


def test_column_names_tell_reports_apart() -> None:
    assert column_names([report(), report(name="audio")]) == ["flange_wear", "audio"]
    assert column_names([report(), report(realization="df1"), report()]) == [
        "flange_wear, df1_ef2 (1)",
        "flange_wear, df1",
        "flange_wear, df1_ef2 (2)",
    ]


def test_json_is_plain_data() -> None:
    content = json.loads(json.dumps(comparison_json([report(), report(**PLAIN)]), allow_nan=False))
    assert content["names"] == ["flange_wear, df1_ef2", "flange_wear, df1"]
    by_key = {row["key"]: row for row in content["rows"]}
    assert by_key["error.max_abs"] == {
        "key": "error.max_abs",
        "title": "largest error",
        "values": [0.00012, 0.42],
        "best": [0],
    }


class Words(HTMLParser):
    """Collects the tags and the text of a page."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.words: list[str] = []
        self.feed(content)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def test_page() -> None:
    content = comparison_page([report(), report(**PLAIN)])
    assert content == comparison_page([report(), report(**PLAIN)])
    assert "1 of 2 passed." in content
    assert content.count('class="best"') == 3
    assert not re.search(r"https?:|url\((?!#)|@import|<script", content)


def test_page_escapes_names() -> None:
    page = Words(comparison_page([report(name="<script>&amp;"), report(simulator="<script>")]))
    assert "script" not in page.tags
    assert "<script>&amp;" in page.words


def test_page_of_different_units_has_no_picture() -> None:
    assert "<svg" in comparison_page([report(), report()])
    assert "<svg" not in comparison_page([report(), report(**{"error.unit": "V"})])


def test_load_by_file_and_by_folder(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text(json.dumps(report()), encoding="utf-8")
    assert load_report(tmp_path) == report()
    assert load_report(tmp_path / "report.json") == report()


_OUT_OF_RANGE = "JSON with a number out of range as error.max_abs"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("name = 1", "text that is no JSON"),
        ('{"sqnr_db": NaN}', "text that is no JSON"),
        ("[" * 100_000 + "]" * 100_000, "text that is no JSON"),
        ("[]", "JSON without name"),
        (json.dumps(report(**{"error.max_abs": math.inf})).replace("Infinity", "1e999"), _OUT_OF_RANGE),
        (json.dumps(report(**{"error.max_abs": 10**400})), _OUT_OF_RANGE),
        (json.dumps(report(error=3)), "JSON without error.unit"),
        (json.dumps(report(**{"error.max_abs": "small"})), "JSON with 'small' as error.max_abs"),
        (json.dumps(report(samples=True)), "JSON with True as samples"),
        (json.dumps(report(passed=1)), "JSON with 1 as passed"),
        (json.dumps(report(name="\ud800")), "JSON with '\\ud800' as name"),
        (json.dumps(report(simulator="one\ntwo")), "JSON with 'one\\ntwo' as simulator"),
        (json.dumps(report(samples="x" * 1000)), "JSON with 'xxxxxxxxxxxx...xxxxxxxxxxxxx' as samples"),
    ],
)
def test_load_refuses_what_is_no_report(tmp_path: Path, content: str, reason: str) -> None:
    path = tmp_path / "report.json"
    path.write_text(content, encoding="utf-8")
    message = f"{path} must be a report.json of sosmith, not {reason}"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        load_report(path)


def test_load_refuses_bytes(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_bytes(b"\xff\xfe\x00")
    message = f"{path} must be a report.json of sosmith, not text that is no JSON"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        load_report(path)


def test_load_refuses_a_missing_file(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nowhere"):
        message = f"{path} must be a readable report.json or a folder that holds one, not: no such file or directory"
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            load_report(path)
