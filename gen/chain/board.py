"""A chain on a board: what its link has to know of it, and the modules that go into the FPGA."""

from __future__ import annotations

import math
from collections.abc import Sequence

from amaranth.lib.wiring import Component

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.gen.chain.rates import Rate, results_of
from sosmith.gen.chain.shared_hardware import shared_hardware
from sosmith.gen.chain.top import chain_interface, registers_port, top_text
from sosmith.gen.output.identity import BoardItem
from sosmith.gen.output.verilog import core_verilog
from sosmith.hdl.boards.chain_core import ChainCore
from sosmith.hdl.boards.channel_holder import CLOCKS, HeldChannels
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import SpecificationError
from sosmith.model.link.protocol import MAX_BODY
from sosmith.model.reload.registers import ADDRESS_BITS


def chain_item(design: ChainDesign) -> BoardItem:
    """Return what a board has to know of a chain.

    Raises
    ------
    SpecificationError
        If the link has no whole number of results for a sample, too many for a message, or those of one channel with
        samples of others, or more than one stage has registers.
    """
    spec, loaded = design.spec.base, _loaded(design)
    channels = spec.channels
    first, last = design.stages[0].design.datapath, design.stages[-1].design.datapath
    results, copies = results_and_copies(design.rates, channels, last.output.bytes, spec.path)
    face = chain_interface(design)
    in_turn = copies > 1 and channels > 1
    latency = face.latency_cycles + (CLOCKS if in_turn else 0)
    fingerprint = None if loaded is None else loaded.design.architecture.fingerprint

    def component() -> Component:
        core = ChainCore(
            design.name,
            first.inputs,
            last.output,
            channels=channels,
            factor=1 if in_turn else copies,
            registers="" if loaded is None else registers_port(loaded),
            address_bits=ADDRESS_BITS,
            lock=loaded is not None and bool(loaded.design.spec.hardware.reload_lock),
        )
        return HeldChannels(core, copies, channels) if in_turn else core

    return BoardItem(
        name=design.name,
        kind="chain",
        architecture="_".join(dict.fromkeys(stage.design.architecture.name for stage in design.stages)),
        spec=spec,
        inputs=tuple(first.inputs),
        output=last.output,
        flags=dict(face.outputs.flags),
        possible=_possible(design, loaded),
        cycles_per_sample=latency if in_turn else math.ceil(design.clocks_per_sample),
        latency_cycles=latency,
        fingerprint=fingerprint,
        words=0 if loaded is None else loaded.design.architecture.bank_size[0],
        component=component,
        make_verilog=lambda: top_text(design),
        make_modules=lambda: modules(design),
        results=results,
    )


def results_and_copies(rates: Sequence[Rate], channels: int, result_bytes: int, path: object) -> tuple[int, int]:
    """Return the results of each sample on the link, and how often the board repeats each of the chain's.

    Parameters
    ----------
    rates : sequence of Rate
        By how much each stage interpolates and decimates.
    channels : int
        Number of channels.
    result_bytes : int
        Bytes of a result, without its flags.
    path : object
        What an error begins with.

    Raises
    ------
    SpecificationError
        If there is no such number, or a message is too short.
    """
    rise, factor = math.prod(rate.rise for rate in rates), math.prod(rate.factor for rate in rates)
    if rise % factor and factor % rise:
        raise SpecificationError(
            f"{path}: interpolate and decimate must make the rate a whole multiple or a whole part on a board, whose "
            f"link returns as many results for each sample, not {rise} / {factor} of it"
        )
    if channels > 1 and any(results_of(rates, n) != -(-n * rise // factor) for n in range(factor)):
        raise SpecificationError(
            f"{path}: interpolate must not stand behind decimate on a board with several channels: a sample there "
            "brings results that leave with later samples, which may be those of another channel"
        )
    results, most = max(rise // factor, 1), (MAX_BODY - 1) // (result_bytes + 1)
    if results > most:
        raise SpecificationError(
            f"{path}: interpolate must give at most {most} results for each sample on a board, as many as fit a "
            f"message of the link, not {results}"
        )
    return results, max(factor // rise, 1)


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


def _possible(design: ChainDesign, loaded: StageDesign | None) -> tuple[int, ...]:
    """Bits of the flags that a result can have; of a core with registers, any."""
    if loaded is not None:
        return tuple(int(flag) for flag in Flag)
    can = {Flag.INPUT_AT_RAIL, Flag.OUTPUT_SATURATED}
    can |= {Flag.OUTSIDE_CALIBRATION} if design.carried_flags > 1 else set()
    can |= {Flag.SETTLING} if design.settling else set()
    can |= {Flag.FAULT} if any(stage.design.spec.hardware.protect != "none" for stage in design.stages) else set()
    return tuple(sorted(int(flag) for flag in can))
