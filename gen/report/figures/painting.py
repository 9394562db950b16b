"""Draws figures of a report as SVG elements to stand inside an HTML page, and what several of them share.

Each figure is drawn in placeholder colours, which are then replaced by the page's CSS variables: light, dark
and print follow the page. Texts stay texts, in the page's own font. The same evidence gives the same bytes.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter

from sosmith.gen.picture import plain_parameters, settled, svg_text
from sosmith.gen.quantity import quantity
from sosmith.gen.report.run import Instants

Array = npt.NDArray[np.float64]

WIDE, NARROW = 940, 460
"""Widths of the drawing in CSS pixels: across the page, and half the page or a telephone."""

SERIES = tuple(f"series{k}" for k in range(8))
"""Colour roles of curves that lie beside each other as equals."""

ROLES = ("ink", "muted", "grid", "truth", "unfiltered", "golden", "hardware", "limit", "asked", *SERIES)

COLOUR = {role: f"#0000{index:02x}" for index, role in enumerate(ROLES, start=1)}

PANEL_HEIGHT = 350

IDEAL_LINE: dict[str, Any] = {"lw": 3.6}

REAL_LINE: dict[str, Any] = {"lw": 2.0, "ls": (0, (3.0, 1.6))}
"""Two curves that nearly always coincide: dashes on a broad line show both."""

STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 12.0,
    "axes.edgecolor": COLOUR["muted"],
    "axes.labelcolor": COLOUR["ink"],
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": COLOUR["grid"],
    "grid.linewidth": 0.8,
    "xtick.color": COLOUR["muted"],
    "ytick.color": COLOUR["muted"],
    "xtick.labelcolor": COLOUR["ink"],
    "ytick.labelcolor": COLOUR["ink"],
    "text.color": COLOUR["ink"],
    "lines.linewidth": 1.4,
    "lines.solid_joinstyle": "round",
    "path.simplify": False,
    "text.parse_math": False,  # a dollar sign in a name is a dollar sign
    "savefig.transparent": True,
}


def draw(name: str, title: str, width: int, height: int, paint: Callable[[Figure], None]) -> str:
    """Paint a figure of `width` by `height` CSS pixels and return it as one ``<svg>`` element.

    Parameters
    ----------
    name : str
        Name of the figure, unique in the page: it keeps the identifiers of its parts apart from others'.
    title : str
        What the figure shows, read out by screen readers; may not hold markup.
    """
    return _embed(settled(_painted(name, width, height, paint), f"{name}-{width}-"), title, width, height)


def _painted(name: str, width: int, height: int, paint: Callable[[Figure], None]) -> str:
    with mpl.rc_context(plain_parameters() | STYLE | {"svg.hashsalt": f"{name}-{width}"}):
        figure = Figure(figsize=(width / 72, height / 72), dpi=72, layout="constrained")
        paint(figure)
        return svg_text(figure)


def _embed(svg: str, title: str, width: int, height: int) -> str:
    """Strip a standalone SVG to the element that an HTML page wants, and hand its colours to the page."""
    body = svg[svg.index("<svg") :]
    body = body[body.index(">") + 1 :].removesuffix("\n")
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r'<g id="[^"]*"/>\s*', "", body)
    body = re.sub(r'<g id="[^"]*">', "<g>", body)
    body = re.sub(r"<!--.*?-->\s*", "", body)
    body = body.replace("xlink:href", "href")
    body = body.replace(' target="_blank"', "")  # a point leads to a place in the same page
    # before its release 3.11 matplotlib wrote size and family as one property
    body = re.sub(r"font: ([\d.]+px) [^;\"]*", r"font: \1 var(--sans)", body)
    body = re.sub(r"font-family: [^;\"]*", "font-family: var(--sans)", body)
    body = re.sub(r'(?<= )(d|x|y|width|height)="[^"]*"', _shorten, body)
    body = re.sub(r"\n\s*", "\n", body)
    for role, colour in COLOUR.items():
        body = body.replace(colour, f"var(--{role})")
    body, links = re.subn(r'<a href="#([a-z]+)-(\d+)">', r'<a href="#\1-\2" aria-label="\1 \2">', body)
    role = "group" if links else "img"  # what is within a picture cannot be reached
    return f'<svg viewBox="0 0 {width} {height}" role="{role}" aria-label="{title}">{body}'


def _shorten(attribute: re.Match[str]) -> str:
    """Round the numbers of an attribute to a hundredth of a pixel."""
    rounded = re.sub(r"\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", attribute[0])
    return re.sub(r"\s+", " ", rounded)


def envelope(time: Array | Instants, values: Array, columns: int) -> tuple[Array, Array]:
    """Thin out a long trace so that no peak is lost.

    Parameters
    ----------
    time, values : ndarray, shape (n,)
        The trace.
    columns : int
        Number of stretches to divide it into.

    Returns
    -------
    time, values : ndarray, shape (m,) with m <= 2 * columns
        The smallest and the largest value of each stretch at their own times; a short trace as it is.
    """
    if len(values) <= 2 * columns:
        return time[:], values
    edges = np.linspace(0, len(values), columns + 1).astype(int)
    chosen = set()
    for start, stop in itertools.pairwise(edges):
        chosen.add(start + int(np.argmin(values[start:stop])))
        chosen.add(start + int(np.argmax(values[start:stop])))
    index = np.array(sorted(chosen))
    return time[index], values[index]


def clip(name: str, longest: int) -> str:
    """Shorten a name that is longer than `longest` characters."""
    return name if len(name) <= longest else name[: longest - 1] + "…"


def frequency_axis(axes: Axes, frequency: Array) -> None:
    """Make the lower axis logarithmic, over all of `frequency`, in Hz."""
    axes.set_xscale("log")
    axes.set_xlim(float(frequency[0]), float(frequency[-1]))
    decades(axes.xaxis, float(frequency[0]), float(frequency[-1]), "Hz", 6)


def decades(axis: Axis, low: float, high: float, unit: str, labels: int) -> None:
    """Set the ticks of a logarithmic axis from `low` to `high`: one at every decade at least, `labels` with words.

    Less than two decades have ticks at 1, 2 and 5, less than half a one at all digits, the shortest spans even ones.
    Up to four decades have small ones at 2 to 9 between.
    """
    span = math.log10(high / low)
    subs = (1.0,) if span >= 2 else (1.0, 2.0, 5.0) if span > 0.5 else tuple(map(float, range(1, 10)))
    ends = math.floor(math.log10(low)), math.ceil(math.log10(high))
    places = [sub * 10.0**k for k in range(ends[0], ends[1] + 1) for sub in subs]
    places = [place for place in places if low * 0.999 <= place <= high * 1.001]
    if len(places) < 2:
        axis.set_major_locator(MaxNLocator(min(labels, 4)))
        axis.set_minor_locator(FixedLocator([]))
        axis.set_major_formatter(FuncFormatter(lambda v, _: quantity(v, unit)))
        return
    step = math.ceil(len(places) / labels)
    axis.set_major_locator(FixedLocator(places))
    small = [m * 10.0**k for k in range(*ends) for m in range(2, 10)] if span < 4 else []
    axis.set_minor_locator(FixedLocator([place for place in small if place not in places]))
    axis.set_minor_formatter(NullFormatter())
    named = places[::step]
    axis.set_major_formatter(FuncFormatter(lambda v, _: quantity(v, unit, 1) if v in named else ""))
