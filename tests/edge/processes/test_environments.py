"""Commands in hostile environments, a few in every run; `python -m benchmarks.edge` counts two hundred."""

from __future__ import annotations

import pytest

from tests.edge.processes.environments import COMMANDS, HARMFUL, tried

QUICK = ("init", "list", "stream", "help", "combinations")


@pytest.mark.slow
def test_environments_of_quick_commands() -> None:
    found = [tried(seed, QUICK) for seed in range(30)]
    assert [one for each in found for one in each.findings] == []
    assert {change for each in found for change in each.changes} > {*HARMFUL}


@pytest.mark.slow
def test_environments_of_all_commands() -> None:
    assert [one for seed in range(30, 30 + 6 * len(COMMANDS)) for one in tried(seed).findings] == []
