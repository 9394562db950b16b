"""The exact filter for Rocq: its sections in integers, and near ones with fewer digits by which it is followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpz_poly

from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.rocq.polynomials import common_denominator, integers, numbers
from sosmith.verify.rocq.responses import divide, impulse

_ROUGH = 1 << 21
"""First sample of the response that a rough gain is read off."""


@dataclass(frozen=True)
class ExactRow:
    """What Rocq's `exact_row` finds: ``K output = row * input``, within `rest`; and the parts that it follows."""

    row: fmpz_poly
    rest: int
    parts: str


def sections_of(entries: Sequence[SectionEntry]) -> list[tuple[list[int], list[int]]]:
    """Return numerators and denominators in integers."""
    made = []
    for entry in entries:
        scale = common_denominator([entry.numerator, entry.denominator])
        made.append((integers(entry.numerator, scale), integers(entry.denominator, scale)))
    return made


def sections_term(sections: Sequence[tuple[Sequence[int], Sequence[int]]]) -> str:
    """Write them as a term of Rocq."""
    return "[" + ";\n   ".join(f"({numbers(over)}, {numbers(under)})" for over, under in sections) + "]"


def exact_row(
    sections: Sequence[tuple[Sequence[int], Sequence[int]]], least: int, whole: int, bits: int
) -> ExactRow:
    """Follow `exact_row` for inputs of magnitude at most `least`, with coefficients of near sections of `bits`."""
    limits, roughs = [least], []
    for over, under in sections:
        rough, limit = _rough(over, under, limits[-1])
        roughs.append(rough)
        limits.append(limit)
    row, rest, parts = fmpz_poly([whole]), 0, []
    for index in reversed(range(len(sections))):
        over, under = sections[index]
        near = _Near(over, under, bits if len(under) > 1 or under[0] != 1 else 0)
        divided = divide(near.bits, near.tail, [int(value) for value in row.coeffs()])
        far = near.drift[0] * limits[index] + near.drift[1] * limits[index + 1]
        size = sum(map(abs, divided.values))
        rest += divided.rest * limits[index + 1] + size * far // near.share + 1
        row = fmpz_poly(near.over) * fmpz_poly(divided.values)
        main = near.witness(divided.samples, 0)
        parts.append(f"Part ({main}) {numbers(near.over)} ({roughs[index]}) {limits[index + 1]}")
    return ExactRow(row, rest, "[" + ";\n   ".join(reversed(parts)) + "]")


class _Near:
    """A section with coefficients of fewer digits: `times` the true ones are nearly `share` times these."""

    def __init__(self, over: Sequence[int], under: Sequence[int], bits: int) -> None:
        self.bits, self.times, self.share = bits, 1 << bits, under[0]
        self.over = [round(Fraction(value << bits, under[0])) for value in over]
        self.tail = [round(Fraction(value << bits, under[0])) for value in under[1:]]
        self.drift = self._drift(over, self.over), self._drift(under, [1 << bits, *self.tail])

    def _drift(self, true: Sequence[int], near: Sequence[int]) -> int:
        return sum(abs(self.times * a - self.share * b) for a, b in zip(true, near, strict=True))

    def witness(self, samples: int, one: int) -> str:
        return f"Witness {samples} {self.bits} {numbers(self.tail)} (2 ^ {self.bits}) {self.share} {one}"


def _rough(over: Sequence[int], under: Sequence[int], least: int) -> tuple[str, int]:
    """Return a witness for a rough gain, and the limit of the output that follows."""
    for bits in (32, 48, 64, 96, 160):
        near = _Near(over, under, bits)
        made = impulse(near.bits, near.tail, _ROUGH)
        size = sum(map(abs, made.values))
        left = near.share * ((_ROUGH << bits) - made.rest) - size * near.drift[1]
        if left > 0:
            break
    total = sum(abs(int(value)) for value in (fmpz_poly(list(over)) * fmpz_poly(made.values)).coeffs())
    limit = -(-near.times * total * least // left) if left > 0 else least
    return near.witness(made.samples, _ROUGH), limit
