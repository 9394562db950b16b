"""The commands under `sosmith calibrate`: add measurements, refit, show the history, export."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sosmith.commands.instrument.calibrate_options import (
    ACCEPT,
    DATE,
    METHOD,
    ORDER,
    REQUIRED,
    ROBUST,
    SENSOR,
    STORE,
    TYPE,
    VERSION,
    Range,
    fit_options,
    lengths,
    millimetres,
    on_optional_day,
    range_of,
)
from sosmith.commands.instrument.calibrate_reference import reference_command
from sosmith.commands.options import print_tables
from sosmith.interface.choices import DEFAULT_RANGES, picture_format
from sosmith.interface.files import write_file
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.output_paths import output_option, plot_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.interface.instrument.calibration_store import Added, Fitted

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
    sosmith calibrate reference gauges.csv --sensor left    the morning's targets: the curve of the day
    sosmith calibrate history --sensor left            list all versions and their drift
    sosmith calibrate files --sensor left              list the files, and which were withdrawn
    sosmith calibrate export --sensor left             print [calibration] for a specification
    sosmith calibrate advise --sensor left 2mm 3mm     what to measure next
    sosmith calibrate health --sensor left             whether the sensor has changed
"""


@click.group("calibrate", help=_HELP)
def calibrate() -> None:
    """Group the calibration commands."""


@calibrate.command("add")
@click.argument("file", type=click.Path(path_type=Path))
@STORE
@SENSOR
@DATE
@click.option("--keep-good", is_flag=True, help="Keep the valid rows of a file that also has invalid ones.")
@click.option(
    "--surprising",
    is_flag=True,
    help="Store a file that looks like a slip: other units, swapped columns, another sensor.",
)
@range_of("clearance", "mm", DEFAULT_RANGES[0])
@range_of("voltage", "V", DEFAULT_RANGES[1])
@range_of("temperature", "degC", DEFAULT_RANGES[2])
@METHOD
@TYPE
@ORDER
@ACCEPT
@REQUIRED
@ROBUST
@JSON_OPTION
def add_command(
    file: Path,
    store: Path,
    sensor: str,
    date: str,
    keep_good: bool,
    surprising: bool,
    clearance_range: Range | None,
    voltage_range: Range | None,
    temperature_range: Range | None,
    method: str,
    sensor_type: str | None,
    order: int | None,
    accept: float | None,
    required_r: float | None,
    robust: bool,
    as_json: bool,
) -> None:
    """Add the measurements in FILE (CSV or XLSX), and refit.

    An invalid row is refused with its line number and the reason: text in place of a number, a value out of range, or a
    measurement that is already in the store. Unless --keep-good is given, one invalid row refuses the whole file, and
    the exit status is 2; so does a file that looks like a slip, such as inches, unless --surprising is given. The
    measurements and the version fitted to them are on disk when this command ends. It tells how far the sensor now
    reads from the version before, and alarms of its health. Exits with 1 if the measurements are stored but no
    polynomial is good enough.

    \b
        sosmith calibrate add bench.csv --sensor left
        sosmith calibrate add april.xlsx --sensor left --date 2026-04-20 --keep-good
    """
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    options = fit_options(method, sensor_type, required_r, robust, accept, order)
    with show_progress() as step:
        added = CalibrationStore(store).add(
            sensor,
            file,
            date,
            options,
            ranges=(clearance_range, voltage_range, temperature_range),
            keep_good=keep_good,
            surprising=surprising,
            progress=step,
        )
    if as_json:
        print_json(added.as_dict())
    _note_addition(file, store, added)
    _warn(added)
    if not as_json:
        print_tables(added.tables())
    fitted = added.fitted
    _warn(fitted)
    if not as_json:
        print_tables(fitted.tables())


def _note_addition(file: Path, store: Path, added: Added) -> None:
    """Say which rows were refused and how many stored; raises SpecificationError if none was."""
    refusals = added.refusals
    for refusal in refusals[:_SHOWN]:
        note(f"{file}, line {refusal.line}: {refusal.reason}")
    if len(refusals) > _SHOWN:
        note(f"... and {len(refusals) - _SHOWN:,} more lines; --json lists all")
    if not added.kept:
        rows = len(refusals) + added.good
        way = ", or skipped with --keep-good" if added.good else ""
        raise SpecificationError(f"{file}: every row must be valid{way}, not {len(refusals):,} of {rows:,} refused")
    left_out = f", {_counted(len(refusals), 'row')} skipped" if refusals else ""
    note(f"stored {_counted(added.good, 'measurement')} from {file} in {store}{left_out}")


calibrate.add_command(reference_command)


@calibrate.command("fit")
@STORE
@SENSOR
@DATE
@METHOD
@TYPE
@ORDER
@ACCEPT
@REQUIRED
@ROBUST
@JSON_OPTION
def fit_command(
    store: Path,
    sensor: str,
    date: str,
    method: str,
    sensor_type: str | None,
    order: int | None,
    accept: float | None,
    required_r: float | None,
    robust: bool,
    as_json: bool,
) -> None:
    """Refit to all measurements of a sensor.

    Use it to change the method or its options, or for another day, without new measurements. Creates a new version if
    the polynomial, the options or, with --method bayes, the day have changed. Exits with 1 if no polynomial is good
    enough.

    \b
        sosmith calibrate fit --sensor left --accept 0.2mm
        sosmith calibrate fit --sensor left --method paper --robust --required-r 0.99
    """
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    options = fit_options(method, sensor_type, required_r, robust, accept, order)
    with show_progress() as step:
        fitted = CalibrationStore(store).fit(sensor, date, options, step)
    _warn(fitted)
    if as_json:
        print_json(fitted.as_dict())
    else:
        print_tables(fitted.tables())


@calibrate.command("files")
@STORE
@SENSOR
@JSON_OPTION
def files_command(store: Path, sensor: str, as_json: bool) -> None:
    """List the files that a sensor's measurements came from, and which of them were withdrawn, by whom and why.

    \b
        sosmith calibrate files --sensor left
    """
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    files = CalibrationStore(store).files(sensor)
    if as_json:
        print_json(files.entries())
    else:
        print_tables(files.tables())


@calibrate.command("withdraw")
@click.argument("file")
@click.option("--reason", required=True, help="Why the file does not count.")
@click.option("--author", required=True, help="Who withdraws it.")
@STORE
@SENSOR
@DATE
@JSON_OPTION
def withdraw_command(file: str, reason: str, author: str, store: Path, sensor: str, date: str, as_json: bool) -> None:
    """Withdraw FILE, and refit without it.

    FILE is its name as it was added, or its number in `sosmith calibrate files`. Nothing is deleted: the withdrawal is
    recorded with author and reason, the measurements count no more, and the versions fitted to them stay reproducible.
    The new version is fitted as the newest one was. A corrected file may then be added, with the same readings or
    others. Exits with 1 if the file is withdrawn but no polynomial is good enough.

    \b
        sosmith calibrate withdraw april.csv --sensor left --reason "gauge 4 was worn" --author "A. Smith"
    """
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    with show_progress() as step:
        removed = CalibrationStore(store).withdraw(sensor, file, date, author=author, reason=reason, progress=step)
    if as_json:
        print_json(removed.as_dict())
    note(f"withdrew {_counted(removed.measurements, 'measurement')} of {removed.file} in {store}")
    fitted = removed.fitted
    _warn(fitted)
    if not as_json:
        print_tables(fitted.tables())


@calibrate.command("history")
@STORE
@SENSOR
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
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    with show_progress() as step:
        history = CalibrationStore(store).history(sensor, verify=verify, progress=step)
    if as_json:
        print_json(history.entries())
    else:
        print_tables(history.tables())
    if verify:
        count = len(history.versions)
        note(f"every version is reproduced bit for bit: {count} of {count}")


@calibrate.command("export")
@STORE
@SENSOR
@VERSION
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["toml", "csv"]),
    default="toml",
    show_default=True,
    help="toml: the table [calibration] of a specification; csv: the measurements, for its key calibration.data.",
)
@click.option(
    "--room",
    type=click.FloatRange(min=0.0, min_open=True),
    help="toml: coefficients to design hardware with, in which every curve within this many mm fits.",
)
@output_option("File to write.  [default: stdout]", stdout=True)
def export_command(
    store: Path, sensor: str, number: int | None, file_format: str, room: float | None, output: Path | None
) -> None:
    """Write the coefficients or the measurements of a version.

    The format toml is the table [calibration] of a specification, with the covariance of its coefficients; csv the
    measurements that it was fitted to. Either file reads back to exactly the same coefficients. A core with
    reload = true can load the new coefficients at run time; see `sosmith reload`.

    In the architecture parallel, coefficients have as many bits as those that it is designed with take, and one more.
    With --room these are wide enough for every curve that is so near over the ranges of the sensor, which must be those
    of the ports. They are to design hardware with, not to measure with.

    \b
        sosmith calibrate export --sensor left -o left.toml
        sosmith calibrate export --sensor left --version 1 --format csv -o left.csv
        sosmith calibrate export --sensor left --room 1 -o hardware.toml
    """
    if room is not None and file_format != "toml":
        raise SpecificationError(f"--format must be toml with --room, not {file_format}")
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    kept = CalibrationStore(store)
    with show_progress() as step:
        version = kept.version(sensor, number).number
        if file_format == "toml":
            step("fitting again")
            text, left_out = kept.specification(sensor, version, room)
            if left_out:
                note(f"the uncertainty is left out: {left_out}")
        else:
            text = kept.measurements(sensor, version)
    if output is None:
        click.echo(text, nl=False)
    else:
        write_file(output, text)
        note(f"wrote {output}: version {version} of sensor {sensor}")


@calibrate.command("plot")
@STORE
@SENSOR
@VERSION
@output_option("SVG or PNG file to write.  [default: calibration.svg]")
def plot_command(store: Path, sensor: str, number: int | None, output: Path | None) -> None:
    """Plot coverage, residuals, leverage and history.

    \b
        sosmith calibrate plot --sensor left -o left.svg
    """
    path = output or Path("calibration.svg")
    file_format = picture_format(path)
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    kept = CalibrationStore(store)
    with show_progress() as step:
        version = kept.version(sensor, number).number
        drawn = kept.picture(sensor, file_format, version, step)
    write_file(path, drawn)
    note(f"wrote {path}: version {version} of sensor {sensor}")


@calibrate.command("advise")
@click.argument("clearances", nargs=-1, required=True, metavar="CLEARANCE...", callback=lengths)
@click.option("--within", default="0.2mm", show_default=True, callback=millimetres, help="Wanted 95 % interval, +-.")
@click.option(
    "--temperature",
    "temperatures",
    type=click.FloatRange(-273.15, 2000.0),
    multiple=True,
    help="Temperature of the readings and of the measurements in degC; may be given several times.  "
    "[default: lowest, middle and highest one measured]",
)
@click.option("--most", type=click.IntRange(1, 1000), default=60, show_default=True, help="Most measurements.")
@click.option(
    "--uncertainty",
    callback=millimetres,
    help="Standard uncertainty of what is measured, as of reference targets.  [default: it scatters as before]",
)
@STORE
@SENSOR
@DATE
@JSON_OPTION
def advise_command(
    clearances: tuple[float, ...],
    within: float,
    temperatures: tuple[float, ...],
    most: int,
    uncertainty: float | None,
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
        sosmith calibrate advise 2mm 3mm 4mm --sensor left --within 0.1mm --uncertainty 0.02mm
    """
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    with show_progress() as step:
        step(f"fitting {sensor}")
        advised = CalibrationStore(store).advice(
            sensor,
            date,
            clearances,
            temperatures=temperatures,
            within=within,
            most=most,
            uncertainty=uncertainty or 0.0,
        )
    if as_json:
        print_json(advised.as_dict())
    else:
        print_tables(advised.tables())
    if advised.shortfall:
        raise ShortfallError(advised.shortfall)


@calibrate.command("health")
@STORE
@SENSOR
@click.option(
    "--since",
    callback=on_optional_day,
    metavar="YYYY-MM-DD",
    help="Begin the charts at this date: what was before is known, and raises no alarm.  [default: the first day]",
)
@plot_option("SVG or PNG file for the charts.")
@JSON_OPTION
def health_command(store: Path, sensor: str, since: str | None, plot: Path | None, as_json: bool) -> None:
    """Say whether a sensor still behaves as its measurements so far and its type would predict.

    Each day's measurements are predicted from the days before. Control charts of the differences raise alarms for a
    step of offset or gain, for drift, and for more scatter; a sentence says what explains the change best. A last day
    between the warning limit and the limit of an alarm gets a notice. Exits with 1 while an alarm stands.

    \b
        sosmith calibrate health --sensor left --plot health.svg
        sosmith calibrate health --sensor left --since 2026-04-20
    """
    file_format = "" if plot is None else picture_format(plot)
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    with show_progress() as step:
        step(f"going through the days of {sensor}")
        checked = CalibrationStore(store).health(sensor, since)
        if plot is not None:
            step("drawing")
            write_file(plot, checked.picture(file_format))
    if plot is not None:
        note(f"wrote {plot}")
    if as_json:
        print_json(checked.as_dict())
    else:
        print_tables(checked.tables())
    if checked.alarms:
        raise ShortfallError(
            f"sensor {sensor}: {_counted(checked.alarms, 'alarm')}; look at the sensor, then use --since"
        )


def _warn(fitted: Added | Fitted) -> None:
    for warning in fitted.warnings:
        note(f"warning: {warning}")


def _counted(count: int, what: str) -> str:
    return f"{count:,} {what}{'' if count == 1 else 's'}"
