"""Facts about a decimator before a filter, for manifest, report and tables, and about the filter without one."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from typing import Any

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.decimation import group_delay, nearest_db, own_delay
from sosmith.gen.filter.design import design
from sosmith.gen.filter.largest_gain import LargestGain
from sosmith.gen.fpga.boards import find_board
from sosmith.model.dataflow.decimator import Decimator

_HALF = Fraction(1, 2)


@dataclass(frozen=True, kw_only=True)
class AliasingFacts:
    """What folds from around one multiple of the lower rate, both sides of it.

    Attributes
    ----------
    low, high : float
        Ends of the band that folds into the pass band, in Hz.
    gain_db : float
        Bound on the gain of the decimator in it, proven.
    passing_db : float
        Bound on the gain of decimator and filter in it, proven.
    whole_low, whole_high : float
        Ends of the whole band, half the lower rate to both sides of the multiple, in Hz.
    largest_db : float
        Bound on the gain of decimator and filter in the whole band, proven.
    largest_at : float
        Where at the output that gain is reached but for a thousandth, in Hz.
    """

    low: float
    high: float
    gain_db: float
    passing_db: float
    whole_low: float
    whole_high: float
    largest_db: float
    largest_at: float


@dataclass(frozen=True, kw_only=True)
class CalibrationFacts:
    """The calibration before a decimator.

    Attributes
    ----------
    architecture : str
        Name of its architecture.
    cycles_per_sample, latency_cycles : int
        Its own clocks between samples at the highest rate, and from a sample to its result.
    instructions : int or None
        Of its program; None in the parallel architecture.
    bits : int
        Width of its result.
    lsb, low, high : float
        Step of its result, and its smallest and largest value, in the output's unit.
    error : float
        Proven bound on the error of its result, in the output's unit.
    """

    architecture: str
    cycles_per_sample: int
    latency_cycles: int
    instructions: int | None
    bits: int
    lsb: float
    low: float
    high: float
    error: float


@dataclass(frozen=True, kw_only=True)
class DecimationFacts:
    """A decimator before a filter.

    Attributes
    ----------
    factor, stages : int
        Samples for each result, and pairs of integrator and comb.
    width, dropped : int
        Bits of each integrator and comb, and of these, how many the rounding behind them drops.
    sample_rate : float
        Rate of the results, in Hz.
    correction : float
        Weight g of ``1 + g - g / z``, which corrects the droop in the pass band.
    held : bool
        Whether each result is handed out once for each of its samples.
    cycles_per_result : int
        Clocks between results at the highest rate.
    deviation_db : float
        Largest deviation of the gain from that of the filter without a decimator, at `SAMPLED` frequencies of the pass
        band; no bound on what is between them.
    delay : float
        Group delay of decimator and filter at zero frequency, in s.
    aliasing : tuple of AliasingFacts
        Bands that fold into the pass band, the lowest first.
    worst_aliasing : float
        Largest amplitude at the output of a sine in any of these bands that fills the range of the input, in the
        output's unit.
    largest_db, largest : float
        The same of a sine at any frequency from half the lower rate on, wherever it folds: the gain, and the amplitude
        in the output's unit, both proven.
    direct_largest_db : float
        Largest gain of the filter without a decimator at these frequencies.
    calibration : CalibrationFacts or None
        What stands before it; None if it takes the input itself.
    """

    factor: int
    stages: int
    width: int
    dropped: int
    sample_rate: float
    correction: float
    held: bool
    cycles_per_result: int
    deviation_db: float
    delay: float
    aliasing: tuple[AliasingFacts, ...]
    worst_aliasing: float
    largest_db: float
    largest: float
    direct_largest_db: float
    calibration: CalibrationFacts | None = None

    @property
    def own_delay(self) -> float:
        """Delay of the decimator alone, in s."""
        return float(own_delay(self.factor, self.stages)) / (self.sample_rate * self.factor)

    @property
    def entries(self) -> dict[str, Any]:
        """All of it as a tree; of a calibration nothing if there is none."""
        tree = asdict(self)
        if self.calibration is None:
            del tree["calibration"]
        return tree


@dataclass(frozen=True, kw_only=True)
class DownsamplingFacts:
    """An FIR filter that decimates by itself.

    Attributes
    ----------
    factor : int
        Samples for each result.
    filled : int
        Times that the first sample goes in before it counts; 0 from zero.
    sample_rate : float
        Rate of the results, in Hz.
    held : bool
        Whether each result is handed out once for each of its samples.
    cycles_per_result : int
        Clocks between results at the highest rate.
    delay : float
        Group delay of the filter at zero frequency, in s.
    """

    factor: int
    filled: int
    sample_rate: float
    held: bool
    cycles_per_result: int
    delay: float

    @property
    def entries(self) -> dict[str, Any]:
        """All of it as a tree."""
        return asdict(self)


def downsampling_facts(core: CoreDesign) -> DownsamplingFacts | None:
    """Collect the facts about a filter that decimates by itself; None for any other core."""
    down, filter_ = core.datapath.downsampler, core.quantized.filter
    if down is None or down.factor == 1 or filter_ is None:
        return None
    ((taps, _),) = filter_.exact
    symmetric = taps in {taps[::-1], tuple(-tap for tap in taps[::-1])}
    delay = Fraction(len(taps) - 1, 2) if symmetric or not sum(taps) else group_delay(filter_.exact)
    return DownsamplingFacts(
        factor=down.factor,
        filled=down.filled,
        sample_rate=float(core.spec.sample_rate / down.factor),
        held=core.architecture.hold,
        cycles_per_result=core.architecture.cycles_per_result,
        delay=float(delay / core.spec.sample_rate),
    )


def decimation_facts(core: CoreDesign) -> DecimationFacts | None:
    """Collect the facts about the decimator of a core; None for a core without one."""
    decimation, decimator, filter_ = core.quantized.decimation, core.datapath.decimator, core.quantized.filter
    if decimation is None or decimator is None or filter_ is None:
        return None
    direct = design(core.spec.filter, core.spec.sample_rate)
    gains, peaks, rate = decimation.aliasing, decimation.bands(filter_), decimation.rate
    passing = decimation.passing(filter_)
    largest = max(peak.gain for peak in peaks)
    low, high = core.datapath.decimated_range
    amplitude = decimator.input.lsb * (high - low) / 2
    return DecimationFacts(
        factor=decimator.factor,
        stages=decimator.stages,
        width=decimator.width,
        dropped=decimator.dropped,
        sample_rate=float(decimation.rate),
        correction=float(decimation.correction),
        held=core.architecture.hold,
        cycles_per_result=core.architecture.cycles_per_result,
        deviation_db=decimation.deviation(filter_, direct),
        delay=float(decimation.delay(filter_)),
        aliasing=tuple(
            AliasingFacts(
                low=float(band * rate - decimation.edge),
                high=float(min(band * rate + decimation.edge, decimation.sample_rate / 2)),
                gain_db=nearest_db(gain),
                passing_db=nearest_db(into.gain),
                whole_low=float((band - _HALF) * rate),
                whole_high=float(min((band + _HALF) * rate, decimation.sample_rate / 2)),
                largest_db=nearest_db(peak.gain),
                largest_at=float(peak.at * rate),
            )
            for band, (gain, into, peak) in enumerate(zip(gains, passing, peaks, strict=True), start=1)
        ),
        worst_aliasing=float(max(into.gain for into in passing) * amplitude),
        largest_db=nearest_db(largest),
        largest=float(largest * amplitude),
        direct_largest_db=nearest_db(LargestGain(direct.exact).from_frequency(_HALF / decimation.factor).gain),
        calibration=_calibration_facts(core),
    )


def _calibration_facts(core: CoreDesign) -> CalibrationFacts | None:
    quantized, architecture = core.quantized.calibration, core.architecture.calibration
    if quantized is None or architecture is None:
        return None
    port, program = quantized.datapath.output, architecture.program
    low, high = (float(port.zero + code * port.lsb) for code in quantized.datapath.result_range)
    return CalibrationFacts(
        architecture=architecture.name,
        cycles_per_sample=architecture.cycles_per_sample,
        latency_cycles=architecture.latency_cycles,
        instructions=None if program is None else len(program.instructions),
        bits=port.bits,
        lsb=float(port.lsb),
        low=low,
        high=high,
        error=float(quantized.bound * port.lsb),
    )


@dataclass(frozen=True, kw_only=True)
class RateCosts:
    """What a core costs that filters at some rate.

    Attributes
    ----------
    clocks_per_sample : float
        Clocks that each sample of the input takes, on average, at the highest rate. A calibration before a decimator
        works while the filter does: the slower of them counts.
    memory_bits : int or None
        Bits of memory for a channel, with those of a calibration before a decimator; None in the parallel architecture.
    decimator_bits : int
        Bits of the decimator's registers, without its control; with several channels, of its memories for each of them.
    bound : float
        Proven bound on the error, in the output's unit.
    delay : float
        Group delay at zero frequency, in s.
    architecture : str
        Name of the architecture, that of a calibration before a decimator first if it is another one.
    """

    clocks_per_sample: float
    memory_bits: int | None
    decimator_bits: int
    bound: float
    delay: float
    architecture: str


def rate_costs(core: CoreDesign) -> RateCosts:
    """Return what a core with a filter costs."""
    quantized, architecture = core.quantized, core.architecture
    filter_, decimation, factor = quantized.filter, quantized.decimation, 1
    decimator = core.datapath.decimator
    assert filter_ is not None
    delay = group_delay(filter_.exact) / core.spec.sample_rate
    if decimation is not None:
        delay, factor = decimation.delay(filter_), decimation.factor
    return RateCosts(
        clocks_per_sample=architecture.cycles_per_result / factor,
        memory_bits=architecture.memory_bits,
        decimator_bits=0 if decimator is None else _kept_bits(decimator, core.spec.channels),
        bound=float(quantized.bound * core.datapath.output.lsb),
        delay=float(delay),
        architecture=_named(architecture),
    )


def _kept_bits(decimator: Decimator, channels: int) -> int:
    return decimator.register_bits if channels == 1 else decimator.bits_of_channel


def _named(architecture: Architecture) -> str:
    calibration = architecture.calibration
    return (
        architecture.name
        if calibration is None or calibration.name == architecture.name
        else f"{calibration.name}, {architecture.name}"
    )


def direct_design(core: CoreDesign) -> CoreDesign:
    """Design the same core without a decimator.

    Raises
    ------
    ShortfallError
        If no formats meet the specification.
    """
    spec, options = core.spec, core.options
    return design_core(
        replace(spec, filter=replace(spec.filter, decimate=None)),
        core=core.core,
        realization=options.get("realization"),
        board=find_board(options["board"]) if "board" in options else None,
    )
