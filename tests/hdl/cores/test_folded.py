"""The folded and serial cores against exact integers: every length of a program, resets, loads, scrubbing, upsets."""

from __future__ import annotations

import random
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from tests.formal.small import leaky, limiter
from tests.hdl.bus.reload_benches import crc_of
from tests.hdl.core_bench import Pace, run_core, simulate
from tests.hdl.folded_bench import Line, Model, Probed, Result, Sample
from tests.verify.program.programs import small
from tests.verify.small_specifications import INSTRUMENT

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.hdl.plan import folded_clocks
from sosmith.hdl.plan.instructions import encoded
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.fold import program
from sosmith.model.dataflow.graph import GraphBuilder
from sosmith.model.dataflow.program import Opcode, Program
from sosmith.model.dataflow.status import Flag
from sosmith.model.port import Port
from sosmith.model.reload.registers import CRC, DATA, FAULTS, VERSION, Register
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage

FAULT = 1 << Flag.FAULT


def port(name: str, bits: int, *, signed: bool) -> Port:
    return Port(name=name, bits=bits, signed=signed, lsb=Fraction(1), zero=Fraction(0))


def mixer() -> Datapath:
    """Make ``v(n) = floor8((a b + a(n-1) - 3/4 v(n-1)) * 8) / 8``, limited to nine bits, with all five flags."""
    g = GraphBuilder()
    a, b = g.input("a", 0, 0, 31), g.input("b", 0, -8, 7)
    v1 = g.delay("v1", 3, -4096, 4095)
    total = g.add(g.multiply(a, b, "product"), g.add(g.scale(v1, -3, 2), g.previous(a, "a1")))
    v = g.bound(g.floor(total, 3), -4096, 4095, "v")
    g.connect(v1, v)
    graph, y = g.build([v]), port("y", 9, signed=True)
    last = OutputStage(offset=0, offset_frac=0, x=graph.nodes[graph.outputs[0]].range, low=y.lowest, high=y.highest)
    return Datapath(
        name="mixer",
        inputs=(port("a", 5, signed=False), port("b", 4, signed=True)),
        output=y,
        stages=(HornerStep("sum", graph), last),
        calibrated=((3, 28), (-7, 6)),
        wear=((40, 100), (0, 1), (-50, 200), (7, 8), (-1, 90)),
    )


def lowpass(share: int) -> Datapath:
    """Make ``y(n) = floor(share / 8 y(n-1) + x(n))``."""
    g = GraphBuilder()
    x, y1 = g.input("x", 0, -8, 7), g.delay("y1", 0, -64, 63)
    y = g.bound(g.floor(g.add(g.scale(y1, share, 3), x), 0), -64, 63, "y")
    g.connect(y1, y)
    stages = (HornerStep("sum", g.build([y])),)
    return Datapath(
        name="lowpass", inputs=(port("x", 4, signed=True),), output=port("y", 7, signed=True), stages=stages
    )


def some(datapath: Datapath, count: int, channels: int, seed: int = 1) -> list[Sample]:
    """Draw samples, each of any channel."""
    chance = random.Random(seed)
    return [
        (chance.randrange(channels), [chance.randint(p.lowest, p.highest) for p in datapath.inputs])
        for _ in range(count)
    ]


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("serial", "channels", "protect", "products"),
    [
        (False, 1, "none", 1),
        (False, 1, "detect", 1),
        (False, 3, "none", 1),
        (False, 5, "correct", 1),
        (True, 1, "none", 1),
        (True, 3, "correct", 1),
        (False, 1, "none", 2),
        (False, 1, "detect", 2),
        (False, 3, "none", 2),
        (False, 5, "correct", 2),
    ],
)
def test_every_sample_at_any_pace(serial: bool, channels: int, protect: str, products: int) -> None:
    """Samples of channels that do not exist are dropped."""
    datapath = mixer()
    made = program(datapath, 3, products=products)
    dut = Probed(datapath, made, serial=serial, channels=channels, protect=protect)
    samples = some(datapath, 40, channels if channels == 1 else 1 << (channels - 1).bit_length())
    expected = Model(datapath, made, channels).results(made, samples)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut, 0.3, 0.3)
        line.put(samples)
        assert await line.finish(len(expected)) == expected

    simulate(dut, testbench)


@pytest.mark.parametrize("share", [-8, -5, -1, 3, 7])
def test_a_serial_core_multiplies_by_factors_of_either_sign(share: int) -> None:
    datapath = lowpass(share)
    made = program(datapath, 3)
    dut = Probed(datapath, made, serial=True)
    samples = some(datapath, 12, 1)
    expected = Model(datapath, made, 1).results(made, samples)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut, 0.0, 0.0)
        line.put(samples)
        assert await line.finish(len(expected)) == expected

    simulate(dut, testbench)


@pytest.mark.parametrize("protect", ["none", "detect"])
@pytest.mark.parametrize("serial", [False, True])
def test_a_sample_is_accepted_at_the_clock_that_is_stated(serial: bool, protect: str) -> None:
    datapath = lowpass(5)
    made = program(datapath, 3)
    dut = Probed(datapath, made, serial=serial, protect=protect)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut)
        for sample in some(datapath, 3, 1):
            await line.wait(100)  # all words have been cleared, and the sample before has left
            line.put([sample])
            await line.wait(folded_clocks.taken_cycles(made, serial=serial, protect=protect))
            assert line.waiting == 1
            await line.wait(1)
            assert line.waiting == 0

    simulate(dut, testbench)


def test_flags_of_a_filter_that_starts_from_zero() -> None:
    """Settling for as long as it is stated, and outside the calibration by the codes alone."""
    design = small(INSTRUMENT).design
    inside = replace(design.datapath, calibrated=((500, 3500), (0, 1023)))
    codes = np.stack([np.linspace(p.lowest, p.highest, 40).astype(int) for p in inside.inputs], axis=1)
    results, flags = inside.compute_with_status(codes[:, np.newaxis])
    found = run_core(ARCHITECTURES["folded"](inside), [(0, row) for row in codes.tolist()], Pace())
    assert [(beat.code, beat.status) for beat in found] == list(
        zip(results[:, 0].tolist(), flags[:, 0].tolist(), strict=True)
    )
    for flag in (Flag.SETTLING, Flag.OUTSIDE_CALIBRATION):
        assert {*(flags >> flag & 1).ravel().tolist()} == {0, 1}


@pytest.mark.slow
def test_a_result_waits_for_longer_than_the_next_sample_takes() -> None:
    """Its code and its flags stay, though the next sample has begun."""
    datapath = mixer()
    made = program(datapath, 3)
    assert folded_clocks.overlaps(made, serial=False)
    dut = Probed(datapath, made, serial=False)
    samples = some(datapath, 40, 1)
    expected = Model(datapath, made, 1).results(made, samples)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut, stall=0.99)
        line.put(samples)
        assert await line.finish(len(expected)) == expected

    simulate(dut, testbench)


@pytest.mark.parametrize("protect", ["none", "detect"])
@pytest.mark.parametrize("count", [15, 16, 17, 18, 33])
def test_every_length_of_a_program(count: int, protect: str) -> None:
    """A counter is as wide as the last address of a program needs; one clock more is one clock more."""
    datapath = limiter()
    made = program(datapath, 3).padded(count)
    dut = Probed(datapath, made, serial=False, protect=protect)
    samples = some(datapath, 4, 1)
    expected = Model(datapath, made, 1).results(made, samples)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut)
        await line.wait(folded_clocks.reset_cycles(made, 1) + 5)
        line.put(samples)
        start = line.clocks
        assert await line.finish(len(expected)) == expected
        rate = folded_clocks.cycles_per_sample(made, serial=False, protect=protect)
        latency = folded_clocks.latency_cycles(made, serial=False, protect=protect)
        assert line.clocks - start - 3 == 3 * rate + latency + 1

    simulate(dut, testbench)


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("serial", "channels"), [(False, 1), (False, 2), (False, 5), (True, 3)])
def test_a_reset_in_mid_run_clears_every_channel(serial: bool, channels: int) -> None:
    datapath = mixer()
    made = program(datapath, 3)
    dut = Probed(datapath, made, serial=serial, channels=channels)
    before, after = some(datapath, 3 * channels, channels), [(c, [9, -5]) for c in (*range(channels), 0)]
    expected = Model(datapath, made, channels).results(made, after)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut)
        for clocks in (3, 17, 40):
            line.put([(c, [31, 7]) for c in range(channels)])
            await line.finish(channels)
            line.put(before)
            await line.wait(clocks)
            await line.reset()
            line.put(after)
            assert await line.finish(len(after)) == expected

    simulate(dut, testbench)


@pytest.mark.parametrize("protect", ["none", "detect", "correct"])
def test_memories_hold_at_power_up_what_a_reset_leaves(protect: str) -> None:
    """Words of 6 bits in slices of 8, which is what 320 of them with their check bits are cut into."""
    datapath = limiter()
    made = program(datapath, 5)
    dut = Probed(datapath, made, serial=False, channels=-(-320 // made.words), protect=protect)

    async def testbench(ctx: Any) -> None:
        names = [f"words{low}" for low in range(0, {"none": 6, "detect": 7, "correct": 11}[protect], 8)]
        before = [[ctx.get(word) for word in dut.memory(name)] for name in names]
        for name in names:
            for word in dut.memory(name):
                ctx.set(word, 3)
        await Line(ctx, dut).wait(folded_clocks.reset_cycles(made, dut.channels) + 2)
        assert [[ctx.get(word) for word in dut.memory(name)] for name in names] == before
        assert [value & 63 for value in before[0][: made.words]] == made.reset()

    simulate(dut, testbench)


@pytest.mark.parametrize("serial", [False, True])
def test_flags_of_a_result_that_needs_no_limit(serial: bool) -> None:
    datapath = replace(leaky(), wear=((-1, 0),))
    made = program(datapath, 3)
    dut = Probed(datapath, made, serial=serial)
    samples = some(datapath, 20, 1)
    expected = Model(datapath, made, 1).results(made, samples)
    assert {result.status >> Flag.WEAR_WARNING for result in expected} == {0, 1, 3}

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut)
        line.put(samples)
        assert await line.finish(len(expected)) == expected

    simulate(dut, testbench)


def test_two_wrong_bits_of_limits_change_nothing_that_waits() -> None:
    """The limits are read once for each result."""
    datapath = mixer()
    made = program(datapath, 3)
    dut = Probed(datapath, made, serial=False, channels=5, protect="detect")
    samples = [(3, [20, 5])] * 3
    expected = Model(datapath, made, 5).results(made, samples)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut, stall=1.0)
        line.put(samples[:1])
        while not ctx.get(dut.m_axis_tvalid):
            await line.wait(1)
        await line.wait(2)
        dut.damage(ctx, "wear_limits", 3, 4)
        await line.wait(5)  # which checks that the result stays
        line.stall = 0.0
        line.put(samples[1:])
        first, *others = await line.finish(3)
        assert first == expected[0]
        assert all(result.status & FAULT for result in others)

    simulate(dut, testbench)


def taken_over(model: Model, programs: tuple[Program, Program], samples: list[Sample], found: list[Result]) -> Model:
    """Return the model after samples of which some first ones were of one program, and the others of the next."""
    for count in range(len(samples) + 1):
        tried = deepcopy(model)
        if tried.results(programs[1], samples[count:]) == found[count:]:
            return tried
        assert model.results(programs[0], samples[count : count + 1]) == found[count : count + 1]
    raise AssertionError("a program that was loaded must take over")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("serial", "count", "protect"),
    [(False, 16, "none"), (False, 17, "none"), (True, 15, "correct"), (False, 18, "detect")],
)
def test_another_program_takes_over_between_two_samples(serial: bool, count: int, protect: str) -> None:
    """Three times, so that each bank is loaded and used."""
    datapath = lowpass(5)
    plain = program(datapath, 3, spare_words=8)
    first = replace(plain, accumulator_bits=plain.accumulator_bits + 2)
    others = [program(lowpass(share), 3, like=first).padded(count) for share in (-6, 3, 7)]
    first = first.padded(count)
    dut = Probed(datapath, first, serial=serial, channels=2, fingerprint=7, protect=protect)

    async def testbench(ctx: Any) -> None:
        line, model, now = Line(ctx, dut, 0.1, 0.1), Model(datapath, first, 2), first
        for version, new in enumerate(others, 1):
            words = [encoded(instruction, new) for instruction in new.instructions]
            samples: list[Sample] = []
            for register, word in loading(version, words):
                line.put(more := some(datapath, 1, 2, seed=len(samples)))
                samples += more
                await line.write(register.address, word)
            found = await line.finish(len(samples))
            model = taken_over(model, (now, new), samples, found)
            now = new
            samples = some(datapath, 5, 2, seed=version)
            line.put(samples)
            assert await line.finish(5) == model.results(now, samples)

    simulate(dut, testbench)


@pytest.mark.slow
def test_a_program_that_judges_inputs_takes_over_from_one_that_does_not() -> None:
    datapath = lowpass(5)
    plain = program(datapath, 3, spare_words=8)
    judging = program(replace(lowpass(3), calibrated=((-4, 3),)), 3, like=plain)
    assert [any(i.opcode is Opcode.JUDGE for i in one.instructions) for one in (plain, judging)] == [False, True]
    first, new = (one.padded(len(judging.instructions)) for one in (plain, judging))
    dut = Probed(datapath, first, serial=False, fingerprint=7)
    samples = some(datapath, 12, 1)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut, 0.0, 0.0)
        for register, word in loading(1, [encoded(instruction, new) for instruction in new.instructions]):
            await line.write(register.address, word)
        line.put(samples)
        found = await line.finish(len(samples))
        assert found == Model(datapath, new, 1).results(new, samples)
        assert {result.status >> Flag.OUTSIDE_CALIBRATION & 1 for result in found} == {0, 1}

    simulate(dut, testbench)


def loading(version: int, words: list[int]) -> list[tuple[Register, int]]:
    """List the writes that load a program."""
    return [(VERSION, version), *((DATA, word) for word in words), (CRC, crc_of(version, words))]


@pytest.mark.slow
@pytest.mark.parametrize(("channels", "count"), [(1, 33), (3, 40)])
def test_the_scrubber_mends_all_words_while_the_core_waits(channels: int, count: int) -> None:
    """One bit of every word of both memories at a time, also the last instruction and words that are not used."""
    datapath = limiter()
    made = program(datapath, 3).padded(count)
    dut = Probed(datapath, made, serial=False, channels=channels, fingerprint=7, protect="correct")
    samples = some(datapath, 6, channels)
    expected = Model(datapath, made, channels).results(made, samples)

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut)
        line.put(samples[:3])
        assert await line.finish(3) == expected[:3]
        addresses = [("words0", k) for k in range(made.words * channels)] + [("instructions", k) for k in range(count)]
        before = [ctx.get(dut.memory(name)[k]) for name, k in addresses]
        for bit in range(8):
            for name, k in addresses:
                dut.damage(ctx, name, k, (bit + k) % 8)
            for _ in range(68):  # a round of 64 addresses, and what is in the pipeline
                await line.wait(1)
                assert dut.reads_a_word(ctx)
            assert [ctx.get(dut.memory(name)[k]) for name, k in addresses] == before
        faults = await line.read(FAULTS.address)
        assert FAULTS.field("CORRECTED").of(faults) >= 8 * count  # those found at one clock count once
        assert FAULTS.field("UNCORRECTED").of(faults) == 0
        line.put(samples[3:])
        assert await line.finish(3) == expected[3:]

    simulate(dut, testbench)


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("name", "serial", "protect"),
    [
        ("words0", False, "correct"),
        ("words0", True, "detect"),
        ("instructions", False, "detect"),
        ("instructions", False, "correct"),
    ],
)
def test_a_damaged_word_gives_no_wrong_result_without_a_flag(name: str, serial: bool, protect: str) -> None:
    """At any clock, with samples waiting: words are cleared after the first result that has the flag, or before it."""
    datapath = mixer()
    made = program(datapath, 3)
    dut = Probed(datapath, made, serial=serial, channels=3, protect=protect)
    samples = some(datapath, 5, 3)
    expected = Model(datapath, made, 3).results(made, samples)
    chance = random.Random(1)
    flagged = []

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut, stall=0.2)
        for _ in range(7):
            await line.reset()
            line.put(samples)
            await line.wait(folded_clocks.reset_cycles(made, 3) + chance.randrange(80))
            state = chance.randrange(3) * made.words + chance.randrange(made.states)
            address = state if name == "words0" else chance.randrange(len(made.instructions))
            bits = chance.sample(range(8), 1 if protect == "detect" else 2)
            dut.damage(ctx, name, address, *bits)
            found = await line.finish(len(samples))
            faults = [bool(result.status & FAULT) for result in found]
            first = faults.index(True) if any(faults) else len(found)
            assert found[:first] == expected[:first]
            assert all(faults[first:])
            flagged.append(any(faults))
            if name == "instructions":
                dut.damage(ctx, name, address, *bits)
            else:
                cleared = [result._replace(status=result.status & ~FAULT) for result in found]
                assert any(cleared[k:] == fresh(datapath, made, samples[k:]) for k in (first, first + 1))

    simulate(dut, testbench)
    assert sum(flagged) > 3


def fresh(datapath: Datapath, made: Program, samples: list[Sample]) -> list[Result]:
    """Results of three channels from a reset on."""
    return Model(datapath, made, 3).results(made, samples)


def test_two_wrong_bits_count_and_are_acknowledged() -> None:
    datapath = limiter()
    made = program(datapath, 3)
    dut = Probed(datapath, made, serial=False, fingerprint=7, protect="correct")

    async def testbench(ctx: Any) -> None:
        line = Line(ctx, dut)
        await line.wait(60)
        dut.damage(ctx, "words0", 1, 0, 2)
        await line.wait(60)
        for flag in (FAULT, 0):
            line.put([(0, [0])])
            ((_, _, status),) = await line.finish(1)
            assert status & FAULT == flag
            faults = await line.read(FAULTS.address)
            assert (FAULTS.field("CORRECTED").of(faults), FAULTS.field("UNCORRECTED").of(faults)) == (0, flag // FAULT)
            await line.write(FAULTS.address, 0)

    simulate(dut, testbench)
