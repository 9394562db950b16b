"""A trace that went through a board: its results as rows of a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from os import PathLike, fspath
from pathlib import Path

from sosmith.host.board import BAUD, Board, Results
from sosmith.host.recording import as_csv, recording
from sosmith.host.rows import columns, rows
from sosmith.host.trace_samples import samples_for
from sosmith.model.link.identity import Identity
from sosmith.model.text_files import write_file
from sosmith.model.traces.wav_file import check_rate, is_wav, wav_bytes


@dataclass(frozen=True, eq=False)
class Streamed:
    """What a board computed from a trace.

    Attributes
    ----------
    identity : Identity
        What the board says that it is.
    results : Results
        All results: one for each sample, or as many as the identity says.
    faults : dict of str to int
        Faults of the line that were mended, by their kinds; those that did not occur are left out.
    """

    identity: Identity
    results: Results = field(repr=False)
    faults: dict[str, int]

    @classmethod
    def through(
        cls,
        port: str,
        trace: str | PathLike[str],
        *,
        baud: int = BAUD,
        progress: Callable[[str, int, int], None] = lambda step, done, total: None,
    ) -> Streamed:
        """Send the samples of a CSV or WAV file through the board at a port, from reset.

        Raises
        ------
        SpecificationError
            If the file does not fit the board.
        ToolError
            If there is no board, or the link fails.
        """
        with Board(port, baud=baud) as board:
            progress(f"reading {trace}", 0, 0)
            codes = samples_for(board.identity, Path(fspath(trace)))
            results = board.run_codes(codes, lambda done, total: progress("streaming", done, total))
            faults = {name: count for name, count in board.faults.items() if count}
            return cls(board.identity, results, faults)

    def csv(self) -> str:
        """Return a row for each result: time_s, channel if there are several, the value with its unit, code, status."""
        return as_csv([columns(self.identity), *rows(self.identity, self.results)])

    def save(self, path: str | PathLike[str]) -> None:
        """Write the same rows to a CSV file, or to a new Parquet file if its name ends so; .wav: the codes as sound.

        Raises
        ------
        SpecificationError
            If the file cannot be written, or the sample rate is not one of a WAV file.
        """
        target = Path(fspath(path))
        if is_wav(target):
            rate = Fraction(self.identity.result_rate).limit_denominator(10**9)
            check_rate(target, rate)
            codes = self.results.codes.reshape(-1, self.identity.channels)
            write_file(target, wav_bytes(codes, self.identity.output_port, rate))
            return
        if target.suffix.lower() != ".parquet":
            write_file(target, self.csv())
            return
        with recording(target, columns(self.identity)) as file:
            file.add(rows(self.identity, self.results))
