"""Inputs and outputs of a scenario: the core it drives, one call, and the resulting signals."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes, Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.traces.trace import Tone

MIN_SAMPLES = 4000
"""Lowest default number of samples of a trace."""

MAX_SAMPLES = 60_000
"""Highest default number of samples of a trace: a co-simulation of tens of seconds."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Bench:
    """Properties of the core that a scenario needs.

    Attributes
    ----------
    ports : tuple of Port
        Inputs: voltage in V and, if there are two, temperature in degC for an instrument; any one input
        for a plain filter.
    output : Port
        Output; the filter counts as settled within half its LSB.
    sample_rate : Fraction
        Samples per second.
    polynomial : Polynomial, optional
        Calibration; None for a plain filter.
    impulse_response : ndarray, shape (n,)
        Impulse response of the ideal filter, up to a negligible remainder; ``[1.0]`` for a core without a filter.
    error_responses : tuple of ndarray, shape (m,)
        Impulse response from each quantizer inside the filter to its output; empty for a core without a filter.

    Raises
    ------
    ValueError
        If the number of ports is wrong, an impulse response is empty or not finite, or the sample rate is not
        positive.
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

    @property
    def bins(self) -> int:
        """Number of frequencies from zero to half the sample rate at which the gain is computed."""
        return (1 << max(len(self.impulse_response), 1 << 14).bit_length()) // 2 + 1

    @cached_property
    def _gains(self) -> Values:
        return np.asarray(np.abs(np.fft.rfft(self.impulse_response, 2 * (self.bins - 1))))

    def gain(self, frequency: Values) -> Values:
        """Return the gain of the ideal filter, before its output is decimated, at frequencies in Hz."""
        return np.interp(frequency, np.linspace(0, float(self.sample_rate) / 2, self.bins), self._gains)

    def settling(self, step: float) -> int:
        """Return the samples from an input step until the output stays within half an output LSB of its final value.

        `step` is in the output's unit. The output differs from its final value by at most `step` times the sum of the
        magnitudes of the remaining impulse response.
        """
        to_come = np.cumsum(np.abs(self.impulse_response[::-1]))[::-1]
        return int(np.count_nonzero(to_come[1:] * step > float(self.output.lsb) / 2))


@dataclass(frozen=True, eq=False)
class Run:
    """One call of a scenario: its core, length and source of randomness.

    Attributes
    ----------
    name : str
        Name of the scenario.
    bench : Bench
        The core.
    samples : int
        Length of the trace, at least 1.
    rng : Generator
        Source of all randomness.
    """

    name: str
    bench: Bench
    samples: int
    rng: np.random.Generator

    @cached_property
    def progress(self) -> Values:
        """Linear ramp from 0 at the first sample to 1 at the last, shape (n,)."""
        return np.arange(self.samples) / max(self.samples - 1, 1)

    @property
    def time(self) -> Values:
        """Time of each sample in s, shape (n,), from 0."""
        return np.arange(self.samples) / float(self.bench.sample_rate)

    def between(self, ends: tuple[float, float]) -> Values:
        """Return a linear ramp between `ends` over the whole trace, shape (n,)."""
        return ends[0] + (ends[1] - ends[0]) * self.progress

    def refuse_length(self, least: int, why: str) -> SpecificationError:
        """Return the error for a trace with fewer than `least` samples; `why` is the reason, in parentheses."""
        rate = float(self.bench.sample_rate)
        return SpecificationError(
            f"seconds must be at least {least / rate:.6g} for {self.name} ({why}), not {self.samples / rate:.6g}"
        )


@dataclass(frozen=True, eq=False)
class Emulated:
    """Signals generated by a scenario.

    Attributes
    ----------
    codes : ndarray of int64, shape (n, n_inputs)
        Input codes of the core.
    truth : ndarray, shape (n,), optional
        True values, in the unit of the core's output.
    reading : ndarray of bool, shape (n,), optional
        Samples at which the measurement is compared with `truth`.
    tone : Tone, optional
        What the signal is, where it is a sine.
    """

    codes: Codes
    truth: Values | None = None
    reading: npt.NDArray[np.bool_] | None = None
    tone: Tone | None = None
