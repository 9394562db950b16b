"""Wear of a wheel flange from its clearance: depth, rate, remaining life, state; equations of the paper's section 6."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt
from scipy import stats

from sosmith.model.errors import SpecificationError
from sosmith.model.port import Values

MIN_BLOCKS = 8
"""Blocks that a rate takes: with fewer, the interval of a median of slopes has hardly a meaning."""

MAX_BLOCKS = 2000
"""Blocks that a rate may take: the slopes of all pairs are formed, two million here."""

BLOCKS = 40
"""Blocks of a record that has too few days for blocks of a day."""

ROUNDING = 1e-9
"""How far below a limit, in mm, a reading still counts as having reached it.

Doubles of decimal numbers are off by less, and a step of an output code is more."""

MAX_CORRELATION = 0.95
"""Beyond this the deviations are no scatter about a line: an interval can hardly be wide enough."""

MIN_FALL = 1 / 20
"""Part of the limit that a fall of the clearance has at least: what is less may be the season."""

_FALL_SCATTERS, _FALL_BLOCKS, _MIN_FALL_BLOCKS = 8, 4, 3

DAY = 1.0
"""Length of a block unless said otherwise, days: longer than anything a filter or a journey keeps for itself."""


class WearState(StrEnum):
    """How far the wear has come; the names of the hardware's flags."""

    GOOD = "good"
    WARNING = "warning"
    CRITICAL = "critical"


@dataclass(frozen=True, kw_only=True)
class WearLimits:
    """What a clearance means for a wheel, in mm; the table [wear] of a specification.

    Attributes
    ----------
    initial : float
        Clearance without wear, s_i; at least 0. The paper's sensor needs 1.5 mm.
    limit : float
        Wear from which on it is critical, s_w,max. The paper states 9 mm, but for flanges from 33 down to 22 mm, whose
        difference is 11 mm: take the limit from the railway's own rules.
    warning : float or None
        Wear from which on there is a warning, above 0 and below `limit`; None for none.
    sensor_range : float or None
        Clearance up to which the sensor can be trusted. If it is less than the clearance at the limit, the wear is
        critical from there on.

    Raises
    ------
    SpecificationError
        If a number does not fit.
    """

    initial: float
    limit: float
    warning: float | None = None
    sensor_range: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.initial < math.inf:
            raise SpecificationError(f"initial must be a clearance of 0 mm or more, not {self.initial:g} mm")
        if not 0 < self.limit < math.inf:
            raise SpecificationError(f"limit must be a wear above 0 mm, not {self.limit:g} mm")
        if self.warning is not None and not 0 < self.warning < self.limit:
            raise SpecificationError(
                f"warning must be a wear above 0 mm and below the limit of {self.limit:g} mm, not {self.warning:g} mm"
            )
        start = self.initial + (self.warning or 0.0)
        if self.sensor_range is not None and not start < self.sensor_range < math.inf:
            what = "initial clearance" if self.warning is None else "clearance of the warning"
            raise SpecificationError(
                f"sensor range must be above the {what}, {start:g} mm, not {self.sensor_range:g} mm"
            )

    @property
    def warning_clearance(self) -> float | None:
        """Clearance from which on there is a warning, mm."""
        return None if self.warning is None else self.initial + self.warning

    @property
    def critical_clearance(self) -> float:
        """Clearance from which on the wear is critical, mm: the limit's, or the sensor's range if that comes first."""
        end = self.initial + self.limit
        return end if self.sensor_range is None else min(end, self.sensor_range)

    def state(self, clearance: float) -> WearState:
        """State at a clearance in mm, without memory, by the comparisons that the hardware makes with its codes."""
        if clearance >= self.critical_clearance - ROUNDING:
            return WearState.CRITICAL
        if self.warning_clearance is not None and clearance >= self.warning_clearance - ROUNDING:
            return WearState.WARNING
        return WearState.GOOD


@dataclass(frozen=True, kw_only=True)
class WearRate:
    """Rate of wear, in mm a day.

    Attributes
    ----------
    rate : float
        Median of the slopes between all pairs of blocks (Theil and Sen).
    low, high : float
        Interval of the rate at `confidence`, widened for the correlation between blocks.
    confidence : float
        Between 0 and 1.
    blocks : int
        Count of blocks.
    block : float
        Length of a block, days.
    scatter : float
        Scatter of the blocks' medians about the line, mm: 1.4826 times the median of the absolute deviations, which
        for normally distributed ones is the standard deviation.
    correlation : float
        Correlation of the deviations of neighbouring blocks, -1 to 1.
    """

    rate: float
    low: float
    high: float
    confidence: float
    blocks: int
    block: float
    scatter: float
    correlation: float


@dataclass(frozen=True, kw_only=True)
class Fall:
    """A fall of the clearance. Wear makes none: the wheel was turned or changed, or the sensor mounted anew.

    Attributes
    ----------
    size : float
        By how much, mm.
    window : float
        Days from there to the last reading.
    """

    size: float
    window: float


@dataclass(frozen=True, kw_only=True)
class WearReport:
    """Wear at the end of a record. Lengths in mm, times in days.

    Attributes
    ----------
    limits : WearLimits
        What it was judged by.
    samples : int
        Count of readings.
    duration : float
        From the first reading to the last, days.
    clearance : float
        Median of the last block, mm.
    wear : float
        ``clearance - initial``, mm: s_w = s_r - s_i. Negative if the initial clearance is too large.
    remaining : float
        Wear from there to the critical clearance, mm; 0 beyond it.
    rate : WearRate
        Rate of wear.
    fall : Fall or None
        The last fall of the clearance among the blocks that the rate is from, which it makes too small.
    life, life_low, life_high : float or None
        Days from the last reading until the critical clearance at the rate, at the upper end of its interval and at the
        lower; None where that rate is not above zero, so that no end is in sight.
    last : float
        The last reading, mm.
    state : WearState
        State of the last reading: what the flags of the hardware say with it.
    first_warning, first_critical : float or None
        Time of the first reading in that state or beyond it, in the time of the record, days.
    warnings, criticals : int
        Readings of the last block in that state or beyond it: noise makes them come and go near a limit.
    last_block : int
        Readings of the last block.
    """

    limits: WearLimits
    samples: int
    duration: float
    clearance: float
    wear: float
    remaining: float
    rate: WearRate
    fall: Fall | None
    life: float | None
    life_low: float | None
    life_high: float | None
    last: float
    state: WearState
    first_warning: float | None
    first_critical: float | None
    warnings: int
    criticals: int
    last_block: int


def block_medians(
    time: Values, clearance: Values, block: float | None
) -> tuple[Values, Values, npt.NDArray[np.int64], float]:
    """Cut a record into blocks of equal length, counted back from its last reading, and take the medians of each.

    Readings close to each other share what the filter remembers and the state of one journey, so they are no
    independent witnesses of a rate; their median is one.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Days, not falling.
    clearance : ndarray, shape (n,)
        mm.
    block : float or None
        Length in days; None takes `DAY`, or a fortieth of a record with fewer than `MIN_BLOCKS` days.

    Returns
    -------
    time, clearance : ndarray, shape (blocks,)
        Medians of the blocks that hold readings.
    count : ndarray, shape (blocks,)
        Readings of each.
    block : float
        Length of a block, days.
    """
    span = float(time[-1] - time[0])
    if block is None:
        block = DAY if span >= MIN_BLOCKS * DAY else span / BLOCKS
    if not 0 < block < math.inf:
        raise SpecificationError(f"block must be a time above 0 days, not {block:g} days")
    if span / block > MAX_BLOCKS:
        raise SpecificationError(
            f"block must be at least {span / MAX_BLOCKS:.3g} days for a record of {span:.4g} days, not {block:g} days"
        )
    number = np.floor((time[-1] - time) / block).astype(np.int64)[::-1]  # rising from the end of the record
    edges = np.flatnonzero(np.diff(number)) + 1
    times, values = np.split(time[::-1], edges), np.split(clearance[::-1], edges)
    return (
        np.array([float(np.median(part)) for part in reversed(times)]),
        np.array([float(np.median(part)) for part in reversed(values)]),
        np.array([len(part) for part in reversed(values)]),
        block,
    )


def rate_of(time: Values, clearance: Values, block: float, confidence: float) -> WearRate:
    """Rate of wear by the Theil-Sen slope with its interval (P. K. Sen, J. Am. Stat. Assoc. 63, 1968).

    Up to 29 % of the blocks may be wild without the slope being so. Sen's interval takes deviations as independent.
    Where those of neighbouring blocks correlate by r > 0, it is widened by ``sqrt((1 + r) / (1 - r))``, as the
    effective count of samples of a first-order autoregression falls (G. V. Bayley and J. M. Hammersley, J. R. Stat.
    Soc. Suppl. 8, 1946).

    Parameters
    ----------
    time, clearance : ndarray, shape (blocks,)
        Days and mm, at least `MIN_BLOCKS`.
    block : float
        Length of a block, days.
    confidence : float
        Between 0 and 1.

    Raises
    ------
    SpecificationError
        If there are too few blocks, or the confidence is none.
    """
    if not 0 < confidence < 1:
        raise SpecificationError(f"confidence must be between 0 and 1, not {confidence:g}")
    if len(time) < MIN_BLOCKS:
        raise SpecificationError(
            f"the record must have readings in at least {MIN_BLOCKS} blocks of {block:.4g} days, not in {len(time)}"
        )
    slope, intercept, low, high = stats.theilslopes(clearance, time, alpha=confidence)
    deviation = clearance - intercept - slope * time
    deviation = deviation - np.median(deviation)
    correlation = _correlation(deviation)
    wider = math.sqrt((1 + correlation) / (1 - correlation)) if correlation > 0 else 1.0
    return WearRate(
        rate=float(slope),
        low=float(slope - wider * (slope - low)),
        high=float(slope + wider * (high - slope)),
        confidence=confidence,
        blocks=len(time),
        block=block,
        scatter=1.4826 * float(np.median(np.abs(deviation))),
        correlation=correlation,
    )


def _correlation(deviation: Values) -> float:
    """Estimate the correlation of neighbours from deviations about a fitted line.

    A fit to n values takes a part of it along, with a line about ``(2 + 4 r) / n`` on average (for a mean see M. G.
    Kendall, Biometrika 41, 1954), which is given back. The tests count how often the interval then holds the truth.
    """
    energy, count = float(np.sum(deviation**2)), len(deviation)
    if energy == 0:
        return 0.0
    found = float(np.sum(deviation[1:] * deviation[:-1])) / energy
    return min((found + 2 / count) / (1 - 4 / count), MAX_CORRELATION)


def last_fall(time: Values, clearance: Values, least: float) -> Fall | None:
    """Find the last place where the clearance falls and stays down, by the medians of the blocks before and after.

    Parameters
    ----------
    time, clearance : ndarray, shape (blocks,)
        Days and mm.
    least : float
        Size of the smallest fall that counts, mm; beside that it has to stand out of the scatter.

    Returns
    -------
    Fall or None
        Its window ends between the two blocks, so far before the last of `time`.
    """
    if len(time) < MIN_BLOCKS:
        return None
    level = clearance - np.median(np.diff(clearance) / np.diff(time)) * time
    steps = np.diff(level)
    scatter = 1.4826 * float(np.median(np.abs(steps - np.median(steps))))
    sizes = np.zeros(len(steps))
    for k in range(_MIN_FALL_BLOCKS, len(clearance) - _MIN_FALL_BLOCKS + 1):
        before, after = level[max(k - _FALL_BLOCKS, 0) : k], level[k : k + _FALL_BLOCKS]
        sizes[k - 1] = np.median(before) - np.median(after)
    found = np.flatnonzero(sizes > max(least, _FALL_SCATTERS * scatter))
    if not len(found):
        return None
    # neighbouring places see the same fall: it is where the steepest step is
    near = found[found > found[-1] - _FALL_BLOCKS]
    place = int(near[np.argmin(steps[near])])
    return Fall(size=float(sizes[place]), window=float(time[-1] - (time[place] + time[place + 1]) / 2))


def judge(
    time: Values,
    clearance: Values,
    limits: WearLimits,
    *,
    block: float | None = None,
    window: float | None = None,
    confidence: float = 0.95,
) -> WearReport:
    """Judge a record of clearances.

    The interval of the remaining life takes the ends of the rate's interval, and moves the present clearance by as many
    of the blocks' scatter as belong to the confidence. It says how long if wear goes on at this rate, no more.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Days, not falling.
    clearance : ndarray, shape (n,)
        mm, finite.
    limits : WearLimits
        What the clearances mean.
    block : float, optional
        Length of a block, days; see `block_medians`.
    window : float, optional
        Take the rate from so many days at the end only.
    confidence : float
        Of the intervals, between 0 and 1.

    Raises
    ------
    SpecificationError
        If the record is empty, not finite, not in order of time, or too short for a rate.
    """
    if len(time) != len(clearance) or not len(time):
        raise SpecificationError(
            f"the record must have a time for each clearance, not {len(time)} for {len(clearance)}"
        )
    if not (np.all(np.isfinite(time)) and np.all(np.isfinite(clearance))):
        raise SpecificationError("the record must hold finite times and clearances, not others")
    if np.any(np.diff(time) < 0):
        raise SpecificationError("the record must be in order of time, not go back")
    if not time[-1] > time[0]:
        raise SpecificationError("the record must last longer than one moment for a rate of wear, not 0 days")
    if window is not None and not 0 < window < math.inf:
        raise SpecificationError(f"window must be a time above 0 days, not {window:g} days")
    recent = slice(0 if window is None else int(np.searchsorted(time, time[-1] - window)), None)
    if not time[-1] > time[recent][0]:
        before = float(time[-1] - time[time < time[-1]][-1])
        raise SpecificationError(
            f"window must be at least {before:.4g} days, from the last reading to one before it, not {window:g} days"
        )
    times, medians, counts, length = block_medians(time[recent], clearance[recent], block)
    rate = rate_of(times, medians, length, confidence)
    fall = last_fall(times, medians, MIN_FALL * limits.limit)
    now, last_block = float(medians[-1]), int(counts[-1])
    remaining = max(limits.critical_clearance - now, 0.0)
    gone = float(time[-1] - times[-1])
    off = float(stats.norm.ppf((1 + confidence) / 2)) * rate.scatter
    states = [limits.state(value) for value in clearance.tolist()]
    end = states[-last_block:]
    critical = [state is WearState.CRITICAL for state in states]
    warned = [state is not WearState.GOOD for state in states]
    return WearReport(
        limits=limits,
        samples=len(time),
        duration=float(time[-1] - time[0]),
        clearance=now,
        wear=now - limits.initial,
        remaining=remaining,
        rate=rate,
        fall=None if fall is None else replace(fall, window=fall.window + gone),
        life=_life(remaining, rate.rate, gone),
        life_low=_life(max(remaining - off, 0.0), rate.high, gone),
        life_high=_life(remaining + off if remaining else 0.0, rate.low, gone),
        last=float(clearance[-1]),
        state=states[-1],
        first_warning=float(time[warned.index(True)]) if any(warned) and limits.warning is not None else None,
        first_critical=float(time[critical.index(True)]) if any(critical) else None,
        warnings=sum(state is not WearState.GOOD for state in end),
        criticals=sum(state is WearState.CRITICAL for state in end),
        last_block=last_block,
    )


def _life(remaining: float, rate: float, gone: float) -> float | None:
    """Days until what remains is worn at a rate in mm a day, less the days `gone` already; None if it never is."""
    if remaining == 0:
        return 0.0
    life = remaining / rate if rate > 0 else math.inf
    return max(life - gone, 0.0) if life < math.inf else None
