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


@cache
def better() -> Plan:
    return in_better_order(audio())


@cache
def in_all_orders() -> list[Plan]:
    return [exchanges._ordered(audio(), [*order]).trimmed() for order in permutations(range(3))]


def rows_of(planned: Plan) -> list[tuple[float, ...]]:
    assert planned.ideal is not None
    return [tuple(row) for row in planned.ideal.rows]


def test_the_sections_of_audio_lowpass_take_fewer_adders_in_another_order() -> None:
    before, after = audio(), better()
    assert after.size < before.size
    assert after.otherwise is before
    assert rows_of(after) != rows_of(before)
    assert sorted(rows_of(after)) == sorted(rows_of(before))


def test_no_order_of_three_sections_is_smaller() -> None:
    assert better().size == min(way.size for way in in_all_orders())


def test_the_other_order_is_proven_to_the_same_bound() -> None:
    quantized = prove(better())
    assert quantized.bound <= 1
    assert audio().objective.of_datapath(quantized.datapath) < audio().size
    assert quantized.filter is not None
    assert [tuple(row) for row in quantized.filter.rows] == rows_of(better())


def test_an_order_that_is_larger_once_it_is_proven_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    worst = max(in_all_orders(), key=lambda each: each.size)
    assert worst.size > audio().size > better().size
    proven = prove(replace(worst, otherwise=audio()))
    assert proven.datapath == prove(audio()).datapath

    def short(*_: object, **__: object) -> None:
        raise ShortfallError("no")

    monkeypatch.setattr("sosmith.gen.word_lengths.quantize.cascade", short)
    monkeypatch.setattr("sosmith.gen.word_lengths.quantize._equally_shared", short)
    with pytest.raises(ShortfallError, match=r"^no$"):
        prove(better())


def test_only_sections_whose_words_count_bit_by_bit_are_exchanged() -> None:
    assert may_be_ordered(audio())
    assert not may_be_ordered(trimmed(butterworth(2, AUDIO)))
    assert not may_be_ordered(replace(audio(), objective=SHARED_AREA))
    program = ShortProgram("folded", 15)
    assert not may_be_ordered(replace(audio(), objective=program))
    assert in_better_order(replace(audio(), objective=program)).otherwise is None


def test_any_two_of_up_to_four_sections_are_exchanged() -> None:
    assert exchanges._exchanged([0, 1, 2]) == [[1, 0, 2], [2, 1, 0], [0, 2, 1]]
    assert len(exchanges._exchanged([*range(4)])) == 6
    formats = audio().start
    assert formats is not None
    many = replace(formats, formats=(*formats.formats, *formats.formats))
    assert not may_be_ordered(replace(audio(), start=many))
