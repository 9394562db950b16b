"""The jobs of the studio, which a worker carries out: each computes with the public interface what the page shows.

A job gets a function for its news, called with ``"step"`` and what it is at, or ``"part"`` and a part of its result,
and returns a tree for JSON.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import sosmith
from sosmith import Design, Filter, Specification

Tell = Callable[[str, Any], None]
Floats = npt.NDArray[np.float64]

POINTS = 400
"""Points of a curve."""

_proven: dict[str, Design] = {}
"""The last design of this process, by the text of its specification."""


def preview(tell: Tell, *, text: str, path: str) -> dict[str, Any]:
    """Return what a specification asks for and its ideal filter: takes milliseconds."""
    spec = _specification(text, path)
    ideal: Filter = spec.filter
    f = ideal.frequencies(POINTS)
    gain = abs(ideal.frequency_response(f))
    level = max(float(gain.max()), 1e-12)
    time, values = ideal.step_response()
    if ideal.settling_time is not None:
        shown = max(8, math.ceil(1.4 * ideal.settling_time * ideal.sample_rate))
        time, values = time[:shown], values[:shown]
    stride = math.ceil(len(time) / POINTS) or 1
    return {
        "name": spec.name,
        "spec": spec.as_dict(),
        "unit": spec.max_error.unit,
        "max_error": float(spec.max_error),
        "filter": {
            "describe": repr(ideal).removeprefix("<sosmith.Filter: ").removesuffix(">"),
            "order": ideal.order,
            "cutoff": ideal.cutoff,
            "passbands": ideal.passbands,
            "stopbands": ideal.stopbands,
            "overshoot": ideal.overshoot,
            "settling": None if ideal.settling_time is None else float(ideal.settling_time),
        },
        "response": {
            "f": _numbers(f),
            "db": _numbers(_decibels(gain / level)),
            "level": 20 * math.log10(level),
            "delay": _numbers(ideal.group_delay(f)),
        },
        "step": {"t": _numbers(time[::stride]), "y": _numbers(values[::stride])},
        "plane": {"poles": _plane(ideal.poles), "zeros": _plane(ideal.zeros)},
    }


def prove(tell: Tell, *, text: str, path: str) -> dict[str, Any]:
    """Design the core of a specification and prove its error; return what the page shows of it."""
    design = _designed(tell, text, path)
    manifest = design.manifest
    ideal = design.specification.filter
    f = ideal.frequencies(POINTS)
    gain = abs(design.frequency_response(f))
    lsb = float(manifest["streams"]["m_axis"]["fields"][0]["lsb"])
    return {
        "bound": float(design.bound),
        "allowed": float(design.specification.max_error),
        "unit": design.bound.unit,
        "lsb": lsb,
        "budget": [[part, float(value)] for part, value in design.budget.items()],
        "realization": design.realization,
        "architecture": design.architecture,
        "reasons": design.reasons,
        "latency": design.latency_cycles,
        "cycles": design.core.architecture.clocks_per_sample,
        "clock": design.specification.as_dict().get("hardware", {}).get("clock"),
        "cost": _cost(design),
        "db": _numbers(_decibels(gain / max(float(abs(ideal.frequency_response(f)).max()), 1e-12))),
        "f": _numbers(f),
        "limit_cycles": [
            [each["section"], each["largest"] / lsb, each["dead_band"] / lsb] for each in manifest["limit_cycles"]
        ],
        "sections": [
            [section.name, [[name, c.integer, c.fraction_bits] for name, c in section.coefficients.items()]]
            for section in design.sections
        ],
        "scenarios": design.scenarios,
    }


def side_by_side(tell: Tell, *, text: str, path: str) -> list[dict[str, Any]]:
    """Design every realization of a specification; each row is sent as a part as soon as it is there."""
    spec = _specification(text, path)
    rows = []
    for name in spec.realizations:
        tell("step", name)
        try:
            design = sosmith.design(spec, realization=name)
        except (sosmith.ShortfallError, sosmith.SpecificationError) as error:  # look-ahead chooses for itself
            row: dict[str, Any] = {"realization": name, "refused": str(error).removeprefix(f"{path}: ")}
        else:
            row = {
                "realization": name,
                "architecture": design.architecture,
                "bound": float(design.bound),
                "cycles": design.core.architecture.clocks_per_sample,
                "latency": design.latency_cycles,
                "cost": _cost(design),
            }
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
    every = design.core.datapath.samples_per_result  # only samples with a result can be compared
    edges = np.unique(np.linspace(0, len(error), min(POINTS, len(error)) + 1).astype(int))
    truth = [None] * error[0].size if inputs.truth is None else _columns(inputs.truth[::every])
    return {
        "name": inputs.name,
        "samples": len(error),
        "unit": design.bound.unit,
        "bound": float(design.bound),
        "max_error": float(abs(error).max()),
        "rms_error": float(np.sqrt(np.mean(error**2))),
        "t": _numbers(inputs.time[::every][edges[:-1]]),
        "channels": [
            {
                "low": _buckets(np.minimum, output, edges),
                "high": _buckets(np.maximum, output, edges),
                "error": _buckets(np.maximum, abs(wrong), edges),
                "truth": None if true is None else _numbers(true[edges[:-1]]),
                "from_truth": None if true is None else float(np.sqrt(np.mean((output - true) ** 2))),
            }
            for output, wrong, true in zip(_columns(hardware), _columns(error), truth, strict=True)
        ],
    }


def simulate(tell: Tell, *, text: str, path: str, source: str, seconds: float | None, folder: str) -> dict[str, Any]:
    """Co-simulate a design; its report is in `folder`."""
    design = _designed(tell, text, path)

    def progress(step: str, done: int, total: int) -> None:
        tell("step", f"{step}, {done:,} of {total:,}" if total else step)

    report = design.simulate(source, seconds=seconds, folder=folder, progress=progress)
    return {
        "passed": report.passed,
        "shortfalls": list(report.shortfalls),
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


def _specification(text: str, path: str) -> Specification:
    """Check a specification; files that it names must lie in its folder, as the text comes from a page."""
    folder = Path(path).parent.resolve()
    for table, key in (("calibration", "data"), ("filter", "sos_file"), ("filter", "taps_file")):
        named = _tree(text).get(table)
        name = named.get(key) if isinstance(named, dict) else None
        if isinstance(name, str) and not (folder / name).resolve().is_relative_to(folder):
            raise sosmith.SpecificationError(
                f"{path}: {table}.{key} must be a file in the folder of the specification, not {name!r}"
            )
    return Specification.from_toml(text, path)


def _tree(text: str) -> dict[str, Any]:
    """Return what is in a text, as far as it is TOML."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError):
        return {}


def _designed(tell: Tell, text: str, path: str) -> Design:
    if text not in _proven:
        spec = _specification(text, path)
        design = sosmith.design(spec, progress=lambda step, done, total: tell("step", step))
        _proven.clear()
        _proven[text] = design
    return _proven[text]


def _cost(design: Design) -> dict[str, Any]:
    """Return what the core is estimated to take on an ECP5, before synthesis."""
    estimate = design.estimates[0]
    return {
        "device": estimate.device,
        "luts": estimate.luts,
        "flip_flops": estimate.flip_flops,
        "multipliers": estimate.multiplier_blocks,
        "memory": estimate.memory_bits,
        "within": estimate.tested.nine_in_ten,
    }


def _decibels(gain: npt.NDArray[np.floating[Any]]) -> Floats:
    return np.asarray(20 * np.log10(np.maximum(gain, 1e-12)), dtype=np.float64)


def _buckets(of: Any, values: Floats, edges: npt.NDArray[np.int64]) -> list[float | None]:
    """Return the smallest or largest value between any two edges."""
    return _numbers(of.reduceat(values, edges[:-1]))


def _plane(points: npt.NDArray[np.complex128]) -> list[list[float]]:
    return [[float(point.real), float(point.imag)] for point in points]


def _numbers(values: npt.ArrayLike) -> list[float | None]:
    """Numbers with seven digits, which a picture does not tell from the full ones; None for what is not finite."""
    return [
        float(f"{value:.7g}") if math.isfinite(value) else None for value in np.asarray(values, dtype=float).tolist()
    ]
