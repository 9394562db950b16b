"""VHDL: a component declaration of the core, and an instance of it with its fields as signals."""

from __future__ import annotations

import re

from sosmith.gen.output.packages.facts import PackageFacts, fields_of_beat
from sosmith.model.templates import render

_WORDS = """
    abs access after alias all and architecture array assert assume assume_guarantee attribute begin block body
    buffer bus case component configuration constant context cover default disconnect downto else elsif end entity
    exit fairness file for force function generate generic group guarded if impure in inertial inout is label
    library linkage literal loop map mod nand new next nor not null of on open or others out package parameter
    port postponed procedure process property protected pure range record register reject release rem report
    restrict restrict_guarantee return rol ror select sequence severity shared signal sla sll sra srl strong
    subtype then to transport type unaffected units until use variable vmode vprop vunit wait when while with xnor
    xor
"""
_RESERVED = frozenset(_WORDS.split())
"""Reserved words of VHDL-2008."""

_PLAIN = re.compile(r"[a-z](_?[a-z0-9])*", re.IGNORECASE)


def vhdl_name(name: str) -> str:
    """Return a name as VHDL takes it: an extended identifier where it is none of the basic ones."""
    return name if _PLAIN.fullmatch(name) and name.lower() not in _RESERVED else f"\\{name}\\"


def vhdl_files(facts: PackageFacts) -> dict[str, str]:
    """Return the package with the component and the instance, by their paths in the package."""
    name = facts.name
    values = {
        "name": name,
        "component": vhdl_name(name),
        "library": vhdl_name(f"{name}_package"),
        "entity": vhdl_name(f"{name}_instance"),
        "pins": facts.pins,
        "inputs": [(vhdl_name(f"{field.port.name}_code"), field) for field in fields_of_beat(facts.interface.inputs)],
        "outputs": [(vhdl_name(f"{field.port.name}_code"), field) for field in fields_of_beat(facts.interface.outputs)],
        "dest": facts.interface.inputs.dest_width,
        "width": facts.interface.inputs.width,
    }
    return {
        f"vhdl/{name}_package.vhd": render(__package__, "component.vhd.jinja", **values),
        f"vhdl/{name}_instance.vhd": render(__package__, "instance.vhd.jinja", **values),
    }
