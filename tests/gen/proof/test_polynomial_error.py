"""The bound on a calibration's error: against every input code, and against rounding each coefficient alone."""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, product
from typing import Any

import numpy as np
import pytest
from tests.gen.designs import example_design

from sosmith.gen.output.certificate import certificate
from sosmith.gen.proof.polynomial_error import horner_error, rounded
from sosmith.gen.word_lengths.input_stage import normalised
from sosmith.model.sections.horner import HornerPolynomial, Variable
from sosmith.verify.bounds.polynomial import polynomial_error
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.verification import verify

SHARE = Fraction(45, 100)
"""Share of the bound that some code reaches at least: of short words few are tried, and roundings do not meet."""
BENCH = "flange_wear_bench.toml"
Rows = tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True)
class Case:
    """A polynomial with short words, so that all codes can be tried."""

    rows: Rows
    variables: tuple[Variable, ...]
    frac: int
    finer: int = 0

    @property
    def horner(self) -> HornerPolynomial:
        integers = rounded(self.rows, self.frac, self.variables)
        return HornerPolynomial(coefficients=integers, frac=self.frac, variables=self.variables, finer=self.finer)

    def worst(self) -> Fraction:
        """Return the largest error of the integer model over all codes, exact."""
        last = self.horner.stages[-1].graph.output_ranges[0].frac
        codes = product(*(range(v.low, v.high + 1) for v in self.variables))
        return max(abs(self.computed([*code]) * Fraction(2) ** -last - self.exact(code)) for code in codes)

    def computed(self, wires: list[int]) -> int:
        """Return the code of the polynomial, stage by stage."""
        for stage in self.horner.stages:
            wires = stage.graph.step(wires, [])
        (result,) = wires
        return result

    def exact(self, code: tuple[int, ...]) -> Fraction:
        u, t = ([Fraction(c, 1 << v.bits) for c, v in zip(code, self.variables, strict=True)] + [Fraction(0)])[:2]
        return sum((a * u**i * t**j for i, row in enumerate(self.rows) for j, a in enumerate(row)), Fraction(0))


def rows_of(seed: int, lengths: tuple[int, ...]) -> Rows:
    rng = np.random.default_rng(seed)
    return tuple(tuple(Fraction(int(rng.integers(-999, 1000)), 97) for _ in range(n)) for n in lengths)


def variables_of(bits: tuple[int, ...], *, signed: bool) -> tuple[Variable, ...]:
    return tuple(Variable(name=f"x{k}", bits=width, signed=signed) for k, width in enumerate(bits))


CASES = [
    Case(rows_of(seed, lengths), variables_of(bits, signed=signed), frac, finer)
    for seed, (lengths, bits, signed, frac, finer) in enumerate(
        [
            ((2, 2, 1), (6, 6), False, 3, 0),
            ((2, 2, 1), (6, 6), False, 3, 2),
            ((3, 3), (5, 6), True, 2, 0),
            ((3, 3), (5, 6), True, 2, 2),
            ((1, 1, 1, 1), (8,), False, 5, 0),
            ((1, 1), (10,), True, 4, 0),
            ((3,), (4, 8), False, 0, 0),
            ((1, 2, 3), (4, 5), False, 3, 1),
        ]
    )
]


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=range(len(CASES)))
def test_no_code_exceeds_the_bound_and_one_comes_near_it(case: Case) -> None:
    bound, worst = horner_error(case.rows, case.horner), case.worst()
    assert SHARE * bound < worst <= bound


@pytest.mark.parametrize("case", CASES, ids=range(len(CASES)))
def test_coefficients_are_chosen_for_all_of_the_error(case: Case) -> None:
    alone = tuple(tuple(round(a * 2**case.frac) for a in row) for row in case.rows)
    plain = HornerPolynomial(coefficients=alone, frac=case.frac, variables=case.variables, finer=case.finer)
    assert horner_error(case.rows, case.horner) <= horner_error(case.rows, plain)


@pytest.mark.parametrize("case", CASES, ids=range(len(CASES)))
def test_no_neighbour_of_the_coefficients_is_better(case: Case) -> None:
    """Nor any two together; looked at with so many bits between the stages that only coefficients are rounded."""
    chosen = case.horner.coefficients

    def bound(*steps: tuple[int, int, int]) -> Fraction:
        rows = [list(row) for row in chosen]
        for i, j, by in steps:
            rows[i][j] += by
        horner = HornerPolynomial(
            coefficients=tuple(map(tuple, rows)), frac=case.frac, variables=case.variables, finer=32
        )
        return horner_error(case.rows, horner)

    moves = [(i, j, by) for i, row in enumerate(chosen) for j in range(len(row)) for by in (-1, 1)]
    least = min(bound(*steps) for steps in (*((move,) for move in moves), *combinations(moves, 2)))
    assert least >= bound() * (1 - Fraction(1, 1 << 20))


def test_a_variable_from_zero_counts_half() -> None:
    """What is left of the product is as much below as above the wanted value, in the middle of the box."""
    (u,) = variables_of((16,), signed=False)
    rows = ((Fraction(0),), (Fraction(1, 4),))
    horner = HornerPolynomial(coefficients=((0,), (0,)), frac=0, variables=(u,))
    rounding = Fraction(1, 2)
    assert horner_error(rows, horner) == pytest.approx(float(rounding + Fraction(1, 4)), abs=1e-4)
    assert rounded(rows, 0, (u,)) == ((0,), (0,))
    steeper = ((Fraction(0),), (Fraction(3, 4),))
    assert rounded(steeper, 0, (u,)) == ((0,), (1,))


def test_rows_that_are_only_added_keep_more_bits() -> None:
    (plain, finer) = CASES[0], CASES[1]
    assert [s.graph.output_ranges[-1].frac for s in plain.horner.stages] == [3, 3, 3]
    widths = [[r.frac for r in s.graph.output_ranges] for s in finer.horner.stages]
    assert widths[0][-2:] == [5, 5]
    assert widths[-1] == [3]
    same = HornerPolynomial(coefficients=plain.horner.coefficients, frac=3, variables=plain.variables, finer=2)
    assert horner_error(plain.rows, same) < horner_error(plain.rows, plain.horner)


def test_the_verifier_finds_the_same_bound_and_no_smaller_one_is_taken() -> None:
    made = example_design(BENCH)
    text = certificate_text(certificate(made.quantized, made.spec.max_error))
    read = Certificate.model_validate(json.loads(text))
    fore = [stage for stage in read.stages if stage.role == "polynomial"]
    bound = polynomial_error(read, fore)
    assert bound == made.quantized.input_error
    ports, polynomial = made.datapath.inputs, made.quantized.polynomial
    assert polynomial is not None
    exact = normalised(polynomial, ports, made.datapath.output)
    uncentred = sum(abs(a - round(a * 16) / Fraction(16)) for row in exact for a in row) + 4 * Fraction(1, 32)
    assert bound < uncentred
    off = verify(read).budget["calibration"] - made.quantized.budget["calibration"]
    assert abs(off) < Fraction(1, 1 << 32)


def one_unit_less(tree: Any, part: str) -> None:
    budget = tree["claims"]["budget"]
    less = Fraction(budget[part]) - Fraction(1, 1 << 64)
    budget[part] = str(less)
    tree["claims"]["bound"] = str(sum(map(Fraction, budget.values())))


@pytest.mark.parametrize("part", ["calibration", "filter coefficients", "filter rounding", "output rounding"])
def test_a_budget_one_unit_smaller_is_rejected(part: str) -> None:
    made = example_design(BENCH)
    tree = json.loads(certificate_text(certificate(made.quantized, made.spec.max_error)))
    verify(Certificate.model_validate(tree))
    one_unit_less(tree, part)
    with pytest.raises(RejectedError, match=rf"^the part {part} of the budget must be "):
        verify(Certificate.model_validate(tree))
