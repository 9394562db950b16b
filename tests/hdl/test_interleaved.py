"""The schedule of a loop that several channels take turns in, and that it is the hardware's."""

from itertools import pairwise

import pytest
from tests.gen.designs import example_design

from sosmith.hdl.core import latency_cycles
from sosmith.hdl.interleaved import schedule
from sosmith.model.graph import Graph, Op

REALIZATIONS = ("df1_ef2", "df2t", "delta", "state_space", "normal", "lattice_wdf")


def graphs(realization: str) -> list[Graph]:
    return [stage.graph for stage in example_design("flange_wear_bench.toml", realization=realization).datapath.stages]


@pytest.mark.parametrize("channels", [2, 3, 5, 8, 64])
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_every_value_is_there_before_it_is_used(realization: str, channels: int) -> None:
    for graph in graphs(realization):
        plan = schedule(graph, channels)
        assert plan.distance <= channels
        for index, node in enumerate(graph.nodes):
            assert 0 <= plan.ranks[index] < plan.count
            if node.op is Op.DELAY:
                assert plan.ranks[index] >= 1  # the memory is told the channel a rank before
                assert plan.writes[index] >= plan.ranks[index] - 1  # never written before it is read
                assert plan.writes[index] >= plan.ranks[node.operands[0]]
                continue
            assert all(plan.ranks[i] <= plan.ranks[index] for i in node.operands)
        assert all(plan.ranks[i] < plan.count for i in graph.outputs)


def test_more_channels_leave_less_to_a_rank() -> None:
    section = graphs("df1_ef2")[-2]
    ranks = [schedule(section, channels).count for channels in (2, 3, 8)]
    assert all(few <= more for few, more in pairwise(ranks))
    assert ranks[0] < ranks[-1]


def test_the_latency_counts_all_ranks_and_both_buffers() -> None:
    datapath = example_design("flange_wear_bench.toml", realization="df1_ef2").datapath
    assert latency_cycles(datapath, 8) == sum(schedule(stage.graph, 8).count for stage in datapath.stages) + 2
