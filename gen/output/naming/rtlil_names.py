r"""One name for each net of an RTLIL text: no second ones, and for a port without any that of the net outside.

::

    module \top                                          module \top_buffer
      wire width 2 \status                                 wire width 2 input 3 \port$207$0     becomes \status
      wire width 2 \o_status                               ..
      cell \top_buffer \buffer
        connect \port$207$0 \status [1:0]
      connect \o_status \status [1:0]        is left out: Yosys would take whichever name comes first in the alphabet

A port has no name of its own where a part of a word comes from somewhere else than the rest. Ports of a module are
named after those of the modules above it, or else after what drives or takes them inside.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial

_MODULE = re.compile(r"^module \\(?P<name>\S+)\n.*?^end\n", re.MULTILINE | re.DOTALL)
_CELL = re.compile(r"^  cell \\(?P<module>\S+) \\\S+\n(?P<ports>.*?)^  end\n", re.MULTILINE | re.DOTALL)
_NAMELESS = r"port\$\d+\$\d+|\w+_(?:read|write)_(?:address|data|enable)"
"""Ports without a name of their own, or with that of what a memory inside has there."""
_PORT = re.compile(
    rf"^    connect \\(?P<port>{_NAMELESS}) \\(?P<net>\S+) \[(?P<high>\d+)(?::(?P<low>\d+))?\]$", re.MULTILINE
)
_WIRE = re.compile(
    r"^  wire width (?P<width>\d+)(?: (?:input|output|inout) \d+)? +(?:signed +)?\\(?P<name>\S+)$", re.MULTILINE
)

_DRIVEN = re.compile(
    r"^connect \\(?P<port>port\$\d+\$\d+) \\(?P<net>\S+) \[(?P<high>\d+)(?::(?P<low>\d+))?\]$", re.MULTILINE
)
_OUT = re.compile(r"^connect \\(?P<port>port\$\d+\$\d+) (?P<wire>\$\d+ \[[\d:]+\])$", re.MULTILINE)
_INSIDE = re.compile(r"^    connect \\(?P<net>\S+) (?P<wire>\$\d+ \[[\d:]+\])$", re.MULTILINE)
_PLAIN = re.compile(
    r"^(?P<said>  attribute .*\n)?(?P<wire>  wire width [1-9]\d* (?:signed )?\\[A-Za-z_]\w*\n)", re.MULTILINE
)
"""Wires with names of their own, and the attribute of those that have one, as registers do."""
_UNKEPT = re.compile(
    r"(?:^  attribute \\init .*\n)?(?<!^  attribute \\keep 1\n)^  wire width \d+ (?:signed )?\\(?P<name>\S+)\n\n?",
    re.MULTILINE,
)
_OF_MEMORY = re.compile(r"_(?:read|write)_(?:address|data|enable)$")
"""What goes to a port of a memory, or comes from it: the name of what drives it says more."""
_SECOND = re.compile(r"^connect \\(?P<name>\S+) \\(?P<net>\S+) \[(?P<high>\d+)(?::0)?\]\n", re.MULTILINE)


def without_second_names(text: str) -> str:
    """Leave out the wires in an RTLIL text that are others as a whole; one that has to be kept stays."""
    return _MODULE.sub(lambda module: _with_first_names(module[0]), text)


def _with_first_names(module: str) -> str:
    widths = {wire["name"]: int(wire["width"]) for wire in _WIRE.finditer(module)}
    unkept = {wire["name"] for wire in _UNKEPT.finditer(module)}
    seconds: dict[str, list[str]] = {}
    for match in _SECOND.finditer(module):
        name, net = match["name"], match["net"]
        if name in unkept and widths[name] == widths[net] == int(match["high"]) + 1:
            seconds.setdefault(net, []).append(name)
    better = {}
    for net, names in seconds.items():
        others = [name for name in names if not _OF_MEMORY.search(name)]
        if net in unkept and others and _OF_MEMORY.search(net):
            better[net] = others[0]
    left = {name for names in seconds.values() for name in names}
    for lines in (_UNKEPT, _SECOND):
        module = lines.sub(lambda match: "" if match["name"] in left else match[0], module)
    return re.sub(r"(?<=\\)\S+", lambda match: better.get(match[0], match[0]), module) if better else module


def with_kept_names(text: str) -> str:
    """Let synthesis keep the wires in an RTLIL text that have names: those that are no ports and no registers."""
    return _PLAIN.sub(lambda match: match[0] if match["said"] else f"  attribute \\keep 1\n{match['wire']}", text)


def with_named_ports(text: str) -> str:
    """Name the ports in an RTLIL text after the nets that they are connected to, as far as these have names."""
    modules = {module["name"]: module[0] for module in _MODULE.finditer(text)}
    for name in reversed(_from_below(modules)):
        widths = {wire["name"]: int(wire["width"]) for wire in _WIRE.finditer(modules[name])}
        for cell in _CELL.finditer(modules[name]):
            inside = cell["module"]
            if inside not in modules:
                continue
            taken = {wire["name"] for wire in _WIRE.finditer(modules[inside])}
            names = _named(_PORT.finditer(cell["ports"]), widths, taken)
            names = _named(_DRIVEN.finditer(modules[inside]), {}, taken) | names
            if "\\port$" in modules[inside]:
                names = _passed_on(modules[inside], taken) | names
            if names:
                renamed = partial(_renamed, names)
                # Ports of the cells in it are those of other modules, also where they are called the same.
                own = r"(?<!^    connect \\)(?<=\\)\S+"
                modules[inside] = re.sub(own, renamed, modules[inside], flags=re.MULTILINE)
                connected = re.sub(r"(?<=^    connect \\)\S+", renamed, cell[0], flags=re.MULTILINE)
                modules[name] = modules[name].replace(cell[0], connected)
    return _MODULE.sub(lambda module: modules[module["name"]], text)


def _from_below(modules: dict[str, str]) -> list[str]:
    """Return the modules, each behind all that are in it."""
    order: dict[str, None] = {}

    def place(name: str) -> None:
        for cell in _CELL.finditer(modules[name]):
            if cell["module"] in modules and cell["module"] not in order:
                place(cell["module"])
        order[name] = None

    for name in modules:
        if name not in order:
            place(name)
    return list(order)


def _named(ports: Iterator[re.Match[str]], widths: dict[str, int], taken: set[str]) -> dict[str, str]:
    """Return names for ports that have none; a port of some bits of a net has their numbers in its name."""
    names: dict[str, str] = {}
    for port in ports:
        name, high, low = port["net"], port["high"], port["low"]
        if int(high) - int(low or high) + 1 != widths.get(name):
            name = "_".join(filter(None, (name, high, low)))
        if "$" not in name and name not in taken and port["port"] not in names:
            taken.add(name)
            names[port["port"]] = name
    return names


def _passed_on(module: str, taken: set[str]) -> dict[str, str]:
    """Return names for ports that are those of modules inside, which no net with a name lies between."""
    inside = {match["wire"]: match["net"] for match in _INSIDE.finditer(module)}
    names: dict[str, str] = {}
    for port in _OUT.finditer(module):
        name = inside.get(port["wire"], "$")
        if "$" not in name and name not in taken:
            taken.add(name)
            names[port["port"]] = name
    return names


def _renamed(names: dict[str, str], match: re.Match[str]) -> str:
    return names.get(match[0], match[0])
