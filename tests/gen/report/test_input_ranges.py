"""Codes at the ends of an input's range: told with their share; values that were cut spoil the verdict."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.gen.report.pictures import unpainted
from tests.interface.small import FILTER

import sosmith

RATE, BITS = FILTER["sample_rate"], FILTER["input"]["x"]["bits"]
TONE = np.sin(2 * np.pi * 20.0 * np.arange(400) / RATE)


@pytest.fixture(autouse=True)
def _unpainted() -> Iterator[None]:
    with unpainted:
        yield


@pytest.fixture(scope="module", name="design")
def _design() -> sosmith.Design:
    return sosmith.design(FILTER)


def _report(design: sosmith.Design, trace: object, folder: Path) -> sosmith.Report:
    return design.simulate(trace, folder=folder, simulator="icarus", idle=0, stall=0)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("form", ["arrays", "file"])
def test_a_trace_that_was_clipped_does_not_pass(design: sosmith.Design, tmp_path: Path, form: str) -> None:
    values, file = 5 * TONE, tmp_path / "loud.csv"
    file.write_text("x\n" + "\n".join(map(repr, values.tolist())) + "\n", encoding="utf-8")
    report = _report(design, {"x": values} if form == "arrays" else file, tmp_path)
    beyond = 100 * np.mean(abs(values) > 1)
    assert report.bit_exact
    assert not report.passed
    (reason,) = report.shortfalls
    assert reason == (
        f"The input x must stay in its range, −1.00 to 1.00: {beyond:.3g} % of the values in the trace do not, "
        "and were limited to it: scale the trace, or widen input.x.range."
    )
    assert report.summary["inputs"][0]["limited"] == pytest.approx(beyond / 100)
    assert reason in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_tone_of_full_scale_passes_without_a_word(design: sosmith.Design, tmp_path: Path) -> None:
    report = _report(design, {"x": 0.999 * TONE}, tmp_path)
    assert (report.passed, report.summary["notes"], report.summary["inputs"][0]["at_end"]) == (True, [], 0)
    assert _report(design, {"x": TONE}, tmp_path).passed  # 1 is the end of the range, and in it
    assert _report(design, "worst_case", tmp_path).summary["notes"] == []


@pytest.mark.slow
def test_codes_at_the_ends_are_told_with_their_share(design: sosmith.Design, tmp_path: Path) -> None:
    half = 2 ** (BITS - 1)
    codes = np.clip(np.round(2 * half * TONE), -half, half - 1).astype(int)
    file = tmp_path / "codes.csv"
    file.write_text("x_code\n" + "\n".join(map(str, codes.tolist())) + "\n", encoding="utf-8")
    report, share = _report(design, file, tmp_path), np.mean((codes == -half) | (codes == half - 1))
    assert report.summary["inputs"][0]["at_end"] == pytest.approx(share)
    (note,) = report.summary["notes"]
    assert note.startswith(f"{100 * share:.3g} % of the codes of x are at an end of its range: ")
    assert report.passed  # whether it was measured so, nobody knows
    assert note in (tmp_path / "report.html").read_text(encoding="utf-8")
