"""Counts of samples and results in a chain of which stages interpolate, decimate, or do neither.

A stage that interpolates by L makes results ``m L .. m L + L - 1`` of sample m; one that decimates by M makes result m
of sample ``m M``. So n samples have ``n L`` results, or n / M rounded up, and result j comes with sample j / L rounded
down, or ``j M``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class Rate(NamedTuple):
    """By how much a stage interpolates and decimates; one of both is 1."""

    rise: int
    factor: int


def results_of(rates: Sequence[Rate], samples: int) -> int:
    """Count the results of so many samples of a channel.

    Examples
    --------
    >>> results_of([Rate(3, 1), Rate(1, 2)], 3)
    5
    """
    for rate in rates:
        samples = -(-samples * rate.rise // rate.factor)
    return samples


def samples_of(rates: Sequence[Rate], results: int) -> npt.NDArray[np.int64]:
    """Return, for the first results, the number of the sample with which each comes.

    Examples
    --------
    >>> samples_of([Rate(3, 1), Rate(1, 2)], 5).tolist()
    [0, 0, 1, 2, 2]
    """
    numbers = np.arange(results)
    for rate in reversed(rates):
        numbers = numbers * rate.factor // rate.rise
    return numbers


def gathered(flags: npt.NDArray[np.uint8], rates: Sequence[Rate]) -> npt.NDArray[np.uint8]:
    """Return, for each result, the bits set in any sample since the one of the last result that came with another.

    Parameters
    ----------
    flags : array of uint8, shape (samples,)
    rates : sequence of Rate

    Examples
    --------
    >>> gathered(np.array([1, 0, 2, 0, 0], dtype=np.uint8), [Rate(1, 3), Rate(2, 1)]).tolist()
    [1, 1, 2, 2]
    """
    if not len(flags):
        return flags
    last = samples_of(rates, results_of(rates, len(flags)))
    ends, which = np.unique(last, return_inverse=True)
    starts = np.concatenate([[0], ends[:-1] + 1])
    of_ends: npt.NDArray[np.uint8] = np.bitwise_or.reduceat(flags[: ends[-1] + 1], starts)
    return of_ends[which]


@dataclass(frozen=True)
class Pattern:
    """Which samples bring results: of every `factor` samples one is followed, with its zeros, or the other way round.

    Attributes
    ----------
    rise, factor : int
        By how much the rate goes up, and down.
    rises_last : bool
        Whether a sample that brings results brings `rise` of them; if not, zeros are put in before results are left
        out, and it brings `rise` / `factor`, rounded down or up.
    """

    rise: int
    factor: int
    rises_last: bool

    @property
    def least(self) -> int:
        """Results that every sample brings, or, with `rises_last`, one that brings any has."""
        return self.rise if self.rises_last else self.rise // self.factor

    @property
    def extra(self) -> int:
        """Of `factor` samples, how many bring one result more than the others, or, with `rises_last`, any."""
        return 1 if self.rises_last else self.rise % self.factor

    def entries(self, results: int) -> tuple[int, int]:
        """Return the number of samples that bring the first results, at least so many, and how many these are."""
        if self.rises_last:
            entries = -(-results // self.rise)
            return entries, entries * self.rise
        if not self.least:
            return results, results
        entries = results * self.factor // self.rise
        while -(-entries * self.rise // self.factor) < results:
            entries += 1
        return entries, -(-entries * self.rise // self.factor)


def pattern_of(rates: Sequence[Rate]) -> Pattern:
    """Return the pattern of rates that turn once at most."""
    rise, factor, first = 1, 1, None
    for rate in rates:
        rise, factor = rise * rate.rise, factor * rate.factor
        if first is None and rate != (1, 1):
            first = rate
    return Pattern(rise, factor, rises_last=rise > 1 and (first is None or first.rise == 1))
