"""How designs are handed to the workers of a cluster."""

from __future__ import annotations

from typing import Any

import pytest

from sosmith.sim.exploration.cluster import groups_of

TASKS: list[Any] = [*range(1_000)]


@pytest.mark.parametrize("threads", [0, 1, 2, 7, 64])
@pytest.mark.parametrize("count", [0, 1, 5, 40, 1_000])
def test_every_design_is_in_one_group(threads: int, count: int) -> None:
    groups = groups_of(TASKS[:count], threads)
    assert [task for group in groups for task in group] == TASKS[:count]
    assert all(1 <= len(group) <= 16 for group in groups)


def test_groups_become_smaller_towards_the_end() -> None:
    sizes = [len(group) for group in groups_of(TASKS, 4)]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] == 16
    assert sizes[-16:] == [1] * 16  # four for each thread
    assert len(sizes) < len(TASKS) / 7


def test_few_designs_are_tasks_of_their_own() -> None:
    assert [len(group) for group in groups_of(TASKS[:8], 2)] == [1] * 8
