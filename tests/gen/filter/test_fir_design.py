"""FIR filters by edges and losses: what is proven of their gains, on a dense grid, and by the verifier."""

from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy import signal

from sosmith.gen.filter.fir_design import designed_taps
from sosmith.gen.filter.gain_limits import gains_in, keeps_to
from sosmith.gen.filter.loss_mask import Band, LossMask, mask_of
from sosmith.model.errors import SpecificationError
from sosmith.verify.specified.filter_table import read_filter_table
from sosmith.verify.specified.fir_mask import keeps_to_losses

LOSSES = Fraction(1, 2), Fraction(40)
CASES: list[tuple[str, str, tuple[Fraction, ...], tuple[Fraction, ...], int]] = [
    ("equiripple", "lowpass", (Fraction(1, 10),), (Fraction(1, 5),), 19),
    ("equiripple", "highpass", (Fraction(3, 10),), (Fraction(1, 5),), 19),
    ("equiripple", "bandpass", (Fraction(1, 5), Fraction(3, 10)), (Fraction(1, 10), Fraction(2, 5)), 17),
    ("least_squares", "bandstop", (Fraction(1, 10), Fraction(2, 5)), (Fraction(1, 5), Fraction(3, 10)), 25),
    ("kaiser", "lowpass", (Fraction(1, 10),), (Fraction(1, 5),), 24),
    ("halfband", "lowpass", (Fraction(1, 5),), (Fraction(3, 10),), 23),
]


def mask(case: tuple[str, str, tuple[Fraction, ...], tuple[Fraction, ...], int]) -> LossMask:
    return mask_of(case[1], case[2], case[3], LOSSES)


def table(case: tuple[str, str, tuple[Fraction, ...], tuple[Fraction, ...], int], loss: str = "40") -> Any:
    edges = {"passband_edge": [*case[2]], "stopband_edge": [*case[3]]}
    losses = {"passband_loss": Decimal("0.5"), "stopband_loss": Decimal(loss)}
    return read_filter_table({"family": case[0], "kind": case[1], **edges, **losses}, Fraction(1))


def grid(taps: tuple[Fraction, ...], band: Band) -> np.ndarray[Any, Any]:
    return np.abs(signal.freqz([float(tap) for tap in taps], worN=np.linspace(*map(float, band), 3000), fs=1.0)[1])


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[0]} {case[1]}")
def test_losses_are_kept_with_few_taps(case: tuple[str, str, tuple[Fraction, ...], tuple[Fraction, ...], int]) -> None:
    wanted = mask(case)
    taps = designed_taps(case[0], wanted)
    assert len(taps) == case[4]
    assert taps == taps[::-1]
    for bands, low, high in ((wanted.passbands, 10**-0.025, 1.0), (wanted.stopbands, 0.0, 0.01)):
        for band in bands:
            least, most = gains_in(taps, band)
            sampled = grid(taps, band)
            assert low <= least <= sampled.min() + 1e-12
            assert sampled.max() - 1e-12 <= most <= high
            assert most - sampled.max() < 1e-3 * high  # the enclosure is no wider than it must be
    assert keeps_to_losses(taps, table(case))
    assert not keeps_to_losses(taps, table(case, "90"))


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[0]} {case[1]}")
def test_a_tap_that_is_off_is_seen(case: tuple[str, str, tuple[Fraction, ...], tuple[Fraction, ...], int]) -> None:
    wanted = mask(case)
    first, *others, last = designed_taps(case[0], wanted)
    off = (first + Fraction(1, 50), *others, last + Fraction(1, 50))
    assert not keeps_to(off, wanted)
    assert not keeps_to_losses(off, table(case))
    assert not keeps_to_losses((first + Fraction(1, 10**9), *others, last), table(case))  # not symmetric any more


def test_half_of_a_half_band_filter_is_zero() -> None:
    taps = designed_taps("halfband", mask(CASES[-1]))
    middle = len(taps) // 2
    assert middle % 2 == 1
    assert not any(taps[1:middle:2])
    assert all(taps[::2])


def test_too_narrow_a_transition_band_is_refused() -> None:
    narrow = mask_of("lowpass", (Fraction(1, 10),), (Fraction(1001, 10000),), LOSSES)
    with pytest.raises(
        SpecificationError,
        match=r"^filter's edges and losses must be met by at most 256 taps, and are not: widen the transition band or "
        r"lower stopband_loss$",
    ):
        designed_taps("equiripple", narrow)
