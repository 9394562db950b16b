"""On-line arithmetic in hardware, proven: its residual stays in its range, and the core keeps the streams' rules."""

from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import pytest
from amaranth.hdl import Assert, Assume, Module, Mux, Signal, signed
from amaranth.lib.wiring import Component, In, Out
from tests.formal.prover import INDUCTION, Proof, broken, combinational_outputs, prove
from tests.formal.small import port
from tests.formal.stream_rules import StreamRules

from sosmith.hdl.online import cascade, core, residual
from sosmith.hdl.plan import online_clocks
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder
from sosmith.model.sections.online import OnlineSection
from sosmith.model.sections.output import OutputStage

SECTION = OnlineSection(
    name="small",
    numerator=(Fraction(1, 64),),
    recursion=(Fraction(123, 64),),
    feedback=(),
    x_frac=0,
    y_frac=0,
    largest=Fraction(4),
)


class ResidualAlone(Component):
    """A residual by itself, to which something is added at every clock."""

    def __init__(self, module: ModuleType) -> None:
        self.residual = module.Residual.of(SECTION, "unit")
        bits = SECTION.residual_bits
        super().__init__(
            {
                "increment": In(bits),
                "selects": In(1),
                "clear": In(1),
                "value": Out(signed(bits)),
                "digit": Out(signed(2)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the residual, with its value and digit as numbers."""
        m = Module()
        digit = self.residual.step(m, self.increment, self.selects, self.clear)
        m.d.comb += [
            self.value.eq(self.residual.word + self.residual.carries),
            self.digit.eq(Mux(digit[0], 1, Mux(digit[1], -1, 0))),
        ]
        return m


class Invariant(Proof):
    """The residual w is in [-3/4, 3/4), and what it becomes with a digit d is ``2 w + increment - d``.

    Increments are in [-1/4, 1/4]. Before digits are selected, 2 w + increment is in that range by itself, which depends
    on all digits to come.
    """

    def __init__(self, design: ResidualAlone, most: int = 1) -> None:
        super().__init__(design)
        self.most = most

    def state(self, m: Module) -> None:
        """State the invariant."""
        d = self.design
        quarter = 1 << (SECTION.residual_frac - 2)
        increment = d.increment.as_signed()
        exact, known = Signal(signed(SECTION.residual_bits + 2)), Signal()
        total = 2 * d.value + increment
        m.d.comb += Assume((increment >= -self.most * quarter) & (increment <= self.most * quarter))
        with m.If(~d.selects):
            m.d.comb += Assume((total >= -3 * quarter) & (total < 3 * quarter))
        m.d.proof += [exact.eq(Mux(d.clear, 0, total)), known.eq(~self.reset & self.started)]
        with m.If(self.started):
            m.d.comb += Assert((d.value >= -3 * quarter) & (d.value < 3 * quarter))
        with m.If(known & self.started):
            m.d.comb += Assert(d.value == exact - 4 * quarter * d.digit)


@pytest.mark.slow
def test_the_residual_is_exact_and_stays_in_its_range(tmp_path: Path) -> None:
    assert prove(Invariant(ResidualAlone(residual)), tmp_path, INDUCTION) == "PASS"


FAULTS = {
    "1 only from 3/4 on": ("if self.section.select(u) > 0", "if 3 <= u <= 6"),
    "-1 from -1/2 down": ("if self.section.select(u) < 0", "if 7 <= u <= 14"),
    "a carry is lost": ("a & b | a & increment | b & increment", "a & b | a & increment"),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_fault_is_found(fault: tuple[str, str], tmp_path: Path) -> None:
    assert prove(Invariant(ResidualAlone(broken(residual, *fault))), tmp_path, INDUCTION) != "PASS"


@pytest.mark.slow
def test_a_delay_that_is_one_too_small_is_found(tmp_path: Path) -> None:
    assert prove(Invariant(ResidualAlone(residual), most=2), tmp_path, INDUCTION) != "PASS"


class Section(NamedTuple):
    """A stage that is nothing but its graph."""

    name: str
    graph: Graph


def averager() -> Datapath:
    """Make ``y(n) = (x(n) + y(n-1)) / 2``, rounded, with words of two bits in and out."""
    g = GraphBuilder()
    x = g.input("x", 0, -2, 1)
    v1 = g.delay("v1", 1, -4, 4)
    total = g.add(g.shift(x, -1), g.shift(g.floor(v1, 0), -1))
    v = g.bound(g.add(total, g.constant(1, 1)), -4, 4, "v")
    g.connect(v1, v)
    section = Section("section0", g.build([g.floor(v, 0)]))
    (of,), y = section.graph.output_ranges, port("y", 2)
    last = OutputStage(offset=0, offset_frac=0, x=of, low=y.lowest, high=y.highest)
    return Datapath(name="small", inputs=(port("x", 2),), output=y, stages=(section, last))


def core_rules(module: ModuleType = core, *, computes: bool = False) -> StreamRules:
    """Rules of a core with two units, each of which may hold a sample, and one on its way to either side."""
    datapath = averager()
    latency = online_clocks.latency_cycles(datapath)
    held = latency // online_clocks.schedule_of(datapath).interval + 4
    if computes:
        return StreamRules(module.OnlineCore(datapath), held, datapath=datapath)
    return StreamRules(module.OnlineCore(datapath), held, patience=latency)


@pytest.mark.slow
def test_the_core_keeps_the_rules_of_the_streams(tmp_path: Path) -> None:
    assert prove(core_rules(), tmp_path) == "PASS"


@pytest.mark.slow
def test_the_core_computes_its_recursion(tmp_path: Path) -> None:
    """For all inputs, stalls and resets: what leaves is what the graph makes of all samples so far."""
    assert prove(core_rules(computes=True), tmp_path, timeout=2400) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ('f"{own}_increment")', 'f"{own}_increment", reset_less=True)'),  # what was added comes through a reset
        ("half ^ odd", "half"),  # the last digit does not look at the one before
    ],
)
def test_a_core_that_computes_something_else_is_found_out(
    right: str, wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(core, "OnlineCascade", broken(cascade, right, wrong).OnlineCascade)
    assert prove(core_rules(computes=True), tmp_path, timeout=1200) == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("self.s_axis_tready.eq(advance & cascade.tick)", "self.s_axis_tready.eq(advance)"),  # samples are lost
        ("EnableInserter(advance)(cascade)", "cascade"),  # the units move into a full buffer
    ],
)
def test_a_broken_core_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(core_rules(broken(core, right, wrong)), tmp_path) == "FAIL"


def test_no_output_depends_on_an_input_within_a_clock(tmp_path: Path) -> None:
    assert combinational_outputs(core.OnlineCore(averager()), tmp_path) == []
