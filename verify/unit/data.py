"""What the data registers of a unit hold: for each instruction, what the instruction says.

The states of the control are known (`sosmith.verify.unit.control`). In each of them, what every data register takes
over is a form of what the others hold, and must be the one that the instruction in its stage asks for::

    folded    data = word read           product = data * factor     total + product = added, modulo its width
              factor = constant, or the operand
              with two products a clock, all three twice, and their sum in a register
    serial    shifted, left = the two factors; while there are digits left, total + shifted * left stays the same

`added` is then what `sosmith.verify.program.check` has added up after an instruction. The accumulator is kept in two
registers, the upper one of which is shifted a clock later: what it holds is ``low + 2**s * (high >> carried * bits)``.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import partial

from sosmith.verify.graph import require
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.program.text import NUMBER_BITS, Instruction, ProgramText
from sosmith.verify.reader.syntax import Expression
from sosmith.verify.unit.contexts import DATA, Contexts, Slice, unknown
from sosmith.verify.unit.control import DEST, DONE, READS, SERIAL, Control, Event, Machine, Stages
from sosmith.verify.unit.ternary import Values

ADDED, READ, SECOND_READ = "added", *READS
_SECOND = "second_"
_LOW, _HIGH, _CARRIED = "total_low", "total_high", "carried"
_CARRIES, _CLEARS = frozenset({"store", "drop", "give"}), frozenset({"finish", "judge", "take"})

Kind = Hashable
"""What is expected in a state; None for nothing."""


@dataclass(frozen=True)
class Subject:
    """What is checked.

    Attributes
    ----------
    name : str
        For sentences.
    values : sequence of Expression
        What it depends on.
    kind : callable
        What is expected at a clock.
    check : callable
        Checks it for a kind in a state; raises `RejectedError`.
    """

    name: str
    values: Sequence[Expression]
    kind: Callable[[Machine, Event], Kind]
    check: Callable[[Kind, Values], None]


class Data:
    """The data registers of a unit.

    Parameters
    ----------
    netlist : Netlist
    program : ProgramText
    control : Control
    contexts : Contexts
    stages : Stages
    """

    def __init__(
        self, netlist: Netlist, program: ProgramText, control: Control, contexts: Contexts, stages: Stages
    ) -> None:
        self._netlist, self._program, self._control, self._stages = netlist, program, control, stages
        self._contexts = contexts
        self._bits, self._word = program.digit_bits, program.digit_bits + 1
        self._width = program.accumulator_bits
        serial = stages == SERIAL
        self.subjects = [
            self._register("operand", self._kind_of_operand, self._operand),
            self._total(),
            *(self._write(k) for k in range(len(control.words))),
            *([] if program.channels == 1 else self._channel()),
            *(self._serial() if serial else self._folded()),
        ]
        self._is_serial = serial

    def check_nets(self) -> None:
        """Check what does not depend on any state: the word that is read, and what is added up.

        Raises
        ------
        RejectedError
            If one of them is another value.
        """
        for net, ports in self._control.reads.items():
            forms = Forms()
            read: Form = {}
            for name, port in zip(self._control.words, ports, strict=True):
                low, width = int(name[5:]), self._netlist.memories[name].width
                read = plus(read, forms.variable(port.register, 0, (1 << width) - 1), 1 << low)
            word = self._contexts.logic(forms, {}, {}, opened=net).net(net)
            require(same_word(forms, word, read, self._word), f"{net} must be the word read, not another value")

    # Kinds.

    def _at(self, machine: Machine, stage: int) -> Instruction | None:
        return self._control.instruction(machine, stage)

    def _factor(self, machine: Machine) -> Kind:
        """Return what an instruction that has its word is multiplied by."""
        reading = self._at(machine, self._stages.reading)
        if reading is None:
            return None
        return "operand" if reading.multiplies_words else ("constant", reading.constant)

    def _kind_of_operand(self, machine: Machine, event: Event) -> Kind:
        reading = self._at(machine, self._stages.reading)
        if not event.advance:
            return "keep"
        if reading is not None:
            return "load" if reading.opcode == "operand" else "keep"
        return "keep" if self._needs_operand(machine) else None

    def _needs_operand(self, machine: Machine) -> bool:
        """Whether the operand register is read before it is loaded again, in the sample that comes to it next."""
        coming = [number for number in machine.pipe[: self._stages.reading - 1] if number is not None]
        rest = self._program.instructions[coming[-1] if coming else machine.position :]
        used = (each.opcode == "operand" for each in rest if each.multiplies_words or each.opcode == "operand")
        return not next(used, True)

    def _kind_of_total(self, machine: Machine, event: Event) -> Kind:
        last = self._at(machine, self._stages.last)
        if last is None:
            return "clear"
        if not event.advance:
            return "add"
        return "clear" if last.end in _CLEARS else "carry" if last.end in _CARRIES else "add"

    def _kind_of_write(self, machine: Machine, event: Event) -> Kind:
        writer = self._control.writer(machine, event)
        if writer is None:
            return None
        return ("take", writer.constant % (1 << NUMBER_BITS)) if writer.opcode == "take" else writer.end

    # Subjects.

    def _register(
        self, name: str, kind: Callable[[Machine, Event], Kind], wanted: Callable[[Forms, Kind, Form], Form]
    ) -> Subject:
        """Return the subject of a register, which must be what is wanted of it after a clock."""
        width = self._netlist.widths.get(name, 0)
        if name == "operand" and not width:  # no instruction uses it
            return Subject(name, (), lambda machine, event: None, lambda kind, values: None)

        def check(kind: Kind, values: Values) -> None:
            forms = Forms()
            now = self._signed(forms, name, width)
            logic = self._contexts.logic(forms, values, {**self._held(forms), name: now})
            content = self._contexts.after(name, logic, forms, now)
            right = same_word(forms, content, wanted(forms, kind, now), width)
            require(right, f"{name} must be {_shown(kind)} after a clock, not another value")

        return Subject(name, self._contexts.loads(name), kind, check)

    def _held(self, forms: Forms) -> dict[str, Form]:
        """Return what the cut nets and registers hold: words, sums and factors, with their signs.

        The slices that a word is read in are its bits, as `check_nets` proves.
        """
        names = ("moved", "passed4", "passed5", "operand", *self._control.reads)
        widths = {ADDED: self._width, "products": 2 * self._word + 1} | dict.fromkeys(names, self._word)
        for prefix in ("", _SECOND):
            own = {"data": self._word, "factor": self._word, "product": 2 * self._word}
            widths |= {prefix + name: width for name, width in own.items()}
        contents = {name: self._signed(forms, name, width) for name, width in widths.items()}
        for net, ports in self._control.reads.items():
            for name, port in zip(self._control.words, ports, strict=True):
                above = forms.floor(shifted(contents[net], -int(name[5:])))
                contents[port.register] = forms.unsigned(above, self._netlist.memories[name].width)
        return contents

    @staticmethod
    def _signed(forms: Forms, name: str, width: int) -> Form:
        return forms.variable(name, -1 << (width - 1), (1 << (width - 1)) - 1)

    def _operand(self, forms: Forms, kind: Kind, now: Form) -> Form:
        return self._signed(forms, READ, self._word) if kind == "load" else now

    def _factor_form(self, forms: Forms, kind: Kind) -> Form:
        if isinstance(kind, tuple):
            return constant(kind[1])
        return self._signed(forms, "operand", self._word)

    def _folded(self) -> list[Subject]:
        def always(machine: Machine, event: Event) -> Kind:
            return "as asked"

        def moved(forms: Forms, kind: Kind, now: Form) -> Form:
            return self._moved(forms, kind)

        def kind_of_moved(machine: Machine, event: Event) -> Kind:
            reading = self._at(machine, self._stages.reading)
            if reading is None or not reading.is_early:
                return "nothing"
            return ("take", reading.constant % (1 << NUMBER_BITS)) if reading.opcode == "take" else "move"

        def product(forms: Forms, kind: Kind, now: Form, prefix: str = "") -> Form:
            contents = self._held(forms)
            return forms.times(contents[f"{prefix}data"], contents[f"{prefix}factor"])

        two = self._program.products > 1
        added_up = "products" if two else "product"

        def check_added(kind: Kind, values: Values) -> None:
            for carried in (0, 1):
                forms = Forms()
                total, contents = self._accumulator(forms, carried)
                added = self._contexts.logic(forms, values, {**self._held(forms), **contents}, opened=ADDED).net(ADDED)
                wanted = plus(total, self._held(forms)[added_up])
                self._require_added(forms, added, wanted)

        return [
            self._register("data", always, lambda forms, kind, now: self._signed(forms, READ, self._word)),
            self._register(
                "factor",
                lambda machine, event: self._factor(machine),
                lambda forms, kind, now: self._factor_form(forms, kind),
            ),
            self._register("product", always, product),
            self._register("passed4" if two else "moved", kind_of_moved, moved),
            *(self._second(always, product) if two else ()),
            Subject(ADDED, self._opened(ADDED), always, check_added),
        ]

    def _second(self, always: Callable[[Machine, Event], Kind], product: Callable[..., Form]) -> list[Subject]:
        """Return the subjects of the second product, of the sum of both, and of a word that waits for that."""

        def kind_of_factor(machine: Machine, event: Event) -> Kind:
            reading = self._at(machine, self._stages.reading)
            return None if reading is None else ("constant", reading.second_constant)

        def same(name: str) -> Callable[[Forms, Kind, Form], Form]:
            return lambda forms, kind, now: self._held(forms)[name]

        def both(forms: Forms, kind: Kind, now: Form) -> Form:
            contents = self._held(forms)
            return plus(contents["product"], contents[f"{_SECOND}product"])

        return [
            self._register(f"{_SECOND}data", always, same(SECOND_READ)),
            self._register(f"{_SECOND}factor", kind_of_factor, lambda forms, kind, now: self._factor_form(forms, kind)),
            self._register(f"{_SECOND}product", always, partial(product, prefix=_SECOND)),
            self._register("products", always, both),
            self._register("passed5", always, same("passed4")),
            self._register("moved", always, same("passed5")),
        ]

    def _opened(self, name: str) -> list[Expression]:
        """Return what drives a cut net."""
        return [driver.value for driver in self._netlist.drivers[name]]

    def _require_added(self, forms: Forms, added: Form, wanted: Form) -> None:
        right = same_word(forms, added, wanted, self._width)
        require(right, f"{ADDED} must be the sum before and the product, not another value")

    def _moved(self, forms: Forms, kind: Kind) -> Form:
        """Return what MOVE and TAKE write."""
        if kind == "move":
            return self._signed(forms, READ, self._word)
        if not isinstance(kind, tuple):
            return {}
        total: Form = {}
        digits = self._program.digits
        for k, bit in enumerate(digits[min(kind[1], len(digits) - 1)]):
            one = forms.variable((DATA, bit[1]), 0, 1) if isinstance(bit, tuple) else constant(bit or 0)
            total = plus(total, one, 1 << k)
        return total

    def _accumulator(self, forms: Forms, carried: int) -> tuple[Form, dict[str, Form]]:
        """Return what the accumulator holds, and its registers."""
        split = self._netlist.widths[_LOW]
        low = forms.variable(_LOW, 0, (1 << split) - 1)
        high = self._signed(forms, _HIGH, self._width - split)
        contents = {_LOW: low, _HIGH: high, _CARRIED: constant(carried)}
        above = forms.floor(shifted(high, -self._bits)) if carried else high
        return plus(low, above, 1 << split), contents

    def _total(self) -> Subject:
        contexts, split = self._contexts, self._netlist.widths.get(_LOW, 0)
        names = (_LOW, _HIGH, _CARRIED)

        def check(kind: Kind, values: Values) -> None:
            forms = Forms()
            logic = contexts.logic(forms, values, self._held(forms))
            low, high, carried = (
                contexts.after(name, logic, forms, forms.variable(name, 0, (1 << self._netlist.widths[name]) - 1))
                for name in names
            )
            high = forms.signed(high, self._width - split)
            later = forms.floor(shifted(high, -self._bits))
            accumulated = plus(
                forms.unsigned(low, split),
                plus(high, forms.times(forms.unsigned(carried, 1), plus(later, high, -1))),
                1 << split,
            )
            added = self._signed(forms, ADDED, self._width)
            wanted = {} if kind == "clear" else forms.floor(shifted(added, -self._bits)) if kind == "carry" else added
            right = same_word(forms, accumulated, wanted, self._width)
            require(right, f"{_LOW} and {_HIGH} must {kind} what is added up, not another value")

        return Subject("total", [v for name in names for v in contexts.loads(name)], self._kind_of_total, check)

    def _write(self, number: int) -> Subject:
        """Return the subject of what is written to a memory, and to which channel's words."""
        name, port = self._control.words[number], self._control.writes[number]
        low, width = int(name[5:]), self._netlist.memories[name].width

        def check(kind: Kind, values: Values) -> None:
            forms = Forms()
            contents = self._held(forms)
            early = kind == "move" or isinstance(kind, tuple)
            if not early:
                contents["moved"] = {}  # nothing is moved while something is stored
            word_written = self._contexts.logic(forms, values, contents).word(port.data)
            moved = self._moved(forms, kind) if self._is_serial else contents["moved"]
            word = moved if early else contents[ADDED]
            whole = forms.unsigned(word, self._bits if kind == "store" else self._word)
            wanted = forms.unsigned(forms.floor(shifted(whole, -low)), width)
            require(
                same_word(forms, word_written, wanted, width), f"{name} must be given {_shown(kind)}, not another value"
            )

        if self._program.channels > 1:
            for address in (port.address, *(ports[number].address for ports in self._control.reads.values())):
                self._check_channel(name, address)
        return Subject(name, [port.data], self._kind_of_write, check)

    def _check_channel(self, memory: str, address: Expression) -> None:
        """Check that the upper bits of an address are the channel, whatever the lower ones."""
        forms = Forms()
        bits = self._program.words.bit_length() - 1
        whole = self._contexts.logic(forms, {}, {}, deep=True).word(address)
        upper = forms.floor(shifted(forms.unsigned(whole, self._netlist.width(address)), -bits))
        right = same_word(forms, upper, self._channel_form(forms), self._netlist.widths["channel"])
        require(right, f"{memory} must be used for the channel of the sample, not for another one")

    def _channel_form(self, forms: Forms) -> Form:
        return unknown(forms, Slice("channel", 0, self._netlist.widths["channel"]))

    def _channel(self) -> list[Subject]:
        width = self._netlist.widths.get("channel", 0)
        require(0 < width <= self._netlist.widths[DEST], "a core with several channels must have a register channel")

        def check(kind: Kind, values: Values) -> None:
            forms = Forms()
            now, dest = self._channel_form(forms), forms.variable(DEST, 0, (1 << self._netlist.widths[DEST]) - 1)
            logic = self._contexts.logic(forms, values, {DEST: dest, "channel": now})
            content = self._contexts.after("channel", logic, forms, now)
            right = same_word(forms, content, dest if kind == "begin" else now, width)
            require(right, f"channel must be that of the sample in work, not another one, to {kind}")

        def kind_of(machine: Machine, event: Event) -> Kind:
            return "begin" if event.begins else "keep"

        return [Subject("channel", self._contexts.loads("channel"), kind_of, check)]

    # Serial.

    def _serial(self) -> list[Subject]:
        word = self._word

        def kind_of_factors(machine: Machine, event: Event) -> Kind:
            return self._factor(machine) if event.advance else "shift"

        def kind_of_first(machine: Machine, event: Event) -> Kind:
            kind = kind_of_factors(machine, event)
            return kind if kind in {None, "shift"} else "word"

        def first(forms: Forms, kind: Kind, now: Form) -> Form:
            return plus(now, now) if kind == "shift" else self._signed(forms, READ, word)

        def second(forms: Forms, kind: Kind, now: Form) -> Form:
            return forms.floor(shifted(now, -1)) if kind == "shift" else self._factor_form(forms, kind)

        def check_added(kind: Kind, values: Values) -> None:
            for carried in (0, 1):
                for left in self._lefts():
                    self._check_digit(carried, *left)

        def always(machine: Machine, event: Event) -> Kind:
            return "as asked"

        return [
            self._register("shifted", kind_of_first, first),
            self._register("left", kind_of_factors, second),
            Subject(ADDED, (), always, check_added),
        ]

    def _lefts(self) -> list[tuple[int, int, int]]:
        """Return all values of what is left of a factor as ``2 q + r``: r, and least and largest q."""
        top = 1 << (self._word - 2)
        return [(r, low, high) for r in (0, 1) for low, high in ((-top, -2), (-1, -1), (0, 0), (1, top - 1))]

    def _check_digit(self, carried: int, odd: int, low: int, high: int) -> None:
        """Check one digit of a multiplication: what is added, and whether it was the last one."""
        forms = Forms()
        half = forms.variable("half", low, high)
        left = plus(plus(half, half), constant(odd))
        total, contents = self._accumulator(forms, carried)
        factor = self._signed(forms, "shifted", 2 * self._word)
        contents |= {"left": left, "shifted": factor}
        logic = self._contexts.logic(forms, {}, contents, opened=ADDED)
        wanted = plus(total, factor, -odd if low == high == -1 else odd)
        self._require_added(forms, logic.net(ADDED), wanted)
        done = self._contexts.logic(forms, {}, contents, opened=DONE).net(DONE)
        last = low == high == 0 or (low == high == -1 and odd)
        require(
            forms.unsigned(done, 1) == constant(int(last)),
            f"{DONE} must be {int(last)} while {'nothing but a sign is' if last else 'there are digits'} left",
        )


def _shown(kind: Kind) -> str:
    return " ".join(map(str, kind)) if isinstance(kind, tuple) else str(kind)
