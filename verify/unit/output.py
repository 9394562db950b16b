"""What leaves a unit: the result, limited, and its flags, each of the sample that the result is of."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.program.text import ProgramText
from sosmith.verify.reader.syntax import Bits
from sosmith.verify.unit.contexts import Contexts, Slice, unknown
from sosmith.verify.unit.control import Control, Event, Machine, Stages, read_ports
from sosmith.verify.unit.data import ADDED, Kind, Subject
from sosmith.verify.unit.ternary import Values

OUTPUT, FLAGS, OUTPUT_DEST = "m_axis_tdata", "m_axis_tuser", "m_axis_tdest"
_RAIL, _OUTSIDE, _JUDGED, _SETTLING = "rail", "outside", "judged", "settling"
_FLAG_BITS = 8
_NEVER = (6, 7)


class Output:
    """The registers of results and flags, and the ports that they leave by.

    Parameters
    ----------
    netlist : Netlist
    program : ProgramText
    control : Control
    contexts : Contexts
    stages : Stages
    certificate : Certificate
        Whose graph says how a result is limited, and whose ports have rails. Its item says at what codes the output is
        worn; without an item, the flags of wear are left out.

    Attributes
    ----------
    copies : bool
        Whether the flags of a result are copied when it is complete, since the next sample may have begun.
    settles : bool
        Whether the program judges whether the filter has settled.
    """

    def __init__(
        self,
        netlist: Netlist,
        program: ProgramText,
        control: Control,
        contexts: Contexts,
        stages: Stages,
        certificate: Certificate,
    ) -> None:
        self._netlist, self._program, self._control, self._stages = netlist, program, control, stages
        self._contexts, self._certificate = contexts, certificate
        item = None if certificate.about is None else certificate.about.item
        self._worn = None if item is None else item.wear
        self._node: NodeEntry = certificate.stages[-1].nodes[certificate.stages[-1].outputs[0]]
        self.settles = len(certificate.stages[-1].outputs) > 1
        self.copies = self._has(_JUDGED)
        self.subjects = [
            *(self._given(k) for k in range(len(program.results))),
            self._flag(_RAIL, self._kind_of_rail),
            *([self._flag(_OUTSIDE, self._kind_of_outside)] if self._has(_OUTSIDE) else []),
            *([self._flag(_SETTLING, self._kind_of_settling)] if self.settles else []),
            *([self._flag(_JUDGED, self._kind_of_judged)] if self.copies else []),
            self._port(),
        ]
        if self._worn is not None and len(self._worn) > 1:
            self._check_memory(self._worn)

    def _has(self, name: str) -> bool:
        """Whether there is a register, whole or in parts: a net of this name may be what is left of one that is 0."""
        return name in self._netlist.registers or name in self._netlist.fields.values()

    # Kinds.

    def samples_inputs(self, event: Event) -> bool:
        """Whether the flags of the inputs are taken over at a clock."""
        return event.accepted if self.copies else event.begins

    def judges(self, machine: Machine, event: Event) -> str | None:
        """Return the flag that the program judges at a clock; None if it judges none."""
        last = self._control.instruction(machine, self._stages.last)
        if not event.advance or last is None or last.end != "judge":
            return None
        return _SETTLING if self.settles and last.target % 2 else _OUTSIDE

    def _kind_of_given(self, number: int, machine: Machine, event: Event) -> Kind:
        last = self._control.instruction(machine, self._stages.last)
        gives = event.advance and last is not None and last.end == "give"
        return "added" if gives and last is not None and self._program.part(last.target) == number else "keep"

    def _kind_of_rail(self, machine: Machine, event: Event) -> Kind:
        return "inputs" if self.samples_inputs(event) else "keep"

    def _kind_of_outside(self, machine: Machine, event: Event) -> Kind:
        judges = self.judges(machine, event) == _OUTSIDE
        if self.samples_inputs(event):
            require(not judges, f"{_OUTSIDE} must not be judged while a sample comes")
            return "inputs"
        return "judge" if judges else "keep"

    def _kind_of_settling(self, machine: Machine, event: Event) -> Kind:
        return "judge" if self.judges(machine, event) == _SETTLING else "keep"

    def _kind_of_judged(self, machine: Machine, event: Event) -> Kind:
        return "copy" if event.ends else "keep"

    # Subjects.

    def _given(self, number: int) -> Subject:
        """Return the subject of the register that holds a part of the result."""
        name = f"given{number}" if self._has(f"given{number}") else OUTPUT
        width = self._program.results[number]

        def check(kind: Kind, values: Values) -> None:
            forms = Forms()
            now = forms.variable(name, 0, (1 << width) - 1)
            added = _signed(forms, ADDED, self._program.accumulator_bits)
            logic = self._contexts.logic(forms, values, {name: now, ADDED: added})
            content = self._contexts.after(name, logic, forms, now)
            right = same_word(forms, content, added if kind == "added" else now, width)
            require(right, f"{name} must be {kind} after a clock, not another value")

        def kind(machine: Machine, event: Event) -> Kind:
            return self._kind_of_given(number, machine, event)

        return Subject(name, self._contexts.loads(name), kind, check)

    def _flag(self, name: str, kind: Callable[[Machine, Event], Kind]) -> Subject:
        """Return the subject of a register that holds flags."""
        width = self._netlist.widths.get(name, 1)

        def check(kind: Kind, values: Values) -> None:
            forms = Forms()
            now = forms.variable(name, 0, (1 << width) - 1)
            contents = {name: now, ADDED: _signed(forms, ADDED, self._program.accumulator_bits)}
            others = [other for other in (_RAIL, _OUTSIDE, _SETTLING) if other != name and self._has(other)]
            contents = {other: self._held(forms, other) for other in others} | contents
            logic = self._contexts.logic(forms, values, contents, fields=self._fields(forms))
            content = self._contexts.after(name, logic, forms, now)
            right = same_word(forms, content, self._wanted(forms, name, kind, now, contents[ADDED]), width)
            require(right, f"{name} must be {kind} after a clock, not another value")

        return Subject(name, self._contexts.loads(name), kind, check)

    def _held(self, forms: Forms, name: str) -> Form:
        """Return what the register of a flag holds; one that is not there holds 0."""
        return forms.variable(name, 0, 1) if self._has(name) else {}

    def _wanted(self, forms: Forms, name: str, kind: Kind, now: Form, added: Form) -> Form:
        if kind == "keep":
            return now
        if kind == "copy":
            both = plus(self._held(forms, _RAIL), self._held(forms, _OUTSIDE), 2)
            return plus(both, self._held(forms, _SETTLING), 4 if self.settles else 0)
        if kind == "inputs":
            return self._at_rail(forms) if name == _RAIL else {}
        negative = forms.negative(added)
        if name == _SETTLING:
            return negative
        return plus(plus(now, negative), forms.times(now, negative), -1)

    # Inputs.

    def _code(self, forms: Forms, number: int) -> Form:
        port = self._certificate.inputs[number]
        return forms.variable(("code", number), port.lowest, port.highest)

    def _fields(self, forms: Forms) -> list[tuple[int, int, Form]]:
        """Return the fields of the input: where each begins, how wide it is, and its word."""
        fields: list[tuple[int, int, Form]] = []
        offset = 0
        for number, port in enumerate(self._certificate.inputs):
            fields.append((offset, port.bits, forms.unsigned(self._code(forms, number), port.bits)))
            offset += -(-port.bits // 8) * 8
        return fields

    def _at_rail(self, forms: Forms) -> Form:
        """Whether an input has its lowest or its highest code."""
        inside = constant(1)
        for number, port in enumerate(self._certificate.inputs):
            code = self._code(forms, number)
            above = forms.negative(plus(constant(port.lowest), code, -1))
            below = forms.negative(plus(code, constant(port.highest), -1))
            inside = forms.times(inside, forms.times(above, below))
        return plus(constant(1), inside, -1)

    # What leaves.

    def _port(self) -> Subject:
        if self._program.channels > 1:
            self._check_dest()

        def kind(machine: Machine, event: Event) -> Kind:
            return "result" if machine.waiting else None

        return Subject(OUTPUT, [Bits(OUTPUT), Bits(FLAGS)], kind, lambda kind, values: self._check_ports(values))

    def _check_ports(self, values: Values) -> None:
        forms = Forms()
        node, bits = self._node, self._certificate.output.bits
        is_limited = node.op is Operation.CLAMP
        source = self._certificate.stages[-1].nodes[node.operands[0]] if is_limited else node
        result = forms.variable("result", source.low, source.high)
        below, above, code = constant(0), constant(0), result
        if is_limited:
            below = forms.negative(plus(result, constant(node.low), -1))
            above = forms.negative(plus(constant(node.high), result, -1))
            code = plus(result, forms.times(below, plus(constant(node.low), result, -1)))
            code = plus(code, forms.times(above, plus(constant(node.high), result, -1)))
        logic = self._contexts.logic(forms, values, self._parts(forms, result) | self._flags(forms))
        width = -(-bits // 8) * 8
        require(self._netlist.widths[OUTPUT] == width, f"{OUTPUT} must have {width} bits")
        require(same_word(forms, logic.net(OUTPUT), code, width), f"{OUTPUT} must be the result, not another value")
        self._check_flags(forms, logic, code, plus(below, above))

    def _check_dest(self) -> None:
        """Check that the channel of a result is that of the sample in work."""
        forms = Forms()
        channel = unknown(forms, Slice("channel", 0, self._netlist.widths["channel"]))
        dest = self._contexts.logic(forms, {}, {}, deep=True).net(OUTPUT_DEST)
        right = same_word(forms, dest, channel, self._netlist.widths[OUTPUT_DEST])
        require(right, f"{OUTPUT_DEST} must be the channel of the sample, not another value")

    def _parts(self, forms: Forms, result: Form) -> dict[str, Form]:
        """Return what the registers of a result hold: its digits."""
        digit = self._program.digit_bits
        contents: dict[str, Form] = {}
        for k, width in enumerate(self._program.results):
            name = f"given{k}" if self._has(f"given{k}") else OUTPUT
            contents[name] = forms.unsigned(forms.floor(shifted(result, -digit * k)), width)
        return contents

    def _flags(self, forms: Forms) -> dict[str, Form]:
        """Return what the registers hold that the flags of a result are in."""
        own = {name: forms.variable(name, 0, 1) for name in (_RAIL, _OUTSIDE, _SETTLING) if self._has(name)}
        if not self.copies:
            return own
        bits = [self._held(forms, name) for name in (_RAIL, _OUTSIDE, _SETTLING)]
        width = self._netlist.widths[_JUDGED]
        total: Form = {}
        for place, bit in enumerate(bits[:width]):
            total = plus(total, bit, 1 << place)
        return {_JUDGED: total}

    def _check_flags(self, forms: Forms, logic: Evaluation, code: Form, limited: Form) -> None:
        require(self._netlist.widths[FLAGS] == _FLAG_BITS, f"{FLAGS} must have {_FLAG_BITS} bits")
        outside = self._held(forms, _OUTSIDE)
        settling = self._held(forms, _SETTLING) if self.settles else constant(0)
        wanted: dict[int, tuple[str, Form]] = {
            0: ("input_at_rail", self._held(forms, _RAIL)),
            1: ("outside_calibration", outside),
            2: ("output_saturated", limited),
            5: ("settling", settling),
            **{place: ("0, as there is no such flag", constant(0)) for place in _NEVER},
        }
        if self._worn is not None:
            ends = self._wear(forms, self._worn)
            for place, (name, end) in enumerate(zip(("wear_warning", "wear_critical"), ends, strict=True), 3):
                worn = constant(0) if end is None else plus(constant(1), forms.negative(plus(code, end, -1)), -1)
                wanted[place] = name, plus(worn, forms.times(worn, settling), -1)
        for place, (name, value) in sorted(wanted.items()):
            right = same_word(forms, logic.net(FLAGS, place, 1), value, 1)
            require(right, f"bit {place} of {FLAGS} must be {name}, not another value")

    # Wear.

    def _wear(self, forms: Forms, wear: Sequence[tuple[int, int]]) -> tuple[Form | None, Form | None]:
        """Return the limits of wear of a result; None if wear is not judged."""
        if not wear:
            return None, None
        if len(wear) == 1:
            return constant(wear[0][0]), constant(wear[0][1])
        output, name = self._certificate.output, self._limit_register()
        word = forms.variable(name, 0, (1 << (2 * output.bits)) - 1)
        limits = [forms.floor(shifted(word, -output.bits * k)) for k in range(2)]
        sides = [forms.signed(f, output.bits) if output.signed else forms.unsigned(f, output.bits) for f in limits]
        return sides[0], sides[1]

    def _limit_register(self) -> str:
        (port,) = read_ports(self._netlist, "wear_limits")
        return port.register

    def _check_memory(self, wear: Sequence[tuple[int, int]]) -> None:
        """Check the memory of limits: its words, and that it is read for the channel at every clock."""
        memory = self._netlist.memories.get("wear_limits")
        if memory is None:
            raise RejectedError("a core whose channels have limits of their own must have a memory wear_limits")
        bits = self._certificate.output.bits
        mask = (1 << bits) - 1
        words = tuple((low & mask) | (high & mask) << bits for low, high in wear)
        require(memory.first == words and not memory.statements, "wear_limits must hold the limits of all channels")
        ports = read_ports(self._netlist, memory.name)
        require(len(ports) == 1 and ports[0].enable is None, "wear_limits must be read at every clock")
        forms = Forms()
        address = self._contexts.logic(forms, {}, {}, deep=True).word(ports[0].address)
        width = self._netlist.widths["channel"]
        channel = unknown(forms, Slice("channel", 0, width))
        right = self._netlist.width(ports[0].address) == width and same_word(forms, address, channel, width)
        require(right, "wear_limits must be read for the channel of the sample")


def _signed(forms: Forms, name: str, width: int) -> Form:
    return forms.variable(name, -1 << (width - 1), (1 << (width - 1)) - 1)
