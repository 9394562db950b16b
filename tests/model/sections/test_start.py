"""The start of a filter from its first sample, and what passes beside a section."""

import doctest

import numpy as np
import pytest
from tests.gen.word_lengths.filters import butterworth, plain

from sosmith.model.dataflow.graph import Range
from sosmith.model.sections import start
from sosmith.model.sections.output import FirstSample, OutputStage
from sosmith.model.sections.start import PassingStage, StartStage

RANGES = [Range(3, -128, 127), Range(0, 0, 255), Range(5, 17, 90), Range(0, -90, -17), Range(-2, 0, 3)]


@pytest.mark.parametrize("x", RANGES)
@pytest.mark.parametrize("passes", [False, True])
def test_hands_on_every_sample_less_the_first_one(x: Range, passes: bool) -> None:
    stage = StartStage(x=x, passes=passes)
    samples = np.random.default_rng(1).integers(x.low, x.high + 1, 40).tolist()
    for ends in ([x.low, x.high, x.low], [x.high, x.low, x.high], samples):
        got = stage.graph.run([[code] for code in ends])
        assert got == [[code - ends[0], ends[0]][: 1 + passes] for code in ends]
    assert stage.graph.output_ranges == (Range(x.frac, x.low - x.high, x.high - x.low), x)[: 1 + passes]


def test_passes_a_value_beside_a_section_that_is_otherwise_the_same() -> None:
    section = plain(butterworth(2, 0.1)).sections[0]
    held = Range(4, -5, 900)
    made = PassingStage(section=section, held=held)
    assert made.name == section.name
    samples = np.random.default_rng(2).integers(-9000, 9000, 50).tolist()
    alone = section.graph.run([[code] for code in samples])
    assert made.graph.run([[code, code % 900] for code in samples]) == [
        [y, code % 900] for (y,), code in zip(alone, samples, strict=True)
    ]


@pytest.mark.parametrize(("gain", "frac", "expected"), [(1, 0, [26, 100]), (3, 2, [22, 100]), (-1, 0, [-6, 84])])
def test_is_added_with_its_gain_before_the_output_is_limited(gain: int, frac: int, expected: list[int]) -> None:
    held = FirstSample(range=Range(1, 0, 32), gain=gain, gain_frac=frac)
    stage = OutputStage(offset=0, offset_frac=0, x=Range(2, -400, 400), low=-128, high=100, held=held)
    assert stage.graph.run([[4 * 10, 2 * 16], [4 * 100, 2 * 16]]) == [[code] for code in expected]


def test_the_example_is_true() -> None:
    results = doctest.testmod(start)
    assert results.attempted > 0
    assert results.failed == 0
