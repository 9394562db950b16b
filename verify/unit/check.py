"""Proves that the unit of a folded or serial core runs its program, for all inputs, stalls and resets.

`sosmith.verify.program` proves what a program computes, where each instruction does what its name says, one after the
other. Here it is shown, from the SystemVerilog, that the unit makes just that of a program::

    core.sv --> netlist --> control: all states that it can be in ------------------+
                   |                                                                v
                   +--> data: what each register takes over, a form of the others --> in each state what the
                                                                                      instructions in it ask for

1. After a reset all words are cleared. Then every state is visited that the control can be in, for any source and sink:
   each instruction is fetched in its turn, a word is read and written when and where the instructions say, each sample
   is begun, accepted and answered once, and a result stays until it leaves (`sosmith.verify.unit.control`).
2. In each of these states, what the data registers take over is what the instructions ask for: the word read, the
   product, the sum modulo the width of the accumulator, the digit that is stored (`sosmith.verify.unit.data`).
3. A result is limited as the graph says, and its flags are those of its sample (`output` and `order`).
4. While the sink is ready, the longest way through the states is a number of clocks (`going_on`).

That an instruction reads a word only once the one that writes it has done so is shown with the program. Names of
registers count: under a wrong name a proof is not found. The source must keep a sample on offer until it is accepted,
as AXI4-Stream asks.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from functools import partial

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import require
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.program.text import ProgramText, read_program
from sosmith.verify.progress import Progress
from sosmith.verify.reader.inlined import inlined
from sosmith.verify.reader.source import read_source
from sosmith.verify.unit.contexts import Contexts
from sosmith.verify.unit.control import DEST, FOLDED, READS, SERIAL, TWO_PRODUCTS, Control, Event, Machine
from sosmith.verify.unit.data import ADDED, Data, Subject
from sosmith.verify.unit.going_on import Pace, pace
from sosmith.verify.unit.order import check_order
from sosmith.verify.unit.output import Output
from sosmith.verify.unit.ternary import Values

CLOCK = "aclk"
_SPLIT = (
    *("left", "shifted", "moved", "passed4", "passed5", "operand", "data", "factor", "product"),
    *("second_data", "second_factor", "second_product", "products"),
)


@dataclass(frozen=True)
class UnitVerdict:
    """The result of the check of a unit.

    Attributes
    ----------
    states : int
        Number of states of its control.
    cases : int
        Number of cases of its data.
    pace : Pace
        Within how many clocks it takes samples and gives results.
    """

    states: int
    cases: int
    pace: Pace

    @property
    def progress(self) -> Progress:
        """Within how many clocks it takes samples and gives results."""
        return self.pace.progress


def check_unit(text: str, certificate: Certificate, *, serial: bool, top: str | None = None) -> UnitVerdict:
    """Prove that the unit in a core's SystemVerilog runs the program in it.

    Raises
    ------
    RejectedError
        If it does anything else, or the text has anything that cannot be checked.
    """
    name = top or certificate.name
    modules = inlined(read_source(text, name), name).modules
    netlist = flattened(modules, CLOCK)
    program = read_program(text, name)
    stages = SERIAL if serial else (FOLDED, TWO_PRODUCTS)[program.products - 1]
    require(not serial or program.products == 1, "a serial unit must have one product at a time, not two")
    control = Control(netlist, program, stages, _existing(netlist, program.channels))
    split = [name for name in _SPLIT if name in netlist.drivers]
    contexts = Contexts(netlist, control, control.ternary, [ADDED, *READS[: program.products], *split])
    data = Data(netlist, program, control, contexts, stages)
    data.check_nets()
    output = Output(netlist, program, control, contexts, stages, certificate)
    cases = _Cases(contexts, [*data.subjects, *output.subjects])
    clearing = control.visit(cases.note)
    cases.check()
    check_order(control, program, output)
    ways = pace(control, clearing, partial(_digits, program) if serial else lambda number: 1)
    return UnitVerdict(len(control.nodes), cases.count, ways)


def _digits(program: ProgramText, number: int) -> int:
    """Return the most clocks that a serial multiplication takes: until nothing but a sign is left of a factor."""
    instruction = program.instructions[number]
    left = -1 << program.digit_bits if instruction.multiplies_words else instruction.constant
    clocks = 1
    while left not in {-1, 0, 1}:
        left, clocks = left >> 1, clocks + 1
    return clocks


def _existing(netlist: Netlist, channels: int) -> list[str]:
    """Return the nets that say whether the channel on offer exists."""
    if channels == 1:
        return []
    dependence, nets = Dependence(netlist, set()), []
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
            nets.append(name)
    return nets


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
