"""A recursion that several channels take turns in: its schedule, its states, and what goes through it."""

import random
from itertools import pairwise
from typing import Any

import pytest
from amaranth.hdl import Module, Signal, Value
from amaranth.sim import Simulator
from tests.formal.small import leaky, limiter
from tests.gen.designs import example_design
from tests.hdl.core_bench import Pace, run_core

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.hdl.check_bits import CheckBits, Read
from sosmith.hdl.plan.interleaving import schedule
from sosmith.hdl.plan.pipeline import is_block_product
from sosmith.hdl.stages import interleaved
from sosmith.hdl.stages.interleaved import InterleavedStage
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op

REALIZATIONS = ("df1_ef2", "df2t", "delta", "state_space", "normal", "lattice_wdf")


def graphs(realization: str) -> list[Graph]:
    return [stage.graph for stage in example_design("flange_wear_bench.toml", realization=realization).datapath.stages]


@pytest.mark.sweep(15)
@pytest.mark.parametrize("channels", [2, 3, 5, 8, 16, 17, 64])
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_every_value_is_there_before_it_is_used(realization: str, channels: int) -> None:
    for graph in graphs(realization):
        plan = schedule(graph, channels)
        assert plan.distance <= channels
        assert plan.reading == (0 if channels == 2 else 1 if channels <= 16 else 2)
        for index, node in enumerate(graph.nodes):
            assert 0 <= plan.pipeline_stages[index] < plan.depth
            if node.op is Op.DELAY:
                addressed = plan.pipeline_stages[index] - plan.reading  # where the memory is addressed
                assert addressed >= 0
                assert plan.writes[index] >= addressed + max(plan.reading - 1, 0)  # block RAM: not while it is read
                source = plan.pipeline_stages[node.operands[0]]
                assert source + max(plan.reading - 1, 0) <= plan.writes[index] <= plan.depth
                continue
            assert all(plan.pipeline_stages[i] <= plan.pipeline_stages[index] for i in node.operands)
        assert all(plan.pipeline_stages[i] < plan.depth for i in graph.outputs)


def test_more_channels_make_a_deeper_pipeline() -> None:
    section = graphs("df1_ef2")[-2]
    depths = [schedule(section, channels).depth for channels in (2, 3, 8)]
    assert all(few <= more for few, more in pairwise(depths))
    assert depths[0] < depths[-1]


def damped() -> tuple[Graph, int, int, int, int]:
    """Return a recursion through a product, and the nodes of the sum before it, the product, and two sums behind."""
    g = GraphBuilder()
    x, y1 = g.input("x", 0, -2, 1), g.delay("y1", 0, -8, 7)
    before = g.subtract(x, y1)
    product = g.scale(before, 3, 2)
    behind = g.add(x, g.floor(product, 0))
    last = g.add(behind, x)
    g.connect(y1, g.bound(last, -8, 7))
    return g.build([y1]), int(before), int(product), int(behind), int(last)


def test_a_product_of_a_block_has_registers_on_both_sides_where_the_loop_has_the_clocks() -> None:
    graph, before, product, behind, _ = damped()
    assert is_block_product(graph, graph.nodes[product])
    for channels, clocks in ((3, (0, 1)), (8, (1, 1))):
        places = schedule(graph, channels).pipeline_stages
        assert (places[product] - places[before], places[behind] - places[product]) == clocks


def test_a_product_of_adders_leaves_time_for_several_sums() -> None:
    """No register can shorten it."""
    graph, _, product, behind, last = damped()
    for adders, clocks in (((), 1), ((product,), 0)):
        places = schedule(graph, 8, adders=adders).pipeline_stages
        assert places[last] - places[behind] == clocks


@pytest.mark.parametrize("channels", [2, 3, 17])
def test_every_channel_has_a_state_of_its_own(channels: int) -> None:
    """In memories that are read at once, and in those of LUTs and of blocks, which are read a clock later."""
    chance = random.Random(1)
    samples = [(chance.randrange(channels), [chance.randint(-2, 1)]) for _ in range(5 * channels)]
    before = [0] * channels
    expected = []
    for channel, (code,) in samples:
        expected.append((channel, min(max(code + before[channel], -2), 1)))
        before[channel] = code
    found = run_core(ARCHITECTURES["parallel"](limiter(), channels), samples, Pace())
    assert [(beat.channel, beat.code) for beat in found] == expected


class Findings(CheckBits):
    """Check bits that find wrong what a test says."""

    failed: Signal

    def read(self, m: Module, word: Value, name: str) -> Read:
        """Take a word apart."""
        return super().read(m, word, name)._replace(failed=self.failed)


def test_what_is_found_wrong_goes_with_what_has_read_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fault from before the stage, too; and a scrub leaves the stage as a sample does."""
    section = leaky().stages[0]
    monkeypatch.setattr(Findings, "failed", Signal(), raising=False)
    monkeypatch.setattr(interleaved, "CheckBits", Findings)
    dut: Any = InterleavedStage(section, 3, protect="detect")
    depth = dut.schedule.depth
    reads = next(dut.schedule.pipeline_stages[delay] for delay in section.graph.delays)
    seen: list[tuple[int, int]] = []

    async def bench(ctx: Any) -> None:
        ctx.set(dut.advance, 1)
        for clock in range(4 * depth):
            ctx.set(dut.i_scrub, clock == 0)
            ctx.set(dut.i_fault, clock == depth)
            ctx.set(Findings.failed, clock == 2 * depth + reads)
            seen.append((ctx.get(dut.o_scrub), ctx.get(dut.o_fault)))
            await ctx.tick()

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert [clock for clock, (scrub, _) in enumerate(seen) if scrub] == [depth]
    assert [clock for clock, (_, fault) in enumerate(seen) if fault] == [2 * depth, 3 * depth]


def test_channel_and_bank_leave_with_their_sample() -> None:
    dut: Any = InterleavedStage(leaky().stages[0], 3)
    depth = dut.schedule.depth
    chance = random.Random(2)
    went_in = [(1, clock % 3, chance.randrange(2)) for clock in range(3 * depth)]
    came_out: list[tuple[int, int, int]] = []

    async def bench(ctx: Any) -> None:
        ctx.set(dut.advance, 1)
        for valid, channel, bank in went_in:
            for name, value in (("valid", valid), ("channel", channel), ("bank", bank)):
                ctx.set(getattr(dut, f"i_{name}"), value)
            came_out.append(tuple(ctx.get(getattr(dut, f"o_{name}")) for name in ("valid", "channel", "bank")))
            await ctx.tick()

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert [valid for valid, *_ in came_out[:depth]] == [0] * depth
    assert came_out[depth:] == went_in[:-depth]


@pytest.mark.parametrize(("coefficient", "fits"), [((1 << 18) - 1, True), (-(1 << 16), True), (-(1 << 17), False)])
def test_the_sign_of_a_coefficient_counts_among_its_bits(coefficient: int, fits: bool) -> None:
    """With 19 bits it takes more than a block."""
    g = GraphBuilder()
    product = g.scale(g.input("x", 0, -2, 1), coefficient, 18)
    graph = g.build([product])
    assert is_block_product(graph, graph.nodes[product]) is fits
