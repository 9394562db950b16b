"""Figures of a self-updating calibration, as an SVG or PNG file; the same calibration gives the same bytes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.picture import BLUE, GREY, RED, legend_below, picture
from sosmith.instrument.calibration.fit_quality import HIGH_LEVERAGE
from sosmith.instrument.calibration.measurement_store import Version
from sosmith.instrument.calibration.self_updating import Calibration

MESH = 25
"""Voltages, and temperatures, at which the interval of a reading is drawn."""

_DATES = 6
"""Versions, at most, whose dates stand on the axis of the history."""


def calibration_plot(made: Calibration, versions: Sequence[Version], file_format: str) -> bytes:
    """Draw coverage, residuals and leverage of a calibration, and the history up to it.

    Parameters
    ----------
    made : Calibration
        What to draw.
    versions : sequence of Version
        All versions up to it.
    file_format : str
        One of `sosmith.gen.picture.FORMATS`.
    """

    def paint(figure: Figure) -> None:
        axes = figure.subplots(3, 2)
        version = made.version
        figure.suptitle(f"Sensor {made.sensor}, version {version.number} of {version.date}")
        _draw_coverage(figure, axes[0, 0], made)
        _draw_residuals(axes[0, 1], made)
        _draw_leverage(axes[1, 0], made)
        _draw_history(axes[1, 1], versions)
        _draw_intervals(figure, axes[2, 0], made)
        _draw_over_voltage(axes[2, 1], made)

    return picture("calibration", (11, 12), paint, file_format)


def _draw_coverage(figure: Figure, axes: Axes, made: Calibration) -> None:
    voltage = [one.reading.values[1] for one in made.stored]
    temperature = [one.reading.values[2] for one in made.stored]
    limit = float(np.max(np.abs(made.quality.residual))) or 1.0
    points = axes.scatter(
        voltage, temperature, c=made.quality.residual, cmap="coolwarm", vmin=-limit, vmax=limit, s=14, zorder=2
    )
    corners = made.quality.region.corners
    outline = np.array([*corners, corners[0]])
    axes.plot(outline[:, 0], outline[:, 1], color=GREY, lw=1.0)
    _, voltages, temperatures = made.ranges
    axes.set(xlim=voltages, ylim=temperatures, xlabel="voltage (V)", ylabel="temperature (°C)")
    axes.set_title(f"Coverage: {100 * made.coverage:.1f} % of the sensor's range", loc="left")
    figure.colorbar(points, ax=axes, label="residual (mm)")


def _draw_residuals(axes: Axes, made: Calibration) -> None:
    clearance = [one.reading.values[0] for one in made.stored]
    axes.plot(clearance, made.quality.residual, ".", color=BLUE, ms=4)
    weighted = [k for k, weight in enumerate(made.fit.weights) if weight < 1]
    if weighted:
        off = [clearance[k] for k in weighted]
        axes.plot(off, made.quality.residual[weighted], "o", mfc="none", color=RED, label="weighted down")
        legend_below(axes)
    axes.axhline(0, color=GREY, lw=0.8)
    axes.set(xlabel="clearance (mm)", ylabel="measured minus fitted (mm)")
    axes.set_title(f"Residuals: {made.version.rms:.3g} mm rms", loc="left")


def _draw_intervals(figure: Figure, axes: Axes, made: Calibration) -> None:
    (v_low, v_high), (t_low, t_high) = made.fit.covered
    V, T = np.meshgrid(np.linspace(v_low, v_high, MESH), np.linspace(t_low, t_high, MESH))
    half = made.quality.uncertainty.half_width(V.ravel(), T.ravel()).reshape(V.shape)
    levels = axes.contourf(V, T, half, levels=10, cmap="viridis")
    axes.set(xlabel="voltage (V)", ylabel="temperature (°C)")
    low, high = made.quality.uncertainty.limits
    axes.set_title(f"95 % interval of a reading: ±{low:.3g} to ±{high:.3g} mm", loc="left")
    figure.colorbar(levels, ax=axes, label="half-width (mm)")


def _draw_over_voltage(axes: Axes, made: Calibration) -> None:
    voltage = np.array([one.reading.values[1] for one in made.stored])
    axes.plot(voltage, made.quality.residual, ".", color=BLUE, ms=4)
    axes.axhline(0, color=GREY, lw=0.8)
    axes.set(xlabel="voltage (V)", ylabel="measured minus fitted (mm)")
    lack = made.quality.uncertainty.lack
    verdict = f"a curve of {lack.missed:.2g} mm rms" if lack.structured else "no structure"
    axes.set_title(f"Lack of fit: {verdict}, pure scatter {lack.pure:.2g} mm rms", loc="left")


def _draw_leverage(axes: Axes, made: Calibration) -> None:
    axes.plot(made.quality.leverage, made.quality.residual, ".", color=BLUE, ms=4)
    limit = HIGH_LEVERAGE * float(made.quality.leverage.mean())
    axes.axvline(limit, color=RED, lw=0.8, label=f"{HIGH_LEVERAGE:g} times the mean")
    legend_below(axes)
    axes.set(xlabel="leverage", ylabel="residual (mm)")
    axes.set_title("Leverage of each measurement on its own fit", loc="left")


def _draw_history(axes: Axes, versions: Sequence[Version]) -> None:
    curves = {
        "rms residual": [version.rms for version in versions],
        "cross-validated error": [version.cross_validated for version in versions],
        "drift from the version before": [version.drift for version in versions],
    }
    numbers = [version.number for version in versions]
    for (label, values), colour in zip(curves.items(), (GREY, BLUE, RED), strict=True):
        axes.plot(numbers, np.array(values, dtype=np.float64), "o-", color=colour, label=label)
    shown = versions[:: -(-len(versions) // _DATES)]
    axes.set_xticks([version.number for version in shown], [f"{version.number}\n{version.date}" for version in shown])
    axes.set_ylim(bottom=0)
    axes.set(xlabel="version and its date", ylabel="mm")
    legend_below(axes, 0.28)
    axes.set_title("History", loc="left")
