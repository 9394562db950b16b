"""Numbers of a manifest: only a finite number that is near enough is the exact one."""

from fractions import Fraction
from math import inf, nan

import pytest

from sosmith.verify.verdict.figures import Figure


@pytest.mark.parametrize("stated", [1, 1.0, 0.5, 1.75, 1 + 2**-46])
def test_what_is_near_enough_holds(stated: float) -> None:
    assert Figure(Fraction(1), below=Fraction(1, 2), above=Fraction(3, 4)).holds(stated)


@pytest.mark.parametrize("stated", [0.4999, 1.7501, inf, -inf, nan, True, "1", None])
def test_what_is_not_does_not(stated: object) -> None:
    assert not Figure(Fraction(1), below=Fraction(1, 2), above=Fraction(3, 4)).holds(stated)
