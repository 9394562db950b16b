# amaranth: UnusedElaboratable=no
"""Front-ends with converters at their pins: codes, faults, the last good value, times; and some that are broken."""

import json
import random
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from amaranth.hdl import Const, Signal, Value
from tests.sim.converters.bench_run import found_by

from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.converters.front_end import FrontEnd, _Scan
from sosmith.model.converters.reading import Reading
from sosmith.model.converters.schedule import Schedule
from sosmith.model.converters.spi_converter import CONVERTERS, ReadingFault
from sosmith.model.dataflow.status import Flag
from sosmith.model.port import Port
from sosmith.sim.converters.cocotb_bus import thermocouple_frame

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
SIGNED = Port.from_range("x", 12, Fraction(-1), Fraction(1), signed=True)
TEMPERATURE = Port.from_range("temperature", 14, Fraction(0), Fraction(128), unit="degC")


@dataclass(frozen=True)
class Case:
    """A front-end: clock and sample rate in Hz, channels, inputs; `scale` of the thermocouple converter's times."""

    clock: int
    rate: int
    channels: int
    readings: tuple[tuple[str, Reading], ...]
    samples: int
    scale: Fraction = Fraction(1)

    @property
    def schedule(self) -> Schedule:
        timings = (reading.converter.timing for _, reading in self.readings)
        scaled = tuple(
            replace(each, conversion=each.conversion * self.scale, power_up=each.power_up * self.scale)
            for each in timings
        )
        return Schedule.of(
            tuple(reading for _, reading in self.readings),
            scaled,
            channels=self.channels,
            clock=Fraction(self.clock),
            sample_rate=Fraction(self.rate),
            latency=10,
        )


def case(clock: int, rate: int, channels: int, samples: int, scale: Fraction = Fraction(1), **devices: Port) -> Case:
    span = (Fraction(-1), Fraction(1))
    spans = {"mcp3202": (Fraction(0), Fraction(10)), "mcp3204": span, "ad7476a": span, "max31855": None}
    readings = tuple((name, Reading.of(CONVERTERS[name], port, spans[name])) for name, port in devices.items())
    return Case(clock, rate, channels, readings, samples, scale)


CASES = {
    # The slowest SPI, two converters of two inputs, one for each thermocouple.
    "instrument": case(100_000, 100, 3, 40, mcp3202=VOLTAGE, max31855=TEMPERATURE),
    # As fast as an MCP3204 allows, at almost the highest sample rate, of which the clock is no multiple.
    "adc": case(12_000_000, 11_400, 4, 8, mcp3204=SIGNED),
    # 250,000 samples a second.
    "fast": case(25_000_000, 250_000, 1, 20, ad7476a=SIGNED),
    # As fast as a MAX31855 allows, which converts faster here.
    "thermocouple": case(50_000_000, 10_000, 2, 30, Fraction(1, 500), max31855=TEMPERATURE),
}


def values(job: Case, number: int, channel: int, seed: int) -> list[int]:
    """Return what an input's converter gives at each of its conversions; some thermocouples are broken at times."""
    name, _ = job.readings[number]
    chance = random.Random(f"{seed} {number} {channel}")
    count = -(-job.samples // job.schedule.intervals[number]) + 1
    if name != "max31855":
        return [chance.choice([0, 4095, chance.randrange(4096)]) for _ in range(count)]
    broken: list[dict[str, Any]] = [{}, {}, {"opened": True}, {"ground": True}, {"supply": True}]
    frames = [
        thermocouple_frame(chance.randrange(512), cold=chance.randrange(-800, 2000), **chance.choice(broken))
        for _ in range(count)
    ]
    special = [
        thermocouple_frame(-1),
        thermocouple_frame(512),
        thermocouple_frame(511),
        1 << 16,
        1 << 17,
        1 << 3,
        (1 << 32) - 1,
    ]
    return [chance.choice(special) if chance.random() < 0.4 else frame for frame in frames]


def run(folder: Path, job: Case, given: list[list[list[int]]]) -> dict[str, Any]:
    """Simulate; `given` is what the converters give, by input and channel."""
    folder.mkdir()
    text = to_verilog(to_rtlil(FrontEnd(job.schedule, result_bytes=2), "front_end"))
    # Icarus takes a function whose name begins with a dollar sign for one of the system.
    (folder / "front_end.sv").write_text(re.sub(r"\\\$procmux\$(\d+) ", r"procmux_\1 ", text))
    readings = [
        {"device": name, "scale": str(job.scale), "values": each}
        for (name, _), each in zip(job.readings, given, strict=True)
    ]
    (folder / "job.json").write_text(
        json.dumps({"clock": job.clock, "readings": readings, "results": job.samples * job.channels})
    )
    return found_by("front_end_bench", folder)


def expected(job: Case, given: list[list[list[int]]]) -> tuple[list[list[int]], list[bool], list[int]]:
    """Return the samples, whether each has a held code, and the faults of the last readings."""
    codes, held = {}, {}
    for number, (_, reading) in enumerate(job.readings):
        for channel, frames in enumerate(given[number]):
            each, faulty = reading.held(frames)
            repeats = job.schedule.intervals[number]
            codes[number, channel] = [code for code in each for _ in range(repeats)]
            held[number, channel] = [bad for bad in faulty for _ in range(repeats)]
    samples, flags = [], []
    inputs = range(len(job.readings))
    for n in range(job.samples):
        for channel in range(job.channels):
            word, place = 0, 0
            for number in inputs:
                bits = 8 * job.readings[number][1].port.bytes
                word |= (codes[number, channel][n] & (1 << bits) - 1) << place
                place += bits
            samples.append([channel, word])
            flags.append(any(held[number, channel][n] for number in inputs))
    last = [(job.samples - 1) // job.schedule.intervals[number] for number in inputs]
    faults = [
        sum(1 << fault for fault in job.readings[number][1].code(given[number][channel][last[number]])[1])
        for channel in range(job.channels)
        for number in inputs
    ]
    return samples, flags, faults


def check(folder: Path, job: Case, given: list[list[list[int]]]) -> None:
    found = run(folder, job, given)
    samples, held, faults = expected(job, given)
    assert found["samples"] == samples
    status = [(n + 1 & 1) | flag << Flag.FAULT for n, flag in enumerate(held)]
    assert found["results"] == [[n % job.channels, n | each << 16] for n, each in enumerate(status)]
    assert found["faults"] == faults


def conversions(job: Case, seed: int = 1) -> list[list[list[int]]]:
    return [[values(job, n, channel, seed) for channel in range(job.channels)] for n in range(len(job.readings))]


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_codes_and_flags_are_those_of_the_model(name: str, tmp_path: Path) -> None:
    check(tmp_path / "run", CASES[name], conversions(CASES[name]))


def test_what_the_model_makes_of_a_frame() -> None:
    reading = Reading.of(CONVERTERS["max31855"], TEMPERATURE)
    assert (reading.offset, reading.gain) == (0, 32)
    good = thermocouple_frame(100 * 4 + 1)
    assert reading.code(good) == (401 * 32, ())
    assert reading.code(good | 1 << 16 | 1) == (None, (ReadingFault.OPEN,))
    assert reading.code(thermocouple_frame(400, ground=True)) == (None, (ReadingFault.SHORT_TO_GROUND,))
    assert reading.code(thermocouple_frame(400, supply=True)) == (None, (ReadingFault.SHORT_TO_SUPPLY,))
    assert reading.code(good | 1 << 16) == (None, (ReadingFault.FRAME,))
    assert reading.code(thermocouple_frame(-1)) == (None, (ReadingFault.RANGE,))
    assert reading.code(thermocouple_frame(512)) == (None, (ReadingFault.RANGE,))
    codes, held = reading.held([good | 1 << 3, good, thermocouple_frame(0, opened=True), good + (1 << 18)])
    assert codes == [0, 401 * 32, 401 * 32, 402 * 32]
    assert held == [True, False, True, False]


def without_faults(scan: Any, reading: Reading, frame: Value, code: Signal) -> Value:
    """Take every reading for a good one."""
    return Const(0, len(ReadingFault))


def with_wrong_bits(scan: Any, reading: Reading, frame: Value, code: Signal) -> Value:
    """Take a wrong null bit for a right one."""
    return FAULTS(scan, reading, frame, code) & ~(1 << ReadingFault.FRAME)


FAULTS = _Scan.faults


@pytest.mark.slow
@pytest.mark.parametrize("broken", [without_faults, with_wrong_bits])
def test_a_front_end_that_misses_faults_is_found(broken: Callable[..., Value], tmp_path: Path) -> None:
    job = CASES["thermocouple"]
    with patch.object(_Scan, "faults", broken), pytest.raises(AssertionError):
        check(tmp_path / "run", job, conversions(job))


def changed(name: str, **changes: Any) -> Case:
    """Return a case whose converters are others for the hardware than at its pins."""
    job = CASES[name]
    readings = tuple(
        (device, replace(reading, converter=replace(reading.converter, **changes))) for device, reading in job.readings
    )
    return replace(job, readings=readings)


@pytest.mark.parametrize(
    ("job", "changes", "expected"),
    [
        pytest.param(
            CASES["adc"],
            {"half": 5},
            r"SCK of the MCP3204 0 must have at most 1,000,000 Hz, not 1,[0-9]+,[0-9]+ Hz",
            id="too fast",
        ),
        pytest.param(
            CASES["adc"],
            {"deselect": 1},
            r"CS of the MCP3204 0 must be high for 500 ns, not for [0-9]+ ns",
            id="too soon again",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CASES["instrument"],
            {"intervals": (1, 10)},
            r"CS of the MAX31855 0 must be high to end a conversion for 100,000,000 ns, not for 9[0-9,]+ ns",
            id="during a conversion",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            CASES["thermocouple"],
            {"first": 2},
            r"the MAX31855 0 must be left alone behind power-up for 400,000 ns, not for 3[0-9]+,[0-9]+ ns",
            id="before the first conversion",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            changed("adc", command=0b10000),
            {},
            r"the MCP3204 0 must be asked for a single input, not for a difference",
            id="another command",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            changed("adc", bits=18),
            {},
            r"a frame of the MCP3204 0 must have 19 clocks, not 18",
            id="short frame",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_a_data_sheet_forbids_is_told(job: Case, changes: dict[str, Any], expected: str, tmp_path: Path) -> None:
    wrong = replace(job.schedule, **changes)
    job = replace(job, samples=12)
    with patch.object(Case, "schedule", wrong), pytest.raises(AssertionError, match=rf"^{expected}$"):
        run(tmp_path / "run", job, conversions(job))
