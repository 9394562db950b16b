"""Proves that the bits above a result repeat its sign, or are 0, at every clock: bit by bit, through all modules.

Two bits are the same if they are the same logic of the same bits. If they are bits of registers, they must be the same
before the first clock, and what each of them takes over at a clock must be the same, provided that they are now: this
is induction over the clocks. If both are choices by the same bit, what is chosen from must be the same on either side::

    m_axis_tdata[11] == m_axis_tdata[10]
      register o_data[11] == o_data[10]                 both 0 before the first clock
        at a clock: full ? o_next[11] : code[10]  ==  full ? o_next[10] : code[10]
          register o_next[11] == o_next[10]             ..

Whatever else there is in the core may hold anything.
"""

from __future__ import annotations

from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.graph import require
from sosmith.verify.multirate.bit_logic import Bit, BitLogic
from sosmith.verify.parallel.netlist import flattened
from sosmith.verify.reader.syntax import Module

_OUTPUT = "m_axis_tdata"


def check_signs(modules: dict[str, Module], port: PortEntry, clock: str) -> None:
    """Prove that what `m_axis_tdata` has above the bits of a result is its sign again, or 0.

    Parameters
    ----------
    modules : dict of str to Module
        All modules of the core, the top first.
    port : PortEntry
        The output.
    clock : str
        The clock of all registers.

    Raises
    ------
    RejectedError
        If a bit is another one, or this is not found.
    """
    netlist = flattened(modules, clock)
    logic = BitLogic(netlist)
    width = netlist.widths[_OUTPUT]
    wanted = -(-port.bits // 8) * 8
    require(width == wanted, f"{_OUTPUT} must have {wanted} bits, not {width}")
    bits, sign = logic.net(_OUTPUT), port.bits - 1
    for place in range(port.bits, width):
        what = f"the sign, bit {sign}," if port.signed else "0"
        same = _same(logic, bits[place], bits[sign] if port.signed else 0)
        require(same, f"bit {place} of {_OUTPUT} must be {what} at every clock, not another value")


def _same(logic: BitLogic, a: Bit, b: Bit) -> bool:
    """Whether two bits are proven to be the same at every clock; the second may be a constant."""
    taken: set[tuple[Bit, Bit]] = set()
    goals = [(a, b)]
    while goals:
        a, b = pair = goals.pop()
        if a == b or pair in taken:
            continue
        source, other = logic.sources[a], logic.sources[b]
        if source.kind == "?" and (b < 2 or (other.kind == "?" and source.operands[0] == other.operands[0])):
            sides = [(b,), (b,)] if b < 2 else other.operands[1:]
            goals += [(x, y) for (x,), (y,) in zip(source.operands[1:], sides, strict=True)]
            continue
        first = b if b < 2 else logic.first(b)
        if first is None or logic.first(a) != first:
            return False
        taken.add(pair)
        goals.append((logic.after(a), b if b < 2 else logic.after(b)))
    return True
