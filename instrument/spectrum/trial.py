"""Runs a proposed filter on a trace with truth: the error before and after, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import signal

from sosmith.instrument.spectrum.proposal import Proposal
from sosmith.instrument.spectrum.spectra import Array

SETTLING = 10.0
"""Length of the start-up transient that is left out, in group delays."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Errors relative to the truth, in the signal's unit, without their means: no filter removes an offset.

    Attributes
    ----------
    samples : int
        Number of samples compared.
    at_readings : bool
        Whether only the trace's readings are compared, at the same time; otherwise the truth is delayed like the
        filter's output.
    before, after : float
        Rms error without and with the filter.
    offset_before, offset_after : float
        Mean error without and with the filter. If readings are compared at the same time, the second includes the lag
        behind a steady change.
    """

    samples: int
    at_readings: bool
    before: float
    after: float
    offset_before: float
    offset_after: float


def try_filter(values: Array, truth: Array, reading: npt.NDArray[np.bool_] | None, proposal: Proposal) -> Trial | None:
    """Filter `values`, shape (n,), and compare with `truth`; None if the trace is too short to settle.

    The filter runs in double precision and starts in the steady state for the first value.
    """
    made = proposal.filter
    filtered, _ = signal.sosfilt(made.sos, values, zi=signal.sosfilt_zi(made.sos) * values[0])
    settled = int(np.ceil(SETTLING * proposal.delay * made.sample_rate))
    lag = 0 if reading is not None else round(proposal.delay * made.sample_rate)
    index = np.arange(max(settled, lag), len(values))
    if reading is not None:
        index = index[reading[index]]
    if len(index) < 2:
        return None
    before, after = (values - truth)[index - lag], filtered[index] - truth[index - lag]
    return Trial(
        samples=len(index),
        at_readings=reading is not None,
        before=float(np.std(before)),
        after=float(np.std(after)),
        offset_before=float(np.mean(before)),
        offset_after=float(np.mean(after)),
    )
