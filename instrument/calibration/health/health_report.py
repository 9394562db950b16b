"""The health of a sensor as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from sosmith.instrument.calibration.health.explanation import REASONS
from sosmith.instrument.calibration.health.monitoring import Health, date_of

DIGITS = 4
"""Decimals: elementary functions may differ in the last bits from machine to machine."""


def health_json(sensor: str, found: Health) -> dict[str, Any]:
    """Return the charts, their alarms, and the notice of the last day; each day's numbers are standard normal ones."""
    known, notice = found.innovations, found.notice
    return {
        "sensor": sensor,
        "alarms": [
            {
                "chart": alarm.chart.name,
                "date": alarm.raised,
                "since": alarm.begin,
                "upwards": alarm.chart.upwards,
                "explanation": alarm.explanation.best.name,
                "probabilities": {
                    reason.name: round(probability, DIGITS)
                    for reason, probability in zip(REASONS, alarm.explanation.probabilities, strict=True)
                },
                "sentence": alarm.sentence,
            }
            for alarm in found.alarms
        ],
        "notice": None
        if notice is None
        else {
            "date": notice.date,
            "reads_more_by_mm": round(notice.shift, DIGITS),
            "deviations": round(notice.deviations, DIGITS),
            "sentence": notice.sentence,
        },
        "charts": {
            chart.name: {"limit": chart.limit, "values": np.round(chart.values, DIGITS).tolist()}
            for chart in found.charts
        },
        "first_day": found.first,
        "days": [
            {
                "date": date_of(day),
                "measurements": int(known.count[k]),
                "outliers": int(known.outliers[k]),
                "offset": round(float(known.offset[k]), DIGITS),
                "gain": round(float(known.gain[k]), DIGITS),
                "scatter": round(float(known.scatter[k]), DIGITS),
                "reads_more_by_mm": round(-float(known.shift[k]), DIGITS),
            }
            for k, day in enumerate(known.days)
        ],
    }
