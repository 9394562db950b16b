"""The clocks that headers and manifests state, measured on the hardware in simulation, for a table of combinations."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from tests.hdl.core_bench import simulate

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import from_text
from sosmith.hdl.plan.streams import width

_LONGEST = 4000
"""Clocks after which a sample counts as lost."""

_SPECIFICATION = """
name = "x"
sample_rate = 48000.0
channels = {channels}
{inputs}
[filter]
family = "butterworth"
kind = "lowpass"
order = 1
cutoff = 1000.0
{decimation}
[output]
bits = 12
range = [-1.0, 1.0]
signed = true
[hardware]
clock = 48.0e6
{hardware}
"""
_INPUT = "input.x = { bits = 12, range = [-1.0, 1.0], signed = true }"
_CALIBRATED = """
input.voltage = { bits = 12, range = [0.0, 1.0] }
input.temperature = { bits = 8, range = [0.0, 1.0] }
calibration.coefficients = [[0.1], [0.8, 0.1]]
"""


@dataclass(frozen=True)
class Combination:
    """One row of the table."""

    architecture: str
    channels: int = 1
    decimate: int = 1
    calibrated: bool = False
    hardware: tuple[str, ...] = ()

    def __str__(self) -> str:
        parts = (self.architecture, f"{self.channels}", f"decimate {self.decimate}", "calibrated" * self.calibrated)
        return ", ".join(filter(None, (*parts, *self.hardware)))

    def made(self) -> Architecture:
        """Design it."""
        text = _SPECIFICATION.format(
            channels=self.channels,
            inputs=_CALIBRATED if self.calibrated else _INPUT,
            decimation=f"decimate = {self.decimate}" if self.decimate > 1 else "",
            hardware="\n".join((f'architecture = "{self.architecture}"', *self.hardware)),
        )
        return design_core(from_text(text, Path("x.toml"))).architecture


# The first five run always: of each of them, a figure was stated once that the hardware did not keep.
TABLE = [
    Combination("parallel", channels=3, hardware=('protect = "correct"',)),
    Combination("folded", hardware=("reload = true",)),
    Combination("folded", calibrated=True, hardware=('start = "zero"',)),
    Combination("folded", decimate=2),
    Combination("parallel", decimate=2, calibrated=True),
    Combination("parallel"),
    Combination("parallel", hardware=('protect = "correct"',)),
    Combination("parallel", hardware=("samples_per_clock = 2",)),
    Combination("parallel", channels=3),
    Combination("parallel", channels=3, hardware=('protect = "detect"', 'start = "zero"')),
    Combination("parallel", channels=3, calibrated=True, hardware=('protect = "correct"',)),
    Combination("parallel", decimate=2),
    Combination("parallel", channels=3, decimate=2),
    Combination("folded"),
    Combination("folded", hardware=('start = "zero"',)),
    Combination("folded", hardware=('protect = "correct"',)),
    Combination("folded", hardware=('protect = "detect"', "reload = true")),
    Combination("folded", channels=3, hardware=('protect = "correct"',)),
    Combination("folded", channels=3, calibrated=True),
    Combination("folded", decimate=2, calibrated=True),
    Combination("folded", channels=3, decimate=2),
    Combination("folded", channels=3, decimate=2, calibrated=True),
    Combination("serial"),
    Combination("serial", hardware=("reload = true", 'protect = "detect"')),
    Combination("serial", channels=3, decimate=2),
    Combination("online"),
]


@dataclass
class Seen:
    """Clocks since the end of a reset, of the samples that were accepted and of the results that left."""

    accepted: list[int] = field(default_factory=list)
    left: list[int] = field(default_factory=list)

    def waits(self, made: Architecture) -> list[int]:
        """Clocks from each sample that brings a result to that result; the channels take turns."""
        size = made.channels * (1 if made.decimator is None else made.decimator.factor)
        bring = [at for k, at in enumerate(self.accepted) if k % size < made.channels]
        return [left - at for left, at in zip(self.left, bring, strict=True)]


def measured(made: Architecture, results: int, *, alone: bool) -> Seen:
    """Offer samples from the end of a reset on, as fast as they are taken or each when the result before has left."""
    dut: Any = made.component()
    factor = 1 if made.decimator is None else made.decimator.factor
    # Channels take turns; all of them bring their results, and the samples between bring none.
    size = made.channels * factor
    count = (results - 1) // made.channels * size + made.channels
    chance = random.Random(1)
    seen = Seen()

    async def bench(ctx: Any) -> None:
        ctx.set(dut.aresetn, 0)
        ctx.set(dut.m_axis_tready, 1)
        await ctx.tick("bench").repeat(2)
        ctx.set(dut.aresetn, 1)
        clock = taken = last = 0
        while len(seen.left) < results or taken < count:
            assert clock - last < _LONGEST, f"no transfer after {last} clocks"
            due = taken // size * made.channels + min(taken % size, made.channels)
            offers = taken < count and (not alone or len(seen.left) >= due)
            ctx.set(dut.s_axis_tvalid, offers)
            ctx.set(dut.s_axis_tdata, chance.getrandbits(width(made.datapath.inputs) * made.samples_per_clock))
            if made.channels > 1:
                ctx.set(dut.s_axis_tdest, taken % made.channels)
            if ctx.get(dut.m_axis_tvalid):
                seen.left.append(clock)
                last = clock
            if offers and ctx.get(dut.s_axis_tready):
                seen.accepted.append(clock)
                taken, last = taken + 1, clock
            await ctx.tick("bench")
            clock += 1

    simulate(dut, bench)
    return seen


@pytest.mark.sweep(2)
@pytest.mark.parametrize("combination", TABLE, ids=str)
def test_the_clocks_stated_are_those_of_the_hardware(combination: Combination) -> None:
    made = combination.made()
    alone = measured(made, 2 * made.channels, alone=True)
    fast = measured(made, 3 * made.channels, alone=False)
    longest = max(alone.waits(made))
    if combination.architecture == "serial":  # whose clocks depend on the numbers
        assert 0.5 * made.reset_cycles <= alone.accepted[0] <= made.reset_cycles
        assert longest <= made.latency_cycles <= 2 * (longest + early(made))
    else:
        assert alone.accepted[0] == fast.accepted[0] == made.reset_cycles
        assert longest <= made.latency_cycles <= longest + early(made)
    size = made.channels * (1 if made.decimator is None else made.decimator.factor)
    apart = [later - earlier for earlier, later in pairwise(fast.accepted[::size])]
    assert apart[-1] <= made.cycles_per_result * made.channels


def early(made: Architecture) -> int:
    """Clocks from the edge that finds a sample to that which accepts it: the latency counts from the first."""
    return (
        made._taken_cycles
        if made.decimator is None
        else 0
        if made.calibration is None
        else made.calibration._taken_cycles
    )
