"""Vehicle motion for scenario files: the change of clearance at one sensor, at the paper's speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.run import run
from sosmith.instrument.vehicle.track import curved_track, tangent_track
from sosmith.model.arrays import Values

SPEED = 20.0
"""Speed of the vehicle in m/s, as in section 5.1 of the paper."""

IRREGULARITY = "low"
"""Level of the random irregularities."""

WHEELSET = 0
"""Index of the wheelset whose right flange the sensor faces: the leading one."""

MIN_RATE = 1.0
"""Lowest sample rate in Hz of the vehicle model."""


def vehicle_clearance(track: str, time: Values, seed: int, *, model: str = "nonlinear") -> Values:
    """Return the change of the clearance in mm on the paper's curve or on tangent track, of the shape of `time`.

    The track is extended straight as far as `time` requires.

    Parameters
    ----------
    track : {"paper", "tangent"}
    time : ndarray, shape (n,)
        Time in s, equally spaced from 0.
    seed : int
        Seed of the random irregularities, 0 or more.
    model : {"nonlinear", "linear"}, optional
        Of the contacts of wheels and rails.

    Raises
    ------
    SpecificationError
        As for `sosmith.instrument.vehicle.run.run`.
    """
    parameters = built_in()
    rate = (len(time) - 1) / time[-1] if len(time) > 1 else MIN_RATE
    way = SPEED * (len(time) + 1) / rate
    table = parameters.track
    table = replace(table, run_out=max(table.run_out, way - table.tangent - 2 * table.spiral - table.curve))
    made = (curved_track if track == "paper" else tangent_track)(table)
    motion = run(
        parameters,
        made,
        speed=SPEED,
        sample_rate=rate,
        irregularity=IRREGULARITY,
        seed=seed,
        model=model,
        distance=way,
    )
    return np.asarray(motion.clearance_mm[: len(time), WHEELSET])
