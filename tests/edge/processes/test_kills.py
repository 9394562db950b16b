"""Kills of everything that writes, a few in every run; `python -m benchmarks.edge` counts a thousand."""

from __future__ import annotations

import pytest

from tests.edge.processes.kills import duration, killed
from tests.edge.processes.writers import QUICK, WHOLE

FAST = 4


SLOWER = {"recording in Parquet"}  # its package alone takes a second to import


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOWER)) for name in QUICK])
def test_killed_at_any_moment(name: str) -> None:
    longest = duration(QUICK[name])
    found = [killed(QUICK[name], seed, longest) for seed in range(FAST)]
    assert [one.findings for one in found] == [()] * FAST
    assert any(one.at_work for one in found)


@pytest.mark.slow
@pytest.mark.parametrize("name", WHOLE)
def test_a_command_killed_at_any_moment(name: str) -> None:
    longest = duration(WHOLE[name])
    found = [killed(WHOLE[name], seed, longest) for seed in range(FAST)]
    assert [one.findings for one in found] == [()] * FAST
