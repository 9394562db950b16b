"""Figures of a run of the vehicle, as an SVG or PNG file; the same run gives the same bytes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.instrument.amplitude_spectrum import Array, amplitude_spectrum
from sosmith.gen.instrument.vehicle_report import TRACKS, VehicleRun
from sosmith.gen.picture import BLUE, GREEN, GREY, RED, legend_below, picture

SMALLEST = 1e-6
"""Smallest amplitude drawn, in mm: a nanometre."""

_COLOURS = (BLUE, RED, GREEN)


def vehicle_plot(made: VehicleRun, file_format: str) -> bytes:
    """Draw motions over the distance and their spectra.

    Parameters
    ----------
    made : VehicleRun
        What to draw.
    file_format : str
        One of `sosmith.gen.picture.FORMATS`.
    """
    motion = made.motion

    def paint(figure: Figure) -> None:
        axes = figure.subplots(3, 2)
        random = "" if made.irregularities == "none" else f", irregularities {made.irregularities}, seed {made.seed}"
        figure.suptitle(f"Co-Co locomotive, {made.track} track, {made.speed:g} m/s{random}")
        room = 1e3 * made.parameters.sensor.flange_clearance
        _draw(axes[0, 0], made, 1e3 * motion.wheelset_lateral, "lateral (mm)", "Wheelsets, lateral, to the left")
        for side in (-room, room):
            axes[0, 0].axhline(side, color=GREY, lw=0.8, ls="--")
        axes[0, 0].text(made.motion.distance[-1], -room, "flange ", ha="right", va="top", color=GREY)
        yaw = 1e3 * motion.wheelset_yaw_to_frame
        _draw(axes[0, 1], made, yaw, "yaw (mrad)", "Wheelsets, yaw in their frames")
        _draw(axes[1, 0], made, motion.clearance_mm, "change (mm)", "Clearance at the right wheels' sensors")
        _draw_vertical(axes[1, 1], made)
        _draw_spectra(axes[2, 0], made, 1e3 * motion.wheelset_lateral, "Spectrum of the lateral motion")
        _draw_spectra(axes[2, 1], made, motion.clearance_mm, "Spectrum of the clearance")
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=6, frameon=False)

    style = {"path.simplify": True, "path.simplify_threshold": 0.3, "text.parse_math": True}  # powers of ten
    return picture("vehicle", (11, 10), paint, file_format, style=style)


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
