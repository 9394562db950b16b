"""Limits of a verification: whatever is given, it ends with a sentence."""

import re
import signal
import time
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

from sosmith.verify.bounds.polynomial import _Value
from sosmith.verify.c_model import forms as c_forms
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel import forms as parallel_forms
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.program import normal_form
from sosmith.verify.reader.gates import Gates
from sosmith.verify.verdict.limits import limited


def forever() -> None:
    while True:
        pass


@pytest.mark.parametrize("work", [forever, lambda: time.sleep(600)], ids=["works", "waits"])
def test_what_takes_too_long_is_refused_and_the_alarms_are_as_they_were(work: Callable[[], None]) -> None:
    before = [signal.getsignal(number) for number in (signal.SIGALRM, signal.SIGPROF)]
    sentence = (
        "the proof must end within 0.05 s of processor time, which this certificate or text does not allow; "
        "--time-limit gives it more"
    )
    with pytest.raises(RejectedError, match=f"^{re.escape(sentence)}$"), limited(0.05):
        work()
    assert [signal.getsignal(number) for number in (signal.SIGALRM, signal.SIGPROF)] == before
    for timer in (signal.ITIMER_REAL, signal.ITIMER_PROF):
        assert signal.getitimer(timer) == (0.0, 0.0)


def test_no_limit_is_none() -> None:
    with limited(0):
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def deep(levels: int) -> int:
    return 0 if levels == 0 else 1 + deep(levels - 1)


@pytest.mark.parametrize(
    ("work", "sentence"),
    [
        (lambda: deep(10**6), "the graphs and texts must not be nested deeper than they can be followed"),
        (lambda: int("9" * 10_000), "the numbers must be of a size that can be computed with"),
        (lambda: float(10**400), "the numbers must be of a size that can be computed with"),
    ],
    ids=["depth", "digits", "size"],
)
def test_what_cannot_be_computed_is_a_sentence(work: object, sentence: str) -> None:
    assert callable(work)
    with pytest.raises(RejectedError, match=f"^{sentence}$"), limited(1):
        work()


def test_faults_of_the_verifier_itself_are_not_hidden() -> None:
    with pytest.raises(ValueError, match=r"^a fault$"), limited(1):
        raise ValueError("a fault")


Squarer = tuple[Any, Callable[[Any], Any]]


def hardware() -> Squarer:
    forms = Forms()
    return forms.variable("x", -8, 7), lambda x: forms.times(x, x)


def graph() -> Squarer:
    return _Value({(1, 0): Fraction(1)}, Fraction(0)), lambda x: x.times(x)


SQUARERS: dict[str, Callable[[], Squarer]] = {
    "hardware": hardware,
    "graph": graph,
    "program": lambda: ({(0,): 1}, lambda x: normal_form.times(x, x)),
}


@pytest.mark.parametrize("kind", SQUARERS)
def test_squares_of_squares_end(kind: str) -> None:
    """Forty in a row are short to write, and had no end."""
    value, squared = SQUARERS[kind]()
    for _ in range(6):
        value = squared(value)
    with pytest.raises(RejectedError, match=r"^a product must have at most 64 factors, not 128$"):
        squared(value)


def test_squares_of_squares_in_a_c_model_end() -> None:
    forms = c_forms.Forms()
    value = forms.variable("x", -8, 7)
    for _ in range(8):
        value = forms.product(value, value)
    with pytest.raises(RejectedError, match=r"^a product must have at most 1024 bits, not 1537$"):
        forms.product(value, value)


def test_products_of_long_sums_end() -> None:
    long: normal_form.Form = {(atom,): 1 for atom in range(200)}
    with pytest.raises(RejectedError, match=r"^a product must have at most 16384 terms, not 40000$"):
        normal_form.times(long, long)


def test_a_multiplier_of_gates_is_no_larger_than_any_core_has() -> None:
    gates = Gates()
    with pytest.raises(RejectedError, match=r"^a product must have at most 512 bits to be compared, not 513$"):
        gates.product_of([0] * 513, [0] * 513)


def test_choices_of_choices_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is a little longer than the last one: a thousand lines asked for hours."""
    monkeypatch.setattr(parallel_forms, "_MOST_WORK", 1000)
    forms = Forms()
    value = forms.variable("x", 0, 255)
    for k in range(40):
        value = normal_form.plus(value, forms.variable(k, 0, 1))
        forms.limits(value)
    with pytest.raises(RejectedError, match=r"^the hardware must be proven by looking at 1000 terms, not more$"):
        forms.narrowed(value, 0, 1).times(value, value)
