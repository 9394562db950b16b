"""What a design says of itself, in tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.folded_fir import FoldedFir
from sosmith.gen.architectures.multiplexed import Multiplexed
from sosmith.gen.architectures.polyphase import Polyphase
from sosmith.gen.architectures.shared_fir import SharedFir
from sosmith.gen.core import CoreDesign
from sosmith.gen.estimate.estimate import Estimate
from sosmith.gen.facts.cost_table import cost_table
from sosmith.gen.facts.design_tables import budget_table, limit_cycles_table, uncertainty_table
from sosmith.gen.facts.table import Table
from sosmith.gen.filter.decimation import SAMPLED
from sosmith.gen.output.core_facts import CoreFacts, SectionFacts
from sosmith.gen.output.decimation_facts import DecimationFacts, DownsamplingFacts, RateCosts
from sosmith.gen.quantity import count, quantity
from sosmith.gen.specification.specification import Specification
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.interface.quantity import Quantity
from sosmith.model.dataflow.program import Program
from sosmith.model.port import Port

if TYPE_CHECKING:
    from sosmith.gen.calibration.fit import Fit
    from sosmith.instrument.uncertainty.instrument_budget import InstrumentBudget

Rows = list[Sequence[str]]


def design_tables(
    core: CoreDesign,
    facts: CoreFacts,
    *,
    budget: Mapping[str, Quantity],
    rate_costs: Mapping[str, RateCosts],
    estimates: Sequence[Estimate],
    uncertainty: InstrumentBudget | None,
    details: bool,
) -> list[Table]:
    """Say what a design is, and how its error bound comes about; its sections, limit cycles and schedule as details."""
    tables = [
        Table(f"{facts.name}: {facts.core}", _overview(core, facts, uncertainty)),
        budget_table(budget, facts.max_error, facts.lsb, facts.unit),
    ]
    if facts.decimation is not None:
        tables.append(_rates(rate_costs, facts.output.unit, facts.channels))
    if estimates:
        tables.append(cost_table(estimates))
    if not details:
        return tables
    if uncertainty is not None:
        from sosmith.instrument.uncertainty.instrument_budget import budget_json

        tables.append(uncertainty_table(budget_json(uncertainty)))
    if facts.sections:
        tables += [_sections(facts.sections), limit_cycles_table(facts.limit_cycles, facts)]
    calibration = core.architecture.calibration
    before = (
        None
        if calibration is None or calibration.program is None
        else _schedule(calibration.program, " in the calibration")
    )
    own = None if facts.program is None else _schedule(facts.program)
    return tables + [table for table in (before, own) if table is not None]


def _overview(core: CoreDesign, facts: CoreFacts, uncertainty: InstrumentBudget | None) -> Rows:
    spec, architecture = core.spec, core.architecture
    unit = f" {facts.unit}" if facts.unit else ""
    rows: Rows = []
    if facts.filter is not None:
        rows.append(("filter", facts.description))
    if facts.aliasing is not None:
        deviation, dc = 100 * facts.aliasing.max_deviation, 100 * facts.aliasing.dc_error
        rows.append(("aliasing", f"at most {deviation:.3g} % of the gain, {dc:.3g} % at zero frequency"))
    if facts.decimation is not None:
        rows += _decimation(facts.decimation, facts.unit)
    if facts.downsampling is not None:
        rows += _downsampling(facts.downsampling)
    rows += [*_calibration(core, uncertainty), *facts.reasons.items()]
    rows.append(("output", f"{facts.output.bits} bits, one LSB = {facts.lsb:.6g}{unit}"))
    if spec.wear is not None:
        rows.append(("wear flags", _wear_text(spec.wear, facts.output)))
    rows += [*_all_hardware_rows(architecture), *_option_rows(facts)]
    if facts.channels > 1:
        rows.append(("channels", f"{facts.channels:,}, each at {float(spec.sample_rate):,.6g} Hz"))
    return rows


def _downsampling(downsampling: DownsamplingFacts) -> Iterator[tuple[str, str]]:
    """Say which results of an FIR filter leave."""
    rate = f"at {downsampling.sample_rate:,.6g} Hz"
    yield "decimation", f"one result for {downsampling.factor} samples, {rate}; no other is computed"
    if downsampling.held:
        yield "results", f"each {downsampling.factor} times, at the rate of the samples"


def _decimation(decimation: DecimationFacts, unit: str) -> Iterator[tuple[str, str]]:
    """Say what stands before the filter, and what it lets through."""
    before = decimation.calibration
    if before is not None:
        yield (
            "into the decimator",
            f"the calibration's result, {quantity(before.low, unit)} to {quantity(before.high, unit)} in {before.bits} "
            f"bits, within {quantity(before.error, unit)}; not limited",
        )
    yield (
        "decimator",
        f"{count(decimation.stages, 'integrator')} and {count(decimation.stages, 'comb')} of {decimation.width} bits, "
        f"{decimation.width - decimation.dropped} bits leave, at "
        f"{decimation.sample_rate:,.6g} Hz",
    )
    if decimation.held:
        yield "results", f"each {decimation.factor} times, at the rate of the samples"
    alone = max(band.gain_db for band in decimation.aliasing)
    most = max(band.passing_db for band in decimation.aliasing)
    yield (
        "aliasing into the pass band",
        f"at most {most:.1f} dB at the output, {quantity(decimation.worst_aliasing, unit)} of a sine over the "
        f"whole range of {'the input' if before is None else 'that result'}; {alone:.1f} dB behind the decimator",
    )
    yield (
        f"anything from {decimation.sample_rate / 2:,.6g} Hz on",
        f"at most {decimation.largest_db:.1f} dB, {quantity(decimation.largest, unit)}, wherever it folds; "
        f"{decimation.direct_largest_db:.1f} dB without a decimator",
    )
    yield (
        "gain in the pass band",
        f"within {decimation.deviation_db:.2g} dB of that without a decimator, at {SAMPLED} frequencies",
    )


def _rates(costs: Mapping[str, RateCosts], unit: str, channels: int) -> Table:
    each = costs.values()
    where = "registers" if channels == 1 else "memory"
    rows: Rows = [
        ("architecture", *(one.architecture for one in each)),
        ("clocks a sample", *(f"{one.clocks_per_sample:,.4g}" for one in each)),
        ("memory", *("none" if one.memory_bits is None else f"{one.memory_bits:,} bits" for one in each)),
        (f"{where} of the decimator", *(f"{one.decimator_bits:,} bits" for one in each)),
        ("error bound", *(quantity(one.bound, unit) for one in each)),
        ("delay", *(quantity(one.delay, "s") for one in each)),
    ]
    if "direct" not in costs:
        rows.append(("without a decimator", "no word lengths meet the specification"))
    return Table("The same filter without a decimator", rows, ("", *costs))


def _calibration(core: CoreDesign, uncertainty: InstrumentBudget | None) -> Iterator[tuple[str, str]]:
    """Say where the calibration comes from, and what a reading is worth."""
    polynomial = core.quantized.polynomial
    if polynomial is None:
        return
    m, n = polynomial.orders
    orders = f"orders {m} in voltage, {n} in temperature"
    if core.fit is not None:
        yield "calibration", f"fitted: {orders}, adjusted r {core.fit.adjusted_r:.4f}"
        yield "its measurements", _worth(core.spec, core.fit)
    else:
        yield "calibration", f"given: {orders}"
    yield "reading", UNKNOWN if uncertainty is None else uncertainty.summary


def _worth(spec: Specification, fitted: Fit) -> str:
    """Return what a fitted calibration is worth, in the unit of its measurements: the proof covers arithmetic only."""
    assert spec.calibration is not None
    assert spec.calibration.data is not None
    from sosmith.gen.calibration.fit import read_measurements
    from sosmith.instrument.calibration.uncertainty import of_polynomial  # with scipy.special, which is long in coming

    uncertainty = of_polynomial(read_measurements(spec.calibration.data), fitted)
    low, high = uncertainty.limits
    missed = f"; {uncertainty.lack.warning}" if uncertainty.lack.structured else ""
    return f"hold 95 % of the clearances within ±{low:.3g} to ±{high:.3g} mm of the polynomial{missed}"


def _wear_text(wear: WearSpec, output: Port) -> str:
    """Return the clearances at which the wear flags are set: one value, or the range over the channels."""
    unit = f" {output.unit}".rstrip()

    def span(values: Sequence[Fraction]) -> str:
        low, high = float(min(values)), float(max(values))
        return f"{low:g}{unit}" if low == high else f"{low:g} to {high:g}{unit}, by channel,"

    warning, critical = (span(values) for values in zip(*wear.clearances(), strict=True))
    return f"warning from {warning} on, critical from {critical} on"


def _all_hardware_rows(architecture: Architecture) -> list[tuple[str, str]]:
    """Return the resources of the hardware, those of a program before a decimator first."""
    calibration = architecture.calibration
    apart = [] if calibration is None or calibration.program is None else _hardware_rows(calibration)
    return [*((f"{name}, calibration", value) for name, value in apart), *_hardware_rows(architecture)]


def _hardware_rows(architecture: Architecture) -> list[tuple[str, str]]:
    """Return the resources of the hardware, before synthesis."""
    program, cost = architecture.program, architecture.cost
    latency = ("latency", f"{architecture.latency_cycles:,} clocks")
    if isinstance(architecture, FoldedFir):
        port, plan, turn, shared = architecture.datapath.inputs[0], architecture.in_turn, 0, ""
        if isinstance(architecture, SharedFir):
            turn, shared = architecture.turn, f", for all {len(architecture.results)} results of a sample"
        steps = f"{len(plan.rounds[turn])} steps for a result{shared}"
        return [
            latency,
            ("multipliers", f"1 of {plan.data_bits} x {plan.factor_bits}, {steps}"),
            ("memory", f"{plan.words:,} samples of {port.bits} bits a channel{', twice' * plan.pairs}"),
        ]
    if isinstance(architecture, Polyphase):
        (size, *_), phases = architecture.multiplications, architecture.plan
        multipliers = f"{phases.multipliers} of {size.data.bits} x {size.factor.bits}, which take turns"
        products = f"{len(phases.steps.steps)} products for a result"
        return [latency, ("multipliers", f"{multipliers}: {products}"), ("line", f"{phases.length:,} samples")]
    if isinstance(architecture, Multiplexed):
        cost = architecture.shared_cost
    if program is None:
        sizes = f"{cost.adder_bits}, {cost.register_bits}"
        return [latency, ("multipliers", cost.multiplier_sizes), ("adder bits, state and register bits", sizes)]
    word = program.digit_bits + 1
    count = architecture.multiplier_blocks
    multiplier = f"{count} of {word} x {word}" if count else "none, shifts and additions"
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


def _option_rows(facts: CoreFacts) -> Iterator[tuple[str, str]]:
    """Say what was asked for beside the arithmetic."""
    if facts.start == "steady":
        yield "start", "from the steady state of the first sample"
    if facts.reload is not None:
        yield "reload", "coefficients are loaded at run time, over AXI4-Lite"
    if facts.protect in _PROTECTION:
        yield "upsets", _PROTECTION[facts.protect]


def _sections(sections: Sequence[SectionFacts]) -> Table:
    rows: Rows = [
        (
            section.name,
            "\n".join(f"{c.name} = {c.integer} * 2^-{c.frac}" for c in section.coefficients),
            section.input,
            "\n".join(f"{name} {form}" for name, form in section.states.items()),
            section.output,
        )
        for section in sections
    ]
    return Table("Sections", rows, ("section", "coefficients", "input", "states", "output"))


def _schedule(program: Program, where: str = "") -> Table:
    words = {at.name: ", ".join(map(str, at.addresses)) for at in program.locations}
    rows: Rows = [(str(start), str(count), name, words.get(name, "")) for name, start, count in program.schedule]
    title = f"Schedule: {len(program.instructions)} instructions for each sample of each channel{where}"
    return Table(title, rows, ("from", "clocks", "value", "words"))


UNKNOWN = "not stated; the bound below is that of the arithmetic alone"
"""What stands for the uncertainty of a reading where the calibration's own is not known."""
