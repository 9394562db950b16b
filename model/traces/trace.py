"""Traces: the input codes of a core over time, with the true values they represent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes, Values
from sosmith.model.port import Port


@dataclass(frozen=True)
class Tone:
    """A sine.

    Attributes
    ----------
    frequency : Fraction
        Frequency in Hz.
    settled : int
        Number of samples after which nothing is left of its beginning.
    """

    frequency: Fraction
    settled: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """Input codes of a core, one row per sample. All arrays are read-only; those that already are so are not copied.

    Attributes
    ----------
    name : str
        Name of the scenario or the file.
    ports : tuple of Port
        Inputs, in the order of the columns of `codes`.
    sample_rate : Fraction
        Samples per second.
    codes : ndarray of int64, shape (n, n_inputs)
        Codes within the ports' ranges; at least one sample.
    truth : ndarray, shape (n,), optional
        True values: the result of an ideal measurement, in the unit of the core's output.
    reading : ndarray of bool, shape (n,), optional
        Samples at which the measurement is compared with `truth`.
    seed : int, optional
        Seed of a generated trace.
    tone : Tone, optional
        What the only input is, where it is a sine.
    limited : tuple of int
        Number of values of each input that were out of its range before they became codes; empty if none can have been.

    Raises
    ------
    ValueError
        If there is no sample, a shape is wrong, a code is out of range, a true value is not finite, or the sample
        rate is not positive.
    """

    name: str
    ports: tuple[Port, ...]
    sample_rate: Fraction
    codes: Codes
    truth: Values | None = None
    reading: npt.NDArray[np.bool_] | None = None
    seed: int | None = None
    tone: Tone | None = None
    limited: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if self.sample_rate <= 0:
            raise ValueError(f"sample_rate must be positive, not {self.sample_rate}")
        codes = _own(self.codes, np.int64)
        if codes.ndim != 2 or codes.shape[1] != len(self.ports) or not codes.size:
            raise ValueError(f"codes must be of shape (n, {len(self.ports)}) with n > 0, not {codes.shape}")
        for port, column in zip(self.ports, codes.T, strict=True):
            wrong = column[(column < port.lowest) | (column > port.highest)]
            if len(wrong):
                raise ValueError(f"{port.name} must be in {port.lowest}..{port.highest}, not {wrong[0]}")
        self._freeze("codes", codes)
        if self.truth is not None:
            truth = _own(self.truth, np.float64)
            if truth.shape != codes.shape[:1] or not np.all(np.isfinite(truth)):
                raise ValueError(f"truth must be {len(codes)} finite numbers, not of shape {truth.shape}")
            self._freeze("truth", truth)
        if self.reading is not None:
            reading = _own(self.reading, np.bool_)
            if reading.shape != codes.shape[:1]:
                raise ValueError(f"reading must be {len(codes)} flags, not of shape {reading.shape}")
            self._freeze("reading", reading)

    def _freeze(self, name: str, array: npt.NDArray[np.generic]) -> None:
        array.setflags(write=False)
        object.__setattr__(self, name, array)

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.codes)

    @property
    def time(self) -> Values:
        """Time of each sample in s, shape (n,), from 0."""
        time = np.arange(len(self), dtype=np.float64)
        time /= float(self.sample_rate)
        return time

    def delayed(self, samples: int) -> Trace:
        """Return the trace delayed by `samples`, with equal length; the first sample is held until then."""
        if not samples:
            return self
        source = np.maximum(np.arange(len(self)) - samples, 0)
        return replace(
            self,
            codes=self.codes[source],
            truth=None if self.truth is None else self.truth[source],
            reading=None if self.reading is None else self.reading[source],
            tone=None if self.tone is None else replace(self.tone, settled=self.tone.settled + samples),
        )

    def first(self, count: int) -> Trace:
        """Return the first `count` samples, at least one; all if there are fewer."""
        return replace(
            self,
            codes=self.codes[:count],
            truth=None if self.truth is None else self.truth[:count],
            reading=None if self.reading is None else self.reading[:count],
        )

    def every(self, count: int) -> Trace:
        """Return the trace with one sample out of `count`, the first among them."""
        return replace(
            self,
            sample_rate=self.sample_rate / count,
            codes=self.codes[::count],
            truth=None if self.truth is None else self.truth[::count],
            reading=None if self.reading is None else self.reading[::count],
            tone=None if self.tone is None else replace(self.tone, settled=-(-self.tone.settled // count)),
        )

    def values(self) -> Values:
        """Return the physical values of the codes in the ports' units, shape (n, n_inputs)."""
        decoded = [port.decode(column) for port, column in zip(self.ports, self.codes.T, strict=True)]
        return np.stack(decoded, axis=1)


def _own(array: npt.ArrayLike, kind: type[np.generic]) -> npt.NDArray[Any]:
    """Return a copy that nobody else can change, or the array itself if nobody can."""
    if isinstance(array, np.ndarray) and array.dtype == kind and not array.flags.writeable:
        return array
    return np.array(array, dtype=kind)
