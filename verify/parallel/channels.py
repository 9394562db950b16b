"""What stands before the pipeline of a core with several channels: which samples it takes, and which one enters.

::

                                                          enters, unless its channel is in the first positions
    s_axis --> [input buffer] --> the sample in front -------+-------> position 0 --> [valid 1] --> [valid 2] -- ..
                      ^                                      |
                      +--------- leaves when it enters ------+

- The input buffer is a queue of two. It takes a sample when the handshake of the stream does, unless the channel does
  not exist, and none while the states are being cleared; it gives one away when that enters the pipeline.
- After a reset, and before the first sample, every word of the states is cleared, one channel at each clock.
- A sample in front enters as soon as none of the first positions holds one, whatever else there is: while the sink is
  ready it waits for as many clocks as there are copies of valid bits, at most.

The buffer and the copies of valid bits that a sample in front is compared with are looked for by the names that the
generator gives them; what they do is checked here, and that the comparison is enough in
`sosmith.verify.parallel.pipeline`.
"""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.control import RESET, SINK, SOURCE, Buffer, Control, Entrance, Search
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import constant, plus
from sosmith.verify.reader.syntax import Bits, Expression, Load, Statement

DEST = "s_axis_tdest"
_BUFFER = ("o_valid", "full", "i_valid", "o_ready")


def find_channels(netlist: Netlist, channels: int, prefix: str = "") -> Control:
    """Find the control signals of a core with several channels, whose nets have a prefix, and check all that they do.

    Raises
    ------
    RejectedError
        If samples do not move as they must.
    """
    buffer, full = Buffer(*(f"{prefix}input_buffer.{name}" for name in _BUFFER)), f"{prefix}output_buffer.full"
    for name in (buffer.valid, buffer.full, buffer.coming, buffer.ready, full):
        require(name in netlist.widths, f"a core with several channels must have {name}")
    search = Search(netlist, {buffer.coming, buffer.ready})
    valid = search.register(search.net("m_axis_tvalid", {}), "m_axis_tvalid")
    chain = search.chain(valid, full)
    if chain[0] == buffer.valid and len(chain) > 1:  # without states, nothing holds a sample back
        chain = chain[1:]
    enters = _source(netlist, chain[0])
    search = Search(netlist, {buffer.coming, buffer.ready, enters})
    ready = search.net("s_axis_tready", {buffer.full: 0})
    clearing = search.register(search.inverted(ready), "what withholds s_axis_tready")
    word = _counter(netlist, search, clearing, channels)
    near = tuple(name for name in (f"{prefix}near{k}" for k in range(len(chain))) if name in netlist.registers)
    control = Control(
        (enters, *chain), Buffer(valid, full, chain[-1], SINK), Entrance(buffer, clearing, word, channels, near)
    )
    search.check_chain(control.valid, full)
    search.check_chain((enters, *near), full)
    search.check_buffer(control.output)
    search.check_buffer(buffer)
    _check_acceptance(netlist, buffer, clearing, channels)
    _check_leaving(netlist, buffer, control)
    return control


def _source(netlist: Netlist, register: str) -> str:
    """Return the net that a valid bit takes over, followed back through the ports of instances up to a register."""
    loaded = [value for value in _loaded(netlist.registers[register].statements) if isinstance(value, Bits)]
    require(len(loaded) == 1, f"{register} must take over one net, not {len(loaded)}")
    name = loaded[0].name
    while True:
        drivers = netlist.drivers.get(name, [])
        if len(drivers) != 1 or not isinstance(drivers[0].value, Bits) or drivers[0].value.width is not None:
            return name
        if drivers[0].value.name in netlist.registers:
            return name
        name = drivers[0].value.name


def _loaded(statements: Sequence[Statement]) -> list[Expression]:
    values: list[Expression] = []
    for statement in statements:
        if isinstance(statement, Load):
            values.append(statement.value)
        else:
            values += [*_loaded(statement.yes), *_loaded(statement.no)]
    return values


def _counter(netlist: Netlist, search: Search, clearing: str, channels: int) -> str:
    """Check that all channels are cleared in turn; return the register that says which one."""
    first = netlist.registers[clearing].first
    require(first == 1, f"{clearing} must be 1 before the first clock, not {first}")
    search.expect(clearing, {RESET: 0}, 1)
    search.expect(clearing, {RESET: 1, clearing: 0}, 0)
    width = (channels - 1).bit_length()
    counters = [
        name
        for name, register in netlist.registers.items()
        if register.width == width and name != clearing and _counts(search, name, {RESET: 1, clearing: 1}, channels)
    ]
    require(len(counters) == 1, f"one register must count to {channels - 1} while {clearing} is 1, not {len(counters)}")
    for k in range(channels):
        search.expect(clearing, {RESET: 1, clearing: 1, counters[0]: k}, int(k < channels - 1))
    return counters[0]


def _counts(search: Search, name: str, case: dict[str, int], channels: int) -> bool:
    """Whether a register begins at 0 and counts up in a case."""
    try:
        search.expect_empty(name)
        for k in range(channels - 1):
            search.expect(name, {**case, name: k}, k + 1)
    except RejectedError:
        return False
    return True


def _check_acceptance(netlist: Netlist, buffer: Buffer, clearing: str, channels: int) -> None:
    """Check that the input buffer is given what the stream hands over, if its channel exists."""
    search = Search(netlist)
    for full in (0, 1):
        for busy in (0, 1):
            _, value = search.net("s_axis_tready", {buffer.full: full, clearing: busy})
            require(value == constant(int(not full and not busy)), "s_axis_tready must be 0 just while nothing fits")
    _, value = search.net(buffer.coming, {clearing: 1})
    require(not value, f"{buffer.coming} must be 0 while states are being cleared")
    forms, value = search.net(buffer.coming, {clearing: 0})
    dest = forms.variable(DEST, 0, (1 << netlist.widths[DEST]) - 1)
    exists = forms.negative(plus(dest, constant(channels), -1))
    require(
        same_word(forms, value, forms.times(forms.variable(SOURCE, 0, 1), exists), 1),
        f"{buffer.coming} must be {SOURCE} for the {channels} channels that exist, and 0 for others",
    )


def _check_leaving(netlist: Netlist, buffer: Buffer, control: Control) -> None:
    """Check that a sample leaves the input buffer just when it enters the pipeline."""
    search, enters, ready = Search(netlist), control.valid[0], buffer.ready
    _, value = search.net(enters, {buffer.valid: 0})
    require(not value, f"{enters} must be 0 while the input buffer is empty")
    _, value = search.net(ready, {buffer.valid: 1, control.full: 1})
    require(not value, f"{ready} must be 0 while the pipeline stands")
    forms, logic = search.logic({buffer.valid: 1, control.full: 0})
    require(same_word(forms, logic.net(enters), logic.net(ready), 1), f"{ready} must be 1 just when {enters} is")
    assert control.entrance is not None
    _, value = search.net(enters, {buffer.valid: 1, control.full: 0, **dict.fromkeys(control.entrance.near, 0)})
    require(
        value == constant(1),
        f"{enters} must be 1 for a sample in front while none of those that it may wait for is in the pipeline",
    )
