"""The budget of an instrument: what the specification states, through the polynomial and the filter."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import load
from sosmith.instrument.uncertainty.instrument_budget import (
    Instrument,
    budget_json,
    budget_of,
    instrument_of,
    noise_gain,
    slopes,
)
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A

SPEC = """\
name = "demo"
sample_rate = 100.0
input.voltage = { bits = 12, range = [0.0, 10.0] }
input.temperature = { bits = 12, range = [0.0, 128.0] }
[calibration]
coefficients = [[1.0, -0.002], [1.0]]
[filter]
family = "butterworth"
kind = "lowpass"
order = 2
cutoff = 5.0
[output]
bits = 12
range = [0.0, 16.0]
unit = "mm"
"""
WORTH = """\
[calibration.uncertainty]
covariance = [[0.0004, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.000001]]
freedom = 20
systematic = 0.05
systematic_freedom = 9
voltage = [1.0, 9.0]
temperature = [20.0, 80.0]
"""
STATED = """\
[uncertainty]
noise = 0.02
temperature = 0.5
voltage = 0.01
clearance_rate = 0.3
motion = [[2.0, 0.4], [20.0, 0.1]]
"""


def instrument(tmp_path: Path, text: str = SPEC + WORTH + STATED) -> Instrument | None:
    path = tmp_path / "demo.toml"
    path.write_text(text)
    return instrument_of(load(path))


def test_every_source_is_what_it_says(tmp_path: Path) -> None:
    found = instrument(tmp_path)
    assert found is not None
    V, T = np.array([5.0]), np.array([30.0])
    budget = {one.source: one for one in found.budget(V, T).contributions}
    shares = {name: one.contribution.item() for name, one in budget.items()}
    sos = signal.butter(2, 5.0, fs=100.0, output="sos")
    impulse = signal.sosfilt(sos, np.eye(1, 4000)[0])
    _, response = signal.sosfreqz(sos, [2.0, 20.0], fs=100.0)
    assert shares == pytest.approx(
        {
            "calibration": math.sqrt(0.0004 + 25 * 1e-6),
            "systematic error of a day": 0.05,
            "sensor noise": 0.02 * math.sqrt(np.sum(impulse**2)),
            "thermocouple": 0.002 * 0.5,
            "converter of the voltage": 0.01 / math.sqrt(3),
            "delay of a moving reading": 0.3 / math.sqrt(3) * np.sum(impulse * np.arange(4000)) / 100,
            "motion at 2 Hz": 0.4 / math.sqrt(2) * abs(response[0]),
            "motion at 20 Hz": 0.1 / math.sqrt(2) * abs(response[1]),
            "steps of the voltage": 10 / 2**12 / math.sqrt(12),
            "steps of the temperature": 0.002 * 128 / 2**12 / math.sqrt(12),
            "arithmetic, proven": float(found.spec.max_error) / math.sqrt(3),
        },
        rel=1e-6,
    )
    assert (budget["calibration"].freedom, budget["systematic error of a day"].freedom) == (20, 9)


def test_noise_through_the_filter_is_what_a_simulation_shows(tmp_path: Path) -> None:
    found = instrument(tmp_path)
    assert found is not None
    assert found.ideal is not None
    noise = signal.sosfilt(found.ideal.sos, np.random.default_rng(1).normal(size=200_000))
    assert noise_gain(found.ideal) == pytest.approx(noise.std(), rel=0.02)
    assert noise_gain(None) == 1.0


def test_slopes_are_derivatives() -> None:
    V, T, h = np.array([2.0, 7.0]), np.array([20.0, 90.0]), 1e-6
    by_voltage, by_temperature = slopes(EQUATION_5A, V, T)
    assert by_voltage == pytest.approx((EQUATION_5A(V + h, T) - EQUATION_5A(V - h, T)) / (2 * h), rel=1e-6)
    assert by_temperature == pytest.approx((EQUATION_5A(V, T + h) - EQUATION_5A(V, T - h)) / (2 * h), rel=1e-6)


def test_what_is_not_stated_is_told(tmp_path: Path) -> None:
    found = instrument(tmp_path, SPEC + WORTH)
    assert found is not None
    assert found.missing == (
        "sensor noise",
        "thermocouple",
        "converter of the voltage",
        "delay of a moving reading",
        "motion let through",
    )
    assert instrument(tmp_path, SPEC) is None


def test_a_design_has_the_whole_budget(tmp_path: Path) -> None:
    path = tmp_path / "demo.toml"
    path.write_text(SPEC + WORTH)
    made = budget_of(design_core(load(path), core="calibration"))
    assert made is not None
    told = json.loads(json.dumps(budget_json(made)))
    assert told["at"]["expanded"] == told["expanded"]["largest"] > 0.1
    assert told["arithmetic_bound"] < 0.01
    assert made.summary.startswith("±0.12 mm holds the true value in 95 %, most of it systematic error of a day;")


def test_what_wear_is_worth(tmp_path: Path) -> None:
    found = instrument(tmp_path)
    assert found is not None
    worth = found.of_wear(3.0, 8.0)
    assert worth.rise == pytest.approx(5.0 * 0.001, rel=0.01)
    assert worth.standard > 0.05


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[[0.0004, 0.0, 0.0], ",
            "[",
            "calibration.uncertainty.covariance must be 3 rows of 3 numbers, one for each coefficient, not 2 of 3",
        ),
        (
            "[0.0, 0.0, 0.0], [0.0, 0.0, 0.000001]",
            "[0.0, 0.0, 0.0], [0.1, 0.0, 0.000001]",
            "calibration.uncertainty.covariance must be symmetric, with no correlation above 1, "
            "not 0.1 and 0 at [2][0] and [0][2]",
        ),
        ("freedom = 20\n", "freedom = 0\n", "calibration.uncertainty.freedom must be a number of degrees of freedom"),
        (
            "[2.0, 0.4]",
            "[60.0, 0.4]",
            "uncertainty.motion[0] must be above 0 and below half the sample rate, 50 Hz, not 60 Hz",
        ),
        ("[2.0, 0.4]", "[2.0, -0.4]", "uncertainty.motion[0] must be of an amplitude of 0 or more, not -0.4"),
        ("noise = 0.02", "noise = -1", "uncertainty.noise must be a number of V from 0 to 1000000, not -1"),
        ("noise = 0.02", "nois = 0.02", "uncertainty.nois must be one of the keys noise, temperature, voltage,"),
        ("systematic = ", "sistematic = ", "calibration.uncertainty.sistematic must be one of the keys covariance,"),
        (
            "coefficients = [[1.0, -0.002], [1.0]]",
            'data = "m.csv"',
            "calibration.uncertainty must be left out with data, whose own uncertainty counts, not given",
        ),
    ],
)
def test_refusals(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = SPEC + WORTH + STATED
    assert old in text
    with pytest.raises(SpecificationError) as refusal:
        instrument(tmp_path, text.replace(old, new, 1))
    assert str(refusal.value).removeprefix(f"{tmp_path / 'demo.toml'}: ").startswith(message)
