"""Responses of recursions as Rocq's `impulse` and `divide` make them, to choose how long and how precise they must be.

Rocq computes them again. Nothing proven depends on what is found here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.verify.graph import RejectedError

_SAMPLES = 1 << 20
"""Most samples of a response."""

_BEGUN = 64
"""Samples of a response that does not die away."""

_GROWTH = 256
"""Bits by which a response may become larger than what it responds to."""

_STRIDE = 16
"""Samples between two looks at whether a response has died away."""


@dataclass(frozen=True)
class Response:
    """A rounded response of a polynomial over another.

    Attributes
    ----------
    samples : int
        How many of them Rocq is told to compute.
    values : list of int
    rest : int
        Sum of the magnitudes of what they leave of the equation, at most.
    """

    samples: int
    values: list[int]
    rest: int


def split(under: Sequence[int]) -> tuple[int, list[int]]:
    """Return the exponent of the first coefficient, a power of two, and the other coefficients.

    Raises
    ------
    RejectedError
        If it is not a power of two.
    """
    bits = under[0].bit_length() - 1
    if under[0] != 1 << max(bits, 0):
        raise RejectedError(f"a denominator must begin with a power of two, not {under[0]}")
    return bits, list(under[1:])


def impulse(bits: int, tail: Sequence[int], one: int) -> Response:
    """Respond to `one * 2**bits` with the denominator ``[2**bits, *tail]``.

    Raises
    ------
    RejectedError
        If the response does not die away.
    """
    made = _respond(bits, tail, [one], [])
    return Response(made.samples, [one, *made.values], made.rest)


def divide(bits: int, tail: Sequence[int], over: Sequence[int]) -> Response:
    """Respond to a polynomial with the denominator ``[2**bits, *tail]``.

    Raises
    ------
    RejectedError
        If the response does not die away.
    """
    return _respond(bits, tail, [], over)


def begun(bits: int, tail: Sequence[int], one: int) -> Response:
    """Respond as `impulse` does, for some samples only: of a response that does not die away."""
    made = [one]
    for _ in range(_BEGUN):
        made.append(-sum(a * y for a, y in zip(tail, reversed(made), strict=False)) >> bits)
    begin = _ended(bits, tail, made, 1)
    return Response(begin.samples, made, begin.rest)


def _respond(bits: int, tail: Sequence[int], past: Sequence[int], over: Sequence[int]) -> Response:
    order, size = len(tail), sum(map(abs, tail))
    made = list(past)
    skip, least = len(made), len(over) if order or not past else 0
    most = 1 << _GROWTH + max(value.bit_length() for value in (*past, *over, 1))
    while True:
        count = len(made) - skip
        if count % _STRIDE == 0 and made and abs(made[-1]) > most:
            raise RejectedError(f"a response must not become larger than 2**{_GROWTH} times what it responds to")
        if count >= least and (count % _STRIDE == 0 or not order):
            largest = max(map(abs, made[-order:]), default=0) if order else 0
            if largest * size <= count << bits or not order:
                break
        if count > _SAMPLES:
            raise RejectedError(f"a response must die away within {_SAMPLES} samples")
        value = over[count] if count < len(over) else 0
        for a, y in zip(tail, reversed(made), strict=False):
            value -= a * y
        made.append(value >> bits)
    return _ended(bits, tail, made, skip)


def _ended(bits: int, tail: Sequence[int], made: list[int], skip: int) -> Response:
    """Return a response with what it leaves of the equation behind its last sample."""
    order, count = len(tail), len(made) - skip
    recent = made[::-1][:order]
    left = [sum(a * y for a, y in zip(tail[k:], recent, strict=False)) for k in range(order)]
    return Response(count, made[skip:], (count << bits) + sum(map(abs, left)))
