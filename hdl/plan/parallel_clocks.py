"""Clocks of the parallel architecture."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from sosmith.hdl.plan.interleaving import Schedule, schedule
from sosmith.hdl.plan.look_ahead import Products, period, plans
from sosmith.hdl.plan.pipeline import longest_time, pipeline_depth, pipeline_stages
from sosmith.hdl.plan.unfolding import unfolded_stages
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph
from sosmith.model.dataflow.structure import Stage
from sosmith.model.sections.start import StartStage

_UNIT, _CHAINED, _BESIDE = 0.5e-9, 0.4e-9, 3.6e-9
"""Time of a unit of `sosmith.hdl.plan.pipeline.operation_time` in seconds, where one or two operations fill a pipeline
stage, and where many follow each other, whose carry chains overlap; and what a clock takes besides for registers and
wires. From placed cores on an ECP5 of speed grade 6: audio_lowpass with look-ahead over 4, 8 and 16 samples, and the
examples and realizations in docs/cost.md."""


def latency_cycles(
    datapath: Datapath, channels: int = 1, *, protect: str = "none", adders: Sequence[Collection[int]] = ()
) -> int:
    """Most clocks from the edge that accepts a sample to the edge that can hand its result on, without a stall.

    With several channels, a sample waits for a scrub of its channel, though not for one of another. Products in
    `adders`, by stage and node, are made of adders.
    """
    scrub = 0
    if protect != "none" and channels > 1:  # states of one channel are registers, and are not scrubbed
        scrub = max(plan.distance for plan in schedules(datapath, channels, protect, adders)) - 1
    return sum(depths(datapath, channels, protect, adders)) + 1 + (channels > 1) + (len(datapath.wear) > 1) + scrub


def schedules(
    datapath: Datapath, channels: int, protect: str, adders: Sequence[Collection[int]] = ()
) -> list[Schedule]:
    """Return the schedule of each datapath stage for several channels."""
    made_of_adders = adders or [()] * len(datapath.stages)
    return [
        schedule(stage.graph, channels, rewrites=protect != "none", adders=own)
        for stage, own in zip(datapath.stages, made_of_adders, strict=True)
    ]


def pipeline_stages_of(
    graphs: Sequence[Graph], channels: int, protect: str, adders: Sequence[Collection[int]]
) -> list[Sequence[int]]:
    """Return the pipeline stage of each node of the graphs of stages, without look-ahead."""
    if channels == 1:
        return [pipeline_stages(graph) for graph in graphs]
    return [
        schedule(graph, channels, rewrites=protect != "none", adders=own).pipeline_stages
        for graph, own in zip(graphs, adders, strict=True)
    ]


def depths(datapath: Datapath, channels: int, protect: str, adders: Sequence[Collection[int]] = ()) -> list[int]:
    """Return the number of pipeline stages of each datapath stage."""
    if channels == 1:
        return [depth_of(stage, protect) for stage in datapath.stages]
    return [plan.depth for plan in schedules(datapath, channels, protect, adders)]


def depth_of(stage: Stage, protect: str = "none") -> int:
    """Return the number of pipeline stages of a datapath stage for one channel."""
    return 1 if protect == "none" and isinstance(stage, StartStage) else pipeline_depth(stage.graph)


def block_latency_cycles(datapath: Datapath, lanes: int, products: Products | None = None) -> int:
    """Clocks from the edge that accepts a beat to the edge that can hand its results on, without a stall.

    With look-ahead, `products` says how products by constants are made.
    """
    return sum(block_depths(datapath, lanes, products)) + 1


def block_depths(datapath: Datapath, lanes: int, products: Products | None = None) -> list[int]:
    """Return the number of pipeline stages of each stage with several samples a clock, or with look-ahead."""
    stages = unfolded_stages(datapath, lanes)
    if products is not None:
        return [plan.depth for plan in plans(stages, products)]
    return [pipeline_depth(stage.graph) for stage in stages]


def clock_estimate(datapath: Datapath, lanes: int, products: Products | None = None) -> float:
    """Estimate the highest clock of a core for one channel on an ECP5, in Hz: by its slowest pipeline stage."""
    stages = unfolded_stages(datapath, lanes)
    if products is not None:
        return 1 / (_BESIDE + _UNIT * period(stages, products))
    return clock_of(max(longest_time(stage.graph) for stage in stages))


def clock_of(time: int) -> float:
    """Estimate the clock of a pipeline stage of so many units of time, where carry chains overlap, in Hz."""
    return 1 / (_BESIDE + _CHAINED * time)
