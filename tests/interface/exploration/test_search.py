"""Searches: what is asked for depends on the seed alone, and leads to the front."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Generator, Iterable, Sequence
from pathlib import Path
from typing import Any

import pytest
from tests.interface.small import FILTER
from tests.suite.extras import needs

import sosmith
from sosmith import Specification, SpecificationError, ToolError
from sosmith.instrument.scenarios.traces import ChosenTraces
from sosmith.sim.exploration.grid import Task
from sosmith.sim.exploration.parameters import Parameters, Span
from sosmith.sim.exploration.run import Outcome, explore

pytestmark = needs("optuna")

SPEC = Specification.load(FILTER).checked

COUNT = 120
"""Designs of a search: the optimizer has learned by then, and takes longer for each that it adds."""

SPACE: Parameters = {
    "hardware.realization": ["df1", "df2t", "delta", "state_space"],
    "output.bits": Span(9, 16),
    "output.max_error": Span(0.0001, 0.1),
}


def result(task: Task) -> dict[str, Any]:
    """Stand for a design: a cost and a bound with a front that is known, and some combinations refused."""
    bits, allowed = task.changes["output.bits"], task.changes["output.max_error"]
    if allowed <= 2.0 / 2**bits:
        return {"key": task.key, "changes": task.changes, "refused": "output.max_error must be more"}
    waste = {"df1": 1.0, "df2t": 1.5, "delta": 2.0, "state_space": 3.0}[task.changes["hardware.realization"]]
    architecture = task.changes.get("hardware.architecture", "parallel")
    return {
        "key": task.key,
        "changes": task.changes,
        "refused": None,
        "passed": task.changes["hardware.realization"] != "delta",
        "architecture": architecture,
        "error": {"bound": allowed},
        "cost": {
            "value": waste * bits * (1 - math.log10(allowed)),
            "unit": "LUT4" if architecture == "parallel" else "instructions",
            "source": "estimate",
        },
    }


class Machine:
    """Runs tasks in the order of `arranged`, until so many are done."""

    def __init__(self, arranged: Callable[[Sequence[Task]], Iterable[Task]] = lambda tasks: tasks, ends: int = 0):
        self.done: list[str] = []
        self._arranged, self._ends = arranged, ends

    def __call__(self, batches: Iterable[Sequence[Task]]) -> Generator[dict[str, Any], None, None]:
        for batch in batches:
            for task in self._arranged(batch):
                if self._ends and len(self.done) == self._ends:
                    raise ToolError("killed")
                self.done.append(task.key)
                yield result(task)


def searched(
    folder: Path, count: int = COUNT, *, seed: int = 1, machine: Machine | None = None, **more: Any
) -> Outcome:
    return explore(
        SPEC, SPACE | more, folder, machine or Machine(), traces=ChosenTraces(), search=count, samples=100, seed=seed
    )


@pytest.fixture(scope="module", name="found")
def search(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    return searched(tmp_path_factory.mktemp("searched"))


@pytest.mark.slow
def test_no_design_is_made_twice(found: Outcome) -> None:
    assert len({point["key"] for point in found.points}) == len(found.points) == COUNT
    assert [task.key for task in found.tasks] == [point["key"] for point in found.points]


@pytest.mark.slow
def test_values_are_within_their_ranges(found: Outcome) -> None:
    for point in found.points:
        bits, allowed = point["changes"]["output.bits"], point["changes"]["output.max_error"]
        assert isinstance(bits, int)
        assert 9 <= bits <= 16
        assert 0.0001 <= allowed <= 0.1
        assert allowed == float(f"{allowed:.4g}")


def test_the_search_is_drawn_to_the_front(found: Outcome) -> None:
    """The best designs are of df1 with few bits: the second half has far more of them than chance would give."""
    later = found.points[COUNT // 2 :]
    of_df1 = sum(point["changes"]["hardware.realization"] == "df1" for point in later)
    assert of_df1 > COUNT // 4  # half as many by chance
    assert {point["changes"]["hardware.realization"] for point in found.front} == {"df1"}


@pytest.mark.slow
def test_the_order_of_the_results_is_of_no_account(found: Outcome, tmp_path: Path) -> None:
    assert searched(tmp_path, machine=Machine(lambda tasks: reversed(list(tasks)))) == found


@pytest.mark.slow
@pytest.mark.parametrize("ends", [24, 53])
def test_a_search_that_was_killed_goes_on(found: Outcome, tmp_path: Path, ends: int) -> None:
    killed, again = Machine(ends=ends), Machine()
    with pytest.raises(ToolError, match=r"^killed$"):
        searched(tmp_path, machine=killed)
    assert searched(tmp_path, machine=again) == found
    assert len(again.done) == COUNT - ends
    assert not set(killed.done) & set(again.done)


def test_another_seed_is_another_search(found: Outcome, tmp_path: Path) -> None:
    other = searched(tmp_path, 24, seed=2)
    assert [point["changes"] for point in other.points] != [point["changes"] for point in found.points[:24]]


def test_a_longer_search_goes_on_from_a_shorter_one(found: Outcome, tmp_path: Path) -> None:
    assert searched(tmp_path, 48).points == found.points[:48]


def test_architectures_are_a_parameter_like_any_other(tmp_path: Path) -> None:
    machines = {"hardware.architecture": ["parallel", "folded"]}
    points = searched(tmp_path, 48, **machines).points
    assert {point["changes"]["hardware.architecture"] for point in points} == {"parallel", "folded"}
    assert list(points[0]["changes"]) == [*SPACE, "hardware.architecture"]


def test_a_space_that_is_small_enough_is_a_grid(tmp_path: Path) -> None:
    small = {"hardware.realization": ["df1", "df2t"], "output.bits": Span(12, 14), "output.max_error": [0.01]}
    found = explore(SPEC, small, tmp_path, Machine(), traces=ChosenTraces(), search=6, samples=100)
    assert [tuple(point["changes"].values())[:2] for point in found.points] == [
        (name, bits) for name in ("df1", "df2t") for bits in (12, 13, 14)
    ]


def test_a_space_that_is_used_up_ends_the_search(tmp_path: Path) -> None:
    small: Parameters = {
        "hardware.realization": ["df1", "df2t"],
        "output.max_error": Span(0.01, 0.01001),
        "output.bits": [12],
    }
    found = explore(SPEC, small, tmp_path, Machine(), traces=ChosenTraces(), search=100, samples=100)
    assert 2 <= len(found.points) <= 4


def test_what_a_search_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        SpecificationError, match=r"hardware\.realization must be one of auto, .* \(did you mean delta\?\)$"
    ):
        searched(tmp_path, **{"hardware.realization": ["df1", "dleta"]})
    with pytest.raises(SpecificationError, match=r"^search must be at least 1, not 0$"):
        sosmith.explore(FILTER, {"output.bits": [9, 10]}, folder=tmp_path, search=0)
    with pytest.raises(
        SpecificationError, match=r"^output\.bits must be a list of values, or a range such as 1\.\.8, not 9$"
    ):
        sosmith.explore(FILTER, {"output.bits": "9"}, folder=tmp_path)
    monkeypatch.setitem(sys.modules, "optuna", None)
    message = r"the package optuna is needed for a search, and was not found: pip install 'sosmith\[search\]'"
    with pytest.raises(ToolError, match=f"^{message}$"):
        searched(tmp_path)


def test_a_search_of_real_designs(tmp_path: Path) -> None:
    space = {"output.max_error": "0.0011..0.02", "output.bits": [10, 12]}
    found = sosmith.explore(FILTER, space, folder=tmp_path, search=3, samples=300, jobs=1)
    assert len(found.points) == 3
    assert found.as_dict()["parameters"] == {"output.max_error": "0.0011..0.02", "output.bits": [10, 12]}
    assert found.as_dict()["search"] == 3
    assert found.front
