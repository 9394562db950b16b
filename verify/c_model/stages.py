"""The functions of a C model's stages: statement by statement, they compute what the certificate's stages do.

A stage takes what the stage before it has stored, and words of its own; it stores what it hands on, and each of its
words once. Nobody else writes these, so that stages may run in any order of samples that passes a result on before it
is overwritten. A name ``n<stage>_<node>`` has the value of that node, and ``n<stage>_<node>s<k>`` that times ``2**k``:
where it is declared, its expression has to have that form. A word that is read as a node holds its value in every
sample if what is stored has a past that is that node: at the first sample both are 0.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sosmith.verify.c_model.cursor import Cursor
from sosmith.verify.c_model.expressions import HELD, Reader, Value, fits
from sosmith.verify.c_model.forms import Form, scaled
from sosmith.verify.c_model.worths import Place, Worths
from sosmith.verify.certificate_file import PortEntry, StageEntry
from sosmith.verify.graph import label, require

_NAME = r"n(0|[1-9]\d{0,5})_(0|[1-9]\d{0,5})(?:s([1-9]\d?))?"
"""A node, and the power of two that it is times."""


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
        What they hold; of a node times a power of two, the index -1.
    forms : dict of str to Form
        The forms of that.
    owners : dict of int to (int, Form)
        The stage of each state, and what it holds where it is read.
    """

    prefix: str
    stages: Sequence[StageEntry]
    inputs: Sequence[PortEntry]
    words: Mapping[int, str]
    fields: dict[str, str] = field(default_factory=dict)
    stored: dict[str, Place] = field(default_factory=dict)
    forms: dict[str, Form] = field(default_factory=dict)
    owners: dict[int, tuple[int, Form]] = field(default_factory=dict)

    def read(self, cursor: Cursor, name: str) -> None:
        """Read the members that stages hand on, and all stages.

        Raises
        ------
        RejectedError
            If one computes anything else, or may leave a type.
        """
        declared = {(int(match[1]), int(match[2])) for match in cursor.following("const", _NAME)}
        self.worths = Worths(self.stages, self.inputs, declared)
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
            self.forms[member] = self.worths.input(index)
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
        form = self.worths.worth(place)
        members = [name for name, (stage, _) in self.stored.items() if stage == place[0] and self.forms[name] == form]
        require(bool(members), f"the stages must hand on {label(self.stages[place[0]], place[1])}")
        return members[0]


class _Body:
    """The body of a stage's function."""

    def __init__(self, stages: Stages, cursor: Cursor, index: int) -> None:
        self._all, self._cursor, self._index = stages, cursor, index
        self._stage = stages.stages[index]
        self._worths = stages.worths
        self._names: dict[str, Value] = {}
        self._nodes: dict[str, Place] = {}
        self._changed: set[int] = set()
        self._unused: set[str] = set()

    def read(self) -> None:
        while self._cursor.next == "const":
            self._declare()
        while not self._cursor.accepts("}"):
            if self._cursor.next == "state":
                self._store_state()
            elif self._cursor.next == "w":
                self._store_member()
            else:
                self._use()
        own = {slot for slot, (stage, _) in self._all.owners.items() if stage == self._index}
        require(self._changed == own, f"{self._stage.name} must store each of its states once")

    def _declare(self) -> None:
        self._cursor.expect("const")
        kind = self._cursor.take("|".join(HELD))
        name = self._cursor.take(_NAME)
        parts = re.fullmatch(_NAME, name, re.ASCII)
        assert parts is not None, "the cursor takes nothing else"
        stage, index, exponent = (int(part or 0) for part in parts.groups())
        require(
            stage == self._index and index < len(self._stage.nodes) and name not in self._names,
            f"{name} must be a node of {self._stage.name}, and declared once",
        )
        self._cursor.expect("=")
        place, node = (stage, index), self._stage.nodes[index]
        wanted = scaled(self._worths.computed(place), 1 << exponent)
        if self._cursor.next == "w":
            self._take_member(place, wanted)
        elif self._cursor.next == "state":
            self._take_state(wanted)
        else:
            require(
                self._expression(kind).form == wanted,
                f"{name} of the C model must compute {label(self._stage, index)}, and computes something else",
            )
        self._cursor.expect(";")
        low, high = node.low << exponent, node.high << exponent
        require(fits(kind, low, high), f"{name} of the C model must hold {low}..{high}, as {kind} does not")
        self._names[name] = Value(kind, low, high, scaled(self._worths.worth(place), 1 << exponent))
        self._nodes[name] = place if exponent == 0 else (stage, -1)

    def _expression(self, kind: str) -> Value:
        """Read the expression of a node, and the conversion to its type, which keeps what the node's range allows."""
        peek = self._cursor.peek
        reader = Reader(self._cursor, self._names, self._worths.forms)
        if (self._cursor.next, peek(1), peek(2)) == ("(", kind, ")") and (peek(3) == "(" or peek(4) == ";"):
            self._cursor.expect(f"({kind})")
            return reader.primary()
        return reader.expression()

    def _take_member(self, place: Place, wanted: Form) -> None:
        self._cursor.expect("w->")
        member = self._cursor.take(r"\w+")
        stage, _ = self._all.stored.get(member, (-2, 0))
        require(
            stage == self._index - 1 and self._all.forms[member] == wanted,
            f"{label(self._stage, place[1])} must be what the stage before it hands on, not {member}",
        )

    def _take_state(self, wanted: Form) -> None:
        slot = self._state()
        require(slot in self._all.words and slot not in self._all.owners, f"state {slot} must be read once")
        self._all.owners[slot] = (self._index, wanted)

    def _state(self) -> int:
        """Read a state, and return its number."""
        self._cursor.expect("state->")
        return int(self._cursor.take(r"s(?:0|[1-9]\d{0,5})").removeprefix("s"))

    def _store_state(self) -> None:
        slot = self._state()
        value = self._stored()
        stage, wanted = self._all.owners.get(slot, (-1, ()))
        require(stage == self._index and slot not in self._changed, f"state {slot} must be stored once, by its stage")
        require(
            self._worths.forms.past(value.form) == wanted,
            f"state {slot} must be stored as it is read a sample later, and holds something else",
        )
        require(fits(self._all.words[slot], value.low, value.high), f"state {slot} must hold {value.low}..{value.high}")
        self._changed.add(slot)

    def _stored(self) -> Value:
        """Read what is stored, and return its value."""
        self._cursor.expect("=")
        name = self._cursor.take(r"\w+")
        self._cursor.expect(";")
        require(name in self._names, f"{name!a} must have a value where it is stored")
        self._last = name
        return self._names[name]

    def _store_member(self) -> None:
        self._cursor.expect("w->")
        member = self._cursor.take(r"\w+")
        value = self._stored()
        require(member in self._all.fields and member not in self._all.stored, f"{member} must be stored once")
        require(
            fits(self._all.fields[member], value.low, value.high),
            f"{member} must hold {value.low}..{value.high}, as {self._all.fields[member]} does not",
        )
        self._all.stored[member] = self._nodes[self._last]
        self._all.forms[member] = value.form

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
