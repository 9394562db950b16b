"""An instruction's code, which files and hosts make in integers, against the fields that the hardware reads."""

import random

import pytest
from tests.gen.designs import example_design

from sosmith.hdl.instruction import instruction_layout
from sosmith.hdl.plan.instructions import encoded, instruction_bits
from sosmith.model.dataflow.folding.fold import program
from sosmith.model.dataflow.program import Instruction, Opcode


@pytest.mark.parametrize("products", [1, 2])
@pytest.mark.parametrize("digit_bits", [4, 15])
def test_the_hardware_reads_what_was_encoded(digit_bits: int, products: int) -> None:
    datapath = example_design("flange_wear_bench.toml", realization="df1_ef2").datapath
    made = program(datapath, digit_bits, products=products)
    layout, rng = instruction_layout(made), random.Random(digit_bits)
    assert layout.size == instruction_bits(made)
    ends = range(-1 << digit_bits, 1 << digit_bits)

    def fields() -> list[int]:
        return [rng.randrange(made.words), rng.choice(ends), rng.randrange(made.words)]

    drawn = [Instruction(opcode, *fields(), *fields()[:2]) for opcode in Opcode]
    last = made.words - 1
    extremes = Instruction(max(Opcode), last, ends[0], last, last, ends[0]), Instruction(Opcode(0), 0, -1, 0, 0, -1)
    for instruction in (*drawn, *extremes):
        code = encoded(instruction, made)
        assert layout.const({name: getattr(instruction, name) for name in layout.members}).as_bits() == code
        assert 0 <= code < 1 << layout.size
