"""The integer program for products by several constants, and the table of docs/hardware.md that is made of it."""

from itertools import product

import pytest
from benchmarks import constant_products
from benchmarks.adder_program import Program, Way, fewest_bits, useful, ways_of, with_signs

from sosmith.model.dataflow.adder_graph import adder_bits, adder_graph

RANGE = (-128, 127)


def test_the_table_is_that_of_the_record() -> None:
    text = constant_products.DOCUMENT.read_text(encoding="utf-8")
    assert constant_products.with_table(text) == text
    rows = constant_products.recorded()
    assert all(row.bound <= row.program_bits <= row.bits for row in rows)
    for name in ("audio_lowpass", "8 of 16 bits, drawn"):
        of = [row for row in rows if row.source == name]
        line = next(line for line in text.splitlines() if line.startswith(f"| {name} | {len(of)} |"))
        cells = line.split(" | ")
        assert [int(cells[2]), int(cells[7])] == [sum(row.sums for row in of), sum(row.program_bits for row in of)]


def test_ways_are_all_sums_of_two_values_and_the_larger_shift_is_free() -> None:
    values = (1, 3, 5, 7, 11, 23)
    free = {}
    for value, a, b, shift, sign in product(values[1:], values, values, range(1, 6), (1, -1)):
        if a != value != b and value in {abs(a + sign * (b << shift))}:
            key = value, (min(a, b), max(a, b))
            free[key] = max(shift, free.get(key, 0))
    bits = {3: 10, 5: 11, 7: 11, 11: 12, 23: 13}
    ways = ways_of(values, *RANGE)
    assert {(way.value, way.parts): way.bits for way in ways} == {key: bits[key[0]] - k for key, k in free.items()}


def test_what_leads_to_no_fewer_bits_is_left_out() -> None:
    """3 in 8 bits, and 11 by one of two extra values; 7 has no use, and 13 takes too much."""
    ways = [
        Way(3, (1, 1), 8),
        Way(5, (1, 1), 8),
        Way(7, (1, 1), 8),
        Way(13, (1, 3), 30),
        Way(11, (1, 5), 9),
        Way(11, (1, 13), 9),
    ]
    assert useful(ways, (3, 11), 26) == [ways[0], ways[1], ways[4]]
    assert useful(ways, (3, 11), 25) == []


def test_values_of_a_circle_are_not_made() -> None:
    """5 and 9 of each other would take least; 5 of 1 and 9 of 5 is what can be made."""
    ways = [Way(5, (1, 9), 1), Way(9, (1, 5), 1), Way(5, (1, 1), 8)]
    program = Program((5, 9), ways)
    assert program.order(program.solve().x) == [5, 9]


@pytest.mark.parametrize("constants", [(11, 13), (-7, 45), (3, -3, 10)])
def test_the_program_proposes_and_integers_decide(constants: tuple[int, ...]) -> None:
    result = fewest_bits(constants, *RANGE)
    adders = adder_graph(constants)
    assert result.bound <= result.bits <= adder_bits(adders, *RANGE)
    assert result.bound > 0


def test_what_the_sums_one_by_one_miss_is_found() -> None:
    constants = (57, 23, 19)
    known = adder_bits(adder_graph(constants), *RANGE)
    assert fewest_bits(constants, *RANGE).bits < known


def test_signs_are_those_of_the_constants_and_of_least_bits() -> None:
    graph = with_signs([3, 11], (-11, 24), *RANGE)
    assert graph is not None
    values = [1]
    for adder in graph:
        left, right = (values[k] << shift for k, shift in (adder.left, adder.right))
        values.append(left - right if adder.subtract else left + right)
        assert values[-1] == adder.multiple
    assert values == [1, 3, -11]
    assert with_signs([11], (11,), *RANGE) is None  # one sum does not do
