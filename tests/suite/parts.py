"""``--part K/N``: the K-th of N parts of the tests, so that those which take hours are run in pieces.

A plugin. Cases of a test go to the parts in turn, so that each part shows something of nearly every sweep.
"""

from __future__ import annotations

import re
import zlib
from collections import Counter

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option."""
    text = "run the K-th of N parts of the chosen tests alone: cases of a test go to the parts in turn"
    parser.addoption("--part", metavar="K/N", help=text)


def pytest_configure(config: pytest.Config) -> None:
    """Refuse what is no part, before there are processes that test."""
    part_of(config)


def part_of(config: pytest.Config) -> tuple[int, int] | None:
    """Return K and N; None if all parts are asked for."""
    stated = config.getoption("--part")
    if stated is None:
        return None
    wanted = re.fullmatch(r"(\d+)/(\d+)", stated)
    number, count = map(int, wanted.groups()) if wanted else (0, 0)
    if not 1 <= number <= count:
        raise pytest.UsageError(f"--part must be K/N with K from 1 to N, such as 2/10, not {stated}")
    return number, count


@pytest.hookimpl(trylast=True)  # of what `-m` and `-k` have left
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the tests of one part."""
    asked = part_of(config)
    if asked is None:
        return
    number, count = asked
    before: Counter[str] = Counter()
    kept, left = [], []
    for item in items:
        test = item.nodeid.partition("[")[0]
        part = (zlib.crc32(test.encode()) + before[test]) % count
        before[test] += 1
        (kept if part == number - 1 else left).append(item)
    config.hook.pytest_deselected(items=left)
    items[:] = kept
