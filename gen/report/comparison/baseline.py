"""Judges reports against a baseline: each figure may be worse by its tolerance, and no more."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sosmith.gen.report.comparison import rows
from sosmith.gen.report.comparison.differences import UNKNOWN
from sosmith.gen.report.comparison.fairness import fairness
from sosmith.gen.report.comparison.report_file import Report, fact
from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean

_KEYS = {
    "error": "error.max_abs",
    "rms": "error.rms",
    "sqnr": "sqnr_db",
    "accuracy": "accuracy_percent.hardware",
    "true_error": "true_error.max_abs",
    "bound": "error.bound",
    "cycles": "provenance.cycles_per_sample",
    "latency": "latency_cycles",
    "lut": "provenance.cost.luts",
    "multipliers": "provenance.cost.multiplier_blocks",
    "registers": "provenance.cost.register_bits",
    "instructions": "provenance.cost.instructions",
    "words": "provenance.cost.memory_words",
}
_BY_KEY = {figure.key: figure for figure in rows.FIGURES}

FIGURES: Mapping[str, rows.Figure] = {name: _BY_KEY[key] for name, key in _KEYS.items()}
"""Figures that can be judged, by their names in a tolerance."""


@dataclass(frozen=True)
class Tolerance:
    """By how much a figure may be worse: `amount` in its own unit, or a share of the baseline's value."""

    amount: float
    relative: bool

    def text(self) -> str:
        """As written in `--tolerance`."""
        return f"{100 * self.amount:g}%" if self.relative else f"{self.amount:g}"


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One figure of one candidate beside the baseline's.

    Attributes
    ----------
    figure, title : str
        Its name in a tolerance, and for people.
    values, cells : tuple
        Of the baseline and of the candidate, as numbers (None if unknown) and as text.
    tolerance : Tolerance
        What is allowed.
    verdict : str
        "better", "equal", "within" the tolerance, "worse" or "not comparable".
    reason : str
        Why it is not comparable, else empty.
    same_unit : bool
        Whether both values have the same unit.
    """

    figure: str
    title: str
    values: tuple[float | None, float | None]
    cells: tuple[str, str]
    tolerance: Tolerance
    verdict: str
    reason: str = ""
    same_unit: bool = True

    @property
    def passed(self) -> bool:
        """Whether the candidate is not worse."""
        return self.verdict in {"better", "equal", "within"}

    @property
    def change(self) -> str:
        """Change from the baseline in per cent, empty where that has no meaning."""
        before, after = self.values
        if before is None or after is None or before == 0 or not self.same_unit:
            return ""
        return f"{100 * (after - before) / abs(before):+.2f} %".replace("-", "−")


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A candidate beside the baseline.

    Attributes
    ----------
    name : str
        Of the candidate.
    judged : tuple of Judged
        Its figures.
    shortfalls : tuple of str
        Why it falls short by itself, one sentence each.
    """

    name: str
    judged: tuple[Judged, ...]
    shortfalls: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the candidate is not worse than the baseline, and passes by itself."""
        return not self.shortfalls and all(one.passed for one in self.judged)

    @property
    def reasons(self) -> list[str]:
        """Why the candidate did not pass, one sentence each."""
        sentences = list(self.shortfalls)
        for one in self.judged:
            if one.verdict == "worse":
                change = f" ({one.change})" if one.change else ""
                sentences.append(
                    f"{one.title}: {one.cells[1]} instead of {one.cells[0]}{change}, {one.tolerance.text()} allowed."
                )
        for reason in dict.fromkeys(one.reason for one in self.judged if one.reason):
            titles = ", ".join(one.title for one in self.judged if one.reason == reason)
            sentences.append(f"Not comparable: {titles}. {reason}")
        return sentences


def read_tolerances(text: str) -> dict[str, Tolerance]:
    """Read tolerances such as ``error=5%,cycles=0,lut=2%``.

    Raises
    ------
    SpecificationError
        If a name is unknown or comes twice, or a number is missing, negative or not finite.
    """
    tolerances: dict[str, Tolerance] = {}
    for part in text.split(","):
        name, _, amount = (piece.strip() for piece in part.partition("="))
        if name not in FIGURES:
            raise SpecificationError(
                f"a tolerance must be of {', '.join(FIGURES)}, not of {name or 'nothing'}{did_you_mean(name, FIGURES)}"
            )
        if name in tolerances:
            raise SpecificationError(f"a tolerance must be given once, not twice as for {name}")
        if not re.fullmatch(r"(\d+\.?\d*|\.\d+)(e[+-]?\d+)?%?", amount, re.IGNORECASE):
            raise SpecificationError(f"a tolerance must be a number such as 5% or 0, not {name}={amount}")
        relative = amount.endswith("%")
        number = float(amount.removesuffix("%"))
        if not math.isfinite(number):
            raise SpecificationError(f"a tolerance must be a number such as 5% or 0, not {name}={amount}")
        tolerances[name] = Tolerance(number / 100 if relative else number, relative)
    return tolerances


def judge(
    baseline: Report, candidates: Sequence[Report], tolerances: Mapping[str, Tolerance] | None = None
) -> list[Judgement]:
    """Hold each candidate against the baseline.

    With `tolerances`, the figures that they name are judged; without, all that the baseline knows, and none may be
    worse. A figure that cannot be compared does not pass: a changed trace or specification would else hide a change.
    """
    asked = tolerances
    if asked is None:
        asked = {
            name: Tolerance(0.0, relative=False)
            for name, figure in FIGURES.items()
            if fact(baseline, figure.key) is not None
        }
    names = rows.column_names([baseline, *candidates], baseline=True)[1:]
    return [
        Judgement(
            name=name,
            judged=tuple(_judged(baseline, candidate, figure, allowed) for figure, allowed in asked.items()),
            shortfalls=_shortfalls(candidate),
        )
        for name, candidate in zip(names, candidates, strict=True)
    ]


def _shortfalls(candidate: Report) -> tuple[str, ...]:
    if candidate["passed"] and candidate["bit_exact"]:
        return ()
    stated = fact(candidate, "shortfalls")
    readable = (
        isinstance(stated, list) and stated and all(isinstance(each, str) and each.isprintable() for each in stated)
    )
    return tuple(stated) if readable else ("It falls short of its own specification.",)


def _judged(baseline: Report, candidate: Report, name: str, allowed: Tolerance) -> Judged:
    figure = FIGURES[name]
    sign = -1 if figure.better is max else 1
    before, after = fact(baseline, figure.key), fact(candidate, figure.key)
    units = baseline["error"]["unit"], candidate["error"]["unit"]
    cells = tuple(
        UNKNOWN if v is None else figure.show(v, unit) for v, unit in zip((before, after), units, strict=True)
    )
    reason = getattr(fairness([baseline, candidate]), figure.group)
    if before is None or after is None:
        reason = reason or f"The {'baseline' if before is None else 'candidate'} does not know it."
    verdict = "not comparable" if reason else _verdict(sign * before, sign * after, allowed)
    return Judged(
        figure=name,
        title=figure.title,
        values=(before, after),
        cells=(cells[0], cells[1]),
        tolerance=allowed,
        verdict=verdict,
        reason=reason,
        same_unit=units[0] == units[1] or figure.group not in {"accuracy", "bounds"},
    )


def _verdict(before: float, after: float, allowed: Tolerance) -> str:
    """Judge two values of which the smaller is the better."""
    if after == before:
        return "equal"
    if after < before:
        return "better"
    slack = allowed.amount * abs(before) if allowed.relative else allowed.amount
    return "within" if after <= before + slack else "worse"
