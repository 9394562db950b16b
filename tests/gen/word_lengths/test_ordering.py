"""Order and pairing of sections: the dynamic programme against exhaustive search by another route, and the theory."""

import math
import re
from collections.abc import Iterable
from functools import cache
from itertools import permutations

import numpy as np
import pytest
from scipy import signal
from tests.gen.designs import with_rows
from tests.gen.word_lengths.filters import butterworth as butterworth_filter
from tests.gen.word_lengths.filters import plain

from sosmith.gen.filter.design import decay_length
from sosmith.gen.proof.linear_model import linear_model
from sosmith.gen.realizations.registry import REALIZATIONS, Row
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.word_lengths.ordering import NoisySection, Norm, arrange, best_order

NORMS: tuple[Norm, ...] = ("l1", "l2", "linf")


def butterworth(order: int, u: float) -> list[Row]:
    """Low-pass sections of unity gain at u = tan(pi fc / fs), highest Q first (THEORY section 0)."""
    rows: list[Row] = []
    for k in range(order // 2):
        c = 2 * math.sin(math.pi * (2 * k + 1) / (2 * order))
        a0 = 1 + c * u + u * u
        g = u * u / a0
        rows.append((g, 2 * g, g, 1.0, 2 * (u * u - 1) / a0, (1 - c * u + u * u) / a0))
    if order % 2:
        rows.append((u / (1 + u), u / (1 + u), 0.0, 1.0, (u - 1) / (1 + u), 0.0))
    return rows


def elliptic(order: int, cutoff: float) -> list[Row]:
    z, p, k = signal.ellip(order, 0.5, 60, cutoff, fs=1.0, output="zpk")
    rows = []
    for row in signal.zpk2sos(z, p, k):
        gain = row[:3].sum() / row[3:].sum()
        rows.append(tuple(map(float, [*row[:3] / gain, *row[3:]])))
    return rows


def noisy(rows: Iterable[Row], *, feedback: int) -> list[NoisySection]:
    """Sections in direct form I with one quantizer and error feedback of order 0 or 2 (1 for a single pole)."""
    result = []
    for b0, b1, b2, _, a1, a2 in rows:
        single = a2 == 0 and b2 == 0
        shaped = ((1.0, -1.0) if single else (1.0, -2.0, 1.0)) if feedback else (1.0,)
        numerator, denominator = ((b0, b1), (1.0, a1)) if single else ((b0, b1, b2), (1.0, a1, a2))
        result.append(NoisySection(numerator=numerator, denominator=denominator, noise=(shaped,)))
    return result


def exhaustive(
    sections: list[NoisySection], scale: Norm, noise: Norm, *, pairing: bool
) -> dict[tuple[tuple[int, int], ...], float]:
    """Cost of every arrangement, from impulse responses in the time domain."""
    count = len(sections)
    rows = [[1, 0, 0, *s.denominator, *[0] * (3 - len(s.denominator))] for s in sections]
    impulse = np.zeros(decay_length(np.array(rows)))
    impulse[0] = 1

    def through(poles: Iterable[int], zeros: Iterable[int], extra: tuple[float, ...] = (1.0,)) -> np.ndarray:
        h = signal.lfilter(extra, [1.0], impulse)
        for k in poles:
            h = signal.lfilter([1.0], sections[k].denominator, h)
        for k in zeros:
            h = signal.lfilter(sections[k].numerator, [1.0], h)
        return np.asarray(h)

    def norm(h: np.ndarray, kind: Norm) -> float:
        if kind == "l1":
            return float(np.abs(h).sum())
        if kind == "l2":
            return float(np.linalg.norm(h))
        return float(np.abs(np.fft.rfft(h, 1 << (8 * len(h) - 1).bit_length())).max())

    @cache
    def to(poles: frozenset[int], zeros: frozenset[int]) -> float:
        return norm(through(sorted(poles), sorted(zeros)), scale)

    @cache
    def from_(last: int, poles: frozenset[int], zeros: frozenset[int]) -> list[float]:
        return [norm(through([last, *sorted(poles)], sorted(zeros), taps), noise) for taps in sections[last].noise]

    everything = frozenset(range(count))
    costs = {}
    for poles in permutations(range(count)):
        for zeros in permutations(range(count)) if pairing else (poles,):
            pairs = list(zip(poles, zeros, strict=True))
            if any(len(sections[z].numerator) > len(sections[p].denominator) for p, z in pairs):
                continue
            total = 0.0
            for k in range(count):
                before = frozenset(poles[: k + 1]), frozenset(zeros[: k + 1])
                errors = from_(poles[k], everything - before[0], everything - before[1])
                total += sum((to(*before) * error) ** (2 if noise == "l2" else 1) for error in errors)
            costs[tuple(pairs)] = total
    return costs


def check(sections: list[NoisySection], scale: Norm, noise: Norm, *, pairing: bool) -> None:
    costs = exhaustive(sections, scale, noise, pairing=pairing)
    best = arrange(sections, scale=scale, noise=noise, pairing=pairing)
    worst = arrange(sections, scale=scale, noise=noise, pairing=pairing, worst=True)
    assert best.cost == pytest.approx(min(costs.values()), rel=1e-9)
    assert worst.cost == pytest.approx(max(costs.values()), rel=1e-9)
    assert costs[best.order] == pytest.approx(best.cost, rel=1e-9)
    assert costs[worst.order] == pytest.approx(worst.cost, rel=1e-9)


@pytest.mark.sweep(12)
@pytest.mark.parametrize("scale", NORMS)
@pytest.mark.parametrize("feedback", [0, 2])
@pytest.mark.parametrize("order", range(1, 9))
def test_order_of_butterworth_sections_equals_exhaustive_search(order: int, feedback: int, scale: Norm) -> None:
    for u in (0.0811, 0.5):
        check(noisy(butterworth(order, u), feedback=feedback), scale, "l2", pairing=False)


@pytest.mark.sweep(12)
@pytest.mark.parametrize("scale", NORMS)
@pytest.mark.parametrize("feedback", [0, 2])
@pytest.mark.parametrize("order", range(3, 9))
def test_pairing_and_order_of_elliptic_sections_equals_exhaustive_search(
    order: int, feedback: int, scale: Norm
) -> None:
    check(noisy(elliptic(order, 0.11), feedback=feedback), scale, "l2", pairing=True)


def test_the_proofs_norm_too() -> None:
    check(noisy(elliptic(7, 0.05), feedback=2), "l1", "l1", pairing=True)


F5, F7 = butterworth(5, 3.727 / 12), butterworth(7, 0.00813)
PUBLISHED = [
    (F7, "linf", 0, (2, 3, 0, 1), 55.84, 2.34),
    (F7, "l1", 0, (1, 2, 0, 3), 58.74, 1.83),
    (F7, "l2", 0, (2, 0, 1, 3), 32.67, 1.03),
    (F7, "linf", 2, (0, 1, 2, 3), 0.10, 0.06),
    (F7, "l1", 2, (0, 1, 2, 3), 3.94, 0.05),
    (F7, "l2", 2, (0, 1, 2, 3), -22.74, 0.06),
    (F5, "linf", 0, (2, 0, 1), 9.94, 0.87),
    (F5, "linf", 2, (0, 1, 2), 2.70, 1.06),
    (F5, "l1", 0, (1, 0, 2), 12.41, 0.83),
    (F5, "l1", 2, (0, 1, 2), 5.69, 1.00),
    (F5, "l2", 0, (2, 0, 1), 2.72, 0.46),
    (F5, "l2", 2, (0, 1, 2), -4.59, 1.19),
]
"""THEORY section 4: sections with the highest Q first, best order, noise in dB, dB from best to worst."""


@pytest.mark.parametrize(("rows", "scale", "feedback", "order", "noise", "spread"), PUBLISHED)
def test_table_of_section_4(
    rows: list[Row], scale: Norm, feedback: int, order: tuple[int, ...], noise: float, spread: float
) -> None:
    sections = noisy(rows, feedback=feedback)
    best, worst = (arrange(sections, scale=scale, worst=bad) for bad in (False, True))
    assert tuple(pole for pole, _ in best.order) == order
    assert round(best.decibels, 2) == noise
    assert round(worst.decibels - best.decibels, 2) == spread


def test_numerators_beyond_their_denominator_stay_where_they_are() -> None:
    """What scipy.signal.zpk2sos makes of an odd order: one pole and two zeros, two poles and one zero."""
    single = NoisySection(numerator=(1.0, 2.0, 1.0), denominator=(1.0, -0.5), noise=((1.0,),))
    double = NoisySection(numerator=(1.0, 1.0), denominator=(1.0, -1.2, 0.5), noise=((1.0,),))
    assert sorted(arrange([single, double], scale="l2", pairing=True).order) == [(0, 0), (1, 1)]


def test_too_many_sections_are_refused() -> None:
    message = "sections must be so few that their spectra have at most 268435456 samples, not 12"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        arrange(noisy(butterworth(24, 0.01), feedback=0), scale="l1")


def models_of(rows: Iterable[Row], realization: str = "df1") -> list:
    words = SectionFormat(coefficient_bits=24)
    return [linear_model(REALIZATIONS[realization].build(row, words, f"s{k}").graph) for k, row in enumerate(rows)]


def test_a_bad_order_is_changed_and_a_good_one_kept() -> None:
    """Sharpest section first costs a Chebyshev filter of order 8 more than a bit without error feedback."""
    rows = sorted(map(tuple, signal.cheby1(8, 0.5, 0.05, fs=1.0, output="sos").tolist()), key=lambda row: -row[5])
    rows = [(*(b / sum(row[:3]) * sum(row[3:]) for b in row[:3]), *row[3:]) for row in rows]
    order = best_order(models_of(rows))
    assert order != (0, 1, 2, 3)
    improved = [rows[k] for k in order]
    assert best_order(models_of(improved)) == (0, 1, 2, 3)
    costs = exhaustive(noisy(rows, feedback=0), "l1", "l1", pairing=False)
    present, chosen = (costs[tuple((k, k) for k in way)] for way in [(0, 1, 2, 3), order])
    assert chosen < present * 2 / 3
    assert chosen == pytest.approx(min(costs.values()), rel=1e-3)


@pytest.mark.slow
def test_the_word_lengths_are_chosen_in_the_better_order() -> None:
    rows = sorted(map(tuple, signal.cheby1(8, 0.5, 0.05, fs=1.0, output="sos").tolist()), key=lambda row: -row[5])
    ideal = with_rows(butterworth_filter(2, 0.1), rows)
    made = plain(ideal, "df1")
    assert made.filter is not None
    order = best_order(models_of(rows))
    assert made.filter.rows == tuple(rows[k] for k in order) != ideal.rows
    poles = [sum(row[4:]) for row in made.filter.rows]
    assert made.quantized_sos[:, 4:].sum(axis=1) == pytest.approx(poles, abs=1e-4)
    assert made.bound <= 1


def test_a_small_gain_is_no_reason() -> None:
    assert best_order(models_of(F7[::-1])) == (0, 1, 2, 3)
    assert best_order(models_of(F7[:1])) == (0,)


def test_no_order_is_looked_for_where_that_would_take_long() -> None:
    rows = butterworth(20, 0.0001)
    assert best_order(models_of(rows)) == tuple(range(10))
