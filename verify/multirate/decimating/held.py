"""How a result that is held is handed out for each of its samples: `copies` counts, and it leaves with the last one.

::

    buffer: the result at the output --> m_axis, R times: [copies] 0 .. R - 1
              ^ leaves = m_axis_tready and copies = R - 1

The output buffer is a queue for what takes a result from it whenever `leaves` says so, which the rest of the proof has
as an input.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sosmith.verify.graph import require
from sosmith.verify.multirate.decimating.entrance import by_ends
from sosmith.verify.multirate.logic import Logic, Ranges, RegisterShape
from sosmith.verify.parallel.control import SINK
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus

LEAVES = "leaves"
"""Whether the result at the output leaves, if there is one."""

_COPIES = "copies"


@dataclass(frozen=True)
class Held:
    """What counts the copies of a result: a part of the hardware.

    Attributes
    ----------
    copies : int
        Times that each result is handed out, from 2 on.
    valid : str
        The register that is 1 while there is a result at the output.
    """

    copies: int
    valid: str

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a result leaves."""
        return {LEAVES: 1}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """The count of copies."""
        return {_COPIES: RegisterShape((self.copies - 1).bit_length(), 0)}

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The count by its ends."""
        return {_COPIES: by_ends(self.copies - 1)}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        last = now.limits(_COPIES) == (self.copies - 1,) * 2
        if name == LEAVES:
            return constant(int(now.bit(SINK) and last))
        if not (now.bit(self.valid) and now.bit(SINK)):
            return now.word(name)
        return {} if last else plus(now.word(name), constant(1))


def let_out(netlist: Netlist) -> Netlist:
    """Return a netlist whose results leave when an input says so.

    Raises
    ------
    RejectedError
        If it has no net that does.
    """
    named = netlist.widths.get(LEAVES) == 1 and LEAVES in netlist.drivers
    require(named, f"a core that holds results must have a net {LEAVES}, which says when one leaves")
    return netlist.with_input(LEAVES)
