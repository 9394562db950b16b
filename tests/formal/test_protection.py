"""A protected core, proven: no wrong bit of a state gives a wrong sample without the flag."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from amaranth.hdl import Assert, Assume, Const, Module, Mux, Signal
from tests.formal.prover import broken, prove
from tests.formal.small import leaky
from tests.formal.stream_rules import StreamRules

from sosmith.hdl.cores import parallel as core
from sosmith.hdl.plan import parallel_clocks
from sosmith.hdl.stages import pipelined as stage

Change = tuple[str, str]
"""A piece of text that is there once, and what takes its place."""
FAULT = 6
"""Bit of `m_axis_tuser`."""
STATE_BITS = 3
"""Of `leaky`."""
LAST = "        last = len(takes) - 1\n"
UPSET = """        for i in graph.delays:
            loaded = Mux(takes[stages[i]], at(graph.nodes[i].operands[0], stages[i]), wires[i])
            with m.If(UPSET.any() & ~self.clear):
                m.d.sync += wires[i].eq(loaded ^ UPSET)
"""
"""At the end of this clock the state is what it would be, but for the bits of `UPSET`."""


class OneUpset(StreamRules):
    """The stream keeps its rules, and what has no flag is right, if one bit of the state is turned over, or none.

    Parameters
    ----------
    in_core, in_stage : sequence of (str, str)
        What is replaced in the text of the core and of its stages.
    upsets : bool
        Whether a bit may be turned over, once, at any clock; if not, nothing ever has the flag.
    """

    def __init__(self, in_core: Sequence[Change] = (), in_stage: Sequence[Change] = (), *, upsets: bool = True) -> None:
        self.upset, self.upsets = Signal(STATE_BITS), upsets
        parts: Any = broken(stage, LAST, UPSET + LAST, *in_stage)
        parts.UPSET, parts.Mux = self.upset, Mux
        whole: Any = broken(core, "from sosmith.hdl.stages.pipelined import PipelinedStage\n", "", *in_core)
        whole.PipelinedStage = parts.PipelinedStage
        design = whole.Core(leaky(), protect="detect")
        super().__init__(design, parallel_clocks.latency_cycles(leaky()) + 1, datapath=leaky())
        self.excused = design.m_axis_tuser[FAULT]
        self._inputs.append(self.upset)

    def state(self, m: Module) -> None:
        """State it."""
        super().state(m)
        happened = Signal()
        m.d.proof += happened.eq(happened | self.upset.any())
        m.d.comb += Assume((self.upset & (self.upset - 1)) == 0)
        with m.If(happened if self.upsets else Const(1)):
            m.d.comb += Assume(self.upset == 0)
        if not self.upsets:
            with m.If(self.started & self.design.m_axis_tvalid):
                m.d.comb += Assert(~self.excused)


@pytest.mark.slow
@pytest.mark.sweep(1)
@pytest.mark.parametrize("upsets", [pytest.param(False, marks=pytest.mark.slow), True])
def test_what_has_no_flag_is_right(upsets: bool, tmp_path: Path) -> None:
    assert prove(OneUpset(upsets=upsets), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("in_core", "in_stage"),
    [
        ([], [("self.o_fault.eq(fault | wrong)", "self.o_fault.eq(wrong)")]),  # a fault does not go with its sample
        *(
            pytest.param(*changes, marks=pytest.mark.slow)
            for changes in (
                (
                    [("parts.guard.fault | fault", "parts.guard.fault")],
                    [],
                ),  # the first has no flag
                (
                    [("parts.guard.fault | fault", "fault")],
                    [],
                ),  # none behind the restart has
                ([], [("parity.eq(_fitting(following, state).xor())", "parity.eq(state.as_unsigned().xor())")]),
            )
        ),
    ],
)
def test_a_core_that_misses_an_upset_is_found_out(
    in_core: list[Change], in_stage: list[Change], tmp_path: Path
) -> None:
    assert prove(OneUpset(in_core, in_stage), tmp_path) == "FAIL"


@pytest.mark.slow
def test_a_parity_bit_that_is_wrong_after_a_reset_is_found_out(tmp_path: Path) -> None:
    change = ('name=f"{logic.names[i]}_parity")', 'name=f"{logic.names[i]}_parity", init=1)')
    assert prove(OneUpset(in_stage=[change], upsets=False), tmp_path) == "FAIL"
