"""Which multiplier takes which product of an FIR filter that decimates, with which sample, and their clocks.

A result needs S products, and R samples come for each result. So ``P = ceil(S / R)`` multipliers are enough for a
sample at each clock, if each of them takes another product with each of the R samples. The sample with the phase p,
which comes p samples before the one that brings the result, brings those of samples that are there by then: the product
of a tap with the delay d, which stands d - p places back in the line of samples then, may be taken if ``p <= d``::

    delay d of the tap     0   1   2   3   4   5   6   7   8   9        R = 4, P = 3
    phase p                0   1   2   3   0   1   2   3   0   1
    multiplier             0   0   0   0   1   1   1   1   2   2
    place in the line      0   0   0   0   4   4   4   4   8   8

Of a dense filter, each multiplier has one place in the line. Where taps are equal, a product takes the sum of two
samples, of which the second one's place falls by two with each sample; where taps are 0, products of other delays move
up to phases that are free. Then a choice among the places stands before the multiplier.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from sosmith.hdl.plan.decimating.plan import DecimatingPlan, paced
from sosmith.hdl.plan.tap_steps import TapStep, TapSteps, tap_steps
from sosmith.model.dataflow.datapath import Datapath

_BEFORE_SUMS = 4
"""Clocks from a sample to the products: line, places, sum of two, product."""


@dataclass(frozen=True, kw_only=True)
class PolyphasePlan(DecimatingPlan):
    """The products of a filter by multiplier and phase.

    Attributes
    ----------
    steps : TapSteps
        The products, each of one sample or two.
    factor, filled, settling, limits, channels
        As of `DecimatingPlan`.
    """

    steps: TapSteps

    @property
    def multipliers(self) -> int:
        """P."""
        return -(-len(self.steps.steps) // self.factor)

    @property
    def fills(self) -> int:
        """Times that R samples go in before the first one is accepted: until no other one counts."""
        return max(1, -(-(self.steps.section.length - 1) // self.factor)) if self.filled else 0

    @cached_property
    def length(self) -> int:
        """Samples of the line: those up to the last place from which one is taken."""
        taken = [(phase, step) for phase, own in enumerate(self.by_phase) for step in own if step is not None]
        return 1 + max(max(step.first, step.second or 0) - phase for phase, step in taken)

    @cached_property
    def by_phase(self) -> tuple[tuple[TapStep | None, ...], ...]:
        """The product of each multiplier, by phase; None where it has none.

        Products with the fewest phases to choose from come first, each to the phase that keeps its place in the line
        the same as that of the others, or else to the last one that is free; so each finds one.
        """
        phases: list[list[TapStep]] = [[] for _ in range(self.factor)]
        for step in sorted(self.steps.steps, key=lambda step: step.first):
            latest = min(step.first, self.factor - 1)
            wanted = step.first % self.factor
            order = [wanted, *range(latest, -1, -1)]
            phase = next(p for p in order if p <= latest and len(phases[p]) < self.multipliers)
            phases[phase].append(step)
        columns = [[*own, *[None] * (self.multipliers - len(own))] for own in phases]
        return tuple(map(tuple, columns))

    @property
    def levels(self) -> int:
        """Clocks of the sums of all products of a phase."""
        return (self.multipliers - 1).bit_length()

    @property
    def clocks(self) -> int:
        """Clocks from the edge at which a sample enters to the one that adds its products to the result."""
        return _BEFORE_SUMS + self.levels + 1


def polyphase_plan(datapath: Datapath, channels: int = 1) -> PolyphasePlan:
    """Return which multiplier takes which product of a datapath that is one FIR filter which decimates.

    Raises
    ------
    ValueError
        If the datapath is another one, or keeps no samples.
    """
    return PolyphasePlan(**paced(datapath)._asdict(), channels=channels, steps=tap_steps(datapath))
