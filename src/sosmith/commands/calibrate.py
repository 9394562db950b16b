"""The commands under `sosmith calibrate`: take measurements in, refit, look back, export."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from sosmith.gen.instrument.calibration_plot import calibration_plot
from sosmith.gen.instrument.calibration_report import (
    CALLED_OUT,
    addition_json,
    calibration_json,
    measurements_csv,
    specification_table,
    version_json,
)
from sosmith.gen.picture import FORMATS
from sosmith.model.calibration.fit import REQUIRED_R, terms_of
from sosmith.model.calibration.fit_quality import CELLS
from sosmith.model.calibration.measurement_files import DEFAULT_RANGES, Range, Refusal, parse_date
from sosmith.model.calibration.measurement_store import Version, open_store
from sosmith.model.calibration.self_updating import (
    Calibration,
    add,
    calibration_of,
    find_version,
    refit,
    refused_first_file,
)
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.text_files import write_contents, write_files
from sosmith.terminal import (
    JSON_OPTION,
    TableConsole,
    new_table,
    note,
    output_option,
    print_json,
    show_progress,
)

_SHOWN = 20
"""Count of refused lines that are printed; JSON has all."""

_HELP = """Keep measurements of sensors, and a calibration that is fitted anew with every addition.

Measurements are rows of a CSV or XLSX file with the columns clearance_mm, voltage_V, temperature_C and, if wanted,
date. They go into a store, a single SQLite file, and stay there. Each addition fits the smallest polynomial of
voltage and temperature whose adjusted r reaches the value required, and keeps it as a new version. Begin with

\b
    sosmith calibrate add bench.csv --sensor left      take measurements in, see the fit
    sosmith calibrate history --sensor left            all versions and how far they drifted
    sosmith calibrate export --sensor left             [calibration] for a specification
"""


@click.group("calibrate", help=_HELP)
def calibrate() -> None:
    """Hold the commands."""


def _day(ctx: click.Context, parameter: click.Parameter, text: str | None) -> str:
    return datetime.date.today().isoformat() if text is None else parse_date(text)


def _range(quantity: str, unit: str, usual: Range) -> Callable[[Any], Any]:
    return click.option(
        f"--{quantity}-range",
        nargs=2,
        type=float,
        metavar="LOW HIGH",
        callback=_check_range,
        help=f"{quantity.capitalize()} in {unit} that can be right, from now on.  "
        f"[default: as before; {usual[0]:g} {usual[1]:g} for a new sensor]",
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
    help="The file with the measurements.",
)
_SENSOR = click.option("--sensor", default="sensor", show_default=True, help="Name of the sensor.")
_DATE = click.option(
    "--date", callback=_day, metavar="YYYY-MM-DD", help="Day of the measurements or fit.  [default: today]"
)
_REQUIRED_R = click.option(
    "--required-r",
    type=float,
    callback=_check_required_r,
    default=REQUIRED_R,
    show_default=True,
    help="Adjusted r to reach; orders rise until it is.",
)
_ROBUST = click.option("--robust", is_flag=True, help="Weight outliers down (Huber).")
_VERSION = click.option("--version", "number", type=int, help="Number of the version.  [default: the newest]")


@calibrate.command("add")
@click.argument("file", type=click.Path(path_type=Path))
@_STORE
@_SENSOR
@_DATE
@click.option("--keep-good", is_flag=True, help="Keep the good rows of a file that has bad ones.")
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
    """Take the measurements of FILE.csv or FILE.xlsx in, and fit anew.

    A row that cannot be right is refused with its line and the reason: text in place of a number, a value out of range,
    a measurement that is there already. Then nothing of the file is kept, and the exit status is 2, unless
    --keep-good is given. What is kept is on disk before this command ends, together with the version fitted to it.
    Exits with 1 if the measurements are kept but no polynomial reaches the required r.
    """
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
        way = ", or left out with --keep-good" if good else ""
        raise SpecificationError(f"{file}: every row must be right{way}, not {len(refusals):,} of {rows:,} refused")
    left_out = f", {_counted(len(refusals), 'row')} left out" if refusals else ""
    note(f"kept {_counted(good, 'measurement')} of {file} in {store}{left_out}")
    if addition.calibration is None:
        raise ShortfallError(addition.shortfall)
    if not as_json:
        _print_calibration(addition.calibration)


@calibrate.command("fit")
@_STORE
@_SENSOR
@_DATE
@_REQUIRED_R
@_ROBUST
@JSON_OPTION
def fit_command(store: Path, sensor: str, date: str, required_r: float, robust: bool, as_json: bool) -> None:
    """Fit to all measurements of a sensor again, such as with --robust or another --required-r.

    Makes a new version if the polynomial or what was asked for has changed. Exits with 1 if no polynomial reaches the
    required r.
    """
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
        _print_calibration(made)


@calibrate.command("history")
@_STORE
@_SENSOR
@click.option("--verify", is_flag=True, help="Fit every version again from its measurements, and compare bit by bit.")
@JSON_OPTION
def history_command(store: Path, sensor: str, verify: bool, as_json: bool) -> None:
    """List the versions of a sensor's calibration.

    Shown are orders, adjusted r, rms residual, cross-validated (CV) error and drift: the largest difference to the
    version before, over the voltages and temperatures that measurements cover.
    With --verify, exits with 1 if a version does not come out the same.
    """
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
        _print_history(sensor, versions)
    if verify:
        note(f"every version comes out the same, bit for bit: {len(versions)} of {len(versions)}")


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
    help="The table [calibration] of a specification, or the measurements for its key calibration.data.",
)
@output_option("File to write.  [default: stdout]")
def export_command(store: Path, sensor: str, number: int | None, file_format: str, output: Path | None) -> None:
    """Write a version's coefficients as the table [calibration] of a specification, or its measurements as CSV.

    Either way the doubles read back are those of the version. A core with reload = true takes the specification with
    new coefficients at run time.
    """
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
    """Draw coverage, residuals, leverage and history of a sensor's calibration."""
    path = output or Path("calibration.svg")
    file_format = path.suffix.lower().removeprefix(".")
    if file_format not in FORMATS:
        raise SpecificationError(f"{path}: the plot's name must end in .svg or .png, not {path.suffix or 'neither'}")
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


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g} mm"


def _print_calibration(made: Calibration) -> None:
    version, quality = made.version, made.quality
    console = TableConsole()
    state = "new" if made.new else "unchanged"
    overview = new_table(f"Sensor {escape(made.sensor)}, version {version.number} of {version.date}: {state}", ["", ""])
    robust = ", robust" if version.robust else ""
    overview.add_row("measurements", f"{version.measurements:,}{robust}")
    m, n = version.polynomial.orders
    overview.add_row("orders", f"{m} in voltage, {n} in temperature, to reach r = {version.required_r:g}")
    overview.add_row("adjusted r", f"{made.fit.adjusted_r:.6f}{_rejected(made)}")
    overview.add_row("residual, rms", _mm(version.rms))
    overview.add_row("residual, largest", _mm(float(abs(quality.residual).max())))
    left_out = _mm(version.cross_validated) if version.cross_validated is not None else "not defined: leverage 1"
    overview.add_row("cross-validated error, rms", left_out)
    (v_low, v_high), (t_low, t_high) = made.fit.covered
    overview.add_row("covered", f"{v_low:g} to {v_high:g} V, {t_low:g} to {t_high:g} °C")
    overview.add_row("coverage of the range", f"{100 * made.coverage:.1f} % lies between measurements")
    cells = round(quality.filled_cells * CELLS**2)
    overview.add_row("cells with measurements", f"{cells} of {CELLS} x {CELLS}")
    mean = len(terms_of(made.fit.orders)) / version.measurements
    high = len(quality.high_leverage)
    overview.add_row("leverage, largest", f"{quality.leverage.max():.4f} (mean {mean:.4f}; {high} above 3 times that)")
    if version.robust:
        overview.add_row("weighted down", f"{sum(weight < 1 for weight in made.fit.weights):,}")
    for number, drift in sorted(made.drift.items(), reverse=True)[:5]:
        overview.add_row(f"drift from version {number}", _mm(drift))
    console.print(overview)
    called = new_table("Largest residuals", ["no.", "from", "mm", "V", "°C", "residual, mm", "leverage"])
    for index in quality.largest_residuals(CALLED_OUT):
        one = made.stored[index]
        values = [f"{value:g}" for value in one.reading.values]
        off, leverage = f"{quality.residual[index]:+.4f}", f"{quality.leverage[index]:.3f}"
        called.add_row(str(one.number), escape(f"{one.source}:{one.reading.line}"), *values, off, leverage)
    console.print(called)


def _rejected(made: Calibration) -> str:
    shown = [f"{trial.orders[0]}, {trial.orders[1]}: {trial.adjusted_r:.6f}" for trial in made.fit.rejected[:3]]
    more = [f"{len(made.fit.rejected) - 3} more"] if len(made.fit.rejected) > 3 else []
    return f" (orders {'; '.join(shown + more)})" if shown else ""


def _print_history(sensor: str, versions: list[Version]) -> None:
    table = new_table(
        f"Sensor {escape(sensor)}, errors in mm",
        ["no.", "date", "count", "orders", "r", "rms", "CV error", "drift"],
    )
    for version in versions:
        m, n = version.polynomial.orders
        figures = (version.rms, version.cross_validated, version.drift)
        table.add_row(
            str(version.number),
            version.date,
            f"{version.measurements:,}",
            f"{m}, {n}{' robust' if version.robust else ''}",
            f"{max(version.adjusted_r_squared, 0.0) ** 0.5:.5f}",
            *("-" if figure is None else f"{figure:.4g}" for figure in figures),
        )
    TableConsole().print(table)
