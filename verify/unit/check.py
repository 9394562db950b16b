"""Proves that the unit of a folded or serial core runs its program as `sosmith.verify.program` takes it."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import require
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.program.text import read_program
from sosmith.verify.reader.source import read_source
from sosmith.verify.unit.contexts import Contexts, Slice
from sosmith.verify.unit.control import DEST, FOLDED, SERIAL, Control, Event, Machine
from sosmith.verify.unit.data import ADDED, READ, Data, Subject
from sosmith.verify.unit.ternary import Values

CLOCK = "aclk"
_SPLIT = ("left", "shifted", "moved", "operand", "data", "factor", "product")


@dataclass(frozen=True)
class UnitVerdict:
    """What the check of a unit has found.

    Attributes
    ----------
    states : int
        Number of states of its control.
    cases : int
        Number of cases of its data.
    """

    states: int
    cases: int


def check_unit(text: str, certificate: Certificate, *, serial: bool, top: str | None = None) -> UnitVerdict:
    """Prove that the unit in a core's SystemVerilog runs the program in it.

    Raises
    ------
    RejectedError
        If it does anything else, or the text has anything that cannot be checked.
    """
    modules = read_source(text, top or certificate.name).modules
    netlist = flattened(modules, CLOCK)
    program = read_program(text, top or certificate.name)
    stages = SERIAL if serial else FOLDED
    control = Control(netlist, program, stages, _existing(netlist, program.channels))
    split = [name for name in _SPLIT if name in netlist.drivers]
    contexts = Contexts(netlist, control, control.ternary, [ADDED, READ, *split])
    data = Data(netlist, program, control, contexts, stages)
    data.check_nets()
    cases = _Cases(contexts, data.subjects)
    control.visit(cases.note)
    cases.check()
    return UnitVerdict(len(control.nodes), cases.count)


def _existing(netlist: Netlist, channels: int) -> list[str]:
    """Return the nets that say whether the channel on offer exists."""
    if channels == 1:
        return []
    dependence, found = Dependence(netlist, set()), []
    for name in netlist.drivers:
        if netlist.widths[name] != 1 or dependence.of_net(name) != {DEST}:
            continue
        forms = Forms()
        dest = forms.variable(DEST, 0, (1 << netlist.widths[DEST]) - 1)

        def content(asked: str, dest: Form = dest) -> Form:
            require(asked == DEST, f"{asked} must not be read here")
            return dest

        value = Evaluation(netlist, forms, content).net(name)
        if same_word(forms, value, forms.negative(plus(dest, constant(channels), -1)), 1):
            found.append(name)
    return found


class _Cases:
    """The cases of subjects, as states are visited."""

    def __init__(self, contexts: Contexts, subjects: list[Subject]) -> None:
        self._contexts = contexts
        self._subjects = [(subject, contexts.slices(subject.values)) for subject in subjects]
        self._cases: list[dict[Hashable, Values]] = [{} for _ in subjects]

    @property
    def count(self) -> int:
        """Number of cases."""
        return sum(map(len, self._cases))

    def note(self, number: int, machine: Machine, event: Event, values: Values) -> None:
        """Note the cases at a clock."""
        for (subject, slices), cases in zip(self._subjects, self._cases, strict=True):
            kind = subject.kind(machine, event)
            if kind is not None:
                key = kind, self._contexts.key(slices, values)
                if key not in cases:
                    cases[key] = values

    def check(self) -> None:
        """Check all of them."""
        for (subject, _), cases in zip(self._subjects, self._cases, strict=True):
            for key, values in cases.items():
                assert isinstance(key, tuple)
                subject.check(key[0], values)


__all__ = ["Slice", "UnitVerdict", "check_unit"]
