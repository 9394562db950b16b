"""Reads what stands around a core that filters at a lower rate: its decimator, what holds its results, and the wires.

The core itself, the module with the suffix ``_behind``, is a box with ports here. Which port is which is found from
what it is connected to.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from sosmith.gen.verifier.graph import RejectedError, require
from sosmith.gen.verifier.parallel.control import RESET
from sosmith.gen.verifier.parallel.netlist import Netlist, flattened
from sosmith.gen.verifier.parallel.text import Bits, Expression, Joined, Module, Number, read_modules

BEHIND, CIC, HOLDER = "behind.", "decimator.", "holder."
"""Prefixes of nets of the core's ports, of the decimator, and of what holds results."""

CLOCK = "aclk"
_UNDEFINED = re.compile(r"\b(\d+)'hx+")
_MODULE = re.compile(r"^module .*?^endmodule$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Seams:
    """Ports of the core behind, by what they are connected to.

    Attributes
    ----------
    entering : dict of str to str
        Inputs, and what each must have: the reset, the result of the decimator, its flag, and whether there is one.
    taken : str
        Output: whether a result of the decimator is taken.
    ready, valid : str
        Input and output: whether a result of the core is taken, and whether there is one.
    """

    entering: Mapping[str, str]
    taken: str
    ready: str
    valid: str


def seams_of(netlist: Netlist, *, held: bool) -> Seams:
    """Find the ports.

    Raises
    ------
    RejectedError
        If the core has others, or not all of them.
    """
    sources = {name: _source(netlist, name) for name in sorted(netlist.inlets) if name.startswith(BEHIND)}
    wanted = (CLOCK, RESET, *(CIC + name for name in ("o_data", "o_rail", "o_valid")))
    for source in wanted:
        count = list(sources.values()).count(source)
        require(count == 1, f"one port of the core must be {source}, not {count}")
    others = [name for name, source in sources.items() if source not in wanted]
    require(len(others) == 1, f"the core must have one other input, which takes its results, not {len(others)}")
    entering = {name: source for name, source in sources.items() if source in wanted[1:]}
    taken, valid = _source(netlist, CIC + "o_ready"), _source(netlist, "m_axis_tvalid")
    if held:
        valid = _source(netlist, HOLDER + "i_valid")
    for name, found in ((CIC + "o_ready", taken), ("a valid result", valid)):
        require(found.startswith(BEHIND), f"{name} must be an output of the core")
    return Seams(entering, taken, others[0], valid)


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
        If the first one has another name, or the text has anything that cannot be read.
    """
    modules = read_modules(_MODULE.sub(lambda found: _with_unknowns(found[0]), text))
    first = next(iter(modules))
    require(first == name, f"the first module must be {name}, not {first}")
    return modules


def read_around(modules: Mapping[str, Module], name: str) -> tuple[Netlist, bool]:
    """Put together everything but the core itself, and say whether results are held."""
    behind, held = f"{name}_behind", f"{name}_holder" in modules
    require(behind in modules, f"the core must have a module {behind}")
    box = Module(ports=modules[behind].ports, widths=modules[behind].widths)
    return flattened({**modules, behind: box}, CLOCK), held


def _with_unknowns(module: str) -> str:
    """Write an input that nothing drives in place of each undefined value."""
    wires: list[str] = []

    def unknown(found: re.Match[str]) -> str:
        wires.append(f"  wire [{int(found[1]) - 1}:0] \\?{len(wires)} ;\n")
        return f"\\?{len(wires) - 1} "

    head, end, rest = module.partition(";\n")
    rest = _UNDEFINED.sub(unknown, rest)
    return head + end + "".join(wires) + rest


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
