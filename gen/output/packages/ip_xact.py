"""The component of IP-XACT (IEEE 1685-2014): ports, buses, registers and files."""

from __future__ import annotations

from typing import NamedTuple

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.reload.registers import BITS, DESIGN, ID, INTERFACE, LAYOUT, MAGIC
from sosmith.model.templates import render


class _Bus(NamedTuple):
    """A bus interface: its name, role, and the name and version of its definition in ARM's library."""

    name: str
    role: str
    type: str
    version: str


_BUSES = (
    _Bus("s_axis", "slave", "AXI4Stream", "r0p0_1"),
    _Bus("m_axis", "master", "AXI4Stream", "r0p0_1"),
    _Bus("s_axil", "slave", "AXI4-Lite", "r0p0_0"),
)


def ip_xact_files(facts: PackageFacts) -> dict[str, str]:
    """Return the component by its path in the package; its bus definitions are those of ARM, which it names."""
    present = {pin.bus for pin in facts.pins}
    constants: dict[str, int] = {}
    if facts.core.reload is not None:
        layout = INTERFACE << LAYOUT.field("INTERFACE").low | facts.core.reload.words << LAYOUT.field("WORDS").low
        constants = {ID.name: MAGIC, LAYOUT.name: layout, DESIGN.name: facts.core.reload.design}
    text = render(
        __package__,
        "ip_xact.xml.jinja",
        name=facts.name,
        vlnv=facts.vlnv,
        description=facts.description,
        buses=[bus for bus in _BUSES if bus.name in present],
        pins=facts.pins,
        registers=facts.registers,
        constants=constants,
        bits=BITS,
        range=4 * len(facts.registers),
    )
    return {f"ip_xact/{facts.name}.xml": text}
