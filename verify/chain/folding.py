"""Proves what a chain lets through: of frequencies that come out at others, and in the pass band of one with limits.

The magnitude of a polynomial's value on the unit circle differs within r of an angle from that of its tangent there by
at most ``|V''| r**2 / 2 + C r**3 / 6``, with its second derivative V'' there, and where C is the sum of the magnitudes
of its coefficients, each times the cube of the distance from a centre, whose choice turns the value and does not change
its magnitude. A numerator is bounded from above by that, a
denominator from below; for the smallest gain in a band, the other way round. A band is halved until the product over
all sections is at most the gain that is claimed, or exceeds it at a frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import acb, acb_poly, arb, ctx, fmpq

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.chain.chain_file import FoldingEntry, KeptEntry, LargestEntry, LimitedEntry
from sosmith.verify.chain.responses import Part, Run, runs_of
from sosmith.verify.graph import RejectedError, require

_PRECISION = 256
_SMALLEST = Fraction(1, 1 << 60)
_MOST_PARTS = 1 << 20
_EXCESS = Fraction(1, 1 << 9)
"""Share by which a gain may exceed the one that is reached where it says."""

_CLOSE = Fraction(1, 1 << 19)
"""The same in the pass band of a chain with limits, where gains are compared with each other."""

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


def check_limited(entry: LimitedEntry | None, parts: Sequence[Sequence[Part]]) -> None:
    """Check what is claimed of some stages by themselves, by the parts of each stage; errors as `check_folding`."""
    if entry is None:
        return
    require(
        entry.first <= entry.last < len(parts),
        f"limits must be of stages that there are, 0 to {len(parts) - 1}, not {entry.first} to {entry.last}",
    )
    require(entry.kept is not None, "some stages with limits must claim the gains in their pass band")
    check_folding([entry], [part for own in parts[entry.first : entry.last + 1] for part in own])


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
        if entry.kept is not None:
            _check_kept(gain, entry.kept, entry.edge, run)


def _check_kept(gain: _Gain, kept: KeptEntry, edge: Fraction | None, run: Run) -> None:
    """Check what is claimed of the gain from end to end: in the pass band, and in the stop band if there is one."""
    if edge is None:
        raise RejectedError("gains in a pass band must be claimed of a chain that has one")
    require(run.rise == 1, "gains in a pass band must be claimed of a chain that does not interpolate")
    band = (Fraction(0), edge)
    _check(gain, kept.most, [band], "the largest gain in the pass band", _CLOSE, "there")
    _check_least(gain, kept.least, band)
    require((kept.stop is None) == (kept.stopped is None), "a stop band must have both an edge and a gain")
    if kept.stop is not None and kept.stopped is not None:
        require(edge < kept.stop < _HALF, f"the stop band must begin behind the pass band, not at {kept.stop}")
        _check(gain, kept.stopped, [(kept.stop, _HALF)], "the largest gain in the stop band", where="there")


def _check_least(gain: _Gain, claim: LargestEntry, band: Band) -> None:
    """Check that no gain in a band is less than the one that is claimed, and that hardly more is reached."""
    what = "the smallest gain in the pass band"
    require(
        band[0] <= claim.at <= band[1],
        f"{what} must be reached there, not at {float(claim.at):.6g} of the sample rate",
    )
    require(
        not arb(_fmpq(claim.gain)) < gain.at(claim.at) * arb(_fmpq(1 - _CLOSE)) - arb(2) ** -60,
        f"{what} must be that at {float(claim.at):.6g} of the sample rate, {float(gain.at(claim.at)):.6g}, or little "
        f"less, not {float(claim.gain):.6g}",
    )
    least, left = arb(_fmpq(claim.gain)), [band]
    for _ in range(_MOST_PARTS):
        if not left:
            return
        low, high = left.pop()
        if gain.stays(low, high, least, -1):
            continue
        middle = (low + high) / 2
        there = gain.at(middle)
        require(
            not there < least,
            f"{what} must be at most {float(there):.6g}, which is reached at {float(middle):.6g} of the sample rate, "
            f"not {float(claim.gain):.6g}",
        )
        if high - low < _SMALLEST:
            break
        left += [(low, middle), (middle, high)]
    raise UndecidedError(what)


def _into(factor: int, edge: Fraction) -> list[Band]:
    """Bands around the multiples of a lower rate."""
    bands = []
    for multiple in range(1, factor):
        low, high = Fraction(multiple, factor) - edge, Fraction(multiple, factor) + edge
        if low < _HALF:
            bands.append((low, min(high, _HALF)))
    return bands


def _check(
    gain: _Gain,
    claim: LargestEntry,
    bands: Sequence[Band],
    what: str,
    excess: Fraction = _EXCESS,
    where: str = "that folds",
) -> None:
    require(
        any(low <= claim.at <= high for low, high in bands),
        f"{what} must be reached at a frequency {where}, not at {float(claim.at):.6g} of the sample rate",
    )
    reached = gain.at(claim.at)
    require(
        not arb(_fmpq(claim.gain)) > reached * arb(_fmpq(1 + excess)) + arb(2) ** -60,
        f"{what} must be that at {float(claim.at):.6g} of the sample rate, {float(reached):.6g}, or little more, "
        f"not {float(claim.gain):.6g}",
    )
    most, left, is_close = arb(_fmpq(claim.gain)), list(bands), excess == _CLOSE
    for _ in range(_MOST_PARTS):
        if not left:
            return
        low, high = left.pop()
        if gain.within(low, high, most) or (is_close and gain.stays(low, high, most, 1)):
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
        self._second = acb_poly([_ball(tap * (k - centre) ** 2) for k, tap in enumerate(taps)])
        self._third = _ball(sum((abs(tap * (k - centre) ** 3) for k, tap in enumerate(taps)), Fraction(0)))

    def at(self, frequency: Fraction) -> arb:
        """Return its magnitude."""
        return abs(self._taps(acb(_ball(-2 * frequency * self.step)).exp_pi_i()))

    def around(self, frequency: Fraction, reach: arb) -> tuple[acb, acb, arb]:
        """Return its value, turned, how it changes along the tangent within `reach` of the first rate's angle.

        And a bound on how far its value is from the tangent there.
        """
        u, angle = acb(_ball(-2 * frequency * self.step)).exp_pi_i(), reach * self.step
        beside = abs(self._second(u)) * angle**2 / 2 + self._third * angle**3 / 6
        return self._taps(u), acb(0, -1) * self._moment(u) * angle, beside

    def around_closely(self, frequency: Fraction, reach: arb) -> tuple[acb, acb, arb, arb]:
        """Return the same, and a bound on the second derivative there, times the square of the reach."""
        u, angle = acb(_ball(-2 * frequency * self.step)).exp_pi_i(), reach * self.step
        bend = abs(self._second(u))
        beside = bend * angle**2 / 2 + self._third * angle**3 / 6
        curve = (bend + self._third * angle) * angle**2
        return self._taps(u), acb(0, -1) * self._moment(u) * angle, beside, curve


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
            value *= each.at(frequency)
        for each in self._under:
            value /= each.at(frequency)
        return value

    def within(self, low: Fraction, high: Fraction, most: arb) -> bool:
        """Say whether the gain is shown to be at most `most` between two frequencies."""
        middle, reach = (low + high) / 2, arb.pi() * _ball(high - low)
        above, below = arb(1) / self._images, arb(1)
        for each in self._over:
            value, change, beside = each.around(middle, reach)
            above *= abs(value + change).max(abs(value - change)) + beside
        for each in self._under:
            value, change, beside = each.around(middle, reach)
            least = abs(value) - abs(change) - beside
            if not least > 0:
                return False
            below *= least
        return bool(above <= most * below)

    def stays(self, low: Fraction, high: Fraction, bound: arb, sign: int) -> bool:
        """Say whether the gain is shown to be at most `bound` between two frequencies; at least, with the sign -1.

        By its logarithm, of which slopes of sections cancel each other; where the gain is far from 0.
        """
        middle, reach = (low + high) / 2, arb.pi() * _ball(high - low)
        value, slope, rest = arb(1) / self._images, arb(0), arb(0)
        for polynomials, power in ((self._over, 1), (self._under, -1)):
            for each in polynomials:
                own, change, beside, curve = each.around_closely(middle, reach)
                size = abs(own)
                least = size - abs(change) - beside
                if not least > 0:
                    return False
                value *= size**power
                slope += power * (own.real * change.real + own.imag * change.imag) / size**2
                rest += (curve / least + ((abs(change) + curve) / least) ** 2) / 2
        spread = abs(slope) + rest
        return bool(value * spread.exp() <= bound if sign > 0 else value * (-spread).exp() >= bound)


def _ball(value: Fraction) -> arb:
    return arb(_fmpq(value))


def _fmpq(value: Fraction) -> fmpq:
    return fmpq(value.numerator, value.denominator)
