"""Clocks of the on-line architecture."""

from __future__ import annotations

from sosmith.hdl.plan.pipeline import pipeline_depth
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.sections.online import OnlineSchedule, online_schedule, sections_of


def schedule_of(datapath: Datapath) -> OnlineSchedule:
    """Schedule the sections of a datapath in a core.

    Raises
    ------
    OnlineError
        If a section is not one for on-line arithmetic.
    """
    before = datapath.stages[: sections_of(datapath).start]
    return online_schedule(datapath, sum(pipeline_depth(stage.graph) for stage in before))


def latency_cycles(datapath: Datapath) -> int:
    """Clocks from the edge that accepts a sample to the edge that can hand its result on, without a stall."""
    return schedule_of(datapath).done + pipeline_depth(datapath.stages[-1].graph) + 1
