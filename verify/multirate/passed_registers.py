"""Checks that the register interface of a core behind a decimator is that of the whole: AXI4-Lite, signal by signal.

Each input of the core has all bits of the port with its name, and each port that leaves has those of the output with
its name. The two responses may share an output of one bit, which says that an access is refused, above a zero.
"""

from __future__ import annotations

from sosmith.verify.graph import require
from sosmith.verify.multirate.bit_logic import Bit, BitLogic
from sosmith.verify.multirate.connections import BEHIND, REGISTERS
from sosmith.verify.parallel.netlist import Netlist

_INPUTS = ("awaddr", "awprot", "awvalid", "wdata", "wstrb", "wvalid", "bready", "araddr", "arprot", "arvalid", "rready")
_RESPONSES = ("bresp", "rresp")


def check_registers(netlist: Netlist, logic: BitLogic) -> set[Bit]:
    """Check the register interface, if there is one; return the bits of the core that leave through it.

    Parameters
    ----------
    netlist : Netlist
        Everything but the core itself.
    logic : BitLogic
        Its bits.

    Raises
    ------
    RejectedError
        If a signal is anything else than that of the core.
    """
    names = {name.removeprefix(REGISTERS) for name in netlist.ports if name.startswith(REGISTERS)}
    inlets = {name for name in netlist.inlets if name.startswith(BEHIND + REGISTERS)}
    taken = {name.removeprefix(BEHIND + REGISTERS) for name in inlets}
    require(taken <= names & {*_INPUTS}, f"the register interface of the core must have inputs of the top, not {taken}")
    for name in sorted(taken):
        same = logic.net(BEHIND + REGISTERS + name) == logic.net(REGISTERS + name)
        require(same, f"{REGISTERS}{name} must go to the core as it is")
    left = set[Bit]()
    for name in sorted(names - {*_INPUTS}):
        bits, own = logic.net(REGISTERS + name), BEHIND + REGISTERS + name
        if own in netlist.widths:
            right = own not in netlist.inlets and bits == logic.net(own)
        else:
            alone = bits[1] if name in _RESPONSES and len(bits) == 2 and not bits[0] else 0
            kind, _, operands = logic.sources[alone]
            right = alone > 1 and not operands and kind.startswith(BEHIND) and netlist.widths[kind] == 1
            right = right and kind not in netlist.inlets
        require(right, f"{REGISTERS}{name} must be that of the core, not another value")
        left |= {bit for bit in bits if bit > 1}
    if {*_RESPONSES} <= names:
        one, other = (logic.net(REGISTERS + name) for name in _RESPONSES)
        require(one == other, f"{REGISTERS}rresp must refuse what {REGISTERS}bresp refuses")
    return left
