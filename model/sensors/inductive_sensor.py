"""The inductive displacement sensor: voltage from clearance and temperature, with its errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values
from sosmith.model.calibration.polynomial import EQUATION_4, EQUATION_5A, Polynomial
from sosmith.model.random_streams import Streams
from sosmith.model.sensors.coil import Coil

VOLTAGE_NOISE = 0.01
"""Broadband noise of the inductive sensor's voltage, V rms.

From the paper: its errors before (table 1) and after (table 4) the low-pass filter, read as millimetres, differ by
8.8 um rms. Divided by the slope of equation 5a at each of the ten clearances (46.5 degC), this is 10.5 mV. Read as
fractions of the clearance, as equation 7 has them, they differ by 64 um rms, and the noise is 48 mV.
"""

HARMONICS = 64
"""Cosines that a systematic error is made of; more would not change its statistics."""


class ForwardModel(Protocol):
    """Voltage in V of an ideal sensor from clearance in mm and temperature in degC."""

    def __call__(self, clearance: npt.ArrayLike, temperature: npt.ArrayLike) -> Values:
        """Return the voltage, of the common shape of both."""
        ...


@dataclass(frozen=True)
class InverseRegression:
    """A regression of second order in the voltage, such as equations 4 and 5a of the paper, solved for the voltage.

    The root is the one on the rising branch. Where the clearance is below the least one that the regression can take at
    that temperature, the voltage is that of the least one.
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
"""The sensor as equation 5a of the paper describes it, without noise; positive from 1.09 mm on at 20 degC."""

FORWARD_MODELS: dict[str, ForwardModel] = {
    "equation_4": InverseRegression(EQUATION_4),
    "equation_5a": sensor_voltage,
    "coil": Coil(),
}
"""Forward models by the name that a scenario file gives them."""


@dataclass(frozen=True)
class Mains:
    """Hum of the mains in the voltage.

    Attributes
    ----------
    frequency : float
        Of the fundamental in Hz. Sampled as it is: at 100 Hz, 50 Hz becomes an alternation, at 6 Hz a line at 2 Hz.
    amplitudes : tuple of float
        Peak values in V of the fundamental and its harmonics, in order.
    """

    frequency: float = 50.0
    amplitudes: tuple[float, ...] = ()

    def __call__(self, time: Values, chance: Streams) -> Values:
        """Hum in V at the times in s; each line has a random phase."""
        hum = np.zeros(len(time))
        if self.amplitudes:
            phases = chance("mains").uniform(0, 2 * np.pi, len(self.amplitudes))
            for k, (amplitude, phase) in enumerate(zip(self.amplitudes, phases, strict=True), start=1):
                hum += amplitude * np.sin(2 * np.pi * k * self.frequency * time + phase)
        return hum


@dataclass(frozen=True)
class Ageing:
    """Drift of the voltage over days: ``V * (1 + gain) + offset``, both zero on day 0.

    Attributes
    ----------
    offset_per_day, gain_per_day : float
        Steady drift in V per day, and per day.
    offset_walk, gain_walk : float
        Standard deviation of a random walk's daily step, in V and as a ratio.
    """

    offset_per_day: float = 0.0
    gain_per_day: float = 0.0
    offset_walk: float = 0.0
    gain_walk: float = 0.0

    def at(self, day: float, chance: Streams) -> tuple[float, float]:
        """Offset in V and gain on a `day`, 0 or more; between whole days the walk is a straight line."""
        offset = self.offset_per_day * day + self.offset_walk * _walk(day, chance("ageing of the offset"))
        gain = self.gain_per_day * day + self.gain_walk * _walk(day, chance("ageing of the gain"))
        return offset, gain


def _walk(day: float, generator: np.random.Generator) -> float:
    """Position of a random walk of unit steps, the same for a day whatever other days are asked for."""
    steps = generator.normal(size=int(day) + 1)
    return float(np.sum(steps[:-1]) + (day - int(day)) * steps[-1])


@dataclass(frozen=True)
class SystematicError:
    """What stays the same over the run of a day and no filter removes: lack of fit, setting, drift of the day.

    A smooth random curve over the clearance with the same standard deviation everywhere, a new one on each day: a sum
    of cosines of random frequency and phase, which tends to a Gaussian process with the covariance
    ``rms**2 * exp(-(difference / correlation)**2 / 2)``.

    Attributes
    ----------
    rms : float
        In mm of clearance.
    correlation : float
        Distance in mm over which the error changes.
    """

    rms: float = 0.0
    correlation: float = 2.0

    def on(self, day: float, chance: Streams) -> Callable[[Values], Values]:
        """Return the error in mm as a function of the clearance in mm on the whole day that `day` is in."""
        if not self.rms:
            return np.zeros_like
        generator = chance(f"systematic error of day {int(day)}")
        frequencies = generator.normal(0.0, 1 / self.correlation, HARMONICS)
        phases = generator.uniform(0.0, 2 * np.pi, HARMONICS)
        scale = self.rms * np.sqrt(2 / HARMONICS)

        def error(clearance: Values) -> Values:
            total = np.zeros_like(clearance)  # one by one: all at once would take 64 times the memory of a long trace
            for frequency, phase in zip(frequencies, phases, strict=True):
                total += np.cos(frequency * clearance + phase)
            return np.asarray(scale * total)

        return error


@dataclass(frozen=True)
class InductiveState:
    """What the days have made of a sensor: offset in V, gain as a ratio, and an error in mm over the clearance."""

    offset: float = 0.0
    gain: float = 0.0
    error: Callable[[Values], Values] = np.zeros_like


@dataclass(frozen=True, kw_only=True)
class InductiveSensor:
    """The sensor with its errors.

    Attributes
    ----------
    model : ForwardModel
        Nonlinearity and temperature drift.
    noise : float
        Broadband noise in V rms.
    mains : Mains
        Hum.
    ageing : Ageing
        Drift over days.
    systematic_error : SystematicError
        Error of a day's run.
    output_range : tuple of float, optional
        Lowest and highest voltage in V that the output stage can give; without it any.
    """

    model: ForwardModel = sensor_voltage
    noise: float = VOLTAGE_NOISE
    mains: Mains = field(default_factory=Mains)
    ageing: Ageing = field(default_factory=Ageing)
    systematic_error: SystematicError = field(default_factory=SystematicError)
    output_range: tuple[float, float] | None = None

    def state(self, day: float, chance: Streams) -> InductiveState:
        """Return what the sensor has become on a `day`, 0 or more; `chance` is that of its whole life."""
        offset, gain = self.ageing.at(day, chance)
        return InductiveState(offset, gain, self.systematic_error.on(day, chance))

    def steady_voltage(self, clearance: Values, temperature: Values, state: InductiveState) -> Values:
        """Voltage in V without noise and hum, from arrays of clearance in mm and temperature in degC."""
        ideal = self.model(clearance + state.error(clearance), temperature)
        return self._limited(ideal * (1 + state.gain) + state.offset)

    def voltage(
        self, clearance: Values, temperature: Values, time: Values, state: InductiveState, chance: Streams
    ) -> Values:
        """Voltage in V over the `time` in s, with noise and hum; arrays of one shape (n,)."""
        disturbance = chance("inductive noise").normal(0.0, self.noise, len(time)) + self.mains(time, chance)
        return self._limited(self.steady_voltage(clearance, temperature, state) + disturbance)

    def _limited(self, voltage: Values) -> Values:
        return voltage if self.output_range is None else np.clip(voltage, *self.output_range)
