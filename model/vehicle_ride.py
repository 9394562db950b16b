"""The vehicle model as the source of motion for scenario files."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from sosmith.model.errors import SpecificationError
from sosmith.model.port import Values
from sosmith.model.track import Track, curved_track, tangent_track
from sosmith.model.vehicle_parameters import Parameters, TrackTable, built_in
from sosmith.model.vehicle_run import run

SPEED = 20.0
"""Speed in m/s unless said otherwise: the paper's section 5.1."""


@dataclass(frozen=True, kw_only=True)
class VehicleRide:
    """Motion at the sensor of one wheelset; the track runs straight on for as long as the ride takes.

    Attributes
    ----------
    parameters : Parameters
        Of vehicle and track.
    speed : float
        In m/s.
    wheelset : int
        1 to 6, counted from the front.
    irregularity : {None, "low", "high"}
        Random irregularities of the track.

    Raises
    ------
    SpecificationError
        If there is no such wheelset; of the rest, when it runs.
    """

    parameters: Parameters = field(default_factory=built_in)
    speed: float = SPEED
    wheelset: int = 1
    irregularity: str | None = "low"

    def __post_init__(self) -> None:
        if not 1 <= self.wheelset <= 6:
            raise SpecificationError(f"the wheelset must be from 1 to 6, not {self.wheelset}")

    def __call__(self, track: str, time: Values, seed: int) -> Values:
        """Return the change of the clearance in mm at even steps of `time` in s, shape (n,), from 0 on.

        `track` is "paper", the paper's curve, or "tangent", a straight one with the same single irregularity.
        """
        step = float(time[1]) if len(time) > 1 else 1.0
        motion = run(
            self.parameters,
            self._track(track, self.speed * (float(time[-1]) + step)),
            speed=self.speed,
            sample_rate=1 / step,
            irregularity=self.irregularity,
            seed=seed,
        )
        return motion.clearance_mm[: len(time), self.wheelset - 1]

    def _track(self, name: str, way: float) -> Track:
        """Lay the track, and as much straight track behind it as the `way` in m asks for."""
        make = curved_track if name == "paper" else tangent_track
        table: TrackTable = self.parameters.track
        missing = max(0.0, way - make(table).length)
        return make(replace(table, run_out=table.run_out + missing))
