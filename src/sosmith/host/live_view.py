"""The live view in a terminal: a table of all channels, and a plot of the one that is worn most."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from sosmith.host.board import Results
from sosmith.model.link.identity import Identity

_BLOCKS = " ▁▂▃▄▅▆▇█"
_POINTS = 2000
"""Most points of a channel that are kept; when there are more, every second one is left out."""


def plot(values: Sequence[float], width: int, height: int) -> list[str]:
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


@dataclass
class _History:
    """Values of a channel with their sample numbers, thinned out evenly as they become many."""

    step: int = 1
    numbers: deque[int] = field(default_factory=deque)
    values: deque[float] = field(default_factory=deque)

    def add(self, first: int, values: Sequence[float]) -> None:
        for n, value in enumerate(values, start=first):
            if n % self.step == 0:
                self.numbers.append(n)
                self.values.append(value)
        if len(self.values) > _POINTS:
            self.step *= 2
            kept = [(n, v) for n, v in zip(self.numbers, self.values, strict=True) if n % self.step == 0]
            self.numbers, self.values = deque(n for n, _ in kept), deque(v for _, v in kept)

    def slope(self) -> float | None:
        """Least-squares slope per sample; None for fewer than three values."""
        if len(self.values) < 3:
            return None
        x = np.asarray(self.numbers, dtype=np.float64)
        y = np.asarray(self.values)
        x = x - x.mean()
        return float(x @ (y - y.mean()) / (x @ x))


class LiveView:
    """What is shown of a board.

    Parameters
    ----------
    identity : Identity
        The board.
    manifest : mapping or None
        The core's manifest, which tells the wear; None if there is none.
    port : str
        Where the board is.
    """

    def __init__(self, identity: Identity, manifest: Mapping[str, Any] | None, port: str) -> None:
        self._identity, self._port = identity, port
        self._initial = _initial(identity, manifest)
        self._histories = [_History() for _ in range(identity.channels)]
        self._last: list[tuple[float, int]] = []
        self._samples = 0
        self.state = "connected"
        self.alarms = 0

    def add(self, results: Results, first: int) -> None:
        """Take the newest results, the first of sample number `first`."""
        shape = (-1, self._identity.channels)
        values, status = results.values.reshape(shape), results.status.reshape(shape)
        for channel, history in enumerate(self._histories):
            history.add(first, values[:, channel].tolist())
        self._last = list(zip(values[-1].tolist(), status[-1].tolist(), strict=True))
        self._samples = first + len(values)

    def render(self, width: int = 80) -> Group:
        """Return what to print."""
        about = self._identity
        unit, rate = about.output_port.unit, about.sample_rate
        table = Table(box=None, pad_edge=False, header_style="bold")
        worn = self._initial is not None
        wear = [f"wear, {unit}", f"{unit}/h"] if worn else [f"{unit or 'steps'}/h"]
        for name in ("channel", f"{about.output_port.name}{f', {unit}' if unit else ''}", *wear):
            table.add_column(escape(name), justify="right")
        table.add_column("flags")
        for channel, (value, status) in enumerate(self._last):
            slope = self._histories[channel].slope()
            per_hour = "-" if slope is None else f"{slope * rate * 3600:+.3f}"
            depth = [f"{value - self._initial[channel]:.3f}"] if self._initial is not None else []
            table.add_row(str(channel), f"{value:.4f}", *depth, per_hour, _shown(about, status))
        head = Text.assemble(
            (about.name, "bold"),
            f" at {self._port}: {self.state}, {self._samples:,} samples, {self._samples / rate:,.1f} s",
            (f", {self.alarms} alarms" if self.alarms else "", "bold red"),
        )
        return Group(head, "", table, "", *self._plot(width))

    def _plot(self, width: int) -> list[Text]:
        if not self._last:
            return []
        initial = self._initial or [0.0] * len(self._last)
        channel = max(range(len(self._last)), key=lambda k: self._last[k][0] - initial[k])
        values = self._histories[channel].values
        low, high = min(values), max(values)
        rows = plot(values, max(width - 12, 20), 6)
        labels = [f"{high:10.4f} ", *[" " * 11] * (len(rows) - 2), f"{low:10.4f} "]
        title = f"channel {channel}" if len(self._last) > 1 else self._identity.output_port.name
        return [Text(f"{title:>10}"), *(Text(label + row) for label, row in zip(labels, rows, strict=True))]


def _initial(identity: Identity, manifest: Mapping[str, Any] | None) -> list[float] | None:
    """Clearance of each channel without wear, from the specification in the manifest."""
    wear = (manifest or {}).get("spec", {}).get("wear")
    if not wear:
        return None
    given = wear["initial"]
    return [float(value) for value in given] if isinstance(given, list) else [float(given)] * identity.channels


def _shown(identity: Identity, status: int) -> Text:
    raised = [flag for flag, bit in identity.flags.items() if status >> bit & 1]
    style = "red" if {"wear_critical", "fault"} & set(raised) else "yellow"
    return Text(", ".join(raised).replace("_", " ") or "-", style=style if raised else "")
