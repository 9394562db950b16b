"""What the files of a package say about their core, collected once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.core_facts import CoreFacts, InterfaceFacts, StreamFacts, core_facts
from sosmith.gen.output.packages.vlnv import Vlnv
from sosmith.gen.output.pins import Pin, pins
from sosmith.hdl.plan.streams import Field
from sosmith.model.reload.registers import Register, registers_of


@dataclass(frozen=True, kw_only=True)
class PackageFacts:
    """A core as its package describes it.

    Attributes
    ----------
    core : CoreFacts
        Facts about the core.
    pins : tuple of Pin
        Ports of the top module.
    vlnv : Vlnv
        Its name among other cores.
    clock : Fraction
        Clock in the specification, in Hz.
    registers : tuple of Register
        Registers on its AXI4-Lite port; empty if it has none.
    """

    core: CoreFacts
    pins: tuple[Pin, ...]
    vlnv: Vlnv
    clock: Fraction
    registers: tuple[Register, ...]

    @property
    def name(self) -> str:
        """Name of the top module."""
        return self.core.name

    @property
    def interface(self) -> InterfaceFacts:
        """Streams of the core."""
        return self.core.interface

    @property
    def period(self) -> float:
        """Period of the clock in ns, rounded to ps."""
        return round(float(10**9 / self.clock), 3)

    @property
    def description(self) -> str:
        """What the core is, in one line."""
        core = self.core
        parts = [core.core, *([core.realization] if core.realization else []), core.architecture]
        if core.interface.inputs.lanes > 1:
            parts.append(f"{core.interface.inputs.lanes} samples a clock")
        if core.lower_rate is not None:
            parts.append(f"decimated by {core.lower_rate.factor}")
        inputs = ", ".join(field.port.name for field in core.interface.inputs.fields)
        (output,) = core.interface.outputs.fields
        error = f"error at most {core.error_bound:.6g} {core.unit}".strip()
        return f"{', '.join(parts)}: {inputs} to {output.port.name}, {error}"


def fields_of_beat(stream: StreamFacts) -> tuple[Field, ...]:
    """Return the fields of all samples of a beat; of several, each with the sample's number behind its name."""
    if stream.lanes == 1:
        return stream.fields
    return tuple(
        Field(replace(field.port, name=f"{field.port.name}_{lane}"), field.offset + lane * stream.sample_width)
        for lane in range(stream.lanes)
        for field in stream.fields
    )


def package_facts(design: CoreDesign, vlnv: Vlnv | None = None) -> PackageFacts:
    """Collect what a package says about a core; without `vlnv`, under the usual name."""
    facts = core_facts(design)
    registers: tuple[Register, ...] = ()
    if facts.reload is not None:
        registers = registers_of(protected=facts.protect != "none", lock=design.architecture.reload_lock)
    return PackageFacts(
        core=facts,
        pins=pins(design, facts.interface),
        vlnv=vlnv or Vlnv.default(facts.name),
        clock=design.spec.hardware.clock,
        registers=registers,
    )
