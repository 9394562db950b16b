"""WAV files: codes pass unchanged where the file has their width, are rounded where not, and what is refused."""

from __future__ import annotations

import io
import struct
import wave
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.traces import wav_file
from sosmith.model.traces.formats import read_trace_file, write_trace_file
from sosmith.model.traces.trace import Trace
from sosmith.model.traces.wav_file import check_rate, read_wav, wav_bytes

RATE = Fraction(48000)


def port(bits: int = 16, *, signed: bool = True, low: int = -1) -> Port:
    return Port.from_range("x", bits, Fraction(low), Fraction(1), signed=signed)


def chunk(name: bytes, data: bytes, size: int | None = None) -> bytes:
    return name + struct.pack("<I", len(data) if size is None else size) + data + bytes(len(data) % 2)


def fmt(
    tag: int = 1, channels: int = 1, rate: int = 48000, *, block: int | None = None, bits: int = 16, more: bytes = b""
) -> bytes:
    size = channels * bits // 8 if block is None else block
    return chunk(b"fmt ", struct.pack("<HHIIHH", tag, channels, rate, rate * size, size, bits) + more)


def riff(*chunks: bytes) -> bytes:
    body = b"WAVE" + b"".join(chunks)
    return b"RIFF" + struct.pack("<I", len(body)) + body


def given(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "song.wav"
    path.write_bytes(content)
    return path


def refused(tmp_path: Path, content: bytes, channels: int = 1, ports: tuple[Port, ...] = (port(),)) -> str:
    path = given(tmp_path, content)
    with pytest.raises(SpecificationError) as told:
        read_wav(path, ports, RATE, channels)
    return str(told.value).removeprefix(str(path))


@pytest.mark.parametrize("bits", [2, 12, 16, 17, 24, 25, 32])
@pytest.mark.parametrize("signed", [True, False])
def test_codes_come_back_as_they_were(bits: int, signed: bool, tmp_path: Path) -> None:
    x = port(bits, signed=signed)
    codes = np.random.default_rng(1).integers(x.lowest, x.highest, (50, 2), endpoint=True)
    codes[0], codes[1] = x.lowest, x.highest
    content = wav_bytes(codes, x, RATE)
    with wave.open(io.BytesIO(content)) as sound:  # another reader
        assert sound.getparams()[:4] == (2, {2: 2, 12: 2, 16: 2, 17: 3, 24: 3, 25: 4, 32: 4}[bits], 48000, 50)
    first, second = read_wav(given(tmp_path, content), (x,), RATE, 2)
    np.testing.assert_array_equal(np.stack([first.codes[:, 0], second.codes[:, 0]], axis=1), codes)
    assert (first.name, first.limited, first.sample_rate) == ("song", (0,), RATE)


def test_other_widths_and_floats_are_scaled_to_the_range_and_rounded_as_by_a_converter(tmp_path: Path) -> None:
    def codes(samples: np.ndarray, x: Port) -> tuple[list[int], tuple[int, ...]]:
        file = io.BytesIO()
        wavfile.write(file, 48000, samples)
        (trace,) = read_wav(given(tmp_path, file.getvalue()), (x,), RATE)
        return trace.codes[:, 0].tolist(), trace.limited

    eight = port(8)
    assert codes(np.array([-32768, -128, -127, 0, 127, 128, 32767], np.int16), eight) == (
        [-128, 0, 0, 0, 0, 1, 127],
        (0,),
    )
    assert codes(np.array([0, 128, 255], np.uint8), port(16)) == ([-32768, 0, 32512], (0,))
    assert codes(np.array([-(2**31), 2**30], np.int32), port(16, signed=False, low=0)) == ([0, 49152], (0,))
    for kind in (np.float32, np.float64):
        assert codes(np.array([-1, 0.5, 1, 1.5, -3e38], kind), eight) == ([-128, 64, 127, 127, -128], (2,))


def test_the_header_that_other_programs_write_for_24_bits_and_many_channels_is_read(tmp_path: Path) -> None:
    guid = b"\x00\x00\x00\x00\x10\x00\x80\x00\x00\xaa\x00\x38\x9b\x71"
    more = struct.pack("<HHI", 22, 20, 4) + struct.pack("<H", 1) + guid
    content = riff(
        chunk(b"JUNK", bytes(5)), fmt(0xFFFE, bits=24, more=more), chunk(b"data", b"\x00\x00\x40"), chunk(b"LIST", b"x")
    )
    (trace,) = read_wav(given(tmp_path, content), (port(24),), RATE)
    assert trace.codes.tolist() == [[1 << 22]]


def test_what_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = chunk(b"data", bytes(8))
    assert refused(tmp_path, b"ID3\x04") == " must be a WAV file, not one that starts with b'ID3\\x04'"
    assert refused(tmp_path, riff(fmt())) == " must be a whole WAV file, not end before its samples"
    assert refused(tmp_path, riff(fmt(), chunk(b"data", bytes(8), 4_000_000_000))) == (
        " must be a whole WAV file, not end 3,999,999,992 bytes before what its header announces"
    )
    assert refused(tmp_path, riff(data, fmt())) == " must tell the format of its samples before them, not behind"
    assert refused(tmp_path, riff(fmt(6), data)) == ": the samples must be PCM or floats, not A-law"
    assert refused(tmp_path, riff(fmt(0x1234), data)) == (
        ": the samples must be PCM or floats, not of the format 0x1234"
    )
    shape = ": the samples must be PCM of 8, 16, 24 or 32 bits or floats of 32 or 64 bits, not "
    assert refused(tmp_path, riff(fmt(channels=0), data)) == f"{shape}16 bits in 0 bytes for 0 channels"
    assert refused(tmp_path, riff(fmt(bits=64), data)) == f"{shape}64 bits in 8 bytes for 1 channels"
    assert refused(tmp_path, riff(fmt(block=3, bits=16), data)) == f"{shape}16 bits in 3 bytes for 1 channels"
    assert refused(tmp_path, riff(fmt(3, bits=16), data)) == f"{shape}16 bits in 2 bytes for 1 channels"
    whole = ": the data must be whole samples of 6 bytes, at least one, not "
    assert refused(tmp_path, riff(fmt(channels=3), data), 3) == f"{whole}8 bytes"
    assert refused(tmp_path, riff(fmt(channels=3), chunk(b"data", b"")), 3) == f"{whole}0 bytes"
    nan = struct.pack("<2f", 0, float("nan"))
    assert refused(tmp_path, riff(fmt(3, bits=32), chunk(b"data", nan))) == ": sample 1 must be finite, not nan"
    monkeypatch.setattr(wav_file, "MAX_SAMPLES", 3)
    assert refused(tmp_path, riff(fmt(), data)) == " must have at most 3 samples over all channels, not 4"
    monkeypatch.setattr(wav_file, "_MAX_CHUNKS", 2)
    many = riff(*[chunk(b"LIST", b"")] * 2, fmt(), data)
    assert refused(tmp_path, many) == " must have its samples within 2 chunks, not behind more"
    monkeypatch.setattr(wav_file, "MAX_BYTES", 20)
    assert refused(tmp_path, many) == ": the WAV file must be at most 20 bytes, not longer"


def test_what_does_not_fit_the_specification_is_told_with_its_cure(tmp_path: Path) -> None:
    stereo = wav_bytes(np.zeros((4, 2), np.int64), port(), Fraction(44100))
    assert refused(tmp_path, stereo) == (
        ": the sample rate must be the 48000 Hz of the specification, not 44100 Hz; state sample_rate = 44100 there, "
        "or resample the file, as by: sox song.wav -r 48000 song_48000.wav"
    )
    stereo = wav_bytes(np.zeros((4, 2), np.int64), port(), RATE)
    assert refused(tmp_path, stereo, channels=3) == (
        ": the channels must be the 3 of the design, or one that drives all, not 2; state channels = 2 in the "
        "specification, or keep one of the file, as by: sox song.wav song_1.wav remix 1"
    )
    two = (port(), Port.from_range("temperature", 8, Fraction(0), Fraction(1)))
    assert refused(tmp_path, stereo, ports=two) == (
        ": a WAV file must be for one input, not x and temperature; a CSV file has both"
    )
    with pytest.raises(SpecificationError, match=r"^a.wav: the sample rate of a WAV file must be a whole number of Hz"):
        check_rate(Path("a.wav"), Fraction(48000, 7))
    flac = "song.flac: sound must be a WAV file, not .flac; convert it, as by: ffmpeg -i song.flac song.wav"
    with pytest.raises(SpecificationError) as told:
        read_trace_file(Path("song.flac"), (port(),), RATE)
    assert str(told.value) == flac


def test_a_file_by_its_name_and_one_channel_for_all(tmp_path: Path) -> None:
    codes = np.arange(5)[:, np.newaxis]
    trace = Trace(name="t", ports=(port(),), sample_rate=RATE, codes=codes)
    for name in ("a.wav", "a.WAV", "a.csv"):
        write_trace_file(tmp_path / name, [trace])
        first, second = read_trace_file(tmp_path / name, (port(),), RATE, 2)
        assert (first.codes[:, 0].tolist(), second.codes[:, 0].tolist()) == ([0, 1, 2, 3, 4], [0, 0, 1, 2, 3])
    assert (tmp_path / "a.WAV").read_bytes()[:4] == b"RIFF"
