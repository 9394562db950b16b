"""Sections in on-line arithmetic: the recurrence gives the graph's result, and its residual cannot leave its range."""

import random
import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction
from itertools import product

import pytest
from tests.gen.designs import example_design, parallel_design

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range
from sosmith.model.sections import online
from sosmith.model.sections.direct_form import DirectForm1, Product
from sosmith.model.sections.online import OnlineError, OnlineSection, online_schedule, online_section, sections_of

Digits = dict[int, int]
MINUS_HALF = Fraction(-1, 2)


def second_order(feedback: tuple[int, int], *, x_frac: int = 0, y_frac: int = 3) -> DirectForm1:
    """Make a low-pass section with unity gain: a1 = -1.5, a2 = 0.625, b = (1, 2, 1) / 32."""
    return DirectForm1(
        name="section0",
        products=(Product("A1", 1, 1, (0, 0, 0), (-1, 1)), Product("A2", 1, 3, (1, 2, 1), (0, -4), 2)),
        integer_part=(-2, 1),
        feedback=feedback,
        x=Range(x_frac, -128, 127),
        y_frac=y_frac,
        v_range=(-(1 << 16), (1 << 16) - 1),
    )


def first_order(feedback: tuple[int, int], *, pole: int = -1) -> DirectForm1:
    """Make a section with its pole at 0.625, or on the other side."""
    return DirectForm1(
        name="section0",
        products=(Product("A1", 3, 3, (1, -pole, 0), (2 * pole, 0), 1),),
        integer_part=(pole, 0),
        feedback=feedback,
        x=Range(0, -128, 127),
        y_frac=2,
        v_range=(-(1 << 15), (1 << 15) - 1),
    )


SECTIONS = {
    "df1": second_order((0, 0)),
    "df1_ef1": second_order((-1, 0)),
    "df1_ef2": second_order((-2, 1)),
    "positive feedback": second_order((2, 1)),
    "finer input": second_order((-1, 0), x_frac=5),
    "coarser input": second_order((-2, 1), x_frac=-1, y_frac=2),
    "first order": first_order((-1, 0)),
    "first order, other side": first_order((1, 0), pole=1),
}


def redundant(value: Fraction, last: int, rng: random.Random) -> Digits:
    """Return signed digits of a value, down to the weight ``2**last``, at random among all that there are."""
    code = int(value * Fraction(2) ** -last)
    assert code == value * Fraction(2) ** -last
    digits: Digits = {}
    exponent = last
    while code or exponent < last + 4:
        bit = code & 1
        digits[exponent] = rng.choice((1, -1)) if bit and abs(code) > 1 else (bit if code > 0 else -bit)
        code = (code - digits[exponent]) >> 1
        exponent += 1
    return digits


def run(section: OnlineSection, graph: Graph, samples: Iterable[int], *, disguise: int | None = None) -> None:
    """Hold the recurrence against the graph; a seed disguises each operand as other digits of the same value."""
    rng = random.Random(disguise)
    state = graph.reset()
    xs: list[Digits] = [{0: 0}] * 3
    ys: list[Digits] = [{0: 0}] * 2
    errors = [MINUS_HALF] * 2
    for x in samples:
        (y,) = graph.step([x], state)
        xs = [redundant(x * Fraction(2) ** -section.x_frac, -section.x_frac, rng), *xs[:2]]
        digits, error = section.run(
            xs[: len(section.numerator)], ys[: len(section.recursion)], errors[: len(section.feedback)]
        )
        value = sum((d * Fraction(2) ** k for k, d in digits.items()), Fraction(0))
        assert value == y * Fraction(2) ** -section.y_frac
        assert set(digits.values()) <= {-1, 0, 1}
        assert min(digits) == -section.y_frac
        assert max(digits) == section.leading
        assert MINUS_HALF <= error < -MINUS_HALF
        ys = [digits if disguise is None else redundant(value, -section.y_frac, rng), ys[0]]
        errors = [error, errors[0]]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("made", SECTIONS.values(), ids=SECTIONS)
def test_the_recurrence_gives_the_result_of_the_graph(made: DirectForm1) -> None:
    section = online_section("section0", made.graph)
    rng = random.Random(1)
    ends = [made.x.low, made.x.high]
    samples = [rng.choice([rng.randint(*made.x[1:]), *ends]) for _ in range(100)]
    run(section, made.graph, samples)
    run(section, made.graph, samples, disguise=2)


@pytest.mark.parametrize("made", SECTIONS.values(), ids=SECTIONS)
def test_coefficients_are_those_of_the_section(made: DirectForm1) -> None:
    section = online_section("section0", made.graph)
    reach = len(section.numerator)
    assert section.numerator == made.numerator[:reach]
    assert not any(made.numerator[reach:])
    order = len(section.recursion)
    assert section.recursion == tuple(-a for a in made.denominator[:order])
    assert not any(made.denominator[order:])
    assert section.feedback == tuple(-k for k in made.feedback)[: len(section.feedback)]
    assert not any(made.feedback[len(section.feedback) :])


# The residual.

Step = Callable[[OnlineSection, int, int, int], tuple[int, int, int]]


def hardware(section: OnlineSection, word: int, carries: int, increment: int) -> tuple[int, int, int]:
    return section.step(word, carries, increment)


def reachable(section: OnlineSection, step: Step = hardware) -> set[tuple[int, int]]:
    """Return all pairs of words that any digits lead to, from 0 on; fails where a value leaves its range."""
    unit = Fraction(2) ** section.residual_frac / 2**section.delay
    factors = (*section.numerator, *section.recursion)
    sums = {sum((f * d for f, d in zip(factors, digits, strict=True)), Fraction(0)) for digits in _digits(len(factors))}
    mask = (1 << section.residual_bits) - 1
    increments = [int(total * unit) & mask for total in sums]
    seen, left = {(0, 0)}, [(0, 0)]
    while left:
        word, carries = left.pop()
        before = section.value(word, carries)
        for increment in increments:
            one, other, digit = step(section, word, carries, increment)
            after = section.value(one, other)
            exact = 2 * before + section.value(increment, 0) - digit
            assert after == exact, f"{after} must be {exact}"
            assert -3 <= 4 * after < 3, f"a residual must be in [-3/4, 3/4), not {after}"
            if (one, other) not in seen:
                seen.add((one, other))
                left.append((one, other))
    return seen


def _digits(count: int) -> Iterable[tuple[int, ...]]:
    return product((-1, 0, 1), repeat=count)


SMALL = {
    "one": (Fraction(1),),
    "half and quarter": (Fraction(1, 2), Fraction(-1, 4)),
    "two": (Fraction(27, 16), Fraction(-5, 16)),
}


def small(factors: tuple[Fraction, ...]) -> OnlineSection:
    return OnlineSection(
        name="small",
        numerator=factors[:1],
        recursion=factors[1:] or (Fraction(0),),
        feedback=(),
        x_frac=0,
        y_frac=0,
        largest=Fraction(4),
    )


@pytest.mark.parametrize("factors", SMALL.values(), ids=SMALL)
def test_no_digits_lead_the_residual_out_of_its_range(factors: tuple[Fraction, ...]) -> None:
    """All states of the carry-save pair that any sequence of digits can reach are visited."""
    assert len(reachable(small(factors))) >= 2 ** len(factors)


def test_a_delay_that_is_one_too_small_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(online, "MOST_INCREMENT", Fraction(1, 2))
    section = small(SMALL["two"])
    assert section.delay == 2
    with pytest.raises(AssertionError, match=r"must be in \[-3/4, 3/4\), not|must be -?\d"):
        reachable(section)


@pytest.mark.parametrize(("least", "most"), [(3, -3), (0, -3), (2, -5), (2, -2)])
def test_a_selection_that_is_off_is_found(least: int, most: int) -> None:
    """The digit is 1 from `least` quarters on, right is 1 or 2, and -1 from `most` quarters down, right is -3 or -4."""

    def step(section: OnlineSection, word: int, carries: int, increment: int) -> tuple[int, int, int]:
        low = section.residual_bits - 4
        total, carry, _ = section.step(word, carries, increment, selects=False)
        top = total >> low
        signed = top if top <= 6 else top - 16
        digit = 1 if signed >= least else (-1 if signed <= most else 0)
        return total & ((1 << low) - 1) | (top - 4 * digit & 15) << low, carry, digit

    with pytest.raises(AssertionError, match=r"must be in \[-3/4, 3/4\), not|must be -?\d"):
        reachable(small(SMALL["two"]), step)


# What is no such section, and what does not fit.


def test_sections_that_quantize_elsewhere_are_refused() -> None:
    made = SECTIONS["df1"]
    kept = replace(made, products=tuple(replace(p, kept=0, range=(-4000, 4000)) for p in made.products))
    with pytest.raises(
        OnlineError, match=r"^its output must be the floor of a sum of taps, without a quantizer before$"
    ):
        online_section("section0", kept.graph)


def test_a_sum_without_a_recursion_is_refused() -> None:
    g = GraphBuilder()
    x = g.input("x", 0, -8, 7)
    graph = g.build([g.bound(g.add(x, g.previous(x, "x1")), -16, 14, "y")])
    with pytest.raises(OnlineError, match=r"^a section must be recursive$"):
        online_section("section0", graph)


@pytest.mark.parametrize("realization", ["df2t", "lattice_wdf"])
def test_other_realizations_are_refused(realization: str) -> None:
    datapath = example_design("audio_lowpass.toml", realization=realization).datapath
    with pytest.raises(OnlineError, match=r"^section\d is not a section in direct form I: "):
        online_schedule(datapath, 0)


def test_a_datapath_without_sections_is_refused() -> None:
    datapath = parallel_design("flange_wear_bench.toml", core="calibration").datapath
    with pytest.raises(OnlineError, match=re.escape("there must be filter sections, and there are none")):
        sections_of(datapath)


def test_signals_of_too_different_sizes_are_refused() -> None:
    schedule = online.OnlineSchedule((online_section("section0", SECTIONS["df1"].graph),), 2, 0)
    with pytest.raises(
        OnlineError, match=r"^the signals before and behind section0 must differ less in size: it would"
    ):
        schedule.check()
