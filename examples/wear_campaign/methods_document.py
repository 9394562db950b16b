"""The document's section on ways of fitting, and its picture, from recorded figures only."""

from __future__ import annotations

from typing import Any

import numpy as np
from examples.wear_campaign import wear_intervals
from matplotlib.figure import Figure
from scipy import stats

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

DEGREES = {"bench_43_50": "43 to 50 degC", "bench_92_96": "92 to 96 degC"}
WEAR = {"depth": "depth", "rate": "rate", "life": "remaining life"}

CEILING = "the true sensor's own curve"

FEW_LINEAR = 0.05
"""Share of linear fits up to which the paper's rule loses nothing by them."""


def section(
    rows: list[dict[str, Any]], rule: list[dict[str, Any]], wear: dict[str, Any], settings: dict[str, Any]
) -> list[str]:
    """Return the section's blocks: text, and tables."""
    own, share = settings["methods"], 100 * settings["confidence"]
    mains = [row for row in rows if "," not in row["case"]]
    week = [row for row in mains if row["case"] == "a_week_in_service"]
    told = ", ".join(f"{gain(row):+.2f} with {SENSORS[row['sensor']]}" for row in week)
    worst = ", ".join(
        f"{worst_of(row, 'bayes') - worst_of(row, 'paper'):+.1f} with {SENSORS[row['sensor']]}" for row in week
    )
    fell = sum(float(np.mean(row["methods"]["bayes"]["plain"])) for row in week) / len(week)
    return [
        "## Which way of fitting",
        "The same measurements, fitted in three ways ([calibration.md](calibration.md)): by the paper's rule; by "
        "least squares with the paper's orders 2, 1 whatever r is reached; and by `bayes`. For each of "
        f"{settings['seeds']} seeds and each of {len(own['sensors'])} true sensors: the paper's equation 5a, its "
        "equation 4, and a coil with a core; `bayes` takes each for a sensor of the type equation 5a. In double "
        "precision, with the paper's filter on the bench and that from spectra in the week. Mean accuracy in % with "
        f"its {share:.0f} % interval, and the worst seed. The true sensors of a seed share their streams of random "
        f"numbers: scatter, noise and errors of the days are the same for all of them, so that the {len(mains)} cases "
        "are fewer than as many independent results.",
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
        *_ceilings([row for row in mains if row not in week]),
        *_linear_fits(rule, [row for row in mains if row not in week], settings),
        *_variants([row for row in rows if row not in mains], own),
        *_intervals(mains, settings),
        *_wear_intervals(wear),
    ]


def _ceilings(benches: list[dict[str, Any]]) -> list[str]:
    """Say how much of the error a calibration can take away on the bench, and what the paper's rule loses."""
    rows = []
    for row in benches:
        means = {name: one["mean"] for name, one in row["accuracy"].items()}
        linear = of_order_1(row)
        accuracies = np.array(row["methods"]["paper"]["accuracy"])
        rows.append(
            [
                NAMES[row["case"]],
                SENSORS[row["sensor"]],
                f"{np.count_nonzero(linear)} of {len(linear)}",
                f"{accuracies[linear].mean():.2f}" if linear.any() else "-",
                f"{accuracies[~linear].mean():.2f}" if not linear.all() else "-",
                *(f"{means[name]:.2f}" for name in ("bayes", "own curve", "own polynomial", "day polynomial")),
                f"{ceiling(row):+.2f}",
            ]
        )
    return [
        "### What a calibration can gain on the bench",
        "The depot's measurements are of other days than the run, whose systematic error is new. The most that they "
        "can show, if there were any number of them, is the true sensor's own curve; with it in place of a "
        "calibration, only the day's error and the noise are left. Beside it stand the polynomials of orders 2, 1, "
        "which is what the datapath has, nearest to that curve and to the curve of the very day. With equation 4, the "
        "sensor is at its rail of 0 V at the smallest clearance: the curve says only where the rail begins, a "
        "polynomial can allow for it. The last column is the most that any way of fitting gains from these "
        "measurements over the paper's rule, but for luck. Mean accuracies in %; those of the paper's rule apart for "
        "the seeds in which it keeps a linear fit and for the others.",
        table(
            [
                "run",
                "true sensor",
                "linear fits",
                "there, %",
                "other fits, %",
                "bayes, %",
                "own curve, %",
                "as a polynomial, %",
                "that of the day, %",
                "the better of both over the paper, points",
            ],
            rows,
        ),
        _reason(benches),
    ]


def _linear_fits(rule: list[dict[str, Any]], benches: list[dict[str, Any]], settings: dict[str, Any]) -> list[str]:
    """Say how often the paper's rule keeps a linear fit, over many seeds, and what that means for gains over it."""
    rows = []
    for row, compared in zip(rule, benches, strict=True):
        accuracy, linear = np.array(row["accuracy"]), np.array(row["order"]) == 1
        some = slice(settings["seeds"])
        low, high = share_of(linear, settings["confidence"])
        mean, error = gain_with_share(linear, compared)
        rows.append(
            [
                NAMES[row["case"]],
                SENSORS[row["sensor"]],
                f"{100 * linear[some].mean():.1f}",
                f"{100 * linear.mean():.1f} ({100 * low:.1f} to {100 * high:.1f})",
                f"{accuracy[linear].mean():.2f}" if linear.any() else "-",
                f"{accuracy[~linear].mean():.2f}" if not linear.all() else "-",
                f"{accuracy[some].mean():.2f}",
                f"{accuracy.mean():.2f}",
                f"{gain(compared):+.2f}",
                f"{mean:+.2f} +- {error:.2f}",
            ]
        )
    few, many = settings["seeds"], settings["methods"]["rule_seeds"]
    return [
        f"The share of linear fits decides what the rule loses, and {few} seeds know it badly. Here it is over {many} "
        f"seeds of the rule alone, with its {100 * settings['confidence']:.0f} % interval (Clopper and Pearson). "
        f"For the other methods {few} seeds are enough: among fits of one kind what `bayes` gains over the rule, seed "
        f"by seed, varies little. The last column has the mean gains among the linear fits and among the others, of "
        f"{few} seeds, in the shares of {many} (post-stratification), with the standard error of both.",
        table(
            [
                "run",
                "true sensor",
                f"linear of {few}, %",
                f"linear of {many}, %",
                "there, %",
                "other fits, %",
                f"mean of {few}, %",
                f"mean of {many}, %",
                f"bayes over the rule by {few}, points",
                f"with the share of {many}, points",
            ],
            rows,
        ),
    ]


def _reason(benches: list[dict[str, Any]]) -> str:
    """Say why the gains differ."""
    most = max(benches, key=lambda row: np.mean(of_order_1(row)))
    fewest = [row for row in benches if np.mean(of_order_1(row)) <= FEW_LINEAR]
    text = (
        "What the paper's rule loses are its linear fits: they pass an adjusted r of 0.975 or not by chance, "
        f"{np.count_nonzero(of_order_1(most))} of {len(of_order_1(most))} times with {SENSORS[most['sensor']]} at "
        f"{DEGREES[most['case']]}. Where it takes order 2, hundreds of measurements leave every way of fitting the "
        "same curve, and what is left is the error of the day, which only measurements of that day can show."
    )
    for row in fewest:
        text += (
            f" With {SENSORS[row['sensor']]} at {DEGREES[row['case']]} it keeps "
            f"{np.count_nonzero(of_order_1(row))} linear fits, and the true sensor's curve itself "
            f"gains {ceiling(row):+.2f} points: no way of fitting reaches more from these measurements. `bayes` "
            f"differs from the rule by {paired(row)} points."
        )
    return text


def _variants(rows: list[dict[str, Any]], own: dict[str, Any]) -> list[str]:
    return [
        f"What helps, and what harms, with {own['variant_seeds']} seeds: measurements of the same day as the run, "
        f"measurements at {own['near'][0]:g} to {own['near'][-1]:g} mm, where "
        f"the wheels are, and {100 * own['outliers']:g} % of the measurements off by 3 mm:",
        table(
            ["run", "true sensor", *(f"{name}, %" for name in METHODS.values()), "bayes over the paper, points"],
            [
                [
                    NAMES[row["case"]],
                    SENSORS[row["sensor"]],
                    *(accuracy(row, method) for method in METHODS),
                    f"{gain(row):+.2f}",
                ]
                for row in rows
            ],
        ),
    ]


def _intervals(mains: list[dict[str, Any]], settings: dict[str, Any]) -> list[str]:
    """Say how often the intervals hold the true clearance."""
    inside, alone, paper = (
        [100 * float(np.mean(row["methods"][method][f"{which}inside"])) for row in mains]
        for method, which in (("bayes", ""), ("bayes", "calibration "), ("paper", ""))
    )
    kinds = (("bayes", ""), ("bayes", "calibration "), ("paper", ""))
    first = settings["methods"]["sensors"][0]
    of_first = [row for row in mains if row["sensor"] == first]
    sources = list(dict.fromkeys(source for row in of_first for source in row["budget"]))
    return [
        "### How often the intervals hold",
        "A reading's 95 % interval is that of its uncertainty budget "
        "([calibration.md](calibration.md#what-a-reading-is-worth)): the calibration with its covariance, the day's "
        "systematic error, and what is stated of the instruments in `campaign.toml`. With `bayes`, it holds "
        f"{min(inside):.1f} to {max(inside):.1f} % of the filtered readings' true clearances; the interval of the "
        f"calibration alone {min(alone):.1f} to {max(alone):.1f} %; the budget with a calibration by the paper's rule, "
        f"which knows nothing of the days' errors, {min(paper):.1f} to {max(paper):.1f} %. All readings of a bench run "
        "share one systematic error. So that a single day's luck does not decide, the intervals of each seed's "
        f"calibration are held against {settings['methods']['interval_days']} such runs, each on another day. +- is "
        "the standard error over the seeds.",
        table(
            [
                "run",
                "true sensor",
                *("bayes, the whole budget: inside, %", "half-width, mm"),
                *("the calibration alone: inside, %", "half-width, mm"),
                *("the paper's rule, the whole budget: inside, %", "half-width, mm"),
            ],
            [
                [
                    NAMES[row["case"]],
                    SENSORS[row["sensor"]],
                    *(
                        text
                        for method, which in kinds
                        for text in (
                            f"{100 * np.mean(row['methods'][method][which + 'inside']):.1f} "
                            f"+- {sampling(row, method, which + 'inside'):.1f}",
                            f"{np.mean(row['methods'][method][which + 'half_width']):.3f}",
                        )
                    ),
                ]
                for row in mains
            ],
        ),
        f"Where it comes from, with {SENSORS[first]}: standard uncertainty by source in um, on average over readings.",
        table(
            ["source", *(NAMES[row["case"]] for row in of_first)],
            [
                [
                    source,
                    *(f"{1000 * row['budget'][source]:.3g}" if source in row["budget"] else "-" for row in of_first),
                ]
                for source in sources
            ],
        ),
    ]


def _wear_intervals(found: dict[str, Any]) -> list[str]:
    return [
        f"The budget goes on into wear ([wear.md](wear.md)). Of {wear_intervals.RUNS} records of "
        f"{wear_intervals.DAYS} days with a calibration that is off by {wear_intervals.OFFSET:g} mm and "
        f"{100 * wear_intervals.GAIN:g} % rms, days by {wear_intervals.SYSTEMATIC:g} mm rms and readings by "
        f"{wear_intervals.SCATTER:g} mm rms, its 95 % intervals hold the true value as often as this, with that "
        "uncertainty stated and without:",
        table(
            ["interval of", "with the budget, %", "by the scatter alone, %"],
            [[WEAR[what], f"{100 * one['with']:.1f}", f"{100 * one['without']:.1f}"] for what, one in found.items()],
        ),
    ]


def ceiling(row: dict[str, Any]) -> float:
    """Return by how many points the true sensor's curve, or its polynomial, is above the paper's rule."""
    mean = {name: float(one["mean"]) for name, one in row["accuracy"].items()}
    return max(mean["own curve"], mean["own polynomial"]) - mean["paper"]


def of_order_1(row: dict[str, Any]) -> Any:
    """Return for which seeds the paper's rule keeps a fit that is linear in the voltage."""
    return np.array(row["methods"]["paper"]["order"]) == 1


def share_of(chosen: Any, confidence: float) -> tuple[float, float]:
    """Return the exact confidence interval of a share (Clopper and Pearson 1934)."""
    found = stats.binomtest(int(np.count_nonzero(chosen)), len(chosen)).proportion_ci(confidence)
    return float(found.low), float(found.high)


def gain_with_share(linear: Any, row: dict[str, Any]) -> tuple[float, float]:
    """Return what `bayes` gains over the paper's rule in points with another share of linear fits, and its error.

    `linear` says of each of many seeds whether the rule keeps a linear fit; `row` has fewer seeds, of all methods. The
    mean is that of both kinds of fits in those shares. Its standard error has in it that of the share, binomial, and
    those of the two means; one seed of a kind says nothing of how much it varies, which then counts as its own gain.
    """
    apart = np.subtract(*(row["methods"][method]["accuracy"] for method in ("bayes", "paper")))
    total, variance, means = 0.0, 0.0, []
    for share, own in ((np.mean(linear), apart[of_order_1(row)]), (np.mean(~linear), apart[~of_order_1(row)])):
        means.append(float(own.mean()) if len(own) else 0.0)
        spread = own.var(ddof=1) / len(own) if len(own) > 1 else means[-1] ** 2
        total += share * means[-1]
        variance += share**2 * spread
    share = float(np.mean(linear))
    variance += (means[0] - means[1]) ** 2 * share * (1 - share) / len(linear)
    return float(total), float(np.sqrt(variance))


def paired(row: dict[str, Any]) -> str:
    """Return the mean difference of `bayes` from the paper's rule in points, with its standard error."""
    apart = np.subtract(*(row["methods"][method]["accuracy"] for method in ("bayes", "paper")))
    return f"{apart.mean():+.2f} +- {apart.std(ddof=1) / np.sqrt(len(apart)):.2f}"


def gain(row: dict[str, Any]) -> float:
    """Return by how many points the mean of `bayes` is above the paper's rule."""
    return float(row["accuracy"]["bayes"]["mean"] - row["accuracy"]["paper"]["mean"])


def worst_of(row: dict[str, Any], method: str) -> float:
    """Return the accuracy of the worst seed."""
    return float(min(row["methods"][method]["accuracy"]))


def sampling(row: dict[str, Any], method: str, figure: str) -> float:
    """Return the standard error in points of a mean share, over seeds."""
    inside = 100 * np.array(row["methods"][method][figure])
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
        if "own curve" in row["accuracy"]:
            most = row["accuracy"]["paper"]["mean"] + ceiling(row)
            axes.plot([most, most], [-(k - 0.2), -(k + 0.58)], color=GREY, lw=2.0, label=None if k else CEILING)
        ticks.append(-(k + 0.19))
        names.append(f"{NAMES[row['case']]}: {SENSORS[row['sensor']]}")
    axes.set_yticks(ticks, names)
    axes.set_xlim(80, 100)
    axes.set_xlabel("accuracy by equation 7, %: a tick for each seed, the mean as a dot with its interval")
    figure.legend(loc="outside upper center", ncols=2)
