"""Impulse responses in double precision around each part of a filter: to it, behind it, and of all others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.design import estimated_length
from sosmith.gen.realizations.registry import realization_of
from sosmith.model.arithmetic.recursive_filters import lfilter, sosfilt

Array = npt.NDArray[np.float64]
_Transfer = tuple[list[float], list[float]]


class Responses(NamedTuple):
    """Impulse responses around one part, all of one length.

    Attributes
    ----------
    through : array
        From the input of the filter to that of the part.
    behind : array
        From the output of the part to that of the filter.
    others : array
        Of all other parts.
    """

    through: Array
    behind: Array
    others: Array


def responses_around(parts: Sequence[Any], realization: str) -> list[Responses]:
    """Return the responses around each part that a realization makes its stages from, long enough for estimates."""
    transfer = realization_of(realization).transfer
    return _around_sections(parts) if transfer is None else _around([_in_doubles(transfer(part)) for part in parts])


def _around_sections(rows: Sequence[Sequence[float]]) -> list[Responses]:
    sos = np.array(rows, dtype=np.float64)
    impulse = _impulse(estimated_length(sos))
    return [
        Responses(*(sosfilt(some, impulse) if len(some) else impulse for some in (sos[:k], sos[k + 1 :], others)))
        for k in range(len(rows))
        for others in [np.delete(sos, k, axis=0)]
    ]


def _around(parts: Sequence[_Transfer]) -> list[Responses]:
    impulse = _impulse(max(_length(denominator) for _, denominator in parts))

    def response(some: Sequence[_Transfer]) -> Array:
        signal = impulse
        for numerator, denominator in some:
            signal = lfilter(numerator, denominator, signal)
        return signal

    return [
        Responses(*map(response, (parts[:k], parts[k + 1 :], [*parts[:k], *parts[k + 1 :]]))) for k in range(len(parts))
    ]


def _impulse(length: int) -> Array:
    impulse = np.zeros(length)
    impulse[0] = 1.0
    return impulse


def _in_doubles(transfer: tuple[Sequence[Any], Sequence[Any]]) -> _Transfer:
    numerator, denominator = ([float(value) for value in polynomial] for polynomial in transfer)
    return numerator, denominator


def _length(denominator: Sequence[float]) -> int:
    """Count the samples that estimates need of a denominator ``1 + A1 z**-M + A2 z**-2M``; 1 without poles."""
    step = math.gcd(*(k for k, value in enumerate(denominator) if k and value))
    if not step:
        return 1
    first, second = (*denominator[step::step], 0.0)[:2]
    return step * estimated_length(np.array([[1.0, 0.0, 0.0, 1.0, first, second]]))
