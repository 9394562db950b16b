"""Streams samples through a core with the loop of ``loop.h``, which is compiled together with the core's model."""

from __future__ import annotations

import ctypes
import random
from collections.abc import Callable

from sosmith.sim.beats import Beats
from sosmith.sim.stream.bursts import Pace
from sosmith.sim.stream.rules import BUSY, PROBED_SHARE, SILENCE, ProtocolError, Word, followed, hung, moved, too_many

_BLOCK = 1 << 17  # clocks between two reports of progress: some tens of milliseconds
_GOES_ON, _DONE, _FOLLOWED, _MOVED, _HUNG, _TOO_MANY = range(6)


class _Pace(ctypes.Structure):
    _fields_ = (
        ("waiting", ctypes.c_double),
        ("spread", ctypes.c_double),
        ("share", ctypes.c_double),
        ("left", ctypes.c_uint64),
    )


class _Word(ctypes.Structure):
    _fields_ = (("tdest", ctypes.c_uint64), ("tdata", ctypes.c_uint64), ("tuser", ctypes.c_uint64))

    def value(self) -> Word:
        return Word(self.tdest, self.tdata, self.tuser)


class _Stream(ctypes.Structure):
    """State of the loop; ``loop.h`` has the same structure."""

    _fields_ = (
        ("sent_tdest", ctypes.c_void_p),
        ("sent_tdata", ctypes.c_void_p),
        ("to_send", ctypes.c_uint64),
        ("to_receive", ctypes.c_uint64),
        ("received_tdest", ctypes.c_void_p),
        ("received_tdata", ctypes.c_void_p),
        ("received_tuser", ctypes.c_void_p),
        ("patience", ctypes.c_uint64),
        ("silence_limit", ctypes.c_uint64),
        ("busy", ctypes.c_uint64),
        ("probed_share", ctypes.c_double),
        ("idle", _Pace),
        ("stall", _Pace),
        ("clocks", ctypes.c_uint64),
        ("sent", ctypes.c_uint64),
        ("received", ctypes.c_uint64),
        ("silence", ctypes.c_uint64),
        ("offered", ctypes.c_uint64),
        ("held_valid", ctypes.c_uint64),
        ("word_valid", ctypes.c_uint64),
        ("held", _Word),
        ("word", _Word),
        ("twister", ctypes.c_uint32 * 624),
        ("position", ctypes.c_uint32),
    )


def stream(
    library: ctypes.CDLL,
    words: Beats,
    received: Beats,
    *,
    seed: int,
    idle: float,
    stall: float,
    patience: int,
    progress: Callable[[int], None],
) -> tuple[int, int, ProtocolError | None]:
    """Send `words` at a random pace and receive all their results, checking every clock.

    To be called while the clock is low and all inputs have settled.

    Parameters
    ----------
    library : CDLL
        Where the loop is.
    words : Beats
        What to send.
    received : Beats
        Arrays as long as there are results, to be filled with what comes out.
    seed, idle, stall
        The random pace, as in `sosmith.sim.stream.bursts`.
    patience : int
        Clocks that the core may take for one sample.
    progress : callable
        Called with the number of samples received, from time to time.

    Returns
    -------
    clocks : int
        Clocks taken.
    count : int
        Samples received.
    error : ProtocolError or None
        The rule that the core broke.
    """
    loop = library.sosmith_stream
    loop.restype, loop.argtypes = ctypes.c_int32, (ctypes.c_void_p, ctypes.c_uint64)
    source = random.Random(seed)
    _, numbers, _ = source.getstate()
    paces = [_Pace(pace.waiting, pace.spread) for pace in (Pace(source, idle), Pace(source, stall))]
    state = _Stream(
        sent_tdest=words.tdest.ctypes.data,
        sent_tdata=words.tdata.ctypes.data,
        to_send=len(words),
        to_receive=len(received),
        received_tdest=received.tdest.ctypes.data,
        received_tdata=received.tdata.ctypes.data,
        received_tuser=received.tuser.ctypes.data,
        patience=patience,
        silence_limit=SILENCE,
        busy=BUSY,
        probed_share=PROBED_SHARE,
        idle=paces[0],
        stall=paces[1],
        twister=(ctypes.c_uint32 * 624)(*numbers[:-1]),
        position=numbers[-1],
    )
    while (outcome := loop(ctypes.byref(state), _BLOCK)) == _GOES_ON:
        progress(state.received)
    return state.clocks, state.received, _error(outcome, state)


def _error(outcome: int, state: _Stream) -> ProtocolError | None:
    if outcome == _DONE:
        return None
    if outcome == _FOLLOWED:
        return followed(state.clocks)
    if outcome == _MOVED:
        return moved(state.held.value(), state.word.value() if state.word_valid else None, state.received)
    if outcome == _TOO_MANY:
        return too_many(state.received)
    return hung(state.silence, state.sent, state.received)
