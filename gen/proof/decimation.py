"""Samples of a response at even distances, without those between them.

The response ``h = 1/D`` holds ``h[n - i]`` as sample n of ``z**i / D``. Of any fraction, every other sample follows
without the rest, because its numerator and denominator can be multiplied by the mirrored denominator ``D(-z)``, which
makes the denominator even::

    P(z) / D(z) = P(z) D(-z) / (D(z) D(-z)),    D(z) D(-z) = E(z**2)

The even powers of ``P(z) D(-z)`` over E are the even samples (A. Bostan and R. Mori, "A simple and fast algorithm for
computing the N-th term of a linearly recurrent sequence", 2021; E is a step of Graeffe's iteration). Every step doubles
the distance. All of it is computed in balls, which enclose the exact samples. A step makes them wider by a factor of no
more than about ``2**(d + 1)``, as no sum of the magnitudes of a denominator's coefficients exceeds ``2**d``.
"""

from __future__ import annotations

from flint import arb, arb_poly, fmpq_poly


def decimated(denominator: fmpq_poly, doublings: int, count: int, width: int) -> list[list[arb]]:
    """Enclose samples ``h[n S - i]`` of ``1/denominator`` for ``S = 2**doublings``, at the present precision of FLINT.

    Parameters
    ----------
    denominator : fmpq_poly
        With the constant term 1.
    doublings : int
        Logarithm of the distance S.
    count, width : int
        The samples are those with n from 0 to ``count - 1``, and i from 0 to ``width - 1``.

    Returns
    -------
    list of list of arb, shape (count, width)
        Sample ``n S - i`` at ``[n][i]``; 0 before the beginning.

    Examples
    --------
    >>> [[float(value) for value in row] for row in decimated(fmpq_poly([1, -2]), 2, 3, 2)]
    [[1.0, 0.0], [16.0, 8.0], [256.0, 128.0]]
    """
    under = arb_poly(denominator)
    overs = [arb_poly([0] * i + [1]) for i in range(width)]
    for _ in range(doublings):
        mirrored = arb_poly([-c if k % 2 else c for k, c in enumerate(under.coeffs())])
        overs = [arb_poly((over * mirrored).coeffs()[::2]) for over in overs]
        under = arb_poly((under * mirrored).coeffs()[::2])
    inverse = _inverse(under, count)
    columns = [(over * inverse).coeffs()[:count] for over in overs]
    return [[column[n] if n < len(column) else arb(0) for column in columns] for n in range(count)]


def _inverse(series: arb_poly, count: int) -> arb_poly:
    """Return at least `count` terms of 1/series, whose constant term is 1, by Newton's iteration."""
    inverse, known = arb_poly([1]), 1
    while known < count:
        known *= 2
        inverse = (inverse * (2 - series * inverse)).truncate(known)
    return inverse
