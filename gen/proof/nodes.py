"""A recursion in blocks: the weights with which a few samples of a response determine all others.

All responses ``h = N/D`` over a denominator D of degree d solve the same recursion from sample ``deg N - d + 1`` on. In
a block of B samples, each is therefore a fixed combination of the d samples at the *nodes* of the block, and so are
the samples at the nodes of the next block::

    h[j B + i] = sum over m of Phi[i, m] W[j, m],    W[j + 1] = K W[j]

The weights Phi and K depend on D alone. They are enclosed in ball arithmetic, with samples of the response of 1/D in
integers. The first ones are computed one by one; a bound on the sum of their magnitudes gives their error,
``L1(1/D) <= prod 1/(1 - |p|)`` over the poles p. Those far away, which only the nodes need, are reached by doubling
the distance between samples (`sosmith.gen.proof.decimation`), so that none is computed that nothing asks for. The
nodes are the pivots of an elimination with row pivoting (discrete Leja points: Bos, De Marchi, Sommariva and Vianello
2010). Phi is then of the order of one, however close the poles are to each other.

The number J of blocks is a power of two for which ``|K**J| < 1`` in the maximum norm. This proves that every response
decays, and bounds what comes after these blocks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from operator import mul

import numpy as np
import numpy.typing as npt
from flint import arb, arb_mat, ctx, fmpq_poly, fmpz_mat

from sosmith.gen.proof.decimation import decimated
from sosmith.gen.proof.poles import Coefficients, pole_radii, power_of
from sosmith.model.errors import ShortfallError

Integers = npt.NDArray[np.object_]

LONGEST = 1 << 21
"""Samples in which a response must decay to the accuracy of the word-length search."""

_LONGEST_BITS = 40  # that accuracy, relative, in bits
_DECAY_BITS = 16  # to which responses decay beyond the accuracy wanted
_SMALLEST_BLOCK, _LARGEST_BLOCK = 64, 512
_LONG = 1 << 16  # samples of a response with longer blocks: what is done for each costs most
_WINDOWS = 12  # that the nodes are spread over, in the time in which a response decays to `_LONGEST_BITS`
_FIRST = 64  # places among which the nodes are chosen, and
_GROUPS, _NEIGHBOURS = 32, 4  # groups of neighbours at even distances, at least; fewer than twice as many
_SLACK_BITS = 16
_LARGEST_GROWTH = 1 << 32  # of an error from block to block; more distant nodes make it smaller
_MOST_GROWTH = 1 << 512  # of an error; beyond, sums are not in the range of doubles, and worth nothing
_DIGITS = 3  # binary digits of the number of blocks
_GUARD_BITS = 64  # of the first precision that is tried
_MOST_BITS = 1 << 16  # of a precision

_TOO_CLOSE = "the poles must not lie so close to each other that a response cannot be enclosed"


class _CoarseError(ArithmeticError):
    """The precision is too low, by about `bits`."""

    def __init__(self, bits: int) -> None:
        super().__init__()
        self.bits = bits


class Nodes:
    """Weights of the samples at the nodes, for responses over one denominator.

    Parameters
    ----------
    denominators : sequence of Coefficients
        Factors of the denominator, each of a degree of at most 2 and with the constant term 1.
    accuracy : int
        Bits to which responses decay, relative to their size; a few more.
    bits : int
        Fraction bits of the weights.
    block : int or None
        Length of a block; None chooses one.

    Attributes
    ----------
    degree : int
        Degree d of the denominator.
    block, blocks : int
        Length B of a block, and number J of blocks.
    weights : array of int, shape (block, degree)
        Phi in units of ``2**-bits``, within two units.
    powers : list of array of int, shape (degree, degree)
        ``K**(2**k)`` likewise, for every k up to that of J.
    steps : list of fmpz_mat
        The same as `powers`, for products.
    norms : list of Fraction
        Bound on the maximum norm of each of `powers`; the last one is far below 1.

    Raises
    ------
    ShortfallError
        If a pole does not lie inside the unit circle, a response lasts longer than `LONGEST` samples, or poles lie too
        close to each other.
    """

    def __init__(
        self, denominators: Sequence[Coefficients], accuracy: int, bits: int, block: int | None = None
    ) -> None:
        radii = [radius for denominator in denominators for radius in pole_radii(denominator)]
        if max(radii, default=Fraction(0)) >= 1:
            raise ShortfallError("every pole must lie inside the unit circle, and one does not")
        self._denominator = fmpq_poly([1])
        for denominator in denominators:
            self._denominator *= polynomial(denominator)
        self._interleaved = math.gcd(*(power_of(denominator) for denominator in denominators if len(denominator) > 1))
        """M of a denominator in powers of ``w**M``."""
        self.degree = len(radii)
        self.bits = bits
        self._decay = accuracy + _DECAY_BITS
        self._most = LONGEST * self._decay // (_LONGEST_BITS + _DECAY_BITS)
        self.gain = math.ceil(math.prod((1 / (1 - radius) for radius in radii), start=Fraction(1)))
        """Bound on ``L1(1/D)``."""
        self.spread = 2 * (1 + (1 << self.degree)) * self.gain
        """Bound on the error of `impulse` and `samples_at`, in units of ``2**-fine``."""
        self._length, self.block = self._lengths(max(radii, default=Fraction(0)), block)
        self.blocks = 0
        self.residue = Fraction(0)
        self.fine = bits + self.gain.bit_length() + self.spread.bit_length() + _GUARD_BITS
        """Fraction bits of `impulse` and `samples_at`."""
        self._wider, self._neighbours = 1, _NEIGHBOURS
        self._known: dict[int, tuple[list[int], list[list[int]]]] = {}
        while True:
            try:
                self._enclose()
                break
            except _CoarseError as error:
                if self.fine > _MOST_BITS:
                    raise ShortfallError(_TOO_CLOSE) from None
                if error.bits:
                    self.fine += error.bits + _GUARD_BITS // 2

    def _lengths(self, radius: Fraction, block: int | None) -> tuple[int, int]:
        """Estimate the length of the responses from the pole that decays most slowly, and choose that of a block."""
        per_sample = -math.log2(radius) if radius > Fraction(1, 2**64) else 64.0
        length = math.ceil((self._decay + 2 * self.degree) / max(per_sample, 2.0**-60)) + 2 * self.degree
        self._check(length)
        if block is None:
            block = min(max(math.isqrt(length), _SMALLEST_BLOCK), _LARGEST_BLOCK, length) if self.degree else 0
            block *= 4 if length > _LONG else 1
        return length, block

    def _check(self, length: int) -> None:
        if length > self._most:
            shown = length * (_LONGEST_BITS + _DECAY_BITS) // self._decay
            raise ShortfallError(
                f"the impulse response must end within {LONGEST} samples, not {shown}: a pole lies too close to the "
                "unit circle"
            )

    def impulse(self, length: int) -> list[int]:
        """Return at least `length` samples of the response of 1/D from its beginning, within `spread`."""
        return self._continued([1 << self.fine], length)

    def beginnings(self, length: int) -> tuple[list[int], list[list[int]]]:
        """Return `impulse`, and `samples_at` each of `places`, the last sample first; each length is computed once."""
        if length not in self._known:
            self._known[length] = self.impulse(length), [self.samples_at(at, length)[::-1] for at in self.places]
        return self._known[length]

    def samples_at(self, place: int, more: int) -> list[int]:
        """Return d samples of the response of 1/D up to `place`, one of `places`, and `more` behind it.

        They are within `spread`, as are those from the beginning. The first d are within two units, and what follows
        from errors e of these alone is the response ``N/D`` with the first d coefficients of ``D e`` as N. As the
        magnitudes of the coefficients of D have a sum of ``2**d`` at most, it stays below ``2 * 2**d L1(1/D)``.
        """
        if place in self._distant:
            return self._continued(self._distant[place][::-1], self.degree + more)
        padded = [*([0] * self.degree), *self.impulse(place + more + 1)]
        return padded[place + 1 : place + 1 + self.degree + more]

    def _continued(self, response: list[int], length: int) -> list[int]:
        """Continue a response to `length` samples, in units of ``2**-fine``.

        Each sample is rounded down, and before it the coefficients so little that it costs less than another unit. That
        makes an error of less than two units at the input of 1/D.
        """
        shift = self.fine + self.gain.bit_length() + self.degree.bit_length()
        scale = int(self._denominator.denom())
        weights = [-((int(c) << shift) // scale) for c in self._denominator.numer().coeffs()][1:]
        while len(response) < length:
            response.append(sum(map(mul, weights, response[: -len(weights) - 1 : -1])) >> shift)
        return response

    def _reach(self, window: int) -> dict[int, list[int]]:
        """Find the d samples up to each place far from the beginning, the last one first, within two units."""
        doublings = max(window // _GROUPS, 1).bit_length() - 1
        count, width = (window - 1 >> doublings) + 1, self.degree + self._neighbours - 1
        more = (self.degree + 2) * (doublings + 4) + _GUARD_BITS
        while True:
            with ctx.workprec(self.fine + more):
                rows = decimated(self._denominator, doublings, count, width)
                try:
                    samples = _rounded([value for row in rows for value in row], self.fine).reshape(count, width)
                    break
                except _CoarseError:
                    more *= 2
        return {
            (k << doublings) - back: samples[k, back : back + self.degree].tolist()
            for k in range(count)
            for back in range(self._neighbours)
            if (k << doublings) - back >= _FIRST
        }

    def _enclose(self) -> None:
        """Find the nodes, the weights and the powers, at the present precision."""
        d, size = self.degree, self.block
        self.places: list[int] = []
        """Distances of the nodes from the beginning of a block."""
        self.weights = np.zeros((size, d), dtype=object)
        self.powers: list[Integers] = []
        self.steps: list[fmpz_mat] = []
        self.norms: list[Fraction] = []
        self._distant: dict[int, list[int]] = {}
        if not d:
            return
        window = max(self._length * _LONGEST_BITS * self._wider // (_WINDOWS * self._decay), 2 * d, size)
        beginning = [*([0] * d), *self.impulse(max(size, _FIRST))]
        self._distant = self._reach(window)
        rows = {at: beginning[at + d : at : -1] for at in range(min(window, _FIRST))} | self._distant
        candidates = sorted(rows)
        picked, least = _pivots(np.array([rows[at] for at in candidates], dtype=object), self.fine)
        if not least and self._neighbours < self._interleaved:
            # M responses are interleaved: neighbours that miss too many of these are too few at any precision.
            self._neighbours = self._interleaved
            raise _CoarseError(0)
        short = self.bits + self.spread.bit_length() + _SLACK_BITS - least.bit_length()
        if short > 0:
            raise _CoarseError(short)
        self.places = [candidates[k] for k in picked]
        with ctx.workprec(self.fine + self.gain.bit_length()):
            radius = arb(0, self.spread)

            def balls(matrix: list[list[int]]) -> arb_mat:
                return arb_mat(len(matrix), d, [arb(value) + radius for row in matrix for value in row])

            try:
                inverse = balls([rows[at] for at in self.places]).inv()
            except ZeroDivisionError:
                raise _CoarseError(self.fine) from None
            wanted = [beginning[at + d : at : -1] for at in range(size)]
            wanted += [self.samples_at(at, size)[: -d - 1 : -1] for at in self.places]
            entries = (balls(wanted) * inverse).entries()
            self.weights = _rounded(entries[: size * d], self.bits).reshape(size, d)
            self._multiply(arb_mat(d, d, entries[size * d :]))
        growth = math.prod(max(norm, Fraction(1)) for norm in self.norms)
        if self._wider < _WINDOWS and growth > _LARGEST_GROWTH:
            self._wider *= 2
            raise _CoarseError(0)
        if growth > _MOST_GROWTH:
            raise ShortfallError(_TOO_CLOSE)

    def _multiply(self, step: arb_mat) -> None:
        """Find the number of blocks and the powers of K up to there."""
        target = Fraction(1, 1 << self._decay)
        powers = [step]
        while _norm(powers[-1]) > target:
            self._check(self.block << len(powers) - 1)
            powers.append(powers[-1] * powers[-1])
        # Between the last two powers of two: in the binary expansion of the number of blocks, from its highest digit.
        self.blocks, whole = 1 << len(powers) - 1, powers[-1]
        if len(powers) > 1:
            self.blocks, whole = self.blocks // 2, powers[-2]
            for k in reversed(range(max(0, len(powers) - 2 - _DIGITS), len(powers) - 2)):
                longer = whole * powers[k]
                if _norm(longer) > target:
                    self.blocks, whole = self.blocks + (1 << k), longer
            unit = max(0, len(powers) - 2 - _DIGITS)
            self.blocks, whole = self.blocks + (1 << unit), whole * powers[unit]
        self.residue = _norm(whole)
        self._check(self.block * self.blocks)
        d = self.degree
        self.powers = [
            _rounded(power.entries(), self.bits).reshape(d, d) for power in powers[: self.blocks.bit_length()]
        ]
        self.steps = [fmpz_mat(d, d, power.ravel().tolist()) for power in self.powers]
        self.norms = [_norm(power) for power in powers[: len(self.powers)]]


def polynomial(values: Sequence[Fraction]) -> fmpq_poly:
    """Convert coefficients to a polynomial of FLINT."""
    scale = math.lcm(*(value.denominator for value in values))
    return fmpq_poly([value.numerator * (scale // value.denominator) for value in values], scale)


def _pivots(matrix: Integers, bits: int) -> tuple[list[int], int]:
    """Rows that an elimination with row pivoting picks, in integers with `bits` fraction bits, and the least pivot."""
    picked, least = [], 1 << bits
    for column in range(matrix.shape[1]):
        pivot = int(np.argmax(np.abs(matrix[:, column])))
        value = matrix[pivot, column]
        least = min(least, abs(value))
        if not value:
            break
        picked.append(pivot)
        factors = (matrix[:, column] << bits) // value
        matrix[:, column:] -= (factors[:, None] * matrix[pivot, column:]) >> bits
        matrix[pivot] = 0
    return picked, least


def _rounded(balls: Sequence[arb], bits: int) -> Integers:
    """Multiples of ``2**-bits`` within two units of all that the balls enclose."""
    result = np.empty(len(balls), dtype=object)
    half = arb(0.5) * arb(2) ** -bits
    for index, value in enumerate(balls):
        if not value.rad() < half:
            raise _CoarseError(bits)
        mantissa, exponent = value.mid().man_exp()
        shift = int(exponent) + bits
        result[index] = int(mantissa << shift if shift >= 0 else mantissa >> -shift)
    return result


def _norm(matrix: arb_mat) -> Fraction:
    """Bound on the maximum norm of a matrix."""
    largest = Fraction(0)
    for row in matrix.tolist():
        mantissa, exponent = (int(part) for part in sum(map(abs, row), arb(0)).upper().man_exp())
        largest = max(largest, mantissa * Fraction(2) ** exponent)
    return largest
