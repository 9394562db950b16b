"""The paper's vehicle: equation 20 and tables 5 to 8."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal

from sosmith.gen.paper_comparison import Comparison, Part, compare
from sosmith.model.paper_figures import PaperFigures

_WHEELS = ("right", "left")
_BOGIES = ("bogie 1", "bogie 2")

Row = tuple[str, str, Decimal]
"""Quantity, unit and printed figure."""


def vehicle_parts(figures: PaperFigures) -> list[Part]:
    """Equation 20 and tables 5 to 8."""
    return [_equation_20(), *(_table(figures, number) for number in (5, 6, 7)), _table_8(figures)]


def printed_rows(figures: PaperFigures, number: int) -> list[Row]:
    """Figures of table 5, 6, 7 or 8 in the order printed, right wheels and bogie 1 first."""
    rows: list[Row] = []
    if number == 8:
        for motion in ("vertical", "lateral", "yaw"):
            for k, value in enumerate(figures.numbers("table_8", motion)):
                body = f"wheelset {k + 1}" if k < 6 else f"bogie {k - 5}"
                rows.append((f"{motion}, {body}", "dB", value))
        return rows
    name, columns, unit = {
        5: ("vertical", _WHEELS, "mm"),
        6: ("lateral", _WHEELS, "mm"),
        7: ("yaw", _BOGIES, "rad"),
    }[number]
    for k, values in enumerate(figures.rows(f"table_{number}", name)):
        for column, value in zip(columns, values, strict=True):
            body = f"wheelset {k + 1}, {column} wheel" if number < 7 else f"{column}, wheelset {k + 1}"
            rows.append((body, unit, value))
    if number == 5:
        rows.append(("bogie frame, in the text", "mm", figures.number("table_5", "frame")))
    return rows


def _equation_20() -> Part:
    return Part(
        title="Equation 20",
        where="section 5.1",
        finding="the general equation of motion, without figures; masses, stiffnesses and dampings are not printed",
    )


def _table(figures: PaperFigures, number: int) -> Part:
    return Part(
        title=f"Table {number}",
        where=figures.where(f"table_{number}"),
        finding="maxima of the paper's multi-body simulation, whose parameters are not printed",
        comparisons=tuple(_not_modelled(row) for row in printed_rows(figures, number)),
    )


def _not_modelled(row: Row) -> Comparison:
    quantity, unit, printed = row
    return compare(
        quantity, printed, None, unit, note="the paper's vehicle of 106 degrees of freedom is not described by figures"
    )


def _table_8(figures: PaperFigures) -> Part:
    table = {motion: figures.numbers("table_8", motion) for motion in ("vertical", "lateral", "yaw")}
    wheelsets = {motion: values[:6] for motion, values in table.items()}

    def ripples(motion: str, pick: Callable[[tuple[Decimal, ...]], Decimal], which: int) -> Comparison:
        ripple = figures.numbers("table_8", f"{motion}_wheelsets")[which]
        return _from_ripple(
            f"{motion}, {'largest' if which == 0 else 'smallest'} of the wheelsets", pick(wheelsets[motion]), ripple
        )

    comparisons = [
        comparison for motion in wheelsets for comparison in (ripples(motion, max, 0), ripples(motion, min, 1))
    ]
    comparisons += [
        _from_ripple(f"{motion}, bogies", table[motion][6], figures.number("table_8", f"{motion}_frame"))
        for motion in ("vertical", "lateral")
    ]
    comparisons += [_not_modelled(row) for row in printed_rows(figures, 8)]
    return Part(
        title="Table 8",
        where=figures.where("table_8"),
        finding=r"the attenuations are $-20 \log_{10} \delta$ of the ripples in the text, but for one end of a range",
        comparisons=tuple(comparisons),
    )


def _from_ripple(quantity: str, printed: Decimal, ripple: Decimal) -> Comparison:
    ours = -20 * math.log10(ripple)
    needed = 10 ** (-float(printed) / 20)
    return compare(
        quantity, printed, ours, "dB",
        note=f"$\\delta$ = {ripple} in the text; the printed figure is that of {needed:.4f}",
    )  # fmt: skip
