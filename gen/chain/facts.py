"""Tables of a chain: its stages, its error budget and what folds."""

from __future__ import annotations

import math

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.facts.design_tables import budget_table
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.filter.largest_gain import Peak
from sosmith.gen.quantity import frequency, plain_number, quantity


def chain_tables(design: ChainDesign) -> list[Table]:
    """Say what the stages are, what the bound is made of, and what folds."""
    base = design.spec.base
    parts = {stage.spec.name: float(stage.share) for stage in design.stages}
    tables = [_stages(design), budget_table(parts, float(base.max_error), float(base.output.lsb), base.output.unit)]
    if design.folding is not None:
        tables.append(_folding(design, design.folding))
    return tables


def _stages(design: ChainDesign) -> Table:
    rows = []
    for stage in design.stages:
        architecture, datapath = stage.design.architecture, stage.design.datapath
        rows.append(
            (
                stage.spec.name,
                stage.spec.kind,
                frequency(float(stage.spec.rate)),
                str(datapath.samples_per_result),
                f"{architecture.name}, {stage.design.quantized.realization or ''}".rstrip(", "),
                str(architecture.multiplier_blocks),
                plain_number(float(architecture.clocks_per_sample)),
                f"{stage.output.bits} bits",
                quantity(float(stage.bound), stage.output.unit),
                plain_number(float(stage.gain)),
            )
        )
    head = (
        "stage",
        "kind",
        "rate",
        "decimates by",
        "hardware",
        "multiplier blocks",
        "clocks a sample",
        "output",
        "error at most",
        "gain to the end",
    )
    return Table(f"Chain {design.name}", rows, head, numbers=(3, 5, 6))


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
