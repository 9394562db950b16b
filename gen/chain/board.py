"""A chain on a board: what its link has to know of it, and the modules that go into the FPGA."""

from __future__ import annotations

import math

from amaranth.lib.wiring import Component

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.gen.chain.shared_hardware import shared_hardware
from sosmith.gen.chain.top import chain_interface, registers_port, top_text
from sosmith.gen.output.identity import BoardItem
from sosmith.gen.output.verilog import core_verilog
from sosmith.hdl.boards.chain_core import ChainCore
from sosmith.hdl.boards.channel_holder import CLOCKS, HeldChannels
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import SpecificationError
from sosmith.model.reload.registers import ADDRESS_BITS


def chain_item(design: ChainDesign) -> BoardItem:
    """Return what a board has to know of a chain.

    Raises
    ------
    SpecificationError
        If it interpolates, or more than one stage has registers.
    """
    spec, loaded = design.spec.base, _loaded(design)
    channels, factor = spec.channels, design.factor
    if design.rise > 1:
        raise SpecificationError(
            f"{spec.path}: interpolate must be left out on a board, whose link returns one result for each sample"
        )
    first, last = design.stages[0].design.datapath, design.stages[-1].design.datapath
    face = chain_interface(design)
    in_turn = factor > 1 and channels > 1
    latency = face.latency_cycles + (CLOCKS if in_turn else 0)
    fingerprint = None if loaded is None else loaded.design.architecture.fingerprint

    def component() -> Component:
        core = ChainCore(
            design.name,
            first.inputs,
            last.output,
            channels=channels,
            factor=1 if in_turn else factor,
            registers="" if loaded is None else registers_port(loaded),
            address_bits=ADDRESS_BITS,
            lock=loaded is not None and bool(loaded.design.spec.hardware.reload_lock),
        )
        return HeldChannels(core, factor, channels) if in_turn else core

    return BoardItem(
        name=design.name,
        kind="chain",
        architecture="_".join(dict.fromkeys(stage.design.architecture.name for stage in design.stages)),
        spec=spec,
        inputs=tuple(first.inputs),
        output=last.output,
        flags=dict(face.outputs.flags),
        possible=_possible(design, loaded),
        cycles_per_sample=latency if in_turn else _cycles(design),
        latency_cycles=latency,
        fingerprint=fingerprint,
        words=0 if loaded is None else loaded.design.architecture.bank_size[0],
        component=component,
        make_verilog=lambda: top_text(design),
        make_modules=lambda: modules(design),
    )


def modules(design: ChainDesign) -> str:
    """SystemVerilog of the chain: its cores and its top, as `generate_chain` writes them."""
    return "\n".join([*(text for stage in design.stages for text in _texts(stage)), top_text(design)])


def _texts(stage: StageDesign) -> list[str]:
    if stage.shared is not None:
        return [text for name, text in shared_hardware(stage).items() if name.endswith(".sv")]
    return [core_verilog(core) for core in stage.cores]


def _loaded(design: ChainDesign) -> StageDesign | None:
    """Return the stage with registers."""
    stages = [stage for stage in design.stages if stage.design.architecture.fingerprint is not None]
    if len(stages) > 1:
        names = ", ".join(stage.spec.name for stage in stages)
        raise SpecificationError(
            f"{design.spec.base.path}: reload must be true of at most one stage on a board, whose link reaches the "
            f"registers of one core, not of {names}"
        )
    return stages[0] if stages else None


def _cycles(design: ChainDesign) -> int:
    """Clocks between samples at the highest rate: those of the slowest stage, rounded up."""
    slowest, factor = 1, 1
    for stage in design.stages:
        slowest = max(slowest, math.ceil(stage.design.architecture.clocks_per_sample / factor))
        factor *= stage.design.datapath.samples_per_result
    return slowest


def _possible(design: ChainDesign, loaded: StageDesign | None) -> tuple[int, ...]:
    """Bits of the flags that a result can have; of a core with registers, any."""
    if loaded is not None:
        return tuple(int(flag) for flag in Flag)
    can = {Flag.INPUT_AT_RAIL, Flag.OUTPUT_SATURATED}
    can |= {Flag.OUTSIDE_CALIBRATION} if design.carried_flags > 1 else set()
    can |= {Flag.SETTLING} if design.settling else set()
    can |= {Flag.FAULT} if any(stage.design.spec.hardware.protect != "none" for stage in design.stages) else set()
    return tuple(sorted(int(flag) for flag in can))
