"""What the stages of a structure would be, and about what they cost: before any filter is designed.

Lengths are those of Kaiser's formula (1974), orders of CIC filters are the lowest that stop what aliases into the pass
band, and costs come from the model that estimates designs (`sosmith.gen.estimate`), with the word lengths and
coefficients that are usual. So all structures can be compared in a fraction of a second; the best ones are designed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from sosmith.gen.chain.automatic.limits import Limits
from sosmith.gen.chain.automatic.structures import Structure
from sosmith.gen.estimate.cic import Ladder, of_ladder
from sosmith.gen.estimate.estimate import luts_of
from sosmith.gen.estimate.rings import Rings, of_size
from sosmith.gen.fpga.boards import Device
from sosmith.gen.quantity import count, frequency
from sosmith.gen.specification.choices import MAX_GIVEN_TAPS, MAX_TAPS
from sosmith.gen.word_lengths.cost import MULTIPLIER_BITS, Multiplication, Operand

_SPENT = 0.97
"""Share of the pass-band loss that stages may take: proofs need a little of it."""

_EARLY = 0.15
"""Share of it that the ripple of each stage before the last takes, and the droop of CIC filters if it stays."""

_SPARE = 0.05
"""How much more than asked, in dB, stages stop; and a quarter of the pass-band loss, as losses are relative."""

_MOST_DROOP = 3.0
"""Largest droop of CIC filters, in dB, that the last stage makes up for."""

_FEW_TAPS = 9
"""How many taps a filter is expected to have that has no stop band."""

_MOST_ORDER = 12
_COEFFICIENT_BITS = 4
"""Bits of the largest coefficient beyond those of the output."""

_FLAGS = 3
_ELLIPTIC_LUTS, _CLOCKS_OF_ORDER, _OTHER_CLOCKS = 360.0, 8, 12
"""What an IIR filter in the folded architecture takes, roughly: LUT4, and clocks for each result."""

_SECTION_BITS, _OTHER_LUTS, _MORE_BITS = 12, 120.0, 6
"""What sections with hardware of their own take, roughly: LUT4 for each bit of a section's words, LUT4 beside them, and
bits that these words have beyond the data."""


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What a chain is chosen for.

    Attributes
    ----------
    limits : Limits
    rate : Fraction
        Of the samples, in Hz.
    factor : int
    clock : Fraction
        In Hz.
    channels, input_bits, output_bits : int
    exact_bits, between_bits : int
        Bits of the output with steps as large as the error that is allowed, and of a port between two stages.
    each_clock : bool
        Whether filters that decimate may take a sample at each clock: CIC filters of adders, others with multipliers
        that take turns. Otherwise each has a multiplier and a ring of samples.
    """

    limits: Limits
    rate: Fraction
    factor: int
    clock: Fraction
    channels: int
    input_bits: int
    output_bits: int
    exact_bits: int
    between_bits: int
    each_clock: bool = False

    @property
    def last_rate(self) -> Fraction:
        """Rate of the results, in Hz."""
        return self.rate / self.factor

    @property
    def stop(self) -> Fraction:
        """Where the stop band of the last stage begins, in Hz."""
        image = self.last_rate - self.limits.passband_edge
        return image if self.limits.stopband_edge is None else min(self.limits.stopband_edge, image)

    @property
    def kept(self) -> Fraction:
        """Up to where, in Hz, nothing may alias before the last stage."""
        return self.limits.passband_edge if self.limits.stopband_edge is None else self.stop

    @property
    def stopband_loss(self) -> float:
        """What each stage has to stop, in dB below 1."""
        return float(self.limits.stopband_loss) + _SPARE + float(self.limits.passband_loss) / 4


class Cost(NamedTuple):
    """What stages take: LUT4, multiplier blocks, bits of memory."""

    luts: float
    blocks: float
    memory_bits: float

    def weighed(self, device: Device) -> float:
        """Return it in LUT4: blocks and memory count as the share of the FPGA's that they are."""
        total = self.luts
        if device.multipliers:
            total += self.blocks * device.logic_cells / device.multipliers
        return total + self.memory_bits * device.logic_cells / (device.block_rams * BLOCK_RAM_BITS[device.block_ram])


BLOCK_RAM_BITS = {"SB_RAM40_4K": 4096, "DP16KD": 18432, "SDPB": 16384}
"""Bits of the block RAMs of the FPGAs that are estimated."""


class Problem(NamedTuple):
    """Why a structure is out of question: how many times more it needs than there is, and the same in words.

    `estimated` says that this is only expected.
    """

    times: float
    text: str
    estimated: bool = False


@dataclass(kw_only=True)
class Planned:
    """A stage of a structure.

    Attributes
    ----------
    kind : str
    factor : int
    rate : Fraction
        Of its samples, in Hz.
    order : int
        Of a CIC filter.
    edge, stop : Fraction
        Edges of its pass band and its stop band, in Hz.
    loss : float
        Of its pass band, in dB.
    taps : int
        How many it is expected to have; of an IIR filter, its order.
    each_clock : bool
        Whether it takes a sample at each clock; an IIR filter whose sections share hardware, as fast as it must.
    """

    kind: str
    factor: int
    rate: Fraction
    order: int = 0
    edge: Fraction = Fraction(0)
    stop: Fraction = Fraction(0)
    loss: float = 0.0
    taps: int = 1
    each_clock: bool = False

    @property
    def steps(self) -> int:
        """Products for each result: half as many as taps, as these are symmetric; half of them are 0 in a half-band."""
        return (self.taps + 1) // 4 + 1 if self.kind == "halfband" else (self.taps + 1) // 2

    def clocks(self, channels: int) -> int:
        """Clocks for each result of a channel, expected."""
        if self.each_clock:
            return self.factor
        if self.kind == "iir":
            return _CLOCKS_OF_ORDER * self.taps + _OTHER_CLOCKS
        return self.factor * (1 + (channels > 1)) + self.steps + 5

    def available(self, wanted: Wanted) -> int:
        """Clocks that there are for each result of a channel."""
        return int(wanted.clock * self.factor / (self.rate * wanted.channels))


@dataclass(kw_only=True)
class Plan:
    """A structure with its stages.

    Attributes
    ----------
    structure : Structure
    stages : list of Planned
    compensates : bool
        Whether the last stage makes up for the droop of CIC filters.
    problem : Problem or None
        Why it is out of question, the worst reason.
    cost : Cost
        Expected.
    """

    structure: Structure
    stages: list[Planned]
    compensates: bool = False
    problem: Problem | None = None
    cost: Cost = field(default=Cost(0.0, 0.0, 0.0))

    def against(self, problem: Problem) -> None:
        """Note a reason; the worst one stays."""
        if self.problem is None or problem.times > self.problem.times:
            self.problem = problem


def plan(structure: Structure, wanted: Wanted, device: Device) -> Plan:
    """Say what the stages of a structure would be, and what speaks against it."""
    made = Plan(structure=structure, stages=[])
    rate = wanted.rate
    for step in structure.steps:
        each_clock = wanted.each_clock and step.kind == "cic" and wanted.channels == 1
        made.stages.append(Planned(kind=step.kind, factor=step.factor, rate=rate, each_clock=each_clock))
        rate /= step.factor
    droop = _plan_cic(made, wanted)
    _plan_filters(made, wanted, droop)
    if made.problem is None:
        _check_clocks(made, wanted)
        made.cost = _cost(made, wanted, device)
    return made


def _plan_cic(made: Plan, wanted: Wanted) -> float:
    """Choose the orders of CIC filters; return how much they droop together at the edge of the pass band, in dB."""
    droop = 0.0
    for stage in made.stages:
        if stage.kind != "cic":
            continue
        own = moving_sum(stage.factor, float(wanted.limits.passband_edge / stage.rate))
        alias = moving_sum(stage.factor, float(1 / Fraction(stage.factor) - wanted.kept / stage.rate))
        needed = wanted.stopband_loss + _MOST_DROOP / 2
        stage.order = max(1, math.ceil(needed / -decibel(alias))) if alias < 1 else _MOST_ORDER + 1
        stage.taps = stage.order * (stage.factor - 1) + 1
        most = min(_MOST_ORDER, (MAX_GIVEN_TAPS - 1) // (stage.factor - 1))
        if stage.order > most:
            reached = -most * decibel(alias)
            made.against(
                Problem(
                    stage.order / most,
                    f"too little alias attenuation: {reached:.0f} dB by a CIC filter of order {most}",
                )
            )
        droop -= stage.order * decibel(own)
    if droop > _MOST_DROOP:
        made.against(Problem(droop / _MOST_DROOP, f"CIC filters droop by {droop:.1f} dB, at most {_MOST_DROOP:g} dB"))
    return droop


def _plan_filters(made: Plan, wanted: Wanted, droop: float) -> None:
    """Give the other stages their bands and losses, and the lengths that these take."""
    limits, stages = wanted.limits, made.stages
    whole = float(limits.passband_loss) * _SPENT
    filters = [stage for stage in stages if stage.kind not in {"cic", "every"}]
    *early, last = filters
    share = min(_EARLY, 0.5 / max(1, len(early)))
    left = whole * (1 - share * len(early))
    stays = _EARLY * whole if last.kind == "fir" else 0.6 * whole
    made.compensates = droop > stays
    if made.compensates and last.kind != "fir":
        made.against(Problem(droop / stays, f"CIC filters droop by {droop:.2g} dB, for which no filter makes up"))
    for stage in filters:
        is_last = stage is last
        stage.loss = left - (0 if made.compensates else droop) if is_last else whole * share
        stage.edge = limits.passband_edge
        stage.stop = wanted.stop if is_last else stage.rate / stage.factor - wanted.kept
        if stage.kind == "halfband":
            stage.edge = max(stage.rate / 2 - stage.stop, stage.edge)
            stage.stop = stage.rate / 2 - stage.edge
        if is_last and stage.factor == 1 and stage.kind == "fir":  # what is left to stop is above its rate
            stage.stop, stage.taps = stage.rate / 2, _FEW_TAPS
            if not made.compensates:
                made.against(Problem(math.inf, "nothing is left for the last filter to do"))
            continue
        if not stage.edge < stage.stop < stage.rate / 2 or stage.loss <= 0:
            made.against(Problem(math.inf, "bands of its filters overlap"))
            continue
        stage.taps = _length(stage, wanted)
        if stage.kind != "iir" and stage.taps > MAX_TAPS:
            made.against(
                Problem(
                    stage.taps / MAX_TAPS,
                    f"too long: {stage.taps} taps at {_hertz(stage.rate)}, of at most {MAX_TAPS}, which stop some "
                    f"{_reached(stage):.0f} dB",
                    estimated=True,
                )
            )


def _reached(stage: Planned) -> float:
    """Return the loss of the stop band that the most taps reach, by Kaiser's formula."""
    least = 10 ** (-stage.loss / 20)
    product = 14.6 * (MAX_TAPS - 1) * float((stage.stop - stage.edge) / stage.rate) + 13
    return max(0.0, 2 * product + decibel((1 - least) / (1 + least)))


def _length(stage: Planned, wanted: Wanted) -> int:
    """Return the number of taps by Kaiser's formula, or the order of an elliptic filter."""
    loss, stop = stage.loss, wanted.stopband_loss
    if stage.kind == "iir":
        from scipy.signal import ellipord  # noqa: PLC0415 - slow to load

        edges = (float(2 * edge / stage.rate) for edge in (stage.edge, stage.stop))
        return int(ellipord(*edges, loss, stop)[0])
    least = 10 ** (-loss / 20)
    ripple, rest = (1 - least) / (1 + least), 10 ** (-stop / 20)
    if stage.kind == "halfband":
        ripple = rest = min(ripple, rest)
    width = float((stage.stop - stage.edge) / stage.rate)
    length = math.ceil((-10 * math.log10(ripple * rest) - 13) / (14.6 * width)) + 1
    return max(3, length) if stage.kind == "fir" else max(3, length + (3 - length) % 4)


def _check_clocks(made: Plan, wanted: Wanted) -> None:
    """Let stages take a sample at each clock where one multiplier is too slow; say of what is too slow still."""
    for stage in made.stages:
        if stage.clocks(wanted.channels) > stage.available(wanted):
            stage.each_clock = wanted.each_clock
        needed, there = stage.clocks(wanted.channels), stage.available(wanted)
        if needed > there:
            clock = frequency(float(needed * stage.rate * wanted.channels / stage.factor))
            results = _hertz(stage.rate / stage.factor)
            made.against(
                Problem(
                    needed / max(there, 1),
                    f"too slow: {count(needed, 'clock')} for each result at {results}, of {there:,}; a clock of "
                    f"{clock} would do",
                    estimated=True,
                )
            )


def _cost(made: Plan, wanted: Wanted, device: Device) -> Cost:
    """Estimate what the stages take, by the model of designs."""
    total = Cost(0.0, 0.0, 0.0)
    between = wanted.between_bits + (len(made.stages) > 2)
    for k, stage in enumerate(made.stages):
        data = wanted.input_bits if k == 0 else between
        out = between if k < len(made.stages) - 1 else wanted.output_bits
        total = Cost(*(a + b for a, b in zip(total, _cost_of(stage, wanted, device, data, out), strict=True)))
    return total


def _cost_of(stage: Planned, wanted: Wanted, device: Device, data: int, out: int) -> Cost:
    if stage.kind == "iir":
        if stage.each_clock:
            return _cost_of_sections(stage, wanted, device, data)
        wide = max(1, math.ceil(data / max(device.factor_bits, 1)))
        return Cost(_ELLIPTIC_LUTS, wide**2 * (device.multipliers > 0), 60.0 * data)
    if stage.each_clock and stage.kind == "cic":
        width = data + math.ceil(stage.order * math.log2(stage.factor))
        found = of_ladder(Ladder(stage.order, width, stage.factor, out + 1, out, _FLAGS))
        return Cost(luts_of(found, "parallel", device.family), 0.0, 0.0)
    taps = usual_taps(stage)
    largest = max(abs(tap) for tap in taps)
    bits = wanted.exact_bits + _COEFFICIENT_BITS
    if stage.kind == "cic":  # its weights are whole numbers
        bits = 1 + math.ceil(math.log2(largest * stage.factor**stage.order + 1))
    steps = [round(tap / largest * ((1 << bits - 1) - 1)) for tap in taps if tap][: stage.steps]
    pair = data + 1
    if stage.each_clock:
        return _cost_in_turns(stage, device, (data, pair, bits, out))
    if digits := _digits(stage, wanted, device, pair, bits):
        steps, block = steps * digits, device.factor_bits or MULTIPLIER_BITS
        pair, bits = min(pair, block), min(bits, block)
    words = max(2, 1 << (stage.taps - 1).bit_length())
    place = (words - 1).bit_length()
    found = of_size(
        Rings(
            words=words,
            data_bits=data,
            pair_bits=pair,
            pairs=stage.taps > 1,
            factor_bits=bits,
            sum_bits=data + bits + 2,
            output_bits=out,
            flags=_FLAGS,
            channels=wanted.channels,
            last_step=stage.steps * max(digits, 1) + 4,
            codes=[(step & ((1 << bits) - 1)) << place | k for k, step in enumerate(steps)],
        ),
        device,
    )
    return Cost(luts_of(found, "folded", device.family), found["blocks"], found["memory_bits"])


def _cost_of_sections(stage: Planned, wanted: Wanted, device: Device, data: int) -> Cost:
    """Estimate sections with hardware of their own, or of one for all where there are clocks for their turns."""
    sections, word = math.ceil(stage.taps / 2), data + _MORE_BITS
    count = 1 if device.multipliers and sections <= stage.available(wanted) else sections
    blocks = 2 * max(1, math.ceil(word / max(device.factor_bits, 1)))
    return Cost(_OTHER_LUTS + count * _SECTION_BITS * word, count * blocks * (device.multipliers > 0), 0.0)


def _cost_in_turns(stage: Planned, device: Device, sizes: tuple[int, int, int, int]) -> Cost:
    """Estimate a filter whose multipliers take turns; `sizes` are bits of data, pairs, coefficients and results."""
    data, pair, bits, out = sizes
    count, total = math.ceil(stage.steps / stage.factor), data + bits + 2
    product = Multiplication(Operand(pair, signed=True), Operand(bits, signed=True))
    found = {
        "sums": count * (pair + total),
        "chosen": count * data + total,
        "registers": (stage.taps + 2 * count) * data + count * (pair + total) + 2 * out,
        "logic": 16,
    }
    blocks = count * product.blocks_of(device.factor_bits or MULTIPLIER_BITS)
    return Cost(luts_of(found, "parallel", device.family), blocks, 0.0)


def _digits(stage: Planned, wanted: Wanted, device: Device, pair: int, factor: int) -> int:
    """Return how many steps a tap takes whose product is too wide for a block; 0 if it is not, or there is no time."""
    block = device.factor_bits or MULTIPLIER_BITS
    if Multiplication(Operand(pair, signed=True), Operand(factor, signed=True)).blocks_of(block) == 1:
        return 0
    steps = math.ceil((pair - 1) / (block - 1)) * math.ceil((factor - 1) / (block - 1))
    needed = stage.clocks(wanted.channels) + (steps - 1) * stage.steps
    return steps if needed <= stage.available(wanted) else 0


def usual_taps(stage: Planned) -> list[float]:
    """Return taps like those that a stage will have: of a moving sum, or an ideal response cut by a window."""
    if stage.kind == "cic":
        taps = np.ones(1)
        for _ in range(stage.order):
            taps = np.convolve(taps, np.ones(stage.factor) / stage.factor)
        return [float(tap) for tap in taps]
    if stage.taps == 1:
        return [1.0]
    cut = float((stage.edge + stage.stop) / stage.rate)
    places = np.arange(stage.taps) - (stage.taps - 1) / 2
    taps = np.sinc(cut * places) * np.kaiser(stage.taps, 8.0)
    return [float(tap) if abs(tap) > 1e-9 else 0.0 for tap in taps]


def moving_sum(factor: int, frequency: float) -> float:
    """Magnitude of the mean of `factor` samples at a frequency in units of their rate."""
    angle = math.pi * frequency
    return abs(math.sin(factor * angle) / (factor * math.sin(angle))) if math.sin(angle) else 1.0


def decibel(gain: float) -> float:
    """Return a gain in dB; one of nothing is -400 dB."""
    return 20 * math.log10(max(gain, 1e-20))


def _hertz(rate: Fraction) -> str:
    return frequency(float(rate))
