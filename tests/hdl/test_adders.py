"""Products by constants made of adders, in simulation."""

import random
import re
from typing import Any

import pytest
from amaranth.hdl import Module, Shape, Signal
from amaranth.sim import Simulator
from tests.formal.small import port
from tests.hdl.core_bench import Pace, run_core

from sosmith.gen.architecture import Architecture, Blocks
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.adders import multiples
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range
from sosmith.model.sections.horner import HornerStep

CONSTANTS = (1, -1, 4, 3, -3, 5, 45, -45, 105, -208, 683, -683)


def simulated(operand: Signal, constants: tuple[int, ...], low: int, high: int) -> list[list[int]]:
    """Return all products for each code of the operand."""
    m = Module()
    products = []
    for k, value in enumerate(multiples(m, operand, Range(0, low, high), constants, "x")):
        product = Signal(value.shape(), name=f"product{k}")
        m.d.comb += product.eq(value)
        products.append(product)
    found: list[list[int]] = []

    async def bench(ctx: Any) -> None:
        for code in range(low, high + 1):
            ctx.set(operand, code)
            await ctx.delay(1e-9)
            found.append([ctx.get(product) for product in products])

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()
    return found


@pytest.mark.parametrize(("low", "high"), [(-16, 15), (0, 31), (-3, 11), (2, 9), (-7, -2)])
def test_all_products_of_all_codes(low: int, high: int) -> None:
    operand = Signal(Shape(max(low.bit_length(), high.bit_length()) + (low < 0), signed=low < 0))
    wanted = [[constant * code for constant in CONSTANTS] for code in range(low, high + 1)]
    assert simulated(operand, CONSTANTS, low, high) == wanted


def recursion() -> Graph:
    """Two constants that meet one state, shifted for one of them, one that meets the input, and a negative one."""
    g = GraphBuilder()
    x = g.input("x", 0, -128, 127)
    v1 = g.delay("v1", 4, -2047, 2047)
    fed = g.add(g.scale(g.shift(v1, 1), 11, 6, "fed"), g.scale(v1, -7, 5, "back"))
    v = g.clamp(g.floor(g.add(fed, g.scale(x, 43, 4, "in")), 4), -2047, 2047, "v")
    g.connect(v1, v)
    return g.build([g.clamp(g.floor(v, 0), -128, 127, "y")])


def datapath() -> Datapath:
    return Datapath(
        name="small", inputs=(port("x", 8),), output=port("y", 8), stages=(HornerStep("section", recursion()),)
    )


@pytest.mark.parametrize("channels", [1, 3])
def test_a_core_computes_what_its_graph_computes(channels: int) -> None:
    chance = random.Random(1)
    core = Architecture("parallel", datapath(), channels, blocks=Blocks(0))
    assert list(map(len, core.adders)) == [3]
    samples = [(chance.randrange(channels), [chance.choice((-128, 127, chance.randint(-128, 127)))]) for _ in range(90)]
    states = [recursion().reset() for _ in range(channels)]
    wanted = [(channel, *recursion().step(codes, states[channel])) for channel, codes in samples]
    assert [(beat.channel, beat.code) for beat in run_core(core, samples, Pace())] == wanted


def test_the_text_names_the_sums_and_has_no_product() -> None:
    text = to_verilog(to_rtlil(Architecture("parallel", datapath(), blocks=Blocks(0)).component(), "small"))
    assert "*" not in re.sub(r"\(\*.*?\*\)|/\*.*?\*/", "", text)
    for name in ("v1_times_11", "v1_times_minus_7", "x_times_43"):
        assert re.search(rf"\(\* keep = .*\*\)\n *wire (?:signed )?\[\d+:0\] {name};", text), name


def test_a_loadable_constant_needs_a_multiplier() -> None:
    assert not any(Architecture("parallel", datapath(), reload=True, blocks=Blocks(0)).adders)
