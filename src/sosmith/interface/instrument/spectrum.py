"""Spectra of traces, and the filter proposed from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from sosmith.instrument.spectrum.settings import COVERAGE, TOLERANCE, SpectrumSettings, Wish
from sosmith.instrument.spectrum.survey import Survey
from sosmith.instrument.spectrum.survey import survey as run
from sosmith.model.errors import SpecificationError


def survey(
    traces: Sequence[Path],
    *,
    columns: Sequence[str] = (),
    truth: str | None = None,
    channels: Sequence[int] = (),
    calibration: Path | None = None,
    motion: bool = False,
    tolerance: float = TOLERANCE,
    coverage: float = COVERAGE,
    passband: float | None = None,
    time_constant: float | None = None,
    passband_loss: float | None = None,
    window: str = "hann",
    segment: float | None = None,
    overlap: float = 0.5,
    detrend: str = "linear",
    confidence: float = 0.95,
    into: Path | None = None,
    output: Path | None = None,
    progress: Callable[[str], None] = lambda step: None,
) -> Survey:
    """Estimate the spectra of traces, and propose a low-pass filter from them.

    Parameters
    ----------
    traces : sequence of Path
        CSV files.
    columns, truth, channels
        Columns of values to use where a trace has them, the column with the true signal, and the channels to use;
        all of them if empty.
    calibration : Path or None
        Specification whose calibration computes the clearance; None for that of `into`, or else equation 5a.
    motion : bool
        Whether traces without a truth are disturbance only.
    tolerance, coverage, passband, passband_loss
        As in `sosmith.instrument.spectrum.settings.Wish`; `time_constant` in s gives the passband edge instead.
    window, segment, overlap, detrend, confidence
        As in `sosmith.instrument.spectrum.settings.SpectrumSettings`.
    into, output : Path or None
        Specification to put the filter into, and the file that the caller will write the result to.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    SpecificationError
        If a file or a value cannot be used, or `into` or `output` is given and no filter can be proposed.
    """
    settings = SpectrumSettings(window=window, segment=segment, overlap=overlap, detrend=detrend, confidence=confidence)
    edge = _pass_edge(passband, time_constant)
    wish = Wish(tolerance=tolerance, coverage=coverage, passband=edge, passband_loss=passband_loss)
    return run(
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
        progress=progress,
    )


def _pass_edge(passband: float | None, time_constant: float | None) -> float | None:
    if time_constant is None:
        return passband
    if passband is not None:
        raise SpecificationError("the passband edge must be given by one of --passband and --time-constant, not both")
    if not 0 < time_constant < math.inf:
        raise SpecificationError(f"time-constant must be a positive number of seconds, not {time_constant:g}")
    return float(f"{1 / (2 * math.pi * time_constant):.5g}")  # as many digits as the other numbers of the proposal
