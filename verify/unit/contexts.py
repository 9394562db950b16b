"""In which cases the logic of data is to be checked: what the control nets that it reads are, in all states.

Few of all states differ for one register: an accumulator sees whether there is an instruction, and of what kind. So the
states are taken together in which all control bits that count for a subject are the same, and the same is expected.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import NamedTuple

from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import ONE, Form, constant, plus
from sosmith.verify.reader.syntax import Bits, Choice, Expression, Joined, Load, Number, Statement, Word
from sosmith.verify.unit.control import Control
from sosmith.verify.unit.ternary import Ternary, Values

DATA = "s_axis_tdata"


class Slice(NamedTuple):
    """Bits of a control net."""

    name: str
    low: int
    width: int


class Part(NamedTuple):
    """A register that holds bits of a word from `low` on."""

    name: str
    low: int
    width: int


class Contexts:
    """The control bits that subjects read.

    Parameters
    ----------
    netlist : Netlist
    control : Control
        Whose nets are known in every state.
    cuts : set of str
        Data nets that are variables by themselves.
    """

    def __init__(self, netlist: Netlist, control: Control, ternary: Ternary, cuts: Iterable[str]) -> None:
        self._netlist, self._control, self._ternary = netlist, control, ternary
        self._cuts = set(cuts)
        self._reached: dict[str, frozenset[Slice]] = {}
        self._controls: set[str] = set()

    def slices(self, values: Iterable[Expression]) -> list[Slice]:
        """Return the control bits that expressions read."""
        return sorted({part for value in values for bits in _bits(value) for part in self._of(bits)})

    def key(self, slices: Sequence[Slice], values: Values) -> Hashable:
        """Return what control bits are in a state."""
        return tuple(self._ternary.bits(*each, values) for each in slices)

    def logic(
        self,
        forms: Forms,
        values: Values,
        contents: Mapping[str, Form],
        opened: str | None = None,
        fields: Sequence[tuple[int, int, Form]] = (),
        deep: bool = False,
    ) -> Evaluation:
        """Return the logic in a state, where some registers and cut nets hold the given forms.

        The net `opened` is no cut. `fields` are the places, widths and words of the input's fields; without them, each
        of its bits is a variable. `deep` logic reads control registers only, which is for control bits that are not
        known: control nets that are not would lose what they are made of.
        """
        widths = self._netlist.widths

        def content(name: str) -> Form:
            return contents[name] if name in contents else forms.variable(name, 0, (1 << widths[name]) - 1)

        def part(name: str, low: int, width: int) -> Form | None:
            if name == DATA:
                for offset, wide, whole in fields:
                    if offset <= low and low + width <= offset + wide:
                        return forms.floor(shifted(whole, offset - low))
                bits = (forms.variable((DATA, low + k), 0, 1) for k in range(width))
                return _sum((bit, k) for k, bit in enumerate(bits))
            if name in contents or not self._is_control(name):
                return None
            value, mask = self._ternary.bits(name, low, width, values)
            if mask == (1 << width) - 1:
                return constant(value)
            return unknown(forms, Slice(name, low, width))

        def word(name: str, address: Form) -> Form:
            raise RejectedError(f"words of {name} must be read to a register of their own")

        cuts = (self._cuts | (self._control.cuts if deep else self._controls)) - {opened}
        return Evaluation(self._netlist, forms, content, word=word, cuts=cuts, fields=part)

    def parts(self, name: str) -> list[Part]:
        """Return the registers that hold a word, the lowest bits first.

        Raises
        ------
        RejectedError
            If there are none.
        """
        if name in self._netlist.registers:
            return [Part(name, 0, self._netlist.widths[name])]
        parts = [
            Part(driver.value.name, driver.low, driver.width)
            for driver in self._netlist.drivers.get(name, ())
            if isinstance(driver.value, Bits) and driver.value.name in self._netlist.fields
        ]
        if not parts or sum(part.width for part in parts) != self._netlist.widths[name]:
            raise RejectedError(f"the unit must have a register {name}")
        return parts

    def loads(self, name: str) -> list[Expression]:
        """Return all expressions that decide what a word is after a clock."""
        return [value for part in self.parts(name) for value in _loads(self._netlist.registers[part.name].statements)]

    def after(self, name: str, logic: Evaluation, forms: Forms, now: Form) -> Form:
        """Return what a word that is `now` is after a clock."""
        parts: list[tuple[Form, int]] = []
        for part in self.parts(name):
            before = forms.floor(shifted(now, -part.low)) if part.low else now
            value = after(logic, self._netlist.registers[part.name].statements, before)
            whole = part.width == self._netlist.widths[name]
            parts.append((value if whole else forms.unsigned(value, part.width), part.low))
        return _sum(parts)

    def _is_control(self, name: str) -> bool:
        return name in self._controls or name in self._control.registers or name in self._control.cuts

    def _of(self, bits: Bits) -> frozenset[Slice]:
        name = bits.name
        if name in self._cuts or name == DATA:
            return frozenset()
        if self._control.is_control(name):
            self._controls.add(name)
            width = self._netlist.widths[name] if bits.width is None else bits.width
            return frozenset({Slice(name, bits.low, width)})
        if name not in self._reached:
            self._reached[name] = frozenset()  # within a loop, which `Evaluation` refuses
            values = [driver.value for driver in self._netlist.drivers.get(name, ())]
            self._reached[name] = frozenset(self.slices(values))
        return self._reached[name]


def unknown(forms: Forms, bits: Slice) -> Form:
    """Return control bits that are not known, as the channel of a sample is not."""
    return forms.variable(bits, 0, (1 << bits.width) - 1)


def after(logic: Evaluation, statements: Sequence[Statement], now: Form) -> Form:
    """Return what a register that holds `now` holds after a clock, whatever decides on it."""
    for statement in statements:
        if isinstance(statement, Load):
            loaded = logic.loaded((statement,))
            assert loaded is not None
            now = loaded[1]
            continue
        select = logic.bit(statement.condition)
        if not select.keys() - {ONE}:
            now = after(logic, statement.yes if select else statement.no, now)
            continue
        yes, no = after(logic, statement.yes, now), after(logic, statement.no, now)
        now = plus(no, logic.product(select, plus(yes, no, -1)))
    return now


def _sum(parts: Iterable[tuple[Form, int]]) -> Form:
    total: Form = {}
    for part, low in parts:
        total = plus(total, part, 1 << low)
    return total


def _loads(statements: Sequence[Statement]) -> list[Expression]:
    values: list[Expression] = []
    for statement in statements:
        if isinstance(statement, Choice):
            values += [statement.condition, *_loads(statement.yes), *_loads(statement.no)]
        else:
            values.append(statement.value)
    return values


def _bits(value: Expression) -> list[Bits]:
    if isinstance(value, Bits):
        return [value]
    if isinstance(value, Number):
        return []
    if isinstance(value, Word):
        return _bits(value.address)
    parts = value.parts if isinstance(value, Joined) else value.operands
    return [bits for part in parts for bits in _bits(part)]
