"""What pipeline stages have in common, for all inputs there are; products made of adders."""

import random
import re
from collections.abc import Callable
from itertools import product
from typing import Any

import pytest
from amaranth.hdl import Cat, Module, Shape, Signal, Value
from amaranth.sim import Simulator
from tests.formal.small import port
from tests.hdl.core_bench import Pace, run_core

from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.adders import multiples
from sosmith.hdl.pipelined_logic import banks_in_use, limits
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range
from sosmith.model.sections.horner import HornerStep


def values(inputs: list[Signal], output: Callable[[Module], Value], given: list[tuple[int, ...]]) -> list[int]:
    """Value of something combinational for each of several inputs."""
    m = Module()
    made = output(m)
    result = Signal(made.shape())
    m.d.comb += result.eq(made)
    found: list[int] = []

    async def bench(ctx: Any) -> None:
        for codes in given:
            for signal, code in zip(inputs, codes, strict=True):
                ctx.set(signal, code)
            await ctx.delay(1e-9)
            found.append(ctx.get(result))

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()
    return found


@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize("bits", [3, 4, 6])
@pytest.mark.parametrize(("low", "high"), [(-4, 3), (-5, 3), (-3, 3), (-4, 2), (0, 3), (1, 3), (2, 3), (-1, 0)])
def test_limits_are_those_of_the_range(low: int, high: int, bits: int, signed: bool) -> None:
    operand = Signal(Shape(bits, signed=signed))
    codes = range(-(1 << bits - 1), 1 << bits - 1) if signed else range(1 << bits)
    g = GraphBuilder()
    graph = g.build([g.clamp(g.input("x", 0, min(codes), max(codes)), low, high)])
    found = values(
        [operand], lambda _: Cat(*limits(graph.nodes[graph.outputs[0]], operand)), [(code,) for code in codes]
    )
    assert found == [(code < low) | (code > high) << 1 for code in codes]


def test_a_bank_is_in_use_if_a_valid_sample_uses_it() -> None:
    valid, banks = [Signal(name=f"valid{k}") for k in range(2)], [Signal(name=f"bank{k}") for k in range(2)]
    given = list(product((0, 1), repeat=4))
    used = [{bank for there, bank in zip(row[:2], row[2:], strict=True) if there} for row in given]
    found = values([*valid, *banks], lambda _: banks_in_use(valid, banks), given)
    assert found == [sum(1 << bank for bank in row) for row in used]


CONSTANTS = (1, -1, 4, 3, -3, 5, 45, -45, 105, -208, 683, -683)


@pytest.mark.parametrize(("low", "high"), [(-16, 15), (0, 31), (-3, 11), (2, 9), (-7, -2)])
def test_all_products_of_all_codes(low: int, high: int) -> None:
    operand = Signal(Shape(max(low.bit_length(), high.bit_length()) + (low < 0), signed=low < 0))
    codes = range(low, high + 1)
    for k, constant in enumerate(CONSTANTS):

        def product_by(m: Module, k: int = k) -> Value:
            return multiples(m, operand, Range(0, low, high), CONSTANTS, "x")[k]

        assert values([operand], product_by, [(code,) for code in codes]) == [constant * code for code in codes]


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
    core = ARCHITECTURES["parallel"](datapath(), channels, blocks=Blocks(0))
    assert list(map(len, core.adders)) == [3]
    samples = [(chance.randrange(channels), [chance.choice((-128, 127, chance.randint(-128, 127)))]) for _ in range(90)]
    states = [recursion().reset() for _ in range(channels)]
    wanted = [(channel, *recursion().step(codes, states[channel])) for channel, codes in samples]
    assert [(beat.channel, beat.code) for beat in run_core(core, samples, Pace())] == wanted


def test_the_text_names_the_sums_and_has_no_product() -> None:
    text = to_verilog(to_rtlil(ARCHITECTURES["parallel"](datapath(), blocks=Blocks(0)).component(), "small"))
    assert "*" not in re.sub(r"\(\*.*?\*\)|/\*.*?\*/", "", text)
    for name in ("v1_times_11", "v1_times_minus_7", "x_times_43"):
        kept = rf"\n *wire (?:signed )?\[\d+:0\] {name};\n  \(\* keep = 32'd1 \*\)\n  wire {name}_top;\n"
        assert re.search(kept, text), name


def test_a_loadable_constant_needs_a_multiplier() -> None:
    assert not any(ARCHITECTURES["parallel"](datapath(), reload=True, blocks=Blocks(0)).adders)


def test_sums_may_have_more_than_63_bits() -> None:
    x = Signal(Shape(64, signed=True))
    known, codes = Range(0, -(2**63), 2**63 - 1), [2**63 - 1, -1, -(2**63)]
    found = values([x], lambda m: multiples(m, x, known, [85], "x")[0], [(code,) for code in codes])
    assert found == [85 * code for code in codes]
