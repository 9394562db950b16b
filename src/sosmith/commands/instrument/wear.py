"""`sosmith wear`: depth, rate and remaining life of a wheel flange from a record of clearances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.instrument.wear.record_columns import CLEARANCES, TIMES
from sosmith.interface.choices import picture_format
from sosmith.interface.files import write_contents
from sosmith.model.errors import SpecificationError
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.instrument.wear.assessment import ClearanceUncertainty, WearLimits, WearReport
    from sosmith.instrument.wear.record_file import WearRecord

_HELP = f"""Estimate the wear, wear rate and remaining life of a wheel flange from TRACE.csv.

TRACE.csv has a time column ({", ".join(("time_s", *TIMES))}) and a clearance column in mm ({", ".join(CLEARANCES)}, or
--column). Wear is the clearance minus the initial one. The rate is the median slope between the medians of one-day
blocks, with a confidence interval that accounts for their correlation. The state is that of the last reading, by the
same comparisons as the wear flags of the hardware.

\b
    sosmith wear days.csv --initial 1.5 --limit 9 --warning 7
    sosmith wear days.csv --spec my.toml --plot wear.svg
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
@click.option("--plot", type=click.Path(path_type=Path), help="SVG or PNG file for a plot.")
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
    plot: Path | None,
    as_json: bool,
) -> None:
    """Carry out `sosmith wear`."""
    file_format = "" if plot is None else picture_format(plot)
    from sosmith.instrument.wear.assessment import WearLimits, judge
    from sosmith.instrument.wear.record_file import read_wear_record

    worth = None
    if spec is not None:
        if any(value is not None for value in (initial, limit, warning, sensor_range)):
            raise SpecificationError("the limits must be given by --spec or one by one, not both")
        limits, worth = _limits_of(spec, channel), _uncertainty_of(spec)
    elif initial is None or limit is None:
        raise SpecificationError("the limits must be given by --initial and --limit, or by --spec, not left out")
    else:
        limits = WearLimits(initial=initial, limit=limit, warning=warning, sensor_range=sensor_range)
    with show_progress() as step:
        step(f"reading {trace}")
        record = read_wear_record(trace, column, channel)
        if channel and spec is None and not record.channels:
            raise SpecificationError("--channel must come with --spec or with a column channel, not without both")
        step("rate of wear")
        report = judge(
            record.time,
            record.clearance,
            limits,
            block=block,
            window=window,
            confidence=confidence,
            uncertainty=worth,
        )
        drawn = None
        if plot is not None:
            from sosmith.instrument.wear.wear_plot import wear_plot

            step("drawing")
            drawn = wear_plot(record.time, record.clearance, report, file_format, dated=record.dated)
    if as_json:
        print_json(_json(record, report))
    else:
        from sosmith.commands.tables.wear import print_wear

        print_wear(record, report, channel)
    if plot is not None and drawn is not None:
        write_contents(plot.parent, {plot.name: drawn})
        note(f"wrote {plot}")


def _limits_of(path: Path, channel: int) -> WearLimits:
    from sosmith.gen.specification.specification import load
    from sosmith.instrument.wear.assessment import WearLimits

    spec = load(path)
    wear = spec.wear
    if wear is None:
        raise SpecificationError(f"{path}: the specification must have a table [wear] for --spec, not none")
    if spec.output.unit != "mm":
        raise SpecificationError(f"{path}: output.unit must be 'mm' for --spec, not {spec.output.unit!r}")
    if channel >= spec.channels:
        raise SpecificationError(f"{path}: channel must be below {spec.channels}, the count of channels, not {channel}")
    return WearLimits(
        initial=float(wear.initial[channel if len(wear.initial) > 1 else 0]),
        limit=float(wear.limit),
        warning=float(wear.warning),
        sensor_range=None if wear.sensor_range is None else float(wear.sensor_range),
    )


def _uncertainty_of(path: Path) -> Callable[[float, float], ClearanceUncertainty] | None:
    """Return what clearances are worth; None if the specification does not say what its calibration is worth."""
    from sosmith.gen.specification.specification import load
    from sosmith.instrument.uncertainty.instrument_budget import instrument_of

    found = instrument_of(load(path))
    return None if found is None else found.of_wear


def _json(record: WearRecord, report: WearReport) -> dict[str, Any]:
    """Return all results, with the unit in each key."""
    rate = report.rate
    return {
        "file": str(record.path),
        "column": record.column,
        "samples": report.samples,
        "duration_days": report.duration,
        "limits_mm": asdict(report.limits) | {"critical_clearance": report.limits.critical_clearance},
        "clearance_mm": report.clearance,
        "wear_mm": report.wear,
        "wear_interval_mm": {"low": report.wear_low, "high": report.wear_high, "confidence": rate.confidence},
        "uncertainty": None
        if report.uncertainty is None
        else {"standard_mm": report.uncertainty.standard, "rise_mm": report.uncertainty.rise},
        "remaining_mm": report.remaining,
        "rate_mm_per_day": {"value": rate.rate, "low": rate.low, "high": rate.high, "confidence": rate.confidence},
        "fall": None if report.fall is None else {"mm": report.fall.size, "window_days": report.fall.window},
        "blocks": {
            "count": rate.blocks,
            "days": rate.block,
            "scatter_mm": rate.scatter,
            "correlation": rate.correlation,
        },
        "life_days": {"value": report.life, "low": report.life_low, "high": report.life_high},
        "last_reading_mm": report.last,
        "state": str(report.state),
        "first_warning_days": report.first_warning,
        "first_critical_days": report.first_critical,
        "last_block": {
            "samples": report.last_block,
            "at_warning_or_beyond": report.warnings,
            "critical": report.criticals,
        },
    }
