"""The paper's vehicle: equation 20 and tables 5 to 8."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal

from sosmith.gen.paper_comparison import Comparison, Part, compare
from sosmith.model.paper_figures import PaperFigures

_WHEELSETS = 6
_MOTIONS = ("vertical", "lateral", "yaw")
_NOT_DESCRIBED = "the paper's vehicle of 106 degrees of freedom is not described by figures"


@dataclass(frozen=True, kw_only=True)
class Simulated:
    """A figure of a vehicle of ours.

    Attributes
    ----------
    value : float
        In the unit of the table.
    same_quantity : bool
        Whether it is what the paper's figure is.
    why : str
        What stands between the two.
    """

    value: float
    same_quantity: bool
    why: str


@dataclass(frozen=True, kw_only=True)
class SimulatedRun:
    """A run of our vehicle over the paper's track.

    Attributes
    ----------
    rows : mapping
        Figures by the quantities of `printed_rows`.
    remarks : tuple of str
        What must be known of the run. Markdown.
    """

    rows: Mapping[str, Simulated]
    remarks: tuple[str, ...]


def vehicle_parts(figures: PaperFigures, run: SimulatedRun) -> list[Part]:
    """Equation 20 and tables 5 to 8, with the figures of a run of ours where it has them."""
    return [_equation_20(run), *(_table(figures, number, run) for number in (5, 6, 7)), _table_8(figures, run)]


def printed_rows(figures: PaperFigures, number: int) -> Iterator[tuple[str, str, Decimal]]:
    """Quantity, unit and figure of each cell of table 5, 6, 7 or 8, column by column of a row."""
    if number == 8:
        columns = [figures.numbers("table_8", motion) for motion in _MOTIONS]
        for k in range(len(columns[0])):
            body = f"wheelset {k + 1}" if k < _WHEELSETS else f"bogie {k + 1 - _WHEELSETS}"
            for motion, column in zip(_MOTIONS, columns, strict=True):
                if k < len(column):
                    yield f"{motion} at 50 Hz, {body}", "dB", column[k]
        return
    name, sides, unit = {
        5: ("vertical", (", right wheel", ", left wheel"), "mm"),
        6: ("lateral", (" to the right", " to the left"), "mm"),
        7: ("yaw", (" to bogie 1", " to bogie 2"), "rad"),
    }[number]
    for k, values in enumerate(figures.rows(f"table_{number}", name)):
        for side, value in zip(sides, values, strict=True):
            yield f"{name}, wheelset {k + 1}{side}", unit, value
    if number == 5:
        yield "vertical, bogie", "mm", figures.number("table_5", "frame")


def _equation_20(run: SimulatedRun) -> Part:
    return Part(
        title="Equation 20",
        where="section 5.1",
        finding="the general equation of motion, without figures; masses, stiffnesses and dampings are not printed",
        before=run.remarks,
    )


def _table(figures: PaperFigures, number: int, run: SimulatedRun) -> Part:
    comparisons = tuple(_rows(figures, number, run))
    return Part(
        title=f"Table {number}",
        where=figures.where(f"table_{number}"),
        finding=f"maxima of a multi-body simulation whose parameters are not printed{_compared(comparisons)}",
        comparisons=comparisons,
    )


def _compared(comparisons: tuple[Comparison, ...]) -> str:
    """Say between which factors ours lie."""
    ratios = [float(one.ours / one.printed) for one in comparisons if one.ours is not None and one.printed]
    return f"; ours are {min(ratios):.2g} to {max(ratios):.2g} times these" if ratios else ""


def _rows(figures: PaperFigures, number: int, run: SimulatedRun) -> Iterator[Comparison]:
    for quantity, unit, printed in printed_rows(figures, number):
        if quantity in run.rows:
            ours = run.rows[quantity]
            yield compare(quantity, printed, ours.value, unit, note=ours.why, comparable=ours.same_quantity)
        else:
            yield compare(quantity, printed, None, unit, note=_NOT_DESCRIBED)


def _table_8(figures: PaperFigures, run: SimulatedRun) -> Part:
    table = {motion: figures.numbers("table_8", motion) for motion in _MOTIONS}

    def ripples(motion: str, pick: Callable[[tuple[Decimal, ...]], Decimal], name: str, which: int) -> Comparison:
        ripple = figures.numbers("table_8", f"{motion}_wheelsets")[which]
        return _from_ripple(f"{motion}, {name} of the wheelsets", pick(table[motion][:_WHEELSETS]), ripple)

    comparisons = [
        comparison
        for motion in _MOTIONS
        for comparison in (ripples(motion, max, "largest", 0), ripples(motion, min, "smallest", 1))
    ]
    comparisons += [
        _from_ripple(f"{motion}, bogies", table[motion][_WHEELSETS], figures.number("table_8", f"{motion}_frame"))
        for motion in ("vertical", "lateral")
    ]
    return Part(
        title="Table 8",
        where=figures.where("table_8"),
        finding=r"the attenuations are $-20 \log_{10} \delta$ of the ripples in the text, but for one end of a range",
        comparisons=(*comparisons, *_rows(figures, 8, run)),
    )


def _from_ripple(quantity: str, printed: Decimal, ripple: Decimal) -> Comparison:
    needed = math.pow(10, -float(printed) / 20)
    return compare(
        quantity, printed, -20 * math.log10(ripple), "dB",
        note=f"$\\delta$ = {ripple} in the text; the printed figure is that of {needed:.4f}",
    )  # fmt: skip
