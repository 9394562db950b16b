"""One more multiple by a few more sums: nothing is missed, and the cheapest is what is returned."""

from collections.abc import Mapping
from itertools import product

import pytest

from sosmith.model.arithmetic.few_sums import Split, cheapest, sets_of_values

BITS = 8
"""Of the operand, which is signed."""
MOST = 1 << 22
FAR = 10**6


def bits(multiple: int, shifts: tuple[int, int], subtract: bool) -> int:
    """Adder bits as `sosmith.model.dataflow.adder_graph` counts them, written anew."""
    ends = [multiple * end for end in (-(1 << BITS - 1), (1 << BITS - 1) - 1)]
    width = 1 + max((end if end >= 0 else -end - 1).bit_length() for end in ends)
    free = shifts[1] or (0 if subtract else shifts[0])
    return width - free


def check(splits: Mapping[int, Split], there: Mapping[int, int], levels: int) -> int:
    """Assert that every sum is the value that it is said to be, of what is before it; return what all take."""
    made = dict(there)
    for value, split in splits.items():
        left, right = (part << shift for part, shift in zip(split.parts, split.shifts, strict=True))
        assert value == (left - right if split.subtract else left + right)
        made[value] = 1 + max(made[part] for part in split.parts)
    assert max(made.values()) <= levels
    return sum(bits(value, split.shifts, split.subtract) for value, split in splits.items())


def by_brute_force(there: tuple[int, ...], sums: int, shifts: int) -> dict[int, int]:
    """Return what each number takes at least with up to so many sums, positive or negative, of all orders."""
    least: dict[int, int] = {}
    states = {frozenset(there): 0}
    for _ in range(sums):
        following: dict[frozenset[int], int] = {}
        for made, cost in states.items():
            for a, b, shift, subtract in product(made, made, range(1, shifts + 1), (0, 1, 2)):
                value = a + (b << shift) if subtract == 0 else a - (b << shift) if subtract == 1 else (a << shift) - b
                if value in made or -value in made or abs(value) >= 1 << shifts + 1:
                    continue
                takes = cost + bits(value, (shift, 0) if subtract == 2 else (0, shift), subtract > 0)
                least[value] = min(takes, least.get(value, FAR))
                key = made | {value}
                following[key] = min(takes, following.get(key, FAR))
        states = following
    return least


@pytest.mark.parametrize(("there", "sums", "top"), [((1,), 1, 64), ((1,), 2, 64), ((1, 11), 2, 32), ((1, -3), 2, 32)])
def test_no_graph_takes_less_than_the_cheapest(there: tuple[int, ...], sums: int, top: int) -> None:
    """All signed graphs of up to so many sums, with shifts and values as large as the search allows."""
    shifts = top.bit_length()
    least = by_brute_force(there, sums, shifts)
    numbers = [n for n in range(top // 2 + 1, top, 2) if n not in there]
    found: dict[int, int] = {}
    for number, count in product(numbers, range(1, sums + 1)):
        splits = cheapest(dict.fromkeys(there, 0), number, sums, count, bits, FAR, MOST)
        if splits is not None:
            found[number] = min(check(splits, dict.fromkeys(there, 0), sums), found.get(number, FAR))
    assert found == {number: least[number] for number in numbers if number in least}
    assert len(found) > (1 if sums == 1 else 6)


def sums_of(values: tuple[int, ...], number: int) -> set[int]:
    """Return the odd sizes that one sum makes of two values, with the shifts and sizes that the search allows."""
    shifts = range(1, number.bit_length() + 2)
    found = {abs(a + sign * (b << shift)) for a, b in product(values, values) for shift in shifts for sign in (1, -1)}
    return {size for size in found if size < 2 << shifts[-1]}


@pytest.mark.parametrize("number", [23, 29, 45])
def test_no_set_is_missed(number: int) -> None:
    sets = {
        tuple(sorted((first, second)))
        for first in sums_of((1,), number) - {1, number}
        for second in sums_of((1, first), number) - {1, first, number}
        if _gives(number, second, first)
    }
    assert {*sets_of_values((1,), number, 3, MOST)} == sets


def _gives(number: int, last: int, first: int) -> bool:
    """Say whether a number is a sum of the last value and one that is there."""
    pairs = [pair for other in (1, first, last) for pair in ((last, other), (other, last))]
    shifts = range(1, number.bit_length() + 2)
    return any(number in {abs(a + (b << k)), abs(a - (b << k))} for a, b in pairs for k in shifts)


def test_every_set_of_five_gives_the_number() -> None:
    sets = sets_of_values((1,), 139883, 5, MOST >> 3)
    assert len(sets) > 10
    assert [values for values in sets if 139883 not in sums_of(values, 139883)] == []


def test_a_constant_of_four_sums_for_which_digits_take_six() -> None:
    splits = cheapest({1: 0}, 108265, 4, 4, bits, FAR, MOST)
    assert splits is not None
    assert len(splits) == 4
    check(splits, {1: 0}, 4)
    assert all(cheapest({1: 0}, 108265, 4, sums, bits, FAR, MOST) is None for sums in (1, 2, 3))


def test_five_sums_where_four_do_not_do() -> None:
    assert cheapest({1: 0}, 139883, 4, 4, bits, FAR, MOST) is None
    splits = cheapest({1: 0}, 139883, 4, 5, bits, FAR, MOST)
    assert splits is not None
    assert len(splits) == 5
    check(splits, {1: 0}, 4)


def test_nothing_is_returned_that_does_not_take_less() -> None:
    splits = cheapest({1: 0}, 75, 3, 2, bits, FAR, MOST)
    assert splits is not None
    cost = check(splits, {1: 0}, 3)
    assert cheapest({1: 0}, 75, 3, 2, bits, cost, MOST) is None
    assert cheapest({1: 0}, 75, 3, 2, bits, cost + 1, MOST) == splits


def test_sums_follow_each_other_on_as_many_levels_as_allowed() -> None:
    """105 = 7 * 15 takes two sums one after the other; what is on a level of its own counts."""
    assert cheapest({1: 0}, 105, 1, 2, bits, FAR, MOST) is None
    assert cheapest({1: 0}, 105, 2, 2, bits, FAR, MOST) is not None
    assert cheapest({1: 0, 13: 2}, 105, 2, 1, bits, FAR, MOST) is None
    splits = cheapest({1: 0, 13: 2}, 105, 3, 1, bits, FAR, MOST)
    assert splits == {105: Split((1, 13), (0, 3), subtract=False)}


def test_a_negative_that_is_there_is_used_and_that_of_the_number_is_not() -> None:
    splits = cheapest({1: 0, -13: 0}, 51, 1, 1, bits, FAR, MOST)
    assert splits == {51: Split((-13, 1), (0, 6), subtract=False)}
    assert cheapest({1: 0, -105: 1}, 105, 3, 2, bits, FAR, MOST) is None


def test_effort_is_bounded() -> None:
    """With fewer values than all sets make, the sets of least values are looked at; long numbers not at all."""
    every, few = (sets_of_values((1,), 64911, 4, most) for most in (MOST, MOST >> 6))
    assert {*few} < {*every}
    assert sets_of_values((1,), (1 << 28) + 1, 2, MOST) == []
    assert cheapest({1: 0, (1 << 70) + 1: 1}, 75, 3, 2, bits, FAR, MOST) is not None  # no shift is beyond 64 bits
