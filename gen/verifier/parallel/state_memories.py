"""The states of a core with several channels: memories with a word for the DELAY node of each channel.

A word is read for a sample at one position, and written when that sample leaves another, further on. In between, it may
not be read for another sample of the channel::

    position        r     r+1    ..    w                    distance: the least number of positions from a sample of a
    read here ------+                  +------ written      channel to its next one, which the entrance keeps apart
                    <------ w - r ----->

    the sample before, of the same channel, is at r + distance or further: past w, if w - r + 1 <= distance

So a word that is read for a sample holds the code of the DELAY node for it, by induction over the samples of a channel:
it is 0 once the states are cleared, and takes over the code of the node's operand when a sample leaves w.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from sosmith.gen.verifier.graph import RejectedError, require
from sosmith.gen.verifier.parallel.control import Case, Control, Entrance, UndecidedError, cases
from sosmith.gen.verifier.parallel.evaluation import Evaluation
from sosmith.gen.verifier.parallel.graph_codes import GraphCodes
from sosmith.gen.verifier.parallel.netlist import Memory, Netlist
from sosmith.gen.verifier.parallel.text import Choice, Expression, Load, Statement, Word
from sosmith.gen.verifier.program.normal_form import Form, constant

_NOWHERE = -2
"""A position before all samples."""


@dataclass(frozen=True)
class State:
    """A register or a memory that is taken to hold the code of a DELAY node.

    Attributes
    ----------
    node : int
        The node.
    behind : int
        Position that it is loaded behind.
    """

    node: int
    behind: int


class Registers(Protocol):
    """What the registers of the core hold, as `Pipeline` finds it; its methods say what they return."""

    channel: Form

    def at(self, position: int, case: Case) -> Evaluation: ...
    def in_front(self, known: Mapping[str, Form], opened: str) -> Evaluation: ...
    def held(self, name: str) -> Form: ...
    def behind(self, name: str) -> int | None: ...
    def same(self, a: Form, b: Form, width: int) -> bool: ...
    def position_by_control(self, name: str, statements: Sequence[Statement]) -> int: ...


class StateMemories:
    """The memories of a core with several channels that have the names of DELAY nodes.

    Parameters
    ----------
    registers : Registers
        What the registers hold.
    netlist : Netlist
    control : Control
    entrance : Entrance
        That of `control`.
    graph : GraphCodes
    """

    def __init__(
        self, registers: Registers, netlist: Netlist, control: Control, entrance: Entrance, graph: GraphCodes
    ) -> None:
        self._registers, self._netlist, self._graph = registers, netlist, graph
        self._control, self._entrance = control, entrance
        self.states: dict[str, State] = {}
        for node in graph.delays:
            name = f"{graph.nodes[node].stage}.{graph.nodes[node].name}_memory"
            if name in netlist.memories:
                behind = registers.position_by_control(name, netlist.memories[name].statements)
                self.states[name] = State(node, behind)
        self._apart: int | None = None

    @property
    def distance(self) -> int:
        """Least number of positions from a sample of a channel to its next one."""
        if self._apart is None:
            self._apart = 1 + self._positions_without_the_channel()
        return self._apart

    def word(self, name: str, address: Form, position: int) -> Form | None:
        """Return what is read from a memory for the sample at a position; None if it holds no state.

        Raises
        ------
        RejectedError
            If it is not the word of the sample's channel, or may not have been written by then.
        """
        if name not in self.states:
            return None
        state = self.states[name]
        node = self._graph.nodes[state.node]
        require(
            self._registers.same(address, self._registers.channel, 64),
            f"{name} must hold {node.label} and be read for the channel of the sample, not for another one",
        )
        ahead = state.behind - position
        require(
            0 <= ahead < self.distance,
            f"{name} must hold {node.label} and be read at most {self.distance - 1} positions before it is written, "
            f"not {ahead}",
        )
        return self._graph.codes[state.node]

    def check(self) -> None:
        """Prove by induction that each word holds the code of the DELAY node for its channel.

        Raises
        ------
        RejectedError
            If one does not.
        """
        for name, state in self.states.items():
            memory, channels = self._netlist.memories[name], self._entrance.channels
            what = f"{name} must hold {self._graph.nodes[state.node].label}"
            require(len(memory.first) == channels, f"{what} of {channels} channels, not of {len(memory.first)}")
            try:
                self._check_cleared(memory, what)
                self._check_taken(memory, state, what)
            except UndecidedError as undecided:
                raise RejectedError(f"{what}, and {undecided} must not count for what is written") from None

    def _check_cleared(self, memory: Memory, what: str) -> None:
        """Check that the word of one channel becomes 0 at each clock while states are cleared."""
        address = _address(memory)
        for logic, loaded in self._written(memory, _NOWHERE, {self._entrance.clearing: 1}):
            require(
                loaded is not None and self._registers.same(loaded, {}, memory.width), f"{what} and be cleared to 0"
            )
            require(
                self._registers.same(logic.word(address), logic.net(self._entrance.word), self._netlist.width(address)),
                f"{what} and be cleared for one channel after the other",
            )

    def _check_taken(self, memory: Memory, state: State, what: str) -> None:
        """Check what is written when a sample leaves, and that nothing is otherwise."""
        address, clearing, full = _address(memory), self._entrance.clearing, self._control.full
        valid = self._control.valid[state.behind]
        (source,) = self._graph.nodes[state.node].operands
        for logic, loaded in self._written(memory, state.behind, {clearing: 0, full: 0, valid: 1}):
            if loaded is None:
                raise RejectedError(f"{what}, which is written when a sample leaves position {state.behind}")
            require(
                self._registers.same(logic.word(address), self._registers.channel, self._netlist.width(address)),
                f"{what} and be written for the channel of the sample",
            )
            require(
                self._registers.same(loaded, self._graph.codes[source], memory.width),
                f"{what} and take over {self._graph.nodes[source].label}, not another value",
            )
        for case in ({clearing: 0, full: 1}, {clearing: 0, full: 0, valid: 0}):
            for _, loaded in self._written(memory, _NOWHERE, case):
                require(loaded is None, f"{what}, which stays while no sample leaves position {state.behind}")

    def _written(self, memory: Memory, position: int, fixed: Case) -> list[tuple[Evaluation, Form | None]]:
        """Return the logic and what is written, in each case that is left; None where nothing is."""

        def evaluate(case: Case) -> tuple[Evaluation, Form | None]:
            logic = self._registers.at(position, case)
            loaded = logic.loaded(memory.statements)
            return logic, None if loaded is None else loaded[1]

        return [found for _, found in cases(fixed, evaluate)]

    def _positions_without_the_channel(self) -> int:
        """Return how many first positions hold no sample of the channel of one that enters."""
        enters, channel = self._control.valid[0], self._registers.channel
        for count, near in enumerate(self._entrance.near):
            repeated = f"near_channel{count}"
            require(repeated in self._netlist.registers, f"{near} must come with a register {repeated}")
            width = self._netlist.widths[repeated]
            here = self._registers.behind(repeated) == count
            require(
                here and self._registers.same(self._registers.held(repeated), channel, width),
                f"{repeated} must hold the channel of the sample at position {count + 1}",
            )
            met: Mapping[str, Form] = {
                self._entrance.buffer.held: constant(1), near: constant(1), repeated: channel
            }  # fmt: skip
            if self._registers.in_front(met, enters).net(enters):
                return count
        return len(self._entrance.near)


def _address(memory: Memory) -> Expression:
    """Return the address that a memory is written at: there is one place where it is."""
    (first, *rest) = memory.statements or (None,)
    if isinstance(first, Choice) and not (rest or first.no) and len(first.yes) == 1:
        load = first.yes[0]
        if isinstance(load, Load) and isinstance(load.target, Word):
            return load.target.address
    raise RejectedError(f"{memory.name} must be written in one place")
