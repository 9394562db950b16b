"""What a likelihood ratio tells of a wheel over days, as a measure for the state of wear: `python -m benchmarks.days`.

A test that knows neither what happens nor when: each day, the readings so far are held against a straight line, and
against one with a step or a change of its slope on any of the last days, by least squares. The largest of these
differences, in standard deviations, is an alarm beyond a threshold, which is set for the allowed rate of false alarms.
"""

from __future__ import annotations

import numpy as np
from benchmarks.day_alarms import ALLOWED, FAULT_DAY, FAULT_DAYS, KINDS, QUIET_DAYS

from sosmith.model.arrays import Values

BACK = 14
"""Days back from today on which a change may have begun."""

LEAST = 15
"""Days before the first alarm: a line has to be known."""

RECORDS, FAULTS = 400, 1000
"""Records by which the threshold is set, and those of each kind that are to be told."""

APART = 28
"""Days after an alarm in which there is no other one."""


def likelihood_ratio(error: float, first: int) -> list[float]:
    """Return the shares of `KINDS` that are told in time by one wheel, for an error of a day in mm."""
    directions = [_directions(day) for day in range(LEAST, QUIET_DAYS)]
    quiet = _largest(np.random.default_rng([first, 4]).normal(size=(RECORDS, QUIET_DAYS)), directions)
    threshold = _threshold(quiet)
    days = np.arange(FAULT_DAY + FAULT_DAYS + 1)
    found = []
    for number, kind in enumerate(KINDS):
        noise = np.random.default_rng([first, 5, number]).normal(size=(FAULTS, len(days)))
        read = noise + kind.reading(days.astype(np.float64)) / error
        largest = _largest(read, directions[: len(days) - LEAST])[:, FAULT_DAY - LEAST :]
        found.append(float(np.mean(largest.max(axis=1) >= threshold)))
    return found


def _directions(day: int) -> Values:
    """Return unit vectors of steps and changes of slope, without what a line explains; shape (n, day + 1)."""
    at = np.arange(day + 1.0)
    line, _ = np.linalg.qr(np.array([np.ones(day + 1), at]).T)
    found = []
    for begin in range(max(day - BACK + 1, 3), day + 1):
        for change in (np.where(at >= begin, 1.0, 0.0), np.maximum(at - begin, 0.0)):
            if change.any():
                left = change - line @ (line.T @ change)
                found.append(left / np.linalg.norm(left))
    return np.array(found)


def _largest(read: Values, directions: list[Values]) -> Values:
    """Return the largest difference on each day from `LEAST` on; shape (records, days)."""
    each = [np.abs(read[:, : one.shape[1]] @ one.T).max(axis=1) for one in directions]
    return np.array(each).T


def _threshold(quiet: Values) -> float:
    """Return the lowest threshold, in steps of 0.02, with at most `ALLOWED` alarms a day."""
    threshold = 3.0
    while sum(_alarms(one, threshold) for one in quiet) > ALLOWED * quiet.size:
        threshold += 0.02
    return threshold


def _alarms(largest: Values, threshold: float) -> int:
    count, last = 0, -APART
    for day in np.flatnonzero(largest >= threshold).tolist():
        if day - last >= APART:
            count, last = count + 1, day
    return count
