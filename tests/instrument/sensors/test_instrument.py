"""The sensors together: thermocouple chain, faults, and streams of chance that do not disturb one another."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from sosmith.instrument.sensors.digitizer import CodeFault, Digitizer
from sosmith.instrument.sensors.inductive_sensor import InductiveSensor, sensor_voltage
from sosmith.instrument.sensors.instrument import SensorFaults, Sensors
from sosmith.instrument.sensors.thermometer import IdealThermometer, ThermocoupleChain
from sosmith.model.arithmetic.random_streams import one_stream, streams
from sosmith.model.arrays import Codes
from sosmith.model.port import Port

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
TEMPERATURE = Port.from_range("temperature", 16, Fraction(0), Fraction(256), unit="degC")
PORTS = (VOLTAGE, TEMPERATURE)
N = 4000
T = np.linspace(20.0, 200.0, N)
D = np.linspace(2.0, 9.0, N)
TIME = np.arange(N) / 100
CHAIN = Sensors(inductive=InductiveSensor(noise=0.05), thermometer=ThermocoupleChain())


def codes(sensors: Sensors, faults: SensorFaults | None = None, seed: int = 1) -> Codes:
    return sensors.codes(D, T, TIME, PORTS, streams(seed), faults=faults)


def shown_temperature(chain: ThermocoupleChain, faults: SensorFaults | None = None) -> np.typing.NDArray[np.float64]:
    return TEMPERATURE.decode(codes(replace(CHAIN, thermometer=chain), faults)[:, 1])


def test_an_ideal_chain_shows_the_temperature_within_the_error_of_the_linearization() -> None:
    shown = shown_temperature(ThermocoupleChain(noise=0.0))
    # Error of the inverse, half a step of 0.3 uV of the converter and of 1/256 degC of the port.
    assert np.abs(shown - T).max() < 0.0467 + 0.004 + 0.002 + 0.001
    np.testing.assert_allclose(ThermocoupleChain().steady(T), T, rtol=0, atol=0.05)


def test_noise_of_the_thermocouple() -> None:
    error = shown_temperature(ThermocoupleChain(noise=8.0)) - shown_temperature(ThermocoupleChain(noise=0.0))
    assert np.std(error) == pytest.approx(8 / 41, rel=0.06)  # uV over uV per degC


def test_an_error_of_the_cold_junction_and_of_the_converter() -> None:
    quiet = ThermocoupleChain(noise=0.0)
    warmer = shown_temperature(replace(quiet, cold_junction_error=1.0)) - shown_temperature(quiet)
    assert 0.95 < warmer.min() <= warmer.max() < 1.05
    shifted = shown_temperature(replace(quiet, digitizer=Digitizer(offset=100.0))) - shown_temperature(quiet)
    assert np.mean(shifted) == pytest.approx(100 * 156.25 / 2**19 / 0.0405, rel=0.03)
    assert np.abs(shown_temperature(replace(quiet, cold_junction=-10.0)) - T).max() < 0.06


def test_an_open_thermocouple_goes_to_the_rail() -> None:
    open_loop = SensorFaults(open_thermocouple=(slice(100, 200),))
    for thermometer in (ThermocoupleChain(), IdealThermometer()):
        shown = codes(replace(CHAIN, thermometer=thermometer), open_loop)[:, 1]
        assert set(shown[100:200].tolist()) == {TEMPERATURE.highest}
        assert max(shown[:100].max(), shown[200:].max()) < TEMPERATURE.highest


def test_a_fault_changes_nothing_but_its_own_samples() -> None:
    healthy = codes(CHAIN)
    faults = SensorFaults(
        voltage=(CodeFault(start=500, stop=700, share=0.5), CodeFault(start=900, stop=950)),
        temperature=(CodeFault(start=600, stop=650, code=0),),
        open_thermocouple=(slice(1000, 1100),),
    )
    faulty = codes(CHAIN, faults)
    marks = faults.marks(N)
    assert marks.sum() == 200 + 50 + 100
    np.testing.assert_array_equal(healthy[~marks], faulty[~marks])
    assert np.any(healthy[500:700] != faulty[500:700])
    assert set(faulty[600:650, 1].tolist()) == {0}


def test_what_one_sensor_draws_does_not_shift_the_other() -> None:
    first, second = codes(CHAIN), codes(replace(CHAIN, inductive=InductiveSensor(noise=0.0)))
    np.testing.assert_array_equal(first[:, 1], second[:, 1])
    assert np.any(first[:, 0] != second[:, 0])
    assert np.any(first != codes(CHAIN, seed=2))
    np.testing.assert_array_equal(first, codes(CHAIN))


def test_the_voltage_goes_through_its_converter() -> None:
    sensors = Sensors(inductive=InductiveSensor(noise=0.0), voltage_digitizer=Digitizer(offset=-7.0))
    np.testing.assert_array_equal(codes(sensors)[:, 0], VOLTAGE.encode(sensor_voltage(D, T)) - 7)


def test_one_port_takes_the_voltage_alone() -> None:
    alone = Sensors().codes(D, T, TIME, PORTS[:1], streams(1))
    np.testing.assert_array_equal(alone, codes(Sensors())[:, :1])


def test_one_stream_draws_in_the_order_of_the_calls() -> None:
    chance = one_stream(np.random.default_rng(1))
    drawn = [chance("a").normal(), chance("b").normal()]
    assert drawn == np.random.default_rng(1).normal(size=2).tolist()
    assert streams(1)("a").normal() != streams(1)("b").normal()
    assert streams(1, "x")("a").normal() != streams(1, "y")("a").normal()
