"""Samples for a board from a trace file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np

from sosmith.model.arrays import Codes
from sosmith.model.link.identity import Identity
from sosmith.model.traces.trace_file import read_traces


def samples_for(identity: Identity, path: Path) -> Codes:
    """Return codes of shape (samples, channels, inputs) from a trace file.

    A file without the column channel drives all channels, each one sample later than the one before.

    Raises
    ------
    SpecificationError
        If the file does not fit the board, as for `read_traces`.
    """
    rate = Fraction(identity.sample_rate).limit_denominator(10**9)
    traces = read_traces(path, identity.input_ports, rate, identity.channels)
    if len(traces) < identity.channels:
        traces = tuple(traces[0].delayed(k) for k in range(identity.channels))
    return np.stack([trace.codes for trace in traces], axis=1)
