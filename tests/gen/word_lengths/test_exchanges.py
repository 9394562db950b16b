"""The order of sections that exchanges lead to: no design grows by it, and some shrink."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import permutations

import pytest
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth

from sosmith.gen.filter.design import Filter
from sosmith.gen.word_lengths import exchanges
from sosmith.gen.word_lengths.exchanges import in_better_order, may_be_ordered
from sosmith.gen.word_lengths.objective import SHARED_AREA, SMALL_AREA, Objective, ShortProgram
from sosmith.gen.word_lengths.quantize import Plan, plan, prove
from sosmith.model.errors import ShortfallError

AUDIO = 1000.0 / 48000.0


def trimmed(ideal: Filter, realization: str = "df1_ef2", objective: Objective = SMALL_AREA) -> Plan:
    planned = plan(
        name="test",
        inputs=(SIGNED,),
        output=OUT,
        max_error=OUT.lsb,
        ideal=ideal,
        polynomial=None,
        realization=realization,
    )
    return planned.under(objective).trimmed()


@cache
def audio() -> Plan:
    return trimmed(butterworth(5, AUDIO))


def rows_of(planned: Plan) -> list[tuple[float, ...]]:
    assert planned.ideal is not None
    return [tuple(row) for row in planned.ideal.rows]


def test_the_sections_of_audio_lowpass_take_fewer_adders_in_another_order() -> None:
    before, after = audio(), in_better_order(audio())
    assert after.size < before.size
    assert after.otherwise is before
    assert rows_of(after) != rows_of(before)
    assert sorted(rows_of(after)) == sorted(rows_of(before))


def test_no_order_of_three_sections_is_smaller() -> None:
    before, best = audio(), in_better_order(audio())
    sizes = [exchanges._ordered(before, [*order]).size for order in permutations(range(3))]
    assert best.size == min(sizes)


def test_the_other_order_is_proven_to_the_same_bound() -> None:
    quantized = prove(in_better_order(audio()))
    assert quantized.bound <= 1
    assert audio().objective.of_datapath(quantized.datapath) < audio().size
    assert [tuple(row) for row in quantized.filter.rows] == rows_of(in_better_order(audio()))  # type: ignore[union-attr]


def test_an_order_that_is_larger_once_it_is_proven_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    better = in_better_order(audio())
    worst = max((exchanges._ordered(audio(), [*order]) for order in permutations(range(3))), key=lambda each: each.size)
    assert worst.size > audio().size > better.size
    proven = prove(replace(worst, otherwise=audio()))
    assert proven.datapath == prove(audio()).datapath

    def short(*_: object, **__: object) -> None:
        raise ShortfallError("no")

    monkeypatch.setattr("sosmith.gen.word_lengths.quantize.cascade", short)
    monkeypatch.setattr("sosmith.gen.word_lengths.quantize._equally_shared", short)
    with pytest.raises(ShortfallError, match=r"^no$"):
        prove(better)


def test_only_sections_whose_words_count_bit_by_bit_are_exchanged() -> None:
    assert may_be_ordered(audio())
    assert not may_be_ordered(trimmed(butterworth(2, AUDIO)))
    assert not may_be_ordered(replace(audio(), objective=SHARED_AREA))
    program = ShortProgram("folded", 15)
    assert not may_be_ordered(replace(audio(), objective=program))
    assert in_better_order(replace(audio(), objective=program)).otherwise is None


def test_of_many_sections_neighbours_are_exchanged() -> None:
    assert exchanges._exchanged([0, 1, 2]) == [[1, 0, 2], [2, 1, 0], [0, 2, 1]]
    assert len(exchanges._exchanged([*range(4)])) == 6
    assert exchanges._exchanged([0, 1, 2, 3, 4])[1:3] == [[0, 2, 1, 3, 4], [0, 1, 3, 2, 4]]
    assert len(exchanges._exchanged([*range(5)])) == 4
