"""Other coefficients for one stage of a running chain: proven to fit the stage, and the bound of the chain anew.

The stage is proven as a core of its own, or each of its cores if it interpolates. With its new response, errors of the
stages before it reach the end with other gains, and other magnitudes reach the ports behind it: none of them may limit
what passes.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from sosmith.gen.chain.design import (
    ChainDesign,
    StageDesign,
    excess_of,
    gains_to_the_end,
    limited_of,
    parts_of,
    reach_behind,
)
from sosmith.gen.chain.joints.registers import registers_unit
from sosmith.gen.chain.phases import exact_parts, specs_of
from sosmith.gen.chain.response import Part, peak_gain
from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.quantity import quantity
from sosmith.gen.reload.register_writes import pairs_of, reload_json, words_of, writes_of
from sosmith.gen.reload.reload import Swap, check_swap, own_set, set_for
from sosmith.model.errors import ShortfallError, SpecificationError

_LARGEST = ("transient_samples", "error_after_transient", "state_use")
"""Facts of which the largest of all cores counts."""


@dataclass(frozen=True, kw_only=True)
class ChainSwap:
    """A swap of the coefficients of a stage.

    Attributes
    ----------
    stage : StageDesign
        The stage as it was generated.
    swaps : tuple of Swap
        The set, as proven for each core of the stage.
    bound : Fraction
        Bound of the chain with the set, in the unit of its output: from a reset on, or once the swap has faded.
    """

    stage: StageDesign
    swaps: tuple[Swap, ...]
    bound: Fraction


def reload_chain(design: ChainDesign, wanted: ChainSpec, *, reset: bool) -> ChainSwap:
    """Prove the set of the one stage in which another specification differs.

    Parameters
    ----------
    design : ChainDesign
        The chain as it was generated.
    wanted : ChainSpec
        The same chain, with other coefficients of a stage, and another `max_error` if it must have one.
    reset : bool
        Whether the chain is reset between the swap and the next sample.

    Raises
    ------
    SpecificationError
        If anything else differs, or the stage cannot be loaded.
    ShortfallError
        If the set does not fit the stage, a port behind it, the error allowed, or the limits of the whole.
    """
    k = _changed(design, wanted)
    stage, spec, base = design.stages[k], wanted.stages[k], wanted.base
    asked = exact_parts(wanted, spec) if spec.rise > 1 else ()
    specs = specs_of(wanted, spec, stage.design.spec.inputs, stage.output, base.max_error, asked)
    try:
        sets = [set_for(core, each) for core, each in zip(stage.cores, specs, strict=True)]
        swaps = tuple(
            check_swap(core, None if reset else own_set(core), each)
            for core, each in zip(stage.cores, sets, strict=True)
        )
    except ShortfallError as error:
        raise ShortfallError(f"stage {spec.name}: {error}") from None
    quantized = [swap.new_set.quantized for swap in swaps]
    parts = [each.parts for each in design.stages]
    parts[k] = parts_of(quantized)
    errors = [each.bound for each in design.stages]
    errors[k] = max(each.bound for each in quantized) * stage.output.lsb
    _check_ports(design, parts, errors)
    gains = gains_to_the_end(design.spec, parts)
    bound = sum((error * gain for error, gain in zip(errors, gains, strict=True)), Fraction(0))
    if bound > base.max_error:
        allowed, reached = (quantity(float(value), base.output.unit) for value in (base.max_error, bound))
        raise ShortfallError(
            f"the chain must keep its error within {allowed} with the set, and is proven to {reached} only: nothing is "
            "to be loaded"
        )
    if wanted.limits is not None:
        excess = excess_of(wanted.limits, limited_of(wanted, parts))
        if excess:
            raise ShortfallError(
                f"the limits of the chain must be kept with the set, and are not: {'; '.join(excess)}: nothing is to "
                "be loaded"
            )
    return ChainSwap(stage=stage, swaps=swaps, bound=bound)


def writes_json(design: ChainDesign, swap: ChainSwap, version: int) -> dict[str, Any]:
    """Return what a host needs to load a set, as `sosmith.gen.reload.register_writes.reload_json` does for a core.

    Cores that share registers are loaded together: the words of one after those of the other. What is proven of all of
    them is that of the worst.
    """
    stage = swap.stage
    each = [reload_json(core, own, version) for core, own in zip(stage.cores, swap.swaps, strict=True)]
    registers = registers_unit(design, stage)
    if registers is None:
        return each[0]
    worst = max(each, key=lambda facts: facts["error_bound"])
    words = [word for core, own in zip(stage.cores, swap.swaps, strict=True) for word in words_of(core, own.new_set)]
    return worst | {
        "name": registers.stage,
        "design": registers.design,
        "words": registers.words,
        **{key: max(facts[key] for facts in each) for key in _LARGEST},
        "zero_frequency_gain": sum(facts["zero_frequency_gain"] for facts in each) / len(each),
        "writes": pairs_of(writes_of(words, version)),
    }


def _changed(design: ChainDesign, wanted: ChainSpec) -> int:
    """Return the number of the stage that differs."""
    spec = design.spec
    for name, have, other in (
        ("name", spec.name, wanted.name),
        ("sample_rate", spec.base.sample_rate, wanted.base.sample_rate),
        ("channels", spec.base.channels, wanted.base.channels),
        ("inputs", spec.base.inputs, wanted.base.inputs),
        ("output", spec.base.output, wanted.base.output),
        ("stage", *([(s.name, s.kind, s.factor, s.rise) for s in each.stages] for each in (spec, wanted))),
    ):
        if have != other:
            raise SpecificationError(
                f"{wanted.base.path}: {name} must be as in {spec.base.path} for a set to be loaded there"
            )
    changed = [
        k for k, (own, other) in enumerate(zip(spec.stages, wanted.stages, strict=True)) if own.tables != other.tables
    ]
    if len(changed) != 1:
        names = " and ".join(spec.stages[k].name for k in changed) or "none"
        raise SpecificationError(
            f"{wanted.base.path}: one stage must differ from {spec.base.path}, as each has registers of its own, "
            f"not {names}"
        )
    (k,) = changed
    if spec.stages[k].kind == "polynomial":
        raise SpecificationError(
            f"{wanted.base.path}: stage {spec.stages[k].name} must be a filter for a set to be proven for the chain, "
            "not a polynomial"
        )
    return k


def _check_ports(design: ChainDesign, parts: list[tuple[Part, ...]], errors: list[Fraction]) -> None:
    carried = Fraction(0)
    for m, stage in enumerate(design.stages[:-1]):
        gain = peak_gain(parts[m], steady=design.spec.is_steady) if parts[m] else Fraction(0)
        carried = carried * gain + errors[m]
        most, end = reach_behind(design.spec, parts[: m + 1]) + carried, stage.output.highest * stage.output.lsb
        if most >= end:
            raise ShortfallError(
                f"the set must keep results behind stage {stage.spec.name} below {float(end):.6g}, where its port "
                f"ends, not reach {float(most):.6g}"
            )
