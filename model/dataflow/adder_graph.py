"""Multiplication by constants with shifts and additions: which sums to make, and of what.

Every sum is a multiple of the operand, made of two others, each shifted to the left::

    x --+---- << 2 ---> + = 5x --+---- << 4 ---> - = 75x            75 = 5 * 16 - 5
        |               ^        |               ^
        +---------------+        +---------------+

A number is taken apart in four ways, each of which leaves one or two simpler numbers: a factor ``2**k + 1`` or
``2**k - 1`` is divided out; its canonical signed digits are cut in two; a power of two is split off; or a multiple that
is there already, shifted. For one constant these are, with powers split off at any digit, the steps of Bernstein
(Multiplication by integer constants, Software: Practice and Experience 16, 1986). Several constants of one operand
share sums as in RAG-n (Dempster and Macleod, Use of minimum-adder multiplier blocks in FIR digital filters, IEEE
Transactions on Circuits and Systems II 42, 1995): the constant that takes least is made first, and its sums are there
for the others.

What was found so for a constant is compared with all graphs of up to four sums, and with many of five
(`sosmith.model.arithmetic.few_sums`), which reuse a sum in more ways than steps that leave simpler numbers do.

What is minimized is the number of adder bits. The lowest bits of a sum, where only one of both has any, take none
unless that one is subtracted. At most one more sum follows another than in a balanced tree of the constant's digits,
since each is a carry chain on the way of a sample.

>>> for adder in adder_graph((75, 20)):
...     print(adder)
Adder(multiple=5, left=(0, 0), right=(0, 2), subtract=False)
Adder(multiple=75, left=(1, 4), right=(1, 0), subtract=True)
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from typing import NamedTuple

from sosmith.model.arithmetic.few_sums import ALL, Split, cheapest
from sosmith.model.dataflow.graph import Graph, Op

_SEARCHED = 72
"""Bits times signed digits of a number up to which a power is split off at any place: bounds the time of the search."""

_MANY = 8
"""Multiples beyond which one that is there is tried only where it leaves another that is there: bounds the time too."""

_MOST_TRIED = 1 << 21
"""Terms that are split off for all constants; beyond a share of it, one is taken apart by factors and digits only."""

_COMPARED = 8
"""Most constants that are compared for which is to be made next, those with the fewest signed digits."""

_SUBTRACTION = 4
"""Adder bits that a subtraction counts as, where few sums are compared: an iCE40 inverts what is subtracted in LUT of
their own, once for all differences. With 4, those fall by a seventh in the examples and recipes, and adder bits rise by
one in a hundred."""

_OPERAND_BITS = 16
"""Width of the operand for which adder bits are minimized; the choice hardly depends on it."""

_MOST_VALUES = 1 << 22
"""Values that are made of all sets of sums, for all constants: bounds the time of looking for few sums."""

Term = tuple[int, int]
"""A multiple, as the number of its sum from 1 on or 0 for the operand itself, and how far it is shifted to the left."""


class Adder(NamedTuple):
    """A sum or a difference of two shifted multiples of the operand, and which multiple it is."""

    multiple: int
    left: Term
    right: Term
    subtract: bool


class _Solution(NamedTuple):
    """Adder bits that a number takes, and the split of every sum among them, simpler ones first."""

    bits: int
    splits: Mapping[int, Split]


def odd_part(value: int) -> tuple[int, int]:
    """Return the odd number, and how far it is shifted to the left, that give `value`, which is not 0."""
    shift = (value & -value).bit_length() - 1
    return value >> shift, shift


@cache
def signed_digits(value: int) -> tuple[tuple[int, int], ...]:
    """Return sign and power of two of each canonical signed digit that is not 0, the lowest first.

    >>> signed_digits(-7)
    ((1, 0), (-1, 3))
    """
    digits = []
    power = 0
    while value:
        sign = 2 - (value & 3) if value & 1 else 0
        if sign:
            digits.append((sign, power))
        value = (value - sign) >> 1
        power += 1
    return tuple(digits)


@cache
def adder_graph(constants: tuple[int, ...]) -> tuple[Adder, ...]:
    """Return the sums that give the multiples of one operand by all `constants`, none of which is 0.

    A multiple by c is the operand or one of the sums, ``odd_part(c)[0]``, shifted to the left by ``odd_part(c)[1]``.
    """
    wanted = {odd_part(constant)[0] for constant in constants} - {1}
    # less for one constant may leave less to share with the next
    return min((_one_by_one(wanted, few) for few in (False, True)), key=_weight)


def _one_by_one(constants: Collection[int], few: bool) -> tuple[Adder, ...]:
    """Return the sums that give odd constants, the simplest first; each by few sums, if so, where that takes less."""
    levels = {1: 0}
    splits: dict[int, Split] = {}
    wanted = {*constants}
    most, most_values = (limit // max(len(wanted), 1) for limit in (_MOST_TRIED, _MOST_VALUES))
    while wanted:
        search = _Search(levels, most)
        simplest = sorted(wanted, key=lambda number: (len(signed_digits(number)), _by_size(number)))[:_COMPARED]
        candidates = {
            number: search.cheapest(number, _most_levels(number)) for number in sorted(simplest, key=_by_size)
        }
        chosen = min(candidates, key=lambda number: candidates[number].bits)
        found = candidates[chosen].splits
        for number, split in (_cheaper(levels, chosen, found, most_values) if few else found).items():
            levels[number] = 1 + max(levels[part] for part in split.parts)
            splits[number] = split
        wanted -= levels.keys()
    numbers = _in_order(splits)
    return tuple(
        Adder(
            number,
            (numbers[split.parts[0]], split.shifts[0]),
            (numbers[split.parts[1]], split.shifts[1]),
            split.subtract,
        )
        for number in numbers
        if number != 1
        for split in [splits[number]]
    )


def _cheaper(there: Mapping[int, int], number: int, splits: Mapping[int, Split], most: int) -> Mapping[int, Split]:
    """Return the splits that give a number, or those of less weight in a few sums.

    One sum more than all ways of which are looked at is tried only where so many do not give the number.
    """
    for sums in range(1, ALL + 2):
        below = sum(_weighed_bits(made, split.shifts, split.subtract) for made, split in splits.items())
        # nearly every sum takes the bits of the operand, or more
        if sums * _OPERAND_BITS >= below or (sums > ALL and len(splits) <= ALL):
            break
        splits = cheapest(there, number, _most_levels(number), sums, _weighed_bits, below, most) or splits
    return splits


def _weight(adders: Iterable[Adder]) -> int:
    return sum(_weighed_bits(adder.multiple, (adder.left[1], adder.right[1]), adder.subtract) for adder in adders)


def _weighed_bits(multiple: int, shifts: tuple[int, int], subtract: bool) -> int:
    """Return the adder bits of a sum, and what a subtraction counts beside them."""
    return _searched_bits(multiple, shifts, subtract) + _SUBTRACTION * subtract


def _in_order(splits: Mapping[int, Split]) -> dict[int, int]:
    """Return the numbers of the sums, each of which follows what it is made of.

    One that was made on a level too high for a later constant is made again on a lower one, of later sums.
    """
    numbers = {1: 0}
    for start in splits:
        pending = [start]
        while pending:
            missing = [part for part in splits[pending[-1]].parts if part not in numbers]
            if missing and pending[-1] not in numbers:
                pending += missing[::-1]
                continue
            numbers.setdefault(pending.pop(), len(numbers))
    return numbers


def by_operand(graph: Graph, products: Iterable[int]) -> list[tuple[int, list[int]]]:
    """Return SCALE nodes by the node whose code they multiply, which a SHIFT does not change."""
    groups: dict[int, list[int]] = {}
    for index in sorted(products):
        (operand,) = graph.nodes[index].operands
        while graph.nodes[operand].op is Op.SHIFT:
            (operand,) = graph.nodes[operand].operands
        groups.setdefault(operand, []).append(index)
    return list(groups.items())


def adder_bits(adders: Iterable[Adder], low: int, high: int) -> int:
    """Return the adder bits of sums whose operand is in low..high."""
    return sum(_bits(adder.multiple, (adder.left[1], adder.right[1]), adder.subtract, low, high) for adder in adders)


def scalings(graph: Graph) -> frozenset[int]:
    """Return the products by constants that can be made of adders: all but those by 0."""
    return frozenset(index for index, node in enumerate(graph.nodes) if node.op is Op.SCALE and node.parameter)


def multiple_range(multiple: int, low: int, high: int) -> tuple[int, int]:
    """Return the smallest and the largest multiple of an operand in low..high."""
    ends = multiple * low, multiple * high
    return min(ends), max(ends)


def multiple_name(operand: str, multiple: int) -> str:
    """Return the name of a sum, from that of the operand."""
    return f"{operand}_times_{'minus_' * (multiple < 0)}{abs(multiple)}"


def _bits(multiple: int, shifts: tuple[int, int], subtract: bool, low: int, high: int) -> int:
    """Return the bits of a sum that take an adder: all but the lowest, where the second has none or is all there is."""
    least, most = multiple_range(multiple, low, high)
    width = max(least.bit_length() if least >= 0 else (~least).bit_length(), most.bit_length()) + (least < 0)
    first, second = shifts
    return width - (second if second else 0 if subtract else first)


def _searched_bits(multiple: int, shifts: tuple[int, int], subtract: bool) -> int:
    """Return the bits of a sum that take an adder, for the operand for which they are minimized."""
    end = 1 << (_OPERAND_BITS - 1)
    return _bits(multiple, shifts, subtract, -end, end - 1)


class _Search:
    """Finds out what odd numbers take, given the multiples that are there, and on which level of sums each is."""

    def __init__(self, there: Mapping[int, int], most_tried: int) -> None:
        self._there = dict(there)
        self._tried, self._most_tried = 0, most_tried
        self._known: dict[tuple[int, int], _Solution | None] = {}

    def cheapest(self, number: int, levels: int) -> _Solution:
        """Return what a number takes with so many levels of sums, which are enough."""
        solution = self._solution(number, levels)
        assert solution is not None
        return solution

    def _solution(self, number: int, levels: int) -> _Solution | None:
        if self._there.get(number, levels + 1) <= levels:
            return _Solution(0, {})
        key = number, levels
        if key not in self._known:
            self._known[key] = self._taken_apart(number, levels) if levels else None
        return self._known[key]

    def _taken_apart(self, number: int, levels: int) -> _Solution | None:
        best: _Solution | None = None
        for split in self._splits(number):
            bits = _searched_bits(number, split.shifts, split.subtract)
            if best is not None and bits + max(map(self._least, split.parts)) >= best.bits:
                continue
            splits: dict[int, Split] = {}
            for part in dict.fromkeys(split.parts):
                solution = self._solution(part, levels - 1)
                if solution is None or (best is not None and bits + solution.bits >= best.bits):
                    break
                bits += solution.bits
                splits |= {made_of: of for made_of, of in solution.splits.items() if made_of not in splits}
            else:
                best = _Solution(bits, {**splits, number: split})
        return best

    def _least(self, number: int) -> int:
        """Adder bits that a number takes at least, by its number of digits."""
        return 0 if number in self._there else (len(signed_digits(number)) - 1).bit_length() * _OPERAND_BITS

    def _splits(self, number: int) -> Iterator[Split]:
        digits = signed_digits(number)
        top = abs(number).bit_length()
        for k in range(1, top):
            for factor, subtract in (((1 << k) + 1, False), ((1 << k) - 1, True)):
                if 1 < factor < abs(number) and number % factor == 0:
                    yield Split((number // factor,) * 2, (k, 0), subtract)
        for cut in range(1, len(digits)):
            low = sum(sign << power for sign, power in digits[:cut])
            yield from _signed((low, 0), odd_part(number - low))
        searched = top * len(digits) <= _SEARCHED and self._tried < self._most_tried
        places = range(top + 1) if searched else ()
        self._tried += 2 * len(places) * len(self._there)
        fewer = len(digits) if len(self._there) <= _MANY else 0
        for there in self._there:
            for term in ((sign * there, place) for place in places for sign in (1, -1)):
                part = odd_part(number - (term[0] << term[1])) if number != term[0] << term[1] else (0, 0)
                if part[0] in self._there or 0 < len(signed_digits(part[0])) < fewer:
                    yield from _signed(term, part)


def _signed(a: Term, b: Term) -> Iterator[Split]:
    """Yield a sum of two numbers, given as odd ones with shifts: of positive ones, or with the lowest bits for free."""
    (x, i), (y, j) = sorted((a, b), key=lambda term: term[0] < 0)
    if y < 0:
        yield Split((x, -y), (i, j), subtract=True)
    if y > 0 or (x > 0 and j == 0 and y != -1):
        yield Split((x, y), (i, j), subtract=False)


def _most_levels(number: int) -> int:
    return (len(signed_digits(number)) - 1).bit_length() + 1


def _by_size(number: int) -> tuple[int, int]:
    return abs(number), number
