"""Architectures: what is taken and why, and what cannot keep up."""

import json
import re
from dataclasses import replace
from fractions import Fraction

import pytest
from tests.formal.small import limiter
from tests.gen.architectures.one_filter import design_in
from tests.gen.designs import EXAMPLES, example_design

from sosmith.gen.architectures.budget import Budget
from sosmith.gen.architectures.registry import ARCHITECTURES, fitting
from sosmith.gen.core import design_core
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.manifest import manifest
from sosmith.gen.specification.specification import load
from sosmith.hdl.plan.instructions import instruction_bits
from sosmith.model.errors import ShortfallError


@pytest.mark.parametrize("architecture", ["folded", "serial"])
def test_one_unit_for_all(architecture: str) -> None:
    made = design_in(architecture)
    program = made.architecture.program
    assert program is not None
    is_folded = architecture == "folded"
    latency = len(program.instructions) + 5 if is_folded else program.serial_cycles + 3
    clocks = len(program.instructions) if is_folded else latency  # folded begins a sample before the result has left
    tree = manifest(core_facts(made))
    assert tree["architecture"] == architecture
    assert tree["latency_cycles"] == latency
    assert tree["cycles_per_sample"] == clocks
    assert made.reasons["architecture"] == (
        f"{architecture}: asked for in the specification; takes {clocks:,} of 2,083 clocks a sample"
    )
    schedule = json.loads(json.dumps(tree["schedule"]))
    assert [[i.opcode.mnemonic, i.address, i.constant, i.target] for i in program.instructions] == schedule[
        "instructions"
    ]
    assert sum(count for _, _, count in program.schedule) == len(program.instructions)
    assert [name for name, _, _ in program.schedule][:: len(program.schedule) - 1] == ["input", "output"]


def test_the_smallest_that_keeps_up_is_taken() -> None:
    made = example_design("audio_lowpass.toml")
    needed = made.architecture.cycles_per_sample
    available = int(made.spec.hardware.clock / made.spec.sample_rate)
    assert made.reasons["architecture"] == (
        f"folded: the smallest that keeps up; takes {needed:,} of {available:,} clocks a sample"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("board", "architecture", "there"),
    [
        ("icestick", "serial", "icestick, whose iCE40 HX1K has no multipliers"),
        ("icebreaker", "folded", "icebreaker, whose iCE40 UP5K has 8 multipliers"),
        ("ulx3s_25f", "folded", "ulx3s_25f, whose ECP5 LFE5U-25F has 28 multipliers"),
    ],
)
def test_the_board_s_multipliers_count(board: str, architecture: str, there: str) -> None:
    made = design_core(load(EXAMPLES / "flange_wear_locomotive.toml"), realization="df1_ef2", board=find_board(board))
    needed = made.architecture.cycles_per_sample
    assert made.reasons["architecture"] == (
        f"{architecture}: the smallest that keeps up on {there}; takes {needed:,} of 120,000 clocks a sample"
    )


@pytest.mark.parametrize(
    ("architecture", "board", "digit_bits"),
    [
        ("folded", None, 15),
        ("folded", "icebreaker", 15),
        ("folded", "ulx3s_25f", 17),
        ("folded", "tang_nano_9k", 15),
        ("serial", "ulx3s_25f", 15),
    ],
)
def test_digits_are_as_wide_as_the_multipliers_of_the_board(
    architecture: str, board: str | None, digit_bits: int
) -> None:
    budget = Budget(clock=Fraction(10**8), sample_rate=Fraction(48_000))
    made = fitting(ARCHITECTURES[architecture], budget, limiter(), None if board is None else find_board(board))
    assert made.program is not None
    assert made.program.digit_bits == digit_bits


def test_an_instruction_that_can_be_loaded_fits_a_register() -> None:
    datapath = example_design("flange_wear_locomotive.toml", realization="df1_ef2").datapath
    made = ARCHITECTURES["folded"](datapath, reload=True, digit_bits=17).program
    assert made is not None
    assert (made.digit_bits, instruction_bits(made)) == (15, 32)
    fixed = ARCHITECTURES["folded"](datapath, digit_bits=17).program
    assert fixed is not None
    assert (fixed.digit_bits, instruction_bits(fixed)) == (17, 34)


@pytest.mark.slow
def test_what_folding_cannot_keep_up_with_is_parallel() -> None:
    spec = load(EXAMPLES / "audio_lowpass.toml")
    made = design_core(replace(spec, channels=64))
    assert made.architecture.name == "parallel"
    assert re.fullmatch(
        r"parallel: none of the 8 realizations meets the specification: .*the folded architecture takes [\d,]+ clocks "
        r"a sample: at a clock of [\d,]+ Hz with 64 channels the sample rate must be at most [\d,.]+ Hz, not 48,000 Hz",
        made.reasons["architecture"],
    )
    assert (manifest(core_facts(made))["cycles_per_sample"], manifest(core_facts(made))["schedule"]) == (1, None)


@pytest.mark.slow
def test_a_clock_that_nothing_keeps_up_with_is_refused() -> None:
    spec = load(EXAMPLES / "audio_lowpass.toml")
    with pytest.raises(
        ShortfallError,
        match=r"the parallel architecture takes 1 clock a sample: at a clock of [\d,]+ Hz with 60,000 channels the "
        r"sample rate must be at most [\d,.]+ Hz, not 48,000 Hz$",
    ):
        design_core(replace(spec, channels=60_000))


@pytest.mark.parametrize(("architecture", "clock"), [("folded", 3_000_000), ("serial", 12_000_000)])
def test_an_architecture_that_cannot_keep_up_says_what_it_could_do(architecture: str, clock: int) -> None:
    with pytest.raises(
        ShortfallError,
        match=rf"^the {architecture} architecture takes ([\d,]+) clocks a sample: at a clock of {clock:,} Hz the "
        r"sample rate must be at most ([\d,.]+) Hz, not 48,000 Hz$",
    ) as refusal:
        design_in(architecture, clock=clock)
    words = re.search(r"takes ([\d,]+) clocks.* at most ([\d,.]+) Hz", str(refusal.value))
    assert words is not None
    needed, most = (float(word.replace(",", "")) for word in words.groups())
    assert most == pytest.approx(clock / needed, rel=1e-5)
    made = design_in(architecture, clock=int(needed) * 48_000)
    assert made.architecture.cycles_per_sample == needed


@pytest.mark.parametrize(
    ("clock", "rate", "most", "wanted"),
    [
        ("119999.99999999", "10000", "9,999.99", "10,000"),
        ("60000", "10000", "5,000", "10,000"),
        ("7", "10000", "0.583333", "10,000"),
        ("11", "10000", "0.916666", "10,000"),
        ("34156.9452", "2846.4123", "2,846.4121", "2,846.4123"),
        ("3000000", "1000000", "250,000", "1,000,000"),
    ],
)
def test_the_rate_that_it_could_do_is_never_rounded_up(clock: str, rate: str, most: str, wanted: str) -> None:
    architecture = design_in("parallel").architecture
    with pytest.raises(ShortfallError, match=rf"must be at most {most} Hz, not {wanted} Hz$"):
        Budget(clock=Fraction(clock), sample_rate=Fraction(rate), channels=12).check(architecture)


@pytest.mark.slow
def test_a_realization_that_cannot_be_folded_is_refused() -> None:
    datapath = example_design("audio_lowpass.toml", realization="normal").datapath
    with pytest.raises(
        ShortfallError,
        match=r"^the realization must suit the folded architecture: "
        r"the datapath must not truncate inside to be folded; parallel takes every realization$",
    ):
        fitting(ARCHITECTURES["folded"], Budget(clock=Fraction(10**8), sample_rate=Fraction(48_000)), datapath)


def test_what_the_instructions_are_there_for() -> None:
    program = example_design("audio_lowpass.toml").architecture.program
    assert program is not None
    products = [i for i in program.instructions if i.constant and i.address != program.one]
    powers = sum(abs(i.constant).bit_count() == 1 for i in products)
    text = " ".join((EXAMPLES.parent / "docs" / "hardware.md").read_text(encoding="utf-8").split())
    assert (
        f"Of the {len(program.instructions)} instructions of audio_lowpass, {powers} multiply a word by a power of two "
        f"and {len(products) - powers} by another constant"
    ) in text


@pytest.mark.parametrize(
    ("architecture", "expected"), [("parallel", 2141111839), ("folded", 3170416528), ("serial", 2376647297)]
)
def test_cores_in_the_field_keep_their_fingerprint(architecture: str, expected: int) -> None:
    """A core compares this number with that of a set: it must not follow the names in this code."""
    assert ARCHITECTURES[architecture](limiter(), reload=True).fingerprint == expected


def test_digits_of_another_width_make_another_core() -> None:
    found = {ARCHITECTURES["folded"](limiter(), reload=True, digit_bits=bits).fingerprint for bits in (14, 15, 17)}
    assert len(found) == 3


def test_slow_clocks_are_told_in_full() -> None:
    with pytest.raises(ShortfallError, match=r": at a clock of 0\.4 Hz .* must be at most 0\.4 Hz, not 7\.3 Hz$"):
        Budget(clock=Fraction("0.4"), sample_rate=Fraction("7.3"), channels=1).check(design_in("parallel").architecture)
