"""Files of traces by their names: CSV, and WAV where they end so."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from sosmith.model.arrays import side_by_side
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.text_files import write_file
from sosmith.model.traces import wav_file
from sosmith.model.traces.suffixes import OTHER_SOUND
from sosmith.model.traces.trace import Trace
from sosmith.model.traces.trace_file import read_traces, write_traces


def read_trace_file(path: Path, ports: tuple[Port, ...], sample_rate: Fraction, channels: int = 1) -> tuple[Trace, ...]:
    """Read a trace file for a core, as `read_traces` or `read_wav` does.

    Returns
    -------
    tuple of Trace
        One for each of the core's `channels`. A file with a single channel drives all, each a sample later than the
        one before.

    Raises
    ------
    SpecificationError
        As these do; and if the name is that of sound in another format.
    """
    if path.suffix.lower() in OTHER_SOUND:
        raise SpecificationError(
            f"{path}: sound must be a WAV file, not {path.suffix.lower()}; convert it, as by: ffmpeg -i {path.name} "
            f"{path.stem}.wav"
        )
    read = wav_file.read_wav if wav_file.is_wav(path) else read_traces
    given = read(path, ports, sample_rate, channels)
    return given if len(given) == channels else tuple(given[0].delayed(k) for k in range(channels))


def write_trace_file(path: Path, traces: Sequence[Trace]) -> None:
    """Write the traces of a core's channels as `write_traces` does, or as sound.

    Raises
    ------
    SpecificationError
        As `write_traces`; for sound, if there are several inputs, or the sample rate is not one of a WAV file.
    ToolError
        If the disk is full.
    """
    if not wav_file.is_wav(path):
        write_traces(path, traces)
        return
    (first, *_) = traces
    wav_file.check_ports(path, first.ports)
    wav_file.check_rate(path, first.sample_rate)
    codes = side_by_side([trace.codes for trace in traces])[:, :, 0]
    write_file(path, wav_file.wav_bytes(codes, first.ports[0], first.sample_rate))
