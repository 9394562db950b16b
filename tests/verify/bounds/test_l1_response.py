"""Approximate inverses: what is none is not taken, and how long one is, which its proof does not depend on."""

import pytest
from flint import fmpq, fmpq_poly

from sosmith.verify.bounds import l1_response
from sosmith.verify.bounds.l1_response import UndecidedError, inverse


@pytest.mark.parametrize("first", [0, 1, 2, 3])
def test_what_is_no_inverse_is_not_taken(first: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of ``1 - w / 2``, with one sample: the residuals of 0, 1, 2 and 3 are 1, 1/2, 2 and 7/2."""
    monkeypatch.setattr(l1_response, "_divided", lambda numerators, shift, bits, longest: [first << bits])
    with pytest.raises(UndecidedError, match=r"^the inverse of a denominator could not be enclosed$"):
        inverse(fmpq_poly([1, fmpq(-1, 2)]))


@pytest.mark.parametrize(("decay", "goes_on"), [(139.85, False), (139.5, True)])
def test_an_inverse_ends_with_the_block_at_which_the_rest_is_small_enough(decay: float, goes_on: bool) -> None:
    """One pole falls by ``2**-decay`` in a block of 256; that times the sum so far, ``2**1.66``, is for ``2**-138``."""
    pole = fmpq(round(2 ** (60 - decay / 256)), 1 << 60)
    count = inverse(fmpq_poly([1, -pole])).samples.degree() + 1
    assert count > 257 if goes_on else count == 257
