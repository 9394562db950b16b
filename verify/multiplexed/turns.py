"""Where samples are in a core whose sections take turns: its valid bits, and how far samples are apart.

::

    s_axis_tvalid --> rest = 0 ? --> [valid 1] --> [valid 2] -- .. --> [valid n] --> output buffer
                          ^
    s_axis_tready <-------+--- and not full          rest: clocks until the next sample may enter

A sample is at position k once it has moved k times. All samples move one position at each clock at which `full` is 0,
and none at others; and with each sample that enters, `rest` counts down from one less than the interval. So no two
samples are less than an interval of positions apart.

`rest` is looked for by this name; the others are found from the ports.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from sosmith.verify.graph import require
from sosmith.verify.parallel.control import RESET, SINK, SOURCE, Buffer, Search
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import ONE, constant

READY, REST = "s_axis_tready", "rest"

_MOST_REST = 1 << 10
"""Most values of `rest` that are gone through: more than any core has."""


@dataclass(frozen=True)
class Turns:
    """Where samples are.

    Attributes
    ----------
    valid : tuple of str
        For each position whether there is a sample; position 0 is the source.
    buffer : Buffer
        The output buffer, to which a sample comes from the last position.
    interval : int
        Least number of positions between two samples.
    """

    valid: tuple[str, ...]
    buffer: Buffer
    interval: int

    @property
    def names(self) -> set[str]:
        """The registers among these."""
        return {*self.valid[1:], self.buffer.valid, self.buffer.full, REST}

    def apart(self, position: int, other: int) -> bool:
        """Whether there may be a sample at another position beside the one at this."""
        return abs(position - other) >= self.interval


def turns_of(netlist: Netlist) -> Turns:
    """Find the registers that say where samples are, and check all that they do.

    Raises
    ------
    RejectedError
        If samples do not move as they must.
    """
    search = Search(netlist)
    require(REST in netlist.registers, f"the core must have a register {REST}")
    valid = search.register(search.net("m_axis_tvalid", {}), "m_axis_tvalid")
    full = search.register(search.inverted(search.net(READY, {REST: 0})), f"not {READY}")
    chain = search.chain(valid, full)
    buffer = Buffer(valid, full, chain[-1], SINK)
    search.check_chain(chain, full)
    search.expect_empty(chain[0])
    search.check_buffer(buffer)
    return Turns((SOURCE, *chain), buffer, _interval(netlist, search, chain[0], full))


def _interval(netlist: Netlist, search: Search, first: str, full: str) -> int:
    """Check when a sample enters, in every case; return how far that keeps samples apart."""
    count = 1 << netlist.widths[REST]
    require(count <= _MOST_REST, f"{REST} must have fewer bits")
    search.expect_empty(REST)
    _, begun = search.loaded(REST, {RESET: 1, full: 0, REST: 0, SOURCE: 1})
    require(not begun.keys() - {ONE}, f"{REST} must be a number after a sample has entered")
    last = int(begun.get(ONE, 0))
    for rest, stands, comes in product(range(count), (0, 1), (0, 1)):
        case = {RESET: 1, full: stands, REST: rest, SOURCE: comes}
        search.expect(REST, case, rest if stands else rest - 1 if rest else last if comes else 0)
        for own in (0, 1):
            search.expect(first, {**case, first: own}, own if stands else int(comes and not rest))
        _, ready = search.net(READY, {full: stands, REST: rest})
        require(ready == constant(int(not stands and not rest)), f"{READY} must be 1 just while a sample may enter")
    return last + 1
