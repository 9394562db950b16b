"""The tables of a calibration: its figures, its history."""

from __future__ import annotations

from rich.markup import escape
from rich.table import Table

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.instrument.calibration.advice import Advice
from sosmith.instrument.calibration.calibration_report import CALLED_OUT, uncertainty_plane
from sosmith.instrument.calibration.fit_quality import CELLS
from sosmith.instrument.calibration.health.monitoring import Health, date_of
from sosmith.instrument.calibration.measurement_store import Version
from sosmith.instrument.calibration.self_updating import Calibration


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
    reached = f", to reach r = {version.required_r:g}" if version.sensor_type is None else ""
    overview.add_row("method", _method(made))
    overview.add_row("orders", f"{m} in voltage, {n} in temperature{reached}")
    overview.add_row("adjusted r", f"{made.fit.adjusted_r:.6f}{_rejected(made)}")
    overview.add_row("residual, rms", _mm(version.rms))
    overview.add_row("residual, largest", _mm(float(abs(quality.residual).max())))
    why = "leverage 1" if version.sensor_type is None else "one day only"
    left_out = _mm(version.cross_validated) if version.cross_validated is not None else f"not defined: {why}"
    overview.add_row("cross-validated error, rms", left_out)
    _add_uncertainty(overview, made)
    (v_low, v_high), (t_low, t_high) = made.fit.covered
    overview.add_row("covered", f"{v_low:g} to {v_high:g} V, {t_low:g} to {t_high:g} °C")
    overview.add_row("coverage of the range", f"{100 * made.coverage:.1f} % lies between measurements")
    cells = round(quality.filled_cells * CELLS**2)
    overview.add_row("cells with measurements", f"{cells} of {CELLS} x {CELLS}")
    mean = float(quality.leverage.mean())
    high = len(quality.high_leverage)
    overview.add_row(
        "leverage, largest", f"{quality.leverage.max():.4f} (mean {mean:.4f}; {high} above three times the mean)"
    )
    if made.bayesian is not None:
        at_rail = made.bayesian.at_rail
        overview.add_row("left out as outliers", f"{sum(weight == 0 for weight in made.fit.weights) - at_rail:,}")
        if at_rail:
            overview.add_row("left out at a rail", f"{at_rail:,}, with the voltage at an end of its range")
    if version.robust:
        overview.add_row("given less weight", f"{sum(weight < 1 for weight in made.fit.weights):,}")
    for number, drift in sorted(made.drift.items(), reverse=True)[:5]:
        overview.add_row(f"drift from version {number}", _mm(drift))
    console.print(overview)
    console.print(_intervals(made))
    called = new_table("Largest residuals", ["no.", "from", "mm", "V", "°C", "residual, mm", "leverage"])
    for index in quality.largest_residuals(CALLED_OUT):
        one = made.stored[index]
        values = [f"{value:g}" for value in one.reading.values]
        off, leverage = f"{quality.residual[index]:+.4f}", f"{quality.leverage[index]:.3f}"
        called.add_row(str(one.number), escape(f"{one.source}:{one.reading.line}"), *values, off, leverage)
    console.print(called)


def _method(made: Calibration) -> str:
    if made.bayesian is None or made.version.sensor_type is None:
        return "paper"
    kind = escape(made.version.sensor_type.name)
    curve = "without a measurement of that day" if made.bayesian.plain else "with the day's own curve"
    return f"bayes, type {kind}, for {made.version.date}, {curve}"


def _add_uncertainty(overview: Table, made: Calibration) -> None:
    """Add what the calibration is worth."""
    found = made.quality.uncertainty
    if made.bayesian is not None:
        overview.add_row("scatter of a measurement", f"{made.bayesian.posterior.scatter:.3g} mm rms")
        overview.add_row("systematic error of a day", f"{made.bayesian.posterior.systematic:.3g} mm rms")
    lack = found.lack
    verdict = "the residuals follow a curve" if lack.structured else "no structure in the residuals"
    overview.add_row("lack of fit", f"{lack.missed:.2g} mm rms beside {lack.pure:.2g} mm of pure scatter: {verdict}")
    low, high = found.limits
    overview.add_row("95 % interval of a reading", f"±{low:.3g} to ±{high:.3g} mm where there are measurements")
    if made.version.accept is not None:
        overview.add_row("accepted", f"±{made.version.accept:g} mm or less")
    days = found.over_days
    if days is not None:
        inside = f"{100 * days.inside:.1f} % of {days.count:,} measurements, each from other days"
        overview.add_row("inside their 95 % intervals", inside)


def _intervals(made: Calibration) -> Table:
    """Return half-widths of intervals over the plane of voltage and temperature, at what was measured."""
    voltages, temperatures, half = uncertainty_plane(made)
    table = new_table("95 % interval of a reading, ± mm", ["°C", *(f"{v:.3g} V" for v in voltages)])
    for row, temperature in zip(half, temperatures, strict=True):
        table.add_row(f"{temperature:.3g}", *(f"{value:.3g}" for value in row))
    return table


def _rejected(made: Calibration) -> str:
    shown = [f"{trial.orders[0]}, {trial.orders[1]}: {trial.adjusted_r:.6f}" for trial in made.fit.rejected[:3]]
    more = [f"{len(made.fit.rejected) - 3} more"] if len(made.fit.rejected) > 3 else []
    return f" (orders {'; '.join(shown + more)})" if shown else ""


def print_health(sensor: str, found: Health) -> None:
    """Print the charts of a sensor, and a sentence for each alarm."""
    console = TableConsole()
    known = found.innovations
    days, outliers = len(known.days) - found.first, int(known.outliers.sum())
    verdict = "no alarm" if not found.alarms else f"{len(found.alarms)} alarm{'s' * (len(found.alarms) > 1)}"
    left_out = f", {outliers:,} outlier{'s' * (outliers > 1)} left out" if outliers else ""
    console.print(
        f"Sensor {escape(sensor)}: {verdict}; {days:,} days on the charts, to {date_of(known.days[-1])}{left_out}\n"
    )
    table = new_table("Control charts", ["", "last day", "largest", "limit", "alarm"])
    raised = {alarm.chart.name: alarm.raised for alarm in found.alarms}
    for chart in found.charts:
        values = [f"{value:.2f}" for value in (chart.values[-1], chart.values.max(), chart.limit)]
        table.add_row(chart.name, *values, raised.get(chart.name, "-"))
    console.print(table)
    for alarm in found.alarms:
        console.print(escape(alarm.sentence))


def print_advice(sensor: str, date: str, found: Advice) -> None:
    """Print where to measure, and what it is expected to bring."""
    console = TableConsole()
    console.print(f"Sensor {escape(sensor)}, {date}: {found.count} measurements\n")
    plan = new_table("To measure", ["mm", "°C", "times"])
    for clearance, temperature, count in found.plan:
        plan.add_row(f"{clearance:g}", f"{temperature:.3g}", str(count))
    console.print(plan)
    gain = new_table("95 % interval, ± mm", ["mm", "°C", "without", "with"])
    for (clearance, temperature), before, after in zip(found.targets, found.before, found.after, strict=True):
        gain.add_row(f"{clearance:g}", f"{temperature:.3g}", f"{before:.3g}", f"{after:.3g}")
    console.print(gain)


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
            f"{m}, {n}{' robust' if version.robust else ''}{' bayes' if version.method == 'bayes' else ''}",
            f"{max(version.adjusted_r_squared, 0.0) ** 0.5:.5f}",
            *("-" if figure is None else f"{figure:.4g}" for figure in figures),
        )
    TableConsole().print(table)
