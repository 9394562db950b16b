"""One run of a core: codes in and out, and what the integer model and the exact chain say of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from sosmith.gen.core import CoreDesign
from sosmith.model.arrays import Codes, side_by_side
from sosmith.model.dataflow.status import Flag
from sosmith.model.port import Port
from sosmith.model.traces.trace import Tone, Trace

Array = npt.NDArray[np.float64]
Column = Array | Callable[[], Array]
"""An array, or what makes a new one each time: there is no room for all that follows from millions of samples."""
Mask = npt.NDArray[np.bool_]
_Kind = TypeVar("_Kind", bound=np.generic)

_COLUMNS = ("received", "values", "golden", "before", "truth", "reading", "unsettled")
"""The arrays of which a view of one channel keeps a column."""


@dataclass(frozen=True)
class Instants:
    """Instants in s at even steps from 0, made where they are asked for.

    Attributes
    ----------
    count : int
        Number of instants.
    rate : float
        Instants in a second.
    """

    count: int
    rate: float

    def __len__(self) -> int:
        """Return the number of instants."""
        return self.count

    def __getitem__(self, index: Any) -> Any:
        """Return those that an array would have at `index`: a number, a slice or an array of numbers."""
        if isinstance(index, slice):
            return np.arange(*index.indices(self.count), dtype=np.float64) / self.rate
        return np.asarray(index, dtype=np.float64) / self.rate


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """The results of one run; arrays have the shape (n, channels), those of one channel alone (n,).

    Values are in the unit of the output. The properties `time`, `hardware` and `unfiltered` are made anew each time.

    Attributes
    ----------
    scenario : str
        Name of the trace.
    instants : ndarray or Instants, shape (n,)
        Instants of the results in s, rising.
    codes : int64 array, shape (samples, channels, inputs)
        What went in; behind a decimator, more samples than results.
    received : array of integers
        What came out, in the smallest type that holds the codes of the output: a run may have ten million of them.
    values : Column
        The values of `received`.
    differs : ndarray of bool, shape (n, channels)
        Where a code or a flag is not that of the integer model; always of all channels.
    golden : ndarray
        The exact chain on the same codes, limited to the range of the output.
    before : Column or None
        The calibration alone; None without a filter.
    truth : ndarray or None
        True values, where the trace has them.
    reading : ndarray of bool or None
        The instants at which the measurement counts, all if None.
    unsettled : ndarray of bool or None
        The results that the hardware flags as settling; None if it has no flag for that.
    cycles : int
        Clock cycles from the end of reset to the last result.
    tone : Tone or None
        What went in, where it is a sine; in results, settled in all channels.
    shown_channel : int or None
        The channel that the arrays are of, where it is one of several.
    """

    scenario: str
    instants: Array | Instants
    codes: Codes
    received: npt.NDArray[np.signedinteger[Any]]
    values: Column
    differs: Mask
    golden: Array
    before: Column | None = None
    truth: Array | None = None
    reading: Mask | None = None
    unsettled: Mask | None = None
    cycles: int = 0
    tone: Tone | None = None
    shown_channel: int | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.received if callable(self.values) else self.values)
        if len(shape) not in {1, 2} or min(shape) < 1:
            raise ValueError(f"hardware must have the shape (n,) or (n, channels) with n >= 1, not {shape!r}")
        if (len(self.instants),) != shape[:1]:
            raise ValueError(f"time must have the shape {shape[:1]!r}, not {(len(self.instants),)!r}")
        for name in _COLUMNS:
            values = getattr(self, name)
            if values is not None and not callable(values) and np.shape(values) != shape:
                raise ValueError(f"{_TOLD.get(name, name)} must have the shape {shape!r}, not {np.shape(values)!r}")
        for name in ("golden", "values"):
            values = getattr(self, name)
            if not callable(values) and not np.all(np.isfinite(values)):
                raise ValueError(f"{_TOLD.get(name, name)} must be finite, not NaN or infinite")

    def __len__(self) -> int:
        """Return the number of instants."""
        return len(self.golden)

    @property
    def time(self) -> Array:
        """Instants of the results in s, shape (n,)."""
        return np.asarray(self.instants[:])

    @property
    def hardware(self) -> Array:
        """The values of `received`."""
        return _array(self.values)

    @property
    def unfiltered(self) -> Array | None:
        """The calibration alone; None without a filter."""
        return None if self.before is None else _array(self.before)

    @property
    def error(self) -> Array:
        """Hardware minus golden, a new array."""
        return self.minus(self.golden)

    def minus(self, other: Array) -> Array:
        """Return hardware minus `other`, a new array."""
        values = self.hardware
        return np.subtract(values, other, out=values if callable(self.values) else None)

    def at(self, index: int) -> float:
        """Return an instant in s; a negative index counts from the end."""
        return float(self.instants[range(len(self))[index]])

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
        columns: dict[str, Any] = {name: _column(array, channel) for name, array in arrays.items()}
        return replace(self, shown_channel=channel if self.channels > 1 else None, **columns)


_TOLD = {"values": "hardware", "before": "unfiltered"}
"""What messages call the attributes that properties make arrays of."""


def _array(column: Column) -> Array:
    return column() if callable(column) else column


def _column(column: Column | None, channel: int) -> Column | None:
    """Return one channel of an array, or what makes it."""
    if callable(column):
        return lambda: column()[:, channel]
    return None if column is None else column[:, channel]


def run_of(
    design: CoreDesign,
    traces: Sequence[Trace],
    received: Codes | None = None,
    status: npt.NDArray[np.uint8] | None = None,
    *,
    cycles: int = 0,
) -> Run:
    """Compare what hardware computed from `traces`, one for each channel, with integer model and exact chain.

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
    codes = side_by_side([trace.codes for trace in traces])
    expected, flags = datapath.compute_with_status(codes)
    if received is None or status is None:
        received, status = expected, flags
    received, status = received[: len(expected)], status[: len(expected)]  # not what fills a beat
    differs = (expected != received) | (flags != status)
    unsettled = (status >> Flag.SETTLING & 1).astype(np.bool_) if datapath.settles else None
    received = np.asarray(received, dtype=_smallest(datapath.output))
    del expected, flags, status  # the exact chain takes as much memory
    if datapath.samples_per_result > 1:  # only samples that bring a result can be compared
        traces = [trace.every(datapath.samples_per_result) for trace in traces]
    run = Run(
        scenario=traces[0].name,
        instants=Instants(len(traces[0]), float(traces[0].sample_rate)),
        codes=codes,
        received=received,
        values=lambda: datapath.output.decode(received),
        differs=differs,
        golden=quantized.exact(codes),
        before=None if quantized.filter is None else lambda: quantized.unfiltered(codes),
        truth=_stacked([trace.truth for trace in traces]),
        reading=_stacked([trace.reading for trace in traces]),
        unsettled=unsettled,
        cycles=cycles,
        tone=max((trace.tone for trace in traces if trace.tone is not None), key=_settled, default=None),
    )
    return run.of_channel(0) if len(traces) == 1 else run


def _settled(tone: Tone) -> int:
    return tone.settled


def _smallest(port: Port) -> type[np.signedinteger[Any]]:
    """Return the smallest type with a sign that holds the codes of a port."""
    return next(kind for kind in (np.int16, np.int32, np.int64) if np.iinfo(kind).max >= port.highest)


def _stacked(columns: Sequence[npt.NDArray[_Kind] | None]) -> npt.NDArray[_Kind] | None:
    """Columns of all channels side by side, or None if there are none."""
    present = [column for column in columns if column is not None]
    return side_by_side(present) if present else None
