"""Reading of the `[filter]` table by the verifier: exact numbers, and a refusal of all that it would not verify."""

import re
from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest

from sosmith.model.errors import SpecificationError
from sosmith.verify.specified.filter_table import FilterTable, read_filter_table

BY_ORDER = {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": Decimal("0.1")}
BY_EDGES = {
    "family": "elliptic",
    "kind": "bandpass",
    "passband_edge": [20, 30],
    "stopband_edge": [10, 40],
    "passband_loss": Decimal("0.1"),
    "stopband_loss": 60,
}
LOW = {"kind": "lowpass", "passband_edge": 20, "stopband_edge": 30}
ELLIPTIC = {"family": "elliptic", "passband_loss": 1, "stopband_loss": 40}
INVARIANT = {"method": "impulse_invariant"}


def read(table: Any) -> FilterTable:
    return read_filter_table(table, Fraction(100))


def test_numbers_are_exact() -> None:
    made = read({**BY_ORDER, "cutoff": Decimal("0.2587803")})
    assert made.cutoff == (Fraction(2587803, 10**9),)
    assert (made.method, made.order, made.max_order) == ("bilinear", 2, 20)
    made = read(BY_EDGES)
    assert made.passband_edge == (Fraction(1, 5), Fraction(3, 10))
    assert made.losses == {"passband_loss": Fraction(1, 10), "stopband_loss": 60}
    assert made.max_order == 10
    made = read({"sos": [[Decimal("0.1"), 0, 0, 1, 0, 0]], "family": "mine", "kind": "any"})
    assert made == FilterTable(rows=((Fraction(1, 10), 0, 0, 1, 0, 0),))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({}, "filter.family must be given, not missing"),
        (
            {**BY_ORDER, "family": "gauss"},
            "filter.family must be one of butterworth, chebyshev1, chebyshev2, elliptic, bessel, "
            "equiripple, least_squares, kaiser, halfband, not gauss",
        ),
        (
            {**BY_ORDER, "kind": "allpass"},
            "filter.kind must be one of lowpass, highpass, bandpass, bandstop, not allpass",
        ),
        ({**BY_ORDER, "method": "matched"}, "filter.method must be one of bilinear, impulse_invariant, not matched"),
        ({**BY_ORDER, "order": 0}, "filter.order must be from 1 to 20 for lowpass, not 0"),
        ({**BY_ORDER, "order": 21}, "filter.order must be from 1 to 20 for lowpass, not 21"),
        (
            {**BY_ORDER, "kind": "bandstop", "cutoff": [1, 2], "order": 11},
            "filter.order must be from 1 to 10 for bandstop, not 11",
        ),
        ({**BY_ORDER, "order": True}, "filter.order must be a whole number, not True"),
        ({**BY_ORDER, "order": Decimal(2)}, "filter.order must be a whole number, not Decimal('2')"),
        ({**BY_ORDER, "cutoff": 0.1}, "filter.cutoff must be an exact number, not 0.1"),
        ({**BY_ORDER, "cutoff": True}, "filter.cutoff must be an exact number, not True"),
        ({**BY_ORDER, "cutoff": Decimal("inf")}, "filter.cutoff must be a finite number, not Infinity"),
        ({**BY_ORDER, "cutoff": 0}, "filter.cutoff must be above 0 and below half the sample_rate, not 0 Hz"),
        ({**BY_ORDER, "cutoff": 50}, "filter.cutoff must be above 0 and below half the sample_rate, not 50 Hz"),
        ({**BY_ORDER, "cutoff": [1, 2]}, "filter.cutoff must be one frequency for lowpass, not 2"),
        (
            {**BY_ORDER, "kind": "bandpass"},
            "filter.cutoff must be two frequencies [low, high] for bandpass, not 1",
        ),
        ({**BY_ORDER, "kind": "bandpass", "cutoff": [2, 1]}, "filter.cutoff must be rising, not 2, 1"),
        ({key: BY_ORDER[key] for key in ("family", "kind", "order")}, "filter.cutoff must be given, not missing"),
        ({key: BY_ORDER[key] for key in ("family", "kind", "cutoff")}, "filter.order must be given, not missing"),
        (
            {**BY_ORDER, "passband_loss": 1},
            "filter.passband_loss must be left out with order and cutoff for butterworth, not 1",
        ),
        ({**BY_ORDER, "family": "chebyshev2"}, "filter.stopband_loss must be given, not missing"),
        (
            {**BY_ORDER, "sos_file": "x"},
            "filter.sos_file must be left out with order and cutoff for butterworth, not x",
        ),
        (
            {**BY_ORDER, **ELLIPTIC, "passband_loss": 40},
            "filter.passband_loss must be below stopband_loss (40 dB), not 40",
        ),
        ({**BY_ORDER, **ELLIPTIC, "passband_loss": 0}, "filter.passband_loss must be a positive number of dB, not 0"),
        (
            {**BY_ORDER, **INVARIANT, "kind": "highpass"},
            "filter.kind must be lowpass with impulse_invariant, not highpass",
        ),
        (
            {**BY_ORDER, **INVARIANT, **ELLIPTIC},
            "filter.order must be odd for elliptic with impulse_invariant, not 2",
        ),
        (
            {**BY_EDGES, **INVARIANT},
            "filter.method must be bilinear with edges and losses, not impulse_invariant",
        ),
        (
            {**BY_EDGES, "family": "bessel"},
            "filter.family must be one with a formula for the minimum order, not bessel",
        ),
        (
            {**BY_ORDER, "freedom": "mask"},
            "filter.freedom must be left out with order and cutoff for butterworth, not mask",
        ),
        ({**BY_EDGES, "freedom": "all"}, "filter.freedom must be one of none, mask, not all"),
        ({**BY_EDGES, "gain": 2}, "filter.gain must be left out with edges and losses, not 2"),
        (
            {**BY_EDGES, "stopband_edge": [10, 25]},
            "filter.passband_edge must be inside stopband_edge for bandpass, not elsewhere",
        ),
        (
            {**BY_EDGES, "kind": "bandstop"},
            "filter.passband_edge must be around stopband_edge for bandstop, not elsewhere",
        ),
        (
            {**BY_EDGES, **LOW, "kind": "highpass"},
            "filter.passband_edge must be above stopband_edge for highpass, not elsewhere",
        ),
        (
            {**BY_EDGES, **LOW, "passband_edge": 30},
            "filter.passband_edge must be below stopband_edge for lowpass, not elsewhere",
        ),
        ({"sos": [[1, 0, 0, 2, 0, 0]]}, "filter.sos[0] must be a row with 1 as its fourth number, not 2"),
        ({"sos": [[1, 0, 0, 1, 0.5, 0]]}, "filter.sos[0] must be an exact number, not 0.5"),
        ({"sos": [[1, 0, 0, 1, 0, 0]], "order": 2}, "filter.order must be left out with sos, not 2"),
        *(
            ({"sos": value}, "filter.sos must be a list of rows [b0, b1, b2, 1, a1, a2], not another value")
            for value in (1, [], [1], [[1, 2]], [[1, 0, 0, 1, 0, 0], 1])
        ),
    ],
)
def test_refusals(table: Any, sentence: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        read(table)


def test_freedom() -> None:
    by_edges, by_order = {**BY_EDGES, "freedom": "mask"}, {**BY_ORDER, "freedom": "none"}
    assert [read_filter_table(table, Fraction(100)).by_losses for table in (by_edges, by_order, BY_EDGES)] == [
        True,
        False,
        False,
    ]
