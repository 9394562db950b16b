"""The figures of several reports as rows: accuracy, bounds, cost, speed; the best of a row where that is fair."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from sosmith.gen.quantity import LEAST_PART, decibels, full_scale_level, number, plain_number, quantity
from sosmith.gen.report.comparison.differences import UNKNOWN
from sosmith.gen.report.comparison.fairness import fairness, source_name
from sosmith.gen.report.comparison.report_file import Report, fact


@dataclass(frozen=True, kw_only=True)
class Row:
    """One property of all compared reports.

    Attributes
    ----------
    group : str
        "run", "accuracy", "bounds", "filter", "clocks", "cost" or "simulation".
    key : str
        Its name in `report.json`, with dots.
    title : str
        Its name for people.
    values : tuple
        As in the reports, None where unknown, in the order of the reports.
    cells : tuple of str
        The values as plain text, with units.
    best : tuple of int
        Indices of the best reports; empty where best has no meaning or is not fair, or all are equal.
    """

    group: str
    key: str
    title: str
    values: tuple[Any, ...]
    cells: tuple[str, ...]
    best: tuple[int, ...]


Show = Callable[[Any, str], str]
Better = Callable[[Sequence[float]], float]


@dataclass(frozen=True)
class Figure:
    """A figure of `report.json`: its group, key and title, how it is shown, and which of several is best."""

    group: str
    key: str
    title: str
    show: Show
    better: Better | None = None
    by_all: bool = False  # shown only if all reports know it


def _text(value: Any, _unit: str) -> str:
    return str(value)


def _count(value: float, _unit: str) -> str:
    return number(value)


def _percent(value: float, _unit: str) -> str:
    return f"{value:.4f} %".replace("-", "−")


def _level(value: float, _unit: str) -> str:
    return decibels(value)


def _full_scale_level(value: float, _unit: str) -> str:
    return full_scale_level(value)


FIGURES = (
    Figure("run", "name", "name", _text),
    Figure("run", "realization", "realization", _text),
    Figure("run", "scenario", "trace", _text),
    Figure("run", "samples", "samples", _count),
    Figure("run", "simulator", "simulator", _text),
    Figure("run", "passed", "verdict", lambda value, _: "passed" if value else "falls short"),
    Figure("run", "bit_exact", "equal to the integer model", lambda value, _: "bit for bit" if value else "no"),
    Figure("accuracy", "true_error.max_abs", "largest error against the true value", quantity, min, by_all=True),
    Figure("accuracy", "true_error.rms", "typical error against the true value (RMS)", quantity, min, by_all=True),
    Figure("accuracy", "error.max_abs", "largest error", quantity, min),
    Figure("accuracy", "error.max_lsb", "largest error in LSB", lambda value, _: f"{plain_number(value)} LSB"),
    Figure("accuracy", "error.rms", "typical error (RMS)", quantity, min),
    Figure("accuracy", "sound.error_peak_dbfs", "largest error in dBFS", _full_scale_level),
    Figure("accuracy", "sound.error_rms_dbfs", "typical error in dBFS (RMS)", _full_scale_level),
    Figure("accuracy", "sound.tone.thd_n_db", "distortion and noise (THD+N)", _level, min),
    Figure("accuracy", "sqnr_db", "signal to error", _level, max),
    Figure("accuracy", "accuracy_percent.hardware", "accuracy, hardware", _percent, max),
    Figure("accuracy", "accuracy_percent.golden", "accuracy, exact calculation", _percent),
    Figure("accuracy", "accuracy_percent.unfiltered", "accuracy without the filter", _percent),
    Figure("bounds", "error.bound", "error limit", quantity, min),
    Figure("filter", "delay.seconds", "group delay", lambda value, _: quantity(value, "s")),
    Figure("filter", "frequency_response.passband_loss_db", "loss in the pass band", _level),
    Figure("filter", "frequency_response.stopband_attenuation_db", "attenuation in the stop band", _level),
    Figure("filter", "aliases.anywhere_db", "largest gain of aliases and images", _level),
    Figure("filter", "aliases.passband_db", "largest gain of these in the pass band", _level),
    Figure("clocks", "provenance.cycles_per_sample", "clock cycles per sample", _count, min),
    Figure("clocks", "latency_cycles", "latency in clock cycles", _count, min),
    Figure("cost", "provenance.cost.source", "origin of the cost", _text),
    Figure("cost", "provenance.cost.luts", "LUT4", _count, min),
    Figure("cost", "provenance.cost.multiplier_blocks", "multiplier blocks", _count, min),
    Figure("cost", "provenance.cost.register_bits", "register bits", _count, min),
    Figure("cost", "provenance.cost.instructions", "instructions", _count, min),
    Figure("cost", "provenance.cost.memory_words", "words of memory", _count, min),
    Figure("simulation", "cycles_per_sample", "clock cycles per sample, with waiting", lambda v, _: plain_number(v)),
    Figure("simulation", "cycles_per_second", "simulated clock cycles per second", lambda v, _: quantity(v, "")),
)

_ALWAYS = ("run",)
"""Groups whose rows are shown even where no report knows a value."""


def compare(reports: Sequence[Report]) -> list[Row]:
    """Line up reports as `load_report` returns them, or as `sosmith.gen.report.report.summarise` makes them.

    Raises
    ------
    ValueError
        If there are fewer than two reports.
    """
    if len(reports) < 2:
        raise ValueError(f"reports must hold at least two reports, not {len(reports)}")
    fair = fairness(reports)
    reasons = {"accuracy": fair.accuracy, "bounds": fair.bounds, "clocks": fair.clocks, "cost": fair.cost}
    figures = [one for figure in FIGURES for one in (figure, *(_parts(reports) if figure.key == "error.bound" else ()))]
    rows = {figure: _row(reports, figure, fair=not reasons.get(figure.group)) for figure in figures}
    return [row for figure, row in rows.items() if row.group in _ALWAYS or _is_known(row, by_all=figure.by_all)]


def _parts(reports: Sequence[Report]) -> list[Figure]:
    """Return what the bounds are sums of, the parts that count in any of them: parts of a core, stages of a chain."""
    names = dict.fromkeys(
        name
        for report in reports
        for name, part in (fact(report, "error.parts") or {}).items()
        if part >= (fact(report, "error.bound") or 0) * LEAST_PART
    )
    return [Figure("bounds", f"error.parts.{name}", f"of it, {name}", quantity) for name in names]


def _is_known(row: Row, *, by_all: bool) -> bool:
    return (all if by_all else any)(value is not None for value in row.values)


def _row(reports: Sequence[Report], figure: Figure, *, fair: bool) -> Row:
    if figure.key == "provenance.cost.source":
        boards = [fact(report, "provenance.cost.board") for report in reports]
        values = tuple(fact(report, figure.key) for report in reports)
        cells = tuple(source_name(source, board) for source, board in zip(values, boards, strict=True))
    else:
        values = tuple(fact(report, figure.key) for report in reports)
        units = [report["error"]["unit"] for report in reports]
        cells = tuple(
            UNKNOWN if value is None else figure.show(value, unit) for value, unit in zip(values, units, strict=True)
        )
    best: tuple[int, ...] = ()
    known = [value for value in values if value is not None]
    if fair and figure.better is not None and known:
        # equal to the eye is equal: differences below the digits shown do not make a winner
        winner = cells[values.index(figure.better(known))]
        best = tuple(index for index, cell in enumerate(cells) if cell == winner)
    if len(best) == len(known):
        best = ()
    return Row(group=figure.group, key=figure.key, title=figure.title, values=values, cells=cells, best=best)


def column_names(reports: Sequence[Report], *, baseline: bool = False) -> list[str]:
    """Names of the reports: the folders that they lie in, where these are known and differ.

    Otherwise those that share a name get its realization, and a number if that is not enough. With `baseline`, the
    first is called so, and the others do not have to differ from it.
    """
    if baseline:
        return ["baseline", *column_names(reports[1:])]
    folders = [str(report.get("folder", "")) for report in reports]
    if all(folders) and len(set(folders)) == len(folders):
        return folders
    names = [str(report["name"]) for report in reports]
    if len(set(names)) < len(names):
        parts = [(str(report["name"]), str(report["realization"])) for report in reports]
        alone = len({name for name, _ in parts}) == 1 and len(set(parts)) == len(parts)
        names = [realization if alone else f"{name}, {realization}" for name, realization in parts]
    return [
        f"{name} ({names[: index + 1].count(name)})" if names.count(name) > 1 else name
        for index, name in enumerate(names)
    ]
