"""The number of pipeline stages of a datapath stage."""

from fractions import Fraction

import pytest
from tests.formal.small import resonator
from tests.gen.designs import example_design
from tests.gen.word_lengths.filters import butterworth, fir_spec, plain

from sosmith.gen.filter.design import design
from sosmith.gen.word_lengths.fir import fir_stages
from sosmith.hdl.plan.pipeline import operation_time, pipeline_depth, pipeline_stages
from sosmith.model.dataflow.graph import GraphBuilder, Op, Range


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


@pytest.mark.slow
def test_what_a_tap_sum_dropped_is_added_a_stage_before_it_is_a_state() -> None:
    (stage,) = (one for one in plain(butterworth(3, 0.05), "df1_ef2").datapath.stages if one.name == "section1")
    graph, planned = stage.graph, pipeline_stages(stage.graph)
    errors = {i for i in graph.delays if graph.nodes[graph.nodes[i].operands[0]].op is Op.FRACTION}
    pairs = [(planned[i], planned[k]) for k, node in enumerate(graph.nodes) for i in errors & set(node.operands)]
    assert any(sums == error - 1 for error, sums in pairs)


def test_no_pipeline_stage_of_a_filter_without_recursion_is_empty() -> None:
    taps = ["0.0123", "-0.0456", "0.1789", "0.31", "0.1789", "-0.0456", "0.0123"]
    (section,), _ = fir_stages(design(fir_spec(taps), 1000.0), "fir_symmetric", Range(0, -1000, 999), Fraction(1, 4))
    planned = pipeline_stages(section.graph)
    assert set(planned) == set(range(max(planned) + 1))
    assert max(planned) > 0


def test_a_product_by_a_power_of_two_may_take_no_time() -> None:
    g = GraphBuilder()
    x = g.input("x", 0, -8, 7)
    products = [int(g.scale(x, by, 0)) for by in (1, 2, 8, 3, 6, -1, -2)]
    graph = g.build([products[0]])
    assert [operation_time(graph, graph.nodes[k], powers=True) for k in products] == [0, 0, 0, 12, 12, 12, 12]
    assert {operation_time(graph, graph.nodes[k]) for k in products} == {12}
