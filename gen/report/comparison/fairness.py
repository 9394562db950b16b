"""Whether figures of several reports may be held against each other, and the reason where they may not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.gen.report.comparison.report_file import Report, fact
from sosmith.gen.specification.values import listed


@dataclass(frozen=True)
class Fairness:
    """Reasons why a kind of figure cannot be compared, one sentence each; empty where it can.

    Attributes
    ----------
    accuracy : str
        Of errors and ratios, which were measured on a trace.
    bounds : str
        Of error limits, which hold for all inputs in range.
    clocks : str
        Of clocks per sample and latency.
    cost : str
        Of what the hardware takes.
    """

    accuracy: str
    bounds: str
    clocks: str
    cost: str


def fairness(reports: Sequence[Report]) -> Fairness:
    """Judge what of `reports` can be compared.

    Errors need the same exact calculation and the same input codes; bounds and clocks the same exact calculation;
    costs, besides, figures of one origin: synthesis for one board, or estimates of one architecture.
    """
    reference = _reference(reports)
    return Fairness(
        accuracy=reference or _trace(reports),
        bounds=reference,
        clocks=reference,
        cost=reference or _cost(reports),
    )


def _reference(reports: Sequence[Report]) -> str:
    if _differ(reports, "error.unit"):
        return f"Errors in {listed(_distinct(reports, 'error.unit'))} cannot be compared."
    if _unknown(reports, "provenance.reference_sha256"):
        return "A report of an earlier version does not tell which exact calculation the hardware was held against."
    if _differ(reports, "provenance.reference_sha256"):
        return "The exact calculations differ (inputs, calibration, filter, output range or channels)."
    return ""


def _trace(reports: Sequence[Report]) -> str:
    if _differ(reports, "provenance.trace_sha256"):
        return f"The input codes differ: traces {_listed(reports, 'scenario')}."
    return ""


def _cost(reports: Sequence[Report]) -> str:
    keys = ("provenance.cost.source", "provenance.cost.board", "provenance.cost.device")
    sources = {tuple(fact(each, key) for key in keys) for each in reports}
    if len({source[:2] for source in sources}) > 1:
        named = ", ".join(sorted({source_name(*each[:2]) for each in sources}))
        return f"The costs have different origins: {named}."
    if len(sources) > 1 and next(iter(sources))[0] == "estimate":
        return "The costs are estimates of different versions, or for different FPGAs."
    if sources <= {("estimate", None, None), ("program", None, None)} and _differ(reports, "architecture"):
        named = _listed(reports, "architecture")
        return f"Estimates of an earlier version cannot be compared between architectures: {named}."
    return ""


def source_name(source: str | None, board: str | None) -> str:
    """Name of the origin of a cost."""
    if source == "synthesis":
        return f"synthesis for {board}"
    return {"estimate": "estimate before synthesis", "program": "length of the program"}.get(source or "", "unknown")


def _differ(reports: Sequence[Report], key: str) -> bool:
    return len({fact(report, key) for report in reports}) > 1


def _unknown(reports: Sequence[Report], key: str) -> bool:
    return any(fact(report, key) is None for report in reports)


def _listed(reports: Sequence[Report], key: str) -> str:
    return ", ".join(_distinct(reports, key))


def _distinct(reports: Sequence[Report], key: str) -> list[str]:
    """Return the distinct values, in the order of the reports; without a unit, numbers are plain."""
    return list(dict.fromkeys(str(fact(report, key)) or "plain numbers" for report in reports))
