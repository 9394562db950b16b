"""The command `sosmith vehicle`: motion of a six-axle locomotive on a track, and the clearance that a sensor sees."""

from __future__ import annotations

import time
from pathlib import Path

import click

from sosmith.commands.options import OneOf, print_tables
from sosmith.interface.choices import LEVELS, MODELS, TRACK_NAMES, picture_format
from sosmith.interface.files import write_file
from sosmith.output_paths import OutputFile, output_option, plot_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress


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
    from sosmith.interface.instrument.vehicle import Ride

    if write_parameters is not None:
        write_file(write_parameters, Ride.parameters())
        note(f"wrote {write_parameters}")
        return
    with show_progress() as step:
        step("running over the track")
        begin = time.process_time()
        ride = Ride.over(
            track,
            parameters=parameters,
            speed=speed,
            sample_rate=sample_rate,
            irregularities=irregularities,
            seed=seed,
            model=model,
        )
        took = time.process_time() - begin
        if output is not None:
            step("writing the motion")
            write_file(output, ride.csv())
        if plot is not None:
            step("drawing")
            write_file(plot, ride.picture(file_format))
    for path in (output, plot):
        if path is not None:
            note(f"wrote {path}")
    note(f"{ride.length:.0f} m of track took {took:.1f} s of processor time")
    if ride.warning:
        note(ride.warning)
    if as_json:
        print_json(ride.as_dict())
    else:
        print_tables(ride.tables(details=details))
