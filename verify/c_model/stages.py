"""The functions of a C model's stages: statement by statement, they compute the nodes of the certificate's stages.

A stage takes what the stage before it has stored, and the words of its own delays; it stores what it hands on and its
delays' next words. Nobody else writes these, so that stages may run in any order of samples that passes a result on
before it is overwritten.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sosmith.verify.c_model.cursor import Cursor
from sosmith.verify.c_model.expressions import (
    HELD,
    Form,
    Reader,
    Value,
    choice,
    fits,
    masked,
    number,
    product,
    quotient,
    shifted,
    total,
    variable,
)
from sosmith.verify.certificate_file import NodeEntry, Operation, PortEntry, StageEntry
from sosmith.verify.graph import label, require

Place = tuple[int, int]
"""A node by its stage and its index; inputs have the stage -1."""


@dataclass
class Stages:
    """The stages of a datapath, as far as they are read.

    Attributes
    ----------
    prefix : str
        What their names begin with.
    stages : sequence of StageEntry
    inputs : sequence of PortEntry
        What the first of them takes.
    words : mapping of int to str
        Types of the states, by their numbers.
    fields : dict of str to str
        Types of what is handed on, by the names of the members.
    stored : dict of str to Place
        What they hold.
    owners : dict of int to Place
        The delay of each state.
    """

    prefix: str
    stages: Sequence[StageEntry]
    inputs: Sequence[PortEntry]
    words: Mapping[int, str]
    fields: dict[str, str] = field(default_factory=dict)
    stored: dict[str, Place] = field(default_factory=dict)
    owners: dict[int, Place] = field(default_factory=dict)

    def read(self, cursor: Cursor, name: str) -> None:
        """Read the members that stages hand on, and all stages.

        Raises
        ------
        RejectedError
            If one computes anything else, or may leave a type.
        """
        cursor.expect("typedef struct {")
        while not cursor.accepts("}"):
            kind = cursor.take("|".join(HELD))
            member = cursor.take(r"\w+")
            require(member not in self.fields, f"{member} must be a member once")
            self.fields[member] = kind
            cursor.expect(";")
        cursor.expect(f"{self.prefix}wires;")
        for index, port in enumerate(self.inputs):
            member = f"{port.name}_code"
            require(member in self.fields, f"{member} must be a member")
            require(
                fits(self.fields[member], port.lowest, port.highest),
                f"{member} must hold {port.lowest}..{port.highest}, as {self.fields[member]} does not",
            )
            self.stored[member] = (-1, index)
        for index in range(len(self.stages)):
            cursor.expect(
                f"static ALWAYS_INLINE void {self.prefix}stage{index}({name}_state *state, {self.prefix}wires *w) {{"
            )
            _Body(self, cursor, index).read()
        require(set(self.stored) == set(self.fields), "each member must hold what a stage hands on")

    def member(self, place: Place) -> str:
        """Return the member that holds a node.

        Raises
        ------
        RejectedError
            If there is none.
        """
        member = next((name for name, other in self.stored.items() if other == place), None)
        require(member is not None, f"the stages must hand on {label(self.stages[place[0]], place[1])}")
        assert member is not None
        return member

    def value(self, place: Place) -> Value:
        """Return what a node or an input is worth, as a variable."""
        stage, index = place
        if stage < 0:
            port = self.inputs[index]
            return Value("", port.lowest, port.highest, variable(f"input {index}"))
        node = self.stages[stage].nodes[index]
        return Value("", node.low, node.high, variable(f"node {stage} {index}"))


class _Body:
    """The body of a stage's function."""

    def __init__(self, stages: Stages, cursor: Cursor, index: int) -> None:
        self._all, self._cursor, self._index = stages, cursor, index
        self._stage = stages.stages[index]
        self._names: dict[str, Value] = {}
        self._kinds: dict[str, str] = {}
        self._supply = list(self._taken())
        self._changed: set[int] = set()
        self._unused: set[str] = set()

    def _taken(self) -> list[Place]:
        if self._index == 0:
            return [(-1, index) for index in range(len(self._all.inputs))]
        return [(self._index - 1, output) for output in self._all.stages[self._index - 1].outputs]

    def read(self) -> None:
        for index, node in enumerate(self._stage.nodes):
            self._declare(index, node)
        require(not self._supply, f"{self._stage.name} must take all that the stage before it hands on")
        while not self._cursor.accepts("}"):
            if self._cursor.next == "state":
                self._store_state()
            elif self._cursor.next == "w":
                self._store_member()
            else:
                self._use()
        delays = {place for place in self._all.owners.values() if place[0] == self._index}
        changed = {self._all.owners[slot] for slot in self._changed}
        require(changed == delays, f"{self._stage.name} must store each of its states once")

    def _declare(self, index: int, node: NodeEntry) -> None:
        name = f"n{self._index}_{index}"
        self._cursor.expect("const")
        kind = self._cursor.take("|".join(HELD))
        self._cursor.expect(f"{name} =")
        place = (self._index, index)
        if node.op is Operation.INPUT:
            self._take_member(place)
        elif node.op is Operation.DELAY:
            self._take_state(place)
        else:
            value = self._expression(kind)
            require(
                value.form == self._wanted(node),
                f"{name} of the C model must compute {label(self._stage, index)}, and computes something else",
            )
        self._cursor.expect(";")
        self._check_type(name, kind, node)
        self._names[name] = self._all.value(place)._replace(type=kind)

    def _expression(self, kind: str) -> Value:
        """Read the expression of a node, and the conversion to its type, which keeps what the node's range allows."""
        peek = self._cursor.peek
        reader = Reader(self._cursor, self._names)
        if (self._cursor.next, peek(1), peek(2)) == ("(", kind, ")") and (peek(3) == "(" or peek(4) == ";"):
            self._cursor.expect(f"({kind})")
            return reader.primary()
        return reader.expression()

    def _check_type(self, name: str, kind: str, node: NodeEntry) -> None:
        require(
            fits(kind, node.low, node.high),
            f"{name} of the C model must hold {node.low}..{node.high}, as {kind} does not",
        )

    def _take_member(self, place: Place) -> None:
        self._cursor.expect("w->")
        member = self._cursor.take(r"\w+")
        wanted = self._supply.pop(0) if self._supply else None
        require(
            wanted is not None and self._all.stored.get(member) == wanted,
            f"{label(self._stage, place[1])} must be what the stage before it hands on, not {member}",
        )

    def _take_state(self, place: Place) -> None:
        slot = self._state()
        require(slot in self._all.words and slot not in self._all.owners, f"state {slot} must be that of one delay")
        self._all.owners[slot] = place

    def _state(self) -> int:
        """Read a state, and return its number."""
        self._cursor.expect("state->")
        return int(self._cursor.take(r"s(?:0|[1-9]\d{0,5})").removeprefix("s"))

    def _store_state(self) -> None:
        slot = self._state()
        self._cursor.expect("=")
        name = self._cursor.take(r"\w+")
        self._cursor.expect(";")
        owner = self._all.owners.get(slot, (-1, 0))
        require(
            owner[0] == self._index and slot not in self._changed, f"state {slot} must be stored once, by its stage"
        )
        source = self._stage.nodes[owner[1]].operands[0]
        require(
            name == f"n{self._index}_{source}", f"state {slot} must be stored from n{self._index}_{source}, not {name}"
        )
        node = self._stage.nodes[source]
        require(fits(self._all.words[slot], node.low, node.high), f"state {slot} must hold {node.low}..{node.high}")
        self._changed.add(slot)

    def _store_member(self) -> None:
        self._cursor.expect("w->")
        member = self._cursor.take(r"\w+")
        self._cursor.expect("=")
        name = self._cursor.take(r"\w+")
        self._cursor.expect(";")
        require(member in self._all.fields and member not in self._all.stored, f"{member} must be stored once")
        require(name in self._names, f"{name!a} must have a value where it is stored")
        index = int(name.rpartition("_")[2])
        node = self._stage.nodes[index]
        self._check_type(member, self._all.fields[member], node)
        self._all.stored[member] = (self._index, index)

    def _use(self) -> None:
        """Read a statement that does nothing but keep compilers quiet."""
        self._cursor.expect("(void)")
        name = self._cursor.take(r"\w+")
        self._cursor.expect(";")
        require(
            (name in self._names or name == "state") and name not in self._unused,
            f"{name!a} must be named once, and have a value",
        )
        self._unused.add(name)

    def _wanted(self, node: NodeEntry) -> Form:
        """Return the form of what a node is."""
        operands = [self._stage.nodes[index] for index in node.operands]
        forms = [variable(f"node {self._index} {index}") for index in node.operands]
        if node.op is Operation.CONSTANT:
            return number(node.parameter)
        if node.op in {Operation.ADD, Operation.SUBTRACT}:
            sign = 1 if node.op is Operation.ADD else -1
            a, b = (1 << node.frac - operand.frac for operand in operands)
            return total((forms[0], a), (forms[1], sign * b))
        if node.op is Operation.SCALE:
            return total((forms[0], node.parameter))
        if node.op is Operation.MULTIPLY:
            return product(forms[0], forms[1])
        if node.op is Operation.FLOOR:
            return shifted(forms[0], operands[0].frac - node.frac, operands[0].low, operands[0].high)
        if node.op is Operation.FRACTION:
            return masked(forms[0], (1 << operands[0].frac - node.parameter) - 1)
        if node.op is Operation.TRUNCATE:
            return quotient(forms[0], 1 << operands[0].frac - node.frac)
        if node.op is Operation.CLAMP:
            low, high = number(node.low), number(node.high)
            return choice("<", forms[0], low, low, choice(">", forms[0], high, high, forms[0]))
        return forms[0]  # SHIFT and BOUND keep the code
