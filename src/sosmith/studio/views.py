"""What the page shows of filters and designs, as trees for JSON: a single core is a design with one stage."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sosmith import ChainSpecification, Design, Filter, Specification

if TYPE_CHECKING:  # what a chain alone needs is loaded when there is one
    from sosmith import Chain, ChainFilter

Floats = npt.NDArray[np.float64]

POINTS = 400
"""Points of a curve."""

OF_CHAIN = 1000
"""Points of a curve of a chain, whose notches lie close to each other."""


def asked(spec: Specification | ChainSpecification) -> dict[str, Any]:
    """Return what a specification asks for: its ideal filters, and for a chain what they are together."""
    shown: dict[str, Any] = {
        "name": spec.name,
        "spec": spec.as_dict(),
        "unit": spec.max_error.unit,
        "max_error": float(spec.max_error),
        "chain": None,
    }
    if isinstance(spec, Specification):
        return shown | {"describe": _describe(spec.filter), "stages": [_of_filter(spec.filter)]}
    kinds = [stage["kind"] for stage in spec.as_dict()["stage"]]
    shown["describe"] = " → ".join(spec.stages)
    if spec.is_automatic:
        return shown | {"stages": [None]}
    whole = spec.filter
    filters = [None if kind == "polynomial" else one.filter for kind, one in zip(kinds, spec.alone, strict=True)]
    return shown | {
        "stages": [None if one is None else _of_filter(one) for one in filters],
        "chain": of_chain(whole),
    }


def _describe(ideal: Filter) -> str:
    return repr(ideal).removeprefix("<sosmith.Filter: ").removesuffix(">")


def _of_filter(ideal: Filter) -> dict[str, Any]:
    """Return the responses of a filter by itself."""
    f = ideal.frequencies(POINTS)
    gain = abs(ideal.frequency_response(f))
    level = max(float(gain.max()), 1e-12)
    time, values = ideal.step_response()
    if ideal.settling_time is not None:
        shown = max(8, math.ceil(1.4 * ideal.settling_time * ideal.sample_rate))
        time, values = time[:shown], values[:shown]
    stride = math.ceil(len(time) / POINTS) or 1
    return {
        "rate": ideal.sample_rate,
        "filter": {
            "describe": _describe(ideal),
            "order": ideal.order,
            "cutoff": ideal.cutoff,
            "passbands": ideal.passbands,
            "stopbands": ideal.stopbands,
            "overshoot": ideal.overshoot,
            "settling": None if ideal.settling_time is None else float(ideal.settling_time),
        },
        "response": {
            "f": numbers(f),
            "db": numbers(decibels(gain / level)),
            "level": 20 * math.log10(level),
            "delay": numbers(ideal.group_delay(f)),
        },
        "step": {"t": numbers(time[::stride]), "y": numbers(values[::stride])},
        "plane": {"poles": _plane(ideal.poles), "zeros": _plane(ideal.zeros)},
    }


def of_chain(whole: ChainFilter) -> dict[str, Any]:
    """Return the responses of a chain and of its stages over the same frequencies, and what its aliases are."""
    f = whole.frequencies(OF_CHAIN)
    folded = whole.aliases(POINTS)
    return {
        "f": numbers(f),
        "db": numbers(decibels(abs(whole.frequency_response(f)))),
        "stages": {name: numbers(decibels(gain)) for name, gain in whole.stage_gains(f).items()},
        "bands": whole.bands,
        "aliases": None
        if folded is None
        else {
            "f": numbers(folded[0]),
            "stays": numbers(decibels(folded[1])),
            "folds": numbers(decibels(folded[2])),
        },
    }


def proven(design: Design | Chain) -> dict[str, Any]:
    """Return what is proven of a design, and what it costs."""
    output = design.manifest["streams"]["m_axis"]["fields"][0]
    shown: dict[str, Any] = {
        "bound": float(design.bound),
        "allowed": float(design.specification.max_error),
        "unit": design.bound.unit,
        "lsb": float(output["lsb"]),
        "budget": [[part, float(value)] for part, value in design.budget.items()],
        "latency": design.latency_cycles,
        "scenarios": design.scenarios,
        "tables": [],
    }
    if isinstance(design, Design):
        stages = [_of_stage([design], design.specification.filter)]
        return shown | {"cycles": stages[0]["cycles"], "chain": None, "stages": stages} | summary(stages)
    stages = [
        _of_stage(cores, alone.filter) | {"name": name, "share": float(design.budget[name])}
        for (name, cores), alone in zip(design.cores.items(), design.specification.alone, strict=True)
    ]
    return shown | {
        "cycles": design.clocks_per_sample,
        "tables": [table.as_dict() for table in design.tables()],
        "chain": {"limits": design.bands, "passing": _passing(design), **of_chain(design.filter)},
        "chosen": design.specification.as_dict() if design.choice is not None else None,
        "stages": stages,
        **summary(stages),
    }


def _passing(design: Chain) -> list[tuple[float, str]]:
    """Return the largest gain of aliases into the pass band, and of images of it, in dB, as far as there are any."""
    known = (design.folding.get("passband"), "aliasing"), (design.images.get("passband"), "image")
    return [(float(decibels(np.array(peak[0]))), name) for peak, name in known if peak is not None]


def _of_stage(cores: Sequence[Design], ideal: Filter) -> dict[str, Any]:
    """Return what the cores of a stage are; of one that interpolates, there is one for each of its results in turn."""
    first = cores[0]
    output = first.manifest["streams"]["m_axis"]["fields"][0]
    curve: dict[str, Any] = {"f": [], "db": []}
    if first.sections:
        f = ideal.frequencies(POINTS)
        level = max(float(abs(ideal.frequency_response(f)).max()), 1e-12)
        curve = {"f": numbers(f), "db": numbers(decibels(abs(_integer(cores, ideal, f)) / level))}
    label = [""] if len(cores) == 1 else [f"result {k}, " for k in range(len(cores))]
    named = list(zip(label, cores, strict=True))
    return curve | {
        "realization": first.realization,
        "architecture": first.architecture,
        "reasons": first.reasons,
        "cycles": max(core.core.architecture.clocks_per_sample for core in cores),
        "bits": output["width"],
        "cost": _total([_cost(core) for core in cores]),
        "limit_cycles": [
            [before + each["section"], each["largest"] / output["lsb"], each["dead_band"] / output["lsb"]]
            for before, core in named
            for each in core.manifest["limit_cycles"]
        ],
        "sections": [
            [before + section.name, [[name, c.integer, c.fraction_bits] for name, c in section.coefficients.items()]]
            for before, core in named
            for section in core.sections
        ],
    }


def _integer(cores: Sequence[Design], ideal: Filter, f: Floats) -> npt.NDArray[np.complex128]:
    """Return the gain with integer coefficients: of one core, or of the results of several in turn."""
    turns = enumerate(cores)
    gain = sum(core.frequency_response(f) * np.exp(-2j * np.pi * f * k / ideal.sample_rate) for k, core in turns)
    whole: npt.NDArray[np.complex128] = np.asarray(gain)
    # Taps by edges are times the number of results in the hardware, taps that are given are not.
    larger = abs(whole).max() > math.sqrt(len(cores)) * abs(ideal.frequency_response(f)).max()
    return whole / len(cores) if larger else whole


def summary(stages: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return realizations, architectures and cost of all stages together."""
    return {
        "realization": _each_once(stage["realization"] for stage in stages) or None,
        "architecture": _each_once(stage["architecture"] for stage in stages),
        "cost": _total([stage["cost"] for stage in stages]),
    }


def costs(design: Design | Chain) -> dict[str, Any]:
    """Return realizations, architectures and cost of a design that is compared with others."""
    cores = [design] if isinstance(design, Design) else design.stages
    return {
        "architecture": _each_once(core.architecture for core in cores),
        "bound": float(design.bound),
        "cycles": design.core.architecture.clocks_per_sample
        if isinstance(design, Design)
        else design.clocks_per_sample,
        "latency": design.latency_cycles,
        "cost": _total([_cost(core) for core in cores]),
    }


def _each_once(names: Iterable[str | None]) -> str:
    return ", ".join(dict.fromkeys(name for name in names if name))


def _cost(design: Design) -> dict[str, Any]:
    """Return what a core is estimated to take on an ECP5, before synthesis."""
    estimate = design.estimates[0]
    return {
        "device": estimate.device,
        "luts": estimate.luts,
        "flip_flops": estimate.flip_flops,
        "multipliers": estimate.multiplier_blocks,
        "memory": estimate.memory_bits,
        "within": estimate.tested.nine_in_ten,
    }


def _total(all_costs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Add costs; of what joins the cores, nothing is counted before synthesis."""
    added = {key: sum(cost[key] for cost in all_costs) for key in ("luts", "flip_flops", "multipliers", "memory")}
    return {"device": all_costs[0]["device"], **added, "within": max(cost["within"] for cost in all_costs)}


def decibels(gain: npt.NDArray[np.floating[Any]]) -> Floats:
    """Return gains in dB, none below -240."""
    return np.asarray(20 * np.log10(np.maximum(gain, 1e-12)), dtype=np.float64)


def _plane(points: npt.NDArray[np.complex128]) -> list[list[float]]:
    return [[float(point.real), float(point.imag)] for point in points]


def numbers(values: npt.ArrayLike) -> list[float | None]:
    """Numbers with seven digits, which a picture does not tell from the full ones; None for what is not finite."""
    return [
        float(f"{value:.7g}") if math.isfinite(value) else None for value in np.asarray(values, dtype=float).tolist()
    ]
