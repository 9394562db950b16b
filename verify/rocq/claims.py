"""Theorems for the gains that a certificate claims of each section: of its recursion alone, and of the whole of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpz_poly

from sosmith.verify.certificate_file import Certificate, Operation, StageEntry
from sosmith.verify.graph import require
from sosmith.verify.rocq.linear import LinearStage
from sosmith.verify.rocq.polynomials import common_denominator, integers, number, numbers, rows
from sosmith.verify.rocq.responses import impulse, split

_BITS = (88, 104, 136, 232)
"""Precision of the first sample of a response, tried in this order."""


@dataclass(frozen=True)
class Claim:
    """A theorem about a certificate.

    Attributes
    ----------
    name : str
        Of the theorem in Rocq.
    words : str
        What it says, for people.
    text : str
        The theorem and its proof.
    """

    name: str
    words: str
    text: str


def gain_claims(certificate: Certificate) -> Iterator[Claim]:
    """Write the theorems for the gains of all sections, in their order.

    Raises
    ------
    RejectedError
        If gains are not given of exactly the sections, or a section is not linear or not stable.
    """
    sections = [stage for stage in certificate.stages if stage.role == "section"]
    claims = certificate.claims.sections
    names = [section.name for section in sections]
    require(
        [claim.section for claim in claims] == names,
        f"gains must be given of {', '.join(names) or 'nothing'}, "
        f"not {', '.join(claim.section for claim in claims) or 'nothing'}",
    )
    for index, (section, claim) in enumerate(zip(sections, claims, strict=True)):
        model = LinearStage(section)
        where = f"section {index}"
        first = [[Fraction(1)]]
        yield _gain(f"recursion_gain_{index}", f"{where}: gain of its recursion", model, first, claim.recursion_gain)
        for place, output in enumerate(section.outputs):
            if not passes_by(section, output):
                over = [
                    _in_values(section, model, output, source)
                    for source in range(len(section.nodes))
                    if section.nodes[source].op is Operation.INPUT
                ]
                words = f"{where}: gain from its inputs to output {place}"
                yield _gain(f"peak_gain_{index}_{place}", words, model, over, claim.peak_gain)


def passes_by(section: StageEntry, output: int) -> bool:
    """Whether an output of a section is an input, which passes beside what the section computes."""
    return section.nodes[output].op is Operation.INPUT


def _in_values(section: StageEntry, model: LinearStage, node: int, source: int) -> list[Fraction]:
    """Numerator between values instead of codes."""
    unit = Fraction(2) ** (section.nodes[source].frac - section.nodes[node].frac)
    return [value * unit for value in model.numerator(node, ("node", source, 0))]


def _gain(name: str, words: str, model: LinearStage, over: Sequence[Sequence[Fraction]], claimed: Fraction) -> Claim:
    scale = common_denominator([model.denominator, *over])
    under, numerators = integers(model.denominator, scale), [integers(one, scale) for one in over]
    text = f"""\
Theorem {name} : gain_at_most {numbers(under)} {rows(numerators)} {number(claimed.numerator)} {claimed.denominator}.
Proof.
  apply (claimed_gain _ _ ({_decided(under, numerators, claimed)})).
  vm_cast_no_check (eq_refl true).
Qed.
"""
    return Claim(name, f"{words} at most {float(claimed):.9g}", text)


def _decided(under: Sequence[int], over: Sequence[Sequence[int]], claimed: Fraction) -> str:
    """Return a witness that proves a claim, or that with the highest precision."""
    exponent, tail = split(under)
    for bits in _BITS:
        made = impulse(exponent, tail, 1 << bits)
        response = fmpz_poly(made.values)
        total = sum(int(sum(map(abs, (fmpz_poly(list(one)) * response).coeffs()))) for one in over)
        if total <= claimed * ((1 << bits + exponent) - made.rest):
            break
    return f"Witness {made.samples} {exponent} {numbers(tail)} 1 1 (2 ^ {bits})"
