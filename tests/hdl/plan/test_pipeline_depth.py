"""The number of pipeline stages of a datapath stage."""

import pytest
from tests.formal.small import resonator
from tests.gen.designs import example_design

from sosmith.hdl.plan.pipeline import pipeline_depth, pipeline_stages


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("realization", "depths"),
    [
        ("df1_ef2", [2, 2, 3, 3, 1]),  # a first-order section remembers one sample only
        ("df2t", [2, 2, 2, 2, 1]),
        ("state_space", [2, 2, 2, 2, 1]),
        ("lattice_wdf", [2, 1, 1, 1, 1]),  # no arithmetic before its loops
    ],
)
def test_the_stages_of_the_audio_low_pass(realization: str, depths: list[int]) -> None:
    datapath = example_design("audio_lowpass.toml", realization=realization).datapath
    assert [pipeline_depth(stage.graph) for stage in datapath.stages] == depths


def test_each_step_of_a_polynomial_takes_one_pipeline_stage() -> None:
    datapath = example_design("flange_wear_bench.toml", core="calibration").datapath
    assert {pipeline_depth(stage.graph) for stage in datapath.stages} == {1}


def test_what_depends_on_older_states_alone_is_computed_before_the_rest() -> None:
    assert pipeline_depth(resonator().stages[0].graph) == 3
    graph = example_design("audio_lowpass.toml", realization="df1_ef2").datapath.stages[2].graph
    stages = {node.name: stage for node, stage in zip(graph.nodes, pipeline_stages(graph), strict=True)}
    assert [stages[name] for name in ("product_A1", "product_A2")] == [2, 1]
