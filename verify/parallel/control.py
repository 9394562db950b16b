"""Which registers move the samples of a core: the pipeline's valid bits, and the state of the output buffer.

::

    s_axis_tvalid --> [valid 1] --> [valid 2] -- .. --> [valid n] --+--> [o_valid] --> m_axis_tvalid
                                                                    |        ^
    s_axis_tready <-- not [full] <----------------------------------+        +--- m_axis_tready

They are found from the ports, backwards; names do not count. Then every one of them is checked at every clock: which
samples there are, and where, is then what the pictures of the components say, for any handshakes and resets:

- Reset and the time before the first clock leave the core empty.
- While `full` is 0, all samples move one position at each clock; while it is 1, none does.
- The output buffer is a queue of two samples that loses none and repeats none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import pairwise, product
from typing import TypeVar

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus

RESET, SOURCE, SINK = "aresetn", "s_axis_tvalid", "m_axis_tready"
"""Ports that control what moves."""

Case = Mapping[str, int]
"""Values of control signals."""

_Result = TypeVar("_Result")


class UndecidedError(Exception):
    """A control signal counts that the case says nothing of."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.name = name


def cases(
    fixed: Case, evaluate: Callable[[Case], _Result], values: Callable[[str], Iterable[int]] = lambda name: (0, 1)
) -> Iterator[tuple[Case, _Result]]:
    """Yield the result in each case that the fixed control signals leave, as far as they count.

    `values` are those that a signal can have.
    """
    try:
        result = evaluate(fixed)
    except UndecidedError as undecided:
        for value in values(undecided.name):
            yield from cases({**fixed, undecided.name: value}, evaluate, values)
    else:
        yield fixed, result


def about(name: str, error: RejectedError) -> RejectedError:
    """Return an error whose sentence says what it is about."""
    sentence = str(error)
    return RejectedError(name + sentence.removeprefix("it")) if sentence.startswith("it ") else error


@dataclass(frozen=True)
class Buffer:
    """A buffer of two samples: the signals that say what it holds, and what moves it.

    Attributes
    ----------
    valid, full : str
        Registers: whether it holds a sample, and whether it holds two.
    coming, ready : str
        Whether a sample comes while it is not full, and whether one may leave.
    """

    valid: str
    full: str
    coming: str
    ready: str


@dataclass(frozen=True)
class Control:
    """The registers that move the samples.

    Attributes
    ----------
    valid : tuple of str
        For each position whether it holds a sample that moves on; position 0 is the source.
    output : Buffer
        The output buffer.
    entrance : Entrance or None
        What stands before position 0 in a core with several channels.
    """

    valid: tuple[str, ...]
    output: Buffer
    entrance: Entrance | None = None

    @property
    def full(self) -> str:
        """Whether the pipeline stands."""
        return self.output.full

    @property
    def names(self) -> set[str]:
        """All control signals."""
        names = {*self.valid, self.output.valid, self.output.full, RESET, SOURCE, SINK}
        return names if self.entrance is None else names | self.entrance.names

    @property
    def cuts(self) -> set[str]:
        """Nets among the control signals."""
        if self.entrance is None:
            return set()
        return {self.valid[0], self.entrance.buffer.coming, self.entrance.buffer.ready}


@dataclass(frozen=True)
class Entrance:
    """What stands before the pipeline of a core with several channels.

    Attributes
    ----------
    buffer : Buffer
        The input buffer.
    clearing, word : str
        Registers: whether the states are being cleared, and those of which channel.
    channels : int
        Number of channels.
    near : tuple of str
        Registers that repeat the valid bits of positions 1, 2, ..
    """

    buffer: Buffer
    clearing: str
    word: str
    channels: int
    near: tuple[str, ...]

    @property
    def names(self) -> set[str]:
        """All control signals among these."""
        return {self.buffer.valid, self.buffer.full, self.buffer.coming, self.buffer.ready, self.clearing}


def find_control(netlist: Netlist) -> Control:
    """Find the control registers of a core with one channel, and check all that they do.

    Raises
    ------
    RejectedError
        If samples do not move as they must.
    """
    search = Search(netlist)
    valid = search.register(search.net("m_axis_tvalid", {}), "m_axis_tvalid")
    full = search.register(search.inverted(search.net("s_axis_tready", {})), "not s_axis_tready")
    chain = search.chain(valid, full)
    last = search.register(search.loaded(chain[0], {RESET: 1, full: 0, chain[0]: 0}), f"what {chain[0]} takes over")
    require(last == SOURCE, f"{chain[0]} must follow {SOURCE}, not {last}")
    control = Control((SOURCE, *chain), Buffer(valid, full, chain[-1], SINK))
    search.check_chain(control.valid, full)
    search.check_buffer(control.output)
    return control


class Search:
    """Evaluates control logic by itself.

    Parameters
    ----------
    netlist : Netlist
    cuts : set of str
        Nets that are taken as signals of their own.
    """

    def __init__(self, netlist: Netlist, cuts: Set[str] = frozenset()) -> None:
        self._netlist, self._cuts = netlist, cuts

    def net(self, name: str, case: Case) -> tuple[Forms, Form]:
        """Return a net where the signals of a case have values, and all others are variables."""
        require(self._netlist.widths.get(name) == 1, f"{name} must have one bit")
        forms, logic = self.logic(case)
        return forms, forms.unsigned(logic.net(name), 1)

    def loaded(self, name: str, case: Case) -> tuple[Forms, Form]:
        """Return what a register holds at the next clock."""
        require(name in self._netlist.registers, f"{name} must be a register")
        forms, logic = self.logic(case)
        try:
            loaded = logic.loaded(self._netlist.registers[name].statements)
        except RejectedError as error:
            raise about(name, error) from None
        return forms, forms.unsigned(logic.net(name) if loaded is None else loaded[1], self._netlist.widths[name])

    def inverted(self, evaluated: tuple[Forms, Form]) -> tuple[Forms, Form]:
        """Return 1 less a value."""
        forms, value = evaluated
        return forms, plus(constant(1), value, -1)

    def register(self, evaluated: tuple[Forms, Form], what: str) -> str:
        """Return the register, or the source, that a value is.

        Raises
        ------
        RejectedError
            If it is none.
        """
        name = self.one_register(evaluated)
        if name is None:
            raise RejectedError(
                f"{what} must be one register, not logic of {len(evaluated[0].keys(evaluated[1]))} signals"
            )
        return name

    def one_register(self, evaluated: tuple[Forms, Form]) -> str | None:
        """Return the register, or the source, that a value is; None if it is none."""
        forms, value = evaluated
        keys = forms.keys(value)
        name = next(iter(keys)) if len(keys) == 1 else None
        if not isinstance(name, str) or value != forms.variable(name, 0, 1):
            return None
        return name if name in self._netlist.registers or name == SOURCE else None

    def chain(self, valid: str, full: str) -> list[str]:
        """Return the valid bits that are registers, from the source to the output buffer."""
        chain = [self.register(self.loaded(valid, {RESET: 1, full: 0, valid: 0}), f"what {valid} takes over")]
        while True:
            before = self.one_register(self.loaded(chain[-1], {RESET: 1, full: 0, chain[-1]: 0}))
            if before is None or before not in self._netlist.registers:
                return chain[::-1]
            require(before not in {*chain, full, valid}, f"{chain[-1]} must not follow {before}, which follows it")
            chain.append(before)

    def check_chain(self, valid: Sequence[str], full: str) -> None:
        """Check that valid bits follow each other in every case while the pipeline does not stand."""
        for before, name in pairwise(valid):
            self.expect_empty(name)
            for stands, coming, own in product((0, 1), repeat=3):
                case = {RESET: 1, full: stands, before: coming, name: own}
                self.expect(name, case, own if stands else coming)

    def check_buffer(self, buffer: Buffer) -> None:
        """Check that a buffer is a queue of two in every case."""
        for name in (buffer.valid, buffer.full):
            self.expect_empty(name)
        for valid, full, ready, coming in product((0, 1), repeat=4):
            if full and not valid:
                continue  # never: both checks below keep it so
            case = {RESET: 1, buffer.valid: valid, buffer.full: full, buffer.ready: ready, buffer.coming: coming}
            leaves = ready or not valid
            self.expect(buffer.valid, case, (full or coming) if leaves else 1)
            self.expect(buffer.full, case, 0 if leaves else (full or coming))

    def expect_empty(self, name: str) -> None:
        """Check that a register is 0 before the first clock and after a reset."""
        first = self._netlist.registers[name].first
        require(first == 0, f"{name} must be 0 before the first clock, not {first}")
        self.expect(name, {RESET: 0}, 0)

    def expect(self, name: str, case: Case, wanted: int) -> None:
        """Check what a register holds after a clock in a case."""
        _, value = self.loaded(name, case)
        stated = ", ".join(f"{signal} = {bit}" for signal, bit in case.items())
        require(value == constant(wanted), f"{name} must be {wanted} after a clock with {stated}")

    def logic(self, case: Case) -> tuple[Forms, Evaluation]:
        """Return the logic where the signals of a case have values, and all others are variables."""
        forms = Forms()

        def content(name: str) -> Form:
            if name in case:
                return constant(case[name])
            register = self._netlist.registers.get(name)
            known = register is None or register.first is not None
            require(known, f"{name} must have a value before the first clock, as it counts for what moves")
            return forms.variable(name, 0, (1 << self._netlist.widths[name]) - 1)

        return forms, Evaluation(self._netlist, forms, content, cuts=self._cuts)
