"""The headline figures of the report: the measurement first, then the arithmetic, the simulation's speed last."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sosmith.gen.quantity import count, decibels, duration, in_own_unit, plain_number, quantity, scale
from sosmith.gen.report.behaviour import Behaviour
from sosmith.gen.report.evidence import Evidence

Summary = Mapping[str, Any]


@dataclass(frozen=True)
class Tile:
    """A headline figure: its name, its value, lines below it, and the share of its limit if it has one."""

    name: str
    value: str
    asides: Sequence[str]
    share: float | None = None


@dataclass(frozen=True)
class Row:
    """Tiles that belong together, under one title."""

    title: str
    tiles: Sequence[Tile]


def amount(value: float | None, unit: str) -> str:
    """Return a quantity that is not broken across lines."""
    return quantity(value, unit).replace(" ", "\u00a0")


def lsb(steps: float) -> str:
    """Return a number of steps of the output code."""
    return f"{plain_number(steps)} LSB"


@dataclass(frozen=True)
class ErrorUnit:
    """The one unit of all errors of the arithmetic in a report, in which its limit, or else an LSB, reads well."""

    factor: float
    symbol: str

    @classmethod
    def of(cls, evidence: Evidence) -> ErrorUnit:
        """Choose it for a run."""
        return cls(*scale(evidence.facts.error_bound or evidence.facts.lsb, evidence.facts.unit))

    def number(self, value: float) -> str:
        """Return a value in this unit, without it."""
        return plain_number(value * self.factor)

    def amount(self, value: float) -> str:
        """Return a value with this unit, not broken across lines."""
        joint = " × " if self.symbol.startswith("10") else " "
        return f"{self.number(value)}{joint}{self.symbol}".rstrip().replace(" ", "\u00a0")

    def titled(self, words: str) -> str:
        """Return the title of a column in this unit."""
        return f"{words} in {self.symbol}" if self.symbol else words


def tile_rows(evidence: Evidence, summary: Summary, found: Behaviour) -> list[Row]:
    """Return the rows from the top of the page; rows without a tile are left out."""
    rows = [
        Row("The measurement", _measurement(evidence, summary, found)),
        Row("The arithmetic", _arithmetic(evidence, summary)),
        Row("The simulation", [_speed(evidence)]),
    ]
    return [row for row in rows if row.tiles]


def _measurement(evidence: Evidence, summary: Summary, found: Behaviour) -> list[Tile]:
    tiles = [_truth(evidence, summary, found), _passband(evidence, summary), _delay(evidence, found), _settling(found)]
    return [tile for tile in tiles if tile is not None]


def _truth(evidence: Evidence, summary: Summary, found: Behaviour) -> Tile | None:
    error = found.true_error
    if error is None:
        return None
    asides = [
        f"RMS {_in(error.rms, evidence.facts.unit)} · mean {_in(error.mean, evidence.facts.unit)}, "
        f"over {count(found.readings, 'reading')}"
    ]
    accuracy = summary["accuracy_percent"]
    if accuracy["hardware"] is not None:
        without = accuracy["unfiltered"] if evidence.facts.filter is not None else None
        beside = "" if without is None else f", without the filter {_percent(without)}"
        asides.append(f"accuracy by the paper's measure {_percent(accuracy['hardware'])}{beside}")
    return Tile("Largest error against the true value", _in(error.max_abs, evidence.facts.unit), asides)


def _passband(evidence: Evidence, summary: Summary) -> Tile | None:
    """Tile of the filter's accuracy, where no true value is known."""
    deviation = summary["frequency_response"]["max_deviation_db_passband"]
    if deviation is None or evidence.run.truth is not None:
        return None
    return Tile("Change of the gain in the passband", decibels(deviation), ["by rounding the coefficients"])


def _delay(evidence: Evidence, found: Behaviour) -> Tile | None:
    clocks = f"{count(evidence.facts.interface.latency_cycles, 'clock cycle')} from input to output"
    if found.delay is None or found.delay_hz is None or evidence.facts.filter is None:
        return Tile(
            "Delay", count(evidence.facts.interface.latency_cycles, "clock cycle"), ["from input to output; no filter"]
        )
    rate = evidence.facts.filter.sample_rate * (
        1 if evidence.facts.decimation is None else evidence.facts.decimation.factor
    )
    samples = f"{plain_number(found.delay * rate)} samples"
    where = "of slow changes" if found.delay_hz == 0 else f"at {amount(found.delay_hz, 'Hz')}"
    return Tile("Delay", amount(found.delay, "s"), [f"{where}: {samples}; the hardware takes {clocks}"])


def _settling(found: Behaviour) -> Tile | None:
    if found.settling is None or found.settling_to_lsb is None or found.step is None:
        return None
    asides = ["after a step, to within 1 %" if found.step.passes_constants else "after a step, to 1 % of its peak"]
    asides.append(f"to half an LSB, over the whole range, {amount(found.settling_to_lsb, 's')}")
    if found.step.overshoot is not None:
        asides.append(f"overshoot {plain_number(100 * found.step.overshoot)} %")
    return Tile("Settling time", amount(found.settling, "s"), [asides[0], "; ".join(asides[1:])])


def _arithmetic(evidence: Evidence, summary: Summary) -> list[Tile]:
    error, unit = summary["error"], ErrorUnit.of(evidence)
    share = error["max_abs"] / evidence.facts.error_bound if evidence.facts.error_bound else None
    limit = "proven limit" if share is None else f"{100 * share:.0f} % of the proven limit"
    compared = "bit for bit" if summary["bit_exact"] else f"of {count(evidence.run.samples, 'sample')}"
    if evidence.run.channels > 1:
        compared += f", {count(evidence.run.channels, 'channel')}"
    return [
        Tile(
            "Largest error of the arithmetic",
            unit.amount(error["max_abs"]),
            [f"{lsb(error['max_lsb'])} · {limit} {unit.amount(evidence.facts.error_bound)}"],
            share,
        ),
        Tile(
            "Typical error (RMS)",
            unit.amount(error["rms"]),
            [f"{lsb(error['rms'] / evidence.facts.lsb)} · mean {unit.amount(error['mean'])}"],
        ),
        Tile(
            "Samples equal to the integer model",
            f"all {evidence.run.samples:,}" if summary["bit_exact"] else f"all but {evidence.run.mismatches:,}",
            [compared],
        ),
        Tile(
            "Signal to error",
            decibels(summary["sqnr_db"]) if error["rms"] else "no error at all",
            [f"one LSB is {unit.amount(evidence.facts.lsb)}"],
        ),
    ]


def _speed(evidence: Evidence) -> Tile:
    """Tile of the simulation: its own time, and that of the run with all that was made before and after it."""
    gate_by_gate = "" if evidence.gates is None else ", gate by gate"
    clocks = f"{count(evidence.run.cycles, 'clock cycle')} with {evidence.simulator}{gate_by_gate}"
    whole = f"the whole run, with generating, compiling and comparing, took {duration(evidence.wall_seconds)}"
    if not 0 < evidence.cycles_per_second < float("inf"):
        return Tile("Speed", "not measured", [clocks, whole])
    simulated = duration(evidence.run.cycles / evidence.cycles_per_second)
    return Tile("Speed", f"{amount(evidence.cycles_per_second, 'Hz')} clock", [f"{clocks} in {simulated}", whole])


def _in(value: float, unit: str) -> str:
    return in_own_unit(value, unit).replace(" ", "\u00a0")


def _percent(value: float) -> str:
    return f"{value:.2f}\u00a0%".replace("-", "−")
