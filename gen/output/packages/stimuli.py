"""The stimuli of a package's bench: the worst cases of the proof, the corners of the inputs, and noise."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.core_facts import InterfaceFacts
from sosmith.gen.output.vectors import Vectors, whole_beats
from sosmith.gen.stimuli.core import bench_of
from sosmith.gen.stimuli.run import Bench, Run
from sosmith.gen.stimuli.worst_case_inputs import all_responses, worst_cases
from sosmith.model.arrays import Codes, Values

_MOST = 8192
"""Most transfers of a part of the stimuli: an event-driven simulator takes them in seconds."""
_HELD = 16
"""Samples for which a corner of the inputs is held."""
_SEED = 1


@dataclass(frozen=True, eq=False, kw_only=True)
class Stimuli:
    """The stimuli of a bench and what the core has to answer.

    Attributes
    ----------
    vectors : Vectors
        The samples.
    parts : tuple of str
        What they consist of, in order, one sentence each.
    """

    vectors: Vectors
    parts: tuple[str, ...]


def bench_stimuli(design: CoreDesign, interface: InterfaceFacts) -> Stimuli:
    """Make the stimuli of a core's bench, with the responses of the integer model; `interface` are its streams.

    First the input that drives the output highest and lowest, by the signs of the ideal filter's impulse response; then
    the same for the path of each rounding error; then all corners of the inputs; then noise, uniform over all codes.
    The last two reach every code of the inputs that the first two leave out. Channel k lags channel 0 by k samples. The
    last beat of several samples is filled with the last one of them.
    """
    bench, channels = bench_of(design), design.spec.channels
    most = max(_MOST // channels, 8)
    pieces = [
        ("worst case of the output", *_worst(bench, [bench.impulse_response], most)),
        ("worst cases of the rounding errors", *_worst(bench, all_responses(bench), most // 2)),
        ("corners of the inputs", _corners(bench), ""),
        ("noise, uniform over all codes", _noise(bench, most // 4), ""),
    ]
    first = np.concatenate([codes for _, codes, _ in pieces])
    lagging = np.maximum(np.arange(len(first))[:, np.newaxis] - np.arange(channels), 0)
    codes = whole_beats(first[lagging], interface.inputs)
    filling = len(codes) - len(first)
    responses, status = design.datapath.compute_with_status(codes)
    return Stimuli(
        vectors=Vectors(
            stimuli=codes,
            responses=np.repeat(responses, interface.copies_per_result, axis=0),
            status=np.repeat(status, interface.copies_per_result, axis=0),
        ),
        parts=(
            *(f"{len(part)} samples: {what}{remark}" for what, part, remark in pieces),
            *[f"{filling} samples: the last one again, to fill its beat"] * (filling > 0),
        ),
    )


def _worst(bench: Bench, responses: list[Values], most: int) -> tuple[Codes, str]:
    """Return the codes of the worst cases of `responses`, at most so many, and a remark where that cuts a tail."""
    whole = 2 * len(responses) * max(map(len, responses))
    run = Run("package", bench, min(whole, most), np.random.default_rng(_SEED))
    remark = "" if whole <= most else f" (of {whole} samples; the tails of the impulse responses are left out)"
    return worst_cases(run, responses).codes, remark


def _corners(bench: Bench) -> Codes:
    ends = [(port.lowest, port.highest) for port in bench.ports]
    return np.repeat(np.array(list(product(*ends)), dtype=np.int64), _HELD, axis=0)


def _noise(bench: Bench, samples: int) -> Codes:
    rng = np.random.default_rng(_SEED)
    return np.stack([rng.integers(p.lowest, p.highest, samples, endpoint=True) for p in bench.ports], axis=1)
