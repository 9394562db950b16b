"""From calibration and filter to simulated hardware."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.report.report import write_report
from sosmith.gen.specification.specification import load
from sosmith.model.polynomial import Polynomial
from sosmith.model.text_files import write_files
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import Progress, simulate

HERE = Path(__file__).parent


@dataclass(frozen=True, kw_only=True)
class Wear:
    """The table ``[wear]`` of a specification, in mm."""

    initial: float = 1.5
    warning: float = 7.0
    limit: float = 9.0


def calibration_table(polynomial: Polynomial) -> str:
    """Return the table ``[calibration]`` of a polynomial; its numbers read back exactly."""
    rows = [[float(a) for a in row] for row in polynomial.coefficients]
    return f"[calibration]\ncoefficients = {rows}\n"


def filter_by_order(order: int, cutoff: float) -> str:
    """Return the table ``[filter]`` of a Butterworth low-pass with its cutoff in Hz."""
    return f'[filter]\nfamily = "butterworth"\nkind = "lowpass"\norder = {order}\ncutoff = {cutoff!r}\n'


def uncertainty_table(stated: dict[str, Any]) -> str:
    """Return the table ``[uncertainty]`` of what is known of the instrument's errors."""
    return "[uncertainty]\n" + "".join(f"{key} = {value}\n" for key, value in stated.items())


def specification(
    folder: Path,
    name: str,
    sample_rate: float,
    calibration: str,
    filter_table: str,
    *,
    wear: Wear | None = None,
    reload: bool = False,
    max_error: float | None = None,
    uncertainty: str = "",
) -> Path:
    """Write the specification of an instrument into `folder`."""
    limits = wear or Wear()
    text = Template((HERE / "instrument.toml").read_text(encoding="utf-8")).substitute(
        name=name,
        sample_rate=sample_rate,
        calibration=calibration,
        filter=filter_table,
        initial=limits.initial,
        warning=limits.warning,
        limit=limits.limit,
        reload=str(reload).lower(),
        max_error='"faithful"' if max_error is None else max_error,
    )
    (path,) = write_files(folder, {f"{name}.toml": text + uncertainty})
    return path


def instrument(
    folder: Path, name: str, sample_rate: float, calibration: str, filter_table: str, **options: Any
) -> CoreDesign:
    """Write a specification with `specification`, and design it."""
    return design_core(load(specification(folder, name, sample_rate, calibration, filter_table, **options)))


def run(made: CoreDesign, traces: Sequence[Trace], folder: Path, simulator: str, progress: Progress) -> dict[str, Any]:
    """Run the hardware on one trace for each channel, write its report, and return the figures of the report.

    Raises
    ------
    RuntimeError
        If the hardware is not the integer model bit for bit, or leaves its proven bound.
    """
    evidence = simulate(made, traces, folder / made.spec.name, simulator=simulator, progress=progress)
    summary = write_report(evidence, folder / made.spec.name)
    if not summary["passed"]:
        raise RuntimeError(f"{made.spec.name}: {'; '.join(summary['shortfalls'])}")
    return summary


def told(summary: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of a simulated run that the campaign's document shows."""
    return {
        "samples": summary["samples"],
        "bit_exact": summary["bit_exact"],
        "accuracy": summary["accuracy_percent"],
        "error_max": summary["error"]["max_abs"],
        "error_bound": summary["error"]["bound"],
    }
