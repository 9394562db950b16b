"""The results of a vehicle run: figures as JSON, motion as CSV."""

from __future__ import annotations

import io
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from sosmith.instrument.vehicle.choices import TRACK_NAMES
from sosmith.instrument.vehicle.lateral import lateral_dynamics
from sosmith.instrument.vehicle.limits import QUOTIENT, Limits, limits
from sosmith.instrument.vehicle.linear_motion import Mode
from sosmith.instrument.vehicle.motion import Motion
from sosmith.instrument.vehicle.parameters import Parameters
from sosmith.instrument.vehicle.run import run
from sosmith.instrument.vehicle.track import curved_track, tangent_track
from sosmith.instrument.vehicle.vertical import vertical_dynamics

TRACKS = dict(zip(TRACK_NAMES, (curved_track, tangent_track), strict=True))
"""Tracks by name."""


@dataclass(frozen=True, kw_only=True, eq=False)
class VehicleRun:
    """A run over a track: its settings, its motion and its limits.

    Attributes
    ----------
    parameters : Parameters
    track : str
        One of `TRACKS`.
    speed, sample_rate : float
        In m/s and Hz.
    irregularities : str
        "none", "low" or "high".
    seed : int
    model : str
        "nonlinear" or "linear".
    motion : Motion
    limits : Limits
    lateral_modes, vertical_modes : tuple of Mode
    """

    parameters: Parameters
    track: str
    speed: float
    sample_rate: float
    irregularities: str
    seed: int
    model: str
    motion: Motion
    limits: Limits
    lateral_modes: tuple[Mode, ...]
    vertical_modes: tuple[Mode, ...]


def vehicle_run(
    parameters: Parameters,
    *,
    track: str,
    speed: float,
    sample_rate: float,
    irregularities: str,
    seed: int,
    model: str = "nonlinear",
) -> VehicleRun:
    """Run the vehicle over one of `TRACKS`; raises what `sosmith.instrument.vehicle.run.run` raises."""
    made = TRACKS[track](parameters.track)
    level = None if irregularities == "none" else irregularities
    motion = run(parameters, made, speed=speed, sample_rate=sample_rate, irregularity=level, seed=seed, model=model)
    return VehicleRun(
        parameters=parameters,
        track=track,
        speed=speed,
        sample_rate=sample_rate,
        irregularities=irregularities,
        seed=seed,
        model=model,
        motion=motion,
        limits=limits(parameters, made, motion),
        lateral_modes=lateral_dynamics(parameters, speed).system.modes(),
        vertical_modes=vertical_dynamics(parameters).system.modes(),
    )


def largest(motion: Motion) -> dict[str, float]:
    """Largest magnitude of every motion, by the names of the columns."""
    return {
        name: float(np.abs(values).max()) for name, values in motion.columns() if name not in ("time_s", "distance_m")
    }


def acceleration(motion: Motion) -> float:
    """Largest magnitude of the lateral acceleration felt in the body, in m/s^2."""
    return float(np.abs(motion.body_acceleration).max())


def vehicle_json(made: VehicleRun) -> dict[str, Any]:
    """Return settings, modes, largest motions and limits of a run; units are in the keys."""
    found = made.limits
    return {
        "track": made.track,
        "speed_m_s": made.speed,
        "sample_rate_Hz": made.sample_rate,
        "irregularities": made.irregularities,
        "seed": made.seed,
        "model": made.model,
        "samples": len(made.motion.time),
        "modes": {"lateral": _modes(made.lateral_modes), "vertical": _modes(made.vertical_modes)},
        "largest": largest(made.motion),
        "body_acceleration_m_s2": acceleration(made.motion),
        "limits": [
            {
                "wheelset": k + 1,
                "beyond_flange_mm": 1e3 * float(found.beyond_flange[k]),
                "beyond_flange_share": float(found.beyond_flange_share[k]),
                "flange_force_kN": 1e-3 * float(found.flange_force[k]),
                "friction_used": float(found.friction_used[k]),
                "friction_exceeded_share": float(found.friction_exceeded_share[k]),
                "sliding_share": float(found.sliding_share[k]),
                "derailment_quotient": float(found.derailment_quotient[k]),
                "derailment_quotient_over_2_m": float(found.sliding_quotient[k]),
                "guiding_sum_over_2_m_kN": 1e-3 * float(found.guiding_sum[k]),
                "load_share": float(found.load_share[k]),
            }
            for k in range(6)
        ],
        "nadal_limit": found.nadal,
        "quotient_limit_over_2_m": QUOTIENT,
        "prudhomme_limit_kN": 1e-3 * found.prudhomme,
        "within_limits": found.kept,
    }


def _modes(modes: tuple[Mode, ...]) -> list[dict[str, Any]]:
    return [
        {
            "frequency_Hz": mode.frequency,
            "damping_ratio": mode.damping,
            "growth_per_s": mode.growth,
            "coordinate": mode.coordinate,
        }
        for mode in modes
    ]


def parameters_json(parameters: Parameters) -> dict[str, Any]:
    """Value, unit and source of each parameter by its path, such as ``body.mass``."""
    found: dict[str, Any] = {}
    for table in fields(parameters):
        if table.name != "sources":
            part = getattr(parameters, table.name)
            for one in fields(part):
                path = f"{table.name}.{one.name}"
                value, unit = getattr(part, one.name), one.metadata["unit"]
                found[path] = {"value": value, "unit": unit, "source": parameters.sources[path]}
    return found


def vehicle_csv(motion: Motion) -> str:
    """Motion as CSV: one header line, then six decimals of mm and mrad (nanometres and nanoradians)."""
    columns = dict(motion.columns())
    stream = io.StringIO()
    stream.write(",".join(columns) + "\n")
    # adding 0.0 makes a negative zero positive, so that it is written the same everywhere
    np.savetxt(stream, np.round(np.stack(list(columns.values()), axis=1), 6) + 0.0, fmt="%.6f", delimiter=",")
    return stream.getvalue()
