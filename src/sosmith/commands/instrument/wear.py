"""`sosmith wear`: depth, rate and remaining life of a wheel flange from a record of clearances."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.options import print_tables
from sosmith.interface.choices import CLEARANCES, TIMES, picture_format
from sosmith.interface.files import write_file
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import plot_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

_HELP = f"""Estimate the wear, wear rate and remaining life of a wheel flange from TRACE.csv.

TRACE.csv has a time column ({", ".join(("time_s", *TIMES))}) and a clearance column in mm ({", ".join(CLEARANCES)}, or
--column). Wear is the clearance minus the initial one. The rate is the median slope between the medians of one-day
blocks, with a confidence interval that accounts for their correlation. The state is that of the last reading, by the
same comparisons as the wear flags of the hardware.

\b
    sosmith wear days.csv --initial 1.5 --limit 9 --warning 7
    sosmith wear days.csv --spec my.toml --plot wear.svg
    sosmith wear days.csv --spec my.toml --risk 0.05
"""


@click.command("wear", help=_HELP)
@click.argument("trace", type=click.Path(path_type=Path), metavar="TRACE.csv")
@click.option("--initial", type=float, help="Clearance without wear, in mm.")
@click.option("--limit", type=float, help="Wear at which the state is critical, in mm.")
@click.option("--warning", type=float, help="Wear at which the state is a warning, in mm.  [default: no warning]")
@click.option("--sensor-range", type=float, help="Largest clearance that the sensor measures reliably, in mm.")
@click.option(
    "--spec",
    type=click.Path(path_type=Path),
    metavar="SPEC",
    help="Take these four from [wear] of this specification, and what a reading is worth from its calibration.",
)
@click.option(
    "--channel",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Channel of SPEC, and of TRACE.csv if it has the column channel.",
)
@click.option("--column", help="Name of the clearance column.")
@click.option("--block", type=float, help="Length of a block in days.  [default: 1, less for a short record]")
@click.option("--window", type=float, help="Estimate the rate from this many days at the end.  [default: all]")
@click.option("--confidence", type=float, default=0.95, show_default=True, help="Confidence level of the intervals.")
@click.option(
    "--risk",
    type=float,
    help="Follow level and rate over the days, tell jumps and changes of the rate, and call wear critical from this "
    "probability of being past the limit on, such as 0.05.",
)
@click.option(
    "--day-error",
    type=float,
    help="With --risk: standard uncertainty in mm of what is new each day in a reading.  [default: that of SPEC, or "
    "the scatter of the days]",
)
@plot_option("SVG or PNG file for a plot.")
@JSON_OPTION
def wear_command(
    trace: Path,
    initial: float | None,
    limit: float | None,
    warning: float | None,
    sensor_range: float | None,
    spec: Path | None,
    channel: int,
    column: str | None,
    block: float | None,
    window: float | None,
    confidence: float,
    risk: float | None,
    day_error: float | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Carry out `sosmith wear`."""
    file_format = "" if plot is None else picture_format(plot)
    from sosmith.interface.instrument.wear import Wear, WearLimits
    from sosmith.interface.specification import Specification

    limits: Specification | WearLimits
    if spec is not None:
        if any(value is not None for value in (initial, limit, warning, sensor_range)):
            raise SpecificationError("the limits must be given by --spec or one by one, not both")
        limits = Specification.load(spec)
    elif initial is None or limit is None:
        raise SpecificationError("the limits must be given by --initial and --limit, or by --spec, not left out")
    else:
        limits = WearLimits(initial=initial, limit=limit, warning=warning, sensor_range=sensor_range)
    with show_progress() as step:
        found = Wear.of(
            trace,
            limits,
            channel=channel,
            column=column,
            block=block,
            window=window,
            confidence=confidence,
            risk=risk,
            day_error=day_error,
            progress=step,
        )
        drawn = None
        if plot is not None:
            step("drawing")
            drawn = found.picture(file_format)
    if as_json:
        print_json(found.as_dict())
    else:
        print_tables(found.tables())
    if plot is not None and drawn is not None:
        write_file(plot, drawn)
        note(f"wrote {plot}")
