"""Parts of an exploration: its grid, its front, and the record that a killed run goes on from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from tests.interface.small import FILTER

from sosmith import Specification, SpecificationError
from sosmith.instrument.scenarios.traces import ChosenTraces
from sosmith.sim.exploration.front import pareto_front
from sosmith.sim.exploration.grid import Subject, Task, changed, tasks_of
from sosmith.sim.exploration.parameters import Span, Values, default_parameters, read_parameter
from sosmith.sim.exploration.record import FILE, record_in

SPEC = Specification.load(FILTER).checked


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("hardware.realization=df1,delta", "hardware.realization", ["df1", "delta"]),
        ("filter.order = 2, 3", "filter.order", [2, 3]),
        ("output.max_error=1e-3,0.5", "output.max_error", [0.001, 0.5]),
        ("output.range=[-1.0, 1.0],[-2.0, 2.0]", "output.range", [[-1.0, 1.0], [-2.0, 2.0]]),
        ('name="a,b"', "name", ["a,b"]),
        ("hardware.reload=true,false", "hardware.reload", [True, False]),
        ("filter.order=3..8", "filter.order", Span(3, 8)),
        ("filter.cutoff=0.1..16", "filter.cutoff", Span(0.1, 16)),
    ],
)
def test_parameters_are_read(text: str, key: str, values: Values) -> None:
    assert read_parameter(text) == (key, values)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("filter.order", "a parameter must be KEY=V1,V2,... or KEY=LOW..HIGH, not filter.order"),
        ("=3", "a parameter must be KEY=V1,V2,... or KEY=LOW..HIGH, not =3"),
        ("filter.order=2,,3", "a value must be one of TOML, or a name, not nothing in filter.order=2,,3"),
        ("filter.order=1 2", "a value must be one of TOML, or a name, not 1 2 in filter.order=1 2"),
        ("a=8..3", "a range must be LOW..HIGH with LOW less than HIGH, not 8..3"),
        ("a=0..inf", "a range must be LOW..HIGH with LOW less than HIGH, not 0..inf"),
        ("a=[1", "a value must be one of TOML, or a name, not \\[1 in a=\\[1"),
    ],
)
def test_parameters_that_cannot_be_read(text: str, message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        read_parameter(text)


def tasks(parameters: dict[str, Values], **changes: Any) -> list[Task]:
    known: dict[str, Any] = {"core": None, "samples": 100, "seed": 1, "board": None, "traces": ChosenTraces()}
    return tasks_of(Subject(spec=SPEC, **(known | changes)), parameters)


def test_every_combination_is_a_task_of_its_own() -> None:
    made = tasks({"output.bits": [8, 10], "hardware.realization": ["df1", "delta"]})
    assert [tuple(task.changes.values()) for task in made] == [(8, "df1"), (8, "delta"), (10, "df1"), (10, "delta")]
    assert made[1].specification().output.bits == 8
    assert made[1].specification().hardware.realization == "delta"
    assert len({task.key for task in made}) == 4
    assert SPEC.source["output"]["bits"] == 10


def test_a_key_holds_all_that_the_result_depends_on() -> None:
    sweep: dict[str, Values] = {"output.bits": [8]}
    keys = {tasks(sweep, **changes)[0].key for changes in ({}, {"samples": 99}, {"seed": 2}, {"board": "icestick"})}
    assert len(keys) == 4
    assert tasks(sweep)[0].key == tasks({"output.bits": [8], "hardware.realization": ["df1_ef1"]})[0].key


def test_a_value_that_fits_nothing_is_refused() -> None:
    with pytest.raises(
        SpecificationError, match=r"hardware\.realization must be one of auto, .* \(did you mean delta\?\)$"
    ):
        tasks({"output.bits": [8, 10], "hardware.realization": ["df1", "dleta"]})
    with pytest.raises(SpecificationError, match=r"output\.bit must be one of the keys"):
        tasks({"output.bit": [8]})
    assert len(tasks({"output.bits": [8, 10], "output.max_error": [0.001, 0.01]})) == 4  # 8 bits need more than 0.001


def test_what_no_grid_can_be_made_of() -> None:
    with pytest.raises(SpecificationError, match=r"^a parameter must be a key of the specification, not name\.x$"):
        changed(SPEC.source, {"name.x": 1})
    with pytest.raises(SpecificationError, match=r"^there must be at most 100,000 combinations, not 250,000$"):
        tasks({"output.bits": [8] * 500, "filter.order": [2] * 500})
    with pytest.raises(
        SpecificationError, match=r"^output\.bits must be a list of values unless there is a search, not 8\.\.12$"
    ):
        tasks({"output.bits": Span(8, 12)})


def test_default_parameters() -> None:
    found = default_parameters(SPEC)
    assert len(found["hardware.realization"]) == 8
    assert found["output.max_error"] == [2 / 1024, 4 / 1024, 8 / 1024]


def point(key: str, cost: float, bound: float, **changes: Any) -> dict[str, Any]:
    known = {
        "key": key,
        "refused": None,
        "passed": True,
        "architecture": "parallel",
        "cost": {"value": cost, "unit": "LUT4", "source": "estimate"},
        "error": {"bound": bound},
    }
    return known | changes


def front(*points: dict[str, Any]) -> list[str]:
    return [one["key"] for one in pareto_front(points)]


def test_nobody_on_the_front_is_beaten() -> None:
    assert front(point("dear", 9, 1), point("beaten", 9, 2), point("cheap", 1, 5), point("between", 5, 3)) == [
        "cheap",
        "between",
        "dear",
    ]


def test_of_equal_points_the_first_is_on_the_front() -> None:
    assert front(point("a", 1, 1), point("b", 1, 1), point("c", 1, 2), point("d", 2, 1)) == ["a"]


def test_what_falls_short_is_not_on_the_front() -> None:
    assert front(point("a", 1, 1, passed=False), point("b", 2, 2), {"key": "c", "refused": "no"}) == ["b"]


def test_costs_of_several_architectures_share_an_axis() -> None:
    """But those of an earlier version, which did not tell for which FPGA they were."""
    other = point("b", 2, 2, architecture="serial")
    assert front(point("a", 1, 1), other) == ["a", "b"]
    estimate = {"cost": {"value": 2, "unit": "LUT4", "source": "estimate", "device": "ECP5 LFE5U-25F"}}
    assert front(point("a", 1, 1) | estimate, other | estimate) == ["a"]
    cells = {"cost": {"value": 2, "unit": "LUT4", "source": "synthesis"}}
    assert front(point("a", 1, 1) | cells, other | cells) == ["a"]


def test_a_line_that_was_torn_is_cut_off(tmp_path: Path) -> None:
    with record_in(tmp_path) as record:
        record.add({"key": "a", "n": 1})
        record.add({"key": "b", "n": 2})
        record.add({"key": "b", "n": 3})  # a result that came twice
    whole = (tmp_path / FILE).read_bytes()
    for torn in (b'{"key": "c", "n', b'{"key": "c"}', b'"c"\n'):
        (tmp_path / FILE).write_bytes(whole + torn)
        with record_in(tmp_path) as record:
            assert record.points == {"a": {"key": "a", "n": 1}, "b": {"key": "b", "n": 2}}
        assert (tmp_path / FILE).read_bytes() == whole
    assert [json.loads(line)["n"] for line in whole.splitlines()] == [1, 2]


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    message = "the output folder must be free, not in use by another run; choose one with -o"
    with record_in(tmp_path), pytest.raises(SpecificationError, match=message), record_in(tmp_path):
        pass
