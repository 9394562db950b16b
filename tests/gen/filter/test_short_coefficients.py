"""Filters with short coefficients inside a mask: the gains of each, by scipy and by both proofs, and its digits."""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy import signal

from sosmith.gen.filter.design import Filter, design
from sosmith.gen.filter.gain_limits import gains_in, keeps_to
from sosmith.gen.filter.loss_mask import LossMask, mask_of
from sosmith.gen.filter.short_coefficients import digits
from sosmith.gen.specification.specification import FilterSpec
from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.specified.filter_table import FilterTable, read_filter_table
from sosmith.verify.specified.section_mask import sections_keep_to_losses

Case = tuple[str, str, tuple[str, ...], tuple[str, ...], str, str]
CASES: list[Case] = [
    ("butterworth", "lowpass", ("0.01875",), ("0.04166",), "1.5", "30"),
    ("butterworth", "highpass", ("0.04166",), ("0.01875",), "1.5", "30"),
    ("butterworth", "lowpass", ("0.0001",), ("0.0004",), "1", "40"),
    ("chebyshev1", "lowpass", ("0.0026",), ("0.0045",), "0.5", "20"),
    ("chebyshev2", "highpass", ("0.3",), ("0.2",), "1", "40"),
    ("elliptic", "lowpass", ("0.1",), ("0.13",), "0.5", "40"),
    ("elliptic", "bandpass", ("0.1", "0.15"), ("0.07", "0.2"), "0.5", "30"),
    ("butterworth", "bandstop", ("0.05", "0.2"), ("0.08", "0.14"), "1", "20"),
]
NAMES = [f"{case[0]} {case[1]} from {case[2][0]}" for case in CASES]
DIGITS = dict(zip(NAMES, (15, 23, 16, 19, 9, 20, 20, 19), strict=True))
"""Nonzero digits of b0, a1 and a2 of all sections."""


def spec(case: Case, freedom: str = "mask") -> FilterSpec:
    family, kind, passband, stopband, loss, stop = case
    return FilterSpec(
        family=family,
        kind=kind,
        method="bilinear",
        order=None,
        cutoff=None,
        passband_edge=tuple(map(Fraction, passband)),
        stopband_edge=tuple(map(Fraction, stopband)),
        passband_loss=Fraction(loss),
        stopband_loss=Fraction(stop),
        sos=None,
        freedom=freedom,
    )


def mask(case: Case) -> LossMask:
    _, kind, passband, stopband, loss, stop = case
    return mask_of(
        kind, tuple(map(Fraction, passband)), tuple(map(Fraction, stopband)), (Fraction(loss), Fraction(stop))
    )


def table(case: Case, **others: object) -> FilterTable:
    family, kind, passband, stopband, loss, stop = case
    edges: dict[str, Any] = {"passband_edge": [*map(Decimal, passband)], "stopband_edge": [*map(Decimal, stopband)]}
    losses = {"passband_loss": Decimal(loss), "stopband_loss": Decimal(stop), "freedom": "mask"}
    return read_filter_table({"family": family, "kind": kind, **edges, **losses, **others}, Fraction(1))


def sections(designed: Filter) -> list[SectionEntry]:
    return [SectionEntry(numerator=over, denominator=under) for over, under in designed.exact]


def multiplied(designed: Filter, part: int) -> list[Fraction]:
    total = [Fraction(1)]
    for section in designed.exact:
        total = [
            sum(
                (total[k] * tap for k in range(len(total)) for m, tap in enumerate(section[part]) if k + m == n),
                Fraction(0),
            )
            for n in range(len(total) + len(section[part]) - 1)
        ]
    return total


@pytest.mark.sweep(2)
@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_the_gains_keep_to_the_mask(case: Case) -> None:
    designed = design(spec(case), 1)
    taps, poles = multiplied(designed, 0), multiplied(designed, 1)
    assert keeps_to(taps, mask(case), poles)
    assert sections_keep_to_losses(sections(designed), table(case))
    wanted = mask(case)
    limits = (
        (wanted.passbands, 10 ** (-float(case[4]) / 20), 1.0),
        (wanted.stopbands, 0.0, 10 ** (-float(case[5]) / 20)),
    )
    for bands, low, high in limits:
        for band in bands:
            sampled = np.abs(signal.sosfreqz(designed.sos, np.linspace(*map(float, band), 4000), fs=1.0)[1])
            least, most = gains_in(taps, band, poles)
            assert low <= least <= sampled.min() * (1 + 1e-6)
            assert sampled.max() * (1 - 1e-6) <= most <= high


@pytest.mark.sweep(3)
@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_the_coefficients_are_exact_and_short(case: Case) -> None:
    designed = design(spec(case), 1)
    exact = [tuple(map(Fraction, row)) for row in designed.rows]
    assert designed.exact == tuple(
        tuple(tuple(taps[: max(k + 1 for k in range(3) if taps[k])]) for taps in (row[:3], row[3:])) for row in exact
    )
    of_family = design(spec(case, "none"), 1)
    assert designed.order == of_family.order
    assert sum(digits(value) for row in exact for value in (row[0], *row[4:])) == DIGITS[NAMES[CASES.index(case)]]


def test_a_low_pass_keeps_constants_as_they_are() -> None:
    for case in CASES[:1] + CASES[2:3]:
        assert sum(multiplied(design(spec(case), 1), 0)) == sum(multiplied(design(spec(case), 1), 1))


@pytest.mark.parametrize("case", [CASES[0], CASES[6]], ids=["lowpass", "bandpass"])
def test_a_filter_outside_the_mask_is_seen(case: Case) -> None:
    designed = design(spec(case), 1)
    for change in ({"passband_loss": Decimal("0.05")}, {"stopband_loss": Decimal(case[5]) + 20}):
        assert not sections_keep_to_losses(sections(designed), table(case, **change))
    first, *others = sections(designed)
    louder = SectionEntry(
        numerator=tuple(tap * Fraction(9, 8) for tap in first.numerator), denominator=first.denominator
    )
    assert not sections_keep_to_losses([louder, *others], table(case))
    taps, poles = multiplied(designed, 0), multiplied(designed, 1)
    assert not keeps_to([tap * Fraction(9, 8) for tap in taps], mask(case), poles)
    assert not keeps_to(taps, mask(case)._replace(stopband_loss=Fraction(case[5]) + 20), poles)


def test_a_narrow_peak_between_two_frequencies_is_seen() -> None:
    # A pole at a distance of 1e-9 from the unit circle: a grid does not show it.
    near = SectionEntry(
        numerator=(Fraction(1, 10**4),), denominator=(Fraction(1), Fraction(0), Fraction(10**9 - 1, 10**9))
    )
    asked = table(CASES[1], passband_edge=[Decimal("0.3")], stopband_edge=[Decimal("0.251")], stopband_loss=Decimal(40))
    below = table(CASES[1], passband_edge=[Decimal("0.3")], stopband_edge=[Decimal("0.249")], stopband_loss=Decimal(40))
    assert not sections_keep_to_losses([near], asked)
    assert not sections_keep_to_losses([near], below)  # the gain in the pass band is too low
    assert gains_in([Fraction(1, 10**4)], (Fraction(1, 5), Fraction(3, 10)), near.denominator)[1] > 1e4


def test_it_says_what_it_is() -> None:
    case = replace(spec(CASES[0]), passband_edge=(Fraction(900),), stopband_edge=(Fraction(2000),))
    assert design(case, 48000).describe == "Lowpass inside its mask, order 5, near Butterworth, at 48000 Hz"
