"""The sum of a response's magnitudes from a response in pieces, whose exact residual proves it.

Sequences whose absolute values have a finite sum form an algebra under convolution with that sum, ``|.|``, as its norm
(`sosmith.verify.bounds.l1_response`). For the response of N/D, let h be any sequence and ``E = N - D h``. Then

    |N/D - h| <= |1/D| |E|,    |1/D| <= |u| / (1 - |1 - D u|) for any u with |1 - D u| < 1.

Here h is built from pieces of B samples. A piece is a fixed linear form of d numbers, which follow from those of the
piece before::

    h[q + j B + i] = sum over m of P[i, m] x[j, m],    x[j + 1] = T x[j]

However P and T were found, they are binary fractions, and these sequences are exact. Within a piece, E is the form
``D * P`` of x; where a piece begins, it is that of the piece before, carried on, plus D times the step between the two.
So ``|E|`` is at most the size of these forms, which integers give, times the sum of all ``max |x[j]|``, plus the
residual of the first samples. No poles are located, no error of a recursion is estimated, and the bound exists only if
the response decays.

How the magnitudes are added up is in `sosmith.verify.bounds.summed_forms`. The difference of two responses that are
nearly the same is one of pieces of the same length, side by side: over a common denominator, it would have twice as
many poles, close to each other.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import dropwhile
from operator import mul
from typing import cast

import numpy as np
from flint import acb, arb, arb_mat, ctx, fmpq, fmpq_poly, fmpz, fmpz_mat, fmpz_poly

from sosmith.verify.bounds.grid import fraction_of
from sosmith.verify.bounds.l1_response import UndecidedError, fraction
from sosmith.verify.bounds.summed_forms import Floats, Integers, SummedForms

_ACCURACY = 112  # bits behind the binary point to which a sum is found
_MARGIN = 48  # bits for the sizes of forms and sums
_LONGEST = 1 << 24  # samples
_LARGEST_PIECE = 2048  # samples
_SPREAD = 1 / 24  # of the time in which a response decays to 2**-40: where the numbers x of a piece are samples
_GROUPS, _NEIGHBOURS = 64, 4  # of samples among which these are chosen


class Pieces:
    """Responses over one denominator, whose constant term is 1 and whose coefficients are binary fractions.

    Parameters
    ----------
    denominator : fmpq_poly
        The denominator.
    like : Pieces or None
        Other responses, with whose pieces these are to have the length in common.

    Raises
    ------
    UndecidedError
        If the responses do not decay, or not within 16 million samples, or a coefficient is not a binary fraction.
    """

    def __init__(self, denominator: fmpq_poly, like: Pieces | None = None) -> None:
        scale = int(denominator.denom())
        if scale & (scale - 1):
            raise UndecidedError("a coefficient is no binary fraction")
        self._shift = scale.bit_length() - 1
        self._under = [int(c) for c in denominator.numer().coeffs()]
        self._order = len(self._under) - 1
        self._inverse = Fraction(1)
        self._found: dict[tuple[tuple[str, ...], bool], tuple[fmpq, Fraction]] = {}
        if self._order:
            self._build(like)
            total, residual = self._sequence(fmpq_poly([1]))
            if residual >= 1:
                raise UndecidedError("the inverse of a denominator could not be enclosed")
            self._inverse = total / (1 - residual)

    def norm(self, numerator: fmpq_poly, *, rough: bool = False) -> Fraction:
        """Upper bound of the sum of magnitudes ``|N/D|``, hardly above it; if `rough`, by about a share of ``2**-40``.

        Of numerators that are each other's multiples or delays, it is computed once.
        """
        coefficients = numerator.coeffs()
        if not coefficients:
            return Fraction(0)
        leading = coefficients[-1]
        shape = tuple(str(value / leading) for value in dropwhile(lambda value: not value, coefficients))
        key = shape, rough and (shape, False) not in self._found
        if key not in self._found:
            total, residual = self._sequence(numerator, rough=rough)
            self._found[key] = leading, total + self._inverse * residual
        first, norm = self._found[key]
        return abs(fraction(leading / first)) * norm

    def excess(
        self, numerator: fmpq_poly, rising: fmpq_poly, low: Fraction, high: Fraction
    ) -> tuple[Fraction, Fraction]:
        """Upper bounds, over all n, of ``|f[n]|`` minus the sum over k > n of what r[k] contributes; at least 0.

        f and r are the responses of `numerator` and `rising`. What drives r is in [low, high], which contains zero. The
        first bound is with what it contributes to the upper limit, the second to the lower one. Sums are known to about
        20 bits.
        """
        (f, f_doubts, off), (r, r_doubts, r_off) = map(self._samples, (numerator, rising))
        count, largest = max(len(f), len(r)) + 1, max(-low, high)
        most = np.pad(np.abs(f) + f_doubts, (0, count - len(f)))
        bounds = []
        for ends in ((float(low), float(high)), (-float(high), -float(low))):
            least = np.maximum(np.maximum(ends[0] * r, ends[1] * r) - float(largest) * r_doubts, 0.0)
            least = np.pad(least, (0, count - len(r)))
            behind = np.cumsum(least[:0:-1])[::-1] * (1 - 2.0**-20)  # more than the rounding of these sums
            bounds.append(Fraction(max(0.0, float((most[:-1] - behind).max()))) + off + largest * r_off)
        return bounds[0], bounds[1]

    def distance(self, numerator: fmpq_poly, other: Pieces, subtracted: fmpq_poly) -> Fraction | None:
        """Upper bound of the sum of magnitudes ``|N/D - N'/D'|``, the second response one of `other`, hardly above it.

        None if their pieces do not have the same length.
        """
        if not self._order or not other._order or self._piece != other._piece:
            return None
        together = (self, numerator), (other, subtracted)
        start = max(0, *(over.degree() + 1 - pieces._order for pieces, over in together))
        bits = max(self._bits, other._bits)
        heads, vectors, off = [], [], Fraction(0)
        for pieces, over in together:
            head, numbers, left_out, residual = pieces._pieces(over, start)
            heads.append([Fraction(value, 1 << pieces._bits) for value in head])
            vectors.append(numbers << bits - pieces._bits)
            off += left_out + pieces._inverse * residual
        count = max(numbers.shape[1] for numbers in vectors)
        # Those of `np.pad` would be no integers of Python, and a product of one with a long integer overflows.
        both = np.zeros((sum(map(len, vectors)), count), dtype=np.object_)
        for row, numbers in zip((0, len(vectors[0])), vectors, strict=True):
            both[row : row + len(numbers), : numbers.shape[1]] = numbers
        first = sum((abs(a - b) for a, b in zip(*heads, strict=True)), Fraction(0))
        return first + self._summed.beside(other._summed).magnitudes(both) + off

    # The forms.

    def _build(self, like: Pieces | None) -> None:
        radii = self._radii()
        if max(radii) >= 1:
            raise UndecidedError("the responses of a denominator do not decay")
        grows = math.ceil(-sum(math.log2(1 - radius) for radius in radii))
        decay = -math.log2(max(*radii, 2.0**-40))
        length = (_ACCURACY + 2 * self._order) / decay + 4 * self._order + 16
        if length > _LONGEST:
            raise UndecidedError(f"a response does not die away within {_LONGEST} samples")
        self._grown = 2 * (sum(map(abs, self._under)) >> self._shift).bit_length()
        self._bits = _ACCURACY + _MARGIN + grows + self._grown
        pieces = max(0, math.ceil(math.log2(length / _LARGEST_PIECE)))
        self._piece = max(math.ceil(length / (1 << pieces)), 2 * self._order)
        if like is not None and like._order and self._piece <= 2 * like._piece and like._piece >= 2 * self._order:
            self._piece = like._piece
        window = max(math.ceil(40 * _SPREAD / decay), self._piece)
        self._wanted = Fraction(1 << _MARGIN // 2 + self._grown, 1 << self._bits)
        fine = self._bits + 2 * grows + 64
        while True:
            self._find_forms(window, fine)
            if self._check_forms():
                break
            if fine > 8 * self._bits:
                raise UndecidedError("the responses of a denominator could not be enclosed")
            fine += fine // 2
            self._bits += _MARGIN // 2  # large forms, as of poles close to each other, make more of their last bits
        self._find_powers()

    def _radii(self) -> list[float]:
        """Approximate magnitudes of the poles: a hint to lengths and precisions, which nothing proven depends on."""
        roots = cast("list[tuple[acb, int]]", fmpz_poly(self._under).complex_roots())
        return [1 / abs(complex(root)) for root, count in roots for _ in range(count)]

    def _impulse_up_to(self, length: int) -> list[int]:
        """Approximate samples of 1/D in units of ``2**-fine``."""
        samples = self._impulse
        drop = max(0, self._shift - 2 * self._fine)
        weights, shift = [-value >> drop for value in self._under[1:]], self._shift - drop
        while len(samples) < length:
            samples.append(sum(map(mul, weights, samples[: -len(weights) - 1 : -1])) >> shift)
        return samples

    def _find_forms(self, window: int, fine: int) -> None:
        """Choose the samples that x stands for, by elimination, and find P and T from those of 1/D."""
        d, size = self._order, self._piece
        self._fine, self._impulse = fine, [1 << fine]
        response = [*([0] * d), *self._impulse_up_to(window + size + d)]

        def row(at: int) -> list[int]:
            return response[at + d : at : -1]

        step = max(1, window // _GROUPS)
        near = {*range(min(window, _GROUPS)), *(at + k for at in range(0, window, step) for k in range(_NEIGHBOURS))}
        places = sorted(near)
        matrix = np.array([row(at) for at in places], dtype=object)
        self._places: list[int] = []
        for column in range(d):
            pivot = int(np.argmax(np.abs(matrix[:, column])))
            factors = (matrix[:, column] << fine) // (matrix[pivot, column] or 1)
            matrix[:, column:] -= (factors[:, None] * matrix[pivot, column:]) >> fine
            matrix[pivot] = 0
            self._places.append(places[pivot])
        wanted = [*range(size + d), *(size + at for at in self._places)]
        with ctx.workprec(2 * fine):
            try:
                inverse = arb_mat([list(map(arb, row(at))) for at in self._places]).mid().inv().mid()
            except ZeroDivisionError:
                inverse = arb_mat(d, d)
            scaled = arb_mat([list(map(arb, row(at))) for at in wanted]) * inverse * arb(2) ** self._bits
            forms = np.array([_integer(value) for value in scaled.entries()], dtype=object).reshape(-1, d)
        self._forms, self._step = forms[: size + d], forms[size + d :]

    def _check_forms(self) -> bool:
        """Find by how much the forms fail to solve the recursion, exactly; whether that is little enough."""
        d, size, forms = self._order, self._piece, self._forms
        under = fmpz_poly(self._under)
        inside = ((under * fmpz_poly(column)).coeffs()[d : size + d] for column in forms.T.tolist())
        between = forms[:d] @ self._step - (forms[size:] << self._bits)
        norm = Fraction(sum(map(abs, self._under)), 1 << self._shift)
        self._residual = Fraction(int(sum(sum(map(abs, column)) for column in inside)), 1 << self._shift + self._bits)
        self._residual += norm * Fraction(int(np.abs(between).sum()), 1 << 2 * self._bits)
        return self._residual < self._wanted

    def _find_powers(self) -> None:
        """Find powers of T, and the norms of these and of one that is so small that what is behind hardly counts."""
        d, bits = self._order, self._bits
        self._powers: list[fmpz_mat] = []
        self._norms: list[Fraction] = []
        with ctx.workprec(3 * bits):
            power = arb_mat(d, d, [arb(value) * arb(2) ** -bits for value in self._step.ravel().tolist()])
            while True:
                rows = power.tolist()
                upper = [sum(map(abs, row), arb(0)).upper() for row in rows]
                self._norms.append(max(fraction_of(value) for value in upper))
                entries = power.entries()
                if not all(value.rad() * arb(2) ** bits < 1 for value in entries):
                    raise UndecidedError("the responses of a denominator could not be enclosed")
                if self._norms[-1] < Fraction(1, 1 << _ACCURACY):
                    break
                if self._piece << len(self._norms) > _LONGEST:
                    raise UndecidedError(f"a response does not die away within {_LONGEST} samples")
                self._powers.append(fmpz_mat(d, d, [_integer(value * arb(2) ** bits) for value in entries]))
                power = power * power
        self._count = 1 << len(self._powers)
        whole = self._forms[: self._piece]
        self._weight = Fraction(int(np.abs(whole).sum()), 1 << bits)
        self._summed = SummedForms(whole, bits)

    # The sequences.

    def _sequence(self, numerator: fmpq_poly, *, rough: bool = False) -> tuple[Fraction, Fraction]:
        """Upper bounds of ``|h|`` and of the residual ``|N - D h|`` for a sequence h."""
        if not self._order:
            taps, scale = _taps(numerator)
            return Fraction(sum(map(abs, taps)), scale), Fraction(0)
        head, numbers, left_out, residual = self._pieces(numerator)
        first = Fraction(sum(map(abs, head)), 1 << self._bits)
        total = self._summed.rough_magnitudes(numbers) if rough else self._summed.magnitudes(numbers)
        return first + total + left_out, residual

    def _pieces(self, numerator: fmpq_poly, least: int = 0) -> tuple[list[int], Integers, Fraction, Fraction]:
        """Find a sequence h: its first samples and the numbers x of its pieces, both in units of ``2**-bits``.

        The first samples are at least so many.
        Return as well by how much all magnitudes together may differ from those of h, and the residual ``|N - D h|``.
        """
        taps, scale = _taps(numerator)
        d, bits = self._order, self._bits
        start = max(least, len(taps) - d)
        places = [*range(start), *(start + at for at in self._places)]
        impulse = self._impulse_up_to(max(places) + 1)
        under = scale << self._fine - bits
        values = [sum(n * impulse[at - k] for k, n in enumerate(taps[: at + 1])) // under for at in places]
        head, first = values[:start], np.array(values[start:], dtype=object)
        numbers, error = self._numbers(first)
        sizes = Fraction(float(np.abs(numbers.astype(np.float64) * 2.0**-bits).max(axis=0).sum()) * (1 + 2.0**-30))
        sizes = (sizes + Fraction(len(numbers[0]) * error, 1 << bits)) / (1 - self._norms[-1])
        residual = self._first_residual(taps, scale, head, first) + self._residual * sizes
        left_out = self._weight * (Fraction(self._count * error, 1 << bits) + self._norms[-1] * sizes)
        return head, numbers, left_out, residual

    def _samples(self, numerator: fmpq_poly) -> tuple[Floats, Floats, Fraction]:
        """Return a response's samples, by how much each may be off, and by how much all magnitudes together may be."""
        head, numbers, left_out, residual = self._pieces(numerator)
        values, doubts = self._summed.values(numbers)
        first = np.array(head, dtype=object).astype(np.float64) * 2.0**-self._bits
        return (
            np.concatenate([first, values.T.ravel()]),
            np.concatenate([np.abs(first) * 2.0**-50, doubts.T.ravel()]),
            left_out + self._inverse * residual,
        )

    def _first_residual(self, taps: list[int], scale: int, head: list[int], first: Integers) -> Fraction:
        """Sum of the magnitudes of ``N - D h`` before piece 0 carries on by itself."""
        bits = 2 * self._bits
        samples = [*(value << self._bits for value in head), *(self._forms[: self._order] @ first).tolist()]
        total = Fraction(0)
        for n in range(len(samples)):
            product = sum(value * samples[n - k] for k, value in enumerate(self._under[: n + 1]))
            wanted = Fraction(taps[n] if n < len(taps) else 0, scale)
            total += abs(wanted - Fraction(product, 1 << self._shift + bits))
        return total

    def _numbers(self, first: Integers) -> tuple[Integers, int]:
        """Return x of all pieces, shape (order, pieces), in units of ``2**-bits``, and a bound on the error of each."""
        d, bits = self._order, self._bits
        rows, error = [[fmpz(value)] for value in first.tolist()], 0
        largest = max(map(abs, first.tolist()))
        for power, norm in zip(self._powers, self._norms, strict=False):
            following = [value >> bits for value in (power * fmpz_mat(rows)).entries()]
            # The power is within two units, and the product is rounded down.
            error = max(error, math.ceil(norm * error) + (2 * d * (largest + error) >> bits) + 2)
            largest = max(largest, int(max(map(abs, following))))
            count = len(rows[0])
            rows = [row + following[k * count : (k + 1) * count] for k, row in enumerate(rows)]
        return np.array([list(map(int, row)) for row in rows], dtype=object), error


def _taps(numerator: fmpq_poly) -> tuple[list[int], int]:
    """Return the coefficients of a numerator as integers, and what they are to be divided by."""
    return [int(value) for value in numerator.numer().coeffs()], int(numerator.denom())


def _integer(value: arb) -> int:
    """Round a narrow ball to an integer within two of all that it encloses."""
    mantissa, exponent = (int(part) for part in value.mid().man_exp())
    return mantissa << exponent if exponent >= 0 else mantissa >> -exponent
