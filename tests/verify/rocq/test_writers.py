"""What is written for Rocq, without Rocq: responses, limits and plans that its theories follow."""

import random
from fractions import Fraction

import numpy as np
import pytest
from flint import fmpz_poly
from tests.verify.rocq.small import BAND_STOP, BOTH, SETTLING, calibrated, coarse, designed, small

from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.verify.certificate_file import Certificate, NodeEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.bound import bound_claims
from sosmith.verify.rocq.calibration import calibration_of
from sosmith.verify.rocq.cascade import Cascade, Rows, cascade_of
from sosmith.verify.rocq.check import theorems
from sosmith.verify.rocq.exact import exact_row, sections_of
from sosmith.verify.rocq.flat import flattened
from sosmith.verify.rocq.ranges import Windows, decided, negative, windows_of
from sosmith.verify.rocq.responses import begun, divide, impulse, split
from sosmith.verify.rocq.start import start_of


def left(bits: int, tail: list[int], values: list[int], over: list[int]) -> int:
    """Sum of the magnitudes of ``values * [2**bits, *tail] - over``."""
    difference = fmpz_poly(values) * fmpz_poly([1 << bits, *tail]) - fmpz_poly(over)
    return sum(abs(int(value)) for value in difference.coeffs())


@pytest.mark.parametrize("seed", range(5))
def test_a_response_leaves_no_more_than_it_says(seed: int) -> None:
    rng = random.Random(seed)
    bits, tail = 12, [rng.randint(-2000, 2000), rng.randint(-2000, 2000)]
    over = [rng.randint(-(1 << 40), 1 << 40) for _ in range(50)]
    for made, of in ((impulse(bits, tail, 1 << 30), [1 << 30 + bits]), (divide(bits, tail, over), over)):
        assert left(bits, tail, made.values, of) <= made.rest <= len(made.values) << bits + 2


def test_a_response_that_does_not_die_away_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sosmith.verify.rocq.responses._SAMPLES", 1000)
    with pytest.raises(RejectedError, match=r"^a response must die away within 1000 samples$"):
        impulse(4, [-16], 1 << 20)


def test_a_response_that_grows_is_refused_before_it_is_long() -> None:
    with pytest.raises(
        RejectedError, match=r"^a response must not become larger than 2\*\*256 times what it responds to$"
    ):
        impulse(4, [-32], 1 << 20)


def test_a_denominator_that_begins_with_another_number_is_refused() -> None:
    with pytest.raises(RejectedError, match=r"^a denominator must begin with a power of two, not 3$"):
        split([3, 1])


def last_rows(made: Certificate) -> tuple[Cascade, int]:
    """Return the cascade of a certificate and the node that its last stage takes."""
    graph = flattened(made)
    return cascade_of(graph), graph.feeds[-1][0]


def test_a_response_without_end_begins_as_one_with_an_end() -> None:
    bits, tail = 12, [-6000, 2300]
    made, whole = begun(bits, tail, 1 << 30), impulse(bits, tail, 1 << 30)
    assert whole.values[: len(made.values)] == made.values
    assert left(bits, tail, made.values, [1 << 30 + bits]) <= made.rest


@pytest.mark.parametrize("steady", [False, True])
def test_an_input_of_few_bits_before_an_output_of_many_has_all_theorems(steady: bool) -> None:
    made = coarse(steady=steady)
    assert made.stages[0].nodes[0].frac < 0
    assert theorems(made).unchecked == ()


@pytest.mark.sweep(3)
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_plans_prove_the_range_of_every_target(realization: str) -> None:
    made = small(realization, steady=True)
    cascade, _ = last_rows(made)
    windows = windows_of(cascade, start_of(cascade.graph))
    for index, section in enumerate(cascade.sections):
        for target in section.targets:
            node = cascade.graph.node(target)
            see_proven(windows, cascade.rows(index, target, max(abs(node.low), abs(node.high)).bit_length() + 24), node)


def see_proven(windows: Windows, rows: Rows, node: NodeEntry) -> None:
    assert windows.most(rows.row) + rows.rest <= rows.whole * node.high
    assert windows.most(negative(rows.row)) + rows.rest <= -rows.whole * node.low


@pytest.mark.slow
def test_plans_are_precise_enough_behind_a_section_with_a_larger_denominator() -> None:
    made = designed(BAND_STOP)
    cascade, _ = last_rows(made)
    windows = windows_of(cascade, None)
    assert cascade.bits_lost(2) > 40  # without which no plan proves the range of some of the targets below
    for target in cascade.sections[2].targets:
        see_proven(windows, decided(windows, 2, target), cascade.graph.node(target))


def test_the_windows_are_those_of_a_difference() -> None:
    cascade, _ = last_rows(small(steady=True))
    windows = windows_of(cascade, start_of(cascade.graph))
    entry = windows.entry
    assert entry is not None
    assert windows.span == (1 << 16) - 1
    assert windows.most({entry: fmpz_poly([3, -2])}) == 3 * windows.span  # with the first window; 2 with the other


def test_the_exact_filter_in_near_sections_is_the_exact_one() -> None:
    sections = sections_of(small().ideal.sections)
    whole, bits = 1 << 200, 100
    made = exact_row(sections, 1 << 15, whole, bits)
    response, recent = [1.0] + [0.0] * 40, [1.0] + [0.0] * 40
    for over, under in sections:
        response = []
        for n in range(41):
            value = sum(b * recent[n - k] for k, b in enumerate(over) if k <= n)
            value -= sum(a * response[n - k] for k, a in enumerate(under) if 0 < k <= n)
            response.append(value / under[0])
        recent = response
    found = [int(value) / whole for value in made.row.coeffs()[:41]]
    assert np.abs(np.array(found) - np.array(response)).max() < 1e-14
    assert 0 < made.rest < whole >> 40


def test_the_error_of_a_calibration_holds_for_random_codes() -> None:
    made = calibrated()
    graph = flattened(made)
    start = start_of(graph)
    assert start is not None
    found = calibration_of(made, graph, start.sample)
    assert found.error < Fraction(1, 2)
    assert made.claims.budget["calibration"] >= found.error
    assert found.most < 1 << 16


def test_the_theorem_says_what_the_certificate_claims() -> None:
    made = calibrated()
    cascade, _ = last_rows(made)
    claims = {claim.name: claim.text for claim in bound_claims(made, made, cascade, start_of(cascade.graph), None)}
    bound = made.claims.bound
    assert f"<= IZR {bound.numerator} / IZR {bound.denominator})%R." in claims["error_is_bounded"]
    assert "(from_first (fun n => calibrated (x n)))" in claims["error_is_bounded"]
    assert "(y (Z.of_nat n) - IZR (-1024) / IZR 1)" in claims["error_is_bounded"]
    assert "(from_zero (fun n => calibrated (x n)))" in "".join(
        claim.text for claim in bound_claims(small(), small(), last_rows(small())[0], None, None)
    )


def test_the_theorem_says_what_a_decimator_takes() -> None:
    made = designed(BOTH)
    entry = made.decimation
    assert entry is not None
    claims = {claim.name: claim.text for claim in theorems(made).claims}
    assert "(from_first (averaged_input x))" in claims["error_is_bounded"]
    assert "code core (decimated x)" in claims["error_is_bounded"]
    assert f"Decimator {entry.factor} {entry.stages} {entry.width} {entry.dropped} false." in claims["decimated_within"]


def test_the_theorem_says_from_which_sample_on_it_has_settled() -> None:
    made = designed(SETTLING)
    claims = {claim.name: claim.text for claim in theorems(made).claims}
    assert f"forall n, {made.claims.settling} <= Z.of_nat n ->" in claims["settled"]
    assert "(from_zero (fun n => calibrated (z (m + n)%nat)))" in claims["settled"]
    assert f"(if Z.of_nat n <? {made.claims.settling} then -1 else 0)" in claims["flagged"]
