"""The proof of a cascade: ranges of all its nodes, and the error of its roundings and its coefficients.

The impulse responses of all sources (the input, and the error of every quantizer) are carried from stage to stage
through exact linear models. At each node with a stated range, and at the output, they bound the value. If no node has
overflowed at an earlier sample, none overflows at this one; by induction, the linear model always holds.

Behind a stage that takes the first sample x0 off every sample (`sosmith.model.sections.start`), the input is ``x - x0``
with x and x0 in the same range, of the width R: for each x0 it stays in a window of this width that contains 0. Limits
are linear in the place of the window, so those of the windows [0, R] and [-R, 0] hold for all of them.

Stages may have several inputs and outputs. Where the paths of one source meet, their responses are added, and the
source counts once.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from sosmith.gen.proof.linear_model import LinearModel, Polynomial
from sosmith.gen.proof.peak_gain import Drive, Extent, difference, extent
from sosmith.gen.proof.response import IMPULSE, Response

StageModel = Sequence[LinearModel]
"""Models of all outputs of a stage, in their order."""

TransferFunction = tuple[tuple[Fraction, ...], tuple[Fraction, ...]]
"""Numerator and denominator in ``w = z**-1``."""


@dataclass(frozen=True)
class CascadeProof:
    """What is proven about a cascade of linear stages, in the units of its input and output.

    Attributes
    ----------
    nodes : tuple of dict of int to Extent
        For each stage, the values that its BOUND nodes (by index) can take.
    output : Extent
        The values that the output can take.
    rounding : Extent
        Output minus the output of the same coefficients without quantizers.
    coefficients : Extent
        Output of the stages' transfer functions minus that of the ideal sections.
    gain : Fraction
        Worst-case peak gain of the ideal sections.
    """

    nodes: tuple[dict[int, Extent], ...]
    output: Extent
    rounding: Extent
    coefficients: Extent
    gain: Fraction


def prove_cascade(
    stages: Sequence[StageModel],
    ideal: Sequence[TransferFunction],
    low: Fraction,
    high: Fraction,
    *,
    steady: bool = False,
) -> CascadeProof:
    """Prove a cascade of at least one stage, with one input and one output, for inputs in [low, high] from reset on.

    If `steady`, these are the ends of ``x - x0``, and low is -high.

    Raises
    ------
    ShortfallError
        If a stage is unstable or its response does not decay in time.
    """
    wires: list[Drives] = [{INPUT: Drive(IMPULSE, low, high)}]
    nodes = []
    for number, stage in enumerate(stages):
        lanes = [Lane(number, model, wires) for model in stage]
        nodes.append({node: _limits(lane.at(node), steady=steady) for lane in lanes for node in lane.model.bounds})
        wires = [lane.at(lane.model.output) for lane in lanes]
    (drives,) = wires
    exact = through(ideal)
    return CascadeProof(
        nodes=tuple(nodes),
        output=_limits(drives, steady=steady),
        rounding=extent([drive for key, drive in drives.items() if key != INPUT]),
        coefficients=_deviation(drives[INPUT].response, exact, low, high, steady=steady),
        gain=ideal_gain(ideal),
    )


def _limits(drives: Drives, *, steady: bool) -> Extent:
    """Limits of the sum of drives; if `steady`, for the input in each of its windows."""
    if not steady or INPUT not in drives:
        return extent(list(drives.values()))
    zero, through = Fraction(0), drives[INPUT]
    windows = [Drive(through.response, zero, through.high), Drive(through.response, through.low, zero)]
    extents = [extent(list({**drives, INPUT: window}.values())) for window in windows]
    return Extent(min(one.low for one in extents), max(one.high for one in extents))


def coefficient_extent(
    stages: Sequence[StageModel],
    ideal: Sequence[TransferFunction],
    low: Fraction,
    high: Fraction,
    *,
    steady: bool = False,
) -> Extent:
    """Limits of the output of the stages' transfer functions minus that of the ideal sections."""
    return _deviation(quantized_response(stages), through(ideal), low, high, steady=steady)


def _deviation(quantized: Response, exact: Response, low: Fraction, high: Fraction, *, steady: bool) -> Extent:
    """Limits of a response minus the exact one; if `steady`, for the input in each of its windows."""
    if not steady:
        return difference(quantized, exact, low, high)
    limits = difference(quantized, exact, Fraction(0), high)  # of the opposite window, they are the opposite ones
    return Extent(-limits.magnitude, limits.magnitude)


def quantized_response(stages: Sequence[StageModel]) -> Response:
    """Impulse response of the stages without their quantizers."""
    wires = [IMPULSE]
    for stage in stages:
        wires = [_joined([(wires[k], t) for k, t in zip(m.entries, m.transfers, strict=True)], m) for m in stage]
    (response,) = wires
    return response


def error_drives(stages: Sequence[StageModel]) -> list[Drive]:
    """Drives at the output by everything except the input: errors of the quantizers, and constants."""
    wires: list[Drives] = [{}]
    for number, stage in enumerate(stages):
        lanes = [Lane(number, model, wires) for model in stage]
        wires = [lane.at(lane.model.output) for lane in lanes]
    (drives,) = wires
    return list(drives.values())


def rounding_gains(stages: Sequence[StageModel]) -> list[dict[str, Fraction]]:
    """Error that each stage's quantizers cause at the output, by name: half the width of its range."""
    wires = [IMPULSE]  # from each output of a stage to the end
    gains = []
    for stage in reversed(stages):
        after = [wire.all_pole(model.denominator) for wire, model in zip(wires, stage, strict=True)]
        extents = {
            source.name: extent([Drive(response.taps(source.numerators[model.output]), source.low, source.high)])
            for response, model in zip(after, stage, strict=True)
            for source in model.quantizers
        }
        gains.append({name: (e.high - e.low) / 2 for name, e in extents.items()})
        wires = [
            _sum(
                response.taps(model.transfers[model.entries.index(k)])
                for response, model in zip(after, stage, strict=True)
                if k in model.entries
            )
            for k in range(_input_count(stage))
        ]
    return gains[::-1]


def ideal_gain(ideal: Sequence[TransferFunction]) -> Fraction:
    """Worst-case peak gain of the ideal sections."""
    return _gain(tuple((tuple(b), tuple(a)) for b, a in ideal))


@lru_cache(maxsize=32)  # the plan of every realization asks for it, and its proof
def _gain(ideal: tuple[TransferFunction, ...]) -> Fraction:
    return extent([Drive(through(ideal), Fraction(-1), Fraction(1))]).high


def through(sections: Sequence[TransferFunction]) -> Response:
    """Impulse response of cascaded sections."""
    response = IMPULSE
    for numerator, denominator in sections:
        response = response.all_pole(denominator).taps(numerator)
    return response


Key = tuple[int, int, str, int]
"""A source: number of the stage, output node, name, and position among the sources of that output's model."""

Drives = Mapping[Key, Drive]

INPUT: Key = (-1, 0, "input", 0)


class Lane:
    """One output of a stage, with everything that drives it."""

    def __init__(self, number: int, model: LinearModel, wires: Sequence[Drives]) -> None:
        self.model = model
        self._number = number
        self._arrived = [
            {key: Drive(d.response.all_pole(model.denominator), d.low, d.high) for key, d in wires[k].items()}
            for k in model.entries
        ]
        self._own = IMPULSE.all_pole(model.denominator)

    def at(self, node: int) -> Drives:
        """Drives at a node: those from earlier stages, then the stage's own sources."""
        model = self.model
        drives: dict[Key, Drive] = {}
        for source, arrived in zip(model.sources, self._arrived, strict=False):
            for key, drive in arrived.items():
                response = drive.response.taps(source.numerators[node])
                if key in drives:
                    response = drives[key].response.plus(response)
                drives[key] = Drive(response, drive.low, drive.high)
        for index, source in enumerate(model.own):
            key = self._number, model.output, source.name, index
            drives[key] = Drive(self._own.taps(source.numerators[node]), source.low, source.high)
        return drives


def _joined(arrived: Sequence[tuple[Response, Polynomial]], model: LinearModel) -> Response:
    return _sum(response.all_pole(model.denominator).taps(transfer) for response, transfer in arrived)


def _sum(responses: Iterable[Response]) -> Response:
    total, *rest = responses
    for response in rest:
        total = total.plus(response)
    return total


def _input_count(stage: StageModel) -> int:
    return 1 + max(k for model in stage for k in model.entries)
