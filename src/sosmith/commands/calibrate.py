"""The commands under `sosmith calibrate`: add measurements, refit, show the history, export."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.gen.picture import format_of
from sosmith.model.calibration.acceptance import DEFAULT_RANGES, REQUIRED_R, Range
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.text_files import write_contents, write_files
from sosmith.terminal import JSON_OPTION, note, output_option, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.model.calibration.measurement_files import Refusal

_SHOWN = 20
"""Number of refused lines that are printed; JSON has all of them."""

_HELP = """Store sensor measurements, and refit the calibration with every addition.

Measurements are rows of a CSV or XLSX file with the columns clearance_mm, voltage_V, temperature_C and, optionally,
date. They are kept in a store, a single SQLite file. Each addition fits the smallest polynomial of voltage and
temperature whose adjusted r reaches the required value, and stores it as a new version. To get started:

\b
    sosmith calibrate add bench.csv --sensor left      add measurements, show the fit
    sosmith calibrate history --sensor left            list all versions and their drift
    sosmith calibrate export --sensor left             print [calibration] for a specification
"""


@click.group("calibrate", help=_HELP)
def calibrate() -> None:
    """Group the calibration commands."""


def _day(ctx: click.Context, parameter: click.Parameter, text: str | None) -> str:
    if text is None:
        return datetime.date.today().isoformat()
    from sosmith.model.calibration.measurement_files import parse_date

    return parse_date(text)


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


def _check_required_r(ctx: click.Context, parameter: click.Parameter, given: float) -> float:
    if not 0 <= given < 1:  # NaN too
        raise SpecificationError(f"--required-r must be 0 or more and less than 1, not {given:g}")
    return given


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
    default=REQUIRED_R,
    show_default=True,
    help="Required adjusted r; orders are raised until it is reached.",
)
_ROBUST = click.option("--robust", is_flag=True, help="Give outliers less weight (Huber).")
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
    required_r: float,
    robust: bool,
    as_json: bool,
) -> None:
    """Add the measurements in FILE (CSV or XLSX), and refit.

    An invalid row is refused with its line number and the reason: text in place of a number, a value out of range, or a
    measurement that is already in the store. Unless --keep-good is given, one invalid row refuses the whole file, and
    the exit status is 2. The measurements and the version fitted to them are on disk when this command ends. Exits
    with 1 if the measurements are stored but no polynomial reaches the required r.

    \b
        sosmith calibrate add bench.csv --sensor left
        sosmith calibrate add april.xlsx --sensor left --date 2026-04-20 --keep-good
    """
    from sosmith.gen.instrument.calibration_report import addition_json
    from sosmith.model.calibration.measurement_store import open_store
    from sosmith.model.calibration.self_updating import add, refused_first_file

    ranges = (clearance_range, voltage_range, temperature_range)
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
                    required_r=required_r,
                    robust=robust,
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
    if not as_json:
        from sosmith.commands.tables.calibration import print_calibration

        print_calibration(addition.calibration)


@calibrate.command("fit")
@_STORE
@_SENSOR
@_DATE
@_REQUIRED_R
@_ROBUST
@JSON_OPTION
def fit_command(store: Path, sensor: str, date: str, required_r: float, robust: bool, as_json: bool) -> None:
    """Refit to all measurements of a sensor.

    Use it to change --robust or --required-r without new measurements. Creates a new version if the polynomial or the
    options have changed. Exits with 1 if no polynomial reaches the required r.

    \b
        sosmith calibrate fit --sensor left --robust --required-r 0.99
    """
    from sosmith.commands.tables.calibration import print_calibration
    from sosmith.gen.instrument.calibration_report import calibration_json
    from sosmith.model.calibration.measurement_store import open_store
    from sosmith.model.calibration.self_updating import refit

    with show_progress() as step, open_store(store) as opened:
        step(f"fitting {sensor}")
        made = refit(
            opened,
            sensor,
            date,
            required_r=required_r,
            robust=robust,
            progress=lambda tried, count: step(f"fitting {sensor}", tried, count),
        )
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
    from sosmith.gen.instrument.calibration_report import version_json
    from sosmith.model.calibration.measurement_store import open_store
    from sosmith.model.calibration.self_updating import calibration_of, find_version

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
@output_option("File to write.  [default: stdout]")
def export_command(store: Path, sensor: str, number: int | None, file_format: str, output: Path | None) -> None:
    """Write the coefficients or the measurements of a version.

    The format toml is the table [calibration] of a specification, csv the measurements that it was fitted to. Either
    file reads back to exactly the same doubles. A core with reload = true can load the new coefficients at run
    time; see `sosmith reload`.

    \b
        sosmith calibrate export --sensor left -o left.toml
        sosmith calibrate export --sensor left --version 1 --format csv -o left.csv
    """
    from sosmith.gen.instrument.calibration_report import measurements_csv, specification_table
    from sosmith.model.calibration.measurement_store import open_store
    from sosmith.model.calibration.self_updating import find_version

    with open_store(store) as opened:
        version = find_version(opened, sensor, number)
        text = (
            specification_table(sensor, version)
            if file_format == "toml"
            else measurements_csv(opened.measurements(sensor, version.last_measurement))
        )
    if output is None:
        click.echo(text, nl=False)
    else:
        write_files(output.parent, {output.name: text})
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
    file_format = format_of(path)
    from sosmith.gen.instrument.calibration_plot import calibration_plot
    from sosmith.model.calibration.measurement_store import open_store
    from sosmith.model.calibration.self_updating import calibration_of

    with show_progress() as step, open_store(store) as opened:
        step("fitting again")
        made = calibration_of(opened, sensor, number)
        versions = opened.versions(sensor)[: made.version.number]
        step("drawing")
        drawn = calibration_plot(made, versions, file_format)
    write_contents(path.parent, {path.name: drawn})
    note(f"wrote {path}: version {made.version.number} of sensor {sensor}")


def _counted(count: int, what: str) -> str:
    return f"{count:,} {what}{'' if count == 1 else 's'}"


def _note_refusals(file: Path, refusals: tuple[Refusal, ...]) -> None:
    for refusal in refusals[:_SHOWN]:
        note(f"{file}, line {refusal.line}: {refusal.reason}")
    if len(refusals) > _SHOWN:
        note(f"... and {len(refusals) - _SHOWN:,} more lines; --json lists all")
