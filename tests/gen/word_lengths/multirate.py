"""What a decimated instrument should compute, in integers so long that nothing counts which they round.

It shares no code with the designs that it judges: the polynomial in powers of the codes, moving sums from running
totals, and the sections in the transposed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.model.port import Port

GUARD = 200
"""Fraction bits of everything behind the decimator, in the unit of the output."""

Rows = Sequence[Sequence[Fraction]]


def calibrated(codes: np.ndarray, inputs: Sequence[Port], rows: Rows) -> tuple[list[int], int]:
    """Return the polynomial of each sample as exact integers over a common denominator, and that."""
    columns = []
    for index, port in enumerate(inputs):
        under = math.lcm(port.zero.denominator, port.lsb.denominator)
        zero, lsb = int(port.zero * under), int(port.lsb * under)
        columns.append((np.array([zero + lsb * int(code) for code in codes[:, index]], dtype=object), under))
    (v, v_under), (t, t_under) = columns
    factors = {(i, j): a / v_under**i / t_under**j for i, row in enumerate(rows) for j, a in enumerate(row)}
    under = math.lcm(*(factor.denominator for factor in factors.values()))
    total = np.array([0] * len(codes), dtype=object)
    for (i, j), factor in factors.items():
        total = total + int(factor * under) * v**i * t**j
    return total.tolist(), under


def moving_sums(values: list[int], factor: int, stages: int) -> list[int]:
    """Return every R-th moving sum of R values, N times over, where the first one has been there for ever."""
    padded = [values[0]] * (factor * stages) + values
    for _ in range(stages):
        running, totals = 0, [0]
        for value in padded:
            running += value
            totals.append(running)
        padded = [totals[k] - totals[k - factor] for k in range(factor, len(totals))]
    start = len(padded) - len(values)
    return padded[start::factor]


def filtered(values: list[int], sections: Sequence[tuple[Sequence[Fraction], Sequence[Fraction]]]) -> list[int]:
    """Filter integers by sections that start from zero."""
    for b, a in sections:
        over, under = ([round(c / a[0] * 2**GUARD) for c in (*row, 0, 0)[:3]] for row in (b, a))
        first = second = 0
        results = []
        for x in values:
            y = (over[0] * x >> GUARD) + first
            first = (over[1] * x - under[1] * y >> GUARD) + second
            second = over[2] * x - under[2] * y >> GUARD
            results.append(y)
        values = results
    return values


def exact_results(made: CoreDesign, codes: np.ndarray) -> np.ndarray:
    """Return the exact results of a decimated instrument in output LSBs, from its first sample on, shape (results,)."""
    quantized, datapath = made.quantized, made.datapath
    decimator, output = datapath.decimator, datapath.output
    assert decimator is not None
    assert quantized.filter is not None
    assert quantized.polynomial is not None
    values, under = calibrated(codes, datapath.inputs, quantized.polynomial.coefficients)
    sums = moving_sums(values, decimator.factor, decimator.stages)
    lsb = output.lsb * under * decimator.factor**decimator.stages
    entering = [(value * lsb.denominator << GUARD) // lsb.numerator for value in sums]
    sections = quantized.filter.exact
    gain = math.prod((sum(b, Fraction(0)) / sum(a, Fraction(0)) for b, a in sections), start=Fraction(1))
    held = round(gain * entering[0])
    low, high = (code + output.zero / output.lsb for code in (output.lowest, output.highest))
    scale = Fraction(1, 2**GUARD)
    found = [(y + held) * scale for y in filtered([x - entering[0] for x in entering], sections)]
    return np.array([float(min(max(y, low), high) - output.zero / output.lsb) for y in found])


def worst_error(made: CoreDesign, codes: np.ndarray) -> float:
    """Return the largest difference of the integer model from the exact results, in output LSBs."""
    return float(np.abs(made.datapath.compute(codes) - exact_results(made, codes)).max())
