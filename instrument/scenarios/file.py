"""Scenario files: days of operation described in TOML, and the traces generated from them.

The format is defined in `sosmith.instrument.scenarios.schema`. A trace is the concatenation of all excerpts; its true
value is the clearance without vehicle motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sosmith.gen.stimuli.plateaus import READING_PART, plateau_samples
from sosmith.gen.stimuli.run import Bench
from sosmith.instrument.scenarios.catalogue import LIMIT_SAMPLES
from sosmith.instrument.scenarios.schema import DigitizerTable, ExcerptTable, FaultTable, ScenarioDocument, WearTable
from sosmith.instrument.sensors.digitizer import CodeFault, Digitizer
from sosmith.instrument.sensors.inductive_sensor import (
    FORWARD_MODELS,
    Ageing,
    InductiveSensor,
    Mains,
    SystematicError,
)
from sosmith.instrument.sensors.instrument import SensorFaults, Sensors
from sosmith.instrument.sensors.thermometer import ThermocoupleChain
from sosmith.model.arithmetic.elementary import exp
from sosmith.model.arithmetic.random_streams import Streams, streams
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.tables.csv_table import check_rows, read_csv_table
from sosmith.model.tables.toml_tables import read_tables
from sosmith.model.traces.trace import Trace

VEHICLE = "vehicle"
"""Value of `motion_from` that selects the motion of the vehicle model."""

TRACKS = {"tangent": "tangent", "braking": "tangent", "curve": "paper"}
"""Track for each operation of a moving vehicle: straight, or the paper's curve."""

MIN_STEADY = 200
"""Lowest number of samples for reading in an excerpt without a given duration."""

_SENSORS = ("inductive", "thermocouple")
"""Names of the sensors in fault tables, in the order of the core's inputs."""


class VehicleMotion(Protocol):
    """Motion of the vehicle at the sensor."""

    def __call__(self, track: str, time: Values, seed: int) -> Values:
        """Return the change of the clearance in mm at `time` in s, shape (n,), on `track`, a value of `TRACKS`."""
        ...


@dataclass(frozen=True, kw_only=True)
class ScenarioFile:
    """A scenario read from a file.

    Attributes
    ----------
    path : Path
        The file; the trace is named after it, without the extension.
    document : ScenarioDocument
        Its content.
    sensors : Sensors
        The sensors that it describes.
    """

    path: Path
    document: ScenarioDocument
    sensors: Sensors

    def clearance(self, day: float, channel: int = 0) -> float:
        """Return the true clearance in mm on `day`: the initial clearance plus wear.

        Raises
        ------
        SpecificationError
            If the file does not describe the wear of this channel.
        """
        document = self.document
        tables = document.channel or (() if document.wear is None else (document.wear,) * (channel + 1))
        if channel >= len(tables):
            raise self.refuse(f"channel must have a table for each channel of the core, not only {len(tables)}")
        return tables[channel].initial_clearance + wear_on(tables[channel], day)

    def refuse(self, what: str) -> SpecificationError:
        """Return an error about this file; `what` is the sentence after the file's name."""
        return SpecificationError(f"{self.path}: {what}")


def load_scenario(path: Path) -> ScenarioFile:
    """Read and check a scenario file.

    Raises
    ------
    SpecificationError
        For the first error, in one sentence: the file, the path of the key, what was expected and what was found.
    """
    document = read_tables(path, ScenarioDocument)
    return ScenarioFile(path=path, document=document, sensors=_sensors(document))


def wear_on(table: WearTable, day: float) -> float:
    """Return the wear in mm on `day`; interpolated linearly between breakpoints and constant beyond them."""
    if table.rate is not None:
        return table.rate * day
    if table.rate_per_1000_km is not None and table.km_per_day is not None:
        return table.rate_per_1000_km * table.km_per_day / 1000 * day
    days, wear = zip(*(table.history or ()), strict=True)
    return float(np.interp(day, days, wear))


def emulate_file(
    scenario: ScenarioFile, bench: Bench, *, seed: int, channel: int = 0, vehicle: VehicleMotion | None = None
) -> Trace:
    """Generate the trace of a scenario file for one channel of a core.

    Readings are marked where the filter has settled after the beginning of the excerpt and after each fault. For
    clearances in steps, they are in the last part of each step (`sosmith.gen.stimuli.plateaus.READING_PART`).

    Parameters
    ----------
    scenario : ScenarioFile
    bench : Bench
        The core.
    seed : int
        Seed of all randomness, 0 or more. Equal seeds give equal traces.
    channel : int, optional
        Channel whose wear is used.
    vehicle : VehicleMotion, optional
        Vehicle model, for excerpts with ``motion_from = "vehicle"``.

    Raises
    ------
    SpecificationError
        If the core is not an instrument, the seed is negative, an excerpt is too short for the filter to settle, a
        fault lies outside its excerpt, a motion file is invalid, or the trace is longer than `LIMIT_SAMPLES`.
    """
    if bench.kind != "instrument":
        raise scenario.refuse("the core must be an instrument with a voltage input, not a plain filter")
    if seed < 0:
        raise SpecificationError(f"seed must be 0 or more, not {seed}")
    document = scenario.document
    plans = [_plan(scenario, bench, k, channel) for k in range(len(document.excerpt))]
    if sum(plan.samples for plan in plans) > LIMIT_SAMPLES:
        seconds = sum(plan.samples for plan in plans) / float(bench.sample_rate)
        most = LIMIT_SAMPLES / float(bench.sample_rate)
        raise scenario.refuse(
            f"all excerpts together must last at most {most:.6g} s, {LIMIT_SAMPLES} samples, not {seconds:.6g}"
        )
    parts = [_part(scenario, bench, plan, seed, vehicle) for plan in plans]
    reading = np.concatenate([part.reading for part in parts])
    if not reading.any():
        least = min(plan.settling for plan in plans) / float(bench.sample_rate)
        raise scenario.refuse(
            "one excerpt or more must last longer without a fault than the filter takes to settle, "
            f"{least:.6g} s or more, not none"
        )
    return Trace(
        name=scenario.path.stem,
        ports=bench.ports,
        sample_rate=bench.sample_rate,
        codes=np.concatenate([part.codes for part in parts]),
        truth=np.concatenate([part.truth for part in parts]),
        reading=reading,
        seed=seed,
    )


def range_notes(scenario: ScenarioFile, ports: Sequence[Port]) -> tuple[str, ...]:
    """Return a sentence for each temperature and stuck code in the file that is outside the range of a core's input."""
    notes = []
    for k, excerpt in enumerate(scenario.document.excerpt):
        where = f"{scenario.path}: excerpt[{k}]"
        notes += [f"{where} {text}" for port in ports[1:] for text in _temperature_notes(excerpt, port)]
        for number, fault in enumerate(excerpt.fault):
            port = dict(zip(_SENSORS, ports, strict=False)).get(fault.sensor)
            if port is not None and fault.code is not None and not port.lowest <= fault.code <= port.highest:
                end = port.lowest if fault.code < port.lowest else port.highest
                notes.append(
                    f"{where}.fault[{number}] is stuck at code {fault.code}, but the codes of {port.name} are "
                    f"{port.lowest}..{port.highest}: it is stuck at {end} instead"
                )
    return tuple(notes)


def _temperature_notes(excerpt: ExcerptTable, port: Port) -> Iterator[str]:
    low, high = (float(port.zero + port.lsb * code) for code in (port.lowest, port.highest + 1))
    ends = [excerpt.temperature, excerpt.temperature if excerpt.temperature_to is None else excerpt.temperature_to]
    if min(ends) < low or max(ends) > high:
        reached = max(ends) if max(ends) > high else min(ends)
        yield (
            f"reaches {reached:g} degC, but the range of the core's temperature input ends at "
            f"{high if reached > high else low:g} degC: its code saturates there, and the clearance is calibrated "
            "for the wrong temperature; widen the range in [input.temperature]"
        )


@dataclass(frozen=True, eq=False)
class _Plan:
    """One excerpt: index in the file, true clearance, mask of readings, samples until the filter settles."""

    index: int
    excerpt: ExcerptTable
    truth: Values
    reading: npt.NDArray[np.bool_]
    settling: int

    @property
    def samples(self) -> int:
        return len(self.truth)


@dataclass(frozen=True, eq=False)
class _Part:
    codes: npt.NDArray[np.int64]
    truth: Values
    reading: npt.NDArray[np.bool_]


def _plan(scenario: ScenarioFile, bench: Bench, index: int, channel: int) -> _Plan:
    excerpt = scenario.document.excerpt[index]
    rate = float(bench.sample_rate)
    levels = excerpt.clearances
    if levels is None:
        levels = (scenario.clearance(excerpt.day, channel),)
    step = max(levels) + sum(amplitude for _, amplitude in excerpt.motion)
    settling = bench.settling(step)
    least = plateau_samples(bench, levels) * len(levels) if len(levels) > 1 else 2 * settling + MIN_STEADY
    samples = least if excerpt.seconds is None else math.floor(excerpt.seconds * rate + 0.5)
    if not 1 <= samples <= LIMIT_SAMPLES:
        raise scenario.refuse(
            f"excerpt[{index}].seconds must be from {1 / rate:.6g} to {LIMIT_SAMPLES / rate:.6g}, one sample to "
            f"{LIMIT_SAMPLES} of them, not {excerpt.seconds or samples / rate:g}"
        )
    position = np.arange(samples)
    if len(levels) == 1:
        return _Plan(index, excerpt, np.full(samples, levels[0]), position >= settling, settling)
    if samples < least:
        raise scenario.refuse(
            f"excerpt[{index}].seconds must be at least {least / rate:.6g} (the filter has to settle on "
            f"{len(levels)} clearances), not {samples / rate:.6g}"
        )
    length = samples // len(levels)
    plateau = np.minimum(position // length, len(levels) - 1)
    within = position - plateau * length
    last = within >= math.floor(length * (1 - READING_PART))
    return _Plan(index, excerpt, np.array(levels)[plateau], last & (within < length), settling)


def _part(scenario: ScenarioFile, bench: Bench, plan: _Plan, seed: int, vehicle: VehicleMotion | None) -> _Part:
    chance = streams(seed, f"excerpt {plan.index}")
    time = np.arange(plan.samples) / float(bench.sample_rate)
    faults = _faults(scenario, bench, plan)
    codes = scenario.sensors.codes(
        plan.truth + _motion(scenario, plan, time, seed, chance, vehicle),
        temperature_profile(plan.excerpt, time),
        time,
        bench.ports,
        chance,
        state=scenario.sensors.inductive.state(plan.excerpt.day, streams(seed, "life of the sensor")),
        faults=faults,
    )
    faulty = faults.marks(plan.samples)
    # A fault can leave an error as large as the whole output range in the filter.
    span = float(bench.output.lsb) * (bench.output.highest - bench.output.lowest)
    last_fault = np.maximum.accumulate(np.where(faulty, np.arange(plan.samples), -LIMIT_SAMPLES))
    recovered = np.arange(plan.samples) - last_fault > bench.settling(span)
    return _Part(codes, plan.truth, plan.reading & recovered)


def temperature_profile(excerpt: ExcerptTable, time: Values) -> Values:
    """Return the temperature in degC at `time` in s since the beginning of the excerpt, shape (n,).

    With a time constant it approaches `temperature_to` exponentially, like a body heated by constant power; without one
    it reaches `temperature_to` linearly at the last sample.
    """
    first, last = excerpt.temperature, excerpt.temperature_to
    if last is None:
        return np.full(len(time), first)
    if excerpt.time_constant is not None:
        return np.asarray(last + (first - last) * exp(-time / excerpt.time_constant))
    return np.asarray(first + (last - first) * time / max(time[-1], 1e-300))


def _motion(
    scenario: ScenarioFile,
    plan: _Plan,
    time: Values,
    seed: int,
    chance: Streams,
    vehicle: VehicleMotion | None,
) -> Values:
    excerpt = plan.excerpt
    motion = chance("vibration").normal(0.0, excerpt.vibration, len(time))
    phases = chance("motion").uniform(0, 2 * np.pi, len(excerpt.motion))
    for (frequency, amplitude), phase in zip(excerpt.motion, phases, strict=True):
        motion += amplitude * np.sin(2 * np.pi * frequency * time + phase)
    if excerpt.motion_from is None:
        return motion
    if excerpt.motion_from == VEHICLE:
        if vehicle is None:
            raise scenario.refuse(f"excerpt[{plan.index}].motion_from must be a file here, not the vehicle model")
        return motion + vehicle(TRACKS[excerpt.operation], time, seed)
    table = read_csv_table(
        scenario.path.parent / excerpt.motion_from, ("time_s", "clearance_mm"), ("time_s", "clearance_mm")
    )
    clock = table.column("time_s")
    check_rows(
        table,
        np.concatenate([[False], np.diff(clock) <= 0]),
        lambda k: f"time_s must be above the {clock[k - 1]:g} s of the previous row, not {clock[k]:g} s",
    )
    if clock[0] > 0 or clock[-1] < time[-1]:
        raise SpecificationError(
            f"{table.path}: time_s must extend from 0 to the {time[-1]:.6g} s of excerpt[{plan.index}], "
            f"not from {clock[0]:.6g} to {clock[-1]:.6g}"
        )
    return motion + np.interp(time, clock, table.column("clearance_mm"))


def _faults(scenario: ScenarioFile, bench: Bench, plan: _Plan) -> SensorFaults:
    rate = float(bench.sample_rate)
    by_sensor: dict[str, list[CodeFault]] = {sensor: [] for sensor in _SENSORS}
    disconnected = []
    for k, fault in enumerate(plan.excerpt.fault):
        start, stop = (math.floor(at * rate + 0.5) for at in (fault.start, fault.start + fault.seconds))
        if not start < stop or start >= plan.samples:
            raise scenario.refuse(
                f"excerpt[{plan.index}].fault[{k}] must cover a sample of the excerpt's {plan.samples / rate:.6g} s, "
                f"not from {fault.start:g} to {fault.start + fault.seconds:g} s"
            )
        if fault.kind == "open":
            disconnected.append(slice(start, stop))
        else:
            by_sensor[fault.sensor].append(_code_fault(fault, start, stop))
    return SensorFaults(
        voltage=tuple(by_sensor[_SENSORS[0]]),
        temperature=tuple(by_sensor[_SENSORS[1]]),
        open_thermocouple=tuple(disconnected),
    )


def _code_fault(fault: FaultTable, start: int, stop: int) -> CodeFault:
    return CodeFault(start=start, stop=stop, share=1.0 if fault.share is None else fault.share, code=fault.code)


def _sensors(document: ScenarioDocument) -> Sensors:
    inductive, thermocouple = document.sensors.inductive, document.sensors.thermocouple
    converter = thermocouple.digitizer
    range_mv = Fraction(repr(converter.range))
    return Sensors(
        inductive=InductiveSensor(
            model=FORWARD_MODELS[inductive.model],
            noise=inductive.noise,
            mains=Mains(**inductive.mains.model_dump()),
            ageing=Ageing(**inductive.ageing.model_dump()),
            systematic_error=SystematicError(**inductive.systematic_error.model_dump()),
            output_range=inductive.output_range,
        ),
        thermometer=ThermocoupleChain(
            noise=thermocouple.noise,
            cold_junction=thermocouple.cold_junction,
            cold_junction_error=thermocouple.cold_junction_error,
            port=Port.from_range("emf", converter.bits, -range_mv, range_mv, signed=True, unit="mV"),
            digitizer=_digitizer(converter),
        ),
        voltage_digitizer=_digitizer(inductive.digitizer),
    )


def _digitizer(table: DigitizerTable) -> Digitizer:
    return Digitizer(offset=table.offset, gain_error=table.gain_error, inl=table.inl)
