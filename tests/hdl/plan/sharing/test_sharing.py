"""Which sections share hardware, and when: what the plan says of cores of known structure."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest

import sosmith
from sosmith.hdl.plan.sharing.sections import merged
from sosmith.hdl.plan.sharing.sharing import MOST_CLOCKS, Sharing, sharing
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op


def datapath(order: int = 6, **hardware: Any) -> Datapath:
    return _design(order, tuple(hardware.items())).core.datapath


@cache
def _design(order: int, hardware: tuple[tuple[str, Any], ...]) -> sosmith.Design:
    tree = {
        "name": "plan",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"family": "butterworth", "kind": "lowpass", "order": order, "cutoff": 50.0},
        "output": {"bits": 8, "range": [-1.0, 1.0], "signed": True, "max_error": 0.02},
        "hardware": {"architecture": "multiplexed", "realization": "df1_ef2", "clock": 1e6, **dict(hardware)},
    }
    return sosmith.design(tree)


class Named:
    """A stage."""

    def __init__(self, name: str, graph: Graph) -> None:
        self.name, self.graph = name, graph


def section(constant: int, *, frac: int = 4, x_frac: int = 0, kept: int = 2, added: bool = True) -> Graph:
    """Make ``v(n) = floor(v(n-1) - c v(n-1)) + x(n)``, or less x(n)."""
    g = GraphBuilder()
    x = g.input("x", x_frac, -8, 7)
    v1 = g.delay("v1", kept, -512, 511)
    product = g.floor(g.scale(v1, constant, frac, "product"), kept)
    left = g.subtract(v1, product)
    v = g.bound((g.add if added else g.subtract)(left, x), -512, 511, "v")
    g.connect(v1, v)
    return g.build([v])


def test_three_sections_have_one_hardware() -> None:
    plan = sharing(datapath())
    (unit,) = plan.shared
    assert [stage.name for stage in unit.stages] == ["section0", "section1", "section2"]
    assert [stage.name for stage in plan.alone] == ["start", "output_stage"]
    assert (plan.clocks, plan.interval, plan.depth, plan.latency_cycles) == (1, 3, 5, 6)
    assert not plan.is_kept_at_entrance


def test_a_sample_is_kept_where_the_first_stage_takes_turns() -> None:
    plan = sharing(datapath(start="zero"))
    assert plan.is_kept_at_entrance
    assert (plan.interval, plan.depth) == (3, 5)


def test_a_section_of_another_structure_stands_alone() -> None:
    plan = sharing(datapath(5))
    assert [[stage.name for stage in unit.stages] for unit in plan.shared] in (
        [["section0", "section1"]],
        [["section1", "section2"]],
    )
    assert len(plan.alone) == 3


def test_a_fast_clock_spreads_a_turn_over_several() -> None:
    estimates = [sharing(datapath(), clock).clock_estimate for clock in (1.0, 70e6, 1e9)]
    assert estimates == sorted(estimates)
    assert estimates[0] < 70e6 <= estimates[1]
    slow, fast = sharing(datapath(), 1.0), sharing(datapath(), 1e9)
    assert slow.clocks == 1 < fast.clocks <= MOST_CLOCKS
    assert fast.interval == 3 * fast.clocks


@pytest.mark.parametrize("available", range(3, 13))
def test_turns_take_no_more_clocks_than_there_are(available: int) -> None:
    plan = sharing(datapath(), 1e9, available)
    fastest = sharing(datapath(), 1e9)
    assert plan.interval <= available
    assert plan.clocks == min(available // 3, fastest.clocks)
    assert sharing(datapath(), 1e9, 2).clocks == 1


@pytest.mark.parametrize("clocks", range(1, MOST_CLOCKS + 1))
def test_each_node_is_behind_its_operands(clocks: int) -> None:
    (unit,) = sharing(datapath()).shared
    turn = unit.turn(clocks)
    for node, clock in zip(unit.graph.nodes, turn, strict=True):
        assert 0 <= clock < clocks
        assert all(turn[index] <= clock for index in node.operands if node.op is not Op.DELAY)
    assert unit.period(clocks) <= unit.period(1)


def test_an_interval_is_no_shorter_than_the_deepest_stage() -> None:
    made = datapath(5, realization="df1")
    plan = sharing(made)
    assert plan.interval == max(plan.depth_of(unit) for unit in plan.units)


def test_constants_have_the_fraction_bits_of_the_longest() -> None:
    shared = merged([Named("a", section(3, frac=4)), Named("b", section(5, frac=6))])
    assert shared is not None
    (constants,) = shared.constants.values()
    assert constants == (12, 5)


def test_nodes_have_room_for_all_sections() -> None:
    shared = merged([Named("a", section(3, x_frac=0)), Named("b", section(5, x_frac=2))])
    assert shared is not None
    entry = shared.graph.nodes[shared.graph.inputs[0]]
    assert (entry.frac, entry.low, entry.high) == (2, -32, 28)


@pytest.mark.parametrize(
    "other",
    [section(3, kept=3), section(3, added=False)],
    ids=["other fraction bits of a state", "a difference in place of a sum"],
)
def test_other_structures_share_nothing(other: Graph) -> None:
    assert merged([Named("a", section(3)), Named("b", other)]) is None


def test_a_plan_needs_two_sections() -> None:
    alone = datapath(2, architecture="parallel")
    with pytest.raises(ValueError, match=r"^two sections that follow each other must have the same operations$"):
        sharing(alone)


def test_plans_are_equal_for_equal_datapaths() -> None:
    assert sharing(datapath()) == sharing(datapath())
    assert isinstance(sharing(datapath()), Sharing)


def test_a_product_of_several_blocks_takes_longer_for_the_wires_between_them() -> None:
    of_one = merged([Named("a", section(1000, frac=24)), Named("b", section(1001, frac=24))])
    of_two = merged([Named("a", section(1 << 22, frac=24)), Named("b", section((1 << 22) + 1, frac=24))])
    assert of_one is not None
    assert of_two is not None
    assert of_two.period(1) == of_one.period(1) + 10  # 2 for adding up their results
