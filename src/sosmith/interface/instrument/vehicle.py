"""Motion of a six-axle locomotive on a track, and the clearance that its sensors see."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from sosmith.gen.facts.table import Table, View
from sosmith.instrument.paper.comparison import Comparison
from sosmith.instrument.paper.figures import read_paper_figures
from sosmith.instrument.paper.vehicle_comparison import comparison_json, run_comparison
from sosmith.instrument.paper.vehicle_tables import detail_tables, limits_table
from sosmith.instrument.vehicle.parameters import built_in, built_in_text, load
from sosmith.instrument.vehicle.vehicle_report import (
    VehicleRun,
    parameters_json,
    vehicle_csv,
    vehicle_json,
    vehicle_run,
)


@dataclass(frozen=True, eq=False)
class Ride(View):
    """A run of the locomotive over a track."""

    run: VehicleRun = field(repr=False)
    """Settings, motion, limits and modes."""

    @classmethod
    def over(
        cls,
        track: str = "paper",
        *,
        parameters: str | PathLike[str] | None = None,
        speed: float = 20.0,
        sample_rate: float = 100.0,
        irregularities: str = "none",
        seed: int = 1,
        model: str = "nonlinear",
    ) -> Ride:
        """Run it over a track, "paper" or "tangent".

        Parameters
        ----------
        track : str
            The paper's track with its curve, or a straight one of the same length.
        parameters : path
            TOML file with masses, springs and track, as `Ride.parameters` returns one; by default that one.
        speed, sample_rate : float
            In m/s and Hz.
        irregularities : str
            "none", "low" or "high": level of random irregularities (ERRI B176), drawn from `seed`.
        model : str
            "nonlinear": friction limits the creep forces, and flanges meet the rails; "linear": neither.

        Raises
        ------
        SpecificationError
            If a value or the file cannot be used.
        """
        given = built_in() if parameters is None else load(Path(fspath(parameters)))
        return cls(
            vehicle_run(
                given,
                track=track,
                speed=speed,
                sample_rate=sample_rate,
                irregularities=irregularities,
                seed=seed,
                model=model,
            )
        )

    @staticmethod
    def parameters() -> str:
        """Return the built-in parameters as TOML, with the source of each."""
        return built_in_text()

    @property
    def length(self) -> float:
        """Length of the track in m."""
        return float(self.run.motion.distance[-1])

    @cached_property
    def _paper(self) -> Mapping[int, tuple[Comparison, ...]]:
        """The paper's tables beside ours; empty where the run does not allow it."""
        return run_comparison(self.run, read_paper_figures())

    @property
    def warning(self) -> str:
        """A sentence about the wheelsets that exceed the limits most; empty if none does."""
        limits, linear = self.run.limits, self.run.model == "linear"
        if limits.kept:
            return ""
        worst, slips = int(limits.beyond_flange.argmax()), int(limits.friction_used.argmax())
        climbs, lifts = int(limits.derailment_quotient.argmax()), int(limits.load_share.argmin())
        ratio, used = limits.derailment_quotient[climbs], limits.friction_used[slips]
        parts = []
        if linear and limits.beyond_flange[worst] > 0:
            parts.append(f"wheelset {worst + 1} moves {1e3 * limits.beyond_flange[worst]:.1f} mm past the flange")
        if used > 1:
            parts.append(f"the creep force of wheelset {slips + 1} is {used:.2f} times the available friction")
        if ratio >= limits.nadal:
            parts.append(f"wheelset {climbs + 1} climbs the rail, with a Y/Q of {ratio:.2f} against {limits.nadal:.2f}")
        if limits.load_share[lifts] <= 0:
            parts.append(f"a wheel of wheelset {lifts + 1} lifts off the rail")
        return f"this run exceeds the limits of the {self.run.model} model: {' and '.join(parts)}"

    def csv(self) -> str:
        """Return the motion, with the columns time_s, wheelset1_lateral_mm, ..., clearance1_mm, ..."""
        return vehicle_csv(self.run.motion)

    def picture(self, file_format: str) -> bytes:
        """Draw motions and spectra, as "svg" or "png", with the linear model beside them where it is stable."""
        from sosmith.instrument.vehicle.vehicle_plot import linear_beside, vehicle_plot

        return vehicle_plot(self.run, file_format, linear_beside(self.run))

    def tables(self, *, details: bool = False) -> list[Table]:
        """Return the limits; with `details` also modes, largest motions and the paper's tables beside ours."""
        return [limits_table(self.run), *(detail_tables(self.run, self._paper) if details else [])]

    def as_dict(self) -> dict[str, Any]:
        """Return settings, limits, comparison and parameters in JSON types."""
        more = {"comparison": comparison_json(self._paper), "parameters": parameters_json(self.run.parameters)}
        return vehicle_json(self.run) | more
