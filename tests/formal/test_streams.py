"""The rules of the streams, proven: on the output buffer's faces and on those of a core in each architecture."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType

import pytest
from tests.formal.prover import broken, combinational_outputs, prove
from tests.formal.small import leaky, limiter, resonator
from tests.formal.stream_rules import DIGIT_BITS, StreamRules

from sosmith.hdl import axi_stream
from sosmith.hdl.cores import folded
from sosmith.hdl.cores import parallel as core
from sosmith.hdl.plan import folded_clocks, parallel_clocks
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.fold import program


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


@pytest.mark.slow
def test_the_parallel_core_keeps_the_rules_and_computes_its_recursion(tmp_path: Path) -> None:
    assert prove(core_rules(), tmp_path) == "PASS"


@pytest.mark.slow
def test_a_core_of_three_pipeline_stages_computes_its_recursion(tmp_path: Path) -> None:
    assert prove(core_rules(datapath=resonator()), tmp_path, timeout=1200) == "PASS"


@pytest.mark.slow
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
        ("start | (fetching & ~waits)", "start | fetching"),  # a result overwritten while it waits
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


@pytest.mark.slow
@pytest.mark.parametrize(("module", "serial"), [(core, None), (folded, False), (folded, True)])
def test_channels_stay_with_their_samples(module: ModuleType, serial: bool | None, tmp_path: Path) -> None:
    assert prove(channel_rules(module, serial), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(("module", "serial"), [(core, None), (folded, False)])
def test_a_channel_too_many_is_found_out(module: ModuleType, serial: bool | None, tmp_path: Path) -> None:
    wrong = broken(module, "self.s_axis_tdest < self.channels", "self.s_axis_tdest <= self.channels")
    assert prove(channel_rules(wrong, serial), tmp_path) == "FAIL"


@pytest.mark.slow
def test_a_channel_that_is_lost_is_found_out(tmp_path: Path) -> None:
    wrong = broken(folded, "channel.eq(self.s_axis_tdest)", "channel.eq(0)")
    assert prove(channel_rules(wrong, serial=False), tmp_path) == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize("serial", [False, True])
def test_the_folded_core_computes_a_limited_sum(serial: bool, tmp_path: Path) -> None:
    assert prove(folded_rules(serial=serial, datapath=limiter()), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize("serial", [False, True])
def test_the_folded_core_computes_a_recursion(serial: bool, tmp_path: Path) -> None:
    assert prove(folded_rules(serial=serial, datapath=leaky()), tmp_path, timeout=1200) == "PASS"


@pytest.mark.slow
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
        ("stage.advance.eq(advance)", "stage.advance.eq(1)"),  # the pipeline moves into a full buffer
        ("valid: Value = self.s_axis_tvalid", "valid: Value = Const(1, 1)"),  # samples out of nothing
        ("self.s_axis_tready.eq(ready)", "self.s_axis_tready.eq(1)"),  # samples taken and dropped
    ],
)
def test_a_broken_core_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(core_rules(broken(core, right, wrong)), tmp_path) == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize("serial", [False, True])
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("self.s_axis_tready.eq(taken | control.dropped)", "self.s_axis_tready.eq(1)"),  # taken while at work
        ("busy.eq(1)", "busy.eq(0)"),  # the next one begun before the result is taken
        ("else ~pipeline[-2].valid", "else 1"),  # handed out before it is complete
    ],
)
def test_a_broken_folded_core_is_found_out(right: str, wrong: str, serial: bool, tmp_path: Path) -> None:
    assert prove(folded_rules(broken(folded, right, wrong), serial=serial), tmp_path) == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize("make", [core_rules, partial(folded_rules, progress=True)], ids=["parallel", "folded"])
def test_a_latency_that_is_too_short_is_found_out(make: Callable[[], StreamRules], tmp_path: Path) -> None:
    rules = make()
    assert rules.patience is not None
    rules.patience = rules.patience - 1 if make is core_rules else rules.patience // 3
    assert prove(rules, tmp_path) == "FAIL"


@pytest.mark.slow
def test_a_limit_without_a_sign_is_found_out(tmp_path: Path) -> None:
    module = broken(folded, "[: self._result_bits].as_signed()", "[: self._result_bits]")
    assert prove(folded_rules(module, serial=True, datapath=limiter()), tmp_path) == "FAIL"


DESIGNS = {
    "buffer": lambda: axi_stream.StreamBuffer(8),
    "parallel": lambda: core.Core(resonator()),
    "folded": lambda: folded.FoldedCore(resonator(), program(resonator(), DIGIT_BITS), serial=False),
    "serial": lambda: folded.FoldedCore(resonator(), program(resonator(), DIGIT_BITS), serial=True),
}


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", DESIGNS)
def test_no_output_depends_on_an_input_within_a_clock(name: str, tmp_path: Path) -> None:
    assert combinational_outputs(DESIGNS[name](), tmp_path) == []


def test_a_path_from_sink_to_source_is_found_out(tmp_path: Path) -> None:
    module = broken(axi_stream, "self.advance.eq(~full)", "self.advance.eq(~full | self.o_ready)")
    assert combinational_outputs(module.StreamBuffer(8), tmp_path) == ["advance"]
