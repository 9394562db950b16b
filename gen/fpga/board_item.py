"""What a board has to know of what stands in it: a core, or a chain of cores."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from amaranth.lib.wiring import Component

from sosmith.gen.core import CoreDesign, refuse_decimated_channels
from sosmith.gen.output.core_facts import interface_facts
from sosmith.gen.output.verilog import core_verilog
from sosmith.gen.reload.register_writes import bank_size
from sosmith.gen.specification.specification import Specification
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port


@dataclass(frozen=True, kw_only=True)
class BoardItem:
    """What stands in a board, with one result for each sample.

    Attributes
    ----------
    name : str
        Name of its top module.
    kind : str
        One of `sosmith.gen.specification.choices.CORES`, or "chain".
    architecture : str
        Name of the architecture; of a chain, those of the stages, joined by an underscore each.
    spec : Specification
        What is asked for; of a chain, what is common to all stages.
    inputs : tuple of Port
    output : Port
    flags : dict of str to int
        Bits of the flags by their names.
    possible : tuple of int
        Bits of those that a result can have.
    cycles_per_sample, latency_cycles : int
        Clocks between samples of all channels at the highest rate, and from a sample to its result.
    fingerprint : int or None
        What the register DESIGN has; None without registers.
    words : int
        Words of a set of coefficients.
    component : callable
        Makes the component, with the members of a core, for the board's top.
    make_verilog : callable
        Makes its SystemVerilog, whose digest the board tells.
    make_modules : callable
        Makes the SystemVerilog of modules that the component takes as they are.
    """

    name: str
    kind: str
    architecture: str
    spec: Specification
    inputs: tuple[Port, ...]
    output: Port
    flags: dict[str, int]
    possible: tuple[int, ...]
    cycles_per_sample: int
    latency_cycles: int
    fingerprint: int | None
    words: int
    component: Callable[[], Component]
    make_verilog: Callable[[], str]
    make_modules: Callable[[], str] = lambda: ""

    @cached_property
    def verilog(self) -> str:
        """Its SystemVerilog, as it is generated."""
        return self.make_verilog()


def core_item(design: CoreDesign) -> BoardItem:
    """Return what a board has to know of a core.

    Raises
    ------
    SpecificationError
        If beats of the core hold several samples, or there is not a result for each sample.
    """
    _check(design)
    fingerprint = design.architecture.fingerprint
    return BoardItem(
        name=design.datapath.name,
        kind=design.core,
        architecture=design.architecture.name,
        spec=design.spec,
        inputs=tuple(design.datapath.inputs),
        output=design.datapath.output,
        flags=dict(interface_facts(design).outputs.flags),
        possible=_possible(design),
        cycles_per_sample=design.architecture.cycles_per_sample,
        latency_cycles=design.architecture.latency_cycles,
        fingerprint=fingerprint,
        words=0 if fingerprint is None else bank_size(design.architecture)[0],
        component=design.architecture.component,
        make_verilog=lambda: core_verilog(design),
    )


def item_of(design: CoreDesign | BoardItem) -> BoardItem:
    """Return an item as it is, and that of a core; errors as those of `core_item`."""
    return design if isinstance(design, BoardItem) else core_item(design)


def _possible(design: CoreDesign) -> tuple[int, ...]:
    """Bits of the flags that a result can have: with registers, any."""
    datapath = design.datapath
    if design.architecture.fingerprint is not None:
        return tuple(int(flag) for flag in Flag)
    ranges = zip(datapath.inputs, datapath.calibrated, strict=True)
    can = {
        Flag.INPUT_AT_RAIL: True,
        Flag.OUTSIDE_CALIBRATION: any((port.lowest, port.highest) != limits for port, limits in ranges),
        Flag.OUTPUT_SATURATED: True,
        Flag.WEAR_WARNING: bool(datapath.wear),
        Flag.WEAR_CRITICAL: bool(datapath.wear),
        Flag.SETTLING: datapath.settles,
        Flag.FAULT: design.spec.hardware.protect != "none",
    }
    return tuple(int(flag) for flag in Flag if can[flag])


def _check(design: CoreDesign) -> None:
    """Check that a core takes one sample at a time, and has a result for each."""
    refuse_decimated_channels(design, "on a board")
    lanes, factor = design.architecture.samples_per_clock, design.datapath.samples_per_result
    if lanes > 1:
        raise SpecificationError(
            f"{design.spec.path}: hardware.samples_per_clock must be 1 on a board, whose serial line never brings "
            f"several samples a clock, not {lanes}"
        )
    if factor > 1 and not design.architecture.hold:
        raise SpecificationError(
            f"{design.spec.path}: filter.hold must be true with filter.decimate = {factor} on a board, which "
            "returns a result for each sample, not false"
        )
