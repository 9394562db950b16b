"""What joins the cores of a stage that interpolates: every variant that is written is accepted, and no other."""

from __future__ import annotations

import re
from fractions import Fraction

import pytest

from sosmith.gen.chain.joints.turns import TurnsUnit
from sosmith.gen.chain.rates import Pattern, Rate, pattern_of, results_of, samples_of
from sosmith.gen.output.core_facts import StreamFacts
from sosmith.hdl.plan.streams import fields
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port
from sosmith.verify.certificate_file import StreamEntry
from sosmith.verify.chain.flags import Timing, timing_of
from sosmith.verify.chain.turns import TurnsClaim, check_turns
from sosmith.verify.reader.source import read_source

PORT = Port.from_range("y", 12, Fraction(-1), Fraction(1), signed=True, unit="")
_TOKEN = re.compile(r"\d+'h[0-9a-f]+|\b\d+\b|[-+&|~?:]|==|\b[a-z_]\w*\b")
_OTHER = {"-": "+", "+": "-", "&": "|", "|": "&", "==": "!=", "~": "!"}


def pair(phases: int, dest: int, *, guarded: bool = False, loads: bool = False) -> tuple[str, TurnsClaim]:
    stream = StreamFacts(fields=fields((PORT,)), dest_width=dest, flags={"fault": 6})
    unit = TurnsUnit(name="rx_fill_turns", phases=phases, results=stream, guarded=guarded, loads=loads)
    entry = StreamEntry.model_construct(width=stream.width, dest_width=dest, user_width=stream.user_width)
    claim = TurnsClaim(name="rx_fill_turns", cores=phases, results=entry, guarded=guarded, loads=loads)
    return unit.text(), claim


def check(text: str, claim: TurnsClaim) -> None:
    check_turns(read_source(text, "rx_fill_turns").modules["rx_fill_turns"], claim)


@pytest.mark.parametrize("dest", [0, 8])
@pytest.mark.parametrize("phases", [2, 3, 4, 7])
@pytest.mark.parametrize("guarded", [False, True])
@pytest.mark.parametrize("loads", [False, True])
def test_each_variant_is_accepted(phases: int, dest: int, guarded: bool, loads: bool) -> None:
    check(*pair(phases, dest, guarded=guarded, loads=loads))


def test_another_number_of_cores_is_refused() -> None:
    text, _ = pair(3, 0)
    _, claim = pair(4, 0)
    with pytest.raises(ShortfallError, match=r"^the ports of rx_fill_turns must be "):
        check(text, claim)


def test_a_fault_that_is_one_of_a_core_alone_is_refused() -> None:
    text, claim = pair(3, 8, guarded=True)
    plain, other = pair(3, 8)
    for given, wanted in ((plain, claim), (text, other), (text.replace("any2, 6", "any1, 6"), claim)):
        with pytest.raises(
            ShortfallError, match=r"^rx_fill_turns must |^the (registers|widths) of rx_fill_turns must "
        ):
            check(given, wanted)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("none | every2", "1'h1"),
        ("chosen1 = given1 | offered1", "chosen1 = given1"),
        ("i2_begun | o2_tready", "o2_tready"),
        ("every1 & chosen2", "chosen2"),
    ],
)
def test_a_bank_that_may_change_within_a_sample_is_refused(old: str, new: str) -> None:
    text, claim = pair(3, 0, loads=True)
    assert old in text
    with pytest.raises(ShortfallError, match=r"^rx_fill_turns must assign "):
        check(text.replace(old, new), claim)


@pytest.mark.slow
def test_no_token_may_be_another_one() -> None:
    text, claim = pair(3, 8, guarded=True, loads=True)
    refused = 0
    for match in _TOKEN.finditer(text, text.index("wire reset;")):
        other = _OTHER.get(match[0], "moves" if match[0] != "moves" else "later")
        if match[0][0].isdigit():
            other = f"{match[0][:-1]}{(int(match[0][-1], 16) + 1) % 10}"
        with pytest.raises(ShortfallError):
            check(text[: match.start()] + other + text[match.end() :], claim)
        refused += 1
    assert refused > 250


RATES = [
    [],
    [Rate(1, 3)],
    [Rate(1, 2), Rate(3, 1)],
    [Rate(3, 1), Rate(1, 2)],
    [Rate(2, 1), Rate(1, 1), Rate(1, 3)],
    [Rate(7, 1), Rate(1, 3)],
    [Rate(4, 1), Rate(1, 2)],
]


@pytest.mark.parametrize("rates", RATES)
def test_both_sides_count_the_samples_that_bring_results(rates: list[Rate]) -> None:
    """By counting: which of the first samples bring any, and how many results the first of these bring in all."""
    numbers = samples_of(rates, results_of(rates, 60)).tolist()
    pattern, timing = pattern_of(rates), timing_of(rates)
    assert (timing.up, timing.down, timing.down_first) == (pattern.rise, pattern.factor, pattern.rises_last)
    assert pattern == Pattern(*(timing.up, timing.down), rises_last=timing.down_first)
    bringing = sorted(set(numbers))
    for results in range(19):
        entries, brought = pattern.entries(results)
        assert timing.bringing(results) == (entries, brought)
        assert brought == sum(number in bringing[:entries] for number in numbers) >= results
        assert not entries or sum(number in bringing[: entries - 1] for number in numbers) < results


def test_a_rate_that_turns_twice_is_refused() -> None:
    with pytest.raises(ShortfallError, match=r"^the rate must turn once at most behind the first stage$"):
        timing_of([(2, 1), (1, 2), (1, 1), (2, 1)])
    assert timing_of([(1, 1), (2, 1), (1, 2)]) == Timing(2, 2, down_first=False)
