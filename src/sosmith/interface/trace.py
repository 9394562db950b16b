"""Inputs of a design over time, from a scenario or a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.traces.trace import Trace as Coded

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trace:
    """Inputs of a design over time, from `Design.trace`.

    Arrays hold one sample per row, shape (samples,) for one channel and (samples, channels) for several.

    Attributes
    ----------
    name : str
        Name of the scenario or of the file.
    time : ndarray of float, shape (samples,)
        Time of each sample in s.
    inputs : dict of str to ndarray of float
        Physical values of each input: `Design.run(**inputs)` takes them.
    truth : ndarray of float or None
        True values, in the unit of the output, if they are known.
    """

    name: str
    time: Floats = field(repr=False)
    inputs: dict[str, Floats] = field(repr=False)
    truth: Floats | None = field(repr=False)

    coded: tuple[Coded, ...] = field(repr=False)
    """The same in the form of the inner packages, one for each channel, with codes."""

    @classmethod
    def of(cls, channels: Sequence[Coded]) -> Trace:
        """Make it of one trace per channel, all of the same length."""
        first = channels[0]
        truths = [trace.truth for trace in channels if trace.truth is not None]
        return cls(
            name=first.name,
            time=first.time,
            inputs={
                port.name: _columns([port.decode(trace.codes[:, k]) for trace in channels])
                for k, port in enumerate(first.ports)
            },
            truth=_columns(truths) if len(truths) == len(channels) else None,
            coded=tuple(channels),
        )

    def pieces(self) -> Iterator[str]:
        """Yield the text of `csv` piece by piece: a long trace need not be in memory as text."""
        from sosmith.model.traces.trace_file import trace_pieces

        return trace_pieces(self.coded)

    def csv(self) -> str:
        """Return the text of a CSV file, with a column for each input; several channels are told apart by another."""
        from sosmith.model.traces.trace_file import traces_csv

        return traces_csv(self.coded)

    def write(self, path: str | PathLike[str]) -> None:
        """Write the CSV file, or sound if the name ends in .wav: codes of a core with one input.

        Raises
        ------
        SpecificationError
            If the folder cannot be written; for sound, if there are several inputs, or the sample rate is no whole
            number of Hz.
        """
        from sosmith.model.traces.formats import write_trace_file

        write_trace_file(Path(fspath(path)), self.coded)


def _columns(channels: Sequence[Floats]) -> Floats:
    return channels[0] if len(channels) == 1 else np.stack(channels, axis=1)
