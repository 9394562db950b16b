"""The proof of a cascade: ranges of all its nodes, and the error of its roundings and its coefficients.

Every stage's exact linear model hands the responses of all sources on to the next: the input, and the error
of every quantizer so far. At each node whose range a stage states, and at the end, the responses say what is
possible. If no node overflows at any sample before, none does at this one: so by induction the linear model
holds throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.linear_model import LinearModel
from sosmith.gen.peak_gain import Drive, Extent, Horizon, Response, extent, horizon, impulse

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
        Output minus what the same coefficients would give without quantizers.
    coefficients : Extent
        What the stages' transfer functions give, minus what the ideal sections give.
    gain : Fraction
        Worst-case peak gain of the ideal sections.
    """

    nodes: tuple[dict[int, Extent], ...]
    output: Extent
    rounding: Extent
    coefficients: Extent
    gain: Fraction


def prove_cascade(
    models: Sequence[LinearModel], ideal: Sequence[TransferFunction], low: Fraction, high: Fraction
) -> CascadeProof:
    """Prove a cascade of at least one stage for inputs in [low, high] from reset on.

    Raises
    ------
    ShortfallError
        If a stage is unstable or its response does not end in time.
    """
    at = _horizon(models, ideal)
    drives = [Drive(impulse(at), low, high)]
    nodes = []
    for model in models:
        arrived = [Drive(d.response.all_pole(model.denominator), d.low, d.high) for d in drives]
        own = impulse(at).all_pole(model.denominator)
        nodes.append({node: extent(_at_node(model, arrived, own, node)) for node in model.bounds})
        drives = _at_node(model, arrived, own, model.output)
    exact = _through(ideal, at)
    return CascadeProof(
        nodes=tuple(nodes),
        output=extent(drives),
        rounding=extent(drives[1:]),
        coefficients=extent([Drive(drives[0].response.minus(exact), low, high)]),
        gain=_gain(exact),
    )


def coefficient_extent(
    models: Sequence[LinearModel], ideal: Sequence[TransferFunction], low: Fraction, high: Fraction
) -> Extent:
    """Limits of what the stages' transfer functions give, minus what the ideal sections give."""
    at = _horizon(models, ideal)
    made = _through([(model.transfer, model.denominator) for model in models], at)
    return extent([Drive(made.minus(_through(ideal, at)), low, high)])


def rounding_gains(models: Sequence[LinearModel]) -> list[dict[str, Fraction]]:
    """Error at the output of each stage's quantizers, by name, half from the lowest to the highest possible."""
    at = _horizon(models, [])
    after = impulse(at)
    gains = []
    for model in reversed(models):
        after = after.all_pole(model.denominator)
        found = [
            (s.name, extent([Drive(after.taps(s.numerators[model.output]), s.low, s.high)])) for s in model.sources
        ]
        gains.append({name: (e.high - e.low) / 2 for name, e in found if name not in {"input", "constant"}})
        after = after.taps(model.transfer)
    return gains[::-1]


def ideal_gain(ideal: Sequence[TransferFunction]) -> Fraction:
    """Worst-case peak gain of the ideal sections."""
    return _gain(_through(ideal, _horizon([], ideal)))


def _horizon(models: Sequence[LinearModel], ideal: Sequence[TransferFunction]) -> Horizon:
    return horizon([[model.denominator for model in models], [denominator for _, denominator in ideal]])


def _gain(response: Response) -> Fraction:
    return extent([Drive(response, Fraction(-1), Fraction(1))]).high


def _at_node(model: LinearModel, arrived: Sequence[Drive], own: Response, node: int) -> list[Drive]:
    """Drives at a node of a stage: what has come from before, then the stage's own sources."""
    entry, *sources = model.sources
    drives = [Drive(drive.response.taps(entry.numerators[node]), drive.low, drive.high) for drive in arrived]
    return drives + [Drive(own.taps(source.numerators[node]), source.low, source.high) for source in sources]


def _through(sections: Sequence[TransferFunction], at: Horizon) -> Response:
    response = impulse(at)
    for numerator, denominator in sections:
        response = response.all_pole(denominator).taps(numerator)
    return response
