"""Test vectors: what went into a core and what came out of it, as CSV, NPZ, VCD, words for `$readmemh`, or sound."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
import numpy.typing as npt
from vcd import VCDWriter

from sosmith.gen.output.core_facts import InterfaceFacts, StreamFacts
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.status import STATUS_BITS
from sosmith.model.errors import SpecificationError
from sosmith.model.traces.wav_file import check_rate, wav_bytes


@dataclass(frozen=True, eq=False, kw_only=True)
class Vectors:
    """Samples of a core, all channels at a time.

    Attributes
    ----------
    stimuli : int64 array, shape (samples, channels, inputs)
        Input codes.
    responses : int64 array, shape (results, channels)
        Output codes, as they come out: one for each sample, or behind a decimator one for every R-th, R times if held.
    status : uint8 array, shape (results, channels)
        Status flags of each output.
    """

    stimuli: Codes
    responses: Codes
    status: npt.NDArray[np.uint8]


FORMATS = (".csv", ".npz", ".vcd", ".hex", ".wav")
"""Suffixes of the files that `vector_files` makes."""


def words(codes: Codes, stream: StreamFacts) -> npt.NDArray[np.uint64]:
    """Return the bus words of samples with `codes`, shape (n, fields): each field extended by its sign to whole bytes.

    Raises
    ------
    ValueError
        If a sample is more than 64 bits wide.
    """
    if stream.sample_width > 64:
        raise ValueError(f"samples must be at most 64 bits wide, not {stream.sample_width}")
    packed = np.zeros(len(codes), dtype=np.uint64)
    for column, field in zip(codes.T, stream.fields, strict=True):
        packed |= (column.astype(np.uint64) & np.uint64((1 << field.padded) - 1)) << np.uint64(field.offset)
    return packed


def whole_beats(codes: Codes, stream: StreamFacts) -> Codes:
    """Return `codes`, shape (samples, channels, inputs), with the last sample repeated until the last beat is full."""
    filling = -len(codes) % stream.lanes
    return np.concatenate([codes, np.repeat(codes[-1:], filling, axis=0)]) if filling else codes


def hex_words(
    vectors: Vectors, interface: InterfaceFacts, came: npt.NDArray[np.int64] | None = None
) -> tuple[str, str]:
    """Return stimuli and responses as two texts for ``$readmemh``, one transfer a line.

    The channels take turns, with all the results that a sample brings: `came` has, for each result of a channel, the
    number of the sample that it comes with; without it, none brings several. A line has ``tdest``, ``tuser`` and
    ``tdata``, as far as the stream has them, with underscores between them. Several samples of a beat share a line;
    their number must be a multiple of that.
    """
    samples, channels, _ = vectors.stimuli.shape
    numbers, channel = np.divmod(np.arange(vectors.responses.size), channels)
    order = np.lexsort((numbers, channel, numbers if came is None else came[numbers]))
    sent = words(vectors.stimuli.reshape(-1, len(interface.inputs.fields)), interface.inputs)
    expected = words(vectors.responses.reshape(-1, 1), interface.outputs)[order]
    status = vectors.status.reshape(-1)[order]
    turns = np.tile(np.arange(channels), samples)
    return (
        _lines(interface.inputs, turns, [(interface.inputs.sample_width, sent)]),
        _lines(
            interface.outputs,
            channel[order],
            [(STATUS_BITS, status), (interface.outputs.sample_width, expected)],
        ),
    )


def _lines(
    stream: StreamFacts, dest: npt.NDArray[np.int64], columns: Sequence[tuple[int, npt.NDArray[np.generic]]]
) -> str:
    """Rows of hexadecimal numbers of so many bits, with the channel first where there is one."""
    texts = [_joined(column, width, stream.lanes) for width, column in columns]
    if stream.dest_width:
        texts.insert(0, _joined(dest, stream.dest_width, 1))
    return "".join("_".join(row) + "\n" for row in zip(*texts, strict=True))


def _joined(column: npt.NDArray[np.generic], width: int, lanes: int) -> list[str]:
    """Write numbers of `width` bits in hexadecimal, those of a beat in one text, the first of them last."""
    digits = [f"{number:0{width // 4}x}" for number in column.tolist()]
    return ["".join(reversed(digits[start : start + lanes])) for start in range(0, len(digits), lanes)]


def result_rate(interface: InterfaceFacts, sample_rate: Fraction) -> Fraction:
    """Return the responses per second of a core that takes `sample_rate` samples per second."""
    return sample_rate * interface.copies_per_result / interface.samples_per_result


def check_format(path: Path, rate: Fraction | None = None) -> None:
    """Check that `vector_files` knows the format that the suffix of `path` names.

    Raises
    ------
    SpecificationError
        If it does not, or if it is sound, and `rate`, in responses per second, is not one of a WAV file.
    """
    if path.suffix not in FORMATS:
        raise SpecificationError(f"{path}: a file of vectors must end in {', '.join(FORMATS)}, not {path.suffix!r}")
    if path.suffix == ".wav" and rate is not None:
        check_rate(path, rate)


def vector_files(path: Path, vectors: Vectors, interface: InterfaceFacts, sample_rate: Fraction) -> dict[str, bytes]:
    """Return the files that hold `vectors`, by name, in the format that the suffix of `path` names.

    Parameters
    ----------
    path : Path
        ``.csv`` (a row for each sample of each channel, codes in decimal; output and status are empty where a sample
        brings no result), ``.npz`` (the arrays of `Vectors` by their names), ``.vcd`` (the codes of every channel at
        the times of the samples), or ``.hex`` (two files for ``$readmemh``, whose names end in ``_stimuli.hex`` and
        ``_responses.hex``; a beat of several samples must be full), or ``.wav`` (the responses as sound).
    vectors : Vectors
        The samples.
    interface : InterfaceFacts
        Streams of the core.
    sample_rate : Fraction
        Samples per second, for the time in a VCD file.

    Raises
    ------
    SpecificationError
        As `check_format`.
    """
    check_format(path, result_rate(interface, sample_rate))
    if path.suffix == ".hex":
        stimuli, responses = hex_words(vectors, interface)
        texts = {f"{path.stem}_stimuli.hex": stimuli, f"{path.stem}_responses.hex": responses}
        return {name: text.encode() for name, text in texts.items()}
    if path.suffix == ".npz":
        content = io.BytesIO()
        np.savez_compressed(
            content, stimuli=vectors.stimuli, responses=vectors.responses, status=vectors.status, allow_pickle=False
        )
        return {path.name: content.getvalue()}
    if path.suffix == ".wav":
        sound = wav_bytes(vectors.responses, interface.outputs.fields[0].port, result_rate(interface, sample_rate))
        return {path.name: sound}
    text = _csv(vectors, interface) if path.suffix == ".csv" else _vcd(vectors, interface, sample_rate)
    return {path.name: text.encode()}


def _names(interface: InterfaceFacts) -> list[str]:
    ports = [field.port.name for stream in (interface.inputs, interface.outputs) for field in stream.fields]
    return [*(f"{name}_code" for name in ports), "status"]


def _csv(vectors: Vectors, interface: InterfaceFacts) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["sample", "channel", *_names(interface)])
    for n, sample in enumerate(_rows(vectors, interface)):
        rows.writerows([n, channel, *row] for channel, row in enumerate(sample))
    return text.getvalue()


def _vcd(vectors: Vectors, interface: InterfaceFacts, sample_rate: Fraction) -> str:
    text = io.StringIO()
    ports = [field.port for stream in (interface.inputs, interface.outputs) for field in stream.fields]
    with VCDWriter(text, timescale="1 ns", date="", version="sosmith") as writer:
        sizes = [*(port.bits for port in ports), STATUS_BITS]
        variables = [
            [
                writer.register_var(f"{interface.name}.channel{channel}", name, "wire", size=size)
                for name, size in zip(_names(interface), sizes, strict=True)
            ]
            for channel in range(vectors.stimuli.shape[1])
        ]
        for n, sample in enumerate(_rows(vectors, interface)):
            for row, channel in zip(sample, variables, strict=True):
                for value, size, variable in zip(row, sizes, channel, strict=True):
                    if value is not None:
                        writer.change(variable, int(n * 10**9 / sample_rate), value % (1 << size))
        writer.close(int(len(vectors.stimuli) * 10**9 / sample_rate))
    return text.getvalue()


def _rows(vectors: Vectors, interface: InterfaceFacts) -> list[list[list[int | None]]]:
    """Input codes, output code and status of each channel of each sample; None where it brings no result."""
    every = interface.samples_per_result // interface.copies_per_result
    sent: list[list[list[int | None]]] = vectors.stimuli.tolist()
    results = np.stack([vectors.responses, vectors.status.astype(np.int64)], axis=2).tolist()
    none = [[None, None]] * vectors.stimuli.shape[1]
    return [
        [[*codes, *result] for codes, result in zip(sample, none if n % every else results[n // every], strict=True)]
        for n, sample in enumerate(sent)
    ]
