"""The states of loops that go back T samples: memories with a word for each of T samples, which take turns.

Each stage counts the samples that it takes over, from 0 to T - 1 and again, and remembers whether it has done so once::

    sample     0   1  ..  T-1    T   T+1  ..        turn = sample modulo T: the address of its word
    turn       0   1  ..  T-1    0    1   ..        warm = whether sample >= T: whether there is one
    warm       0   0  ..   0     1    1   ..

So samples with the same turn are T positions apart or further, as each position holds one sample at most. Nothing
clears the words: a sample that is not warm finds anything. The code of a DELAY node that goes back T samples or more is
0 for it, and so is ``warm * word``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import product
from typing import NamedTuple

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.control import RESET, Case, Control, Search
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.parallel.state_memories import Registers, State, StateMemories, address_of
from sosmith.verify.program.normal_form import Form, constant, plus


class Counter(NamedTuple):
    """A register that counts samples: what it holds for the one at position `behind`, which changes it on leaving."""

    behind: int
    value: Form


class TurnMemories(StateMemories):
    """The memories of a core with look-ahead; see `StateMemories`, of which it proves the same.

    Parameters
    ----------
    registers, netlist, control, graph
        As those of `StateMemories`.

    Attributes
    ----------
    counters : dict of str to Counter
        The registers that count samples, which are found by what the addresses are made of, and have been checked.

    Raises
    ------
    RejectedError
        If a memory has no such registers, or they count otherwise.
    """

    def __init__(
        self,
        registers: Registers,
        netlist: Netlist,
        control: Control,
        graph: GraphCodes,
        dependence: Dependence,
    ) -> None:
        super().__init__(registers, netlist, control, graph, "turn")
        self._dependence, self._search = dependence, Search(netlist)
        self.counters: dict[str, Counter] = {}
        for name in self.states:
            turn = self._turn(name)
            if turn not in self.counters:
                self._count(turn, self.words(name))
            right = self.counters[turn].value == self.address(name)
            require(right, f"{turn} must count the {self.words(name)} words of {name}, not others")

    def words(self, name: str) -> int:
        return len(self._netlist.memories[name].first)

    def distance(self, name: str) -> int:
        return self.words(name)

    def address(self, name: str) -> Form:
        return self._graph.turn(self.words(name))

    def read(self, name: str, state: State, unknown: Form) -> Form:
        cold = plus(constant(1), self._graph.warm(self.words(name)), -1)
        return plus(self._graph.codes[state.node], self._graph.forms.times(cold, unknown))

    def written(self, name: str, state: State) -> tuple[Form, str]:
        node, turns = self._graph.nodes[state.node], self.words(name)
        origin, ago = self._graph.origin(state.node)
        before = self._graph.past((origin, ago - turns))
        if before is None:
            raise RejectedError(f"{name} must hold {node.label}, of {ago} samples ago, not of {turns}")
        return before, f"{self._graph.nodes[origin].label} of {ago - turns} samples ago"

    @property
    def moving(self) -> Case:
        return {RESET: 1}  # what a reset writes is found by samples that are not warm

    def check_beginning(self, name: str, what: str) -> None:
        """Nothing to check: a sample that is not warm may find anything."""

    def _turn(self, name: str) -> str:
        """Return the register that a memory's address comes from: the first one back that depends on itself."""
        register = self._one(self._dependence.of([address_of(self._netlist.memories[name])]), name)
        for _ in self._netlist.registers:
            sources = self._dependence.of_loads(self._netlist.registers[register].statements) - self._control.names
            if register in sources:
                return register
            register = self._one(sources, name)
        raise RejectedError(f"the address of {name} must come from a register that counts, not from a ring of them")

    def _one(self, sources: frozenset[str], name: str) -> str:
        """Return the only one of the registers that the address of a memory comes from."""
        registers = sources & self._netlist.registers.keys()
        right = len(sources) == len(registers) == 1
        require(right, f"the address of {name} must come from one register, not from {len(sources)}")
        return next(iter(registers))

    def _count(self, turn: str, turns: int) -> None:
        """Check a turn, and the registers that it sets: whether a sample is warm."""
        self.counters[turn] = self._checked(turn, {turn: range(turns)}, self._graph.turn(turns), turn, turns)
        for name, register in self._netlist.registers.items():
            if name != turn and turn in self._dependence.of_conditions(register.statements):
                values = {turn: range(turns), name: range(2)}
                self.counters[name] = self._checked(name, values, self._graph.warm(turns), turn, turns)
                require(
                    self.counters[name].behind == self.counters[turn].behind,
                    f"{name} must be set by the sample that {turn} counts, not at another position",
                )

    def _checked(self, name: str, values: Mapping[str, Iterable[int]], value: Form, turn: str, turns: int) -> Counter:
        """Check a register for all `values` of itself and of the turn."""
        behind = self._registers.position_by_control(name, self._netlist.registers[name].statements)
        full, valid = self._control.full, self._control.valid[behind]
        self._search.expect_empty(name)
        for content in product(*values.values()):
            case = {RESET: 1, **dict(zip(values, content, strict=True))}
            last = case[turn] == turns - 1
            after = (0 if last else case[turn] + 1) if name == turn else int(last or case[name])
            self._search.expect(name, {**case, full: 0, valid: 1}, after)
            self._search.expect(name, {**case, full: 0, valid: 0}, case[name])
            self._search.expect(name, {**case, full: 1}, case[name])
        return Counter(behind, value)
