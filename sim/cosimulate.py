"""Runs input codes through a core on a bench and returns its output codes."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sosmith.gen.output.core_facts import InterfaceFacts
from sosmith.model.arrays import Codes
from sosmith.model.errors import ShortfallError
from sosmith.sim.bench import Bench, Progress
from sosmith.sim.stream_packing import completing, each_once, following, pack, random_order, unpack


@dataclass(frozen=True, kw_only=True)
class CosimulationResult:
    """Outputs of the hardware.

    Attributes
    ----------
    codes : int64 array, shape (results, channels, outputs)
        Output codes.
    status : uint8 array, shape (results, channels)
        Status of the outputs, 0 if the core has none.
    cycles : int
        Clocks from the end of reset to the last sample received.
    wall_seconds : float
        Duration of build and run.
    cycles_per_second : float
        Speed of these clocks, without resets and start-up, in processor time.
    simulator : str
        Name of the bench.
    tools : mapping of str to str
        Versions of the tools that ran the core, by name.
    """

    codes: Codes
    status: npt.NDArray[np.uint8]
    cycles: int
    wall_seconds: float
    cycles_per_second: float
    simulator: str
    tools: Mapping[str, str]


def first_copies(result: CosimulationResult, copies: int) -> CosimulationResult:
    """Return a run whose results came `copies` times, one after the other, with each of them once; the last may be cut.

    Raises
    ------
    ShortfallError
        If a copy differs.
    """
    if copies == 1:
        return result
    first = replace(result, codes=result.codes[::copies], status=result.status[::copies])
    for values, once in ((result.codes, first.codes), (result.status, first.status)):
        wrong = np.flatnonzero(
            (values != np.repeat(once, copies, axis=0)[: len(values)]).reshape(len(values), -1).any(axis=1)
        )
        if len(wrong):
            raise ShortfallError(f"result {wrong[0] // copies} must come out {copies} times, and changes meanwhile")
    return first


def cosimulate(
    bench: Bench,
    interface: InterfaceFacts,
    codes: Codes,
    *,
    seed: int = 1,
    progress: Progress = lambda done, total: None,
) -> CosimulationResult:
    """Run `codes` through a core.

    Parameters
    ----------
    bench : Bench
        Bench that runs the core.
    interface : InterfaceFacts
        Streams of the core.
    codes : int64 array, shape (samples, channels, inputs)
        Input codes, at least one sample. Samples of several channels are sent partly in turn, partly in random order.
    seed : int
        Seed of that order.
    progress : callable
        Called with the number of samples received and their total.

    Raises
    ------
    ShortfallError
        If the core breaks a rule of AXI4-Stream, or returns a sample for the wrong channel; says which and where.
    ToolError
        If a tool is missing or fails.
    """
    started = time.monotonic()
    samples, channels, _ = codes.shape
    order = random_order(samples, channels, seed)
    run = bench.run(pack(codes, order, interface.inputs), progress)
    if interface.rates:
        order = following(order, interface.rates)
    elif interface.samples_per_result > 1:
        order = completing(order, interface.samples_per_result)
    result, status = unpack(each_once(run.received, interface.copies_per_result), order, interface.outputs)
    return CosimulationResult(
        codes=result,
        status=status,
        cycles=run.cycles,
        wall_seconds=time.monotonic() - started,
        cycles_per_second=run.cycles / run.seconds,
        simulator=bench.name,
        tools=run.tools,
    )
