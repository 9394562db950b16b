"""The tables of a calibration: its figures, its history, its health, and what to measure next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sosmith.gen.calibration.fit import Fit
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.quantity import count
from sosmith.instrument.calibration.advice import Advice
from sosmith.instrument.calibration.calibration_report import CALLED_OUT, uncertainty_plane
from sosmith.instrument.calibration.fit_quality import CELLS
from sosmith.instrument.calibration.health.monitoring import Health, date_of
from sosmith.instrument.calibration.measurement_store import Source, Version
from sosmith.instrument.calibration.self_updating import Addition, Calibration
from sosmith.instrument.calibration.store.reference import Morning
from sosmith.instrument.calibration.uncertainty import Uncertainty


def fit_facts(
    fit: Fit, measurements: int, largest: float, worth: Uncertainty, *, robust: bool = False, required_r: float = 0.0
) -> list[Fact]:
    """Say what any fit to measurements is: `largest` residual in mm, `required_r` 0 if none was asked for."""
    m, n = fit.orders
    low, high = worth.limits
    reached = f"to reach r = {required_r:g}" if required_r else ""
    return [
        Fact("measurements", measurements, sentence="robust" if robust else ""),
        Fact("orders", f"{m} in voltage, {n} in temperature", sentence=reached),
        Fact("adjusted r", f"{fit.adjusted_r:.6f}", sentence=_rejected(fit)),
        Fact("residual, rms", fit.rms, "mm"),
        Fact("residual, largest", largest, "mm"),
        Fact("95 % interval of a reading", f"±{low:.3g} to ±{high:.3g} mm where there are measurements"),
    ]


def addition_table(addition: Addition) -> Table:
    """Return what a file says of the sensor: how far it reads from the version before, and its health."""
    facts = []
    if addition.shift is not None:
        facts.append(Fact("reads differently by", f"{addition.shift.mean:+.3g} mm", sentence=addition.shift.sentence))
    if addition.health is not None:
        days, alarms = len(addition.health.innovations.days), len(addition.health.alarms)
        verdict = count(alarms, "alarm") if alarms else "no alarm"
        said = "the first day, held against nothing" if days == 1 else f"over {count(days, 'day')} of measurements"
        facts.append(Fact("health", verdict, sentence=said))
    return Table(str(addition.file.path), facts)


def morning_tables(morning: Morning) -> list[Table]:
    """Return what was read at each target, before and now, the curve of the day, and the intervals of readings."""
    made = morning.addition.calibration
    assert made is not None, "there is a calibration for the day"
    rows = []
    for target in morning.targets:
        clearance, voltage, temperature = target.reading.values
        (before, width), (after, narrower) = target.before, target.after
        rows.append(
            (
                f"{clearance:g}",
                f"{target.reading.uncertainty[0]:g}",
                f"{voltage:g}",
                f"{temperature:g}",
                f"{before - clearance:+.3f}",
                f"{width:.3g}",
                f"{after - clearance:+.3f}",
                f"{narrower:.3g}",
            )
        )
    head = ("mm", "known to", "V", "°C", "off before", "±", "off now", "±")
    curve = [
        Fact(f"V^{i} T^{j}", f"{float(value):.6g}")
        for i, row in enumerate(made.version.polynomial.coefficients)
        for j, value in enumerate(row)
    ]
    title = f"Sensor {made.sensor}, {made.version.date}: {count(len(rows), 'target')}, lengths in mm"
    method = f"Curve of the day, version {made.version.number}, mm"
    return [Table(title, rows, head), Table(method, curve), _intervals(made)]


def calibration_tables(made: Calibration) -> list[Table]:
    """Return the figures of a version, the intervals of readings, and the measurements with the largest residuals."""
    version, quality = made.version, made.quality
    state = "new" if made.new else "unchanged"
    title = f"Sensor {made.sensor}, version {version.number} of {version.date}: {state}"
    called = []
    for index in quality.largest_residuals(CALLED_OUT):
        one = made.stored[index]
        values = [f"{value:g}" for value in one.reading.values]
        off, leverage = f"{quality.residual[index]:+.4f}", f"{quality.leverage[index]:.3f}"
        called.append((str(one.number), f"{one.source}:{one.reading.line}", *values, off, leverage))
    head = ("no.", "from", "mm", "V", "°C", "residual, mm", "leverage")
    return [Table(title, list(_figures(made))), _intervals(made), Table("Largest residuals", called, head)]


def _figures(made: Calibration) -> Iterator[Fact]:
    version, quality, plain = made.version, made.quality, made.version.sensor_type is None
    largest = float(abs(quality.residual).max())
    yield from fit_facts(
        made.fit,
        version.measurements,
        largest,
        quality.uncertainty,
        robust=version.robust,
        required_r=version.required_r if plain else 0.0,
    )
    yield Fact("method", _method(made))
    undefined = f"not defined: {'leverage 1' if plain else 'one day only'}"
    crossed = version.cross_validated
    yield Fact("cross-validated error, rms", undefined if crossed is None else crossed, "mm")
    yield from _worth(made)
    (v_low, v_high), (t_low, t_high) = made.fit.covered
    yield Fact("covered", f"{v_low:g} to {v_high:g} V, {t_low:g} to {t_high:g} °C")
    yield Fact("coverage of the range", f"{100 * made.coverage:.1f} % lies between measurements")
    yield Fact("cells with measurements", f"{round(quality.filled_cells * CELLS**2)} of {CELLS} x {CELLS}")
    mean, high = float(quality.leverage.mean()), len(quality.high_leverage)
    above = f"the mean is {mean:.4f}, and {high} are above three times the mean"
    yield Fact("leverage, largest", f"{quality.leverage.max():.4f}", sentence=above)
    if made.bayesian is not None:
        at_rail = made.bayesian.at_rail
        yield Fact("left out as outliers", sum(weight == 0 for weight in made.fit.weights) - at_rail)
        if at_rail:
            yield Fact(
                "left out at a rail",
                at_rail,
                sentence="with the voltage at an end of its range, or at a rail inside it",
            )
    if version.robust:
        yield Fact("given less weight", sum(weight < 1 for weight in made.fit.weights))
    for number, drift in sorted(made.drift.items(), reverse=True)[:5]:
        yield Fact(f"drift from version {number}", drift, "mm")


def _method(made: Calibration) -> str:
    if made.bayesian is None or made.version.sensor_type is None:
        return "paper"
    curve = "without a measurement of that day" if made.bayesian.plain else "with the day's own curve"
    return f"bayes, type {made.version.sensor_type.name}, for {made.version.date}, {curve}"


def _worth(made: Calibration) -> Iterator[Fact]:
    """Say what the calibration is worth."""
    found = made.quality.uncertainty
    if made.bayesian is not None:
        yield Fact("scatter of a measurement", f"{made.bayesian.posterior.scatter:.3g} mm rms")
        yield Fact("systematic error of a day", f"{made.bayesian.posterior.systematic:.3g} mm rms")
    lack = found.lack
    verdict = "the residuals follow a curve" if lack.structured else "no structure in the residuals"
    yield Fact("lack of fit", f"{lack.missed:.2g} mm rms beside {lack.pure:.2g} mm of pure scatter: {verdict}")
    if made.version.accept is not None:
        yield Fact("accepted", f"±{made.version.accept:g} mm or less")
    days = found.over_days
    if days is not None:
        share = f"{100 * days.inside:.1f} % of {days.count:,} measurements, each from other days"
        yield Fact("inside their 95 % intervals", share)


def _intervals(made: Calibration) -> Table:
    """Return half-widths of intervals over the plane of voltage and temperature, at what was measured."""
    voltages, temperatures, half = uncertainty_plane(made)
    rows = [
        (f"{temperature:.3g}", *(f"{value:.3g}" for value in row))
        for row, temperature in zip(half, temperatures, strict=True)
    ]
    return Table("95 % interval of a reading, ± mm", rows, ("°C", *(f"{v:.3g} V" for v in voltages)))


def _rejected(fit: Fit) -> str:
    shown = [f"{trial.adjusted_r:.6f} with {trial.orders[0]} and {trial.orders[1]}" for trial in fit.rejected[:3]]
    more = [f"{len(fit.rejected) - 3} more"] if len(fit.rejected) > 3 else []
    return ", ".join(shown + more)


def health_table(sensor: str, found: Health) -> Table:
    """Return the charts of a sensor, and a sentence for each alarm and for the notice of the last day."""
    known = found.innovations
    days, outliers, measured = len(known.days) - found.first, int(known.outliers.sum()), int(known.count.sum())
    verdict = count(len(found.alarms), "alarm") if found.alarms else "no alarm"
    # Not those of the fit: that leaves out what is off the polynomial of all days.
    left_out = (
        f"; {outliers:,} of {measured:,} measurements left out, off the plane of their own day" if outliers else ""
    )
    raised = {alarm.chart.name: alarm.raised for alarm in found.alarms}
    rows = [
        (
            chart.name,
            *(f"{value:.2f}" for value in (chart.values[-1], chart.values.max(), chart.limit)),
            raised.get(chart.name, "-"),
        )
        for chart in found.charts
    ]
    title = f"Sensor {sensor}: {verdict}; {count(days, 'day')} on the charts, to {date_of(known.days[-1])}{left_out}"
    notes = [one.sentence for one in (*found.alarms, found.notice) if one is not None]
    return Table(title, rows, ("control chart", "last day", "largest", "limit", "alarm"), notes=notes)


def advice_tables(sensor: str, date: str, within: float, found: Advice) -> list[Table]:
    """Return where to measure, and what it is expected to bring."""
    plan = [(f"{clearance:g}", f"{temperature:.3g}", str(times)) for clearance, temperature, times in found.plan]
    gain = [
        (f"{clearance:g}", f"{temperature:.3g}", f"{before:.3g}", f"{after:.3g}")
        for (clearance, temperature), before, after in zip(found.targets, found.before, found.after, strict=True)
    ]
    title = "95 % interval, ± mm"
    if not plan:
        enough = f"nothing to measure, all are within ±{within:g} mm"
        rows = [row[:-1] for row in gain]
        return [Table(f"Sensor {sensor}, {date}: {enough}", rows, ("mm", "°C", title))]
    asked = Table(f"Sensor {sensor}, {date}: {count(found.count, 'measurement')}", plan, ("mm", "°C", "times"))
    return [asked, Table(title, gain, ("mm", "°C", "without", "with"))]


def history_table(sensor: str, versions: Sequence[Version]) -> Table:
    """Return one row for each version of a sensor."""
    rows = []
    for version in versions:
        m, n = version.polynomial.orders
        figures = (version.rms, version.cross_validated, version.drift)
        rows.append(
            (
                str(version.number),
                version.date,
                f"{version.measurements:,}",
                f"{m}, {n}{' robust' if version.robust else ''}{' bayes' if version.sensor_type is not None else ''}",
                f"{max(version.adjusted_r_squared, 0.0) ** 0.5:.5f}",
                *("-" if figure is None else f"{figure:.4g}" for figure in figures),
            )
        )
    return Table(
        f"Sensor {sensor}, errors in mm", rows, ("no.", "date", "count", "orders", "r", "rms", "CV error", "drift")
    )


def sources_table(sensor: str, sources: Sequence[Source]) -> Table:
    """Return one row for each file of a sensor, and a sentence for each that was withdrawn."""
    rows = [
        (
            str(one.number),
            one.name,
            f"{one.measurements:,}",
            one.first if one.first == one.last else f"{one.first} to {one.last}",
            "counts" if one.withdrawal is None else "withdrawn",
        )
        for one in sources
    ]
    notes = [
        f"{one.name} was withdrawn on {one.withdrawal.date} by {one.withdrawal.author}: {one.withdrawal.reason}"
        for one in sources
        if one.withdrawal is not None
    ]
    return Table(f"Sensor {sensor}", rows, ("no.", "file", "measurements", "of", ""), notes=notes)
