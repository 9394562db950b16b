"""What the line of the last samples of several channels takes over at a clock, and its memory and that of the total.

The registers and memories have these names; they move as `sosmith.verify.multirate.decimating.channels` says. The
sample in front is at position 0, the line at position 1, and P is the last position::

    line_memory         of each channel all samples of the line but the oldest, which are read for the sample in front
    line(k)             the sample k samples before the one at position 1, of the same channel, for some k
    valid(k), phase(k)  whether there is a sample at position k, and its phase
    total_memory        what `total` was behind the last sample of each channel, which is read for one at position P - 1

What is read from the line counts as 0 for the first sample of a channel, with a start from zero.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from sosmith.verify.graph import require
from sosmith.verify.multirate.decimating.channels import CONTROL, ChannelEntrance, read_of
from sosmith.verify.multirate.decimating.entrance import by_ends
from sosmith.verify.multirate.logic import Field, Logic, MemoryShape, Ranges, RegisterShape, Signals, Written
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus

TOTAL = "total"
TOTALS = "total_memory"

_LINES = "line_memory"
_NAME = re.compile(r"([a-z]+)(\d+)")


def line_found(netlist: Netlist, bits: int) -> tuple[int, tuple[int, ...]]:
    """Return how many samples of so many bits there are in the line, and the places that are taken from it.

    Raises
    ------
    RejectedError
        If its memory does not hold whole samples.
    """
    memory = netlist.memories.get(_LINES)
    before, rest = (0, 0) if memory is None else divmod(memory.width, bits)
    require(not rest, f"{_LINES} must hold samples of {bits} bits")
    return before + 1, tuple(k for k in range(before + 1) if f"line{k}" in netlist.registers)


@dataclass(frozen=True)
class ChannelLine:
    """The last samples, those on their way, and all memories: a part of the hardware.

    Attributes
    ----------
    entrance : ChannelEntrance
    length : int
        How many samples there are in the line.
    places : tuple of int
        Those that are taken from it.
    positions : int
        How many positions a sample has before its products are added to the total, but for the one in front.
    width : int
        Bits of the total.
    """

    entrance: ChannelEntrance
    length: int
    places: tuple[int, ...]
    positions: int
    width: int

    @property
    def signals(self) -> Signals:
        """What is kept of a channel, and the line of one: side by side, the newest sample lowest."""
        name, bits = read_of(_LINES), self.entrance.port.bits
        places = [Field(_place(k), bits) for k in range(self.length - 1)]
        return Signals({**self.entrance.signals.layout, **({name: places} if places else {})})

    @property
    def nets(self) -> Mapping[str, int]:
        """None."""
        return {}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        bits, phase = self.entrance.port.bits, RegisterShape((self.entrance.factor - 1).bit_length(), None)
        shapes = {f"line{k}": RegisterShape(bits, None) for k in self.places}
        shapes |= {f"phase{k}": phase for k in range(1, self.positions + 1)}
        shapes |= {f"valid{k}": RegisterShape(1, 0) for k in range(2, self.positions + 1)}
        return shapes | {read_of(name): RegisterShape(shape.width, None) for name, shape in self._own.items()}

    @property
    def memories(self) -> Mapping[str, MemoryShape]:
        """That of what is kept, and those of lines and totals."""
        return {CONTROL: self.entrance.memory, **self._own}

    @property
    def _own(self) -> Mapping[str, MemoryShape]:
        channels, line = self.entrance.channels, (self.length - 1) * self.entrance.port.bits
        return {TOTALS: MemoryShape(self.width, channels)} | ({_LINES: MemoryShape(line, channels)} if line else {})

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The phase at the last position by its ends; before, it is passed on as it is. Places may have any code."""
        codes = ((0, (1 << self.entrance.port.bits) - 1),)
        places: dict[str, Ranges] = {_place(k): codes for k in range(self.length - 1)}
        return {**places, f"phase{self.positions}": by_ends(self.entrance.factor - 1)}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name == read_of(_LINES):
            return now.read(_LINES, self.entrance.coming(now))
        if not self.entrance.advances(now):
            return now.word(name)
        if name == read_of(TOTALS):
            return now.read(TOTALS, now.word(f"channel{self.positions - 1}"))
        parts = _NAME.fullmatch(name)
        assert parts is not None  # as it is for all other names in `registers`
        kind, k = parts[1], int(parts[2])
        if kind == "line":
            return self._before(now, k - 1) if k else self.entrance.sample(now)
        if kind == "valid":
            return constant(now.bit(f"valid{k - 1}"))
        return now.word(f"phase{k - 1}") if k > 1 else self.entrance.phase(now)

    def written(self, now: Logic, memory: str) -> Written | None:
        """Return what is written to a memory at the clock, if anything is."""
        if memory == CONTROL:
            return self.entrance.written(now)
        if memory == TOTALS:
            last = self.positions
            leaves = self.entrance.advances(now) and now.bit(f"valid{last}")
            return Written(now.word(f"channel{last}"), now.after(TOTAL)) if leaves else None
        if not self.entrance.enters(now):
            return None
        bits, word = self.entrance.port.bits, now.forms.unsigned(self.entrance.sample(now), self.entrance.port.bits)
        for k in range(self.length - 2):
            word = plus(word, self._before(now, k), 1 << bits * (k + 1))
        return Written(now.word("channel"), word)

    def _before(self, now: Logic, k: int) -> Form:
        """Return the code in place k of the line that the sample in front finds, as bits."""
        if not self.entrance.fills and self.entrance.is_first(now):
            return {}
        return now.signal(_place(k))


def _place(k: int) -> str:
    """Return the name of what place k of a channel's line holds: a signal of its own, so that forms stay short."""
    return f"place {k} of the line"
