"""`sosmith spectrum`: spectra of traces, and the filter that follows from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import click
from rich.markup import escape

from sosmith.gen.core import polynomial_of
from sosmith.gen.picture import FORMATS
from sosmith.gen.specification.specification import load
from sosmith.gen.spectrum.filter_table import filter_table, replace_filter
from sosmith.gen.spectrum.plot import Curve, spectrum_plot
from sosmith.gen.spectrum.prediction import Content, told_apart
from sosmith.gen.spectrum.proposal import COVERAGE, PASSBAND_LOSS, TOLERANCE, Proposal, Wish, propose
from sosmith.gen.spectrum.report import peaks, proposal_json, provenance, ripple, signal_json
from sosmith.gen.spectrum.spectra import DETRENDS, WINDOWS, Spectrum, SpectrumSettings, slow_rms, spectrum
from sosmith.gen.spectrum.trial import Trial, try_filter
from sosmith.model.calibration.polynomial import EQUATION_5A, Polynomial
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.port import Values
from sosmith.model.tables.csv_table import csv_header
from sosmith.model.text_files import write_contents
from sosmith.model.traces.signal_file import Signal, SignalFile, read_signal_file
from sosmith.model.traces.trace_file import TIME_TOLERANCE
from sosmith.terminal import (
    JSON_OPTION,
    TableConsole,
    new_table,
    note,
    output_option,
    print_json,
    show_progress,
)

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


_NOTHING = 1e-9
"""Below this, in any unit, a figure is what rounding left of zero."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _Spectra:
    """A signal with its name and file, and its spectra: measured, and with a truth also true and disturbance."""

    name: str
    file: SignalFile
    signal: Signal
    spectra: dict[str, Spectrum]


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
@click.option("--window", type=click.Choice(WINDOWS), default="hann", show_default=True)
@click.option("--segment", type=float, help="Length of a segment in s.  [default: an eighth of the trace]")
@click.option("--overlap", type=float, default=0.5, show_default=True, help="Of a segment with the next.")
@click.option("--detrend", type=click.Choice(DETRENDS), default="linear", show_default=True, help="In each segment.")
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
    picture = _picture(plot, output)
    with show_progress() as step:
        step("reading")
        polynomial, origin = _polynomial(calibration or into)
        files = _read(traces, polynomial, columns, truth, channels)
        rate = _sample_rate(files, into)
        _check_data(into, output)
        step("spectra")
        signals = [_spectra_of(file, one, settings) for file in files for one in file.signals]
        obstacle = _obstacle(signals, edge, motion=motion)
        if obstacle and (output or into):
            raise SpecificationError(obstacle)
        proposal, shortfall = None, None
        if not obstacle:
            step("proposing")
            proposal, shortfall = _proposed([_content(one, edge, motion=motion) for one in signals], wish, rate)
        drawn = None
        if picture is not None:
            step("drawing")
            curves = [
                Curve(name=f"{one.name}, {key}" if len(one.spectra) > 1 else one.name, unit=one.signal.unit, spectrum=s)
                for one in signals
                for key, s in one.spectra.items()
            ]
            drawn = spectrum_plot(curves, proposal, picture.suffix.lower().removeprefix("."))
    trials = [None if proposal is None else _trial(one, proposal) for one in signals]
    table = None
    if proposal is not None:
        table = filter_table(proposal, provenance(files, wish, settings, motion=motion, calibration=origin))
        if into is not None:
            table = replace_filter(_text_of(into), table, str(into))
    if as_json:
        entries = [
            signal_json(one.name, one.file, one.signal.unit, one.spectra, trial)
            for one, trial in zip(signals, trials, strict=True)
        ]
        proposed = None if proposal is None else proposal_json(proposal)
        print_json({"settings": asdict(settings), "signals": entries, "proposal": proposed})
    else:
        _print_signals(signals)
        if proposal is not None:
            _print_proposal(proposal, signals, trials)
    if table is not None:
        _hand_over(table, output, as_json=as_json)
    if picture is not None and drawn is not None:
        _write(picture, drawn)
    if obstacle:
        note(f"no filter is proposed: {obstacle}")
    if shortfall is not None:
        raise shortfall


def _proposed(
    contents: Sequence[Content], wish: Wish, sample_rate: float
) -> tuple[Proposal | None, ShortfallError | None]:
    """Propose a filter, or tell why there is none: the spectra are shown either way."""
    try:
        return propose(contents, wish, sample_rate), None
    except ShortfallError as shortfall:
        return None, shortfall


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


def _picture(plot: Path | None, output: Path | None) -> Path | None:
    if plot is None:
        return None if output is None else output.with_suffix(".svg")
    if plot.suffix.lower().removeprefix(".") not in FORMATS:
        raise SpecificationError(f"{plot}: the plot's name must end in .svg or .png, not {plot.suffix or 'neither'}")
    return plot


def _polynomial(path: Path | None) -> tuple[Polynomial, str]:
    """Calibration of a specification, equation 5a without one, and what to call it."""
    if path is None:
        return EQUATION_5A, "equation 5a of the paper"
    spec = load(path)
    if spec.calibration is None:
        return EQUATION_5A, f"equation 5a of the paper, as {path.name} has none"
    return polynomial_of(spec)[0], f"that of {path.name}"


def _read(
    traces: Sequence[Path],
    polynomial: Polynomial,
    columns: Sequence[str],
    truth: str | None,
    channels: Sequence[int],
) -> list[SignalFile]:
    """Read each file with those of the columns asked for that it has; each must be in one of the files."""
    headers = [csv_header(path) for path in traces]
    for name in (*columns, *([truth] if truth else [])):
        if not any(name in header for header in headers):
            raise SpecificationError(f"column {name} must be in one of {', '.join(map(str, traces))}, not in none")
    return [
        read_signal_file(
            path, polynomial, [name for name in columns if name in header], truth if truth in header else None, channels
        )
        for path, header in zip(traces, headers, strict=True)
    ]


def _sample_rate(files: Sequence[SignalFile], into: Path | None) -> float:
    """Sample rate of the filter, Hz: that of the traces, or of the specification that they have to agree with."""
    first = files[0]
    rate, owner = first.sample_rate, str(first.path)
    if into is not None:
        spec = load(into)
        rate, owner = float(spec.sample_rate), str(into)
    for file in files:
        if abs(file.sample_rate - rate) > TIME_TOLERANCE * rate:
            raise SpecificationError(
                f"{file.path}: the sample rate must be the {rate:g} Hz of {owner}, not {file.sample_rate:g} Hz"
            )
    return rate


def _check_data(into: Path | None, output: Path | None) -> None:
    """Refuse a copy that would look for its measurements in another folder."""
    if into is None or output is None:
        return
    calibration = load(into).calibration
    if calibration is not None and calibration.data is not None and into.parent.resolve() != output.parent.resolve():
        raise SpecificationError(
            f"{output}: the copy must be in the folder of {into}, whose calibration.data is found from there"
        )


def _spectra_of(file: SignalFile, one: Signal, settings: SpectrumSettings) -> _Spectra:
    parts = {"measured": one.values}
    if one.truth is not None:
        parts |= {"true": one.truth, "disturbance": one.values - one.truth}
    spectra = {key: spectrum(values, file.sample_rate, settings) for key, values in parts.items()}
    return _Spectra(name=f"{file.path.name}: {one.name}", file=file, signal=one, spectra=spectra)


def _obstacle(signals: Sequence[_Spectra], edge: float | None, *, motion: bool) -> str | None:
    """Say why no filter can be proposed, if so."""
    units = list(dict.fromkeys(one.signal.unit or "no unit" for one in signals))
    if len(units) > 1:
        return f"the signals must have one unit, not {' and '.join(units)}: choose some by --column"
    unknown = [one.name for one in signals if one.signal.truth is None]
    if edge is None and unknown and (not motion or len(unknown) == len(signals)):
        return f"--passband or --time-constant must be given, as {unknown[0]} has no truth to tell what is wanted"
    return None


def _content(one: _Spectra, edge: float | None, *, motion: bool) -> Content:
    measured = one.spectra["measured"]
    if one.signal.truth is not None:
        wanted, disturbance = one.spectra["true"], one.spectra["disturbance"]
        slow = _slow(one.signal.values - one.signal.truth, disturbance, one.file.sample_rate)
        return Content(name=one.name, wanted=wanted, disturbance=disturbance, has_truth=True, slow=slow)
    if motion:
        slow = _slow(one.signal.values, measured, one.file.sample_rate)
        return Content(name=one.name, wanted=None, disturbance=measured, has_truth=False, slow=slow)
    assert edge is not None
    return told_apart(one.name, measured, edge)


def _slow(disturbance: Values, found: Spectrum, sample_rate: float) -> float:
    return slow_rms(disturbance, round(sample_rate / found.step))


def _trial(one: _Spectra, proposal: Proposal) -> Trial | None:
    truth = one.signal.truth
    return None if truth is None else try_filter(one.signal.values, truth, one.signal.reading, proposal)


def _text_of(path: Path) -> str:
    return path.read_bytes().decode("utf-8-sig")  # it has been read and checked before


def _write(path: Path, content: bytes) -> None:
    write_contents(path.parent, {path.name: content})
    note(f"wrote {path}")


def _print_signals(signals: Sequence[_Spectra]) -> None:
    first = signals[0].spectra["measured"]
    table = new_table(
        f"Spectra of {first.averages} segments of {1 / first.step:.4g} s; the density of noise lies within "
        f"{first.lower:.3g} to {first.upper:.3g} times the estimate",
        ["signal", "of", "rms", "largest amplitudes"],
    )
    for one in signals:
        for key, found in one.spectra.items():
            unit = one.signal.unit
            shown = ", ".join(
                f"{amplitude:.3g} {unit} at {f:.4g} Hz" for f, amplitude in peaks(found) if amplitude > 1e-9
            )
            rms = f"{found.rms:.4g}" if found.rms > _NOTHING else "0"
            table.add_row(escape(one.name) if key == "measured" else "", key, f"{rms} {unit}", shown)
    TableConsole().print(table)


def _print_proposal(proposal: Proposal, signals: Sequence[_Spectra], trials: Sequence[Trial | None]) -> None:
    console = TableConsole()
    made, wish, unit = proposal.filter, proposal.wish, signals[0].signal.unit
    table = new_table(
        f"Proposal for {wish.coverage:g} times the rms error within {wish.tolerance:g} {unit}", ["", "", "why"]
    )
    for choice in proposal.choices:
        table.add_row(choice.key.replace("_", " "), f"{choice.value:.5g} {choice.unit}", escape(choice.reason))
    assert made.cutoff is not None
    table.add_row("order", str(made.order), f"the least for these, with its cutoff at {made.cutoff[0]:.5g} Hz (-3 dB)")
    table.add_row("group delay", f"{proposal.delay:.4g} s", "at zero frequency: by so much the output is late")
    console.print(table)
    checks = new_table(
        f"Error at the output, rms in {unit or 'the unit of the signal'}",
        ["signal", "disturbance", "filtered", "slow", "of the truth", "tried on the trace", "paper's -20 log10(delta)"],
    )
    for one, prediction, trial in zip(signals, proposal.predictions, trials, strict=True):
        disturbing = one.spectra.get("disturbance", one.spectra["measured"])
        delta, loss = ripple(disturbing, proposal["stopband_edge"])
        tried = "-"
        if trial is not None:
            where = f"{trial.samples:,} {'readings' if trial.at_readings else 'samples'}"
            tried = f"{trial.before:.3g} to {trial.after:.3g} ({where})"
        checks.add_row(
            escape(one.name),
            f"{prediction.unfiltered:.3g}",
            f"{prediction.disturbance:.3g}",
            f"{prediction.slow:.2g}" if prediction.slow > _NOTHING else "0",
            f"{prediction.wanted:.3g}" if prediction.wanted > _NOTHING else "0",
            tried,
            f"{loss:.1f} dB ({delta:.2g})",
        )
    console.print(checks)
