"""The tables of a calibration: its figures, its history."""

from __future__ import annotations

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.gen.instrument.calibration_report import CALLED_OUT
from sosmith.model.calibration.fit import terms_of
from sosmith.model.calibration.fit_quality import CELLS
from sosmith.model.calibration.measurement_store import Version
from sosmith.model.calibration.self_updating import Calibration


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g} mm"


def print_calibration(made: Calibration) -> None:
    """Print the figures of a version, and the measurements with the largest residuals."""
    version, quality = made.version, made.quality
    console = TableConsole()
    state = "new" if made.new else "unchanged"
    overview = new_table(f"Sensor {escape(made.sensor)}, version {version.number} of {version.date}: {state}", ["", ""])
    robust = ", robust" if version.robust else ""
    overview.add_row("measurements", f"{version.measurements:,}{robust}")
    m, n = version.polynomial.orders
    overview.add_row("orders", f"{m} in voltage, {n} in temperature, to reach r = {version.required_r:g}")
    overview.add_row("adjusted r", f"{made.fit.adjusted_r:.6f}{_rejected(made)}")
    overview.add_row("residual, rms", _mm(version.rms))
    overview.add_row("residual, largest", _mm(float(abs(quality.residual).max())))
    left_out = _mm(version.cross_validated) if version.cross_validated is not None else "not defined: leverage 1"
    overview.add_row("cross-validated error, rms", left_out)
    (v_low, v_high), (t_low, t_high) = made.fit.covered
    overview.add_row("covered", f"{v_low:g} to {v_high:g} V, {t_low:g} to {t_high:g} °C")
    overview.add_row("coverage of the range", f"{100 * made.coverage:.1f} % lies between measurements")
    cells = round(quality.filled_cells * CELLS**2)
    overview.add_row("cells with measurements", f"{cells} of {CELLS} x {CELLS}")
    mean = len(terms_of(made.fit.orders)) / version.measurements
    high = len(quality.high_leverage)
    overview.add_row(
        "leverage, largest", f"{quality.leverage.max():.4f} (mean {mean:.4f}; {high} above three times the mean)"
    )
    if version.robust:
        overview.add_row("given less weight", f"{sum(weight < 1 for weight in made.fit.weights):,}")
    for number, drift in sorted(made.drift.items(), reverse=True)[:5]:
        overview.add_row(f"drift from version {number}", _mm(drift))
    console.print(overview)
    called = new_table("Largest residuals", ["no.", "from", "mm", "V", "°C", "residual, mm", "leverage"])
    for index in quality.largest_residuals(CALLED_OUT):
        one = made.stored[index]
        values = [f"{value:g}" for value in one.reading.values]
        off, leverage = f"{quality.residual[index]:+.4f}", f"{quality.leverage[index]:.3f}"
        called.add_row(str(one.number), escape(f"{one.source}:{one.reading.line}"), *values, off, leverage)
    console.print(called)


def _rejected(made: Calibration) -> str:
    shown = [f"{trial.orders[0]}, {trial.orders[1]}: {trial.adjusted_r:.6f}" for trial in made.fit.rejected[:3]]
    more = [f"{len(made.fit.rejected) - 3} more"] if len(made.fit.rejected) > 3 else []
    return f" (orders {'; '.join(shown + more)})" if shown else ""


def print_history(sensor: str, versions: list[Version]) -> None:
    """Print one row for each version of a sensor."""
    table = new_table(
        f"Sensor {escape(sensor)}, errors in mm",
        ["no.", "date", "count", "orders", "r", "rms", "CV error", "drift"],
    )
    for version in versions:
        m, n = version.polynomial.orders
        figures = (version.rms, version.cross_validated, version.drift)
        table.add_row(
            str(version.number),
            version.date,
            f"{version.measurements:,}",
            f"{m}, {n}{' robust' if version.robust else ''}",
            f"{max(version.adjusted_r_squared, 0.0) ** 0.5:.5f}",
            *("-" if figure is None else f"{figure:.4g}" for figure in figures),
        )
    TableConsole().print(table)
