"""The picture of wear: dates where the record has them, the prediction with its interval, the legend off the data."""

from __future__ import annotations

import re

import numpy as np
import pytest

from sosmith.instrument.wear.assessment import WearLimits, judge
from sosmith.instrument.wear.wear_plot import wear_plot

START = 19783.0
"""2024-03-01, in days since 1970-01-01."""


@pytest.mark.parametrize("dated", [True, False])
def test_axis_prediction_and_interval(dated: bool) -> None:
    time = START + np.arange(0, 60, 0.25)
    clearance = 1.5 + 0.08 * (time - START) + 0.02 * np.random.default_rng(1).standard_normal(len(time))
    report = judge(time, clearance, WearLimits(initial=1.5, limit=9.0, warning=7.0, sensor_range=10.5))
    drawn = wear_plot(time, clearance, report, "svg", dated=dated).decode()
    words = re.findall(r"<text[^>]*>([^<]*)</text>", drawn)
    assert ("2024-05-01" in words) == dated
    assert ("days from the beginning of the record" in words) != dated
    assert "95 % interval" in words
    assert f"reached in {report.life:.3g} d" in words
    # the legend begins to the right of where the axis ends
    places = {
        word: float(x) for x, word in re.findall(r'<text[^>]*?(?:x="|translate\()([\d.]+)[^>]*>([^<]*)</text>', drawn)
    }
    assert places["readings"] > max(
        float(x) for x in re.findall(r'<use xlink:href="#m\w*" x="([\d.]+)" y="\d', drawn)[:5]
    )
