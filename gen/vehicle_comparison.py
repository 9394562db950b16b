"""The vehicle's motion beside tables 5 to 8 of the paper, each figure labelled by a rule laid down here."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sosmith.gen.amplitude_spectrum import attenuation, ripple
from sosmith.model.paper_figures import PaperFigures, read_paper_figures
from sosmith.model.vehicle_motion import Motion

PAPER_SPEED = 20.0
"""Speed in m/s of section 5.1."""

REPRODUCED = 0.05
"""A figure of the same quantity is reproduced within this relative distance."""

NEAR = 2.0
"""It is near within this factor, and otherwise not comparable."""

STOP_FREQUENCY = 50.0
"""In Hz; section 5.3 reads the ripple delta there and prints -20 log10(delta)."""

SMALLEST_RIPPLE = 1e-9
"""Ripples below count as this one, 180 dB: less is the rounding of doubles."""

_WHEELSETS = 6
_BOGIES = 2

_CONE = "a cone lifts one wheel as much as it lowers the other; real profiles, and the flange, do not"
_CANT = "ours is half the cant, as the inner rail keeps its height; how the paper's track is canted is not told"
_TWO = "the paper prints two lateral displacements for the wheels of one rigid wheelset; and ours has no flange"
_YAW = "hangs on the links' stiffness, radius and flange force, which the paper does not give; ours has no flange"
_SCALE = "the scale of the paper's transform is not told: its yaw ripple of 0.1 exceeds its largest yaw, 0.0126 rad"


@dataclass(frozen=True, kw_only=True)
class Row:
    """A figure of the paper and ours.

    Attributes
    ----------
    table : str
        "5", "6", "7", "8", or "text" for section 5.2.
    what, unit : str
    paper, ours : float
    same_quantity : bool
        Whether both are the same quantity, decided before any result.
    why : str
        What stands between the two.
    """

    table: str
    what: str
    unit: str
    paper: float
    ours: float
    same_quantity: bool
    why: str

    @property
    def label(self) -> str:
        """By the rule: "reproduced" within `REPRODUCED`, "near" within `NEAR`, else "not comparable"."""
        if self.same_quantity and self.ours > 0:
            if abs(self.ours / self.paper - 1) <= REPRODUCED:
                return "reproduced"
            if 1 / NEAR <= self.ours / self.paper <= NEAR:
                return "near"
        return "not comparable"


def comparison(motion: Motion) -> tuple[Row, ...]:
    """Set a run over the paper's track at `PAPER_SPEED` beside the paper's tables; at least 100 samples per second."""
    figures = read_paper_figures()
    tables = (_vertical, _lateral, _yaw, _attenuations)
    return tuple(row for table in tables for row in table(motion, figures))


def _vertical(motion: Motion, figures: PaperFigures) -> Iterator[Row]:
    for k, (right, left) in enumerate(figures.rows("table_5", "vertical")):
        for side, paper, rise in (("right", right, motion.right_wheel_rise), ("left", left, motion.left_wheel_rise)):
            yield Row(
                table="5",
                what=f"vertical, wheelset {k + 1}, {side} wheel",
                unit="mm",
                paper=float(paper),
                ours=1e3 * float(rise[:, k].max()),
                same_quantity=True,
                why=_CONE,
            )
    yield Row(
        table="text",
        what="vertical, bogie",
        unit="mm",
        paper=float(figures.number("table_5", "frame")),
        ours=1e3 * float(motion.frame_vertical.max()),
        same_quantity=True,
        why=_CANT,
    )


def _lateral(motion: Motion, figures: PaperFigures) -> Iterator[Row]:
    for k, (right, left) in enumerate(figures.rows("table_6", "lateral")):
        for side, paper, sign in (("right", right, -1), ("left", left, 1)):
            yield Row(
                table="6",
                what=f"lateral, wheelset {k + 1} to the {side}",
                unit="mm",
                paper=float(paper),
                ours=1e3 * float((sign * motion.wheelset_lateral[:, k]).max()),
                same_quantity=False,
                why=_TWO,
            )


def _yaw(motion: Motion, figures: PaperFigures) -> Iterator[Row]:
    printed = figures.rows("table_7", "yaw")
    for bogie in range(_BOGIES):
        for k, row in enumerate(printed):
            yaw = motion.wheelset_yaw_to_frame[:, 3 * bogie + k]
            yield Row(
                table="7",
                what=f"yaw, wheelset {k + 1} to bogie {bogie + 1}",
                unit="rad",
                paper=float(row[bogie]),
                ours=float(np.abs(yaw).max()),
                same_quantity=True,
                why=_YAW,
            )


def _attenuations(motion: Motion, figures: PaperFigures) -> Iterator[Row]:
    """Ripples in the units of the paper's own tables: mm, mm and rad."""
    rate = (len(motion.time) - 1) / float(motion.time[-1])
    names = ("vertical", "lateral", "yaw")
    printed = {name: figures.numbers("table_8", name) for name in names}
    for index in range(_WHEELSETS + _BOGIES):
        if index < _WHEELSETS:
            k, part = index, f"wheelset {index + 1}"
            motions = (motion.wheelset_vertical, motion.wheelset_lateral, motion.wheelset_yaw)
        else:
            k = index - _WHEELSETS
            part, motions = f"bogie {k + 1}", (motion.frame_vertical, motion.frame_lateral, motion.frame_yaw)
        for name, values, scale in zip(names, motions, (1e3, 1e3, 1.0), strict=True):
            if index < len(printed[name]):
                delta = ripple(scale * values[:, k], round(rate, 6), STOP_FREQUENCY)
                yield Row(
                    table="8",
                    what=f"{name} at 50 Hz, {part}",
                    unit="dB",
                    paper=float(printed[name][index]),
                    ours=attenuation(max(delta, SMALLEST_RIPPLE)),
                    same_quantity=False,
                    why=_SCALE,
                )
