"""What a board has to know of the core or chain of cores in it, and the identity that it tells the host."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from amaranth.lib.wiring import Component
from pydantic import ValidationError

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.core_facts import interface_facts
from sosmith.gen.output.verilog import core_verilog
from sosmith.gen.specification.specification import Specification
from sosmith.gen.version import __version__
from sosmith.hdl.boards.channel_holder import CLOCKS, HeldChannels
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import SpecificationError
from sosmith.model.link.identity import CONVERTER_FLAGS, Identity, Quantity, Reload, first_fault
from sosmith.model.link.packing import Packing
from sosmith.model.link.protocol import VERSION, results_per_second, samples_per_message
from sosmith.model.port import Port

_ROOM = 1.1
"""What of the line must be free for other requests, as a factor of what results need."""


@dataclass(frozen=True, kw_only=True)
class BoardItem:
    """What stands in a board, with one result for each sample, or with several.

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
    results : int
        Results of each sample.
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
    results: int = 1

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
    channels, factor = design.spec.channels, design.datapath.samples_per_result
    in_turn = channels > 1 and factor > 1
    latency = design.architecture.latency_cycles + (CLOCKS if in_turn else 0)

    def component() -> Component:
        core = design.architecture.component()
        return HeldChannels(core, factor, channels) if in_turn else core

    return BoardItem(
        name=design.datapath.name,
        kind=design.core,
        architecture=design.architecture.name,
        spec=design.spec,
        inputs=tuple(design.datapath.inputs),
        output=design.datapath.output,
        flags=dict(interface_facts(design).outputs.flags),
        possible=_possible(design),
        cycles_per_sample=latency if in_turn else design.architecture.cycles_per_sample,
        latency_cycles=latency,
        fingerprint=fingerprint,
        words=0 if fingerprint is None else design.architecture.bank_size[0],
        component=component,
        make_verilog=lambda: core_verilog(design),
    )


def item_of(design: CoreDesign | BoardItem) -> BoardItem:
    """Return an item as it is, and that of a core; errors as those of `core_item`."""
    return design if isinstance(design, BoardItem) else core_item(design)


def identity(
    design: CoreDesign | BoardItem,
    verilog: str,
    *,
    baud: int,
    clock: float,
    source: Literal["link", "converter"] = "link",
) -> Identity:
    """Return the identity of a board.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        What stands in it.
    verilog : str
        Its SystemVerilog, as `generated` gives it.
    baud : int
        Rate of the line, in bits per second.
    clock : float
        Clock of the core in Hz.
    source : str
        Where samples come from.

    Raises
    ------
    SpecificationError
        If beats of the core hold several samples, there is not a result for each sample, or a host would refuse the
        identity, as it does with a rate or an LSB outside the ranges of docs/protocol.md.
    """
    item = item_of(design)
    try:
        return _identity(item, verilog, baud, clock, source)
    except ValidationError as error:
        raise SpecificationError(
            f"{item.spec.path}: a board must have an identity as in docs/protocol.md, not: {first_fault(error)}"
        ) from None


def _identity(item: BoardItem, verilog: str, baud: int, clock: float, source: Literal["link", "converter"]) -> Identity:
    of_one_sample = Identity(
        protocol=VERSION,
        name=item.name,
        core=item.kind,
        sosmith=__version__,
        design=hashlib.sha256(verilog.encode()).hexdigest(),
        architecture=item.architecture,
        channels=item.spec.channels,
        sample_rate=float(item.spec.sample_rate),
        clock=float(clock),
        baud=baud,
        source=source,
        samples=1,
        inputs=tuple(_quantity(port) for port in item.inputs),
        output=_quantity(item.output),
        flags=item.flags | ({} if source == "link" else CONVERTER_FLAGS),
        reload=None if item.fingerprint is None else Reload(design=item.fingerprint, words=item.words),
        results=item.results,
    )
    of_one_sample = of_one_sample.model_copy(
        update={"samples": samples_per_message(of_one_sample.sample_bytes, item.results * of_one_sample.result_bytes)}
    )
    if item.results > 1:  # the link has no packed form of these
        return of_one_sample
    return of_one_sample.model_copy(update={"packed": _packed(item, of_one_sample)})


def _packed(item: BoardItem, identity: Identity) -> tuple[int, ...] | None:
    """Return the flags of packed results, if the line carries the sample rate with them, and not without."""
    needed = _ROOM * identity.sample_rate * identity.channels
    fault = {int(Flag.FAULT)} if identity.source == "converter" else set()
    flags = tuple(sorted({*item.possible} | fault))
    count = Packing(identity.output_port, flags).per_message(
        1 if identity.source == "converter" else identity.sample_bytes
    )
    plain, packed = (results_per_second(identity.baud, each) for each in (identity.samples, count))
    return flags if plain < needed <= packed else None


def _quantity(port: Port) -> Quantity:
    return (port.name, port.bits, port.signed, float(port.zero), float(port.lsb), port.unit)


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
    lanes, factor = design.architecture.samples_per_clock, design.datapath.samples_per_result
    if lanes > 1:
        raise SpecificationError(
            f"{design.spec.path}: hardware.samples_per_clock must be 1 on a board, whose serial line never brings "
            f"several samples a clock, not {lanes}"
        )
    if design.architecture.bank_pins is not None:
        raise SpecificationError(
            f"{design.spec.path}: hardware.reload_registers must be true on a board, not false: nothing there drives "
            "the pins at which such a core is loaded"
        )
    several = design.spec.channels > 1
    if factor > 1 and design.architecture.hold is several:
        beside = " and several channels" if several else ""
        why = "keeps the last result of each" if several else "returns a result for each sample"
        raise SpecificationError(
            f"{design.spec.path}: filter.hold must be {str(not several).lower()} with filter.decimate = {factor}"
            f"{beside} on a board, which {why}, not {str(several).lower()}"
        )
