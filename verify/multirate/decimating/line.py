"""What the line of the last samples takes over at a clock, and what goes along with each of them, in all cases.

The registers have these names; they move as `sosmith.verify.multirate.decimating.entrance` says::

    line(k)               the sample k samples before the last one that entered
    valid(k), phase(k)    whether there is a sample at position k, from 1 on, and its phase
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from sosmith.verify.multirate.decimating.entrance import Entrance, by_ends
from sosmith.verify.multirate.logic import Logic, Ranges, RegisterShape
from sosmith.verify.parallel.control import SOURCE
from sosmith.verify.program.normal_form import Form, constant

_NAME = re.compile(r"([a-z]+)(\d+)")


@dataclass(frozen=True)
class Line:
    """The last samples, and those on their way: a part of the hardware.

    Attributes
    ----------
    entrance : Entrance
    length : int
        How many samples there are in the line.
    positions : int
        How many positions a sample has before its products are added to the total.
    """

    entrance: Entrance
    length: int
    positions: int

    @property
    def nets(self) -> Mapping[str, int]:
        """None."""
        return {}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        bits, first = self.entrance.port.bits, None if self.entrance.fills else 0
        shapes = {f"line{k}": RegisterShape(bits, first) for k in range(self.length)}
        phase = RegisterShape((self.entrance.factor - 1).bit_length(), None)
        for k in range(1, self.positions + 1):
            shapes |= {f"valid{k}": RegisterShape(1, 0), f"phase{k}": phase}
        return shapes

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The phase at the last position by its ends; before, it is passed on as it is."""
        return {f"phase{self.positions}": by_ends(self.entrance.factor - 1)}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        parts = _NAME.fullmatch(name)
        assert parts is not None  # as it is for all names in `registers`
        kind, k = parts[1], int(parts[2])
        if kind == "line":
            if not self.entrance.enters(now):
                return now.word(name)
            return now.word(f"line{k - 1}") if k else self.entrance.sample(now)
        if not self.entrance.advances(now):
            return now.word(name)
        if kind == "valid":
            return constant(now.bit(f"valid{k - 1}" if k > 1 else SOURCE))
        return now.word(f"phase{k - 1}" if k > 1 else "phase")
