"""What moves in a unit that runs a program: all its states between two samples, one after the other.

The control of a unit is finite: where it is in its program, which instructions are in its pipeline, whether a result
waits. So all of its states are visited, from a reset on, for every behavior of source and sink, beside a small machine
that says what ought to happen::

    position    next instruction of the program to be fetched
    pipe        numbers of the instructions in the pipeline stages, None where there is none
    begun       whether a sample is in work that has not been accepted yet: the source has to keep it there
    refused     whether a sample is on offer whose channel does not exist
    waiting     whether a result is on offer

In each state the registers must be what the machine says: every valid bit, and every instruction that is there. Data
is unknown all the while. Where it decides, as the digits of a factor do in serial, both ways are followed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.netlist import Memory, Netlist
from sosmith.verify.program.text import Instruction, ProgramText
from sosmith.verify.reader.syntax import Bits, Choice, Expression, Load, Word
from sosmith.verify.unit.ternary import UNKNOWN, Ternary, Trits, Values, known

RESET, SOURCE, SINK, DEST = "aresetn", "s_axis_tvalid", "m_axis_tready", "s_axis_tdest"
READY, VALID = "s_axis_tready", "m_axis_tvalid"
DONE = "done"
_MOST_STATES = 200_000
_CLEARS = frozenset({"finish", "judge", "take"})
"""Ends of instructions after which nothing is left in the accumulator."""


class Stages(NamedTuple):
    """Pipeline stages of a unit, the first of which is 1.

    Attributes
    ----------
    address, reading, early, last : int
        Where an instruction addresses its word, has it, where MOVE and TAKE write, and where all else happens.
    """

    address: int
    reading: int
    early: int
    last: int


FOLDED, SERIAL = Stages(2, 3, 4, 5), Stages(1, 2, 2, 3)
TWO_PRODUCTS = Stages(2, 3, 6, 6)
"""Stages of a folded unit with two products a clock, where MOVE and TAKE write with all others."""

READS = ("read", "second_read")
"""The words that an instruction has read, of which a unit with one product a clock has one."""


class Machine(NamedTuple):
    """The state that a unit ought to be in; see the module."""

    pipe: tuple[int | None, ...]
    position: int = 0
    begun: bool = False
    refused: bool = False
    waiting: bool = False


class Node(NamedTuple):
    """A state: the control registers in their order, and the machine."""

    registers: tuple[Trits, ...]
    machine: Machine


class Event(NamedTuple):
    """What happens at a clock.

    Attributes
    ----------
    advance : bool
        Whether the pipeline moves.
    begins, accepted, ends, leaves : bool
        Whether the first instruction of a sample is fetched, a sample is handed over, the last instruction of one is in
        the last stage and done, and a result is handed over.
    offered : bool
        Whether a sample is on offer.
    ready : bool
        Whether the sink is.
    """

    advance: bool
    begins: bool
    accepted: bool
    ends: bool
    leaves: bool
    offered: bool
    ready: bool


class Step(NamedTuple):
    """A clock: from which state, to which one, and what happens."""

    before: int
    after: int
    event: Event


Observer = Callable[[int, Machine, Event, Values], None]
"""Called at each clock with the number of its step, the machine before, what happens, and the nets."""


@dataclass(frozen=True)
class Write:
    """The write port of a memory."""

    enable: Expression
    address: Expression
    data: Expression


@dataclass(frozen=True)
class Read:
    """A register that a memory is read to: None for `enable` at every clock."""

    register: str
    enable: Expression | None
    address: Expression


def write_port(memory: Memory) -> Write:
    """Return the only write port of a memory.

    Raises
    ------
    RejectedError
        If it is written otherwise.
    """
    match memory.statements:
        case (Choice(enable, (Load(Word(_, address), data),), ()),):
            return Write(enable, address, data)
    raise RejectedError(f"{memory.name} must be written at one place, under one condition")


def read_ports(netlist: Netlist, memory: str) -> list[Read]:
    """Return the registers that a memory is read to.

    Raises
    ------
    RejectedError
        If it is used otherwise.
    """
    ports: list[Read] = []
    for register in netlist.registers.values():
        match register.statements:
            case (Load(Bits(_), Word(name, address)),) if name == memory:
                ports.append(Read(register.name, None, address))
            case (Choice(enable, (Load(Bits(_), Word(name, address)),), ()),) if name == memory:
                ports.append(Read(register.name, enable, address))
    return ports


class Control:
    """The control of a unit.

    Parameters
    ----------
    netlist : Netlist
    program : ProgramText
        What it runs.
    stages : Stages
    decisions : sequence of str
        Nets that say whether the channel on offer exists.

    Attributes
    ----------
    steps : list of Step
        All clocks of all states, once `visit` has been called.
    registers : list of str
        The registers that decide what moves, and when.
    ternary : Ternary
        The nets, as far as they are known.
    words, writes : lists of str and Write
        The memories that words are cut into, and their write ports.
    reads : dict of str to list of Read
        For each word that an instruction reads, the ports that it is read by, in the order of `words`.
    """

    def __init__(self, netlist: Netlist, program: ProgramText, stages: Stages, decisions: Sequence[str]) -> None:
        self._netlist, self._program, self._stages, self._decisions = netlist, program, stages, decisions
        self.cuts = {*decisions, *([DONE] if stages == SERIAL else [])}
        require(self.cuts <= netlist.widths.keys(), f"a serial core must have a net {DONE}")
        self.words = _words(netlist)
        self.writes = [write_port(netlist.memories[name]) for name in self.words]
        fetch = _only(read_ports(netlist, "instructions"), "instructions")
        require(not netlist.memories["instructions"].statements, "the program must never be written")
        self.valid = [f"valid{k}" for k in range(1, stages.last + 1)]
        self.codes = [fetch.register, *(f"instruction{k}" for k in range(2, stages.last + 1))]
        for name in (*self.valid, *self.codes):
            require(name in netlist.registers, f"the unit must have a register {name}")
        self._dependence = Dependence(netlist, self.cuts)
        self.reads = {name: self._ports(name, program.products) for name in READS[: program.products]}
        reads = [read for ports in self.reads.values() for read in ports]
        moving = [Bits(READY), Bits(VALID), *(write.enable for write in self.writes)]
        moving += [*(write.address for write in self.writes), *(read.address for read in reads)]
        moving += [read.enable for read in reads if read.enable is not None]
        self.registers = self._closure(moving, [*self.valid, *self.codes])
        self.ternary = Ternary(netlist, {"instructions": netlist.memories["instructions"].first})
        self.steps: list[Step] = []
        self.nodes: list[Node] = []
        self._clears = [instruction.end in _CLEARS for instruction in program.instructions]
        self._mask = program.words - 1

    def _ports(self, word: str, products: int) -> list[Read]:
        """Return the ports that a word is read by: of several, those that the net of its name depends on."""
        ports = [read_ports(self._netlist, memory) for memory in self.words]
        for memory, own in zip(self.words, ports, strict=True):
            require(len(own) == products, f"{memory} must be read at {products} places, not at {len(own)}")
        if products == 1:
            return [own[0] for own in ports]
        require(word in self._netlist.widths, f"the unit must have a net {word}")
        of = self._dependence.of_net(word)
        chosen = [[port for port in own if port.register in of] for own in ports]
        for memory, own in zip(self.words, chosen, strict=True):
            require(len(own) == 1, f"{word} must be read from {memory} at one place, not at {len(own)}")
        return [own[0] for own in chosen]

    def _closure(self, values: Sequence[Expression], names: Sequence[str]) -> list[str]:
        """Return the registers that values and registers depend on, at whatever clock."""
        registers: set[str] = set()
        waiting = [*self._dependence.of(values), *names]
        while waiting:
            name = waiting.pop()
            register = self._netlist.registers.get(name)
            if name not in registers and register is not None:
                registers.add(name)
                waiting += self._dependence.of_conditions(register.statements)
                waiting += self._dependence.of_loads(register.statements)
        return sorted(registers)

    def is_control(self, name: str) -> bool:
        """Whether a net is known in every state, unless it has bits that no state says."""
        leaves = self._dependence.of_net(name)
        return leaves <= {*self.registers, RESET, SOURCE, SINK, *self.cuts}

    # After a reset.

    def cleared(self) -> tuple[Values, int]:
        """Return what the control registers hold once all words have been cleared after a reset, and how late that is.

        Raises
        ------
        RejectedError
            If a word is not cleared, or anything else happens meanwhile.
        """
        data = [write.data for write in self.writes]
        names = self._closure([*data, *(Bits(name) for name in self.registers)], self.registers)
        blank = dict.fromkeys((RESET, SOURCE, SINK), UNKNOWN) | dict.fromkeys(self._netlist.registers, UNKNOWN)
        blank |= dict.fromkeys(self.cuts, UNKNOWN) | {RESET: known(0, 1)}
        values = dict(blank)
        contents = {name: self.ternary.after(name, values) for name in names}
        for name, (value, mask) in contents.items():
            first = self._netlist.registers[name].first
            right = not mask or (first is not None and first & mask == value)
            require(right, f"{name} must be before the first clock what it is after a reset, not {first}")
        written: list[dict[int, int]] = [{} for _ in self.words]
        depth = self._program.words * self._program.channels
        clocks = 0
        while clocks < 2 * depth + 4:
            clocks += 1
            values = {**blank, **contents, RESET: known(1, 1)}
            for name in (READY, VALID, *self.valid):
                require(self.ternary.net(name, values) == (0, 1), f"{name} must be 0 while words are cleared")
            clears = [self._clear(k, values, written[k]) for k in range(len(self.words))]
            if not any(clears):
                break
            require(all(clears), "all parts of a word must be cleared at a clock")
            contents = {name: self.ternary.after(name, values) for name in names}
        for k, name in enumerate(self.words):
            low = int(name.removeprefix("words"))
            width = self._netlist.memories[name].width
            for address in range(depth):
                wanted = int(address % self._program.words == self._program.words - 1) >> low & ((1 << width) - 1)
                content = written[k].get(address)
                require(content == wanted, f"{name}[{address}] must be {wanted} after a reset, not {content}")
        return {name: contents[name] for name in self.registers}, clocks - 1

    def _clear(self, number: int, values: Values, written: dict[int, int]) -> bool:
        """Note what is written to a memory at a clock; return whether anything is."""
        port, name = self.writes[number], self.words[number]
        enable = self._value(port.enable, values)
        require(enable[1] == 1, f"it must be known whether {name} is written while words are cleared")
        if not enable[0]:
            return False
        address, at = self._value(port.address, values)
        data, certain = self._value(port.data, values)
        if at != (1 << self._netlist.width(port.address)) - 1:
            written.clear()  # any of them may be another one now
        elif certain != (1 << self._netlist.width(port.data)) - 1:
            written.pop(address, None)
        else:
            written[address] = data
        return True

    def _value(self, value: Expression, values: Values) -> Trits:
        return self.ternary.value(value, 0, values)

    # All states.

    def visit(self, observe: Observer) -> int:
        """Visit all states, and check each; return in how many clocks after a reset the first is reached.

        Raises
        ------
        RejectedError
            If a register is not what the machine says.
        """
        contents, clocks = self.cleared()
        first = Node(tuple(contents[name] for name in self.registers), Machine((None,) * self._stages.last))
        numbers = {first: 0}
        self.nodes.append(first)
        self._check(first)
        for number, node in _growing(self.nodes):
            for values, event, after in self._clocks(node):
                if after not in numbers:
                    require(len(self.nodes) < _MOST_STATES, f"a unit must have less than {_MOST_STATES} states")
                    numbers[after] = len(self.nodes)
                    self.nodes.append(after)
                    self._check(after)
                observe(len(self.steps), node.machine, event, values)
                self.steps.append(Step(number, numbers[after], event))
        return clocks

    def _check(self, node: Node) -> None:
        """Check the valid bits, and the instructions that are there."""
        contents = dict(zip(self.registers, node.registers, strict=True))
        where = f"at instruction {node.machine.position}"
        for valid, code, number in zip(self.valid, self.codes, node.machine.pipe, strict=True):
            wanted = int(number is not None)
            require(contents[valid] == (wanted, 1), f"{valid} must be {wanted} {where}")
            if number is not None:
                right = contents[code] == known(self._program.codes[number], self._program.code_bits)
                require(right, f"{code} must be {self._program.named(number)} {where}")

    def _clocks(self, node: Node) -> Iterator[tuple[Values, Event, Node]]:
        """Yield all that can happen in a state: the nets, what happens, and the state after it."""
        machine = node.machine
        bit = {0: (0, 1), 1: (1, 1), None: UNKNOWN}
        contents = dict(zip(self.registers, node.registers, strict=True))
        for offered in (1,) if machine.begun or machine.refused else (0, 1):
            for exists in self._existing(machine, offered=bool(offered)):
                for ready in (0, 1) if machine.waiting else (None,):
                    for done in (0, 1) if self._is_busy(machine) else (None,):
                        values: Values = dict.fromkeys(self._netlist.registers, UNKNOWN)
                        values |= contents
                        values |= {RESET: (1, 1), SOURCE: bit[offered], SINK: bit[ready]}
                        values |= dict.fromkeys(self._decisions, bit[exists])
                        if DONE in self.cuts:
                            values[DONE] = bit[done]
                        yield self._clock(machine, values, bool(offered), exists != 0, ready, done != 0)

    def _existing(self, machine: Machine, *, offered: bool) -> tuple[int | None, ...]:
        """Return whether the channel on offer may exist."""
        if not self._decisions or not offered:
            return (None,)
        return (0,) if machine.refused else (1,) if machine.begun else (0, 1)

    def _is_busy(self, machine: Machine) -> bool:
        """Whether the last stage may take several clocks."""
        return DONE in self.cuts and machine.pipe[-1] is not None

    def _clock(
        self, machine: Machine, values: Values, offered: bool, exists: bool, ready: int | None, advance: bool
    ) -> tuple[Values, Event, Node]:
        """Follow one clock."""
        takes = self.ternary.net(READY, values)
        shown = self.ternary.net(VALID, values)
        where = f"at instruction {machine.position}"
        require(takes[1] == 1, f"{READY} must not depend on data {where}")
        require(shown == (int(machine.waiting), 1), f"{VALID} must be {int(machine.waiting)} {where}")
        after = tuple(self.ternary.after(name, values) for name in self.registers)
        fetches = False
        if advance:
            valid, certain = after[self.registers.index(self.valid[0])]
            require(certain == 1, f"{self.valid[0]} must not depend on data {where}")
            fetches = valid == 1
        begins = fetches and machine.position == 0
        accepted = offered and takes[0] == 1
        ends = advance and machine.pipe[-1] == len(self._program.instructions) - 1
        leaves = machine.waiting and ready == 1
        event = Event(advance, begins, accepted, ends, leaves, offered, ready != 0)
        self._check_words(machine, values, advance=advance)
        self._check_sample(machine, event, exists=exists, fetches=fetches)
        fetched = machine.position if fetches else None
        pipe = (fetched, *machine.pipe[:-1]) if advance else machine.pipe
        count = len(self._program.instructions)
        return (
            values,
            event,
            Node(
                after,
                Machine(
                    pipe,
                    (machine.position + fetches) % count,
                    begins or (machine.begun and not accepted),
                    offered and not exists and not accepted,
                    ends or (machine.waiting and not leaves),
                ),
            ),
        )

    def instruction(self, machine: Machine, stage: int) -> Instruction | None:
        """Return the instruction in a pipeline stage, the first of which is 1."""
        number = machine.pipe[stage - 1]
        return None if number is None else self._program.instructions[number]

    def writer(self, machine: Machine, event: Event) -> Instruction | None:
        """Return the instruction that writes a word at a clock, if one does."""
        early, late = (self.instruction(machine, stage) for stage in (self._stages.early, self._stages.last))
        if not event.advance:
            return None
        writers = [each for each in (early,) if each is not None and each.is_early]
        writers += [each for each in (late,) if each is not None and each.writes and not each.is_early]
        require(len(writers) < 2, f"two instructions must not write at a clock, as they do at {machine.position}")
        return writers[0] if writers else None

    def _check_words(self, machine: Machine, values: Values, *, advance: bool) -> None:
        """Check when words are read and written, and where as far as it is the program that says so."""
        where = f"at instruction {machine.position}"
        event = Event(advance, False, False, False, False, False, False)
        writer, reader = self.writer(machine, event), self.instruction(machine, self._stages.address)
        for name, write in zip(self.words, self.writes, strict=True):
            wanted = int(writer is not None)
            require(self._value(write.enable, values) == (wanted, 1), f"{name} must be written {wanted} times {where}")
            if writer is not None:
                address = self._address(write.address, values)
                require(address == writer.target, f"{name} must be written at {writer.target} {where}, not {address}")
        addresses = (None, None) if reader is None else (reader.address, reader.second_address)
        for ports, wanted_address in zip(self.reads.values(), addresses, strict=False):
            for name, read in zip(self.words, ports, strict=True):
                enabled = (1, 1) if read.enable is None else self._value(read.enable, values)
                require(
                    enabled == (1, 1) if advance else enabled == (0, 1),
                    f"{name} must be read just when the pipeline moves, {where}",
                )
                if wanted_address is not None:
                    address = self._address(read.address, values)
                    right = address == wanted_address
                    require(right, f"{name} must be read at {wanted_address} {where}, not {address}")

    def _address(self, value: Expression, values: Values) -> int | None:
        """Return the address within the words of a channel; None if it is unknown."""
        address, mask = self._value(value, values)
        return address & self._mask if mask & self._mask == self._mask else None

    def _check_sample(self, machine: Machine, event: Event, *, exists: bool, fetches: bool) -> None:
        """Check that each sample is begun, read, accepted and answered once, in this order."""
        where = f"at instruction {machine.position}"
        if event.begins:
            right = event.offered and exists and not machine.begun
            require(right, f"a sample must be begun {where} only if there is one that has not been begun")
            if self._program.channels > 1:
                empty = not any(number is not None for number in machine.pipe)
                require(
                    empty and (not machine.waiting or event.leaves),
                    f"a sample must not be begun {where} before the last",
                )
        if event.accepted:
            require(machine.begun or not exists, f"a sample must not be accepted {where} without a result")
        reading = self.instruction(machine, self._stages.reading)
        if reading is not None and reading.opcode == "take":
            require(machine.begun, f"a sample must not be accepted before its digits are taken, as it is {where}")
        gives = self.instruction(machine, self._stages.last)
        if gives is not None and gives.end == "give" and event.advance:
            require(not machine.waiting or event.leaves, f"a result must not be overwritten {where} before it leaves")
        if event.advance and not fetches and machine.position:
            require(self._clears[machine.position - 1], f"the unit must not wait {where} while something is added up")


def apart(machine: Machine) -> int:
    """Return how many samples have begun before the last one without being complete."""
    inside = [number for number in machine.pipe if number is not None]
    return sum(later > number for number, later in pairwise(inside))


def is_inside(machine: Machine) -> bool:
    """Whether a sample has begun whose result is not complete."""
    return machine.position > 0 or any(number is not None for number in machine.pipe)


def _words(netlist: Netlist) -> list[str]:
    """Return the memories that words are cut into, the lowest bits first."""
    names = [name for name in netlist.memories if name.startswith("words") and name[5:].isdecimal()]
    require(bool(names), "the unit must have words")
    return sorted(names, key=lambda name: int(name[5:]))


def _only(ports: Sequence[Read], memory: str) -> Read:
    require(len(ports) == 1, f"{memory} must be read at one place, not at {len(ports)}")
    return ports[0]


def _growing(nodes: Sequence[Node]) -> Iterator[tuple[int, Node]]:
    """Yield nodes by number while more are added."""
    number = 0
    while number < len(nodes):
        yield number, nodes[number]
        number += 1
