"""What the measurements of each day say about the sensor's deviations, once the day's systematic error is eliminated.

For a day with the columns A of the deviations, the columns H of the systematic curves, the residuals r from the type
curve, and a ratio ``rho = systematic**2 / scatter**2``, the covariance of the measurements is ``scatter**2 C`` with
``C = I + rho H H'``. By the matrix inversion lemma, all that is needed of C are sums over the day's measurements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from decimal import Decimal

import numpy as np
import numpy.typing as npt

from sosmith.model.arithmetic.stacked_matrices import (
    applied,
    cholesky,
    dot,
    identity,
    product,
    solved,
    solved_transposed,
    transposed,
)
from sosmith.model.arrays import Values


@dataclass(frozen=True, eq=False)
class DaySums:
    """Sums of products over the measurements of each day; the last axis is the day.

    Attributes
    ----------
    aa, ar, rr : ndarray, shapes (5, 5, days), (5, days), (days,)
        Deviations with deviations, with residuals, and residuals with residuals.
    ha, hr, hh : ndarray, shapes (m, 5, days), (m, days), (m, m, days)
        Systematic curves with deviations, with residuals, and with systematic curves.
    count : ndarray, shape (days,)
        Number of measurements.
    known : DaySums or None
        Sums over the measurements whose variance is known, each divided by it; these are in no other sum. None if there
        are none.
    """

    aa: Values
    ar: Values
    rr: Values
    ha: Values
    hr: Values
    hh: Values
    count: Values
    known: DaySums | None = None

    @classmethod
    def of(cls, a: Values, h: Values, r: Values, weights: Values, day: npt.NDArray[np.int64], days: int) -> DaySums:
        """Sum over measurements: a of shape (5, n), h (m, n), r, weights and the index of the day (n,)."""
        columns = np.concatenate((a, r[None], h, np.ones((1, len(r)))))
        size, k = len(columns), len(a)
        sums = np.zeros((size, size, days))
        for i in range(size):
            weighted = columns[i] * weights
            for j in range(i + 1):
                sums[i, j] = sums[j, i] = np.bincount(day, weights=weighted * columns[j], minlength=days)
        last = size - 1
        return cls(
            aa=sums[:k, :k],
            ar=sums[:k, k],
            rr=sums[k, k],
            ha=sums[k + 1 : last, :k],
            hr=sums[k + 1 : last, k],
            hh=sums[k + 1 : last, k + 1 : last],
            count=sums[last, last],
        )

    def times(self, name: str, squared: Values) -> Values:
        """Return a sum over all measurements, times the squared scatter for each in `squared`, the last axis."""
        own: Values = getattr(self, name)[..., None]
        return own if self.known is None else own + getattr(self.known, name)[..., None] * squared

    def information(self, rho: Values, squared: Values) -> Information:
        """Eliminate the systematic error for each ratio in `rho`, shape (ratios,), 0 or more.

        `squared`, of the same shape, are the squared scatters in mm**2 to go with them; without measurements of known
        variance they do not matter.
        """
        j, h, q, mantissa, exponent = self._by_days(_eliminated, rho, squared)
        return Information(j=j, h=h, q=q, root=Scaled(mantissa, exponent))

    def _by_days(self, of: _OfDays, rho: Values, squared: Values) -> tuple[Values, ...]:
        """Return what `of` makes of the days; for those without known variances, once for each ratio alone."""
        if self.known is None:
            return of(self, rho, squared)
        also = np.flatnonzero(self.known.count > 0)
        rest = np.flatnonzero(self.known.count == 0)
        if not len(rest):
            return of(self, rho, squared)
        ratios, at = np.unique(rho, return_inverse=True)
        plain = of(replace(self.at_days(rest), known=None), ratios, np.ones(len(ratios)))
        found = []
        for one, own in zip(plain, of(self.at_days(also), rho, squared), strict=True):
            every = np.empty((*one.shape[:-2], len(self.rr), len(rho)))
            every[..., rest, :], every[..., also, :] = one[..., at], own
            found.append(every)
        return tuple(found)

    def fisher(self, rho: Values, squared: Values) -> Values:
        """Return how much the measurements can tell of both standard deviations, for each ratio; shape (ratios,).

        `squared` as in `information`. Measurements of known variance tell of the systematic error only.

        It is the determinant of Fisher's information about their logarithms, the deviations being known, divided by 4.
        With the eigenvalues w of ``rho H H' / C``, from 0 for what is all scatter to 1 for what is all systematic, the
        information is ``2 sum w**2`` of the systematic error, ``2 sum (1 - w)**2`` of the scatter, and
        ``2 sum w (1 - w)`` of both, summed over the measurements. 0 without a systematic error.
        """
        if self.known is not None:
            return self._fisher_with_known(rho, squared)
        lower = cholesky(identity(len(self.hh), (len(self.rr), len(rho))) + self.hh[..., None] * rho)
        shares = solved(lower, transposed(solved(lower, self.hh[..., None] * rho)))
        of_day, squared = np.zeros(shares.shape[2:]), np.zeros(shares.shape[2:])
        for k in range(len(shares)):
            of_day = of_day + shares[k, k]
            squared = squared + dot(shares[k], shares[k])
        first, second, count = np.zeros(len(rho)), np.zeros(len(rho)), 0.0
        for day in range(len(self.rr)):
            first, second, count = first + of_day[day], second + squared[day], count + float(self.count[day])
        return np.asarray(second * (count - 2.0 * first + second) - (first - second) ** 2)

    def _fisher_with_known(self, rho: Values, squared: Values) -> Values:
        """Return the same where some variances are known: with G the inverse of ``I + rho H' W H``, W being weights.

        The eigenvalues of the systematic error's share are those of ``rho H' W H G``; of those measurements that
        scatter, ``rho H' H G``. ``rho tr(G' H' H G)`` couples both.
        """
        trace = self._by_days(_traces, rho, squared)
        first, second, of_day, both = (np.zeros(len(rho)) for _ in range(4))
        count = 0.0
        for day in range(len(self.rr)):
            first, second = first + trace[0][day], second + trace[1][day]
            of_day, both = of_day + trace[2][day], both + trace[3][day]
            count += float(self.count[day])
        return np.asarray(of_day * (count - 2.0 * first + second) - both**2)

    def only(self, day: int) -> DaySums:
        """Return the sums of one day, with an axis of length 1 for the day."""
        return self.at_days(np.array([day]))

    def at_days(self, some: npt.NDArray[np.int64]) -> DaySums:
        """Return the sums of some days."""
        own = {field.name: getattr(self, field.name)[..., some] for field in fields(self) if field.name != "known"}
        return DaySums(**own, known=None if self.known is None else self.known.at_days(some))

    def day_curves(self, rho: Values, squared: Values) -> tuple[Values, Values, Values]:
        """Return what the weights w of each day's systematic curves are, given the deviations z.

        For each ratio: ``w = offset - slope z`` on average, and L with the covariance ``scatter**2 rho L' L``.
        Shapes (m, days, ratios), (m, 5, days, ratios) and (m, m, days, ratios).
        """
        m, stack = len(self.hh), (len(self.rr), len(rho))
        lower = cholesky(identity(m, stack) + self.times("hh", squared) * rho)

        def divided(b: Values) -> Values:
            return rho * solved_transposed(lower, solved(lower, b))

        of_r, of_a = divided(self.times("hr", squared)[:, None])[:, 0], divided(self.times("ha", squared))
        return of_r, of_a, solved(lower, identity(m, stack))


_OfDays = Callable[[DaySums, Values, Values], tuple[Values, ...]]
"""Arrays whose last axes are the day and the ratio, of sums, ratios and squared scatters."""


def _eliminated(sums: DaySums, rho: Values, squared: Values) -> tuple[Values, ...]:
    """Return j, h, q of `Information`, with mantissa and exponent of its root."""
    m = len(sums.hh)
    lower = cholesky(identity(m, (len(sums.rr), len(rho))) + sums.times("hh", squared) * rho)
    of_a, of_r = solved(lower, sums.times("ha", squared)), solved(lower, sums.times("hr", squared)[:, None])
    mantissa, exponent = np.ones(lower.shape[2:]), np.zeros(lower.shape[2:])
    for k in range(m):
        mantissa, more = np.frexp(mantissa * lower[k, k])
        exponent = exponent + more
    j = sums.times("aa", squared) - rho * product(transposed(of_a), of_a)
    h = sums.times("ar", squared) - rho * applied(transposed(of_a), of_r[:, 0])
    q = sums.times("rr", squared) - rho * dot(of_r[:, 0], of_r[:, 0])
    return j, h, q, mantissa, exponent


def _traces(sums: DaySums, rho: Values, squared: Values) -> tuple[Values, ...]:
    """Return the traces that Fisher's information is made of: of measurements that scatter, their squares, and both."""
    m = len(sums.hh)
    stack = (len(sums.rr), len(rho))
    every = sums.times("hh", squared) * rho
    lower = cholesky(identity(m, stack) + every)
    inverse = solved_transposed(lower, solved(lower, identity(m, stack)))
    systematic = product(every, inverse)
    own = product(sums.hh[..., None] * rho, inverse)
    coupled = product(transposed(inverse), own)
    trace = [np.zeros(stack) for _ in range(4)]
    for k in range(m):
        trace[0] = trace[0] + own[k, k]
        trace[1] = trace[1] + dot(own[k], own[:, k])
        trace[2] = trace[2] + dot(systematic[k], systematic[:, k])
        trace[3] = trace[3] + coupled[k, k]
    return tuple(trace)


@dataclass(frozen=True, eq=False)
class Scaled:
    """Positive products as ``mantissa * 2**exponent``, which neither overflow nor need a logarithm on the way."""

    mantissa: Values
    exponent: Values

    def times(self, other: Values) -> Scaled:
        """Multiply by positive numbers."""
        mantissa, more = np.frexp(self.mantissa * other)
        return Scaled(mantissa, self.exponent + more)

    def logarithm(self) -> list[Decimal]:
        """Return natural logarithms, correctly rounded by the decimal module; in the order of the flattened arrays."""
        two = Decimal(2).ln()
        return [
            Decimal(mantissa).ln() + int(exponent) * two
            for mantissa, exponent in zip(self.mantissa.ravel().tolist(), self.exponent.ravel().tolist(), strict=True)
        ]


@dataclass(frozen=True, eq=False)
class Information:
    """About the deviations z of each day, times the squared scatter; the last axes are the day and the ratio.

    The likelihood of a day is ``exp(-(q - 2 h'z + z'J z) / (2 scatter**2)) / (scatter**count root)``, up to a factor.
    """

    j: Values
    h: Values
    q: Values
    root: Scaled
