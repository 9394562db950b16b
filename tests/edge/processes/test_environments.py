"""Commands in hostile environments, a few in every run; `python -m benchmarks.edge` counts two hundred."""

from __future__ import annotations

import pytest

from tests.edge.processes.environments import HARMFUL, HARMLESS, tried

FAST = range(12)


def test_environments() -> None:
    found = [tried(seed) for seed in FAST]
    assert [one for each in found for one in each.findings] == []
    assert {change for each in found for change in each.changes} > {*HARMLESS[:3]} & {*HARMFUL[:1]}


@pytest.mark.slow
def test_more_environments() -> None:
    assert [one for seed in range(12, 100) for one in tried(seed).findings] == []
