"""The jobs of the studio, which a worker carries out: each computes with the public interface what the page shows.

A job gets a function for its news, called with ``"step"`` and what it is at, or ``"part"`` and a part of its result,
and returns a tree for JSON.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import sosmith
from sosmith import ChainSpecification, Design, Specification
from sosmith.studio.edits import changed, parsed
from sosmith.studio.stage_list import stages_of
from sosmith.studio.views import POINTS, Floats, asked, costs, numbers, proven

if TYPE_CHECKING:  # what a chain alone needs is loaded when there is one
    from sosmith import Chain

Tell = Callable[[str, Any], None]

_FILES = ("data", "sos_file", "taps_file")
"""Keys that name a file."""

_proven: dict[str, Design | Chain] = {}
"""The last design of this process, by the text of its specification."""


def preview(tell: Tell, *, text: str, path: str) -> dict[str, Any]:
    """Return what a specification asks for and its ideal filters: takes milliseconds."""
    return asked(_specification(text, path))


def prove(tell: Tell, *, text: str, path: str) -> dict[str, Any]:
    """Design the core or the chain of a specification and prove its error; return what the page shows of it."""
    design = _designed(tell, text, path)
    tell("step", "responses and cost")
    return proven(design)


def side_by_side(tell: Tell, *, text: str, path: str, stage: int) -> list[dict[str, Any]]:
    """Design every realization of a core, or of a stage; each row is sent as a part as soon as it is there."""
    spec = _specification(text, path)
    is_chain = isinstance(spec, ChainSpecification)
    one = spec.alone[min(stage, len(spec.stages) - 1)] if isinstance(spec, ChainSpecification) else spec
    rows = []
    for name in one.realizations:
        tell("step", name)
        key = f"stage.{stage}.realization" if is_chain else "hardware.realization"
        try:
            design = _design(_specification(changed(text, {key: name}), path), lambda step, done, total: None)
        except (sosmith.ShortfallError, sosmith.SpecificationError) as error:  # look-ahead chooses for itself
            row: dict[str, Any] = {"realization": name, "refused": str(error).removeprefix(f"{path}: ")}
        else:
            row = {"realization": name, **costs(design)}
        rows.append(row)
        tell("part", row)
    return rows


def _columns(values: Floats) -> list[Floats]:
    """Return the samples of each channel, of one or of several."""
    return [values] if values.ndim == 1 else list(values.T)


def trace(tell: Tell, *, text: str, path: str, source: str, seconds: float | None) -> dict[str, Any]:
    """Run the integer model of a design on a trace, and hold it against the exact result."""
    design = _designed(tell, text, path)
    tell("step", "making the trace")
    inputs = design.trace(source, seconds=seconds)
    tell("step", f"integer model, {len(inputs.time):,} samples")
    hardware = design.run(**inputs.inputs)
    tell("step", "exact result")
    exact = design.run_exact(**inputs.inputs)
    error = hardware - exact
    every, rise = (_every(design), 1) if isinstance(design, Design) else (design.factor, design.rise)
    edges = np.unique(np.linspace(0, len(error), min(POINTS, len(error)) + 1).astype(int))
    known = inputs.truth is not None and rise == 1  # between samples, nobody knows the true value
    truth = _columns(inputs.truth[::every]) if inputs.truth is not None and known else [None] * error[0].size
    time = _times(inputs.time, every, rise, len(error))
    return {
        "name": inputs.name,
        "samples": len(error),
        "unit": design.bound.unit,
        "bound": float(design.bound),
        "max_error": float(abs(error).max()),
        "rms_error": float(np.sqrt(np.mean(error**2))),
        "t": numbers(time[edges[:-1]]),
        "channels": [
            {
                "low": _buckets(np.minimum, output, edges),
                "high": _buckets(np.maximum, output, edges),
                "error": _buckets(np.maximum, abs(wrong), edges),
                "truth": None if true is None else numbers(true[edges[:-1]]),
                "from_truth": None if true is None else float(np.sqrt(np.mean((output - true) ** 2))),
            }
            for output, wrong, true in zip(_columns(hardware), _columns(error), truth, strict=True)
        ],
    }


def _every(design: Design) -> int:
    """Return the number of samples for each result."""
    return design.core.datapath.samples_per_result


def _times(time: Floats, every: int, rise: int, results: int) -> Floats:
    """Return the times of results: those of the samples that they come with, evenly between these."""
    place = np.arange(results) * every / rise
    return np.interp(place, np.arange(len(time)), time) if rise > 1 else time[::every][:results]


def simulate(tell: Tell, *, text: str, path: str, source: str, seconds: float | None, folder: str) -> dict[str, Any]:
    """Co-simulate a core or a chain; its report is in `folder`."""
    design = _designed(tell, text, path)

    def progress(step: str, done: int, total: int) -> None:
        tell("step", f"{step}, {done:,} of {total:,}" if total else step)

    report = design.simulate(source, seconds=seconds, folder=folder, progress=progress)
    return {
        "passed": report.passed,
        "shortfalls": report.summary["shortfalls"],
        "samples": report.summary["samples"],
        "simulator": report.summary["simulator"],
        "bit_exact": report.bit_exact,
    }


def calibrate(tell: Tell, *, measurements: str) -> dict[str, Any]:
    """Fit a calibration to the measurements in a CSV file."""
    fitted = sosmith.Calibration.load(measurements)
    given = fitted.measurements
    widths = fitted.half_width(given.voltage, given.temperature)
    return {
        "coefficients": fitted.coefficients,
        "measurements": len(given.clearance),
        "orders": list(fitted.orders),
        "adjusted_r": fitted.adjusted_r,
        "rms": float(fitted.rms),
        "largest": float(abs(fitted.residual).max()),
        "half_width": [float(widths.min()), float(widths.max())],
        "warning": fitted.warning,
    }


def _specification(text: str, path: str) -> Specification | ChainSpecification:
    """Check a specification; files that it names must lie in its folder, as the text comes from a page."""
    folder = Path(path).parent.resolve()
    tree = parsed(text) or {}
    named = {name: tree.get(name) for name in ("calibration", "filter")}
    named |= {f"stage[{k}]": stage for k, stage in enumerate(stages_of(text) or ())}
    for table, content in named.items():
        for key in _FILES:
            name = content.get(key) if isinstance(content, dict) else None
            if isinstance(name, str) and not (folder / name).resolve().is_relative_to(folder):
                raise sosmith.SpecificationError(
                    f"{path}: {table}.{key} must be a file in the folder of the specification, not {name!r}"
                )
    if "stage" in tree:
        return ChainSpecification.from_toml(text, path)
    return Specification.from_toml(text, path)


def _designed(tell: Tell, text: str, path: str) -> Design | Chain:
    if text not in _proven:
        design = _design(_specification(text, path), lambda step, done, total: tell("step", step))
        _proven.clear()
        _proven[text] = design
    return _proven[text]


def _design(spec: Specification | ChainSpecification, progress: Callable[[str, int, int], None]) -> Design | Chain:
    if isinstance(spec, ChainSpecification):
        return sosmith.design_chain(spec, progress=progress)
    return sosmith.design(spec, progress=progress)


def _buckets(of: Any, values: Floats, edges: npt.NDArray[np.int64]) -> list[float | None]:
    """Return the smallest or largest value between any two edges."""
    return numbers(of.reduceat(values, edges[:-1]))
