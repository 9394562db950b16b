"""How often the intervals of depth, rate and remaining life hold, when clearances are worth what their budget says."""

from __future__ import annotations

import numpy as np

from sosmith.instrument.wear.assessment import ClearanceUncertainty, WearLimits, judge

RUNS, DAYS, RATE = 400, 60, 0.05
"""Records of wear, their length, and the true rate in mm a day."""

SEED = 2001
"""Of all of them."""

SCATTER, SYSTEMATIC, GAIN, OFFSET = 0.02, 0.10, 0.02, 0.10
"""Standard deviations: of a reading and of a day in mm, of the calibration's gain as a ratio, of its offset in mm."""


def wear_covered() -> dict[str, dict[str, float]]:
    """Return how often the intervals of depth, rate and life hold, with and without what the clearances are worth."""
    generator = np.random.default_rng(SEED)
    limits = WearLimits(initial=1.5, limit=9.0)
    time = np.arange(DAYS * 4) / 4.0
    true = 3.0 + RATE * time
    life = (limits.critical_clearance - true[-1]) / RATE
    inside: dict[str, dict[str, list[bool]]] = {what: {"with": [], "without": []} for what in ("depth", "rate", "life")}
    for _ in range(RUNS):
        gain, offset = generator.normal(0, GAIN), generator.normal(0, OFFSET)
        of_day = np.repeat(generator.normal(0, SYSTEMATIC, DAYS), 4)
        shown = true * (1 + gain) + offset + of_day + generator.normal(0, SCATTER, len(time))

        def worth(begin: float, now: float) -> ClearanceUncertainty:
            standard = float(np.sqrt(SCATTER**2 + SYSTEMATIC**2 + OFFSET**2 + (GAIN * now) ** 2))
            return ClearanceUncertainty(standard=standard, freedom=1e9, rise=GAIN * (now - begin))

        for name, known in (("with", worth), ("without", None)):
            report = judge(time, shown, limits, uncertainty=known)
            depth = float(true[-1]) - limits.initial
            low = 0.0 if report.life_low is None else report.life_low
            high = np.inf if report.life_high is None else report.life_high
            inside["depth"][name].append(report.wear_low <= depth <= report.wear_high)
            inside["rate"][name].append(report.rate.low <= RATE <= report.rate.high)
            inside["life"][name].append(low <= life <= high)
    return {
        what: {name: round(float(np.mean(held)), 4) for name, held in found.items()} for what, found in inside.items()
    }
