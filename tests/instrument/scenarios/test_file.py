"""Scenario files: truth, readings, faults, wear, motion, and traces that no fault or further excerpt shifts."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.instrument.scenarios.scenario_texts import FAULT, PLAIN

from sosmith.gen.stimuli.run import Bench
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file, load_scenario, range_notes
from sosmith.instrument.scenarios.instrument_signals import TABLE_1_STEPS, TABLE_2_STEPS
from sosmith.instrument.sensors.inductive_sensor import sensor_voltage
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.port import Port
from sosmith.model.traces.trace import Trace

EXAMPLES = sorted((Path(__file__).parents[3] / "examples" / "scenarios").glob("*.toml"))
VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
TEMPERATURE = Port.from_range("temperature", 16, Fraction(0), Fraction(128), unit="degC")
BENCH = Bench(
    ports=(VOLTAGE, TEMPERATURE),
    output=Port.from_range("clearance", 16, Fraction(0), Fraction(16), unit="mm"),
    sample_rate=Fraction(100),
    polynomial=EQUATION_5A,
    impulse_response=0.1 * 0.9 ** np.arange(300),
)
SETTLED = 100
"""Samples that more than settle the filter above, from 16 mm to half an LSB: 0.9**n * 16 < 16 / 2**17."""


def scenario(folder: Path, text: str, name: str = "day") -> ScenarioFile:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return load_scenario(path)


def made(folder: Path, text: str, *, seed: int = 1, channel: int = 0) -> Trace:
    return emulate_file(scenario(folder, text), BENCH, seed=seed, channel=channel)


def parts(trace: Trace) -> tuple[Values, np.typing.NDArray[np.bool_]]:
    assert trace.truth is not None
    assert trace.reading is not None
    return trace.truth, trace.reading


def shown(trace: Trace) -> Values:
    values = trace.values()
    return EQUATION_5A(values[:, 0], values[:, 1])


def swaying(track: str, time: Values, seed: int) -> Values:
    """Stand in for the vehicle, which takes longer."""
    return np.sin(time + seed) * (1 if track == "paper" else 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples(path: Path) -> None:
    example = load_scenario(path)
    trace = emulate_file(example, BENCH, seed=1, vehicle=swaying)
    truth, reading = parts(trace)
    assert trace.name == path.stem
    assert reading.mean() > 0.05
    assert 1.0 <= truth.min() <= truth.max() <= 10.0
    np.testing.assert_array_equal(trace.codes, emulate_file(example, BENCH, seed=1, vehicle=swaying).codes)
    assert np.any(trace.codes != emulate_file(example, BENCH, seed=2, vehicle=swaying).codes)
    assert bool(range_notes(example, BENCH.ports)) == (path.stem == "tread_braking_200")


def test_there_are_the_examples_that_the_documents_name() -> None:
    assert {path.stem for path in EXAMPLES} >= {
        "bench_43_50",
        "bench_43_50_millimetres",
        "bench_92_96",
        "bench_92_96_millimetres",
        "depot_to_98",
        "tread_braking_200",
        "curves_and_tangent",
        "sensor_faults",
        "a_week_in_service",
    }


@pytest.mark.parametrize(("name", "steps"), [("bench_43_50", TABLE_1_STEPS), ("bench_92_96", TABLE_2_STEPS)])
def test_bench_runs_read_the_last_part_of_each_step(name: str, steps: tuple[float, ...]) -> None:
    (path,) = (path for path in EXAMPLES if path.stem == name)
    truth, reading = parts(emulate_file(load_scenario(path), BENCH, seed=1))
    assert tuple(dict.fromkeys(truth.tolist())) == steps
    assert tuple(dict.fromkeys(truth[reading].tolist())) == steps
    for step in steps:
        plateau = np.flatnonzero(truth == step)
        read = reading[plateau]
        assert read[-1]
        assert np.all(np.diff(read.astype(int)) >= 0)
        assert 0.1 <= read.mean() < 0.13


def test_truth_is_the_wear_of_the_day_and_readings_begin_when_the_filter_has_settled(tmp_path: Path) -> None:
    trace = made(tmp_path, PLAIN)
    truth, reading = parts(trace)
    assert len(trace) == 6000
    assert set(truth.tolist()) == {3.0}
    first = int(np.argmax(reading))
    assert 50 < first < SETTLED
    assert reading[first:].all()
    error = shown(trace) - truth
    assert np.std(error) == pytest.approx(0.01 * 0.745, rel=0.1)  # noise times slope at 3 mm
    assert trace.values()[:, 1] == pytest.approx(20.0, abs=0.6)
    assert np.std(trace.values()[:, 1]) == pytest.approx(4 / 40.3, rel=0.1)


@pytest.mark.parametrize(
    ("wear", "clearance"),
    [
        ("rate = 0.1", 3.0),
        ("rate_per_1000_km = 0.2\nkm_per_day = 300", 2.6),
        ("history = [[0, 0.5], [8, 0.9], [12, 1.7]]", 3.3),
        ("history = [[0, 0.5], [8, 0.9]]", 2.9),
        ("history = [[11, 0.5], [12, 0.9]]", 2.5),
    ],
)
def test_wear(tmp_path: Path, wear: str, clearance: float) -> None:
    truth, _ = parts(made(tmp_path, PLAIN.replace("rate = 0.1", wear)))
    assert truth[0] == pytest.approx(clearance)


def test_each_channel_has_its_wear(tmp_path: Path) -> None:
    text = PLAIN.replace("[wear]", "[[channel]]").replace(
        "[[excerpt]]", "[[channel]]\ninitial_clearance = 4.0\nrate = 0.0\n\n[[excerpt]]"
    )
    assert [parts(made(tmp_path, text, channel=k))[0][0] for k in (0, 1)] == [3.0, 4.0]
    with pytest.raises(
        SpecificationError, match=r"^\S+/day.toml: channel must have a table for each channel of the core, not only 2$"
    ):
        made(tmp_path, text, channel=2)
    assert parts(made(tmp_path, PLAIN, channel=7))[0][0] == 3.0


def test_temperature_profiles(tmp_path: Path) -> None:
    line = made(tmp_path, PLAIN.replace("temperature = 20.0", "temperature = 20.0\ntemperature_to = 80.0"))
    T = line.values()[:, 1]
    assert (T[0], T[-1]) == pytest.approx((20, 80), abs=0.6)
    np.testing.assert_allclose(T, np.linspace(20, 80, 6000), atol=0.7)
    heating = made(
        tmp_path,
        PLAIN.replace("temperature = 20.0", "temperature = 20.0\ntemperature_to = 80.0\ntime_constant = 15.0"),
    )
    T = heating.values()[:, 1]
    assert T[1500] == pytest.approx(80 - 60 / np.e, abs=0.7)
    assert T[-1] == pytest.approx(80 - 60 * np.exp(-4), abs=0.7)


def test_excerpts_follow_one_another_and_do_not_shift_each_other(tmp_path: Path) -> None:
    second = '\n[[excerpt]]\nday = 30\noperation = "tangent"\nseconds = 30\ntemperature = 50.0\nmotion = [[1.2, 0.5]]\n'
    alone, both = made(tmp_path, PLAIN), made(tmp_path, PLAIN + second)
    np.testing.assert_array_equal(alone.codes, both.codes[:6000])
    truth, reading = parts(both)
    assert truth[[5999, 6000]].tolist() == [3.0, 5.0]
    assert reading[5999]
    assert not reading[6000]
    motion = (shown(both) - truth)[6000:]
    line = 2 * np.mean(motion * np.exp(-2j * np.pi * 1.2 * both.time[6000:]))
    assert abs(line) == pytest.approx(0.5, rel=0.01)
    # The same noise twice would be seen.
    repeated = made(tmp_path, PLAIN + "\n[[excerpt]]\n" + PLAIN.partition("[[excerpt]]\n")[2])
    assert np.any(repeated.codes[:6000] != repeated.codes[6000:])


def test_a_fault_changes_its_samples_only_and_keeps_readings_away_until_it_is_forgotten(tmp_path: Path) -> None:
    healthy, faulty = made(tmp_path, PLAIN), made(tmp_path, PLAIN + FAULT)
    within = slice(2000, 2500)
    assert len(set(faulty.codes[within, 0].tolist())) == 1
    assert faulty.codes[2000, 0] == healthy.codes[1999, 0]
    np.testing.assert_array_equal(np.delete(faulty.codes, within, axis=0), np.delete(healthy.codes, within, axis=0))
    np.testing.assert_array_equal(faulty.codes[:, 1], healthy.codes[:, 1])
    _, reading = parts(faulty)
    lost = np.flatnonzero(~reading[1000:]) + 1000
    assert lost[0] == 2000
    assert 2550 < lost[-1] < 2500 + SETTLED + 30
    assert len(lost) == lost[-1] - lost[0] + 1


@pytest.mark.parametrize(
    ("fault", "channel", "code"),
    [
        ('sensor = "thermocouple"\nkind = "open"', 1, 65535),
        ('sensor = "thermocouple"\nkind = "stuck"\ncode = 77', 1, 77),
        ('sensor = "inductive"\nkind = "missing"\nshare = 1.0', 0, None),
    ],
)
def test_kinds_of_faults(tmp_path: Path, fault: str, channel: int, code: int | None) -> None:
    trace = made(tmp_path, f"{PLAIN}\n[[excerpt.fault]]\n{fault}\nstart = 20\nseconds = 5\n")
    held = trace.codes[1999, channel] if code is None else code
    assert set(trace.codes[2000:2500, channel].tolist()) == {held}
    assert trace.codes[2500, channel] != held


def test_motion_from_a_file(tmp_path: Path) -> None:
    text = PLAIN.replace('"depot"', '"curve"\nmotion_from = "ride.csv"')
    ride = tmp_path / "ride.csv"
    ride.write_text("time_s,clearance_mm\n0,0\n30,1\n60,-1\n", encoding="utf-8")
    trace = made(tmp_path, text)
    truth, _ = parts(trace)
    expected = np.interp(trace.time, [0, 30, 60], [0, 1, -1])
    np.testing.assert_allclose(shown(trace) - truth, expected, atol=0.07)
    for content, message in (
        ("0,0\n30,1\n", ": time_s must extend from 0 to the 59.99 s of excerpt[0], not from 0 to 30"),
        ("0,0\n90,1\n60,1\n", ", line 4: time_s must be above the 90 s of the previous row, not 60 s"),
    ):
        ride.write_text(f"time_s,clearance_mm\n{content}", encoding="utf-8")
        with pytest.raises(SpecificationError, match=f"^{re.escape(f'{ride}{message}')}$"):
            made(tmp_path, text)


def test_motion_from_the_vehicle_model(tmp_path: Path) -> None:
    text = PLAIN.replace('"depot"', '"curve"\nmotion_from = "vehicle"')
    asked = []

    def vehicle(track: str, time: Values, seed: int) -> Values:
        asked.append((track, len(time), seed))
        return np.full(len(time), 0.5)

    trace = emulate_file(scenario(tmp_path, text), BENCH, seed=4, vehicle=vehicle)
    assert np.mean(shown(trace) - parts(trace)[0]) == pytest.approx(0.5, abs=0.002)
    assert asked == [("paper", 6000, 4)]
    with pytest.raises(
        SpecificationError, match=r"day.toml: excerpt\[0\].motion_from must be a file here, not the vehicle model$"
    ):
        made(tmp_path, text)


def test_errors_of_the_sensors_reach_the_trace(tmp_path: Path) -> None:
    text = PLAIN.replace(
        "noise = 0.01",
        "noise = 0.0\nageing = { offset_per_day = 0.02 }\nsystematic_error = { rms = 0.2 }\n"
        "mains = { amplitudes = [0.1] }\ndigitizer = { offset = 100.0 }",
    )
    first = VOLTAGE.decode(made(tmp_path, text).codes[:, 0])
    sensor = scenario(tmp_path, text).sensors.inductive
    assert (sensor.ageing.offset_per_day, sensor.systematic_error.rms, sensor.mains.amplitudes) == (0.02, 0.2, (0.1,))
    hum = np.abs(np.fft.rfft(first - first.mean()))
    assert np.argmax(hum) == 3000  # 50 Hz at 100 Hz
    # Two seeds differ by their systematic errors alone, the mean of one seed by ageing and offset as well.
    means = [VOLTAGE.decode(made(tmp_path, text, seed=k).codes[:, 0]).mean() for k in range(40)]
    steady = float(sensor_voltage(3.0, 20.0))
    assert np.mean(means) == pytest.approx(steady + 0.2 + 100 * 10 / 65536, abs=0.15)
    assert np.std(means) == pytest.approx(0.2 / 0.745, rel=0.35)


def test_a_duration_that_is_not_given_is_what_the_filter_needs(tmp_path: Path) -> None:
    trace = made(tmp_path, PLAIN.replace("seconds = 60\n", ""))
    _, reading = parts(trace)
    assert 300 < len(trace) < 500
    assert reading.mean() > 0.5


def test_refusals_while_a_trace_is_made(tmp_path: Path) -> None:
    steps = PLAIN.replace("temperature = 20.0", "temperature = 20.0\nclearances = [1, 2, 3]")
    late = FAULT.replace("start = 20", "start = 80")
    for text, bench, seed, message in (
        (PLAIN, replace(BENCH, polynomial=None, ports=(VOLTAGE,)), 1, "the core must be an instrument with a voltage "),
        (
            PLAIN.replace("seconds = 60", "seconds = 0.5"),
            BENCH,
            1,
            "one excerpt or more must last longer without a fault than the filter takes to settle, ",
        ),
        (
            PLAIN.replace("seconds = 60", "seconds = 0.001"),
            BENCH,
            1,
            "excerpt[0].seconds must be from 0.01 to 100000, one sample to 10000000 of them, not 0.001",
        ),
        (PLAIN.replace("seconds = 60", "seconds = 200000"), BENCH, 1, "excerpt[0].seconds must be from 0.01 to 100000"),
        (steps.replace("seconds = 60", "seconds = 2"), BENCH, 1, "excerpt[0].seconds must be at least "),
        (PLAIN + late, BENCH, 1, "excerpt[0].fault[0] must cover a sample of the excerpt's 60 s, not from 80 to 85 s"),
    ):
        with pytest.raises(SpecificationError, match=f"^{re.escape(f'{tmp_path}/day.toml: {message}')}"):
            emulate_file(scenario(tmp_path, text), bench, seed=seed)
    with pytest.raises(SpecificationError, match=r"^seed must be 0 or more, not -1$"):
        made(tmp_path, PLAIN, seed=-1)
    long = PLAIN.replace("seconds = 60", "seconds = 60000")
    with pytest.raises(
        SpecificationError,
        match=r"day.toml: all excerpts together must last at most 100000 s, 10000000 samples, not 120000$",
    ):
        made(tmp_path, long + "\n[[excerpt]]\n" + long.partition("[[excerpt]]\n")[2])


def test_a_note_on_what_the_temperature_input_cannot_show(tmp_path: Path) -> None:
    hot = scenario(tmp_path, PLAIN.replace("temperature = 20.0", "temperature = 20.0\ntemperature_to = 200.0"))
    assert range_notes(hot, BENCH.ports) == (
        f"{tmp_path}/day.toml: excerpt[0] reaches 200 degC, but the range of the core's temperature input ends at "
        "128 degC: its code saturates there, and the clearance is calibrated for the wrong temperature; widen the "
        "range in [input.temperature]",
    )
    cold = scenario(tmp_path, PLAIN.replace("temperature = 20.0", "temperature = -10.0"))
    assert (
        "reaches -10 degC, but the range of the core's temperature input ends at 0 degC"
        in range_notes(cold, BENCH.ports)[0]
    )
    assert range_notes(hot, BENCH.ports[:1]) == ()
    trace = emulate_file(hot, BENCH, seed=1)
    assert trace.codes[-1, 1] == 65535


def test_a_note_on_codes_that_an_input_does_not_have(tmp_path: Path) -> None:
    stuck = '[[excerpt.fault]]\nsensor = "{}"\nkind = "stuck"\nstart = 0\nseconds = 9\ncode = {}\n'
    within = scenario(tmp_path, PLAIN + stuck.format("inductive", 65535) + stuck.format("thermocouple", 0))
    assert range_notes(within, BENCH.ports) == ()
    beyond = scenario(tmp_path, PLAIN + stuck.format("inductive", 65536) + stuck.format("thermocouple", -1))
    assert range_notes(beyond, BENCH.ports) == (
        f"{tmp_path}/day.toml: excerpt[0].fault[0] is stuck at code 65536, but the codes of voltage are 0..65535: "
        "it is stuck at 65535 instead",
        f"{tmp_path}/day.toml: excerpt[0].fault[1] is stuck at code -1, but the codes of temperature are 0..65535: "
        "it is stuck at 0 instead",
    )
    assert len(range_notes(beyond, BENCH.ports[:1])) == 1
    assert emulate_file(beyond, BENCH, seed=1).codes[10].tolist() == [65535, 0]


@pytest.mark.parametrize(
    ("old", "new", "channel"),
    [
        ("noise = 0.01", "noise = 0.02", 0),
        ("noise = 0.01", 'noise = 0.01\nmodel = "equation_4"', 0),
        ("noise = 0.01", "noise = 0.01\noutput_range = [0.0, 1.0]", 0),
        ("noise = 0.01", "noise = 0.01\nageing = { gain_per_day = 0.01 }", 0),
        ("noise = 0.01", "noise = 0.01\nageing = { offset_walk = 0.01 }", 0),
        ("noise = 0.01", "noise = 0.01\nageing = { gain_walk = 0.01 }", 0),
        ("noise = 0.01", "noise = 0.01\nsystematic_error = { rms = 0.1, correlation = 1.0 }", 0),
        ("noise = 0.01", "noise = 0.01\nmains = { frequency = 60.0, amplitudes = [0.0, 0.1] }", 0),
        ("noise = 0.01", "noise = 0.01\ndigitizer = { gain_error = 0.01 }", 0),
        ("noise = 0.01", "noise = 0.01\ndigitizer = { inl = 50.0 }", 0),
        ("noise = 4.0", "noise = 5.0", 1),
        ("noise = 4.0", "noise = 4.0\ncold_junction = -20.0", 1),
        ("noise = 4.0", "noise = 4.0\ncold_junction_error = 0.5", 1),
        ("noise = 4.0", "noise = 4.0\ndigitizer = { bits = 12 }", 1),
        ("noise = 4.0", "noise = 4.0\ndigitizer = { range = 0.5e2 }", 1),
        ("noise = 4.0", "noise = 4.0\ndigitizer = { offset = 50.0 }", 1),
        ("noise = 4.0", "noise = 4.0\ndigitizer = { gain_error = 0.5 }", 1),
        ("noise = 4.0", "noise = 4.0\ndigitizer = { inl = 1e6 }", 1),
    ],
)
def test_every_key_of_a_sensor_changes_its_codes_and_not_those_of_the_other(
    tmp_path: Path, old: str, new: str, channel: int
) -> None:
    before, after = made(tmp_path, PLAIN), made(tmp_path, PLAIN.replace(old, new))
    assert np.any(before.codes[:, channel] != after.codes[:, channel])
    np.testing.assert_array_equal(before.codes[:, 1 - channel], after.codes[:, 1 - channel])
