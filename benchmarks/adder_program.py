"""The fewest adder bits of the products of one operand by several constants, as an integer program.

Garcia and Volkova (Toward the multiple constant multiplication at minimal hardware cost, IEEE Transactions on Circuits
and Systems I 70, 2023) and before them Kumm (Optimal constant multiplication using integer linear programming, IEEE
Transactions on Circuits and Systems II 65, 2018) leave the value of each sum to the program, which takes a commercial
solver. Here the values are a pool that is there before, so that SciPy's solver, HiGHS, can do it: each way to make a
value of two of the pool is a variable that is 0 or 1, and so is each value; a value that a sum is made of must be made,
on a lower level.

The solver computes in double precision. Its graph is made and counted anew in integers. Its lower bound is its own
claim, over graphs of values in the pool in which no more sums follow each other up to a constant than `adder_graph`
allows. The pool has those values first that give a constant by one sum with other constants: where `MOST_OF_POOL` lets
all of them in, these are all graphs with at most one sum more than there are constants.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import Bounds, LinearConstraint, OptimizeResult, milp
from scipy.sparse import csr_array

from sosmith.model.arithmetic.few_sums import sets_of_values
from sosmith.model.dataflow.adder_graph import Adder, adder_bits, adder_graph, multiple_range, odd_part, signed_digits

MOST_OF_POOL = 160
"""Values that may be sums beside the constants."""

_MOST_VALUES = 1 << 20
"""Effort for the sets of values that the pool is taken from, as for `sets_of_values`."""

NODES, SECONDS = 4000, 10.0
"""Nodes and time after which the solver gives up, with a bound."""

_INFEASIBLE = 2
"""Status of `scipy.optimize.milp`: no graph takes less than is known."""


class Way(NamedTuple):
    """A way to make a positive value of two others, and the adder bits that it takes if their signs suit."""

    value: int
    parts: tuple[int, int]
    bits: int


class Result(NamedTuple):
    """What the integer program comes to.

    Attributes
    ----------
    bits, sums : int
        Adder bits and sums of the graph, counted in integers; those of `adder_graph` where it has no fewer bits.
    bound : int
        Adder bits that no graph of the pool has less than, as the solver says.
    pool, ways : int
        Values of the pool, and variables for ways to make one.
    """

    bits: int
    sums: int
    bound: int
    pool: int
    ways: int


def fewest_bits(constants: Sequence[int], low: int, high: int) -> Result:
    """Return the least adder bits that the solver finds for the products of an operand in low..high."""
    adders = adder_graph(tuple(constants))
    known = adder_bits(adders, low, high)
    targets = tuple(sorted({abs(odd_part(constant)[0]) for constant in constants} - {1}))
    if not targets:
        return Result(known, len(adders), known, 0, 0)
    values = pool(targets, (abs(adder.multiple) for adder in adders))
    ways = useful(ways_of(values, low, high), targets, known)
    if not {*targets} <= {way.value for way in ways}:  # each way to make one leads to no less than is known
        return Result(known, len(adders), known, len(values), len(ways))
    program = Program(targets, ways)
    solution = program.solve()
    bound = known
    if solution.status != _INFEASIBLE:
        dual = solution.mip_dual_bound
        least = sum(min(way.bits for way in ways if way.value == target) for target in targets)
        bound = max(least, min(known, math.ceil(dual - 1e-6))) if dual is not None and math.isfinite(dual) else least
    best = known, len(adders)
    if solution.x is not None:
        graph = with_signs(program.order(solution.x), constants, low, high)
        if graph is not None:
            best = min(best, (adder_bits(graph, low, high), len(graph)))
    return Result(*best, bound, len(values), len(ways))


def pool(targets: tuple[int, ...], more: Iterable[int]) -> list[int]:
    """Return 1, the constants, what more is given, and values that sets of few sums for one constant have."""
    counts: Counter[int] = Counter()
    for target in targets:
        others = tuple(sorted({1, *targets} - {target}))
        for there, sums in ((others, 2), (others, 3), ((1,), 3), ((1,), 4)):
            sets = sets_of_values(there, target, sums, _MOST_VALUES)
            for values in sets:
                counts.update(dict.fromkeys(values, (1 << 20 if sums == 2 else 1 << 12) // len(sets)))
    ranked = sorted(counts, key=lambda value: (-counts[value], value))
    return sorted({1, *targets, *more, *ranked[:MOST_OF_POOL]})


def ways_of(values: Sequence[int], low: int, high: int) -> list[Way]:
    """Return the ways to make each value but 1 of two others of the pool, with the largest shift of either."""
    known = np.array(values, dtype=np.int64)
    found: dict[tuple[int, tuple[int, int]], int] = {}
    for value in values[1:]:
        for shift in range(1, value.bit_length() + 2):
            for rest in (value - (known << shift), value + (known << shift)):
                _add(found, value, known, abs(rest), np.full(len(known), shift))
        for rest in (value - known, value + known):
            step = np.maximum(rest & -rest, 1)
            _add(found, value, known, abs(rest) // step, np.log2(step).astype(int))
    return [Way(value, parts, _width(value, low, high) - shift) for (value, parts), shift in sorted(found.items())]


def _width(value: int, low: int, high: int) -> int:
    """Return the bits of a positive multiple of an operand in low..high, with a sign bit if it has one."""
    ends = multiple_range(value, low, high)
    return max((end if end >= 0 else ~end).bit_length() for end in ends) + (ends[0] < 0)


def _add(
    found: dict[tuple[int, tuple[int, int]], int],
    value: int,
    parts: npt.NDArray[np.int64],
    others: npt.NDArray[np.int64],
    shifts: npt.NDArray[np.int64],
) -> None:
    """Note ways to make a value of parts and others, where these are in the pool, too, and the larger shift."""
    for place in np.nonzero(np.isin(others, parts) & (others != value) & (parts != value))[0].tolist():
        pair = sorted((int(parts[place]), int(others[place])))
        key = value, (pair[0], pair[1])
        found[key] = max(int(shifts[place]), found.get(key, 0))


def useful(ways: list[Way], targets: Collection[int], below: int) -> list[Way]:
    """Return the ways without those that lead to `below` adder bits or more, or make what nothing is made of."""
    while True:
        least: dict[int, int] = {1: 0}
        for way in ways:
            least[way.value] = min(way.bits, least.get(way.value, way.bits))
        base = sum(least.get(target, below) for target in targets)
        given = {1, *targets}
        kept = []
        for way in ways:
            bits = way.bits - (least[way.value] if way.value in given else 0)
            bits += sum(least.get(part, below) for part in {*way.parts} - given)
            if base + bits < below:
                kept.append(way)
        used = {*targets, *(part for way in kept for part in way.parts)}
        kept = [way for way in kept if way.value in used]
        if len(kept) == len(ways):
            return kept
        ways = kept


class Program:
    """The integer program: which ways are taken, which values are made, and on which level of sums each is.

    Parameters
    ----------
    targets : collection of int
        The values that must be made.
    ways : sequence of Way
        At least one for each of them.
    """

    def __init__(self, targets: Collection[int], ways: Sequence[Way]) -> None:
        self._ways = ways
        self._values = sorted({way.value for way in ways})
        self._levels = {target: most_levels(target) for target in targets}
        self._entries: list[tuple[int, int, float]] = []
        self._limits: list[tuple[float, float]] = []
        made = len(ways)
        level = made + len(self._values)
        self._made = {value: made + place for place, value in enumerate(self._values)}
        self._level = {value: level + place for place, value in enumerate(self._values)}
        for value in self._values:
            self._of_value(value)

    def _row(self, low: float, high: float, terms: Mapping[int, float]) -> None:
        """Add a linear constraint on variables."""
        self._entries += [(len(self._limits), variable, factor) for variable, factor in terms.items()]
        self._limits.append((low, high))

    def _of_value(self, value: int) -> None:
        """Make a value in one way if at all, of what is made on lower levels, and use it if it is not wanted itself."""
        numbers = [k for k, way in enumerate(self._ways) if way.value == value]
        self._row(0, 0, {**dict.fromkeys(numbers, 1), self._made[value]: -1})
        by_part: dict[int, list[int]] = defaultdict(list)
        for k in numbers:
            for part in {*self._ways[k].parts} - {1}:
                by_part[part].append(k)
        most = max(self._levels.values())
        for part, taken in by_part.items():
            if part not in self._made:  # no way to make it is left
                self._row(0, 0, dict.fromkeys(taken, 1))
                continue
            self._row(-np.inf, 0, {**dict.fromkeys(taken, 1), self._made[part]: -1})
            levels = {self._level[value]: 1, self._level[part]: -1, **dict.fromkeys(taken, -most - 1)}
            self._row(-most, np.inf, levels)
        if value not in self._levels:
            users = [k for k, way in enumerate(self._ways) if value in way.parts]
            self._row(0, np.inf, {**dict.fromkeys(users, 1), self._made[value]: -1})

    def solve(self) -> OptimizeResult:
        """Return what the solver comes to, within `NODES` and `SECONDS`."""
        size = len(self._ways) + 2 * len(self._values)
        most = max(self._levels.values())
        low, high = np.zeros(size), np.ones(size)
        for value in self._values:
            low[self._made[value]] = value in self._levels
            low[self._level[value]], high[self._level[value]] = 1, self._levels.get(value, most)
        rows, columns, factors = zip(*self._entries, strict=True)
        matrix = csr_array((factors, (rows, columns)), shape=(len(self._limits), size))
        whole = np.repeat([1, 0], [size - len(self._values), len(self._values)])
        return milp(
            np.array([way.bits for way in self._ways] + [0] * (size - len(self._ways))),
            integrality=whole,
            bounds=Bounds(low, high),
            constraints=LinearConstraint(matrix, *np.array(self._limits).T),
            options={"node_limit": NODES, "time_limit": SECONDS, "mip_rel_gap": 0},
        )

    def order(self, solution: npt.NDArray[np.float64]) -> list[int]:
        """Return the values that are made, those on lower levels first."""
        made = [value for value in self._values if solution[self._made[value]] > 0.5]
        return sorted(made, key=lambda value: (round(solution[self._level[value]]), value))


def with_signs(order: Sequence[int], constants: Iterable[int], low: int, high: int) -> tuple[Adder, ...] | None:
    """Return sums with such values, in that order, in the signs of least adder bits; None where they do not exist.

    What a constant asks for has its sign, or both.
    """
    wanted = {odd_part(constant)[0] for constant in constants} - {1}
    best: tuple[int, tuple[Adder, ...]] | None = None
    choices = [
        [signs] if (signs := tuple(s * value for s in (1, -1) if s * value in wanted)) else [(value,), (-value,)]
        for value in order
    ]
    for signed in product(*choices):
        graph = _sums([value for values in signed for value in values], wanted, low, high)
        if graph is not None:
            bits = adder_bits(graph, low, high)
            if best is None or bits < best[0]:
                best = bits, graph
    return None if best is None else best[1]


def _sums(multiples: Sequence[int], wanted: Collection[int], low: int, high: int) -> tuple[Adder, ...] | None:
    """Return for each multiple the cheapest sum of two before it; None if one has none, or none on its levels."""
    made, levels = [1], [0]
    adders: list[Adder] = []
    for multiple in multiples:
        found = []
        for a, b in product(range(len(made)), repeat=2):
            for shift, subtract in product(range(1, abs(multiple).bit_length() + 2), (False, True)):
                for left, right in (((a, shift), (b, 0)), ((a, 0), (b, shift))):
                    value = (made[a] << left[1]) + (-1 if subtract else 1) * (made[b] << right[1])
                    level = 1 + max(levels[a], levels[b])
                    if value == multiple and (multiple not in wanted or level <= most_levels(multiple)):
                        adder = Adder(multiple, left, right, subtract)
                        found.append((adder_bits([adder], low, high), level, adder))
        if not found:
            return None
        _, level, adder = min(found)
        made.append(multiple)
        levels.append(level)
        adders.append(adder)
    return tuple(adders)


def most_levels(value: int) -> int:
    """Return the sums that may follow each other up to a constant, as in `adder_graph`."""
    return (len(signed_digits(value)) - 1).bit_length() + 1
