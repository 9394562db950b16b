"""The rules of AXI4-Stream that a bench checks: their limits, and the sentence for each way of breaking one."""

from __future__ import annotations

from typing import NamedTuple

SILENCE = 2000
"""Clocks without a transfer, with both sides ready most of the time, after which a core has hung."""

BUSY = 64
"""Clocks from input to output above which a bench sleeps while a core is busy and nothing can happen."""

PROBED_SHARE = 1 / 32
"""Share of all clocks at which combinational paths between the handshakes are tested for."""


class ProtocolError(Exception):
    """The core broke a rule of AXI4-Stream."""


class Word(NamedTuple):
    """A word of a stream: channel, data and, on the output stream, status."""

    tdest: int
    tdata: int
    tuser: int = 0


def followed(clock: int) -> ProtocolError:
    """Make the error of outputs that follow inputs within a clock."""
    return ProtocolError(
        f"outputs must not follow s_axis_tvalid or m_axis_tready within a clock, as they did at clock {clock}"
    )


def moved(offered: Word, word: Word | None, sample: int) -> ProtocolError:
    """Make the error of a stalled core that offers `offered` and then `word` or, for None, nothing."""
    if word is None:
        change = "drop m_axis_tvalid"
    else:
        name = next(name for name in Word._fields if getattr(offered, name) != getattr(word, name))
        change = f"change m_axis_{name} from {getattr(offered, name):#x} to {getattr(word, name):#x}"
    return ProtocolError(f"a stalled core must not {change}, as it did at sample {sample}")


def hung(silence: int, sent: int, received: int) -> ProtocolError:
    """Make the error of a core in which no sample has moved for `silence` clocks."""
    return ProtocolError(
        f"a sample must move at least every {silence - 1} clocks: {sent} went in and {received} came out before it hung"
    )


def too_many(received: int) -> ProtocolError:
    """Make the error of a core that offers more results than there are."""
    return ProtocolError(f"{received} samples must come out, not more")
