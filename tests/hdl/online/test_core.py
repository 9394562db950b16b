"""Cores in on-line arithmetic in Amaranth's simulator: the graph's results, at any pace, after the stated clocks."""

import random
from dataclasses import replace
from functools import cache
from itertools import pairwise
from types import ModuleType
from typing import Any

import pytest
from tests.formal.prover import broken
from tests.gen.designs import EXAMPLES
from tests.hdl.core_bench import Pace, run_core, simulate

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import from_text, load
from sosmith.hdl.online import cascade
from sosmith.hdl.online import core as online
from sosmith.model.dataflow.datapath import Datapath

PACES = {"full": Pace(idle=0, stall=0), "slow source": Pace(idle=0.93, stall=0.2), "slow sink": Pace(stall=0.7)}


@cache
def audio(realization: str, start: str = "steady", bits: int = 16) -> Architecture:
    spec = load(EXAMPLES / "audio_lowpass.toml")
    if bits != 16:
        spec = from_text(spec.text.replace("bits = 16", f"bits = {bits}"), EXAMPLES / "audio_lowpass.toml")
    hardware = replace(spec.hardware, architecture="online", realization=realization, start=start)
    return design_core(replace(spec, hardware=hardware)).architecture


@cache
def made(kind: str, order: int) -> Architecture:
    """Make a filter with one to three sections and few bits, whose sections keep different numbers of digits."""
    spec = load(EXAMPLES / "audio_lowpass.toml")
    text = spec.text.replace("bits = 16", "bits = 6").replace("order = 5", f"order = {order}")
    text = text.replace('kind = "lowpass"', f'kind = "{kind}"').replace("cutoff = 1000.0", "cutoff = 9000.0")
    found = from_text(text, EXAMPLES / "audio_lowpass.toml")
    return design_core(replace(found, hardware=replace(found.hardware, architecture="online"))).architecture


def samples(datapath: Datapath, count: int) -> list[list[int]]:
    rng = random.Random(1)
    (port,) = datapath.inputs
    ends = (port.lowest, port.highest)
    return [[rng.choice([rng.randint(*ends), *ends])] for _ in range(count)]


def check(architecture: Architecture, count: int, pace: Pace) -> None:
    datapath = architecture.datapath
    codes = samples(datapath, count)
    wanted = datapath.compute_exact(codes)
    found = run_core(architecture, [(0, row) for row in codes], pace)
    assert [beat.code for beat in found] == wanted
    assert [beat.status for beat in found] == datapath.compute_status(codes).tolist()


@pytest.mark.sweep(1)
@pytest.mark.parametrize("pace", PACES.values(), ids=PACES)
@pytest.mark.parametrize("realization", ["df1", "df1_ef1", "df1_ef2"])
def test_results_are_those_of_the_graph(realization: str, pace: Pace) -> None:
    check(audio(realization), 40, pace)


@pytest.mark.slow
def test_a_filter_that_starts_from_zero() -> None:
    check(audio("df1_ef1", "zero"), 60, Pace())


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("kind", "order"), [("lowpass", 1), ("lowpass", 2), ("highpass", 3), ("highpass", 5)])
def test_other_filters(kind: str, order: int) -> None:
    check(made(kind, order), 100, Pace())


@pytest.mark.slow
@pytest.mark.parametrize(("realization", "bits"), [("df1", 16), ("df1", 24), ("df1_ef2", 16)])
def test_latency_and_interval_are_as_stated(realization: str, bits: int) -> None:
    architecture = audio(realization, bits=bits)
    accepted, left = clocks(online.OnlineCore(architecture.datapath), 10)
    assert {b - a for a, b in pairwise(accepted)} == {architecture.cycles_per_sample}
    assert {b - a for a, b in zip(accepted, left, strict=True)} == {architecture.latency_cycles}
    assert architecture.cycles_per_sample <= 8


def clocks(dut: Any, count: int) -> tuple[list[int], list[int]]:
    """Clocks at which a core takes samples and hands on results, if both sides are always ready."""
    accepted: list[int] = []
    left: list[int] = []

    async def bench(ctx: Any) -> None:
        ctx.set(dut.aresetn, 1)
        ctx.set(dut.m_axis_tready, 1)
        clock = 0
        while len(left) < count:
            ctx.set(dut.s_axis_tvalid, len(accepted) < count)
            if ctx.get(dut.s_axis_tvalid) and ctx.get(dut.s_axis_tready):
                accepted.append(clock)
            if ctx.get(dut.m_axis_tvalid):
                left.append(clock)
            await ctx.tick("bench")
            clock += 1

    simulate(dut, bench)
    return accepted, left


def after_reset(dut: Any, codes: list[list[int]], clock: int) -> list[int]:
    """Results for samples after a reset of one clock, which comes while others are inside."""
    results: list[int] = []

    async def bench(ctx: Any) -> None:
        ctx.set(dut.aresetn, 1)
        ctx.set(dut.m_axis_tready, 1)
        ctx.set(dut.s_axis_tvalid, 1)
        ctx.set(dut.s_axis_tdata, 0x7FFF)
        await ctx.tick("bench").repeat(clock)
        ctx.set(dut.aresetn, 0)
        await ctx.tick("bench")
        ctx.set(dut.aresetn, 1)
        taken = 0
        while len(results) < len(codes):
            ctx.set(dut.s_axis_tvalid, taken < len(codes))
            ctx.set(dut.s_axis_tdata, codes[min(taken, len(codes) - 1)][0] & 0xFFFF)
            taken += taken < len(codes) and ctx.get(dut.s_axis_tready)
            if ctx.get(dut.m_axis_tvalid):
                code = ctx.get(dut.m_axis_tdata)
                results.append(code - (code >> 15 << 16))
            await ctx.tick("bench")

    simulate(dut, bench)
    return results


@pytest.mark.sweep(1)
@pytest.mark.parametrize("clock", [50, 53, 61, 75])
def test_a_reset_of_one_clock_leaves_nothing_behind(clock: int) -> None:
    datapath = audio("df1_ef1", "zero").datapath
    codes = samples(datapath, 6)
    assert after_reset(online.OnlineCore(datapath), codes, clock) == datapath.compute_exact(codes)


@pytest.mark.slow
def test_what_a_reset_leaves_behind_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = broken(
        cascade,
        'f"{own}_increment")',
        'f"{own}_increment", reset_less=True)',
        ('f"{name}_early")', 'f"{name}_early", reset_less=True)'),
    )
    monkeypatch.setattr(online, "OnlineCascade", wrong.OnlineCascade)
    datapath = audio("df1_ef1", "zero").datapath
    codes = samples(datapath, 1)
    found = (after_reset(online.OnlineCore(datapath), codes, clock) for clock in range(74, 81))
    assert any(results != datapath.compute_exact(codes) for results in found)


@pytest.mark.slow
@pytest.mark.parametrize("bits", [16, 24])
def test_a_very_low_cutoff_takes_no_more_clocks(bits: int) -> None:
    """By area alone, its sections would get inputs of more fraction bits than outputs: 9 clocks, and fewer units."""
    spec = load(EXAMPLES / "flange_wear_locomotive.toml")
    text = spec.text.replace("bits = 16", f"bits = {bits}").replace("0.00025 ", '"faithful" ')
    found = from_text(text, EXAMPLES / "flange_wear_locomotive.toml")
    hardware = replace(found.hardware, architecture="online")
    made = design_core(replace(found, hardware=hardware), core="filter")
    schedule = made.architecture.online
    assert schedule is not None
    assert schedule.interval == made.architecture.cycles_per_sample == 7
    assert "LUT4 times clocks, from " in made.reasons["realization"]
    assert f" in {schedule.units} units a section and 7 clocks a sample" in made.reasons["realization"]


def test_interval_and_latency_of_a_section_do_not_depend_on_the_word_length() -> None:
    short, long = (audio("df1", bits=bits).online for bits in (16, 24))
    assert short is not None
    assert long is not None
    assert short.interval == long.interval == 7
    assert all(b.digits > a.digits + 6 for a, b in zip(short.sections, long.sections, strict=True))
    assert [b - a for a, b in pairwise(short.starts)] == [b - a for a, b in pairwise(long.starts)]


FAULTS = {
    "a digit of the sample before comes a clock late": (
        "waits = self.schedule.interval - section.delay - 3",
        "waits = 1",
    ),
    "an empty slot counts as a sample": ("valid = tags[q][0]", "valid = Const(1, 1)"),
    "an empty slot changes the error that is fed back": ("(now & there for now, there", "(now for now, there"),
    "the last digit does not look at the one before": ("half ^ odd", "half"),
    "a residual is not cleared": (
        "pairs[q].step(m, increment, selects, final[q])",
        "pairs[q].step(m, increment, selects, Const(0, 1))",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_fault_is_found(fault: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    wrong: ModuleType = broken(cascade, *fault)
    monkeypatch.setattr(online, "OnlineCascade", wrong.OnlineCascade)
    with pytest.raises(AssertionError):  # without a message, as tests run with plain assertions
        check(audio("df1_ef2"), 60, PACES["slow source"])
