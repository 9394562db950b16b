"""The command `sosmith vehicle`: motion of a six-axle locomotive on a track, and the clearance that a sensor sees."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sosmith.commands.options import OneOf
from sosmith.gen.picture import format_of
from sosmith.model.text_files import write_contents, write_files
from sosmith.model.vehicle.choices import LEVELS, TRACK_NAMES
from sosmith.terminal import JSON_OPTION, note, output_option, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.gen.instrument.vehicle_report import VehicleRun


@click.command("vehicle")
@click.argument("parameters", type=click.Path(path_type=Path), required=False)
@click.option("--speed", type=float, default=20.0, show_default=True, help="Speed in m/s.")
@click.option("--sample-rate", type=float, default=100.0, show_default=True, help="Sample rate of the motion in Hz.")
@click.option(
    "--track",
    type=OneOf(TRACK_NAMES),
    default="paper",
    show_default=True,
    help="paper: the paper's track with its curve; tangent: a straight track of the same length.",
)
@click.option(
    "--irregularities",
    type=OneOf(["none", *LEVELS]),
    default="none",
    show_default=True,
    help="Level of random irregularities (ERRI B176), added to the track's single one.",
)
@click.option("--seed", type=int, default=1, show_default=True, help="Seed of the random irregularities.")
@click.option("--plot", type=click.Path(path_type=Path), help="SVG or PNG file for a plot of motions and spectra.")
@click.option(
    "--write-parameters",
    type=click.Path(path_type=Path),
    help="Only write the built-in parameters, with the source of each, to this TOML file.",
)
@output_option("CSV file for the motion, with the columns time_s, wheelset1_lateral_mm, ..., clearance1_mm, ...")
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
    """Simulate the motion of a six-axle locomotive on a track.

    Prints the modes of free motion, the largest motion of each part, and, at the paper's track and speed, a comparison
    with the paper's tables 5 to 8. The model is linear: it has no flange contact and no friction limit on the creep
    forces. The tables show for each wheelset how far the run exceeds these limits. PARAMETERS is a TOML file with
    masses, springs and track; by default the built-in ones are used.

    \b
        sosmith vehicle --speed 25 --plot vehicle.svg
        sosmith vehicle --write-parameters my_vehicle.toml
        sosmith vehicle my_vehicle.toml --track tangent --irregularities low -o motion.csv
    """
    file_format = "" if plot is None else format_of(plot)
    from sosmith.model.vehicle.parameters import built_in, built_in_text, load

    if write_parameters is not None:
        write_files(write_parameters.parent, {write_parameters.name: built_in_text()})
        note(f"wrote {write_parameters}")
        return
    given = built_in() if parameters is None else load(parameters)
    from sosmith.gen.instrument.vehicle_report import parameters_json, vehicle_csv, vehicle_json, vehicle_run
    from sosmith.gen.paper.figures import read_paper_figures
    from sosmith.gen.paper.vehicle_comparison import comparison_json, run_comparison

    with show_progress() as step:
        step("running over the track")
        made = vehicle_run(
            given, track=track, speed=speed, sample_rate=sample_rate, irregularities=irregularities, seed=seed
        )
        if output is not None:
            step("writing the motion")
            write_files(output.parent, {output.name: vehicle_csv(made.motion)})
        if plot is not None:
            from sosmith.gen.instrument.vehicle_plot import vehicle_plot

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
        from sosmith.commands.tables.vehicle import print_run

        print_run(made, tables)


def _warning(made: VehicleRun) -> str:
    """Describe in one sentence the wheelsets that exceed the model most."""
    found = made.limits
    worst, slips = int(found.beyond_flange.argmax()), int(found.friction_used.argmax())
    parts = []
    if found.beyond_flange[worst] > 0:
        parts.append(f"wheelset {worst + 1} moves {1e3 * found.beyond_flange[worst]:.1f} mm past the flange")
    if found.friction_used[slips] > 1:
        parts.append(
            f"the creep force of wheelset {slips + 1} is {found.friction_used[slips]:.2f} times the available friction"
        )
    return f"this run exceeds the limits of the linear model: {' and '.join(parts)}"
