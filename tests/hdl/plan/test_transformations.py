"""Graphs made for hardware compute what the graphs do that they are made of: unfolded, reassociated, with sums."""

import random
from collections.abc import Sequence

import pytest
from tests.gen.designs import parallel_design

from sosmith.hdl.plan.block_products import blocks_of, is_product, with_blocks
from sosmith.hdl.plan.constant_products import with_sums
from sosmith.hdl.plan.look_ahead import Products, TurnPlan, period, plans
from sosmith.hdl.plan.reassociation import reassociated
from sosmith.hdl.plan.unfolding import unfolded
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op
from sosmith.model.dataflow.structure import Stage
from sosmith.model.sections.horner import HornerStep

SAMPLES = 48


def random_graph(seed: int) -> Graph:
    """Make a recursion with products by constants, gates, delays and roundings; nothing in it overflows."""
    rng = random.Random(seed)
    g = GraphBuilder()
    wires = [g.input("x", 2, -128, 127), g.input("z", 0, -5, 9)]
    newest = past = g.delay("v1", 2, -4000, 4000)
    for _ in range(rng.randint(1, 3)):
        past = g.previous(past, "older")
    wires.append(past)
    for number in range(rng.randint(3, 8)):
        a, b = rng.choice(wires), rng.choice(wires)
        made = [
            g.scale(a, rng.choice([-717, -75, -8, -1, 3, 20, 150, 4813]), rng.randint(0, 9)),
            g.add(a, b),
            g.subtract(a, g.subtract(b, past)),
            g.previous(g.add(a, b), f"held{number}"),
            g.multiply(a, g.constant(1, 0)),
        ][rng.randrange(5)]
        wires.append(g.floor(made, 2) if g[made].width > 24 else made)
    total = g.clamp(g.floor(g.add(wires[-1], g.floor(g.shift(past, -1), 2)), 2), -4000, 4000, "v")
    g.connect(newest, total)
    return g.build([total, wires[-2]])


def samples(graph: Graph, seed: int) -> list[list[int]]:
    rng = random.Random(seed)
    return [[rng.randint(low, high) for _, low, high in graph.input_ranges] for _ in range(SAMPLES)]


@pytest.mark.sweep(8)
@pytest.mark.parametrize("seed", range(25))
def test_rewritten_graphs_give_the_same_codes(seed: int) -> None:
    graph = random_graph(seed)
    rows = samples(graph, seed)
    wanted = graph.run(rows)
    assert reassociated(graph).run(rows) == wanted
    sums = with_sums(graph)
    assert sums.run(rows) == wanted
    scales = [node.parameter for node in sums.nodes if node.op is Op.SCALE]
    assert all(value > 0 and value & (value - 1) == 0 for value in scales)


@pytest.mark.parametrize("bits", [3, 5, 8])
@pytest.mark.parametrize("seed", range(6))
def test_products_in_pieces_fit_blocks_and_give_the_same_codes(seed: int, bits: int) -> None:
    graph = random_graph(seed)
    rows = samples(graph, seed)
    products = [index for index, node in enumerate(graph.nodes) if node.op is Op.SCALE and node.parameter]
    pieces, blocks = with_blocks(graph, products, bits)
    assert pieces.run(rows) == graph.run(rows)
    assert len(blocks) == sum(blocks_of(graph, graph.nodes[i], bits) for i in products if is_product(graph.nodes[i]))
    for node in (pieces.nodes[index] for index in blocks):
        operand = pieces.nodes[node.operands[0]]
        assert operand.width + (not operand.signed) <= bits
        assert abs(node.parameter) < 1 << (bits - 1)
        assert node.parameter > 0 or operand.signed


@pytest.mark.parametrize("low", [0, -2048])
@pytest.mark.parametrize("constants", [(45, 23), (-45, 23), (45, -23), (-45, -23), (-717, -4813)])
def test_pieces_have_the_right_sign_wherever_products_are_used(constants: tuple[int, int], low: int) -> None:
    g = GraphBuilder()
    x, a = g.input("x", 0, low, 2047), g.input("a", 0, -9, 9)
    outputs = []
    for constant in constants:
        users = [g.scale(x, constant, 2) for _ in range(5)]
        outputs += [users[0], g.add(a, users[1]), g.add(users[2], a), g.subtract(a, users[3]), g.subtract(users[4], a)]
    p, q, r, s, t, _ = (g.scale(x, constant, 2) for constant in constants * 3)
    graph = g.build([*outputs, g.add(p, q), g.subtract(r, s), g.add(t, t)])
    pieces, blocks = with_blocks(graph, range(len(graph.nodes)), 5)
    rows = [[value, k % 19 - 9] for k, value in enumerate(range(low, 2048, 97))]
    assert pieces.run(rows) == graph.run(rows)
    factors = [(pieces.nodes[pieces.nodes[i].operands[0]].signed, pieces.nodes[i].parameter) for i in blocks]
    assert all(signed or factor > 0 for signed, factor in factors)


@pytest.mark.parametrize("lanes", [2, 3, 4, 8, 16])
@pytest.mark.parametrize("seed", range(6))
def test_unfolded_graphs_give_the_same_codes(seed: int, lanes: int) -> None:
    graph = random_graph(seed)
    rows = samples(graph, seed)
    beats = [[code for row in rows[k : k + lanes] for code in row] for k in range(0, SAMPLES, lanes)]
    found = [code for beat in unfolded(graph, lanes).run(beats) for code in beat]
    assert found == [code for row in graph.run(rows) for code in row]


def planned(stages: Sequence[Stage]) -> tuple[TurnPlan, ...]:
    return plans(stages, Products.of_adders(stages))


def time(stages: Sequence[Stage]) -> int:
    return period(stages, Products.of_adders(stages))


def test_a_start_takes_one_addition_however_many_samples_a_beat_holds() -> None:
    start = parallel_design("audio_lowpass.toml").datapath.stages[0]
    assert start.name == "start"
    for lanes in (1, 2, 8):
        graph = reassociated(unfolded(start.graph, lanes))
        steps = [HornerStep("start", graph)]
        (plan,) = planned(steps)
        assert plan.distance == plan.turns == 1
        assert time(steps) == 5


def distant(turns: int, additions: int) -> Stage:
    """Make a loop that goes back `turns` samples, with so many additions one after the other."""
    g = GraphBuilder()
    x = g.input("x", 0, 0, 1)
    delays = [g.delay("y1", 0, -100, 100)]
    for k in range(2, turns + 1):
        delays.append(g.previous(delays[-1], f"y{k}"))
    wire = delays[-1]
    for _ in range(additions):
        wire = g.shift(g.shift(g.add(wire, x), 1), -1)  # which keeps the sums apart
    y = g.clamp(wire, -100, 100)
    g.connect(delays[0], y)
    return HornerStep("loop", g.build([y]))


@pytest.mark.parametrize(("turns", "additions", "wanted"), [(4, 2, 5), (4, 5, 10), (8, 5, 5), (2, 3, 20), (3, 3, 10)])
def test_pipeline_stages_are_as_short_as_the_turns_allow(turns: int, additions: int, wanted: int) -> None:
    """A loop of n operations, the limiter included, has turns - 1 pipeline stages: one clock goes to its memory."""
    stage = distant(turns, additions)
    (plan,) = planned([stage])
    assert (plan.turns, time([stage])) == (turns, wanted)
    assert plan.distance <= turns
    assert sum(node.op is Op.DELAY for node in plan.graph.nodes) == 1


def test_all_stages_take_the_time_of_the_slowest_loop() -> None:
    slow, fast = distant(4, 5), distant(8, 5)
    assert [plan.depth for plan in planned([slow, fast])] == [planned([slow])[0].depth, 4]
    assert time([slow, fast]) == time([slow]) == 10
