"""A core whose clocks are followed one by one: control in numbers, data as forms.

What a register holds is a form of what a sample, and those before it, are. A register that nothing is known of holds a
variable of its own, so that whatever is proven with it holds for every value. Whether a word of a memory is written,
and which, must be a number: so must be what those who follow the clocks ask of the control.

A ring is a memory whose words are told by their distance from a pointer. The address of word d of channel c is
``(pointer + d) mod words + words c``, and two addresses of one channel are the same if their distances are the same
modulo `words`: that is all that is used of them.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.control import about
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import ONE, Form, constant, plus
from sosmith.verify.reader.syntax import Load, Statement, Word

UNKNOWN = "unknown"
"""First part of the key of a variable of which nothing is known."""


@dataclass
class State:
    """What registers and memories hold.

    Attributes
    ----------
    registers : dict of str to Form
        Those of which something is known.
    words : dict of str to dict of int to Form
        Words of each memory by their distance from the pointer, for the channel that is followed; others may be
        anything.
    """

    registers: dict[str, Form] = field(default_factory=dict)
    words: dict[str, dict[int, Form]] = field(default_factory=dict)

    def register(self, name: str) -> Form:
        """Return what a register holds.

        Raises
        ------
        RejectedError
            If nothing is known of it.
        """
        require(name in self.registers, f"{name} must follow from the samples and the clocks, not be anything")
        return self.registers[name]

    def copy(self) -> State:
        """Return a state that can change by itself."""
        return State(dict(self.registers), {name: dict(words) for name, words in self.words.items()})


class Sink(NamedTuple):
    """A case of the sink: whether there is a result, how many copies of it follow, and whether it is taken."""

    valid: int
    copies: Form
    ready: int

    @property
    def leaves(self) -> bool:
        """Whether the last copy of a result leaves."""
        return bool(self.valid and self.ready and not self.copies)

    @property
    def free(self) -> bool:
        """Whether there is room for a result at the end of the clock."""
        return not self.valid or self.leaves


class Machine:
    """The core, and where its words are.

    Parameters
    ----------
    netlist : Netlist
    forms : Forms
    words : dict of str to int
        Words of a channel in each memory that is written: those of a ring, or 1.
    channel : Form
        The channel that is followed.
    shortened : callable
        Gives the word of a net a shorter form, as `Evaluation` takes it.

    Attributes
    ----------
    netlist, forms, channel, shortened
        As given.
    pointer : Form
        What distances are counted from.
    undriven : frozenset of str
        Bits of x, which may be anything.
    """

    def __init__(
        self,
        netlist: Netlist,
        forms: Forms,
        words: Mapping[str, int],
        channel: Form,
        shortened: Callable[[Form, int, bool], Form] = lambda word, width, at_inlet: word,
    ) -> None:
        self.netlist, self.forms, self.channel, self.shortened = netlist, forms, channel, shortened
        self.pointer: Form = {}
        self.undriven = frozenset(name for name in netlist.widths if name.startswith("?"))
        self._words = words

    def clock(self, state: State, inputs: Mapping[str, Form], number: int) -> Clock:
        """Return what happens at the clock of this number; an input that is not given may be anything.

        What is not known at clocks of one number is the same, whatever else they differ in.
        """
        return Clock(self, state, inputs, number)

    def unknown(self, what: Hashable, width: int) -> Form:
        """Return a word of which nothing is known but that it is the same for the same `what`."""
        return self.forms.variable((UNKNOWN, what), 0, (1 << width) - 1)

    def distance(self, name: str, address: Form) -> int | None:
        """Return the distance of an address from the pointer; None if it is not known to be one of the channel's.

        It is known if the address is that of a word of the channel for every pointer.
        """
        if name not in self._words:
            return None
        words, forms = self._words[name], self.forms
        if words == 1:
            return 0 if address == self.channel else None
        bits = (words - 1).bit_length()
        base = plus(forms.unsigned(self.pointer, bits), self.channel, words)
        apart = plus(address, base, -1).get(ONE, 0)
        if apart != int(apart):
            return None
        place = int(apart) % words
        wanted = plus(forms.unsigned(plus(self.pointer, constant(place)), bits), self.channel, words)
        # Both are words of so many bits, which are the same if they are so modulo their number. One of more bits may
        # be that of no word: reading it, simulators have x, and FPGAs another word.
        size = 1 << (len(self.netlist.memories[name].first) - 1).bit_length()
        low, high = forms.limits(address)
        same = low >= 0 and high < size and not any(value % size for value in plus(address, wanted, -1).values())
        return place if same else None


class Clock:
    """One clock of a core: what nets have, and what registers and memories hold after it."""

    def __init__(self, machine: Machine, state: State, inputs: Mapping[str, Form], number: int) -> None:
        self._machine, self._state, self._inputs, self._number = machine, state, inputs, number
        self._netlist, self._forms = machine.netlist, machine.forms
        given = self._netlist, self._forms, self._content, machine.shortened
        self._logic = Evaluation(*given, word=self._word, cuts=machine.undriven)
        self._written: dict[str, tuple[int, Form] | None] = {}

    def net(self, name: str, low: int = 0, width: int | None = None) -> Form:
        """Return what a net has."""
        require(name in self._netlist.widths, f"the core must have a net {name}")
        return self._logic.net(name, low, width)

    def bit(self, name: str) -> int:
        """Return a net of one bit, which must be a number.

        Raises
        ------
        RejectedError
            If it depends on data, or on what is not known.
        """
        word = self._forms.unsigned(self.net(name), 1)
        require(not word.keys() - {ONE}, f"{name} must not depend on data")
        return int(word.get(ONE, 0))

    def register(self, name: str) -> Form:
        """Return what a register holds after the clock."""
        register = self._netlist.registers[name]
        try:
            return _short(self._executed(register.statements, self._content(name)), register.width)
        except RejectedError as error:
            raise about(name, error) from None

    def _executed(self, statements: Sequence[Statement], word: Form) -> Form:
        """Return what a register holds behind statements, which has held a word before."""
        for statement in statements:
            if isinstance(statement, Load):
                loaded = self._logic.loaded((statement,))
                assert loaded is not None
                word = loaded[1]
                continue
            select = self._logic.bit(statement.condition)
            if not select.keys() - {ONE}:
                word = self._executed(statement.yes if select else statement.no, word)
            else:
                yes, no = (self._executed(side, word) for side in (statement.yes, statement.no))
                word = plus(no, self._logic.product(select, plus(yes, no, -1)))
        return word

    def words(self, name: str) -> dict[int, Form]:
        """Return what is known of the words of a memory after the clock."""
        written, words = self.written(name), self._state.words.get(name, {})
        return dict(words) if written is None else {**words, written[0]: written[1]}

    def written(self, name: str) -> tuple[int, Form] | None:
        """Return the distance and the word that are written to a memory; None if nothing is.

        Raises
        ------
        RejectedError
            If it is not known whether, or where.
        """
        if name not in self._written:
            self._written[name] = self._write(name)
        return self._written[name]

    def _write(self, name: str) -> tuple[int, Form] | None:
        memory = self._netlist.memories[name]
        try:
            loaded = self._logic.loaded(memory.statements)
        except RejectedError as error:
            raise about(name, error) from None
        if loaded is None:
            return None
        target, word = loaded
        assert isinstance(target, Word)
        address = self._forms.unsigned(self._logic.word(target.address), self._netlist.width(target.address))
        place = self._machine.distance(name, address)
        if place is None:
            raise RejectedError(f"{name} must be written at a word of the channel in work")
        return place, _short(word, memory.width)

    def _content(self, name: str) -> Form:
        known = self._inputs.get(name)
        if known is None:
            known = self._state.registers.get(name)
        return self._machine.unknown((self._number, name), self._netlist.widths[name]) if known is None else known

    def _word(self, name: str, address: Form) -> Form:
        memory = self._netlist.memories[name]
        unknown = self._machine.unknown((self._number, name, frozenset(address.items())), memory.width)
        if not memory.statements:
            if not address.keys() - {ONE}:
                place = int(address.get(ONE, 0))
                return constant(memory.first[place]) if place < len(memory.first) else unknown
            of_channel = address == self._machine.channel
            return self._forms.variable(("constant", name), 0, (1 << memory.width) - 1) if of_channel else unknown
        place_of = self._machine.distance(name, address)
        word = None if place_of is None else self._state.words.get(name, {}).get(place_of)
        if word is None:
            return unknown
        written = self.written(name) if memory.unchecked else None
        return word if written is None or written[0] != place_of else unknown


def _short(word: Form, width: int) -> Form:
    """Return a word of so many bits with the coefficients that are nearest to 0; a number as it is without a sign."""
    size = 1 << width
    if not word.keys() - {ONE}:
        return constant(int(word.get(ONE, 0)) % size)
    reduced = {monomial: _nearest(value, size) for monomial, value in word.items()}
    return {monomial: value for monomial, value in reduced.items() if value}


def _nearest(value: int | Fraction, size: int) -> int | Fraction:
    """Return what is nearest to 0 of a number and all that differ from it by multiples of `size`."""
    if not isinstance(value, int) or 2 * abs(value) == size:  # of two as near, the one that it is
        return value
    rest = value % size
    return rest - size if rest > size >> 1 else rest
