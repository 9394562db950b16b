"""The command `sosmith vehicle`: motion of a six-axle locomotive over a track, and what a sensor sees of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click
from rich.table import Table

from sosmith.gen.instrument.vehicle_plot import vehicle_plot
from sosmith.gen.instrument.vehicle_report import (
    TRACKS,
    VehicleRun,
    largest,
    parameters_json,
    vehicle_csv,
    vehicle_json,
    vehicle_run,
)
from sosmith.gen.paper.comparison import Comparison
from sosmith.gen.paper.figures import read_paper_figures
from sosmith.gen.paper.vehicle_comparison import comparison_json, run_comparison
from sosmith.gen.picture import FORMATS
from sosmith.model.errors import SpecificationError
from sosmith.model.text_files import write_contents, write_files
from sosmith.model.vehicle.linear_motion import Mode
from sosmith.model.vehicle.parameters import built_in, built_in_text, load
from sosmith.model.vehicle.track_irregularity import LEVELS
from sosmith.terminal import (
    JSON_OPTION,
    TableConsole,
    new_table,
    note,
    output_option,
    print_json,
    show_progress,
)

SWINGING = 0.999
"""Damping ratio from which on a mode is not listed by itself: its motion is gone before it comes back."""


@click.command("vehicle")
@click.argument("parameters", type=click.Path(path_type=Path), required=False)
@click.option("--speed", type=float, default=20.0, show_default=True, help="In m/s.")
@click.option("--sample-rate", type=float, default=100.0, show_default=True, help="Of the motion, in Hz.")
@click.option(
    "--track",
    type=click.Choice(list(TRACKS)),
    default="paper",
    show_default=True,
    help="The paper's track with its curve, or a straight one of the same length.",
)
@click.option(
    "--irregularities",
    type=click.Choice(["none", *LEVELS]),
    default="none",
    show_default=True,
    help="Random ones of ERRI B176, on top of the track's single one.",
)
@click.option("--seed", type=int, default=1, show_default=True, help="Of the random irregularities.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw motions and spectra into this SVG or PNG file.")
@click.option(
    "--write-parameters",
    type=click.Path(path_type=Path),
    help="Write the built-in PARAMETERS, with the source of each, into this TOML file, and do nothing else.",
)
@output_option("CSV file for the motion: time_s, wheelset1_lateral_mm, ..., clearance1_mm, ...")
@JSON_OPTION
def vehicle(
    parameters: Path | None,
    speed: float,
    sample_rate: float,
    track: str,
    irregularities: str,
    seed: int,
    plot: Path | None,
    write_parameters: Path | None,
    output: Path | None,
    as_json: bool,
) -> None:
    """Run a six-axle locomotive over a track.

    Prints the modes of free motion, the largest motion of each part, and, for the paper's track and speed, both beside
    the paper's tables 5 to 8. The model is linear: it has no flange contact, and its creep knows no friction limit.
    How far a run goes beyond that is told for each wheelset. PARAMETERS.toml holds masses, springs and track; without
    it, those built in.
    """
    if write_parameters is not None:
        write_files(write_parameters.parent, {write_parameters.name: built_in_text()})
        note(f"wrote {write_parameters}")
        return
    file_format = "" if plot is None else _plot_format(plot)
    given = built_in() if parameters is None else load(parameters)
    with show_progress() as step:
        step("running over the track")
        made = vehicle_run(
            given, track=track, speed=speed, sample_rate=sample_rate, irregularities=irregularities, seed=seed
        )
        if output is not None:
            step("writing the motion")
            write_files(output.parent, {output.name: vehicle_csv(made.motion)})
        if plot is not None:
            step("drawing")
            write_contents(plot.parent, {plot.name: vehicle_plot(made, file_format)})
    for path in (output, plot):
        if path is not None:
            note(f"wrote {path}")
    if not made.limits.kept:
        note(_warning(made))
    tables = run_comparison(made, read_paper_figures())
    if as_json:
        beside = {"comparison": comparison_json(tables), "parameters": parameters_json(made.parameters)}
        print_json(vehicle_json(made) | beside)
    else:
        _print_tables(made, tables)


def _plot_format(path: Path) -> str:
    file_format = path.suffix.lower().removeprefix(".")
    if file_format not in FORMATS:
        raise SpecificationError(f"{path}: the plot's name must end in .svg or .png, not {path.suffix or 'neither'}")
    return file_format


def _warning(made: VehicleRun) -> str:
    """One sentence on the wheelsets that are worst off."""
    found = made.limits
    worst, slips = int(found.beyond_flange.argmax()), int(found.friction_used.argmax())
    parts = []
    if found.beyond_flange[worst] > 0:
        parts.append(f"wheelset {worst + 1} goes {1e3 * found.beyond_flange[worst]:.1f} mm beyond its flange")
    if found.friction_used[slips] > 1:
        parts.append(
            f"creep of wheelset {slips + 1} takes {found.friction_used[slips]:.2f} times the friction there is"
        )
    return f"this run leaves what a linear model can tell: {' and '.join(parts)}"


def _print_tables(made: VehicleRun, tables: Mapping[int, tuple[Comparison, ...]]) -> None:
    console = TableConsole()
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
        table.add_row("-", "1", f"{min(still):.1f} to {max(still):.1f}", "others, which do not swing")
    return table


def _wheelsets_table(made: VehicleRun) -> Table:
    """Largest motions of the wheelsets, and how far they are beyond the model."""
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
    table.add_row("beyond the flange, mm", *(f"{1e3 * way:+.3f}" for way in found.beyond_flange))
    table.add_row("  of the time, %", *(f"{100 * share:.1f}" for share in found.beyond_flange_share))
    table.add_row("creep force / friction", *(f"{used:.3f}" for used in found.friction_used))
    table.add_row("  above 1 of the time, %", *(f"{100 * share:.1f}" for share in found.friction_exceeded_share))
    return table


def _bodies_table(made: VehicleRun) -> Table:
    """Largest motions of frames and body."""
    most = largest(made.motion)
    parts = ("frame1", "frame2", "body")
    table = new_table("Largest motion of frames and body", ["", "frame 1", "frame 2", "body"])
    for motion in ("lateral", "vertical", "yaw", "roll", "pitch"):
        unit = "mm" if motion in ("lateral", "vertical") else "mrad"
        table.add_row(f"{motion}, {unit}", *(f"{most[f'{part}_{motion}_{unit}']:.3f}" for part in parts))
    return table


def _comparison_table(tables: Mapping[int, tuple[Comparison, ...]]) -> Table:
    """Figures of the paper and ours, and below them the reasons."""
    reasons = list(dict.fromkeys(one.explanation for rows in tables.values() for one in rows))
    table = new_table("Beside the paper's tables 5 to 8", ["table", "", "unit", "paper", "ours", "label", "why"])
    for number, rows in tables.items():
        for one in rows:
            why = str(reasons.index(one.explanation) + 1)
            table.add_row(str(number), one.quantity, one.unit, one.shown_printed, one.shown, one.label, why)
    table.caption = "\n".join(f"{number}: {reason}" for number, reason in enumerate(reasons, start=1))
    table.caption_justify = "left"
    return table
