"""An uncertainty budget in the terms of the GUM (JCGM 100:2008): contributions, combined and expanded uncertainty.

Each source has a standard uncertainty, the kind of distribution that it was derived from, and a sensitivity: what the
result changes by per unit of the source. Contributions are independent of each other, and combine by their squares;
degrees of freedom by the formula of Welch and Satterthwaite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy import special

from sosmith.model.arrays import Values

Kind = Literal["normal", "t", "rectangular", "arcsine"]
"""Distribution: t is a normal one whose standard deviation was estimated, arcsine that of a sine at a random moment."""

SHARE = 0.95
"""Coverage probability of the expanded uncertainty."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Contribution:
    """One source of uncertainty at n points.

    Attributes
    ----------
    source : str
        Its name.
    kind : str
        Its distribution.
    uncertainty : ndarray, shape (n,)
        Standard uncertainty in `unit`.
    unit : str
        Unit of the source.
    sensitivity : ndarray, shape (n,)
        Change of the result per `unit`.
    freedom : float
        Degrees of freedom; infinite if the uncertainty is known and not estimated.
    """

    source: str
    kind: Kind
    uncertainty: Values
    unit: str
    sensitivity: Values
    freedom: float = math.inf

    @cached_property
    def contribution(self) -> Values:
        """Standard uncertainty of the result from this source, shape (n,)."""
        return np.asarray(np.abs(self.sensitivity) * self.uncertainty)


@dataclass(frozen=True, eq=False)
class Budget:
    """All contributions at n points.

    Examples
    --------
    >>> import numpy as np
    >>> one = np.ones(1)
    >>> budget = Budget((
    ...     Contribution(source="a", kind="t", uncertainty=3.0 * one, unit="um", sensitivity=one, freedom=9.0),
    ...     Contribution(source="b", kind="rectangular", uncertainty=4.0 * one, unit="um", sensitivity=one),
    ... ))
    >>> budget.combined.item(), round(budget.freedom.item(), 1), round(budget.expanded.item(), 2)
    (5.0, 69.4, 9.97)
    """

    contributions: tuple[Contribution, ...]

    @cached_property
    def combined(self) -> Values:
        """Combined standard uncertainty, shape (n,)."""
        return np.asarray(np.sqrt(sum(one.contribution**2 for one in self.contributions)))

    @cached_property
    def freedom(self) -> Values:
        """Effective degrees of freedom by Welch and Satterthwaite, shape (n,); infinite without an estimated source."""
        spread = sum(
            (one.contribution**4 / one.freedom for one in self.contributions if one.freedom < math.inf),
            np.zeros_like(self.combined),
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(spread > 0, self.combined**4 / spread, math.inf)

    @cached_property
    def factor(self) -> Values:
        """Coverage factor k for `SHARE`: the quantile of Student's t, or of the normal distribution; shape (n,)."""
        return np.asarray(special.stdtrit(self.freedom, (1 + SHARE) / 2))

    @cached_property
    def expanded(self) -> Values:
        """Expanded uncertainty: the half-width of the interval that holds the true value with `SHARE`; shape (n,)."""
        return np.asarray(self.factor * self.combined)


def of_limits(half_width: float) -> float:
    """Return the standard uncertainty of an error that may be anywhere within these limits."""
    return half_width / math.sqrt(3.0)
