"""WAV files: what goes into a core with one input, and what comes out, as sound.

The full scale of the file is that of the port: codes pass from one to the other by a shift, and a code that comes out
stands in the file as it is.
"""

from __future__ import annotations

import io
import struct
import wave
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_bytes
from sosmith.model.port import Port
from sosmith.model.traces.suffixes import WAV
from sosmith.model.traces.trace import Trace

MAX_SAMPLES = 1 << 24
"""Most samples of a file, over all channels: almost six minutes at 48 kHz."""

MAX_BYTES = MAX_SAMPLES * 8 + (1 << 20)
"""Most bytes of a file: samples of 64 bits, and what else programs keep beside them."""

_MAX_CHUNKS = 1000
_FLOAT, _EXTENSIBLE = 3, 0xFFFE
_CONTAINERS = {1: (1, 2, 3, 4), _FLOAT: (4, 8)}
"""Bytes of a sample, by format."""
_NAMES = {2: "ADPCM", 6: "A-law", 7: "µ-law", 17: "IMA ADPCM", 49: "GSM", 80: "MPEG", 85: "MP3"}


def is_wav(path: Path) -> bool:
    """Whether a file is a WAV file by its name."""
    return path.suffix.lower() in WAV


def check_ports(path: Path, ports: Sequence[Port]) -> None:
    """Check that a WAV file can hold what goes into a core.

    Raises
    ------
    SpecificationError
        If the core has several inputs.
    """
    if len(ports) > 1:
        names = " and ".join(port.name for port in ports)
        raise SpecificationError(f"{path}: a WAV file must be for one input, not {names}; a CSV file has both")


def check_rate(path: Path, sample_rate: Fraction) -> None:
    """Check that a WAV file can tell a sample rate.

    Raises
    ------
    SpecificationError
        If the rate is no whole number of Hz below 2**32.
    """
    if sample_rate.denominator != 1 or sample_rate >= 1 << 32:
        raise SpecificationError(
            f"{path}: the sample rate of a WAV file must be a whole number of Hz, not {float(sample_rate):.12g}"
        )


def read_wav(path: Path, ports: tuple[Port, ...], sample_rate: Fraction, channels: int = 1) -> tuple[Trace, ...]:
    """Read a WAV file for a core with one input and the `sample_rate` in Hz of each of its `channels`.

    Samples are PCM of 8, 16, 24 or 32 bits, or floats of 32 or 64 bits, whose full scale is 1. What has more bits than
    the input is rounded to the nearest code and limited to the range, as by a converter.

    Returns
    -------
    tuple of Trace
        One for each channel of the file: as many as `channels`, or a single one.

    Raises
    ------
    SpecificationError
        If the core has several inputs; if the file cannot be read, is damaged, cut off, compressed, longer than
        `MAX_SAMPLES` or without a sample; if its sample rate or its number of channels is another one; if a sample is
        not finite.
    """
    check_ports(path, ports)
    rate, samples = _samples(path, read_bytes(path, what="the WAV file", max_bytes=MAX_BYTES))
    if rate != sample_rate:
        raise SpecificationError(
            f"{path}: the sample rate must be the {float(sample_rate):.12g} Hz of the specification, not {rate} Hz; "
            f"state sample_rate = {rate} there, or resample the file, as by: sox {path.name} -r {round(sample_rate)} "
            f"{path.stem}_{round(sample_rate)}.wav"
        )
    count = samples.shape[1]
    if count not in {1, channels}:
        raise SpecificationError(
            f"{path}: the channels must be the {channels} of the design, or one that drives all, not {count}; "
            f"state channels = {count} in the specification, or keep one of the file, as by: sox {path.name} "
            f"{path.stem}_1.wav remix 1"
        )
    return tuple(_trace(path, samples[:, k], ports[0], sample_rate) for k in range(count))


def _trace(path: Path, samples: npt.NDArray[Any], port: Port, sample_rate: Fraction) -> Trace:
    steps = samples.astype(np.float64)
    if samples.dtype.kind != "f":
        steps /= -float(np.iinfo(samples.dtype).min)
    wrong = np.flatnonzero(~np.isfinite(steps))
    if len(wrong):
        raise SpecificationError(f"{path}: sample {wrong[0]} must be finite, not {steps[wrong[0]]}")
    np.clip(steps, -2, 2, out=steps)  # far out is out
    steps *= 1 << (port.bits - 1)
    steps += 0 if port.signed else 1 << (port.bits - 1)
    of_codes = replace(port, lsb=Fraction(1), zero=Fraction(0))
    codes = of_codes.encode(steps)[:, np.newaxis]
    codes.setflags(write=False)
    return Trace(
        name=path.stem, ports=(port,), sample_rate=sample_rate, codes=codes, limited=(of_codes.outside(steps),)
    )


def _samples(path: Path, content: bytes) -> tuple[int, npt.NDArray[Any]]:
    """Return the sample rate in Hz and the samples, shape (n, channels): floats, or integers aligned to the left."""
    described, data = _chunks(path, content)
    tag, channels, rate, _, block, bits = struct.unpack_from("<HHIIHH", described)
    if tag == _EXTENSIBLE and len(described) >= 26:
        (tag,) = struct.unpack_from("<H", described, 24)
    if tag not in _CONTAINERS:
        raise SpecificationError(
            f"{path}: the samples must be PCM or floats, not {_NAMES.get(tag, f'of the format 0x{tag:04x}')}"
        )
    size, odd = divmod(block, channels or 1)
    if not channels or odd or size not in _CONTAINERS[tag] or not 8 * size - 8 < bits <= 8 * size:
        raise SpecificationError(
            f"{path}: the samples must be PCM of 8, 16, 24 or 32 bits or floats of 32 or 64 bits, not {bits} bits in "
            f"{block} bytes for {channels} channels"
        )
    if len(data) % block or not data:
        raise SpecificationError(
            f"{path}: the data must be whole samples of {block} bytes, at least one, not {len(data)} bytes"
        )
    if len(data) // size > MAX_SAMPLES:
        raise SpecificationError(
            f"{path} must have at most {MAX_SAMPLES:,} samples over all channels, not {len(data) // size:,}"
        )
    return rate, _decoded(data, tag, size).reshape(-1, channels)


def _decoded(data: bytes, tag: int, size: int) -> npt.NDArray[Any]:
    """Return samples of `size` bytes: floats, or integers whose highest bit is that of the full scale."""
    if tag == _FLOAT:
        return np.frombuffer(data, f"<f{size}")
    if size == 1:  # the only ones without a sign
        return (np.frombuffer(data, np.uint8) ^ 0x80).view(np.int8)
    if size == 3:
        words = np.zeros((len(data) // 3, 4), np.uint8)
        words[:, 1:] = np.frombuffer(data, np.uint8).reshape(-1, 3)
        return words.view("<i4")
    return np.frombuffer(data, f"<i{size}")


def _chunks(path: Path, content: bytes) -> tuple[bytes, bytes]:
    """Return the format and the data of a WAV file."""
    if content[:4] != b"RIFF" or content[8:12] != b"WAVE":
        raise SpecificationError(f"{path} must be a WAV file, not one that starts with {content[:12]!r}")
    described, at = b"", 12
    for _ in range(_MAX_CHUNKS):
        if at + 8 > len(content):
            raise SpecificationError(f"{path} must be a whole WAV file, not end before its samples")
        name, size = struct.unpack_from("<4sI", content, at)
        chunk = content[at + 8 : at + 8 + size]
        if len(chunk) < size:
            raise SpecificationError(
                f"{path} must be a whole WAV file, not end {size - len(chunk):,} bytes before what its header announces"
            )
        if name == b"fmt " and size >= 16:
            described = chunk
        elif name == b"data":
            if not described:
                raise SpecificationError(f"{path} must tell the format of its samples before them, not behind")
            return described, chunk
        at += 8 + size + size % 2
    raise SpecificationError(f"{path} must have its samples within {_MAX_CHUNKS} chunks, not behind more")


def wav_bytes(codes: Codes, port: Port, sample_rate: Fraction) -> bytes:
    """Return a WAV file with the codes of a port, shape (n, channels): PCM of 16, 24 or 32 bits, aligned to the left.

    `sample_rate` is one that `check_rate` accepts. Codes without a sign have their middle at 0.
    """
    width = max(2, port.bytes)
    middle = 0 if port.signed else 1 << (port.bits - 1)
    numbers = np.ascontiguousarray((codes - middle) << (8 * width - port.bits), dtype="<i4")
    file = io.BytesIO()
    with wave.open(file, "wb") as sound:
        sound.setnchannels(codes.shape[1])
        sound.setsampwidth(width)
        sound.setframerate(int(sample_rate))
        sound.writeframes(numbers.view(np.uint8).reshape(-1, 4)[:, :width].tobytes())
    return file.getvalue()
