"""Reports side by side: what is best, what is refused, and the page."""

from __future__ import annotations

import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from tests.gen.report.reports import WORSE, report

from sosmith.gen.report.comparison.baseline import Judgement, judge, read_tolerances
from sosmith.gen.report.comparison.choice import choose, cost_unit
from sosmith.gen.report.comparison.differences import alike, differences
from sosmith.gen.report.comparison.fairness import fairness
from sosmith.gen.report.comparison.markdown import comparison_markdown
from sosmith.gen.report.comparison.page import comparison_page
from sosmith.gen.report.comparison.pictures import response_figure
from sosmith.gen.report.comparison.report_file import load_report
from sosmith.gen.report.comparison.rows import Row, column_names, compare
from sosmith.gen.report.comparison.summary import comparison_json
from sosmith.model.errors import SpecificationError


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


def test_parts_of_a_bound_are_shown_where_they_count_in_any_report() -> None:
    parts = ({"start": 3e-64, "rounding": 1e-4}, {"start": 3e-64, "rounding": 1e-9, "calibration": 0.0})
    rows = rows_of(*(report(**{"error.bound": 2e-4, "error.parts": each}) for each in parts))
    assert [key for key in rows if key.startswith("error.parts.")] == ["error.parts.rounding"]
    assert rows["error.parts.rounding"].values == (1e-4, 1e-9)


def test_errors_against_the_true_value_are_shown_where_all_have_them() -> None:
    known = {"true_error": {"max_abs": 0.5, "rms": 0.1, "mean": 0.0, "readings": 9}}
    better = report(true_error={**known["true_error"], "max_abs": 0.4})
    rows = rows_of(report(**known), better)
    assert (rows["true_error.max_abs"].cells, rows["true_error.max_abs"].best) == (
        ("500 µm", "400 µm"),
        (1,),
    )
    assert (rows["true_error.rms"].cells, rows["true_error.rms"].best) == (("100 µm", "100 µm"), ())
    assert not {"true_error.max_abs", "true_error.rms"} & {*rows_of(report(**known), report())}
    assert judged(report(**known), "true_error=0").judged[0].verdict == "not comparable"  # the baseline has none
    (beside,) = judge(report(**known), [better], read_tolerances("true_error=5%"))
    assert beside.passed
    (beside,) = judge(better, [report(**known)], read_tolerances("true_error=5%"))
    assert beside.reasons == ["largest error against the true value: 500 µm instead of 400 µm (+25.00 %), 5% allowed."]


def test_best_is_smallest_error_and_largest_ratio() -> None:
    rows = rows_of(report(**PLAIN), report(), report(**PLAIN))
    assert rows["error.max_abs"].best == (1,)
    assert rows["sqnr_db"].best == (1,)


def test_equal_values_have_no_best() -> None:
    """Equal to the digits shown: 3.0001 and 3 cycles per sample are both 3.00."""
    rows = rows_of(report(), report(**{"error.rms": 0.0000700001}))
    assert rows["error.max_abs"].best == ()
    assert rows["error.rms"].best == ()


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
    with pytest.raises(ValueError, match=r"^reports must hold at least two reports, not 1$"):
        compare([report()])


OTHER_JOB = {"provenance.reference_sha256": "a" * 64}
OTHER_TRACE = {"provenance.trace_sha256": "b" * 64, "scenario": "steps"}


def test_no_winner_between_different_jobs() -> None:
    different = report(**WORSE, **OTHER_JOB)
    assert {row.best for row in compare([report(), different])} == {()}
    reason = "The exact calculations differ (inputs, calibration, filter, output range or channels)."
    assert set(vars(fairness([report(), different])).values()) == {reason}


def test_errors_on_different_traces_have_no_winner_but_costs_do() -> None:
    rows = rows_of(report(), report(**WORSE, **OTHER_TRACE))
    assert rows["error.max_abs"].best == ()
    assert rows["provenance.cost.luts"].best == rows["latency_cycles"].best == (0,)
    assert fairness([report(), report(**OTHER_TRACE)]).accuracy == "The input codes differ: traces wear_ramp, steps."


def test_estimates_for_one_fpga_are_compared_between_architectures() -> None:
    known = {"provenance.cost.device": "ECP5 LFE5U-25F", "provenance.cost.within": 0.12}
    reports = [report(**known), report(architecture="serial", **known, **WORSE)]
    assert fairness(reports).cost == ""
    assert rows_of(*reports)["provenance.cost.luts"].best == (0,)
    unit = "LUT4 equivalents, estimated before synthesis for ECP5 LFE5U-25F, 9 of 10 to within 12 %"
    assert cost_unit(reports[0]) == unit


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (
            {"provenance.cost.source": "synthesis", "provenance.cost.board": "icestick"},
            "The costs have different origins: estimate before synthesis, synthesis for icestick.",
        ),
        (
            {"architecture": "serial"},
            "Estimates of an earlier version cannot be compared between architectures: parallel, serial.",
        ),
        (
            {"provenance.cost.device": "ECP5 LFE5U-25F"},
            "The costs are estimates of different versions, or for different FPGAs.",
        ),
    ],
)
def test_costs_of_different_origins_have_no_winner(changes: dict[str, Any], reason: str) -> None:
    reports = [report(), report(**changes, **WORSE)]
    assert fairness(reports).cost == reason
    assert rows_of(*reports)["provenance.cost.luts"].best == ()
    assert rows_of(*reports)["error.max_abs"].best == (0,)


def test_reports_of_earlier_versions_have_no_winner() -> None:
    old = {key: value for key, value in report(**WORSE).items() if key not in {"provenance", "curves"}}
    assert rows_of(report(), old)["error.max_abs"].best == ()
    told = "A report of an earlier version does not tell which exact calculation the hardware was held against."
    assert fairness([report(), old]).bounds == told
    assert "<svg" in comparison_page([report(), old])


def test_what_differs() -> None:
    """Keys of the specification with what is missing, then the trace, the datapath and the tools."""
    other = report(**OTHER_TRACE, simulator="icarus", realization="df1")
    other["provenance"]["specification"] = {"name": "flange_wear", "filter": {"order": 5}, "channels": 2}
    found = [(one.group, one.title, one.cells) for one in differences([report(), other])]
    assert found == [
        ("specification", "filter.order", ("7", "5")),
        ("specification", "filter.cutoff", ("[0.25]", "not set")),
        ("specification", "channels", ("not set", "2")),
        ("trace", "trace", ("wear_ramp", "steps")),
        ("trace", "input codes, SHA-256", ("2" * 12, "b" * 12)),
        ("datapath", "realization", ("df1_ef2", "df1")),
        ("tools", "simulator", ("verilator", "icarus")),
    ]
    assert ("samples", "20,000") in alike([report(), other])
    assert not {"trace", "simulator", "realization"} & {title for title, _ in alike([report(), other])}
    assert differences([report(), report()]) == []


@pytest.mark.slow
def test_differences_are_rows_and_designs_columns() -> None:
    page = comparison_page([report(), report(realization="df1")])
    cells = '<td class="piece">df1_ef2</td><td class="piece">df1</td>'
    assert f'<tr><th scope="row">datapath: realization</th>{cells}</tr>' in page


def test_the_axis_of_frequency_reaches_to_the_fastest() -> None:
    """Of filters at 100 Hz and at 1 kHz: the first ends at 50 Hz, the axis does not."""
    slow, fast = report(), report()
    fast["curves"]["filter"] = slow["curves"]["filter"] | {"sample_rate": 1000.0}
    figure = response_figure((slow, fast), ("a", "b"))
    assert figure is not None
    assert ">100 Hz</text>" in figure.drawing


NAMES = ("a", "b", "c")


def test_the_cheapest_that_passes_is_taken() -> None:
    """The first fails, the second is dear but more accurate, the third is cheap."""
    reports = [
        report(passed=False, **{"provenance.cost.luts": 1}),
        report(**{"provenance.cost.luts": 2000, "error.bound": 0.0001}),
        report(),
    ]
    choice = choose(reports, NAMES)
    assert (choice.taken, choice.beaten) == (2, ())
    assert choice.reason == (
        "c is the cheapest of the 2 of 3 that pass: 2,728 LUT4 equivalents, estimated before synthesis; its error "
        "limit is 200 nm. The smallest limit is b's, 100 nm, at 1.4 times the cost."
    )


def test_of_equal_costs_the_smallest_limit_is_taken() -> None:
    reports = [report(), report(**{"error.bound": 0.0001})]
    choice = choose(reports, NAMES)
    assert (choice.taken, choice.beaten) == (1, (0,))
    assert choice.reason.endswith("b has the smallest error limit, 100 nm.")


def test_nobody_wins_among_equals() -> None:
    choice = choose([report(), report()], NAMES)
    assert (choice.taken, choice.beaten) == (None, ())
    assert choice.reason == (
        "Both cost the same, 2,728 LUT4 equivalents, estimated before synthesis, and have the same error limit, 200 nm."
    )


def test_nobody_wins_by_an_equal_limit_where_costs_cannot_be_compared() -> None:
    synthesized = {"provenance.cost.source": "synthesis", "provenance.cost.board": "icestick"}
    choice = choose([report(), report(**synthesized)], NAMES)
    assert choice.taken is None
    assert choice.reason.startswith("Those that pass have the same error limit, 200 nm. The costs have different orig")


def test_without_fair_costs_the_smallest_limit_is_taken() -> None:
    synthesized = {"provenance.cost.source": "synthesis", "provenance.cost.board": "icestick"}
    choice = choose([report(), report(**synthesized, **{"error.bound": 0.0001})], NAMES)
    assert choice.taken == 1
    assert choice.reason.startswith("b has the smallest error limit, 100 nm. The costs have different origins")


def folded(instructions: int, bound: float) -> dict[str, Any]:
    """Make a report of a program, whose cost is its length."""
    cost = {"source": "program", "instructions": instructions, "memory_words": 64}
    return report(architecture="folded", **{"provenance.cost": cost, "error.bound": bound})


def test_of_several_architectures_the_cheapest_of_the_smallest_is_taken() -> None:
    """The parallel one is more accurate, but takes a multiplier for every product."""
    accurate = report(**{"error.bound": 0.0001})
    choice = choose([accurate, folded(120, 0.00015), folded(100, 0.0002)], NAMES)
    assert (choice.taken, choice.beaten) == (2, ())
    assert choice.reason == (
        "c is the cheapest of the 2 folded ones: 100 instructions; its error limit is 200 nm. The smallest limit is "
        "b's, 150 nm, at 1.2 times the cost. The folded architecture is the smallest here, and fast enough; of the "
        "others, a (parallel) has the smallest limit, 100 nm."
    )
    choice = choose([accurate, folded(100, 0.0002)], NAMES)
    assert choice.taken == 1
    assert choice.reason.startswith("b is the only folded one that passes: 100 instructions; its error limit is 200 nm")
    failing = folded(100, 0.0002) | {"passed": False}
    assert choose([accurate, failing], NAMES).reason == "a is the only one of 2 that passes."


@pytest.mark.slow
def test_reports_of_earlier_versions_need_not_tell_their_architecture() -> None:
    untold = {key: value for key, value in report(**{"error.bound": 0.0001}).items() if key != "architecture"}
    choice = choose([untold, folded(100, 0.0002)], NAMES)
    assert choice.taken == 0
    assert choice.reason.startswith("a has the smallest error limit, 100 nm.")
    assert "<svg" in comparison_page([untold, folded(100, 0.0002)], [])


@pytest.mark.slow
@pytest.mark.parametrize("extreme", [5e-324, 1e-300, 1e300])
def test_extreme_errors_are_drawn(extreme: float) -> None:
    """Nothing warns that the labels of an axis have no room; warnings are errors here."""
    assert "<svg" in comparison_page([report(**{"error.max_abs": extreme}), report()], [])


def test_nothing_is_taken_of_different_jobs_or_of_failures() -> None:
    assert choose([report(), report(**OTHER_JOB)], NAMES).taken is None
    assert choose([report(passed=False), report(bit_exact=False)], NAMES).reason == "None of them passed."
    assert choose([report(passed=False), report()], NAMES).reason == "b is the only one of 2 that passes."


# beside a baseline


def judged(candidate: dict[str, Any], tolerance: str | None = None) -> Judgement:
    (one,) = judge(report(), [candidate], None if tolerance is None else read_tolerances(tolerance))
    return one


@pytest.mark.parametrize(
    ("change", "tolerance", "verdict"),
    [
        ({"error.max_abs": 0.000126}, "error=5%", "within"),
        ({"error.max_abs": 0.0001261}, "error=5%", "worse"),
        ({"error.max_abs": 0.00011}, "error=0", "better"),
        ({"error.max_abs": 0.00013}, "error=0.00001", "within"),
        ({"provenance.cycles_per_sample": 4}, "cycles=0", "worse"),
        ({"provenance.cycles_per_sample": 4}, "cycles=1", "within"),
        ({"provenance.cost.luts": 1020}, "lut=2%", "within"),
        ({"provenance.cost.luts": 1021}, "lut=2%", "worse"),
        ({"sqnr_db": 98.9}, "sqnr=0", "worse"),
        ({"sqnr_db": 98.9}, "sqnr=0.2", "within"),
        ({"sqnr_db": 99.1}, "sqnr=0", "better"),
        ({}, "bound=0", "equal"),
        ({"sqnr_db": None}, "sqnr=5%", "not comparable"),
        (OTHER_TRACE, "error=5%", "not comparable"),
        (OTHER_TRACE, "lut=0", "equal"),
    ],
)
def test_a_figure_beside_the_baseline(change: dict[str, Any], tolerance: str, verdict: str) -> None:
    one = judged(report(**change), tolerance)
    assert [each.verdict for each in one.judged] == [verdict]
    assert one.passed == (verdict in {"better", "equal", "within"})


def test_without_a_tolerance_nothing_may_be_worse() -> None:
    assert judged(report()).passed
    assert len(judged(report()).judged) == 10  # all but those of a program
    assert [each.figure for each in judged(report(**WORSE)).judged if not each.passed] == [
        "error",
        "rms",
        "latency",
        "lut",
    ]


def test_only_what_a_tolerance_names_is_judged() -> None:
    assert judged(report(**WORSE), "cycles=0").passed
    assert judged(report(passed=False), "cycles=0").reasons == ["It falls short of its own specification."]


def test_reasons_beside_the_baseline() -> None:
    worse = judged(report(**WORSE, **OTHER_TRACE), "error=5%,rms=5%,lut=2%")
    assert worse.reasons == [
        "LUT4: 1,100 instead of 1,000 (+10.00 %), 2% allowed.",
        "Not comparable: largest error, typical error (RMS). The input codes differ: traces wear_ramp, steps.",
    ]


def test_values_of_different_units_have_no_change_in_per_cent() -> None:
    one = judged(report(**WORSE, **{"error.unit": "V"}), "error=5%,bound=0,latency=0")
    assert [each.change for each in one.judged] == ["", "", judged(report(**WORSE), "latency=0").judged[0].change]
    assert one.judged[2].change.endswith(" %")


def test_several_units_are_listed() -> None:
    found = fairness([report(**{"error.unit": unit}) for unit in ("kPa", "bar", "", "kPa")])
    assert found.bounds == "Errors in kPa, bar and plain numbers cannot be compared."


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("eror=5%", "a tolerance must be of error, .*, words, not of eror \\(did you mean error\\?\\)"),
        ("", "a tolerance must be of error, .*, words, not of nothing"),
        ("error=1%,error=2%", "a tolerance must be given once, not twice as for error"),
        ("error", "a tolerance must be a number such as 5% or 0, not error="),
        ("error=-1", "a tolerance must be a number such as 5% or 0, not error=-1"),
        ("error=nan", "a tolerance must be a number such as 5% or 0, not error=nan"),
        ("error=1e999", "a tolerance must be a number such as 5% or 0, not error=1e999"),
    ],
)
def test_bad_tolerances(text: str, message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        read_tolerances(text)


def test_markdown() -> None:
    """A judgement, with what would be markup escaped."""
    pair = [report(), report(**WORSE, name="a|b <i>")]
    text = comparison_markdown(pair, judge(pair[0], pair[1:], read_tolerances("error=5%,cycles=0")))
    assert text.startswith("## ❌ a\\|b &lt;i&gt; falls short beside the baseline\n\n- largest error: 130 nm instead")
    assert "| largest error | 120 nm | 130 nm | +8.33 % | 5% allowed | 🔴 worse |" in text
    assert "| clock cycles per sample | 3 | 3 | +0.00 % | 0 allowed | ⚪ equal |" in text
    plain_text = comparison_markdown(pair)
    assert "| largest error | 120 nm ★ | 130 nm |" in plain_text
    assert "is the cheapest of both" in plain_text


def test_column_names_tell_reports_apart() -> None:
    assert column_names([report(), report(name="audio")]) == ["flange_wear", "audio"]
    assert column_names([report(), report(realization="df1")]) == ["df1_ef2", "df1"]
    assert column_names([report(), report()], baseline=True) == ["baseline", "flange_wear"]
    assert column_names([report(), report(realization="df1"), report()]) == [
        "flange_wear, df1_ef2 (1)",
        "flange_wear, df1",
        "flange_wear, df1_ef2 (2)",
    ]


def test_columns_are_named_by_the_folders_of_the_reports() -> None:
    first, second = report(folder="march"), report(folder="april")
    assert column_names([first, second]) == ["march", "april"]
    assert column_names([first, second], baseline=True) == ["baseline", "april"]
    assert column_names([first, report(folder="march")]) == ["flange_wear, df1_ef2 (1)", "flange_wear, df1_ef2 (2)"]
    assert column_names([first, report()]) == ["flange_wear, df1_ef2 (1)", "flange_wear, df1_ef2 (2)"]


def test_json_is_plain_data() -> None:
    content = json.loads(json.dumps(comparison_json([report(), report(**PLAIN)]), allow_nan=False))
    assert content["names"] == ["df1_ef2", "df1"]
    assert content["choice"]["taken"] == 0
    assert content["differences"] == [{"group": "datapath", "title": "realization", "cells": ["df1_ef2", "df1"]}]
    assert set(content["unfair"].values()) == {""}
    by_key = {row["key"]: row for row in content["rows"]}
    assert by_key["error.max_abs"] == {
        "group": "accuracy",
        "key": "error.max_abs",
        "title": "largest error",
        "values": [0.00012, 0.42],
        "best": [0],
    }


def test_json_beside_a_baseline() -> None:
    pair = [report(), report(**WORSE)]
    content = comparison_json(pair, judge(pair[0], pair[1:], read_tolerances("error=5%")))["baseline"]
    assert (content["name"], content["passed"]) == ("baseline", False)
    assert content["candidates"][0]["figures"] == [
        {
            "figure": "error",
            "baseline": 0.00012,
            "candidate": 0.00013,
            "tolerance": "5%",
            "verdict": "worse",
            "reason": "",
        }
    ]


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


@pytest.mark.slow
def test_page() -> None:
    content = comparison_page([report(), report(**PLAIN)])
    assert content == comparison_page([report(), report(**PLAIN)])
    assert "1 passed" in content
    assert content.count('class="best"') == 2
    assert content.count("<svg viewBox") == 8  # four figures for two widths
    assert not re.search(r"https?:|url\((?!#)|@import|<script", content)


@pytest.mark.slow
def test_page_escapes_names() -> None:
    page = Words(comparison_page([report(name="<script>&amp;"), report(simulator="<script>")]))
    assert "script" not in page.tags
    assert "<script>&amp;" in page.words


@pytest.mark.slow
def test_page_of_different_units_has_no_picture_of_errors() -> None:
    assert "Error over time" in comparison_page([report(), report()])
    content = comparison_page([report(), report(**{"error.unit": "V"})])
    assert "Error over time" not in content
    assert "Errors in mm and V cannot be compared." in content


@pytest.mark.slow
def test_page_beside_a_baseline() -> None:
    pair = [report(), report(**WORSE)]
    content = comparison_page(pair, judge(pair[0], pair[1:], read_tolerances("error=5%")))
    assert "flange_wear falls short beside the baseline" in content
    assert "largest error: 130 nm instead of 120 nm (+8.33 %), 5% allowed." in content


@pytest.mark.slow
def test_a_filter_that_cannot_be_drawn_is_left_out() -> None:
    rows = {"ideal_sos": [[1e12, 0, 0, 1e-12, 0, 0]], "quantized_sos": [[0] * 6]}
    content = comparison_page([report(), report(**{"curves.filter": {"sample_rate": 100.0, **rows}})])
    assert "Filters with their" not in content
    assert "Spectrum of the error" in content


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
        (json.dumps(report(tools={"cocotb": 2})), "JSON with 2 as tools.'cocotb'"),
        (json.dumps(report(**{"provenance.trace_sha256": "2"})), "JSON with '2' as provenance.trace_sha256"),
        (json.dumps(report(**{"provenance.cost": []})), "JSON with [] as provenance.cost"),
        (json.dumps(report(**{"curves.error.low": [0.0]})), "JSON with [0.0] as curves.error.low"),
        (
            json.dumps(report(**{"curves.error.high": [0, 1e13]})),
            "JSON with [0, 10000000000000.0] as curves.error.high",
        ),
        (json.dumps(report(**{"curves.filter.ideal_sos": [[1]]})), "JSON with [[1]] as curves.filter.ideal_sos"),
        (json.dumps(report(**{"curves.filter.sample_rate": 0})), "JSON with 0 as curves.filter.sample_rate"),
        (json.dumps(report(**{"error.parts": {"low": "1"}})), "JSON with 'low' in error.parts"),
        (json.dumps(report(aliases={"anywhere_db": "-60"})), "JSON with '-60' as aliases.anywhere_db"),
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
    message = f"{path}: line 1 must be UTF-8 text, not the byte 0xff"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        load_report(path)


def test_load_refuses_a_missing_file(tmp_path: Path) -> None:
    for path, file in ((tmp_path, tmp_path / "report.json"), (tmp_path / "nowhere",) * 2):
        message = f"{file}: a report.json, or a folder that holds one, must be a readable file, not: "
        message += "no such file or directory"
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            load_report(path)
