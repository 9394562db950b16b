"""Theorems for the gains that a certificate claims of each section: of its recursion alone, and of the whole of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpz_poly

from sosmith.verify.certificate_file import Certificate, Operation, StageEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.rocq.linear import LinearStage
from sosmith.verify.rocq.polynomials import common_denominator, integers, number, numbers, rows
from sosmith.verify.rocq.responses import Response, begun, impulse, split

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
    """Write the theorems for the gains of all sections, in their order, up to one whose recursion does not die away.

    Raises
    ------
    RejectedError
        If gains are not given of exactly the sections, or a section is not linear; or, behind its theorem, which Rocq
        refuses, if the response of a recursion does not die away.
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
        recursion = _Gain(model, [[Fraction(1)]], claim.recursion_gain)
        yield recursion.claim(f"recursion_gain_{index}", f"{where}: gain of its recursion", close=True)
        if recursion.endless is not None:
            raise recursion.endless
        made = {
            place: _Gain(model, _from_inputs(section, model, output), claim.peak_gain)
            for place, output in enumerate(section.outputs)
            if not passes_by(section, output)
        }
        largest = max((gain.proven for gain in made.values()), default=Fraction(0))
        for place, gain in made.items():
            words = f"{where}: gain from its inputs to output {place}"
            yield gain.claim(f"peak_gain_{index}_{place}", words, close=gain.proven == largest)


def _from_inputs(section: StageEntry, model: LinearStage, output: int) -> list[list[Fraction]]:
    return [
        _in_values(section, model, output, source)
        for source, node in enumerate(section.nodes)
        if node.op is Operation.INPUT
    ]


def passes_by(section: StageEntry, output: int) -> bool:
    """Whether an output of a section is an input, which passes beside what the section computes."""
    return section.nodes[output].op is Operation.INPUT


def _in_values(section: StageEntry, model: LinearStage, node: int, source: int) -> list[Fraction]:
    """Numerator between values instead of codes."""
    unit = Fraction(2) ** (section.nodes[source].frac - section.nodes[node].frac)
    return [value * unit for value in model.numerator(node, ("node", source, 0))]


def _response(bits: int, tail: Sequence[int], one: int) -> tuple[Response, RejectedError | None]:
    try:
        return impulse(bits, tail, one), None
    except RejectedError as error:
        return begun(bits, tail, one), error


class _Gain:
    """A gain, and the shortest response that proves it, or that with the highest precision.

    Attributes
    ----------
    proven : Fraction
        What the response proves.
    endless : RejectedError or None
        Why there is no such response, but only the first samples of one.
    """

    def __init__(self, model: LinearStage, over: Sequence[Sequence[Fraction]], claimed: Fraction) -> None:
        scale = common_denominator([model.denominator, *over])
        self._under, self._over = integers(model.denominator, scale), [integers(one, scale) for one in over]
        self._claimed = claimed
        exponent, tail = split(self._under)
        for bits in _BITS:
            made, self.endless = _response(exponent, tail, 1 << bits)
            response = fmpz_poly(made.values)
            total = sum(sum(abs(int(value)) for value in (fmpz_poly(one) * response).coeffs()) for one in self._over)
            left = (1 << bits + exponent) - made.rest
            self.proven = Fraction(total, left) if left > 0 else Fraction(-1)
            self._witness = f"Witness {made.samples} {exponent} {numbers(tail)} 1 1 (2 ^ {bits})"
            if 0 <= self.proven <= claimed or self.endless is not None:
                break

    def claim(self, name: str, words: str, *, close: bool) -> Claim:
        """Write the theorem; if `close`, one that is refused as well if it claims more than follows."""
        statement = f"{numbers(self._under)} {rows(self._over)} {number(self._claimed.numerator)}"
        text = f"""\
Theorem {name} : gain_at_most {statement} {self._claimed.denominator}.
Proof.
  apply ({"claimed_gain" if close else "gain"} _ _ ({self._witness})).
  vm_cast_no_check (eq_refl true).
Qed.
"""
        return Claim(name, f"{words} at most {float(self._claimed):.9g}", text)
