"""The instrument's sensors as one object: inductive sensor, thermometer, and their converters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sosmith.instrument.sensors.digitizer import CodeFault, Digitizer, with_faults
from sosmith.instrument.sensors.inductive_sensor import VOLTAGE_NOISE, InductiveSensor, InductiveState, sensor_voltage
from sosmith.instrument.sensors.thermometer import TEMPERATURE_NOISE, IdealThermometer, Thermometer
from sosmith.model.arithmetic.random_streams import Streams
from sosmith.model.arrays import Codes, Values
from sosmith.model.port import Port

__all__ = ["TEMPERATURE_NOISE", "VOLTAGE_NOISE", "SensorFaults", "Sensors", "sensor_voltage"]


@dataclass(frozen=True, kw_only=True)
class SensorFaults:
    """Sensor faults during a measurement.

    Attributes
    ----------
    voltage, temperature : tuple of CodeFault
        Faults of the voltage codes and of the temperature codes.
    open_thermocouple : tuple of slice
        Samples during which the thermocouple is disconnected.
    """

    voltage: tuple[CodeFault, ...] = ()
    temperature: tuple[CodeFault, ...] = ()
    open_thermocouple: tuple[slice, ...] = ()

    def marks(self, samples: int) -> np.typing.NDArray[np.bool_]:
        """Return a mask, shape (samples,), of the samples with any fault."""
        index = np.arange(samples)
        spans = [(fault.start, fault.stop) for fault in (*self.voltage, *self.temperature)]
        spans += [(span.start, span.stop) for span in self.open_thermocouple]
        marks = np.zeros(samples, dtype=np.bool_)
        for start, stop in spans:
            marks |= (index >= start) & (index < stop)
        return marks


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """The sensors that turn clearance and temperature into a core's input codes.

    Attributes
    ----------
    inductive : InductiveSensor
    thermometer : Thermometer
    voltage_digitizer : Digitizer
        Converter of the voltage, with its errors.
    """

    inductive: InductiveSensor = field(default_factory=InductiveSensor)
    thermometer: Thermometer = field(default_factory=IdealThermometer)
    voltage_digitizer: Digitizer = field(default_factory=Digitizer)

    def codes(
        self,
        clearance: Values,
        temperature: Values,
        time: Values,
        ports: Sequence[Port],
        chance: Streams,
        *,
        state: InductiveState | None = None,
        faults: SensorFaults | None = None,
    ) -> Codes:
        """Return the codes of the ports, shape (n, n_ports).

        Parameters
        ----------
        clearance, temperature, time : ndarray, shape (n,)
            Clearance in mm including motion, temperature in degC, time in s.
        ports : sequence of Port
            Voltage in V and, if there are two, temperature in degC.
        chance : Streams
            Source of randomness; without faults the inductive sensor draws first.
        state : InductiveState, optional
            State of the inductive sensor; that of a new one by default.
        faults : SensorFaults, optional
        """
        faults = faults or SensorFaults()
        voltage = self.inductive.voltage(clearance, temperature, time, state or InductiveState(), chance)
        codes = self.voltage_digitizer.codes(ports[0], voltage)
        columns = [with_faults(codes, ports[0], faults.voltage, chance)]
        if len(ports) > 1:
            columns.append(
                self.thermometer.codes(temperature, ports[1], chance, faults.temperature, faults.open_thermocouple)
            )
        return np.stack(columns, axis=1)
