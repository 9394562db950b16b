"""Fraction bits that a section states without its graph, against the nodes of the graph, in random formats."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from tests.gen.word_lengths.filters import butterworth

from sosmith.gen.proof.linear_model import quantizers
from sosmith.gen.realizations.registry import CASCADES, Section, realization_of
from sosmith.gen.realizations.section_format import SectionFormat, unknown_range
from sosmith.gen.word_lengths.cascade import stages_of
from sosmith.model.dataflow.graph import Op, Range
from sosmith.model.errors import ShortfallError

FILTERS = [
    ("lowpass", 3, 0.1),
    ("lowpass", 5, 0.002),
    ("highpass", 1, 0.3),
    ("highpass", 3, 0.45),
    ("bandpass", 2, 0.1),
]
TRIES = 12


def in_random_formats(kind: str, order: int, cutoff: float, realization: str) -> list[Section]:
    """Sections of a filter, if the realization takes it."""
    rng = random.Random(f"{kind}, {order}, {realization}")
    ideal = butterworth(order, cutoff, kind)
    made: list[Section] = []
    for _ in range(TRIES):
        x = unknown_range(rng.randint(0, 9)) if rng.random() < 0.5 else Range(rng.randint(0, 9), -1000, 999)
        try:
            formats = [SectionFormat(coefficient_bits=rng.randint(8, 30))] * len(
                realization_of(realization).parts(ideal.rows)
            )
            stages = stages_of(ideal, realization, formats, x)
            for k, (form, stage) in enumerate(zip(formats, stages, strict=True)):
                names = [name for name in (*quantizers(stage.graph), *stage.optional_quantizers) if rng.random() < 0.9]
                formats[k] = replace(form, fracs={name: rng.randint(0, 20) for name in names})
            made += stages_of(ideal, realization, formats, x)
        except ShortfallError:
            continue
    return made


@pytest.mark.parametrize("realization", [*CASCADES, "look_ahead_4", "look_ahead_6"])
def test_they_are_those_of_the_graph(realization: str) -> None:
    sections = [section for case in FILTERS for section in in_random_formats(*case, realization)]
    assert len(sections) > TRIES
    for section in sections:
        stated = {node.name: node.frac for node in section.graph.nodes if node.op is Op.BOUND}
        assert section.stated_fracs == stated
