"""From trace files to spectra and a proposal, as `sosmith spectrum` shows them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sosmith.gen.core import polynomial_of
from sosmith.gen.facts.table import Table, View
from sosmith.gen.specification.specification import load
from sosmith.instrument.spectrum.filter_table import filter_table, replace_filter
from sosmith.instrument.spectrum.plot import Curve, spectrum_plot
from sosmith.instrument.spectrum.prediction import Content, told_apart
from sosmith.instrument.spectrum.proposal import Proposal, propose
from sosmith.instrument.spectrum.report import proposal_json, provenance, signal_json
from sosmith.instrument.spectrum.settings import SpectrumSettings, Wish
from sosmith.instrument.spectrum.spectra import Spectrum, slow_rms, spectrum
from sosmith.instrument.spectrum.tables import proposal_tables, signals_table
from sosmith.instrument.spectrum.trial import Trial, try_filter
from sosmith.model.arrays import Values
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import EQUATION_5A, Polynomial
from sosmith.model.tables.csv_table import csv_header
from sosmith.model.traces.signal_file import Signal, SignalFile, read_signal_file
from sosmith.model.traces.trace_file import TIME_TOLERANCE


@dataclass(frozen=True, eq=False, kw_only=True)
class SignalSpectra:
    """A signal with its name, file and spectra: "measured" and, if its truth is known, "true" and "disturbance"."""

    name: str
    file: SignalFile
    signal: Signal
    spectra: dict[str, Spectrum]


@dataclass(frozen=True, eq=False, kw_only=True)
class Survey(View):
    """Spectra of traces, and the filter proposed from them.

    Attributes
    ----------
    settings : SpectrumSettings
        How the spectra were estimated.
    signals : list of SignalSpectra
        Every signal of every trace.
    proposal : Proposal or None
        The proposed filter, None if `obstacle` or `shortfall` says why there is none.
    trials : list of Trial or None
        The proposed filter applied to each signal, None if the signal has no truth or there is no proposal.
    obstacle : str or None
        What is missing for a proposal.
    shortfall : ShortfallError or None
        Why no filter is needed, or why none is good enough.
    table : str or None
        The proposal as TOML: the table ``[filter]``, or a whole specification with it.
    """

    settings: SpectrumSettings
    signals: list[SignalSpectra]
    proposal: Proposal | None
    trials: list[Trial | None]
    obstacle: str | None
    shortfall: ShortfallError | None
    table: str | None

    def plot(self, file_format: str) -> bytes:
        """Plot the spectra, with the mask and the response of the proposal if there is one."""
        curves = [
            Curve(name=f"{one.name}, {key}" if len(one.spectra) > 1 else one.name, unit=one.signal.unit, spectrum=s)
            for one in self.signals
            for key, s in one.spectra.items()
        ]
        return spectrum_plot(curves, self.proposal, file_format)

    def tables(self) -> list[Table]:
        """Return the spectra and, if there is a proposal, the filter and its remaining error."""
        names, spectra = [one.name for one in self.signals], [one.spectra for one in self.signals]
        units = [one.signal.unit for one in self.signals]
        measured = signals_table(names, units, spectra)
        if self.proposal is None:
            return [measured]
        return [measured, *proposal_tables(self.proposal, units[0], names, spectra, self.trials)]

    def as_dict(self) -> dict[str, Any]:
        """Return settings, signals and proposal in JSON types."""
        signals = [
            signal_json(one.name, one.file, one.signal.unit, one.spectra, trial)
            for one, trial in zip(self.signals, self.trials, strict=True)
        ]
        proposal = None if self.proposal is None else proposal_json(self.proposal)
        return {"settings": asdict(self.settings), "signals": signals, "proposal": proposal}


def survey(
    traces: Sequence[Path],
    settings: SpectrumSettings,
    wish: Wish,
    *,
    columns: Sequence[str] = (),
    truth: str | None = None,
    channels: Sequence[int] = (),
    calibration: Path | None = None,
    into: Path | None = None,
    output: Path | None = None,
    motion: bool = False,
    progress: Callable[[str], None] = lambda step: None,
) -> Survey:
    """Estimate the spectra of traces, and propose a low-pass filter from them.

    Parameters
    ----------
    traces : sequence of Path
        CSV files.
    settings : SpectrumSettings
        How spectra are estimated.
    wish : Wish
        Requirements on the filter.
    columns, truth, channels
        Columns of values to use where a trace has them, the column with the true signal, and the channels to use;
        all of them if empty.
    calibration : Path or None
        Specification whose calibration computes the clearance; None for that of `into`, or else equation 5a.
    into, output : Path or None
        Specification to put the filter into, and the file that the caller will write the result to.
    motion : bool
        Whether traces without a truth are disturbance only.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    SpecificationError
        If a file cannot be used, or `into` or `output` is given and no filter can be proposed.
    """
    progress("reading")
    polynomial, origin = _polynomial(calibration or into)
    files = _read(traces, polynomial, columns, truth, channels)
    rate = _sample_rate(files, into)
    _check_data(into, output)
    progress("spectra")
    signals = [_spectra_of(file, one, settings) for file in files for one in file.signals]
    obstacle = _obstacle(signals, wish.passband, motion=motion)
    if obstacle and (output or into):
        raise SpecificationError(obstacle)
    proposal, shortfall, table = None, None, None
    if not obstacle:
        progress("proposing")
        contents = [_content(one, wish.passband, motion=motion) for one in signals]
        proposal, shortfall = _proposed(contents, wish, rate)
    if proposal is not None:
        table = filter_table(proposal, provenance(files, wish, settings, motion=motion, calibration=origin))
        if into is not None:
            table = replace_filter(_text_of(into), table, str(into))
    return Survey(
        settings=settings,
        signals=signals,
        proposal=proposal,
        trials=[None if proposal is None else _trial(one, proposal) for one in signals],
        obstacle=obstacle,
        shortfall=shortfall,
        table=table,
    )


def _proposed(
    contents: Sequence[Content], wish: Wish, sample_rate: float
) -> tuple[Proposal | None, ShortfallError | None]:
    """Propose a filter, or return why there is none: the spectra are shown either way."""
    try:
        return propose(contents, wish, sample_rate), None
    except ShortfallError as shortfall:
        return None, shortfall


def _polynomial(path: Path | None) -> tuple[Polynomial, str]:
    """Return the calibration of a specification, equation 5a without one, and its name."""
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
    """Read each file with the requested columns that it has; each column must be in at least one file."""
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
    """Return the sample rate of the filter, Hz: that of `into` if given, with which the traces must agree."""
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
    """Refuse a copy in another folder, where its path to the measurements would be wrong."""
    if into is None or output is None:
        return
    calibration = load(into).calibration
    if calibration is not None and calibration.data is not None and into.parent.resolve() != output.parent.resolve():
        raise SpecificationError(
            f"{output}: the copy must be in the folder of {into}, whose calibration.data is found from there"
        )


def _spectra_of(file: SignalFile, one: Signal, settings: SpectrumSettings) -> SignalSpectra:
    parts = {"measured": one.values}
    if one.truth is not None:
        parts |= {"true": one.truth, "disturbance": one.values - one.truth}
    spectra = {key: spectrum(values, file.sample_rate, settings) for key, values in parts.items()}
    return SignalSpectra(name=f"{file.path.name}: {one.name}", file=file, signal=one, spectra=spectra)


def _obstacle(signals: Sequence[SignalSpectra], edge: float | None, *, motion: bool) -> str | None:
    """Return why no filter can be proposed, or None."""
    units = list(dict.fromkeys(one.signal.unit or "no unit" for one in signals))
    if len(units) > 1:
        return f"the signals must have one unit, not {' and '.join(units)}: choose among them with --column"
    unknown = [one.name for one in signals if one.signal.truth is None]
    if edge is None and unknown and (not motion or len(unknown) == len(signals)):
        return f"--passband or --time-constant must be given, as {unknown[0]} has no truth to tell what is wanted"
    return None


def _content(one: SignalSpectra, edge: float | None, *, motion: bool) -> Content:
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


def _trial(one: SignalSpectra, proposal: Proposal) -> Trial | None:
    truth = one.signal.truth
    return None if truth is None else try_filter(one.signal.values, truth, one.signal.reading, proposal)


def _text_of(path: Path) -> str:
    return path.read_bytes().decode("utf-8-sig")  # already read and checked
