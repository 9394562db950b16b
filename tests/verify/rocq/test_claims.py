"""Theorems on the gains of sections: accepted to the last unit of the grid, and refused with one unit less."""

import re
from fractions import Fraction
from pathlib import Path

import pytest
from tests.verify.rocq.small import GRID, checked, needs_coqc, small, with_gain

from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.verify.graph import RejectedError, Transfer
from sosmith.verify.rocq.claims import Claim, gain_claims
from sosmith.verify.rocq.kernel import STANDARD
from sosmith.verify.rocq.linear import LinearStage


def refusal(claim: Claim) -> str:
    return f"^Rocq must accept {re.escape(f'{claim.name} ({claim.words})')}, and says: .*$"


@needs_coqc
@pytest.mark.slow
def test_claims_are_accepted_and_one_unit_less_is_refused(tmp_path: Path) -> None:
    """To the last unit of the grid, in both directions: what claims more than is proven is refused as well."""
    made = small()
    claimed = made.claims.sections[1].recursion_gain
    accepted = list(gain_claims(made))[:2]
    for other in (claimed - GRID, claimed + GRID):
        refused = list(gain_claims(with_gain(made, 1, recursion_gain=other)))[2]
        assert refused.name == "recursion_gain_1"
        with pytest.raises(RejectedError, match=refusal(refused)):
            checked(made, tmp_path, [*accepted, refused])


def too_low(claimed: Fraction) -> Fraction:
    """Return one unit of the grid less; two where one less is the gain itself, which is a number of few bits."""
    return claimed - (2 * GRID if (claimed - GRID).denominator < 1 << 56 else GRID)


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_every_claim_of_every_realization(realization: str, tmp_path: Path) -> None:
    made = small(realization)
    claims = list(gain_claims(made))
    assert checked(made, tmp_path, claims) <= STANDARD
    for index, entry in enumerate(made.claims.sections):
        less = with_gain(made, index, recursion_gain=too_low(entry.recursion_gain), peak_gain=too_low(entry.peak_gain))
        name = f"recursion_gain_{index}"
        refused = next(claim for claim in gain_claims(less) if claim.name == name)
        with pytest.raises(RejectedError, match=refusal(refused)):
            checked(made, tmp_path, [refused])
        peaks = [claim for claim in gain_claims(less) if claim.name.startswith(f"peak_gain_{index}")]
        with pytest.raises(RejectedError, match=r"^Rocq must accept peak_gain_"):
            checked(made, tmp_path, peaks)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_the_linear_model_is_that_of_the_verifier(realization: str) -> None:
    """Two ways to the same polynomials: recursion of Faddeev and LeVerrier here, determinants there."""
    for stage in small(realization).stages:
        if stage.role == "section":
            here, there = LinearStage(stage), Transfer(stage)
            assert [str(value) for value in here.denominator] == [str(value) for value in there.denominator.coeffs()]
            for source in there.inputs:
                for output in stage.outputs:
                    unit = Fraction(2) ** (stage.nodes[source[1]].frac - stage.nodes[output].frac)
                    made = [value * unit for value in here.numerator(output, ("node", source[1], 0))]
                    assert [str(value) for value in made] == [str(x) for x in there.numerator(source, output).coeffs()]


def test_gains_of_other_sections_are_refused() -> None:
    made = small()
    fewer = made.model_copy(update={"claims": made.claims.model_copy(update={"sections": ()})})
    with pytest.raises(RejectedError, match=r"^gains must be given of section0, section1, not nothing$"):
        list(gain_claims(fewer))
