"""Forms of expressions: equal ones are worth the same in every sample, and each way to write a value has one form."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction

import pytest

from sosmith.verify.c_model.forms import Form, Forms, number, scaled, total

SAMPLES = 12
Series = tuple[int, ...]
Valued = tuple[Form, Series]
"""A form, and what it is worth in each sample, the first one being that after reset."""


class Given:
    """Forms with what they are worth, computed beside them with Python's integers."""

    def __init__(self, seed: int) -> None:
        self.forms, self.rng = Forms(), random.Random(seed)
        self.pool: list[Valued] = []
        for name, low, high in (("a", -9, 9), ("b", 0, 200), ("c", -(2**20), 2**20)):
            series = tuple(self.rng.randint(low, high) for _ in range(SAMPLES))
            self.pool.append((self.forms.variable(name, low, high), series))

    def number(self, value: int) -> Valued:
        return number(value), (value,) * SAMPLES

    def sum(self, x: Valued, y: Valued, factor: int) -> Valued:
        return total((x[0], 1), (y[0], factor)), tuple(a + factor * b for a, b in zip(x[1], y[1], strict=True))

    def product(self, x: Valued, y: Valued) -> Valued:
        return self.forms.product(x[0], y[0]), tuple(a * b for a, b in zip(x[1], y[1], strict=True))

    def shifted(self, x: Valued, places: int) -> Valued:
        return self.forms.shifted(x[0], places), tuple(a >> places for a in x[1])

    def masked(self, x: Valued, bits: int) -> Valued:
        return self.forms.masked(x[0], bits), tuple(a & (1 << bits) - 1 for a in x[1])

    def quotient(self, x: Valued, divisor: int) -> Valued:
        return self.forms.quotient(x[0], divisor), tuple(int(Fraction(a, divisor)) for a in x[1])

    def choice(self, x: Valued, y: Valued) -> Valued:
        form = self.forms.choice("<", x[0], y[0], y[0], x[0])
        return form, tuple(max(a, b) for a, b in zip(x[1], y[1], strict=True))

    def past(self, x: Valued) -> Valued:
        return self.forms.past(x[0]), (0, *x[1][:-1])

    def drawn(self) -> Valued:
        """Return the result of an operation drawn at random, on what is there."""
        x, y, small = self.rng.choice(self.pool), self.rng.choice(self.pool), self.rng.randint(0, 9)
        ways: list[Callable[[], Valued]] = [
            lambda: self.sum(x, y, self.rng.choice([1, -1, 4, -3, 64])),
            lambda: self.sum(x, self.number(small - 4), 1),
            lambda: self.product(x, y),
            lambda: self.shifted(x, small),
            lambda: self.masked(x, small),
            lambda: self.quotient(x, small + 1),
            lambda: self.choice(x, y),
            lambda: self.past(x),
        ]
        return self.rng.choice(ways)()


@pytest.mark.parametrize("seed", range(8))
def test_what_has_one_form_is_worth_the_same(seed: int) -> None:
    given = Given(seed)
    series: dict[Form, Series] = {}
    alike = 0
    for _ in range(1500):
        form, worth = given.drawn()
        low, high = given.forms.range_of(form)
        assert low <= min(worth)
        assert max(worth) <= high
        if max(map(abs, (low, high))) < 2**60:
            given.pool.append((form, worth))
        alike += form in series
        assert series.setdefault(form, worth) == worth
    assert alike > 50


@pytest.mark.parametrize("places", [1, 3, 8])
def test_other_ways_to_write_a_value_have_its_form(places: int) -> None:
    forms = Forms()
    x, y = forms.variable("x", -1000, 1000), forms.variable("y", -50, 50)
    floor = forms.shifted(x, places)
    power = 1 << places
    assert total((floor, power), (forms.masked(x, places), 1)) == x
    assert forms.shifted(total((x, 1), (y, -power)), places) == total((floor, 1), (y, -1))
    assert forms.shifted(scaled(x, 1 << 20), places + 20) == floor
    assert forms.shifted(forms.past(x), places) == forms.past(floor)
    assert forms.product(scaled(x, 4), y) == forms.product(y, scaled(x, 4)) == scaled(forms.product(y, x), 4)
    assert forms.product(scaled(x, 4), scaled(y, 6)) == scaled(forms.product(scaled(x, 1), scaled(y, 3)), 8)
    assert forms.shifted(x, 40) == forms.shifted(x, 50) != forms.shifted(y, 40)
    assert forms.shifted(total((x, 1), (number(power >> 1), 1)), places) != floor


def test_the_past_of_what_is_not_zero_at_the_start_is_that_of_no_sum() -> None:
    forms = Forms()
    x = forms.variable("x", -1000, 1000)
    more = total((x, 1), (number(7), 1))
    assert forms.past(more) != total((forms.past(x), 1), (number(7), 1))
    assert forms.past(number(1)) != number(1)
    assert forms.shifted(forms.past(more), 3) == forms.past(forms.shifted(more, 3))
    assert forms.shifted(forms.past(forms.past(more)), 3) == forms.past(forms.past(forms.shifted(more, 3)))
    assert forms.past(scaled(x, 5)) == scaled(forms.past(x), 5)
