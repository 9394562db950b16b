"""The entrance of a core that decimates several channels, and what goes along with their samples.

The registers have these names, and `control_memory` a word for each channel; `advance` is 1 while the second word of
the output buffer is free, and only then any register behind the sample in front moves::

    clearing          whether the words of the memory become 0, one at each clock; it begins with that
    there             whether there is a sample in front
    channel, sample   its channel and its code; while `clearing` is 1, the channel whose word becomes 0
    control_memory_read   what is kept of its channel: whether it has started, the phase of the sample, whether a code
                      since the last result was at an end of its range, and how many results were flagged as settling
    filled            how often R of a first sample went in, which fill the filter with a steady start
    valid(1)          whether a sample has entered at the last clock
    channel(k), rail(k), settling(k), counts(k), fresh(k)
                      of the sample at position k, from 1 on: its channel, the flags of its result, whether that counts,
                      and whether it is the first one of its channel, from zero

`near` is 1 while the sample at position 1 has the channel of the one in front, which then waits. So no two samples of
one channel are in neighbouring positions, and of the words that are read,

- that of what is kept, and that of the first sum, are read again at each clock while a sample is in front. They are
  written when a sample enters, and have been read behind that when the next one of its channel enters, which is two
  clocks later at the earliest;
- any other one is read for a sample at one position, and written when that leaves the next one. A sample of the same
  channel that is further on has left that by then, and one behind has not come there yet.

So no word counts that is read while it is written, and each channel has what is kept for itself, as if there were no
others: beside what is said here, integrators and combs (`sosmith.verify.multirate.decimating.channel_ladder`), or a
line of samples and a total (`sosmith.verify.multirate.decimating.channel_line`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.graph import require
from sosmith.verify.multirate.decimating.entrance import READY, by_ends
from sosmith.verify.multirate.logic import (
    BIT,
    Field,
    Logic,
    MemoryShape,
    Ranges,
    RegisterShape,
    Signals,
    Written,
)
from sosmith.verify.parallel.channels import DEST
from sosmith.verify.parallel.control import SOURCE, Case, cases
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.graph_codes import DATA
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus

CONTROL = "control_memory"
NEAR = "near"
"""Whether the sample at position 1 has the channel of the one in front."""

_STARTED, _PHASE, _RAIL, _COUNTED = (f"{what} of the channel" for what in ("start", "phase", "rail", "count"))
_NAME = re.compile(r"([a-z]+)(\d+)")


def read_of(memory: str) -> str:
    """Return the register that takes over what is read from a memory."""
    return f"{memory}_read"


@dataclass(frozen=True)
class ChannelEntrance:
    """Where samples enter, and what is kept of their channels: a part of the hardware.

    Attributes
    ----------
    port : PortEntry
        What enters.
    factor : int
        R.
    fills : int
        How often R of a channel's first sample go in before it enters; 0 with a start from zero.
    full : str
        The register that is 1 while the output buffer has no room.
    channels : int
        Number of channels, at least 2.
    settling : int
        Results of a channel that are flagged as settling.
    dest_width : int
        Bits of the channel on the stream.
    """

    port: PortEntry
    factor: int
    fills: int
    full: str
    channels: int
    settling: int
    dest_width: int

    @property
    def signals(self) -> Signals:
        """What is kept of a channel."""
        fields = [Field(_STARTED, 1), Field(_PHASE, self._phase_bits), Field(_RAIL, 1)]
        counted = [Field(_COUNTED, self.settling.bit_length())] if self.settling else []
        return Signals({read_of(CONTROL): [*fields, *counted]})

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a sample is accepted."""
        return {READY: 1}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        shapes = {
            "clearing": RegisterShape(1, 1),
            "there": RegisterShape(1, 0),
            "channel": RegisterShape(self.channel_bits, 0),
            "sample": RegisterShape(self.port.bits, None),
            "valid1": RegisterShape(1, 0),
            read_of(CONTROL): RegisterShape(self.memory.width, None),
        }
        return shapes | ({"filled": RegisterShape((self.fills - 1).bit_length(), 0)} if self.fills > 1 else {})

    @property
    def memory(self) -> MemoryShape:
        """The shape of the memory of what is kept."""
        return MemoryShape(2 + self._phase_bits + self.settling.bit_length(), self.channels)

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The code by its ends and its sign, counters by their ends, channels by those that there are."""
        half, top = 1 << self.port.bits - 1, (1 << self.port.bits) - 1
        ends = {half - 1, half} if self.port.signed else {0, top}
        ranges: dict[str, Ranges] = {
            "sample": _split(self.port.bits, half, *ends, *(end + 1 for end in ends)),
            "channel": _split(self.channel_bits, self.channels - 1, self.channels),
            DEST: _split(self.dest_width, self.channels),
            _STARTED: BIT,
            _PHASE: by_ends(self.factor - 1),
            _RAIL: BIT,
        }
        if self.settling:
            ranges[_COUNTED] = _split(self.settling.bit_length(), self.settling, self.settling + 1)
        return ranges | ({"filled": by_ends(self.fills - 1)} if self.fills > 1 else {})

    @property
    def channel_bits(self) -> int:
        """Bits of the number of a channel."""
        return (self.channels - 1).bit_length()

    @property
    def _phase_bits(self) -> int:
        return (self.factor - 1).bit_length()

    # What it does.

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name == READY:
            return constant(int(self._ready(now)))
        if name == read_of(CONTROL):
            return now.read(CONTROL, self.coming(now))
        loaded = self._loaded(now, name)
        return now.word(name) if loaded is None else loaded

    def written(self, now: Logic) -> Written | None:
        """Return what is written to the memory at the clock, if anything is."""
        if now.bit("clearing"):
            return Written(now.word("channel"), {})
        return Written(now.word("channel"), self._kept(now)) if self.enters(now) else None

    def _loaded(self, now: Logic, name: str) -> Form | None:
        """Return what a register takes over, if it does."""
        match name:
            case "clearing" if now.bit(name) and now.limits("channel") == (self.channels - 1,) * 2:
                return {}
            case "channel" if now.bit("clearing"):
                return plus(now.word(name), constant(1))
            case "channel" if self._ready(now):
                return now.signal(DEST)
            case "sample" if self._ready(now):
                return now.word(DATA)
            case "there" if self._ready(now):
                return constant(int(now.bit(SOURCE) and now.limits(DEST)[1] < self.channels))
            case "filled" if self.enters(now) and self.fill(now) and self._last(now):
                return {} if self._ends(now) else plus(now.word(name), constant(1))
            case "valid1" if self.advances(now):
                return constant(int(self.enters(now)))
        return None

    def _ready(self, now: Logic) -> bool:
        """Whether a sample is taken: one of a channel that does not exist is dropped."""
        if now.bit("clearing"):
            return False
        return not now.bit("there") or (self.enters(now) and not self.fill(now))

    def advances(self, now: Logic) -> bool:
        """Whether anything behind the sample in front moves."""
        return not now.bit(self.full)

    def enters(self, now: Logic) -> bool:
        """Whether the sample in front enters."""
        return bool(now.bit("there")) and self.advances(now) and not now.bit(NEAR)

    def coming(self, now: Logic) -> Form:
        """Return the channel of the sample that is in front after the clock."""
        return now.forms.unsigned(now.signal(DEST), self.channel_bits) if self._ready(now) else now.word("channel")

    def fill(self, now: Logic) -> bool:
        """Whether the sample in front fills the filter: then it stays."""
        return self.fills > 0 and self.is_first(now)

    def is_first(self, now: Logic) -> bool:
        """Whether its channel has not started."""
        return now.limits(_STARTED) == (0, 0)

    def phase(self, now: Logic) -> Form:
        """Return its phase."""
        return now.signal(_PHASE)

    def completes(self, now: Logic) -> int:
        """Whether it brings a result."""
        return int(now.limits(_PHASE) == (0, 0))

    def is_settling(self, now: Logic) -> int:
        """Whether its result is flagged as settling."""
        return int(now.limits(_COUNTED) != (self.settling,) * 2)

    def at_rail(self, now: Logic) -> int:
        """Whether a code of the channel since the last result is at an end, with that in front."""
        low, high = now.limits("sample")
        here = low == high and low in {self.port.lowest % (1 << self.port.bits), self.port.highest}
        return now.limits(_RAIL)[0] | here

    def sample(self, now: Logic) -> Form:
        """Return its code."""
        low, _ = now.limits("sample")
        negative = self.port.signed and low > self.port.highest
        return plus(now.signal("sample"), constant(-(1 << self.port.bits) if negative else 0))

    def _last(self, now: Logic) -> bool:
        return now.limits(_PHASE) == (self.factor - 1,) * 2

    def _ends(self, now: Logic) -> bool:
        """Whether what fills the filter ends with R samples."""
        return self.fills == 1 or now.limits("filled") == (self.fills - 1,) * 2

    def _kept(self, now: Logic) -> Form:
        """Return what is kept of the channel once the sample in front has entered."""
        fills = self.fill(now)
        started = not fills or (self._last(now) and self._ends(now))
        following = {} if self._last(now) else plus(now.signal(_PHASE), constant(1))
        rail = self.at_rail(now) and not self.completes(now) and not fills
        word = plus(constant(int(started)), now.forms.unsigned(following, self._phase_bits), 2)
        word = plus(word, constant(int(rail)), 2 << self._phase_bits)
        if not self.settling:
            return word
        counted = plus(now.signal(_COUNTED), constant(self.completes(now) & self.is_settling(now)))
        return plus(word, now.forms.unsigned(counted, self.settling.bit_length()), 4 << self._phase_bits)


@dataclass(frozen=True)
class ChannelBeside:
    """What goes along with samples of several channels: a part of the hardware.

    Attributes
    ----------
    entrance : ChannelEntrance
    positions : int
        How many there are before the register of results, but for the one in front.
    fresh : int
        At how many of them it counts whether a sample is the first one of its channel.
    """

    entrance: ChannelEntrance
    positions: int
    fresh: int

    @property
    def nets(self) -> Mapping[str, int]:
        """None."""
        return {}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        fills = self.entrance.fills > 0
        kinds = {"rail": 1, "channel": self.entrance.channel_bits}
        kinds |= ({"counts": 1} if fills else {}) | ({"settling": 1} if self.entrance.settling else {})
        along = {
            f"{kind}{k}": RegisterShape(bits, None)
            for kind, bits in kinds.items()
            for k in range(1, self.positions + 1)
        }
        return along | ({} if fills else {f"fresh{k}": RegisterShape(1, None) for k in range(1, self.fresh + 1)})

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """None: channels may have any number."""
        return {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        parts = _NAME.fullmatch(name)
        assert parts is not None  # as it is for all names in `registers`
        kind, k = parts[1], int(parts[2])
        if not self.entrance.advances(now):
            return now.word(name)
        if k > 1:
            return now.word(f"{kind}{k - 1}")
        if kind == "channel":
            return now.word(kind)
        front = {
            "rail": self.entrance.at_rail,
            "counts": lambda now: not self.entrance.fill(now),
            "settling": self.entrance.is_settling,
            "fresh": self.entrance.is_first,
        }
        return constant(int(front[kind](now)))


def with_near(netlist: Netlist) -> Netlist:
    """Return a netlist whose `near` is an input, of which it is checked that it compares the two channels.

    Raises
    ------
    RejectedError
        If it does not.
    """
    require(netlist.widths.get(NEAR) == 1 and NEAR in netlist.drivers, f"a core with several channels must have {NEAR}")
    for name in ("channel", "channel1", "valid1"):
        require(name in netlist.registers, f"the core must have a register {name}")
    any_channel: dict[str, Ranges] = {name: _split(netlist.widths[name]) for name in ("channel", "channel1")}

    def right(case: Case) -> bool:
        logic = Logic(netlist, Signals({}), case, any_channel)
        apart = plus(logic.word("channel1"), logic.word("channel"), -1)
        differs = plus(logic.forms.negative(apart), logic.forms.negative(plus({}, apart, -1)))
        wanted = plus(constant(1), differs, -1) if logic.bit("valid1") else {}
        return same_word(logic.forms, logic.net(NEAR), wanted, 1)

    same = all(found for _, found in cases(dict.fromkeys(any_channel, 0), right))
    require(same, f"{NEAR} must say whether the sample at position 1 has the channel of the one in front")
    return netlist.with_input(NEAR)


def _split(bits: int, *starts: int) -> Ranges:
    """Return the ranges of so many bits that begin at 0 and at the starts."""
    ends = sorted({0, *(start for start in starts if start < 1 << bits), 1 << bits})
    return tuple((start, after - 1) for start, after in pairwise(ends))
