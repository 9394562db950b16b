"""Proves what a chain lets through of frequencies that come out at others, by bisection of their bands.

The magnitude of a polynomial's value on the unit circle differs within r of an angle from that of its tangent there by
at most ``C r**2 / 2``, where C is the sum of its coefficients' magnitudes, each times the square of the distance from a
centre, whose choice turns the value and does not change its magnitude. A numerator is bounded from above by that, a
denominator from below. A band is halved until the product over all sections is at most the gain that is claimed, or
exceeds it at a frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import acb, acb_poly, arb, ctx, fmpq

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.chain.chain_file import FoldingEntry, LargestEntry
from sosmith.verify.chain.responses import Part, Run, runs_of
from sosmith.verify.graph import require

_PRECISION = 256
_SMALLEST = Fraction(1, 1 << 60)
_MOST_PARTS = 1 << 20
_EXCESS = Fraction(1, 1 << 9)
"""Share by which a gain may exceed the one that is reached where it says."""

_HALF = Fraction(1, 2)
Band = tuple[Fraction, Fraction]


def check_folding(entries: Sequence[FoldingEntry], parts: Sequence[Part]) -> None:
    """Check what is claimed of images and aliases, of each run of parts that changes the rate.

    Raises
    ------
    RejectedError
        If a gain is exceeded, or is not reached where it says.
    UndecidedError
        If that cannot be decided.
    """
    runs = [run for run in runs_of(parts) if run.rise > 1 or run.factor > 1]
    require(
        len(entries) == len(runs),
        f"what folds must be claimed of each of {len(runs)} parts of the chain that change the rate, not of "
        f"{len(entries)}",
    )
    for entry, run in zip(entries, runs, strict=True):
        _check_run(entry, run)


def _check_run(entry: FoldingEntry, run: Run) -> None:
    rates = {"rise": (entry.rise, run.rise), "factor": (entry.factor, run.factor)}
    for name, (claimed, own) in rates.items():
        require(claimed == own, f"the {name} of what folds must be {own}, not {claimed}")
    most = max(run.rise, run.factor)
    with ctx.workprec(_PRECISION):
        gain = _Gain(run)
        _check(gain, entry.anywhere, [(Fraction(1, 2 * most), _HALF)], "the largest gain of what folds")
        require(
            (entry.edge is None) == (entry.passing is None), "a pass band must have both an edge and a gain into it"
        )
        if entry.edge is not None and entry.passing is not None:
            require(
                0 < entry.edge <= Fraction(1, 2 * most),
                f"the edge of the pass band must be above 0 and at most half the lower rate, not {entry.edge}",
            )
            bands = _into(run.factor, entry.edge) + (_into(run.rise, entry.edge) if run.rise != run.factor else [])
            _check(gain, entry.passing, bands, "the largest gain into the pass band")


def _into(factor: int, edge: Fraction) -> list[Band]:
    """Bands around the multiples of a lower rate."""
    bands = []
    for multiple in range(1, factor):
        low, high = Fraction(multiple, factor) - edge, Fraction(multiple, factor) + edge
        if low < _HALF:
            bands.append((low, min(high, _HALF)))
    return bands


def _check(gain: _Gain, claim: LargestEntry, bands: Sequence[Band], what: str) -> None:
    require(
        any(low <= claim.at <= high for low, high in bands),
        f"{what} must be reached at a frequency that folds, not at {float(claim.at):.6g} of the sample rate",
    )
    reached = gain.at(claim.at)
    require(
        not arb(_fmpq(claim.gain)) > reached * arb(_fmpq(1 + _EXCESS)) + arb(2) ** -60,
        f"{what} must be that at {float(claim.at):.6g} of the sample rate, {float(reached):.6g}, or little more, "
        f"not {float(claim.gain):.6g}",
    )
    most, left = arb(_fmpq(claim.gain)), list(bands)
    for _ in range(_MOST_PARTS):
        if not left:
            return
        low, high = left.pop()
        if gain.within(low, high, most):
            continue
        middle = (low + high) / 2
        there = gain.at(middle)
        require(
            not there > most,
            f"{what} must be at least {float(there):.6g}, which is reached at {float(middle):.6g} of the sample rate, "
            f"not {float(claim.gain):.6g}",
        )
        if high - low < _SMALLEST:
            break
        left += [(low, middle), (middle, high)]
    raise UndecidedError(what)


class _Polynomial:
    """A polynomial of a section, at the rate of a part, which is 1 of `step` of the highest one."""

    def __init__(self, taps: Sequence[Fraction], step: int) -> None:
        centre = Fraction(len(taps) - 1, 2)
        self.step = step
        self._taps = acb_poly([_ball(tap) for tap in taps])
        self._moment = acb_poly([_ball(tap * (k - centre)) for k, tap in enumerate(taps)])
        self._curvature = _ball(sum((abs(tap) * (k - centre) ** 2 for k, tap in enumerate(taps)), Fraction(0)))

    def tangent(self, frequency: Fraction) -> tuple[acb, acb]:
        """Return its value, turned, and the derivative by the angle of the first rate."""
        u = acb(_ball(-2 * frequency * self.step)).exp_pi_i()
        return self._taps(u), acb(0, -1) * self._moment(u) * self.step

    def beside(self, reach: arb) -> arb:
        """Bound how far its value leaves the tangent within `reach` of the first rate's angle."""
        return self._curvature * (reach * self.step) ** 2 / 2


class _Gain:
    """The gain of parts one behind the other, of one of the images."""

    def __init__(self, run: Run) -> None:
        self._over: list[_Polynomial] = []
        self._under: list[_Polynomial] = []
        self._images = run.rise
        for section, step in run.spread():
            self._over.append(_Polynomial(section.numerator, step))
            if len(section.denominator) > 1:
                self._under.append(_Polynomial(section.denominator, step))

    def at(self, frequency: Fraction) -> arb:
        """Enclose the gain at a frequency in units of the highest rate."""
        value = arb(1) / self._images
        for each in self._over:
            value *= abs(each.tangent(frequency)[0])
        for each in self._under:
            value /= abs(each.tangent(frequency)[0])
        return value

    def within(self, low: Fraction, high: Fraction, most: arb) -> bool:
        """Say whether the gain is shown to be at most `most` between two frequencies."""
        middle, reach = (low + high) / 2, arb.pi() * _ball(high - low)
        above, below = arb(1) / self._images, arb(1)
        for each in self._over:
            value, slope = each.tangent(middle)
            above *= abs(value + slope * reach).max(abs(value - slope * reach)) + each.beside(reach)
        for each in self._under:
            value, slope = each.tangent(middle)
            least = abs(value) - abs(slope) * reach - each.beside(reach)
            if not least > 0:
                return False
            below *= least
        return bool(above <= most * below)


def _ball(value: Fraction) -> arb:
    return arb(_fmpq(value))


def _fmpq(value: Fraction) -> fmpq:
    return fmpq(value.numerator, value.denominator)
