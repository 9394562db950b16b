"""The stages before a filter's sections: the calibration polynomial, or the scaling of the input, and the start.

A filter that starts from its first sample takes it off before the sections, and adds it behind them with the gain at
zero frequency (`sosmith.model.sections.start`). There that gain is rounded; what this costs is a part of the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from sosmith.gen.proof.polynomial_error import horner_error, rounded
from sosmith.gen.realizations.coefficients import lowest_terms
from sosmith.gen.realizations.section_format import MAX_BITS
from sosmith.model.dataflow.graph import Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerPolynomial, Variable
from sosmith.model.sections.output import FirstSample
from sosmith.model.sections.start import StartStage

_COARSER = 8
"""Most input stages to choose from: the one with an equal share of the budget, and coarser ones."""

_FINER = 2
"""Fraction bits more of the rows of a calibration that are only added."""


_START_SHARE = 16
"""Share of the error allowed for another part that the start may take at most: this part of it."""

_IDENTITY = Polynomial(((Fraction(0),), (Fraction(1),)))


@dataclass(frozen=True, kw_only=True)
class Start:
    """How a filter starts from its first sample.

    Attributes
    ----------
    first_sample : FirstSample or None
        What is added behind the sections; None if that is 0.
    error : Fraction
        Bound on the error of what is added, in output LSBs; exact.
    """

    first_sample: FirstSample | None
    error: Fraction


@dataclass(frozen=True, kw_only=True)
class InputStage:
    """Input stage: calibration or scaling, before the sections.

    Attributes
    ----------
    stages : tuple of Stage
        Its stages; empty if the sections take the input as it is.
    output : Range
        Fraction bits and range of its output, which drives the sections.
    error : Fraction
        Bound on its error, in output LSBs; exact.
    start : Start or None
        What starts the filter from its first sample; None if it starts from zero.
    """

    stages: tuple[Stage, ...]
    output: Range
    error: Fraction
    start: Start | None = None


def starting(stage: InputStage, gain: Fraction, allowed: Fraction, *, loads: bool = False) -> InputStage:
    """Return an input stage with which a filter starts from its first sample.

    Parameters
    ----------
    stage : InputStage
        Input stage of a filter that starts from zero.
    gain : Fraction
        Gain of the ideal filter at zero frequency.
    allowed : Fraction
        Error allowed for each other part, in output LSBs; the start takes a small share of it.
    loads : bool
        Whether other gains can be loaded: the steps are then so small that any gain keeps to the error.
    """
    frac = 0
    while (
        max(abs(round(gain * 2**frac) - gain * 2**frac), Fraction(loads, 2)) * _size(stage.output) * _START_SHARE
        > allowed * 2**frac
    ):
        frac += 1
    integer = round(gain * 2**frac)
    return _with_start(stage, gain, *((integer, frac) if loads else lowest_terms(integer, frac)))


def starting_like(stage: InputStage, gain: Fraction, first_sample: FirstSample | None) -> InputStage:
    """Return an input stage with which another filter starts in hardware that adds `first_sample`.

    Raises
    ------
    ShortfallError
        If the hardware has no multiplier for the gain that the filter needs.
    """
    frac = 0 if first_sample is None else first_sample.gain_frac
    integer = round(gain * 2**frac)
    # Hardware that adds no first sample has a gain of 0 for ever, and without a multiplier a gain of 1.
    if first_sample is None:
        fits = integer == 0
    else:
        fits = integer != 0 and (integer == first_sample.gain or not first_sample.is_plain)
    if not fits:
        have = 0 if first_sample is None else first_sample.gain * Fraction(2) ** -frac
        raise ShortfallError(
            f"the gain at zero frequency must be {have}, as the hardware has it, not {float(gain):.6g}"
        )
    return _with_start(stage, gain, integer, frac)


def _with_start(stage: InputStage, gain: Fraction, integer: int, frac: int) -> InputStage:
    first_sample = FirstSample(range=stage.output, gain=integer, gain_frac=frac) if integer else None
    start = StartStage(x=stage.output, passes=first_sample is not None)
    return replace(
        stage,
        stages=(*stage.stages, start),
        output=start.graph.output_ranges[0],
        start=Start(first_sample=first_sample, error=abs(integer * Fraction(2) ** -frac - gain) * _size(stage.output)),
    )


def _size(x: Range) -> Fraction:
    return max(map(abs, x.limits))


def needs_scaling(port: Port, output: Port) -> bool:
    """Whether a filter's input has an offset, or an LSB that is not a power of two times the output's."""
    return port.zero != 0 or _exponent_of_two(port.lsb / output.lsb) is None


def _exponent_of_two(value: Fraction) -> int | None:
    """Exponent k if `value` is 2**k, else None."""
    exponent = value.numerator.bit_length() - value.denominator.bit_length()
    return exponent if value == Fraction(2) ** exponent else None


def normalised(polynomial: Polynomial, inputs: Sequence[Port], output: Port) -> tuple[tuple[Fraction, ...], ...]:
    """Return exact coefficients, in output LSBs, for the variables ``code * 2**-bits``."""
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


def input_stages(
    polynomial: Polynomial | None, inputs: Sequence[Port], output: Port, allowed: Fraction
) -> tuple[InputStage, ...]:
    """Make the input stage with the fewest fraction bits that keeps to the error `allowed`, and coarser ones.

    The error is in output LSBs. Each stage in the result has fewer fraction bits than the previous one: of all its
    results or, where there are rows that are only added, of these. Without a
    polynomial, an input stage scales the input to output LSBs; it is empty if the factor is a power of two.

    Raises
    ------
    ShortfallError
        If no formats within the limits keep to the error allowed.
    """
    if polynomial is None and not needs_scaling(inputs[0], output):
        exponent = _exponent_of_two(inputs[0].lsb / output.lsb)
        assert exponent is not None
        output_range = Range(-exponent, inputs[0].lowest, inputs[0].highest)
        return (InputStage(stages=(), output=output_range, error=Fraction(0)),)
    coefficients = normalised(polynomial or _IDENTITY, inputs, output)
    variables = tuple(Variable(name=p.name, bits=p.bits, signed=p.signed) for p in inputs)
    finest_first: list[InputStage] = []
    for frac in range(MAX_BITS + 1):
        integers = rounded(coefficients, frac, variables)
        for finer in (0, _FINER) if any(len(row) > 1 for row in coefficients[:-1]) else (0,):
            horner = HornerPolynomial(coefficients=integers, frac=frac, variables=variables, finer=finer)
            error = horner_error(coefficients, horner)
            stages = horner.stages
            finest_first.insert(0, InputStage(stages=stages, output=stages[-1].graph.output_ranges[0], error=error))
            # The first one has rows like any other: a program may have no place for products beside finer ones.
            if error <= allowed and not finer:
                return tuple(finest_first[:_COARSER])
    raise ShortfallError(
        f"the calibration must keep its error below {float(allowed):.3g} output LSB with {MAX_BITS} fraction bits, "
        f"not {float(error):.3g}: raise output.max_error or output.bits"
    )
