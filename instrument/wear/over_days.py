"""Wear over days from a clearance record: the state-space estimate, its risk at the limit, and what was told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from sosmith.gen.calibration.fit import NORMAL_CONSISTENCY
from sosmith.instrument.wear.assessment import WearLimits, block_medians
from sosmith.instrument.wear.state_space import DayReading, DayState, Told, WearModel, filtered
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError

FEWEST = 3
"""Days from which on their scatter is known, where nothing is stated."""

LEAST = 0.001
"""Smallest standard uncertainty of a day in mm: below the steps of any output."""

RISK = 0.05
"""Probability of being past the limit from which wear is critical."""


@dataclass(frozen=True, eq=False, kw_only=True)
class OverDays:
    """Wear of one wheel over days; lengths in mm, times in days.

    Attributes
    ----------
    limits : WearLimits
    states : list of DayState
        One for each day with readings.
    risk : float
        Probability of being past the limit from which wear is critical.
    confidence : float
        Of the intervals.
    day_error : float
        Standard uncertainty in mm of a day's reading, new each day: the mean over the days.
    stated : bool
        Whether it was stated, or taken from the scatter of the days.
    """

    limits: WearLimits
    states: list[DayState]
    risk: float
    confidence: float
    day_error: float
    stated: bool

    @property
    def now(self) -> DayState:
        """The last day."""
        return self.states[-1]

    @property
    def told(self) -> list[Told]:
        """What was told, in the order of the days."""
        return [one for state in self.states for one in state.told]

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the clearance."""
        return self.now.interval(self.confidence)

    @property
    def rate(self) -> tuple[float, float, float]:
        """Rate in mm a day and its interval."""
        mean, spread = self.now.rate()
        wide = float(special.ndtri((1 + self.confidence) / 2)) * spread
        return mean, mean - wide, mean + wide

    @property
    def past(self) -> float:
        """Probability that the clearance is past the critical one."""
        return self.now.beyond(self.limits.critical_clearance)

    @property
    def critical(self) -> bool:
        """Whether that probability is at least the risk."""
        return self.past >= self.risk

    @property
    def life(self) -> tuple[float | None, float | None, float | None]:
        """Days until the critical clearance: as likely as not, and the interval; None for no end in sight."""
        tail = (1 - self.confidence) / 2
        half, low, high = (self.now.life(self.limits.critical_clearance, p) for p in (0.5, tail, 1 - tail))
        return half, low, high


def over_days(
    time: Values,
    clearance: Values,
    limits: WearLimits,
    *,
    block: float | None = None,
    day_error: float | None = None,
    model: WearModel | None = None,
    risk: float = RISK,
    confidence: float = 0.95,
) -> OverDays:
    """Follow the wear of a wheel over days.

    Parameters
    ----------
    time, clearance, limits, block
        As for `sosmith.instrument.wear.assessment.judge`; a block is a day.
    day_error : float or None
        Standard uncertainty in mm of what is new each day in a reading; None takes it from the scatter of the days.
    model : WearModel or None
        What is known beforehand.
    risk, confidence : float
        Between 0 and 1; see `OverDays`.

    Raises
    ------
    SpecificationError
        If one of these is out of range; if there are fewer than `FEWEST` days and no `day_error`.
    """
    for name, value in (("risk", risk), ("confidence", confidence)):
        if not 0 < value < 1:
            raise SpecificationError(f"{name} must be between 0 and 1, not {value:g}")
    if day_error is not None and not LEAST <= day_error < np.inf:
        raise SpecificationError(f"day_error must be {LEAST:g} mm or more, not {day_error:g} mm")
    times, medians, _, _ = block_medians(time, clearance, block)
    spread = _scatter(medians) if day_error is None else day_error
    days = [
        DayReading(time=t, clearance=(d,), uncertainty=(spread,))
        for t, d in zip(times.tolist(), medians.tolist(), strict=True)
    ]
    return OverDays(
        limits=limits,
        states=filtered(days, model or WearModel()),
        risk=risk,
        confidence=confidence,
        day_error=spread,
        stated=day_error is not None,
    )


def _scatter(medians: Values) -> float:
    """Return the standard deviation of the days from the changes from day to day, which jumps hardly move."""
    if len(medians) < FEWEST:
        raise SpecificationError(
            f"the record must have readings on at least {FEWEST} days for their scatter, not on {len(medians)}"
        )
    steps = np.diff(medians)
    off = float(np.median(np.abs(steps - np.median(steps)))) * NORMAL_CONSISTENCY
    return max(off / float(np.sqrt(2.0)), LEAST)
