"""Reads what stands around a core that filters at a lower rate: its decimator, what holds its results, and the wires.

The core itself, the module with the suffix ``_behind``, is a box with ports here, and so is a calibration, ``_ahead``.
Which port is which is found from what it is connected to, but of the handshake from its name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.control import RESET
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.reader.inlined import inlined
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Bits, Expression, Joined, Module, Number

AHEAD, BEHIND, CIC, HOLDER = "ahead.", "behind.", "decimator.", "holder."
"""Prefixes of ports of the calibration and of the core, and of nets of the decimator and of what holds results."""

OF_INPUT = 2
"""Flags of inputs: input_at_rail and outside_calibration."""

CLOCK, DATA, DEST = "aclk", "s_axis_tdata", "s_axis_tdest"

REGISTERS = "s_axil_"
"""Prefix of the ports of the register interface."""


@dataclass(frozen=True)
class CoreConnections:
    """Ports of the core behind.

    Attributes
    ----------
    entering : dict of str to str
        Inputs, and what each must have: the reset, the result of the decimator, its flags, and whether there is one.
    taken : str
        Output: whether a result of the decimator is taken.
    ready, valid : str
        Input and output: whether a result of the core is taken, and whether there is one.
    """

    entering: Mapping[str, str]
    taken: str
    ready: str
    valid: str


@dataclass(frozen=True)
class CalibrationConnections:
    """Ports of the calibration before the decimator.

    Attributes
    ----------
    entering : dict of str to str
        Inputs, and what each must have: the reset and the samples.
    offered, taken : str
        Input and output: whether there is a sample, and whether it is taken.
    ready, valid : str
        Input and output: whether a result is taken, and whether there is one.
    code : tuple of str
        Outputs: the code of a result, or its digits from the lowest on. Above a code that is in one piece there are its
        flags and its channel if there are no ports for these.
    flags : tuple of str
        Outputs with the flags, the lowest first.
    dest : str
        Output: the channel of a result; "" without one.
    """

    entering: Mapping[str, str]
    offered: str
    taken: str
    ready: str
    valid: str
    code: tuple[str, ...]
    flags: tuple[str, ...]
    dest: str


_OFFERED, _TAKEN = ("s_axis_tvalid", "i_valid"), ("s_axis_tready", "advance")
_READY, _VALID = ("m_axis_tready", "o_ready"), ("m_axis_tvalid",)


def core_connections(netlist: Netlist, flags: str, *, has_holder: bool, dest: str | None = None) -> CoreConnections:
    """Find the ports of the core behind.

    A result of the decimator has its flags in the net `flags`, and its channel in the register `dest`, if there are
    any.

    Raises
    ------
    RejectedError
        If the core has others, or not all of them.
    """
    results = (CIC + "o_data", CIC + flags, CIC + "o_valid")
    entering, others = _entering(netlist, BEHIND, (RESET, *results), () if dest is None else (dest,))
    require(len(others) == 1, f"the core must have one other input, which takes its results, not {len(others)}")
    ready = _one_of(netlist, BEHIND, _READY)
    require(others[0] == ready, f"{ready} must be an input of the core")
    taken, valid = (
        _source(netlist, CIC + "o_ready"),
        _source(netlist, HOLDER + "i_valid" if has_holder else "m_axis_tvalid"),
    )
    for name, source, wanted in ((CIC + "o_ready", taken, _TAKEN), ("a valid result", valid, _VALID)):
        require(source.startswith(BEHIND), f"{name} must be an output of the core")
        own = _one_of(netlist, BEHIND, wanted)
        require(source == own, f"{name} must be {own}, not {source}")
    return CoreConnections(entering, taken, ready, valid)


def calibration_connections(
    netlist: Netlist, box: Module | None, bits: int, channel_bits: int = 0
) -> CalibrationConnections:
    """Find the ports of the calibration, the module `box`, whose results and their channels have so many bits.

    Raises
    ------
    RejectedError
        If it has others, or not all of them.
    """
    if box is None:
        raise RejectedError("the core must have a module for the calibration before its decimator")
    entering, others = _entering(netlist, AHEAD, (RESET, DATA, *([DEST] if channel_bits else [])))
    offered, taken, ready, valid = (_one_of(netlist, AHEAD, names) for names in (_OFFERED, _TAKEN, _READY, _VALID))
    require(
        sorted(others) == sorted((offered, ready)), f"the other inputs of the calibration must be {offered}, {ready}"
    )
    outlets = {name for name in netlist.widths if name.startswith(AHEAD)} - netlist.inlets
    outlets -= {taken, valid}
    flags = tuple(AHEAD + name for name in ("m_axis_tuser", "rail", "outside") if AHEAD + name in outlets)
    dest = AHEAD + "channel" if AHEAD + "channel" in outlets else ""
    outlets -= {*flags, dest}
    code = tuple(sorted(outlets)) if len(outlets) == 1 else _digits(box, sorted(outlets), bits)
    count = sum(netlist.widths[name] for name in code)
    beside = count, sum(netlist.widths[name] for name in flags), netlist.widths.get(dest, 0)
    whole = (bits + OF_INPUT + channel_bits, 0, 0), (bits, OF_INPUT, channel_bits)
    named = " and ".join(code)
    require(beside in whole[len(code) > 1 :], f"{named} must have {bits} bits, and {OF_INPUT} flags beside it")
    return CalibrationConnections(entering, offered, taken, ready, valid, code, flags, dest)


def _digits(box: Module, outlets: Sequence[str], bits: int) -> tuple[str, ...]:
    """Return the outputs of a calibration in the order of the digits of its result, of which they have all bits.

    A digit is what a register has that is called ``given`` with its number, from its lowest bit on.
    """
    digits: dict[int, tuple[str, int]] = {}
    for outlet in outlets:
        name = outlet.removeprefix(AHEAD)
        driven = [value for target, value in box.assigns if target == Bits(name)]
        source = Bits(name) if name in box.registers and not driven else next(iter(driven), None)
        digit = (
            re.fullmatch(r"given(0|[1-9]\d*)", source.name) if isinstance(source, Bits) and len(driven) < 2 else None
        )
        right = digit is not None and isinstance(source, Bits) and source.low == 0 and source.name in box.registers
        require(right, f"{outlet} must be a digit of the result, as there are {len(outlets)} outputs for it")
        assert digit is not None
        digits[int(digit[1])] = outlet, box.widths[name]
    places = range(len(outlets))
    require(digits.keys() == {*places}, f"the digits of the calibration must be 0..{len(outlets) - 1}, each once")
    below = [box.widths[f"given{place}"] == digits[place][1] for place in places[:-1]]
    whole = all(below) and sum(width for _, width in digits.values()) == bits
    require(whole, f"the digits of the calibration must have {bits} bits in all, and all of each but for the last")
    return tuple(digits[place][0] for place in places)


def _entering(
    netlist: Netlist, prefix: str, whole: Sequence[str], extended: Sequence[str] = ()
) -> tuple[dict[str, str], list[str]]:
    """Return the inputs of a core that have one of some nets, in all their bits or extended; and those without."""
    wanted = (*whole, *extended)
    own = sorted(name for name in netlist.inlets if name.startswith(prefix))
    sources = {name: _source(netlist, name) for name in own if not name.startswith(prefix + REGISTERS)}
    for source in (CLOCK, *wanted):
        names = [name for name, net in sources.items() if net == source]
        require(len(names) == 1, f"one port of the core must be {source}, not {len(names)}")
        bits, other = netlist.widths[names[0]], netlist.widths[source]
        require(bits == other or source in extended, f"{names[0]} must have {other} bits, as {source} has, not {bits}")
    entering = {name: source for name, source in sources.items() if source in wanted}
    return entering, [name for name, source in sources.items() if source not in {CLOCK, *wanted}]


def _one_of(netlist: Netlist, prefix: str, names: Sequence[str]) -> str:
    """Return the one port of a core that has one of these names."""
    ports = sorted(name for name in netlist.widths if name.startswith(prefix))
    matches = [name for name in ports if re.sub(r"_\d+$", "", name.removeprefix(prefix)) in names]
    require(len(matches) == 1, f"one port of the core must be {' or '.join(names)}, not {len(matches)}")
    return matches[0]


def _source(netlist: Netlist, name: str) -> str:
    """Return the only register, input or output of the core of which a net has bits; "" if there is no such one."""
    try:
        names = set(passed_on(netlist, Bits(name)))
    except RejectedError:
        return ""
    return names.pop() if len(names) == 1 else ""


def read_core(text: str, name: str) -> dict[str, Module]:
    """Read all modules of a core, the top first.

    Raises
    ------
    RejectedError
        If there is no such module, or the text has anything that cannot be read.
    """
    source = read_source(text, name)
    inner = {f"{name}_behind", f"{name}_ahead"} & source.modules.keys()
    return {**source.modules, **{inside: inlined(source, inside).modules[inside] for inside in sorted(inner)}}


def read_shell(modules: Mapping[str, Module], name: str) -> Netlist:
    """Put together everything but the core itself, and the calibration before the decimator."""
    boxes = {}
    for inside in (f"{name}_behind", f"{name}_ahead"):
        if inside in modules:
            ports = modules[inside].ports
            boxes[inside] = Module(ports=ports, widths={port: modules[inside].widths[port] for port in ports})
    require(f"{name}_behind" in boxes, f"the core must have a module {name}_behind")
    return flattened({**modules, **boxes}, CLOCK)


def passed_on(netlist: Netlist, value: Expression) -> Iterator[str]:
    """Yield the registers, inputs and outputs of the core of which an expression has bits as they are.

    Raises
    ------
    RejectedError
        If it is computed from them.
    """
    require(isinstance(value, Bits | Joined | Number), "what is passed on must not be computed")
    if isinstance(value, Joined):
        for part in value.parts:
            yield from passed_on(netlist, part)
    elif isinstance(value, Bits):
        drivers = netlist.drivers.get(value.name)
        if drivers is None:
            yield value.name
        for driver in drivers or []:
            yield from passed_on(netlist, driver.value)
