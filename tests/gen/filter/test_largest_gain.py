"""The largest gain at any frequency: bounded, reached, and found where it is."""

from fractions import Fraction
from types import ModuleType

import numpy as np
import pytest
from tests.formal.prover import broken
from tests.gen.filter.decimations import RATE, lowpass
from tests.gen.filter.gains import CASES, made

from sosmith.gen.filter import largest_gain
from sosmith.gen.filter.decimation import Decimation
from sosmith.gen.filter.design import Filter, design
from sosmith.gen.filter.largest_gain import TOLERANCE, LargestGain
from sosmith.gen.filter.response import complex_response


def gains_in(found: Decimation, filter_: Filter, frequencies: np.ndarray) -> np.ndarray:
    """Return the gain from frequencies in Hz at the input to wherever they fold."""
    return found.gain(frequencies) * abs(complex_response(filter_.sos, frequencies, float(found.rate)))


def check(found: Decimation, filter_: Filter, module: ModuleType = largest_gain) -> None:
    """Compare the bounds of all bands with gains on a fine grid."""
    rate = float(found.rate)
    peaks = module.band_gains(filter_.exact, found.factor, found.stages)
    assert len(peaks) == found.factor // 2
    for band, peak in enumerate(peaks, start=1):
        frequencies = np.linspace((band - 0.5) * rate, min((band + 0.5) * rate, float(RATE) / 2), 20_001)
        gains = gains_in(found, filter_, frequencies)
        assert gains.max() <= float(peak.gain) <= gains.max() * (1 + 1.1 * float(TOLERANCE))
        (at,) = gains_in(found, filter_, np.array([(band - float(peak.at)) * rate]))
        assert at * (1 + float(TOLERANCE)) == pytest.approx(float(peak.gain), rel=1e-6)


def check_intervals(found: Decimation, filter_: Filter, module: ModuleType = largest_gain) -> None:
    """Compare the bounds on intervals, long and short, with gains within them."""
    gains = module.LargestGain(filter_.exact, found.factor, found.stages)
    for count in (1, 8, 64):
        for k in range(count):
            low, high = Fraction(k, 2 * count), Fraction(k + 1, 2 * count)
            within = np.linspace(float(low), float(high), 101) * float(found.rate)
            for band in (1, found.factor // 2):
                _, bound = gains.on_interval(low, high, band)
                assert gains_in(found, filter_, band * float(found.rate) - within).max() <= float(bound) * (1 + 1e-9)


@pytest.mark.sweep(3)
@pytest.mark.parametrize("case", CASES)
def test_a_whole_band_is_bounded_and_the_bound_is_reached(case: tuple[str, int, int, int, str]) -> None:
    found, filter_ = made(*case)
    check(found, filter_)
    check_intervals(found, filter_)
    assert found.bands(filter_) == largest_gain.band_gains(filter_.exact, found.factor, found.stages)


@pytest.mark.parametrize("family", ["butterworth", "chebyshev2", "elliptic"])
@pytest.mark.parametrize("low", [Fraction(1, 32), Fraction(2, 5), Fraction(0)])
def test_a_filter_without_a_decimator(family: str, low: Fraction) -> None:
    filter_ = design(lowpass(5, "2", family=family), RATE)
    peak = LargestGain(filter_.exact).from_frequency(low)
    frequencies = np.linspace(float(low), 0.5, 100_001)[:-1] * float(RATE)
    gains = abs(complex_response(filter_.sos, frequencies, float(RATE)))
    assert gains.max() * (1 - 1e-9) <= float(peak.gain) <= gains.max() * (1 + 1.1 * float(TOLERANCE))
    assert low <= peak.at <= Fraction(1, 2)


BROKEN = [
    ("slope of the CIC filter", "slope = stages * arb.pi()", "slope = -stages * arb.pi()"),
    ("no slope", "(abs(self.slope) * ball(length / 2))", "(abs(self.slope) * 0)"),
    ("half the frequency", "(acb(-2 * q)", "(acb(-q)"),
    ("above the multiple", "((band - q) / factor)", "((band + q) / factor)"),
    ("poles as zeros", "power * slope)", "slope)"),
    ("a bound that is not rounded up", "+ Fraction(1, 1 << _GAIN_BITS))", "- TOLERANCE)"),
]


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN])
def test_a_bound_that_does_not_hold_is_seen(right: str, wrong: str) -> None:
    module = broken(largest_gain, right, wrong)
    cases = [made(*case) for case in CASES]

    def check_all() -> None:
        for case in cases:
            check_intervals(*case, module)
            check(*case, module)

    with pytest.raises(AssertionError):
        check_all()
