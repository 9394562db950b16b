"""Impulse-invariant filters: the analog impulse response sampled, its aliases, and the way to integers."""

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import linalg, signal
from tests.gen.designs import EXAMPLES, example_design
from tests.gen.word_lengths.filters import errors, plain, stimulus

from sosmith.cli import cli
from sosmith.gen.core import design_core
from sosmith.gen.filter.design import Filter, design
from sosmith.gen.filter.impulse_invariance import Aliasing
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.manifest import manifest
from sosmith.gen.realizations.registry import CASCADES
from sosmith.gen.specification.specification import FilterSpec, load

CASES = [
    ("butterworth", 1, 0.05),
    ("butterworth", 2, 0.0026),
    ("butterworth", 3, 0.3),
    ("butterworth", 4, 0.02),
    ("butterworth", 7, 0.002588),
    ("butterworth", 8, 0.1),
    ("chebyshev1", 3, 0.05),
    ("chebyshev1", 6, 0.01),
    ("chebyshev2", 3, 0.05),
    ("chebyshev2", 5, 0.0026),
    ("elliptic", 5, 0.02),
    ("elliptic", 7, 0.1),
    ("bessel", 5, 0.01),
    ("bessel", 6, 0.15),
]
ALL_POLE = [case for case in CASES if case[0] in {"butterworth", "bessel"} and case[1] > 1]
"""Without those of order 1, whose impulse response starts with a step: the sum of its aliases does not converge."""


@dataclass(frozen=True)
class Analog:
    """``gain * prod(s - zeros) / prod(s - poles)``, s in radians per sample; scipy's."""

    zeros: np.ndarray
    poles: np.ndarray
    gain: float


def analog(family: str, order: int, cutoff: float) -> Analog:
    edge = 2 * np.pi * cutoff
    zeros, poles, gain = {
        "butterworth": lambda: signal.butter(order, edge, analog=True, output="zpk"),
        "chebyshev1": lambda: signal.cheby1(order, 0.5, edge, analog=True, output="zpk"),
        "chebyshev2": lambda: signal.cheby2(order, 50, edge, analog=True, output="zpk"),
        "elliptic": lambda: signal.ellip(order, 0.5, 50, edge, analog=True, output="zpk"),
        "bessel": lambda: signal.bessel(order, edge, analog=True, output="zpk", norm="mag"),
    }[family]()
    return Analog(np.asarray(zeros), np.asarray(poles), float(gain))


def sampled(family: str, order: int, cutoff: float) -> tuple[np.ndarray, Aliasing]:
    """Sections and aliasing; `cutoff` as a part of the sample rate."""
    made = designed(family, order, cutoff)
    assert made.aliasing is not None
    return made.sos, made.aliasing


def designed(family: str, order: int, cutoff: float) -> Filter:
    """Filter at 100 Hz; `cutoff` as a part of that."""
    return design(
        FilterSpec(
            family=family,
            kind="lowpass",
            method="impulse_invariant",
            order=order,
            cutoff=(Fraction(cutoff) * 100,),
            passband_edge=None,
            stopband_edge=None,
            passband_loss=Fraction(1, 2),
            stopband_loss=Fraction(50),
            sos=None,
        ),
        100.0,
    )


def sampled_response(family: str, order: int, cutoff: float, samples: int) -> np.ndarray:
    """h_a(n T) by a matrix exponential in the time of the prototype, whose cutoff is 1 rad/s."""
    model = analog(family, order, 1 / (2 * math.pi))
    a, b, c, _ = signal.zpk2ss(model.zeros, model.poles, model.gain)
    step = linalg.expm(a * 2 * math.pi * cutoff)
    x, result = b[:, 0], []
    for _ in range(samples):
        result.append(float(c[0] @ x))
        x = step @ x
    return 2 * math.pi * cutoff * np.array(result)


@pytest.mark.parametrize(("family", "order", "cutoff"), CASES)
def test_the_impulse_response_is_that_of_the_analog_filter(family: str, order: int, cutoff: float) -> None:
    made = designed(family, order, cutoff)
    samples = min(2000, int(5 / cutoff))
    impulse = np.zeros(samples)
    impulse[0] = 1
    h = signal.sosfilt(made.sos, impulse)
    expected = sampled_response(family, order, cutoff, samples)
    # 1e-9: below it the DC gain of a design snaps to one.
    assert np.abs(h - expected).max() < 2e-9 * np.abs(expected).max()
    assert len(made.rows) == (order + 1) // 2
    assert all(row[2] == 0 or row[5] != 0 for row in made.rows)


def test_agrees_with_scipy_where_scipy_is_exact() -> None:
    for order in (1, 2, 3):
        model = analog("butterworth", order, 0.08)
        b, a = signal.zpk2tf(model.zeros, model.poles, model.gain)
        theirs = signal.cont2discrete((b, a), 1.0, method="impulse")
        sos, _ = sampled("butterworth", order, 0.08)
        w = np.linspace(0, np.pi, 100)
        ours = signal.sosfreqz(sos, worN=w)[1]
        assert np.abs(ours - signal.freqz(theirs[0][0], theirs[1], worN=w)[1]).max() < 1e-12


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("family", "order", "cutoff"), ALL_POLE)
def test_the_aliasing_is_that_of_the_poisson_sum(family: str, order: int, cutoff: float) -> None:
    """The response is the sum of the analog one over all multiples of the sample rate, for an h_a that starts at 0."""
    model = analog(family, order, cutoff)
    terms = np.arange(-4000, 4001)

    def aliased(frequency: float) -> complex:
        s = 2j * np.pi * (frequency - terms)
        return complex(np.sum(model.gain / np.prod(s[:, np.newaxis] - model.poles, axis=1)))

    sos, found = sampled(family, order, cutoff)
    # The tail of order 2 falls like 1/k**2: both sides of it together leave 2 / 4000 of the first alias.
    tolerance = 1e-3 * (cutoff**2 if order == 2 else 1e-5)
    assert found.dc_error == pytest.approx(abs(aliased(0.0)) - 1, abs=tolerance)
    frequencies = np.linspace(0, 0.5, 200)
    response = signal.sosfreqz(sos, worN=frequencies, fs=1.0)[1]
    expected = np.array([aliased(f) for f in frequencies])
    assert np.abs(response - expected).max() < tolerance + 1e-9
    model_magnitude = np.abs([model.gain / np.prod(2j * np.pi * f - model.poles) for f in frequencies])
    deviation = np.abs(np.abs(expected) - model_magnitude).max()
    assert deviation <= found.max_deviation + tolerance + 1e-9
    assert found.max_deviation < 1.1 * deviation + tolerance + 1e-9


def test_first_order_in_closed_form() -> None:
    """h[n] = W exp(-W n), hence a gain of W / (1 - exp(-W)) at zero frequency."""
    w = 2 * math.pi * 0.05
    sos, found = sampled("butterworth", 1, 0.05)
    assert sos[0] == pytest.approx([w, 0, 0, 1, -math.exp(-w), 0], rel=1e-14)
    assert found.dc_error == pytest.approx(w / (1 - math.exp(-w)) - 1, rel=1e-12)


def test_zeros_of_a_narrow_low_pass_are_those_of_eulers_polynomial() -> None:
    """As the cutoff falls, order 4 tends to w (1 + 4 w + w**2): zeros -2 +- sqrt(3), whatever the poles."""
    sos, _ = sampled("butterworth", 4, 1e-5)
    zeros = sorted(root for row in sos for root in np.roots(np.trim_zeros(row[:3], "f")) if root)
    assert zeros == pytest.approx([-2 - math.sqrt(3), -2 + math.sqrt(3)], rel=1e-4)


def test_the_aliasing_falls_with_the_cutoff() -> None:
    deviations = [designed("butterworth", 3, cutoff).aliasing for cutoff in (0.2, 0.1, 0.05)]
    sizes = [found.max_deviation for found in deviations if found is not None]
    assert sizes == sorted(sizes, reverse=True)
    assert len(sizes) == 3


def test_a_filter_without_fall_off_is_refused() -> None:
    message = "zeros must be fewer than the 4 poles, not 4"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        sampled("elliptic", 4, 0.1)


def test_the_design_says_what_it_is() -> None:
    made = designed("butterworth", 5, 0.02)
    assert made.describe == "Butterworth lowpass, order 5, 2 Hz at 100 Hz, impulse-invariant"
    assert made.aliasing is not None
    assert made.aliasing.max_deviation < 1e-6


@pytest.mark.slow
def test_from_the_specification_to_the_manifest(tmp_path: Path) -> None:
    text = (EXAMPLES / "audio_lowpass.toml").read_text(encoding="utf-8").replace("bilinear", "impulse_invariant")
    path = tmp_path / "spec.toml"
    path.write_text(text, encoding="utf-8")
    made = design_core(load(path), realization="df1_ef2")
    expected = designed("butterworth", 5, 1000 / 48000).aliasing
    assert expected is not None
    told = manifest(core_facts(made))["aliasing"]
    assert told["max_deviation"] == pytest.approx(expected.max_deviation, rel=1e-3)
    assert told["dc_error"] == pytest.approx(expected.dc_error, abs=1e-12)
    assert manifest(core_facts(example_design("audio_lowpass.toml", realization="df1_ef2")))["aliasing"] is None
    arguments = ["design", str(path), "--realization", "df1_ef2"]
    shown = CliRunner().invoke(cli, arguments, env={"COLUMNS": "120"}).stdout
    deviation, dc = (f"{100 * told[key]:.3g}" for key in ("max_deviation", "dc_error"))
    assert f"at most {deviation} % of the gain, {dc} % at zero frequency" in shown


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "order", "cutoff", "realization"),
    [
        pytest.param(*CASES[case], realization, marks=[] if (i + k) % 3 == 0 else [pytest.mark.slow])
        for i, case in enumerate((3, 6, 10))
        for k, realization in enumerate(CASCADES)
    ],
)
def test_general_numerators_stay_within_their_bound(family: str, order: int, cutoff: float, realization: str) -> None:
    quantized = plain(designed(family, order, cutoff), realization)
    codes = stimulus(quantized.datapath.inputs, order)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    quantized.datapath.compute_exact(codes[6000:7500])  # raises if a value leaves its range
