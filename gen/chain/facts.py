"""Tables of a chain: its stages, its error budget and its aliasing."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from sosmith.gen.chain.automatic.losses import loss_of
from sosmith.gen.chain.design import ChainDesign, Folding, Kept
from sosmith.gen.chain.ideal import bands, level
from sosmith.gen.chain.response import Segment
from sosmith.gen.core import CoreDesign
from sosmith.gen.facts.design_tables import ErrorUnit
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.filter.largest_gain import Peak
from sosmith.gen.quantity import count, decibels, frequency, plain_number, quantity, scale


def chain_tables(design: ChainDesign) -> list[Table]:
    """Say what the stages are, what the bound is made of, and how much aliases."""
    tables = [_stages(design), _budget(design)]
    if design.settling:
        tables.append(_start(design))
    tables += [_folding(design, each) for each in design.foldings]
    if design.limited is not None and design.limited.kept is not None:
        tables.append(_kept(design, design.limited, design.limited.kept))
    return tables


def limits(design: ChainDesign) -> list[tuple[float, float, float, str]]:
    """Return the bands in which aliases and images lie, in Hz, what none of them exceeds, in dB, and its name."""
    most = [float(level(np.array([float(each.anywhere.gain)]))[0]) for each in design.foldings]
    return [(edge, end, top, name) for (edge, end, name), top in zip(bands(design), most, strict=True)]


def _kept(design: ChainDesign, folding: Folding, kept: Kept) -> Table:
    """Say how the gain of the whole, or of some stages from end to end, keeps to its limits."""
    first, end = design.spec.span or (0, len(design.stages))
    rate, limits = design.stages[first].spec.rate, design.spec.limits
    assert limits is not None
    whose = "the whole" if design.spec.span is None else _from_to(design, first, end - 1)
    most = kept.most.gain
    droop = loss_of(kept.least.gain, most)
    rows = [
        Fact("Largest gain", _decibels(kept.most), sentence=f"reached at {_frequency(kept.most.at * rate)}"),
        Fact("Smallest gain", _decibels(kept.least), sentence=f"reached at {_frequency(kept.least.at * rate)}"),
        Fact("Droop and ripple", decibels(droop), sentence=f"at most {float(limits.passband_loss):g} dB asked"),
    ]
    for what, peak in (("Aliases into the pass band", folding.passing), ("In the stop band", kept.stopped)):
        if peak is not None:
            asked = f"at least {float(limits.stopband_loss):g} dB below the largest gain asked"
            rows.append(Fact(what, decibels(-loss_of(peak.gain, most)), sentence=asked))
    return Table(f"Pass band of {whose}, up to {_frequency(limits.passband_edge)}, proven", rows)


def _from_to(design: ChainDesign, first: int, last: int) -> str:
    names = [design.stages[k].spec.name for k in dict.fromkeys((first, last))]
    return " to ".join(names)


def _stages(design: ChainDesign) -> Table:
    rows = []
    for stage in design.stages:
        rise, factor = stage.rate
        multipliers = sum(core.architecture.multiplier_blocks for core in stage.cores)
        rows.append(
            (
                stage.spec.name,
                f"{stage.spec.kind} at {_frequency(stage.spec.rate)}"
                + (f", decimates by {factor}" if factor > 1 else "")
                + (f", interpolates by {rise}" if rise > 1 else ""),
                f"{', '.join(dict.fromkeys(map(_hardware, stage.cores)))}, {count(multipliers, 'multiplier')}",
                plain_number(stage.clocks_per_sample),
                str(stage.output.bits),
            )
        )
    head = ("stage", "what it is", "hardware", "clocks a sample", "bits out")
    return Table(f"{design.name}: stages", rows, head, numbers=(3, 4))


def _hardware(core: CoreDesign) -> str:
    return core.architecture.title(core.quantized.realization if core.quantized.sections else None)


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
    seconds = quantity(float(design.settling / design.spec.last_rate), "s")
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


def _folding(design: ChainDesign, folding: Folding) -> Table:
    segment, rate = folding.segment, design.spec.base.sample_rate
    highest = rate * segment.highest
    ends = rate * segment.rate, highest / segment.factor
    from_to = f"gain from {_frequency(ends[0])} to {_frequency(ends[1])}"
    way = "end-to-end gain" if len(design.foldings) == 1 else from_to
    reached = f"reached at {_frequency(folding.anywhere.at * highest)}"
    rows = []
    if segment.rise > 1:
        what = "Images" if segment.factor == 1 else "Images and aliases"
        text = f"to {_frequency(highest)}; output rate {_frequency(ends[1])}" if segment.factor > 1 else ""
        text = text or f"output rate {_frequency(ends[1])}"
        rows.append(Fact("Results for each input sample", _ratio(segment), sentence=text))
    else:
        what = "Aliasing"
        text = f"output rate {_frequency(ends[1])}"
        rows.append(Fact("Input samples for each result", str(segment.factor), sentence=text))
    edge = _frequency(min(ends) / 2)
    above = f"From above {edge}" if segment.rise == 1 else f"Above {edge}"
    rows.append(Fact(above, _decibels(folding.anywhere), sentence=reached))
    if folding.passing is not None and design.spec.edge is not None:
        at = f"reached at {_frequency(folding.passing.at * highest)}"
        into = "Into" if segment.rise == 1 else "Of" if segment.factor == 1 else "Of or into"
        rows.append(
            Fact(f"{into} the pass band, up to {_frequency(design.spec.edge)}", _decibels(folding.passing), sentence=at)
        )
    return Table(f"{what}: largest {way}, proven", rows)


def _ratio(segment: Segment) -> str:
    return str(segment.rise) if segment.factor == 1 else f"{segment.rise} / {segment.factor}"


def _decibels(peak: Peak) -> str:
    return decibels(20 * math.log10(peak.gain))


def _frequency(value: Fraction) -> str:
    """Frequency with its unit: the rates of a chain lie far apart, and below 1 MHz kHz reads best."""
    if 1000 <= value < 1_000_000:
        return f"{float(value / 1000):.6g} kHz"
    return frequency(float(value))
