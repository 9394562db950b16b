"""What each register of a pipeline holds: a word of the sample that has come as far as it, as a form.

A sample is at position k once it has moved k times; `Control.valid` says which positions hold one. A register behind
position k is loaded when the sample there moves on. What it takes over is a form of what the registers of the same
position hold for the same sample: so all are found, from the outputs back to the inputs, and none of their names
counts.

A recursion cannot be followed like that. A register with the name of a DELAY node is taken to hold that node's code for
the sample that comes next to its position, and this is proven by induction: it must be 0 at first and in reset, take
over the code of the node's operand when a sample leaves, and keep it otherwise. Seen by a sample at another position,
it belongs to a sample before or behind, by as many as there are in between::

    position         1           2           3            with a sample at 1 and at 2, and [v] behind position 2:
    sample          n+1          n          n-1           seen from 2:   v holds delay(n)
                                 [v] ------>              seen from 1:   delay(n) = the one before delay(n+1)
                                                          seen from 3:   delay(n) = the operand at n-1

What a state is about to take over, the net with its name and ``_next``, is the code of the operand for the sample at
the state's own position. Seen from a position before, while that sample moves on, it belongs to the sample before.
So do bits of another net that the state takes over as they are, where there is no such net.

A register that belongs to another position without a known number of samples in between holds nothing that is known,
unless its node lasts: then samples in between do not count.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.channel_memories import ChannelMemories
from sosmith.verify.parallel.channels import DEST
from sosmith.verify.parallel.control import RESET, Buffer, Case, Control, UndecidedError, about, cases
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.evaluation import Content, Evaluation, KnownBits, none_known
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.graph_codes import DATA, GraphCodes, fields_of
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.parallel.state_memories import State, StateMemories
from sosmith.verify.parallel.turn_memories import Counter, TurnMemories
from sosmith.verify.program.normal_form import ONE, Form, constant, plus
from sosmith.verify.reader.syntax import Bits, Choice, Statement

_MOST_OPENED = 8
"""Most variables that are replaced by what they stand for, one after the other, for one comparison."""


class _Part(NamedTuple):
    """Bits of a net."""

    name: str
    low: int
    width: int


def _parts_loaded(statements: Sequence[Statement], netlist: Netlist) -> Iterator[_Part]:
    """Yield what statements load that is a part of a net as it is."""
    for statement in statements:
        if isinstance(statement, Choice):
            yield from _parts_loaded((*statement.yes, *statement.no), netlist)
        elif isinstance(statement.value, Bits):
            yield _Part(statement.value.name, statement.value.low, netlist.width(statement.value))


class Pipeline:
    """The registers of a core.

    Parameters
    ----------
    netlist : Netlist
    control : Control
        Its control registers, which have been checked.
    graph : GraphCodes
        What it should compute.
    forms : Forms
        The atoms of `graph`.
    certificate : Certificate
        Where the fields of the input are read.
    flag_count : int
        Number of flags that come with a sample above its fields.

    Attributes
    ----------
    input_flags : list of Form
        These flags.
    forms : Forms
        The atoms.
    """

    def __init__(
        self,
        netlist: Netlist,
        control: Control,
        graph: GraphCodes,
        forms: Forms,
        certificate: Certificate,
        flag_count: int = 0,
    ) -> None:
        self._netlist, self._control, self._graph, self.forms = netlist, control, graph, forms
        self.input_flags = [forms.variable(("input flag", place), 0, 1) for place in range(flag_count)]
        self._fields = fields_of(graph, certificate, netlist.widths[DATA], self.input_flags)
        self._dependence = Dependence(netlist, control.cuts)
        self._numbers = itertools.count()
        self._behind: dict[str, int | None] = {}
        self._found: dict[str, Form] = {}
        self._second: dict[str, Form] = {}
        self._constants: dict[str, Form | None] = {}
        self._open: list[str] = []
        self._followed: set[str] = set()
        self.states: dict[str, State] = {}
        self._loads: dict[str, _Part] = {}
        self.memories: StateMemories | None = None
        self._counters: dict[str, Counter] = {}
        entrance = control.entrance
        self._source, self._apart, channels = 0, set[str](), 1
        if entrance is not None:
            self._source, self._apart, channels = -1, {entrance.word, *entrance.near}, entrance.channels
        self.channel = forms.variable("channel", 0, channels - 1)
        if entrance is not None:
            self.memories = ChannelMemories(self, netlist, control, graph, entrance)
            return
        for node in graph.delays:
            name = netlist.holder(graph.state_name(node))
            if name is not None:
                statements = netlist.registers[name].statements
                self.states[name] = State(node, self.position_by_control(name, statements))
                for part in _parts_loaded(statements, netlist):
                    self._loads[name] = part
        if graph.turned:
            turns = TurnMemories(self, netlist, control, graph, self._dependence)
            self.memories, self._counters = turns, turns.counters

    @property
    def registers(self) -> int:
        """Number of registers whose content is known."""
        names = {*self._found, *self._second, *self.states, *self._counters}
        return len({self._netlist.fields.get(name, name) for name in names})

    @property
    def last(self) -> int:
        """The position before the output buffer."""
        return len(self._control.valid) - 1

    # What is computed for a sample.

    def at(self, position: int, case: Case) -> Evaluation:
        """Return the logic as the sample at a position sees it."""
        frame = next(self._numbers)
        content = self.seen_from(position, case, frame)

        def word(name: str, address: Form) -> Form:
            if not self._netlist.memories[name].statements and address == self.channel:
                return self.constant_word(name)
            unknown = self._unknown(name, frame)
            state = None if self.memories is None else self.memories.word(name, address, position, unknown)
            return unknown if state is None else state

        def fields(name: str, low: int, width: int) -> Form | None:
            return self._field(low, width) if name == DATA and position == self._source else None

        parts, others = partial(self._part_taken_over, position, case), self._following_at(position).keys()
        return self.logic(content, word, fields=fields, parts=parts, others=others)

    def seen_from(self, position: int, case: Case, frame: int) -> Content:
        """Return what registers and inputs hold for the sample at a position; `frame` numbers what is not known."""
        following = self._following_at(position)

        def content(name: str) -> Form:
            if name in self._control.names:
                return self._control_bit(name, case)
            if name in following:
                self._followed.add(name)
                state = self._following(following[name], position, case)
                return self._unknown(name, frame) if state is None else state
            if name in {DATA, DEST}:
                return self._entering(name) if position == self._source else self._unknown(name, frame)
            require(name in self._netlist.registers, f"the port {name} must not be used here")
            if name in self.states:
                state = self._state(self.states[name], position, case)
                return self._unknown(name, frame) if state is None else state
            if name in self._counters:
                counted = self._counters[name]
                return counted.value if counted.behind == position else self._unknown(name, frame)
            if name in self._apart or position < self._source:
                return self._unknown(name, frame)
            behind = self.behind(name)
            if behind is None:
                always = self.constant_of(name) if position > 0 else None
                return self._unknown(name, frame) if always is None else always
            return self.content_of(name) if behind == position - 1 else self._unknown(name, frame)

        return content

    def _following_at(self, position: int) -> dict[str, State]:
        """Return the nets that hold, for a sample before its state, what the state is about to take over."""
        return {
            f"{name}_next": state
            for name, state in self.states.items()
            if f"{name}_next" in self._netlist.drivers and position < state.behind
        }

    def _part_taken_over(self, position: int, case: Case, *part: str | int) -> Form | None:
        """Return a part of a net that a state is about to take over as it is, for a sample before the state."""
        for name, state in self.states.items():
            if self._loads.get(name) == part and part[0] not in self.states and position < state.behind:
                following = self._following(state, position, case)
                self._followed |= set() if following is None else {f"{name}_next"}
                return following
        return None

    def constant_word(self, name: str) -> Form:
        """Return the word of a memory that never changes, for the channel of a sample."""
        return self.forms.variable(("constant", name), 0, (1 << self._netlist.memories[name].width) - 1)

    def in_front(self, known: Mapping[str, Form], opened: str) -> Evaluation:
        """Return the logic as it is while the input buffer holds a sample, where some registers hold what is `known`.

        `opened` is a control signal that is not taken as such, but as the logic that it is.
        """
        frame = next(self._numbers)

        def content(name: str) -> Form:
            if name in known:
                return known[name]
            inside = name in self._netlist.registers and name not in self._control.names | self._apart
            return self.content_of(name) if inside and self.behind(name) == self._source else self._unknown(name, frame)

        return self.logic(content, opened=opened)

    def logic(
        self,
        content: Callable[[str], Form],
        word: Callable[[str, Form], Form] | None = None,
        *,
        opened: str = "",
        fields: KnownBits = none_known,
        parts: KnownBits = none_known,
        others: Set[str] = frozenset(),
    ) -> Evaluation:
        """Return the logic where registers, inputs, `others` hold what `content` says, memories what `word` does."""
        cuts = (self._control.cuts - {opened}) | others
        given = (self._netlist, self.forms, content, self._graph.shortened)
        return Evaluation(*given, word=word, cuts=cuts, fields=fields, parts=parts)

    def content_of(self, name: str) -> Form:
        """Return what a register holds while there is a sample at its position.

        Raises
        ------
        RejectedError
            If it is not loaded whenever a sample moves on, or then not always with the same.
        """
        if name not in self._found:
            behind = self.behind(name)
            always = self.constant_of(name) if behind is None else None
            require(behind is not None or always is not None, f"{name} must hold a word of a sample, or one constant")
            with self._once(name):
                self._found[name] = self._taken_over(name) if always is None else always
        return self._found[name]

    def constant_of(self, name: str) -> Form | None:
        """Return what a register of no position holds while there is a sample inside; None if that may be anything.

        A sample has moved there since the last reset: what the register takes over whenever samples move is there, too.
        """
        if name not in self._constants:
            with self._once(name):
                moving = [*self._all_taken(name, 1, {RESET: 1, self._control.full: 0})]
                standing = [*self._all_taken(name, 1, {RESET: 1, self._control.full: 1})]
            word = moving[0]
            same = all(other == word for other in moving) and all(other in (None, word) for other in standing)
            self._constants[name] = word if same and word is not None and not word.keys() - {ONE} else None
        return self._constants[name]

    def behind(self, name: str) -> int | None:
        """Return the position that a register is loaded behind; None if it only ever takes over constants."""
        require(name in self._netlist.registers, f"{name} must not be used for data")
        if name not in self._behind:
            with self._once(name):
                self._behind[name] = self._position(name)
        return self._behind[name]

    def same(self, a: Form, b: Form, width: int) -> bool:
        """Whether two words are proven to be the same, if need be by opening what stages hand on."""
        pair: tuple[Form, Form] | None = self._graph.shortened(a, width), self._graph.shortened(b, width)
        for _ in range(_MOST_OPENED):
            if pair is None or same_word(self.forms, *pair, width):
                break
            pair = self._graph.opened(*pair)
        else:
            return False
        return pair is not None

    # The output buffer.

    def buffered(self) -> Evaluation:
        """Return the logic as it is while the output buffer holds a sample: the one that leaves next."""
        frame = next(self._numbers)

        def content(name: str) -> Form:
            if name in self._control.names or name not in self._netlist.registers:
                return self._unknown(name, frame)
            if name not in self._found:
                self._found[name] = self._first_of_two(name, self._control.output, self.last)
            return self._found[name]

        return self.logic(content)

    def _first_of_two(self, name: str, buffer: Buffer, position: int) -> Form:
        """Return what a register of a buffer behind a position holds of the sample that leaves it next."""
        fixed = {RESET: 1, buffer.full: 0, buffer.coming: 1}
        loaded = [
            self._one_of(name, position, {**fixed, buffer.valid: valid, buffer.ready: ready})
            for valid, ready in ((0, 0), (0, 1), (1, 1))
        ]
        for other in loaded[1:]:
            self._require_same(name, loaded[0], other, "whether the buffer is empty or not")
        for full in (0, 1):
            self._require_kept(name, position, {RESET: 1, buffer.valid: 1, buffer.ready: 0, buffer.full: full})
        case = {RESET: 1, buffer.full: 1, buffer.valid: 1, buffer.ready: 1}
        seconds = self._seconds(buffer, position)
        for _, moved in cases(case, lambda each: self._loaded(name, seconds, each)):
            if moved is None:
                raise RejectedError(f"{name} must take over the second sample when the first leaves")
            self._require_same(name, loaded[0], moved, "from the pipeline and from the second place")
        return loaded[0]

    def _seconds(self, buffer: Buffer, position: int) -> Callable[[Case], Evaluation]:
        """Return the logic as it is while a buffer holds a second sample."""
        frame = next(self._numbers)

        def of(case: Case) -> Evaluation:
            def content(name: str) -> Form:
                if name in self._control.names:
                    return self._control_bit(name, case)
                if name not in self._netlist.registers or name in self.states or name in self._counters:
                    return self._unknown(name, frame)
                if name not in self._second:
                    stays = {RESET: 1, buffer.valid: 1, buffer.ready: 0}
                    self._second[name] = self._one_of(name, position, {**stays, buffer.full: 0, buffer.coming: 1})
                    self._require_kept(name, position, {**stays, buffer.full: 1})
                return self._second[name]

            return self.logic(content)

        return of

    # What registers take over.

    def _taken_over(self, name: str) -> Form:
        behind = self.behind(name)
        assert behind is not None
        valid, entrance = self._control.valid, self._control.entrance
        if behind < 0 and entrance is not None:
            return self._first_of_two(name, entrance.buffer, behind)
        require(behind < self.last, f"{name} must hold a word of a sample inside the pipeline")
        word = self._one_of(name, behind, {RESET: 1, self._control.full: 0, valid[behind]: 1})
        self._require_kept(name, behind, {RESET: 1, self._control.full: 1, valid[behind + 1]: 1})
        return word

    def _one_of(self, name: str, position: int, fixed: Case) -> Form:
        """Return what a register takes over from a position: the same in all cases that are left."""
        words: list[Form] = []
        for loaded in self._all_taken(name, position, fixed):
            if loaded is None:
                raise RejectedError(f"{name} must be loaded whenever a sample leaves position {position}")
            words.append(loaded)
        for other in words[1:]:
            self._require_same(name, words[0], other, "whatever other positions hold")
        return words[0]

    def _loaded(self, name: str, logic: Callable[[Case], Evaluation], case: Case) -> Form | None:
        """Return what a register takes over at the next clock; None if it keeps what it holds."""
        register = self._netlist.registers[name]
        try:
            loaded = logic(case).loaded(register.statements)
        except RejectedError as error:
            raise about(name, error) from None
        return None if loaded is None else loaded[1]

    def _require_kept(self, name: str, position: int, fixed: Case) -> None:
        for loaded in self._all_taken(name, position, fixed):
            require(loaded is None, f"{name} must keep what it holds while its sample stays")

    def _require_same(self, name: str, a: Form, b: Form, always: str) -> None:
        require(self.same(a, b, self._netlist.widths[name]), f"{name} must take over the same {always}")

    def computed(self, name: str) -> Form | None:
        """Return what a net is for the sample whose words it is made of; None if it is made of states alone."""
        if name in self.states or name in self._counters:
            return None
        if name in self._netlist.registers:
            return self.content_of(name)
        leaves = self._dependence.of_net(name)
        if any(leaf.startswith(f"{name}_passed") for leaf in leaves):
            return None  # by way of what a state is about to take over from a later position
        sources = self._positions_of(leaves)
        if len(sources) != 1:
            return None
        (position,) = sources
        fixed = {RESET: 1, self._control.full: 0, self._control.valid[position]: 1}
        words = [word for _, word in cases(fixed, lambda case: self.at(position, case).net(name))]
        return words[0]

    def codes_of(self, bits: Bits) -> Iterator[Form]:
        """Yield what bits of a net are for a sample at each position where that is the same in all cases."""
        width = self._netlist.width(bits)
        for position in range(self._source, len(self._control.valid)):
            fixed = {RESET: 1, self._control.full: 0}
            if position >= 0:
                fixed[self._control.valid[position]] = 1
            try:
                words = [word for _, word in cases(fixed, partial(self._part_at, bits, position))]
                if all(self.same(words[0], word, width) for word in words[1:]):
                    yield words[0]
            except RejectedError:
                continue

    def check_states(self) -> None:
        """Prove by induction that each state holds the code of its DELAY node.

        Raises
        ------
        RejectedError
            If one does not.
        """
        for name in self.states:
            self._check_state(name)
        if self.memories is not None:
            self.memories.check()

    def check_followed(self) -> None:
        """Prove that what states are about to take over is that, where it was used.

        Raises
        ------
        RejectedError
            If it is not.
        """
        for name, state in self.states.items():
            if f"{name}_next" not in self._followed:
                continue
            (source,) = self._graph.nodes[state.node].operands
            wanted = self._graph.seen(source, self._graph.nodes[state.node].stage)
            net, full, valid = f"{name}_next", self._control.full, self._control.valid[state.behind]
            part = _Part(net, 0, self._netlist.widths[net]) if net in self._netlist.drivers else self._loads[name]
            fixed = {RESET: 1, full: 0, valid: 1}
            for _, word in cases(fixed, partial(self._part_at, part, state.behind)):
                right = self.same(word, wanted, part.width)
                require(right, f"{net} must be {self._graph.nodes[source].label}, not another value")

    def _part_at(self, part: _Part | Bits, position: int, case: Case) -> Form:
        return self.at(position, case).net(part.name, part.low, part.width)

    def _check_state(self, name: str) -> None:
        state, register = self.states[name], self._netlist.registers[name]
        node, full = self._graph.nodes[state.node], self._control.full
        valid = self._control.valid[state.behind]
        what = f"{name} must hold {node.label}"
        require(register.first == 0, f"{what}, which is 0 at first, not {register.first}")
        for loaded in self._all_taken(name, -1, {RESET: 0}):
            require(loaded == constant(0), f"{what}, which is 0 after a reset, not another value")
        (source,) = node.operands
        require(
            self.same(
                self._one_of(name, state.behind, {RESET: 1, full: 0, valid: 1}),
                self._graph.seen(source, node.stage),
                register.width,
            ),
            f"{what} and take over {self._graph.nodes[source].label}, not another value",
        )
        for case in ({RESET: 1, full: 1}, {RESET: 1, full: 0, valid: 0}):
            for loaded in self._all_taken(name, -1, case):
                require(loaded is None, f"{what}, which stays while no sample leaves position {state.behind}")

    def _all_taken(self, name: str, position: int, fixed: Case) -> Iterator[Form | None]:
        """Yield what a register takes over from a position in each case that is left, None where it is not loaded."""
        for _, loaded in cases(fixed, lambda case: self._loaded(name, lambda c: self.at(position, c), case)):
            yield loaded

    # Where registers are.

    def _position(self, name: str) -> int | None:
        """Return the position that a register is loaded behind: by the valid bit that loads it, or by its sources."""
        conditions = self._dependence.of_conditions(self._netlist.registers[name].statements)
        if conditions & set(self._control.valid):
            return self.position_by_control(name, self._netlist.registers[name].statements)
        leaves = self._dependence.of_loads(self._netlist.registers[name].statements) - self._control.names
        if self._source < 0 and leaves & {DATA, DEST}:
            return self._source
        if not leaves:
            return None
        sources = self._positions_of(leaves) or {
            contents[leaf].behind for contents in (self.states, self._counters) for leaf in leaves & contents.keys()
        }
        require(len(sources) < 2, f"{name} must take over a word of one sample, not of {len(sources)}")
        return sources.pop() if sources else None

    def _positions_of(self, leaves: frozenset[str]) -> set[int]:
        """Return the positions whose samples registers and inputs hold, without states."""
        passed = leaves - self._control.names - self.states.keys() - self._counters.keys()
        positions = {self._source if leaf in {DATA, DEST} else self._position_of(leaf) for leaf in passed}
        return {position for position in positions if position is not None}

    def _position_of(self, name: str) -> int | None:
        """Return the position whose sample a register holds."""
        behind = self.behind(name)
        return None if behind is None else behind + 1

    def position_by_control(self, name: str, statements: Sequence[Statement]) -> int:
        """Return the position behind which statements load something: there is one valid bit among their conditions."""
        bits = sorted(self._dependence.of_conditions(statements) & set(self._control.valid))
        require(len(bits) == 1, f"{name} must be loaded by one valid bit, not by {', '.join(bits) or 'none'}")
        return self._control.valid.index(bits[0])

    # What is read.

    def _control_bit(self, name: str, case: Case) -> Form:
        if name not in case:
            raise UndecidedError(name)
        return constant(case[name])

    def _entering(self, name: str) -> Form:
        """Return the input: the channel, which exists, or the fields' codes and bits that mean nothing."""
        return self.channel if name == DEST else self._samples()

    def _samples(self) -> Form:
        total: Form = {}
        for field in self._fields:
            total = plus(total, field.word, 1 << field.offset)
        return total

    def _field(self, low: int, width: int) -> Form | None:
        """Return bits of the input that lie within one field."""
        for field in self._fields:
            if field.offset <= low and low + width <= field.offset + field.width:
                return self.forms.floor(shifted(field.word, field.offset - low))
        return None

    def _state(self, state: State, position: int, case: Case) -> Form | None:
        """Return what a state holds, as the sample at a position sees it; None if that is not known."""
        node, ago = self._graph.origin(state.node)
        valid = self._control.valid
        if position < 0:
            return None
        if position <= state.behind:
            between = range(position + 1, state.behind + 1)
            return self._graph.past((node, ago + self._samples_in(between, case)))
        if ago == 1 and self._graph.lasts(node):
            return self._graph.past((node, 0))
        between = range(state.behind + 1, position)
        require(position < len(valid), "a position must be inside the pipeline")
        return self._graph.past((node, ago - 1 - self._samples_in(between, case)))

    def _following(self, state: State, position: int, case: Case) -> Form | None:
        """Return what a state is about to take over, as the sample at a position before sees it; None if not known."""
        node, ago = self._graph.origin(state.node)
        control = self._control
        if position < 0 or state.behind >= len(control.valid):
            return None
        for name, wanted in ((control.full, 0), (control.valid[state.behind], 1)):
            if name not in case:
                raise UndecidedError(name)
            if case[name] != wanted:
                return None
        between = range(position + 1, state.behind)
        return self._graph.past((node, ago + self._samples_in(between, case)))

    def _samples_in(self, positions: Iterable[int], case: Case) -> int:
        count = 0
        for position in positions:
            name = self._control.valid[position]
            if name not in case:
                raise UndecidedError(name)
            count += case[name]
        return count

    def _unknown(self, name: str, frame: int) -> Form:
        memory = self._netlist.memories.get(name)
        width = self._netlist.widths[name] if memory is None else memory.width
        return self.forms.variable(("unknown", name, frame), 0, (1 << width) - 1)

    @contextmanager
    def _once(self, name: str) -> Iterator[None]:
        """Refuse a register that is asked for while it is being found."""
        if name in self._open:
            raise RejectedError(f"{name} must not depend on itself, for it is no state of the graph")
        self._open.append(name)
        try:
            yield
        finally:
            self._open.remove(name)
