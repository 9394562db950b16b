"""The module of registers that several cores share, as SystemVerilog, and the pins of the cores that it drives."""

from __future__ import annotations

from collections.abc import Mapping

from amaranth.hdl import Shape
from amaranth.lib.wiring import Out

from sosmith.gen.chain.joints.registers import RegistersUnit
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.shared_registers import SharedRegisters
from sosmith.hdl.shell.bank_pins import bank_members

SHARED = ("reload_bank", "reload_acknowledge")
"""Pins that are the same for all cores."""


def registers_text(unit: RegistersUnit) -> str:
    """SystemVerilog of the module, and of those inside it."""
    core = SharedRegisters(unit.banks, design=unit.design, protected=unit.protected, lock=unit.lock)
    return to_verilog(to_rtlil(core, unit.name))


def pins_of(unit: RegistersUnit, k: int) -> list[tuple[str, str, int]]:
    """Direction, name and width of the pins of core `k`."""
    members = bank_members(*unit.banks[k], protected=unit.protected).items()
    return [
        ("output" if member.flow is Out else "input", name, Shape.cast(member.shape).width) for name, member in members
    ]


def nets_of(unit: RegistersUnit, net: str, k: int) -> Mapping[str, str]:
    """Return the nets at the pins of a core, in a top where the stage's is `net`."""
    return {name: f"{net}_{name}" if name in SHARED else f"{net}_p{k}_{name}" for _, name, _ in pins_of(unit, k)}
