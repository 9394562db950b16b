"""Wear as a state over days: level and rate of each wheel, with jumps that are found, not assumed.

A reading errs by what all readings share (the calibration) and by what is new each day (the systematic error of a
day); its scatter within the day is small beside both. A Kalman filter over the days averages the latter out. Between
two days the level grows by the rate; on few days something happens: the level jumps (a wheel re-profiled or replaced, a
sensor exchanged or mounted anew), the rate changes, or a reading is off. Nobody says when, so each is a hypothesis
with a Kalman filter of its own, weighed by how well it predicts the readings; those that are unlikely are dropped, and
those that differ only in what happened long ago are merged (a Gaussian sum filter: D. L. Alspach and H. W. Sorenson,
IEEE Trans. Automatic Control 17, 1972).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy import special

from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError

LEVEL, RATE, SHARED = range(3)
"""States of a wheel: clearance in mm, its rate in mm a day, and what all readings share of their error in mm."""

STATES = 3

KEPT = 32
"""Hypotheses that are kept from a day to the next."""

LOOK_BACK = 14.0
"""Days after which something that happened is told no more, and hypotheses that differ in it are merged."""

TOLD = 0.7
"""Probability from which something that happened to a wheel is told, whatever it was: it is named by the likeliest. In
days in which nothing happens it is reached less than once in 1,000 (`python -m benchmarks.days`)."""

DIFFUSE = 10.0
"""Standard deviation in mm of the clearance before the first reading."""

BISECTIONS = 60
"""Steps to a quantile."""

LONGEST = 36500.0
"""Days beyond which a remaining life is no longer looked for."""


class Happening(StrEnum):
    """What may happen to a wheel on a day."""

    JUMP = "jump"
    RATE = "change of the rate"
    SENSOR = "change of the sensor"
    OFF = "reading off"


@dataclass(frozen=True, kw_only=True)
class WearModel:
    """What is known of wear beforehand. Lengths in mm, times in days; standard deviations 0 or more.

    Attributes
    ----------
    rate, rate_spread : float
        Expected rate in mm a day, and its standard deviation.
    level_walk, rate_walk : float
        Standard deviations of what level and rate change by in a day, beside the wear by the rate.
    jump, jumps : float
        Standard deviation of a jump of the level, and how often one comes, a day.
    rate_change, rate_changes : float
        The same of changes of the rate.
    sensor_change, sensor_changes : float
        The same of changes of what a sensor reads, as of one that is replaced. Only where the sum of both clearances is
        known can these be told from jumps of the level, and only there they are looked for.
    off, offs : float
        How many times its uncertainty a reading is off if it is, and how often that is, a day.
    shared : float
        Standard uncertainty that all readings share: that of the calibration.

    Raises
    ------
    SpecificationError
        If a standard deviation is negative, or happenings leave no day without one.
    """

    rate: float = 0.05
    rate_spread: float = 0.05
    level_walk: float = 0.005
    rate_walk: float = 0.0003
    jump: float = 0.5
    jumps: float = 1 / 100
    rate_change: float = 0.06
    rate_changes: float = 1 / 200
    sensor_change: float = 0.3
    sensor_changes: float = 1 / 500
    off: float = 5.0
    offs: float = 1 / 200
    shared: float = 0.0

    def __post_init__(self) -> None:
        for name in ("rate_spread", "level_walk", "rate_walk", "jump", "rate_change", "sensor_change", "off", "shared"):
            if not 0 <= getattr(self, name) < math.inf:
                raise SpecificationError(f"{name} must be 0 or more, not {getattr(self, name):g}")
        shares = (self.jumps, self.rate_changes, self.sensor_changes, self.offs)
        if not (min(shares) > 0 and sum(shares) < 0.5):
            raise SpecificationError(
                "jumps, rate_changes, sensor_changes and offs must be above 0 and below 0.5 a day together, not "
                f"{sum(shares):g}"
            )


@dataclass(frozen=True, kw_only=True)
class DayReading:
    """What is read on one day.

    Attributes
    ----------
    time : float
        In days.
    clearance : tuple of float
        Of each wheel in mm; NaN for none.
    uncertainty : tuple of float
        Standard uncertainty in mm of each, without what all readings share; above 0.
    total : float or None
        Sum of the clearances of both wheels in mm where it is known, such as by a gauge over the axle.
    total_uncertainty : float
        Its standard uncertainty in mm, above 0.
    """

    time: float
    clearance: tuple[float, ...]
    uncertainty: tuple[float, ...]
    total: float | None = None
    total_uncertainty: float = 0.03


@dataclass(frozen=True)
class Event:
    """Something that happened to a wheel: when, what, and the state just before it that it changed, in mm."""

    time: float
    wheel: int
    what: Happening
    before: float


@dataclass(frozen=True)
class Told:
    """An event that is told.

    Attributes
    ----------
    event : Event
    at : float
        Day on which it was told.
    probability : float
        That something happened to this wheel in the `LOOK_BACK` days before.
    size : float
        Of a jump, or of what a sensor reads more, in mm; of a change of the rate, the rate now in mm a day.
    """

    event: Event
    at: float
    probability: float
    size: float


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """What may be so: weights of shape (k,), which sum to 1, means (k, n) and covariances (k, n, n) of the states."""

    weight: Values
    mean: Values
    covariance: Values
    events: tuple[tuple[Event, ...], ...]


@dataclass(frozen=True, eq=False)
class DayState:
    """What is known of the wheels on a day, from the readings up to then.

    Attributes
    ----------
    time : float
        The day.
    hypotheses : Hypotheses
        Weighted normal distributions.
    told : tuple of Told
        What was told on this day for the first time.
    """

    time: float
    hypotheses: Hypotheses
    told: tuple[Told, ...]

    def level(self, wheel: int = 0) -> tuple[float, float]:
        """Return mean and standard deviation of the clearance in mm."""
        return self._moments(STATES * wheel + LEVEL)

    def rate(self, wheel: int = 0) -> tuple[float, float]:
        """Return mean and standard deviation of the rate in mm a day."""
        return self._moments(STATES * wheel + RATE)

    def _moments(self, k: int) -> tuple[float, float]:
        found = self.hypotheses
        mean = float(found.weight @ found.mean[:, k])
        spread = found.covariance[:, k, k] + (found.mean[:, k] - mean) ** 2
        return mean, math.sqrt(float(found.weight @ spread))

    def beyond(self, clearance: float, wheel: int = 0, after: float = 0.0) -> float:
        """Return the probability that the clearance is beyond one in mm, now or some days `after` at the rate then."""
        k, found = STATES * wheel, self.hypotheses
        mean = found.mean[:, k + LEVEL] + after * found.mean[:, k + RATE]
        p = found.covariance
        variance = p[:, k, k] + 2 * after * p[:, k, k + RATE] + after**2 * p[:, k + RATE, k + RATE]
        return float(found.weight @ special.ndtr((mean - clearance) / np.sqrt(np.maximum(variance, 1e-18))))

    def interval(self, share: float, wheel: int = 0) -> tuple[float, float]:
        """Return the clearances in mm between which it is with probability `share`, the rest in equal parts beside."""
        mean, spread = self.level(wheel)
        ends = []
        for probability in ((1 + share) / 2, (1 - share) / 2):
            low, high = mean - 20 * spread - 1e-9, mean + 20 * spread + 1e-9
            for _ in range(BISECTIONS):
                middle = (low + high) / 2
                low, high = (middle, high) if self.beyond(middle, wheel) > probability else (low, middle)
            ends.append((low + high) / 2)
        return ends[0], ends[1]

    def life(self, clearance: float, probability: float = 0.5, wheel: int = 0) -> float | None:
        """Return the days until the clearance is beyond one in mm with a probability; None if not in `LONGEST`."""
        if self.beyond(clearance, wheel) >= probability:
            return 0.0
        if self.beyond(clearance, wheel, LONGEST) < probability:
            return None
        low, high = 0.0, LONGEST
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            low, high = (low, middle) if self.beyond(clearance, wheel, middle) >= probability else (middle, high)
        return high


def filtered(days: Sequence[DayReading], model: WearModel) -> list[DayState]:
    """Return the state on each day, from the readings up to that day.

    Raises
    ------
    SpecificationError
        If there is no day, days are not in chronological order, or the wheels are not one or two and the same on all.

    Examples
    --------
    >>> days = [DayReading(time=t, clearance=(3.0 + 0.05 * t,), uncertainty=(0.1,)) for t in range(30)]
    >>> level, spread = filtered(days, WearModel())[-1].level()
    >>> abs(level - 4.45) < 0.01, spread < 0.05
    (True, True)
    """
    wheels = len(days[0].clearance) if days else 0
    if wheels not in {1, 2} or any(len(one.clearance) != wheels for one in days):
        raise SpecificationError(f"the record must have one or two wheels on every day, not {wheels}")
    if any(later.time < day.time for day, later in itertools.pairwise(days)):
        raise SpecificationError("the record must be in chronological order, not go back in time")
    now, before, told = _beginning(wheels, model), days[0].time, list[Told]()
    states = []
    for number, day in enumerate(days):
        now = _updated(_branched(_grown(now, day.time - before, model), day, model, quiet=not number), day)
        before, new = day.time, _new(now, day.time, wheels, told)
        told += new
        now = _merged(now, day.time)
        states.append(DayState(day.time, now, tuple(new)))
    return states


def _beginning(wheels: int, model: WearModel) -> Hypotheses:
    mean = np.tile([0.0, model.rate, 0.0], wheels)
    variance = np.tile(np.array([DIFFUSE, model.rate_spread, model.shared]) ** 2, wheels)
    return Hypotheses(np.ones(1), mean[None], np.diag(variance)[None], ((),))


def _grown(now: Hypotheses, gap: float, model: WearModel) -> Hypotheses:
    """Let `gap` days pass."""
    size = now.mean.shape[1]
    step, noise = np.eye(size), np.zeros((size, size))
    for k in range(0, size, STATES):
        step[k + LEVEL, k + RATE] = gap
        noise[k + LEVEL, k + LEVEL] = gap * model.level_walk**2 + gap**3 / 3 * model.rate_walk**2
        noise[k + RATE, k + RATE] = gap * model.rate_walk**2
        noise[k + LEVEL, k + RATE] = noise[k + RATE, k + LEVEL] = gap**2 / 2 * model.rate_walk**2
    return replace(now, mean=now.mean @ step.T, covariance=step @ now.covariance @ step.T + noise)


_STATE = {Happening.JUMP: LEVEL, Happening.RATE: RATE, Happening.SENSOR: SHARED, Happening.OFF: LEVEL}
"""The state that something changes, or belongs to."""

_Branch = tuple[float, Values, Values, tuple[tuple[int, Happening], ...]]
"""How likely it is, variance added to the states, variance of the readings, and what happened to which wheels."""


@dataclass(frozen=True, eq=False)
class _Branched:
    """Hypotheses with what may have happened on the day; `noise` is the variance of each reading, shape (k, wheels)."""

    hypotheses: Hypotheses
    noise: Values


def _branched(now: Hypotheses, day: DayReading, model: WearModel, *, quiet: bool) -> _Branched:
    """Add to each hypothesis what may happen on a day; nothing where `quiet`, on the first one."""
    wheels, size = len(day.clearance), now.mean.shape[1]
    own = np.array(day.uncertainty, dtype=np.float64) ** 2
    several = [(wheel,) for wheel in range(wheels)] + [(0, 1)] * (wheels > 1)
    each = (
        (Happening.JUMP, model.jumps, LEVEL, model.jump),
        (Happening.RATE, model.rate_changes, RATE, model.rate_change),
    )
    of_sensor = ((Happening.SENSOR, model.sensor_changes, SHARED, model.sensor_change),)
    possible = [(one, some, len(several)) for one in each for some in several]
    if day.total is not None:  # two sensors are not replaced on one day by chance
        possible += [(one, some, wheels) for one in of_sensor for some in several[:wheels]]
    branches: list[_Branch] = [(1.0, np.zeros(size), own, ())]
    if not quiet:
        for (what, share, state, spread), some, ways in possible:
            added = np.zeros(size)
            added[[STATES * wheel + state for wheel in some]] = spread**2
            branches.append((share / ways, added, own, tuple((wheel, what) for wheel in some)))
        for wheel in range(wheels):
            noise = own.copy()
            noise[wheel] *= model.off**2
            branches.append((model.offs / wheels, np.zeros(size), noise, ((wheel, Happening.OFF),)))
        branches[0] = (1.0 - sum(one[0] for one in branches[1:]), *branches[0][1:])
    weight = np.concatenate([share * now.weight for share, *_ in branches])
    covariance = np.concatenate([now.covariance + np.diag(added) for _, added, _, _ in branches])
    events = tuple(
        (
            *events,
            *(Event(day.time, wheel, what, float(mean[STATES * wheel + _STATE[what]])) for wheel, what in happened),
        )
        for _, _, _, happened in branches
        for events, mean in zip(now.events, now.mean, strict=True)
    )
    noise = np.concatenate([np.tile(noise, (len(now.weight), 1)) for _, _, noise, _ in branches])
    return _Branched(Hypotheses(weight, np.tile(now.mean, (len(branches), 1)), covariance, events), noise)


def _updated(branched: _Branched, day: DayReading) -> Hypotheses:
    """Take in the readings of a day one after the other, and keep the likeliest hypotheses."""
    found, size = branched.hypotheses, branched.hypotheses.mean.shape[1]
    rows = []
    for wheel, clearance in enumerate(day.clearance):
        if not math.isnan(clearance):
            h = np.zeros(size)
            h[[STATES * wheel + LEVEL, STATES * wheel + SHARED]] = 1.0
            rows.append((h, clearance, branched.noise[:, wheel]))
    if day.total is not None:
        h = np.zeros(size)
        h[LEVEL::STATES] = 1.0
        rows.append((h, day.total, np.full(len(found.weight), day.total_uncertainty**2)))
    mean, covariance = found.mean, found.covariance
    logarithm = np.log(found.weight)
    for h, value, noise in rows:
        shared = covariance @ h
        variance = shared @ h + noise
        off = value - mean @ h
        logarithm = logarithm - off**2 / variance / 2 - np.log(variance) / 2
        mean = mean + shared * (off / variance)[:, None]
        covariance = covariance - shared[:, :, None] * shared[:, None, :] / variance[:, None, None]
    weight = np.exp(logarithm - logarithm.max())
    best = np.sort(np.argsort(-weight, kind="stable")[:KEPT])
    weight = weight[best] / weight[best].sum()
    return Hypotheses(weight, mean[best], covariance[best], tuple(found.events[k] for k in best))


def _merged(now: Hypotheses, time: float) -> Hypotheses:
    """Forget what happened long ago, and merge hypotheses that differ in nothing else, with their moments."""
    alike: dict[tuple[tuple[float, int, Happening], ...], list[int]] = {}
    recent = [tuple(one for one in events if one.time > time - LOOK_BACK) for events in now.events]
    for k, kept in enumerate(recent):
        alike.setdefault(tuple((one.time, one.wheel, one.what) for one in kept), []).append(k)
    weights, means, covariances = [], [], []
    for some in alike.values():
        share = now.weight[some] / now.weight[some].sum()
        mean = share @ now.mean[some]
        off = now.mean[some] - mean
        spread = now.covariance[some] + off[:, :, None] * off[:, None, :]
        weights.append(now.weight[some].sum())
        means.append(mean)
        covariances.append(np.tensordot(share, spread, 1))
    events = tuple(recent[max(some, key=lambda k: float(now.weight[k]))] for some in alike.values())
    return Hypotheses(np.array(weights), np.array(means), np.array(covariances), events)


def _new(now: Hypotheses, time: float, wheels: int, told: Sequence[Told]) -> list[Told]:
    """Return what is told on this day: what likely happened to a wheel since something was last told of it.

    For `LOOK_BACK` days after that nothing else is told of the wheel: readings that were off first, and then are not,
    would be told as a jump there and one back.
    """
    found = []
    for wheel in range(wheels):
        since = max((one.at for one in told if one.event.wheel == wheel), default=-math.inf)
        if time <= since + LOOK_BACK:  # what was told is still being made out
            continue
        having = [
            (float(weight), k, event)
            for k, (weight, events) in enumerate(zip(now.weight, now.events, strict=True))
            for event in [next((one for one in reversed(events) if one.wheel == wheel and _lasts(one)), None)]
            if event is not None and event.time > max(time - LOOK_BACK, since)
        ]
        probability = sum(weight for weight, _, _ in having)
        if probability < TOLD:
            continue
        shares = {what: sum(one[0] for one in having if one[2].what is what) for what in _SIZED}
        what = max(shares, key=lambda one: shares[one])
        _, k, event = max((one for one in having if one[2].what is what), key=lambda one: one[0])
        level, rate, shared = now.mean[k, STATES * wheel : STATES * (wheel + 1)].tolist()
        sizes = (level - rate * (time - event.time) - event.before, rate, shared - event.before)
        found.append(Told(event, time, min(probability, 1.0), float(sizes[_SIZED.index(what)])))
    return found


_SIZED = (Happening.JUMP, Happening.RATE, Happening.SENSOR)
"""What is told, in the order of the states that it changes."""


def _lasts(event: Event) -> bool:
    return event.what in _SIZED
