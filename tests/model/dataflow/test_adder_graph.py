"""Multiplication by constants with shifts and additions."""

from functools import cache
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sosmith.model.dataflow.adder_graph import (
    Adder,
    _one_by_one,
    adder_bits,
    adder_graph,
    by_operand,
    multiple_range,
    odd_part,
    signed_digits,
)
from sosmith.model.dataflow.graph import GraphBuilder

CONSTANTS = st.integers(-(1 << 18), 1 << 18).filter(bool)


def multiples(adders: tuple[Adder, ...], operand: int) -> list[int]:
    """Return the operand and all sums."""
    values = [operand]
    for adder in adders:
        left, right = (values[k] << shift for k, shift in (adder.left, adder.right))
        values.append(left - right if adder.subtract else left + right)
    return values


def levels(adders: tuple[Adder, ...]) -> dict[int, int]:
    """Return how many sums follow each other up to each multiple."""
    found = [0]
    for adder in adders:
        found.append(1 + max(found[adder.left[0]], found[adder.right[0]]))
    return dict(zip((1, *(adder.multiple for adder in adders)), found, strict=True))


@pytest.mark.slow
@given(st.lists(CONSTANTS, min_size=1, max_size=2), st.integers(-1000, 1000))
def test_every_constant_is_a_shifted_sum(constants: list[int], operand: int) -> None:
    adders = adder_graph(tuple(constants))
    assert multiples(adders, operand) == [operand, *(adder.multiple * operand for adder in adders)]
    made = levels(adders)
    for constant in constants:
        odd, shift = odd_part(constant)
        assert odd << shift == constant
        assert made[odd] <= (len(signed_digits(odd)) - 1).bit_length() + 1


@given(st.integers(-(1 << 40), 1 << 40))
def test_signed_digits_are_canonical(value: int) -> None:
    digits = signed_digits(value)
    assert sum(sign << power for sign, power in digits) == value
    assert all(sign in {-1, 1} for sign, _ in digits)
    assert all(above - below > 1 for (_, below), (_, above) in pairwise(digits))


@cache
def least_adders() -> dict[int, int]:
    """Return the fewest sums that each odd number below 256 takes, by brute force: at most three."""
    limit = 1 << 9
    least: dict[int, int] = {1: 0}
    there = {frozenset({1})}
    for count in (1, 2, 3):
        following = set()
        for numbers in there:
            made = {
                odd_part(total)[0]
                for a in numbers
                for b in numbers
                for shift in range(9)
                for total in ((a << shift) + b, abs((a << shift) - b))
                if 0 < total < limit
            }
            for number in made - numbers:
                least.setdefault(number, count)
                if count < 3:
                    following.add(numbers | {number})
        there = following
    return {number: count for number, count in least.items() if number < 256}


def test_no_number_below_256_takes_more_adders_than_the_fewest() -> None:
    least = least_adders()
    assert min(number for number in least if least[number] == 3) == 43
    assert len(least) == 128  # below 683, three are enough for every number
    more = {n: len(adder_graph((n,))) - count for n, count in least.items() if len(adder_graph((n,))) != count}
    assert more == {}


@pytest.mark.parametrize(("number", "adders"), [(3, 1), (11, 2), (43, 3), (683, 4)])
def test_the_first_numbers_that_take_so_many(number: int, adders: int) -> None:
    """Gustafsson, Dempster and Wanhammar, Extended results for minimum-adder constant integer multipliers (2002)."""
    assert len(adder_graph((number,))) == adders
    assert all(len(adder_graph((n,))) < adders for n in range(max(1, number - 60), number))


@pytest.mark.parametrize(("number", "sums"), [(108265, 4), (244403, 5), (277759, 3)])
def test_a_constant_whose_digits_leave_no_simpler_number(number: int, sums: int) -> None:
    """Taken apart step by step, the first two are made of six sums, the third of four."""
    adders = adder_graph((number,))
    assert len(adders) == sums
    assert multiples(adders, 1) == [1, *(adder.multiple for adder in adders)]
    assert max(levels(adders).values()) <= 4


def test_few_sums_for_one_constant_that_would_leave_less_to_share() -> None:
    """The sums that take least for one of both are of less use for the other."""
    constants = (1895, 409)
    digits, few = (_one_by_one(constants, few) for few in (False, True))
    end = 1 << 15
    assert adder_bits(digits, -end, end - 1) < adder_bits(few, -end, end - 1)
    assert adder_graph(constants) == digits


def test_a_subtraction_is_avoided_where_that_takes_hardly_more() -> None:
    """Taps of `recipes/short_taps`: with six differences among nine sums, an iCE40 took more cells for fewer bits."""
    adders = adder_graph((7, 5, -1, -21, -9, 21, 179, 55))
    assert len(adders) == 9
    assert sum(adder.subtract for adder in adders) <= 3


def test_constants_share_sums() -> None:
    assert [adder.multiple for adder in adder_graph((45, 5))] == [5, 45]
    assert sorted(adder.multiple for adder in adder_graph((-12, 3, 6))) == [-3, 3]
    assert adder_graph((1, 2, 1024)) == ()


def test_the_lowest_bits_are_free_unless_they_are_subtracted() -> None:
    (added,) = adder_graph((5,))
    assert added == Adder(5, (0, 0), (0, 2), subtract=False)
    assert adder_bits([added], -128, 127) == 11 - 2
    assert adder_bits([added._replace(left=(0, 2), right=(0, 0))], -128, 127) == 11 - 2
    assert adder_bits([Adder(3, (0, 2), (0, 0), subtract=True)], -128, 127) == 10
    assert adder_bits([Adder(-3, (0, 0), (0, 2), subtract=True)], -128, 127) == 10 - 2
    assert adder_bits([added], 0, 255) == 11 - 2


def test_the_range_of_a_negative_multiple() -> None:
    assert multiple_range(-3, -2, 5) == (-15, 6)


def test_products_by_operand_see_through_shifts() -> None:
    g = GraphBuilder()
    x, y = g.input("x", 0, -8, 7), g.input("y", 0, -8, 7)
    nodes = [g.scale(wire, 3, 0) for wire in (x, g.shift(g.shift(x, 1), 2), y)]
    graph = g.build([x])
    assert by_operand(graph, nodes) == [(x, nodes[:2]), (y, nodes[2:])]


def test_a_sum_that_is_made_again_on_a_lower_level_follows_what_it_is_made_of() -> None:
    """79 is there as a long chain first; a later constant asks for it on a lower level, as 16 + 63."""
    constants = (79, 49, -193, -27, -553, -159, 51, 1, 85, 229, 77)
    values = [1]
    for adder in adder_graph(constants):
        (left, up), (right, along) = adder.left, adder.right
        values.append((values[left] << up) + (-1 if adder.subtract else 1) * (values[right] << along))
        assert values[-1] == adder.multiple
    assert {odd_part(constant)[0] for constant in constants} <= {*values}
