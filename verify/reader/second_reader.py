"""Compares what this reader sees in a text with what an outside front end does, register by register and bit by bit.

Both are taken apart into the same gates, module by module. Registers, memories, ports and instances are compared by
their names, and what each holds next, or is given, by its literals: equal literals are equal functions. Two functions
that are equal for another reason are taken for different ones, and the text is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from sosmith.verify.graph import require
from sosmith.verify.reader.gates import Gates
from sosmith.verify.reader.logic import Logic, logic_of
from sosmith.verify.reader.outside import modules_outside
from sosmith.verify.reader.recursion import deep_recursion
from sosmith.verify.reader.syntax import Module


class Readings(NamedTuple):
    """What was compared: how many modules, bits of registers, and words of memories."""

    modules: int
    register_bits: int
    words: int


def compare_readings(modules: Mapping[str, Module], netlist: str) -> Readings:
    """Compare modules that were read with the netlist of another front end, in the JSON format of Yosys.

    Raises
    ------
    RejectedError
        For the first difference.
    """
    gates = Gates()
    with deep_recursion():
        directions = {name: module.ports for name, module in modules.items()}
        own = {name: logic_of(module, directions, gates) for name, module in modules.items()}
        other = modules_outside(netlist, {name: module.registers for name, module in modules.items()}, gates)
    require(
        own.keys() == other.keys(),
        f"the second reader must see the modules {', '.join(sorted(own))}, not {', '.join(sorted(other))}",
    )
    for name, logic in own.items():
        _compare(name, logic, other[name])
    bits = sum(len(register.next) for logic in own.values() for register in logic.registers.values())
    words = sum(len(memory.first) for logic in own.values() for memory in logic.memories.values())
    return Readings(len(own), bits, words)


def _compare(module: str, own: Logic, other: Logic) -> None:
    for kind, mine, others in (
        ("port", own.ports, other.ports),
        ("register", own.registers, other.registers),
        ("memory", own.memories, other.memories),
        ("instance", own.instances, other.instances),
        ("input", own.given, other.given),
        ("output", own.outputs, other.outputs),
    ):
        odd = sorted(mine.keys() ^ others.keys())
        require(not odd, f"the second reader must see every {kind} of {module} alike, not {', '.join(odd[:3])}")
        for name, value in mine.items():
            same = value == others[name]
            require(same, f"the second reader must see the {kind} {name} of {module} alike, not as another one")
    clocks = own.clocks == other.clocks
    require(clocks, f"the second reader must see the clock of {module} alike, not {', '.join(sorted(other.clocks))}")
