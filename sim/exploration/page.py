"""The page of an exploration: the front as a picture, whose points lead to their designs, and all designs below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from sosmith.gen.quantity import decibels, number, quantity
from sosmith.gen.report.figures.figure import Figure
from sosmith.gen.report.figures.painting import COLOUR, NARROW, SERIES, WIDE, decades, draw
from sosmith.model.templates import render
from sosmith.sim.exploration.evaluation import Point
from sosmith.sim.exploration.front import cost_kind
from sosmith.sim.exploration.run import Outcome

_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "p")


class _Line(NamedTuple):
    """A design as a line of the table."""

    number: int
    changes: tuple[str, ...]
    point: Point
    bound: str
    error: str
    sqnr: str
    cost: str
    unit: str
    clocks: str
    on_front: bool


def exploration_page(outcome: Outcome) -> str:
    """One HTML page that stands alone."""
    front = {point["key"] for point in outcome.front}
    numbers = {point["key"]: k for k, point in enumerate(outcome.points)}
    designs = [point for point in outcome.points if point["refused"] is None]
    kinds = sorted({cost_kind(point) for point in designs})
    realizations = sorted({point["realization"] for point in designs})
    by_kind = {kind: [point for point in designs if cost_kind(point) == kind] for kind in kinds}
    return render(
        "sosmith.gen.report",
        "exploration.html.jinja",
        outcome=outcome,
        parameters=[
            (key, values if isinstance(values, str) else ", ".join(map(_plain, values)))
            for key, values in outcome.parameters.items()
        ],
        shown=_shown(outcome),
        kinds=len(kinds),
        figures=[
            _figure(kind, points, realizations, front, numbers, k) for k, (kind, points) in enumerate(by_kind.items())
        ],
        front=[_line(point, outcome, numbers, front) for point in outcome.front],
        lines=[_line(point, outcome, numbers, front) for point in designs],
        plain=_plain,
        refused=[point for point in outcome.points if point["refused"] is not None],
        jobs=len({point["reference_sha256"] for point in designs}),
        passed=sum(bool(point["passed"]) for point in designs),
    )


def _line(point: Point, outcome: Outcome, numbers: dict[str, int], front: set[str]) -> _Line:
    error = point["error"]
    return _Line(
        number=numbers[point["key"]],
        changes=tuple(_plain(point["changes"][key]) for key in _shown(outcome)),
        point=point,
        bound=quantity(error["bound"], error["unit"]),
        error=quantity(error["max_abs"], error["unit"]),
        sqnr=decibels(point["sqnr_db"]),
        cost=f"{point['cost']['value']:,.0f}",
        unit=point["cost"]["unit"].partition(",")[0],
        clocks=number(point["cycles_per_sample"]),
        on_front=point["key"] in front,
    )


def _shown(outcome: Outcome) -> list[str]:
    """Swept keys that no column of its own tells."""
    return [key for key in outcome.parameters if key not in {"hardware.realization", "hardware.architecture"}]


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _title(kind: tuple[str, str]) -> str:
    unit, architecture = kind
    return f"{architecture or 'all architectures'}, cost in {unit}"


def _figure(
    kind: tuple[str, str],
    points: Sequence[Point],
    realizations: Sequence[str],
    front: set[str],
    numbers: dict[str, int],
    k: int,
) -> Figure:
    present = {point["realization"] for point in points}

    def picture(width: int) -> str:
        def paint(drawing: Drawing) -> None:
            axes = drawing.subplots()
            _paint(axes, points, realizations, front, numbers)
            axes.set_xlabel(f"cost in {kind[0].partition(',')[0]}")

        return draw(f"front{k}", "Proven error against cost", width, 400, paint)

    return Figure(
        title=_title(kind)[0].upper() + _title(kind)[1:],
        drawing=picture(WIDE),
        narrow=picture(NARROW),
        caption="Lower and further left is better. The line joins the front; faint points are beaten, crossed ones "
        "fall short of their specification. A click leads to the design.",
        legend=[(SERIES[n % len(SERIES)], "dot", name) for n, name in enumerate(realizations) if name in present],
    )


def _paint(
    axes: Axes, points: Sequence[Point], realizations: Sequence[str], front: set[str], numbers: dict[str, int]
) -> None:
    unit = points[0]["error"]["unit"]
    best = sorted((point for point in points if point["key"] in front), key=lambda point: float(point["cost"]["value"]))
    axes.step(
        [point["cost"]["value"] for point in best],
        [point["error"]["bound"] for point in best],
        where="post",
        color=COLOUR["muted"],
        lw=1.4,
        zorder=2,
    )
    for point in points:
        n = realizations.index(point["realization"])
        on_front = point["key"] in front
        drawn = axes.scatter(
            [point["cost"]["value"]],
            [point["error"]["bound"]],
            s=90 if on_front else 34,
            marker=_MARKERS[n % len(_MARKERS)] if point["passed"] else "x",
            color=COLOUR[SERIES[n % len(SERIES)]],
            alpha=1.0 if on_front else 0.45,
            zorder=4 if on_front else 3,
        )
        drawn.set_urls([f"#design-{numbers[point['key']]}"])
    axes.set_xscale("log")
    axes.set_yscale("log")
    values = [float(point["cost"]["value"]) for point in points]
    bounds = [float(point["error"]["bound"]) for point in points]
    axes.set_xlim(max(min(values), 0.5) / 1.25, max(values) * 1.25)
    axes.set_ylim(min(bounds) / 1.25, max(bounds) * 1.25)
    decades(axes.xaxis, *axes.get_xlim(), "", 8)
    decades(axes.yaxis, *axes.get_ylim(), unit, 8)
    axes.set_ylabel("proven error bound")
