"""The tables of spectra, and of the proposed filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sosmith.gen.facts.table import Table
from sosmith.gen.quantity import count
from sosmith.instrument.spectrum.peaks import RESOLVED, peaks, unresolved
from sosmith.instrument.spectrum.proposal import Proposal
from sosmith.instrument.spectrum.report import ripple
from sosmith.instrument.spectrum.spectra import Spectrum
from sosmith.instrument.spectrum.trial import Trial

_NOTHING = 1e-9
"""Figures below this, in any unit, are rounding errors of zero."""

Spectra = Mapping[str, Spectrum]
"""Spectra of a signal: "measured" and, if its truth is known, "true" and "disturbance"."""


def signals_table(names: Sequence[str], units: Sequence[str], spectra: Sequence[Spectra]) -> Table:
    """Return the rms and the largest amplitudes of each signal."""
    first = spectra[0]["measured"]
    rows = []
    for name, unit, parts in zip(names, units, spectra, strict=True):
        for key, part in parts.items():
            shown = [f"{amplitude:.3g} {unit} at {f:.4g} Hz" for f, amplitude in peaks(part) if amplitude > _NOTHING]
            slow = unresolved(part)
            if slow > _NOTHING:
                shown.append(f"about {slow:.2g} {unit} below {RESOLVED * part.step:.3g} Hz: --segment is too short")
            rms = f"{part.rms:.4g}" if part.rms > _NOTHING else "0"
            rows.append((name if key == "measured" else "", key, f"{rms} {unit}", ", ".join(shown)))
    return Table(
        f"Spectra of {first.averages} segments of {1 / first.step:.4g} s; the density of noise lies within "
        f"{first.lower:.3g} to {first.upper:.3g} times the estimate",
        rows,
        ("signal", "of", "rms", "largest amplitudes"),
    )


def proposal_tables(
    proposal: Proposal, unit: str, names: Sequence[str], spectra: Sequence[Spectra], trials: Sequence[Trial | None]
) -> list[Table]:
    """Return the parameters of the filter with their reasons, and the remaining error of each signal."""
    made, wish = proposal.filter, proposal.wish
    assert made.cutoff is not None
    parameters = [
        *((each.key.replace("_", " "), f"{each.value:.5g} {each.unit}", each.reason) for each in proposal.choices),
        ("order", str(made.order), f"the minimum for these, with the cutoff at {made.cutoff[0]:.5g} Hz (-3 dB)"),
        ("group delay", f"{proposal.delay:.4g} s", "at zero frequency: the delay of the output"),
    ]
    errors = []
    for name, parts, prediction, trial in zip(names, spectra, proposal.predictions, trials, strict=True):
        delta, loss = ripple(parts.get("disturbance", parts["measured"]), proposal["stopband_edge"])
        errors.append(
            (
                name,
                f"{prediction.unfiltered:.3g}",
                f"{prediction.disturbance:.3g}",
                f"{prediction.slow:.2g}" if prediction.slow > _NOTHING else "0",
                f"{prediction.wanted:.3g}" if prediction.wanted > _NOTHING else "0",
                "-" if trial is None else _tried(trial),
                f"{loss:.1f} dB ({delta:.2g})",
            )
        )
    head = (
        "signal",
        "disturbance",
        "filtered",
        "slow",
        "of the truth",
        "tried on the trace",
        "paper's -20 log10(delta)",
    )
    title = f"Proposal for {wish.coverage:g} times the rms error within {wish.tolerance:g} {unit}"
    return [
        Table(title, parameters, ("", "", "why")),
        Table(f"Error at the output, rms in {unit or 'the unit of the signal'}", errors, head),
    ]


def _tried(trial: Trial) -> str:
    where = count(trial.samples, "reading" if trial.at_readings else "sample")
    return f"{trial.before:.3g} to {trial.after:.3g} ({where})"
