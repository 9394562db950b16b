"""The filter that a specification states, derived by the verifier: against scipy, and against closed forms."""

import itertools
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import acb, acb_poly, arb, ctx
from scipy import linalg, signal

from sosmith.model.errors import SpecificationError
from sosmith.verify.specified.ideal_filter import TransferFunction, stated_filter

BITS = 512
FAMILIES = ("butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel")
KINDS = ("lowpass", "highpass", "bandpass", "bandstop")
RIPPLES = {
    "chebyshev1": {"passband_loss": Fraction(1, 2)},
    "chebyshev2": {"stopband_loss": Fraction(40)},
    "elliptic": {"passband_loss": Fraction(1, 2), "stopband_loss": Fraction(40)},
}
SCIPYS = {
    "butterworth": signal.butter,
    "chebyshev1": lambda order, *rest, **more: signal.cheby1(order, 0.5, *rest, **more),
    "chebyshev2": lambda order, *rest, **more: signal.cheby2(order, 40, *rest, **more),
    "elliptic": lambda order, *rest, **more: signal.ellip(order, 0.5, 40, *rest, **more),
    "bessel": lambda order, *rest, **more: signal.bessel(order, *rest, norm="mag", **more),
}


def stated(**table: Any) -> TransferFunction:
    """Enclose the filter of a table; frequencies are parts of the sample rate."""
    return stated_filter(table, Fraction(1)).at(BITS)


def responses(made: TransferFunction, frequencies: list[float]) -> list[complex]:
    with ctx.workprec(BITS):
        over, under = (acb_poly(part.coeffs()) for part in made)
        points = [(acb(0, -2) * arb.pi() * arb(f)).exp() for f in frequencies]
        return [complex(over(w) / under(w)) for w in points]


def scipys_responses(zeros: Any, poles: Any, gain: float, frequencies: list[float]) -> list[complex]:
    """Evaluate the doubles that scipy returns exactly: its design is compared, not its evaluation."""
    with ctx.workprec(BITS):
        result = []
        for f in frequencies:
            z = (acb(0, 2) * arb.pi() * arb(f)).exp()
            value = acb(arb(float(gain)))
            for zero in zeros:
                value *= z - acb(complex(zero))
            for pole in poles:
                value /= z - acb(complex(pole))
            result.append(complex(value))
        return result


@pytest.mark.sweep(25)
@pytest.mark.parametrize("cutoff", ["0.0001", "0.01", "0.2", "0.45"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("family", FAMILIES)
def test_the_response_is_scipys(family: str, kind: str, cutoff: str) -> None:
    """Scipy rounds poles and zeros to doubles.

    That counts by their distance from the frequency, which is a part of the band's width: at resonances and close to
    zeros, a small one.
    """
    edges = [Decimal(cutoff), Decimal(cutoff) * Decimal("1.1")] if kind.startswith("band") else [Decimal(cutoff)]
    low, width = float(edges[0]), float(edges[-1] - edges[0]) or float(edges[0])
    beside = [low * factor for factor in (0.3, 0.9, 1.02, 1.07)]
    frequencies = [*beside, *(0.5 - 0.4 * (0.5 - f) for f in beside)]
    for order in range(1, 11):
        made = stated(family=family, kind=kind, order=order, cutoff=edges, **RIPPLES.get(family, {}))
        theirs = SCIPYS[family](order, np.squeeze(np.array(edges, dtype=float)), kind, fs=1.0, output="zpk")
        ours, expected = responses(made, frequencies), scipys_responses(*theirs, frequencies)
        worst = max(abs(a - b) / abs(b) for a, b in zip(ours, expected, strict=True))
        assert worst < 2**-52 * 1000 * order / width


BANDS = {
    "lowpass": (["0.1"], ["0.17"]),
    "highpass": (["0.17"], ["0.1"]),
    "bandpass": (["0.1", "0.2"], ["0.06", "0.27"]),
    "bandstop": (["0.06", "0.27"], ["0.1", "0.2"]),
}
ESTIMATES = {
    "butterworth": signal.buttord,
    "chebyshev1": signal.cheb1ord,
    "chebyshev2": signal.cheb2ord,
    "elliptic": signal.ellipord,
}


def by_edges(family: str, kind: str, **changed: Any) -> TransferFunction:
    passband, stopband = ([Decimal(edge) for edge in edges] for edges in BANDS[kind])
    table = {"passband_edge": passband, "stopband_edge": stopband, "passband_loss": Fraction(1, 2)}
    return stated(family=family, kind=kind, **{**table, "stopband_loss": 40, **changed})


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("family", ESTIMATES)
def test_the_response_by_edges_and_losses_is_scipys(family: str, kind: str) -> None:
    passband, stopband = (np.array([float(edge) for edge in edges]) for edges in BANDS[kind])
    frequencies = [0.01, 0.08, 0.09, 0.11, 0.16, 0.18, 0.21, 0.3, 0.4]
    for loss in (10, 25, 40, 55):
        made = by_edges(family, kind, stopband_loss=loss)
        order, edges = ESTIMATES[family](passband, stopband, 0.5, loss, fs=1.0)
        design = {**SCIPYS, "chebyshev2": lambda order, *rest, **more: signal.cheby2(order, loss, *rest, **more)}  # noqa: B023
        design["elliptic"] = lambda order, *rest, **more: signal.ellip(order, 0.5, loss, *rest, **more)  # noqa: B023
        theirs = design[family](order, edges, kind, fs=1.0, output="zpk")
        assert made.denominator.degree() == len(theirs[1])
        # Scipy searches for the edge of a band-stop filter, and stops at 1e-5 of an octave.
        tolerance = 1e-3 if kind == "bandstop" else 1e-10
        assert responses(made, frequencies) == pytest.approx(
            scipys_responses(*theirs, frequencies), rel=tolerance, abs=tolerance / 10
        )


def contained(made: TransferFunction, numerator: list[Any], denominator: list[Any]) -> None:
    for part, expected in zip(made, (numerator, denominator), strict=True):
        assert part.length() <= len(expected)
        for found, value in zip(itertools.chain(part.coeffs(), itertools.repeat(arb(0))), expected):  # noqa: B905
            assert found.overlaps(arb(value))
            assert found.rad() < 2.0**-400


def test_closed_forms_of_butterworth_filters() -> None:
    """At a quarter of the sample rate the warped edge is 1."""
    quarter = {"family": "butterworth", "cutoff": Decimal("0.25")}
    contained(stated(kind="lowpass", order=1, **quarter), [0.5, 0.5], [1, 0])
    contained(stated(kind="highpass", order=1, **quarter), [0.5, -0.5], [1, 0])
    with ctx.workprec(BITS):
        first = 1 / (2 + arb(2).sqrt())  # s**2 + sqrt(2) s + 1
        last = (2 - arb(2).sqrt()) / (2 + arb(2).sqrt())
        contained(stated(kind="lowpass", order=2, **quarter), [first, 2 * first, first], [1, 0, last])
        contained(stated(kind="highpass", order=2, **quarter), [first, -2 * first, first], [1, 0, last])
        band = {"family": "butterworth", "order": 1, "cutoff": [Fraction(1, 8), Fraction(3, 8)]}
        contained(stated(kind="bandpass", **band), [0.5, 0, -0.5], [1, 0, 0])  # width 2, product 1
        contained(stated(kind="bandstop", **band), [0.5, 0, 0.5], [1, 0, 0])


def test_a_chebyshev_filter_in_closed_form() -> None:
    """``gain = 1 / sqrt(1 + e**2)`` at zero frequency, and s**2 + 2 a / sqrt(2) s + (a**2 + b**2) / 2."""
    made = stated(family="chebyshev1", kind="lowpass", order=2, cutoff=Fraction(1, 4), passband_loss=1)
    with ctx.workprec(BITS):
        e = ((arb(10).log() / 10).exp() - 1).sqrt()
        a = (((1 + e**2).sqrt() / e - 1) / 2).sqrt()
        c0, c1 = (1 + e**2).sqrt() / (2 * e), arb(2).sqrt() * a
        all_ = 1 + c1 + c0
        gain = c0 / (1 + e**2).sqrt() / all_
        contained(made, [gain, 2 * gain, gain], [1, 2 * (c0 - 1) / all_, (1 - c1 + c0) / all_])


@pytest.mark.parametrize(
    ("family", "order"),
    [("butterworth", 1), ("butterworth", 4), ("chebyshev1", 4), ("chebyshev2", 5), ("elliptic", 3), ("bessel", 6)],
)
def test_impulse_invariance_samples_the_analog_response(family: str, order: int) -> None:
    cutoff = 0.03
    made = stated(
        family=family,
        kind="lowpass",
        method="impulse_invariant",
        order=order,
        cutoff=Decimal("0.03"),
        **RIPPLES.get(family, {}),
    )
    numerator, denominator = ([float(value.mid()) for value in part.coeffs()] for part in made)
    ours = signal.lfilter(numerator, denominator, np.eye(1, 60)[0])
    system = SCIPYS[family](order, 2 * np.pi * cutoff, analog=True, output="zpk")
    a, b, c, _ = signal.zpk2ss(*system)
    theirs = [(c @ linalg.expm(a * n) @ b).item() for n in range(60)]
    assert ours == pytest.approx(np.array(theirs), abs=1e-11)


def test_impulse_invariance_in_closed_form() -> None:
    made = stated(family="butterworth", kind="lowpass", method="impulse_invariant", order=1, cutoff=Decimal("0.05"))
    with ctx.workprec(BITS):
        edge = arb.pi() / 10
        contained(made, [edge], [1, -(-edge).exp()])


def test_sections_are_taken_as_they_are() -> None:
    rows = [[Decimal("0.1"), 0, 0, 1, Decimal("-0.9"), 0], [1, 2, 1, 1, 0, Decimal("0.5")]]
    made = stated(sos=rows)
    with ctx.workprec(BITS):
        third, tenth = arb(1) / 10, -arb(9) / 10
        contained(made, [third, 2 * third, third, 0, 0], [1, tenth, 0.5, tenth / 2, 0])


def test_units_of_frequency_cancel() -> None:
    words = {"family": "bessel", "kind": "lowpass", "order": 2}
    one = stated_filter({**words, "cutoff": Decimal("0.1")}, Fraction(1)).at(BITS)
    other = stated_filter({**words, "cutoff": 4800}, Fraction(48000)).at(BITS)
    assert [str(part) for part in one] == [str(part) for part in other]


def test_more_precision_narrows_the_balls() -> None:
    words = {"family": "elliptic", "kind": "bandstop", "order": 7, **RIPPLES["elliptic"]}
    filter_ = stated_filter({**words, "cutoff": [Decimal("0.00001"), Decimal("0.4999")]}, Fraction(1))
    for bits in (256, 2048):
        radius = max(float(value.rad().log().mid()) for part in filter_.at(bits) for value in part.coeffs()[1:])
        assert radius < -(bits - 128) * np.log(2)


def test_an_order_beyond_the_limit_is_refused() -> None:
    filter_ = {"passband_edge": [Decimal("0.1")], "stopband_edge": [Decimal("0.10001")], "stopband_loss": 100}
    with pytest.raises(
        SpecificationError,
        match=r"^the edges and losses of filter must be met by an order of at most 20, not a higher one$",
    ):
        stated(family="butterworth", kind="lowpass", passband_loss=1, **filter_)
