"""Decides whether two literals of gates are the same function, by binary decision diagrams.

Gates that both have are taken for variables first: what is the same for all values of these is the same. If that does
not decide, so are those below them, and then all gates are followed down to the variables, as far as there are few.
"""

from __future__ import annotations

import random
from collections.abc import Collection

from sosmith.verify.reader.gates import LOW, Gates

_MOST_NODES = 20_000
_MOST_GATES = 4_000
_TRIES = 1024
_PEELED = 2
"""Times that a cut is moved down by a gate, as those met first may depend on each other."""

_ALL = (1 << _TRIES) - 1


class _TooLargeError(Exception):
    """A diagram has more nodes than are allowed."""


class Equality:
    """Compares literals.

    Parameters
    ----------
    gates : Gates
        Where they come from.
    """

    def __init__(self, gates: Gates) -> None:
        self._gates = gates
        self._known: dict[tuple[int, int], bool | None] = {}

    def same(self, a: int, b: int) -> bool | None:
        """Whether two literals are the same function; None if it is not decided."""
        if a == b:
            return True
        key = (a, b) if a < b else (b, a)
        if key not in self._known:
            self._known[key] = True if self._decided(*key) else self._tried(*key)
        return self._known[key]

    def _tried(self, a: int, b: int) -> bool | None:
        """Return False if the literals differ for some values of the variables; None if none were found."""
        rng, values = random.Random(1), {LOW >> 1: 0}
        for gate in sorted(self._cone(a) | self._cone(b)):
            inputs = self._gates.inputs(2 * gate)
            if gate not in values and inputs is None:
                values[gate] = rng.getrandbits(_TRIES)
            elif inputs is not None:
                one, other = (values[each >> 1] ^ (_ALL if each & 1 else 0) for each in inputs)
                values[gate] = one & other
        left, right = (values[each >> 1] ^ (_ALL if each & 1 else 0) for each in (a, b))
        return False if left != right else None

    def _decided(self, a: int, b: int) -> bool:
        left, right = self._cone(a), self._cone(b)
        cuts = [(left & right) - {a >> 1, b >> 1}]
        for _ in range(_PEELED):
            cuts.append(cuts[-1] - self._first(a, b, cuts[-1]))
        for cut in (*cuts, frozenset[int]()):
            try:
                diagrams = _Diagrams(self._gates, cut)
                if diagrams.of(a) == diagrams.of(b):
                    return True
            except _TooLargeError:
                pass
            if len(left | right) > _MOST_GATES:
                return False
        return False

    def _first(self, a: int, b: int, cut: Collection[int]) -> set[int]:
        """Return the gates of a cut that are met first on the way down from two literals."""
        met, gates, left = set[int](), set[int](), [a >> 1, b >> 1]
        while left:
            gate = left.pop()
            if gate in gates:
                continue
            gates.add(gate)
            if gate in cut:
                met.add(gate)
            else:
                left += [each >> 1 for each in self._gates.inputs(2 * gate) or ()]
        return met

    def _cone(self, literal: int) -> set[int]:
        gates, left = set[int](), [literal >> 1]
        while left:
            gate = left.pop()
            if gate not in gates:
                gates.add(gate)
                left += [each >> 1 for each in self._gates.inputs(2 * gate) or ()]
        return gates


class _Diagrams:
    """Diagrams of literals over the variables and the gates of a cut, in the order in which they are met."""

    def __init__(self, gates: Gates, cut: Collection[int]) -> None:
        self._gates, self._cut = gates, cut
        self._order: dict[int, int] = {}
        self._nodes: list[tuple[int, int, int]] = [(1 << 30, 0, 0), (1 << 30, 1, 1)]
        self._unique: dict[tuple[int, int, int], int] = {}
        self._ands: dict[tuple[int, int], int] = {}
        self._nots: dict[int, int] = {0: 1, 1: 0}
        self._of: dict[int, int] = {LOW >> 1: 0}

    def of(self, literal: int) -> int:
        """Return the diagram of a literal."""
        left = [literal >> 1]
        while left:
            gate = left[-1]
            inputs = None if gate in self._cut else self._gates.inputs(2 * gate)
            if gate in self._of:
                left.pop()
            elif inputs is None:
                self._of[gate] = self._node(self._order.setdefault(gate, len(self._order)), 0, 1)
                left.pop()
            else:
                missing = [each >> 1 for each in inputs if each >> 1 not in self._of]
                left += missing
                if not missing:
                    self._of[gate] = self._and(*(self._side(each) for each in inputs))
                    left.pop()
        return self._side(literal)

    def _side(self, literal: int) -> int:
        node = self._of[literal >> 1]
        return self._not(node) if literal & 1 else node

    def _node(self, variable: int, low: int, high: int) -> int:
        if low == high:
            return low
        key = variable, low, high
        if key not in self._unique:
            if len(self._nodes) > _MOST_NODES:
                raise _TooLargeError
            self._unique[key] = len(self._nodes)
            self._nodes.append(key)
        return self._unique[key]

    def _not(self, node: int) -> int:
        if node not in self._nots:
            variable, low, high = self._nodes[node]
            self._nots[node] = self._node(variable, self._not(low), self._not(high))
        return self._nots[node]

    def _and(self, a: int, b: int) -> int:
        if b in {a, 1}:
            return a
        if a == 1:
            return b
        if 0 in {a, b}:
            return 0
        key = (a, b) if a < b else (b, a)
        if key not in self._ands:
            (one, *left), (other, *right) = self._nodes[a], self._nodes[b]
            first = min(one, other)
            left, right = (left if one == first else [a, a]), (right if other == first else [b, b])
            self._ands[key] = self._node(first, self._and(left[0], right[0]), self._and(left[1], right[1]))
        return self._ands[key]
