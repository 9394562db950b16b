"""`sosmith stream`: pushes a trace through a board and pulls the results."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.options import BAUD
from sosmith.output_paths import output_option
from sosmith.terminal import note, show_progress


@click.command("stream")
@click.argument("port")
@click.argument("trace", type=click.Path(path_type=Path), metavar="TRACE.csv")
@BAUD
@output_option("CSV file, or Parquet file if its name ends so, for the results.  [default: stdout]", stdout=True)
def stream_command(port: str, trace: Path, baud: int, output: Path | None) -> None:
    """Send the samples of TRACE.csv to the board at PORT, and write its results.

    PORT is a serial port, or the path that `sosmith board SPEC --virtual` prints. TRACE.csv has the columns that
    `sosmith emulate` writes: for each input its codes or its physical values. A trace without the column channel drives
    all channels, each one sample later than the one before. The core starts from reset.

    \b
        sosmith stream /dev/ttyUSB1 ramp.csv -o results.csv
    """
    from sosmith.host.board import Board
    from sosmith.host.recording import as_csv, recording
    from sosmith.host.rows import columns, rows
    from sosmith.host.trace_samples import samples_for
    from sosmith.model.text_files import write_file

    with show_progress() as step, Board(port, baud=baud) as board:
        about = board.identity
        step(f"reading {trace}")
        codes = samples_for(about, trace)
        results = board.run_codes(codes, lambda done, total: step("streaming", done, total))
        faults = {name: count for name, count in board.faults.items() if count}
    text = as_csv([columns(about), *rows(about, results)])
    if output is None:
        click.echo(text, nl=False)
    elif output.suffix.lower() == ".parquet":
        with recording(output, columns(about)) as made:
            made.add(rows(about, results))
    else:
        write_file(output, text)
    if output is not None:
        note(f"wrote {output}: {results.codes.size} results of {about.name}")
    if faults:
        note("mended on the line: " + ", ".join(f"{count} {name}" for name, count in faults.items()))
