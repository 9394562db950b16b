"""Checks that everything that leaves a core behind a decimator leaves, once: results, flags, and the channel.

Which flag an output of the core is, is not known here, but for the first two by their names: then each of them leaves
at its place, and of all others each at one place, without a gap; those of one output in their order. `settling` has a
place of its own behind them, where it is claimed. Above there are zeros.
"""

from __future__ import annotations

from itertools import pairwise

from sosmith.verify.graph import require
from sosmith.verify.multirate.bit_logic import Bit, BitLogic
from sosmith.verify.multirate.connections import BEHIND, CoreConnections
from sosmith.verify.multirate.passed_registers import check_registers
from sosmith.verify.parallel.netlist import Netlist

_LEAVING = _, _FLAGS, _DEST = "m_axis_tdata", "m_axis_tuser", "m_axis_tdest"
_MOST = 8
_SETTLING = 5
_PLACES = {"rail": 0, "outside": 1, "judged": 0, "m_axis_tuser": 0}


def check_passed(
    netlist: Netlist, connections: CoreConnections, word: str, channel_bits: int = 0, *, settles: bool = False
) -> None:
    """Check what leaves, at once or through the register that holds results.

    Parameters
    ----------
    netlist : Netlist
        Everything but the core itself.
    connections : CoreConnections
        Its ports.
    word : str
        The register; "" if results leave at once.
    channel_bits : int
        Bits of a channel, above which there are zeros; 0 without one.
    settles : bool
        Whether there is a flag that says whether a filter has settled.

    Raises
    ------
    RejectedError
        If a bit of an output of the core is lost, or comes where a flag must not be.
    """
    logic, left = origins(netlist, word)
    whole = left[_FLAGS]
    require(len(whole) == _MOST, f"{_FLAGS} must have {_MOST} bits, not {len(whole)}")
    count = sum(1 for bit in whole[:_SETTLING] if bit)
    flags = whole[:count] + ([whole[_SETTLING]] if settles else [])
    others = whole[count:_SETTLING] + whole[_SETTLING + settles :]
    require(
        count > 0 and all(flags) and not any(others) and len({*flags}) == len(flags),
        f"{_FLAGS} must have its flags from bit 0 on, each once, {'settling as claimed, ' * settles}and zeros above",
    )
    for place, bit in zip([*range(count), _SETTLING], flags, strict=False):
        name = logic.sources[bit].kind
        own = (
            name.startswith(BEHIND)
            and not logic.sources[bit].operands
            and name not in {connections.taken, connections.valid}
        )
        first = _PLACES.get(name.removeprefix(BEHIND))
        right = own and (place == _SETTLING or first is None or place == first + logic.sources[bit].place)
        require(right, f"bit {place} of {_FLAGS} must be its flag as the core gives it, not another value")
    dest = left.get(_DEST, [])
    channel = dest[:channel_bits]
    require(not any(dest[channel_bits:]), f"{_DEST} must be the channel, and zeros above")
    for bit, above in pairwise(flags + channel):
        one, other = logic.sources[bit], logic.sources[above]
        require(one.kind != other.kind or one.place + 1 == other.place, f"{_FLAGS} must have the flags in their order")
    if channel:
        names = {logic.sources[bit].kind for bit in channel}
        apart = logic.sources[flags[0]].kind not in names
        own = names == {BEHIND + "channel"} and logic.sources[channel[0]].place == 0 if apart else len(names) == 1
        require(own, f"{_DEST} must be the channel as the core gives it, not another value")
    elsewhere = {bit for name, bits in left.items() if name != _FLAGS for bit in bits}
    require(elsewhere.isdisjoint(flags), f"{_FLAGS} must have no bit that leaves elsewhere")
    passed = elsewhere | {*flags} | check_registers(netlist, logic)
    for name in sorted(netlist.widths):
        if name.startswith(BEHIND) and name not in netlist.inlets | {connections.taken, connections.valid}:
            lost = [place for place, bit in enumerate(logic.net(name)) if bit not in passed]
            require(not lost, f"bit {lost[0] if lost else 0} of {name} must leave the core")


def origins(netlist: Netlist, word: str) -> tuple[BitLogic, dict[str, list[Bit]]]:
    """Return where the bits of each port that leaves come from: what they are, or what the register `word` takes over.

    Raises
    ------
    RejectedError
        If the register does not take over all of them under the same condition.
    """
    logic = BitLogic(netlist)
    left = {name: [_origin(logic, bit, word) for bit in logic.net(name)] for name in _LEAVING if name in netlist.ports}
    if word:
        taken = {logic.sources[logic.after(bit)].operands[0] for name in left for bit in logic.net(name) if bit}
        require(len(taken) == 1, f"{word} must take over all of a result at once")
    return logic, left


def _origin(logic: BitLogic, bit: Bit, word: str) -> Bit:
    """Return what a bit is, or what the register takes over there; 0 is 0 always."""
    if not word or not bit:
        return bit
    own = logic.sources[bit].kind == word and not logic.sources[bit].operands
    require(own, f"what leaves must be 0 or a bit of {word}, not one of {logic.sources[bit].kind or bit}")
    kind, _, operands = logic.sources[logic.after(bit)]
    require(kind == "?" and operands[2] == (bit,), f"{word} must take over results, or hold one")
    return operands[1][0]
