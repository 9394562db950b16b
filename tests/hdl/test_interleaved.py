"""The schedule of a loop that several channels take turns in, and that it is the hardware's."""

from itertools import pairwise

import pytest
from tests.gen.designs import example_design

from sosmith.hdl.core import latency_cycles
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
            assert 0 <= plan.ranks[index] < plan.count
            if node.op is Op.DELAY:
                told = plan.ranks[index] - plan.reading  # the rank at which the memory is told the channel
                assert told >= 0
                assert plan.writes[index] >= told + plan.reading - 1  # block RAM: never written while it is read
                assert plan.ranks[node.operands[0]] + plan.reading - 1 <= plan.writes[index] < plan.count
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
