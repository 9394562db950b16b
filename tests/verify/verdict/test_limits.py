"""Limits of a verification: whatever is given, it ends with a sentence."""

import signal
import time

import pytest

from sosmith.verify.graph import RejectedError
from sosmith.verify.verdict.limits import limited


def test_what_takes_too_long_is_refused_and_the_alarm_is_as_it_was() -> None:
    before = signal.getsignal(signal.SIGALRM)
    with pytest.raises(RejectedError, match=r"^the proof must end within 0\.05 s, which .*$"), limited(0.05):
        time.sleep(60)
    assert signal.getsignal(signal.SIGALRM) is before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


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
