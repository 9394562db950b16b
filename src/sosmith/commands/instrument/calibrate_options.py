"""Options of the commands under `sosmith calibrate`, and what they accept."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.interface.choices import FIT_METHODS, REQUIRED_R
from sosmith.model.errors import SpecificationError

if TYPE_CHECKING:
    from sosmith.interface.instrument.calibration_store import FitOptions

Range = tuple[float, float]


def on_day(ctx: click.Context, parameter: click.Parameter, text: str | None) -> str:
    """Read the date of an option, today by default."""
    from sosmith.interface.instrument.calibration_store import day_of

    return day_of(text)


def on_optional_day(ctx: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    """Read the date of an option that may be left out."""
    return None if text is None else on_day(ctx, parameter, text)


def range_of(quantity: str, unit: str, usual: Range) -> Callable[[Any], Any]:
    """Return the option of a valid range."""
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


def millimetres(ctx: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    """Read a length that may be left out, in mm."""
    return None if text is None else _length(parameter.opts[0], text)


def lengths(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[float, ...]:
    """Read lengths, in mm."""
    return tuple(_length("CLEARANCE", text) for text in texts)


def _length(name: str, text: str) -> float:
    number = re.fullmatch(r"(\d+(?:\.\d+)?) ?mm", text.strip())
    if number is None or not 0 < float(number[1]) <= 1000:
        raise SpecificationError(f"{name} must be a length such as 0.2mm, not {text[:60]!r}")
    return float(number[1])


def fit_options(
    method: str,
    sensor_type: str | None,
    required_r: float | None,
    robust: bool,
    accept: float | None,
    order: int | None,
) -> FitOptions:
    """Return the options of a fit."""
    from sosmith.interface.instrument.calibration_store import FitOptions

    return FitOptions(
        method="paper" if method == "paper" else "bayes",
        sensor_type=sensor_type,
        required_r=required_r,
        robust=robust,
        accept=accept,
        order=order,
    )


STORE = click.option(
    "--store",
    type=click.Path(path_type=Path),
    default=Path("calibration.db"),
    show_default=True,
    help="SQLite file that holds the measurements.",
)
SENSOR = click.option("--sensor", default="sensor", show_default=True, help="Name of the sensor.")
DATE = click.option(
    "--date", callback=on_day, metavar="YYYY-MM-DD", help="Date of the measurements or of the fit.  [default: today]"
)
REQUIRED = click.option(
    "--required-r",
    type=float,
    callback=_check_required_r,
    help=f"With --method paper: required adjusted r; orders are raised until it is reached.  [default: {REQUIRED_R:g}]",
)
ROBUST = click.option("--robust", is_flag=True, help="With --method paper: give outliers less weight (Huber).")
METHOD = click.option(
    "--method",
    type=click.Choice(FIT_METHODS),
    default=FIT_METHODS[0],
    show_default=True,
    help="How to fit the measurements.",
)
TYPE = click.option(
    "--type",
    "sensor_type",
    metavar="NAME|FILE",
    help="With --method bayes: type of the sensor, equation_5a, equation_4 or a TOML file; kept for later fits.  "
    "[default: unchanged; equation_5a for a new sensor]",
)
ACCEPT = click.option(
    "--accept",
    callback=millimetres,
    metavar="LENGTH",
    help="Largest acceptable 95 % interval of a reading's clearance, such as 0.2mm for +-0.2 mm, wherever there are "
    "measurements.",
)
ORDER = click.option(
    "--order",
    type=click.IntRange(2, 8),
    help="With --method bayes: highest order in the voltage of the polynomial of a day with measurements of its own; "
    "kept for later fits. The hardware must have room for it.  [default: unchanged; 2 for a new sensor]",
)
VERSION = click.option("--version", "number", type=int, help="Version number.  [default: the newest]")
