"""How the codes of a trace lie in the ranges of its inputs: a signal at an end of its range was probably cut."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sosmith.gen.quantity import quantity
from sosmith.model.traces.trace import Trace


@dataclass(frozen=True)
class InputRange:
    """The codes of one input, over all channels.

    Attributes
    ----------
    name, unit : str
        The input and its unit.
    low, high : float
        Value of its lowest code, and an LSB beyond its highest.
    samples, at_end : int
        All codes, and those that are the lowest or the highest.
    limited : int
        Values of the trace outside the range, which no code represents; 0 for a trace of codes.
    synthetic : bool
        Whether the trace is a test signal of ours that knows no true value: such signals go to the ends on purpose.
    """

    name: str
    unit: str
    low: float
    high: float
    samples: int
    at_end: int
    limited: int
    synthetic: bool

    @property
    def entry(self) -> dict[str, Any]:
        """The numbers for JSON, with shares from 0 to 1."""
        return {
            "name": self.name,
            "range": [self.low, self.high],
            "at_end": self.at_end / self.samples,
            "limited": self.limited / self.samples,
        }


def input_ranges(traces: Sequence[Trace]) -> tuple[InputRange, ...]:
    """Return the use of each input's range by the traces of all channels, in the order of the inputs."""
    ranges = []
    for k, port in enumerate(traces[0].ports):
        columns = [trace.codes[:, k] for trace in traces]
        low, high = port.decode(np.array([port.lowest, port.highest + 1]))
        ranges.append(
            InputRange(
                name=port.name,
                unit=port.unit,
                low=float(low),
                high=float(high),
                samples=sum(map(len, columns)),
                at_end=sum(
                    int(np.count_nonzero((codes == port.lowest) | (codes == port.highest))) for codes in columns
                ),
                limited=sum(trace.limited[k] for trace in traces if trace.limited),
                synthetic=traces[0].seed is not None and traces[0].truth is None,
            )
        )
    return tuple(ranges)


def limited_inputs(ranges: Sequence[InputRange]) -> Iterator[str]:
    """Say which inputs were outside their ranges: no result is accurate to what the trace meant."""
    for each in ranges:
        if each.limited:
            low, high = (quantity(value, each.unit) for value in (each.low, each.high))
            yield (
                f"The input {each.name} must stay in its range, {low} to {high}: {_share(each.limited, each)} of "
                "the values in the trace do not, and were limited to it: scale the trace, or widen "
                f"input.{each.name}.range."
            )


def inputs_at_an_end(ranges: Sequence[InputRange]) -> Iterator[str]:
    """Say which inputs have codes at an end of their ranges, and how many."""
    for each in ranges:
        if each.at_end > each.limited and not each.synthetic:
            yield (
                f"{_share(each.at_end, each)} of the codes of {each.name} are at an end of its range: if the trace "
                "was measured, the converter was overdriven there, and the accuracy is that of a clipped signal."
            )


def _share(part: int, whole: InputRange) -> str:
    percent = 100 * part / whole.samples
    return f"{percent:.3g} %" if percent >= 0.01 else f"{part:,} of {whole.samples:,}"
