"""The search for words: what it spends and saves, how far its estimates may be trusted, and what happens if not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from tests.gen.designs import ALL, example_design
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.linear_model import Source, linear_model
from sosmith.gen.realizations.coefficients import lowest_terms, round_significant
from sosmith.gen.realizations.kept_formats import Choice
from sosmith.gen.realizations.registry import CASCADES, REALIZATIONS, Section
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.word_lengths import quantize as quantize_module
from sosmith.gen.word_lengths.cost import cost_of, cost_of_graphs
from sosmith.gen.word_lengths.estimates import largest_magnitude
from sosmith.gen.word_lengths.objective import FewSums
from sosmith.gen.word_lengths.quantize import Plan, plan, prove
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.search import Search
from sosmith.model.dataflow.graph import Range
from sosmith.model.sections.direct_form import DirectForm1, Product

FAST = "audio_lowpass.toml", "flange_wear_bench.toml"
EXAMPLES = [pytest.param(name, marks=[] if name in FAST else [pytest.mark.slow]) for name in ALL]
FILTERS = [
    ("lowpass", 1, 0.1),
    ("lowpass", 5, 0.02),
    ("lowpass", 2, 0.001),
    ("highpass", 2, 0.05),
    ("bandpass", 2, 0.1),
    ("bandstop", 3, 0.2),
]


@cache
def example_plan(name: str, realization: str) -> Plan:
    """Plan of an example as it is before trimming."""
    known = example_design(name, realization="df1_ef2")
    return plan(
        name=name,
        inputs=known.datapath.inputs,
        output=known.spec.output,
        max_error=known.spec.max_error,
        ideal=known.quantized.filter,
        polynomial=known.quantized.polynomial,
        realization=realization,
    )


def filter_plan(kind: str, order: int, cutoff: float, realization: str) -> Plan:
    """Plan of a filter alone, for an error of one LSB."""
    return plan(
        name="test",
        inputs=(SIGNED,),
        output=OUT,
        max_error=OUT.lsb,
        ideal=butterworth(order, cutoff, kind),
        polynomial=None,
        realization=realization,
    )


@cache
def trimmed_and_proven(name: str, realization: str) -> tuple[Plan, Quantized]:
    trimmed = example_plan(name, realization).trimmed()
    return trimmed, prove(trimmed)


def search_of(planned: Plan) -> tuple[Search, Choice]:
    assert planned.search is not None
    assert planned.start is not None
    return planned.search, planned.start


def filter_of(planned: Plan) -> Filter:
    assert planned.ideal is not None
    return planned.ideal


def ideal_coefficients(planned: Plan) -> list[dict[str, Fraction]]:
    """Coefficients to 50 significant bits, by section and name."""
    build = REALIZATIONS[planned.realization].build
    sections = [build(row, SectionFormat(coefficient_bits=50), "s") for row in filter_of(planned).rows]
    return [
        {name: integer * Fraction(2) ** -frac for name, (integer, frac) in section.coefficients.items()}
        for section in sections
    ]


# What the estimates are worth.


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize("name", EXAMPLES)
def test_what_is_estimated_is_what_is_proven(name: str, realization: str) -> None:
    """Of the words that the search ends with, at the first attempt: error by its parts, and area."""
    trimmed, made = trimmed_and_proven(name, realization)
    search, choice = search_of(trimmed)
    assert [section.coefficients for section in made.sections] == [form.coefficients for form in choice.formats]
    coefficients = search.coefficient_error(choice)
    rounding = (
        search.error(choice) - coefficients - float(trimmed.input_stages[choice.input_stage].error * trimmed.gain)
    )
    assert coefficients == pytest.approx(float(made.budget["filter coefficients"]), rel=1e-3)
    # Of few bits dropped, the largest error is less than a unit; the estimate takes a unit.
    assert 0.999 < rounding / float(made.budget["filter rounding"]) < 1.08
    assert trimmed.size == pytest.approx(cost_of(made.datapath).area, rel=1e-3)


@pytest.mark.parametrize(
    ("order", "realization"), [(1, "look_ahead_8"), pytest.param(3, "look_ahead_6", marks=pytest.mark.slow)]
)
def test_products_of_look_ahead_keep_as_many_bits_as_the_others_of_their_sum(order: int, realization: str) -> None:
    planned = filter_plan("lowpass", order, 0.1, realization).under(FewSums(18))
    search, choice = search_of(planned.trimmed())
    zeros, *recursions = (estimate.groups for estimate in search._estimates)
    assert [group.total for group in zeros] == [""]  # of an FIR filter, whose sum drops nothing
    assert [[group.total for group in groups] for groups in recursions] == [["u1", "v"]] * len(recursions)
    kept = [
        [{form.fracs[name] for name in group.products} for group in groups]
        for form, groups in zip(choice.formats, (zeros, *recursions), strict=True)
    ]
    assert all(len(fracs) == 1 for groups in kept for fracs in groups)
    made = prove(planned.trimmed())
    assert 0.9 < search.error(choice) / float(sum(made.budget.values()) - made.budget["output rounding"]) < 1.1
    whole = [
        replace(form, fracs={n: f for n, f in form.fracs.items() if "product" not in n}) for form in choice.formats
    ]
    assert search.size(choice) < 0.8 * search.size(replace(choice, formats=tuple(whole)))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("ends", [(-1.0, 1.0), (0.0, 1.0), (-1.0, 0.25), (0.25, 1.0), (-1.0, -0.5)])
def test_the_largest_error_is_that_of_the_worst_input(ends: tuple[float, float], sign: int) -> None:
    """Against the sums up to every sample, each driven by the end that is worse."""
    response = sign * np.array([0.5, -0.125, -2.0, 0.75, 0.25, 0.5])
    driven = np.outer(ends, response)
    tops, bottoms = driven.max(axis=0).cumsum(), driven.min(axis=0).cumsum()
    assert largest_magnitude(response, [ends]) == max(0, *tops, *-bottoms)


@pytest.mark.slow
@pytest.mark.parametrize("realization", ["df1", "df1_ef1", "df1_ef2"])
def test_bits_dropped_from_an_operand_of_inputs_alone_are_not_free(realization: str) -> None:
    """In a band-pass of direct form I, b0 multiplies a difference of two inputs, whose bits are worth something."""
    trimmed = filter_plan("bandpass", 4, 0.05, realization).trimmed()
    search, choice = search_of(trimmed)
    made = prove(trimmed)
    assert any("taps_b0" in estimate.optional for estimate in search._estimates)
    assert all(estimate.gains["taps_b0"] > 0 for estimate in search._estimates if "taps_b0" in estimate.optional)
    proven = float(made.budget["filter rounding"] + made.budget["filter coefficients"])
    assert 0.999 < search.error(choice) / proven < 1.08
    assert trimmed.size == pytest.approx(cost_of(made.datapath).area, rel=1e-3)


@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_start_keeps_each_part_to_its_share(name: str, realization: str) -> None:
    planned = example_plan(name, realization)
    search, choice = search_of(planned)
    share = float(planned.share)
    entry = float(planned.input_stages[0].error * planned.gain)
    coefficients = search.coefficient_error(choice)
    assert choice.input_stage == 0
    assert max(entry, coefficients, search.error(choice) - coefficients - entry) <= share * (1 + 1e-9)
    exact = [{name: float(value) for name, value in section.items()} for section in ideal_coefficients(planned)]
    assert any(
        [form.coefficients for form in choice.formats]
        == [{name: round_significant(value, bits) for name, value in section.items()} for section in exact]
        for bits in range(1, 41)
    )


def test_there_is_no_start_beyond_the_most_bits() -> None:
    search, _ = search_of(example_plan("audio_lowpass.toml", "df1"))
    assert search.start(0.2, 40) is not None
    assert search.start(0.2, 12) is None
    assert search.start(1e-12, 40) is None


# What the search ends with.


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize("name", EXAMPLES)
def test_trimming_saves(name: str, realization: str) -> None:
    before, (after, _) = example_plan(name, realization), trimmed_and_proven(name, realization)
    assert after.size < before.size
    search, choice = search_of(after)
    assert search.error(choice) <= float(after.allowed)


def shorter(planned: Plan) -> Iterator[tuple[str, Choice]]:
    """Every choice with one bit less in one quantizer, or in one coefficient whichever its neighbour."""
    _, choice = search_of(planned)
    exact = ideal_coefficients(planned)
    for k, form in enumerate(choice.formats):
        changed = [(name, form.with_frac(name, frac - 1)) for name, frac in form.fracs.items() if frac]
        for name, (integer, frac) in form.coefficients.items():
            if abs(integer).bit_length() > 2:
                below = (exact[k][name] * Fraction(2) ** (frac - 1)).__floor__()
                changed += [(name, form.with_coefficient(name, lowest_terms(i, frac - 1))) for i in (below, below + 1)]
        for name, other in changed:
            yield (
                f"{name} of section {k}",
                replace(choice, formats=(*choice.formats[:k], other, *choice.formats[k + 1 :])),
            )
    if choice.input_stage + 1 < len(planned.input_stages):
        yield "input stage", replace(choice, input_stage=choice.input_stage + 1)


@pytest.mark.sweep(3)
@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize(("kind", "order", "cutoff"), FILTERS)
def test_no_further_step_both_fits_and_saves(kind: str, order: int, cutoff: float, realization: str) -> None:
    trimmed = filter_plan(kind, order, cutoff, realization).trimmed()
    search, choice = search_of(trimmed)
    assert prove(trimmed).bound <= 1
    area, allowed = search.size(choice), float(trimmed.allowed)
    assert [
        what for what, other in shorter(trimmed) if search.error(other) <= allowed and search.size(other) < area
    ] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_no_further_step_is_left_where_a_calibration_comes_first(name: str) -> None:
    trimmed, made = trimmed_and_proven(name, "df1_ef2")
    search, choice = search_of(trimmed)
    assert made.bound * trimmed.output.lsb <= trimmed.max_error
    area, allowed = search.size(choice), float(trimmed.allowed)
    assert [
        what for what, other in shorter(trimmed) if search.error(other) <= allowed and search.size(other) < area
    ] == []


@pytest.mark.sweep(5)
@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize("name", EXAMPLES)
def test_coefficients_are_neighbours_of_the_ideal(name: str, realization: str) -> None:
    """Each is one of the two integers beside the ideal at its own fraction bits."""
    trimmed, made = trimmed_and_proven(name, realization)
    for section, exact in zip(made.sections, ideal_coefficients(trimmed), strict=True):
        for label, (integer, frac) in section.coefficients.items():
            assert abs(integer - exact[label] * 2**frac) < 1


@pytest.mark.slow
def test_coefficients_differ_in_width_and_are_not_all_the_nearest() -> None:
    further = 0
    for name in FAST:
        for realization in CASCADES:
            trimmed, made = trimmed_and_proven(name, realization)
            widths = [abs(integer).bit_length() for s in made.sections for integer, _ in s.coefficients.values()]
            assert len(set(widths)) > 1
            further += sum(
                abs(integer - exact[label] * 2**frac) > Fraction(1, 2)
                for section, exact in zip(made.sections, ideal_coefficients(trimmed), strict=True)
                for label, (integer, frac) in section.coefficients.items()
            )
    assert further


@pytest.mark.slow
def test_long_operands_are_cut_to_fit_a_multiplier() -> None:
    """Tap sums of a low-pass at a low cutoff are longer than a multiplier takes, each of which costs a second one."""
    _, made = trimmed_and_proven("flange_wear_locomotive.toml", "df1_ef2")
    sections = [section for section in made.sections if isinstance(section, DirectForm1)]
    whole = [replace(s, products=tuple(replace(p, kept=None) for p in s.products)) for s in sections]
    assert cost_of_graphs([s.graph for s in whole]).splits > 0
    assert cost_of_graphs([s.graph for s in sections]).splits == 0


UNITY = "df1", "df1_ef1", "df1_ef2", "delta"


@pytest.mark.sweep(4)
@pytest.mark.parametrize("realization", UNITY)
@pytest.mark.parametrize(("order", "cutoff"), [(1, 0.1), (5, 0.02), (6, 0.003)])
def test_the_gain_at_zero_frequency_stays_exactly_one(order: int, cutoff: float, realization: str) -> None:
    trimmed = filter_plan("lowpass", order, cutoff, realization).trimmed()
    for section in prove(trimmed).sections:
        model = linear_model(section.graph)
        assert sum(model.transfer) == sum(model.denominator)


@pytest.mark.slow
@pytest.mark.parametrize("realization", CASCADES)
def test_the_same_words_are_found_again(realization: str) -> None:
    first, second = (filter_plan("bandpass", 2, 0.1, realization).trimmed() for _ in range(2))
    assert first.start == second.start
    assert prove(first).datapath == prove(second).datapath


# What a quantized tap sum does.


def source_of(section: Section, name: str) -> tuple[Source, int]:
    model = linear_model(section.graph)
    (source,) = [s for s in model.sources if s.name == name]
    return source, model.output


@pytest.mark.parametrize("feedback", [(0, 0), (-1, 0), (-2, 1), (-1, 1)])
@pytest.mark.parametrize("label", ["A1", "A2"])
def test_what_a_tap_sum_drops_comes_through_its_coefficient_and_a_difference(
    label: str, feedback: tuple[int, int]
) -> None:
    """From what is dropped to the output: ``-(1 - w) c 2**-shift / A``, exactly, for the shift counts in the sum."""
    products = (
        Product("A1", 77, 12, (0, 0, 0), (-1, 1)),
        Product("A2", 45, 16, (1, 2, 1), (0, -4), 2),
    )
    fitted = tuple(replace(p, kept=2 if p.name == label else None, range=(-(2**40), 2**40)) for p in products)
    section = DirectForm1(
        name="s",
        products=fitted,
        integer_part=(-2, 1),
        feedback=feedback,
        x=Range(6, -(2**20), 2**20),
        y_frac=5,
        v_range=(-(2**50), 2**50),
    )
    (cut,) = [p for p in fitted if p.name == label]
    source, output = source_of(section, cut.operand)
    model = linear_model(section.graph)
    a = (Fraction(1), *section.denominator)
    expected = [-cut.value * weight for weight in (1, -1)]
    assert convolved(source.numerators[output], a) == convolved(expected, model.denominator)
    # Nothing else changes: neither what passes nor what the sum's other quantizer makes.
    plain = linear_model(replace(section, products=tuple(replace(p, kept=None) for p in fitted)).graph)
    assert convolved(model.transfer, plain.denominator) == convolved(plain.transfer, model.denominator)
    frac = {"A1": 5, "A2": 8}[label]  # of the tap sum: y has 5 fraction bits, x has 6, and the shift adds 2
    assert source.kept == 2
    assert (source.low, source.high) == (0, (2 ** (frac - 2) - 1) * Fraction(2) ** -frac)


def convolved(a: Sequence[Fraction], b: Sequence[Fraction]) -> list[Fraction]:
    result = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            result[i + j] += x * y
    while len(result) > 1 and not result[-1]:
        result.pop()
    return result


# What happens where the estimates fail.


@pytest.fixture(name="fallbacks")
def count_fallbacks(monkeypatch: pytest.MonkeyPatch) -> list[Plan]:
    """Plans that went on with equal shares and exact figures."""
    seen: list[Plan] = []
    original = quantize_module._equally_shared

    def counted(planned: Plan, ideal: Filter) -> Quantized:
        seen.append(planned)
        return original(planned, ideal)

    monkeypatch.setattr(quantize_module, "_equally_shared", counted)
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("realization", CASCADES)
def test_words_that_fit_need_no_second_way(realization: str, fallbacks: list[Plan]) -> None:
    prove(filter_plan("lowpass", 5, 0.02, realization).trimmed())
    assert fallbacks == []


@pytest.mark.slow
@pytest.mark.parametrize("realization", CASCADES)
def test_an_estimate_that_is_too_low_is_made_up_for(
    realization: str, fallbacks: list[Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the proof finds more error than was estimated, less is allowed at the next attempt."""
    true = Search.error
    monkeypatch.setattr(Search, "error", lambda search, choice: 0.8 * true(search, choice))
    trimmed = filter_plan("lowpass", 5, 0.02, realization).trimmed()
    search, choice = search_of(trimmed)
    assert true(search, choice) > float(trimmed.allowed)
    assert prove(trimmed).bound <= 1
    assert fallbacks == []


def too_short(choice: Choice) -> Choice:
    return replace(choice, formats=tuple(replace(w, fracs=dict.fromkeys(w.fracs, 0)) for w in choice.formats))


def unstable(choice: Choice) -> Choice:
    return replace(
        choice, formats=tuple(replace(w, coefficients=dict.fromkeys(w.coefficients, (8, 0))) for w in choice.formats)
    )


@pytest.mark.slow
@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize("spoilt", [too_short, unstable])
def test_a_search_that_finds_no_good_words_is_done_without(
    realization: str, spoilt: Callable[[Choice], Choice], fallbacks: list[Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Search, "trimmed", lambda _, start, allowed: spoilt(start))
    planned = filter_plan("lowpass", 5, 0.02, realization).trimmed()
    made = prove(planned)
    assert fallbacks == [planned]
    assert made.bound <= 1
    assert made.proof is not None
    exact = [{name: float(value) for name, value in s.items()} for s in ideal_coefficients(planned)]
    found = [section.coefficients for section in made.sections]
    assert any(
        found == [{name: round_significant(v, bits) for name, v in s.items()} for s in exact] for bits in range(1, 41)
    )


def test_without_a_start_there_is_no_area_but_still_a_proof(
    fallbacks: list[Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Search, "start", lambda *_: None)
    planned = filter_plan("lowpass", 3, 0.02, "df1_ef2")
    assert planned.size == float("inf")
    assert planned.trimmed() is planned
    assert prove(planned).bound <= 1
    assert fallbacks == [planned]
