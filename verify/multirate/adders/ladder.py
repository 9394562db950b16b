"""What every register of integrators and combs takes over at a clock, in all cases of its control.

The registers have these names, k from 1 to N; `advance` is 1 while the second word of the output buffer is free, and
only then any of them moves, but for the first three, which move with a sample that enters::

    phase, filled, filling    which sample it is, modulo R; how often R of the first one went in; whether that fills
    rail                      whether a code since the last result was at an end of its range
    sum(k)                    adds what sum(k-1) holds of the same sample; sum(0) is the sample
    valid(k), completes(k)    whether sum(k) holds a sample, and whether that brings a result
    comb(k), difference(k)    the difference before, of a result, and by how much the new one differs from it
    moved(k)                  whether difference(k) is that of a new result
    rail(k)                   `rail` as it was with the sample of position k
    left                      how many results do not count yet, or are flagged as settling
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.multirate.logic import BIT, Field, Logic, Ranges, RegisterShape, Signals
from sosmith.verify.parallel.control import SOURCE
from sosmith.verify.parallel.graph_codes import DATA
from sosmith.verify.program.normal_form import Form, constant, plus

READY = "s_axis_tready"
_NAME = re.compile(r"([a-z]+?)(\d*)")


@dataclass(frozen=True)
class Ladder:
    """Integrators, combs, and their control: a part of the hardware.

    Attributes
    ----------
    port : PortEntry
        What enters.
    factor, order, width : int
        R, N, and the bits of each sum.
    filled : bool
        Whether the first sample goes in N R times before it counts; otherwise a reset clears all sums.
    left : int
        Results after a start that do not count, or are flagged as settling.
    full : str
        The register that is 1 while the output buffer has no room.
    """

    port: PortEntry
    factor: int
    order: int
    width: int
    filled: bool
    left: int
    full: str

    @property
    def last(self) -> str:
        """The last difference."""
        return f"difference{self.order}"

    @property
    def moved(self) -> str:
        """Whether it is that of a new result."""
        return f"moved{self.order}"

    @property
    def rail(self) -> str:
        """The flag of its samples."""
        return f"rail{2 * self.order}"

    @property
    def signals(self) -> Signals:
        """The input: a code, and anything above it."""
        return Signals({DATA: [Field(DATA, self.port.bits)]})

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a sample is accepted."""
        return {READY: 1}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        bit, sums = RegisterShape(1, None), RegisterShape(self.width, None if self.filled else 0)
        shapes = {"phase": RegisterShape((self.factor - 1).bit_length(), 0), "rail": RegisterShape(1, 0)}
        if self.filled:
            shapes["filling"] = RegisterShape(1, 1)
            if self.order > 1:
                shapes["filled"] = RegisterShape((self.order - 1).bit_length(), 0)
        for k in range(1, self.order + 1):
            shapes |= {f"sum{k}": sums, f"comb{k}": sums, f"difference{k}": RegisterShape(self.width, None)}
            shapes |= {f"valid{k}": RegisterShape(1, 0), f"completes{k}": bit, f"moved{k}": RegisterShape(1, 0)}
        shapes |= {f"rail{k}": bit for k in range(1, 2 * self.order + 1)}
        if self.left:
            shapes["left"] = RegisterShape(self.left.bit_length(), self.left)
        return shapes

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The code by its ends and its sign, counters by their ends."""
        half, top = 1 << self.port.bits - 1, (1 << self.port.bits) - 1
        ends = {half - 1, half} if self.port.signed else {0, top}
        starts = sorted({0, half, top + 1} | ends | {end + 1 for end in ends})
        ranges: dict[str, Ranges] = {
            DATA: tuple((low, after - 1) for low, after in pairwise(starts)),
            "phase": _by_ends(self.factor - 1, (self.factor - 1).bit_length()),
        }
        if self.filled and self.order > 1:
            ranges["filled"] = _by_ends(self.order - 1, (self.order - 1).bit_length())
        if self.left:
            ranges["left"] = _by_ends(self.left, self.left.bit_length())
        return ranges

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name == READY:
            return constant(int(self._advances(now) and not self._fills(now)))
        parts = _NAME.fullmatch(name)
        assert parts is not None  # as it is for all names in `registers`
        kind, number = parts.groups()
        taken = self._taken(now, kind, int(number)) if number else self._entering(now, kind)
        return now.word(name) if taken is None else taken

    def _advances(self, now: Logic) -> bool:
        return not now.bit(self.full)

    def _fills(self, now: Logic) -> bool:
        return self.filled and bool(now.bit("filling"))

    def _enters(self, now: Logic) -> bool:
        return bool(now.bit(SOURCE)) and self._advances(now)

    def _entering(self, now: Logic, kind: str) -> Form | None:
        """Return what a register takes over that moves with a sample which enters, if it does."""
        last = self.factor - 1
        match kind:
            case "phase" if self._enters(now):
                return constant(0) if now.limits("phase") == (last, last) else plus(now.word("phase"), constant(1))
            case "filled" | "filling" if self._enters(now) and self._fills(now) and now.limits("phase") == (last, last):
                ends = self.order == 1 or now.limits("filled") == (self.order - 1,) * 2
                if kind == "filling":
                    return constant(0) if ends else None
                return plus(now.word("filled"), constant(1))
            case "rail" if self._enters(now) and not self._fills(now):
                return constant(0 if self._completes(now) else self._at_rail(now))
            case "left" if self._advances(now) and now.bit(self.moved) and now.limits("left") != (0, 0):
                return plus(now.word("left"), constant(-1))
        return None

    def _taken(self, now: Logic, kind: str, k: int) -> Form | None:
        """Return what a register of position k takes over from the one before, if it does."""
        if not self._advances(now):
            return None
        match kind:
            case "valid":
                return constant(self._valid(now, k - 1))
            case "completes":
                return constant(self._completes(now) if k == 1 else now.bit(f"completes{k - 1}"))
            case "moved":
                return constant(self._moves(now, k - 1))
            case "rail":
                return constant(self._at_rail(now) if k == 1 else now.bit(f"rail{k - 1}"))
            case "sum" if self._valid(now, k - 1):
                return plus(now.word(f"sum{k}"), self._sample(now) if k == 1 else now.word(f"sum{k - 1}"))
            case "comb" if self._moves(now, k - 1):
                return self._difference(now, k - 1)
            case "difference" if self._moves(now, k - 1):
                return plus(self._difference(now, k - 1), now.word(f"comb{k}"), -1)
        return None

    def _valid(self, now: Logic, k: int) -> int:
        return now.bit(f"valid{k}" if k else SOURCE)

    def _moves(self, now: Logic, k: int) -> int:
        last = self.order
        return now.bit(f"moved{k}") if k else int(now.bit(f"valid{last}") and now.bit(f"completes{last}"))

    def _difference(self, now: Logic, k: int) -> Form:
        return now.word(f"difference{k}" if k else f"sum{self.order}")

    def _completes(self, now: Logic) -> int:
        return int(now.limits("phase") == (0, 0))

    def _at_rail(self, now: Logic) -> int:
        """Whether a code since the last result is at an end, with the one that is there."""
        low, high = now.limits(DATA)
        here = low == high and low in {self.port.lowest % (1 << self.port.bits), self.port.highest}
        return now.bit("rail") | here

    def _sample(self, now: Logic) -> Form:
        """Return the code of the sample that is there."""
        low, _ = now.limits(DATA)
        negative = self.port.signed and low > self.port.highest
        return plus(now.signal(DATA), constant(-(1 << self.port.bits) if negative else 0))


def _by_ends(last: int, bits: int) -> Ranges:
    """Return the ranges of a counter: 0, what is between, its last value, and what it never is."""
    if bits == 1:
        return BIT
    between = [(1, last - 1)] if last > 1 else []
    beyond = [(last + 1, (1 << bits) - 1)] if last + 1 < 1 << bits else []
    return ((0, 0), *between, (last, last), *beyond)
