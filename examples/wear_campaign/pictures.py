"""Pictures of the campaign as SVG, the same bytes for the same results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from examples.wear_campaign.methods_document import draw
from matplotlib.figure import Figure

from sosmith.gen.picture import picture
from sosmith.gen.report.figures.painting import envelope
from sosmith.instrument.paper.figures import PaperFigures, read_paper_figures

BLUE, RED, GREEN, GREY, INK = "#2563a8", "#b4432f", "#2f7d4f", "#9a9a9a", "#222222"

SETTLED_FROM = 20.0
"""Time in s from which the rides are drawn."""

POINTS = 900
"""Largest number of points of a curve; longer ones are decimated."""


def pictures(results: dict[str, Any], series: dict[str, Any]) -> dict[str, bytes]:
    """Draw all pictures; return their files by name."""
    painted: dict[str, tuple[float, Callable[[Figure], None]]] = {
        "methods": (6.4, lambda figure: draw(figure, results["methods"])),
        "bench": (3.4, lambda figure: bench(figure, results["bench"])),
        "runs": (3.4, lambda figure: runs(figure, series["runs"])),
        "ride": (5.4, lambda figure: ride(figure, results["ride"], series["ride"])),
        "week": (3.4, lambda figure: week(figure, results["week"], series["week"])),
    }
    drawn = {name: one for name, one in painted.items() if name == "methods" or name in series}
    return {
        f"campaign_{name}.svg": picture("campaign", (8.6, height), paint, style={"legend.frameon": False})
        for name, (height, paint) in drawn.items()
    }


def bench(figure: Figure, results: dict[str, Any]) -> None:
    """Accuracies of all seeds with their mean, and the paper's."""
    figures = read_paper_figures()
    axes = figure.subplots()
    rows = [row for row in results["runs"] if row["filter"] == "the paper's"] + results["others"]
    ticks, names = [], []
    for k, row in enumerate(rows):
        for j, (what, column) in enumerate((("unfiltered", 0), ("golden", 1))):
            y = -(2.6 * k + j)
            values = np.array(row["values"])[:, column]
            axes.plot(values, np.full(len(values), y), "|", color=BLUE if j else GREY, ms=9, alpha=0.7)
            mean = row[what]
            axes.plot([mean["low"], mean["high"]], [y, y], color=INK, lw=2.5, solid_capstyle="butt")
            axes.plot([mean["mean"]], [y], "o", color=INK, ms=4)
            ticks.append(y)
            reading = ", as mm" if "millimetres" in row["scenario"] else ""
            names.append(
                f"{row['scenario'][6:11].replace('_', ' to ')} degC{reading}, {'filtered' if j else 'unfiltered'}"
            )
    unfiltered, filtered = stated(figures)
    axes.axvline(unfiltered, color=RED, ls="--", lw=1.2, label=f"the paper, unfiltered: {unfiltered:g} %")
    axes.axvline(filtered, color=RED, ls="-", lw=1.2, label=f"the paper, filtered: {filtered:g} %")
    axes.set_yticks(ticks, names)
    axes.set_xlim(max(80.0, float(min(np.min(row["values"]) for row in rows)) - 1), 100)
    axes.set_xlabel("accuracy by equation 7, %: a bar for each seed, mean and its interval in black")
    figure.legend(loc="outside upper center", ncols=2)


def stated(figures: PaperFigures) -> tuple[float, float]:
    """Return the accuracies in per cent of the paper's abstract: without and with the filter."""
    return float(figures.number("abstract", "accuracy")), float(figures.number("abstract", "filtered_accuracy"))


def runs(figure: Figure, series: dict[str, Any]) -> None:
    """Draw one run of each scenario: error before and after the filter."""
    for axes, (name, signals) in zip(figure.subplots(1, 2), series.items(), strict=True):
        time = signals["time"]
        axes.plot(time, 1000 * (signals["measured"] - signals["true"]), color=GREY, lw=0.6, label="before the filter")
        axes.plot(time, 1000 * (signals["filtered"] - signals["true"]), color=BLUE, lw=1.0, label="behind it")
        axes.set_title(name, fontsize=9, loc="left")
        axes.set_ylim(-600, 400)
        axes.set_xlabel("time, s")
        axes.set_ylabel("measured minus true clearance, µm")
        axes.legend(loc="lower right", framealpha=1.0, frameon=True)


def ride(figure: Figure, results: dict[str, Any], series: dict[str, Any]) -> None:
    """Draw the rides: clearance before and after each filter."""
    rides = list(dict.fromkeys(row["scenario"] for row in results["runs"]))
    all_axes = figure.subplots(len(rides), 1, sharex=True)
    for axes, name in zip(np.atleast_1d(all_axes), rides, strict=True):
        found = [result for result in series["results"] if result.scenario == name]
        time, before = envelope(found[0].time, found[0].before, POINTS)
        axes.plot(time, before, color=GREY, lw=0.7, label="measured")
        for result, colour in zip(found, (BLUE, GREEN, RED), strict=True):
            if result.filter == "pre-warped 10 Hz":
                thin_time, thin = envelope(result.time, result.after, POINTS)
                axes.plot(thin_time, thin, color=colour, lw=0.7, label=result.filter)
            else:
                axes.plot(result.time[::20], result.after[::20], color=colour, lw=1.6, label=result.filter)
        axes.axhline(series["clearance"], color=INK, lw=0.8, ls=":", label="true")
        axes.set_title(name, fontsize=9, loc="left")
        axes.set_xlim(SETTLED_FROM, None)
        axes.set_ylim(3, 7)
        axes.set_ylabel("clearance, mm")
    axes.set_xlabel("time, s; what is read begins at 40 s")
    handles, labels = np.atleast_1d(all_axes)[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5)


def week(figure: Figure, results: dict[str, Any], series: dict[str, Any]) -> None:
    """Draw the wear of the week, and the accuracy of each day."""
    left, right = figure.subplots(1, 2)
    found = series["week"]
    initial = found.limits.initial
    left.plot(found.time, found.clearance - initial, ".", color=BLUE, ms=1.2, rasterized=True, label="read")
    left.plot(found.time, found.truth - initial, color=INK, lw=1.2, label="true")
    left.axhline(found.limits.warning, color=RED, ls="--", lw=1, label="warning")
    left.set_xlabel("day")
    left.set_ylabel("wear, mm")
    left.legend(loc="upper left")
    days = [day["day"] for day in results["days"]]
    for name, label, colour in (
        ("first", "calibration of day 0", GREY),
        ("updated", "updated every morning", BLUE),
        ("factory", "equation 5a, what the sensor began as", GREEN),
    ):
        right.plot(days, [day["accuracy"][name] for day in results["days"]], "o-", color=colour, ms=4, label=label)
    right.set_xlabel("day")
    right.set_ylabel("accuracy by equation 7, %")
    right.legend(loc="lower right", fontsize=8)
    right.set_ylim(right.get_ylim()[0] - 6, None)
