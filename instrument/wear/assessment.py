"""Flange wear from the clearance: depth, rate, remaining life, state (section 6 of the paper)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt
from scipy import special

from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError

MIN_BLOCKS = 8
"""Lowest number of blocks for a rate: with fewer, the interval of a median of slopes has little meaning."""

MAX_BLOCKS = 2000
"""Highest number of blocks for a rate: the slopes of all pairs are computed, two million for this number."""

BLOCKS = 40
"""Number of blocks in a record that is too short for blocks of one day."""

ROUNDING = 1e-9
"""Tolerance in mm: a reading this close below a limit counts as having reached it.

It is larger than the rounding of decimal numbers to doubles, and smaller than one LSB of an output.
"""

MAX_CORRELATION = 0.95
"""Upper limit of the estimated correlation: above it the deviations are not scatter about a line, and hardly any
interval is wide enough."""

MIN_FALL = 1 / 20
"""Smallest fall of the clearance that is reported, as a fraction of the wear limit: less may be seasonal."""

_FALL_SCATTERS, _FALL_BLOCKS, _MIN_FALL_BLOCKS = 8, 4, 3

DAY = 1.0
"""Default length of a block in days: longer than the memory of any filter or the conditions of one journey."""


class WearState(StrEnum):
    """Severity of the wear, named like the hardware's flags."""

    GOOD = "good"
    WARNING = "warning"
    CRITICAL = "critical"


@dataclass(frozen=True, kw_only=True)
class WearLimits:
    """How clearance relates to wear, in mm; the table [wear] of a specification.

    Attributes
    ----------
    initial : float
        Clearance without wear, s_i; at least 0. The paper's sensor needs 1.5 mm.
    limit : float
        Wear from which it is critical, s_w,max. The paper states 9 mm, but for flanges worn from 33 to 22 mm, a
        difference of 11 mm: take the limit from the railway's own rules.
    warning : float or None
        Wear from which there is a warning, above 0 and below `limit`; None for no warning.
    sensor_range : float or None
        Clearance up to which the sensor is valid. If it is below the clearance at the limit, wear is critical from
        there on.

    Raises
    ------
    SpecificationError
        If a value is out of range or contradicts another.
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
        """Clearance in mm from which there is a warning."""
        return None if self.warning is None else self.initial + self.warning

    @property
    def critical_clearance(self) -> float:
        """Clearance in mm from which the wear is critical: the lower of the limit and the sensor's range."""
        end = self.initial + self.limit
        return end if self.sensor_range is None else min(end, self.sensor_range)

    def state(self, clearance: float) -> WearState:
        """Return the state at a clearance in mm by the comparisons that the hardware makes on codes, without memory."""
        if clearance >= self.critical_clearance - ROUNDING:
            return WearState.CRITICAL
        if self.warning_clearance is not None and clearance >= self.warning_clearance - ROUNDING:
            return WearState.WARNING
        return WearState.GOOD


@dataclass(frozen=True, kw_only=True)
class ClearanceUncertainty:
    """What the clearances of a record are worth, from the uncertainty budget of the instrument.

    Attributes
    ----------
    standard : float
        Combined standard uncertainty in mm of a reading at the present clearance.
    freedom : float
        Its effective degrees of freedom.
    rise : float
        Standard uncertainty in mm of the rise of the clearance over the record, from the calibration that all readings
        share; what is new each day is in the scatter of the blocks.
    """

    standard: float
    freedom: float
    rise: float


@dataclass(frozen=True, kw_only=True)
class WearRate:
    """Rate of wear in mm per day.

    Attributes
    ----------
    rate : float
        Median of the slopes between all pairs of blocks (Theil and Sen).
    low, high : float
        Confidence interval of the rate, widened for the correlation between blocks.
    confidence : float
        Confidence level, between 0 and 1.
    blocks : int
        Number of blocks.
    block : float
        Length of a block in days.
    scatter : float
        Scatter of the block medians about the line in mm: 1.4826 times the median absolute deviation, which is the
        standard deviation for normally distributed deviations.
    correlation : float
        Correlation between the deviations of adjacent blocks, -1 to 1.
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
    """A fall of the clearance. Wear does not cause it: the wheel was reprofiled or replaced, or the sensor remounted.

    Attributes
    ----------
    size : float
        Size of the fall in mm.
    window : float
        Days from the fall to the last reading.
    """

    size: float
    window: float


@dataclass(frozen=True, kw_only=True)
class WearReport:
    """Wear at the end of a record. Lengths in mm, times in days.

    Attributes
    ----------
    limits : WearLimits
        Limits that it was assessed against.
    samples : int
        Number of readings.
    duration : float
        Time from the first reading to the last, in days.
    clearance : float
        Median of the last block in mm.
    wear : float
        ``clearance - initial`` in mm: s_w = s_r - s_i. Negative if the initial clearance is set too large.
    wear_low, wear_high : float
        Interval of the wear in mm: by the uncertainty of a reading if it is known, else by the scatter of the blocks.
    remaining : float
        Wear left before the critical clearance, in mm; 0 beyond it.
    rate : WearRate
        Rate of wear.
    fall : Fall or None
        The last fall of the clearance within the blocks used for the rate. It makes the rate too low.
    life, life_low, life_high : float or None
        Days from the last reading to the critical clearance, at the rate, at the upper and at the lower end of its
        interval; None where that rate is zero or negative, so that the clearance is never reached.
    last : float
        The last reading in mm.
    state : WearState
        State of the last reading, as the flags of the hardware show it.
    uncertainty : ClearanceUncertainty or None
        What the clearances are worth; None if it is not known.
    first_warning, first_critical : float or None
        Time of the first reading in that state or a worse one, in days on the time axis of the record.
    warnings, criticals : int
        Number of readings of the last block in that state or a worse one; near a limit, noise toggles the state.
    last_block : int
        Number of readings in the last block.
    """

    limits: WearLimits
    samples: int
    duration: float
    clearance: float
    wear: float
    wear_low: float
    wear_high: float
    remaining: float
    rate: WearRate
    fall: Fall | None
    life: float | None
    life_low: float | None
    life_high: float | None
    last: float
    state: WearState
    uncertainty: ClearanceUncertainty | None
    first_warning: float | None
    first_critical: float | None
    warnings: int
    criticals: int
    last_block: int


def block_medians(
    time: Values, clearance: Values, block: float | None
) -> tuple[Values, Values, npt.NDArray[np.int64], float]:
    """Divide a record into blocks of equal length, counted back from its last reading, and take their medians.

    Readings close in time share the filter's memory and the conditions of one journey, so they are not independent
    samples of a rate; block medians nearly are.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time in days, not decreasing.
    clearance : ndarray, shape (n,)
        Clearance in mm.
    block : float or None
        Length in days; None means `DAY`, or 1/40 of a record shorter than `MIN_BLOCKS` days.

    Returns
    -------
    time, clearance : ndarray, shape (blocks,)
        Medians of the blocks that contain readings.
    count : ndarray, shape (blocks,)
        Number of readings in each.
    block : float
        Length of a block in days.
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
    number = np.floor((time[-1] - time) / block).astype(np.int64)[::-1]  # in reverse order, so that it rises
    edges = np.flatnonzero(np.diff(number)) + 1
    times, values = np.split(time[::-1], edges), np.split(clearance[::-1], edges)
    return (
        np.array([float(np.median(part)) for part in reversed(times)]),
        np.array([float(np.median(part)) for part in reversed(values)]),
        np.array([len(part) for part in reversed(values)]),
        block,
    )


def rate_of(time: Values, clearance: Values, block: float, confidence: float) -> WearRate:
    """Estimate the rate of wear by the Theil-Sen slope and its interval (P. K. Sen, J. Am. Stat. Assoc. 63, 1968).

    The slope tolerates up to 29 % of outliers among the blocks. Sen's interval assumes independent deviations. If those
    of adjacent blocks have a correlation r > 0, the interval is widened by ``sqrt((1 + r) / (1 - r))``, following the
    effective sample size of a first-order autoregression (G. V. Bayley and J. M. Hammersley, J. R. Stat. Soc. Suppl.
    8, 1946).

    Parameters
    ----------
    time, clearance : ndarray, shape (blocks,)
        Block medians: time in days and clearance in mm, at least `MIN_BLOCKS` of them.
    block : float
        Length of a block in days.
    confidence : float
        Confidence level, between 0 and 1.

    Raises
    ------
    SpecificationError
        If there are too few blocks, or the confidence level is out of range.
    """
    if not 0 < confidence < 1:
        raise SpecificationError(f"confidence must be between 0 and 1, not {confidence:g}")
    if len(time) < MIN_BLOCKS:
        raise SpecificationError(
            f"the record must have readings in at least {MIN_BLOCKS} blocks of {block:.4g} days, not in {len(time)}"
        )
    from scipy import stats  # noqa: PLC0415, half a second that those who show an uncertainty alone do not wait for

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
    """Estimate the correlation of adjacent values from deviations about a fitted line.

    A line fitted to n values biases the estimate by about ``-(2 + 4 r) / n`` (for a mean see M. G. Kendall, Biometrika
    41, 1954), which is corrected. The tests measure how often the resulting interval covers the true rate.
    """
    energy, count = float(np.sum(deviation**2)), len(deviation)
    if energy == 0:
        return 0.0
    found = float(np.sum(deviation[1:] * deviation[:-1])) / energy
    return min((found + 2 / count) / (1 - 4 / count), MAX_CORRELATION)


def last_fall(time: Values, clearance: Values, least: float) -> Fall | None:
    """Find the last place where the clearance falls and stays low, from the medians of the blocks before and after.

    Parameters
    ----------
    time, clearance : ndarray, shape (blocks,)
        Block medians: time in days and clearance in mm.
    least : float
        Smallest fall to report, in mm; a fall must also exceed the scatter.

    Returns
    -------
    Fall or None
        Its window extends from between the two blocks to the last of `time`.
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
    # adjacent places detect the same fall; it lies at the steepest step
    near = found[found > found[-1] - _FALL_BLOCKS]
    place = int(near[np.argmin(steps[near])])
    return Fall(size=float(sizes[place]), window=float(time[-1] - (time[place] + time[place + 1]) / 2))


def _check_record(time: Values, clearance: Values) -> None:
    """Refuse a record that is empty, not finite, not in chronological order, or too short for a rate."""
    if len(time) != len(clearance) or not len(time):
        raise SpecificationError(
            f"the record must have a time for each clearance, not {len(time)} for {len(clearance)}"
        )
    if not (np.all(np.isfinite(time)) and np.all(np.isfinite(clearance))):
        raise SpecificationError("the record must hold finite times and clearances, not NaN or infinity")
    if np.any(np.diff(time) < 0):
        raise SpecificationError("the record must be in chronological order, not go back in time")
    if not time[-1] > time[0]:
        raise SpecificationError("the record must span more than 0 days for a rate of wear, not 0 days")


def _recent(time: Values, window: float | None) -> slice:
    """Return where the last `window` days of the record are; all of it by default."""
    if window is not None and not 0 < window < math.inf:
        raise SpecificationError(f"window must be a time above 0 days, not {window:g} days")
    recent = slice(0 if window is None else int(np.searchsorted(time, time[-1] - window)), None)
    if not time[-1] > time[recent][0]:
        before = float(time[-1] - time[time < time[-1]][-1])
        raise SpecificationError(
            f"window must be at least {before:.4g} days, from the last reading to one before it, not {window:g} days"
        )
    return recent


def judge(
    time: Values,
    clearance: Values,
    limits: WearLimits,
    *,
    block: float | None = None,
    window: float | None = None,
    confidence: float = 0.95,
    uncertainty: Callable[[float, float], ClearanceUncertainty] | None = None,
) -> WearReport:
    """Assess the wear from a clearance record.

    The interval of the remaining life follows from the ends of the rate's interval and from the scatter of the present
    clearance at the same confidence. It assumes that wear continues at this rate. With an `uncertainty`, the interval
    of the wear is that of a reading, that of the rate also holds the uncertainty of the rise over the record, and that
    of the remaining life follows from both.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time in days, not decreasing.
    clearance : ndarray, shape (n,)
        Clearance in mm, finite.
    limits : WearLimits
        Limits to assess against.
    block : float, optional
        Length of a block in days; see `block_medians`.
    window : float, optional
        Estimate the rate from this many days at the end of the record only.
    confidence : float
        Confidence level of the intervals, between 0 and 1.
    uncertainty : callable, optional
        What the clearances are worth, for the first and the last block's clearance in mm.

    Raises
    ------
    SpecificationError
        If the record is empty, not finite, not in chronological order, or too short for a rate.
    """
    _check_record(time, clearance)
    recent = _recent(time, window)
    times, medians, counts, length = block_medians(time[recent], clearance[recent], block)
    rate = rate_of(times, medians, length, confidence)
    fall = last_fall(times, medians, MIN_FALL * limits.limit)
    now, last_block = float(medians[-1]), int(counts[-1])
    remaining = max(limits.critical_clearance - now, 0.0)
    gone = float(time[-1] - times[-1])
    off = float(special.ndtri((1 + confidence) / 2)) * rate.scatter
    known = None if uncertainty is None else uncertainty(float(medians[0]), now)
    if known is not None:
        off = float(special.stdtrit(known.freedom, (1 + confidence) / 2)) * known.standard
        rate = _with_rise(rate, known, float(times[-1] - times[0]), confidence)
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
        wear_low=now - off - limits.initial,
        wear_high=now + off - limits.initial,
        remaining=remaining,
        rate=rate,
        fall=None if fall is None else replace(fall, window=fall.window + gone),
        life=_life(remaining, rate.rate, gone),
        life_low=_life(max(remaining - off, 0.0), rate.high, gone),
        life_high=_life(remaining + off if remaining else 0.0, rate.low, gone),
        last=float(clearance[-1]),
        state=states[-1],
        uncertainty=known,
        first_warning=float(time[warned.index(True)]) if any(warned) and limits.warning is not None else None,
        first_critical=float(time[critical.index(True)]) if any(critical) else None,
        warnings=sum(state is not WearState.GOOD for state in end),
        criticals=sum(state is WearState.CRITICAL for state in end),
        last_block=last_block,
    )


def _with_rise(rate: WearRate, known: ClearanceUncertainty, span: float, confidence: float) -> WearRate:
    """Widen the interval of a rate by the uncertainty of the rise over `span` days; independent, so squares add."""
    of_rise = float(special.stdtrit(known.freedom, (1 + confidence) / 2)) * known.rise / span
    return replace(
        rate,
        low=rate.rate - math.hypot(rate.rate - rate.low, of_rise),
        high=rate.rate + math.hypot(rate.high - rate.rate, of_rise),
    )


def _life(remaining: float, rate: float, gone: float) -> float | None:
    """Return the days until `remaining` mm are worn at `rate` in mm per day, minus the days `gone`; None for never."""
    if remaining == 0:
        return 0.0
    life = remaining / rate if rate > 0 else math.inf
    return max(life - gone, 0.0) if life < math.inf else None
