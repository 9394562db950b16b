"""Forms as numbers: whatever the variables are, a form has the value of what it was made of."""

import random
from fractions import Fraction
from math import floor, prod

from sosmith.verify.program.normal_form import Form, Forms, constant, plus, scaled, times

LIMITS = {"x": (-8, 7), "y": (0, 15), "z": (-1, 0)}


class Numbered(Forms):
    """Forms whose atoms can be given values."""

    def value(self, form: Form, values: dict[int, int]) -> Fraction:
        total = Fraction(0)
        for monomial, coefficient in form.items():
            total += coefficient * prod(self.atom(number, values) for number in monomial)
        return total

    def atom(self, number: int, values: dict[int, int]) -> int:
        within = self._within.get(number)
        return values[number] if within is None else floor(self.value(within, values))


def test_a_floor_is_the_largest_integer_that_is_not_above() -> None:
    """Of random sums of floors of each other and products of three variables."""
    rng, forms = random.Random(1), Numbered()
    variables = [forms.variable(name, *limits) for name, limits in LIMITS.items()]
    numbers = [number for variable in variables for ((number,),) in [variable]]
    floors = [*variables]
    for _ in range(30):
        a, (b, c) = rng.choice(floors), rng.choices(variables, k=2)
        form = plus(plus(scaled(a, -rng.randrange(4)), times(b, c), Fraction(rng.randrange(-9, 10), 8)), constant(1))
        floors.append(forms.floor(form))
        for _ in range(10):
            values = {k: rng.randint(*limits) for k, limits in zip(numbers, LIMITS.values(), strict=True)}
            exact = forms.value(form, values)
            assert forms.value(floors[-1], values) == floor(exact)
            low, high = forms.extent(form)
            assert low <= exact <= high


def test_floors_of_floors_are_one_floor() -> None:
    forms = Forms()
    x = forms.variable("x", -128, 127)
    twice = forms.floor(scaled(forms.floor(scaled(x, -2)), -3))
    assert twice == forms.floor(scaled(x, -5))
    assert forms.floor(scaled(x, -7)) != twice
    assert forms.floor(scaled(x, -8)) == forms.floor(scaled(x, -8))
    y = forms.variable("y", 0, 127)
    assert forms.floor(scaled(y, -7)) == {}
    assert forms.floor(plus(scaled(y, -7), constant(3))) == constant(3)
    assert forms.floor(x) == x
