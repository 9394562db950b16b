"""The compiled model against the exact interpreter, and what a datapath refuses."""

import ctypes
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from tests.model.datapaths import INPUT, OUTPUT, butterworth, cascade

from sosmith.model.dataflow import compiled
from sosmith.model.dataflow.c_model import c_header, c_source, state_bytes
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import GraphBuilder, Range
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerPolynomial, HornerStep, Variable


@pytest.mark.sweep(2)
@pytest.mark.parametrize("order", [1, 2, 5, 7])
@pytest.mark.parametrize("feedback", [0, 1, 2])
def test_compiled_model_equals_exact_integers(order: int, feedback: int) -> None:
    datapath = cascade(butterworth(order, 0.01), feedback=feedback)
    rng = np.random.default_rng(order)
    codes = rng.integers(-32768, 32768, (1500, 1))
    codes[700:] = 32767  # a step at full scale, which the overshoot saturates
    assert datapath.compute(codes).tolist() == datapath.compute_exact(codes)


def test_runs_shorter_than_the_chain_of_stages() -> None:
    datapath = cascade(butterworth(7, 0.2))
    codes = np.random.default_rng(4).integers(-32768, 32768, (14, 1))
    expected = datapath.compute_exact(codes)
    for samples in range(15):
        assert datapath.compute(codes[:samples]).tolist() == expected[:samples]


def test_channels_are_independent() -> None:
    datapath = cascade(butterworth(3, 0.05))
    codes = np.random.default_rng(5).integers(-32768, 32768, (500, 4, 1))
    together = datapath.compute(codes)
    assert together.shape == (500, 4)
    for channel in range(4):
        assert together[:, channel].tolist() == datapath.compute(codes[:, channel]).tolist()


@pytest.mark.parametrize("samples", [1428, 1429, 1430, 2860, 4001])
def test_channels_in_turns_go_on_where_they_were(samples: int) -> None:
    """Twelve channels take turns of 1,429 samples."""
    datapath = cascade(butterworth(3, 0.05))
    codes = np.random.default_rng(6).integers(-32768, 32768, (samples, 12, 1))
    together, status = datapath.compute(codes), datapath.compute_status(codes)
    for channel in range(12):
        assert together[:, channel].tolist() == datapath.compute(codes[:, channel]).tolist()
        assert status[:, channel].tolist() == datapath.compute_status(codes[:, channel]).tolist()


def test_values_wider_than_a_machine_word_stay_exact() -> None:
    variables = (Variable(name="x", bits=31, signed=True),)
    horner = HornerPolynomial(coefficients=((3,), (-(1 << 40) + 1,), (1 << 41,)), frac=40, variables=variables)
    node = horner.stages[-1].graph.nodes[horner.stages[-1].graph.outputs[0]]
    g = GraphBuilder()
    last = HornerStep("last", g.build([g.clamp(g.floor(g.input("x", 40, node.low, node.high), 0), -128, 127)]))
    port = Port.from_range("x", 31, Fraction(-1), Fraction(1), signed=True)
    output = Port.from_range("y", 8, Fraction(-1), Fraction(1), signed=True)
    wide = max(n.width for stage in horner.stages for n in stage.graph.nodes)
    assert wide > 64
    datapath = Datapath(name="wide", inputs=(port,), output=output, stages=(*horner.stages, last))
    codes = np.random.default_rng(1).integers(-(1 << 30), 1 << 30, (300, 1))
    assert datapath.compute(codes).tolist() == datapath.compute_exact(codes)


def of_one_input(g: GraphBuilder, wire: int, bits: int) -> Datapath:
    """Close a graph whose input x has so many bits without sign, and limit `wire` to an output of eight bits."""
    stage = HornerStep("only", g.build([g.clamp(g.floor(wire, 0), -128, 127)]))
    return Datapath(
        name="edge",
        inputs=(Port.from_range("x", bits, Fraction(0), Fraction(1)),),
        output=Port.from_range("y", 8, Fraction(-1), Fraction(1), signed=True),
        stages=(stage,),
    )


def test_values_without_sign_that_fill_a_machine_word_stay_exact() -> None:
    """The types of C are signed: 64 bits without a sign take 65 there."""
    g = GraphBuilder()
    x = g.input("x", 0, 0, (1 << 30) - 1)
    product = g.scale(x, (1 << 34) - 1, 0)
    assert (g[product].signed, g[product].width) == (False, 64)
    datapath = of_one_input(g, g.shift(product, -58), 30)
    codes = np.array([[0], [1], [(1 << 29) - 1], [1 << 29], [(1 << 30) - 1]])
    assert datapath.compute(codes).tolist() == datapath.compute_exact(codes) == [0, 0, 31, 31, 63]


@pytest.mark.parametrize("bits", [15, 16, 17, 31, 32])
@pytest.mark.parametrize("signed", [False, True])
def test_values_at_the_ends_of_a_type_of_32_bits_stay_exact(bits: int, signed: bool) -> None:
    """Products and sums that just fit 32 bits, and those that just do not, at the ends of what goes in."""
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    g = GraphBuilder()
    x = g.input("x", 0, low, high)
    square = g.multiply(x, x)
    triple = g.add(g.scale(x, 3, 0), g.shift(x, 5))
    whole = g.subtract(g.subtract(square, triple), g.constant((1 << 31) - 1, 0))
    stage = HornerStep("only", g.build([g.clamp(g.floor(g.shift(whole, -2 * bits + 6), 0), -128, 127)]))
    datapath = Datapath(
        name="edge",
        inputs=(Port.from_range("x", bits, Fraction(-1 if signed else 0), Fraction(1), signed=signed),),
        output=Port.from_range("y", 8, Fraction(-1), Fraction(1), signed=True),
        stages=(stage,),
    )
    codes = np.array([[low], [low + 1], [-1 if signed else 0], [1], [high - 1], [high]])
    assert datapath.compute(codes).tolist() == datapath.compute_exact(codes)


def test_a_difference_that_fits_a_type_which_its_terms_do_not_stays_exact() -> None:
    g = GraphBuilder()
    difference = g.subtract(g.input("x", 0, 0, (1 << 32) - 1), g.constant(1 << 31, 0))
    datapath = of_one_input(g, g.shift(difference, -24), 32)
    assert "(int32_t)(n0_0 - INT64_C(2147483648))" in c_source(datapath)
    codes = np.array([[0], [1], [(1 << 31) - 1], [1 << 31], [(1 << 32) - 1]])
    assert datapath.compute(codes).tolist() == datapath.compute_exact(codes) == [-128, -128, -1, 0, 127]


@pytest.mark.parametrize("order", [1, 5])
def test_the_size_of_a_state_is_that_of_the_compiler(order: int) -> None:
    datapath = cascade(butterworth(order, 0.02))
    asked = f"\nsize_t state_size(void) {{ return sizeof({datapath.name}_state); }}\n"
    library = compiled._load(datapath.name, c_header(datapath), c_source(datapath) + asked, "-O0")
    library.state_size.restype = ctypes.c_size_t
    assert library.state_size() == state_bytes(datapath)
    assert set(re.findall(r"^    (\w+) s\d+;", c_header(datapath), re.MULTILINE)) == {"int32_t", "int64_t"}


def test_shifts_by_a_whole_machine_word_leave_the_sign() -> None:
    g = GraphBuilder()
    tiny = g.shift(g.subtract(g.input("x", 0, 0, 255), g.constant(128, 0)), -70)
    datapath = of_one_input(g, tiny, 8)
    codes = np.array([[0], [127], [128], [255]])
    assert datapath.compute(codes).tolist() == datapath.compute_exact(codes) == [-1, -1, 0, 0]


def test_c_text_is_the_same_on_every_run() -> None:
    one, two = (cascade(butterworth(5, 0.02)) for _ in range(2))
    assert (c_source(one), c_header(one)) == (c_source(two), c_header(two))


def test_refusals() -> None:
    datapath = cascade(butterworth(2, 0.1))
    bad = {
        "codes must have the shape (samples, 1) or (samples, channels, 1), not (5, 2)": np.zeros((5, 2), dtype=int),
        "codes must be integers, not float64": np.zeros((5, 1)),
        "codes of x must be in -32768..32767, not 0..32768": np.array([[0], [32768]]),
    }
    for message, codes in bad.items():
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            datapath.compute(codes)
    with pytest.raises(
        ValueError, match=r"^input ports must have the ranges \[\(-32768, 32767\)\], not \[\(0, 65535\)\]$"
    ):
        replace(datapath, inputs=(Port.from_range("x", 16, Fraction(0), Fraction(1)),))
    with pytest.raises(ValueError, match=r"^the last stage's output must fit the output port, not Node\(.*\)$"):
        replace(datapath, output=Port.from_range("y", 12, Fraction(-1), Fraction(1), signed=True))
    with pytest.raises(ValueError, match=r"^input x of output_stage must hold Node\(.*\), not Node\(.*\)$"):
        replace(datapath, stages=(datapath.stages[0], replace(datapath.stages[-1], x=Range(3, 0, 1))))
    assert datapath.inputs == (INPUT,)
    assert datapath.output == OUTPUT
