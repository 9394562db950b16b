"""Counts of operators, and multiplier blocks as Yosys makes them."""

from pathlib import Path

import pytest

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.gen.word_lengths.cost import (
    LUTS_OF_A_BLOCK,
    Cost,
    Multiplication,
    Operand,
    area_of,
    cost_of,
    cost_of_graphs,
)
from sosmith.model.dataflow.graph import Graph, GraphBuilder
from sosmith.verify.verdict.operators import operators

BLOCKS = [
    # signed data, positive constant: the constant takes a sign bit
    (True, 18, 18, 1),
    (True, 19, 18, 1),
    (True, 20, 18, 2),
    (True, 37, 18, 2),
    (True, 38, 18, 3),
    (True, 18, 19, 2),
    (True, 20, 19, 4),
    # signed data, negative constant; its bits are those of its absolute value
    (True, 19, -18, 1),
    (True, 20, -18, 2),
    (True, 19, -19, 2),
    (True, 40, -19, 6),
    # unsigned data, positive constant: no sign anywhere
    (False, 19, 18, 1),
    (False, 19, 19, 1),
    (False, 20, 19, 2),
    (False, 36, 20, 4),
    # unsigned data, negative constant: the data take a sign bit
    (False, 18, -18, 1),
    (False, 19, -18, 2),
    (False, 36, -18, 2),
    (False, 37, -18, 3),
]
"""Sign and bits of the data, bits of the constant, and MULT18X18D that Yosys 0.70 takes (`synth_ecp5`)."""


def scaled(signed: bool, data: int, constant: int) -> Graph:
    """One multiplication by a constant of so many bits, negative if they are."""
    low, high = (-(1 << (data - 1)), (1 << (data - 1)) - 1) if signed else (0, (1 << data) - 1)
    value = (1 << abs(constant)) - 1
    g = GraphBuilder()
    return g.build([g.scale(g.input("x", 0, low, high), value if constant > 0 else -value, 0, "p")])


@pytest.mark.parametrize(("signed", "data", "constant", "blocks"), BLOCKS)
def test_blocks_of_a_multiplication(signed: bool, data: int, constant: int, blocks: int) -> None:
    cost = cost_of_graphs([scaled(signed, data, constant)])
    assert cost.multiplier_blocks == blocks
    assert cost.splits == blocks - 1


@pytest.mark.parametrize(
    ("signed", "data", "constant", "extra"),
    [
        (True, 18, 18, 0),  # the constant's sign bit is always 0
        (True, 19, 18, 18),
        (False, 19, 18, 18),
        (False, 19, -17, 0),  # with a sign bit two bits more, which take a block
        (True, 19, -18, 19 + 19),
        (True, 37, 16, 16),
    ],
)
def test_one_bit_more_is_added(signed: bool, data: int, constant: int, extra: int) -> None:
    assert cost_of_graphs([scaled(signed, data, constant)]).extra_bits == extra


def test_what_is_counted() -> None:
    """An adder, a truncation, which adds, a state, and the register behind the stage."""
    g = GraphBuilder()
    x = g.input("x", 4, -128, 127)
    state = g.delay("s", 4, -128, 127)
    total = g.add(x, state)
    g.connect(state, g.bound(total, -128, 127, "s_next"))
    graph = g.build([g.truncate(total, 0, "y")])
    cost = cost_of_graphs([graph])
    assert cost.multipliers == ()
    assert cost.multiplier_sizes == "none"
    assert cost.adder_bits == 9 + 9
    assert cost.register_bits == 8 + graph.nodes[graph.outputs[0]].width
    assert cost.area == cost.luts


def test_the_area_of_a_graph_adds_up() -> None:
    graphs = [scaled(True, 20, 12), scaled(False, 40, -19)]
    whole = cost_of_graphs(graphs).area
    assert abs(sum(map(area_of, graphs)) - whole) <= 1
    assert whole >= (2 + 6) * LUTS_OF_A_BLOCK
    assert cost_of_graphs([]).area == 0


def test_sizes_for_people() -> None:
    sizes = ((16, 19), (23, 18), (23, 18))
    made = tuple(Multiplication(Operand(a, True), Operand(b, False)) for a, b in sizes)
    cost = Cost(multiplications=made, adder_bits=0, register_bits=0)
    assert cost.multipliers == sizes
    assert cost.multiplier_sizes == "2 of 23 x 18, 1 of 16 x 19"


def test_gates_whose_upper_bits_nobody_needs_count_like_sums() -> None:
    """Far from 0, a sample and the first one differ in their lower bits alone; the verifier counts by itself."""
    text = """
name = "far"
sample_rate = 100.0
input.x = { bits = 8, range = [100.0, 101.0] }
filter.taps = [0.5, 0.5]
output = { bits = 6, range = [0.0, 128.0] }
"""
    core = design_core(from_text(text, Path("far.toml")))
    counted = operators(certificate(core.quantized, core.spec.max_error).stages)
    assert counted.adder_bits == cost_of(core.datapath).adder_bits
