"""What pipeline stages have in common, for all inputs there are."""

from collections.abc import Callable
from itertools import product
from typing import Any

import pytest
from amaranth.hdl import Cat, Module, Shape, Signal, Value
from amaranth.sim import Simulator

from sosmith.hdl.pipelined_logic import banks_in_use, limits
from sosmith.model.dataflow.graph import GraphBuilder


def values(inputs: list[Signal], output: Callable[[], Value], given: list[tuple[int, ...]]) -> list[int]:
    """Value of something combinational for each of several inputs."""
    m = Module()
    made = output()
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
    found = values([operand], lambda: Cat(*limits(graph.nodes[graph.outputs[0]], operand)), [(code,) for code in codes])
    assert found == [(code < low) | (code > high) << 1 for code in codes]


def test_a_bank_is_in_use_if_a_valid_sample_uses_it() -> None:
    valid, banks = [Signal(name=f"valid{k}") for k in range(2)], [Signal(name=f"bank{k}") for k in range(2)]
    given = list(product((0, 1), repeat=4))
    used = [{bank for there, bank in zip(row[:2], row[2:], strict=True) if there} for row in given]
    found = values([*valid, *banks], lambda: banks_in_use(valid, banks), given)
    assert found == [sum(1 << bank for bank in row) for row in used]
