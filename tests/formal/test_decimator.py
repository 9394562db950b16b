"""The decimator, proven: each result is the moving sum of its samples, at any pace, after any reset, from any state."""

from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from amaranth.hdl import Assert, Assume, Cat, Const, Module, Mux, Signal, Value, signed
from tests.formal.prover import Proof, broken, combinational_outputs, prove

from sosmith.hdl.decimation import decimator as hardware
from sosmith.hdl.plan.decimator_clocks import latency_cycles
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.port import Port


class MovingSums(Proof):
    """What has to hold on the faces of a decimator.

    - The output is not valid after a reset; once it is valid, it and all that goes with it stay until they are taken.
    - There is no result without its sample, and no sample of a next one before the result is taken.
    - With `values`, each result is the weighted sum of the last samples, the first one standing for all before it, and
      rounded.
    - Its flag tells of an end of the range since the result before; with `flags`, they are those of any sample since.
    - While the sink is ready, a result is not longer away than is stated.
    """

    def __init__(
        self, made: Decimator, module: ModuleType, *, values: bool, flags: int = 0, guarded: bool = False
    ) -> None:
        super().__init__(module.CicDecimator(made, flags, guarded=guarded))
        self.excused: Value = self.design.o_fault if guarded else Const(0, 1)
        self.made = made
        self.flags = flags
        self.values = values

    def state(self, m: Module) -> None:
        """State the rules."""
        d, made = self.design, self.made
        offered = Cat(d.i_data, d.i_flags) if self.flags else d.i_data
        told = d.o_flags if self.flags else d.o_rail
        offers, before = Signal(), Signal(len(offered))
        m.d.proof += [offers.eq(d.i_valid & ~d.i_ready & ~self.reset), before.eq(offered)]
        with m.If(offers):
            m.d.comb += Assume(d.i_valid & (offered == before))
        taken, given = d.i_valid & d.i_ready, d.o_valid & d.o_ready
        code = d.i_data[: made.input.bits].as_signed()
        payload = Cat(d.o_data, told)
        stalled, held = Signal(), Signal(len(payload))
        was_reset, pending, waited = Signal(), Signal(), Signal(range(latency_cycles(made) + 1))
        m.d.proof += [was_reset.eq(self.reset), stalled.eq(d.o_valid & ~d.o_ready & ~self.reset), held.eq(payload)]
        expected, rail, completes = self._expected(m, taken, code)
        with m.If(self.reset | given):
            m.d.proof += pending.eq(0)
        with m.If(~self.reset & completes):
            m.d.proof += pending.eq(1)
        m.d.proof += waited.eq(0)
        with m.If(pending & ~given & d.o_ready & ~self.reset):
            m.d.proof += waited.eq(waited + 1)
        with m.If(self.started):
            with m.If(was_reset):
                m.d.comb += Assert(~d.o_valid)
            with m.If(stalled):
                m.d.comb += [Assert(d.o_valid), Assert(payload == held)]
            with m.If(d.o_valid):
                m.d.comb += [Assert(pending), Assert(told == rail)]
                if self.values:
                    m.d.comb += Assert(self.excused | (d.o_data == expected))
            with m.If(completes):
                m.d.comb += Assert(~pending)
            m.d.comb += Assert(waited < latency_cycles(made))

    def _expected(self, m: Module, taken: Value, code: Value) -> tuple[Value, Value, Value]:
        """Return what the last result must be, its flag, and whether its last sample is taken now."""
        made = self.made
        taps = made.impulse_response
        begun, phase = Signal(), Signal(range(made.factor))
        history = [Signal(signed(made.input.bits), name=f"history{k}") for k in range(len(taps) - 1)]
        samples = [code, *history]
        first = [code] * len(taps)
        total = Signal(signed(made.width + 1))
        m.d.comb += total.eq(sum(t * x for t, x in zip(taps, samples, strict=True)))
        with m.If(~begun):
            m.d.comb += total.eq(sum(t * x for t, x in zip(taps, first, strict=True)))
        at_end = (code == made.input.lowest) | (code == made.input.highest)
        at_end = self.design.i_flags if self.flags else at_end
        expected = Signal(made.width - made.dropped)
        seen, rail = Signal(len(at_end)), Signal(len(at_end))
        completes = Signal()
        m.d.comb += completes.eq(taken & (phase == 0))
        with m.If(self.reset):
            m.d.proof += [begun.eq(0), phase.eq(0), seen.eq(0)]
        with m.Elif(taken):
            m.d.proof += [begun.eq(1), phase.eq(phase + 1), seen.eq(seen | at_end)]
            with m.If(begun):
                m.d.proof += [register.eq(value) for register, value in zip(history, samples, strict=False)]
            with m.Else():
                m.d.proof += [register.eq(code) for register in history]
            with m.If(completes):
                m.d.proof += [
                    expected.eq((total + (1 << made.dropped >> 1)) >> made.dropped),
                    rail.eq(seen | at_end),
                    seen.eq(0),
                ]
        return expected, rail, completes


class OneUpset(MovingSums):
    """What has no flag is right, if one bit of a sum or a comb is turned over at any clock, or none.

    Parameters
    ----------
    made : Decimator
    changes : sequence of (str, str)
        What is replaced in the text of the decimator.
    upsets : bool
        Whether a bit may be turned over; if not, nothing has the flag.
    """

    def __init__(self, made: Decimator, *changes: tuple[str, str], upsets: bool = True) -> None:
        self.upsets, self.upset = upsets, Signal(2 * made.stages * made.width)
        left = iter(range(0, len(self.upset), made.width))

        def upset(m: Module, state: Signal, following: Value, loads: Value) -> None:
            """Let a state be what it would be at the end of this clock, but for the bits of its upset."""
            start = next(left)
            own = self.upset[start : start + len(state)]
            with m.If(own.any()):
                m.d.sync += state.eq(Mux(loads, following, state) ^ own)

        found = "        return [state.xor() ^ parity]\n"
        module: Any = broken(hardware, found, f"        UPSET(m, state, following, loads)\n{found}", *changes)
        module.UPSET = upset
        super().__init__(made, module, values=True, guarded=True)
        self._inputs.append(self.upset)

    def state(self, m: Module) -> None:
        """State it."""
        super().state(m)
        happened = Signal()
        m.d.proof += happened.eq(happened | self.upset.any())
        m.d.comb += Assume((self.upset & (self.upset - 1)) == 0)
        with m.If(happened | self.reset if self.upsets else Const(1)):
            m.d.comb += Assume(self.upset == 0)
        if not self.upsets:
            with m.If(self.started & self.design.o_valid):
                m.d.comb += Assert(~self.excused)


def small(factor: int = 2, stages: int = 1, dropped: int = 1) -> Decimator:
    port = Port(name="x", bits=2, signed=True, lsb=Fraction(1), zero=Fraction(0))
    return Decimator(input=port, factor=factor, stages=stages, dropped=dropped)


@pytest.mark.slow
@pytest.mark.parametrize("dropped", [0, 1])
def test_results_are_moving_sums(dropped: int, tmp_path: Path) -> None:
    assert prove(MovingSums(small(dropped=dropped), hardware, values=True), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "stages"), [(2, 3), (4, 2)])
def test_no_result_is_lost_or_changed_on_its_way(factor: int, stages: int, tmp_path: Path) -> None:
    assert prove(MovingSums(small(factor, stages), hardware, values=False), tmp_path) == "PASS"


@pytest.mark.slow
def test_flags_that_come_with_samples_are_gathered(tmp_path: Path) -> None:
    assert prove(MovingSums(small(), hardware, values=True, flags=2), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("self.o_flags.eq(found | self.i_flags)", "self.o_flags.eq(found)"),  # that of the last sample forgotten
        ('kept.load("found", 0)', 'kept.load("found", self.i_flags)'),  # told of the next result too
    ],
)
def test_flags_lost_are_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(MovingSums(small(), broken(hardware, right, wrong), values=True, flags=2), tmp_path) == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("before.eq(value)", "before.eq(difference)"),  # a comb of another delay
        ("total = Signal(cic.width,", "total = Signal(cic.width - 1,"),  # a register a bit short
        ("(1 << cic.dropped >> 1)", "0"),  # rounded down
        ('Signal(init=1, name="filling")', 'Signal(name="filling")'),  # a first sample that is there once only
        ("waiting & completes", "0"),  # a result overwritten while it waits
        ("self.o_rail.eq(rail | at_end)", "self.o_rail.eq(at_end)"),  # a rail forgotten
    ],
)
def test_a_broken_decimator_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(MovingSums(small(), broken(hardware, right, wrong), values=True), tmp_path) == "FAIL"


@pytest.mark.slow
@pytest.mark.parametrize("upsets", [False, True])
def test_what_has_no_flag_is_right(upsets: bool, tmp_path: Path) -> None:
    """So a decimator forgets a wrong bit before its flag ends."""
    assert prove(OneUpset(small(dropped=0), upsets=upsets), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("marked.eq(self.decimator.stages + 1)", "marked.eq(0)"),  # the result inside alone
        ("self.o_fault.eq(wrong | marked.any())", "self.o_fault.eq(wrong)"),  # that of this clock alone
        ("Cat(wrong, kept.failed, given).any()", "wrong & enters"),  # looked at with a sample alone
        ("following[: len(state)].xor()", "state.xor()"),  # parity of what was there
    ],
)
def test_a_flag_that_is_missing_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(OneUpset(small(dropped=0), (right, wrong)), tmp_path) == "FAIL"


def test_no_output_follows_an_input_within_a_clock(tmp_path: Path) -> None:
    assert combinational_outputs(hardware.CicDecimator(small()), tmp_path) == []


class Copies(Proof):
    """Each word that goes into a holder comes out `COPIES` times, unchanged, before the next one; none else does."""

    def __init__(self, module: ModuleType) -> None:
        super().__init__(module.Holder(2, COPIES))

    def state(self, m: Module) -> None:
        """State the rules."""
        d = self.design
        owed, word, was_reset = Signal(range(COPIES + 1)), Signal(len(d.i_data)), Signal()
        taken, given = d.i_valid & d.i_ready, d.o_valid & d.o_ready
        m.d.proof += [was_reset.eq(self.reset), owed.eq(owed - given)]
        with m.If(taken):
            m.d.proof += [owed.eq(COPIES), word.eq(d.i_data)]
        with m.If(self.reset):
            m.d.proof += owed.eq(0)
        with m.If(self.started):
            with m.If(was_reset):
                m.d.comb += Assert(~d.o_valid)
            m.d.comb += Assert(d.o_valid == (owed != 0))
            with m.If(d.o_valid):
                m.d.comb += Assert(d.o_data == word)
            with m.If(taken):
                m.d.comb += Assert((owed == 0) | ((owed == 1) & given))
            with m.If((owed == 0) | ((owed == 1) & d.o_ready)):
                m.d.comb += Assert(d.i_ready)


COPIES = 4


def test_each_result_is_handed_out_as_often_as_it_has_samples(tmp_path: Path) -> None:
    assert prove(Copies(hardware), tmp_path) == "PASS"


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("left.eq(self.copies - 1)", "left.eq(self.copies - 2)"),  # a copy too few
        ("(self.o_ready & ~left.any())", "~left.any()"),  # the last copy overwritten while it waits
        ("with m.Elif(self.o_ready):\n            m.d.sync += left", "with m.Else():\n            m.d.sync += left"),
        ("held.eq(self.i_data), self.o_valid.eq(self.i_valid)", "held.eq(self.i_data), self.o_valid.eq(1)"),
    ],
)
def test_a_broken_holder_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(Copies(broken(hardware, right, wrong)), tmp_path) == "FAIL"
