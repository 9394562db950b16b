"""Stages in Amaranth's own simulator: equal to the graph, sample for sample, whatever the pipeline's pace."""

import doctest

import pytest
from tests.gen.designs import ALL, example_design
from tests.gen.word_lengths.filters import stimulus
from tests.hdl.stages.stage_bench import run

from sosmith.gen.realizations.registry import SECTIONS
from sosmith.hdl.stages import pipelined as stage_module


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", list(SECTIONS))
@pytest.mark.parametrize("name", ALL)
def test_stages_equal_their_graphs(name: str, realization: str) -> None:
    datapath = example_design(name, realization=realization).datapath
    samples: list[list[int]] = stimulus(datapath.inputs, 3, 240).tolist()
    for index, stage in enumerate(datapath.stages):
        expected = stage.graph.run(samples)
        assert run(stage, samples, index) == expected, stage.name
        samples = expected


def test_the_worked_example_is_true() -> None:
    results = doctest.testmod(stage_module)
    assert results.attempted > 0
    assert results.failed == 0
