"""Pictures in files of their own: one style, and the same bytes on every run."""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sosmith.model.errors import SpecificationError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("svg", "png")
"""What a picture can be written as."""

BLUE, RED, GREEN, AMBER, PURPLE, SKY, GREY = "#0066a6", "#c94f00", "#009e73", "#e69f00", "#a23b78", "#2aa1d8", "#67645e"
"""The colours of the report on a light page, which are told apart with every kind of colour vision."""

_STYLE: dict[Any, Any] = {  # as typed, rc_context wants the names of its parameters one by one
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e2e2e2",
    "text.parse_math": False,  # a dollar sign in a name is a dollar sign
}

_DPI = 110

_COORDINATES = re.compile(r'(?<= )(?:d|x|y|x1|x2|y1|y2|cx|cy|width|height|transform|viewBox)="[^"]*"')
_IDENTIFIER = re.compile(r'(?<= id=")[a-z][0-9a-f]{10}(?=")')
_LONG = re.compile(r"-?\d+\.\d{4,}")


def format_of(path: Path) -> str:
    """Return which of `FORMATS` the name of a picture's file asks for.

    Raises
    ------
    SpecificationError
        If its name ends in none of them.
    """
    file_format = path.suffix.lower().removeprefix(".")
    if file_format not in FORMATS:
        raise SpecificationError(f"{path}: the plot's name must end in .svg or .png, not {path.suffix or 'neither'}")
    return file_format


def plain_parameters() -> dict[Any, Any]:
    """Return what a file of the user's has changed of matplotlib's parameters, as it is without: no picture follows it.

    The parameters of what shows pictures in windows stay: here are none.
    """
    import matplotlib as mpl

    plain = {name: value for name, value in mpl.rcParamsDefault.items() if not name.startswith("backend")}
    return {name: value for name, value in plain.items() if mpl.rcParams[name] != value}


def picture(
    name: str,
    size: tuple[float, float],
    paint: Callable[[Figure], None],
    file_format: str = "svg",
    style: dict[str, Any] | None = None,
) -> bytes:
    """Paint a figure and return the content of its file.

    Parameters
    ----------
    name : str
        Of the picture; the identifiers of its parts follow from it.
    size : tuple of float
        Width and height in inches.
    paint : callable
        Paints it.
    file_format : str
        One of `FORMATS`.
    style : dict, optional
        Parameters of matplotlib beside those of all pictures.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(plain_parameters() | _STYLE | {"svg.hashsalt": name} | (style or {})):
        figure = Figure(figsize=size, dpi=_DPI, layout="constrained")
        paint(figure)
        if file_format == "svg":
            return settled(svg_text(figure)).encode("utf-8")
        stream = io.BytesIO()
        figure.savefig(stream, format=file_format)
    return stream.getvalue()


def svg_text(figure: Figure) -> str:
    """Draw a figure that has a layout engine as the text of an SVG file.

    It is laid out first: whoever saves a figure with its engine draws it twice, the first time for the layout alone.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    FigureCanvasSVG(figure)
    with mpl.rc_context({"savefig.format": "svg"}):  # texts are measured as this format sets them
        engine = figure.get_layout_engine()
        if engine is not None:
            engine.execute(figure)
        figure.set_layout_engine(None)
        stream = io.StringIO()
        figure.savefig(stream, metadata={"Date": None})
    return stream.getvalue()


def legend_beside(axes: Axes) -> None:
    """Put the legend to the right of the data, where it covers none."""
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=8)


def legend_below(axes: Axes, offset: float = 0.2) -> None:
    """Put the legend below the panel by a part of its height, in rows; for long names, and panels that are narrow."""
    place = (0.5, -offset)
    axes.legend(loc="upper center", bbox_to_anchor=place, ncols=3, borderaxespad=0.0, frameon=False, fontsize=8)


def settled(svg: str, prefix: str = "") -> str:
    """Rid an SVG of what depends on the machine: digits that nobody sees, and identifiers made from them.

    Coordinates keep three decimals, a thousandth of a point: logarithmic axes take their last bits from numpy, which
    has other ones for other processors. matplotlib's identifiers are hashes of coordinates with all their digits;
    here they are numbered, after `prefix`, in the order in which they are defined. Lines lose the blanks at their
    ends.
    """
    numbers = itertools.count(1)
    names = {match: f"{prefix}{match[0]}{next(numbers)}" for match in dict.fromkeys(_IDENTIFIER.findall(svg))}
    svg = re.sub(r"\b[a-z][0-9a-f]{10}\b", lambda match: names.get(match[0], match[0]), svg)
    svg = _COORDINATES.sub(lambda attribute: _LONG.sub(_thousandths, attribute[0]), svg)
    return "\n".join(line.rstrip() for line in svg.splitlines()) + "\n"


def _thousandths(number: re.Match[str]) -> str:
    shown = f"{float(number[0]):.3f}".rstrip("0").rstrip(".")
    return "0" if shown == "-0" else shown
