"""`sosmith spectrum`: spectra of traces, and the filter that follows from them."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path

import click

from sosmith.commands.options import OneOf
from sosmith.gen.picture import format_of
from sosmith.gen.spectrum.settings import (
    COVERAGE,
    DETRENDS,
    PASSBAND_LOSS,
    TOLERANCE,
    WINDOWS,
    SpectrumSettings,
    Wish,
)
from sosmith.model.errors import SpecificationError
from sosmith.model.text_files import write_contents
from sosmith.terminal import JSON_OPTION, note, output_option, print_json, show_progress

_HELP = """Show the spectra of each TRACE.csv, and propose the low-pass filter that follows from them.

A TRACE is what `sosmith emulate` writes, whose clearance the calibration computes, or a CSV file with the column
time_s and columns of values in even steps. The error allowed (--tolerance) is shared among what the filter takes from
the true signal and what it leaves of the disturbance; edges, losses, order and delay follow. A measured trace without
its truth needs --passband or --time-constant: what lies below is wanted, what lies above disturbs. With --motion,
traces without a truth are motion of the vehicle, and nothing of them is wanted. Several traces, or channels of a trace:
the filter does for each of them. Begin with

\b
    sosmith emulate my.toml wear_ramp -o ramp.csv
    sosmith spectrum ramp.csv                                  spectra, proposal, [filter] on stdout
    sosmith spectrum ramp.csv --into my.toml -o filtered.toml  my.toml with the new [filter], and a plot

Exits with 1 if no filter is needed for the tolerance, or none is enough.
"""


@click.command("spectrum", help=_HELP)
@click.argument("traces", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="TRACE...")
@click.option(
    "--column", "columns", multiple=True, help="Take this column of values, where a trace has it; may be given again."
)
@click.option("--truth", help="Column with the true signal.  [default: clearance_mm of an emulated trace, truth]")
@click.option(
    "--channel",
    "channels",
    multiple=True,
    type=click.IntRange(min=0),
    help="Take this channel of traces that hold several; may be given again.  [default: all]",
)
@click.option(
    "--calibration",
    type=click.Path(path_type=Path),
    metavar="SPEC",
    help="Specification whose calibration computes the clearance.  [default: that of --into, or equation 5a]",
)
@click.option("--motion", is_flag=True, help="Nothing is wanted of traces without a truth.")
@click.option(
    "--tolerance", type=float, default=TOLERANCE, show_default=True, help="Error allowed at the output, in mm."
)
@click.option(
    "--coverage", type=float, default=COVERAGE, show_default=True, help="Times the rms error that is to be allowed."
)
@click.option("--passband", type=float, help="Pass edge in Hz.  [default: from the true signals]")
@click.option("--time-constant", type=float, help="The same as 1 / (2 pi T), T in s.")
@click.option(
    "--passband-loss", type=float, help=f"In dB.  [default: from the wanted signal, at most {PASSBAND_LOSS:g}]"
)
@click.option("--window", type=OneOf(WINDOWS), default="hann", show_default=True)
@click.option("--segment", type=float, help="Length of a segment in s.  [default: an eighth of the trace]")
@click.option("--overlap", type=float, default=0.5, show_default=True, help="Of a segment with the next.")
@click.option("--detrend", type=OneOf(DETRENDS), default="linear", show_default=True, help="In each segment.")
@click.option("--confidence", type=float, default=0.95, show_default=True, help="Of the interval of the spectra.")
@click.option(
    "--into", type=click.Path(path_type=Path), metavar="SPEC", help="Write a copy of SPEC with [filter] replaced."
)
@click.option(
    "--plot", type=click.Path(path_type=Path), help="SVG or PNG file for the plot.  [default: beside -o, as .svg]"
)
@JSON_OPTION
@output_option("TOML file for [filter], or for the copy of SPEC.  [default: stdout]")
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
    settings = SpectrumSettings(window=window, segment=segment, overlap=overlap, detrend=detrend, confidence=confidence)
    edge = _pass_edge(passband, time_constant)
    wish = Wish(tolerance=tolerance, coverage=coverage, passband=edge, passband_loss=passband_loss)
    picture = plot if plot is not None or output is None else output.with_suffix(".svg")
    file_format = "" if picture is None else format_of(picture)
    with show_progress() as step:
        from sosmith.gen.spectrum.report import proposal_json, signal_json
        from sosmith.gen.spectrum.survey import survey

        made = survey(
            traces,
            settings,
            wish,
            columns=columns,
            truth=truth,
            channels=channels,
            calibration=calibration,
            into=into,
            output=output,
            motion=motion,
            progress=step,
        )
        drawn = None
        if picture is not None:
            step("drawing")
            drawn = made.plot(file_format)
    if as_json:
        entries = [
            signal_json(one.name, one.file, one.signal.unit, one.spectra, trial)
            for one, trial in zip(made.signals, made.trials, strict=True)
        ]
        proposed = None if made.proposal is None else proposal_json(made.proposal)
        print_json({"settings": asdict(settings), "signals": entries, "proposal": proposed})
    else:
        from sosmith.commands.tables.spectrum import print_proposal, print_signals

        print_signals(made.signals)
        if made.proposal is not None:
            print_proposal(made.proposal, made.signals, made.trials)
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


def _pass_edge(passband: float | None, time_constant: float | None) -> float | None:
    if time_constant is None:
        return passband
    if passband is not None:
        raise SpecificationError("the pass edge must be given by one of --passband and --time-constant, not both")
    if not 0 < time_constant < math.inf:
        raise SpecificationError(f"time-constant must be a positive number of seconds, not {time_constant:g}")
    return float(f"{1 / (2 * math.pi * time_constant):.5g}")  # as many digits as the proposal's other numbers


def _write(path: Path, content: bytes) -> None:
    write_contents(path.parent, {path.name: content})
    note(f"wrote {path}")
