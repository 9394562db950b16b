"""The second-order sections that a datapath's integer coefficients realize, for any structure.

Cascaded sections are converted one by one. Where parallel branches meet, their transfer functions are added in rational
arithmetic, and the zeros of the sum are computed to double precision. The result is therefore accurate even deep in
the stop band, where the branches nearly cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import zip_longest
from typing import cast

import numpy as np
import numpy.typing as npt
from flint import acb, fmpq, fmpq_poly, fmpz_poly

from sosmith.gen.proof.cascade_proof import StageModel
from sosmith.gen.proof.linear_model import LinearModel, Polynomial

Array = npt.NDArray[np.float64]


_Wire = tuple[fmpq_poly, tuple[Polynomial, ...]]
"""Numerator, and factors of the denominator, of the transfer function from the input to a wire."""


def effective_sections(stages: Sequence[StageModel]) -> Array:
    """Second-order sections with the same transfer function, one row of b0, b1, b2, 1, a1, a2 for each.

    Parameters
    ----------
    stages : sequence of StageModel
        Stages that together have one input and one output.

    Returns
    -------
    float array, shape (sections, 6)
    """
    if all(len(stage) == 1 and _is_small(stage[0]) for stage in stages):
        rows = [[*_padded(model.transfer), *_padded(model.denominator)] for (model,) in stages]
        return np.array(rows, dtype=np.float64).reshape(-1, 6)
    wires: list[_Wire] = [(fmpq_poly([1]), ())]
    for stage in stages:
        wires = [_through(model, wires) for model in stage]
    ((numerator, whole),) = wires
    denominators = [factor for denominator in whole for factor in _split(denominator)]
    factors, gain = _factors(numerator)
    one = (Fraction(1),)
    pairs = list(zip_longest(factors, denominators, fillvalue=one)) or [(one, one)]
    share = abs(gain) ** (1 / len(pairs))  # of the gain, for each section
    rows = [[*(share * value for value in _padded(b)), *_padded(a)] for b, a in pairs]
    result = np.array(rows)
    result[0, :3] *= np.sign(gain)
    return result


def _is_small(model: LinearModel) -> bool:
    """Whether it is a second-order section at most."""
    return max(len(model.transfer), len(model.denominator)) <= 3


def _split(denominator: Polynomial) -> list[tuple[Fraction, ...] | tuple[float, ...]]:
    """Factors of degree at most 2 of a denominator, which is its own if it has no higher one."""
    return [denominator] if len(denominator) <= 3 else [*_factors(_poly(denominator))[0]]


def _through(model: LinearModel, wires: Sequence[_Wire]) -> _Wire:
    """Add the transfer functions to an output of a stage; branches that meet are assumed to share no states."""
    arrived = [wires[k] for k in model.entries]
    total = fmpq_poly([0])
    for k, transfer in enumerate(model.transfers):
        part = arrived[k][0] * _poly(transfer)
        for other, (_, denominators) in enumerate(arrived):
            for denominator in denominators if other != k else ():
                part *= _poly(denominator)
        total += part
    own = (model.denominator,) if len(model.denominator) > 1 else ()
    return total, (*(factor for _, factors in arrived for factor in factors), *own)


def _poly(values: Polynomial) -> fmpq_poly:
    return fmpq_poly([fmpq(value.numerator, value.denominator) for value in values])


def _factors(polynomial: fmpq_poly) -> tuple[list[tuple[float, ...]], float]:
    """Factors of degree at most 2 in ``w = 1/z``, each with a constant term of 1 or 0, and the constant factor."""
    coefficients = [int(value) for value in polynomial.numer().coeffs()]
    delays = next(k for k, value in enumerate(coefficients) if value)
    pairs: list[tuple[float, ...]] = []
    real: list[float] = []
    # The library's type stubs omit the multiplicities.
    roots = cast("list[tuple[acb, int]]", fmpz_poly(coefficients[delays:][::-1]).complex_roots())
    for root, count in roots:
        z = complex(root)
        if z.imag == 0:
            real += [z.real] * count
        elif z.imag > 0:
            pairs += [(1.0, -2 * z.real, abs(z) ** 2)] * count
    real.sort()
    pairs += [(1.0, -a - b, a * b) for a, b in zip(real[::2], real[1::2], strict=False)]
    if len(real) % 2:
        pairs.append((1.0, -real[-1]))
    pairs += [(0.0, 1.0)] * delays
    return pairs, float(Fraction(coefficients[delays], int(polynomial.denom())))


def _padded(values: Sequence[Fraction] | Sequence[float]) -> list[float]:
    if len(values) > 3:
        raise ValueError(f"section must have an order of at most 2, not {len(values) - 1}")
    return [*(float(value) for value in values), 0.0, 0.0][:3]
