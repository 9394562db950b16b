"""The inductive displacement sensor: voltage from clearance and temperature, with its errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sosmith.instrument.sensors.coil import Coil
from sosmith.model.arithmetic.random_streams import Streams
from sosmith.model.arrays import Values
from sosmith.model.polynomial import EQUATION_4, EQUATION_5A, Polynomial

VOLTAGE_NOISE = 0.01
"""Broadband noise of the inductive sensor's voltage in V rms.

From the paper: its errors before (table 1) and after (table 4) the low-pass filter, taken as millimetres, differ by
8.8 um rms. Divided by the slope of equation 5a at each of the ten clearances (46.5 degC), this is 10.5 mV. Taken as
fractions of the clearance, as in equation 7, they differ by 64 um rms, and the noise is 48 mV.
"""

HARMONICS = 64
"""Number of cosines in the sum that models a systematic error; more do not change its statistics."""


class ForwardModel(Protocol):
    """Voltage in V of an ideal sensor from clearance in mm and temperature in degC."""

    def __call__(self, clearance: npt.ArrayLike, temperature: npt.ArrayLike) -> Values:
        """Return the voltage in V, of the broadcast shape."""
        ...


@dataclass(frozen=True)
class InverseRegression:
    """A regression of order 2 in the voltage, such as equations 4 and 5a of the paper, solved for the voltage.

    Of the two roots, the one on the rising branch is taken. A clearance below the minimum of the regression at that
    temperature gives the voltage at the minimum.
    """

    polynomial: Polynomial

    def __post_init__(self) -> None:
        if self.polynomial.orders[0] != 2:
            raise ValueError(f"polynomial must be of order 2 in the voltage, not {self.polynomial.orders[0]}")

    def __call__(self, clearance: npt.ArrayLike, temperature: npt.ArrayLike) -> Values:
        """Return the voltage in V at a clearance in mm and a temperature in degC."""
        c, b, a = (self._row(index, temperature) for index in range(3))
        discriminant = b * b - 4 * a * (c - np.asarray(clearance, dtype=np.float64))
        return np.asarray((np.sqrt(np.maximum(discriminant, 0.0)) - b) / (2 * a))

    def _row(self, index: int, temperature: npt.ArrayLike) -> Values:
        row = [float(value) for value in self.polynomial.coefficients[index]]
        return np.asarray(np.polynomial.polynomial.polyval(np.asarray(temperature, dtype=np.float64), row))


sensor_voltage = InverseRegression(EQUATION_5A)
"""The sensor described by equation 5a of the paper, without noise; at 20 degC its voltage is positive above 1.09 mm."""

FORWARD_MODELS: dict[str, ForwardModel] = {
    "equation_4": InverseRegression(EQUATION_4),
    "equation_5a": sensor_voltage,
    "coil": Coil(),
}
"""Forward models by their name in scenario files."""


@dataclass(frozen=True)
class Mains:
    """Mains hum in the voltage.

    Attributes
    ----------
    frequency : float
        Frequency of the fundamental in Hz. It aliases: sampled at 100 Hz, 50 Hz alternates from sample to sample;
        sampled at 6 Hz, it appears at 2 Hz.
    amplitudes : tuple of float
        Peak amplitudes in V of the fundamental and its harmonics, in order.
    """

    frequency: float = 50.0
    amplitudes: tuple[float, ...] = ()

    def __call__(self, time: Values, chance: Streams) -> Values:
        """Return the hum in V at `time` in s; each harmonic has a random phase."""
        hum = np.zeros(len(time))
        if self.amplitudes:
            phases = chance("mains").uniform(0, 2 * np.pi, len(self.amplitudes))
            for k, (amplitude, phase) in enumerate(zip(self.amplitudes, phases, strict=True), start=1):
                hum += amplitude * np.sin(2 * np.pi * k * self.frequency * time + phase)
        return hum


@dataclass(frozen=True)
class Ageing:
    """Drift of the voltage over days: ``V * (1 + gain) + offset``, with zero gain and offset on day 0.

    Attributes
    ----------
    offset_per_day, gain_per_day : float
        Constant drift of the offset in V per day, and of the gain per day.
    offset_walk, gain_walk : float
        Standard deviation of the daily step of a random walk, of the offset in V and of the gain as a ratio.
    """

    offset_per_day: float = 0.0
    gain_per_day: float = 0.0
    offset_walk: float = 0.0
    gain_walk: float = 0.0

    def at(self, day: float, chance: Streams) -> tuple[float, float]:
        """Return offset in V and gain on `day`, 0 or more; the walk is linear between whole days."""
        offset = self.offset_per_day * day + self.offset_walk * _walk(day, chance("ageing of the offset"))
        gain = self.gain_per_day * day + self.gain_walk * _walk(day, chance("ageing of the gain"))
        return offset, gain


def _walk(day: float, generator: np.random.Generator) -> float:
    """Return the position of a random walk of unit steps; it does not depend on which other days are requested."""
    steps = generator.normal(size=int(day) + 1)
    return float(np.sum(steps[:-1]) + (day - int(day)) * steps[-1])


@dataclass(frozen=True)
class SystematicError:
    """Error that is constant over one day and that no filter removes: lack of fit, setting error, daily drift.

    A smooth random function of the clearance with uniform standard deviation, drawn anew for each day. It is a sum of
    cosines of random frequency and phase, which approximates a Gaussian process with the covariance
    ``rms**2 * exp(-(difference / correlation)**2 / 2)``.

    Attributes
    ----------
    rms : float
        Standard deviation in mm of clearance.
    correlation : float
        Correlation length in mm of clearance.
    """

    rms: float = 0.0
    correlation: float = 2.0

    def on(self, day: float, chance: Streams) -> Callable[[Values], Values]:
        """Return the error in mm as a function of the clearance in mm; it is the same throughout the day."""
        if not self.rms:
            return np.zeros_like
        generator = chance(f"systematic error of day {int(day)}")
        frequencies = generator.normal(0.0, 1 / self.correlation, HARMONICS)
        phases = generator.uniform(0.0, 2 * np.pi, HARMONICS)
        scale = self.rms * np.sqrt(2 / HARMONICS)

        def error(clearance: Values) -> Values:
            total = np.zeros_like(clearance)  # term by term: all at once take 64 times the memory of the trace
            for frequency, phase in zip(frequencies, phases, strict=True):
                total += np.cos(frequency * clearance + phase)
            return np.asarray(scale * total)

        return error


@dataclass(frozen=True)
class InductiveState:
    """State of an aged sensor: offset in V, gain as a ratio, and error in mm as a function of clearance in mm."""

    offset: float = 0.0
    gain: float = 0.0
    error: Callable[[Values], Values] = np.zeros_like


@dataclass(frozen=True, kw_only=True)
class InductiveSensor:
    """The inductive sensor with its errors.

    Attributes
    ----------
    model : ForwardModel
        Ideal characteristic, with its nonlinearity and temperature dependence.
    noise : float
        Broadband noise in V rms.
    mains : Mains
        Mains hum.
    ageing : Ageing
        Drift over days.
    systematic_error : SystematicError
        Error that is constant over one day.
    output_range : tuple of float, optional
        Lowest and highest voltage in V of the output stage; unlimited by default.
    """

    model: ForwardModel = sensor_voltage
    noise: float = VOLTAGE_NOISE
    mains: Mains = field(default_factory=Mains)
    ageing: Ageing = field(default_factory=Ageing)
    systematic_error: SystematicError = field(default_factory=SystematicError)
    output_range: tuple[float, float] | None = None

    def state(self, day: float, chance: Streams) -> InductiveState:
        """Return the state on `day`, 0 or more; `chance` must be that of the sensor's whole life."""
        offset, gain = self.ageing.at(day, chance)
        return InductiveState(offset, gain, self.systematic_error.on(day, chance))

    def steady_voltage(self, clearance: Values, temperature: Values, state: InductiveState) -> Values:
        """Return the voltage in V without noise and hum, from clearance in mm and temperature in degC."""
        ideal = self.model(clearance + state.error(clearance), temperature)
        return self._limited(ideal * (1 + state.gain) + state.offset)

    def voltage(
        self, clearance: Values, temperature: Values, time: Values, state: InductiveState, chance: Streams
    ) -> Values:
        """Return the voltage in V at `time` in s, with noise and hum; all arrays have the shape (n,)."""
        disturbance = chance("inductive noise").normal(0.0, self.noise, len(time)) + self.mains(time, chance)
        return self._limited(self.steady_voltage(clearance, temperature, state) + disturbance)

    def _limited(self, voltage: Values) -> Values:
        return voltage if self.output_range is None else np.clip(voltage, *self.output_range)
