"""The ideal chain, before anything is rounded: its stages' exact responses, and what becomes of sines in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import prod
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sosmith.gen.chain.phases import exact_parts
from sosmith.gen.chain.response import Part, Segment, segments_of
from sosmith.gen.chain.specification import ChainSpec, StageSpec
from sosmith.model.arrays import Values

_FLOOR_DB = -200.0
"""Lower limit of gains in dB."""

_EVALUATIONS = 100_000
"""Most frequencies at which an alias map evaluates the response."""


class ExactStage(Protocol):
    """A stage whose exact response is known, designed or not."""

    @property
    def spec(self) -> StageSpec:
        """What was asked for."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """Its exact response; empty for a polynomial, which has none."""


class ExactChain(Protocol):
    """A chain whose exact response is known, designed or not."""

    @property
    def spec(self) -> ChainSpec:
        """What was asked for."""

    @property
    def stages(self) -> Sequence[ExactStage]:
        """In the order of the samples."""


@dataclass(frozen=True, kw_only=True)
class IdealStage:
    """A stage as it is asked for."""

    spec: StageSpec
    parts: tuple[Part, ...]


@dataclass(frozen=True, kw_only=True)
class IdealChain:
    """A chain as it is asked for; its stages must be given, not of the kind auto."""

    spec: ChainSpec
    stages: tuple[IdealStage, ...]


def ideal_chain(spec: ChainSpec, progress: Callable[[str], None] = lambda step: None) -> IdealChain:
    """Design the filters of a chain.

    Raises
    ------
    SpecificationError
        If a stage breaks a rule, or needs an order that is too high.
    ShortfallError
        If there is no such filter.
    """
    stages = (IdealStage(spec=stage, parts=exact_parts(spec, stage, progress)) for stage in spec.stages)
    return IdealChain(spec=spec, stages=tuple(stages))


def level(gain: npt.NDArray[np.inexact]) -> Values:
    """Return magnitudes in dB, none below `_FLOOR_DB`."""
    return np.asarray(20 * np.log10(np.maximum(np.abs(gain), 10 ** (_FLOOR_DB / 20))), dtype=np.float64)


def frequencies(chain: ExactChain, points: int) -> Values:
    """Return frequencies in Hz, from far below the lowest rate to half the highest."""
    ends = [stage.spec.filter_rate for stage in chain.stages]
    lowest, highest = min(*ends, chain.spec.base.sample_rate, chain.spec.last_rate), max(ends)
    return np.geomspace(float(highest) / 2 / float(100 * highest / lowest), float(highest) / 2, points)


def stage_gain(stage: ExactStage, frequency: Values) -> Values:
    """Magnitude of a stage's gain for sines in Hz: those at its input reach it folded by the stages before, if any.

    Of a stage that interpolates, they are those at its output, images of what comes in included.
    """
    return np.asarray(np.abs(_complex(stage, frequency / float(stage.spec.filter_rate))), dtype=np.float64)


def chain_gain(chain: ExactChain, frequency: Values) -> npt.NDArray[np.complex128]:
    """Complex gain at sines of the highest rate, in Hz, without any rounding.

    Without stages that interpolate, that is the rate of the input. With some, a sine of up to half that rate is
    filtered as it is, and others are its images.
    """
    total = np.ones(frequency.shape, dtype=np.complex128)
    for stage in chain.stages:
        total = total * _complex(stage, frequency / float(stage.spec.filter_rate))
    return total


def _complex(stage: ExactStage, turns: Values) -> npt.NDArray[np.complex128]:
    total, step = np.ones(turns.shape, dtype=np.complex128) / stage.spec.rise, 1
    for part in stage.parts:
        u = np.exp(-2j * np.pi * turns * step)
        for numerator, denominator in part.sections:
            over, under = (
                np.polynomial.polynomial.polyval(u, [float(c) for c in taps]) for taps in (numerator, denominator)
            )
            total = total * over / under
        step *= part.factor
    return total


def bands(chain: ExactChain) -> list[tuple[float, float, str]]:
    """Return where a sine comes out at another frequency than it went in: a band in Hz each, and "aliasing" or "image".

    They are in the order of `ChainDesign.foldings`.
    """
    parts = [part for stage in chain.stages for part in stage.parts]
    segments = [each for each in segments_of(parts) if each.rise > 1 or each.factor > 1]
    return [_band(each, chain.spec.base.sample_rate) for each in segments]


def _band(segment: Segment, rate: Fraction) -> tuple[float, float, str]:
    highest = float(rate * segment.highest)
    edge = highest / (2 * max(segment.rise, segment.factor))
    return edge, highest / 2, "aliasing" if segment.rise == 1 else "image"


def alias_map(chain: ExactChain, points: int) -> tuple[Values, Values, Values] | None:
    """Return frequencies at the output in Hz, the gain of what stays there, and the largest of what folds there.

    None of a chain that does not decimate, or that interpolates too: there, `bands` tells more. The largest is that of
    all aliases at just these frequencies.
    """
    factor = prod(stage.spec.factor for stage in chain.stages)
    if factor == 1 or any(stage.spec.rise > 1 for stage in chain.stages):
        return None
    rate = float(chain.spec.last_rate)
    low = rate * np.linspace(0.0, 0.5, max(2, min(points, _EVALUATIONS // factor)))
    centres = rate * np.arange(1, factor // 2 + 1)
    folded = np.abs(centres[:, None, None] + np.array([-1.0, 1.0])[:, None] * low)
    return low, np.abs(chain_gain(chain, low)), np.abs(chain_gain(chain, folded)).max(axis=(0, 1))
