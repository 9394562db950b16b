"""Proves the claims on sections in on-line arithmetic again: from their graphs, by following sets of residuals.

What a unit adds at a step is a sum of digits in {-1, 0, 1} times the coefficients, which are read off the section's
transfer functions. All sums of digits are made, and the set of all residuals that any of them and any estimate of the
carry-save pair can lead to, starting from all those before the first digit, is followed until it grows no more. It must
stay where the last digit is -1, 0 or 1. The estimate u of v has u <= v < u + 1/2 in steps of 1/4; the digit is 1 from
1/2 on and -1 from -3/4 down.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import product

from flint import fmpq_poly

from sosmith.verify.bounds.l1_response import fraction
from sosmith.verify.certificate_file import Certificate, OnlineSectionEntry, Operation, StageEntry
from sosmith.verify.graph import Transfer, require

_CLOCKS = 3
"""Clocks that the hardware takes from a digit to the step that uses it, beyond the delay."""

_REGIONS = {1: (Fraction(1, 2), None), 0: (Fraction(-1, 2), Fraction(3, 4)), -1: (None, Fraction(-1, 4))}
"""Values from which on and below which a digit can be chosen, whatever the estimate is."""

Interval = tuple[Fraction, Fraction]


def check_online(certificate: Certificate, sections: Sequence[StageEntry]) -> None:
    """Check what a certificate claims of its sections' units.

    Parameters
    ----------
    certificate : Certificate
        With claims on on-line arithmetic; its ranges are proven.
    sections : sequence of StageEntry
        The sections, without what passes beside them.

    Raises
    ------
    RejectedError
        If a claim does not hold.
    """
    claims = certificate.claims.online
    assert claims is not None
    names = [section.name for section in sections]
    require(
        [claim.section for claim in claims.sections] == names,
        f"units must be claimed of {', '.join(names)}, "
        f"not {', '.join(claim.section for claim in claims.sections) or 'nothing'}",
    )
    entry = sections[0].nodes[Transfer(sections[0]).inputs[0][1]]
    exponent = max(entry.high.bit_length(), (-entry.low - 1).bit_length()) - entry.frac
    for section, claim in zip(sections, claims.sections, strict=True):
        steps = _check_section(section, claim, exponent)
        require(
            claims.interval >= claim.delay + _CLOCKS,
            f"the interval must be at least {claim.delay + _CLOCKS} clocks for {section.name}, not {claims.interval}",
        )
        require(
            claims.units * claims.interval >= steps,
            f"the units of {section.name} must have {steps} clocks for a sample, not {claims.units * claims.interval}",
        )
        exponent = claim.leading


def _check_section(section: StageEntry, claim: OnlineSectionEntry, exponent: int) -> int:
    """Check one section, whose input has digits from ``2**exponent`` down; return the steps that it takes."""
    model = Transfer(section)
    output = section.outputs[0]
    y, x = section.nodes[output], section.nodes[model.inputs[0][1]]
    numerator, denominator = _row(model.numerator(model.inputs[0], output)), _row(model.denominator)
    errors = [source for source in model.sources if source[0] is Operation.FLOOR]
    others = [source for source in model.sources if source[0] not in {Operation.FLOOR, Operation.INPUT}]
    require(
        len(errors) <= 1 and all(source[0] is Operation.CONSTANT for source in others),
        f"{section.name} must have one quantizer, not {len(errors)}",
    )
    require(denominator[0] == 1, f"the denominator of {section.name} must begin with 1, not {denominator[0]}")
    recursion = [-a for a in denominator[1:]]
    shaping = [-k for k in _row(model.numerator(errors[0], output))] if errors else [Fraction(1)]
    require(shaping[0] == 1, f"the error feedback of {section.name} must begin with 1, not {shaping[0]}")
    feedback = [-k for k in shaping[1:]]
    unit = Fraction(2) ** -y.frac
    centre = sum((fraction(model.numerator(s, output)(0)) * model.sources[s][0] for s in others), Fraction(0))
    wanted = (1 - sum(feedback, Fraction(0))) / 2 * unit if errors else Fraction(0)
    require(
        centre == wanted,
        f"the constant of {section.name} must be {wanted}, which centres its error, not {centre}",
    )
    total = section.nodes[errors[0][1]] if errors else y
    half = unit / 2 if errors else Fraction(0)
    largest = max(abs(end * Fraction(2) ** -total.frac - half) for end in (total.low, total.high))
    increments = _sums([*numerator, *recursion], Fraction(1, 2**claim.delay))
    digits = claim.leading + y.frac + 1
    finer = max(0, x.frac - y.frac)
    fed = digits - claim.delay + finer
    require(
        claim.delay >= finer + 2 and (not any(feedback) or fed <= digits - 3),
        f"all that enters {section.name} must do so before its last two steps: the delay must be larger, not "
        f"{claim.delay}",
    )
    returned = _sums([abs(f) / 2 for f in feedback], Fraction(2) ** (fed - digits + 1))
    require(
        claim.increment == max(*increments, *returned),
        f"the largest increment of {section.name} must be {max(*increments, *returned)}, not {claim.increment}",
    )
    finest = min(
        Fraction(1, 2),
        *(Fraction(1, b.denominator) * Fraction(2) ** (y.frac - x.frac) for b in numerator),
        *(Fraction(1, a.denominator) for a in recursion),
    )
    fed_back = [f * finest * Fraction(2) ** (fed - digits + 1) for f in feedback]
    added = [factor / 2**claim.delay for factor in (*numerator, *recursion)]
    require(
        all((value * 2**claim.residual_frac).denominator == 1 for value in (*added, *fed_back, finest / 4)),
        f"the residual of {section.name} must have more than {claim.residual_frac} fraction bits",
    )
    first = largest / 2 ** (claim.leading + 1)
    _follow(section.name, (-first - max(increments), first + max(increments)), {*increments, *returned})
    return digits + claim.delay + max(0, exponent - claim.leading)


def _row(polynomial: fmpq_poly) -> list[Fraction]:
    return [fraction(value) for value in polynomial.coeffs()]


def _sums(factors: Sequence[Fraction], scale: Fraction) -> set[Fraction]:
    """Return all sums of the factors times digits, scaled."""
    sums = {Fraction(0)}
    for factor in factors:
        sums = {total + factor * digit * scale for total, digit in product(sums, (-1, 0, 1))}
    return sums


def _follow(name: str, start: Interval, increments: set[Fraction]) -> None:
    """Follow the residuals from all those in `start`, closed below and open above."""
    limit = Fraction(3, 4)
    low, high = start
    while True:
        require(
            -limit <= low and high <= limit,
            f"the residual of {name} must stay in [-3/4, 3/4), not reach [{float(low):.6g}, {float(high):.6g})",
        )
        ends = [(low, high)]
        for increment in increments:
            v = 2 * low + increment, 2 * high + increment
            for digit, (least, below) in _REGIONS.items():
                a = v[0] if least is None else max(v[0], least)
                b = v[1] if below is None else min(v[1], below)
                if a < b:
                    ends.append((a - digit, b - digit))
        wider = min(a for a, _ in ends), max(b for _, b in ends)
        if wider == (low, high):
            return
        low, high = wider
