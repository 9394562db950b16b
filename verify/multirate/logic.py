"""What the logic around a core computes, case by case, and what it must be.

Every signal that counts lies in one of its ranges: bits are 0 or 1, of a counter its ends are told apart, and of a word
often nothing. Where a signal turns out to count, each of its ranges is a case of its own.

An undefined value, ``1'hx``, may be either: what is said holds for both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, Protocol

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.connections import BEHIND
from sosmith.verify.parallel.control import RESET, Case, UndecidedError, about, cases
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.reader.syntax import Word

Ranges = Sequence[tuple[int, int]]
"""Ranges that make up all values of a signal, told apart by the cases."""

BIT: Ranges = ((0, 0), (1, 1))


class Field(NamedTuple):
    """A part of a word: the signal whose bits it is, their number, and the lowest of them."""

    signal: str
    width: int
    low: int = 0


class RegisterShape(NamedTuple):
    """A register: its width, and what it holds before the first clock and after a reset; None if that does not count.

    Without a width, it may have any.
    """

    width: int | None
    first: int | None


class MemoryShape(NamedTuple):
    """The width of a memory's words, and their number."""

    width: int
    depth: int


class Written(NamedTuple):
    """What is written to a memory: where, and a word."""

    address: Form
    word: Form


class Signals(NamedTuple):
    """What nets and registers are made of, if not of a value of their own.

    Attributes
    ----------
    layout : dict of str to sequence of Field
        The parts of words; what is above the last may be anything.
    one_hot : dict of str to (str, int)
        Registers that are 1 just while a signal has a value.
    """

    layout: Mapping[str, Sequence[Field]]
    one_hot: Mapping[str, tuple[str, int]] = MappingProxyType({})


class Part(Protocol):
    """What is checked of a part of the hardware."""

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """Its registers."""

    @property
    def nets(self) -> Mapping[str, int]:
        """Its nets that are checked, and their widths."""

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """Signals of several bits whose values are told apart."""

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what a register must hold after the clock if there is no reset, or a net within the clock."""


class MemoryPart(Part, Protocol):
    """What is checked of a part with memories."""

    @property
    def memories(self) -> Mapping[str, MemoryShape]:
        """Its memories."""

    def written(self, now: Logic, memory: str) -> Written | None:
        """Return what must be written to a memory at the clock; None if nothing."""


def check_parts(netlist: Netlist, parts: Sequence[Part], signals: Signals, remembers: MemoryPart | None = None) -> int:
    """Check the shell around a core; return its number of registers.

    Parameters
    ----------
    netlist : Netlist
        Everything but the core itself.
    parts : sequence of Part
        What it must be.
    signals : Signals
        What inputs, registers, and outputs of a core are made of.
    remembers : MemoryPart or None
        That of the parts that has memories.

    Raises
    ------
    RejectedError
        If there is anything else: the sentence names the first register or net that is wrong.
    """
    registers = {name: register_shape for part in parts for name, register_shape in part.registers.items()}
    memories: Mapping[str, MemoryShape] = {} if remembers is None else remembers.memories
    written = {name for name, memory in netlist.memories.items() if memory.statements}
    require(
        netlist.registers.keys() == registers.keys() and written == memories.keys(),
        f"the registers around the core must be {', '.join(sorted({*registers, *memories}))}, not "
        f"{', '.join(sorted({*netlist.registers, *written}))}",
    )
    for name, register_shape in registers.items():
        width, first = netlist.registers[name].width, netlist.registers[name].first
        require(
            register_shape.first in {None, first},
            f"{name} must be {register_shape.first} before the first clock, not {first}",
        )
        require(register_shape.width in {None, width}, f"{name} must have {register_shape.width} bits, not {width}")
    ranges = {name: limits for part in parts for name, limits in part.ranges.items()}
    for name in ranges.keys() & registers.keys():
        assert ranges[name][-1][1] == (1 << netlist.widths[name]) - 1  # as these are all values
    for part in parts:
        for name, width in part.nets.items():
            own = netlist.widths.get(name)
            require(own == width, f"{name} must have {width} bits, not {own or 'none'}")
        for name in (*part.nets, *part.registers):
            _check(netlist, signals, ranges, part, name)
    for name, shape in memories.items():
        memory = netlist.memories[name]
        own_shape = MemoryShape(memory.width, len(memory.first))
        require(own_shape == shape, f"{name} must have {shape.depth} words of {shape.width} bits")
        assert remembers is not None
        _check_memory(netlist, signals, ranges, remembers, name)
    return len(registers)


def _check_memory(
    netlist: Netlist, signals: Signals, ranges: Mapping[str, Ranges], part: MemoryPart, name: str
) -> None:
    """Check what is written to a memory at a clock, in all cases."""
    shape = part.memories[name]

    def right(case: Case) -> bool:
        now = Logic(netlist, signals, case, ranges)
        written, wanted = now.written(name, (shape.depth - 1).bit_length()), part.written(now, name)
        if written is None or wanted is None:
            return written == wanted
        there = same_word(now.forms, written.address, wanted.address, (shape.depth - 1).bit_length())
        return there and same_word(now.forms, written.word, wanted.word, shape.width)

    _in_all_cases(right, ranges, name, " after a clock")


def _check(netlist: Netlist, signals: Signals, ranges: Mapping[str, Ranges], part: Part, name: str) -> None:
    """Check a register after a clock, or a net within one, in all cases."""

    def right(case: Case) -> bool:
        now = Logic(netlist, signals, case, ranges)
        register = name in netlist.registers
        word = now.after(name) if register else now.net(name)
        if register and not now.bit(RESET):
            first = part.registers[name].first
            return first is None or same_word(now.forms, word, constant(first), netlist.widths[name])
        return same_word(now.forms, word, part.wanted(now, name), netlist.widths[name])

    _in_all_cases(right, ranges, name, " after a clock" * (name in netlist.registers))


def _in_all_cases(right: Callable[[Case], bool], ranges: Mapping[str, Ranges], name: str, when: str) -> None:
    """Reject the register, memory or net `name` unless it is `right` in each case."""

    def values(signal: str) -> range:
        return range(len(ranges.get(signal, BIT)))

    for case, same in cases({}, right, values):
        if not same:
            stated = ", ".join(f"{signal} = {_shown(ranges.get(signal, BIT)[k])}" for signal, k in case.items())
            when += f" with {stated}" if stated else ""
            raise RejectedError(f"{name} must be what a decimator has there{when}, not another value")


def _shown(limits: tuple[int, int]) -> str:
    low, high = limits
    return f"{low}" if low == high else f"{low}..{high}"


class Logic:
    """All nets of the core but for what is behind, in one case: each control signal lies in one of its ranges."""

    def __init__(self, netlist: Netlist, signals: Signals, case: Case, ranges: Mapping[str, Ranges]) -> None:
        self.forms = Forms()
        self._netlist, self._case, self._ranges = netlist, case, ranges
        self._layout, self._one_hot = signals
        undriven = {name for name in netlist.widths if name not in netlist.drivers and name not in netlist.registers}
        self._nets = Evaluation(netlist, self.forms, self.word, word=self.read, cuts=undriven, fields=self._field)

    def limits(self, name: str) -> tuple[int, int]:
        """Return the limits of a register, an input, or what leaves the core behind, in this case.

        Raises
        ------
        UndecidedError
            If the case says nothing of this signal, and it is one that must be told apart.
        """
        if name in self._one_hot:
            signal, value = self._one_hot[name]
            bit = int(self.limits(signal) == (value, value))
            return bit, bit
        width = self._netlist.widths.get(name)
        if name not in self._ranges:
            if width is None:
                raise RejectedError(f"there must be a {name}")
            if width > 1:
                return 0, (1 << width) - 1
        if name not in self._case:
            raise UndecidedError(name)
        return self._ranges.get(name, BIT)[self._case[name]]

    def width(self, name: str) -> int:
        """Return the width of a net."""
        return self._netlist.widths[name]

    def word(self, name: str) -> Form:
        """Return what it holds."""
        if name not in self._layout:
            return self.signal(name)
        total: Form = {}
        done, width = 0, self._netlist.widths[name]
        for field in self._layout[name]:
            total = plus(total, self._part(field), 1 << done)
            done += field.width
        require(done <= width, f"{name} must have {done} bits, not {width}")
        return plus(total, self.forms.variable(("rest", name), 0, (1 << width - done) - 1), 1 << done)

    def _field(self, name: str, low: int, width: int) -> Form | None:
        """Return bits of a word that are just one of its parts, of which alone something must be known then."""
        done = 0
        for field in self._layout.get(name, ()):
            if (done, field.width) == (low, width):
                return self._part(field)
            done += field.width
        return None

    def _part(self, field: Field) -> Form:
        signal, bits, low = field
        return self.forms.unsigned(self.forms.floor(shifted(self.signal(signal), -low)), bits)

    def signal(self, name: str) -> Form:
        """Return the value of a signal that is a net or a field of one."""
        return self.forms.variable(name, *self.limits(name))

    def bit(self, name: str) -> int:
        """Return a signal of one bit."""
        low, high = self.limits(name)
        require(low == high, f"{name} must have one bit")
        return low

    def net(self, name: str) -> Form:
        """Return what a net has within the clock."""
        require(name in self._netlist.widths, f"there must be a {name}")
        return self._nets.net(name)

    def result(self, word: Form, bits: int) -> Form:
        """Return a word whose low bits are the result: that of the core as it leaves it, low among those of one output.

        What is above them, signs and flags, is left as it is.

        Raises
        ------
        RejectedError
            If there is more than one such output in it.
        """
        names = self.forms.keys(self.forms.unsigned(word, bits))
        name = next(iter(names), None)
        if len(names) != 1 or not isinstance(name, str) or not name.startswith(BEHIND):
            raise RejectedError("the result must be one output of the core")
        require(self.width(name) >= bits, f"{name} must have at least {bits} bits, not {self.width(name)}")
        return plus(self.forms.unsigned(self.word(name), bits), self.forms.floor(shifted(word, -bits)), 1 << bits)

    def read(self, memory: str, address: Form) -> Form:
        """Return what a memory has at an address: anything, but the same at the same one."""
        width = self._netlist.memories[memory].width
        return self.forms.variable((memory, frozenset(address.items())), 0, (1 << width) - 1)

    def written(self, memory: str, bits: int) -> Written | None:
        """Return what is written to a memory at the clock, if anything is; its address must have so many bits."""
        try:
            loaded = self._nets.loaded(self._netlist.memories[memory].statements)
        except RejectedError as error:
            raise about(memory, error) from None
        if loaded is None:
            return None
        target, word = loaded
        assert isinstance(target, Word)
        width = self._netlist.width(target.address)
        require(width == bits, f"the address of {memory} must have {bits} bits, not {width}")
        return Written(self.forms.unsigned(self._nets.word(target.address), bits), word)

    def after(self, name: str) -> Form:
        """Return what a register holds after the clock."""
        require(name in self._netlist.registers, f"there must be a register {name}")
        try:
            loaded = self._nets.loaded(self._netlist.registers[name].statements)
        except RejectedError as error:
            raise about(name, error) from None
        return self.word(name) if loaded is None else loaded[1]
