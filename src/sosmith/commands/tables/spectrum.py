"""The tables of spectra, and of the proposed filter."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.instrument.spectrum.peaks import peaks
from sosmith.instrument.spectrum.proposal import Proposal
from sosmith.instrument.spectrum.report import ripple
from sosmith.instrument.spectrum.survey import SignalSpectra
from sosmith.instrument.spectrum.trial import Trial

_NOTHING = 1e-9
"""Figures below this, in any unit, are rounding errors of zero."""


def print_signals(signals: Sequence[SignalSpectra]) -> None:
    """Print the rms and the largest amplitudes of each signal."""
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


def print_proposal(proposal: Proposal, signals: Sequence[SignalSpectra], trials: Sequence[Trial | None]) -> None:
    """Print the parameters of the filter with their reasons, and the remaining error."""
    console = TableConsole()
    made, wish, unit = proposal.filter, proposal.wish, signals[0].signal.unit
    table = new_table(
        f"Proposal for {wish.coverage:g} times the rms error within {wish.tolerance:g} {unit}", ["", "", "why"]
    )
    for choice in proposal.choices:
        table.add_row(choice.key.replace("_", " "), f"{choice.value:.5g} {choice.unit}", escape(choice.reason))
    assert made.cutoff is not None
    table.add_row(
        "order", str(made.order), f"the minimum for these, with the cutoff at {made.cutoff[0]:.5g} Hz (-3 dB)"
    )
    table.add_row("group delay", f"{proposal.delay:.4g} s", "at zero frequency: the delay of the output")
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
