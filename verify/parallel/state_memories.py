"""The states of a core that lie in memories, with a word for each sample that may be on its way.

Those are the samples of different channels (`sosmith.verify.parallel.channel_memories`), or of different turns
of a loop that goes back several samples (`sosmith.verify.parallel.turn_memories`): each has its address. A word
is read for a sample at one position, and written when that sample leaves another, further on. In between, it may not be
read for another sample with the same address::

    position        r     r+1    ..    w                    distance: the least number of positions from a sample to
    read here ------+                  +------ written      the next one with the same address
                    <------ w - r ----->

    the sample before, with the same address, is at r + distance or further: past w, if w - r + 1 <= distance

So a word that is read for a sample holds the code of the DELAY node for it, by induction over the samples with its
address: it takes over what the node will be for the next one when a sample leaves w.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.control import Case, Control, UndecidedError, cases
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Memory, Netlist
from sosmith.verify.program.normal_form import Form
from sosmith.verify.reader.syntax import Choice, Expression, Load, Statement, Word

NOWHERE = -2
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
    def content_of(self, name: str) -> Form: ...
    def behind(self, name: str) -> int | None: ...
    def same(self, a: Form, b: Form, width: int) -> bool: ...
    def position_by_control(self, name: str, statements: Sequence[Statement]) -> int: ...


class StateMemories(ABC):
    """The memories of a core that have the names of DELAY nodes.

    Parameters
    ----------
    registers : Registers
        What the registers hold.
    netlist : Netlist
    control : Control
    graph : GraphCodes
    whose : str
        What an address is: "channel" or "turn".
    """

    def __init__(self, registers: Registers, netlist: Netlist, control: Control, graph: GraphCodes, whose: str) -> None:
        self._registers, self._netlist, self._graph = registers, netlist, graph
        self._control, self._whose = control, whose
        self.states: dict[str, State] = {}
        for node in graph.delays:
            name = graph.memory_name(node)
            if name in netlist.memories:
                behind = registers.position_by_control(name, netlist.memories[name].statements)
                self.states[name] = State(node, behind)

    @abstractmethod
    def words(self, name: str) -> int:
        """Return the number of words that a memory must have."""

    @abstractmethod
    def distance(self, name: str) -> int:
        """Return the least number of positions from a sample to the next one with the same address in a memory."""

    @abstractmethod
    def address(self, name: str) -> Form:
        """Return the address of a sample in a memory."""

    @abstractmethod
    def read(self, name: str, state: State, unknown: Form) -> Form:
        """Return the word at the address of a sample; what is not known of it is `unknown`."""

    @abstractmethod
    def written(self, name: str, state: State) -> tuple[Form, str]:
        """Return what is written for a sample, and its name: what the DELAY node is for the next with its address."""

    @property
    @abstractmethod
    def moving(self) -> Case:
        """The control signals that say that samples may move, but for `Control.full`."""

    @abstractmethod
    def check_beginning(self, name: str, what: str) -> None:
        """Check what a memory holds before the first sample; `what` begins the sentence of a rejection."""

    def word(self, name: str, address: Form, position: int, unknown: Form) -> Form | None:
        """Return what is read from a memory for the sample at a position; None if it holds no state.

        Raises
        ------
        RejectedError
            If it is not the word of the sample, or may not have been written by then.
        """
        if name not in self.states:
            return None
        state = self.states[name]
        what = f"{name} must hold {self._graph.nodes[state.node].label} and be read"
        require(
            self._registers.same(address, self.address(name), 64),
            f"{what} for the {self._whose} of the sample, not for another one",
        )
        distance, most = state.behind - position, self.distance(name) - 1
        require(0 <= distance <= most, f"{what} at most {most} positions before it is written, not {distance}")
        # Between 1 and `most` positions lie no two samples with one address: the word is not the one that is written.
        collides = self._netlist.memories[name].unchecked and distance == 0
        require(not collides, f"{what} before the clock at which it is written, or not be marked with no_rw_check")
        return self.read(name, state, unknown)

    def check(self) -> None:
        """Prove by induction that each word holds the code of the DELAY node for the samples with its address.

        Raises
        ------
        RejectedError
            If one does not.
        """
        for name, state in self.states.items():
            depth, words = len(self._netlist.memories[name].first), self.words(name)
            what = f"{name} must hold {self._graph.nodes[state.node].label}"
            require(depth == words, f"{what} of {words} {self._whose}s, not of {depth}")
            try:
                self.check_beginning(name, what)
                self._check_taken(name, state, what)
            except UndecidedError as undecided:
                raise RejectedError(f"{what}, and {undecided} must not count for what is written") from None

    def _check_taken(self, name: str, state: State, what: str) -> None:
        """Check what is written when a sample leaves, and that nothing is otherwise."""
        memory = self._netlist.memories[name]
        address, full = address_of(memory), self._control.full
        valid = self._control.valid[state.behind]
        wanted, label = self.written(name, state)
        for logic, loaded in self.each_written(memory, state.behind, {**self.moving, full: 0, valid: 1}):
            if loaded is None:
                raise RejectedError(f"{what}, which is written when a sample leaves position {state.behind}")
            require(
                self._registers.same(logic.word(address), self.address(name), self._netlist.width(address)),
                f"{what} and be written for the {self._whose} of the sample",
            )
            right = self._registers.same(loaded, wanted, memory.width)
            require(right, f"{what} and take over {label}, not another value")
        for case in ({**self.moving, full: 1}, {**self.moving, full: 0, valid: 0}):
            for _, loaded in self.each_written(memory, NOWHERE, case):
                require(loaded is None, f"{what}, which stays while no sample leaves position {state.behind}")

    def each_written(self, memory: Memory, position: int, fixed: Case) -> list[tuple[Evaluation, Form | None]]:
        """Return the logic and what is written, in each case that is left; None where nothing is."""

        def evaluate(case: Case) -> tuple[Evaluation, Form | None]:
            logic = self._registers.at(position, case)
            loaded = logic.loaded(memory.statements)
            return logic, None if loaded is None else loaded[1]

        return [written for _, written in cases(fixed, evaluate)]


def address_of(memory: Memory) -> Expression:
    """Return the address that a memory is written at: there is one place where it is."""
    (first, *rest) = memory.statements or (None,)
    if isinstance(first, Choice) and not (rest or first.no) and len(first.yes) == 1:
        load = first.yes[0]
        if isinstance(load, Load) and isinstance(load.target, Word):
            return load.target.address
    raise RejectedError(f"{memory.name} must be written in one place")
