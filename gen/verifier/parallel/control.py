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

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TypeVar

from sosmith.gen.verifier.graph import RejectedError, require
from sosmith.gen.verifier.parallel.evaluation import Evaluation
from sosmith.gen.verifier.parallel.forms import Forms
from sosmith.gen.verifier.parallel.netlist import Netlist
from sosmith.gen.verifier.program.normal_form import Form, constant, plus

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


def cases(fixed: Case, evaluate: Callable[[Case], _Result]) -> Iterator[tuple[Case, _Result]]:
    """Yield what is found in each case that the fixed control signals leave, as far as they count."""
    try:
        found = evaluate(fixed)
    except UndecidedError as undecided:
        for value in (0, 1):
            yield from cases({**fixed, undecided.name: value}, evaluate)
    else:
        yield fixed, found


@dataclass(frozen=True)
class Control:
    """The registers that move the samples.

    Attributes
    ----------
    valid : tuple of str
        For each position whether it holds a sample; position 0 is the source.
    o_valid, full : str
        Whether the output buffer holds a sample, and whether it holds two.
    """

    valid: tuple[str, ...]
    o_valid: str
    full: str

    @property
    def names(self) -> set[str]:
        """All control signals."""
        return {*self.valid, self.o_valid, self.full, RESET, SOURCE, SINK}


def find_control(netlist: Netlist) -> Control:
    """Find the control registers of a core with one channel, and check all that they do.

    Raises
    ------
    RejectedError
        If samples do not move as they must.
    """
    search = _Search(netlist)
    o_valid = search.register(search.net("m_axis_tvalid", {}), "m_axis_tvalid")
    full = search.register(search.inverted(search.net("s_axis_tready", {})), "not s_axis_tready")
    loading = {RESET: 1, full: 0, o_valid: 0}
    chain = [search.register(search.loaded(o_valid, loading), f"what {o_valid} takes over")]
    while chain[-1] != SOURCE:
        moving = {RESET: 1, full: 0, chain[-1]: 0}
        before = search.register(search.loaded(chain[-1], moving), f"what {chain[-1]} takes over")
        require(before not in {*chain, full, o_valid}, f"{chain[-1]} must not follow {before}, which follows it")
        chain.append(before)
    control = Control(tuple(reversed(chain)), o_valid, full)
    search.check(control)
    return control


class _Search:
    """Evaluates control logic by itself."""

    def __init__(self, netlist: Netlist) -> None:
        self._netlist = netlist

    def net(self, name: str, case: Case) -> tuple[Forms, Form]:
        """Return a net where the signals of a case have values, and all others are variables."""
        require(self._netlist.widths.get(name) == 1, f"the port {name} must have one bit")
        forms, logic = self._logic(case)
        return forms, forms.unsigned(logic.net(name), 1)

    def loaded(self, register: str, case: Case) -> tuple[Forms, Form]:
        """Return what a register of one bit holds at the next clock."""
        require(self._netlist.widths[register] == 1, f"{register} must have one bit")
        forms, logic = self._logic(case)
        try:
            loaded = logic.loaded(self._netlist.registers[register].statements)
        except RejectedError as error:
            raise RejectedError(f"{register}: {error}") from None
        return forms, forms.unsigned(logic.net(register) if loaded is None else loaded[1], 1)

    def inverted(self, found: tuple[Forms, Form]) -> tuple[Forms, Form]:
        """Return 1 less a value."""
        forms, value = found
        return forms, plus(constant(1), value, -1)

    def register(self, found: tuple[Forms, Form], what: str) -> str:
        """Return the register, or the source, that a value is."""
        forms, value = found
        keys = forms.keys(value)
        name = next(iter(keys)) if len(keys) == 1 else None
        known = isinstance(name, str) and (name in self._netlist.registers or name == SOURCE)
        if not known or value != forms.variable(name, 0, 1):
            raise RejectedError(f"{what} must be one register, not logic of {len(keys)} signals")
        assert isinstance(name, str)
        return name

    def check(self, control: Control) -> None:
        """Check what all control registers do in every case."""
        for name in (*control.valid[1:], control.o_valid, control.full):
            register = self._netlist.registers[name]
            require(register.first == 0, f"{name} must be 0 before the first clock, not {register.first}")
            self._expect(name, {RESET: 0}, 0, "in reset")
        for before, name in zip(control.valid, control.valid[1:], strict=False):
            for full, coming, own in product((0, 1), repeat=3):
                case = {RESET: 1, control.full: full, before: coming, name: own}
                self._expect(name, case, own if full else coming, "while the pipeline stands" if full else "")
        last = control.valid[-1]
        for held, full, ready, coming in product((0, 1), repeat=4):
            if full and not held:
                continue  # never: both checks below keep it so
            case = {RESET: 1, control.o_valid: held, control.full: full, SINK: ready, last: coming}
            leaves = ready or not held
            self._expect(control.o_valid, case, (full or coming) if leaves else 1, "")
            self._expect(control.full, case, 0 if leaves else (full or coming), "")

    def _expect(self, name: str, case: Case, wanted: int, when: str) -> None:
        _, value = self.loaded(name, case)
        if value != constant(wanted):
            stated = ", ".join(f"{signal} = {bit}" for signal, bit in case.items())
            raise RejectedError(f"{name} must be {wanted} after a clock with {stated}{f' ({when})' if when else ''}")

    def _logic(self, case: Case) -> tuple[Forms, Evaluation]:
        forms = Forms()

        def content(name: str) -> Form:
            if name in case:
                return constant(case[name])
            return forms.variable(name, 0, (1 << self._netlist.widths[name]) - 1)

        return forms, Evaluation(self._netlist, forms, content)
