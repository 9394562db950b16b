"""Emulated traces by name: the paper's runs on the bench, ramps, vehicle motion, worst cases.

A scenario turns a `Bench` (the core's ports, sample rate and ideal behaviour) and a seed into a `Trace`,
the same on every run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Codes, Port, Values
from sosmith.model.random_streams import one_stream
from sosmith.model.sensors import Sensors
from sosmith.model.trace import Trace

TABLE_1_STEPS = tuple(float(d) for d in range(1, 11))
"""Clearances in mm of the run at 43 to 50 degC (the paper's table 1)."""

TABLE_2_STEPS = tuple(d / 2 for d in range(2, 21) if d != 11)
"""Clearances in mm of the run at 92 to 96 degC (the paper's table 2, which has no 5.5 mm)."""

RAMP_TEMPERATURE = (20.0, 98.0)
"""First and last temperature in degC of the temperature ramp: the paper's range of measurements."""

RAMP_CLEARANCE = 5.0
"""Clearance in mm during the temperature ramp, the middle of the sensor's range."""

WEAR_CLEARANCE = (2.0, 9.0)
"""First and last clearance in mm of the wear ramp; with the motion it stays within the sensor's 10 mm."""

WEAR_TEMPERATURE = (43.0, 50.0)
"""First and last temperature in degC of the wear ramp: the paper's first run."""

MOTION = ((1.2, 0.5), (2.0, 0.3), (8.0, 0.1))
"""Frequency in Hz and amplitude in mm of the vehicle's motion at the sensor.

1.2 and 7.9 Hz are modes of a bogie at 20 m/s (Cooperrider model), 2 Hz is the paper's track irregularity of
10 m length at 20 m/s. Amplitudes are assumed: 0.5 mm is the least relative yaw of the paper's table 7
(0.00116 rad) on an arm of one wheel radius (0.46 m); shorter waves move the bogie less.
"""

MOTION_NOISE = 0.05
"""Broadband vibration of the clearance in mm rms; assumed, as the bogie's 0.0165 to 0.0648 in section 5.3."""

READING_PART = 0.1
"""Last part of each plateau in which the micrometer is read; the paper reads once, more average the noise."""

LEAST_SAMPLES = 4000
"""Samples that a trace has at least, unless its length is given."""

MOST_SAMPLES = 60_000
"""Samples that a trace has at most, unless its length is given: a co-simulation of tens of seconds."""

LIMIT_SAMPLES = 10_000_000
"""Samples that a trace may have at all, a guard against a slip in the unit: some hundred megabytes."""

SWEEP_END = 0.49
"""Last frequency of the sweep over the sample rate, just below Nyquist's 0.5."""

SWEEP_AMPLITUDE = 0.9
"""Amplitude of the sweep over half the input's range."""

STEP_LEVELS = (0.5, -0.5, 0.25, -0.25)
"""Plateaus of the step scenario over half the input's range, from its middle.

Half of full scale leaves room for the overshoot of any usual filter.
"""

STRONG_PART = 0.999
"""Share of an impulse response's magnitudes that a worst case of the error paths keeps: the rest is a long tail."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Bench:
    """What a scenario needs to know of the core.

    Attributes
    ----------
    ports : tuple of Port
        Inputs: voltage in V and, if there are two, temperature in degC for an instrument; any one input
        for a plain filter.
    output : Port
        Output; its LSB says when the filter has settled.
    sample_rate : Fraction
        Samples per second.
    polynomial : Polynomial, optional
        Calibration; without it the core is a plain filter.
    impulse_response : ndarray, shape (n,)
        Impulse response of the ideal filter, long enough for the rest not to matter; ``[1.0]`` for a
        core without a filter.
    error_responses : tuple of ndarray, shape (m,)
        Impulse response from each rounding inside the filter to its output; none for a core without a filter.

    Raises
    ------
    ValueError
        If the count of ports does not fit, an impulse response is empty or not finite, or the sample
        rate is not positive.
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

    def settling(self, step: float) -> int:
        """Count the samples after a step of the input until the output stays within half an output LSB.

        `step` is in the output's unit. The response differs from its last value by at most `step`
        times the sum of the magnitudes of the impulse response still to come.
        """
        to_come = np.cumsum(np.abs(self.impulse_response[::-1]))[::-1]
        return int(np.count_nonzero(to_come[1:] * step > float(self.output.lsb) / 2))


@dataclass(frozen=True)
class Scenario:
    """A named way to make a trace.

    Attributes
    ----------
    name : str
        Name on the command line.
    description : str
        One line for the user.
    kinds : tuple of str
        Kinds of core it fits (`Bench.kind`).
    default_samples : callable
        Length of the trace for a bench, if none is given.
    make : callable
        Makes codes, truth and reading of the given length.
    """

    name: str
    description: str
    kinds: tuple[str, ...]
    default_samples: Callable[[Bench], int]
    make: Callable[[_Run], _Signal]

    def default_seconds(self, bench: Bench) -> float:
        """Duration of the trace in s, if none is given."""
        return self.default_samples(bench) / float(bench.sample_rate)


@dataclass(frozen=True, eq=False)
class _Run:
    """One call of a scenario: where, how long, and the source of all chance."""

    name: str
    bench: Bench
    samples: int
    rng: np.random.Generator

    @cached_property
    def progress(self) -> Values:
        """0 at the first sample, 1 at the last."""
        return np.arange(self.samples) / max(self.samples - 1, 1)

    @property
    def time(self) -> Values:
        return np.arange(self.samples) / float(self.bench.sample_rate)

    def between(self, ends: tuple[float, float]) -> Values:
        """Straight line over the whole trace."""
        return ends[0] + (ends[1] - ends[0]) * self.progress

    def refuse_length(self, least: int, why: str) -> SpecificationError:
        rate = float(self.bench.sample_rate)
        return SpecificationError(
            f"seconds must be at least {least / rate:.6g} for {self.name} ({why}), not {self.samples / rate:.6g}"
        )


@dataclass(frozen=True, eq=False)
class _Signal:
    codes: Codes
    truth: Values | None = None
    reading: npt.NDArray[np.bool_] | None = None


def emulate(name: str, bench: Bench, *, seed: int, seconds: float | None = None) -> Trace:
    """Make the trace of the scenario `name` for a core.

    Parameters
    ----------
    name : str
        A key of `SCENARIOS` that fits the core.
    bench : Bench
        The core.
    seed : int
        Seed of all noise, 0 or more. Same seed, same trace.
    seconds : float, optional
        Duration; by default long enough for the filter to settle where it matters, and from
        `LEAST_SAMPLES` to `MOST_SAMPLES` long.

    Raises
    ------
    SpecificationError
        If no scenario that fits the core has that name; if the duration is not positive, too short for
        the scenario or above `LIMIT_SAMPLES`; if the seed is negative.
    """
    fitting = [scenario.name for scenario in SCENARIOS.values() if bench.kind in scenario.kinds]
    if name not in fitting:
        core = "a plain filter" if bench.kind == "filter" else "an instrument"
        raise SpecificationError(f"scenario for {core} must be one of {', '.join(fitting)}, not {name!r}")
    if seed < 0:
        raise SpecificationError(f"seed must be 0 or more, not {seed}")
    scenario = SCENARIOS[name]
    samples = scenario.default_samples(bench) if seconds is None else _samples(bench, seconds)
    signal = scenario.make(_Run(name, bench, samples, np.random.default_rng(seed)))
    return Trace(
        name=name,
        ports=bench.ports,
        sample_rate=bench.sample_rate,
        codes=signal.codes,
        truth=signal.truth,
        reading=signal.reading,
        seed=seed,
    )


def _samples(bench: Bench, seconds: float) -> int:
    if not seconds * bench.sample_rate >= 1:  # also for NaN
        least = 1 / float(bench.sample_rate)
        raise SpecificationError(f"seconds must be at least {least:.6g}, one sample, not {seconds}")
    if seconds * bench.sample_rate > LIMIT_SAMPLES:
        most = LIMIT_SAMPLES / float(bench.sample_rate)
        raise SpecificationError(f"seconds must be at most {most:.6g}, {LIMIT_SAMPLES} samples, not {seconds}")
    return round(seconds * float(bench.sample_rate))


# Instruments: clearance and temperature -> sensors -> noise -> ADC codes.


def _sense(run: _Run, clearance: Values, temperature: Values) -> Codes:
    """Codes of the noisy sensors; the ADC saturates."""
    return Sensors().codes(clearance, temperature, run.time, run.bench.ports, one_stream(run.rng))


def _settled(run: _Run, step: float) -> npt.NDArray[np.bool_]:
    """Mark the samples after the filter has settled from a first step; refuse a trace without any."""
    settling = run.bench.settling(step)
    if settling >= run.samples:
        raise run.refuse_length(settling + 1, "the filter has to settle")
    return np.arange(run.samples) >= settling


def plateau_samples(bench: Bench, levels: tuple[float, ...]) -> int:
    """Count the samples of a plateau in whose last part the filter has settled."""
    step = float(np.max(np.abs(np.diff(levels, prepend=0.0))))
    return math.ceil((bench.settling(step) + 1) / (1 - READING_PART))


def _plateaus(run: _Run, levels: tuple[float, ...], heights: tuple[float, ...]) -> _Plateaus:
    """Hold each of `levels` equally long; `heights` are the levels in the output's unit."""
    length = run.samples // len(levels)
    least = plateau_samples(run.bench, heights)
    if length < least:
        raise run.refuse_length(least * len(levels), f"the filter has to settle on {len(levels)} plateaus")
    index = np.minimum(np.arange(run.samples) // length, len(levels) - 1)
    position = np.arange(run.samples) % length
    full = np.arange(run.samples) < length * len(levels)
    return _Plateaus(np.array(levels)[index], full & (position >= math.floor(length * (1 - READING_PART))))


@dataclass(frozen=True, eq=False)
class _Plateaus:
    values: Values
    reading: npt.NDArray[np.bool_]


def _stepped_samples(levels: tuple[float, ...]) -> Callable[[Bench], int]:
    def samples(bench: Bench) -> int:
        least = math.ceil(LEAST_SAMPLES / len(levels))
        return min(max(plateau_samples(bench, levels), least) * len(levels), MOST_SAMPLES)

    return samples


def _bench_run(levels: tuple[float, ...], temperature: tuple[float, float]) -> Callable[[_Run], _Signal]:
    def make(run: _Run) -> _Signal:
        clearance = _plateaus(run, levels, levels)
        codes = _sense(run, clearance.values, run.between(temperature))
        return _Signal(codes, clearance.values, clearance.reading)

    return make


def _temperature_ramp(run: _Run) -> _Signal:
    clearance = np.full(run.samples, RAMP_CLEARANCE)
    reading = _settled(run, RAMP_CLEARANCE)
    return _Signal(_sense(run, clearance, run.between(RAMP_TEMPERATURE)), clearance, reading)


def _wear_ramp(run: _Run) -> _Signal:
    wear = run.between(WEAR_CLEARANCE)
    motion = sum(
        (amplitude * np.sin(2 * np.pi * frequency * run.time) for frequency, amplitude in MOTION),
        run.rng.normal(0.0, MOTION_NOISE, run.samples),
    )
    codes = _sense(run, wear + motion, run.between(WEAR_TEMPERATURE))
    return _Signal(codes, wear, _settled(run, WEAR_CLEARANCE[1]))


def _settlings(count: int, step: float) -> Callable[[Bench], int]:
    """Default length of `count` settling times."""

    def samples(bench: Bench) -> int:
        return min(max(count * bench.settling(step), LEAST_SAMPLES), MOST_SAMPLES)

    return samples


# Both kinds: the inputs that drive the filter's output, or the way of an error to it, as far as any input can.


def sign_matched(response: Values) -> npt.NDArray[np.bool_]:
    """Tell at which samples an input must be at its high end to drive what has this impulse response furthest.

    The pattern is that of the signs of the reversed response, so that at its last sample every term
    ``h[k] x[n - k]`` is at its largest, followed by the same with the ends exchanged.

    Parameters
    ----------
    response : ndarray, shape (n,)

    Returns
    -------
    ndarray of bool, shape (2 n,)
    """
    towards_high = (response >= 0)[::-1]
    return np.concatenate([towards_high, ~towards_high])


def _worst_cases(run: _Run, responses: Sequence[Values]) -> _Signal:
    """Extreme inputs in the patterns of `responses` in turn, over and over; long ones lose their tails."""
    low, high = _extreme_codes(run.bench)
    most = max(run.samples // (2 * len(responses)), 1)
    pattern = np.concatenate([sign_matched(response[:most]) for response in responses])
    return _Signal(np.where(np.resize(pattern, run.samples)[:, np.newaxis], high, low))


def _worst_cases_samples(responses: Sequence[Values]) -> int:
    """Count the samples in which `_worst_cases` shows whole patterns."""
    patterns = 2 * len(responses) * max(map(len, responses))
    return min(patterns * math.ceil(LEAST_SAMPLES / patterns), MOST_SAMPLES)


def _strong(response: Values) -> Values:
    """First part of a response that holds `STRONG_PART` of its magnitudes."""
    so_far = np.cumsum(np.abs(response))
    return response[: int(np.searchsorted(so_far, STRONG_PART * so_far[-1])) + 1]


def _all_responses(bench: Bench) -> list[Values]:
    return [_strong(response) for response in (bench.impulse_response, *bench.error_responses)]


def _extreme_codes(bench: Bench) -> tuple[Codes, Codes]:
    """Input codes, shape (n_inputs,), that give the filter its lowest and its highest input."""
    if bench.polynomial is None:
        return np.array([bench.ports[0].lowest]), np.array([bench.ports[0].highest])
    return _lowest_codes(bench, bench.polynomial, 1.0), _lowest_codes(bench, bench.polynomial, -1.0)


def _lowest_codes(bench: Bench, polynomial: Polynomial, sign: float) -> Codes:
    """Codes that minimise ``sign * polynomial``: a grid over all codes, then ever finer ones around its best.

    With 257 points per axis the first grid tells the valleys of a polynomial of low order apart.
    """
    low = np.array([port.lowest for port in bench.ports])
    high = np.array([port.highest for port in bench.ports])
    first, last = low, high
    while True:
        axes = [np.unique(np.linspace(a, b, 257).round().astype(np.int64)) for a, b in zip(first, last, strict=True)]
        grid = np.meshgrid(*axes, indexing="ij")
        values = sign * polynomial(*(port.decode(codes) for port, codes in zip(bench.ports, grid, strict=True)))
        best = int(np.argmin(values))
        codes = np.array([axis.flat[best] for axis in grid])
        step = np.array([np.diff(axis).max(initial=1) for axis in axes])
        if np.all(step == 1):
            return codes
        first, last = np.maximum(codes - step, low), np.minimum(codes + step, high)


# Plain filters: signals over the input's whole range.


def _scaled(run: _Run, signal: Values) -> Codes:
    """Codes of a signal in -1..1, which stand for the ends of the input's range."""
    port = run.bench.ports[0]
    middle, half = (port.highest + port.lowest) / 2, (port.highest - port.lowest) / 2
    return np.rint(middle + half * signal).astype(np.int64)[:, np.newaxis]


def _step(run: _Run) -> _Signal:
    steps = _plateaus(run, STEP_LEVELS, _step_heights(run.bench))
    codes = _scaled(run, steps.values)
    return _Signal(codes, run.bench.ports[0].decode(codes[:, 0]), steps.reading)


def _step_heights(bench: Bench) -> tuple[float, ...]:
    """Levels of the step scenario in the input's unit."""
    port = bench.ports[0]
    middle, half = (port.highest + port.lowest) / 2, (port.highest - port.lowest) / 2
    return tuple(float(port.zero) + float(port.lsb) * (middle + half * level) for level in STEP_LEVELS)


def _step_samples(bench: Bench) -> int:
    return _stepped_samples(_step_heights(bench))(bench)


def _sweep(run: _Run) -> _Signal:
    cycles = SWEEP_END / 2 * np.arange(run.samples) * run.progress
    return _Signal(_scaled(run, SWEEP_AMPLITUDE * np.sin(2 * np.pi * cycles)))


def _noise(run: _Run) -> _Signal:
    port = run.bench.ports[0]
    return _Signal(run.rng.integers(port.lowest, port.highest, (run.samples, 1), dtype=np.int64, endpoint=True))


SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (
        Scenario(
            "bench_43_50",
            "clearance in steps of 1 mm from 1 to 10 mm, 43 to 50 degC (the paper's table 1)",
            ("instrument",),
            _stepped_samples(TABLE_1_STEPS),
            _bench_run(TABLE_1_STEPS, (43.0, 50.0)),
        ),
        Scenario(
            "bench_92_96",
            "clearance in steps of 0.5 or 1 mm from 1 to 10 mm, 92 to 96 degC (the paper's table 2)",
            ("instrument",),
            _stepped_samples(TABLE_2_STEPS),
            _bench_run(TABLE_2_STEPS, (92.0, 96.0)),
        ),
        Scenario(
            "temperature_ramp",
            "20 to 98 degC at a clearance of 5 mm",
            ("instrument",),
            _settlings(10, RAMP_CLEARANCE),
            _temperature_ramp,
        ),
        Scenario(
            "wear_ramp",
            "wear from 2 to 9 mm under vehicle motion at 1.2, 2 and 8 Hz and broadband vibration",
            ("instrument",),
            _settlings(60, WEAR_CLEARANCE[1]),
            _wear_ramp,
        ),
        Scenario(
            "worst_case",
            "extreme codes in the sign pattern that drives the filter's output furthest",
            ("instrument", "filter"),
            lambda bench: _worst_cases_samples([bench.impulse_response]),
            lambda run: _worst_cases(run, [run.bench.impulse_response]),
        ),
        Scenario(
            "worst_case_errors",
            "the same for the way of every rounding error through the filter to the output, one after another",
            ("instrument", "filter"),
            lambda bench: _worst_cases_samples(_all_responses(bench)),
            lambda run: _worst_cases(run, _all_responses(run.bench)),
        ),
        Scenario(
            "step",
            "steps of up to half the range around its middle",
            ("filter",),
            _step_samples,
            _step,
        ),
        Scenario(
            "sweep",
            "sine of 90 % of full scale from zero to 0.49 of the sample rate",
            ("filter",),
            lambda _bench: 4 * LEAST_SAMPLES,
            _sweep,
        ),
        Scenario(
            "noise",
            "white noise, uniform over all codes",
            ("filter",),
            lambda _bench: 4 * LEAST_SAMPLES,
            _noise,
        ),
    )
}
"""Every scenario by name, in the order in which they are listed to the user."""
