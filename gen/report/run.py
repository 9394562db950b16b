"""One run of a core: codes in and out, and what the integer model and the exact chain say of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from sosmith.gen.core import CoreDesign
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.status import Flag
from sosmith.model.traces.trace import Trace

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
_Kind = TypeVar("_Kind", bound=np.generic)

_COLUMNS = ("received", "hardware", "golden", "unfiltered", "truth", "reading", "unsettled")
"""The arrays of which a view of one channel keeps a column."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """The results of one run; arrays have the shape (n, channels), those of one channel alone (n,).

    Values are in the unit of the output.

    Attributes
    ----------
    scenario : str
        Name of the trace.
    time : ndarray, shape (n,)
        Instants of the results in s, rising.
    codes : int64 array, shape (samples, channels, inputs)
        What went in; behind a decimator, more samples than results.
    received : int64 array
        What came out.
    hardware : ndarray
        The values of `received`.
    differs : ndarray of bool, shape (n, channels)
        Where a code or a flag is not that of the integer model; always of all channels.
    golden : ndarray
        The exact chain on the same codes, limited to the range of the output.
    unfiltered : ndarray or None
        The calibration alone; None without a filter.
    truth : ndarray or None
        True values, where the trace has them.
    reading : ndarray of bool or None
        The instants at which the measurement counts, all if None.
    unsettled : ndarray of bool or None
        The results that the hardware flags as settling; None if it has no flag for that.
    cycles : int
        Clock cycles from the end of reset to the last result.
    shown_channel : int or None
        The channel that the arrays are of, where it is one of several.
    """

    scenario: str
    time: Array
    codes: Codes
    received: Codes
    hardware: Array
    differs: Mask
    golden: Array
    unfiltered: Array | None = None
    truth: Array | None = None
    reading: Mask | None = None
    unsettled: Mask | None = None
    cycles: int = 0
    shown_channel: int | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.hardware)
        if len(shape) not in {1, 2} or min(shape) < 1:
            raise ValueError(f"hardware must have the shape (n,) or (n, channels) with n >= 1, not {shape!r}")
        if np.shape(self.time) != shape[:1]:
            raise ValueError(f"time must have the shape {shape[:1]!r}, not {np.shape(self.time)!r}")
        for name in _COLUMNS:
            values = getattr(self, name)
            if values is not None and np.shape(values) != shape:
                raise ValueError(f"{name} must have the shape {shape!r}, not {np.shape(values)!r}")
        for name in ("golden", "hardware"):
            if not np.all(np.isfinite(getattr(self, name))):
                raise ValueError(f"{name} must be finite, not NaN or infinite")

    @property
    def error(self) -> Array:
        """Hardware minus golden."""
        return self.hardware - self.golden

    @property
    def channels(self) -> int:
        """Number of channels that ran."""
        return int(self.codes.shape[1])

    @property
    def taken(self) -> int:
        """Number of samples that went in, over all channels."""
        return len(self.codes) * self.channels

    @property
    def samples(self) -> int:
        """Number of results, over all channels."""
        return int(self.differs.size)

    @property
    def mismatches(self) -> int:
        """Number of results that are not those of the integer model."""
        return int(np.count_nonzero(self.differs))

    @property
    def first_mismatch(self) -> int | None:
        """Number of the first such result in its channel; None if there is none."""
        wrong = np.flatnonzero(self.differs.any(axis=1))
        return int(wrong[0]) if len(wrong) else None

    @property
    def worst_channel(self) -> int:
        """Number of the channel that has the largest error."""
        return int(np.argmax(np.abs(self.error).max(axis=0))) if self.error.ndim == 2 else 0

    def of_channel(self, channel: int) -> Run:
        """Return the same with arrays of the shape (n,), those of one channel; counts stay those of the whole run."""
        if self.error.ndim == 1:
            return self
        arrays = {name: getattr(self, name) for name in _COLUMNS}
        columns: dict[str, Any] = {name: None if array is None else array[:, channel] for name, array in arrays.items()}
        return replace(self, shown_channel=channel if self.channels > 1 else None, **columns)


def run_of(
    design: CoreDesign,
    traces: Sequence[Trace],
    received: Codes | None = None,
    status: npt.NDArray[np.uint8] | None = None,
    *,
    cycles: int = 0,
) -> Run:
    """Hold what hardware made of `traces`, one for each channel, against integer model and exact chain.

    Parameters
    ----------
    design : CoreDesign
        The core.
    traces : sequence of Trace
        What went in, of equal lengths.
    received, status : arrays, shape (results or more, channels)
        Codes and flags that came out; what exceeds the results of the traces is left out. By default those of the
        integer model itself, without hardware.
    cycles : int
        Clock cycles that the hardware took.

    Raises
    ------
    ToolError
        If no C compiler is found.
    """
    quantized, datapath = design.quantized, design.datapath
    codes = np.stack([trace.codes for trace in traces], axis=1)
    expected, flags = datapath.compute_with_status(codes)
    if received is None or status is None:
        received, status = expected, flags
    received, status = received[: len(expected)], status[: len(expected)]  # not what fills a beat
    exact = quantized.exact(codes)
    if datapath.decimator is not None:  # what is told of a sample is told of those that bring a result
        traces = [trace.every(datapath.decimator.factor) for trace in traces]
    run = Run(
        scenario=traces[0].name,
        time=traces[0].time,
        codes=codes,
        received=received,
        hardware=datapath.output.decode(received),
        differs=(expected != received) | (flags != status),
        golden=exact.golden,
        unfiltered=None if quantized.filter is None else exact.calibrated,
        truth=_stacked([trace.truth for trace in traces]),
        reading=_stacked([trace.reading for trace in traces]),
        unsettled=(status >> Flag.SETTLING & 1).astype(np.bool_) if datapath.settles else None,
        cycles=cycles,
    )
    return run.of_channel(0) if len(traces) == 1 else run


def _stacked(columns: Sequence[npt.NDArray[_Kind] | None]) -> npt.NDArray[_Kind] | None:
    """Columns of all channels side by side, or None if there are none."""
    present = [column for column in columns if column is not None]
    return np.stack(present, axis=1) if present else None
