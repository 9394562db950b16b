"""The tables of a run of the vehicle: its limits in half a screen; modes, largest motions, the paper's beside ours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sosmith.gen.facts.table import Table
from sosmith.instrument.paper.comparison import Comparison
from sosmith.instrument.vehicle.limits import QUOTIENT
from sosmith.instrument.vehicle.linear_motion import Mode
from sosmith.instrument.vehicle.vehicle_report import VehicleRun, acceleration, largest

SWINGING = 0.999
"""Damping ratio from which on a mode is not listed separately: it hardly oscillates."""

_WHEELSETS = tuple(map(str, range(1, 7)))


def limits_table(made: VehicleRun) -> Table:
    """Return how close each wheelset comes to its limits, and what the sensors and the driver notice."""
    most, limits = largest(made.motion), made.limits
    random = "smooth track" if made.irregularities == "none" else f"irregularities {made.irregularities}"
    to_rails = 1e3 * np.abs(made.motion.lateral_to_rails).max(axis=0)
    rows = [
        ("lateral to the rails, mm", *(f"{way:.2f}" for way in to_rails)),
        ("beyond the flange, mm", *(f"{1e3 * way:+.2f}" for way in limits.beyond_flange)),
        ("flange force, kN", *(f"{1e-3 * force:.1f}" for force in limits.flange_force)),
        ("creep force / friction", *(f"{used:.3f}" for used in limits.friction_used)),
        (f"Y/Q, climbs at {limits.nadal:.2f}", *(f"{ratio:.3f}" for ratio in limits.derailment_quotient)),
        (f"Y/Q over 2 m, limit {QUOTIENT:g}", *(f"{ratio:.3f}" for ratio in limits.sliding_quotient)),
        (
            f"sum of Y over 2 m, kN, limit {1e-3 * limits.prudhomme:.0f}",
            *(f"{1e-3 * force:.1f}" for force in limits.guiding_sum),
        ),
        ("least load / static", *(f"{share:.3f}" for share in limits.load_share)),
        ("change of clearance, mm", *(f"{most[f'clearance{k}_mm']:.2f}" for k in _WHEELSETS)),
    ]
    felt = (
        f"The body feels up to {acceleration(made.motion):.2f} m/s^2 to the side and rolls by "
        f"{most['body_roll_mrad']:.1f} mrad."
    )
    title = f"Co-Co locomotive, {made.track} track at {made.speed:g} m/s, {random}, {made.model} contacts"
    return Table(title, rows, ("largest, by wheelset", *_WHEELSETS), notes=[felt])


def detail_tables(made: VehicleRun, paper: Mapping[int, tuple[Comparison, ...]]) -> list[Table]:
    """Return modes, largest motions and, where the run allows it, the comparison with the paper."""
    return [
        _modes_table(f"Lateral modes at {made.speed:g} m/s", made.lateral_modes),
        _modes_table(f"Vertical modes at {made.speed:g} m/s", made.vertical_modes),
        _wheelsets_table(made),
        _bodies_table(made),
        *([_comparison_table(paper)] if paper else []),
    ]


def _modes_table(title: str, modes: tuple[Mode, ...]) -> Table:
    rows = [
        (f"{mode.frequency:.3f}", f"{mode.damping:.3f}", f"{mode.growth:.3f}", mode.coordinate)
        for mode in modes
        if mode.damping < SWINGING
    ]
    still = [mode.growth for mode in modes if mode.damping >= SWINGING]
    if still:
        rows.append(("-", "1", f"{min(still):.1f} to {max(still):.1f}", "other modes, without oscillation"))
    return Table(title, rows, ("Hz", "damping ratio", "growth, 1/s", "most in"))


def _wheelsets_table(made: VehicleRun) -> Table:
    """Largest motions of the wheelsets, and how long flanges touch and wheels slide."""
    most, limits = largest(made.motion), made.limits
    columns = {
        "lateral, mm": "wheelset{}_lateral_mm",
        "vertical, mm": "wheelset{}_vertical_mm",
        "yaw, mrad": "wheelset{}_yaw_mrad",
        "yaw in the frame, mrad": "wheelset{}_yaw_to_frame_mrad",
        "change of clearance, mm": "clearance{}_mm",
    }
    shares = {
        "flange contact, % of the time": limits.beyond_flange_share,
        "sliding, % of the time": limits.sliding_share,
    }
    rows = [
        *((name, *(f"{most[column.format(k)]:.3f}" for k in _WHEELSETS)) for name, column in columns.items()),
        *((name, *(f"{100 * share:.1f}" for share in each)) for name, each in shares.items()),
    ]
    return Table("Largest motion of the wheelsets", rows, ("", *_WHEELSETS))


def _bodies_table(made: VehicleRun) -> Table:
    """Largest motions of the frames and the body."""
    most, parts = largest(made.motion), ("frame1", "frame2", "body")
    units = {"lateral": "mm", "vertical": "mm", "yaw": "mrad", "roll": "mrad", "pitch": "mrad"}
    rows = [
        (f"{motion}, {unit}", *(f"{most[f'{part}_{motion}_{unit}']:.3f}" for part in parts))
        for motion, unit in units.items()
    ]
    return Table("Largest motion of frames and body", rows, ("", "frame 1", "frame 2", "body"))


def _comparison_table(paper: Mapping[int, tuple[Comparison, ...]]) -> Table:
    """Figures of the paper and ours, with the reasons below."""
    reasons = list(dict.fromkeys(one.explanation for rows in paper.values() for one in rows))
    rows = [
        (
            str(number),
            one.quantity,
            one.unit,
            one.shown_printed,
            one.shown,
            one.label,
            str(reasons.index(one.explanation) + 1),
        )
        for number, found in paper.items()
        for one in found
    ]
    notes = [f"{number}: {reason}" for number, reason in enumerate(reasons, start=1)]
    head = ("table", "", "unit", "paper", "ours", "label", "why")
    return Table("Comparison with the paper's tables 5 to 8", rows, head, notes=notes)
