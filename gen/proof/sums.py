"""Sums over impulse responses, from their samples at nodes: in doubles, or with signs in doubles and sums in integers.

The samples of a response are weighted sums of those at the nodes (`sosmith.gen.proof.nodes`). In doubles, such a sum of
d products is wrong by at most ``d 2**-53 / (1 - d 2**-53)`` times the sum of their magnitudes, in any order of
summation (Higham, Accuracy and Stability of Numerical Algorithms, section 3.1). For an accuracy of up to 40 bits, the
magnitudes of long responses are added up like this. Otherwise, the sum of ``|h|`` is that of ``s h`` with s = 1 or -1,
the sign of each sample. Doubles find nearly all signs; the others are found in integers. In each block, s is summed
with the weights Phi; this is exact, because the weights are cut into limbs so short that no double ever rounds. What is
left are d products of long integers.

A sum of responses over several denominators is not brought over a common one, which would have twice as many poles,
close to each other if the responses are nearly the same. Each response keeps its own nodes, and a block has the weights
of all of them, side by side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate
from operator import mul

import numpy as np
import numpy.typing as npt
from flint import fmpq_poly, fmpz, fmpz_mat

from sosmith.gen.proof.nodes import Integers, Nodes
from sosmith.gen.proof.poles import Coefficients

Floats = npt.NDArray[np.float64]

_MORE_BITS = 72  # fraction bits of samples and weights beyond the accuracy of a sum
_AT_ONCE = 1 << 21  # samples in memory at the same time
_ROUNDING = 2.0**-53
_SLACK = 1 + 2.0**-30  # for the rounding of a bound itself
_CLOSE = 64  # blocks in which a largest sum is looked for in integers
_IN_DOUBLES = 40  # largest accuracy for which magnitudes are added up in doubles, and
_ROOM = Fraction(1, 1 << 38)  # share of such a sum that is added to it
_SHORT = 1 << 16  # samples that are few enough to add up their magnitudes in integers all the same

Numerators = tuple[fmpq_poly, ...]
"""Of a sum of responses, one over each denominator."""


@dataclass(frozen=True)
class Total:
    """Sum of a response's magnitudes.

    Attributes
    ----------
    magnitude : Fraction
        Approximately the sum of ``|h|``.
    uncertainty : Fraction
        Bound on its error, and on that of any sum up to some sample that is made with the same samples and signs.
    """

    magnitude: Fraction
    uncertainty: Fraction


@dataclass(frozen=True)
class Weighted:
    """A response of which each sample h counts as ``centre h + radius |h|``; the radius is not negative."""

    numerators: Numerators
    centre: Fraction
    radius: Fraction


@dataclass(frozen=True)
class _Samples:
    """A response before its first block, and at the nodes of its blocks, in units of ``2**-bits``.

    Attributes
    ----------
    head : list of int
        Samples before the first block.
    nodes : array of int, shape (degree, blocks)
        Samples at the nodes.
    values : array of float, shape (degree, blocks)
        The same, rounded to doubles.
    error : int
        Bound on the error of all these samples.
    """

    head: list[int]
    nodes: Integers
    values: Floats
    error: int


@dataclass(frozen=True)
class _Signs:
    """Signs of a response in all blocks.

    Attributes
    ----------
    signs : array of float, shape (block, blocks)
        1 or -1.
    values : array of float, shape (block, blocks)
        Approximate samples.
    unsure : array of float, shape (blocks,)
        Bound on their error.
    """

    signs: Floats
    values: Floats
    unsure: Floats


class Recursion:
    """All sums of responses over some denominators.

    Parameters
    ----------
    denominators : sequence of tuple of Coefficients
        The factors of each, all of a degree of at most 2 and with the constant term 1.
    accuracy : int
        Bits to which sums are computed, relative to the size of a response.

    Raises
    ------
    ShortfallError
        If a pole does not lie inside the unit circle, or a response lasts too long.
    """

    def __init__(self, denominators: Sequence[tuple[Coefficients, ...]], accuracy: int) -> None:
        self._bits = accuracy + _MORE_BITS
        self._parts: list[Nodes] = []
        for factors in denominators:
            block = next((part.block for part in self._parts if part.block), None)
            self._parts.append(_nodes(factors, accuracy, self._bits, block))
        self._degree = sum(part.degree for part in self._parts)
        self._block = max(part.block for part in self._parts)
        self._blocks = max(part.blocks for part in self._parts)
        long = self._block * self._blocks > _SHORT
        self._in_doubles = long and accuracy <= _IN_DOUBLES and len(self._parts) == 1
        self._residue = max(part.residue for part in self._parts)
        weights = [part.weights for part in self._parts if part.degree]
        self._exact_weights = np.concatenate(weights, axis=1) if weights else np.zeros((0, 0), dtype=object)
        self._weights = self._exact_weights.astype(np.float64) * 2.0**-self._bits
        rows = [sum(map(abs, row)) for row in self._exact_weights.tolist()]
        self._widest = (max(rows, default=0) >> self._bits) + 2
        self._size = Fraction(sum(rows) + 2 * self._exact_weights.size, 1 << self._bits)
        self._limb = 52 - self._block.bit_length()
        self._limbs = _limbs(self._exact_weights, self._limb)
        self._totals: dict[tuple[str, ...], Total] = {}

    def totals(self, numerators: Sequence[Numerators]) -> list[Total]:
        """Sum the magnitudes of responses, each once."""
        named = {_key(numerator): numerator for numerator in numerators}
        missing = [key for key in named if key not in self._totals]
        for keys in self._portions(missing, {key: self._start(named[key]) for key in missing}):
            samples_of_all = self._samples([named[key] for key in keys])
            self._totals.update((key, self._total(samples)) for key, samples in zip(keys, samples_of_all, strict=True))
        return [self._totals[_key(numerator)] for numerator in numerators]

    def highest(self, weighted: Sequence[Weighted]) -> Fraction:
        """Bound on the sum, up to any sample, of several responses together; at least 0."""
        numerators = [part.numerators for part in weighted]
        slack = sum(
            (
                (abs(part.centre) + part.radius) * total.uncertainty
                for part, total in zip(weighted, self.totals(numerators), strict=True)
            ),
            Fraction(0),
        )
        scale = math.lcm(*(value.denominator for part in weighted for value in (part.centre, part.radius)))
        factors = [(int(part.centre * scale), int(part.radius * scale)) for part in weighted]
        samples = self._samples(numerators)
        steps = [
            sum(c * value + r * abs(value) for (c, r), value in zip(factors, values, strict=True)) << self._bits
            for values in zip(*(part.head for part in samples), strict=True)
        ]
        sums = list(accumulate(steps, initial=0))
        best = max(sums)
        if self._degree:
            best = max(best, self._highest_in_blocks(samples, factors, sums[-1], best))
        return Fraction(best, scale << 2 * self._bits) + slack

    def excess(self, falling: Numerators, rising: Numerators, low: Fraction, high: Fraction) -> Fraction:
        """Bound, over all n, on ``|f[n]|`` minus the sum over k > n of what r[k] contributes, for two responses.

        What drives r is in [low, high], which contains zero; its contribution is that to the upper limit or to the
        lower one, whichever is less. The bound is 0 at least, and as close as doubles tell it.
        """
        (f, f_off, tail), (r, r_off, _) = map(self._in_time, self._samples([falling, rising]))
        most, largest, more = np.abs(f) + f_off, float(max(-low, high)), 0.0
        for ends in ((float(low), float(high)), (-float(high), -float(low))):
            least = np.maximum(np.maximum(ends[0] * r, ends[1] * r) - largest * r_off, 0.0)
            # What is added up is rounded by far less than what is taken off here.
            behind = np.append(np.cumsum(least[:0:-1])[::-1] * (1 - 2.0**-20), 0.0)
            more = max(more, float((most - behind).max(initial=0.0)) * _SLACK)
        return Fraction(more) + tail

    def _in_time(self, samples: _Samples) -> tuple[Floats, Floats, Fraction]:
        """Return all samples in doubles, bounds on their errors, and on the sum of the magnitudes behind them."""
        values, rough, exact = self._in_all_blocks(samples)
        first = np.array(samples.head, dtype=object).astype(np.float64) * 2.0**-self._bits
        error = samples.error * 2.0**-self._bits
        off = np.concatenate([np.abs(first) * 2.0**-30 + error, np.tile(rough + exact, (self._block, 1)).T.ravel()])
        return np.concatenate([first, values.T.ravel()]), off * _SLACK, self._tail(samples)

    def last_above(self, weighted: Sequence[tuple[Numerators, Fraction]], limit: Fraction) -> int | None:
        """Last sample at which a weighted sum of magnitudes may exceed `limit`, 0 if there is none.

        None if that is not proven to come to an end.
        """
        samples = self._samples([numerator for numerator, _ in weighted])
        unit = Fraction(1, 1 << self._bits)
        last, rest = 0, Fraction(0)
        for at, values in enumerate(zip(*(part.head for part in samples), strict=True)):
            total = sum(w * (abs(v) + s.error) for (_, w), v, s in zip(weighted, values, samples, strict=True))
            last = at if total * unit > limit else last
        start = len(samples[0].head) if samples else 0
        if self._degree:
            sums = np.zeros((self._block, self._blocks))
            for (_, weight), part in zip(weighted, samples, strict=True):
                signs = self._signs(part)
                sums += float(weight) * (np.abs(signs.values) + signs.unsure)
                rest += weight * self._tail(part)
            above = np.flatnonzero(sums.T.ravel() * _SLACK > float(limit))
            last = start + int(above[-1]) if len(above) else last
            if last == start + sums.size - 1:
                return None
        return None if rest > limit else last

    # Samples.

    def _portions(
        self, keys: list[tuple[str, ...]], starts: Mapping[tuple[str, ...], int]
    ) -> Iterator[list[tuple[str, ...]]]:
        """Share out what is computed together: responses that begin alike, so that none depends on the others."""
        count = max(1, _AT_ONCE // max(self._block * self._blocks, 1))
        for begin in sorted(set(starts.values())):
            alike = [key for key in keys if starts[key] == begin]
            yield from (alike[at : at + count] for at in range(0, len(alike), count))

    def _start(self, numerators: Numerators) -> int:
        """Sample from which responses solve their recursions alone."""
        return max(
            0, *(int(over.degree()) - part.degree + 1 for over, part in zip(numerators, self._parts, strict=True))
        )

    def _samples(self, responses: Sequence[Numerators]) -> list[_Samples]:
        """Compute several responses at the nodes, in blocks that begin at the same sample."""
        start = max(map(self._start, responses), default=0)
        parts = [
            self._samples_over(part, numerators, start)
            for part, numerators in zip(self._parts, zip(*responses, strict=True), strict=False)
        ]
        if len(parts) == 1:
            return parts[0]
        return [
            _Samples(
                [sum(values) for values in zip(*(one.head for one in together), strict=True)],
                np.concatenate([one.nodes for one in together]),
                np.concatenate([one.values for one in together]),
                sum(one.error for one in together),
            )
            for together in zip(*parts, strict=True)
        ]

    def _samples_over(self, table: Nodes, numerators: Sequence[fmpq_poly], start: int) -> list[_Samples]:
        """Compute responses over one denominator; 0 in blocks that only others last for."""
        bits = self._bits
        impulse, windows = table.beginnings(start)
        heads, firsts, errors = [], [], []
        for numerator in numerators:
            scale = int(numerator.denom()) << table.fine - bits
            taps = [int(value) for value in numerator.numer().coeffs()]
            heads.append([sum(map(mul, taps, impulse[at::-1])) // scale for at in range(start)])
            firsts.append([sum(map(mul, taps, samples)) // scale for samples in windows])
            errors.append(2 + sum(map(abs, taps)) * table.spread // scale)
        count = len(firsts)
        rows = [[fmpz(value) for value in at_node] for at_node in zip(*firsts, strict=True)]
        for step in table.steps:
            _extend(rows, step, min(len(rows[0]), table.blocks * count - len(rows[0])), bits)
        nodes = np.zeros((table.degree, self._blocks, count), dtype=object)
        if rows:
            nodes[:, : table.blocks] = np.array([[*map(int, row)] for row in rows], dtype=object).reshape(
                table.degree, table.blocks, count
            )
        values = nodes.astype(np.float64) * 2.0**-bits
        sizes = np.abs(values).sum(axis=0).max(axis=0, initial=0.0) * _SLACK
        largest = [math.ceil(size) for size in sizes.tolist()]
        for norm in table.norms:
            # A power is within two units, and its products are rounded down.
            errors = [max(e, math.ceil(norm * e) + 2 * big + 1) for e, big in zip(errors, largest, strict=True)]
        return [
            _Samples(heads[k], nodes[..., k], np.ascontiguousarray(values[..., k]), errors[k]) for k in range(count)
        ]

    # Signs and sums.

    def _in_all_blocks(self, samples: _Samples) -> tuple[Floats, Floats, Floats]:
        """Return samples in doubles, shape (block, blocks), and for each block bounds on rounding and other errors."""
        sizes = np.abs(samples.values).sum(axis=0) * _SLACK
        rough = self._rounding * float(np.abs(self._weights).max(initial=0.0)) * sizes
        exact = (self._widest * samples.error + 2 * sizes) * 2.0**-self._bits * _SLACK
        return self._weights @ samples.values, rough, exact

    @property
    def _rounding(self) -> float:
        return (self._degree + 4) * _ROUNDING * _SLACK

    def _signs(self, samples: _Samples) -> _Signs:
        values, rough, exact = self._in_all_blocks(samples)
        signs = np.where(values < 0, -1.0, 1.0)
        # Where doubles are as good as the integers, the sign counts as known: what that may cost is in `_total`.
        rows, columns = np.nonzero((np.abs(values) <= rough) & (rough > exact))
        if len(rows):
            closer = self._rounding * np.einsum(
                "km,mk->k", np.abs(self._weights[rows]), np.abs(samples.values[:, columns]), optimize=True
            )
            open_ = (np.abs(values[rows, columns]) <= closer) & (closer > exact[columns])
            rows, columns = rows[open_], columns[open_]
            sums = (self._exact_weights[rows] * samples.nodes[:, columns].T).sum(axis=1)
            signs[rows, columns] = np.where(sums < 0, -1.0, 1.0)
        return _Signs(signs, values, rough + exact)

    def _block_sums(self, signs: Floats, nodes: Integers) -> list[int]:
        """Sum of the samples times `signs` in every block, in units of ``2**-(2 bits)``."""
        d, blocks = nodes.shape
        parts = (self._limbs @ signs).reshape(-1, d, blocks).astype(np.int64).astype(object)
        factors = sum(part << self._limb * k for k, part in enumerate(parts))
        return list((factors * nodes).sum(axis=0))

    def _total(self, samples: _Samples) -> Total:
        unit = Fraction(1, 1 << self._bits)
        total = Fraction(sum(map(abs, samples.head)), 1 << self._bits)
        uncertainty = len(samples.head) * samples.error * unit
        if self._degree and self._in_doubles:
            values, rough, exact = self._in_all_blocks(samples)
            summed = Fraction(math.fsum(np.abs(values).sum(axis=0).tolist()))
            unsure = Fraction(math.fsum((rough + exact).tolist()) * _SLACK)
            total += summed
            # Each column was added up in doubles; there is room for whoever verifies it in doubles, too.
            rounding = (self._block + 8) * Fraction(_ROUNDING) + _ROOM
            uncertainty += self._block * unsure + summed * rounding + self._tail(samples)
        elif self._degree:
            signs = self._signs(samples)
            total += sum(self._block_sums(signs.signs, samples.nodes)) * unit * unit
            sizes = Fraction(float(np.abs(samples.values).sum()) * _SLACK)
            off = self._block * (self._blocks * self._widest * samples.error + 2 * sizes) * unit
            # Seven times: the samples themselves are off once. A sign found in doubles no better than this may be wrong
            # where the sample is within three times this; that counts twice.
            uncertainty += 7 * off + self._tail(samples)
        return Total(total, _short(uncertainty))

    def _tail(self, samples: _Samples) -> Fraction:
        """Bound on the sum of the magnitudes behind the last block."""
        sizes = Fraction(float(np.abs(samples.values).sum()) * _SLACK)
        sizes += Fraction(self._degree * self._blocks * samples.error, 1 << self._bits)
        return self._size * sizes * self._residue / (1 - self._residue)

    def _highest_in_blocks(
        self, samples: Sequence[_Samples], factors: Sequence[tuple[int, int]], start: int, best: int
    ) -> int:
        """Largest running sum within the blocks, from `start` on."""
        signs_of_all = [self._signs(part) for part in samples]
        largest = max(abs(value) for pair in factors for value in pair)
        shift = max(0, largest.bit_length() - 60)
        weights = [(math.ldexp(c, -shift), math.ldexp(r, -shift)) for c, r in factors]
        steps = np.zeros((self._block, self._blocks))
        unsure = np.zeros(self._blocks)
        sums = [0] * self._blocks
        for part, signs, (centre, radius), (c, r) in zip(samples, signs_of_all, factors, weights, strict=True):
            for sign, factor in ((np.ones_like(signs.signs), centre), (signs.signs, radius)):
                if factor:
                    sums = [a + factor * b for a, b in zip(sums, self._block_sums(sign, part.nodes), strict=True)]
            size = np.abs(signs.values)
            steps += c * signs.values + r * size
            unsure += (abs(c) + r) * (self._block * signs.unsure + (self._block + 8) * _ROUNDING * size.sum(axis=0))
        starts = list(accumulate(sums, initial=start))[:-1]
        peaks = np.maximum(np.cumsum(steps, axis=0).max(axis=0), 0.0)
        scale = 2 * self._bits + shift
        high = [s + _scaled(p, scale) for s, p in zip(starts, (peaks + unsure * _SLACK).tolist(), strict=True)]
        low = [s + _scaled(p, scale) for s, p in zip(starts, (peaks - unsure * _SLACK).tolist(), strict=True)]
        least = max(best, *low)
        close = [k for k in range(self._blocks) if high[k] > least]
        if len(close) > _CLOSE:
            return max(high)
        for k in close:
            best = max(best, starts[k] + self._highest_in_block(k, samples, signs_of_all, factors))
        return best

    def _highest_in_block(
        self, k: int, samples: Sequence[_Samples], signs_of_all: Sequence[_Signs], factors: Sequence[tuple[int, int]]
    ) -> int:
        steps = np.zeros(self._block, dtype=object)
        for part, signs, (centre, radius) in zip(samples, signs_of_all, factors, strict=True):
            values = (self._exact_weights * part.nodes[:, k]).sum(axis=1)
            steps = steps + values * (centre + radius * signs.signs[:, k].astype(np.int64).astype(object))
        return max(accumulate(map(int, steps), initial=0))


@lru_cache(maxsize=128)
def recursion(denominators: tuple[tuple[Coefficients, ...], ...], accuracy: int) -> Recursion:
    """Return the responses over denominators, given by their factors; the same object for the same factors."""
    return Recursion(denominators, accuracy)


_nodes = lru_cache(maxsize=128)(Nodes)


def _key(numerators: Numerators) -> tuple[str, ...]:
    return tuple(",".join(map(str, over.coeffs())) for over in numerators)


def _extend(rows: list[list[fmpz]], step: fmpz_mat, count: int, bits: int) -> None:
    """Append the products of the first `count` columns and a matrix with `bits` fraction bits, rounded down."""
    columns = fmpz_mat(len(rows), count, [value for row in rows for value in row[:count]])
    products = (step * columns).entries()
    for k, row in enumerate(rows):
        row += [value >> bits for value in products[k * count : (k + 1) * count]]


def _limbs(weights: Integers, bits: int) -> Floats:
    """Cut weights, shape (block, degree), into limbs of `bits` bits, lowest first, shape (limbs * degree, block)."""
    longest = max((abs(value).bit_length() for value in weights.ravel().tolist()), default=0)
    mask = (1 << bits) - 1
    parts, rest = [], weights.T
    while longest > bits:
        parts.append(rest & mask)
        rest, longest = rest >> bits, longest - bits
    return np.concatenate([*parts, rest]).astype(np.float64)


def _scaled(value: float, bits: int) -> int:
    """`value` in units of ``2**-bits``, rounded up."""
    return math.ceil(Fraction(value) * (1 << bits))


def _short(value: Fraction) -> Fraction:
    """`value` rounded up to about 64 significant bits, to keep numbers short."""
    scale = Fraction(2) ** (value.denominator.bit_length() - value.numerator.bit_length() + 64)
    return Fraction(math.ceil(value * scale)) / scale
