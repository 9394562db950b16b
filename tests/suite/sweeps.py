"""Sweeps: which cases of one stand for all in the fast part of the tests."""

from collections.abc import Sequence
from itertools import combinations


def covering(cases: Sequence[dict[str, int]], most: int | None = None) -> set[int]:
    """Choose cases of a sweep that show every value of every parameter first, then every pair of values.

    Parameters
    ----------
    cases : sequence of dict of str to int
        For each case, the index of the value that each parameter has.
    most : int, optional
        How many to choose at most; by default as many as show every pair.

    Returns
    -------
    set of int
        Numbers of the chosen cases, from 0 on; of those that show as much, the first.
    """
    values = [set(case.items()) for case in cases]
    pairs = [set(combinations(sorted(case.items()), 2)) for case in cases]
    chosen: set[int] = set()
    while len(chosen) < (len(cases) if most is None else min(most, len(cases))):
        seen = set().union(*(values[k] for k in chosen)), set().union(*(pairs[k] for k in chosen))
        left = [k for k in range(len(cases)) if k not in chosen]
        best = max(left, key=lambda k: (len(values[k] - seen[0]), len(pairs[k] - seen[1]), -k))
        if most is None and not pairs[best] - seen[1] and not values[best] - seen[0]:
            break
        chosen.add(best)
    return chosen
