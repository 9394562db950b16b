"""Draws the pictures of docs/sensors.md and regenerates its tables: `python -m benchmarks.sensors`.

With `--check` nothing is written; the exit status tells whether document and pictures are up to date.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import get_args

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from sosmith.gen.calibration.fit import Fit, Measurements, fit
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.picture import settled
from sosmith.gen.specification.specification import load
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.paper.figures import read_paper_figures
from sosmith.instrument.scenarios.depot_measurements import measurements_of
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file, load_scenario
from sosmith.instrument.scenarios.instrument_signals import TABLE_1_STEPS, TABLE_2_STEPS
from sosmith.instrument.scenarios.schema import ScenarioDocument
from sosmith.instrument.sensors.inductive_sensor import FORWARD_MODELS, SystematicError, sensor_voltage
from sosmith.instrument.sensors.thermocouple import thermocouple_emf, thermocouple_temperature
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.arrays import Values
from sosmith.model.polynomial import EQUATION_5A, Polynomial
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.reference.golden import calibrated, filtered
from sosmith.model.tables.toml_tables import Table, shown
from sosmith.model.traces.trace import Trace

ROOT = Path(__file__).resolve().parent.parent
DOCUMENT = "docs/sensors.md"
SCENARIOS = ROOT / "examples" / "scenarios"
SPECIFICATION = ROOT / "examples" / "flange_wear_bench.toml"
SEEDS = 100
"""Number of seeds, from 0, over which the accuracy table averages."""

_PAPER = read_paper_figures()
TABLE_1, TABLE_2, TABLE_4 = (
    tuple(map(float, _PAPER.numbers(table, "error"))) for table in ("table_1", "table_2", "table_4")
)
"""Errors printed in the paper: before the filter at 43 to 50 and at 92 to 96 degC, and after it at 43 to 50 degC."""

ADJUSTED_R_SQUARED = {"bench_43_50": 0.9709, "bench_92_96": 0.9706}
"""Adjusted coefficients of determination of equations 4 and 5a, by the run they apply to."""

PRINTED_ACCURACY = {"bench_43_50": (96.1826, 97.2), "bench_92_96": (96.5, None)}
"""The paper's accuracies in per cent, before and after the filter."""


def rms(values: Values) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def slope(clearance: Values, temperature: float) -> Values:
    """Return the slope of equation 5a in mm/V at a clearance in mm."""
    V = sensor_voltage(clearance, temperature)
    return np.asarray((EQUATION_5A(V + 1e-6, temperature) - EQUATION_5A(V - 1e-6, temperature)) / 2e-6)


def derived(name: str, *, millimetres: bool) -> dict[str, float]:
    """Derive the errors of a bench run from the paper's figures: noise in V, systematic error and scatter in mm."""
    first = np.array(TABLE_1_STEPS)
    scale = np.ones(10) if millimetres else first
    removed = (np.array(TABLE_1) - np.array(TABLE_4)) * scale
    noise = rms(removed / slope(first, 46.5))
    if name == "bench_43_50":
        systematic = rms(np.array(TABLE_4) * scale)
    else:
        second = np.array(TABLE_2_STEPS)
        total = rms(np.array(TABLE_2) * (1.0 if millimetres else second))
        systematic = float(np.sqrt(total**2 - (noise * rms(slope(second, 94.0))) ** 2))
    residual = float(np.sqrt((1 - ADJUSTED_R_SQUARED[name]) * np.var(first)))
    scatter = float(np.sqrt(residual**2 - systematic**2))
    return {"noise": noise, "systematic": systematic, "residual": residual, "scatter": scatter}


def bench_files() -> Iterator[tuple[str, str, dict[str, float]]]:
    """Yield the name of each bench file, its label in the table, and its errors derived from the paper's figures."""
    for name, what in (("bench_43_50", "43 to 50 °C"), ("bench_92_96", "92 to 96 °C")):
        yield name, f"{what}, fractions", derived(name, millimetres=False)
        yield f"{name}_millimetres", f"{what}, millimetres", derived(name, millimetres=True)


def readings_table() -> str:
    """Return a Markdown table of the errors derived from the paper's figures."""
    lines = [
        "| run, reading of the tables | noise, V rms | systematic error, mm rms | residual of the regression, mm rms "
        "| of a single measurement, mm rms | file |",
        "|---|---|---|---|---|---|",
    ]
    for name, what, errors in bench_files():
        lines.append(
            f"| {what} | {errors['noise']:.4f} | {errors['systematic']:.3f} | {errors['residual']:.3f} "
            f"| {errors['scatter']:.3f} | `examples/scenarios/{name}.toml` |"
        )
    return "\n".join(lines)


def measured(design: CoreDesign, trace: Trace, polynomial: Polynomial = EQUATION_5A) -> tuple[Values, Values]:
    """Return the clearance in mm before and after the ideal filter."""
    before = calibrated(trace.codes, trace.ports, polynomial)
    made = design.quantized
    assert made.filter is not None
    return before, filtered(before, made.filter.sos, design.datapath.output, steady=made.steady)


def accuracy_table(design: CoreDesign) -> str:
    """Return a Markdown table of the accuracy over seeds, by calibration."""
    head = f"| file | calibration | of {SEEDS} seeds | unfiltered, % | the paper's | filtered, % | the paper's |"
    lines = [head, "|---|---|---|---|---|---|---|"]
    for name, _, _ in bench_files():
        scenario = load_scenario(SCENARIOS / f"{name}.toml")
        results: dict[str, list[list[float]]] = {}
        for seed in range(SEEDS):
            trace = emulate_file(scenario, bench_of(design), seed=seed)
            own = own_calibration(scenario, seed)
            fitted = f"fitted, orders {own.orders[0]}, {own.orders[1]}"
            for calibration, polynomial in (("equation 5a", EQUATION_5A), (fitted, own.polynomial)):
                assert trace.truth is not None
                signals = measured(design, trace, polynomial)
                accuracies = [accuracy_percent(x, trace.truth, trace.reading) for x in signals]
                results.setdefault(calibration, []).append(accuracies)
        printed, printed_after = PRINTED_ACCURACY[name.removesuffix("_millimetres")]
        for calibration, accuracies_of_seeds in sorted(results.items()):
            mean = np.mean(accuracies_of_seeds, axis=0)
            spread = np.std(accuracies_of_seeds, axis=0, ddof=min(1, len(accuracies_of_seeds) - 1))
            lines.append(
                f"| `{name}` | {calibration} | {len(accuracies_of_seeds)} | {mean[0]:.2f} ± {spread[0]:.2f} "
                f"| {printed:.1f} | {mean[1]:.2f} ± {spread[1]:.2f} "
                f"| {'-' if printed_after is None else f'{printed_after:.1f}'} |"
            )
    return "\n".join(lines)


def own_calibration(scenario: ScenarioFile, seed: int) -> Fit:
    """Fit the scenario's depot measurements, as the paper does."""
    rows = measurements_of(scenario, seed)
    columns = np.array([(row.clearance_mm, row.voltage_V, row.temperature_C) for row in rows]).T
    return fit(Measurements(*columns))


def key_table() -> str:
    """Return a Markdown table of all keys of a scenario file."""
    lines = ["| key | what it must be | default |", "|---|---|---|"]
    lines += [f"| `{key}` | {what} | {default} |" for key, what, default in _keys(ScenarioDocument, "")]
    return "\n".join(lines)


def _keys(shape: type[Table], prefix: str) -> Iterator[tuple[str, str, str]]:
    for name, field in shape.model_fields.items():
        inner = next((part for part in _parts(field.annotation) if issubclass(part, Table)), None)
        if inner is not None:
            # Each [[channel]] has the keys of [wear].
            several = "[]" if name in {"excerpt", "fault", "channel"} else ""
            if name != "channel":
                yield from _keys(inner, f"{prefix}{name}{several}.")
            continue
        default = "required" if field.is_required() else shown(field.get_default(call_default_factory=True))
        yield f"{prefix}{name}", str(field.description).replace("|", "\\|"), "-" if default == "missing" else default


def _parts(annotation: object) -> Iterator[type]:
    if isinstance(annotation, type):
        yield annotation
    for part in get_args(annotation):
        yield from _parts(part)


def drawn(width: float, height: float, paint: Callable[[Figure], None]) -> str:
    """Return a painted figure as SVG, with the same bytes on every run."""
    with matplotlib.rc_context(
        {"svg.hashsalt": "sosmith", "svg.fonttype": "none", "axes.grid": True, "grid.alpha": 0.3}
    ):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasSVG(figure)
        paint(figure)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return settled(text.getvalue())


def sensors_picture(figure: Figure) -> None:
    """Draw the sensor characteristics and the error of the thermocouple's inverse."""
    left, right = figure.subplots(1, 2)
    d = np.linspace(0.0, 11.0, 221)
    for name, dashes in (("equation_5a", "-"), ("equation_4", ":"), ("coil", "--")):
        for temperature, colour in ((20.0, "C0"), (98.0, "C3")):
            voltage = FORWARD_MODELS[name](d, temperature)
            inside = d >= (0.0 if name == "coil" else 1.0)
            left.plot(d[inside], voltage[inside], dashes, color=colour, label=f"{name}, {temperature:g} °C")
    left.set(xlabel="clearance in mm", ylabel="voltage in V", title="forward models")
    left.legend()
    t = np.linspace(0.0, 500.0, 2001)
    right.plot(t, thermocouple_temperature(thermocouple_emf(t)) - t, color="C0")
    right.axvspan(0, 200, color="C2", alpha=0.12, label="tread braking")
    right.set(xlabel="temperature in °C", ylabel="error in °C", title="type K, NIST's inverse polynomial")
    right.legend()


def scenario_picture(design: CoreDesign, scenario: ScenarioFile, figure: Figure) -> None:
    """Draw measured and true clearance and the temperature over one trace."""
    trace = emulate_file(scenario, bench_of(design), seed=1)
    before, after = measured(design, trace)
    assert trace.truth is not None
    assert trace.reading is not None
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    upper.plot(trace.time, before, color="0.75", lw=0.8, label="measured")
    upper.plot(trace.time, after, color="C0", lw=1.2, label="filtered")
    upper.plot(trace.time, trace.truth, color="C3", lw=1.2, label="true")
    read = np.where(trace.reading, np.nanmin(trace.truth) - 0.9, np.nan)
    upper.plot(trace.time, read, color="C2", lw=3, label="read")
    upper.set(ylabel="clearance in mm", title=scenario.document.description)
    upper.set_ylim(trace.truth.min() - 1.1, trace.truth.max() + 1.6)
    upper.legend(ncols=4)
    lower.plot(trace.time, trace.values()[:, 1], color="C1")
    lower.set(xlabel="time in s, cut between excerpts", ylabel="°C shown")


def systematic_picture(figure: Figure) -> None:
    """Draw the systematic error on several days, and the paper's filtered errors."""
    axes = figure.subplots()
    d = np.linspace(1.0, 10.0, 181)
    model = SystematicError(rms=derived("bench_43_50", millimetres=False)["systematic"], correlation=2.0)
    for day in range(6):
        axes.plot(d, model.on(day, streams(1))(d), lw=1.0, label=f"day {day}")
    errors = np.array(TABLE_4) * np.array(TABLE_1_STEPS)
    axes.plot(TABLE_1_STEPS, errors, "ko", label="table 4, sign unknown")
    axes.set(xlabel="clearance in mm", ylabel="error in mm")
    figure.legend(loc="outside right center")


def documents() -> dict[str, str]:
    """Return the text of every file that this module writes, by path."""
    design = design_core(load(SPECIFICATION))
    braking = load_scenario(SCENARIOS / "depot_to_98.toml")
    text = (ROOT / DOCUMENT).read_text(encoding="utf-8")
    for mark, table in (
        ("readings", readings_table()),
        ("accuracy", accuracy_table(design)),
        ("keys", key_table()),
    ):
        block = re.compile(rf"(?<=<!-- {mark} -->\n).*?(?=<!-- end of {mark} -->)", re.DOTALL)
        assert len(block.findall(text)) == 1, f"{DOCUMENT} must have one block {mark}"
        text = block.sub(lambda _, table=table: f"\n{table}\n\n", text)  # type: ignore[misc]
    return {
        DOCUMENT: text,
        "docs/images/sensors.svg": drawn(10, 4.2, sensors_picture),
        "docs/images/systematic_error.svg": drawn(8, 3.6, systematic_picture),
        "docs/images/scenario.svg": drawn(10, 4.8, lambda figure: scenario_picture(design, braking, figure)),
    }


def main() -> None:
    """Write or check the document and its pictures."""
    texts = documents()
    if "--check" in sys.argv[1:]:
        stale = [name for name, text in texts.items() if (ROOT / name).read_text(encoding="utf-8") != text]
        sys.exit(f"out of date: {', '.join(stale)}" if stale else 0)
    for name, text in texts.items():
        (ROOT / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
