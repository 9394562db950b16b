"""The pins of a core, as its component has them: what every other tool's description of it has to repeat."""

from __future__ import annotations

from dataclasses import dataclass

from amaranth.hdl import Shape
from amaranth.lib.wiring import Out

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.core_facts import InterfaceFacts, StreamFacts
from sosmith.hdl.axi_stream import core_members
from sosmith.hdl.bus.axi_lite import slave_members
from sosmith.hdl.shell.bank_pins import bank_members
from sosmith.model.reload.registers import ADDRESS_BITS
from sosmith.model.templates import in_comment

_LOADED = {
    "reload_write": "a word for the idle bank is there",
    "reload_address": "its number",
    "reload_data": "the word",
    "reload_bank": "the active bank",
    "reload_free": "no sample uses the idle bank",
    "reload_begun": "a sample that is not taken yet has chosen its bank",
    "reload_corrected": "a wrong bit was corrected",
    "reload_failed": "a wrong bit could not be corrected",
    "reload_acknowledge": "ends the flag fault",
}
"""Pins of a core whose registers are elsewhere."""


@dataclass(frozen=True, kw_only=True)
class Pin:
    """A port of the top module.

    Attributes
    ----------
    name : str
        Its name.
    width : int
        Bits.
    output : bool
        Whether the core drives it.
    meaning : str
        What it carries, in words.
    """

    name: str
    width: int
    output: bool
    meaning: str

    @property
    def bus(self) -> str:
        """The bus it belongs to, ``""`` for clock and reset."""
        return self.name.rpartition("_")[0]

    @property
    def signal(self) -> str:
        """Its name within the bus, as the AXI specification has it but in lower case."""
        return self.name.rpartition("_")[2]


def pins(design: CoreDesign, interface: InterfaceFacts) -> tuple[Pin, ...]:
    """Return the pins of a core: clock and reset, streams, registers, each bus in one piece.

    Parameters
    ----------
    design : CoreDesign
        The core.
    interface : InterfaceFacts
        Its streams.
    """
    members = core_members(
        design.datapath.inputs, design.datapath.output, design.spec.channels, lanes=interface.inputs.lanes
    )
    if (bank := design.architecture.bank_pins) is not None:
        members |= bank_members(*bank, protected=design.spec.hardware.protect != "none")
    elif design.architecture.fingerprint is not None:
        members |= slave_members(ADDRESS_BITS)
    core_pins = [
        Pin(
            name=name,
            width=Shape.cast(member.shape).width,
            output=member.flow is Out,
            meaning=_meaning(name, interface),
        )
        for name, member in members.items()
    ]
    buses = ["", "s_axis", "m_axis", "s_axil", "reload"]
    return tuple(sorted(core_pins, key=lambda pin: buses.index(pin.bus)))


def _in_lanes(stream: StreamFacts) -> list[str]:
    """Say how the samples of a beat lie on the bus, if there are several."""
    if stream.lanes == 1:
        return []
    return [f"{stream.lanes} samples of {stream.sample_width} bits, the first one lowest, each with the bits"]


def _meaning(name: str, interface: InterfaceFacts) -> str:
    if name.startswith("s_axil"):
        return "AXI4-Lite registers"
    if name in _LOADED:
        return _LOADED[name]
    if name.endswith("tdata"):
        stream = interface.inputs if name.startswith("s_") else interface.outputs
        parts = _in_lanes(stream)
        for field in stream.fields:
            port = field.port
            kind = "two's complement" if port.signed else "unsigned"
            offset = f"{float(port.zero):g} + " if port.zero else ""
            value = f"{offset}{float(port.lsb):.9g} * code {in_comment(port.unit)}".rstrip()
            parts.append(f"[{field.offset + port.bits - 1}:{field.offset}] {port.name}, {kind}, = {value}")
        return "; ".join(parts)
    if name.endswith("tuser"):
        flags = [f"[{bit}] {flag}" for flag, bit in interface.outputs.flags.items()]
        lanes = interface.outputs.lanes
        each = [f"{lanes} bytes, a status for each sample, the first one lowest, with the bits"] if lanes > 1 else []
        return "; ".join([*each, *flags])
    lanes = interface.inputs.lanes > 1
    return {
        "aclk": "clock, rising edge",
        "aresetn": "synchronous reset, active low",
        "tdest": "channel",
        "tvalid": f"a {'beat' if lanes else 'sample' if name.startswith('s_') else 'result'} is there",
        "tready": "the core takes it" if name.startswith("s_") else "the receiver takes it",
    }[name.rpartition("_")[2]]
