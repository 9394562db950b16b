"""Pictures in files of their own: one style, and the same bytes on every run."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sosmith.model.errors import SpecificationError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("svg", "png")
"""What a picture can be written as."""

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

    with mpl.rc_context(_STYLE | {"svg.hashsalt": name} | (style or {})):
        figure = Figure(figsize=size, dpi=_DPI, layout="constrained")
        paint(figure)
        stream = io.BytesIO()
        figure.savefig(stream, format=file_format, metadata={"Date": None} if file_format == "svg" else {})
    content = stream.getvalue()
    if file_format == "svg":  # the writer leaves blanks at the ends of lines
        content = b"\n".join(line.rstrip() for line in content.splitlines()) + b"\n"
    return content
