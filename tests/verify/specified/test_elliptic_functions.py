"""Elliptic functions in balls, against scipy and closed forms."""

import re

import pytest
from flint import arb, ctx
from scipy import special

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.specified.elliptic_functions import Modulus, inverse_sn, sn

FRACTIONS = [0.0625 * k for k in range(17)]


def modulus(k: arb) -> Modulus:
    return Modulus(k, ((1 - k) * (1 + k)).sqrt())


@pytest.mark.parametrize("k", [0.001, 0.1, 0.5, 0.9, 0.999])
def test_sn_is_scipys(k: float) -> None:
    quarter = special.ellipk(k**2)
    for u in FRACTIONS:
        with ctx.workprec(200):
            ours = float(sn(arb(u), modulus(arb(k))).mid())
        assert ours == pytest.approx(special.ellipj(u * quarter, k**2)[0], abs=1e-12)


@pytest.mark.parametrize("complement", [1e-30, 1e-13, 0.01, 0.5, 0.99])
def test_half_a_quarter_period_is_enclosed_tightly(complement: float) -> None:
    """Closed form: ``sn(K / 2) = 1 / sqrt(1 + k')``."""
    with ctx.workprec(600):
        small = arb(complement)
        value = sn(arb(0.5), modulus(small).turned)
        expected = (1 + small).rsqrt()
        assert value.overlaps(expected)
        assert value.rel_accuracy_bits() > 500
        assert inverse_sn(expected, modulus(small).turned).overlaps(arb(0.5))


@pytest.mark.parametrize("k", [0.001, 0.5, 0.999])
def test_the_inverse_leads_back(k: float) -> None:
    with ctx.workprec(300):
        for u in FRACTIONS[1:-1]:
            back = inverse_sn(sn(arb(u), modulus(arb(k))), modulus(arb(k)))
            assert back.overlaps(arb(u))
            assert back.rel_accuracy_bits() > 200


def test_the_error_of_the_last_step_is_in_the_ball() -> None:
    """The modulus is the last one at 20 bits, but just so; at 0 the sine and its inverse are not rounded."""
    k = arb(2.0**-10.25)
    with ctx.workprec(400):
        exact = modulus(k)
        wanted = sn(arb(0.3), exact)
    with ctx.workprec(20):
        for value in (sn(arb(0), exact), inverse_sn(arb(0), exact)):
            assert value.rad() > k * k
        assert sn(arb(0.3), exact).contains(wanted)


def test_a_modulus_that_is_not_known_is_refused() -> None:
    sentence = "the modulus of an elliptic function could not be enclosed"
    with pytest.raises(UndecidedError, match=f"^{re.escape(sentence)}$"):
        sn(arb(0.5), Modulus(arb.nan(), arb(1)))
