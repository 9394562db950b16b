"""The headline figures of a run, for page, terminal and `report.json`: the measurement first, the speed last."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from sosmith.gen.facts.design_tables import ErrorUnit, lsb
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.quantity import count, decibels, duration, in_own_unit, plain_number, quantity
from sosmith.gen.report.behaviour import Behaviour
from sosmith.gen.report.evidence import Evidence

Summary = Mapping[str, Any]


def unbroken(text: str) -> str:
    """Return a text in which no number is parted from what it counts at the end of a line."""
    return re.sub(r"(?<=\d) ", "\u00a0", text)


@dataclass(frozen=True)
class _Run:
    """A run with what is measured of it."""

    evidence: Evidence
    summary: Summary
    found: Behaviour


def headlines(evidence: Evidence, summary: Summary, found: Behaviour) -> list[dict[str, Any]]:
    """Return groups with `title` and `facts` in JSON types, from the top of the page, none without a fact."""
    run = _Run(evidence, summary, found)
    groups = {
        "The measurement": list(_measurement(run)),
        "The arithmetic": list(_arithmetic(run)),
        "The simulation": [_speed(evidence)],
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
    evidence, unit = run.evidence, run.evidence.facts.unit
    error, accuracy = run.found.true_error, run.summary["accuracy_percent"]
    if error is not None:
        beside = f"RMS {in_own_unit(error.rms, unit)}, mean {in_own_unit(error.mean, unit)}"
        over = count(run.found.readings, "reading")
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
    yield _delay(evidence, run.found)
    if run.found.settling is not None and run.found.settling_to_lsb is not None and run.found.step is not None:
        yield _settling(run.found.settling, run.found.settling_to_lsb, run.found)


def _delay(evidence: Evidence, found: Behaviour) -> Fact:
    cycles, facts = evidence.facts.interface.latency_cycles, evidence.facts
    if found.delay is None or found.delay_hz is None or facts.filter is None:
        return Fact("Delay", count(cycles, "clock cycle"), sentence="from input to output; no filter")
    rate = facts.filter.sample_rate * (1 if facts.decimation is None else facts.decimation.factor)
    where = "of slow changes" if found.delay_hz == 0 else f"at {quantity(found.delay_hz, 'Hz')}"
    hardware = f"the hardware takes {count(cycles, 'clock cycle')} from input to output"
    sentence = f"{where}: {plain_number(found.delay * rate)} samples; {hardware}"
    return Fact("Delay", found.delay, "s", sentence, quantity)


def _settling(time: float, to_lsb: float, found: Behaviour) -> Fact:
    assert found.step is not None
    parts = [
        "after a step, to within 1 %" if found.step.passes_constants else "after a step, to 1 % of its peak",
        f"to half an LSB, over the whole range, {quantity(to_lsb, 's')}",
    ]
    if found.step.overshoot is not None:
        parts.append(f"overshoot {plain_number(100 * found.step.overshoot)} %")
    return Fact("Settling time", time, "s", "; ".join(parts), quantity)


def _arithmetic(run: _Run) -> Iterator[Fact]:
    facts, error, shown = run.evidence.facts, run.summary["error"], ErrorUnit.of(run.evidence.facts)
    bound = facts.error_bound
    share = error["max_abs"] / bound if bound else None
    limit = f"{'' if share is None else f'{100 * share:.0f} % of '}the proven limit {shown.amount(bound)}"
    yield Fact(
        "Largest error of the arithmetic",
        error["max_abs"],
        facts.unit,
        f"{lsb(error['max_lsb'])}, {limit}",
        lambda value, unit: shown.amount(value),
        share,
    )
    yield Fact(
        "Typical error (RMS)",
        error["rms"],
        facts.unit,
        f"{lsb(error['rms'] / facts.lsb)}, mean {shown.amount(error['mean'])}",
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


def _percent(value: float, unit: str) -> str:
    return f"{value:.2f} {unit}".replace("-", "−")
