"""The tables of a run of the vehicle: its limits in half a screen; modes, largest motions, the paper's beside ours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from rich.table import Table

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.instrument.paper.comparison import Comparison
from sosmith.instrument.vehicle.linear_motion import Mode
from sosmith.instrument.vehicle.vehicle_report import VehicleRun, acceleration, largest

SWINGING = 0.999
"""Damping ratio from which on a mode is not listed separately: it hardly oscillates."""


def print_run(made: VehicleRun) -> None:
    """Print how close each wheelset comes to its limits, and what the sensors and the driver notice."""
    most, found = largest(made.motion), made.limits
    random = "smooth track" if made.irregularities == "none" else f"irregularities {made.irregularities}"
    title = f"Co-Co locomotive, {made.track} track at {made.speed:g} m/s, {random}, {made.model} contacts"
    table = new_table(title, ["largest, by wheelset", *map(str, range(1, 7))])
    to_rails = 1e3 * np.abs(made.motion.lateral_to_rails).max(axis=0)
    table.add_row("lateral to the rails, mm", *(f"{way:.2f}" for way in to_rails))
    table.add_row("beyond the flange, mm", *(f"{1e3 * way:+.2f}" for way in found.beyond_flange))
    table.add_row("flange force, kN", *(f"{1e-3 * force:.1f}" for force in found.flange_force))
    table.add_row("creep force / friction", *(f"{used:.3f}" for used in found.friction_used))
    table.add_row(f"Y/Q, climbs at {found.nadal:.2f}", *(f"{ratio:.3f}" for ratio in found.derailment_quotient))
    table.add_row("least load / static", *(f"{share:.3f}" for share in found.load_share))
    table.add_row("change of clearance, mm", *(f"{most[f'clearance{k}_mm']:.2f}" for k in range(1, 7)))
    console = TableConsole()
    console.print(table)
    console.print(
        f"The body feels up to {acceleration(made.motion):.2f} m/s^2 to the side and rolls by "
        f"{most['body_roll_mrad']:.1f} mrad.",
        highlight=False,
    )


def print_details(made: VehicleRun, tables: Mapping[int, tuple[Comparison, ...]]) -> None:
    """Print modes, largest motions and, where the run allows it, the comparison with the paper."""
    console = TableConsole()
    console.print()
    for name, modes in (("Lateral", made.lateral_modes), ("Vertical", made.vertical_modes)):
        console.print(_modes_table(f"{name} modes at {made.speed:g} m/s", modes))
    console.print(_wheelsets_table(made))
    console.print(_bodies_table(made))
    if tables:
        console.print(_comparison_table(tables))


def _modes_table(title: str, modes: tuple[Mode, ...]) -> Table:
    table = new_table(title, ["Hz", "damping ratio", "growth, 1/s", "most in"])
    for mode in modes:
        if mode.damping < SWINGING:
            table.add_row(f"{mode.frequency:.3f}", f"{mode.damping:.3f}", f"{mode.growth:.3f}", mode.coordinate)
    still = [mode.growth for mode in modes if mode.damping >= SWINGING]
    if still:
        table.add_row("-", "1", f"{min(still):.1f} to {max(still):.1f}", "other modes, without oscillation")
    return table


def _wheelsets_table(made: VehicleRun) -> Table:
    """Largest motions of the wheelsets, and how long flanges touch and wheels slide."""
    most, found = largest(made.motion), made.limits
    table = new_table("Largest motion of the wheelsets", ["", *map(str, range(1, 7))])
    rows = {
        "lateral, mm": "wheelset{}_lateral_mm",
        "vertical, mm": "wheelset{}_vertical_mm",
        "yaw, mrad": "wheelset{}_yaw_mrad",
        "yaw in the frame, mrad": "wheelset{}_yaw_to_frame_mrad",
        "change of clearance, mm": "clearance{}_mm",
    }
    for name, column in rows.items():
        table.add_row(name, *(f"{most[column.format(k)]:.3f}" for k in range(1, 7)))
    table.add_row("flange contact, % of the time", *(f"{100 * share:.1f}" for share in found.beyond_flange_share))
    table.add_row("sliding, % of the time", *(f"{100 * share:.1f}" for share in found.sliding_share))
    return table


def _bodies_table(made: VehicleRun) -> Table:
    """Largest motions of the frames and the body."""
    most = largest(made.motion)
    parts = ("frame1", "frame2", "body")
    table = new_table("Largest motion of frames and body", ["", "frame 1", "frame 2", "body"])
    for motion in ("lateral", "vertical", "yaw", "roll", "pitch"):
        unit = "mm" if motion in ("lateral", "vertical") else "mrad"
        table.add_row(f"{motion}, {unit}", *(f"{most[f'{part}_{motion}_{unit}']:.3f}" for part in parts))
    return table


def _comparison_table(tables: Mapping[int, tuple[Comparison, ...]]) -> Table:
    """Figures of the paper and ours, with the reasons below."""
    reasons = list(dict.fromkeys(one.explanation for rows in tables.values() for one in rows))
    table = new_table(
        "Comparison with the paper's tables 5 to 8", ["table", "", "unit", "paper", "ours", "label", "why"]
    )
    for number, rows in tables.items():
        for one in rows:
            why = str(reasons.index(one.explanation) + 1)
            table.add_row(str(number), one.quantity, one.unit, one.shown_printed, one.shown, one.label, why)
    table.caption = "\n".join(f"{number}: {reason}" for number, reason in enumerate(reasons, start=1))
    table.caption_justify = "left"
    return table
