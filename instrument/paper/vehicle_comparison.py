"""Compares the vehicle's motion with tables 5 to 8 of the paper, figure by figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sosmith.instrument.paper.comparison import Comparison, compare
from sosmith.instrument.paper.figures import PaperFigures
from sosmith.instrument.vehicle.amplitude_spectrum import attenuation, ripple
from sosmith.instrument.vehicle.motion import Motion
from sosmith.instrument.vehicle.vehicle_report import VehicleRun

PAPER_SPEED = 20.0
"""Speed in m/s of section 5.1."""

MIN_SAMPLE_RATE = 100.0
"""In Hz; the paper's tables require motion up to `STOP_FREQUENCY`."""

STOP_FREQUENCY = 50.0
"""In Hz; section 5.3 reads the ripple delta there and prints -20 log10(delta)."""

MIN_RIPPLE = 1e-9
"""Lower limit of ripples, 180 dB; anything smaller is double-precision rounding."""

WHEELSETS = 6
"""Number of wheelsets of the vehicle; table 8 lists them first, then the bogies."""

_CONE = "a cone lifts one wheel as much as it lowers the other; real profiles do not, and a flange lifts its wheel"
_CANT = "ours is half the cant, as the inner rail keeps its height; how the paper's track is canted is not told"
_TWO = "the paper prints two lateral displacements for the wheels of one rigid wheelset"
_YAW = "hangs on the links' stiffness, radius and flange force, which the paper does not give"
_SCALE = "the scale of the paper's transform is not told: its yaw ripple of 0.1 exceeds its largest yaw, 0.0126 rad"


def run_comparison(made: VehicleRun, figures: PaperFigures) -> dict[int, tuple[Comparison, ...]]:
    """Compare a run with the paper's tables 5 to 8.

    Empty unless the run is over the paper's track at `PAPER_SPEED` with at least `MIN_SAMPLE_RATE`.
    """
    comparable = made.track == "paper" and made.speed == PAPER_SPEED and made.sample_rate >= MIN_SAMPLE_RATE
    return comparison(made.motion, figures) if comparable else {}


def comparison_json(tables: Mapping[int, tuple[Comparison, ...]]) -> list[dict[str, Any]]:
    """Return the comparisons in the order of the tables, numbers as floats."""
    return [
        {
            "table": str(number),
            "what": one.quantity,
            "unit": one.unit,
            "paper": None if one.printed is None else float(one.printed),
            "ours": None if one.ours is None else float(one.ours),
            "label": one.label,
            "why": one.explanation,
        }
        for number, rows in tables.items()
        for one in rows
    ]


def comparison(motion: Motion, figures: PaperFigures) -> dict[int, tuple[Comparison, ...]]:
    """Compare a motion with the paper's tables 5 to 8; the conditions are those of `run_comparison`.

    Returns the comparisons by table number, row by row. Which of them are comparable was decided before any result was
    known.
    """
    tables = {5: _vertical, 6: _lateral, 7: _yaw, 8: _attenuations}
    return {number: tuple(table(motion, figures)) for number, table in tables.items()}


def _vertical(motion: Motion, figures: PaperFigures) -> Iterator[Comparison]:
    for k, (right, left) in enumerate(figures.rows("table_5", "vertical")):
        for side, printed, rise in (("right", right, motion.right_wheel_rise), ("left", left, motion.left_wheel_rise)):
            ours = 1e3 * float(rise[:, k].max())
            yield compare(f"vertical, wheelset {k + 1}, {side} wheel", printed, ours, "mm", note=_CONE)
    ours = 1e3 * float(motion.frame_vertical.max())
    yield compare("vertical, bogie", figures.number("table_5", "frame"), ours, "mm", note=_CANT)


def _lateral(motion: Motion, figures: PaperFigures) -> Iterator[Comparison]:
    for k, (right, left) in enumerate(figures.rows("table_6", "lateral")):
        for side, printed, sign in (("right", right, -1), ("left", left, 1)):
            ours = 1e3 * float((sign * motion.wheelset_lateral[:, k]).max())
            name = f"lateral, wheelset {k + 1} to the {side}"
            yield compare(name, printed, ours, "mm", note=_TWO, comparable=False)


def _yaw(motion: Motion, figures: PaperFigures) -> Iterator[Comparison]:
    for k, row in enumerate(figures.rows("table_7", "yaw")):
        for bogie, printed in enumerate(row):
            ours = float(np.abs(motion.wheelset_yaw_to_frame[:, 3 * bogie + k]).max())
            yield compare(f"yaw, wheelset {k + 1} to bogie {bogie + 1}", printed, ours, "rad", note=_YAW)


def _attenuations(motion: Motion, figures: PaperFigures) -> Iterator[Comparison]:
    """Ripples in the units of the paper's own tables: mm, mm and rad."""
    rate = (len(motion.time) - 1) / float(motion.time[-1])
    columns = {
        "vertical": (1e3, motion.wheelset_vertical, motion.frame_vertical),
        "lateral": (1e3, motion.wheelset_lateral, motion.frame_lateral),
        "yaw": (1.0, motion.wheelset_yaw, motion.frame_yaw),
    }
    printed = {name: figures.numbers("table_8", name) for name in columns}
    for index in range(max(map(len, printed.values()))):
        bogie = index - WHEELSETS
        part = f"wheelset {index + 1}" if bogie < 0 else f"bogie {bogie + 1}"
        for name, (scale, wheelsets, frames) in columns.items():
            if index < len(printed[name]):
                values = wheelsets[:, index] if bogie < 0 else frames[:, bogie]
                delta = ripple(scale * values, round(rate, 6), STOP_FREQUENCY)
                ours = attenuation(max(delta, MIN_RIPPLE))
                quantity = f"{name} at 50 Hz, {part}"
                yield compare(quantity, printed[name][index], ours, "dB", note=_SCALE, comparable=False)
