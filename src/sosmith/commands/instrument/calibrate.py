"""The commands under `sosmith calibrate`: add measurements, refit, show the history, export."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.gen.calibration.acceptance import REQUIRED_R
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES, METHODS, Method, Range
from sosmith.interface.choices import picture_format
from sosmith.interface.files import write_file
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.output_paths import output_option, plot_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.instrument.calibration.measurement_files import Refusal
    from sosmith.instrument.calibration.self_updating import Calibration
    from sosmith.instrument.calibration.sensor_type import SensorType

_SHOWN = 20
"""Number of refused lines that are printed; JSON has all of them."""

_HELP = """Store sensor measurements, and refit the calibration with every addition.

Measurements are rows of a CSV or XLSX file with the columns clearance_mm, voltage_V, temperature_C and, optionally,
date. They are kept in a store, a single SQLite file. Each addition fits a polynomial of voltage and temperature, says
what it is worth in mm, and stores it as a new version. --method bayes weighs all measurements with what is known of the
sensor's type, its drift and the error of the day; --method paper takes the smallest polynomial whose adjusted r
reaches the required value. To get started:

\b
    sosmith calibrate add bench.csv --sensor left      add measurements, show the fit
    sosmith calibrate history --sensor left            list all versions and their drift
    sosmith calibrate export --sensor left             print [calibration] for a specification
    sosmith calibrate advise --sensor left 2mm 3mm     what to measure next
    sosmith calibrate health --sensor left             whether the sensor has changed
"""


@click.group("calibrate", help=_HELP)
def calibrate() -> None:
    """Group the calibration commands."""


def _day(ctx: click.Context, parameter: click.Parameter, text: str | None) -> str:
    if text is None:
        return datetime.date.today().isoformat()
    from sosmith.instrument.calibration.measurement_files import parse_date

    return parse_date(text)


def _optional_day(ctx: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    return None if text is None else _day(ctx, parameter, text)


def _range(quantity: str, unit: str, usual: Range) -> Callable[[Any], Any]:
    return click.option(
        f"--{quantity}-range",
        nargs=2,
        type=float,
        metavar="LOW HIGH",
        callback=_check_range,
        help=f"Valid range of the {quantity} in {unit}, kept for later additions.  "
        f"[default: unchanged; {usual[0]:g} {usual[1]:g} for a new sensor]",
    )


def _check_range(ctx: click.Context, parameter: click.Parameter, given: Range | None) -> Range | None:
    if given is not None and not -1e9 <= given[0] < given[1] <= 1e9:
        raise SpecificationError(
            f"{parameter.opts[0]} must be two numbers, the lower one first, not {given[0]:g} {given[1]:g}"
        )
    return given


def _check_required_r(ctx: click.Context, parameter: click.Parameter, given: float | None) -> float | None:
    if given is not None and not 0 <= given < 1:  # NaN too
        raise SpecificationError(f"--required-r must be 0 or more and less than 1, not {given:g}")
    return given


def _millimetres(ctx: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    return None if text is None else _length(parameter.opts[0], text)


def _lengths(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[float, ...]:
    return tuple(_length("CLEARANCE", text) for text in texts)


def _length(name: str, text: str) -> float:
    found = re.fullmatch(r"(\d+(?:\.\d+)?) ?mm", text.strip())
    if found is None or not 0 < float(found[1]) <= 1000:
        raise SpecificationError(f"{name} must be a length such as 0.2mm, not {text[:60]!r}")
    return float(found[1])


def _sensor_type(ctx: click.Context, parameter: click.Parameter, given: str | None) -> SensorType | None:
    if given is None:
        return None
    from sosmith.instrument.calibration.sensor_type_file import sensor_type_named

    return sensor_type_named(given)


def _method(method: str, required_r: float | None, robust: bool) -> tuple[Method, float]:
    """Return the method and the required r."""
    if method == "paper":
        return "paper", REQUIRED_R if required_r is None else required_r
    for name, given in (("--required-r", required_r is not None), ("--robust", robust)):
        if given:
            raise SpecificationError(f"{name} must go with --method paper, not with --method {method}")
    return "bayes", REQUIRED_R


_STORE = click.option(
    "--store",
    type=click.Path(path_type=Path),
    default=Path("calibration.db"),
    show_default=True,
    help="SQLite file that holds the measurements.",
)
_SENSOR = click.option("--sensor", default="sensor", show_default=True, help="Name of the sensor.")
_DATE = click.option(
    "--date", callback=_day, metavar="YYYY-MM-DD", help="Date of the measurements or of the fit.  [default: today]"
)
_REQUIRED_R = click.option(
    "--required-r",
    type=float,
    callback=_check_required_r,
    help=f"With --method paper: required adjusted r; orders are raised until it is reached.  [default: {REQUIRED_R:g}]",
)
_ROBUST = click.option("--robust", is_flag=True, help="With --method paper: give outliers less weight (Huber).")
_METHOD = click.option(
    "--method", type=click.Choice(METHODS), default=METHODS[0], show_default=True, help="How to fit the measurements."
)
_TYPE = click.option(
    "--type",
    "sensor_type",
    callback=_sensor_type,
    metavar="NAME|FILE",
    help="With --method bayes: type of the sensor, equation_5a, equation_4 or a TOML file; kept for later fits.  "
    "[default: unchanged; equation_5a for a new sensor]",
)
_ACCEPT = click.option(
    "--accept",
    callback=_millimetres,
    metavar="LENGTH",
    help="Largest acceptable 95 % interval of a reading's clearance, such as 0.2mm for +-0.2 mm, wherever there are "
    "measurements.",
)
_VERSION = click.option("--version", "number", type=int, help="Version number.  [default: the newest]")


@calibrate.command("add")
@click.argument("file", type=click.Path(path_type=Path))
@_STORE
@_SENSOR
@_DATE
@click.option("--keep-good", is_flag=True, help="Keep the valid rows of a file that also has invalid ones.")
@_range("clearance", "mm", DEFAULT_RANGES[0])
@_range("voltage", "V", DEFAULT_RANGES[1])
@_range("temperature", "degC", DEFAULT_RANGES[2])
@_METHOD
@_TYPE
@_ACCEPT
@_REQUIRED_R
@_ROBUST
@JSON_OPTION
def add_command(
    file: Path,
    store: Path,
    sensor: str,
    date: str,
    keep_good: bool,
    clearance_range: Range | None,
    voltage_range: Range | None,
    temperature_range: Range | None,
    method: str,
    sensor_type: SensorType | None,
    accept: float | None,
    required_r: float | None,
    robust: bool,
    as_json: bool,
) -> None:
    """Add the measurements in FILE (CSV or XLSX), and refit.

    An invalid row is refused with its line number and the reason: text in place of a number, a value out of range, or a
    measurement that is already in the store. Unless --keep-good is given, one invalid row refuses the whole file, and
    the exit status is 2. The measurements and the version fitted to them are on disk when this command ends. Exits
    with 1 if the measurements are stored but no polynomial is good enough.

    \b
        sosmith calibrate add bench.csv --sensor left
        sosmith calibrate add april.xlsx --sensor left --date 2026-04-20 --keep-good
    """
    from sosmith.instrument.calibration.calibration_report import addition_json
    from sosmith.instrument.calibration.measurement_store import open_store
    from sosmith.instrument.calibration.self_updating import add, refused_first_file

    ranges = (clearance_range, voltage_range, temperature_range)
    chosen, needed_r = _method(method, required_r, robust)
    with show_progress() as step:
        step(f"adding {file}")
        addition = None
        if not store.exists():
            addition = refused_first_file(sensor, file, date, ranges=ranges, keep_good=keep_good)
        if addition is None:
            with open_store(store, create=True) as opened:
                addition = add(
                    opened,
                    sensor,
                    file,
                    date,
                    ranges=ranges,
                    keep_good=keep_good,
                    method=chosen,
                    sensor_type=sensor_type,
                    required_r=needed_r,
                    robust=robust,
                    accept=accept,
                    progress=lambda tried, count: step("fitting", tried, count),
                )
    if as_json:
        print_json(addition_json(addition))
    refusals, good = addition.file.refusals, len(addition.file.readings)
    _note_refusals(file, refusals)
    if not addition.kept:
        rows = len(refusals) + good
        way = ", or skipped with --keep-good" if good else ""
        raise SpecificationError(f"{file}: every row must be valid{way}, not {len(refusals):,} of {rows:,} refused")
    left_out = f", {_counted(len(refusals), 'row')} skipped" if refusals else ""
    note(f"stored {_counted(good, 'measurement')} from {file} in {store}{left_out}")
    if addition.calibration is None:
        raise ShortfallError(addition.shortfall)
    _warn(addition.calibration)
    if not as_json:
        from sosmith.commands.tables.calibration import print_calibration

        print_calibration(addition.calibration)


@calibrate.command("fit")
@_STORE
@_SENSOR
@_DATE
@_METHOD
@_TYPE
@_ACCEPT
@_REQUIRED_R
@_ROBUST
@JSON_OPTION
def fit_command(
    store: Path,
    sensor: str,
    date: str,
    method: str,
    sensor_type: SensorType | None,
    accept: float | None,
    required_r: float | None,
    robust: bool,
    as_json: bool,
) -> None:
    """Refit to all measurements of a sensor.

    Use it to change the method or its options, or for another day, without new measurements. Creates a new version if
    the polynomial or the options have changed. Exits with 1 if no polynomial is good enough.

    \b
        sosmith calibrate fit --sensor left --accept 0.2mm
        sosmith calibrate fit --sensor left --method paper --robust --required-r 0.99
    """
    chosen, needed_r = _method(method, required_r, robust)
    from sosmith.commands.tables.calibration import print_calibration
    from sosmith.instrument.calibration.calibration_report import calibration_json
    from sosmith.instrument.calibration.measurement_store import open_store
    from sosmith.instrument.calibration.self_updating import refit

    with show_progress() as step, open_store(store) as opened:
        step(f"fitting {sensor}")
        made = refit(
            opened,
            sensor,
            date,
            method=chosen,
            sensor_type=sensor_type,
            required_r=needed_r,
            robust=robust,
            accept=accept,
            progress=lambda tried, count: step(f"fitting {sensor}", tried, count),
        )
    _warn(made)
    if as_json:
        print_json(calibration_json(made))
    else:
        print_calibration(made)


@calibrate.command("history")
@_STORE
@_SENSOR
@click.option("--verify", is_flag=True, help="Refit every version from its measurements, and compare bit by bit.")
@JSON_OPTION
def history_command(store: Path, sensor: str, verify: bool, as_json: bool) -> None:
    """List the versions of a sensor's calibration.

    Shows the orders, adjusted r, rms residual, cross-validated (CV) error and drift. The drift is the largest
    difference from the previous version, over the measured voltages and temperatures.
    With --verify, exits with 1 if a version cannot be reproduced.

    \b
        sosmith calibrate history --sensor left --verify
    """
    from sosmith.commands.tables.calibration import print_history
    from sosmith.instrument.calibration.calibration_report import version_json
    from sosmith.instrument.calibration.measurement_store import open_store
    from sosmith.instrument.calibration.self_updating import calibration_of, find_version

    with show_progress() as step, open_store(store) as opened:
        newest = find_version(opened, sensor)
        versions = opened.versions(sensor)
        if verify:
            step("checking the file")
            opened.check()
            for version in versions:
                step("fitting again", version.number, newest.number)
                calibration_of(opened, sensor, version.number)
    if as_json:
        print_json([version_json(sensor, version) for version in versions])
    else:
        print_history(sensor, versions)
    if verify:
        note(f"every version is reproduced bit for bit: {len(versions)} of {len(versions)}")


@calibrate.command("export")
@_STORE
@_SENSOR
@_VERSION
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["toml", "csv"]),
    default="toml",
    show_default=True,
    help="toml: the table [calibration] of a specification; csv: the measurements, for its key calibration.data.",
)
@output_option("File to write.  [default: stdout]", stdout=True)
def export_command(store: Path, sensor: str, number: int | None, file_format: str, output: Path | None) -> None:
    """Write the coefficients or the measurements of a version.

    The format toml is the table [calibration] of a specification, with the covariance of its coefficients; csv the
    measurements that it was fitted to. Either file reads back to exactly the same coefficients. A core with
    reload = true can load the new coefficients at run time; see `sosmith reload`.

    \b
        sosmith calibrate export --sensor left -o left.toml
        sosmith calibrate export --sensor left --version 1 --format csv -o left.csv
    """
    from sosmith.instrument.calibration.calibration_report import measurements_csv, specification_table
    from sosmith.instrument.calibration.measurement_store import open_store
    from sosmith.instrument.calibration.self_updating import calibration_of, find_version

    with show_progress() as step, open_store(store) as opened:
        version = find_version(opened, sensor, number)
        if file_format == "toml":
            step("fitting again")
            made = None
            try:
                made = calibration_of(opened, sensor, version.number)
            except ShortfallError as error:
                note(f"the uncertainty is left out: {error}")
            text = specification_table(sensor, version, made)
        else:
            text = measurements_csv(opened.measurements(sensor, version.last_measurement))
    if output is None:
        click.echo(text, nl=False)
    else:
        write_file(output, text)
        note(f"wrote {output}: version {version.number} of sensor {sensor}")


@calibrate.command("plot")
@_STORE
@_SENSOR
@_VERSION
@output_option("SVG or PNG file to write.  [default: calibration.svg]")
def plot_command(store: Path, sensor: str, number: int | None, output: Path | None) -> None:
    """Plot coverage, residuals, leverage and history.

    \b
        sosmith calibrate plot --sensor left -o left.svg
    """
    path = output or Path("calibration.svg")
    file_format = picture_format(path)
    from sosmith.instrument.calibration.calibration_plot import calibration_plot
    from sosmith.instrument.calibration.measurement_store import open_store
    from sosmith.instrument.calibration.self_updating import calibration_of

    with show_progress() as step, open_store(store) as opened:
        step("fitting again")
        made = calibration_of(opened, sensor, number)
        versions = opened.versions(sensor)[: made.version.number]
        step("drawing")
        drawn = calibration_plot(made, versions, file_format)
    write_file(path, drawn)
    note(f"wrote {path}: version {made.version.number} of sensor {sensor}")


@calibrate.command("advise")
@click.argument("clearances", nargs=-1, required=True, metavar="CLEARANCE...", callback=_lengths)
@click.option("--within", default="0.2mm", show_default=True, callback=_millimetres, help="Wanted 95 % interval, +-.")
@click.option(
    "--temperature",
    "temperatures",
    type=click.FloatRange(-273.15, 2000.0),
    multiple=True,
    help="Temperature of the readings and of the measurements in degC; may be given several times.  "
    "[default: lowest, middle and highest one measured]",
)
@click.option("--most", type=click.IntRange(1, 1000), default=60, show_default=True, help="Most measurements.")
@_STORE
@_SENSOR
@_DATE
@JSON_OPTION
def advise_command(
    clearances: tuple[float, ...],
    within: float,
    temperatures: tuple[float, ...],
    most: int,
    store: Path,
    sensor: str,
    date: str,
    as_json: bool,
) -> None:
    """Say what to measure on a day, to know the clearances that matter well enough on that day.

    CLEARANCE, such as 2mm, is where the readings must be good. The command lists where to measure and how many times,
    and the 95 % intervals to expect without and with these measurements. Exits with 1 if --most of them are not enough.

    \b
        sosmith calibrate advise 2mm 3mm 4mm --sensor left --within 0.2mm
    """
    from sosmith.commands.tables.calibration import print_advice
    from sosmith.instrument.calibration.calibration_report import advice_json
    from sosmith.instrument.calibration.measurement_store import open_store
    from sosmith.instrument.calibration.self_updating import advice_for

    with show_progress() as step, open_store(store) as opened:
        step(f"fitting {sensor}")
        found = advice_for(opened, sensor, date, clearances, temperatures, within, most)
    if as_json:
        print_json(advice_json(sensor, date, within, found))
    else:
        print_advice(sensor, date, found)
    if not found.reached:
        raise ShortfallError(
            f"the intervals must be within {within:g} mm, and {found.count} measurements bring them to "
            f"{max(found.after):.3g} mm only"
        )


@calibrate.command("health")
@_STORE
@_SENSOR
@click.option(
    "--since",
    callback=_optional_day,
    metavar="YYYY-MM-DD",
    help="Begin the charts at this date: what was before is known, and raises no alarm.  [default: the first day]",
)
@plot_option("SVG or PNG file for the charts.")
@JSON_OPTION
def health_command(store: Path, sensor: str, since: str | None, plot: Path | None, as_json: bool) -> None:
    """Say whether a sensor still behaves as its measurements so far and its type would predict.

    Each day's measurements are predicted from the days before. Control charts of the differences raise alarms for a
    step of offset or gain, for drift, and for more scatter; a sentence says what explains the change best. Exits with 1
    while an alarm stands.

    \b
        sosmith calibrate health --sensor left --plot health.svg
        sosmith calibrate health --sensor left --since 2026-04-20
    """
    file_format = "" if plot is None else picture_format(plot)
    from sosmith.commands.tables.calibration import print_health
    from sosmith.instrument.calibration.health.health_report import health_json
    from sosmith.instrument.calibration.measurement_store import open_store
    from sosmith.instrument.calibration.self_updating import health_for

    with show_progress() as step, open_store(store) as opened:
        step(f"going through the days of {sensor}")
        found = health_for(opened, sensor, since)
        if plot is not None:
            from sosmith.instrument.calibration.health.health_plot import health_plot

            step("drawing")
            write_file(plot, health_plot(sensor, found, file_format))
    if plot is not None:
        note(f"wrote {plot}")
    if as_json:
        print_json(health_json(sensor, found))
    else:
        print_health(sensor, found)
    if found.alarms:
        raise ShortfallError(
            f"sensor {sensor}: {_counted(len(found.alarms), 'alarm')}; look at the sensor, then use --since"
        )


def _warn(made: Calibration) -> None:
    for warning in made.warnings:
        note(f"warning: {warning}")


def _counted(count: int, what: str) -> str:
    return f"{count:,} {what}{'' if count == 1 else 's'}"


def _note_refusals(file: Path, refusals: tuple[Refusal, ...]) -> None:
    for refusal in refusals[:_SHOWN]:
        note(f"{file}, line {refusal.line}: {refusal.reason}")
    if len(refusals) > _SHOWN:
        note(f"... and {len(refusals) - _SHOWN:,} more lines; --json lists all")
