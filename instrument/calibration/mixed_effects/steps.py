"""A step of the sensor on one of the last days: whether there was one, and what is known of the sensor if there was.

The evidence of the model with one step of the voltage's offset, of the type's tolerance and from some day on, is
compared with that of the model without. A step that is past doubt is told. Where it is only more probable than none,
which one day of measurements often leaves open, it cannot be told, but intervals must hold in either case: they are the
wider of both. The curve is the mean of both by their probabilities.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass, replace

import numpy as np

from sosmith.instrument.calibration.health.explanation import steps_of_the_voltage
from sosmith.instrument.calibration.mixed_effects.model import RATIOS, SCATTERS, Model, Posterior
from sosmith.instrument.calibration.sensor_type import TERMS, SensorType
from sosmith.model.arithmetic.stacked_matrices import applied, product
from sosmith.model.arrays import Values

FEWEST_DAYS = 3
"""Days from which on a step can be told from an error of a day."""

RECENT = 10
"""Days, counted back from the last, on each of which a step is looked for; what was before, the health charts tell."""

CERTAIN = math.log(100.0)
"""Logarithm of the evidence for a step, over that for none, from which on it is told. The evidence is divided by the
number of days that there are to choose from: by Markov's inequality, a sensor of the type then has at most one false
alarm in 100 fits."""

COARSE = 1.0
"""What the evidence may gain where the scatters are not those that are likeliest without a step."""

LARGE = 3.0
"""A step that is told may be as large as so many tolerances: the measurements since say how large it is."""

STEP = 1.5
"""Ratio of neighbouring points of the grid of scatters."""

FRESH, POSSIBLE, LATER = 3, 0.0, 1.0
"""Last days on which a step is possible, so that intervals must hold in either case; the same without that division
from which on it is: as probable as none on the last day; and what more it must be for each day since, which would have
shown it. What began earlier has had the days to show. Of sensors without a step, about one fit in five has such a day
(`python -m benchmarks.days`)."""


@dataclass(frozen=True, eq=False)
class Step:
    """A step that there may have been.

    Attributes
    ----------
    day : int
        Ordinal of the first day with it.
    days : int
        Days that it was chosen from.
    size : float
        Step of the voltage in V, posterior mean.
    evidence : float
        Logarithm of the probability of the measurements with a step on that day over that without.
    posterior : Posterior
        What is known of the day of the calibration if there was one.
    """

    day: int
    days: int
    size: float
    evidence: float
    posterior: Posterior

    @property
    def told(self) -> bool:
        """Whether it is past doubt."""
        return self.evidence - math.log(self.days) > CERTAIN

    @property
    def weight(self) -> float:
        """Probability of a step on that day, beforehand as probable as none."""
        return 1.0 / (1.0 + math.exp(-self.evidence))

    def on(self, model: Model, plain: Posterior, date: int) -> Step:
        """Return the same step with size and posterior for the day of ordinal `date`.

        `model` and `plain` are those without a step; the parameters of `step_of`.
        """
        times = LARGE if self.told else 1.0
        stepped = _with_step(model, model.rows.days.index(self.day), times)
        found = stepped.posterior(stepped.scatters(), plain.curves, date)
        size = times * float(found.scatters.mean_of(found.mean)[-1]) * model.sensor_type.offset
        return replace(self, size=size, posterior=_collapsed(found, times))

    def averaged(self, plain: Posterior) -> Posterior:
        """Return what is known of the day of the calibration whether the sensor stepped or not.

        Its pairs of scatters are those of both posteriors, by the probability of a step.
        """
        other = self.posterior
        wider = other.factor.shape[1] - plain.factor.shape[1]  # the step's own column
        factor = np.pad(plain.factor, ((0, 0), (0, wider), (0, 0)))
        return replace(
            plain,
            scatters=plain.scatters.together(other.scatters, self.weight),
            mean=np.concatenate((plain.mean, other.mean), axis=-1),
            factor=np.concatenate((factor, other.factor), axis=-1),
            offset=_joined(plain.offset, other.offset),
            slope=_joined(plain.slope, other.slope),
            curve_factor=_joined(plain.curve_factor, other.curve_factor),
        )

    @property
    def sentence(self) -> str:
        """What is to be known of it."""
        date = datetime.date.fromordinal(self.day).isoformat()
        if self.told:
            return (
                f"the voltage stepped by about {self.size:+.2g} V on {date}: the measurements before belong to another "
                "curve, and intervals are wider by it"
            )
        return (
            f"the voltage may have stepped by about {self.size:+.2g} V on {date}: the measurements since cannot tell a "
            "step from the errors of days, and intervals hold in either case"
        )


def _joined(values: Values | None, more: Values | None) -> Values | None:
    return None if values is None or more is None else np.concatenate((values, more), axis=-1)


def step_of(model: Model, plain: Posterior, date: int) -> Step | None:
    """Return the most probable step if it is possible, else None.

    Parameters
    ----------
    model : Model
        Without a step.
    plain : Posterior
        Its posterior for the day `date`.
    date : int
        Ordinal, not before the last measurement.
    """
    rows = model.rows
    if len(rows.days) < FEWEST_DAYS:
        return None
    at = plain.scatters.likeliest
    last = len(rows.days) - 1
    days = range(max(1, len(rows.days) - RECENT), len(rows.days))
    plainly = model.evidence(at.scatter, at.ratio)
    first = {k: _with_step(model, k).evidence(at.scatter, at.ratio) - plainly for k in days}
    if max(first.values()) <= POSSIBLE - COARSE:
        return None
    own = plain.scatters.scatter
    scatters = SCATTERS[(own.min() / STEP <= SCATTERS) & (own.max() * STEP >= SCATTERS)]
    without = model.evidence(scatters, RATIOS)
    past_doubt = CERTAIN + math.log(len(days))
    best = max(days, key=lambda k: first[k])
    fresh = max(days[-FRESH:], key=lambda k: first[k] - LATER * (last - k))
    for day, least in ((best, past_doubt), (fresh, POSSIBLE + LATER * (last - fresh))):
        evidence = _with_step(model, day).evidence(scatters, RATIOS) - without
        if evidence > least:
            one = Step(rows.days[day], len(days), 0.0, evidence, plain)
            return one.on(model, plain, date)
    return None


def _direction(known: SensorType) -> Values:
    """Return what a step of the voltage by the type's tolerance is in deviations, shape (5,)."""
    return steps_of_the_voltage(known)[0]


def _with_step(model: Model, day: int, times: float = 1.0) -> Model:
    """Return the model with one deviation more: a step from the day of this index on, of so many tolerances."""
    rows = model.rows
    step = np.where(rows.day >= day, times * applied(_direction(model.sensor_type)[None], rows.a)[0], 0.0)
    return Model.of(model.sensor_type, replace(rows, a=np.concatenate((rows.a, step[None]))), model.weights)


def _collapsed(found: Posterior, times: float) -> Posterior:
    """Return the posterior of the deviations with the step as part of them, for the day of the calibration."""
    size = len(TERMS)
    join = np.concatenate((np.eye(size), times * _direction(found.sensor_type)[:, None]), axis=1)[..., None]
    return replace(
        found,
        mean=applied(join, found.mean),
        factor=product(join, found.factor),
        slope=None if found.slope is None else found.slope[:, :size],
    )
