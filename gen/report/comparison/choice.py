"""Which of several designs to take, and why: the cheapest of those that pass, where they do the same job."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.quantity import plain_number, quantity
from sosmith.gen.report.comparison.fairness import fairness
from sosmith.gen.report.comparison.report_file import Report, fact
from sosmith.gen.word_lengths.cost import LUTS_OF_A_BLOCK

SMALLEST_FIRST = tuple(ARCHITECTURES)
"""Architectures by the hardware that they take where multiplications are many: no multiplier block, one, many."""


@dataclass(frozen=True)
class Choice:
    """The design to take.

    Attributes
    ----------
    taken : int or None
        Index of the report; None where none can be named, as among equals.
    reason : str
        Why it, or why none; one sentence or two.
    beaten : tuple of int
        Indices of those that pass but are both dearer and less accurate, by their bounds, than another one.
    """

    taken: int | None
    reason: str
    beaten: tuple[int, ...] = ()


def choose(reports: Sequence[Report], names: Sequence[str]) -> Choice:
    """Choose among reports, which the reason calls by their `names`.

    The cheapest that passes is taken, of equal ones that with the smallest bound. Where costs of several architectures
    cannot be compared, it is the cheapest of the smallest architecture, as all keep up with the sample rate; where they
    cannot be compared otherwise, the one with the smallest bound.
    """
    fair = fairness(reports)
    passing = [k for k, report in enumerate(reports) if report["passed"] and report["bit_exact"]]
    if fair.bounds:
        return Choice(None, f"They do different jobs. {fair.bounds}")
    if not passing:
        return Choice(None, "None of them passed.")
    if len(passing) == 1:
        return Choice(passing[0], f"{names[passing[0]]} is the only one of {len(reports)} that passes.")
    bounds = {k: _bound(reports[k]) for k in passing}
    rivals = _of_smallest_architecture(reports, passing) if fair.cost else passing
    costs = {k: hardware_cost(reports[k]) for k in rivals}
    unfair = fair.cost if rivals == passing else ""
    if unfair or any(cost is None for cost in costs.values()):
        accurate = min(passing, key=lambda k: bounds[k])
        why = fair.cost or "A report does not tell what its hardware costs."
        limit = quantity(bounds[accurate], _unit(reports))
        if all(bound == bounds[accurate] for bound in bounds.values()):
            return Choice(None, f"Those that pass have the same error limit, {limit}. {why}")
        return Choice(accurate, f"{names[accurate]} has the smallest error limit, {limit}. {why}")
    known = {k: cost for k, cost in costs.items() if cost is not None}
    taken = min(rivals, key=lambda k: (known[k], bounds[k]))
    beaten = tuple(
        k
        for k in rivals
        if any(known[o] <= known[k] and bounds[o] <= bounds[k] and (known[o], bounds[o]) != (known[k], bounds[k])
               for o in rivals)
    )  # fmt: skip
    if rivals == passing:
        everyone = "both" if len(reports) == 2 else f"all {len(reports)}"
        of = everyone if len(passing) == len(reports) else f"the {len(passing)} of {len(reports)} that pass"
        equal = all((known[k], bounds[k]) == (known[taken], bounds[taken]) for k in rivals)
        return Choice(None if equal else taken, _why(reports, names, rivals, taken, known, bounds, of), beaten)
    name = str(reports[taken]["architecture"])
    if len(rivals) == 1:
        size = f"{known[taken]:,.0f} {cost_unit(reports[taken])}"
        limit = quantity(bounds[taken], _unit(reports))
        first = f"{names[taken]} is the only {name} one that passes: {size}; its error limit is {limit}."
    else:
        first = _why(reports, names, rivals, taken, known, bounds, f"the {len(rivals)} {name} ones")
    accurate = min((k for k in passing if k not in rivals), key=lambda k: bounds[k])
    return Choice(
        taken,
        f"{first} The {name} architecture is the smallest here, and fast enough; of the others, {names[accurate]} "
        f"({reports[accurate]['architecture']}) has the smallest limit, {quantity(bounds[accurate], _unit(reports))}.",
        beaten,
    )


def _of_smallest_architecture(reports: Sequence[Report], passing: Sequence[int]) -> Sequence[int]:
    """Return those of `passing` that have the smallest architecture, all where its costs cannot be compared either."""
    names = [str(fact(reports[k], "architecture")) for k in passing]  # a report of an earlier version may not tell
    synthesized = any(fact(reports[k], "provenance.cost.source") == "synthesis" for k in passing)
    if synthesized or not set(names) <= set(SMALLEST_FIRST):
        return passing
    smallest = min(names, key=SMALLEST_FIRST.index)
    rivals = [k for k, name in zip(passing, names, strict=True) if name == smallest]
    return passing if fairness([reports[k] for k in rivals]).cost else rivals


def hardware_cost(report: Report) -> float | None:
    """Cost of a report's hardware in one figure, None if it does not tell.

    LUT4, with a multiplier block counted as `LUTS_OF_A_BLOCK` of them; of a program in a report of an earlier version,
    its instructions.
    """
    luts, blocks = fact(report, "provenance.cost.luts"), fact(report, "provenance.cost.multiplier_blocks")
    if luts is not None:
        return float(luts + LUTS_OF_A_BLOCK * (blocks or 0))
    instructions = fact(report, "provenance.cost.instructions")
    return None if instructions is None else float(instructions)


def cost_unit(report: Report) -> str:
    """Say in words what `hardware_cost` counts, and how good it is."""
    if fact(report, "provenance.cost.luts") is None:
        return "instructions"
    if fact(report, "provenance.cost.source") != "estimate":
        return "LUT4 equivalents"
    within, device = fact(report, "provenance.cost.within"), fact(report, "provenance.cost.device")
    how = "" if within is None else f" for {device}, 9 of 10 to within {100 * within:.0f} %"
    return f"LUT4 equivalents, estimated before synthesis{how}"


def _bound(report: Report) -> float:
    bound: Any = report["error"]["bound"]
    return float("inf") if bound is None else float(bound)


def _unit(reports: Sequence[Report]) -> str:
    return str(reports[0]["error"]["unit"])


def _why(
    reports: Sequence[Report],
    names: Sequence[str],
    rivals: Sequence[int],
    taken: int,
    costs: dict[int, float],
    bounds: dict[int, float],
    of: str,
) -> str:
    unit = _unit(reports)
    size = f"{costs[taken]:,.0f} {cost_unit(reports[taken])}"
    if all(costs[k] == costs[taken] for k in rivals):
        limit = quantity(bounds[taken], unit)
        if all(bounds[k] == bounds[taken] for k in rivals):
            return f"{of[0].upper()}{of[1:]} cost the same, {size}, and have the same error limit, {limit}."
        return f"{of[0].upper()}{of[1:]} cost the same, {size}; {names[taken]} has the smallest error limit, {limit}."
    first = f"{names[taken]} is the cheapest of {of}: {size}; its error limit is {quantity(bounds[taken], unit)}."
    accurate = min(rivals, key=lambda k: bounds[k])
    if bounds[accurate] == bounds[taken]:
        return f"{first} None has a smaller limit."
    times = plain_number(costs[accurate] / costs[taken], 2)
    limit = quantity(bounds[accurate], unit)
    return f"{first} The smallest limit is {names[accurate]}'s, {limit}, at {times} times the cost."
