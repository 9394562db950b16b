"""What a scenario works on: the core that it drives, one call of it, and what it makes."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes, Values
from sosmith.model.calibration.polynomial import Polynomial
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port

MIN_SAMPLES = 4000
"""Samples that a trace has at least, unless its length is given."""

MAX_SAMPLES = 60_000
"""Samples that a trace has at most, unless its length is given: a co-simulation of tens of seconds."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Bench:
    """What a scenario needs to know of the core.

    Attributes
    ----------
    ports : tuple of Port
        Inputs: voltage in V and, if there are two, temperature in degC for an instrument; any one input
        for a plain filter.
    output : Port
        Output; its LSB says when the filter has settled.
    sample_rate : Fraction
        Samples per second.
    polynomial : Polynomial, optional
        Calibration; without it the core is a plain filter.
    impulse_response : ndarray, shape (n,)
        Impulse response of the ideal filter, long enough for the rest not to matter; ``[1.0]`` for a
        core without a filter.
    error_responses : tuple of ndarray, shape (m,)
        Impulse response from each rounding inside the filter to its output; none for a core without a filter.

    Raises
    ------
    ValueError
        If the count of ports does not fit, an impulse response is empty or not finite, or the sample
        rate is not positive.
    """

    ports: tuple[Port, ...]
    output: Port
    sample_rate: Fraction
    polynomial: Polynomial | None
    impulse_response: Values
    error_responses: tuple[Values, ...] = ()

    def __post_init__(self) -> None:
        most, expected = (1, "one input") if self.polynomial is None else (2, "one or two inputs")
        if not 1 <= len(self.ports) <= most:
            raise ValueError(f"ports must be {expected}, not {len(self.ports)}")
        if self.sample_rate <= 0:
            raise ValueError(f"sample_rate must be positive, not {self.sample_rate}")
        named = [("impulse_response", self.impulse_response)]
        named += [(f"error_responses[{k}]", response) for k, response in enumerate(self.error_responses)]
        for name, h in named:
            if h.ndim != 1 or not len(h) or not np.all(np.isfinite(h)):
                raise ValueError(f"{name} must be a row of finite numbers, not of shape {h.shape}")

    @property
    def kind(self) -> str:
        """``"instrument"`` with a calibration, else ``"filter"``."""
        return "filter" if self.polynomial is None else "instrument"

    def settling(self, step: float) -> int:
        """Count the samples after a step of the input until the output stays within half an output LSB.

        `step` is in the output's unit. The response differs from its last value by at most `step`
        times the sum of the magnitudes of the impulse response still to come.
        """
        to_come = np.cumsum(np.abs(self.impulse_response[::-1]))[::-1]
        return int(np.count_nonzero(to_come[1:] * step > float(self.output.lsb) / 2))


@dataclass(frozen=True, eq=False)
class Run:
    """One call of a scenario: where, how long, and the source of all chance.

    Attributes
    ----------
    name : str
        The scenario's.
    bench : Bench
        The core.
    samples : int
        Length of the trace, at least 1.
    rng : Generator
        Where all noise comes from.
    """

    name: str
    bench: Bench
    samples: int
    rng: np.random.Generator

    @cached_property
    def progress(self) -> Values:
        """0 at the first sample, 1 at the last, shape (n,)."""
        return np.arange(self.samples) / max(self.samples - 1, 1)

    @property
    def time(self) -> Values:
        """Time of each sample in s, shape (n,), from 0."""
        return np.arange(self.samples) / float(self.bench.sample_rate)

    def between(self, ends: tuple[float, float]) -> Values:
        """Draw a straight line over the whole trace, shape (n,)."""
        return ends[0] + (ends[1] - ends[0]) * self.progress

    def refuse_length(self, least: int, why: str) -> SpecificationError:
        """Make the error about a trace that must have at least `least` samples; `why` goes in parentheses."""
        rate = float(self.bench.sample_rate)
        return SpecificationError(
            f"seconds must be at least {least / rate:.6g} for {self.name} ({why}), not {self.samples / rate:.6g}"
        )


@dataclass(frozen=True, eq=False)
class Emulated:
    """What a scenario makes.

    Attributes
    ----------
    codes : ndarray of int64, shape (n, n_inputs)
    truth : ndarray, shape (n,), optional
        In the unit of the core's output.
    reading : ndarray of bool, shape (n,), optional
        The samples at which truth and measurement are compared.
    """

    codes: Codes
    truth: Values | None = None
    reading: npt.NDArray[np.bool_] | None = None
