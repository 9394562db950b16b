"""Filter design against scipy and the reference table of the theory notes."""

import math
import re
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy import signal

from sosmith.gen.filter.design import Filter, decay_length, design, minimum_order, prewarp, unwarp
from sosmith.gen.specification.specification import FilterSpec
from sosmith.model.errors import ShortfallError, SpecificationError

NONE = FilterSpec(
    family="butterworth",
    kind="lowpass",
    method="bilinear",
    order=None,
    cutoff=None,
    passband_edge=None,
    stopband_edge=None,
    passband_loss=None,
    stopband_loss=None,
    sos=None,
)


def spec(**keys: Any) -> FilterSpec:
    return replace(NONE, **keys)


def edges(*values: float) -> tuple[Fraction, ...]:
    return tuple(Fraction(v) for v in values)


@pytest.mark.sweep(60)
@pytest.mark.parametrize("order", range(1, 11))
@pytest.mark.parametrize("kind", ["lowpass", "highpass", "bandpass", "bandstop"])
@pytest.mark.parametrize("family", ["butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel"])
def test_sections_make_scipys_filter(family: str, kind: str, order: int) -> None:
    edge = 0.11 if kind in {"lowpass", "highpass"} else (0.11, 0.17)
    cutoff = edge if isinstance(edge, tuple) else (edge,)
    wanted = {
        "butterworth": lambda: signal.butter(order, edge, kind, fs=1.0, output="zpk"),
        "chebyshev1": lambda: signal.cheby1(order, 0.5, edge, kind, fs=1.0, output="zpk"),
        "chebyshev2": lambda: signal.cheby2(order, 40, edge, kind, fs=1.0, output="zpk"),
        "elliptic": lambda: signal.ellip(order, 0.5, 40, edge, kind, fs=1.0, output="zpk"),
        "bessel": lambda: signal.bessel(order, edge, kind, fs=1.0, output="zpk", norm="mag"),
    }[family]()
    made = design(
        spec(
            family=family,
            kind=kind,
            order=order,
            cutoff=edges(*cutoff),
            passband_loss=Fraction(1, 2) if family in {"chebyshev1", "elliptic"} else None,
            stopband_loss=Fraction(40) if family in {"chebyshev2", "elliptic"} else None,
        ),
        1.0,
    )
    assert made.order == order * (2 if kind.startswith("band") else 1)
    z = np.exp(2j * np.pi * np.linspace(0.001, 0.499, 400))
    ours = np.prod([np.polyval(row[:3], z) / np.polyval(row[3:], z) for row in made.sos], axis=0)
    theirs = wanted[2] * np.prod([z - r for r in wanted[0]], axis=0) / np.prod([z - p for p in wanted[1]], axis=0)
    assert np.abs(ours - theirs).max() < 1e-10


@pytest.mark.parametrize("order", range(1, 9))
def test_butterworth_agrees_with_scipy_to_twelve_digits(order: int) -> None:
    made = design(spec(order=order, cutoff=edges(0.2588)), 100.0)
    theirs = signal.butter(order, 0.2588, fs=100.0, output="sos")
    poles = [
        sorted(np.concatenate([np.roots(row[3:]) for row in sos]), key=lambda p: (p.real, p.imag))
        for sos in (made.sos, theirs)
    ]
    assert np.abs(np.array(poles[0])[-order:] - np.array(poles[1])[-order:]).max() < 1e-7  # roots of a double pole pair
    coefficients = sorted(tuple(row[4:]) for row in made.sos)
    expected = sorted(tuple(row[4:]) for row in theirs)
    assert np.abs(np.array(coefficients) - np.array(expected)).max() < 1e-12


@pytest.mark.parametrize(
    "arguments",
    [
        (0.1, 0.9, 0.1, 40.0, 6.0),
        (10.0, 45.0, 0.02, 60.0, 100.0),
        (100.0, 200.0, 1.0, 80.0, 1000.0),
        (1, 3, 3, 20, 8000),
    ],
)
def test_minimum_order_agrees_with_scipy(arguments: tuple[float, ...]) -> None:
    order, cutoff = minimum_order(*arguments)
    theirs = signal.buttord(*arguments[:4], fs=arguments[4])
    assert order == theirs[0]
    assert cutoff == pytest.approx(theirs[1], rel=1e-12)
    made = design(
        spec(
            passband_edge=edges(arguments[0]),
            stopband_edge=edges(arguments[1]),
            passband_loss=Fraction(arguments[2]),
            stopband_loss=Fraction(arguments[3]),
        ),
        arguments[4],
    )
    assert (made.order, made.cutoff) == (order, (cutoff,))


@pytest.mark.parametrize("family", ["butterworth", "chebyshev1", "chebyshev2", "elliptic"])
@pytest.mark.parametrize(
    ("kind", "passband", "stopband"),
    [
        ("lowpass", (10.0,), (20.0,)),
        ("highpass", (20.0,), (10.0,)),
        ("bandpass", (10.0, 20.0), (5.0, 30.0)),
        ("bandstop", (5.0, 30.0), (10.0, 20.0)),
    ],
)
def test_edges_and_losses_are_met(
    family: str, kind: str, passband: tuple[float, ...], stopband: tuple[float, ...]
) -> None:
    made = design(
        spec(
            family=family,
            kind=kind,
            passband_edge=edges(*passband),
            stopband_edge=edges(*stopband),
            passband_loss=Fraction(1, 2),
            stopband_loss=Fraction(50),
        ),
        100.0,
    )
    _, pass_gain = signal.sosfreqz(made.sos, worN=np.array(passband), fs=100.0)
    _, stop_gain = signal.sosfreqz(made.sos, worN=np.array(stopband), fs=100.0)
    assert (20 * np.log10(np.abs(pass_gain)) >= -0.5 - 1e-6).all()
    assert (20 * np.log10(np.abs(stop_gain)) <= -50 + 1e-6).all()


def test_prewarping_is_the_papers_and_undone() -> None:
    """THEORY section 0: 10 Hz at 100 Hz is 64.98 rad/s; table 3's stop band edge."""
    assert prewarp(10, 100) == pytest.approx(64.98, abs=0.005)
    assert prewarp(0.9, 6) == pytest.approx(12 * math.tan(0.15 * math.pi), rel=1e-15)
    assert unwarp(prewarp(3.3, 100), 100) == pytest.approx(3.3, rel=1e-14)


def test_reference_sections_of_the_locomotive_filter() -> None:
    """THEORY section 0, exact sections at u = 0.00813, to all printed digits."""
    cutoff = 100 / math.pi * math.atan(0.00813)
    made = design(spec(order=7, cutoff=(Fraction(cutoff),)), 100.0)
    expected = {
        (-1.992526765172, 0.992790182268),
        (-1.979667200762, 0.979928917791),
        (-1.970864853285, 0.971125406621),
        (-0.983871127732, 0.0),
    }
    assert {(round(row[4], 12), round(row[5], 12)) for row in made.sos.tolist()} == expected


def test_every_low_pass_section_has_unity_gain_at_zero_frequency() -> None:
    for order in range(1, 10):
        sos = design(spec(order=order, cutoff=edges(0.3)), 100.0).sos
        gains = sos[:, :3].sum(axis=1) / sos[:, 3:].sum(axis=1)
        assert np.abs(gains - 1).max() < 1e-12
        assert all((row[2] == 0) == (row[5] == 0) for row in sos)  # as many zeros as poles


def test_given_sections_keep_their_transfer_function() -> None:
    sos = signal.ellip(5, 0.3, 50, 0.08, fs=1.0, output="sos")
    made = design(spec(sos=tuple(tuple(Fraction(float(v)) for v in row) for row in sos)), 1.0)
    x = np.random.default_rng(0).standard_normal(2000)
    assert np.abs(signal.sosfilt(made.sos, x) - signal.sosfilt(sos, x)).max() < 1e-12
    assert (made.kind, made.order, made.cutoff) == ("lowpass", 5, None)


def test_impulse_response_is_long_enough() -> None:
    made = design(spec(order=7, cutoff=edges(0.2588)), 100.0)
    response = made.impulse_response
    assert abs(response[-100:]).max() < 1e-12 * abs(response).max()
    assert response.sum() == pytest.approx(1, abs=1e-12)


def test_the_papers_printed_coefficients_are_unstable() -> None:
    """Table 10 as printed, with four digits, has poles far outside the unit circle (THEORY section 0)."""
    printed = [1, -6.927, 20.56, -33.92, 33.56, -19.93, 6.574, -0.9295]
    assert np.abs(np.roots(printed)).max() == pytest.approx(1.726, abs=5e-4)


def test_refusals() -> None:
    tight = spec(
        passband_edge=edges(10.0), stopband_edge=edges(10.5), passband_loss=Fraction(1, 100), stopband_loss=Fraction(90)
    )
    message = (
        "filter's edges and losses must be met by an order of at most 20, not 257: "
        "widen the transition band or lower stopband_loss"
    )
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        design(tight, 100.0)
    barely_stable = np.array([[1.0, 0, 0, 1, -2 + 1e-9, 1 - 1e-9]])
    with pytest.raises(
        ShortfallError,
        match=r"^the impulse response must decay within 16777216 samples, not 8\.29e\+10: "
        r"a pole lies too close to the unit circle$",
    ):
        decay_length(barely_stable)


def test_description_names_what_people_ask_for() -> None:
    made: Filter = design(spec(order=7, cutoff=edges(0.25)), 100.0)
    assert made.describe == "Butterworth lowpass, order 7, 0.25 Hz at 100 Hz"
    fast = design(spec(kind="bandpass", order=2, cutoff=edges(2.5e6, 10e6)), 250e6)
    assert fast.describe == "Butterworth bandpass, order 4, 2.5 to 10 MHz at 250 MHz"


@pytest.mark.parametrize(
    ("kind", "cutoff", "factor"),
    [
        ("lowpass", (0.2587803,), 16),
        ("lowpass", (2.51,), 1),
        ("lowpass", (2.49,), 2),
        ("lowpass", (40.0,), 1),
        ("bandpass", (0.01, 1.0), 4),
        ("highpass", (0.01,), 1),
        ("bandstop", (0.01, 1.0), 1),
    ],
)
def test_decimation_leaves_twenty_samples_per_period(kind: str, cutoff: tuple[float, ...], factor: int) -> None:
    assert design(spec(kind=kind, order=2, cutoff=edges(*cutoff)), 100.0).decimation == factor


def test_decimation_of_given_sections_is_not_known() -> None:
    rows = ((Fraction(1, 10**6), Fraction(0), Fraction(0), Fraction(1), Fraction(-999999, 10**6), Fraction(0)),)
    assert design(spec(sos=rows), 100.0).decimation == 1
