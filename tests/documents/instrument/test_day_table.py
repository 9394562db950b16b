"""The page on a table in place of the polynomial is what the record gives, and a table keeps to its proven bound."""

import json
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from benchmarks import day_table
from benchmarks.day_table_page import WAYS, largest, page
from benchmarks.interpolated_table import Table, derivative, misses, rows_of, smallest, value

from sosmith.gen.reload.reload import ROOM
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
TEMPERATURE = Port.from_range("temperature", 16, Fraction(0), Fraction(128), unit="degC")
CLEARANCE = Port.from_range("clearance", 16, Fraction(0), Fraction(16), unit="mm")

CURVE = tuple(
    tuple(map(Fraction, row))
    for row in (("5000", "-1900"), ("15100", "3200"), ("17000", "900"), ("-9000", "7"), ("4100", "-40"), ("900", "31"))
)
"""Coefficients of u**i t**j in LSB of the clearance; its values leave no port."""


@pytest.fixture(scope="module")
def record() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(day_table.RECORD.read_text(encoding="utf-8"))
    return found


def test_the_page_is_what_the_record_gives(record: dict[str, Any]) -> None:
    assert day_table.PAGE.read_text(encoding="utf-8") == page(record)


def test_every_curve_keeps_to_every_error_allowed_in_every_way(record: dict[str, Any]) -> None:
    assert len(record["curves"]) == day_table.SENSORS
    for curve in record["curves"]:
        assert [(row["allowed"], row["way"]) for row in curve] == [(a, w) for a in day_table.ALLOWED for w in WAYS]
        for row in curve:
            bounds = [row["bound"]] if "bound" in row else [row[kind]["bound"] for kind in day_table.KINDS]
            assert max(bounds) <= record["allowed"][row["allowed"]]


def test_the_verdict_is_what_the_figures_say(record: dict[str, Any]) -> None:
    text = " ".join(page(record).split())
    assert "a table with lines saves no logic" in text
    assert "a table is cheaper in logic" in text
    for name in day_table.ALLOWED:
        sizes = {
            (way, kind): largest(record, name, way, lambda row, kind=kind: row[kind]["luts"])
            for way in WAYS
            for kind in day_table.KINDS
        }
        assert sizes["polynomial", "folded"] < min(sizes["linear", "folded"], sizes["quadratic", "folded"])
        assert sizes["polynomial", "parallel"] > max(sizes["linear", "parallel"], sizes["quadratic", "parallel"])
        words = largest(record, name, "polynomial", lambda row: row["parallel"]["words"])
        assert words < min(
            largest(record, name, way, lambda row: row["reload_words"]) for way in ("linear", "quadratic")
        )


def test_hardware_with_room_takes_the_curves_of_all_sensors(record: dict[str, Any]) -> None:
    rooms = [None if room is None else float(room) for room in day_table.ROOMS]
    assert [(row["filtered"], row["room"]) for row in record["rooms"]] == [(f, r) for f in (False, True) for r in rooms]
    for row in record["rooms"]:
        assert row["sets"] == day_table.SENSORS ** (1 if row["filtered"] else 2)
        assert row["refused"] > row["sets"] / 2 if row["room"] is None else row["refused"] == 0
        assert all(reason.endswith(f"; {ROOM}") for reason in row["reasons"])


@pytest.mark.slow
def test_the_tables_of_the_first_curve_are_those_of_the_record(record: dict[str, Any], tmp_path: Any) -> None:
    spec = day_table.specification(next(day_table.curves()), tmp_path)
    core = day_table.normalised_curve(spec)
    for row in record["curves"][0]:
        if row["way"] == "polynomial":
            continue
        allowed = day_table.ALLOWED[row["allowed"]] or spec.output.lsb
        table = smallest(rows_of(core), 1 if row["way"] == "linear" else 2, allowed / spec.output.lsb)
        assert (1 << table.exponent, table.frac, table.bits) == (row["segments"], row["frac"], row["bits"])
        assert (table.reload_words, float(table.missed)) == (row["reload_words"], row["missed"])


@pytest.mark.sweep(2)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("allowed", [Fraction(1), Fraction(40)])
def test_the_integers_keep_to_the_bound(degree: int, allowed: Fraction) -> None:
    rows = rows_of(CURVE)
    table = smallest(rows, degree, allowed)
    assert table.bound <= allowed
    draws = random.Random(degree)
    step = 1 << VOLTAGE.bits - table.exponent
    codes = [(k * step + step // 2 - 1, 65535) for k in range(1 << table.exponent)]
    codes += [(draws.randrange(1 << 16), draws.randrange(1 << 16)) for _ in range(2000)]
    datapath = table.datapath((VOLTAGE, TEMPERATURE), CLEARANCE)
    results = datapath.compute(np.array([table.operands(v, t, VOLTAGE.bits) for v, t in codes]))
    errors = [
        abs(value(rows[0], Fraction(v, 1 << 16)) + value(rows[1], Fraction(v, 1 << 16)) * t / (1 << 16) - int(code))
        for (v, t), code in zip(codes, np.ravel(results), strict=True)
    ]
    assert table.bound / 2 < max(errors) <= table.bound


@pytest.mark.parametrize("degree", [1, 2])
def test_what_interpolation_misses_is_bounded_and_nearly_reached(degree: int) -> None:
    """Between exact values, at the place where the remainder's product is largest."""
    rows = rows_of(CURVE)
    exponent = 4
    missed = next(one for k, one in enumerate(misses(rows, degree)) if k == exponent)
    x = Fraction(1, 2) if degree == 1 else (1 - Fraction(577350, 10**6)) / 2
    reached = Fraction(0)
    for segment in range(1 << exponent):
        for row in (rows[0], tuple(a + b for a, b in zip(*rows, strict=True))):
            points = [value(row, (segment + Fraction(k, degree)) / (1 << exponent)) for k in range(degree + 1)]
            if degree == 1:
                line = points[0] + x * (points[1] - points[0])
            else:
                a, b, c = points
                line = a + x * (4 * b - 3 * a - c) + x * x * 2 * (a - 2 * b + c)
            reached = max(reached, abs(value(row, (segment + x) / (1 << exponent)) - line))
    assert Fraction(9, 10) * missed < reached <= missed


def test_derivatives() -> None:
    row = tuple(map(Fraction, (5, 4, 3, 2)))
    assert derivative(row, 1) == (4, 6, 6)
    assert derivative(row, 4) == (0,)


def test_a_table_takes_one_order_of_temperature() -> None:
    with pytest.raises(ValueError, match=r"^the order in the temperature must be at most 1, not 2$"):
        rows_of([[Fraction(1), Fraction(0), Fraction(1)]])


@pytest.mark.slow
def test_what_no_table_reaches_is_refused() -> None:
    with pytest.raises(
        ShortfallError,
        match=r"^the error allowed must be more than 0\.5 LSB and within reach of 16,384 "
        r"segments, not 0\.5 LSB$",
    ):
        smallest(rows_of(CURVE), 1, Fraction(1, 2))


def test_a_table_loads_as_many_values_in_a_word_as_it_holds() -> None:
    short = Table(rows=rows_of([[Fraction(1), Fraction(1)]]), degree=1, exponent=3, frac=2, missed=Fraction(0))
    wide = Table(
        rows=rows_of([[Fraction(1 << 20), Fraction(1 << 20)]]), degree=1, exponent=3, frac=2, missed=Fraction(0)
    )
    assert (short.depth, short.reload_words, wide.reload_words) == (9, 9, 18)
