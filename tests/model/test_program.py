"""A datapath's program computes what its graphs compute, in the words and the accumulator that it states."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.gen.designs import ALL, example_design

from sosmith.model.datapath import Datapath
from sosmith.model.program import HAZARD, Do, FoldingError, Instruction, Program, digits_of, program

FOLDABLE = ("df1", "df1_ef1", "df1_ef2", "df2t", "delta", "state_space")
READS = {Do.MULTIPLY, Do.OPERAND, Do.PRODUCT, Do.GIVE}
WRITES = {Do.TAKE, Do.STORE, Do.FINISH}


def stimulus(datapath: Datapath, samples: int) -> np.ndarray:
    """Noise, then both rails."""
    rng = np.random.default_rng(7)
    columns = [rng.integers(port.lowest, port.highest + 1, samples) for port in datapath.inputs]
    codes = np.stack(columns, axis=1)
    codes[samples // 2 : samples * 3 // 4] = [port.lowest for port in datapath.inputs]
    codes[samples * 3 // 4 :] = [port.highest for port in datapath.inputs]
    return codes


def run(made: Program, datapath: Datapath, codes: np.ndarray) -> list[int]:
    graph = datapath.stages[0].graph
    fracs = [graph.nodes[i].frac for i in graph.inputs]
    words = made.reset()
    given_out = [made.step(sample, words, fracs) for sample in codes.tolist()]
    return [min(max(code, datapath.output.lowest), datapath.output.highest) for code in given_out]


@pytest.mark.parametrize("digit_bits", [8, 15, 17])
@pytest.mark.parametrize("realization", FOLDABLE)
@pytest.mark.parametrize("example", ALL)
def test_a_program_computes_the_same_codes(example: str, realization: str, digit_bits: int) -> None:
    datapath = example_design(example, realization=realization).datapath
    codes = stimulus(datapath, 60)
    assert run(program(datapath, digit_bits), datapath, codes) == datapath.compute_exact(codes)


def test_a_wrong_constant_is_noticed() -> None:
    datapath = example_design("audio_lowpass.toml", realization="df1_ef2").datapath
    made = program(datapath, 15)
    place = next(k for k, (do, _, constant) in enumerate(made.instructions) if do is Do.MULTIPLY and constant > 1000)
    do, address, constant = made.instructions[place]
    wrong = [*made.instructions]
    wrong[place] = Instruction(do, address, constant // 2)
    codes = stimulus(datapath, 60)
    assert run(replace(made, instructions=tuple(wrong)), datapath, codes) != datapath.compute_exact(codes)


@pytest.mark.parametrize("realization", FOLDABLE)
def test_what_is_read_was_stored_long_enough_before(realization: str) -> None:
    made = program(example_design("flange_wear_locomotive.toml", realization=realization).datapath, 15)
    stored = {}
    for k, (do, address, _) in enumerate(made.instructions):
        if do in READS and address in stored:
            assert k - stored[address] >= HAZARD
        if do in WRITES:
            stored[address] = k
    assert made.instructions[-1].do is Do.GIVE


@pytest.mark.parametrize("digit_bits", [10, 15])
def test_constants_and_words_fit_the_multiplier(digit_bits: int) -> None:
    made = program(example_design("flange_wear_locomotive.toml", realization="df1_ef2").datapath, digit_bits)
    limit = 1 << digit_bits
    assert all(-limit <= constant < limit for _, _, constant in made.instructions)
    assert {address for do, address, _ in made.instructions if do in WRITES}.isdisjoint({made.one})
    places = sorted(made.places, key=lambda place: place.address)
    ends = [place.address + place.digits for place in places]
    starts = [end + (end == made.one) for end in [0, *ends[:-1]]]  # the word of ones lies behind the states
    assert [place.address for place in places] == starts
    assert {place.is_state for place in places if place.address < made.one} == {True}
    assert {place.is_state for place in places if place.address > made.one} == {False}
    assert made.words == ends[-1]


def test_an_accumulator_that_is_too_narrow_is_noticed() -> None:
    datapath = example_design("audio_lowpass.toml", realization="df1_ef2").datapath
    made = program(datapath, 15)
    with pytest.raises(OverflowError, match=r"^the accumulator must stay within 24 bits, not -?\d+$"):
        run(replace(made, accumulator_bits=24), datapath, stimulus(datapath, 60))


def test_truncation_cannot_be_folded() -> None:
    datapath = example_design("audio_lowpass.toml", realization="normal").datapath
    with pytest.raises(FoldingError, match=r"^the datapath must not truncate inside to be folded$"):
        program(datapath, 15)


def test_serial_clocks_are_those_of_the_constants_bits() -> None:
    """One clock a bit, the sign's included; what is left of a negative constant ends as -1."""
    base = program(example_design("audio_lowpass.toml", realization="df1_ef2").datapath, 15)

    def clocks(do: Do, constant: int = 0) -> int:
        return replace(base, instructions=(Instruction(do, 1, constant),)).serial_cycles

    found = {constant: clocks(Do.MULTIPLY, constant) for constant in (1, 2, 3, 4, 32767, -1, -2, -3, -4, -32768)}
    assert found == {1: 1, 2: 2, 3: 2, 4: 3, 32767: 15, -1: 1, -2: 2, -3: 3, -4: 3, -32768: 16}
    assert [clocks(do) for do in (Do.STORE, Do.GIVE, Do.NOTHING, Do.PRODUCT)] == [1, 1, 1, 16]


@given(st.integers(-(1 << 44), (1 << 44) - 1))
def test_digits_make_the_code(code: int) -> None:
    digits = digits_of(code, 3, 15)
    assert sum(digit * Fraction(2) ** (15 * k) for k, digit in enumerate(digits)) == code
    assert all(0 <= digit < 1 << 15 for digit in digits[:-1])
    assert -(1 << 15) <= digits[-1] < 1 << 15
