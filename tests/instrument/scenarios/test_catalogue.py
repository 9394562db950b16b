"""Scenarios: what each promises, settled readings, worst cases that are worst, refusals."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from scipy import signal

from sosmith.gen.stimuli.run import MAX_SAMPLES, MIN_SAMPLES, Bench
from sosmith.instrument.scenarios.catalogue import SCENARIOS, emulate
from sosmith.instrument.scenarios.instrument_signals import TABLE_1_STEPS, TABLE_2_STEPS
from sosmith.instrument.scenarios.summaries import SUMMARIES
from sosmith.instrument.sensors.inductive_sensor import VOLTAGE_NOISE
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A, Polynomial
from sosmith.model.port import Port
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.traces.trace import Trace

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
TEMPERATURE = Port.from_range("temperature", 16, Fraction(0), Fraction(128), unit="degC")
CLEARANCE = Port.from_range("clearance", 16, Fraction(0), Fraction(16), unit="mm")
AUDIO = Port.from_range("audio", 16, Fraction(-1), Fraction(1), signed=True)


def butterworth(order: int, cutoff: float, rate: float) -> Values:
    """Impulse response down to 1e-9 of its peak."""
    impulse = np.zeros(1 << 14)
    impulse[0] = 1.0
    h = signal.sosfilt(signal.butter(order, cutoff, fs=rate, output="sos"), impulse)
    return np.asarray(h[: np.flatnonzero(np.abs(h) > 1e-9 * np.abs(h).max())[-1] + 1])


INSTRUMENT = Bench(
    ports=(VOLTAGE, TEMPERATURE),
    output=CLEARANCE,
    sample_rate=Fraction(6),
    polynomial=EQUATION_5A,
    impulse_response=butterworth(5, 0.576, 6),
)
LOCOMOTIVE = replace(INSTRUMENT, sample_rate=Fraction(100), impulse_response=butterworth(7, 0.2587803, 100))
CALIBRATION = replace(INSTRUMENT, sample_rate=Fraction(100), impulse_response=np.array([1.0]))
FILTER = Bench(
    ports=(AUDIO,),
    output=AUDIO,
    sample_rate=Fraction(48000),
    polynomial=None,
    impulse_response=butterworth(5, 1000, 48000),
)
BENCHES = {"instrument": INSTRUMENT, "locomotive": LOCOMOTIVE, "calibration": CALIBRATION, "filter": FILTER}
EVERY = [(name, bench) for name, bench in product(SCENARIOS, BENCHES) if BENCHES[bench].kind in SUMMARIES[name].kinds]


def clearance(trace: Trace) -> Values:
    values = trace.values()
    return EQUATION_5A(values[:, 0], values[:, 1])


def filtered(bench: Bench, x: Values) -> Values:
    return np.asarray(signal.lfilter(bench.impulse_response, [1.0], x))


def measures(trace: Trace) -> tuple[Values, np.typing.NDArray[np.bool_]]:
    assert trace.truth is not None
    assert trace.reading is not None
    return trace.truth, trace.reading


@pytest.mark.parametrize(("name", "bench"), EVERY)
def test_same_seed_same_trace_of_reasonable_length(name: str, bench: str) -> None:
    trace = emulate(name, BENCHES[bench], seed=7)
    again = emulate(name, BENCHES[bench], seed=7)
    np.testing.assert_array_equal(trace.codes, again.codes)
    assert MIN_SAMPLES <= len(trace) <= MAX_SAMPLES
    assert len(trace) == SCENARIOS[name].default_samples(BENCHES[bench])
    assert (trace.name, trace.seed) == (name, 7)
    random = name not in {"worst_case", "worst_case_errors", "step", "sweep", "passband_sweep", "tone"}
    assert random == bool(np.any(trace.codes != emulate(name, BENCHES[bench], seed=8).codes))


@pytest.mark.parametrize(
    ("name", "steps", "temperatures"),
    [("bench_43_50", TABLE_1_STEPS, (43, 50)), ("bench_92_96", TABLE_2_STEPS, (92, 96))],
)
@pytest.mark.parametrize("bench", [INSTRUMENT, LOCOMOTIVE, CALIBRATION], ids=["F5", "F7", "no filter"])
def test_bench_runs(name: str, steps: tuple[float, ...], temperatures: tuple[int, int], bench: Bench) -> None:
    trace = emulate(name, bench, seed=1)
    truth, reading = measures(trace)
    assert tuple(dict.fromkeys(truth.tolist())) == steps
    assert tuple(dict.fromkeys(truth[reading].tolist())) == steps
    assert trace.values()[[0, -1], 1] == pytest.approx(temperatures, abs=0.5)
    # At every reading the filter shows the plateau alone: the truth itself, filtered, is settled.
    assert np.max(np.abs(filtered(bench, truth) - truth)[reading]) <= float(CLEARANCE.lsb) / 2
    # Clearance is noisy by the voltage noise times a slope of 0.4 to 1.6 mm/V, and nothing else.
    assert 0.3 * VOLTAGE_NOISE < np.std((clearance(trace) - truth)[reading]) < 2 * VOLTAGE_NOISE


def test_filter_improves_the_accuracy_of_a_bench_run() -> None:
    trace = emulate("bench_43_50", INSTRUMENT, seed=1)
    truth, reading = measures(trace)
    unfiltered = accuracy_percent(clearance(trace), truth, reading)
    assert 99.5 < unfiltered < accuracy_percent(filtered(INSTRUMENT, clearance(trace)), truth, reading) < 100


def test_tables_of_the_paper() -> None:
    assert TABLE_1_STEPS == (1, 2, 3, 4, 5, 6, 7, 8, 9, 10)
    assert TABLE_2_STEPS == (1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 6, 6.5, 7, 7.5, 8, 8.5, 9, 9.5, 10)


def test_temperature_ramp() -> None:
    trace = emulate("temperature_ramp", INSTRUMENT, seed=1)
    truth, reading = measures(trace)
    assert set(truth.tolist()) == {5.0}
    assert trace.values()[[0, -1], 1] == pytest.approx((20, 98), abs=0.5)
    assert np.max(np.abs(filtered(INSTRUMENT, truth) - truth)[reading]) <= float(CLEARANCE.lsb) / 2
    assert not reading[0]
    assert reading[-1]


def test_wear_ramp_holds_the_three_motions_and_its_truth_does_not() -> None:
    trace = emulate("wear_ramp", CALIBRATION, seed=1, seconds=200)
    truth, _ = measures(trace)
    assert (truth[0], truth[-1]) == (2.0, 9.0)
    np.testing.assert_allclose(np.diff(truth), 7 / (len(trace) - 1), rtol=1e-9)
    motion = clearance(trace) - truth
    for frequency, amplitude in ((1.2, 0.5), (2.0, 0.3), (8.0, 0.1)):
        line = 2 * np.mean(motion * np.exp(-2j * np.pi * frequency * trace.time))
        assert abs(line) == pytest.approx(amplitude, rel=0.05)
        motion = motion - np.real(line * np.exp(2j * np.pi * frequency * trace.time))
    assert 0.05 < np.std(motion) < 0.06


@pytest.mark.parametrize("rate", [6, 100, 48000])
def test_wear_ramp_at_any_sample_rate(rate: int) -> None:
    trace = emulate("wear_ramp", replace(CALIBRATION, sample_rate=Fraction(rate)), seed=1)
    assert 0 < trace.codes[:, 0].min() < trace.codes[:, 0].max() < 65535


@pytest.mark.parametrize("bench", [INSTRUMENT, LOCOMOTIVE, CALIBRATION, FILTER], ids=["F5", "F7", "none", "audio"])
def test_worst_case_reaches_the_extremes_of_the_filtered_signal(bench: Bench) -> None:
    trace = emulate("worst_case", bench, seed=1)
    x = trace.values()[:, 0] if bench.polynomial is None else clearance(trace)
    low, high = (-1.0, 1.0 - 2**-15) if bench.polynomial is None else (x.min(), x.max())
    h = bench.impulse_response
    highest = np.sum(np.where(h >= 0, high * h, low * h))
    lowest = np.sum(np.where(h >= 0, low * h, high * h))
    y = filtered(bench, x)
    assert y.max() == pytest.approx(highest, abs=1e-9)
    assert y.min() == pytest.approx(lowest, abs=1e-9)
    assert trace.truth is None
    assert trace.reading is None


@pytest.mark.parametrize(
    "polynomial",
    [
        EQUATION_5A,
        Polynomial.from_numbers([[0, "0.2", "-0.0031"], ["-1.3", "0.01"], ["0.21"]]),  # extremes inside the range
        # (V - 3.75)**2 (V - 7.5)**2 + 0.3 V: two valleys, the first one a little deeper
        Polynomial.from_numbers([["791.015625"], ["-632.5125"], ["182.8125"], ["-22.5"], [1]]),
    ],
)
def test_worst_case_takes_the_extreme_codes(polynomial: Polynomial) -> None:
    ports = (
        replace(VOLTAGE, bits=9, lsb=Fraction(10, 512)),
        replace(TEMPERATURE, bits=10, lsb=Fraction(128, 1024)),
    )
    trace = emulate("worst_case", replace(CALIBRATION, ports=ports, polynomial=polynomial), seed=1)
    every = polynomial(ports[0].decode(np.arange(512))[:, np.newaxis], ports[1].decode(np.arange(1024)))
    values = polynomial(*trace.values().T)
    assert (values.min(), values.max()) == (every.min(), every.max())


ERROR_PATHS = (butterworth(2, 0.4, 6), np.array([1.0, -1.0, 0.5, -0.25]), np.array([-2.0, 1.0]))
"""Responses from three quantizers, of very different lengths."""


@pytest.mark.parametrize("bench", [INSTRUMENT, FILTER], ids=["F5", "audio"])
def test_worst_case_of_every_error_path(bench: Bench) -> None:
    """Each response in turn sees both of its worst inputs, but for the thousandth of it that is left out."""
    bench = replace(bench, error_responses=ERROR_PATHS)
    trace = emulate("worst_case_errors", bench, seed=1)
    x = trace.values()[:, 0] if bench.polynomial is None else clearance(trace)
    low, high = x.min(), x.max()
    middle, half = (high + low) / 2, (high - low) / 2
    for response in (bench.impulse_response, *ERROR_PATHS):
        reached = np.convolve(x - middle, response)[: len(x)]
        most = half * np.abs(response).sum()
        assert 0.997 * most < reached.max() <= most + 1e-9
        assert -most - 1e-9 <= reached.min() < -0.997 * most


def test_error_paths_share_a_length_that_is_given() -> None:
    bench = replace(FILTER, impulse_response=np.array([1.0, 1.0, 1.0]), error_responses=(np.ones(100), np.ones(2)))
    codes = emulate("worst_case_errors", bench, seed=1, seconds=60 / 48000).codes[:, 0]
    pattern = np.repeat([1, 0, 1, 0, 1, 0], [3, 3, 10, 10, 2, 2])
    np.testing.assert_array_equal(codes > 0, np.resize(pattern, 60))


def test_step() -> None:
    trace = emulate("step", FILTER, seed=1)
    truth, reading = measures(trace)
    assert sorted(set(truth[reading].round(3).tolist())) == [-0.5, -0.25, 0.25, 0.5]
    np.testing.assert_array_equal(truth, trace.values()[:, 0])
    assert np.max(np.abs(filtered(FILTER, truth) - truth)[reading]) <= float(AUDIO.lsb) / 2


def test_sweep_rises_to_just_below_nyquist() -> None:
    x = emulate("sweep", FILTER, seed=1).values()[:, 0]
    assert np.abs(x).max() == pytest.approx(0.9, abs=1e-3)
    for part, expected in ((x[:2000], 0.49 / 16), (x[-2000:], 0.49 * 15 / 16)):
        crossings = np.count_nonzero(np.diff(np.signbit(part)))
        assert crossings / 2 / len(part) == pytest.approx(expected, abs=0.002)


def test_noise_is_white_and_covers_every_part_of_the_range() -> None:
    codes = emulate("noise", FILTER, seed=1).codes[:, 0]
    counts, _ = np.histogram(codes, bins=16, range=(-32768, 32768))
    assert counts.min() > 0.85 * len(codes) / 16
    x = codes - codes.mean()
    assert abs(np.mean(x[1:] * x[:-1])) < 0.03 * np.mean(x**2)


TOP = 10 ** (-1 / 20)


def high_pass(*edges: float) -> Bench:
    impulse = np.zeros(1 << 12)
    impulse[0] = 1.0
    kind = "highpass" if len(edges) == 1 else "bandpass"
    sos = signal.butter(2, edges if len(edges) > 1 else edges[0], kind, fs=48000, output="sos")
    return replace(FILTER, impulse_response=signal.sosfilt(sos, impulse))


SLOW = replace(FILTER, impulse_response=butterworth(1, 5, 48000))
DOUBLED = replace(FILTER, impulse_response=4 * FILTER.impulse_response)


@pytest.mark.parametrize(
    ("bench", "frequency", "amplitude"),
    [
        (FILTER, 997, TOP),
        (DOUBLED, 997, TOP / 4 * np.sqrt(2)),
        (high_pass(10000), 15400, TOP),
        (high_pass(2000, 3000), 2440, TOP),
        (SLOW, 1.49, TOP),
    ],
)
def test_the_tone_is_where_the_filter_passes_and_saturates_nothing(
    bench: Bench, frequency: float, amplitude: float
) -> None:
    trace = emulate("tone", bench, seed=1, seconds=1)
    assert trace.tone is not None
    assert float(trace.tone.frequency) == frequency
    x = trace.values()[:, 0]
    np.testing.assert_allclose(x, amplitude * np.sin(2 * np.pi * frequency * trace.time), atol=0.01)
    assert np.abs(signal.fftconvolve(x, bench.impulse_response)[trace.tone.settled : len(x)]).max() < 1
    assert trace.delayed(3).tone == replace(trace.tone, settled=trace.tone.settled + 3)
    assert trace.every(4).tone == replace(trace.tone, settled=-(-trace.tone.settled // 4))


@pytest.mark.parametrize("bench", [FILTER, high_pass(10000), high_pass(2000, 3000)])
def test_the_sweep_of_the_passband_stays_there_and_covers_the_rest(bench: Bench) -> None:
    x = emulate("passband_sweep", bench, seed=1).values()[:, 0]
    assert np.abs(x).max() == pytest.approx(TOP, abs=1e-3)
    passes = np.mean(np.abs(signal.hilbert(signal.fftconvolve(x, bench.impulse_response)[: len(x)])) > 0.5 * TOP)
    assert passes > 0.6
    assert not np.signbit(x[:100]).any()  # below 240 Hz at first
    assert np.count_nonzero(np.diff(np.signbit(x[-40:]))) / 80 == pytest.approx(0.49, rel=0.1)


def test_the_multitone_has_one_level_at_each_third_of_an_octave() -> None:
    trace = emulate("multitone", FILTER, seed=1, seconds=1)
    assert np.abs(trace.values()).max() == pytest.approx(TOP, abs=1e-3)
    amplitudes = 2 * np.abs(np.fft.rfft(trace.values()[:, 0])) / 48000
    exact = [10 ** (n / 10) for n in range(14, 44)]
    found = [float(np.sqrt(np.sum(amplitudes[round(f) - 3 : round(f) + 4] ** 2))) for f in exact]
    assert max(found) / min(found) < 1.2
    assert np.sqrt(np.sum(amplitudes**2)) == pytest.approx(np.sqrt(np.sum(np.square(found))), rel=0.02)


def test_pink_noise_has_equal_power_in_each_octave() -> None:
    x = emulate("pink_noise", FILTER, seed=1, seconds=4).values()[:, 0]
    assert np.abs(x).max() == pytest.approx(TOP, abs=1e-3)
    power = np.abs(np.fft.rfft(x)) ** 2
    octaves = [np.sum(power[4 * low : 8 * low]) for low in (100, 200, 400, 800, 1600, 3200, 6400)]
    assert max(octaves) / min(octaves) < 1.25


def test_an_unsigned_plain_filter_stays_in_its_range() -> None:
    port = Port.from_range("level", 12, Fraction(0), Fraction(5), unit="V")
    bench = replace(FILTER, ports=(port,))
    for name in ("step", "sweep", "noise", "worst_case", "passband_sweep", "tone"):
        codes = emulate(name, bench, seed=1).codes
        assert 0 <= codes.min() < 1200
        assert 2900 < codes.max() <= 4095


def test_instrument_with_a_voltage_alone() -> None:
    bench = replace(INSTRUMENT, ports=(VOLTAGE,), polynomial=Polynomial.from_numbers([[1], ["0.4"], ["0.06"]]))
    for name in ("bench_43_50", "wear_ramp", "worst_case"):
        assert emulate(name, bench, seed=1).codes.shape[1] == 1


def test_settling_is_the_first_sample_within_half_an_output_lsb() -> None:
    h = np.array([0.5, 0.25, 0.125, 0.0625, 0.0625])
    bench = replace(CALIBRATION, impulse_response=h, output=replace(CLEARANCE, lsb=Fraction(1, 4)))
    # A step of 1 mm shows 0.5, 0.75, 0.875 mm: within 0.125 mm of 1 mm from the third sample on.
    assert bench.settling(1.0) == 2
    assert bench.settling(0.25) == 0
    assert CALIBRATION.settling(10.0) == 0


def test_seconds_give_the_length() -> None:
    assert len(emulate("wear_ramp", INSTRUMENT, seed=1, seconds=100.0)) == 600
    assert len(emulate("worst_case", INSTRUMENT, seed=1, seconds=1 / 6)) == 1


@pytest.mark.parametrize(
    ("name", "bench", "arguments", "message"),
    [
        (
            "bench",
            INSTRUMENT,
            {},
            "scenario for an instrument must be one of bench_43_50, bench_92_96, temperature_ramp, "
            "wear_ramp, worst_case, worst_case_errors, not 'bench' (did you mean bench_92_96?)",
        ),
        (
            "wear_ramp",
            FILTER,
            {},
            "scenario for a plain filter must be one of worst_case, worst_case_errors, step, sweep, noise, "
            "passband_sweep, tone, multitone, pink_noise, not 'wear_ramp'",
        ),
        ("noise", FILTER, {"seed": -1}, "seed must be 0 or more, not -1"),
        (
            "wear_ramp",
            LOCOMOTIVE,
            {"seconds": 1e9},
            "seconds must be at most 100000, 10000000 samples, not 1000000000.0",
        ),
        (
            "noise",
            FILTER,
            {"seconds": 0.0},
            "seconds must be at least 2.08333e-05, one sample, not 0.0",
        ),
        (
            "wear_ramp",
            INSTRUMENT,
            {"seconds": -1},
            "seconds must be at least 0.166667, one sample, not -1",
        ),
        (
            "wear_ramp",
            INSTRUMENT,
            {"seconds": float("nan")},
            "seconds must be at least 0.166667, one sample, not nan",
        ),
    ],
)
def test_refusals(name: str, bench: Bench, arguments: dict[str, float], message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        emulate(name, bench, **{"seed": 1, **arguments})


@pytest.mark.parametrize(
    ("name", "bench", "why"),
    [
        ("bench_43_50", LOCOMOTIVE, "the filter has to settle on 10 plateaus"),
        ("wear_ramp", LOCOMOTIVE, "the filter has to settle"),
        ("step", FILTER, "the filter has to settle on 4 plateaus"),
    ],
)
def test_the_least_length_in_a_refusal_is_the_least_that_works(name: str, bench: Bench, why: str) -> None:
    seconds = 2 / float(bench.sample_rate)
    pattern = rf"^seconds must be at least ([0-9.e-]+) for {name} \({why}\), not {seconds:.6g}$"
    with pytest.raises(SpecificationError, match=pattern) as caught:
        emulate(name, bench, seed=1, seconds=seconds)
    found = re.fullmatch(pattern, str(caught.value))
    assert found
    least = round(float(found[1]) * float(bench.sample_rate))
    _, reading = measures(emulate(name, bench, seed=1, seconds=least / float(bench.sample_rate)))
    assert reading.any()
    with pytest.raises(SpecificationError, match=r"^seconds must be at least "):
        emulate(name, bench, seed=1, seconds=(least - 1) / float(bench.sample_rate))


def test_bench_refusals() -> None:
    for changes, message in (
        ({"polynomial": None}, "ports must be one input, not 2"),
        ({"ports": ()}, "ports must be one or two inputs, not 0"),
        ({"sample_rate": Fraction(0)}, "sample_rate must be positive, not 0"),
        (
            {"impulse_response": np.array([])},
            "impulse_response must be a row of finite numbers, not of shape (0,)",
        ),
        (
            {"impulse_response": np.array([1.0, np.inf])},
            "impulse_response must be a row of finite numbers, not of shape (2,)",
        ),
        (
            {"error_responses": (np.ones(3), np.ones((2, 1)))},
            "error_responses[1] must be a row of finite numbers, not of shape (2, 1)",
        ),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            replace(INSTRUMENT, **changes)
