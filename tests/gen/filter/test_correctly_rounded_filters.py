"""Ideal filters are the correctly rounded ones: against scipy, and against the definitions at high precision."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from flint import acb, arb, ctx
from scipy import signal

from sosmith.gen.filter.design import Filter, design
from sosmith.gen.filter.prototypes import excess, prototype
from sosmith.gen.filter.transformations import warped
from sosmith.gen.specification.specification import FilterSpec

FAMILIES = ("butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel")
PASSBAND_LOSS, STOPBAND_LOSS = Fraction(1, 2), Fraction(40)
SINGLE = ("0.000001", "0.00005", "0.002588", "0.11", "0.25", "0.3", "0.49", "0.499999")
BANDS = (("0.11", "0.17"), ("0.001", "0.0011"), ("0.01", "0.4"), ("0.2", "0.3"))


def designed(family: str, kind: str, order: int, cutoff: tuple[str, ...]) -> Filter:
    return design(
        FilterSpec(
            family=family,
            kind=kind,
            method="bilinear",
            order=order,
            cutoff=tuple(map(Fraction, cutoff)),
            passband_edge=None,
            stopband_edge=None,
            passband_loss=PASSBAND_LOSS if family in {"chebyshev1", "elliptic"} else None,
            stopband_loss=STOPBAND_LOSS if family in {"chebyshev2", "elliptic"} else None,
            sos=None,
        ),
        1,
    )


def scipys(family: str, kind: str, order: int, cutoff: tuple[str, ...]) -> np.ndarray:
    edges = float(cutoff[0]) if len(cutoff) == 1 else [float(edge) for edge in cutoff]
    made: np.ndarray = {
        "butterworth": lambda: signal.butter(order, edges, kind, fs=1.0, output="zpk"),
        "chebyshev1": lambda: signal.cheby1(order, 0.5, edges, kind, fs=1.0, output="zpk"),
        "chebyshev2": lambda: signal.cheby2(order, 40, edges, kind, fs=1.0, output="zpk"),
        "elliptic": lambda: signal.ellip(order, 0.5, 40, edges, kind, fs=1.0, output="zpk"),
        "bessel": lambda: signal.bessel(order, edges, kind, fs=1.0, output="zpk", norm="mag"),
    }[family]()[1]
    return made


def cases() -> list[tuple[str, str, int, tuple[str, ...]]]:
    found = []
    for family, kind in itertools.product(FAMILIES, ("lowpass", "highpass", "bandpass", "bandstop")):
        bands = kind.startswith("band")
        for order in range(1, 7 if bands else 13):
            edges = BANDS if bands else [(edge,) for edge in SINGLE]
            found += [(family, kind, order, cutoff) for cutoff in edges]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_poles_are_scipys(family: str) -> None:
    """Symmetric functions of all poles, which do not depend on how they are paired."""
    for case in cases():
        if case[0] != family:
            continue
        ours, theirs = designed(*case), scipys(*case)
        mine = sorted(row[4] for row in ours.rows)
        assert sum(mine) == pytest.approx(-theirs.sum().real, abs=1e-12 * len(theirs)), case
        product = math.prod(row[5] or -row[4] for row in ours.rows if row[4] or row[5])
        assert abs(product) == pytest.approx(abs(np.prod([p for p in theirs if abs(p) > 1e-15])), rel=1e-11), case


def gain(made: Filter, frequency: Fraction) -> arb:
    """Magnitude of the rows' response, the rows taken exactly; `frequency` as a part of the sample rate."""
    z = acb(2 * arb(frequency.numerator) / frequency.denominator).exp_pi_i()
    value = acb(1)
    for b0, b1, b2, _, a1, a2 in made.rows:
        value *= ((b0 * z + b1) * z + b2) / ((z + a1) * z + a2)
    return abs(value)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_edges_are_where_the_family_has_them(family: str) -> None:
    """The loss at the cutoff is the family's by definition, up to what a rounding of the coefficients moves it."""
    for case in cases():
        if case[0] != family:
            continue
        made = designed(*case)
        with ctx.workprec(256):
            expected = {
                "butterworth": arb(2).rsqrt(),
                "bessel": arb(2).rsqrt(),
                "chebyshev2": (1 + excess(STOPBAND_LOSS)).rsqrt(),
            }.get(family, (1 + excess(PASSBAND_LOSS)).rsqrt())
            for edge in case[3]:
                frequency = Fraction(edge)
                # how far poles and zeros are from 1 and -1, of which the rounding of a coefficient takes 2**-53
                ends = [
                    abs(c0 + s * c1 + c2) for row in made.rows for c0, c1, c2 in (row[:3], row[3:]) for s in (1, -1)
                ]
                near = min(end for end in ends if end > 1e-15)
                width = float(Fraction(case[3][-1]) - Fraction(case[3][0])) if len(case[3]) > 1 else 1.0
                tolerance = 4 * case[2] ** 2 * 2.0**-53 / min(near, width**2) / float(expected)
                assert abs(float(gain(made, frequency) / expected) - 1) < tolerance, (case, edge)


def test_coefficients_are_the_nearest_doubles() -> None:
    """Order 2 at 0.1: a1 and a2 by their textbook formulas, to 120 digits."""
    row = designed("butterworth", "lowpass", 2, ("0.1",)).rows[0]
    with ctx.workprec(400):
        c = warped(Fraction(1, 10), Fraction(1))
        under = 1 + arb(2).sqrt() * c + c**2
        a1, a2 = 2 * (c**2 - 1) / under, (1 - arb(2).sqrt() * c + c**2) / under
        for value, exact in ((row[4], a1), (row[5], a2)):
            distance = abs(exact - value)
            assert distance <= abs(exact - math.nextafter(value, math.inf))
            assert distance <= abs(exact - math.nextafter(value, -math.inf))


@pytest.mark.slow
def test_structure_is_exact() -> None:
    assert designed("butterworth", "lowpass", 2, ("0.25",)).rows[0][4] == 0.0
    assert designed("butterworth", "lowpass", 1, ("0.25",)).rows == ((0.5, 0.5, 0.0, 1.0, 0.0, 0.0),)
    for case in cases():
        for b0, b1, b2, one, _, _ in designed(*case).rows if case[2] in {2, 5} else ():
            assert one == 1.0
            if case[1] == "lowpass" and case[0] in {"butterworth", "chebyshev1", "bessel"}:
                assert (b1, b2) in {(2 * b0, b0), (b0, 0.0)}
            elif case[0] in {"chebyshev2", "elliptic"} and b2:
                assert b2 in {b0, -b0}


@pytest.mark.sweep(2)
@pytest.mark.parametrize("order", [1, 2, 5, 8])
def test_elliptic_ripples_reach_their_losses(order: int) -> None:
    """The prototype's gain swings between its two limits in the pass band, and reaches the stop band's: equiripple."""
    with ctx.workprec(256):
        made = prototype("elliptic", order, PASSBAND_LOSS, STOPBAND_LOSS)

        def gain_at(frequency: float) -> float:
            s, value = acb(0, frequency), acb(made.dc_gain)
            for zero in made.zeros:
                value *= 1 + (s / zero) ** 2
            for pole in (*map(acb, made.real_poles), *made.pole_pairs, *(p.conjugate() for p in made.pole_pairs)):
                value /= 1 - s / pole
            return float(abs(value))

        gains = [gain_at(k / 2000) for k in range(2001)]
        low = float((1 + excess(PASSBAND_LOSS)).rsqrt())
        assert gains[-1] == pytest.approx(low, rel=1e-14)
        assert min(gains) == pytest.approx(low, rel=1e-12)
        assert max(gains) == pytest.approx(1, rel=1e-4)
        if order > 2:
            beyond = [gain_at(float(made.zeros[0]) * (1 + k / 400)) for k in range(20000)]
            assert max(beyond) == pytest.approx(float((1 + excess(STOPBAND_LOSS)).rsqrt()), rel=1e-2)


@pytest.mark.parametrize("family", ["butterworth", "chebyshev1", "chebyshev2", "elliptic"])
def test_minimum_orders_are_scipys(family: str) -> None:
    choose = {
        "butterworth": signal.buttord,
        "chebyshev1": signal.cheb1ord,
        "chebyshev2": signal.cheb2ord,
        "elliptic": signal.ellipord,
    }[family]
    edges = {
        "lowpass": ((0.1,), (0.2,)),
        "highpass": ((0.2,), (0.1,)),
        "bandpass": ((0.1, 0.2), (0.06, 0.27)),
        "bandstop": ((0.05, 0.3), (0.1, 0.2)),
    }
    for kind, (passband, stopband) in edges.items():
        made = design(
            FilterSpec(
                family=family,
                kind=kind,
                method="bilinear",
                order=None,
                cutoff=None,
                passband_edge=tuple(Fraction(str(f)) for f in passband),
                stopband_edge=tuple(Fraction(str(f)) for f in stopband),
                passband_loss=PASSBAND_LOSS,
                stopband_loss=STOPBAND_LOSS,
                sos=None,
            ),
            1,
        )
        order, natural = choose(np.squeeze(passband), np.squeeze(stopband), 0.5, 40, fs=1.0)
        assert made.order == order * (2 if kind.startswith("band") else 1)
        # scipy looks for the best edge of a band-stop to 1e-5 only
        tolerance = 1e-4 if kind == "bandstop" else 1e-12
        assert made.cutoff == pytest.approx(np.atleast_1d(natural), rel=tolerance)
