"""Witnesses for the theorems on peak gains: how many samples of an impulse response, in which units.

The response itself is computed in Rocq. Here it is computed as well, only to choose so much precision that the claim is
decided; nothing proven depends on it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import cast

from flint import acb, fmpz_poly

from sosmith.verify.graph import RejectedError

_SAMPLES = 1 << 18
"""Most samples of a response."""


@dataclass(frozen=True)
class Witness:
    """An impulse response of 1/D: `samples` after the first one, in units of ``2**-bits``, and what it leaves.

    Attributes
    ----------
    values : list of int
        The response h, as Rocq's `impulse` makes it.
    whole, rest : int
        K of ``h * D = K + r``, and ``|r|``.
    """

    samples: int
    bits: int
    values: list[int]
    whole: int
    rest: int

    @property
    def term(self) -> str:
        """Write ``h`` as arguments of `impulse`, behind D."""
        return f"{self.samples} (2 ^ {self.bits})"


def witness(under: Sequence[int], *, extra: int = 0) -> Witness:
    """Choose the response of 1/D for a denominator with integer coefficients, accurate beyond the grid of certificates.

    Parameters
    ----------
    under : sequence of int
        D, which begins with a positive number.
    extra : int
        Bits of precision beyond what mostly decides a claim.

    Raises
    ------
    RejectedError
        If the response does not die away.
    """
    roots = cast("list[tuple[acb, int]]", fmpz_poly(list(under)).complex_roots())
    radius = max((1 / abs(complex(root)) for root, _ in roots), default=0.0)
    if radius >= 1:
        raise RejectedError("the poles must lie inside the unit circle")
    decay = -math.log2(max(radius, 2.0**-40))
    gain = _gain(under, min(_SAMPLES, math.ceil(60 / decay) + 8))
    bits = 64 + 32 + 2 * max(0, math.ceil(math.log2(gain))) + extra
    order = len(under) - 1
    samples = (math.ceil((bits + 2 * order) / decay) + 8 * order) if order else 0
    bits += samples.bit_length()
    if samples > _SAMPLES:
        raise RejectedError(f"a response must die away within {_SAMPLES} samples, not after {samples}")
    values = _impulse(under, samples, 1 << bits)
    whole = under[0] << bits
    left = fmpz_poly(values) * fmpz_poly(list(under)) - whole
    return Witness(samples, bits, values, whole, int(sum(abs(int(value)) for value in left.coeffs())))


def _gain(under: Sequence[int], samples: int) -> float:
    past = [1.0] + [0.0] * (len(under) - 2) if len(under) > 1 else []
    total = 1.0
    weights = [value / under[0] for value in under[1:]]
    for _ in range(samples if past else 0):
        value = -sum(a * y for a, y in zip(weights, past, strict=True))
        past = [value, *past[:-1]]
        total += abs(value)
    return total


def _impulse(under: Sequence[int], samples: int, one: int) -> list[int]:
    made, (first, *others) = [one], under
    for _ in range(samples):
        made.append(-sum(a * y for a, y in zip(others, reversed(made), strict=False)) // first)
    return made


def norm(witness: Witness, over: Sequence[int]) -> int:
    """Sum of the magnitudes of ``h * over``."""
    return sum(abs(int(value)) for value in (fmpz_poly(witness.values) * fmpz_poly(list(over))).coeffs())


def largest(values: Sequence[int]) -> int:
    """Largest sum of the first values, of at least one of them."""
    return max(accumulate(values), default=0)
