"""What integrators and combs of several channels take over at a clock, whose sums and combs are in memories.

The registers and memories have these names, k from 1 to N; they move as `sosmith.verify.multirate.decimating.channels`
says. The sample in front is at position 0, `sum(k)` at position k, and `difference(k)` at N + k::

    sum(k)_memory             the sum of each channel, which is read for a sample at position k - 2
    sum(k)                    that of the sample's channel and sum(k-1) of the same sample, which is written back
    comb(k)_memory            the difference before, of each channel, which is read for a sample at position N + k - 2
    difference(k)             by how much difference(k-1) differs from that; difference(0) is sum(N)
    valid(k), completes(k)    whether sum(k) holds a sample, and whether that brings a result
    moved(k)                  whether difference(k) is that of a new result

What is read counts as 0 for the first sample of a channel, with a start from zero.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from sosmith.verify.multirate.decimating.channels import CONTROL, ChannelEntrance, read_of
from sosmith.verify.multirate.decimating.ladder import Combs
from sosmith.verify.multirate.logic import Logic, MemoryShape, Ranges, RegisterShape, Written
from sosmith.verify.program.normal_form import Form, constant, plus

_NAME = re.compile(r"([a-z]+)(\d+)(_memory(_read)?)?")


@dataclass(frozen=True)
class ChannelLadder(Combs):
    """Integrators and combs, and all memories: a part of the hardware.

    Attributes
    ----------
    entrance : ChannelEntrance
    order, width : int
        N, and the bits of each sum.
    """

    entrance: ChannelEntrance
    order: int
    width: int

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        word, shapes = RegisterShape(self.width, None), dict[str, RegisterShape]()
        for k in range(1, self.order + 1):
            shapes |= {f"sum{k}": word, f"difference{k}": word}
            shapes |= {read_of(f"{kind}{k}_memory"): word for kind in ("sum", "comb")}
            shapes |= {f"completes{k}": RegisterShape(1, None), f"moved{k}": RegisterShape(1, 0)}
            shapes |= {f"valid{k}": RegisterShape(1, 0)} if k > 1 else {}
        return shapes

    @property
    def memories(self) -> Mapping[str, MemoryShape]:
        """That of what is kept, and those of sums and combs."""
        shape = MemoryShape(self.width, self.entrance.channels)
        names = (f"{kind}{k}_memory" for kind in ("sum", "comb") for k in range(1, self.order + 1))
        return {CONTROL: self.entrance.memory, **dict.fromkeys(names, shape)}

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """None: sums may have any value."""
        return {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        kind, k, is_read = _parts(name)
        if is_read:
            return self._read(now, kind, k)
        if not self.entrance.advances(now):
            return now.word(name)
        match kind:
            case "valid":
                return constant(now.bit(f"valid{k - 1}"))
            case "completes":
                return constant(self.entrance.completes(now) if k == 1 else now.bit(f"completes{k - 1}"))
            case "moved":
                return constant(self._moves(now, k))
            case "sum":
                return plus(self._sum(now, k - 1), self._before(now, kind, k))
        return plus(self._difference(now, k - 1), self._before(now, "comb", k), -1)

    def written(self, now: Logic, memory: str) -> Written | None:
        """Return what is written to a memory at the clock, if anything is."""
        if memory == CONTROL:
            return self.entrance.written(now)
        kind, k, _ = _parts(memory)
        position = self._position(kind, k)
        leaves = self.entrance.enters(now) if position == 0 else self.entrance.advances(now)
        if not leaves or not self._there(now, kind, k):
            return None
        before = self._before(now, kind, k) if kind == "sum" else {}
        word = plus(self._sum(now, k - 1), before) if kind == "sum" else self._difference(now, k - 1)
        return Written(self._channel(now, position), word)

    def _position(self, kind: str, k: int) -> int:
        """Return the position of the samples that a sum or a comb is read for when they leave."""
        return k - 1 if kind == "sum" else self.order + k - 1

    def _there(self, now: Logic, kind: str, k: int) -> int:
        """Whether a sample at the position of a sum or a comb, but in front, moves it."""
        if kind == "comb":
            return self._moves(now, k)
        return now.bit(f"valid{k - 1}") if k > 1 else 1

    def _read(self, now: Logic, kind: str, k: int) -> Form:
        """Return what is read at a clock, for the sample that comes to the position of a sum or a comb."""
        position, memory = self._position(kind, k), f"{kind}{k}_memory"
        if position == 0:
            return now.read(memory, self.entrance.coming(now))
        if not self.entrance.advances(now):
            return now.word(read_of(memory))
        return now.read(memory, self._channel(now, position - 1))

    def _before(self, now: Logic, kind: str, k: int) -> Form:
        """Return the sum of the channel of a sample, or what its comb holds."""
        position = self._position(kind, k)
        word = now.word(read_of(f"{kind}{k}_memory"))
        if self.entrance.fills:
            return word
        first = now.bit(f"fresh{position}") if position else self.entrance.is_first(now)
        return {} if first else word

    def _channel(self, now: Logic, position: int) -> Form:
        return now.word(f"channel{position or ''}")

    def _moves(self, now: Logic, k: int) -> int:
        """Whether a new result comes to comb k."""
        last = self.order
        return now.bit(f"moved{k - 1}") if k > 1 else int(now.bit(f"valid{last}") and now.bit(f"completes{last}"))

    def _sum(self, now: Logic, k: int) -> Form:
        return now.word(f"sum{k}") if k else self.entrance.sample(now)

    def _difference(self, now: Logic, k: int) -> Form:
        return now.word(f"difference{k}" if k else f"sum{self.order}")


def _parts(name: str) -> tuple[str, int, bool]:
    """Return what a name is of: kind, number, and whether it is what is read from a memory."""
    parts = _NAME.fullmatch(name)
    assert parts is not None  # as it is for all names of the part
    return parts[1], int(parts[2]), parts[4] is not None
