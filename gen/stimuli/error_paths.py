"""Impulse responses of a cascade in double precision, from every quantizer to the output.

Test signals are made from these. The proof uses its own exact responses (`sosmith.gen.proof.peak_gain`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.design import decay_length
from sosmith.gen.proof.linear_model import LinearModel, Source, linear_models
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.arithmetic.recursive_filters import lfilter

Array = npt.NDArray[np.float64]


def error_responses(quantized: Quantized) -> Iterator[Array]:
    """Impulse response from each quantizer's error to the cascade's output, in the order of the sections.

    Yields
    ------
    ndarray, shape (n,)
        Response of the output to a unit error, both in output LSBs, until the rest is below 1e-12 of the envelope.
        Constants inside the sections count as quantizers.
    """
    for _, _, _, response in error_paths(quantized):
        yield response


def error_paths(quantized: Quantized) -> list[tuple[int, LinearModel, Source, Array]]:
    """Every source inside the sections: index of its section, its model, the source, and its response as above."""
    length = decay_length(quantized.quantized_sos)
    impulse = np.zeros(length)
    impulse[0] = 1.0
    after = [impulse]  # from each output of a section to the end
    by_section: list[list[tuple[int, LinearModel, Source, Array]]] = []
    stages = [linear_models(section.graph) for section in quantized.sections]
    for number, stage in reversed(list(enumerate(stages))):
        over = [_filtered((Fraction(1),), m.denominator, wire) for m, wire in zip(stage, after, strict=True)]
        by_section.append(
            [
                (number, model, source, _filtered(source.numerators[model.output], (Fraction(1),), response))
                for model, response in zip(stage, over, strict=True)
                for source in model.own
            ]
        )
        after = [np.zeros(length) for _ in range(1 + max(k for model in stage for k in model.entries))]
        for model, response in zip(stage, over, strict=True):
            for k, transfer in zip(model.entries, model.transfers, strict=True):
                after[k] += _filtered(transfer, (Fraction(1),), response)
    return [path for paths in reversed(by_section) for path in paths]


def _filtered(numerator: Sequence[Fraction], denominator: Sequence[Fraction], values: Array) -> Array:
    over, under = ([float(value) for value in polynomial] for polynomial in (numerator, denominator))
    return lfilter(over, under, values)
