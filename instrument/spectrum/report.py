"""Results of `sosmith spectrum` as JSON and as comments in a [filter] table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from sosmith.instrument.spectrum.peaks import peaks, unresolved
from sosmith.instrument.spectrum.prediction import Prediction
from sosmith.instrument.spectrum.proposal import Proposal
from sosmith.instrument.spectrum.settings import SpectrumSettings, Wish
from sosmith.instrument.spectrum.spectra import FINER, Spectrum
from sosmith.instrument.spectrum.trial import Trial
from sosmith.model.traces.signal_file import SignalFile


def ripple(found: Spectrum, edge: float) -> tuple[float, float]:
    """Largest amplitude delta from `edge` in Hz on, and ``-20 log10(delta)`` in dB, as in table 8 of the paper.

    The dB value grows as the disturbance shrinks, and depends on the unit: with delta in mm it is the level of the
    unfiltered signal below 1 mm, not an attenuation that a filter must have. It is infinite if delta is 0.
    """
    frequency = np.arange(len(found.fine_amplitude)) * found.step / FINER
    delta = float(np.max(found.fine_amplitude[frequency >= edge], initial=0.0))
    return delta, -20 * math.log10(delta) if delta > 0 else math.inf


def options_text(wish: Wish, settings: SpectrumSettings, *, motion: bool) -> str:
    """List the options that the proposal depends on, in one line."""
    given = asdict(wish) | asdict(settings) | {"motion": motion}
    del given["confidence"]  # does not affect the proposal
    shown = [f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}" for key, value in given.items()]
    return "options: " + ", ".join(text for text in shown if not text.endswith((" None", " False")))


def provenance(
    files: Sequence[SignalFile], wish: Wish, settings: SpectrumSettings, *, motion: bool, calibration: str
) -> list[str]:
    """Lines that describe the origin of a proposal."""
    lines = [
        f"{file.path.name} (sha256 {file.sha256}), {file.sample_rate:g} Hz: {', '.join(s.name for s in file.signals)}"
        for file in files
    ]
    return [*lines, f"calibration: {calibration}", options_text(wish, settings, motion=motion)]


def spectrum_json(found: Spectrum) -> dict[str, Any]:
    """Return one spectrum with its arrays."""
    return {
        "frequency_hz": found.frequency.tolist(),
        "density": found.density.tolist(),
        "amplitude": found.amplitude.tolist(),
        "averages": found.averages,
        "degrees_of_freedom": found.degrees_of_freedom,
        "confidence_factors": [found.lower, found.upper],
        "rms": found.rms,
        "peaks": [{"frequency_hz": frequency, "amplitude": amplitude} for frequency, amplitude in peaks(found)],
        "unresolved_amplitude": unresolved(found),
    }


def signal_json(
    name: str, file: SignalFile, unit: str, spectra: Mapping[str, Spectrum], trial: Trial | None
) -> dict[str, Any]:
    """Return one signal: its origin, its spectra by name, and the trial."""
    return {
        "name": name,
        "file": str(file.path),
        "sha256": file.sha256,
        "sample_rate_hz": file.sample_rate,
        "unit": unit,
        "spectra": {key: spectrum_json(found) for key, found in spectra.items()},
        "trial": None if trial is None else asdict(trial),
    }


def proposal_json(proposal: Proposal) -> dict[str, Any]:
    """Return the proposal: numbers with reasons, filter, delay, predictions."""
    made = proposal.filter
    return {
        "wish": asdict(proposal.wish),
        "filter": {"family": made.family, "kind": made.kind, "method": "bilinear"}
        | {choice.key: choice.value for choice in proposal.choices},
        "reasons": {choice.key: choice.reason for choice in proposal.choices},
        "needed_passband_edge_hz": proposal.needed,
        "order": made.order,
        "cutoff_hz": None if made.cutoff is None else made.cutoff[0],
        "group_delay_s": proposal.delay,
        "predictions": [_prediction_json(one) for one in proposal.predictions],
    }


def _prediction_json(one: Prediction) -> dict[str, Any]:
    return asdict(one) | {"rms": one.rms}
