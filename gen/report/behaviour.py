"""What a run says about the core as an instrument: error against the true value, delay, settling time, aliases."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from sosmith.gen.filter.decimation import decimated_step
from sosmith.gen.filter.response import FilterFacts, group_delay, magnitude_db, measurement_grid, passbands
from sosmith.gen.filter.step_response import SETTLED, StepResponse, step_response
from sosmith.gen.output.core_facts import CoreFacts
from sosmith.gen.output.decimation_facts import DecimationFacts
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.run import Mask
from sosmith.model.reference.accuracy import ErrorStatistics, error_statistics


@dataclass(frozen=True, kw_only=True)
class Behaviour:
    """Figures of the core, and of its filter with integer coefficients and what decimates before it.

    Attributes
    ----------
    true_error : ErrorStatistics or None
        Hardware minus true value at the readings, in the output's unit; None where no true value is known.
    readings : int
        Samples that this counts.
    delay, delay_hz : float or None
        Group delay in s, and the frequency in Hz at which it is taken: zero, or the middle of the passband where
        constants do not pass; None without a filter.
    step : StepResponse or None
        None without a filter, or if it is too slow.
    settling : float or None
        Time in s after a step until the output stays within `SETTLED` of it.
    settling_to_lsb : float or None
        Time in s after a step over the whole range of the output until the output stays within half an LSB.
    transient : int
        Samples at the beginning of this run that the hardware flags as settling.
    """

    true_error: ErrorStatistics | None
    readings: int
    delay: float | None
    delay_hz: float | None
    step: StepResponse | None
    settling: float | None
    settling_to_lsb: float | None
    transient: int


def behaviour(evidence: Evidence) -> Behaviour:
    """Measure a run and its filter; of several channels, all count for the error against the true value."""
    error = true_error(evidence)
    facts, (low, high) = evidence.facts.filter, evidence.facts.range
    span = high - low
    step = None if facts is None else _step(facts, evidence.facts.lsb, span, evidence.facts.decimation)
    delay = None if facts is None else _delay(facts)
    if delay is not None and evidence.facts.decimation is not None:
        delay = (
            evidence.facts.decimation.delay,
            delay[1],
        )  # of decimator and filter, at zero frequency as the filter's own
    return Behaviour(
        true_error=None if error is None else error_statistics(error),
        readings=0 if error is None else error.size,
        delay=None if delay is None else delay[0],
        delay_hz=None if delay is None else delay[1],
        step=step,
        settling=None if step is None else step.samples_to(SETTLED) / step.sample_rate,
        settling_to_lsb=None if step is None else step.samples_to(evidence.facts.lsb / 2 / span) / step.sample_rate,
        transient=_transient(evidence),
    )


def true_error(evidence: Evidence) -> Any:
    """Hardware minus true value at the readings, shape (readings,); None if there are none."""
    if evidence.run.truth is None:
        return None
    error, reading = evidence.run.minus(evidence.run.truth), readings_of(evidence)
    counted = error.ravel() if reading is None else error[reading]
    return counted if counted.size else None


def readings_of(evidence: Evidence) -> Mask | None:
    """Return which samples count against the true value; None for all.

    Those that the trace marks, else all that the hardware does not flag as settling.
    """
    if evidence.run.reading is not None or evidence.run.unsettled is None:
        return evidence.run.reading  # readings are marked where a scenario holds them settled
    return ~evidence.run.unsettled


def _transient(evidence: Evidence) -> int:
    """Count the samples before the first one that is settled in all channels."""
    if evidence.run.unsettled is None:
        return 0
    flagged = evidence.run.unsettled.reshape(len(evidence.run), -1).any(axis=1)
    return int(np.argmin(np.append(flagged, False)))


def behaviour_entry(measured: Behaviour) -> dict[str, Any]:
    """Return the entries of `report.json`; lengths of time in s."""
    error, step = measured.true_error, measured.step
    return {
        "true_error": None
        if error is None
        else {"max_abs": error.max_abs, "rms": error.rms, "mean": error.mean, "readings": measured.readings},
        "delay": None if measured.delay is None else {"seconds": measured.delay, "frequency": measured.delay_hz},
        "settling": None
        if step is None
        else {
            "seconds": measured.settling,
            "half_lsb_seconds": measured.settling_to_lsb,
            "overshoot_percent": None if step.overshoot is None else 100 * step.overshoot,
        },
    }


def aliases_entry(facts: CoreFacts) -> dict[str, float | None] | None:
    """Return the exact filter's largest gains of aliases, in dB: of all, and in the pass band; None if it has none.

    Those of a CIC decimator with its filter are proven, those of an FIR filter that decimates are measured.
    """
    if facts.decimation is not None:
        passing = max(band.passing_db for band in facts.decimation.aliasing)
        return {"anywhere_db": facts.decimation.largest_db, "passband_db": passing}
    if facts.downsampling is None or facts.filter is None:
        return None
    return _measured_aliases(facts.filter, facts.downsampling.sample_rate)


def _measured_aliases(facts: FilterFacts, rate: float) -> dict[str, float | None]:
    grid = measurement_grid(facts)
    above = grid[grid >= rate / 2]
    gain = magnitude_db(facts.ideal_sos, above, facts.sample_rate)
    lands = np.abs(above - rate * np.round(above / rate))
    bands = passbands(facts)
    inside = gain[lands <= bands[0][1]] if facts.kind == "lowpass" and bands else gain[:0]
    return {"anywhere_db": float(gain.max()), "passband_db": float(inside.max()) if inside.size else None}


def _step(facts: FilterFacts, lsb: float, span: float, before: DecimationFacts | None) -> StepResponse | None:
    factor, stages = (1, 0) if before is None else (before.factor, before.stages)
    return _cached_step(
        facts.quantized_sos.tobytes(), len(facts.quantized_sos), facts.sample_rate, lsb / 2 / span, factor, stages
    )


@lru_cache(maxsize=8)
def _cached_step(
    sections: bytes, count: int, sample_rate: float, precision: float, factor: int, stages: int
) -> StepResponse | None:
    sos = np.frombuffer(sections).reshape(count, -1)
    return step_response(sos, sample_rate, precision, decimated_step(factor, stages))


def _delay(facts: FilterFacts) -> tuple[float, float] | None:
    frequency = 0.0
    bands = passbands(facts)
    if facts.kind == "bandpass" and bands:
        frequency = math.sqrt(bands[0][0] * bands[0][1])
    elif facts.kind == "highpass" and bands:
        frequency = sum(bands[0]) / 2
    (delay,) = group_delay(facts.quantized_sos, np.array([frequency]), facts.sample_rate).tolist()
    return (delay, frequency) if math.isfinite(delay) else None
