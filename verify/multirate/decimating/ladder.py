"""What every register of integrators and combs takes over at a clock, in all cases of its control.

The registers have these names, k from 1 to N; they move as `sosmith.verify.multirate.decimating.entrance` says::

    sum(k)                    adds what sum(k-1) holds of the same sample; sum(0) is the sample
    valid(k), completes(k)    whether sum(k) holds a sample, and whether that brings a result
    comb(k), difference(k)    the difference before, of a result, and by how much the new one differs from it
    moved(k)                  whether difference(k) is that of a new result
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from sosmith.verify.multirate.decimating.entrance import Entrance
from sosmith.verify.multirate.logic import Logic, Ranges, RegisterShape
from sosmith.verify.parallel.control import SOURCE
from sosmith.verify.program.normal_form import Form, constant, plus

_NAME = re.compile(r"([a-z]+)(\d+)")


class Combs:
    """What combs leave, whatever holds the words of integrators and combs."""

    order: int

    @property
    def last(self) -> str:
        """The last difference."""
        return f"difference{self.order}"

    @property
    def moved(self) -> str:
        """Whether it is that of a new result."""
        return f"moved{self.order}"

    @property
    def nets(self) -> Mapping[str, int]:
        """None."""
        return {}


@dataclass(frozen=True)
class Ladder(Combs):
    """Integrators and combs: a part of the hardware.

    Attributes
    ----------
    entrance : Entrance
    order, width : int
        N, and the bits of each sum.
    """

    entrance: Entrance
    order: int
    width: int

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them."""
        shapes: dict[str, RegisterShape] = {}
        bit, sums = RegisterShape(1, None), RegisterShape(self.width, None if self.entrance.fills else 0)
        for k in range(1, self.order + 1):
            shapes |= {f"sum{k}": sums, f"comb{k}": sums, f"difference{k}": RegisterShape(self.width, None)}
            shapes |= {f"valid{k}": RegisterShape(1, 0), f"completes{k}": bit, f"moved{k}": RegisterShape(1, 0)}
        return shapes

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """None: sums may have any value."""
        return {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        parts = _NAME.fullmatch(name)
        assert parts is not None  # as it is for all names in `registers`
        taken = self._taken(now, parts[1], int(parts[2])) if self.entrance.advances(now) else None
        return now.word(name) if taken is None else taken

    def _taken(self, now: Logic, kind: str, k: int) -> Form | None:
        """Return what a register takes over from the position before, if it does."""
        match kind:
            case "valid":
                return constant(self._valid(now, k - 1))
            case "completes":
                return constant(self.entrance.completes(now) if k == 1 else now.bit(f"completes{k - 1}"))
            case "moved":
                return constant(self._moves(now, k - 1))
            case "sum" if self._valid(now, k - 1):
                return plus(now.word(f"sum{k}"), self.entrance.sample(now) if k == 1 else now.word(f"sum{k - 1}"))
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
