"""Sums of the magnitudes of linear forms of many vectors: ``|P x|`` over all rows of P and all x.

P and x are integers in units of ``2**-bits``. Signs are taken from products in doubles, with a bound on all rounding
(Higham, Accuracy and Stability of Numerical Algorithms, section 3.1); where the bound leaves a sign open, it comes from
the integers. Signs are then summed with P, which is cut into limbs so short that no double ever rounds. Where an upper
bound need not be so close, the magnitudes of the products in doubles are added up.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import reduce

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.object_]

_UNIT = 2.0**-53  # bound on the relative error of an operation in doubles
_SLACK = 1 + 2.0**-30  # for the rounding of such a bound itself


class SummedForms:
    """Forms, of which sums over vectors are made.

    Parameters
    ----------
    forms : array of int, shape (rows, order)
        P in units of ``2**-bits``.
    bits : int
        Fraction bits, of vectors as well.
    """

    def __init__(self, forms: Integers, bits: int) -> None:
        self.forms, self.bits = forms, bits
        self._doubles = forms.astype(np.float64) * 2.0**-bits
        self._limb = 52 - len(forms).bit_length()
        self._limbs = _limbs(forms, self._limb)

    def beside(self, others: SummedForms) -> SummedForms:
        """Return forms of two vectors, one below the other: these of the first, minus the `others` of the second."""
        bits = max(self.bits, others.bits)
        parts = [self.forms << bits - self.bits, -(others.forms << bits - others.bits)]
        return SummedForms(np.concatenate(parts, axis=1), bits)

    def magnitudes(self, numbers: Integers) -> Fraction:
        """Sum of ``|P x|``, exact, over vectors of the shape (order, count)."""
        values, doubts = self.values(numbers)
        signs = np.where(values < 0, -1.0, 1.0)
        rows, columns = np.nonzero(np.abs(values) <= doubts)
        exact = (self.forms[rows] * numbers[:, columns].T).sum(axis=1)
        signs[rows, columns] = np.where(exact < 0, -1.0, 1.0)
        parts = (self._limbs @ signs).reshape(-1, *numbers.shape).astype(np.int64).astype(object)
        added = reduce(lambda high, low: (high << self._limb) + low, reversed(parts))
        return Fraction(int((added * numbers).sum()), 1 << 2 * self.bits)

    def rough_magnitudes(self, numbers: Integers) -> Fraction:
        """Upper bound of that sum, above it by a share of about ``2**-42``."""
        scaled = self._scaled(numbers)
        total = math.fsum(np.abs(self._doubles @ scaled).sum(axis=0).tolist())
        products = float(np.abs(self._doubles).sum(axis=0) @ np.abs(scaled).sum(axis=1))
        # Of a product, both factors are rounded, and the magnitudes for one vector are added up one by one.
        rounding = (len(numbers) + 4) * products + (len(self.forms) + 4) * total
        return Fraction(total) + Fraction(rounding * _UNIT * _SLACK)

    def values(self, numbers: Integers) -> tuple[Floats, Floats]:
        """Return P x, and by how much each may be off, shape (rows, count)."""
        scaled = self._scaled(numbers)
        doubts = np.abs(self._doubles) @ np.abs(scaled)
        return self._doubles @ scaled, doubts * ((len(numbers) + 4) * _UNIT * _SLACK)

    def _scaled(self, numbers: Integers) -> Floats:
        return np.asarray(numbers.astype(np.float64) * 2.0**-self.bits, dtype=np.float64)


def _limbs(forms: Integers, bits: int) -> Floats:
    """Cut forms, shape (rows, order), into limbs of `bits` bits, lowest first, shape (limbs * order, rows)."""
    longest = max(abs(value).bit_length() for value in forms.ravel().tolist())
    parts, rest = [], forms.T
    while longest > bits:
        parts.append(rest & ((1 << bits) - 1))
        rest, longest = rest >> bits, longest - bits
    return np.concatenate([*parts, rest]).astype(np.float64)
