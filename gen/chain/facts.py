"""Tables of a chain: its stages, its error budget and what folds."""

from __future__ import annotations

import math

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.facts.design_tables import ErrorUnit
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.filter.largest_gain import Peak
from sosmith.gen.quantity import count, frequency, plain_number, scale


def chain_tables(design: ChainDesign) -> list[Table]:
    """Say what the stages are, what the bound is made of, and what folds."""
    tables = [_stages(design), _budget(design)]
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
                f"{stage.spec.kind} at {frequency(float(stage.spec.rate))}"
                + (f", one of {factor}" if factor > 1 else ""),
                f"{hardware}, {count(architecture.multiplier_blocks, 'multiplier block')}",
                plain_number(float(architecture.clocks_per_sample)),
                str(stage.output.bits),
            )
        )
    head = ("stage", "what it is", "hardware", "clocks a sample", "bits out")
    return Table(f"{design.name}: chain", rows, head, numbers=(3, 4))


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
    head = ("stage", shown.titled("error at most"), "gain to the end", shown.titled("adds"), "in LSB")
    title = "Error budget from end to end, proven for all inputs in range"
    return Table(title, rows, head, {"sum": "bold"}, numbers=(1, 2, 3, 4))


def _folding(design: ChainDesign, folding: Peak) -> Table:
    rate = design.spec.base.sample_rate
    rows = [
        Fact(
            "Samples for each result",
            str(design.factor),
            sentence=f"results at {frequency(float(rate / design.factor))}",
        ),
        Fact(
            f"Anything above {frequency(float(rate / (2 * design.factor)))}",
            _decibels(folding),
            sentence=f"reached at {frequency(float(folding.at * rate))}",
        ),
    ]
    if design.passing is not None and design.spec.edge is not None:
        rows.append(
            Fact(
                f"Into the pass band, up to {frequency(float(design.spec.edge))}",
                _decibels(design.passing),
                sentence=f"reached at {frequency(float(design.passing.at * rate))}",
            )
        )
    return Table("What folds, proven: the largest gain from end to end", rows)


def _decibels(peak: Peak) -> str:
    return f"{20 * math.log10(peak.gain):.2f} dB"
