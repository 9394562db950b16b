"""The distance between the stated filter and a certificate's: tight, nothing for the right filter, large for others."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import fields
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from scipy import signal

from sosmith.gen.filter.design import design
from sosmith.gen.specification.specification import FilterSpec
from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.specified import filter_distance
from sosmith.verify.specified.filter_distance import distance
from sosmith.verify.specified.ideal_filter import StatedFilter, stated_filter

FAMILIES = ("butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel")
KINDS = ("lowpass", "highpass", "bandpass", "bandstop")
RIPPLES: dict[str, dict[str, Fraction]] = {
    "chebyshev1": {"passband_loss": Fraction(1, 2)},
    "chebyshev2": {"stopband_loss": Fraction(40)},
    "elliptic": {"passband_loss": Fraction(1, 2), "stopband_loss": Fraction(40)},
}
BANDS = {
    "lowpass": (["0.1"], ["0.17"]),
    "highpass": (["0.17"], ["0.1"]),
    "bandpass": (["0.1", "0.2"], ["0.06", "0.27"]),
    "bandstop": (["0.06", "0.27"], ["0.1", "0.2"]),
}


def stated(**table: Any) -> StatedFilter:
    """Read a table; frequencies are parts of the sample rate."""
    return stated_filter(table, Fraction(1))


NOTHING = stated(sos=[[0, 0, 0, 1, 0, 0]])


def entries(rows: Sequence[Sequence[float]]) -> list[SectionEntry]:
    return [
        SectionEntry(numerator=tuple(map(Fraction, row[:3])), denominator=tuple(map(Fraction, row[3:]))) for row in rows
    ]


def rounded(filter_: StatedFilter, bits: int) -> list[SectionEntry]:
    """Return the filter as one section of any order, its coefficients rounded to `bits` fraction bits."""
    with ctx.workprec(bits + 256):
        parts = [
            tuple(Fraction(int((value * 2**bits).mid().floor().unique_fmpz()), 2**bits) for value in part.coeffs())
            for part in filter_.at(bits + 256)
        ]
    return [SectionEntry.model_construct(numerator=parts[0], denominator=parts[1])]


def by_order(family: str, kind: str, cutoff: str, order: int, **more: Any) -> dict[str, Any]:
    edges = [Decimal(cutoff), Decimal(cutoff) * Decimal("1.0001" if cutoff[2] == "4" else "1.5")]
    if not kind.startswith("band"):
        del edges[1]
    return {"family": family, "kind": kind, "order": order, "cutoff": edges, **RIPPLES.get(family, {}), **more}


def by_edges(family: str, kind: str) -> dict[str, Any]:
    passband, stopband = ([Decimal(edge) for edge in edges] for edges in BANDS[kind])
    table = {"passband_edge": passband, "stopband_edge": stopband, "passband_loss": Fraction(1, 2)}
    return {"family": family, "kind": kind, "stopband_loss": Fraction(45), **table}


# What the figure is.


@pytest.mark.parametrize(
    ("table", "row"),
    [
        (by_order("butterworth", "lowpass", "0.01", 2), [0.001, 0.002, 0.001, 1, -1.9, 0.906]),
        (by_order("elliptic", "bandstop", "0.1", 3), [1, 0, 0, 1, 0, 0]),
        (by_order("bessel", "highpass", "0.3", 4), [0.5, -0.25, 0, 1, 0.5, 0]),
        (by_order("chebyshev1", "lowpass", "0.02", 8), [0, 0, 0, 1, 0, 0]),
        ({"sos": [[1, 0, 0, 1, 0, 0]]}, [0.75, 0, 0, 1, 0, 0]),
        ({"sos": [[1, 0, 0, 1, 0, 0]]}, [1, 0.5, -0.125, 1, 0, 0]),
        ({"sos": [[1, 0, 0, 1, Decimal("-0.999"), 0]]}, [1, 0, 0, 1, -0.998, 0]),
    ],
)
def test_the_bound_is_just_above_the_sum_of_magnitudes(table: dict[str, Any], row: list[float]) -> None:
    filter_ = stated(**table)
    impulse = np.eye(1, 60_000)[0]
    true = [np.array([float(value.mid()) for value in part.coeffs()]) for part in filter_.at(256)]
    ours = signal.lfilter(*true, impulse) - signal.lfilter(row[:3], row[3:], impulse)
    exact = np.abs(ours).sum()
    bound = float(distance(filter_, entries([row])))
    assert exact * (1 - 1e-6) <= bound < 1.8 * exact


def test_it_is_a_peak_gain() -> None:
    """Twice the difference is twice the distance, and nothing is as far as the peak gain."""
    one = stated(sos=[[1, 0, 0, 1, 0, 0]])
    quarter, half = (float(distance(one, entries([[gain, 0, 0, 1, 0, 0]]))) for gain in (0.75, 0.5))
    assert half == pytest.approx(2 * quarter, rel=1e-4)
    assert 1 <= distance(one, entries([[0, 0, 0, 1, 0, 0]])) < Fraction(1001, 1000)


@pytest.mark.parametrize("bits", [100, 300, 600])
def test_it_shows_deviations_far_below_double_precision(bits: int) -> None:
    filter_ = stated(**by_order("butterworth", "lowpass", "0.001", 4))
    found = distance(filter_, rounded(filter_, bits))
    # Coefficients of the fourth-order denominator act on the response with gains of up to 1 / 0.0006**4.
    assert Fraction(1, 2 ** (bits + 4)) < found < Fraction(2**43, 2**bits)


def test_equal_filters_are_as_near_as_the_arithmetic_can_tell() -> None:
    rows = [[Decimal("0.1"), 0, 0, 1, Decimal("-0.9"), 0], [1, 2, 1, 1, 0, Decimal("0.3")]]
    exact = [
        SectionEntry(numerator=tuple(Fraction(b) for b in row[:3]), denominator=tuple(Fraction(a) for a in row[3:]))
        for row in rows
    ]
    assert distance(stated(sos=rows), exact) < Fraction(1, 2**1024)
    mean = entries([[0.5, 0.5, 0, 1, 0, 0]])
    assert distance(stated(**by_order("butterworth", "lowpass", "0.25", 1)), mean) < Fraction(1, 2**1024)


@pytest.mark.parametrize(("width", "precisions"), [(0.75, 1), (1.5, 6)])
def test_right_bits_are_wanted_down_to_the_limit(
    width: float, precisions: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Just below 2**-1024 the first precision is enough; just above, all are tried."""
    tried: list[int] = []

    def unknown(stated: StatedFilter, sections: Sequence[SectionEntry], bits: int) -> arb:
        tried.append(bits)
        return arb(0, width) * arb(2) ** -1024

    monkeypatch.setattr(filter_distance, "_bound", unknown)
    assert distance(NOTHING, []) < Fraction(2, 2**1024)
    assert tried == [256 << k for k in range(precisions)]


def test_the_order_of_sections_and_how_they_are_split_do_not_matter() -> None:
    filter_ = stated(**by_order("bessel", "lowpass", "0.1", 4))
    rows = entries(design(specification(by_order("bessel", "lowpass", "0.1", 4)), 1).rows)
    rows.append(SectionEntry(numerator=(Fraction(1), Fraction(1, 2)), denominator=(Fraction(1), Fraction(1, 2))))
    assert distance(filter_, rows) == distance(filter_, rows[::-1])
    assert distance(filter_, rows) < 1e-13


@pytest.mark.parametrize("row", [[1, 0, 0, 1, -2, 1.125], [1, 0, 0, 1, -1, 0]])
def test_unstable_sections_have_no_distance(row: list[float]) -> None:
    sentence = "the stability of the ideal filter and the stated one could not be decided"
    with pytest.raises(UndecidedError, match=f"^{re.escape(sentence)}$"):
        distance(stated(**by_order("butterworth", "lowpass", "0.1", 1)), entries([row]))


# The generator's filters are near.


def specification(table: dict[str, Any]) -> FilterSpec:
    words: dict[str, Any] = {field.name: None for field in fields(FilterSpec)}
    words["method"] = "bilinear"
    for key, value in table.items():
        words[key] = tuple(map(Fraction, value)) if isinstance(value, list) else value
    return FilterSpec(**words)


def allowance(sections: Sequence[SectionEntry]) -> Fraction:
    """Bound what the rounding of every coefficient to a double can do, to first order."""
    total = Fraction(0)
    for k, section in enumerate(sections):
        others = [*sections[:k], *sections[k + 1 :]]
        one = (Fraction(1),)
        numerator = SectionEntry(numerator=one, denominator=section.denominator)
        denominator = SectionEntry(numerator=section.numerator, denominator=section.denominator)
        by_numerator = distance(NOTHING, [*others, numerator])
        by_denominator = distance(NOTHING, [*others, denominator, numerator])
        total += by_numerator * sum(map(abs, section.numerator)) + by_denominator * sum(map(abs, section.denominator))
    return total / 2**53


NEAR = [
    *(
        by_order(family, kind, cutoff, order)
        for family, kind, cutoff, order in itertools.product(FAMILIES, KINDS, ("0.00001", "0.03", "0.4999"), (1, 2, 5))
    ),
    *(by_edges(family, kind) for family in FAMILIES[:-1] for kind in KINDS),
    *(
        by_order(family, "lowpass", "0.2", order, method="impulse_invariant")
        for family in FAMILIES
        for order in (1, 3, 5)
    ),
    by_order("butterworth", "lowpass", "0.1", 20),
    by_order("elliptic", "bandpass", "0.1", 10),
    by_order("bessel", "bandstop", "0.1", 10),
]


def name(table: dict[str, Any]) -> str:
    words = [table["family"], table["kind"], table.get("method", ""), table.get("order", "edges")]
    return "-".join(str(word) for word in [*words, *table.get("cutoff", ())] if word)


@pytest.mark.sweep(60)
@pytest.mark.parametrize("table", NEAR, ids=name)
def test_the_generators_filter_is_as_near_as_doubles_can_be(table: dict[str, Any]) -> None:
    made = entries(design(specification(table), Fraction(1)).rows)
    assert distance(stated(**table), made) < 2 * allowance(made)


# Everything that the specification says counts.

PART = Fraction(1, 10**9)
ODD = {"method": "impulse_invariant"}
BASES = [
    *(by_order(family, kind, "0.03", 3) for family in FAMILIES for kind in KINDS),
    *(by_order(family, "lowpass", "0.03", 3, **ODD) for family in FAMILIES),
    *(by_edges(family, kind) for family in FAMILIES[:-1] for kind in KINDS),
    by_order("elliptic", "lowpass", "0.00001", 7),
    by_order("bessel", "bandpass", "0.4999", 4),
]


def changes(table: dict[str, Any]) -> list[dict[str, Any]]:
    """Each of the words, orders and numbers that the filter depends on, one at a time a little different."""
    made = []
    for key, value in table.items():
        match key:
            case "order":
                step = 2 if "method" in table else 1
                made += [{**table, key: value + step}, {**table, key: value - step}]
            case "cutoff" | "passband_edge" | "stopband_edge":
                if key == "stopband_edge" and table["kind"] != "bandstop":
                    continue  # it sets the order, and nothing else
                moved = [[*value[:k], Fraction(v) * (1 + PART), *value[k + 1 :]] for k, v in enumerate(value)]
                if key == "passband_edge" and table["kind"] == "bandstop":
                    del moved[0]  # this one follows from the other three
                made += [{**table, key: edges} for edges in moved]
            case "passband_loss" | "stopband_loss":
                # A Butterworth or Chebyshev I filter by edges has its order from the stop band, and nothing else.
                if key in RIPPLES.get(table["family"], {}) or key == "passband_loss":
                    made.append({**table, key: value * (1 + PART)})
            case "family":
                same = [other for other in FAMILIES if RIPPLES.get(other) == RIPPLES.get(value)]
                made += [{**table, key: other} for other in (same if "order" in table else FAMILIES[:-1])]
            case "kind" if "order" in table and "method" not in table:
                pairs = {KINDS[0]: KINDS[1], KINDS[1]: KINDS[0], KINDS[2]: KINDS[3], KINDS[3]: KINDS[2]}
                made.append({**table, key: pairs[value]})
    if table["kind"] == "lowpass" and "order" in table:
        made.append({**table, "method": "bilinear" if "method" in table else "impulse_invariant"})
    return [changed for changed in made if changed != table]


@pytest.mark.parametrize("table", BASES, ids=name)
def test_every_word_counts(table: dict[str, Any]) -> None:
    certified = rounded(stated(**table), 600)
    near = distance(stated(**table), certified)
    assert near < Fraction(1, 2**300)
    for changed in changes(table):
        assert distance(stated(**changed), certified) > Fraction(1, 10**12), changed
