"""The paper's accuracies: tables 1, 2 and 4, and the percentages of text and abstract."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise

from sosmith.instrument.paper.comparison import Comparison, Part, compare, compare_accuracy, plain, table
from sosmith.instrument.paper.figures import PaperFigures
from sosmith.instrument.paper.regression import scatter

TABLES = ("table_1", "table_2", "table_4")


def unfiltered_parts(figures: PaperFigures) -> list[Part]:
    """Equation 7, table 1 and table 2."""
    return [_equation_7(figures), _table(figures, "table_1"), _table(figures, "table_2")]


def filtered_part(figures: PaperFigures) -> Part:
    """Table 4."""
    return _table(figures, "table_4")


def stated_part(figures: PaperFigures) -> Part:
    """Compare the accuracies stated in the abstract with those that follow from the tables."""
    unfiltered, filtered = (figures.number("abstract", name) for name in ("accuracy", "filtered_accuracy"))
    every = {name: (float(relative_reading(figures, name)), float(absolute_reading(figures, name))) for name in TABLES}
    head = ["accuracy in %", "printed error is relative", "printed error is in mm"]
    rows = [[_title(name), f"{relative:.4f}", f"{absolute:.4f}"] for name, (relative, absolute) in every.items()]
    nearest = min((abs(value - float(filtered)), value) for pair in every.values() for value in pair)[1]
    return Part(
        title="Accuracies of the abstract",
        where=figures.where("abstract"),
        finding=f"{unfiltered} % is table 2; {filtered} % follows from no table (the nearest is {nearest:.2f} %)",
        comparisons=(
            compare_accuracy("of the regression", unfiltered, relative_reading(figures, "table_2"), note="table 2"),
            Comparison(
                quantity="filtered in real time", unit="%", printed=filtered,
                note="it belongs to figure 19, which has no table and no numbers; table 4, the one table of filtered "
                f"readings, gives {every['table_4'][0]:.2f} % and states {figures.number('table_4', 'accuracy')} %",
            ),
        ),
        after=(
            table(head, rows),
            "The abstract sets one run without the filter beside another with it. The same run without and with it is "
            f"in tables 1 and 4: {every['table_1'][0]:.2f} % and {every['table_4'][0]:.2f} %.",
            "What the instrument achieves with errors of that size, emulated over many seeds and run through the "
            "hardware, is in [campaign.md](campaign.md).",
        ),
    )  # fmt: skip


def relative_reading(figures: PaperFigures, name: str) -> Fraction:
    """Accuracy in per cent if the printed errors are already relative."""
    return 100 - 100 * _mean(figures.numbers(name, "error"))


def absolute_reading(figures: PaperFigures, name: str) -> Fraction:
    """Accuracy in per cent by equation 7 if the printed errors are in mm."""
    errors, clearances = figures.numbers(name, "error"), figures.numbers(name, "clearance")
    return 100 - 100 * _mean([Fraction(e) / Fraction(d) for e, d in zip(errors, clearances, strict=True)])


def errors_in_mm(figures: PaperFigures, name: str) -> list[float]:
    """Errors of the rows in mm if the printed ones are relative."""
    errors, clearances = figures.numbers(name, "error"), figures.numbers(name, "clearance")
    return [float(e * d) for e, d in zip(errors, clearances, strict=True)]


def _mean(values: tuple[Decimal, ...] | list[Fraction]) -> Fraction:
    return sum(map(Fraction, values), Fraction(0)) / len(values)


def _rms(values: list[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def _title(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _equation_7(figures: PaperFigures) -> Part:
    head = ["", *(_title(name) for name in TABLES)]
    as_mm = [[float(error) for error in figures.numbers(name, "error")] for name in TABLES]
    as_parts = [errors_in_mm(figures, name) for name in TABLES]
    rows = [
        ["rms error in mm, if the printed error is in mm", *(plain(_rms(values), 3) for values in as_mm)],
        ["rms error in mm, if the printed error is relative", *(plain(_rms(values), 3) for values in as_parts)],
        [
            "accuracy in % by equation 7, if in mm",
            *(f"{float(absolute_reading(figures, name)):.4f}" for name in TABLES),
        ],
        ["accuracy in %, if relative", *(f"{float(relative_reading(figures, name)):.4f}" for name in TABLES)],
    ]
    expected = scatter(figures, float(figures.number("equation_4", "adjusted_r_squared")))
    times = expected / _rms(as_mm[0])
    return Part(
        title="Equation 7",
        where="section 3.3",
        finding=(
            "it divides by the true clearance; the tables' percentages do not, unless their errors are relative already"
        ),
        before=(
            r"$$\text{percent error} = \frac{|d_o - d_a|}{d_a} \cdot 100\,\%$$",
            "In tables 1, 2 and 4 the percentage is 100 times the error beside it, at every clearance. So either the "
            'column "error" is relative already, $|d_o - d_a| / d_a$, or it is in mm and the division is missing. '
            "The averages that the paper states use the percentages as printed, which is right under the first "
            "reading only.",
        ),
        after=(
            table(head, rows),
            f"Which reading holds the paper does not say. A scatter of {plain(expected, 2)} mm, which its adjusted $r$ "
            f"means, speaks for the first: under the second, readings would be {times:.0f} times better than the "
            "regression that makes them. `accuracy_percent` in our reports follows equation 7 as written.",
        ),
    )


def _table(figures: PaperFigures, name: str) -> Part:
    clearances, errors = figures.numbers(name, "clearance"), figures.numbers(name, "error")
    percent = figures.numbers(name, "percent")
    comparisons = [
        compare(f"error at {clearance} mm", error, Fraction(one) / 100, note="the percentage beside it over 100")
        for clearance, error, one in zip(clearances, errors, percent, strict=True)
    ]
    if name == "table_2":
        comparisons += [
            compare("average error", figures.number(name, "mean_error"), _mean(errors)),
            compare("average error", figures.number(name, "mean_percent"), _mean(percent), "%"),
        ]
    stated, ours = figures.number(name, "accuracy"), relative_reading(figures, name)
    comparisons.append(compare_accuracy("accuracy stated", stated, ours, note=_why(figures, name)))
    comparisons.append(
        compare_accuracy("accuracy if the errors are in mm", None, absolute_reading(figures, name), note="equation 7")
    )
    if name == "table_4":
        left = _mean(errors) / _mean(figures.numbers("table_1", "error"))
        comparisons.append(
            compare("mean error over that of table 1", None, left, note="it seems the same run without the filter")
        )
    return Part(
        title=_title(name),
        where=figures.where(name),
        finding=_finding(figures, name),
        comparisons=tuple(comparisons),
        after=_remarks(figures, name),
    )


def _remarks(figures: PaperFigures, name: str) -> tuple[str, ...]:
    if name == "table_1":
        return ("![Errors of tables 1, 2 and 4](images/paper_errors.svg)",)
    if name == "table_2":
        clearances = figures.numbers(name, "clearance")
        step = clearances[1] - clearances[0]
        gaps = [low + step for low, high in pairwise(clearances) if high - low > step]
        return (f"Without a row at {' and '.join(map(str, gaps))} mm, which the steps of {step} mm would have.",)
    return (_what_the_filter_leaves(figures),)


def _what_the_filter_leaves(figures: PaperFigures) -> str:
    """Compare the errors of table 4 with those of table 1, overall and where they are largest."""
    before, after = (figures.numbers(name, "error") for name in ("table_1", "table_4"))
    largest = sorted(range(len(before)), key=lambda k: -before[k])[:3]
    left = float(sum(after[k] for k in largest) / sum(before[k] for k in largest))
    where = ", ".join(str(figures.numbers("table_1", "clearance")[k]) for k in sorted(largest))
    return (
        "Tables 1 and 4 have the same positions, and errors that rise and fall together: they seem to be of one run, "
        f"without and with the filter. Of the largest errors, at {where} mm, the filter leaves {100 * left:.0f} %: "
        "they are systematic, of the regression or of the sensor, and no low-pass removes that."
    )


def _finding(figures: PaperFigures, name: str) -> str:
    stated, ours, other = (
        figures.number(name, "accuracy"),
        float(relative_reading(figures, name)),
        float(absolute_reading(figures, name)),
    )
    return f"stated {stated} %, the rows give {ours:.4f} % as printed and {other:.4f} % by equation 7 with errors in mm"


def _why(figures: PaperFigures, name: str) -> str:
    """Explain the accuracy that is stated with a table."""
    if name != "table_4":
        return "100 % minus the mean of the percentages"
    errors = figures.numbers(name, "error")
    eleven = 100 - 100 * _mean(errors) * len(errors) / (len(errors) + 1)
    return (
        "the mean of the ten percentages leaves less; the stated figure would come out if their sum were divided by "
        f"eleven ({float(eleven):.2f} %)"
    )
