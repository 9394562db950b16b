"""From a specification to a frozen datapath: word lengths chosen on proven bounds.

All amounts inside are in output LSBs. What `max_error` leaves beside the half LSB of the output rounding is
divided between calibration, filter coefficients and filter rounding; each part gets the fewest bits that keep
to its share. The parts of the bound are then proven for what came out, and so are the ranges of all nodes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sosmith.gen.design import Filter
from sosmith.gen.linear_model import LinearModel, linear_model
from sosmith.gen.ordering import best_order
from sosmith.gen.peak_gain import Extent
from sosmith.gen.proof import (
    CascadeProof,
    Section,
    coefficient_extent,
    ideal_gain,
    prove_cascade,
    rounding_gains,
)
from sosmith.gen.realizations import REALIZATIONS, SectionFormat
from sosmith.model.datapath import Datapath, Stage
from sosmith.model.errors import ShortfallError
from sosmith.model.horner import HornerPolynomial, HornerStep, Variable
from sosmith.model.output import OutputStage
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

Array = npt.NDArray[np.float64]

_FEWEST_BITS, _MOST_BITS = 4, 40
"""Significant bits of a coefficient that are tried; as many fraction bits of a signal at most: no useful design lies
beyond."""

_BITS_TO_ORDER = 24
"""Significant bits of the coefficients with which orders of the sections are compared."""

_Format = tuple[int, int, int]
"""Fraction bits, smallest and largest code of a signal."""


@dataclass(frozen=True, kw_only=True)
class Quantized:
    """A datapath and the proven bound on its error.

    Attributes
    ----------
    datapath : Datapath
        What is computed, bit for bit.
    filter : Filter or None
        The ideal filter; None for a calibration core.
    polynomial : Polynomial or None
        The ideal polynomial; None for a filter core.
    realization : str
        Name of the sections' realization.
    coefficient_bits : int
        Significant bits of the sections' coefficients; 0 without a filter.
    budget : dict of str to Fraction
        Parts of the error bound in output LSBs, each proven.
    entry_error : Fraction
        Bound on the error of what comes before the filter, at the filter's input, in output LSBs; exact.
    proof : CascadeProof or None
        The proof of the sections; None without a filter.
    """

    datapath: Datapath
    filter: Filter | None
    polynomial: Polynomial | None
    realization: str
    coefficient_bits: int
    budget: dict[str, Fraction]
    entry_error: Fraction
    proof: CascadeProof | None

    @property
    def bound(self) -> Fraction:
        """Proven bound on ``|output - exact|`` in output LSBs, the exact value limited to the output's range."""
        return sum(self.budget.values(), Fraction(0))

    @property
    def sections(self) -> tuple[Stage, ...]:
        """The filter's sections, in the order of the cascade."""
        return tuple(s for s in self.datapath.stages if not isinstance(s, HornerStep | OutputStage))

    @cached_property
    def quantized_sos(self) -> Array:
        """The transfer functions that the integer coefficients make, shape (sections, 6)."""
        rows = []
        for section in self.sections:
            model = linear_model(section.graph)
            rows.append([*_padded(model.transfer), *_padded(model.denominator)])
        return np.array(rows, dtype=np.float64).reshape(-1, 6)


def quantize(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
) -> Quantized:
    """Choose formats and integer coefficients, and prove their error.

    Parameters
    ----------
    name : str
        Name of the core.
    inputs, output : Port
        Its ports; two inputs with a polynomial, one without.
    max_error : Fraction
        Error allowed, in the unit of `output`; more than half an LSB.
    ideal : Filter or None
        Filter; None for a calibration core.
    polynomial : Polynomial or None
        Calibration polynomial in physical units; None for a filter core.
    realization : str
        A key of `REALIZATIONS`.

    Raises
    ------
    ShortfallError
        If no formats within the limits keep to `max_error`.
    """
    parts = (polynomial is not None or _needs_scaling(inputs[0], output)) + 2 * (ideal is not None)
    share = (max_error / output.lsb - Fraction(1, 2)) / max(parts, 1)
    gain = Fraction(1) if ideal is None else _gain(ideal)
    stages: list[Stage] = []
    budget: dict[str, Fraction] = {}
    entry_error = Fraction(0)
    if polynomial is None and not _needs_scaling(inputs[0], output):
        exponent = _exponent_of_two(inputs[0].lsb / output.lsb)
        assert exponent is not None
        signal: _Format = (-exponent, inputs[0].lowest, inputs[0].highest)
    else:
        horner, entry_error = _horner(_normalised(polynomial or _IDENTITY, inputs, output), inputs, share / gain)
        stages += horner.stages
        signal = _format_of(horner.stages[-1])
        budget["calibration" if polynomial is not None else "input scaling"] = entry_error * gain
    proof, bits = None, 0
    if ideal is not None:
        ideal = _ordered(ideal, realization)
        bits = _coefficient_bits(ideal, realization, signal, share)
        fracs = _fraction_bits(ideal, realization, bits, share)
        sections, proof = _cascade(ideal, realization, bits, fracs, signal)
        while proof.rounding.magnitude > share:  # where a quantizer's error is not centred
            fracs = [{name: frac + 1 for name, frac in sources.items()} for sources in fracs]
            sections, proof = _cascade(ideal, realization, bits, fracs, signal)
        stages += sections
        budget |= _filter_budget(proof)
        signal = _format_of(sections[-1])
    stage, error = _output_stage(signal, output)
    budget["output rounding"] = error
    return Quantized(
        datapath=Datapath(name=name, inputs=inputs, output=output, stages=(*stages, stage)),
        filter=ideal,
        polynomial=polynomial,
        realization=realization,
        coefficient_bits=bits,
        budget=budget,
        entry_error=entry_error,
        proof=proof,
    )


def with_realization(quantized: Quantized, realization: str) -> Quantized:
    """Return the design in another realization with the same coefficient width and fraction bits of each section.

    The bound is proven anew and may exceed what the specification allows.
    """
    ideal = quantized.filter
    assert ideal is not None
    stages = quantized.datapath.stages
    first = next(index for index, stage in enumerate(stages) if stage in quantized.sections)
    entry = quantized.sections[0].graph
    node = entry.nodes[entry.inputs[0]]
    signal = (node.frac, node.low, node.high)
    kept = [_format_of(section)[0] for section in quantized.sections]
    models = _wide(ideal, realization, quantized.coefficient_bits)
    fracs = [dict.fromkeys(_quantizers(model), frac) for model, frac in zip(models, kept, strict=True)]
    sections, proof = _cascade(ideal, realization, quantized.coefficient_bits, fracs, signal)
    stage, error = _output_stage(_format_of(sections[-1]), quantized.datapath.output)
    return replace(
        quantized,
        datapath=replace(quantized.datapath, stages=(*stages[:first], *sections, stage)),
        realization=realization,
        budget=quantized.budget | _filter_budget(proof) | {"output rounding": error},
        proof=proof,
    )


def _gain(ideal: Filter) -> Fraction:
    try:
        return ideal_gain(ideal_sections(ideal))
    except ShortfallError as error:
        raise ShortfallError(f"{error}{f' by {ideal.decimation}' if ideal.decimation > 1 else ''}") from None


def _ordered(ideal: Filter, realization: str) -> Filter:
    """Return the filter with its sections in the order that rounds best, if that is worth a change."""
    try:
        models = _wide(ideal, realization, _BITS_TO_ORDER)
    except ShortfallError:
        return ideal  # not to be built with so few bits
    return replace(ideal, rows=tuple(ideal.rows[k] for k in best_order(models)))


def _remedy(ideal: Filter, *first: str) -> str:
    """Name what would help where a share of the budget cannot be kept to."""
    ways = [*first, "raise output.max_error", "raise output.bits"]
    if ideal.decimation > 1:
        assert ideal.cutoff is not None
        ratio = ideal.sample_rate / ideal.cutoff[-1]
        ways.append(f"decimate by {ideal.decimation} first, as the cutoff is 1/{ratio:.0f} of the sample rate")
    return f"{', '.join(ways[:-1])} or {ways[-1]}"


_IDENTITY = Polynomial(((Fraction(0),), (Fraction(1),)))


def _needs_scaling(port: Port, output: Port) -> bool:
    """Whether the code of a filter's input is anything but a power of two times an output LSB."""
    return port.zero != 0 or _exponent_of_two(port.lsb / output.lsb) is None


def _padded(values: Sequence[Fraction]) -> list[float]:
    if len(values) > 3:
        raise ValueError(f"section must have an order of at most 2, not {len(values) - 1}")
    return [*(float(value) for value in values), 0.0, 0.0][:3]


def _format_of(stage: Stage) -> _Format:
    node = stage.graph.nodes[stage.graph.outputs[0]]
    return node.frac, node.low, node.high


def _filter_budget(proof: CascadeProof) -> dict[str, Fraction]:
    return {"filter coefficients": proof.coefficients.magnitude, "filter rounding": proof.rounding.magnitude}


def _output_stage(signal: _Format, output: Port) -> tuple[OutputStage, Fraction]:
    """Make the last stage and tell its error: half an LSB where anything is rounded, and the offset's own rounding."""
    frac = max(signal[0], 0)
    exact = -output.zero / output.lsb * 2**frac
    offset = round(exact)
    rounding = Fraction(1, 2) if signal[0] > 0 else Fraction(0)
    stage = OutputStage(
        offset=offset,
        offset_frac=frac,
        x_frac=signal[0],
        x_low=signal[1],
        x_high=signal[2],
        low=output.lowest,
        high=output.highest,
    )
    return stage, rounding + abs(exact - offset) / 2**frac


def _exponent_of_two(value: Fraction) -> int | None:
    """Exponent k where `value` is 2**k, else None."""
    exponent = value.numerator.bit_length() - value.denominator.bit_length()
    return exponent if value == Fraction(2) ** exponent else None


def _normalised(polynomial: Polynomial, inputs: Sequence[Port], output: Port) -> tuple[tuple[Fraction, ...], ...]:
    """Exact coefficients in the codes' fractions ``code * 2**-bits``, in output LSBs."""
    columns = max(map(len, polynomial.coefficients))
    first = _substitution(inputs[0], len(polynomial.coefficients))
    second = _substitution(inputs[1], columns) if len(inputs) > 1 else [[Fraction(1)]]
    result = [[Fraction(0)] * columns for _ in polynomial.coefficients]
    for i, row in enumerate(polynomial.coefficients):
        for j, a in enumerate(row):
            for p, left in enumerate(first[i]):
                for q, right in enumerate(second[j]):
                    result[p][q] += a * left * right / output.lsb
    return tuple(_trimmed(row) for row in result)


def _trimmed(row: Sequence[Fraction]) -> tuple[Fraction, ...]:
    end = max((k for k, value in enumerate(row) if value), default=0)
    return tuple(row[: end + 1])


def _substitution(port: Port, count: int) -> list[list[Fraction]]:
    """Powers of ``zero + lsb * 2**bits * u`` as coefficients of u."""
    powers = [[Fraction(1)]]
    span = port.lsb * 2**port.bits
    for _ in range(count - 1):
        last = powers[-1]
        powers.append(
            [a * port.zero + b * span for a, b in zip([*last, Fraction(0)], [Fraction(0), *last], strict=True)]
        )
    return powers


def _horner(
    coefficients: tuple[tuple[Fraction, ...], ...], inputs: Sequence[Port], allowed: Fraction
) -> tuple[HornerPolynomial, Fraction]:
    """Find the fewest fraction bits whose error stays below `allowed`, both in output LSBs."""
    variables = tuple(Variable(name=p.name, bits=p.bits, signed=p.signed) for p in inputs)
    for frac in range(_MOST_BITS + 1):
        integers = tuple(tuple(round(c * 2**frac) for c in row) for row in coefficients)
        horner = HornerPolynomial(coefficients=integers, frac=frac, variables=variables)
        error = _horner_error(coefficients, horner)
        if error <= allowed:
            return horner, error
    raise ShortfallError(
        f"the calibration must keep its error below {float(allowed):.3g} output LSB with {_MOST_BITS} fraction bits, "
        f"not {float(error):.3g}: raise output.max_error or output.bits"
    )


def _horner_error(exact: tuple[tuple[Fraction, ...], ...], horner: HornerPolynomial) -> Fraction:
    """Bound on the polynomial's error over all input codes, exact; |u| and |t| are at most one."""
    half = Fraction(1, 2 ** (horner.frac + 1))
    rows = []
    for wanted, made in zip(exact, horner.coefficients, strict=True):
        errors = [abs(w - m * Fraction(1, 2**horner.frac)) for w, m in zip(wanted, made, strict=True)]
        rows.append(sum(errors) + half * (len(errors) - 1))
    return Fraction(sum(rows) + half * (len(rows) - 1))


def ideal_sections(ideal: Filter) -> list[Section]:
    """Return the ideal sections as exact rationals of their double-precision coefficients."""
    sections = []
    for row in ideal.rows:
        numerator, denominator = ([Fraction(value) for value in part] for part in (row[:3], row[3:]))
        sections.append((_shortened(numerator), _shortened(denominator)))
    return sections


def _shortened(values: Sequence[Fraction]) -> tuple[Fraction, ...]:
    end = max((k for k, value in enumerate(values) if value), default=0)
    return tuple(values[: end + 1])


def _values(signal: _Format) -> tuple[Fraction, Fraction]:
    unit = Fraction(2) ** -signal[0]
    return signal[1] * unit, signal[2] * unit


def _wide(ideal: Filter, realization: str, bits: int) -> list[LinearModel]:
    """Models of the sections with every quantizer at whole output LSBs and no ranges."""
    build = REALIZATIONS[realization].build
    words = SectionFormat(coefficient_bits=bits)
    return [linear_model(build(row, words, f"section{k}").graph) for k, row in enumerate(ideal.rows)]


def _quantizers(model: LinearModel) -> list[str]:
    return [source.name for source in model.sources if source.name not in {"input", "constant"}]


def _coefficient_bits(ideal: Filter, realization: str, signal: _Format, share: Fraction) -> int:
    """Fewest significant bits whose proven effect stays within `share`."""
    sections, ends = ideal_sections(ideal), _values(signal)
    bits = _FEWEST_BITS
    while bits <= _MOST_BITS:
        try:
            error = coefficient_extent(_wide(ideal, realization, bits), sections, *ends).magnitude
        except ShortfallError:
            bits += 1  # unstable with so few bits
            continue
        if error <= share:
            return bits
        # An error falls by half with each bit, now and then by more: leap most of the way.
        bits += max(1, math.floor(math.log2(error / share)) - 2)
    raise ShortfallError(
        f"the filter's coefficients must keep their error below {float(share):.3g} output LSB with {_MOST_BITS} "
        f"significant bits each, and do not: {_remedy(ideal)}"
    )


def _fraction_bits(ideal: Filter, realization: str, bits: int, share: Fraction) -> list[dict[str, int]]:
    """Fraction bits of every quantizer so that all their errors together stay within `share`."""
    unit = rounding_gains(_wide(ideal, realization, bits))
    count = sum(map(len, unit))
    fracs = [
        {name: max(0, math.ceil(math.log2(error * count / share))) if error else 0 for name, error in sources.items()}
        for sources in unit
    ]
    if max((frac for sources in fracs for frac in sources.values()), default=0) > _MOST_BITS:
        raise ShortfallError(
            f"the filter must keep its rounding error below {float(share):.3g} output LSB with {_MOST_BITS} fraction "
            f"bits in each state, and does not: {_remedy(ideal, 'choose a realization with error feedback')}"
        )
    # An equal split wastes up to a bit each; give back what the sum allows, the first section first.
    for sources, errors in zip(fracs, unit, strict=True):
        for name in sources:
            total = _total(fracs, unit) + errors[name] * Fraction(2) ** -sources[name]
            if sources[name] > 0 and total <= share:
                sources[name] -= 1
    return fracs


def _total(fracs: Sequence[Mapping[str, int]], unit: Sequence[Mapping[str, Fraction]]) -> Fraction:
    return sum(
        (
            errors[name] * Fraction(2) ** -sources[name]
            for sources, errors in zip(fracs, unit, strict=True)
            for name in sources
        ),
        Fraction(0),
    )


def _cascade(
    ideal: Filter, realization: str, bits: int, fracs: Sequence[Mapping[str, int]], signal: _Format
) -> tuple[list[Stage], CascadeProof]:
    """Build the sections, prove their ranges, and build them again with these."""
    build = REALIZATIONS[realization].build
    entry = signal
    stages = []
    for k, row in enumerate(ideal.rows):
        words = SectionFormat(coefficient_bits=bits, fracs=fracs[k], x_frac=entry[0])
        stages.append(build(row, words, f"section{k}"))
        entry = _format_of(stages[-1])
    proof = prove_cascade([linear_model(s.graph) for s in stages], ideal_sections(ideal), *_values(signal))
    entry = signal
    result = []
    for k, row in enumerate(ideal.rows):
        nodes = stages[k].graph.nodes
        ranges = {nodes[i].name: _codes(extent, nodes[i].frac) for i, extent in proof.nodes[k].items()}
        words = SectionFormat(
            coefficient_bits=bits,
            fracs=fracs[k],
            ranges=ranges,
            x_frac=entry[0],
            x_low=entry[1],
            x_high=entry[2],
        )
        result.append(build(row, words, f"section{k}"))
        entry = _format_of(result[-1])
    return result, proof


def _codes(extent: Extent, frac: int) -> tuple[int, int]:
    """Range of codes that holds all values of an extent."""
    unit = Fraction(2) ** frac
    return math.floor(extent.low * unit), math.ceil(extent.high * unit)
