"""Measures the alarms of sensor health: `python -m benchmarks.sensor_health`.

False alarms over many sensors without a fault, and how soon stated faults are told, with what is said to explain them.
With --document, records them in benchmarks/sensor_health.json and renews docs/health.md with its picture.
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from sosmith.gen.calibration.fit import COLUMNS, Measurements
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.health.charts import (
    ALLOWANCE,
    CHARTS,
    DECISION,
    MOST_OF_A_DAY,
    STEP_LIMIT,
    WARNING_LIMIT,
    charts_of,
)
from sosmith.instrument.calibration.health.explanation import FOLLOWING, explanation_of
from sosmith.instrument.calibration.health.health_plot import health_plot
from sosmith.instrument.calibration.health.innovations import Course, course_of
from sosmith.instrument.calibration.health.monitoring import health_of
from sosmith.instrument.calibration.sensor_type import DEFAULT_TYPE, SENSOR_TYPES
from sosmith.instrument.scenarios.depot_measurements import measurements_of
from sosmith.instrument.scenarios.file import ScenarioFile, load_scenario
from sosmith.instrument.sensors.inductive_sensor import FORWARD_MODELS, InverseRegression
from sosmith.model.arrays import Values
from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.text_files import write_contents
from sosmith.terminal import show_progress

HERE = Path(__file__).parent
ROOT = HERE.parent
RECORD = HERE / "sensor_health.json"
PAGE = ROOT / "docs" / "health.md"

SCENARIO = ROOT / "examples" / "scenarios" / "a_week_in_service.toml"
"""The week in service, continued for more days: 15 measurements each morning of an ageing sensor."""

SENSORS = tuple(FORWARD_MODELS)
DAYS, SEEDS = 250, 24
"""Days without a fault, and sensors of each kind."""

FAULT_DAY, FAULT_DAYS, FAULT_SEEDS = 60, 40, 24
"""First day of a fault, days that it lasts, and sensors with it."""

FIRST_SEED = 5001
"""None of these seeds was used to choose the limits."""


@dataclass(frozen=True)
class Fault:
    """A fault: its name, and what it makes of clearance in mm, voltage in V, temperature in degC, `late` days on."""

    name: str
    change: Callable[[Values, Values, Values, Values, np.random.Generator], tuple[Values, Values]]


def _off(
    offset: float, gain: float = 0.0, per_day: float = 0.0, gain_per_day: float = 0.0
) -> Callable[..., tuple[Values, Values]]:
    def change(d: Values, V: Values, T: Values, late: Values, chance: np.random.Generator) -> tuple[Values, Values]:
        return d, V * (1.0 + gain + gain_per_day * (late + 1.0)) + offset + per_day * (late + 1.0)

    return change


def _louder(times: float) -> Callable[..., tuple[Values, Values]]:
    def change(d: Values, V: Values, T: Values, late: Values, chance: np.random.Generator) -> tuple[Values, Values]:
        more = 0.475 * math.sqrt(times**2 - 1.0)  # the scenario's own scatter is 0.475 mm rms
        return np.maximum(d + chance.normal(0.0, more, len(d)), 0.0), V

    return change


def _another(d: Values, V: Values, T: Values, late: Values, chance: np.random.Generator) -> tuple[Values, Values]:
    other = SENSOR_TYPES[DEFAULT_TYPE].polynomial(tuple(chance.normal(0.0, 1.0, 5).tolist()))
    return d, InverseRegression(other)(EQUATION_5A(V, T), T)


def _moved(by: float) -> Callable[..., tuple[Values, Values]]:
    def change(d: Values, V: Values, T: Values, late: Values, chance: np.random.Generator) -> tuple[Values, Values]:
        return np.maximum(d - by, 0.0), V

    return change


FAULTS = (
    Fault("mounted anew, 0.2 mm nearer", _moved(0.2)),
    Fault("mounted anew, 0.5 mm nearer", _moved(0.5)),
    Fault("turned: offset +0.3 V, gain -5 %", _off(0.3, -0.05)),
    Fault("turned: offset +0.5 V, gain +10 %", _off(0.5, 0.10)),
    Fault("another sensor, of the type's tolerances", _another),
    Fault("offset drifts by 0.01 V a day", _off(0.0, per_day=0.01)),
    Fault("offset drifts by 0.03 V a day", _off(0.0, per_day=0.03)),
    Fault("gain drifts by 0.3 % a day", _off(0.0, gain_per_day=0.003)),
    Fault("measurements scatter 1.5 times as much", _louder(1.5)),
    Fault("measurements scatter 2 times as much", _louder(2.0)),
)


def days_of(scenario: ScenarioFile, sensor: str, days: int, seed: int) -> Measurements:
    """Return the measurements of so many days of a true sensor."""
    assert scenario.document.calibration is not None
    table = scenario.document.calibration.model_copy(update={"days": tuple(range(days))})
    inductive = replace(scenario.sensors.inductive, model=FORWARD_MODELS[sensor])
    changed = replace(
        scenario,
        document=scenario.document.model_copy(update={"calibration": table}),
        sensors=replace(scenario.sensors, inductive=inductive),
    )
    rows = measurements_of(changed, seed)
    d, V, T = (np.array([getattr(row, name) for row in rows]) for name in COLUMNS)
    return Measurements(d, V, T, "the depot", tuple(datetime.date.fromisoformat(row.date).toordinal() for row in rows))


def with_fault(healthy: Measurements, fault: Fault, seed: int) -> Measurements:
    """Return the measurements with a fault from day `FAULT_DAY` on."""
    day = np.array(healthy.days) - healthy.days[0]
    late = day - FAULT_DAY
    d, V, T = healthy.clearance, healthy.voltage, healthy.temperature
    d, V = fault.change(d, V, T, late.astype(np.float64), np.random.default_rng([seed, 7]))
    d, V = np.where(late >= 0, d, healthy.clearance), np.where(late >= 0, V, healthy.voltage)
    return Measurements(d, np.clip(V, *DEFAULT_RANGES[1]), healthy.temperature, healthy.source, healthy.days)


def course(measurements: Measurements) -> Course:
    """Return the days of a sensor that is taken to be of the default type, as a user would have it."""
    return course_of(measurements, SENSOR_TYPES[DEFAULT_TYPE], DEFAULT_RANGES[1])


def false_alarms(scenario: ScenarioFile, sensor: str, step: Callable[[int], None]) -> dict[str, Any]:
    """Count the first alarms of each chart, and of any, over days without a fault."""
    first: dict[str, list[int]] = {name: [] for name in (*CHARTS, "any")}
    watched = dict.fromkeys(first, 0)
    moments: list[list[float]] = []
    for seed in range(FIRST_SEED, FIRST_SEED + SEEDS):
        found = course(days_of(scenario, sensor, DAYS, seed)).innovations()
        alarms = {chart.name: chart.alarm for chart in charts_of(found)}
        alarms["any"] = min((at for at in alarms.values() if at is not None), default=None)
        for name, at in alarms.items():
            watched[name] += DAYS if at is None else at + 1
            first[name] += [] if at is None else [at]
        moments.append([float(x) for one in (found.offset, found.gain, found.scatter) for x in (one.mean(), one.var())])
        step(seed - FIRST_SEED + 1)
    average = np.mean(moments, axis=0)
    return {
        "sensor": sensor,
        "days": watched,
        "alarms": {name: len(found) for name, found in first.items()},
        "moments": [round(float(x), 3) for x in average],
    }


def detections(scenario: ScenarioFile, fault: Fault, step: Callable[[int], None]) -> dict[str, Any]:
    """Return the days from the fault to its alarm, and what is said to explain it."""
    delays: list[int] = []
    before, reasons, charts = 0, Counter[str](), Counter[str]()
    for seed in range(FIRST_SEED, FIRST_SEED + FAULT_SEEDS):
        healthy = days_of(scenario, SENSORS[seed % len(SENSORS)], FAULT_DAY + FAULT_DAYS, seed)
        days = course(with_fault(healthy, fault, seed))
        told = [(chart.alarm, chart.begin, chart.name) for chart in charts_of(days.innovations())]
        alarms = sorted((at, begin, name) for at, begin, name in told if at is not None and begin is not None)
        before += bool(alarms) and alarms[0][0] < FAULT_DAY
        late = [alarm for alarm in alarms if alarm[0] >= FAULT_DAY]
        if late:
            at, begin, name = late[0]
            delays.append(at - FAULT_DAY + 1)
            reasons[explanation_of(days, begin, at).best.name] += 1
            charts[name] += 1
        step(seed - FIRST_SEED + 1)
    return {
        "fault": fault.name,
        "told": len(delays),
        "of": FAULT_SEEDS,
        "before": before,
        "delays": sorted(delays),
        "reasons": dict(reasons.most_common()),
        "charts": dict(charts.most_common()),
    }


def measured() -> dict[str, Any]:
    """Measure everything."""
    scenario = load_scenario(SCENARIO)
    with show_progress() as progress:
        false = [
            false_alarms(scenario, sensor, lambda done, sensor=sensor: progress(f"no fault, {sensor}", done, SEEDS))
            for sensor in SENSORS
        ]
        faults = [
            detections(scenario, fault, lambda done, fault=fault: progress(fault.name, done, FAULT_SEEDS))
            for fault in FAULTS
        ]
    return {"days": DAYS, "seeds": SEEDS, "false": false, "faults": faults}


def document(found: dict[str, Any]) -> str:
    """Return the page for recorded figures."""
    false = "\n".join(
        f"| {row['sensor'].replace('_', ' ')} | {row['days']['any']:,} | "
        + " | ".join(str(row["alarms"][name]) for name in (*CHARTS, "any"))
        + f" | {', '.join(f'{x:.2f}' for x in row['moments'][::2])} | "
        + f"{', '.join(f'{x:.2f}' for x in row['moments'][1::2])} |"
        for row in found["false"]
    )
    days = sum(row["days"]["any"] for row in found["false"])
    alarms = sum(row["alarms"]["any"] for row in found["false"])
    low, high = run_length(days, alarms)
    between = f"{days / alarms:,.0f} days of measurements" if alarms else "more days than were watched"
    reach = f"more than {low:,.0f} days" if high is None else f"{low:,.0f} to {high:,.0f} days"
    faults = "\n".join(
        f"| {row['fault']} | {row['told']} of {row['of']} | {quantiles(row['delays'])} | "
        f"{counted(row['charts'])} | {counted(row['reasons'])} |"
        for row in found["faults"]
    )
    return TEMPLATE.format(
        command="python -m benchmarks.sensor_health --document",
        days=found["days"],
        seeds=found["seeds"],
        step=STEP_LIMIT,
        warning=WARNING_LIMIT,
        most=MOST_OF_A_DAY,
        allowance=ALLOWANCE,
        decision=DECISION,
        heads=" | ".join(CHARTS),
        lines="---|" * (len(CHARTS) + 5),
        false=false,
        between=between,
        reach=reach,
        fault_day=FAULT_DAY,
        fault_days=FAULT_DAYS,
        fault_seeds=FAULT_SEEDS,
        faults=faults,
        following=FOLLOWING,
    )


def run_length(days: int, alarms: int) -> tuple[float, float | None]:
    """Return the 95 % interval of the mean days between false alarms, which come at random; None for no upper end."""
    low = 2 * days / float(stats.chi2.ppf(0.975, 2 * alarms + 2))
    return low, 2 * days / float(stats.chi2.ppf(0.025, 2 * alarms)) if alarms else None


def quantiles(delays: list[int]) -> str:
    """Return the median delay, and nine tenths of them."""
    if not delays:
        return "-"
    middle, late = (float(np.quantile(delays, share, method="higher")) for share in (0.5, 0.9))
    return f"{middle:.0f}, {late:.0f}"


def counted(names: dict[str, int]) -> str:
    """Return names with their counts."""
    return ", ".join(f"{name} {count}" for name, count in names.items()) or "-"


TEMPLATE = """# Sensor health

Made by `{command}`; every figure is a result of that run.

`sosmith calibrate health` says whether a sensor still behaves as its measurements so far and its type would predict.
Each day's measurements in the store are predicted from the days before, by the mixed-effects model of the
[calibration](calibration.md#two-ways-of-fitting), and three numbers are kept of the difference: a step of the
offset, a step of the gain, and the scatter. While the sensor drifts no more than its type, they are independent,
with mean 0 and variance 1.

```sh
./run calibrate health --sensor left --plot health.svg
```

![Control charts of a sensor that is turned after 60 days](images/health.svg)

The picture is of an emulated sensor that is turned on day 60.

## The charts

- **Step**: an offset or gain that is {step:g} standard deviations off on one day.
- **Drift**: cumulative sums of offset and gain, upwards and downwards. Each day adds its number, at most {most:g},
  less {allowance:g}; the alarm is at {decision:g}.
- **Scatter**: the same for the scatter, upwards.

Below the limit of a step there is a warning limit. If the offset of the last day is {warning:g} standard deviations or
more, a notice says by how many mm the sensor reads differently, that one day in 20 is beyond the limit by chance
([how many were](days.md#sensors-that-are-not-as-their-type)), and that, if the sensor has stepped, intervals may not
hold until another day is measured. A notice is no alarm: the exit status is 0.

Readings at the sensor's rail do not count, nor do measurements off the plane of their own day; `add` tells how many
are off the curve that it fits to all days, which may be others. The first day is held against the type only, and
raises no alarm. An alarm stands, and the exit status is 1, until `--since` begins the charts later: the sensor has been
looked at. Measurements of another sensor belong under another name (`--sensor`): the calibration would take them
for the old one's drift.

Each alarm comes with the explanation that makes the measurements since the change most probable, all being equally
likely beforehand: chance; drift four times faster; *mounted anew*, a step of all clearances alike; *turned*, a step
of offset and gain far outside the drift of the type; *another sensor*, of which nothing but the type is known;
twice the *scatter*. The days from the change to the alarm decide, and at least {following} days if there are so
many.

## False alarms

The week in service of the [campaign](campaign.md), continued for {days} days: 15 measurements a day, an ageing
sensor, {seeds} sensors of each kind, none of which was used to choose the limits. All are taken for sensors of the
type equation 5a. First alarms only; mean and variance are those of offset, gain and scatter.

| true sensor | days watched | {heads} | any | mean | variance |
|{lines}
{false}

Together, there are {between} from one false alarm to the next ({reach} at 95 %).

## How soon a fault is told

From day {fault_day} on, for {fault_days} days and {fault_seeds} sensors of all three kinds; days from the fault to
the alarm, as the median and the day by which nine of ten of those told are; which chart tells it first, and the
explanation then.

| fault | told | days: half, nine tenths | by | explained by |
|---|---|---|---|---|
{faults}

A day of 15 measurements with the scatter of this depot, 0.475 mm, and a systematic error of 0.129 mm knows the
offset to 0.14 mm: a fault of that size needs several days.
"""


def drawing() -> bytes:
    """Draw the charts of a sensor that is turned."""
    fault = next(fault for fault in FAULTS if fault.name.startswith("turned"))
    measurements = with_fault(
        days_of(load_scenario(SCENARIO), SENSORS[1], FAULT_DAY + FAULT_DAYS, FIRST_SEED), fault, 1
    )
    return health_plot("left", health_of(measurements, SENSOR_TYPES[DEFAULT_TYPE], DEFAULT_RANGES[1]), "svg")


def main() -> None:
    """Measure; print JSON, or renew the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sensor_health", description=__doc__)
    parser.add_argument("--document", action="store_true", help="record, and renew docs/health.md and its picture")
    parser.add_argument("--recorded", action="store_true", help="do not measure: renew the page from the record")
    arguments = parser.parse_args()
    found = json.loads(RECORD.read_text(encoding="utf-8")) if arguments.recorded else measured()
    text = json.dumps(found, indent=1) + "\n"
    if not (arguments.document or arguments.recorded):
        print(text, end="")
        return
    write_contents(HERE, {RECORD.name: text.encode()})
    write_contents(PAGE.parent, {PAGE.name: document(found).encode()})
    write_contents(PAGE.parent / "images", {"health.svg": drawing()})


if __name__ == "__main__":
    main()
