"""Levels of a run in dB of full scale, and distortion and noise of a test tone, for filters of sound."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.report.evidence import Evidence
from sosmith.model.full_scale import peak_dbfs, rms_dbfs
from sosmith.model.reference.accuracy import ErrorStatistics, error_statistics
from sosmith.model.reference.sine_fit import SineFit, sine_fit


def sound_entry(evidence: Evidence, error: ErrorStatistics) -> dict[str, Any] | None:
    """Return the entry ``sound`` of `report.json`; None for what is not sound.

    Returns
    -------
    dict or None
        In dB of full scale, None for silence: ``peak_dbfs`` and ``rms_dbfs`` of the output over all channels,
        ``error_peak_dbfs`` and ``error_rms_dbfs`` of hardware minus exact calculation. ``tone``: None unless the trace
        is a sine of which enough is settled; else ``frequency`` in Hz, ``level_dbfs`` of the sine at the output,
        ``thd_n_db`` of the channel with the most and ``exact_thd_n_db`` of the exact calculation on the same input
        codes. See `sosmith.model.full_scale` and `sosmith.model.reference.sine_fit` for the formulas.
    """
    if not evidence.facts.is_sound:
        return None
    level = error_statistics(evidence.run.hardware)
    return {
        "peak_dbfs": peak_dbfs(level.max_abs),
        "rms_dbfs": rms_dbfs(level.rms),
        "error_peak_dbfs": peak_dbfs(error.max_abs),
        "error_rms_dbfs": rms_dbfs(error.rms),
        "tone": _tone_entry(evidence),
    }


def _tone_entry(evidence: Evidence) -> dict[str, Any] | None:
    run, facts = evidence.run, evidence.facts
    if run.tone is None or facts.filter is None:
        return None
    frequency, first, rate = float(run.tone.frequency), run.tone.settled, facts.filter.sample_rate

    def fits(values: npt.NDArray[Any]) -> list[SineFit]:
        columns = values.reshape(len(values), -1)[first:].T
        return [fit for column in columns if (fit := sine_fit(column, frequency, rate)) is not None]

    # from the codes themselves: a value is its code times an LSB, so the ratio is the same
    hardware, exact = fits(np.asarray(run.received)), fits(run.golden)
    if not hardware:
        return None
    return {
        "frequency": frequency,
        "level_dbfs": peak_dbfs(max(fit.amplitude for fit in hardware) * facts.lsb),
        "thd_n_db": _most(hardware),
        "exact_thd_n_db": _most(exact),
    }


def _most(fits: Sequence[SineFit]) -> float | None:
    return max((fit.thd_n_db for fit in fits if fit.thd_n_db is not None), default=None)
