"""The headline figures of a run, for page, terminal and `report.json`: the measurement first, the speed last."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from sosmith.gen.facts.design_tables import ErrorUnit, lsb
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.quantity import count, decibels, duration, full_scale_level, in_own_unit, plain_number, quantity
from sosmith.gen.report.behaviour import Behaviour
from sosmith.gen.report.evidence import Evidence

Summary = Mapping[str, Any]

SIMULATION = "The simulation"
"""Title of the group that is no part of the result, and stands last."""


def unbroken(text: str) -> str:
    """Return a text in which no number is parted from what it counts at the end of a line."""
    return re.sub(r"(?<=\d) ", "\u00a0", text)


@dataclass(frozen=True)
class _Run:
    """A run with what is measured of it."""

    evidence: Evidence
    summary: Summary
    measured: Behaviour


def headlines(evidence: Evidence, summary: Summary, measured: Behaviour) -> list[dict[str, Any]]:
    """Return groups with `title` and `facts` in JSON types, from the top of the page, none without a fact."""
    run = _Run(evidence, summary, measured)
    groups = {
        "The measurement": list(_measurement(run)),
        "The arithmetic": list(_arithmetic(run)),
        "The hardware": list(_hardware(evidence)),
        SIMULATION: [_speed(evidence)],
    }
    return [{"title": title, "facts": [fact.as_dict() for fact in facts]} for title, facts in groups.items() if facts]


def report_table(summary: Summary) -> Table:
    """Say verdict, the measurement, the arithmetic and the speed; `summary` is the content of ``report.json``."""
    *first, speed = (fact for group in summary["facts"] for fact in group["facts"])
    rows = [Fact(fact["name"], fact["text"], sentence=fact["sentence"]) for fact in first]
    unit = summary["error"]["unit"]
    rows += [
        Fact(f"Largest error with {other['name']} at the same widths", quantity(other["max_abs"], unit))
        for other in summary["alternatives"]
    ]
    rows += [Fact("Short", reason) for reason in summary["shortfalls"]]
    rows += [Fact("Note", reason) for reason in summary["notes"]]
    rows.append(Fact(speed["name"], speed["text"], sentence=speed["sentence"]))
    return Table(summary["name"], rows, styles={"Short": "red"}, passed=summary["passed"])


def _measurement(run: _Run) -> Iterator[Fact]:
    if (sound := run.summary["sound"]) is not None:
        yield from _sound(sound)
    evidence, unit = run.evidence, run.evidence.facts.unit
    error, accuracy = run.measured.true_error, run.summary["accuracy_percent"]
    if error is not None:
        beside = f"RMS {in_own_unit(error.rms, unit)}, mean {in_own_unit(error.mean, unit)}"
        over = count(run.measured.readings, "reading")
        yield Fact("Largest error against the true value", error.max_abs, unit, f"{beside}, over {over}")
    if accuracy["hardware"] is not None:
        without = accuracy["unfiltered"] if evidence.facts.filter is not None else None
        beside = "by the paper's measure" if without is None else f"by the paper's measure; {without:.2f} % unfiltered"
        yield Fact("Accuracy", accuracy["hardware"], "%", beside.replace(" -", " −"), _percent)
    deviation = run.summary["frequency_response"]["max_deviation_db_passband"]
    if deviation is not None and evidence.run.truth is None:
        yield Fact("Change of the gain in the passband", deviation, "dB", "by rounding the coefficients", _level)
    if (worth := evidence.uncertainty) is not None:
        low, high = (plain_number(worth["expanded"][key]) for key in ("smallest", "largest"))
        share = f"with a probability of {100 * worth['probability']:g} %"
        yield Fact("Uncertainty of a reading", f"±{low} to ±{high} {worth['unit']}", sentence=share)
    if run.measured.delay is not None and run.measured.delay_hz is not None:
        yield _delay(evidence, run.measured.delay, run.measured.delay_hz)
    if run.measured.settling is not None and run.measured.settling_to_lsb is not None and run.measured.step is not None:
        yield _settling(run.measured.settling, run.measured.settling_to_lsb, run.measured)


def _sound(sound: Mapping[str, Any]) -> Iterator[Fact]:
    tone = sound["tone"]
    if tone is not None:
        exact = tone["exact_thd_n_db"]
        beside = "" if exact is None else f"; the exact calculation on the same input has {decibels(exact)}"
        at = f"{quantity(tone['frequency'], 'Hz')} at {full_scale_level(tone['level_dbfs'])}{beside}"
        measured = "none at all" if tone["thd_n_db"] is None else tone["thd_n_db"]
        yield Fact("Distortion and noise (THD+N)", measured, "dB", at, _level)
    if sound["rms_dbfs"] is None:
        yield Fact("Level of the output", "silence", sentence="every code is 0")
    else:
        peak = f"RMS; the largest value is at {full_scale_level(sound['peak_dbfs'])}"
        yield Fact("Level of the output", sound["rms_dbfs"], "dBFS", peak, _full_scale_level)


def _delay(evidence: Evidence, delay: float, at: float) -> Fact:
    facts = evidence.facts
    assert facts.filter is not None  # that has the delay
    rate = facts.filter.sample_rate * (1 if facts.decimation is None else facts.decimation.factor)
    where = "of slow changes" if at == 0 else f"at {quantity(at, 'Hz')}"
    return Fact("Delay of the filter", delay, "s", f"{where}: {plain_number(delay * rate)} samples", quantity)


def _settling(time: float, to_lsb: float, measured: Behaviour) -> Fact:
    assert measured.step is not None
    parts = [
        "after a step, to within 1 %" if measured.step.passes_constants else "after a step, to 1 % of its peak",
        f"to half an LSB, over the whole range, {quantity(to_lsb, 's')}",
    ]
    if measured.step.overshoot is not None:
        parts.append(f"overshoot {plain_number(100 * measured.step.overshoot)} %")
    return Fact("Settling time", time, "s", "; ".join(parts), quantity)


def _arithmetic(run: _Run) -> Iterator[Fact]:
    facts, error, shown = run.evidence.facts, run.summary["error"], ErrorUnit.of(run.evidence.facts)
    bound = facts.error_bound
    share = error["max_abs"] / bound if bound else None
    limit = f"{'' if share is None else f'{100 * share:.0f} % of '}the proven limit {shown.amount(bound)}"
    sound = run.summary["sound"]
    peak, rms = ("", "") if sound is None else (_also(sound["error_peak_dbfs"]), _also(sound["error_rms_dbfs"]))
    yield Fact(
        "Largest error of the arithmetic",
        error["max_abs"],
        facts.unit,
        f"{lsb(error['max_lsb'])}{peak}, {limit}",
        lambda value, unit: shown.amount(value),
        share,
    )
    yield Fact(
        "Typical error (RMS)",
        error["rms"],
        facts.unit,
        f"{lsb(error['rms'] / facts.lsb)}{rms}, mean {shown.amount(error['mean'])}",
        lambda value, unit: shown.amount(value),
    )
    taken = run.evidence.run
    first = "" if taken.first_mismatch is None else f", the first at {taken.first_mismatch:,}"
    compared = "bit for bit" if run.summary["bit_exact"] else f"of {count(taken.samples, 'sample')}{first}"
    if taken.channels > 1:
        compared += f", {count(taken.channels, 'channel')}"
    equal = f"all {taken.samples:,}" if run.summary["bit_exact"] else f"all but {taken.mismatches:,}"
    yield Fact("Samples equal to the integer model", equal, sentence=compared)
    level = run.summary["sqnr_db"] if error["rms"] else "no error at all"
    step = f"one LSB is {shown.amount(facts.lsb)}"
    yield Fact("Signal to error", "—" if level is None else level, "dB", step, _level)


def _also(level: float | None) -> str:
    return "" if level is None else f", {full_scale_level(level)}"


def _hardware(evidence: Evidence) -> Iterator[Fact]:
    """Say what the hardware takes, of the FPGA and of time."""
    facts, known = evidence.facts, evidence.provenance
    if known is not None:
        yield _cost(known.cost)
    cycles = facts.interface.latency_cycles
    clock = f"{count(cycles, 'clock cycle')} at {quantity(facts.clock, 'Hz')}, from an input sample to its result"
    yield Fact("Latency of the hardware", cycles / facts.clock, "s", clock, quantity)


def _cost(cost: Mapping[str, Any]) -> Fact:
    blocks = count(cost["multiplier_blocks"] or 0, "multiplier block")
    if cost["source"] == "synthesis":
        return Fact("Cost", count(cost["luts"], "LUT"), sentence=f"{blocks}; synthesized for {cost['board']}")
    memory = f"{count(cost['memory_bits'], 'bit')} of memory"
    within = f"the LUT4 to within {100 * cost['within']:.0f} % for 9 of 10 designs tested"
    rest = f"{blocks}, {count(cost['register_bits'], 'flip-flop')}, {memory}, estimated for {cost['device']}; {within}"
    return Fact("Cost", f"about {count(cost['luts'], 'LUT')}", sentence=rest)


def _speed(evidence: Evidence) -> Fact:
    """Say how fast the simulation was by itself, and how long the run took with all that was made for it."""
    gate_by_gate = "" if evidence.gates is None else f", gate by gate as the netlist for {evidence.gates.board.name}"
    clocks = f"{count(evidence.run.cycles, 'clock cycle')} with {evidence.simulator}{gate_by_gate}"
    whole = f"the whole run, with generating, compiling and comparing, took {duration(evidence.wall_seconds)}"
    if not 0 < evidence.cycles_per_second < float("inf"):
        return Fact("Speed", "not measured", sentence=f"{clocks}; {whole}")
    simulated = duration(evidence.run.cycles / evidence.cycles_per_second)
    return Fact("Speed", evidence.cycles_per_second, "Hz", f"{clocks} in {simulated}; {whole}", _clock)


def _clock(value: float, unit: str) -> str:
    return f"{quantity(value, unit)} clock"


def _level(value: float, unit: str) -> str:
    return decibels(value)


def _full_scale_level(value: float, unit: str) -> str:
    return full_scale_level(value)


def _percent(value: float, unit: str) -> str:
    return f"{value:.2f} {unit}".replace("-", "−")
