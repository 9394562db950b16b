"""A datapath's program computes what its graphs compute, in the words and the accumulator that it states."""

import doctest
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.formal.small import limiter
from tests.gen.designs import ALL, example_design
from tests.gen.word_lengths.filters import fir_spec, plain

from sosmith.gen.filter.design import design
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding import fold
from sosmith.model.dataflow.folding.fold import columns_of, program
from sosmith.model.dataflow.folding.values import FoldingError
from sosmith.model.dataflow.graph import GraphBuilder
from sosmith.model.dataflow.program import (
    EARLY_WRITES,
    LATE_WRITES,
    MOVED,
    STORED,
    Instruction,
    Location,
    Opcode,
    Program,
    digits_of,
)
from sosmith.model.dataflow.scheduling import ONE
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerPolynomial, Variable

FOLDABLE = ("df1", "df1_ef1", "df1_ef2", "df2t", "delta", "state_space")
WRITES = EARLY_WRITES | LATE_WRITES


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
    given_out = [made.step(sample, words, fracs).code for sample in codes.tolist()]
    return [min(max(code, datapath.output.lowest), datapath.output.highest) for code in given_out]


@pytest.mark.sweep(6)
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
    number = next(k for k, i in enumerate(made.instructions) if i.opcode is Opcode.MULTIPLY and i.constant > 1000)
    wrong = [*made.instructions]
    wrong[number] = made.instructions[number]._replace(constant=made.instructions[number].constant // 2)
    codes = stimulus(datapath, 60)
    assert run(replace(made, instructions=tuple(wrong)), datapath, codes) != datapath.compute_exact(codes)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("products", [1, 2])
@pytest.mark.parametrize("realization", FOLDABLE)
def test_what_is_read_was_stored_long_enough_before(realization: str, products: int) -> None:
    """With two products a clock all words are written at the end of the pipeline, which has one stage more."""
    datapath = example_design("flange_wear_locomotive.toml", realization=realization).datapath
    made = program(datapath, 15, products=products, trials=4 * (products - 1))
    readable = {}
    for k, (opcode, address, _, target, second_address, second_constant) in enumerate(made.instructions):
        assert k >= readable.get(address, 0)
        assert k >= readable.get(second_address, 0) or not second_constant
        assert products > 1 or (second_address, second_constant) == (0, 0)
        if opcode in WRITES and products == 1:
            readable[target] = k + (MOVED if opcode in EARLY_WRITES else STORED)
            assert k == 0 or opcode in LATE_WRITES or made.instructions[k - 1].opcode not in LATE_WRITES
        elif opcode in WRITES:
            readable[target] = k + STORED + 1
    assert made.instructions[-1].opcode is Opcode.GIVE


@pytest.mark.sweep(1)
@pytest.mark.parametrize("digit_bits", [15, 17])
@pytest.mark.parametrize("example", ["audio_lowpass.toml", "flange_wear_bench.toml"])
def test_two_products_a_clock_compute_the_same_in_fewer_clocks(example: str, digit_bits: int) -> None:
    datapath = example_design(example, realization="df1_ef1").datapath
    one, two = program(datapath, digit_bits), program(datapath, digit_bits, products=2)
    tried = program(datapath, digit_bits, products=2, trials=24)
    codes = stimulus(datapath, 60)
    assert run(two, datapath, codes) == run(tried, datapath, codes) == datapath.compute_exact(codes)
    assert len(tried.instructions) <= len(two.instructions) < 0.9 * len(one.instructions)
    assert any(i.second_constant for i in two.instructions)
    assert tried == program(datapath, digit_bits, products=2, trials=24)


def test_one_sum_has_one_order() -> None:
    datapath = plain(design(fir_spec(("0.25", "0.5", "0.25")), 1.0), "fir_direct").datapath
    assert program(datapath, 15, products=2, trials=6) == program(datapath, 15, products=2)


def test_a_wrong_second_constant_is_noticed() -> None:
    datapath = example_design("audio_lowpass.toml", realization="df1_ef2").datapath
    made = program(datapath, 15, products=2)
    number = next(k for k, i in enumerate(made.instructions) if abs(i.second_constant) > 1000)
    wrong = [*made.instructions]
    wrong[number] = wrong[number]._replace(second_constant=wrong[number].second_constant // 2)
    codes = stimulus(datapath, 60)
    assert run(replace(made, instructions=tuple(wrong)), datapath, codes) != datapath.compute_exact(codes)


@pytest.mark.parametrize("digit_bits", [10, 15])
def test_constants_and_words_fit_the_multiplier(digit_bits: int) -> None:
    made = program(example_design("flange_wear_locomotive.toml", realization="df1_ef2").datapath, digit_bits)
    limit = 1 << digit_bits
    assert all(-limit <= instruction.constant < limit for instruction in made.instructions)
    assert all(i.target < made.one for i in made.instructions if i.opcode in WRITES)
    states = [address for location in made.locations if location.is_state for address in location.addresses]
    assert states == [*range(made.states)]
    assert all(address < made.one for location in made.locations for address in location.addresses)
    assert made.words == made.one + 1 == 1 << made.one.bit_length()


def test_words_are_used_again() -> None:
    made = program(example_design("flange_wear_locomotive.toml", realization="df1_ef2").datapath, 15)
    others = [location for location in made.locations if not location.is_state]
    used = {address for location in made.locations for address in location.addresses}
    assert used == {*range(max(used) + 1)}
    assert len(used) - made.states < sum(location.digits for location in others)


def test_the_schedule_covers_the_program() -> None:
    made = program(example_design("flange_wear_locomotive.toml", realization="df1_ef2").datapath, 15)
    ends = [start + count for _, start, count in made.schedule]
    assert [start for _, start, _ in made.schedule] == [0, *ends[:-1]]
    assert ends[-1] == len(made.instructions)


def test_an_accumulator_that_is_too_narrow_is_noticed() -> None:
    datapath = example_design("audio_lowpass.toml", realization="df1_ef2").datapath
    made = program(datapath, 15)
    with pytest.raises(OverflowError, match=r"^the accumulator must stay within 24 bits, not -?\d+$"):
        run(replace(made, accumulator_bits=24), datapath, stimulus(datapath, 60))


@given(
    st.integers(-(1 << 40), 1 << 40).filter(bool),
    st.integers(0, 50),
    st.integers(-30, 30),
    st.integers(-(1 << 30), 1 << 30),
    st.integers(0, 50),
    st.sampled_from([4, 15]),
)
def test_columns_begin_where_the_exact_sum_does(
    coefficient: int, frac: int, shift: int, constant: int, constant_frac: int, digit_bits: int
) -> None:
    """The columns of ``floor(c x 2**shift + k)`` against the same sum in rationals."""
    g = GraphBuilder()
    x = g.input("x", frac=0, low=-8, high=7)
    total = g.add(g.shift(g.scale(x, coefficient, frac), shift), g.constant(constant, constant_frac))
    columns = columns_of(g.build([g.bound(g.floor(total, 0), -(1 << 99), 1 << 99, "y")]), digit_bits)
    slope, offset = coefficient * Fraction(2) ** (shift - frac), Fraction(constant, 1 << constant_frac)
    below = -(-(max(slope.denominator, offset.denominator).bit_length() - 1) // digit_bits)
    assert sum(column.end is Opcode.DROP for column in columns) == below
    end = 1 + next(k for k, column in enumerate(columns) if column.end is Opcode.FINISH)
    for code in (-8, -1, 0, 5, 7):
        found = sum(
            product.constant * (1 if product.digit == ONE else code) << (digit_bits * k)
            for k, column in enumerate(columns[:end])
            for product in column.products
        )
        wrong = Fraction(found, 1 << (digit_bits * below)) - slope * code - offset
        assert wrong % (2 << (digit_bits * (end - below))) == 0  # FINISH keeps one bit beyond the top digit's


def test_a_constant_cannot_be_folded() -> None:
    x = Port(name="x", bits=8, signed=False, lsb=Fraction(1), zero=Fraction(0))
    variables = (Variable(name="x", bits=8),)
    stages = HornerPolynomial(coefficients=((5,),), frac=0, variables=variables).stages
    datapath = Datapath(name="five", inputs=(x,), output=x, stages=stages)
    with pytest.raises(FoldingError, match=r"^the datapath must not give a constant to be folded$"):
        program(datapath, 15)


@pytest.mark.slow
def test_truncation_cannot_be_folded() -> None:
    datapath = example_design("audio_lowpass.toml", realization="normal").datapath
    with pytest.raises(FoldingError, match=r"^the datapath must not truncate inside to be folded$"):
        program(datapath, 15)


def test_serial_clocks_are_those_of_the_constants_bits() -> None:
    """One clock a bit, the sign's included; what is left of a negative constant ends as -1."""
    base = program(example_design("audio_lowpass.toml", realization="df1_ef2").datapath, 15)

    def clocks(opcode: Opcode, constant: int = 0) -> int:
        return replace(base, instructions=(Instruction(opcode, 1, constant),)).serial_cycles

    found = {constant: clocks(Opcode.MULTIPLY, constant) for constant in (1, 2, 3, 4, 32767, -1, -2, -3, -4, -32768)}
    assert found == {1: 1, 2: 2, 3: 2, 4: 3, 32767: 15, -1: 1, -2: 2, -3: 3, -4: 3, -32768: 16}
    assert [clocks(opcode) for opcode in (Opcode.STORE, Opcode.GIVE, Opcode.PRODUCT, Opcode.PRODUCT_STORE)] == [
        1,
        1,
        16,
        16,
    ]


@given(st.integers(-(1 << 44), (1 << 44) - 1))
def test_digits_make_the_code(code: int) -> None:
    digits = digits_of(code, 3, 15)
    assert sum(digit * Fraction(2) ** (15 * k) for k, digit in enumerate(digits)) == code
    assert all(0 <= digit < 1 << 15 for digit in digits[:-1])
    assert -(1 << 15) <= digits[-1] < 1 << 15


def test_a_padded_program_does_nothing_first() -> None:
    datapath = example_design("audio_lowpass.toml", realization="df1_ef2").datapath
    made = program(datapath, 15)
    count = len(made.instructions)
    padded = made.padded(count + 7)
    assert padded.instructions == (*[Instruction(Opcode.MULTIPLY, made.one)] * 7, *made.instructions)
    codes = stimulus(datapath, 20)
    assert run(padded, datapath, codes) == datapath.compute_exact(codes)
    with pytest.raises(ValueError, match=rf"^a program must have at most {count - 1} instructions, not {count}$"):
        made.padded(count - 1)


def test_a_program_takes_over_only_where_everything_fits() -> None:
    datapath = example_design("audio_lowpass.toml", realization="df1_ef2").datapath
    made = program(datapath, 15)
    assert program(datapath, 15, like=made) == made
    roomy = replace(made, words=made.words + 3, accumulator_bits=made.accumulator_bits + 2)
    taken = program(datapath, 15, like=roomy)
    assert (taken.words, taken.accumulator_bits) == (roomy.words, roomy.accumulator_bits)
    for changed, message in (
        ({"accumulator_bits": 20}, rf"bits of the accumulator must be at most 20, not {made.accumulator_bits}"),
        ({"words": 5}, rf"words of memory must be at most 5, not {made.words}"),
        ({"digit_bits": 14}, "digit_bits must be 14, not 15"),
        ({"locations": ()}, r"its states must be \[\], not \[.*\]"),
        ({"inputs": ()}, r"digits and fraction bits of its inputs must be \[\], not \[.*\]"),
    ):
        with pytest.raises(FoldingError, match=rf"^to take over, {message}$"):
            program(datapath, 15, like=replace(made, **changed))


def test_a_state_keeps_its_digits() -> None:
    """A program that would need fewer digits for a state takes as many as before: the upper ones hold its sign."""
    datapath = example_design("audio_lowpass.toml", realization="df1_ef2").datapath
    made = program(datapath, 15)

    def wider_at(name: str) -> tuple[Location, ...]:
        return tuple(replace(p, addresses=(*p.addresses, *[99] * (p.name == name))) for p in made.locations)

    with pytest.raises(FoldingError, match=r"^to take over, its states must be .*$"):
        program(
            datapath, 15, like=replace(made, locations=wider_at("section1.v1"))
        )  # the locations behind it would have to move
    last = [p for p in made.locations if p.is_state][-1].name
    more = next(p.digits for p in made.locations if p.name == last) + 1
    wider = tuple(
        replace(p, addresses=(*p.addresses, p.addresses[-1] + 1)) if p.name == last else p for p in made.locations
    )
    taken = program(datapath, 15, like=replace(made, locations=wider, words=2 * made.words))
    assert next(p.digits for p in taken.locations if p.name == last) == more
    codes = stimulus(datapath, 20)
    assert run(taken, datapath, codes) == datapath.compute_exact(codes)


def test_the_accumulator_holds_a_word_however_small_the_sums() -> None:
    made = program(limiter(), 15)
    assert made.accumulator_bits == 16


def test_the_worked_example_is_true() -> None:
    results = doctest.testmod(fold)
    assert results.attempted > 0
    assert results.failed == 0
