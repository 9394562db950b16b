"""Several samples a clock, look-ahead and decimation in explorations and in the studio: rates, costs and times."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.output.packages.made import SPARSE, design_of
from tests.interface.small import FILTER

import sosmith
from sosmith.gen.estimate.estimate import USUAL, estimated
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.report.provenance import hardware_cost, provenance_of
from sosmith.gen.report.report import summarise
from sosmith.gen.specification.specification import from_text
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.interface.specification import Specification
from sosmith.sim.exploration.front import cost_kind, pareto_front
from sosmith.sim.exploration.parameters import default_parameters
from sosmith.sim.simulation import simulate
from sosmith.studio import jobs


def with_hardware(**hardware: Any) -> dict[str, Any]:
    return {**FILTER, "hardware": {**FILTER["hardware"], **hardware}}


@pytest.mark.slow
def test_each_number_of_samples_a_clock_has_its_own_front(tmp_path: Path) -> None:
    """The bound is the same, and the cost a multiple: none of them would be on a front beside a slower one."""
    found = sosmith.explore(
        FILTER, parameters={"hardware.samples_per_clock": [1, 2, 4]}, samples=300, jobs=1, folder=tmp_path
    )
    lanes = [point["changes"]["hardware.samples_per_clock"] for point in found.front]
    assert sorted(lanes) == [1, 2, 4]
    assert [point["cycles_per_sample"] * lane for point, lane in zip(found.front, lanes, strict=True)] == [1, 1, 1]
    costs = {lane: point["cost"]["value"] for lane, point in zip(lanes, found.front, strict=True)}
    assert 1.8 * costs[1] < costs[2] < costs[4] / 1.8
    page = (tmp_path / "exploration.html").read_text(encoding="utf-8")
    assert "4 samples a clock, cost in LUT4 equivalents, estimated before synthesis for ECP5 LFE5U-25F" in page
    assert ">0.25<" in page


def test_points_of_one_rate_are_compared_and_those_of_an_earlier_version_have_one() -> None:
    def point(cost: float, bound: float, **more: Any) -> dict[str, Any]:
        source = more.pop("source", "estimate")
        head = {"refused": None, "passed": True, "architecture": "parallel", "error": {"bound": bound}}
        return {**head, "cost": {"value": cost, "unit": "LUT4", "source": source}, **more}

    old, better, wide, worse = (
        point(2, 1.0),
        point(1, 1.0, samples_per_clock=1),
        *(point(cost, 1.0, samples_per_clock=4) for cost in (5, 6)),
    )
    assert pareto_front([old, better, wide, worse]) == [better, wide]
    assert cost_kind(wide) == ("LUT4", "parallel, 4 samples a clock")
    assert cost_kind(point(5, 1.0, samples_per_clock=4, source="synthesis")) == ("LUT4", "4 samples a clock")
    assert cost_kind(old) == ("LUT4", "parallel")


@pytest.mark.parametrize(
    ("hardware", "swept"),
    [
        ({}, ["hardware.realization", "hardware.architecture"]),
        ({"samples_per_clock": 2}, ["hardware.realization"]),
        ({"pipeline": "look-ahead", "realization": "auto"}, []),
    ],
)
def test_nothing_is_swept_that_the_specification_excludes(hardware: dict[str, Any], swept: list[str]) -> None:
    text = Specification.load(with_hardware(**hardware)).toml()
    assert list(default_parameters(from_text(text, Path("some.toml")))) == [*swept, "output.max_error"]


def test_a_decimator_is_part_of_an_estimated_cost() -> None:
    made = design_of("held").core
    decimator, told = made.datapath.decimator, hardware_cost(made)
    assert decimator is not None
    assert told["source"] == "estimate"
    behind = estimated(replace(made.architecture, datapath=made.datapath.behind_decimator), find_board(USUAL[0]))
    assert behind is not None
    assert told["register_bits"] >= behind.flip_flops + decimator.register_bits / 2
    assert told["luts"] > behind.luts + decimator.stages * decimator.width
    assert decimator.adder_bits == 6 * decimator.width


@pytest.mark.slow
def test_clocks_a_sample_are_an_average_behind_a_decimator(tmp_path: Path) -> None:
    made = design_of("sparse").core
    (trace,) = traces_for(made, "noise", seed=1, seconds=0.202)
    assert made.architecture.cycles_per_result == 34
    assert provenance_of(made, [trace]).cycles_per_sample == made.architecture.clocks_per_sample == 8.5
    assert str(design_of("plain").core.architecture.clocks_per_sample) == "1"
    evidence = simulate(made, [trace], tmp_path, simulator="icarus")
    assert evidence.run.samples == 51
    assert summarise(evidence)["cycles_per_sample"] == evidence.run.cycles / 202
    assert "<td>8.5</td>" in design_of("sparse")._repr_html_()


def told(job: Any, tables: dict[str, Any], **more: Any) -> Any:
    return job(lambda *_: None, text=Specification.load(tables).toml(), path="some.toml", **more)


@pytest.mark.slow
def test_the_studio_tells_times_of_results() -> None:
    found = told(jobs.trace, SPARSE, source="noise", seconds=0.1)
    assert found["samples"] == 25
    np.testing.assert_allclose(found["t"], np.arange(25) * 0.004)
    assert told(jobs.prove, SPARSE)["cycles"] == 8.5
    assert told(jobs.prove, with_hardware(samples_per_clock=4))["cycles"] == 0.25


def test_the_studio_says_that_look_ahead_chooses_for_itself() -> None:
    rows = told(jobs.side_by_side, with_hardware(pipeline="look-ahead", realization="auto"), stage=0)
    message = "hardware.realization must be 'auto' with hardware.pipeline = \"look-ahead\", not 'df1'"
    assert rows[0] == {"realization": "df1", "refused": message}
