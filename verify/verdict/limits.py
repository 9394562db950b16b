"""Limits of a verification: it ends with a sentence, however a certificate or a text is made."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from sosmith.verify.graph import RejectedError

SECONDS = 600.0
"""Time that a verification may take by default, in s; the largest design of the documents takes a tenth of it."""


class _OutOfTimeError(BaseException):
    """The time is over; no handler of the verifier's own errors catches it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Reject what takes longer than `seconds`, or more stack, memory or digits than there are.

    Time is limited in the main thread only, where a signal can interrupt what runs.

    Raises
    ------
    RejectedError
        If a limit is reached.
    """
    timed = threading.current_thread() is threading.main_thread() and seconds > 0

    def ring(number: int, frame: FrameType | None) -> None:
        raise _OutOfTimeError

    before = signal.signal(signal.SIGALRM, ring) if timed else None
    if timed:
        signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    except _OutOfTimeError:
        raise RejectedError(
            f"the proof must end within {seconds:g} s, which this certificate or text does not allow"
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
        if timed:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)
