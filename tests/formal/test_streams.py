"""The rules of the streams, proven: on the output buffer's faces and on those of a core in each architecture."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType

import pytest
from amaranth.hdl import Assert, Assume, Cat, Const, Module, Signal, Value
from amaranth.lib.wiring import Component, Out
from tests.formal.prover import Proof, broken, combinational_outputs, prove
from tests.formal.small import leaky, limiter, reference, resonator

from sosmith.hdl import axi_stream, core, folded
from sosmith.hdl.plan import folded_clocks, parallel_clocks
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding import program

DIGIT_BITS = 3


class StreamRules(Proof):
    """What has to hold on the faces of a design.

    - The output is not valid after a reset; once it is valid, it and all that goes with it stay until they are taken.
    - There is no output without an input before it, and never more of them on their way than the design holds.
    - While the sink is ready, an output is not longer away than `patience` clocks.
    - Each output is that of its input: of one input that the solver picks, which stands for any.

    Parameters
    ----------
    design : Component
        An output buffer, or a core.
    capacity : int
        Samples that the design holds at most.
    patience : int or None
        Clocks; None asks for no progress.
    datapath : Datapath or None
        What a core with one channel computes; None does not ask.
    source_waits : bool
        Whether the source keeps its offer until it is taken, as AXI4-Stream asks; else it may do as it likes.
    """

    def __init__(
        self,
        design: Component,
        capacity: int,
        *,
        patience: int | None = None,
        datapath: Datapath | None = None,
        source_waits: bool = False,
    ) -> None:
        super().__init__(design)
        self.capacity, self.patience, self.datapath = capacity, patience, datapath
        self.source_waits = source_waits
        self.excused: Value = Const(0, 1)
        """Whether the output may be any, as a flag beside it says."""
        self.cleared: Value = Const(0, 1)
        """Whether the core begins anew at this clock, but for a reset."""
        self.picks = self.free(1, "picks")

    def state(self, m: Module) -> None:
        """State the rules."""
        d = self.design
        if hasattr(d, "aclk"):
            taken, given = d.s_axis_tvalid & d.s_axis_tready, d.m_axis_tvalid & d.m_axis_tready
            valid, ready = d.m_axis_tvalid, d.m_axis_tready
            names = [name for name, member in d.signature.members.items() if member.flow is Out]
            payload = Cat(getattr(d, name) for name in names if name.startswith("m_axis") and name != "m_axis_tvalid")
            if self.source_waits:
                self._assume_source(m)
            if hasattr(d, "s_axis_tdest"):
                taken &= d.s_axis_tdest < d.channels  # others are dropped
        else:
            taken, given = d.i_valid & d.advance, d.o_valid & d.o_ready
            valid, ready, payload = d.o_valid, d.o_ready, d.o_data
        was_reset, stalled, before = Signal(), Signal(), Signal(len(payload))
        count = Signal(range(self.capacity + 2))
        m.d.proof += [was_reset.eq(self.reset), stalled.eq(valid & ~ready & ~self.reset), before.eq(payload)]
        m.d.proof += count.eq(count + taken - given)
        with m.If(self.reset):
            m.d.proof += count.eq(0)
        with m.If(self.started):
            with m.If(was_reset):
                m.d.comb += Assert(~valid)
            with m.If(stalled):
                m.d.comb += [Assert(valid), Assert(payload == before)]
            with m.If(valid):
                m.d.comb += Assert(count != 0)
            m.d.comb += Assert(count <= self.capacity)
        if self.patience is not None:
            self._state_progress(m, (count != 0) & ready & ~given)
        if not hasattr(d, "aclk"):
            self._state_order(m, (taken, given), count, d.i_data, d.o_data)
        elif hasattr(d, "s_axis_tdest"):
            self._state_order(m, (taken, given), count, d.s_axis_tdest, d.m_axis_tdest)
        elif self.datapath is not None:
            self._state_order(m, (taken, given), count, *self.results(m, self.datapath, taken))

    def results(self, m: Module, datapath: Datapath, taken: Value) -> tuple[Value, Value]:
        """Return what the offered input gives, and where the output shows it."""
        code = self.design.s_axis_tdata[: datapath.inputs[0].bits].as_signed()
        result = reference(m, datapath, code, taken, self.reset | self.cleared)
        return result, self.design.m_axis_tdata.as_signed()

    def _assume_source(self, m: Module) -> None:
        d = self.design
        offer = Cat(d.s_axis_tdata, d.s_axis_tdest if hasattr(d, "s_axis_tdest") else ())
        waits, before = Signal(), Signal(len(offer))
        m.d.proof += [waits.eq(d.s_axis_tvalid & ~d.s_axis_tready & ~self.reset), before.eq(offer)]
        with m.If(waits):
            m.d.comb += Assume(d.s_axis_tvalid & (offer == before))

    def _state_progress(self, m: Module, waits: Value) -> None:
        waited = Signal(range(self.patience + 1))
        m.d.proof += waited.eq(0)
        with m.If(waits & ~self.reset):
            m.d.proof += waited.eq(waited + 1)
        with m.If(self.started):
            m.d.comb += Assert(waited < self.patience)

    def _state_order(self, m: Module, moves: tuple[Value, Value], count: Value, expected: Value, output: Value) -> None:
        """Follow one sample: `ahead` are those to be given before it."""
        taken, given = moves
        follows, ahead, result = Signal(), Signal(range(self.capacity + 1)), Signal(expected.shape())
        with m.If(self.reset):
            m.d.proof += follows.eq(0)
        with m.Elif(follows & given):
            m.d.proof += [ahead.eq(ahead - 1), follows.eq(ahead != 0)]
        with m.Elif(~follows & taken & self.picks):
            m.d.proof += [follows.eq(1), ahead.eq(count - given), result.eq(expected)]
        with m.If(self.started & follows & (ahead == 0) & (count != 0)):
            valid = self.design.m_axis_tvalid if hasattr(self.design, "aclk") else self.design.o_valid
            with m.If(valid):
                m.d.comb += Assert(self.excused | (output == result))


def buffer_rules(module: ModuleType = axi_stream) -> StreamRules:
    return StreamRules(module.StreamBuffer(8), 2, patience=1)


def core_rules(module: ModuleType = core, datapath: Datapath | None = None) -> StreamRules:
    made = leaky() if datapath is None else datapath
    latency = parallel_clocks.latency_cycles(made)
    return StreamRules(module.Core(made), latency + 1, patience=latency, datapath=made)


def folded_rules(
    module: ModuleType = folded, *, serial: bool = False, progress: bool = False, datapath: Datapath | None = None
) -> StreamRules:
    made = limiter() if datapath is None else datapath
    schedule = program(made, DIGIT_BITS)
    patience = folded_clocks.latency_cycles(schedule, serial=serial) if progress else None
    design = module.FoldedCore(made, schedule, serial=serial)
    held = 2 if folded_clocks.overlaps(schedule, serial=serial) else 1
    return StreamRules(design, held, patience=patience, datapath=datapath, source_waits=True)


def overlapping_rules(module: ModuleType = folded, datapath: Datapath | None = None) -> StreamRules:
    """Rules of a folded core that begins a sample while the one before is in its pipeline."""
    made = limiter() if datapath is None else datapath
    schedule = program(made, DIGIT_BITS).padded(9)
    assert folded_clocks.overlaps(schedule, serial=False)
    design = module.FoldedCore(made, schedule, serial=False)
    patience = folded_clocks.latency_cycles(schedule, serial=False)
    return StreamRules(design, 2, patience=patience, datapath=datapath, source_waits=True)


def test_the_output_buffer_keeps_the_rules_and_every_word(tmp_path: Path) -> None:
    assert prove(buffer_rules(), tmp_path) == "PASS"


def test_the_parallel_core_keeps_the_rules_and_computes_its_recursion(tmp_path: Path) -> None:
    assert prove(core_rules(), tmp_path) == "PASS"


@pytest.mark.slow
def test_a_core_of_three_pipeline_stages_computes_its_recursion(tmp_path: Path) -> None:
    assert prove(core_rules(datapath=resonator()), tmp_path, timeout=1200) == "PASS"


@pytest.mark.sweep(1)
@pytest.mark.parametrize("serial", [False, True])
def test_the_folded_core_keeps_the_rules(serial: bool, tmp_path: Path) -> None:
    assert prove(folded_rules(serial=serial, progress=not serial), tmp_path) == "PASS"


@pytest.mark.slow
def test_samples_that_overlap_keep_the_rules(tmp_path: Path) -> None:
    assert prove(overlapping_rules(), tmp_path) == "PASS"


@pytest.mark.slow
def test_samples_that_overlap_are_computed_one_by_one(tmp_path: Path) -> None:
    assert prove(overlapping_rules(datapath=limiter()), tmp_path, timeout=1200) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("start | (fetching & ~held)", "start | fetching"),  # a result overwritten while it waits
        ("self._gives_last(pipeline) if", "1 if"),  # handed out before it is complete
    ],
)
def test_samples_that_overlap_too_far_are_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(overlapping_rules(broken(folded, right, wrong), limiter()), tmp_path, timeout=1200) == "FAIL"


def channel_rules(module: ModuleType, serial: bool | None = None) -> StreamRules:
    """Rules of a core with three channels, parallel if `serial` is None."""
    if serial is None:
        return StreamRules(module.Core(limiter(), 3), parallel_clocks.latency_cycles(limiter(), 3) + 2)
    design = module.FoldedCore(limiter(), program(limiter(), DIGIT_BITS), serial=serial, channels=3)
    return StreamRules(design, 1, source_waits=True)


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("module", "serial"), [(core, None), (folded, False), (folded, True)])
def test_channels_stay_with_their_samples(module: ModuleType, serial: bool | None, tmp_path: Path) -> None:
    assert prove(channel_rules(module, serial), tmp_path) == "PASS"


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("module", "serial"), [(core, None), (folded, False)])
def test_a_channel_too_many_is_found_out(module: ModuleType, serial: bool | None, tmp_path: Path) -> None:
    wrong = broken(module, "self.s_axis_tdest < self.channels", "self.s_axis_tdest <= self.channels")
    assert prove(channel_rules(wrong, serial), tmp_path) == "FAIL"


def test_a_channel_that_is_lost_is_found_out(tmp_path: Path) -> None:
    wrong = broken(folded, "channel.eq(self.s_axis_tdest)", "channel.eq(0)")
    assert prove(channel_rules(wrong, serial=False), tmp_path) == "FAIL"


@pytest.mark.sweep(1)
@pytest.mark.parametrize("serial", [False, True])
def test_the_folded_core_computes_a_limited_sum(serial: bool, tmp_path: Path) -> None:
    assert prove(folded_rules(serial=serial, datapath=limiter()), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize("serial", [False, True])
def test_the_folded_core_computes_a_recursion(serial: bool, tmp_path: Path) -> None:
    assert prove(folded_rules(serial=serial, datapath=leaky()), tmp_path, timeout=1200) == "PASS"


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("full.eq(self.i_valid)", "full.eq(0)"),  # a word that meets a stall is lost
        ("self.o_valid.eq(1), full.eq(0)", "self.o_valid.eq(1)"),  # the second word comes for ever
        ("head.eq(second)", "head.eq(self.i_data)"),  # the second word is overtaken
        ("self.o_ready | ~self.o_valid", "1"),  # a word that waits is overwritten
        ("full = Signal()", "full = Signal(reset_less=True)"),  # a word comes through a reset
    ],
)
def test_a_broken_buffer_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(buffer_rules(broken(axi_stream, right, wrong)), tmp_path) == "FAIL"


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("component.advance.eq(advance)", "component.advance.eq(1)"),  # the pipeline moves into a full buffer
        ("valid: Value = self.s_axis_tvalid", "valid: Value = Const(1, 1)"),  # samples out of nothing
        ("self.s_axis_tready.eq(ready)", "self.s_axis_tready.eq(1)"),  # samples taken and dropped
    ],
)
def test_a_broken_core_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(core_rules(broken(core, right, wrong)), tmp_path) == "FAIL"


@pytest.mark.sweep(2)
@pytest.mark.parametrize("serial", [False, True])
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("self.s_axis_tready.eq(taken | dropped)", "self.s_axis_tready.eq(1)"),  # taken while at work
        ("busy.eq(1)", "busy.eq(0)"),  # the next one begun before the result is taken
        ("else ~pipeline[-2].valid", "else 1"),  # handed out before it is complete
    ],
)
def test_a_broken_folded_core_is_found_out(right: str, wrong: str, serial: bool, tmp_path: Path) -> None:
    assert prove(folded_rules(broken(folded, right, wrong), serial=serial), tmp_path) == "FAIL"


@pytest.mark.sweep(1)
@pytest.mark.parametrize("make", [core_rules, partial(folded_rules, progress=True)], ids=["parallel", "folded"])
def test_a_latency_that_is_too_short_is_found_out(make: Callable[[], StreamRules], tmp_path: Path) -> None:
    rules = make()
    assert rules.patience is not None
    rules.patience = rules.patience - 1 if make is core_rules else rules.patience // 3
    assert prove(rules, tmp_path) == "FAIL"


def test_a_limit_without_a_sign_is_found_out(tmp_path: Path) -> None:
    module = broken(folded, "cut.as_signed() if output.signed else cut", "cut")
    assert prove(folded_rules(module, serial=True, datapath=limiter()), tmp_path) == "FAIL"


DESIGNS = {
    "buffer": lambda: axi_stream.StreamBuffer(8),
    "parallel": lambda: core.Core(resonator()),
    "folded": lambda: folded.FoldedCore(resonator(), program(resonator(), DIGIT_BITS), serial=False),
    "serial": lambda: folded.FoldedCore(resonator(), program(resonator(), DIGIT_BITS), serial=True),
}


@pytest.mark.parametrize("name", DESIGNS)
def test_no_output_depends_on_an_input_within_a_clock(name: str, tmp_path: Path) -> None:
    assert combinational_outputs(DESIGNS[name](), tmp_path) == []


def test_a_path_from_sink_to_source_is_found_out(tmp_path: Path) -> None:
    module = broken(axi_stream, "self.advance.eq(~full)", "self.advance.eq(~full | self.o_ready)")
    assert combinational_outputs(module.StreamBuffer(8), tmp_path) == ["advance"]
