"""Adds the flag `settling` to a datapath whose filter starts from zero, for as long as that is proven to show."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

from sosmith.gen.proof.settling import settling
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage
from sosmith.model.sections.start import StartStage


def samples_to_settle(datapath: Datapath) -> int:
    """Count the samples to flag after a start; 0 without a filter, and behind a start from its steady state.

    Raises
    ------
    ShortfallError
        If the filter is not proven to settle.
    """
    stages = datapath.stages
    sections = tuple(stage.graph for stage in stages if not isinstance(stage, HornerStep | StartStage | OutputStage))
    steady = any(isinstance(stage, StartStage) for stage in stages)
    return max(settling(sections), 1) if sections and not steady else 0


def with_settling(datapath: Datapath, samples: int) -> Datapath:
    """Return a datapath that flags so many samples after a start; with 0 of them, as it is."""
    if not samples:
        return datapath
    *stages, last = datapath.stages
    return replace(datapath, stages=(*stages, replace(cast("OutputStage", last), settling=samples)))
