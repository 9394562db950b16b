"""The table of a co-simulation's results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sosmith.gen.facts.table import Table
from sosmith.gen.quantity import count, duration, in_own_unit, plain_number, quantity


def report_table(summary: Mapping[str, Any]) -> Table:
    """Say verdict, the measurement, the arithmetic and the speed; `summary` is the content of ``report.json``."""
    unit = summary["error"]["unit"]
    rows: list[Sequence[str]] = [*_measurement(summary, unit), *_arithmetic(summary, unit)]
    rows += [("short", reason) for reason in summary["shortfalls"]]
    rows += [("note", reason) for reason in summary["notes"]]
    rows.append(("simulated by", _speed(summary)))
    return Table(summary["name"], rows, styles={"short": "red"}, passed=summary["passed"])


def _measurement(summary: Mapping[str, Any], unit: str) -> Iterator[tuple[str, str]]:
    error, accuracy = summary["true_error"], summary["accuracy_percent"]
    if error is not None:
        words = f"at most {in_own_unit(error['max_abs'], unit)}, RMS {in_own_unit(error['rms'], unit)}"
        yield "error against the true value", f"{words}, over {count(error['readings'], 'reading')}"
    if accuracy["hardware"] is not None:
        without = accuracy["unfiltered"]
        beside = "" if without is None else f"; {without:.2f} % without the filter"
        yield "accuracy, the paper's measure", f"{accuracy['hardware']:.2f} %{beside}"
    worth = summary["uncertainty"]
    if worth is not None:
        low, high = (plain_number(worth["expanded"][key]) for key in ("smallest", "largest"))
        yield "uncertainty of a reading", f"±{low} to ±{high} {worth['unit']} at {100 * worth['probability']:g} %"
    delay, settling = summary["delay"], summary["settling"]
    if delay is not None:
        where = "" if delay["frequency"] == 0 else f" at {quantity(delay['frequency'], 'Hz')}"
        yield "delay of the filter", f"{quantity(delay['seconds'], 's')}{where}"
    if settling is not None:
        over = settling["overshoot_percent"]
        beyond = "" if over is None else f"; overshoot {plain_number(over)} %"
        yield "settling time to 1 %", f"{quantity(settling['seconds'], 's')}{beyond}"


def _arithmetic(summary: Mapping[str, Any], unit: str) -> Iterator[tuple[str, str]]:
    error, samples = summary["error"], count(summary["samples"], "sample")
    exact = (
        f"yes, all of {samples}"
        if summary["bit_exact"]
        else f"no: {summary['mismatches']:,} differ, the first at {summary['first_mismatch']:,}, of {samples}"
    )
    yield "hardware equals integer model", exact
    largest = f"at most {quantity(error['max_abs'], unit)} = {plain_number(error['max_lsb'])} LSB"
    limit = f"proven limit {quantity(error['bound'], unit)}"
    yield "error of the arithmetic", f"{largest}; {limit}"
    if summary["sqnr_db"] is not None:
        yield "signal to error", f"{summary['sqnr_db']:.1f} dB"
    for other in summary["alternatives"]:
        yield f"  {other['name']} at the same widths", f"at most {quantity(other['max_abs'], unit)}"


def _speed(summary: Mapping[str, Any]) -> str:
    gates = "" if summary["gates"] is None else f", the netlist for {summary['gates']}"
    clocks = f"{summary['simulator']}{gates}: {count(summary['cycles'], 'clock')}"
    speed = summary["cycles_per_second"]
    return f"{clocks} in {duration(summary['cycles'] / speed)}" if speed else clocks
