"""Samples for a board from a trace file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np

from sosmith.model.arrays import Codes
from sosmith.model.link.identity import Identity
from sosmith.model.traces.formats import read_trace_file


def samples_for(identity: Identity, path: Path) -> Codes:
    """Return codes of shape (samples, channels, inputs) from a trace file.

    A file with a single channel drives all channels, each one sample later than the one before.

    Raises
    ------
    SpecificationError
        If the file does not fit the board, as for `read_trace_file`.
    """
    rate = Fraction(identity.sample_rate).limit_denominator(10**9)
    traces = read_trace_file(path, identity.input_ports, rate, identity.channels)
    return np.stack([trace.codes for trace in traces], axis=1)
