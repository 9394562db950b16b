"""The equations of a section compute what its graph computes, in every realization; the diagram shows all of them."""

from __future__ import annotations

import math
import random
import re
from fractions import Fraction

import pytest
from tests.gen.designs import example_design
from tests.gen.report.evidences import Page, evidence, page_of

from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.report.figures.diagram import diagram
from sosmith.gen.report.recursion import Coefficient, Equation, Recursion, Term, recursion_of
from sosmith.model.dataflow.graph import Graph

SMALL = str.maketrans("₋₀₁₂₃₄₅₆₇₈₉", "-0123456789")
ROUNDED = re.compile(r"(?:⌊(?P<floor>.*)⌋|trunc\((?P<trunc>.*)\)|frac\((?P<frac>.*)\))(?P<bits>[₋₀-₉]+)")


class Evaluated:
    """Carries out equations, sample by sample, in rationals."""

    def __init__(self, recursion: Recursion) -> None:
        self.recursion = recursion
        self.coefficients = {each.name: Fraction(each.integer, 2**each.frac) for each in recursion.coefficients}
        self.past: list[dict[str, Fraction]] = []

    def step(self, inputs: dict[str, Fraction]) -> dict[str, Fraction]:
        """Compute all signals of a sample."""
        now = dict(inputs)
        for equation in self.recursion.equations:
            total = sum((self.term(term, now) for term in equation.terms), Fraction(0))
            now[equation.name] = rounded(equation.rounding.format(""), total) if equation.rounding else total
        self.past.insert(0, now)
        return now

    def term(self, term: Term, now: dict[str, Fraction]) -> Fraction:
        factor = self.coefficients[term.coefficient] if term.coefficient else 1
        return term.gain * factor * (self.signal(term.signal, now) if term.signal else 1)

    def signal(self, words: str, now: dict[str, Fraction]) -> Fraction:
        whole = ROUNDED.fullmatch(words)
        if whole:
            inner = next(found for found in (whole["floor"], whole["trunc"], whole["frac"]) if found is not None)
            return rounded(words.replace(inner, ""), self.signal(inner, now))
        name, _, delay = words.partition("(n−")
        if not delay:
            return now[name]
        samples = int(delay.rstrip(")"))
        return self.past[samples - 1][name] if samples <= len(self.past) else Fraction(0)


def rounded(kind: str, value: Fraction) -> Fraction:
    """Round as ``⌊⌋₄``, ``trunc()₄`` or ``frac()₄`` says."""
    bits = int(re.sub(r"[^₋₀-₉]", "", kind).translate(SMALL))
    scaled = value * Fraction(2) ** bits
    if kind.startswith("trunc"):
        return Fraction(math.trunc(scaled)) / Fraction(2) ** bits
    floor = Fraction(math.floor(scaled)) / Fraction(2) ** bits
    return value - floor if kind.startswith("frac") else floor


def agrees(name: str, graph: Graph) -> bool:
    """Tell whether equations and graph agree on all outputs, for random inputs.

    They stay in a part of the range: a section alone may see sequences that no section before it would give.
    """
    recursion, state = recursion_of(name, graph), graph.reset()
    evaluated, generator = Evaluated(recursion), random.Random(5)
    for _ in range(40):
        codes = [generator.randint(low // 16, high // 16) for _, low, high in graph.input_ranges]
        nodes = [graph.nodes[i] for i in graph.inputs]
        values = {node.name: code * Fraction(2) ** -node.frac for node, code in zip(nodes, codes, strict=True)}
        got = evaluated.step(values)
        expected = graph.step(codes, state)
        for index, code in zip(graph.outputs, expected, strict=True):
            if got[graph.nodes[index].name] != code * Fraction(2) ** -graph.nodes[index].frac:
                return False
    return True


@pytest.mark.sweep(4)
@pytest.mark.parametrize("realization", list(SECTIONS))
def test_equations_compute_what_the_graph_computes(realization: str) -> None:
    made = example_design("flange_wear_bench.toml", core="filter", realization=realization).quantized
    assert made.sections
    for section in made.sections:
        assert agrees(section.name, section.graph)


SMALLEST = Recursion(
    "section0",
    (
        Equation(
            "v", (Term(Fraction(2), "", "v(n−1)"), Term(Fraction(-1, 4), "A1", "⌊x⌋₃"), Term(Fraction(3, 8), "", ""))
        ),
        Equation("y", (Term(Fraction(-1), "", "v"),), "⌊{}⌋₄"),
    ),
    (Coefficient("A1", -33825, 21),),
)


def test_words() -> None:
    assert [each.words for each in SMALLEST.equations] == ["v = 2 · v(n−1) − 1/4 · A1 · ⌊x⌋₃ + 3/8", "y = ⌊−v⌋₄"]
    assert SMALLEST.coefficients[0].words == "−33,825 · 2⁻²¹ = −0.01612901688"


def test_the_diagram_has_every_name_gain_and_coefficient() -> None:
    words = Page(diagram(SMALLEST)).words
    for word in ("v", "z⁻¹", "2", "1/4·A1", "−0.01613", "⌊x⌋₃", "3/8", "y", "⌊ ⌋₄", "−"):
        assert word in words
    assert diagram(SMALLEST) == diagram(SMALLEST)


@pytest.mark.slow
def test_the_page_shows_it() -> None:
    page = Page(page_of(evidence(recursions=(SMALLEST,))))
    assert "section0 as realized, df1_ef2" in page.words
    assert any("v = 2 · v(n−1) − 1/4 · A1 · ⌊x⌋₃ + 3/8" in words for words in page.words)
