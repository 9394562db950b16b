"""What explains measurements far better than the errors of a day that the type expects: other errors, told in words.

The evidence of the model, the probability of the measurements under it, is compared with that of models of other
errors: those of a day vary over a shorter or a longer clearance, or part of them stays from day to day. Intervals of
the model hold less than they say where another one is far more probable.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sosmith.instrument.calibration.mixed_effects.model import NEGLIGIBLE, RATIOS, SCATTERS, Model
from sosmith.instrument.calibration.mixed_effects.systematic_error import SystematicCurves
from sosmith.model.arrays import Values

FEWEST_DAYS = 3
"""Days from which on errors of a day can be told from others."""

CERTAIN = 4.6
"""Difference of the logarithms of the evidence from which on another model is told: a hundred times as probable."""

LENGTHS = (0.25, 0.5, 2.0, 10.0)
"""Correlation lengths that are compared, relative to the type's; with the last one, an error is an offset."""

POSSIBLE = -3.0
"""The same from which on another model is possible: a twentieth as probable, what intervals of 95 % leave out."""

LASTING = 3.0
"""Standard deviation of an error that stays, relative to what the type expects of the error of a day."""


def doubts_of(
    model: Model, curves: SystematicCurves, clearance: Values, weights: Values, *, of_day: bool
) -> tuple[str, ...]:
    """Return a sentence for each model that is far more probable, or that would leave the day's curve less certain.

    Parameters
    ----------
    model : Model
        The model of the type.
    curves : SystematicCurves
        Its errors of a day.
    clearance, weights : ndarray, shape (n,)
        Clearance in mm of each row, and 0 for those that are left out.
    of_day : bool
        Whether there are measurements of the day of the calibration: its intervals then rest on how far an error of a
        day reaches, whether the polynomial follows that or not.
    """
    if len(model.rows.days) < FEWEST_DAYS:
        return ()
    known = model.sensor_type
    coarse = model.weighed(SCATTERS, RATIOS)
    scatters = SCATTERS[np.isin(SCATTERS, coarse.scatter[coarse.weight > NEGLIGIBLE])]

    def evidence_of(a: Values, h: Values) -> float:
        rows = replace(model.rows, a=a, h=h)
        return Model.of(known, rows, weights).evidence(scatters, RATIOS)

    plain = evidence_of(model.rows.a, model.rows.h)
    others = {
        length: evidence_of(model.rows.a, replace(curves, correlation=length * known.correlation).columns(clearance))
        for length in LENGTHS
    }
    lasting = np.concatenate((model.rows.a, LASTING * known.systematic * model.rows.h))
    found = []
    stays = evidence_of(lasting, model.rows.h) - plain
    best = max(others, key=lambda length: others[length])
    if stays > max(CERTAIN, others[best] - plain):
        found.append(
            "the measurements of all days miss the curve alike, which its orders cannot follow: what is booked as the "
            "error of a day stays, and the intervals do not know that"
        )
    elif others[best] - plain > CERTAIN:
        longest = best == max(LENGTHS)
        what = "are the same at all clearances" if longest else f"vary over about {best * known.correlation:g} mm"
        found.append(
            f"the errors of a day {what}, not over {known.correlation:g} mm as those of the type {known.name}: a type "
            f"with correlation = {best * known.correlation:g} gives the right intervals"
        )
    elif of_day and others[min(LENGTHS)] - plain > POSSIBLE:
        found.append(
            f"the measurements are too few to tell over which clearance the errors of a day vary: if that is "
            f"{min(LENGTHS) * known.correlation:g} mm, not {known.correlation:g} mm as of the type {known.name}, "
            "the curve of the day is less certain than its intervals say"
        )
    return tuple(found)
