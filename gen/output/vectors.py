"""Test vectors: what went into a core and what came out of it, as CSV, NPZ, VCD, or words for `$readmemh`."""

from __future__ import annotations

import csv
import io
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Vectors:
    """Samples of a core, all channels at a time.

    Attributes
    ----------
    stimuli : int64 array, shape (samples, channels, inputs)
        Input codes.
    responses : int64 array, shape (samples, channels)
        Output codes.
    status : uint8 array, shape (samples, channels)
        Status flags of each output.
    """

    stimuli: Codes
    responses: Codes
    status: npt.NDArray[np.uint8]


FORMATS = (".csv", ".npz", ".vcd", ".hex")
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


def hex_words(vectors: Vectors, interface: InterfaceFacts) -> tuple[str, str]:
    """Return stimuli and responses as two texts for ``$readmemh``, one transfer a line.

    The channels take turns. A line has ``tdest``, ``tuser`` and ``tdata``, as far as the stream has them, with
    underscores between them.
    """
    samples, channels, inputs = vectors.stimuli.shape
    dest = np.tile(np.arange(channels), samples)
    sent = words(vectors.stimuli.reshape(-1, inputs), interface.inputs)
    expected = words(vectors.responses.reshape(-1, 1), interface.outputs)
    status = vectors.status.reshape(-1)
    into, out = interface.inputs, interface.outputs
    return (
        _lines(into.dest_width, [dest], [into.width], [sent]),
        _lines(out.dest_width, [dest], [STATUS_BITS, out.width], [status, expected]),
    )


def _lines(
    dest_width: int, dest: list[npt.NDArray[np.int64]], widths: list[int], columns: list[npt.NDArray[np.generic]]
) -> str:
    """Rows of hexadecimal numbers of `widths` bits, with the channel first where there is one."""
    if dest_width:
        widths, columns = [dest_width, *widths], [*dest, *columns]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return "".join("_".join(f"{v:0{w // 4}x}" for v, w in zip(row, widths, strict=True)) + "\n" for row in rows)


def check_format(path: Path) -> None:
    """Check that `vector_files` knows the format that the suffix of `path` names.

    Raises
    ------
    SpecificationError
        If it does not.
    """
    if path.suffix not in FORMATS:
        raise SpecificationError(f"{path}: a file of vectors must end in {', '.join(FORMATS)}, not {path.suffix!r}")


def vector_files(path: Path, vectors: Vectors, interface: InterfaceFacts, sample_rate: Fraction) -> dict[str, bytes]:
    """Return the files that hold `vectors`, by name, in the format that the suffix of `path` names.

    Parameters
    ----------
    path : Path
        ``.csv`` (a row for each sample of each channel, codes in decimal), ``.npz`` (the arrays of `Vectors` by their
        names), ``.vcd`` (the codes of every channel at the times of the samples), or ``.hex`` (two files for
        ``$readmemh``, whose names end in ``_stimuli.hex`` and ``_responses.hex``).
    vectors : Vectors
        The samples.
    interface : InterfaceFacts
        Streams of the core.
    sample_rate : Fraction
        Samples per second, for the time in a VCD file.

    Raises
    ------
    SpecificationError
        If the suffix is another one.
    """
    check_format(path)
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
    text = _csv(vectors, interface) if path.suffix == ".csv" else _vcd(vectors, interface, sample_rate)
    return {path.name: text.encode()}


def _names(interface: InterfaceFacts) -> list[str]:
    ports = [field.port.name for stream in (interface.inputs, interface.outputs) for field in stream.fields]
    return [*(f"{name}_code" for name in ports), "status"]


def _csv(vectors: Vectors, interface: InterfaceFacts) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["sample", "channel", *_names(interface)])
    for n, sample in enumerate(_rows(vectors)):
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
        for n, sample in enumerate(_rows(vectors)):
            for row, channel in zip(sample, variables, strict=True):
                for value, size, variable in zip(row, sizes, channel, strict=True):
                    writer.change(variable, int(n * 10**9 / sample_rate), value % (1 << size))
        writer.close(int(len(vectors.responses) * 10**9 / sample_rate))
    return text.getvalue()


def _rows(vectors: Vectors) -> list[list[list[int]]]:
    """Input codes, output code and status of each channel of each sample."""
    results = np.stack([vectors.responses, vectors.status.astype(np.int64)], axis=2)
    rows: list[list[list[int]]] = np.concatenate([vectors.stimuli, results], axis=2).tolist()
    return rows
