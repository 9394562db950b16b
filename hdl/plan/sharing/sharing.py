"""Which sections of a datapath share hardware, and the clocks that this takes.

Sections of the same structure, which follow each other in a datapath, have one graph in hardware
(`sosmith.hdl.plan.sharing.sections`). Each takes as many clocks as its logic is spread over, its turn; a sample takes
the turns of all sections::

    sections    section0            section1            section2                     K = 3 sections
    clocks      0    1    2         3    4    5         6    7    8                  D = 3 clocks a turn
    hardware    taps product sum    taps product sum    taps product sum             one sample every K D = 9 clocks
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from sosmith.hdl.plan.parallel_clocks import clock_of, depth_of
from sosmith.hdl.plan.pipeline import longest_time
from sosmith.hdl.plan.sharing.sections import SharedSections, merged
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph
from sosmith.model.dataflow.structure import Stage
from sosmith.model.sections.start import PassingStage

MOST_CLOCKS = 4
"""Most clocks that a turn is spread over: with more, no clock is faster."""

_UNIT, _BESIDE = 0.55e-9, 0.6e-9
"""Time of a unit of `sosmith.hdl.plan.pipeline.operation_time` in seconds where sections share hardware, and what a
clock takes besides. From placed cores of order 4 to 8 on an ECP5 of speed grade 6, 1 to 4 clocks a turn: from 7 % less
than they take to 27 % more."""


@dataclass(frozen=True)
class Sharing:
    """How a datapath's stages become hardware whose sections take turns.

    Attributes
    ----------
    datapath : Datapath
    units : tuple
        What there is hardware for, in the order of the stages: sections that share it, or a stage alone.
    clocks : int
        Clocks of a turn of each section that shares hardware.
    """

    datapath: Datapath
    units: tuple[SharedSections | Stage, ...]
    clocks: int

    @property
    def shared(self) -> list[SharedSections]:
        """The units that several sections share."""
        return [unit for unit in self.units if isinstance(unit, SharedSections)]

    @property
    def alone(self) -> list[Stage]:
        """The stages with hardware of their own."""
        return [unit for unit in self.units if not isinstance(unit, SharedSections)]

    @property
    def graphs(self) -> list[Graph]:
        """What there is hardware for."""
        return [unit.graph for unit in self.units]

    @property
    def interval(self) -> int:
        """Clocks between samples: the turns of as many sections as share hardware, so many as any stage takes."""
        return max(self.depth_of(unit) for unit in self.units)

    @property
    def is_kept_at_entrance(self) -> bool:
        """Whether a register keeps a sample for the first unit, which takes several clocks for it."""
        return isinstance(self.units[0], SharedSections)

    @cached_property
    def depth(self) -> int:
        """Clocks from the edge that accepts a sample to the one that has its result in the last register."""
        return self.is_kept_at_entrance + sum(map(self.depth_of, self.units))

    def depth_of(self, unit: SharedSections | Stage) -> int:
        """Return the clocks that a sample takes in a unit."""
        if isinstance(unit, SharedSections):
            return len(unit.stages) * self.clocks
        return depth_of(unit)

    @property
    def latency_cycles(self) -> int:
        """Clocks from the edge that accepts a sample to the one that can output its result, without a stall."""
        return self.depth + 1 + (len(self.datapath.wear) > 1)

    @property
    def clock_estimate(self) -> float:
        """Estimate of the highest clock on an ECP5, in Hz."""
        shared = max(unit.period(self.clocks) for unit in self.shared)
        alone = max((longest_time(stage.graph) for stage in self.alone), default=0)
        return min(1 / (_BESIDE + _UNIT * shared), clock_of(alone))


def sharing(datapath: Datapath, clock: float = 0.0, available: int = 0) -> Sharing:
    """Return which sections of a datapath share hardware, with as few clocks of a turn as a `clock` in Hz allows.

    If none are fast enough, it is the fastest. There may be so many clocks `available` for each sample that turns are
    not spread over more; 0 says that there are any.

    Raises
    ------
    ValueError
        If no two sections that follow each other have the same operations.
    """
    units: list[SharedSections | Stage] = []
    run: list[Stage] = []
    for stage in (*map(_inner, datapath.stages), None):
        longer = None if stage is None or not run else merged([*run, stage])
        if longer is None and run:
            units.append(merged(run) or run[0])
            run = []
        if stage is not None:
            run.append(stage)
    made = Sharing(datapath, tuple(units), 1)
    if not made.shared:
        raise ValueError("two sections that follow each other must have the same operations")
    ways = [Sharing(datapath, tuple(units), clocks) for clocks in range(1, MOST_CLOCKS + 1)]
    in_time = [way for way in ways if not available or way.interval <= available] or ways[:1]
    fast = next((way for way in in_time if way.clock_estimate >= clock), None)
    return fast or max(in_time, key=lambda way: way.clock_estimate)


def _inner(stage: Stage) -> Stage:
    """Return a section without what only passes it by, which has no logic."""
    return stage.section if isinstance(stage, PassingStage) else stage
