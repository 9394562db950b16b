"""A board that lies at each step: no traceback, an end, documented statuses, and nothing lost that was taken."""

import random
from collections import Counter
from pathlib import Path

import pytest

from sosmith.model.errors import LinkError
from tests.commands.invocation import Invocation
from tests.edge.hostile_run import hostile_run
from tests.edge.lying_board import false_identity, with_memory
from tests.host.lines import plain_device
from tests.host.ports import plugged

FAST, SLOW = range(6), range(6, 500)


def run(seeds: range, folder: Path) -> Counter[int]:
    outcomes = {seed: hostile_run(seed, folder) for seed in seeds}
    assert {seed: each.findings for seed, each in outcomes.items() if each.findings} == {}
    assert sum(each.lies for each in outcomes.values()) > 5 * len(seeds)
    return Counter(each.status for each in outcomes.values())


def test_lies_in_the_fast_run(tmp_path: Path) -> None:
    statuses = run(FAST, tmp_path)
    assert set(statuses) >= {0, 1, 3}


@pytest.mark.slow
def test_more_lies(tmp_path: Path) -> None:
    run(SLOW, tmp_path)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("command", ["monitor", "stream"])
def test_a_false_identity_at_a_terminal(command: str, seed: int, tmp_path: Path) -> None:
    """Over a real pseudo-terminal: every seed has an identity that is none."""
    trace = tmp_path / "trace.csv"
    trace.write_text("x_code\n1\n")
    device = plain_device()
    given = (str(trace),) if command == "stream" else ("--trace", str(trace))
    lie = b"{" + false_identity(device._memory, random.Random(seed))
    if seed == 0:
        lie = device._memory.rstrip(b"\0").replace(b'"plain"', b'"\\u001b[2J"')
    with_memory(device, lie)
    with plugged(device) as port:
        result = Invocation(command).run(port, *given, "-o", str(tmp_path / "out.csv"))
    assert isinstance(result.exception, LinkError)
    assert str(result.exception).startswith("the board's identity must be the JSON of docs/protocol.md, not: ")
    assert str(result.exception).isprintable()
    assert not (tmp_path / "out.csv").exists()
