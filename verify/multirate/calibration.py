r"""How a calibration is wired before a decimator: its first sample fills the decimator before it is accepted.

::

    s_axis_tvalid  _/~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\_
    first          ~~~~\______________________________   the sample goes into the calibration
    fills          ____/~~~~~~~~~~~~~~~~~~~~~~~~~~\____   its result is offered to the decimator
    filled         ______________________________/~\__   and has been accepted there: so is the sample

A source holds a sample until it is accepted. So the first one goes into the calibration once, and its result stays
there while the decimator fills, which takes it at each clock and accepts it at the end. From then on, each sample that
is accepted goes into the calibration, and each of its results into the decimator; with a start from zero, all do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.multirate.connections import DATA, OF_INPUT, CalibrationConnections
from sosmith.verify.multirate.logic import Field, Logic, Ranges, RegisterShape
from sosmith.verify.parallel.control import SOURCE
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus

FLAGS = tuple(f"flag {place} of the calibration" for place in range(OF_INPUT))
"""Signals: the flags of a result, the lowest first."""

CODE = "result of the calibration"
"""Signal: its code."""

CHANNEL = "channel of the calibration"
"""Signal: the channel of a result."""


def layout_of(
    netlist: Netlist, connections: CalibrationConnections, port: PortEntry, channel_bits: int = 0
) -> dict[str, list[Field]]:
    """Return what the outputs of a calibration with results, flags and channels are made of."""
    left = [Field(flag, 1) for flag in FLAGS]
    layout, low = dict[str, list[Field]](), 0
    for name in connections.code:
        count = min(netlist.widths[name], port.bits - low)
        layout[name] = [Field(CODE, count, low)]
        low += count
    for name in connections.flags or connections.code:
        count = netlist.widths[name] if connections.flags else OF_INPUT
        layout[name] = [*layout.get(name, []), *left[:count]]
        left = left[count:]
    if channel_bits:
        dest = connections.dest or connections.code[0]
        layout[dest] = [*layout.get(dest, []), Field(CHANNEL, channel_bits)]
    return layout


@dataclass(frozen=True)
class Gate:
    """What lets samples of several channels in once some clocks have passed since the reset, and has them go on.

    Attributes
    ----------
    clocks : int
        Number of these clocks, which `closed` counts down.
    width : int
        Bits of `closed`.
    ready : callable
        Whether the decimator takes what comes.
    connections : CalibrationConnections or None
        Ports of the calibration before it.
    widths : dict of str to int
        Widths of ports of the core.
    """

    clocks: int | None
    width: int
    ready: Callable[[Logic], int]
    connections: CalibrationConnections | None
    widths: Mapping[str, int]

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a sample is accepted, and what enters the calibration."""
        if self.connections is None:
            return {"s_axis_tready": 1}
        entering = {name: self.widths[source] for name, source in self.connections.entering.items()}
        return {"s_axis_tready": 1, self.connections.offered: 1, self.connections.ready: 1, **entering}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """The counter."""
        return {"closed": RegisterShape(self.width, self.clocks)}

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The counter by whether it is 0."""
        return {"closed": ((0, 0), (1, (1 << self.width) - 1))}

    def offered(self, now: Logic) -> int:
        """Whether a sample is let in."""
        return int(self._is_open(now) and now.bit(SOURCE))

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what a register or a net must be."""
        if name == "closed":
            return plus(now.word(name), constant(0 if self._is_open(now) else -1))
        if self.connections is None:
            return constant(int(self._is_open(now) and self.ready(now)))
        if name == "s_axis_tready":
            return constant(int(self._is_open(now) and now.bit(self.connections.taken)))
        if name == self.connections.offered:
            return constant(self.offered(now))
        return (
            constant(self.ready(now)) if name == self.connections.ready else now.word(self.connections.entering[name])
        )

    def _is_open(self, now: Logic) -> bool:
        return now.limits("closed") == (0, 0)


@dataclass(frozen=True)
class CalibrationPorts:
    """The ports of the calibration, and what lets samples in.

    Attributes
    ----------
    connections : CalibrationConnections
    ready : callable
        Whether the decimator takes a result.
    width : int
        Bits of `s_axis_tdata`.
    fills : bool
        Whether the first sample fills the decimator.
    """

    connections: CalibrationConnections
    ready: Callable[[Logic], int]
    width: int
    fills: bool

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a sample is accepted, and what enters the calibration."""
        entering = {name: self.width if source == DATA else 1 for name, source in self.connections.entering.items()}
        return {"s_axis_tready": 1, self.connections.offered: 1, self.connections.ready: 1, **entering}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """What is done with the first sample."""
        if not self.fills:
            return {}
        return {"first": RegisterShape(1, 1), "fills": RegisterShape(1, 0), "filled": RegisterShape(1, 0)}

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """There are bits only."""
        return {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name in self.connections.entering:
            return now.word(self.connections.entering[name])
        if name == self.connections.ready:
            return constant(self.ready(now))
        first, fills, filled = (
            (now.bit(register) for register in ("first", "fills", "filled")) if self.fills else (0, 0, 0)
        )
        flows = not (first or fills or filled)
        if name == self.connections.offered:
            return constant(int((first or flows) and now.bit(SOURCE)))
        if name == "s_axis_tready":
            return constant(int(filled or (flows and now.bit(self.connections.taken))))
        ends = fills and now.bit(self.connections.valid) and self.ready(now)
        begins = first and now.bit(SOURCE) and now.bit(self.connections.taken)
        if name == "filled":
            return constant(int(ends))
        if name == "first":
            return constant(int(first and not begins))
        return constant(int(not ends and (fills or begins)))
