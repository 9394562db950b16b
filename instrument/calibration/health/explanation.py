"""What explains a change of a sensor best: its evidence, the probability of the measurements from the change on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sosmith.instrument.calibration.health.innovations import Belief, Course
from sosmith.instrument.calibration.sensor_type import TERMS, SensorType
from sosmith.model.arrays import Values

FOLLOWING = 5
"""Days from the change on that decide among the explanations, if the alarm came before."""

FASTER, LOUDER = 4.0, 2.0
"""How many times faster a sensor drifts, and how many times as much measurements scatter, where that is the reason."""


@dataclass(frozen=True)
class Reason:
    """A possible explanation.

    Attributes
    ----------
    name : str
        Key in JSON.
    text : str
        Clause for a sentence.
    belief : callable
        Changes the belief before the first day of the change, for a type of sensor.
    faster, louder : float
        Factors on drift and scatter from then on.
    """

    name: str
    text: str
    belief: Callable[[Belief, SensorType], Belief] = lambda belief, known: belief
    faster: float = 1.0
    louder: float = 1.0


def steps_of_the_voltage(known: SensorType) -> list[Values]:
    """Return what steps of the voltage's offset and gain by their tolerances are in deviations, each of shape (5,).

    A small step moves the curve by its slope over the voltage: the clearance of ``V - offset - gain V``.
    """
    _, c_v, _, c_vt, c_vv = known.curve
    slope = {(0, 0): c_v, (0, 1): c_vt, (1, 0): 2 * c_vv}
    by_gain = {(i + 1, j): c for (i, j), c in slope.items()}
    terms = np.array([[float(one.get(term, 0)) for one in known.deviations] for term in TERMS])
    moved = [
        [-tolerance * by.get(term, 0.0) for term in TERMS]
        for tolerance, by in ((known.offset, slope), (known.gain, by_gain))
    ]
    return [np.linalg.solve(terms, np.array(one)) for one in moved]


REASONS = (
    Reason("none", "the drift and scatter of the type explain it best: it may be chance"),
    Reason("drift", f"the sensor drifts about {FASTER:g} times faster than its type", faster=FASTER),
    Reason(
        "mounted anew",
        "all clearances stepped alike: the sensor was moved, or mounted anew",
        lambda belief, known: belief.changed([np.eye(len(TERMS))[0]]),
    ),
    Reason(
        "turned",
        "offset and gain of the voltage stepped: the sensor was turned, or its electronics adjusted",
        lambda belief, known: belief.changed(steps_of_the_voltage(known)),
    ),
    Reason(
        "another sensor",
        "everything changed within the tolerances of the type: this is another sensor",
        lambda belief, known: belief.of_another(),
    ),
    Reason("scatter", f"the measurements scatter about {LOUDER:g} times as much", louder=LOUDER),
)
"""All explanations, each as likely as the others beforehand."""


@dataclass(frozen=True)
class Explanation:
    """How well each of `REASONS` explains a change; `probabilities` are in their order, their sum is 1."""

    probabilities: tuple[float, ...]

    @property
    def best(self) -> Reason:
        """The likeliest one."""
        return REASONS[self.probabilities.index(max(self.probabilities))]


def explanation_of(course: Course, begin: int, alarm: int) -> Explanation:
    """Compare the explanations of a change that began on the day of index `begin` and was told on the day `alarm`."""
    days = course.days
    last = min(max(begin + FOLLOWING, alarm + 1), len(days))
    before = next(belief for k, (belief, _) in enumerate(course.beliefs()) if k == begin)
    evidence = []
    for reason in REASONS:
        belief, total = reason.belief(before, course.sensor_type), 0.0
        drifts = tuple(reason.faster**2 * drift for drift in course.sensor_type.drifts)
        if reason.faster > 1.0:  # the day before the change has drifted so already
            belief = belief.later(1, drifts)
        for k in range(begin, last):
            if k > begin:
                belief = belief.later(course.gaps[k], drifts)
            belief, _, one = days[k].louder(reason.louder).taken_in(belief)
            total += one
        evidence.append(total)
    highest = max(evidence)
    weights = [math.exp(one - highest) for one in evidence]
    return Explanation(tuple(weight / math.fsum(weights) for weight in weights))
