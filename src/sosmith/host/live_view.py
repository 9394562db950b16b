"""The live view in a terminal: a table of all channels, and a plot of the one that is worn most."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from sosmith.host.readings import Reading, Readings
from sosmith.terminal import printable

_BLOCKS = " ▁▂▃▄▅▆▇█"


def plot(values: Sequence[float] | npt.NDArray[np.float64], width: int, height: int) -> list[str]:
    """Draw values as columns of block characters, the newest on the right, between their lowest and their highest."""
    shown = np.asarray(values, dtype=np.float64)
    if len(shown) > width:
        edges = np.linspace(0, len(shown), width + 1).astype(int)
        shown = np.array([shown[start:end].mean() for start, end in pairwise(edges.tolist())])
    if not len(shown):
        return [""] * height
    low, high = float(shown.min()), float(shown.max())
    levels = np.full(len(shown), 4) if high == low else np.rint((shown - low) / (high - low) * (8 * height - 1)) + 1
    rows = [np.clip(levels - 8 * row, 0, 8).astype(int) for row in reversed(range(height))]
    return ["".join(_BLOCKS[level] for level in row.tolist()) for row in rows]


def render(readings: Readings, width: int = 80) -> Group:
    """Return what to print, for a terminal of `width` characters."""
    about, now = readings.identity, readings.now
    quantity, unit = printable(about.output_port.name), printable(about.output_port.unit)
    table = Table(box=None, pad_edge=False, header_style="bold")
    wear = [f"wear, {unit}"] if readings.initial is not None else []
    wear += [f"{unit or 'steps'}/h"] if readings.rated else []
    for name in ("channel", f"{quantity}{f', {unit}' if unit else ''}", *wear):
        table.add_column(escape(name), justify="right")
    table.add_column("flags")
    for one in now:
        per_hour = ["-" if one.per_hour is None else f"{one.per_hour:+.3f}"] if readings.rated else []
        depth = [] if one.wear is None else [f"{one.wear:.3f}"]
        table.add_row(str(one.channel), f"{one.value:.4f}", *depth, *per_hour, _shown(one.flags))
    head = Text.assemble(
        (printable(about.name), "bold"),
        f" at {printable(readings.port)}: {readings.state}, {readings.samples:,} samples, {readings.seconds:,.1f} s",
        (f", {readings.alarms} alarms" if readings.alarms else "", "bold red"),
    )
    return Group(head, "", table, "", *_plotted(readings, now, width))


def _plotted(readings: Readings, now: list[Reading], width: int) -> list[Text]:
    if not now:
        return []
    worst = max(now, key=lambda one: one.value if one.wear is None else one.wear).channel
    values = readings.histories[worst].values
    rows = plot(values, max(width - 12, 20), 6)
    labels = [f"{values.max():10.4f} ", *[" " * 11] * (len(rows) - 2), f"{values.min():10.4f} "]
    title = f"channel {worst}" if len(now) > 1 else printable(readings.identity.output_port.name)
    return [Text(f"{title:>10}"), *(Text(label + row) for label, row in zip(labels, rows, strict=True))]


def _shown(flags: Sequence[str]) -> Text:
    style = "red" if {"wear_critical", "fault"} & set(flags) else "yellow"
    return Text(printable(", ".join(flags)).replace("_", " ") or "-", style=style if flags else "")
