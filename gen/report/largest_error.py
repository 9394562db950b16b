"""The largest error of a run: the samples around it, and the limits that are shown beside it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sosmith.gen.report.evidence import Evidence
from sosmith.model.reference.accuracy import error_statistics, peak


def close_up(evidence: Evidence, samples: int = 60) -> slice:
    """At most `samples` samples around the first of those with the largest error."""
    count = len(evidence.run)
    start = error_statistics(evidence.run.error).worst - samples // 2
    start = min(max(start, 0), max(count - samples, 0))
    return slice(start, min(start + samples, count))


class Limit(NamedTuple):
    """Limit of the error, in the output's unit, and how it is drawn."""

    value: float
    role: str
    dashes: str
    words: str


def error_limits(evidence: Evidence) -> tuple[list[Limit], list[Limit]]:
    """Split the limits of the error into those to draw and those too far outside.

    A limit beyond six times the largest error would squeeze the curve to a line.
    """
    limits = [Limit(evidence.facts.error_bound, "limit", "--", "limit")]
    if not np.isclose(evidence.facts.max_error, evidence.facts.error_bound, rtol=1e-3):
        limits.append(Limit(evidence.facts.max_error, "asked", ":", "allowed by the specification"))
    reach = 6 * error_peak(evidence)
    return [limit for limit in limits if limit.value <= reach], [limit for limit in limits if limit.value > reach]


def error_peak(evidence: Evidence) -> float:
    """Largest error, at least half a step of the output, so that no axis is empty."""
    return max(peak(evidence.run.error), evidence.facts.lsb / 2)
