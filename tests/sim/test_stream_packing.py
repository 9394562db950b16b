"""Codes to beats and back, and a bench without any simulator behind the same protocol."""

import re
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from sosmith.gen.output.core_facts import InterfaceFacts, StreamFacts
from sosmith.hdl.plan.streams import fields
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port
from sosmith.sim.beats import Beats
from sosmith.sim.bench import BenchRun, Progress
from sosmith.sim.cosimulate import cosimulate
from sosmith.sim.stream_packing import each_once, pack, random_order, unpack


def port(name: str, bits: int, *, signed: bool) -> Port:
    return Port(name=name, bits=bits, signed=signed, lsb=Fraction(1), zero=Fraction(0))


PORTS = (port("voltage", 11, signed=True), port("temperature", 16, signed=False))
STREAM = StreamFacts(fields=fields(PORTS), dest_width=8)
INTERFACE = InterfaceFacts(name="copy", inputs=STREAM, outputs=STREAM, reset_cycles=0, latency_cycles=1)


@dataclass
class Copy:
    """A bench whose core hands its input on; `damage` changes what comes out."""

    damage: str = ""
    name: str = "copy"

    def run(self, sent: Beats, progress: Progress) -> BenchRun:
        progress(len(sent), len(sent))
        dest, data, user = sent.tdest.copy(), sent.tdata.copy(), np.arange(len(sent)).astype(np.uint64)
        if self.damage == "channel":
            dest[5] = 1 - dest[5]
        if self.damage == "extension":
            data[0] ^= np.uint64(1 << 15)
        if self.damage == "count":
            dest, data, user = dest[1:], data[1:], user[1:]
        return BenchRun(received=Beats(dest, data, user), cycles=len(sent), seconds=0.5, tools={"copy": "1"})


def codes(samples: int = 20, channels: int = 2) -> np.ndarray:
    rng = np.random.default_rng(3)
    drawn = [rng.integers(p.lowest, p.highest, (samples, channels), endpoint=True) for p in PORTS]
    for column, p in zip(drawn, PORTS, strict=True):
        column[0] = p.lowest
        column[1] = p.highest
    return np.stack(drawn, axis=2)


def test_fields_are_extended_to_whole_bytes() -> None:
    beats = pack(np.array([[[-2, 0xABCD]]]), np.array([0]), STREAM)
    assert beats.tdata.tolist() == [0xABCD_FFFE]


@pytest.mark.parametrize("channels", [1, 2, 5])
def test_what_is_packed_comes_back(channels: int) -> None:
    sent = codes(33, channels)
    order = random_order(33, channels, seed=4)
    assert sorted(order.tolist()) == sorted(list(range(channels)) * 33)
    found, status = unpack(pack(sent, order, STREAM), order, STREAM)
    assert (found == sent).all()
    assert not status.any()


def test_any_bench_will_do() -> None:
    result = cosimulate(Copy(), INTERFACE, codes(), seed=4)
    assert (result.codes == codes()).all()
    order = random_order(20, 2, seed=4)
    assert (result.status[:, 0] == np.flatnonzero(order == 0)).all()
    assert (result.cycles, result.cycles_per_second, result.simulator) == (40, 80.0, "copy")


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ("channel", r"m_axis_tdest must be (0, not 1|1, not 0), at output 5"),
        ("extension", r"voltage must be extended to whole bytes, not 0x\w+ at sample 0"),
        ("count", "40 samples must come out, not 39"),
    ],
)
def test_a_wrong_beat_is_found(damage: str, message: str) -> None:
    with pytest.raises(ShortfallError, match=f"^{message}$"):
        cosimulate(Copy(damage), INTERFACE, codes(), seed=4)


def test_a_sample_beyond_64_bits_is_refused() -> None:
    wide = replace(STREAM, fields=fields([port(f"x{k}", 32, signed=False) for k in range(3)]))
    with pytest.raises(ValueError, match=re.escape("samples must be at most 64 bits wide, not 96")):
        pack(np.zeros((1, 1, 3), dtype=np.int64), np.array([0]), wide)


@pytest.mark.parametrize("lanes", [2, 4, 16])
def test_samples_of_a_beat_lie_side_by_side(lanes: int, tmp_path: Path) -> None:
    stream = replace(STREAM, dest_width=0, lanes=lanes, flags={"fault": 6})
    sent = codes(samples=37, channels=1)
    order = np.zeros(len(sent), dtype=np.int64)
    beats = pack(sent, order, stream)
    assert len(beats) == -(-len(sent) // lanes)
    (one,) = pack(sent[1:2], order[:1], replace(stream, lanes=1)).numbers()[:1]
    assert beats.numbers()[0][1] >> stream.sample_width & 0xFFFF_FFFF == one[1]
    last = beats.numbers()[-1][1]
    assert (
        last >> stream.sample_width * (lanes - 1)
        == pack(sent[-1:], order[:1], replace(stream, lanes=1)).numbers()[0][1]
    )
    received = Beats.zeros(len(beats), stream.width, stream.user_width)
    for index, (dest, data, _) in enumerate(beats.numbers()):
        received.put(index, dest, data, sum((lanes * index + lane) % 256 << 8 * lane for lane in range(lanes)))
    received.save(tmp_path / "beats")
    found, status = unpack(Beats.load(tmp_path / "beats"), order, stream)
    assert found.tolist() == sent.tolist()
    assert status[:, 0].tolist() == list(range(len(sent)))


def test_a_missing_beat_of_several_samples_is_an_error() -> None:
    stream = replace(STREAM, dest_width=0, lanes=4)
    beats = pack(codes(channels=1), np.zeros(20, dtype=np.int64), stream)
    with pytest.raises(ShortfallError, match=r"^5 samples must come out, not 4$"):
        unpack(beats.first(4), np.zeros(20, dtype=np.int64), stream)


def test_copies_are_taken_once() -> None:
    beats = Beats(np.zeros(6, np.int64), np.repeat(np.array([7, 9], np.uint64), 3), np.zeros(6, np.uint64))
    assert each_once(beats, 3).tdata.tolist() == [7, 9]
    assert each_once(beats, 1) is beats
    with pytest.raises(ShortfallError, match=r"^each result must come out 4 times, not 6 beats in all$"):
        each_once(beats, 4)
    beats.tuser[4] = 1
    with pytest.raises(ShortfallError, match=r"^result 1 must come out 3 times, and changes meanwhile$"):
        each_once(beats, 3)
