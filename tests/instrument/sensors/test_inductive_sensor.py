"""The inductive sensor: reference voltages of equations 4 and 5a, the coil, and each of its errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from sosmith.instrument.paper.figures import read_paper_figures
from sosmith.instrument.sensors.coil import REFERENCE_TEMPERATURE, Coil
from sosmith.instrument.sensors.inductive_sensor import (
    FORWARD_MODELS,
    VOLTAGE_NOISE,
    Ageing,
    InductiveSensor,
    InductiveState,
    InverseRegression,
    Mains,
    SystematicError,
    sensor_voltage,
)
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.arrays import Values
from sosmith.model.polynomial import EQUATION_4, EQUATION_5A, Polynomial

PAPER = read_paper_figures()
TABLE_1, TABLE_4 = (np.array(PAPER.numbers(table, "error"), dtype=np.float64) for table in ("table_1", "table_4"))


@pytest.mark.parametrize(
    ("name", "temperature", "voltages"),
    [
        ("equation_5a", 20.0, (1.8656, 5.5601, 9.5353)),
        ("equation_5a", 60.0, (2.0152, 5.5570, 9.4636)),
        ("equation_5a", 98.0, (2.1430, 5.5543, 9.3974)),
        ("equation_4", 20.0, (1.8558, 5.6755, 9.4816)),
        ("equation_4", 98.0, (1.845, 4.9917, 8.5227)),
    ],
)
def test_reference_voltages(name: str, temperature: float, voltages: tuple[float, ...]) -> None:
    # The equations solved for V at 2, 5 and 10 mm, worked out independently of this package.
    shown = FORWARD_MODELS[name]([2.0, 5.0, 10.0], temperature)
    np.testing.assert_allclose(shown, voltages, rtol=0, atol=5.5e-5)


@pytest.mark.parametrize("equation", [EQUATION_4, EQUATION_5A], ids=["4", "5a"])
def test_inverse_of_a_regression(equation: Polynomial) -> None:
    d, T = np.meshgrid(np.linspace(1.4, 10, 50), np.linspace(20, 98, 40))
    np.testing.assert_allclose(equation(InverseRegression(equation)(d, T), T), d, rtol=0, atol=1e-13)


def test_only_a_parabola_in_the_voltage_is_inverted() -> None:
    cubic = Polynomial.from_numbers([["1"], ["1"], ["1"], ["1"]])
    with pytest.raises(ValueError, match=r"^polynomial must be of order 2 in the voltage, not 3$"):
        InverseRegression(cubic)


def test_below_the_least_clearance_the_voltage_is_that_of_the_least() -> None:
    lowest = sensor_voltage(0.1, 20.0)
    assert lowest == sensor_voltage(0.3, 20.0)
    assert EQUATION_5A(lowest, 20.0) < EQUATION_5A(lowest + 0.01, 20.0)
    assert EQUATION_5A(lowest, 20.0) < EQUATION_5A(lowest - 0.01, 20.0)


def test_voltage_noise_follows_from_the_papers_tables() -> None:
    d = np.arange(1.0, 11.0)
    V = sensor_voltage(d, 46.5)
    slope = (EQUATION_5A(V + 1e-6, 46.5) - EQUATION_5A(V - 1e-6, 46.5)) / 2e-6
    in_millimetres = np.sqrt(np.mean(((TABLE_1 - TABLE_4) / slope) ** 2))
    assert in_millimetres == pytest.approx(VOLTAGE_NOISE, rel=0.06)
    as_fractions = np.sqrt(np.mean(((TABLE_1 - TABLE_4) * d / slope) ** 2))
    assert as_fractions == pytest.approx(0.048, abs=0.0005)


def test_the_coil_rises_everywhere_and_turns_with_the_temperature_as_equation_5a() -> None:
    coil = Coil()
    d, T = np.linspace(0.0, 15.0, 301), np.linspace(-20.0, 200.0, 23)
    assert np.all(np.diff(coil(d[:, np.newaxis], T), axis=0) > 0)
    drift = coil([2.0, 10.0], 98.0) - coil([2.0, 10.0], 20.0)
    np.testing.assert_allclose(drift, sensor_voltage([2.0, 10.0], 98.0) - sensor_voltage([2.0, 10.0], 20.0), atol=0.1)
    assert drift[0] > 0.1 > -0.1 > drift[1]
    # The impedance falls as it warms up, which the paper names as the cause of the drift.
    assert coil.impedance(10.0, 98.0) < coil.impedance(10.0, 20.0)


def test_the_coils_parameters_are_the_fit_that_is_documented() -> None:
    # From the smallest initial clearance that the paper allows; equation 5a ends at 98 degC.
    clearances, temperatures = (1.5, 10.0), (60.0, 98.0)
    d = np.linspace(*clearances, 86)

    def curve(p: Values) -> Coil:
        return replace(Coil(), decay=p[0], gain=p[1], balance=p[2])

    def misfit(p: Values) -> Values:
        return curve(p)(d, REFERENCE_TEMPERATURE) - sensor_voltage(d, REFERENCE_TEMPERATURE)

    first = least_squares(misfit, [6.0, 1.0, 50.0], x_scale=[5, 1, 50], xtol=1e-14, ftol=1e-14)
    np.testing.assert_allclose(first.x, (Coil().decay, Coil().gain, Coil().balance), rtol=1e-4)
    assert np.sqrt(np.mean(first.fun**2)) == pytest.approx(0.055, abs=0.0005)

    def drift_misfit(p: Values) -> Values:
        coil = replace(Coil(), inductance_drift=p[0], depth_drift=p[1])
        changes = [
            (model(d, T) - model(d, REFERENCE_TEMPERATURE)) for T in temperatures for model in (coil, sensor_voltage)
        ]
        return np.concatenate([changes[0] - changes[1], changes[2] - changes[3]])

    second = least_squares(drift_misfit, [0.0, 0.0], x_scale=1e-4, xtol=1e-14, ftol=1e-14)
    np.testing.assert_allclose(second.x, (Coil().inductance_drift, Coil().depth_drift), rtol=1e-3)
    assert np.sqrt(np.mean(second.fun**2)) == pytest.approx(0.030, abs=0.0005)


@pytest.mark.parametrize(
    ("rate", "line"),
    [(100.0, 50.0), (6.0, 2.0), (1000.0, 50.0), (75.0, 25.0), (120.0, 50.0)],
)
def test_mains_alias_to_where_sampling_puts_them(rate: float, line: float) -> None:
    n = np.arange(int(rate) * 40)
    hum = Mains(amplitudes=(0.1,))(n / rate, streams(3))
    spectrum = np.abs(np.fft.rfft(hum))
    assert np.argmax(spectrum) / 40 == line
    assert np.sort(spectrum)[-2] < 1e-6 * spectrum.max()


def test_harmonics_of_the_mains() -> None:
    time = np.arange(4000) / 1000
    hum = Mains(frequency=49.75, amplitudes=(0.2, 0.0, 0.1))(time, streams(1))
    for frequency, amplitude in ((49.75, 0.2), (99.5, 0.0), (149.25, 0.1)):
        line = 2 * np.mean(hum * np.exp(-2j * np.pi * frequency * time))
        assert abs(line) == pytest.approx(amplitude, abs=1e-9)


def test_ageing_is_the_same_for_a_day_whatever_other_days_there_are() -> None:
    walk = Ageing(offset_walk=0.01, gain_walk=0.001)
    assert walk.at(0.0, streams(1)) == (0.0, 0.0)
    at_days = [walk.at(day, streams(1))[0] for day in range(400)]
    assert walk.at(2.25, streams(1))[0] == pytest.approx(at_days[2] + 0.25 * (at_days[3] - at_days[2]))
    assert np.std(np.diff(at_days)) == pytest.approx(0.01, rel=0.1)
    assert at_days != [walk.at(day, streams(2))[0] for day in range(400)]
    assert Ageing(offset_per_day=0.002, gain_per_day=-1e-4).at(30.0, streams(1)) == pytest.approx((0.06, -0.003))


def test_systematic_error_is_smooth_of_the_given_size_and_new_each_day() -> None:
    model = SystematicError(rms=0.2, correlation=2.0)
    d = np.linspace(1.0, 10.0, 181)
    days = np.array([model.on(day, streams(5))(d) for day in range(400)])
    np.testing.assert_allclose(np.sqrt(np.mean(days**2, axis=0)), 0.2, rtol=0.15)
    assert np.sqrt(np.mean(days**2)) == pytest.approx(0.2, rel=0.05)
    correlation = np.mean(days[:, :-40] * days[:, 40:]) / np.mean(days**2)  # over 2 mm
    assert correlation == pytest.approx(np.exp(-0.5), abs=0.06)
    np.testing.assert_array_equal(model.on(7.9, streams(5))(d), days[7])
    assert abs(np.mean(days[:-1] * days[1:])) < 0.1 * 0.2**2


def test_the_sensor_adds_its_errors_up() -> None:
    time = np.arange(20_000) / 100
    d, T = np.full(len(time), 5.0), np.full(len(time), 60.0)
    sensor = InductiveSensor(noise=0.02, mains=Mains(amplitudes=(0.1,)))
    state = InductiveState(offset=0.3, gain=0.01, error=lambda d: d * 0 + 0.25)
    shown = sensor.voltage(d, T, time, state, streams(1))
    steady = sensor_voltage(5.25, 60.0) * 1.01 + 0.3
    np.testing.assert_allclose(sensor.steady_voltage(d, T, state), steady)
    assert np.mean(shown) == pytest.approx(steady, abs=0.001)
    hum = Mains(amplitudes=(0.1,))(time, streams(1))
    assert np.std(shown - hum) == pytest.approx(0.02, rel=0.03)
    # Noise has a stream of its own: taking the hum away leaves every draw of it as it was.
    quiet = replace(sensor, mains=Mains()).voltage(d, T, time, state, streams(1))
    np.testing.assert_allclose(shown - hum, quiet, rtol=0, atol=1e-12)


def test_the_output_stage_limits() -> None:
    sensor = InductiveSensor(noise=0.5, output_range=(0.0, 10.0))
    d = np.repeat([1.0, 10.8], 500)
    shown = sensor.voltage(d, np.full(1000, 20.0), np.arange(1000) / 100, InductiveState(), streams(1))
    assert (shown.min(), shown.max()) == (0.0, 10.0)
    free = replace(sensor, output_range=None).voltage(
        d, np.full(1000, 20.0), np.arange(1000) / 100, InductiveState(), streams(1)
    )
    assert free.min() < -0.5
    assert free.max() > 10.5


def test_a_days_state() -> None:
    sensor = InductiveSensor(ageing=Ageing(offset_per_day=0.01), systematic_error=SystematicError(rms=0.2))
    state = sensor.state(3.0, streams(1))
    assert state.offset == pytest.approx(0.03)
    d = np.array([2.0, 4.0])
    np.testing.assert_array_equal(state.error(d), sensor.systematic_error.on(3, streams(1))(d))
    fresh = InductiveSensor().state(3.0, streams(1))
    assert (fresh.offset, fresh.gain, fresh.error(d).tolist()) == (0.0, 0.0, [0.0, 0.0])
