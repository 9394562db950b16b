"""What stands before the pipeline of a core with several channels: which samples it takes, and which one enters.

::

                                                          enters, unless its channel is in the first positions
    s_axis --> [input buffer] --> the sample in front -------+-------> position 0 --> [valid 1] --> [valid 2] -- ..
                      ^                                      |
                      +--------- leaves when it enters ------+

- The input buffer is a queue of two. It takes a sample when the handshake of the stream does, unless the channel does
  not exist, and none while the states are being cleared; it gives one away when that enters the pipeline.
- After a reset, and before the first sample, every word of the states is cleared, one channel at each clock.

The buffer and the copies of valid bits that a sample in front is compared with are looked for by the names that the
generator gives them; what they do is checked here, and that the comparison is enough in
`sosmith.gen.verifier.parallel.pipeline`.
"""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.gen.verifier.graph import RejectedError, require
from sosmith.gen.verifier.parallel.control import RESET, SINK, SOURCE, Buffer, Control, Entrance, Search
from sosmith.gen.verifier.parallel.equality import same_word
from sosmith.gen.verifier.parallel.netlist import Netlist
from sosmith.gen.verifier.parallel.text import Bits, Expression, Load, Statement
from sosmith.gen.verifier.program.normal_form import constant, plus

DEST = "s_axis_tdest"
_BUFFER = Buffer("input_buffer.o_valid", "input_buffer.full", "input_buffer.i_valid", "input_buffer.o_ready")


def find_channels(netlist: Netlist, channels: int) -> Control:
    """Find the control signals of a core with several channels, and check all that they do.

    Raises
    ------
    RejectedError
        If samples do not move as they must.
    """
    for name in (_BUFFER.held, _BUFFER.full, _BUFFER.coming, _BUFFER.ready, "output_buffer.full"):
        require(name in netlist.widths, f"a core with several channels must have {name}")
    search = Search(netlist, {_BUFFER.coming, _BUFFER.ready})
    held, full = search.register(search.net("m_axis_tvalid", {}), "m_axis_tvalid"), "output_buffer.full"
    chain = search.chain(held, full)
    enters = _source(netlist, chain[0])
    search = Search(netlist, {_BUFFER.coming, _BUFFER.ready, enters})
    ready = search.net("s_axis_tready", {_BUFFER.full: 0})
    clearing = search.register(search.inverted(ready), "what withholds s_axis_tready")
    word = _counter(netlist, search, clearing, channels)
    near = tuple(f"near{k}" for k in range(len(chain)) if f"near{k}" in netlist.registers)
    control = Control(
        (enters, *chain), Buffer(held, full, chain[-1], SINK), Entrance(_BUFFER, clearing, word, channels, near)
    )
    search.check_chain(control.valid, full)
    search.check_chain((enters, *near), full)
    search.check_buffer(control.output)
    search.check_buffer(_BUFFER)
    _check_acceptance(netlist, clearing, channels)
    _check_leaving(netlist, control)
    return control


def _source(netlist: Netlist, register: str) -> str:
    """Return the net that a valid bit takes over, followed back through the ports of instances."""
    found = [value for value in _loaded(netlist.registers[register].statements) if isinstance(value, Bits)]
    require(len(found) == 1, f"{register} must take over one net, not {len(found)}")
    name = found[0].name
    while True:
        drivers = netlist.drivers.get(name, [])
        if len(drivers) != 1 or not isinstance(drivers[0].value, Bits) or drivers[0].value.width is not None:
            return name
        name = drivers[0].value.name


def _loaded(statements: Sequence[Statement]) -> list[Expression]:
    found: list[Expression] = []
    for statement in statements:
        if isinstance(statement, Load):
            found.append(statement.value)
        else:
            found += [*_loaded(statement.yes), *_loaded(statement.no)]
    return found


def _counter(netlist: Netlist, search: Search, clearing: str, channels: int) -> str:
    """Check that all channels are cleared in turn; return the register that says which one."""
    first = netlist.registers[clearing].first
    require(first == 1, f"{clearing} must be 1 before the first clock, not {first}")
    search.expect(clearing, {RESET: 0}, 1)
    search.expect(clearing, {RESET: 1, clearing: 0}, 0)
    width = (channels - 1).bit_length()
    found = [
        name
        for name, register in netlist.registers.items()
        if register.width == width and name != clearing and _counts(search, name, {RESET: 1, clearing: 1}, channels)
    ]
    require(len(found) == 1, f"one register must count to {channels - 1} while {clearing} is 1, not {len(found)}")
    for k in range(channels):
        search.expect(clearing, {RESET: 1, clearing: 1, found[0]: k}, int(k < channels - 1))
    return found[0]


def _counts(search: Search, name: str, case: dict[str, int], channels: int) -> bool:
    """Whether a register begins at 0 and counts up in a case."""
    try:
        search.expect_empty(name)
        for k in range(channels - 1):
            search.expect(name, {**case, name: k}, k + 1)
    except RejectedError:
        return False
    return True


def _check_acceptance(netlist: Netlist, clearing: str, channels: int) -> None:
    """Check that the input buffer is given what the stream hands over, if its channel exists."""
    search = Search(netlist)
    for full in (0, 1):
        for busy in (0, 1):
            _, value = search.net("s_axis_tready", {_BUFFER.full: full, clearing: busy})
            require(value == constant(int(not full and not busy)), "s_axis_tready must be 0 just while nothing fits")
    _, value = search.net(_BUFFER.coming, {clearing: 1})
    require(not value, f"{_BUFFER.coming} must be 0 while states are being cleared")
    forms, value = search.net(_BUFFER.coming, {clearing: 0})
    dest = forms.variable(DEST, 0, (1 << netlist.widths[DEST]) - 1)
    exists = forms.negative(plus(dest, constant(channels), -1))
    require(
        same_word(forms, value, forms.times(forms.variable(SOURCE, 0, 1), exists), 1),
        f"{_BUFFER.coming} must be {SOURCE} for the {channels} channels that exist, and 0 for others",
    )


def _check_leaving(netlist: Netlist, control: Control) -> None:
    """Check that a sample leaves the input buffer just when it enters the pipeline."""
    search, enters, ready = Search(netlist), control.valid[0], _BUFFER.ready
    _, value = search.net(enters, {_BUFFER.held: 0})
    require(not value, f"{enters} must be 0 while the input buffer is empty")
    _, value = search.net(ready, {_BUFFER.held: 1, control.full: 1})
    require(not value, f"{ready} must be 0 while the pipeline stands")
    forms, logic = search.logic({_BUFFER.held: 1, control.full: 0})
    require(same_word(forms, logic.net(enters), logic.net(ready), 1), f"{ready} must be 1 just when {enters} is")
