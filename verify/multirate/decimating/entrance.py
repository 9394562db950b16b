"""The entrance of a core that decimates and takes a sample at each clock, and what goes along with its samples.

The registers have these names; `advance` is 1 while the second word of the output buffer is free, and only then any of
them moves::

    phase             number of the sample since the last one that brought a result, which has 0
    filled, filling   how often R of the first sample went in; whether that still fills the filter
    rail              whether a code since the last result was at an end of its range
    rail(k)           the same with the sample of position k, from 1 on
    left              how many results do not count yet, or are flagged as settling
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.multirate.logic import BIT, Field, Logic, Ranges, RegisterShape, Signals
from sosmith.verify.parallel.control import SOURCE
from sosmith.verify.parallel.graph_codes import DATA
from sosmith.verify.program.normal_form import Form, constant, plus

READY = "s_axis_tready"


@dataclass(frozen=True)
class Entrance:
    """Where samples enter: a part of the hardware.

    Attributes
    ----------
    port : PortEntry
        What enters.
    factor : int
        R.
    fills : int
        How often R of the first sample go in before it is accepted; 0 if a reset clears what is remembered.
    full : str
        The register that is 1 while the output buffer has no room.
    """

    port: PortEntry
    factor: int
    fills: int
    full: str

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
        shapes = {"phase": RegisterShape((self.factor - 1).bit_length(), 0), "rail": RegisterShape(1, 0)}
        if self.fills:
            shapes["filling"] = RegisterShape(1, 1)
        if self.fills > 1:
            shapes["filled"] = RegisterShape((self.fills - 1).bit_length(), 0)
        return shapes

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The code by its ends and its sign, counters by their ends."""
        half, top = 1 << self.port.bits - 1, (1 << self.port.bits) - 1
        ends = {half - 1, half} if self.port.signed else {0, top}
        starts = sorted({0, half, top + 1} | ends | {end + 1 for end in ends})
        ranges: dict[str, Ranges] = {
            DATA: tuple((low, after - 1) for low, after in pairwise(starts)),
            "phase": by_ends(self.factor - 1),
        }
        return ranges | ({"filled": by_ends(self.fills - 1)} if self.fills > 1 else {})

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name == READY:
            return constant(int(self.advances(now) and not self._fills(now)))
        loaded = self._loaded(now, name)
        return now.word(name) if loaded is None else loaded

    def _loaded(self, now: Logic, name: str) -> Form | None:
        """Return what a register takes over, if it does."""
        last = now.limits("phase") == (self.factor - 1,) * 2 if name != "rail" and self.enters(now) else False
        match name:
            case "phase" if self.enters(now):
                return constant(0) if last else plus(now.word("phase"), constant(1))
            case "filled" if last and self._fills(now):
                return plus(now.word("filled"), constant(1))
            case "filling" if last and self._fills(now):
                ends = self.fills == 1 or now.limits("filled") == (self.fills - 1,) * 2
                return constant(0) if ends else None
            case "rail" if self.enters(now) and not self._fills(now):
                return constant(0 if self.completes(now) else self.at_rail(now))
        return None

    def advances(self, now: Logic) -> bool:
        """Whether anything moves."""
        return not now.bit(self.full)

    def enters(self, now: Logic) -> bool:
        """Whether a sample enters."""
        return bool(now.bit(SOURCE)) and self.advances(now)

    def _fills(self, now: Logic) -> bool:
        return self.fills > 0 and bool(now.bit("filling"))

    def completes(self, now: Logic) -> int:
        """Whether the sample that is there brings a result."""
        return int(now.limits("phase") == (0, 0))

    def at_rail(self, now: Logic) -> int:
        """Whether a code since the last result is at an end, with the one that is there."""
        low, high = now.limits(DATA)
        here = low == high and low in {self.port.lowest % (1 << self.port.bits), self.port.highest}
        return now.bit("rail") | here

    def sample(self, now: Logic) -> Form:
        """Return the code of the sample that is there."""
        low, _ = now.limits(DATA)
        negative = self.port.signed and low > self.port.highest
        return plus(now.signal(DATA), constant(-(1 << self.port.bits) if negative else 0))


@dataclass(frozen=True)
class Beside:
    """What goes along with samples: the flag of each position, and the count of results that come behind the last.

    Attributes
    ----------
    entrance : Entrance
    positions : int
        How many there are before the register of results.
    left : int
        Results after a start that do not count, or are flagged as settling.
    comes : callable
        Whether a result leaves the last position.
    """

    entrance: Entrance
    positions: int
    left: int
    comes: Callable[[Logic], bool]

    @property
    def nets(self) -> Mapping[str, int]:
        """None."""
        return {}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        shapes = {f"rail{k}": RegisterShape(1, None) for k in range(1, self.positions + 1)}
        return shapes | ({"left": RegisterShape(self.left.bit_length(), self.left)} if self.left else {})

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The count by its ends."""
        return {"left": by_ends(self.left)} if self.left else {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if not self.entrance.advances(now):
            return now.word(name)
        if name == "left":
            counts = self.comes(now) and now.limits("left") != (0, 0)
            return plus(now.word(name), constant(-1 if counts else 0))
        k = int(name.removeprefix("rail"))
        return constant(self.entrance.at_rail(now) if k == 1 else now.bit(f"rail{k - 1}"))


@dataclass(frozen=True)
class Others:
    """Registers of which it is checked elsewhere what they hold."""

    names: frozenset[str]

    @property
    def nets(self) -> Mapping[str, int]:
        """None."""
        return {}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them, in any form."""
        return dict.fromkeys(sorted(self.names), RegisterShape(None, None))

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """None."""
        return {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what it takes over."""
        return now.after(name)


def by_ends(last: int) -> Ranges:
    """Return the ranges of a counter: 0, what is between, its last value, and what it never is."""
    if last == 1:
        return BIT
    top = 1 << last.bit_length()
    between = [(1, last - 1)] if last > 1 else []
    beyond = [(last + 1, top - 1)] if last + 1 < top else []
    return ((0, 0), *between, (last, last), *beyond)
