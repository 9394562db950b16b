"""The tables that show a design."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.calibration.fit import Fit, read_measurements
from sosmith.gen.output.core_facts import LimitCycleFacts
from sosmith.gen.output.decimation_facts import RateCosts
from sosmith.gen.quantity import LEAST_PART, quantity
from sosmith.gen.specification.specification import Specification
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.instrument.calibration.uncertainty import of_polynomial
from sosmith.instrument.uncertainty.budget import SHARE
from sosmith.instrument.uncertainty.instrument_budget import InstrumentBudget
from sosmith.interface.design import Design
from sosmith.interface.quantity import Quantity
from sosmith.model.dataflow.program import Program
from sosmith.model.port import Port
from sosmith.model.sections.start import StartStage


def print_design(design: Design, *, details: bool = False) -> None:
    """Print a design, with its sections, limit cycles and schedule as `details`."""
    console, made = TableConsole(), design.core
    quantized, datapath = made.quantized, made.datapath
    unit = escape(f" {datapath.output.unit}") if datapath.output.unit else ""
    lsb = float(datapath.output.lsb)
    overview = new_table(f"{made.spec.name}: {made.core}", ["", ""])
    if quantized.filter is not None:
        overview.add_row("filter", quantized.filter.describe)
        aliasing = quantized.filter.aliasing
        if aliasing is not None:
            deviation, dc = 100 * aliasing.max_deviation, 100 * aliasing.dc_error
            overview.add_row("aliasing", f"at most {deviation:.3g} % of the gain, {dc:.3g} % at zero frequency")
    _add_decimation(overview, design)
    _add_calibration(overview, design)
    for subject, reason in made.reasons.items():
        overview.add_row(subject, reason)
    overview.add_row("output", f"{datapath.output.bits} bits, one LSB = {lsb:.6g}{unit}")
    if made.spec.wear is not None:
        overview.add_row("wear flags", _wear_text(made.spec.wear, datapath.output))
    for name, value in (*_all_hardware_rows(made.architecture), *_option_rows(made.architecture)):
        overview.add_row(name, value)
    if made.spec.channels > 1:
        overview.add_row("channels", f"{made.spec.channels:,}, each at {float(made.spec.sample_rate):,.6g} Hz")
    console.print(overview)
    print_budget(console, design.budget, datapath.output.lsb, design.specification.max_error)
    if design.facts.decimation is not None:
        _print_rates(console, design.rate_costs, datapath.output.unit, made.spec.channels)
    if not details:
        return
    if design.uncertainty is not None:
        print_uncertainty(console, design.uncertainty)
    sections = new_table("Sections", ["section", "coefficients", "input", "states", "output"])
    for section in design.facts.sections:
        coefficients = "\n".join(f"{c.name} = {c.integer} * 2^-{c.frac}" for c in section.coefficients)
        states = "\n".join(f"{name} {form}" for name, form in section.states.items())
        sections.add_row(section.name, coefficients, section.input, states, section.output)
    if design.facts.sections:
        console.print(sections)
        _print_limit_cycles(console, design.facts.limit_cycles, lsb)
    _print_schedules(console, made.architecture)


def _add_decimation(overview: Table, design: Design) -> None:
    """Say what stands before the filter, and what it lets through."""
    found = design.facts.decimation
    if found is None:
        return
    unit = design.core.datapath.output.unit
    before = found.calibration
    if before is not None:
        overview.add_row(
            "into the decimator",
            f"the calibration's result, {quantity(before.low, unit)} to {quantity(before.high, unit)} in {before.bits} "
            f"bits, within {quantity(before.error, unit)}; not limited",
        )
    overview.add_row(
        "decimator",
        f"{found.stages} integrators and combs of {found.width} bits, {found.width - found.dropped} bits leave, at "
        f"{found.sample_rate:,.6g} Hz",
    )
    if found.held:
        overview.add_row("results", f"each {found.factor} times, at the rate of the samples")
    most = max(band.gain_db for band in found.aliasing)
    overview.add_row(
        "aliasing into the pass band",
        f"at most {most:.1f} dB, {quantity(found.worst_aliasing, unit)} of a sine over the whole range of "
        f"{'the input' if before is None else 'that result'}",
    )
    overview.add_row(
        f"anything from {found.sample_rate / 2:,.6g} Hz on",
        f"at most {found.largest_db:.1f} dB, {quantity(found.largest, unit)}, wherever it folds; "
        f"{found.direct_largest_db:.1f} dB without a decimator",
    )
    overview.add_row("gain in the pass band", f"within {found.deviation_db:.2g} dB of that without a decimator")


def _print_rates(console: Console, costs: Mapping[str, RateCosts], unit: str, channels: int) -> None:
    table = new_table("The same filter without a decimator", ["", *costs])
    table.add_row("architecture", *(each.architecture for each in costs.values()))
    table.add_row("clocks a sample", *(f"{each.clocks_per_sample:,.4g}" for each in costs.values()))
    memories = ("none" if each.memory_bits is None else f"{each.memory_bits:,} bits" for each in costs.values())
    table.add_row("memory", *memories)
    where = "registers" if channels == 1 else "memory"
    table.add_row(f"{where} of the decimator", *(f"{each.decimator_bits:,} bits" for each in costs.values()))
    table.add_row("error bound", *(escape(quantity(each.bound, unit)) for each in costs.values()))
    table.add_row("delay", *(quantity(each.delay, "s") for each in costs.values()))
    console.print(table)


def _add_calibration(overview: Table, design: Design) -> None:
    """Say where the calibration comes from, and what a reading is worth."""
    made, polynomial, worth = design.core, design.core.quantized.polynomial, design.uncertainty
    if polynomial is None:
        return
    m, n = polynomial.orders
    if made.fit is not None:
        overview.add_row(
            "calibration",
            f"fitted: orders {m} in voltage, {n} in temperature, adjusted r {made.fit.adjusted_r:.4f}",
        )
        overview.add_row("its measurements", _worth(made.spec, made.fit))
    else:
        overview.add_row("calibration", f"given: orders {m} in voltage, {n} in temperature")
    overview.add_row("reading", UNKNOWN if worth is None else escape(worth.summary))


def _worth(spec: Specification, fitted: Fit) -> str:
    """Return what a fitted calibration is worth, in the unit of its measurements: the proof covers arithmetic only."""
    assert spec.calibration is not None
    assert spec.calibration.data is not None
    found = of_polynomial(read_measurements(spec.calibration.data), fitted)
    low, high = found.limits
    missed = f"; {found.lack.warning}" if found.lack.structured else ""
    return f"hold 95 % of the clearances within ±{low:.3g} to ±{high:.3g} mm of the polynomial{missed}"


def _wear_text(wear: WearSpec, output: Port) -> str:
    """Return the clearances at which the wear flags are set: one value, or the range over the channels."""
    unit = f" {output.unit}".rstrip()

    def span(values: Sequence[Fraction]) -> str:
        low, high = float(min(values)), float(max(values))
        return f"{low:g}{unit}" if low == high else f"{low:g} to {high:g}{unit}, by channel,"

    warning, critical = (span(values) for values in zip(*wear.clearances(), strict=True))
    return escape(f"warning from {warning} on, critical from {critical} on")


def _all_hardware_rows(architecture: Architecture) -> list[tuple[str, str]]:
    """Return the resources of the hardware, those of a program before a decimator first."""
    ahead = architecture.ahead
    apart = [] if ahead is None or ahead.program is None else _hardware_rows(ahead)
    return [*((f"{name}, calibration", value) for name, value in apart), *_hardware_rows(architecture)]


def _hardware_rows(architecture: Architecture) -> list[tuple[str, str]]:
    """Return the resources of the hardware, before synthesis."""
    program, cost = architecture.program, architecture.cost
    latency = ("latency", f"{architecture.latency_cycles:,} clocks")
    if program is None:
        sizes = f"{cost.adder_bits}, {cost.register_bits}"
        return [latency, ("multipliers", cost.multiplier_sizes), ("adder bits, state and register bits", sizes)]
    word = program.digit_bits + 1
    multiplier = "none, shifts and additions" if architecture.multiplier_blocks == 0 else f"1 of {word} x {word}"
    memory = f"{program.words:,} words of {word} bits a channel, {program.states:,} of them states"
    accumulator = f"{program.accumulator_bits} bits"
    return [
        latency,
        ("multipliers", multiplier),
        ("accumulator", accumulator),
        ("memory", memory),
    ]


_PROTECTION = {
    "detect": "a wrong bit in a memory or a state is detected, and the core starts anew",
    "correct": "a wrong bit in a memory is corrected, two are detected, and the core starts anew",
}


def _option_rows(architecture: Architecture) -> list[tuple[str, str]]:
    """Return what was asked for beside the arithmetic."""
    rows = []
    if any(isinstance(stage, StartStage) for stage in architecture.datapath.stages):
        rows.append(("start", "from the steady state of the first sample"))
    if architecture.reload:
        rows.append(("reload", "coefficients are loaded at run time, over AXI4-Lite"))
    if architecture.protect in _PROTECTION:
        rows.append(("upsets", _PROTECTION[architecture.protect]))
    return rows


def _print_schedules(console: Console, architecture: Architecture) -> None:
    if architecture.ahead is not None:
        _print_schedule(console, architecture.ahead.program, " in the calibration")
    _print_schedule(console, architecture.program)


def _print_schedule(console: Console, program: Program | None, where: str = "") -> None:
    if program is None:
        return
    table = new_table(
        f"Schedule: {len(program.instructions)} instructions for each sample of each channel{where}",
        ["from", "clocks", "value", "words"],
    )
    words = {at.name: ", ".join(map(str, at.addresses)) for at in program.locations}
    for name, start, count in program.schedule:
        table.add_row(str(start), str(count), escape(name), words.get(name, ""))
    console.print(table)


def _print_limit_cycles(console: Console, cycles: Sequence[LimitCycleFacts], lsb: float) -> None:
    table = new_table(
        "Limit cycles: what a section's own rounding can sustain, in output LSB",
        ["section", "without input", "dead band", "Lyapunov weights"],
    )
    for found in cycles:
        largest = "none, proven" if found.none else f"up to {found.largest / lsb:.4g}"
        weights = ", ".join(f"{float(weight):.4g}" for weight in found.lyapunov or ())
        table.add_row(found.section, largest, f"{found.dead_band / lsb:.4g}", weights or "not needed")
    console.print(table)


def print_uncertainty(console: Console, found: InstrumentBudget) -> None:
    """Print the uncertainty budget at the point of the largest uncertainty."""
    at, budget, unit = found.worst, found.budget, found.unit
    where = f"{found.clearance[at]:.3g} {unit} ({found.voltage[at]:.3g} V, {found.temperature[at]:.3g} °C)"
    table = new_table(
        f"Uncertainty of a reading at {escape(where)}, where it is largest",
        ["source", "distribution", "u", "sensitivity", escape(unit), "freedom"],
    )
    for one in budget.contributions:
        per = "" if one.unit == unit else " s" if one.unit == f"{unit}/s" else f" {unit}/{one.unit}"
        freedom = f"{one.freedom:.3g}" if math.isfinite(one.freedom) else "known"
        table.add_row(
            one.source,
            one.kind,
            f"{one.uncertainty[at]:.3g} {escape(one.unit)}",
            f"{one.sensitivity[at]:.3g}{escape(per)}",
            f"{one.contribution[at]:.3g}",
            freedom,
        )
    freedom = f"{budget.freedom[at]:.3g}" if math.isfinite(budget.freedom[at]) else "known"
    table.add_row("[bold]combined[/]", "", "", "", f"{budget.combined[at]:.3g}", freedom)
    table.add_row(
        "[bold]expanded[/]", f"{100 * SHARE:g} %", "", f"k = {budget.factor[at]:.3g}", f"{budget.expanded[at]:.3g}", ""
    )
    console.print(table)


UNKNOWN = "not stated; the bound below is that of the arithmetic alone"
"""What stands for the uncertainty of a reading where the calibration's own is not known."""


def print_budget(console: Console, budget: Mapping[str, Quantity], lsb: Fraction, max_error: Quantity) -> None:
    """Print the parts of an error bound that count, and the allowed error, in the output's unit and in LSB."""
    table = new_table(
        "Error budget of the arithmetic, proven for all inputs in range"
        if "calibration" in budget
        else "Error budget, proven for all inputs in range",
        ["part", escape(max_error.unit) or "full scale 1", "output LSB"],
    )
    seen = {part: value for part, value in budget.items() if value >= float(lsb) * LEAST_PART}
    for part, value in [*seen.items(), ("[bold]sum[/]", sum(budget.values())), ("allowed", max_error)]:
        table.add_row(part, f"{float(value):.3g}", f"{float(value) / float(lsb):.4f}")
    console.print(table)
