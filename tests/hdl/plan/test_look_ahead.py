"""Look-ahead with many multiplier blocks: wires from those far away take a pipeline stage of their own."""

import random
from fractions import Fraction

import numpy as np
import pytest
from tests.hdl.core_bench import Pace, run_core

from sosmith.gen.architectures.blocks import NO_LIMIT
from sosmith.gen.architectures.parallel import Parallel
from sosmith.hdl.plan.block_products import is_product
from sosmith.hdl.plan.look_ahead import Products, TurnPlan, period, plans
from sosmith.hdl.plan.pipeline import NO_LOGIC
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import GraphBuilder
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep

BLOCKS = Products((frozenset(),), 18)
"""All products of a single stage take blocks."""


def many_products(count: int, turns: int) -> Datapath:
    """Make ``y(n) = floor(11117 / 2**15 y(n - turns) + sum of c_k x(n-k))`` with as many products in all."""
    g = GraphBuilder()
    x = g.input("x", 0, -2048, 2047)
    past = first = g.delay("y1", 0, -(1 << 15), (1 << 15) - 1)
    for k in range(2, turns + 1):
        past = g.previous(past, f"y{k}")
    total = g.scale(past, 11117, 15, "product_y")
    tap = x
    for k in range(count - 1):
        total = g.add(g.scale(tap, 11181 + 2 * k * k, 12), total)
        tap = g.previous(tap, f"x{k + 1}")
    y = g.clamp(g.floor(total, 0), -(1 << 15), (1 << 15) - 1, "y")
    g.connect(first, y)
    ports = (
        Port(name=name, bits=bits, signed=True, lsb=Fraction(1), zero=Fraction(0))
        for name, bits in (("x", 12), ("y", 16))
    )
    source, output = ports
    return Datapath(name="many", inputs=(source,), output=output, stages=(HornerStep("many", g.build([y])),))


def behind(plan: TurnPlan, product: int) -> list[int]:
    """Pipeline stages from a product to each operation that takes it."""
    nodes, left, found = plan.graph.nodes, [product], list[int]()
    while left:
        index = left.pop()
        for user, node in enumerate(nodes):
            if index in node.operands and user not in plan.loops:
                if node.op in NO_LOGIC:
                    left.append(user)
                else:
                    found.append(plan.pipeline_stages[user] - plan.pipeline_stages[product])
    return found


@pytest.mark.parametrize(
    ("count", "turns", "gap", "time"), [(64, 4, 1, 5), (65, 5, 2, 5), (65, 4, 2, 10), (65, 3, 1, 17)]
)
def test_many_blocks_have_a_pipeline_stage_for_their_wires(count: int, turns: int, gap: int, time: int) -> None:
    """They may make a pipeline stage longer, but not by more than they take in one with something else."""
    stages = many_products(count, turns).stages
    (plan,) = plans(stages, BLOCKS)
    products = [index for index, node in enumerate(plan.graph.nodes) if is_product(node)]
    assert (len(products), period(stages, BLOCKS)) == (count, time)
    assert plan.distance <= turns
    assert min(each for index in products for each in behind(plan, index)) == gap


@pytest.mark.parametrize("turns", [3, 4])
def test_a_core_with_many_blocks_equals_the_model(turns: int) -> None:
    datapath = many_products(66, turns)
    core = Parallel(datapath, look_ahead=True, blocks=NO_LIMIT)
    assert core.multiplier_blocks > 64
    rng = random.Random(turns)
    codes = [[rng.randint(-2048, 2047)] for _ in range(120)]
    found = run_core(core, [(0, row) for row in codes], Pace())
    assert [beat.code for beat in found] == datapath.compute_exact(np.array(codes))
