"""The tables ``[[stage]]`` of a structure: what a user would write by hand, from what its stages are planned to be."""

from __future__ import annotations

from decimal import ROUND_FLOOR, Context, Decimal, Inexact
from fractions import Fraction
from typing import Any

import numpy as np

from sosmith.gen.chain.automatic.compensation import Array, compensating
from sosmith.gen.chain.automatic.screen import Plan, Planned, Problem, Wanted
from sosmith.gen.specification.choices import MAX_TAPS

_EXACT = Context(prec=200, traps=[Inexact])
_SHORTENED = Context(prec=12, rounding=ROUND_FLOOR)
_ELLIPTIC = {"family": "elliptic", "architecture": "folded", "realization": "df1_ef1"}
"""Of an IIR filter; all realizations and architectures would take minutes to compare."""

_LOSS = Decimal("0.00001")
_SHORT = {"cic": "cic", "halfband": "half", "fir": "fir", "iir": "iir", "every": "every"}

Tables = list[dict[str, Any]]


def tables_of(plan: Plan, wanted: Wanted, name: str) -> Tables | Problem:
    """Return the stages of a plan, with names that begin with `name`; or why there are none."""
    tables: Tables = []
    kinds = [stage.kind for stage in plan.stages]
    for k, stage in enumerate(plan.stages):
        own = _SHORT[stage.kind]
        number = str(1 + kinds[:k].count(stage.kind)) if kinds.count(stage.kind) > 1 else ""
        table: dict[str, Any] = {
            "name": f"{name}_{own}{number}",
            "kind": "fir" if stage.kind == "every" else stage.kind,
        }
        if stage.kind == "cic":
            table["order"] = stage.order
        if stage.factor > 1:
            table["decimate"] = stage.factor
        is_last = k == len(plan.stages) - 1
        try:
            own_keys = _taps(plan, wanted) if is_last and plan.compensates else _edges(stage, wanted)
        except Inexact:
            return Problem(float("inf"), "a rate between stages is no finite decimal in Hz")
        if own_keys is None:
            return Problem(stage.taps / MAX_TAPS, f"no filter of about {stage.taps} taps makes up for the droop")
        tables.append(table | own_keys)
    return tables


def _edges(stage: Planned, wanted: Wanted) -> dict[str, Any]:
    """Return the keys of a filter by edges and losses; of a CIC filter, none."""
    _check_rate(stage.rate)
    if stage.kind == "cic":
        return {}
    if stage.kind == "every":
        return {"taps": [Decimal(1)]}
    edges = {"passband_edge": -_below(-stage.edge)}
    if stage.kind != "halfband":
        edges["stopband_edge"] = _below(stage.stop)
    family = _ELLIPTIC if stage.kind == "iir" else {}
    return {**family, **edges, "passband_loss": _rounded(stage.loss), "stopband_loss": _rounded(wanted.stopband_loss)}


def _taps(plan: Plan, wanted: Wanted) -> dict[str, Any] | None:
    """Return taps of the last stage that make up for the droop of the CIC filters; None if there are none."""
    *before, last = plan.stages

    def gain(frequency: Array) -> Array:
        total = np.ones(frequency.shape)
        for stage in before:
            if stage.kind == "cic":
                angles = np.pi * np.maximum(frequency * float(last.rate / stage.rate), 1e-12)
                sums = np.sin(stage.factor * angles) / (stage.factor * np.sin(angles))
                total = total * np.abs(sums) ** stage.order
        return total

    _check_rate(last.rate)
    edge, stop = float(last.edge / last.rate), float(last.stop / last.rate)
    taps = compensating(last.taps, gain, edge, stop, (last.loss, wanted.stopband_loss))
    return None if taps is None else {"taps": taps}


def _check_rate(rate: Fraction) -> None:
    """Check that a rate is a finite decimal, as that of every stage must be.

    Raises
    ------
    Inexact
        If its digits never end.
    """
    _EXACT.divide(Decimal(rate.numerator), Decimal(rate.denominator))


def _below(edge: Fraction) -> Decimal:
    """Return an edge as a decimal, a little less where its digits never end."""
    return _SHORTENED.divide(Decimal(edge.numerator), Decimal(edge.denominator))


def _rounded(loss: float) -> Decimal:
    return Decimal(loss).quantize(_LOSS)
