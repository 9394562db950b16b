"""The temperature channel: a type K thermocouple with converter and linearization, or an ideal thermometer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Protocol

import numpy as np

from sosmith.instrument.sensors.digitizer import CodeFault, Digitizer, with_faults
from sosmith.instrument.sensors.thermocouple import EMF_RANGE, loop_emf, thermocouple_emf, thermocouple_temperature
from sosmith.model.arithmetic.random_streams import Streams
from sosmith.model.arrays import Codes, Values
from sosmith.model.port import Port

TEMPERATURE_NOISE = 0.1
"""Broadband noise of the thermocouple channel in degC rms.

Assumed: about 4 uV at the 41.4 uV/degC of a type K thermocouple near 60 degC (ITS-90), after averaging in a slow
channel. It moves equation 5a by less than 0.4 um, well below the voltage's noise.
"""

EMF_PORT = Port.from_range("emf", 19, Fraction("-78.125"), Fraction("78.125"), signed=True, unit="mV")
"""Converter of the emf: 19 bits over +-78.125 mV, as in the MAX31856 thermocouple converter at a gain of 8."""


class Thermometer(Protocol):
    """A temperature channel of the instrument."""

    def codes(
        self, temperature: Values, port: Port, chance: Streams, faults: Sequence[CodeFault], open_loop: Sequence[slice]
    ) -> Codes:
        """Return the codes of the temperature port, shape (n,), for the true temperature in degC.

        Parameters
        ----------
        temperature : ndarray, shape (n,)
        port : Port
            Temperature input of the core, in degC.
        chance : Streams
            Source of randomness.
        faults : sequence of CodeFault
            Faults of the port's codes.
        open_loop : sequence of slice
            Samples during which the sensor is disconnected.
        """
        ...

    def steady(self, temperature: Values) -> Values:
        """Return the indicated temperature in degC without noise."""
        ...


@dataclass(frozen=True, kw_only=True)
class IdealThermometer:
    """The true temperature with broadband noise; when disconnected, it gives the highest code.

    Attributes
    ----------
    noise : float
        Noise in degC rms.
    """

    noise: float = TEMPERATURE_NOISE

    def codes(
        self, temperature: Values, port: Port, chance: Streams, faults: Sequence[CodeFault], open_loop: Sequence[slice]
    ) -> Codes:
        """As for `Thermometer.codes`."""
        shown = temperature + chance("temperature noise").normal(0.0, self.noise, len(temperature))
        codes = port.encode(shown)
        for samples in open_loop:
            codes[samples] = port.highest
        return with_faults(codes, port, faults, chance)

    def steady(self, temperature: Values) -> Values:
        """As for `Thermometer.steady`."""
        return temperature


@dataclass(frozen=True, kw_only=True)
class ThermocoupleChain:
    """Type K thermocouple channel: emf, noise, converter, cold junction compensation, linearization by NIST's inverse.

    Attributes
    ----------
    noise : float
        Input noise in uV rms.
    cold_junction : float
        True temperature of the cold junction in degC.
    cold_junction_error : float
        Error of the compensation in degC; positive if it takes the cold junction to be warmer than it is.
    port : Port
        Format of the emf converter, in mV.
    digitizer : Digitizer
        Errors of that converter.
    """

    noise: float = 4.0
    cold_junction: float = 25.0
    cold_junction_error: float = 0.0
    port: Port = EMF_PORT
    digitizer: Digitizer = field(default_factory=Digitizer)

    def codes(
        self, temperature: Values, port: Port, chance: Streams, faults: Sequence[CodeFault], open_loop: Sequence[slice]
    ) -> Codes:
        """As for `Thermometer.codes`; an open thermocouple lets the bias current drive the converter to full scale."""
        emf = loop_emf(temperature, self.cold_junction)
        emf = emf + chance("thermocouple noise").normal(0.0, self.noise / 1000, len(emf))
        emf_codes = self.digitizer.codes(self.port, emf)
        for samples in open_loop:
            emf_codes[samples] = self.port.highest
        return with_faults(port.encode(self._linearized(self.port.decode(emf_codes))), port, faults, chance)

    def steady(self, temperature: Values) -> Values:
        """As for `Thermometer.steady`; without the converter."""
        return self._linearized(loop_emf(temperature, self.cold_junction))

    def _linearized(self, emf: Values) -> Values:
        """Return the temperature in degC, limited to the range of the inverse polynomials."""
        compensation = thermocouple_emf(self.cold_junction + self.cold_junction_error)
        return thermocouple_temperature(np.clip(emf + compensation, *EMF_RANGE))
