"""The schedule of a recursion that several channels take turns in."""

from itertools import pairwise

import pytest
from tests.gen.designs import example_design

from sosmith.hdl.interleaved import schedule
from sosmith.model.dataflow.graph import Graph, Op

REALIZATIONS = ("df1_ef2", "df2t", "delta", "state_space", "normal", "lattice_wdf")


def graphs(realization: str) -> list[Graph]:
    return [stage.graph for stage in example_design("flange_wear_bench.toml", realization=realization).datapath.stages]


@pytest.mark.parametrize("channels", [2, 3, 5, 8, 16, 17, 64])
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_every_value_is_there_before_it_is_used(realization: str, channels: int) -> None:
    for graph in graphs(realization):
        plan = schedule(graph, channels)
        assert plan.distance <= channels
        assert plan.reading == (1 if channels <= 16 else 2)
        for index, node in enumerate(graph.nodes):
            assert 0 <= plan.pipeline_stages[index] < plan.depth
            if node.op is Op.DELAY:
                addressed = plan.pipeline_stages[index] - plan.reading  # where the memory is addressed
                assert addressed >= 0
                assert plan.writes[index] >= addressed + plan.reading - 1  # block RAM: never written while it is read
                assert plan.pipeline_stages[node.operands[0]] + plan.reading - 1 <= plan.writes[index] < plan.depth
                continue
            assert all(plan.pipeline_stages[i] <= plan.pipeline_stages[index] for i in node.operands)
        assert all(plan.pipeline_stages[i] < plan.depth for i in graph.outputs)


def test_more_channels_make_a_deeper_pipeline() -> None:
    section = graphs("df1_ef2")[-2]
    depths = [schedule(section, channels).depth for channels in (2, 3, 8)]
    assert all(few <= more for few, more in pairwise(depths))
    assert depths[0] < depths[-1]
