"""`sosmith spectrum`: spectra of traces, and a filter proposed from them."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.options import OneOf, print_tables
from sosmith.interface.choices import COVERAGE, DETRENDS, PASSBAND_LOSS, TOLERANCE, WINDOWS, picture_format
from sosmith.interface.files import write_file
from sosmith.output_paths import output_option, plot_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

_HELP = """Show the spectra of traces, and propose a low-pass filter based on them.

A TRACE is a file that `sosmith emulate` has written, from which the calibration computes the clearance, or a CSV file
with a column time_s in even steps and columns of values. The allowed error (--tolerance) is divided between the
distortion of the true signal and the disturbance that passes the filter; edges, losses, order and delay follow from it.
A measured trace without a true signal needs --passband or --time-constant: everything below that edge is wanted signal,
everything above is disturbance. With --motion, all of a trace without a true signal is disturbance by vehicle motion.
With several traces or channels, the filter meets the tolerance for each of them. To get started:

\b
    sosmith emulate my.toml wear_ramp -o ramp.csv
    sosmith spectrum ramp.csv                                  print spectra, proposal and [filter]
    sosmith spectrum ramp.csv --into my.toml -o filtered.toml  write my.toml with the new [filter], and a plot

Exits with 1 if the tolerance needs no filter, or no filter meets it.
"""


@click.command("spectrum", help=_HELP)
@click.argument("traces", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="TRACE...")
@click.option("--column", "columns", multiple=True, help="Use this column of values, where a trace has it; repeatable.")
@click.option("--truth", help="Column with the true signal.  [default: clearance_mm of an emulated trace, truth]")
@click.option(
    "--channel",
    "channels",
    multiple=True,
    type=click.IntRange(min=0),
    help="Use this channel of multichannel traces; repeatable.  [default: all]",
)
@click.option(
    "--calibration",
    type=click.Path(path_type=Path),
    metavar="SPEC",
    help="Specification whose calibration computes the clearance.  [default: that of --into, or equation 5a]",
)
@click.option("--motion", is_flag=True, help="Treat traces without a true signal as disturbance by vehicle motion.")
@click.option(
    "--tolerance", type=float, default=TOLERANCE, show_default=True, help="Allowed error at the output, in mm."
)
@click.option(
    "--coverage",
    type=float,
    default=COVERAGE,
    show_default=True,
    help="Multiple of the rms error that the tolerance covers.",
)
@click.option("--passband", type=float, help="Passband edge in Hz.  [default: from the true signals]")
@click.option("--time-constant", type=float, help="Passband edge given as a time constant T in s: 1 / (2 pi T).")
@click.option(
    "--passband-loss",
    type=float,
    help=f"Passband loss in dB.  [default: from the signal, at most {PASSBAND_LOSS:g}]",
)
@click.option("--window", type=OneOf(WINDOWS), default="hann", show_default=True, help="Window function.")
@click.option("--segment", type=float, help="Length of a segment in s.  [default: an eighth of the trace]")
@click.option("--overlap", type=float, default=0.5, show_default=True, help="Overlap of adjacent segments, 0 to 0.95.")
@click.option(
    "--detrend", type=OneOf(DETRENDS), default="linear", show_default=True, help="Trend to remove from segments."
)
@click.option(
    "--confidence",
    type=float,
    default=0.95,
    show_default=True,
    help="Confidence level of the spectra.",
)
@click.option(
    "--into", type=click.Path(path_type=Path), metavar="SPEC", help="Write a copy of SPEC with [filter] replaced."
)
@plot_option("SVG or PNG file for the plot.  [default: name of -o with .svg]")
@JSON_OPTION
@output_option("TOML file for [filter], or for the copy of SPEC.  [default: stdout]", stdout=True)
def spectrum_command(
    traces: tuple[Path, ...],
    columns: tuple[str, ...],
    truth: str | None,
    channels: tuple[int, ...],
    calibration: Path | None,
    motion: bool,
    tolerance: float,
    coverage: float,
    passband: float | None,
    time_constant: float | None,
    passband_loss: float | None,
    window: str,
    segment: float | None,
    overlap: float,
    detrend: str,
    confidence: float,
    into: Path | None,
    plot: Path | None,
    as_json: bool,
    output: Path | None,
) -> None:
    """Carry out `sosmith spectrum`."""
    picture = plot if plot is not None or output is None else output.with_suffix(".svg")
    file_format = "" if picture is None else picture_format(picture)
    with show_progress() as step:
        from sosmith.interface.instrument.spectrum import survey

        made = survey(
            traces,
            columns=columns,
            truth=truth,
            channels=channels,
            calibration=calibration,
            motion=motion,
            tolerance=tolerance,
            coverage=coverage,
            passband=passband,
            time_constant=time_constant,
            passband_loss=passband_loss,
            window=window,
            segment=segment,
            overlap=overlap,
            detrend=detrend,
            confidence=confidence,
            into=into,
            output=output,
            progress=step,
        )
        drawn = None
        if picture is not None:
            step("drawing")
            drawn = made.plot(file_format)
    if as_json:
        print_json(made.as_dict())
    else:
        print_tables(made.tables())
    if made.table is not None:
        _hand_over(made.table, output, as_json=as_json)
    if picture is not None and drawn is not None:
        _write(picture, drawn)
    if made.obstacle:
        note(f"no filter is proposed: {made.obstacle}")
    if made.shortfall is not None:
        raise made.shortfall


def _hand_over(table: str, output: Path | None, *, as_json: bool) -> None:
    if output is not None:
        _write(output, table.encode())
    elif not as_json:
        click.echo(table, nl=False)


def _write(path: Path, content: bytes) -> None:
    write_file(path, content)
    note(f"wrote {path}")
