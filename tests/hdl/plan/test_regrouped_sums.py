"""Sums of loops in another order: the same codes, and no later than a chain of them."""

import random
from collections.abc import Sequence

import pytest

from sosmith.hdl.plan.look_ahead import Products, period, plans
from sosmith.hdl.plan.regrouped_sums import regrouped
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op, Range, Wire
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.look_ahead import LookAhead, Tap


def loop(seed: int, turns: int = 4) -> Graph:
    """Make a loop with a sum of the input, now and before, states of two ages, and products of them, in any order."""
    rng = random.Random(seed)
    g = GraphBuilder()
    x = g.input("x", 0, -50, 50)
    states = [g.delay("y1", 0, -(1 << 12), 1 << 12)]
    for k in range(2, 2 * turns + 1):
        states.append(g.previous(states[-1], f"y{k}"))
    near, far = states[turns - 1], states[2 * turns - 1]
    terms = [
        x,
        near,
        far,
        g.scale(near, rng.choice((-5, 3, 11)), 5),
        g.scale(far, rng.choice((-7, 5, 9)), 6),
        g.previous(x, "x1"),
    ]
    rng.shuffle(terms)
    total = added(g, terms, rng)
    y = g.clamp(g.floor(total, 0), -(1 << 12), 1 << 12)
    g.connect(states[0], y)
    return g.build([y])


def added(g: GraphBuilder, terms: Sequence[Wire], rng: random.Random) -> Wire:
    """Add and subtract terms, some of them in brackets, whose ranges are stated here and there."""
    if len(terms) == 1:
        return terms[0]
    cut = rng.randrange(1, len(terms))
    one, other = added(g, terms[:cut], rng), added(g, terms[cut:], rng)
    total = g.add(one, other) if rng.random() < 0.6 else g.subtract(one, other)
    return g.bound(total, g[total].low, g[total].high) if rng.random() < 0.3 else total


@pytest.mark.parametrize("seed", range(12))
def test_regrouped_sums_give_the_same_codes(seed: int) -> None:
    graph = loop(seed)
    rng = random.Random(seed)
    rows = [[rng.randint(-50, 50)] for _ in range(200)]
    assert regrouped(graph).run(rows) == graph.run(rows)
    assert len({row[0] for row in graph.run(rows)}) > 10


@pytest.mark.parametrize("seed", range(12))
def test_the_newest_state_meets_two_sums_at_most(seed: int) -> None:
    """What is multiplied comes one addition later than the state itself, and both of them behind all others."""
    graph = regrouped(loop(seed))
    (newest,) = (i for i in graph.delays if graph.nodes[i].name == "y4")
    behind = {newest: 0}
    for index, node in enumerate(graph.nodes):
        found = [behind[i] for i in node.operands if i in behind and node.op is not Op.DELAY]
        if found and node.op is not Op.CLAMP:
            behind[index] = max(found) + (node.op in {Op.ADD, Op.SUBTRACT})
    assert max(behind.values()) == 2  # of six terms, one after another, up to five


def test_a_constant_longer_than_a_block_takes_no_longer_in_a_loop() -> None:
    """The state itself, which is what the constant has beyond a block, is added while the product is made."""
    g = GraphBuilder()
    x = g.input("x", 10, -(1 << 20), (1 << 20) - 1)
    states = [g.delay("y1", 10, -(1 << 22), (1 << 22) - 1)]
    for k in range(2, 5):
        states.append(g.previous(states[-1], f"y{k}"))
    total = g.subtract(x, g.scale(states[-1], (1 << 18) - 3, 19))
    v = g.bound(total, -(1 << 31), (1 << 31) - 1, "v")
    y = g.floor(v, 10)
    g.connect(states[0], y)
    stage = HornerStep("loop", g.build([y]))
    products = Products((frozenset(),), 18)
    (plan,) = plans([stage], products)
    assert (plan.turns, plan.distance, period([stage], products)) == (4, 4, 5)


def test_a_product_of_the_newest_state_waits_for_sums_that_are_there_as_early() -> None:
    """Products drop bits; the older state's is added to what is there before, and not to the newest one's."""
    section = LookAhead(
        name="loop",
        distance=3,
        factors=(),
        recursion=(Tap("A1", -1729795, 20, 3, 15), Tap("A2", 205769, 18, 6, 15)),
        x=Range(14, -(1 << 23), 1 << 23),
        fracs=(),
        ranges=(),
        y_frac=11,
        v_range=(-(1 << 27), 1 << 27),
    )
    products = Products((frozenset(i for i, node in enumerate(section.graph.nodes) if abs(node.parameter) < 4),), 18)
    (plan,) = plans([section], products)
    assert (plan.turns, plan.distance, period([section], products)) == (3, 3, 10)
