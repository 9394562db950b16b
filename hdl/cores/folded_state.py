"""What the parts of a folded core tell each other: what it is doing, where it is in its program, and wrong bits."""

from __future__ import annotations

from typing import NamedTuple

from amaranth.hdl import Module, Signal, Value

from sosmith.hdl.reload import ReloadPort
from sosmith.hdl.shell.bank_pins import BankPins

NO_COLLISIONS = {"no_rw_check": 1}
"""Attribute of memories: no word is used that is read at the clock at which it is written.

`STORED` and `MOVED` keep the program from doing so, and a bank of the program is not written while it is read. At such
a clock a simulator reads the old word and a block RAM anything; without the attribute, Yosys adds registers and a
comparator to make both equal.
"""


class Control:
    """What a core is doing.

    Attributes
    ----------
    advance : Signal
        Whether the pipeline moves at this clock.
    clearing : Signal
        Whether words are cleared.
    start : Signal
        Whether a sample has been found.
    busy : Signal
        Whether one is in work.
    channel : Signal
        Channel of the sample in work, or of the word that is cleared.
    dropped : Signal
        Whether a sample of a channel that does not exist is accepted.
    leaves : Signal
        Whether the result leaves.
    """

    def __init__(self, channel_bits: int) -> None:
        self.advance = Signal(name="advance")
        self.clearing = Signal(name="clearing", init=1)
        self.start = Signal(name="start")
        self.busy = Signal(name="busy")
        self.channel = Signal(channel_bits, name="channel")
        self.dropped = Signal(name="dropped")
        self.leaves = Signal(name="leaves")


class Position(NamedTuple):
    """Where the core is in its program: the address of an instruction, and whether it is read for a sample."""

    counter: Signal
    fetches: Signal


class Reload(NamedTuple):
    """The reload port, and the bank that the sample in work uses."""

    port: ReloadPort | BankPins
    bank: Signal


def fault_nets(m: Module, memory: str, corrected: Value, failed: Value) -> tuple[Value, Value]:
    """Return whether a wrong bit was corrected, and whether one could not be, as nets that say in which memory."""
    nets = Signal(name=f"{memory}_corrected"), Signal(name=f"{memory}_failed")
    m.d.comb += [net.eq(value) for net, value in zip(nets, (corrected, failed), strict=True)]
    return nets
