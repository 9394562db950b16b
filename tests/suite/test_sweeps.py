"""Of a sweep, those cases run always that show every value and every pair of them; the others are slow."""

from itertools import combinations, product

import pytest
from tests.suite.sweeps import covering

SIZES = {"architecture": 3, "simulator": 3, "channels": 2, "protect": 2}
GRID = [dict(zip(SIZES, indices, strict=True)) for indices in product(*map(range, SIZES.values()))]


def test_every_pair_of_values_is_shown() -> None:
    chosen = covering(GRID)
    pairs = {pair for k in chosen for pair in combinations(GRID[k].items(), 2)}
    assert pairs == {pair for case in GRID for pair in combinations(case.items(), 2)}
    assert 9 <= len(chosen) < len(GRID) // 2


@pytest.mark.parametrize("most", [1, 2, 3, 100])
def test_so_many_at_most_and_every_value_first(most: int) -> None:
    chosen = covering(GRID, most)
    assert len(chosen) == min(most, len(GRID))
    seen = {value for k in chosen for value in GRID[k].items()}
    assert len(seen) >= min(most, 3) * 2 + 2 * min(most, 2)


def test_of_a_plain_list_the_first_are_taken() -> None:
    assert covering([{"case": k} for k in range(9)], 3) == {0, 1, 2}


TRIED = """
import pytest

@pytest.mark.sweep(2)
@pytest.mark.parametrize("a", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("b", [1, 2])
def test_sum(a, b):
    pass
"""


def test_the_others_are_slow(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nmarkers =\n    slow\n    sweep")
    pytester.makeconftest("from tests.conftest import pytest_collection_modifyitems")
    pytester.makepyfile(TRIED)
    for marks, passed in (("not slow", 2), ("", 6)):
        pytester.runpytest("-m", marks, "-p", "no:cacheprovider").assert_outcomes(passed=passed, deselected=6 - passed)
