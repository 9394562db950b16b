"""The command `sosmith vehicle`: motion of a six-axle locomotive on a track, and the clearance that a sensor sees."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sosmith.commands.options import OneOf
from sosmith.interface.choices import LEVELS, MODELS, TRACK_NAMES, picture_format
from sosmith.interface.files import write_file
from sosmith.output_paths import OutputFile, output_option, plot_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.instrument.vehicle.vehicle_report import VehicleRun


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
@click.option(
    "--model",
    type=OneOf(MODELS),
    default="nonlinear",
    show_default=True,
    help="nonlinear: friction limits the creep forces, and flanges meet the rails; linear: neither.",
)
@click.option("--details", is_flag=True, help="Also print modes, every part's largest motion, and the paper's tables.")
@plot_option("SVG or PNG file for a plot of motions and spectra.")
@click.option(
    "--write-parameters",
    type=OutputFile(),
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
    model: str,
    details: bool,
    plot: Path | None,
    write_parameters: Path | None,
    output: Path | None,
    as_json: bool,
) -> None:
    """Simulate the motion of a six-axle locomotive on a track.

    Prints how close each wheelset comes to its limits: flange clearance, friction, derailment quotient, wheel load; and
    what its sensor sees. With --details also the modes of free motion, the largest motion of each part and, on the
    paper's track at its speed, the paper's tables 5 to 8 beside ours. Creep forces saturate at the limit of friction
    and flanges meet the rails; for small motion that is the linear model, which --model linear keeps at any size.
    PARAMETERS is a TOML file with masses, springs and track; by default the built-in ones are used.

    \b
        sosmith vehicle --speed 25 --plot vehicle.svg
        sosmith vehicle --details --model linear
        sosmith vehicle --write-parameters my_vehicle.toml
        sosmith vehicle my_vehicle.toml --track tangent --irregularities low -o motion.csv
    """
    file_format = "" if plot is None else picture_format(plot)
    from sosmith.instrument.vehicle.parameters import built_in, built_in_text, load

    if write_parameters is not None:
        write_file(write_parameters, built_in_text())
        note(f"wrote {write_parameters}")
        return
    given = built_in() if parameters is None else load(parameters)
    from sosmith.instrument.paper.figures import read_paper_figures
    from sosmith.instrument.paper.vehicle_comparison import comparison_json, run_comparison
    from sosmith.instrument.vehicle.vehicle_report import parameters_json, vehicle_csv, vehicle_json, vehicle_run

    with show_progress() as step:
        step("running over the track")
        begin = time.process_time()
        made = vehicle_run(
            given,
            track=track,
            speed=speed,
            sample_rate=sample_rate,
            irregularities=irregularities,
            seed=seed,
            model=model,
        )
        took = time.process_time() - begin
        if output is not None:
            step("writing the motion")
            write_file(output, vehicle_csv(made.motion))
        if plot is not None:
            from sosmith.instrument.vehicle.vehicle_plot import linear_beside, vehicle_plot

            step("drawing")
            beside = linear_beside(made)
            write_file(plot, vehicle_plot(made, file_format, beside))
    for path in (output, plot):
        if path is not None:
            note(f"wrote {path}")
    note(f"{made.motion.distance[-1]:.0f} m of track took {took:.1f} s of processor time")
    if not made.limits.kept:
        note(_warning(made))
    tables = run_comparison(made, read_paper_figures())
    if as_json:
        more = {"comparison": comparison_json(tables), "parameters": parameters_json(made.parameters)}
        print_json(vehicle_json(made) | more)
    else:
        from sosmith.commands.tables.vehicle import print_details, print_run

        print_run(made)
        if details:
            print_details(made, tables)


def _warning(made: VehicleRun) -> str:
    """Describe in one sentence the wheelsets that exceed the limits most."""
    found, linear = made.limits, made.model == "linear"
    worst, slips = int(found.beyond_flange.argmax()), int(found.friction_used.argmax())
    climbs, lifts = int(found.derailment_quotient.argmax()), int(found.load_share.argmin())
    parts = []
    if linear and found.beyond_flange[worst] > 0:
        parts.append(f"wheelset {worst + 1} moves {1e3 * found.beyond_flange[worst]:.1f} mm past the flange")
    if found.friction_used[slips] > 1:
        parts.append(
            f"the creep force of wheelset {slips + 1} is {found.friction_used[slips]:.2f} times the available friction"
        )
    if found.derailment_quotient[climbs] >= found.nadal:
        ratio = found.derailment_quotient[climbs]
        parts.append(f"wheelset {climbs + 1} climbs the rail, with a Y/Q of {ratio:.2f} against {found.nadal:.2f}")
    if found.load_share[lifts] <= 0:
        parts.append(f"a wheel of wheelset {lifts + 1} lifts off the rail")
    return f"this run exceeds the limits of the {made.model} model: {' and '.join(parts)}"
