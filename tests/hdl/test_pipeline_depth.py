"""Which rank of a stage does what, and the latency that follows."""

import pytest
from tests.gen.designs import example_design

from sosmith.hdl.core import latency_cycles
from sosmith.hdl.stage import pipeline_depth


@pytest.mark.parametrize(
    ("realization", "counts"),
    [
        ("df1_ef2", [2, 3, 3, 1]),  # a first-order section remembers one sample only
        ("df2t", [2, 2, 2, 1]),
        ("state_space", [2, 2, 2, 1]),
        ("lattice_wdf", [1, 1, 1, 1]),  # no arithmetic before its loops
    ],
)
def test_ranks_of_the_audio_low_pass(realization: str, counts: list[int]) -> None:
    datapath = example_design("audio_lowpass.toml", realization=realization).datapath
    assert [pipeline_depth(stage.graph) for stage in datapath.stages] == counts
    assert latency_cycles(datapath) == sum(counts) + 1


def test_a_polynomial_has_one_rank_a_stage() -> None:
    datapath = example_design("flange_wear_bench.toml", core="calibration").datapath
    assert {pipeline_depth(stage.graph) for stage in datapath.stages} == {1}
