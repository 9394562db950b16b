"""Fits the factors of the estimate of cost, `sosmith.gen.estimate`, to recorded synthesis."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import nnls

from sosmith.gen.architectures.registry import MEASURED
from sosmith.gen.estimate.estimate import TITLES, total

Factors = dict[str, float]

EARLIER = Path(__file__).with_name("cost_earlier.json")
"""Factors by architecture, family and target, fitted to 389 syntheses of the hardware as it was before sums were carry
chains of their own, with seeds that are for the fit alone."""

_NO_LUTS = {"registers", "memory_bits", "blocks", "rams"}
"""Quantities that take no LUT4."""
_OF_FLIP_FLOPS = {"registers", "cores", "ports", "channels", "guards", "decimators", "units", "opcodes", "loaded"}
"""Quantities that flip-flops are fitted to."""

_EXPECTED = {
    **{"ports": 180.0, "guarded_ports": 200.0, "guards": 100.0, "cores": 20.0, "decimators": 20.0, "units": 20.0},
    **{"channels": 5.0, "counters": 5.0, "lines": 4.0, "residuals": 3.0, "words": 2.5, "opcodes": 2.0, "shifts": 2.0},
    **{"logic": 2.0, "guarded_stages": 2.0, "operands": 1.5, "accumulators": 1.3, "soft_products": 1.7},
}
"""LUT4 that one of a quantity is expected to take where it is not about 1, before the fit."""

_PULLS = (0.2, 0.6, 0.8)
"""How strongly factors are drawn: those of all designs to what is expected, those of an architecture to these, and
those of a family of FPGA to `EARLIER` ones, or to those of the architecture where a quantity is new to it."""


_LEAST = 0.1
"""Factor that a smaller one counts as when others are drawn to it."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """A synthesis.

    Attributes
    ----------
    name : str
        What was synthesized.
    architecture, family : str
        Architecture, and family of FPGA.
    unseen : bool
        Whether the fit must not use it.
    quantities : Mapping of str to float
        As `sosmith.gen.estimate.core.quantities_of` counts them.
    luts, flip_flops : int
        Cells after synthesis.
    """

    name: str
    architecture: str
    family: str
    unseen: bool
    quantities: Mapping[str, float]
    luts: int
    flip_flops: int


def fitted(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, Factors]]]:
    """Return the factors of LUT4 and of flip-flops, by architecture and family.

    They minimize the squares of relative errors, and are not negative. Those of an architecture are drawn to those of
    all, and those of a family to those of an earlier fit or of its architecture, as few designs tell of each.
    """
    found: dict[str, dict[str, dict[str, Factors]]] = defaultdict(lambda: defaultdict(dict))
    known = [row for row in rows if not row.unseen]
    names = sorted({name for row in known for name in row.quantities})
    for target, chosen in (
        ("luts", [name for name in names if name not in _NO_LUTS]),
        ("flip_flops", [name for name in names if name in _OF_FLIP_FLOPS]),
    ):
        expected = np.array([_EXPECTED.get(name, 1.0) if target == "luts" else 1.0 for name in chosen])
        of_all = _least_squares(known, chosen, target, expected, _PULLS[0])
        for architecture in MEASURED:
            here = [row for row in known if row.architecture == architecture]
            common = _least_squares(here, chosen, target, of_all, _PULLS[1])
            for family in TITLES:
                own = [row for row in here if row.family == family]
                before = _with_earlier(architecture, family, target, chosen, common)
                factors = _least_squares(own, chosen, target, before, _PULLS[2])
                found[architecture][family][target] = {
                    name: round(float(factor), 3) for name, factor in zip(chosen, factors, strict=True) if factor
                }
    return {architecture: dict(families) for architecture, families in found.items()}


def _with_earlier(
    architecture: str, family: str, target: str, names: Sequence[str], common: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Return the factors of an earlier fit; those in common for quantities that it had in no family."""
    families = _earlier()[architecture]
    known = {name for of in families.values() for name in of[target]}
    own = families[family][target]
    return np.array([own.get(name, 0.0) if name in known else usual for name, usual in zip(names, common, strict=True)])


@cache
def _earlier() -> dict[str, dict[str, dict[str, Factors]]]:
    content: dict[str, dict[str, dict[str, Factors]]] = json.loads(EARLIER.read_text(encoding="utf-8"))
    return content


def _least_squares(
    rows: Sequence[Row], names: Sequence[str], target: str, drawn_to: npt.NDArray[np.float64], weight: float
) -> npt.NDArray[np.float64]:
    """Return factors, drawn to others by the shares of a design that these make; the others themselves without rows."""
    if not rows:
        return drawn_to
    shares = np.array([[row.quantities.get(name, 0) / getattr(row, target) for name in names] for row in rows])
    typical = np.array([np.median(column[column > 0]) if (column > 0).any() else 0.0 for column in shares.T])
    ends = np.maximum(drawn_to, _LEAST)
    pull = weight * np.sqrt(ends * typical) / ends + _LEAST**4
    factors: npt.NDArray[np.float64] = nnls(
        np.vstack([shares, np.diag(pull)]), np.concatenate([np.ones(len(rows)), pull * drawn_to])
    )[0]
    return factors


def errors(rows: Sequence[Row], factors: Mapping[str, Any], target: str = "luts") -> list[float]:
    """Return the relative error of each estimate."""
    return [
        total(row.quantities, factors[row.architecture][row.family][target]) / getattr(row, target) - 1 for row in rows
    ]
