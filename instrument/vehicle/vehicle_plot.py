"""Figures of a run of the vehicle, as an SVG or PNG file; the same run gives the same bytes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.picture import BLUE, GREEN, GREY, RED, legend_below, picture
from sosmith.instrument.vehicle.amplitude_spectrum import Array, amplitude_spectrum
from sosmith.instrument.vehicle.vehicle_report import TRACKS, VehicleRun, vehicle_run
from sosmith.model.errors import SpecificationError

SMALLEST = 1e-6
"""Smallest amplitude drawn, in mm: a nanometre."""

_COLOURS = (BLUE, RED, GREEN)


def linear_beside(made: VehicleRun) -> VehicleRun | None:
    """Run the linear model over the same track; None if it is what ran, or is unstable at this speed."""
    if made.model == "linear":
        return None
    try:
        return vehicle_run(
            made.parameters,
            track=made.track,
            speed=made.speed,
            sample_rate=made.sample_rate,
            irregularities=made.irregularities,
            seed=made.seed,
            model="linear",
        )
    except SpecificationError:
        return None


def vehicle_plot(made: VehicleRun, file_format: str, beside: VehicleRun | None = None) -> bytes:
    """Draw motions and forces over the distance, and spectra.

    Parameters
    ----------
    made : VehicleRun
        What to draw.
    file_format : str
        One of `sosmith.gen.picture.FORMATS`.
    beside : VehicleRun, optional
        The linear model's run over the same track, drawn for the leading wheelset.
    """
    motion = made.motion

    def paint(figure: Figure) -> None:
        axes = figure.subplots(4, 2)
        random = "" if made.irregularities == "none" else f", irregularities {made.irregularities}, seed {made.seed}"
        figure.suptitle(f"Co-Co locomotive, {made.track} track, {made.speed:g} m/s{random}: {made.model} contacts")
        _draw(axes[0, 0], made, 1e3 * motion.lateral_to_rails, "lateral (mm)", "Wheelsets, lateral to the rails")
        _draw_flanges(axes[0, 0], made)
        title = "The leading wheelset, lateral to the rails"
        _draw_beside(axes[0, 1], made, beside, "lateral_to_rails", 1e3, "lateral (mm)", title)
        _draw_flanges(axes[0, 1], made)
        _draw(axes[1, 0], made, motion.clearance_mm, "change (mm)", "Clearance at the right wheels' sensors")
        title = "Clearance at the leading wheelset's sensor"
        _draw_beside(axes[1, 1], made, beside, "clearance_mm", 1.0, "change (mm)", title)
        _draw(
            axes[2, 0],
            made,
            motion.friction_used,
            "of the limit (1)",
            "Creep force over friction",
        )
        _draw(
            axes[2, 1],
            made,
            motion.derailment_quotient,
            "Y/Q (1)",
            "Guiding force over wheel load",
        )
        _draw_vertical(axes[3, 0], made)
        _draw_spectra(axes[3, 1], made, motion.clearance_mm, "Spectrum of the clearance")
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=6, frameon=False)

    style = {"path.simplify": True, "path.simplify_threshold": 0.3, "text.parse_math": True}  # powers of ten
    return picture("vehicle", (11, 13), paint, file_format, style=style)


def _draw(axes: Axes, made: VehicleRun, values: Array, label: str, title: str) -> None:
    """Draw six lines over the distance, front bogie solid, rear bogie thin."""
    for k in range(6):
        name = f"wheelset {k + 1}"
        axes.plot(
            made.motion.distance, values[:, k], color=_COLOURS[k % 3], lw=1.1 if k < 3 else 0.6, label=name, zorder=2
        )
    _mark_track(axes, made)
    axes.set(xlabel="distance of the first wheelset (m)", ylabel=label)
    axes.set_title(title, loc="left")


def _draw_beside(
    axes: Axes, made: VehicleRun, beside: VehicleRun | None, name: str, scale: float, label: str, title: str
) -> None:
    """Draw the leading wheelset's motion by both models."""
    runs = [(made, BLUE, 1.1)] if beside is None else [(beside, GREY, 1.1), (made, BLUE, 1.1)]
    for one, colour, width in runs:
        values = scale * getattr(one.motion, name)[:, 0]
        axes.plot(one.motion.distance, values, color=colour, lw=width, label=f"{one.model} contacts")
    _mark_track(axes, made)
    legend_below(axes)
    axes.set(xlabel="distance of the first wheelset (m)", ylabel=label)
    axes.set_title(title, loc="left")


def _draw_flanges(axes: Axes, made: VehicleRun) -> None:
    """Draw where the flanges of the leading wheelset meet the rails; gauge widening moves it."""
    distance = made.motion.distance
    track = TRACKS[made.track](made.parameters.track)
    room = 1e3 * (made.parameters.sensor.flange_clearance + track.widening_at(distance) / 2)
    for side in (-room, room):
        axes.plot(distance, side, color=GREY, lw=0.8, ls="--")
    axes.text(distance[-1], -room[-1], "flange ", ha="right", va="top", color=GREY)


def _draw_vertical(axes: Axes, made: VehicleRun) -> None:
    motion = made.motion
    lines = {
        "rails at wheelset 1": motion.wheelset_vertical[:, 0],
        "frame 1": motion.frame_vertical[:, 0],
        "body": motion.body_vertical,
    }
    for (name, values), colour in zip(lines.items(), (GREY, *_COLOURS[:2]), strict=True):
        axes.plot(motion.distance, 1e3 * values, color=colour, lw=1.0, label=name)
    _mark_track(axes, made)
    legend_below(axes)
    axes.set(xlabel="distance of the first wheelset (m)", ylabel="upward (mm)")
    axes.set_title("Vertical", loc="left")


def _mark_track(axes: Axes, made: VehicleRun) -> None:
    """Shade the curve and its spirals."""
    track = TRACKS[made.track](made.parameters.track)
    bent = np.flatnonzero(track.curvature)
    if len(bent):
        first, last = track.corners[bent[0]], track.corners[bent[-1]]
        before, behind = track.corners[max(bent[0] - 1, 0)], track.corners[min(bent[-1] + 1, len(track.corners) - 1)]
        axes.axvspan(float(before), float(behind), color="#f2f2f2", lw=0, zorder=0)
        axes.axvspan(float(first), float(last), color="#e8e8e8", lw=0, zorder=0)


def _draw_spectra(axes: Axes, made: VehicleRun, values: Array, title: str) -> None:
    frequency, amplitude = amplitude_spectrum(values, made.sample_rate)
    for k in range(3):
        axes.loglog(frequency[1:], np.maximum(amplitude[1:, k], SMALLEST), color=_COLOURS[k], lw=0.8)
    for mode in made.lateral_modes:
        if mode.frequency > 0 and mode.damping < 0.4:
            axes.axvline(mode.frequency, color=GREY, lw=0.6, ls=":")
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude (mm)", ylim=(SMALLEST, None))
    axes.set_title(f"{title}, wheelsets 1 to 3", loc="left")
