"""`sosmith stream`: pushes a trace through a board and pulls the results."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.options import BAUD
from sosmith.output_paths import output_option
from sosmith.terminal import note, show_progress


@click.command("stream")
@click.argument("port")
@click.argument("trace", type=click.Path(path_type=Path), metavar="TRACE.csv|wav")
@BAUD
@output_option("CSV file for the results, or Parquet or WAV file if its name ends so.  [default: stdout]", stdout=True)
def stream_command(port: str, trace: Path, baud: int, output: Path | None) -> None:
    """Send the samples of TRACE to the board at PORT, and write its results.

    PORT is a serial port, or the path that `sosmith board SPEC --virtual` prints. A CSV file has the columns
    that `sosmith emulate` writes: for each input its codes or its physical values. A trace of one channel drives all
    channels, each one sample later than the one before. The core starts from reset.

    \b
        sosmith stream /dev/ttyUSB1 ramp.csv -o results.csv
        sosmith stream /dev/ttyUSB1 song.wav -o filtered.wav
    """
    from sosmith.interface.stream import Streamed

    with show_progress() as step:
        streamed = Streamed.through(port, trace, baud=baud, progress=step)
    if output is None:
        click.echo(streamed.csv(), nl=False)
    else:
        streamed.save(output)
        note(f"wrote {output}: {streamed.results.codes.size} results of {streamed.identity.name}")
    if streamed.faults:
        note("mended on the line: " + ", ".join(f"{count} {name}" for name, count in streamed.faults.items()))
