"""Tables of a design for pages, terminals and notebooks: error budget, uncertainty of a reading, limit cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sosmith.gen.facts.table import Table
from sosmith.gen.output.core_facts import CoreFacts, LimitCycleFacts
from sosmith.gen.quantity import LEAST_PART, plain_number, scale


def lsb(steps: float) -> str:
    """Return a number of steps of the output code."""
    return f"{plain_number(steps)} LSB"


@dataclass(frozen=True)
class ErrorUnit:
    """The one unit of all errors of the arithmetic of a design, in which its limit, or else an LSB, reads well."""

    factor: float
    symbol: str
    blank: str = " "

    @classmethod
    def of(cls, facts: CoreFacts, blank: str = " ") -> ErrorUnit:
        """Choose it for a design; `blank` stands between number and unit, on a page one that breaks no line."""
        return cls(*scale(facts.error_bound or facts.lsb, facts.unit), blank)

    def number(self, value: float) -> str:
        """Return a value in this unit, without it."""
        return plain_number(value * self.factor)

    def amount(self, value: float) -> str:
        """Return a value with this unit; one that reads 0 has no power of ten."""
        number, symbol = self.number(value), self.symbol
        if number == "0" and symbol.startswith("10"):
            symbol = symbol.partition(" ")[2]
        joint = " × " if symbol.startswith("10") else " "
        return f"{number}{joint}{symbol}".rstrip().replace(" ", self.blank)

    def titled(self, words: str) -> str:
        """Return the title of a column in this unit."""
        return f"{words} in {self.symbol}" if self.symbol else words


def budget_table(parts: Mapping[str, float], allowed: float, step: float, unit: str) -> Table:
    """Say what an error bound is made of, the parts that count, and what is allowed; all are in the output's unit.

    `step` is one LSB of the output.
    """
    seen = [(part, value) for part, value in parts.items() if value >= step * LEAST_PART]
    bound = sum(parts.values())
    shown = ErrorUnit(*scale(bound or step, unit))
    of_what = " of the arithmetic" if "calibration" in parts else ""
    return Table(
        f"Error budget{of_what}, proven for all inputs in range",
        [
            (part.replace("_", " "), shown.number(value), f"{value / step:.4f}")
            for part, value in (*seen, ("sum", bound), ("allowed", allowed))
        ],
        ("part", shown.titled("at most"), "in LSB"),
        {"sum": "bold"},
        numbers=(1, 2),
    )


def uncertainty_table(budget: Mapping[str, Any]) -> Table:
    """Say what a reading's uncertainty is made of where it is largest; `budget` is in the types of JSON."""
    at, unit = budget["at"], budget["unit"]
    rows = [
        (
            one["source"],
            one["distribution"],
            f"{plain_number(one['standard_uncertainty'])} {one['unit']}",
            plain_number(one["sensitivity"]),
            plain_number(one["contribution"]),
            _freedom(one["degrees_of_freedom"]),
        )
        for one in at["contributions"]
    ]
    rows.append(("combined", "", "", "", plain_number(at["combined"]), _freedom(at["degrees_of_freedom"])))
    expanded = f"expanded, {100 * budget['probability']:g} %"
    factor = f"k = {plain_number(at['coverage_factor'])}"
    rows.append((expanded, "", "", factor, plain_number(at["expanded"]), ""))
    where = (
        f"{plain_number(at['clearance'])} {unit} ({plain_number(at['voltage_V'])} V, "
        f"{plain_number(at['temperature_C'])} °C)"
    )
    return Table(
        f"Uncertainty of a reading at {where}, where it is largest",
        rows,
        ("source", "distribution", "standard uncertainty", "sensitivity", unit, "degrees of freedom"),
        {"combined": "bold", expanded: "bold"},
        numbers=range(2, 6),
    )


def _freedom(value: float | None) -> str:
    return "known" if value is None else plain_number(value)


def limit_cycles_table(cycles: Sequence[LimitCycleFacts], facts: CoreFacts) -> Table:
    """Say what each section's rounding can sustain by itself, at the section's own output."""
    unit = ErrorUnit.of(facts)
    rows = [
        (
            each.section,
            "none, proven" if each.none else unit.number(each.largest),
            "0" if each.none else plain_number(each.largest / facts.lsb),
            unit.number(each.dead_band),
            plain_number(each.dead_band / facts.lsb),
            ", ".join(f"{float(weight):.4g}" for weight in each.lyapunov or ()) or "not needed",
        )
        for each in cycles
    ]
    head = ("section", unit.titled("without input, at most"), "in LSB", unit.titled("dead band"), "in LSB")
    return Table(
        "Limit cycles: what a section's own rounding can sustain",
        rows,
        (*head, "Lyapunov weights"),
        numbers=range(1, 6),
    )
