"""Parallel cores beside a decimator: proven, and rejected when anything in them is wrong."""

import re
from types import ModuleType

import pytest
from tests.formal.prover import broken, broken_beneath
from tests.verify.multirate.decimators import Case, Instrument, designed, written
from tests.verify.parallel.edits import random_edits, swept
from tests.verify.parallel.simulated import outputs

from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.cores import parallel as hardware
from sosmith.hdl.decimation import decimator
from sosmith.hdl.shell import pipeline, shell
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator
from sosmith.verify.multirate.parallel_core import check_ahead, check_behind

PLAIN, HELD, SEVERAL = Case(hold=False), Case(output_bits=11), Case(channels=3, hold=False, output_bits=11)
INSTRUMENT = Instrument("parallel", signed=True)
CASES = [
    PLAIN,
    HELD,
    SEVERAL,
    Case(signed=False, output_bits=9, cutoff=20, error=0.02),
    Case(channels=3),
    INSTRUMENT,
    Instrument("parallel", hold=True),
    Instrument("parallel", channels=3),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("case", CASES)
def test_a_core_beside_a_decimator_is_proven(case: Case | Instrument) -> None:
    _, certificate = designed(case)
    verdict = check_behind(written(case), certificate, case.channels)
    assert (verdict.states > 5, verdict.memories > 5) == (True, case.channels > 1)
    if isinstance(case, Instrument):
        before = check_ahead(written(case), certificate, case.channels)
        assert before.registers > 10
        assert before.states == 0


def rejection(case: Case | Instrument, text: str) -> str:
    """Return the sentence of a rejection; nothing if a text is accepted."""
    _, certificate = designed(case)
    try:
        check_decimator(text, certificate, case.channels)
        check_behind(text, certificate, case.channels)
        if isinstance(case, Instrument):
            check_ahead(text, certificate, case.channels)
    except RejectedError as error:
        return str(error)
    return ""


HOLDS = "\n            m.d.sync += later.eq(value)"
STATUS = 'delayed(m, buffer.advance, inputs, self._depth_of_stages, "status")'
BROKEN = [
    (PLAIN, "a flag of another sample", hardware, STATUS, "inputs"),
    (PLAIN, "a flag that gets lost", hardware, "self.given_flags if self.flags_given else None\n", "NEVER\n"),
    (HELD, "flags that do not stand still", pipeline, f"with m.If(advance):{HOLDS}", f"with m.If(Const(1, 1)):{HOLDS}"),
    (INSTRUMENT, "flags the wrong way round", shell, "return given\n", "return given[::-1]\n"),
    (INSTRUMENT, "a rail that is not told", shell, "at_rail(self.datapath.inputs, tdata) if", "Const(0, 1) if"),
    (SEVERAL, "a flag that passes the buffer", hardware, "head.given if", "self.s_axis_tuser if"),
    (SEVERAL, "a sample that does not wait", hardware, "waits = waits | (taken & (near == channel))", "pass"),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("case", "where", "right", "wrong"), [pytest.param(case, *edit, id=subject) for case, subject, *edit in BROKEN]
)
def test_a_core_that_is_wrong_is_rejected(
    case: Case | Instrument, where: ModuleType, right: str, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, _ = designed(case)
    assert not rejection(case, written(case))
    module = broken(hardware, right, wrong) if where is hardware else broken_beneath(hardware, where, right, wrong)
    monkeypatch.setattr(hardware, "Core", module.Core)
    text = to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))
    assert text != written(case)
    assert re.search(r"\bmust\b", rejection(case, text))


def test_flags_that_leave_at_other_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which flag is which is not known around the core, but what it makes is proven where it leaves."""
    made, certificate = designed(PLAIN)
    right = "self.m_axis_tuser.eq(handed.user)"
    wrong = broken(decimator, right, "self.m_axis_tuser.eq(handed.user[:3][::-1])").DecimatedCore
    monkeypatch.setattr(decimator, "DecimatedCore", wrong)
    text = to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))
    sentence = "bit 0 of m_axis_tuser must be input_at_rail, as the ports and .* say, not another value"
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        check_behind(text, certificate)


def test_a_flag_that_is_held_by_itself() -> None:
    """A register that holds results takes over all of one at once."""
    case = Case()
    text = written(case)
    found = re.search(r"^( *)if \((\w+)\) (\w+) <= i_data;$", text, re.MULTILINE)
    assert found is not None
    indent, takes, word = found.groups()
    whole = f"{indent}{word} <= {{ choice9999, choice9998 }};"
    head = "  wire choice9997;\n  wire choice9999;\n  wire [9:0] choice9998;\n"
    head += f"  assign choice9997 = {takes} & o_ready;\n  assign choice9999 = choice9997 ? i_data[10] : {word}[10];\n"
    head += f"  assign choice9998 = {takes} ? i_data[9:0] : {word}[9:0];\n"
    start = text.rindex("  always_ff", 0, found.start())
    edited = text[:start] + head + text[start : found.start()] + whole + text[found.end() :]
    assert rejection(case, edited) == f"holder.{word} must take over all of a result at once"


def sweep(case: Case | Instrument, count: int, seed: int, clocks: int) -> None:
    """Edit at random, in all modules; what is accepted must be the same in simulation."""
    flags = 5 if isinstance(case, Instrument) else 7  # of outside_calibration, no certificate speaks

    def seen(text: str) -> object:
        defined = re.sub(r"\b(\d+)'hx+", r"\1'h0", text)
        rows = outputs(defined, clocks, seed, case.channels)
        return [{**row, "m_axis_tuser": row.get("m_axis_tuser", 0) & flags} for row in rows]

    text = written(case)
    found = swept(random_edits(text, count, seed), lambda other: rejection(case, other), seen, text)
    assert found["accepted"] + found["rejected"] == count
    assert found["rejected"] > count // 2


@pytest.mark.slow
def test_twenty_edits() -> None:
    sweep(PLAIN, 20, seed=1, clocks=300)


@pytest.mark.slow
@pytest.mark.parametrize("case", [HELD, SEVERAL, INSTRUMENT, Instrument("parallel", channels=3, hold=True)])
def test_a_hundred_edits(case: Case | Instrument) -> None:
    sweep(case, 100, seed=2, clocks=600)
