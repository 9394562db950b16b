# amaranth: UnusedElaboratable=no
"""Front-ends with audio converters at their pins: words in and out bit for bit, times; and some that are broken."""

import json
import random
import re
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from amaranth.hdl import Module, Signal
from tests.sim.converters.bench_run import found_by

from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.converters.front_end import FrontEnd
from sosmith.hdl.converters.i2s_master import I2sMaster
from sosmith.model.converters.dac_writing import Writing
from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
from sosmith.model.converters.i2s_frame import LATENCY, I2sFrame
from sosmith.model.converters.reading import Reading
from sosmith.model.converters.schedule import Schedule
from sosmith.model.converters.spi_dac import SPI_DACS
from sosmith.model.port import Port

PORT = Port.from_range("x", 24, Fraction(-1), Fraction(1), signed=True)
NARROW = Port.from_range("x", 16, Fraction(-1), Fraction(1), signed=True)
COARSE = Port.from_range("x", 12, Fraction(-1), Fraction(1), signed=True)
FULL = (Fraction(-1), Fraction(1))
FRAMES = 6


@dataclass(frozen=True)
class Case:
    """A front-end: converters, clock and sample rate in Hz, channels, format of input and output."""

    adc: str
    dac: str
    clock: int
    rate: int
    channels: int
    port: Port = PORT

    @property
    def schedule(self) -> Schedule:
        adc = I2S_CONVERTERS[self.adc]
        dac = I2S_CONVERTERS.get(self.dac) or SPI_DACS[self.dac]
        return Schedule.of(
            (Reading.of(replace(adc, width=self.port.bits), self.port, FULL),),
            (None,),
            writing=Writing.of(dac, replace(self.port, name="y"), FULL),
            channels=self.channels,
            clock=Fraction(self.clock),
            sample_rate=Fraction(self.rate),
            latency=30,
        )


CASES = {
    "stereo": Case("pcm1808", "pcm5102a", 24_576_000, 48_000, 2),
    # Two lines in and out, the last with one channel; 16 of 24 bits; a board's clock, whose rate is 1.7 % above.
    "pmod": Case("cs5343", "cs4344", 25_000_000, 48_828, 3, NARROW),
    # A DAC for each channel, on an SPI.
    "mixed": Case("pcm1808", "mcp4921", 36_864_000, 48_000, 2, COARSE),
    # 384 periods of MCLK.
    "fast": Case("pcm1808", "cs4344", 73_728_000, 96_000, 1),
}


def words(job: Case) -> list[list[tuple[int, int]]]:
    chance = random.Random(f"{job}")
    top = 1 << 23
    ends = (-top, top - 1, -1, 0, 1)
    lines = -(-job.channels // 2)

    def pick() -> int:
        return chance.choice(ends) if chance.random() < 0.3 else chance.randrange(-top, top)

    return [[(pick(), pick()) for _ in range(FRAMES)] for _ in range(lines)]


def run(folder: Path, job: Case, given: list[list[tuple[int, int]]], schedule: Schedule | None = None) -> Any:
    """Simulate; `given` is what each ADC gives."""
    folder.mkdir()
    plan = schedule or job.schedule
    text = to_verilog(to_rtlil(FrontEnd(plan, result_bytes=job.port.bytes), "front_end"))
    # Icarus takes a function whose name begins with a dollar sign for one of the system.
    (folder / "front_end.sv").write_text(re.sub(r"\\\$procmux\$(\d+) ", r"procmux_\1 ", text))
    (folder / "job.json").write_text(
        json.dumps(
            {
                "clock": job.clock,
                "adcs": [job.adc] * len(given),
                "dacs": [job.dac] * (job.channels if job.dac in SPI_DACS else len(given)),
                "words": given,
                "frames": FRAMES + LATENCY,
            }
        )
    )
    return found_by("i2s_bench", folder)


def check(job: Case, given: list[list[tuple[int, int]]], found: Any) -> None:
    bits, channels = job.port.bits, job.channels
    codes = [[given[c // 2][n][c % 2] >> (24 - bits) for c in range(channels)] for n in range(FRAMES)]
    mask = (1 << 8 * job.port.bytes) - 1
    assert found["samples"][: FRAMES * channels] == [
        [c, codes[n][c] & mask] for n in range(FRAMES) for c in range(channels)
    ]
    writing = job.schedule.writing
    assert writing is not None
    for channel, written in enumerate(found["written"]):
        assert written[:FRAMES] == [writing.word(row[channel]) for row in codes]
    for line, heard in enumerate(found["heard"]):
        sides = [2 * line, min(2 * line + 1, channels - 1)]
        expected = [[writing.word(row[side]) for side in sides] for row in codes]
        assert heard == [[0, 0]] * LATENCY + expected


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", CASES)
def test_each_result_leaves_two_frames_behind_its_sample(name: str, tmp_path: Path) -> None:
    job = CASES[name]
    given = words(job)
    check(job, given, run(tmp_path / "run", job, given))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "frame", "expected"),
    [
        pytest.param(
            "stereo",
            I2sFrame(clocks=512, ratio=128),
            r"BCLK of the PCM1808 must be high for 244 ns, not for 163 ns",
            id="slow MCLK",
        ),
        pytest.param(
            "pmod",
            I2sFrame(clocks=1024, ratio=512),
            r"MCLK of the CS5343 must be one that it allows at 24,414 Hz, not 512 times that",
            id="MCLK of another rate",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_a_data_sheet_forbids_is_told(name: str, frame: I2sFrame, expected: str, tmp_path: Path) -> None:
    job = CASES[name]
    wrong = replace(job.schedule, frame=frame)
    with pytest.raises(AssertionError, match=rf"^{expected}$"):
        run(tmp_path / "run", job, words(job), wrong)


def one_bit_late(master: I2sMaster, m: Module, line: int, falls: Signal) -> None:
    """Send the words as the left-justified format has them."""
    late = Signal()
    m.d.sync += late.eq(master.bclk)
    SEND(master, m, line, late & ~master.bclk)


SEND = I2sMaster.send


@pytest.mark.slow
def test_data_behind_the_edge_is_found(tmp_path: Path) -> None:
    job = CASES["stereo"]
    with patch.object(I2sMaster, "send", one_bit_late):
        found = run(tmp_path / "run", job, words(job))
    with pytest.raises(AssertionError):
        check(job, words(job), found)
