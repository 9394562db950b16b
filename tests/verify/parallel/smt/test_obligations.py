"""The goals of the hardware check as SMT-LIB: unsat in two solvers for cores as they are, sat for broken ones."""

from __future__ import annotations

import re
from functools import cache

import pytest
from tests.verify.parallel.cores import Made, looking_ahead, made, specified
from tests.verify.parallel.smt.solvers import NAMES, answer
from tests.verify.small_specifications import NARROW, STEADY

from sosmith.gen.core import design_core
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.check import check_hardware
from sosmith.verify.parallel.smt.obligations import obligations

PARALLEL = 'hardware.architecture = "parallel"\n'


@cache
def core(text: str) -> Made:
    return made(design_core(specified(text + PARALLEL)))


@cache
def goals(text: str) -> dict[str, str]:
    return obligations(core(text).text, core(text).certificate)


def edited(text: str, pattern: str, new: str) -> str:
    """Replace the only place that a pattern matches."""
    result, count = re.subn(pattern, new, text)
    assert count == 1, (pattern, count)
    return result


@pytest.mark.sweep(1)
@pytest.mark.parametrize("solver", NAMES)
def test_every_register_of_a_small_core_is_proven_by_each_solver(solver: str) -> None:
    check_hardware(core(NARROW).text, core(NARROW).certificate)
    said = {name: answer(solver, goal) for name, goal in goals(NARROW).items()}
    assert set(said.values()) == {"unsat"}
    assert {"section0.v1", "section0.x1", "m_axis_tdata"} <= said.keys()


@pytest.mark.parametrize("solver", NAMES)
def test_what_sums_of_long_words_leave_is_proven_as_well(solver: str) -> None:
    """Delays, words that pass stages, flags; products of long words take solvers too long."""
    easy = re.compile(r"x\d|v2|started|first|passed1|status|held")
    said = {name: answer(solver, goal) for name, goal in goals(STEADY).items() if easy.search(name)}
    assert len(said) > 10
    assert set(said.values()) == {"unsat"}


BROKEN = [
    pytest.param(r"(take0\)) x1 <= x;", r"\1 x1 <= ~x;", "section0.x1", id="delay"),
    pytest.param(r"\(take0\) x1 <= x;", "(i_valid) x1 <= x;", "section0.x1", id="a state that does not stay"),
    pytest.param(r"\$signed\(5'h0b\)", "$signed(5'h0d)", "section0.v1", id="coefficient"),
    pytest.param(r"\(rst\) v1 <= 12'h000;", "(rst) v1 <= 12'h001;", "section0.v1", id="reset"),
    pytest.param(r"\? 5'h07 : rounded", "? 5'h06 : rounded", "m_axis_tdata", id="limit of the output"),
    pytest.param(r"\$signed\(3'h2\)", "$signed(3'h1)", "m_axis_tdata", id="rounding of the output"),
]


@pytest.mark.sweep(4)
@pytest.mark.parametrize("solver", NAMES)
@pytest.mark.parametrize(("pattern", "new", "place"), BROKEN)
def test_a_broken_core_has_a_counterexample(pattern: str, new: str, place: str, solver: str) -> None:
    text = edited(core(NARROW).text, pattern, new)
    with pytest.raises(RejectedError):
        check_hardware(text, core(NARROW).certificate)
    assert answer(solver, obligations(text, core(NARROW).certificate)[place]) == "sat"


def test_the_texts_are_the_same_each_time() -> None:
    again = obligations(core(NARROW).text, core(NARROW).certificate)
    assert again == goals(NARROW)
    assert all(text.count("(check-sat)") == 1 and "(set-logic QF_BV)" in text for text in again.values())


@pytest.mark.slow
def test_a_core_with_memories_is_refused() -> None:
    ahead = looking_ahead()
    with pytest.raises(RejectedError, match=r"^goals for solvers must be of a core without memories$"):
        obligations(ahead.text, ahead.certificate)
