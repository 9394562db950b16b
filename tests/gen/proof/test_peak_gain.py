"""Peak gains against reference figures, closed forms, brute force, and a second method."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from sosmith.gen.proof.cascade_proof import ideal_gain
from sosmith.gen.proof.nodes import LONGEST
from sosmith.gen.proof.peak_gain import Drive, Extent, extent, peak_gain
from sosmith.gen.proof.poles import Coefficients, pole_radii
from sosmith.gen.proof.response import IMPULSE
from sosmith.gen.proof.sums import Recursion
from sosmith.model.errors import ShortfallError
from sosmith.verify.bounds.l1_response import inverse, is_stable, response

Section = tuple[Coefficients, Coefficients]

ONE = (Fraction(1),)
DIFFERENCES = ((1, -1), (1, -2, 1))
"""Numerators ``1 - w`` and ``(1 - w)**2``: error feedback of first and second order."""


def dyadic(*values: float) -> Coefficients:
    return tuple(Fraction(value) for value in values)


def polynomial(values: Coefficients) -> fmpq_poly:
    return fmpq_poly([fmpq(value.numerator, value.denominator) for value in values])


def butterworth(u: float, order: int) -> list[Section]:
    """Bilinear Butterworth sections with unity gain at zero frequency, the highest Q first; u = tan(pi fc / fs)."""
    sections = []
    for k in range(order // 2):
        c = 2 * math.sin(math.pi * (2 * k + 1) / (2 * order))  # 1 / Q
        a0 = 1 + c * u + u * u
        b0 = u * u / a0
        sections.append((dyadic(b0, 2 * b0, b0), dyadic(1, 2 * (u * u - 1) / a0, (1 - c * u + u * u) / a0)))
    if order % 2:
        b0 = u / (1 + u)
        sections.append((dyadic(b0, b0), dyadic(1, -(1 - u) / (1 + u))))
    return sections


F7 = butterworth(0.00813, 7)


@pytest.mark.parametrize(
    ("index", "a", "gain", "recursion", "shaped"),
    [
        (0, ("-1.992526765172", "0.992790182268"), "2.907748", "11039.05", ("177.4", "4.1213")),
        (1, ("-1.979667200762", "0.979928917791"), "1.177827", "4500.43", ("66.14", "2.5257")),
        (2, ("-1.970864853285", "0.971125406621"), "1.002942", "3849.28", ("49.22", "2.3152")),
        (3, ("-0.983871127732",), "1.000000", "62.00", ("2.00",)),
    ],
)
def test_sections_of_the_seventh_order_filter(
    index: int, a: tuple[str, ...], gain: str, recursion: str, shaped: tuple[str, ...]
) -> None:
    """The figures of the reference table, to every digit that it prints."""
    numerator, denominator = F7[index]
    assert tuple(f"{float(value):.12f}" for value in denominator[1:]) == a
    assert f"{float(peak_gain([(numerator, denominator)])):.6f}" == gain
    assert f"{float(peak_gain([(ONE, denominator)])):.2f}" == recursion
    for taps, expected in zip(DIFFERENCES, shaped, strict=False):
        digits = len(expected.partition(".")[2])
        assert f"{float(peak_gain([(dyadic(*taps), denominator)])):.{digits}f}" == expected


@pytest.mark.parametrize(
    ("radians", "sections", "recursions", "whole"),
    [
        (3.727, ("2.174511", "1.033734", "1.000000"), ("7.649556", "4.294890", "2.109874"), None),
        (1.871, ("2.139089", "1.028179", "1.000000"), ("24.98", "13.51", "3.71"), "1.403676"),
    ],
)
def test_sections_of_the_fifth_order_filter(
    radians: float, sections: tuple[str, ...], recursions: tuple[str, ...], whole: str | None
) -> None:
    """Likewise; the table cuts the last digit of 7.6495557 off."""
    made = butterworth(radians / 12, 5)  # at 6 Hz
    assert tuple(f"{float(peak_gain([section])):.6f}" for section in made) == sections
    for (_, denominator), expected in zip(made, recursions, strict=True):
        assert f"{float(peak_gain([(ONE, denominator)])):.{len(expected.partition('.')[2])}f}" == expected
    if whole is not None:
        assert f"{float(peak_gain(made)):.6f}" == whole


def test_the_whole_seventh_order_filter() -> None:
    """Its gain, and the overshoot of its step response: the extent of a constant drive."""
    assert f"{float(peak_gain(F7)):.6f}" == "1.558978"
    assert ideal_gain(F7) == peak_gain(F7)
    made = IMPULSE
    for numerator, denominator in F7:
        made = made.all_pole(denominator).taps(numerator)
    assert f"{float(extent([Drive(made, Fraction(1), Fraction(1))]).high):.4f}" == "1.1541"


@pytest.mark.parametrize("quality", [0.3, 0.5, 0.51, 0.7071, 2.24698, 10.0])
def test_closed_form_of_a_continuous_section(quality: float) -> None:
    """A bilinear low-pass section tends to ``coth(pi / (2 sqrt(4 Q**2 - 1)))``, or 1 up to Q = 1/2, as u falls."""
    expected = 1.0 if quality <= 0.5 else 1 / math.tanh(math.pi / (2 * math.sqrt(4 * quality**2 - 1)))
    found = []
    for u in (2.0**-6, 2.0**-9):
        a0 = 1 + u / quality + u * u
        b0 = u * u / a0
        denominator = dyadic(1, 2 * (u * u - 1) / a0, (1 - u / quality + u * u) / a0)
        found.append(abs(float(peak_gain([(dyadic(b0, 2 * b0, b0), denominator)])) - expected))
    assert found[1] <= max(found[0] / 7, 1e-9)  # the error falls as u or faster
    assert found[1] < 0.001 * expected


def test_a_term_far_below_the_others_counts() -> None:
    """Poles at 0.9 and 0.1 with weights 1 and 1e-12: 10 + 1e-12 / 0.9, where public code says 9.99871."""
    small = Fraction(1e-12)
    slow, fast = Fraction(0.9), Fraction(0.1)
    numerator = (1 + small, -(fast + small * slow))
    exact = 1 / (1 - slow) + small / (1 - fast)
    denominator = (Fraction(1), -(slow + fast), slow * fast)
    assert f"{float(exact):.13f}" == "10.0000000000011"
    assert exact < peak_gain([(numerator, denominator)]) < exact + small / 4
    closer = response(polynomial(numerator), inverse(polynomial(denominator))).gain
    assert exact < closer < exact + Fraction(1, 10**30)


@pytest.mark.parametrize("pole", [0.0, 0.5, -0.5, 0.984375, -0.99993896484375])
def test_slack_is_tiny_but_there(pole: float) -> None:
    """The response of one real pole is a geometric series."""
    exact = 1 / (1 - abs(Fraction(pole)))
    found = peak_gain([(ONE, dyadic(1, -pole))])
    assert 0 < found - exact < exact / 2**32


@st.composite
def sections(draw: st.DrawFn) -> Section:
    radius, angle = draw(st.floats(0, 0.97)), draw(st.floats(0, math.pi))
    b = draw(st.lists(st.floats(-2, 2).map(lambda v: round(v, 6)), min_size=1, max_size=3).filter(any))
    return dyadic(*b), dyadic(1, -2 * radius * math.cos(angle), radius * radius)


@pytest.mark.slow
@given(st.lists(sections(), min_size=1, max_size=3))
@settings(max_examples=60)
def test_brute_force_and_the_second_method_agree(cascade: list[Section]) -> None:
    samples = np.zeros(3000)
    samples[0] = 1
    numerator = denominator = fmpq_poly([1])
    for b, a in cascade:
        samples = signal.lfilter([float(v) for v in b], [float(v) for v in a], samples)
        numerator *= polynomial(b)
        denominator *= polynomial(a)
    found = peak_gain(cascade)
    brute = np.abs(samples).sum()
    assert float(found) == pytest.approx(brute, rel=1e-8, abs=1e-10)
    assert is_stable(denominator)
    closer = response(numerator, inverse(denominator))
    assert closer.gain - 2 * closer.error < found < closer.gain * (1 + Fraction(1, 2**20)) + Fraction(1, 2**30)


@pytest.mark.slow
@given(st.floats(-2, 2), st.floats(-1, 1))
@settings(max_examples=200)
def test_radii_lie_just_above_the_poles(a1: float, a2: float) -> None:
    radii = pole_radii(dyadic(1, a1, a2))
    assert sorted(map(float, radii)) == pytest.approx(sorted(np.abs(np.roots([1, a1, a2]))), abs=2e-8)
    product = abs(Fraction(a2))
    assert product <= math.prod(radii) <= product + Fraction(1, 2**70)


def response_of(*samples: float) -> Drive:
    """Return a drive by a response of a few samples and the unit interval."""
    return Drive(IMPULSE.taps(dyadic(*samples)), Fraction(0), Fraction(1))


def near(found: Extent, low: float | Fraction, high: float | Fraction) -> bool:
    slack = Fraction(1, 2**24)
    return Fraction(low) - slack <= found.low <= Fraction(low) and Fraction(high) <= found.high <= high + slack


def test_an_interval_is_used_as_it_is() -> None:
    """A unipolar drive reaches the sum of the positive and that of the negative samples, and no more."""
    one_sided = response_of(3, -1, 2, -0.5)
    assert near(extent([one_sided]), -1.5, 5)
    both_sided = Drive(one_sided.response, Fraction(-1), Fraction(1))
    assert near(extent([both_sided]), -6.5, 6.5)
    offset = Drive(one_sided.response, Fraction(1), Fraction(2))
    assert near(extent([offset]), 0, 3 * 2 - 1 + 2 * 2)


def test_drives_that_balance_at_every_sample_do_so() -> None:
    up, down = response_of(1, 1, 1), response_of(-1, -1, -1)
    constants = [Drive(drive.response, Fraction(1), Fraction(1)) for drive in (up, down)]
    assert near(extent(constants), 0, 0)
    assert near(extent([up, down]), -3, 3)


def test_what_cannot_overshoot_is_not_followed_from_sample_to_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a drive of both signs, a small constant one, of which less is to come than the other still takes."""
    monkeypatch.setattr(Recursion, "highest", lambda *_: pytest.fail("followed"))
    large = Drive(response_of(3, -1, 2, -4).response, Fraction(-1), Fraction(1))
    small = Drive(response_of(1, 1, 1).response, Fraction(1, 8), Fraction(1, 8))
    assert near(extent([large, small]), Fraction(3, 8) - 10, Fraction(3, 8) + 10)


def test_nothing_drives_nothing() -> None:
    assert extent([]) == Extent(Fraction(0), Fraction(0))
    still = Drive(response_of(1, 2).response, Fraction(0), Fraction(0))
    assert extent([still]) == Extent(Fraction(0), Fraction(0))
    nothing = Drive(still.response.minus(still.response), Fraction(-1), Fraction(1))
    other = response_of(3, -1)
    assert extent([nothing, other]) == extent([other])


def test_the_difference_of_equal_responses_is_nothing() -> None:
    made = IMPULSE.all_pole(F7[0][1])
    difference = extent([Drive(made.minus(made), Fraction(-1), Fraction(1))])
    assert difference.low == difference.high == 0


@pytest.mark.parametrize("denominator", [(1, -1), (1, -2, 1), (1, 0, 1), (1, -1.9, 0.89), (1, 0, -1.0625), (1, 3, 2)])
def test_an_unstable_section_is_refused(denominator: tuple[float, ...]) -> None:
    message = "every pole must lie inside the unit circle, and one does not"
    with pytest.raises(ShortfallError, match=f"^{re.escape(message)}$"):
        peak_gain([(ONE, dyadic(*denominator))])


def test_a_response_that_lasts_too_long_is_refused() -> None:
    message = (
        rf"the impulse response must end within {LONGEST} samples, not \d+: "
        r"a pole lies too close to the unit circle"
    )
    with pytest.raises(ShortfallError, match=f"^{message}$"):
        peak_gain([(ONE, dyadic(1, -(1 - 2.0**-24)))])


def test_a_section_of_third_order_is_refused() -> None:
    message = "denominator must be of degree 1 or 2 in w or in a power of w, not of degree 3"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        pole_radii(dyadic(1, 0.25, 0, 0.125))
