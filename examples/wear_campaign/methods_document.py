"""The document's section on ways of fitting, and its picture, from recorded figures only."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

BLUE, RED, GREY, INK = "#2563a8", "#b4432f", "#8a8a8a", "#222222"

NAMES = {
    "bench_43_50": "bench, 43 to 50 degC",
    "bench_92_96": "bench, 92 to 96 degC",
    "a_week_in_service": "week",
    "bench_43_50, same day": "bench, 43 to 50 degC, measured on the same day too",
    "bench_92_96, same day": "bench, 92 to 96 degC, measured on the same day too",
    "a_week_in_service, near": "week, measured where the wheels are",
    "a_week_in_service, outliers": "week, outliers among the measurements",
}
"""Cases as the document calls them."""

SENSORS = {"equation_5a": "equation 5a", "equation_4": "equation 4", "coil": "coil"}
METHODS = {"paper": "the paper's rule", "least squares": "least squares, orders 2, 1", "bayes": "bayes"}
"""Methods as the document calls them."""


def section(rows: list[dict[str, Any]], settings: dict[str, Any]) -> list[str]:
    """Return the section's blocks: text, and tables as lists of rows."""
    own, share = settings["methods"], 100 * settings["confidence"]
    mains = [row for row in rows if "," not in row["case"]]
    week = [row for row in mains if row["case"] == "a_week_in_service"]
    told = ", ".join(f"{gain(row):+.2f} with {SENSORS[row['sensor']]}" for row in week)
    worst = ", ".join(
        f"{worst_of(row, 'bayes') - worst_of(row, 'paper'):+.1f} with {SENSORS[row['sensor']]}" for row in week
    )
    inside = [100 * float(np.mean(row["methods"]["bayes"]["inside"])) for row in mains]
    own_inside = [100 * float(np.mean(row["methods"]["paper"]["inside"])) for row in mains]
    fell = sum(float(np.mean(row["methods"]["bayes"]["plain"])) for row in week) / len(week)
    return [
        "## Which way of fitting",
        "The same measurements, fitted in three ways ([calibration.md](calibration.md)): by the paper's rule; by "
        "least squares with the paper's orders 2, 1 whatever r is reached; and by `bayes`. For each of "
        f"{settings['seeds']} seeds and each of {len(own['sensors'])} true sensors: the paper's equation 5a, its "
        "equation 4, and a coil with a core; `bayes` takes each for a sensor of the type equation 5a. In double "
        "precision, with the paper's filter on the bench and that from spectra in the week. Mean accuracy in % with "
        f"its {share:.0f} % interval, and the worst seed.",
        table(
            ["run", "true sensor", *(f"{name}, %" for name in METHODS.values()), "bayes over the paper, points"],
            [
                [
                    NAMES[row["case"]],
                    SENSORS[row["sensor"]],
                    *(accuracy(row, method) for method in METHODS),
                    f"{gain(row):+.2f}",
                ]
                for row in mains
            ],
        ),
        "![Accuracy of every seed by method, case and sensor](images/campaign_methods.svg)",
        f"In the week, `bayes` gains on average, in points: {told}; in the worst seed: {worst}. The day's own "
        f"curve was left out on {100 * fell:.1f} % of the days, because a polynomial with it left the output's range "
        "or fell.",
        "An interval says what a calibration is worth if it holds as often as it claims. Those of `bayes` hold "
        f"{min(inside):.1f} to {max(inside):.1f} % of the filtered readings' true clearances for 95 % claimed; those "
        f"of the paper's rule, which knows only the standard error of its curve, {min(own_inside):.1f} to "
        f"{max(own_inside):.1f} %. All readings of a bench run share one systematic error: such a share is known to a "
        "few points only, as its standard error over the seeds says.",
        table(
            ["run", "true sensor", "bayes: inside, %", "half-width, mm", "the paper's: inside, %", "half-width, mm"],
            [
                [
                    NAMES[row["case"]],
                    SENSORS[row["sensor"]],
                    *(
                        text
                        for method in ("bayes", "paper")
                        for text in (
                            f"{100 * np.mean(row['methods'][method]['inside']):.1f} +- {sampling(row, method):.1f}",
                            f"{np.mean(row['methods'][method]['half_width']):.3f}",
                        )
                    ),
                ]
                for row in mains
            ],
        ),
        f"What helps, and what harms, with equation 5a as the true sensor and {own['variant_seeds']} seeds: "
        f"measurements of the same day as the run, measurements at {own['near'][0]:g} to {own['near'][-1]:g} mm, where "
        f"the wheels are, and {100 * own['outliers']:g} % of the measurements off by 3 mm:",
        table(
            ["run", *(f"{name}, %" for name in METHODS.values())],
            [[NAMES[row["case"]], *(accuracy(row, method) for method in METHODS)] for row in rows if row not in mains],
        ),
    ]


def gain(row: dict[str, Any]) -> float:
    """Return by how many points the mean of `bayes` is above the paper's rule."""
    return float(row["accuracy"]["bayes"]["mean"] - row["accuracy"]["paper"]["mean"])


def worst_of(row: dict[str, Any], method: str) -> float:
    """Return the accuracy of the worst seed."""
    return float(min(row["methods"][method]["accuracy"]))


def sampling(row: dict[str, Any], method: str) -> float:
    """Return the standard error in points of the mean share inside, over seeds."""
    inside = 100 * np.array(row["methods"][method]["inside"])
    return float(inside.std(ddof=1) / np.sqrt(len(inside)))


def accuracy(row: dict[str, Any], method: str) -> str:
    """Return mean, interval and worst seed."""
    found = row["accuracy"][method]
    return f"{found['mean']:.2f} ({found['low']:.2f} to {found['high']:.2f}; {worst_of(row, method):.1f})"


def table(heads: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def draw(figure: Figure, rows: list[dict[str, Any]]) -> None:
    """Draw a line for each case and sensor, with a tick for each seed, for the paper's rule and for bayes."""
    axes = figure.subplots()
    ticks, names = [], []
    for k, row in enumerate(rows):
        for j, (method, colour) in enumerate((("paper", RED), ("bayes", BLUE))):
            y = -(k + 0.38 * j)
            values = np.array(row["methods"][method]["accuracy"])
            axes.plot(values, np.full(len(values), y), "|", color=colour, ms=7, alpha=0.6)
            mean = row["accuracy"][method]
            axes.plot([mean["low"], mean["high"]], [y, y], color=INK, lw=2.0, solid_capstyle="butt")
            axes.plot([mean["mean"]], [y], "o", color=colour, mec=INK, ms=5, label=METHODS[method] if not k else None)
        ticks.append(-(k + 0.19))
        names.append(f"{NAMES[row['case']]}: {SENSORS[row['sensor']]}")
    axes.set_yticks(ticks, names)
    axes.set_xlim(80, 100)
    axes.set_xlabel("accuracy by equation 7, %: a tick for each seed, the mean as a dot with its interval")
    figure.legend(loc="outside upper center", ncols=2)
