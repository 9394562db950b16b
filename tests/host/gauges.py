"""A gauge and what it is fed."""

from __future__ import annotations

from typing import Any

import numpy as np
from tests.host.lines import device_of
from tests.interface.small import instrument_design

from sosmith.host.board import Results
from sosmith.host.readings import Readings

FLAGS = {"wear_warning": 3, "wear_critical": 4}


MANIFEST = {"spec": {"wear": {"initial": 1.0, "warning": 0.5, "limit": 2.0}}}


def gauge(**changes: Any) -> Readings:
    about = device_of(instrument_design())._identity.model_copy(update={"flags": FLAGS, **changes})
    return Readings(about, MANIFEST, "/dev/ttyUSB1")


def feed(readings: Readings, count: int = 1000, start: float = 0.0) -> None:
    """Add results whose first channel rises by 36 mm/h, and whose second has a warning once."""
    first = readings.samples
    numbers = np.arange(first, first + count)
    values = np.stack([1 + numbers / 10_000, np.full(count, 2.0)], axis=1)
    status = np.stack([np.zeros(count), np.where(numbers == 500, 8, 0)], axis=1).astype(np.uint8)
    readings.add(Results(values, values.astype(np.int64), status, FLAGS), first, start)
