"""Beats of several samples, and loops that take turns, proven: the rules of the streams, and every result."""

from pathlib import Path
from types import ModuleType

import pytest
from amaranth.hdl import Cat, Module, Value
from tests.formal.prover import broken, prove
from tests.formal.small import distant, leaky, limiter, reference_of_beats
from tests.formal.stream_rules import StreamRules

from sosmith.hdl.cores import block as block_core
from sosmith.hdl.plan import look_ahead as plan
from sosmith.hdl.plan import parallel_clocks
from sosmith.hdl.plan.unfolding import unfolded_stages
from sosmith.hdl.stages import look_ahead
from sosmith.model.dataflow.datapath import Datapath


class BlockRules(StreamRules):
    """The same of a core whose beats hold several samples."""

    def results(self, m: Module, datapath: Datapath, taken: Value) -> tuple[Value, Value]:
        """Return what the offered beat gives, and where the output shows it."""
        bits, lanes = datapath.inputs[0].bits, self.design.lanes
        codes = [self.design.s_axis_tdata[8 * k :][:bits].as_signed() for k in range(lanes)]
        found = reference_of_beats(m, datapath, codes, taken, self.reset)
        shown = [self.design.m_axis_tdata[8 * k : 8 * k + 8].as_signed() for k in range(lanes)]
        shapes = datapath.output.bits
        return Cat(*(one.as_unsigned()[:shapes] for one in found)), Cat(*(one[:shapes] for one in shown))


def rules(
    datapath: Datapath, lanes: int, *, ahead: bool, module: ModuleType = block_core, order: bool = True
) -> BlockRules:
    """Rules of a core; without `order`, those of the handshake alone."""
    products = plan.Products.of_adders(unfolded_stages(datapath, lanes)) if ahead else None
    latency = parallel_clocks.block_latency_cycles(datapath, lanes, products)
    design = module.BlockCore(datapath, lanes, products=products)
    return BlockRules(design, latency + 1, patience=latency, datapath=datapath if order else None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("datapath", "lanes", "ahead"),
    [
        (leaky(), 2, False),
        (limiter(), 2, False),
        (limiter(), 2, True),
        (distant(2), 1, True),
    ],
)
def test_beats_keep_the_rules_and_every_sample(datapath: Datapath, lanes: int, ahead: bool, tmp_path: Path) -> None:
    assert prove(rules(datapath, lanes, ahead=ahead), tmp_path, timeout=600) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(("turns", "lanes"), [(3, 1), (4, 2), (4, 1)])
def test_longer_turns_keep_the_rules_and_every_sample(turns: int, lanes: int, tmp_path: Path) -> None:
    assert prove(rules(distant(turns), lanes, ahead=True), tmp_path, timeout=2400) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("self.s_axis_tready.eq(advance)", "self.s_axis_tready.eq(1)"),  # beats taken and dropped
        ("Sample(self.s_axis_tvalid)", "Sample(Const(1, 1))"),  # beats out of nothing
        ("samples = [self.s_axis_tdata[size * k : size * (k + 1)]", "samples = [self.s_axis_tdata[:size]"),
        ("self.hand_out(m, buffer, beat.valid, results)", "self.hand_out(m, buffer, beat.valid, results[::-1])"),
    ],
)
def test_a_broken_core_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    wrong_core = broken(block_core, right, wrong)
    assert prove(rules(leaky(), 2, ahead=False, module=wrong_core), tmp_path, timeout=600) == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (
            "with m.If(self.advance & self.i_valid):\n            m.d.sync += turn.eq",
            "with m.If(self.advance):\n            m.d.sync += turn.eq",
        ),
        (
            "read.data.as_unsigned() & warms[own - 1].replicate(node.width)",
            "read.data",
        ),  # what was before a reset comes back
        ('Signal(name="warm")', 'Signal(name="warm", init=1)'),
        ("write.addr.eq(turns[written])", "write.addr.eq(turns[own])"),
        ("self.advance & valid[written]),\n            ]", "self.advance),\n            ]"),
        ("with m.If(self.advance & valid[stage]):", "with m.If(self.advance):"),  # a delay moves without a sample
    ],
)
def test_a_broken_turn_is_found_out(right: str, wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = broken(look_ahead, right, wrong)
    monkeypatch.setattr(block_core, "LookAheadStage", module.LookAheadStage)
    assert prove(rules(distant(3), 1, ahead=True), tmp_path, timeout=600) == "FAIL"


@pytest.mark.slow
def test_a_loop_that_is_too_long_for_its_turns_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = broken(plan, "for time in tried if _fits(graph, turns, loops, time, wired=False)", "for time in tried")
    monkeypatch.setattr(block_core, "plans", wrong.plans)
    monkeypatch.setattr(parallel_clocks, "plans", wrong.plans)
    assert prove(rules(distant(2), 1, ahead=True), tmp_path, timeout=600) == "FAIL"
