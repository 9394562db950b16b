"""Limits of a verification: it ends with a sentence, however a certificate or a text is made."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from sosmith.verify.graph import RejectedError

SECONDS = 60.0
"""Processor time that a verification may take by default, in s."""

_BUSY = 10
"""How many times as long it may take by the clock, on a machine that has other things to do."""

_ALARMS = ((signal.ITIMER_PROF, signal.SIGPROF, 1), (signal.ITIMER_REAL, signal.SIGALRM, _BUSY))


class _OutOfTimeError(BaseException):
    """The time is over; no handler of the verifier's own errors catches it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Reject what takes more than `seconds` of processor time, or more stack, memory or digits than there are.

    Time is limited in the main thread only, where a signal can interrupt what runs.

    Raises
    ------
    RejectedError
        If a limit is reached.
    """
    timed = threading.current_thread() is threading.main_thread() and seconds > 0

    def ring(number: int, frame: FrameType | None) -> None:
        raise _OutOfTimeError

    alarms = _ALARMS if timed else ()
    before = [signal.signal(number, ring) for _, number, _ in alarms]
    for timer, _, factor in alarms:
        signal.setitimer(timer, factor * seconds)
    try:
        yield
    except _OutOfTimeError:
        raise RejectedError(
            f"the proof must end within {seconds:g} s of processor time, which this certificate or text does not "
            "allow; --time-limit gives it more"
        ) from None
    except RecursionError:
        raise RejectedError("the graphs and texts must not be nested deeper than they can be followed") from None
    except MemoryError:
        raise RejectedError("the proof must fit the memory, which this certificate or text does not allow") from None
    except (OverflowError, ValueError) as error:
        if isinstance(error, OverflowError) or "digits" in str(error):
            raise RejectedError("the numbers must be of a size that can be computed with") from None
        raise
    finally:
        for (timer, number, _), handler in zip(alarms, before, strict=True):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)
