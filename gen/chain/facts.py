"""Tables of a chain: its stages, its error budget and its aliasing."""

from __future__ import annotations

import math
from fractions import Fraction

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.facts.design_tables import ErrorUnit
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.filter.largest_gain import Peak
from sosmith.gen.quantity import count, decibels, frequency, plain_number, quantity, scale


def chain_tables(design: ChainDesign) -> list[Table]:
    """Say what the stages are, what the bound is made of, and how much aliases."""
    tables = [_stages(design), _budget(design)]
    if design.settling:
        tables.append(_start(design))
    if design.folding is not None:
        tables.append(_folding(design, design.folding))
    return tables


def _stages(design: ChainDesign) -> Table:
    rows = []
    for stage in design.stages:
        architecture, datapath = stage.design.architecture, stage.design.datapath
        factor, quantized = datapath.samples_per_result, stage.design.quantized
        hardware = f"{architecture.name} {quantized.realization if quantized.sections else ''}".rstrip()
        rows.append(
            (
                stage.spec.name,
                f"{stage.spec.kind} at {_frequency(stage.spec.rate)}"
                + (f", decimates by {factor}" if factor > 1 else ""),
                f"{hardware}, {count(architecture.multiplier_blocks, 'multiplier')}",
                plain_number(float(architecture.clocks_per_sample)),
                str(stage.output.bits),
            )
        )
    head = ("stage", "what it is", "hardware", "clocks a sample", "bits out")
    return Table(f"{design.name}: stages", rows, head, numbers=(3, 4))


def _budget(design: ChainDesign) -> Table:
    """Say what each stage adds to the bound: its own error, times how much of it reaches the end."""
    base = design.spec.base
    step, unit = float(base.output.lsb), base.output.unit
    shown = ErrorUnit(*scale(float(design.bound), unit))
    rows = [
        (
            stage.spec.name,
            shown.number(float(stage.bound)),
            plain_number(float(stage.gain)),
            shown.number(float(stage.share)),
            f"{float(stage.share) / step:.4f}",
        )
        for stage in design.stages
    ]
    rows += [
        (name, "", "", shown.number(float(value)), f"{float(value) / step:.4f}")
        for name, value in (("sum", design.bound), ("allowed", base.max_error))
    ]
    head = ("stage", shown.titled("error at most"), "gain to the end", shown.titled("adds"), "LSB")
    title = "End-to-end error budget, proven for all inputs in range"
    return Table(title, rows, head, {"sum": "bold"}, numbers=(1, 2, 3, 4))


def _start(design: ChainDesign) -> Table:
    seconds = quantity(float(design.settling * design.factor / design.spec.base.sample_rate), "s")
    return Table(
        "Start from zero",
        [
            Fact(
                "Flagged as settling",
                str(design.settling),
                sentence=f"results of a channel, {seconds}: until each stage has settled, one after the other",
            )
        ],
    )


def _folding(design: ChainDesign, folding: Peak) -> Table:
    rate = design.spec.base.sample_rate
    rows = [
        Fact(
            "Input samples for each result",
            str(design.factor),
            sentence=f"output rate {_frequency(rate / design.factor)}",
        ),
        Fact(
            f"From above {_frequency(rate / (2 * design.factor))}",
            _decibels(folding),
            sentence=f"reached at {_frequency(folding.at * rate)}",
        ),
    ]
    if design.passing is not None and design.spec.edge is not None:
        rows.append(
            Fact(
                f"Into the pass band, up to {_frequency(design.spec.edge)}",
                _decibels(design.passing),
                sentence=f"reached at {_frequency(design.passing.at * rate)}",
            )
        )
    return Table("Aliasing: largest end-to-end gain, proven", rows)


def _decibels(peak: Peak) -> str:
    return decibels(20 * math.log10(peak.gain))


def _frequency(value: Fraction) -> str:
    """Frequency with its unit: the rates of a chain lie far apart, and below 1 MHz kHz reads best."""
    if 1000 <= value < 1_000_000:
        return f"{float(value / 1000):.6g} kHz"
    return frequency(float(value))
