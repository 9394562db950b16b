"""Proves that the program of a folded or serial core computes the graph of its certificate, for all inputs and states.

The program is read from the core's SystemVerilog (`sosmith.verify.program.text`) and run once, with normal forms
in place of numbers (`sosmith.verify.program.normal_form`)::

    certificate --> graph --> form of each node ---------------------+
                      |                                              v
                      +--> states: words <-> DELAY nodes --> run --> equal?  each value stored, the result, the states
                      |    (program_states)                   ^
    core.sv ----> program ------------------------------------+

1. At the start of a sample, the words of a state hold the digits of its DELAY node, and the last word holds 1. A DELAY
   node that no words hold is the floor of another one.
2. Each value that the program stores must be that of a node: the same form, up to multiples of what the top digit
   drops. The certificate's range of that node then says that it fits its digits.
3. At the end, the result must be the output of the graph before it is limited, and the words of each state must hold
   the digits of what its DELAY node takes over. What a node takes over that is a floor must be that floor.

By induction over the samples, the states are then those of the graph at every sample. The accumulator adds modulo its
width; the proof shows that it fits whenever its upper bits are used. The ranges are those of the certificate, which
`sosmith.verify.verification` proves. What runs the program, the limits of the output and the flags but
outside_calibration are not part of this proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.program.fault import Contribution, Group, fault
from sosmith.verify.program.graph_forms import Graph, floored, joined
from sosmith.verify.program.logic import Bit
from sosmith.verify.program.memory import Kept, Memory
from sosmith.verify.program.normal_form import ONE, Form, Forms, constant, plus, scaled, times, valuation
from sosmith.verify.program.run import one_bit_away, samples
from sosmith.verify.program.states import State, find_states
from sosmith.verify.program.text import NUMBER_BITS, Instruction, ProgramText, read_program

STORED, MOVED = 4, 3
"""Least number of instructions from one that writes a word to one that reads it: so deep is the pipeline.

MOVE and TAKE write one pipeline stage before STORE and FINISH. With two products a clock, there is one stage more, and
all write in the last one.
"""

_SAMPLES = 32
"""Samples for which a program is run on numbers, to find where it is wrong."""


@dataclass(frozen=True)
class ProgramVerdict:
    """The result of the check of a program.

    Attributes
    ----------
    instructions, values, states : int
        Number of instructions, of values that they store, and of states.
    judged : tuple of (int, int)
        Smallest and largest code of each input without the flag outside_calibration.
    program : ProgramText
        The program as it was read.
    memory : Memory
        Which words hold which values.
    """

    instructions: int
    values: int
    states: int
    judged: tuple[tuple[int, int], ...]
    program: ProgramText = field(repr=False, compare=False)
    memory: Memory = field(repr=False, compare=False)


def check_program(
    text: str,
    certificate: Certificate,
    *,
    top: str | None = None,
    calibrated: Sequence[tuple[int, int]] | None = None,
) -> ProgramVerdict:
    """Prove that the program in a core's SystemVerilog computes the graph of a certificate.

    Parameters
    ----------
    text : str
        SystemVerilog of a folded or serial core.
    certificate : Certificate
        Its certificate, which `verify` has accepted.
    top : str or None
        Name of its module; None for that of the certificate.
    calibrated : sequence of (int, int) or None
        Smallest and largest code of each input that is not outside the calibration; None to take what the program has,
        since the certificate does not say.

    Returns
    -------
    ProgramVerdict
        The result.

    Raises
    ------
    RejectedError
        If the program computes anything else, or the text has no program that can be checked; the sentence names the
        first instruction that is wrong.
    """
    program = read_program(text, top or certificate.name)
    graph = joined(certificate)
    run = _proven(program, graph, certificate)
    ends = [(port.lowest, port.highest) for port in certificate.inputs]
    judged = tuple((max(low, a), min(high, b)) for (low, high), (a, b) in zip(ends, run.judged, strict=True))
    for index, (port, limits, wanted) in enumerate(zip(certificate.inputs, judged, calibrated or judged, strict=True)):
        last = run.judges.get(index)
        who = "the program" if last is None else program.named(last)
        require(
            limits == tuple(wanted),
            f"{who} must judge {port.name} by the codes {wanted[0]}..{wanted[1]}, not {limits[0]}..{limits[1]}",
        )
    return ProgramVerdict(len(program.instructions), run.values, len(run.states), judged, program, run.memory())


def _proven(program: ProgramText, graph: Graph, certificate: Certificate) -> _Run:
    """Return a run that proves a program by either guess of its states, or say what is wrong by the first one."""
    run = _Run(program, graph, certificate)
    try:
        run.all()
    except RejectedError as error:
        other = _Run(program, graph, certificate, own_words=True)
        if other.guess != run.guess:
            with suppress(RejectedError):
                other.all()
                return other
        raise _located(run, certificate) or error from None
    return run


def _check_order(program: ProgramText) -> None:
    """Check what does not depend on values: TAKE comes first, words are read in time, the result comes last."""
    digits, taken = len(program.digits), 0
    for number, instruction in enumerate(program.instructions):
        opcode, value = instruction.opcode, instruction.constant
        named = program.named(number)
        if taken < digits and opcode != "multiply":
            wanted = opcode == "take" and value % (1 << NUMBER_BITS) == taken
            require(wanted, f"{named} must take digit {taken} of the sample, which must be taken first")
            taken += 1
        else:
            require(opcode != "take", f"{named} must not take a digit of a sample that has been accepted")
    _check_words(program)
    last = len(program.instructions) - 1
    end = program.instructions[last]
    is_end = end.opcode == "give" and program.part(end.target) == len(program.results) - 1
    require(is_end, f"{program.named(last)} must give the last part of the result")


def _check_words(program: ProgramText) -> None:
    """Check that words are read and written in time, for two samples one behind the other."""
    count = len(program.instructions)
    readable: dict[int, tuple[int, int]] = {}
    for number in range(2 * count):
        instruction = program.instructions[number % count]
        named = program.named(number % count)
        for address in instruction.read:
            stored, distance = readable.get(address, (-STORED, 0))
            require(
                number >= stored + distance,
                f"{named} must read its word {distance} or more instructions after it is stored, not {number - stored}",
            )
        if instruction.is_early and number and program.products == 1:
            before = program.instructions[(number - 1) % count]
            require(
                not before.writes or before.is_early,
                f"{named} must not write at the same clock as {program.named((number - 1) % count)}",
            )
        if instruction.writes:
            at_once = instruction.is_early and program.products == 1
            readable[instruction.target] = number, MOVED if at_once else STORED + program.products - 1


def _located(wrong: _Run, certificate: Certificate) -> RejectedError | None:
    """Return the rejection for a program that would be right but for one bit; None if there is no such bit."""
    program, graph = wrong.program, wrong.graph
    states = dict.fromkeys(graph.delays, 0)
    results = [graph.step(row, states) for row in samples(certificate, _SAMPLES)]
    sentences = []
    for number, code in one_bit_away(program, certificate, results, wrong.suspects()):
        right = replace(program, codes=(*program.codes[:number], code, *program.codes[number + 1 :]))
        try:
            run = _Run(right, graph, certificate)
            run.all()
        except RejectedError:
            continue
        node = graph.nodes[run.purpose.get(number, graph.output)]
        sentences.append(
            f"instruction {number} must be {right.instructions[number]} for {node.label}, "
            f"not {program.instructions[number]}"
        )
    return RejectedError(", or ".join(sentences)) if sentences else None


class _Word(NamedTuple):
    """What a memory word or the operand register holds: a form in low..high."""

    form: Form
    low: int
    high: int


@dataclass
class _Accumulator:
    """``floor(total / 2**shift)``, in low..high; `begun` once a digit was split off that was not dropped."""

    total: Form = field(default_factory=dict)
    shift: int = 0
    low: int = 0
    high: int = 0
    begun: bool = False


class _Run:
    """One sample of a program, on forms."""

    def __init__(
        self, program: ProgramText, graph: Graph, certificate: Certificate, *, own_words: bool = False
    ) -> None:
        self.program, self.graph, self._certificate = program, graph, certificate
        self._bits = program.digit_bits
        self._forms = Forms()
        self.states, self._floors = find_states(program, graph, certificate, own_words=own_words)
        self._of = graph.values(self._forms, self._floors)
        base = 1 << self._bits
        self._words = [
            _Word(self._forms.variable(("word", address), -base, base - 1), -base, base - 1)
            for address in range(program.words)
        ]
        self._words[-1] = _Word(constant(1), 1, 1)
        for state in self.states:
            low, high = graph.nodes[state.node].limits
            digits = self._digits(self._state(state.node, state.node, state.shift), state.digits)
            for k, digit in enumerate(digits):
                top = k == state.digits - 1
                self._words[state.address + k] = self._word(
                    digit, (low, high) if top else None, self._frac(state.node) + state.shift, k
                )
        self._history = [(address, word.form) for address, word in enumerate(self._words)]
        self._stored: list[tuple[int, ...]] = []
        self._taken_at = list[int]()
        self._acc = _Accumulator()
        self._group = Group()
        self._operand = _Word(self._forms.variable("operand", -base, base - 1), -base, base - 1)
        self._given: dict[int, tuple[Form, int]] = {}
        self._writers: dict[int, int] = {}
        self.values = 0
        self.judges: dict[int, int] = {}
        self._flagged = False
        self.purpose: dict[int, int] = {}
        self._groups: dict[int, list[int]] = {}
        self._suspects: list[int] = []
        self.judged = [(port.lowest, port.highest) for port in certificate.inputs]

    @property
    def guess(self) -> tuple[list[State], dict[int, int]]:
        """Where the states are taken to be: in which words, and as the floor of which others."""
        return self.states, self._floors

    def all(self) -> None:
        """Run the program, and check the result and the states.

        Raises
        ------
        RejectedError
            If it does not compute the graph.
        """
        _check_order(self.program)
        for number, instruction in enumerate(self.program.instructions):
            self._step(number, instruction)
        self._finish_sample()

    def memory(self) -> Memory:
        """Return which words hold which values, once the program has run."""
        nodes = self.graph.nodes
        return Memory(
            states=tuple(
                Kept(
                    tuple(range(state.address, state.address + state.digits)),
                    nodes[state.node].name,
                    self._frac(state.node) + state.shift,
                )
                for state in self.states
            ),
            stored=tuple(self._stored),
            taken=frozenset(self._taken_at),
            written=tuple(self._history),
            nodes={node.name: index for index, node in enumerate(nodes)},
            digits=lambda node, frac, count: self._digits(scaled(self._of[node], frac), count),
        )

    def suspects(self) -> list[int]:
        """Return the instructions that work on the value at which the run has stopped."""
        return self._suspects or [*self._group.instructions, *self._group.ends[-1:]]

    # Values and their digits.

    def _frac(self, node: int) -> int:
        return self.graph.nodes[node].entry.frac

    def _state(self, node: int, state: int, shift: int) -> Form:
        """Value of a node as the words of a state hold it."""
        return scaled(self._of[node], self._frac(state) + shift)

    def _digits(self, value: Form, count: int) -> list[Form]:
        floors = [self._forms.floor(scaled(value, -self._bits * k)) for k in range(count)]
        low = [plus(a, b, -(1 << self._bits)) for a, b in pairwise(floors)]
        return [*low, floors[-1]]

    def _word(self, form: Form, limits: tuple[Fraction, Fraction] | None, frac: int, position: int) -> _Word:
        """Return a word with a digit: one of the lower ones, or the top one of a value in `limits`."""
        if limits is None:
            return _Word(form, 0, (1 << self._bits) - 1)
        unit = Fraction(2) ** (frac - self._bits * position)
        return _Word(form, (limits[0] * unit).__floor__(), (limits[1] * unit).__floor__())

    # Instructions.

    def _step(self, number: int, instruction: Instruction) -> None:
        value, target = instruction.constant, instruction.target
        word, end = self._words[instruction.address], instruction.end
        if end == "take":
            self._take(number, target, value)
            return
        if instruction.multiplies_words:
            self._add(word, self._operand.form, (self._operand.low, self._operand.high))
        elif value:
            self._add(word, constant(value), (value, value))
        if second := instruction.second_constant:
            self._add(self._words[instruction.second_address], constant(second), (second, second))
        if end == "operand":
            self._operand = word
        elif end == "move":
            self._store(number, target, word)
        elif end in {"store", "drop", "give"}:
            self._column(number, end, target)
        elif end == "finish":
            self._finish(number, target)
        elif end == "judge":
            self._judge(number, target)
        if end not in {"finish", "judge"}:
            self._group.instructions.append(number)

    def _take(self, number: int, address: int, value: int) -> None:
        self._store(number, address, self._taken(number, self.program.digits[value % (1 << NUMBER_BITS)]))
        self._taken_at.append(address)
        self._acc = _Accumulator()

    def _taken(self, number: int, bits: Sequence[Bit]) -> _Word:
        """Return a digit of an input: zeros, then bits of its code in order, then zeros or its sign."""
        offset = 0
        zeros = next((k for k, bit in enumerate(bits) if bit != 0), len(bits))
        for port, node in zip(self._certificate.inputs, self.graph.inputs, strict=True):
            code = scaled(self._of[node], self._frac(node))
            own = [("s_axis_tdata", offset + k) for k in range(port.bits)]
            offset += -(-port.bits // 8) * 8
            if zeros == len(bits) or bits[zeros] not in own:
                continue
            first = own.index(bits[zeros])  # type: ignore[arg-type]
            count = next(
                (k for k in range(len(bits) - zeros) if first + k >= port.bits or bits[zeros + k] != own[first + k]),
                len(bits) - zeros,
            )
            rest, ends_in_sign = bits[zeros + count :], port.signed and first + count == port.bits
            if ends_in_sign and all(bit == own[-1] for bit in rest):
                form = scaled(self._forms.floor(scaled(code, -first)), zeros)
                low, high = self._forms.extent(form)
                base = 1 << self._bits
                return _Word(form, max(int(low), -base), min(int(high), base - 1))
            if not any(rest) and count < len(bits) - zeros:
                above, below = (self._forms.floor(scaled(code, -first - k)) for k in (count, 0))
                form = scaled(plus(below, above, -(1 << count)), zeros)
                return _Word(form, 0, ((1 << count) - 1) << zeros)
        require(zeros == len(bits), f"{self.program.named(number)} must take a digit of an input, not bits of several")
        return _Word({}, 0, 0)

    def _store(self, number: int, address: int, word: _Word) -> None:
        self._words[address] = word
        self._writers[address] = number
        self._history.append((address, word.form))

    def _add(self, word: _Word, factor: Form, ends: tuple[int, int]) -> None:
        acc = self._acc
        product = times(word.form, factor)
        acc.total = plus(acc.total, product, 1 << acc.shift)
        corners = [a * b for a in (word.low, word.high) for b in ends]
        acc.low, acc.high = acc.low + min(corners), acc.high + max(corners)
        self._group.contributions.append(Contribution(product, len(self._group.ends)))

    def _fits(self, number: int) -> None:
        limit = 1 << (self.program.accumulator_bits - 1)
        acc = self._acc
        require(
            -limit <= acc.low and acc.high < limit,
            f"{self.program.named(number)} must find a sum that fits the {self.program.accumulator_bits} bits of the "
            f"accumulator, not one in {acc.low}..{acc.high}",
        )

    def _column(self, number: int, end: str, target: int) -> None:
        """Split the lowest digit off the accumulator: it is stored, given or dropped."""
        acc = self._acc
        self._fits(number)
        if end != "drop":
            self._begin()
            low, high = (self._forms.floor(scaled(acc.total, -acc.shift - k)) for k in (0, self._bits))
            part = self.program.part(target)
            if end == "store":
                self._store_next(number, target, self._word(plus(low, high, -(1 << self._bits)), None, 0, 0))
            elif part == len(self.program.results) - 1:
                self._given[part] = low, number
            elif part is not None:
                self._given[part] = plus(low, high, -(1 << self._bits)), number
        acc.shift += self._bits
        acc.low, acc.high = acc.low >> self._bits, acc.high >> self._bits
        self._group.ends.append(number)

    def _begin(self) -> None:
        """Take what is left after all digits that were dropped as the value that is stored from now on."""
        acc = self._acc
        if not acc.begun:
            acc.total, acc.shift, acc.begun = self._forms.floor(scaled(acc.total, -acc.shift)), 0, True

    def _store_next(self, number: int, address: int, word: _Word) -> None:
        self._store(number, address, word)

    def _finish(self, number: int, address: int) -> None:
        """Store the top digit of a value, which must be that of a node."""
        acc = self._acc
        self._begin()
        top = acc.shift + self._bits
        match = self._node(acc.total, top)
        self._group.ends.append(number)
        if match is None:
            require(False, fault(self.program, self.graph, self._of, self._group))
            return
        node, frac = match
        value = scaled(self._of[node], frac)
        form = self._forms.floor(scaled(value, -acc.shift))
        limits = self.graph.nodes[node].limits
        self._store_next(number, address, self._word(form, limits, frac, acc.shift // self._bits))
        self.values += 1
        self._groups[number] = [*self._group.instructions, number]
        self._stored.append(
            tuple(self.program.instructions[end].target for end in self._group.ends if self._stores(end))
        )
        self.purpose |= dict.fromkeys(self._groups[number], node)
        self._acc, self._group = _Accumulator(), Group()

    def _stores(self, number: int) -> bool:
        return self.program.instructions[number].end in {"store", "finish"}

    def _node(self, total: Form, top: int) -> tuple[int, int] | None:
        """Find a node that is `total` modulo ``2**(top + 1)`` as a signed number, with some number of fraction bits.

        Of several with the same value, take the one with the narrowest range: it holds for all of them. A total of 0 is
        any node that is 0.
        """
        modulus = 2 << top
        rest = {monomial: c for monomial, c in total.items() if c % modulus}
        if not rest:
            return next(((node, 0) for node, value in enumerate(self._of) if not value), None)
        least = min(map(valuation, rest.values()))
        best: tuple[Fraction, int, int] | None = None
        for node, value in enumerate(self._of):
            if not value:
                continue
            frac = least - min(map(valuation, value.values()))
            unit = Fraction(2) ** frac
            low, high = self.graph.nodes[node].limits
            if not (-(1 << top) <= low * unit and high * unit < 1 << top):
                continue
            if (best is None or high - low < best[0]) and all(
                (total.get(m, 0) - value.get(m, 0) * unit) % modulus == 0 for m in total.keys() | value.keys()
            ):
                best = high - low, node, frac
        return None if best is None else best[1:]

    def _judge(self, number: int, target: int) -> None:
        """Compare an input with a limit: negative if it is outside; or judge whether the filter has settled."""
        self._fits(number)
        total = self._acc.total
        if self.graph.settling is not None:
            require(target in {0, 1}, f"{self.program.named(number)} must judge flag 0 or 1, not {target}")
            if target == 1:
                right = total == self._of[self.graph.settling] and not self._acc.begun
                require(right, f"{self.program.named(number)} must judge {self.graph.nodes[self.graph.settling].label}")
                self._acc, self._group, self._flagged = _Accumulator(), Group(), True
                return
        free = total.get(ONE, 0)
        for index, node in enumerate(self.graph.inputs):
            code = scaled(self._of[node], self._frac(node))
            (monomial,) = code
            factor = total.get(monomial, 0)
            if not factor or total.keys() - {monomial, ONE} or self._acc.begun:
                continue
            low, high = self.judged[index]
            limit = Fraction(-free) / factor
            self.judges[index] = number
            if factor > 0:
                self.judged[index] = max(low, -((-limit).__floor__())), high
            else:
                self.judged[index] = low, min(high, limit.__floor__())
            self._acc, self._group = _Accumulator(), Group()
            return
        require(False, f"{self.program.named(number)} must compare an input with a limit, not another value")

    # The end of the sample.

    def _finish_sample(self) -> None:
        """Check the result, the states and the flag once all instructions have run."""
        require(
            self._flagged or self.graph.settling is None, "the program must judge whether the sample is before settling"
        )
        self._check_result()
        for state in self.states:
            entry = self.graph.nodes[state.node].entry
            digits = self._digits(self._state(entry.operands[0], state.node, state.shift), state.digits)
            for k, digit in enumerate(digits):
                self._check_word(
                    state.address + k, digit, f"digit {k} of what {self.graph.nodes[state.node].label} takes over"
                )
        self._check_word(self.program.words - 1, constant(1), "1")
        for node, of in self._floors.items():
            (source,), (larger,) = (self.graph.nodes[n].entry.operands for n in (node, of))
            wanted = floored(self._of[larger], self._frac(node), self._forms)
            label, other = self.graph.nodes[node].label, self.graph.nodes[of].label
            require(self._of[source] == wanted, f"the program must keep {label}, which is not the floor of {other}")

    def _check_word(self, address: int, wanted: Form, what: str) -> None:
        word = self._words[address]
        if word.form == wanted:
            return
        writer = self._writers.get(address)
        who = "the program" if writer is None else self.program.named(writer)
        self._suspects = next((group for group in self._groups.values() if writer in group), [])
        require(False, f"{who} must leave {what} in word {address}, not another value")

    def _check_result(self) -> None:
        node = self.graph.output
        label = self.graph.nodes[node].label
        wanted = scaled(self._of[node], self._frac(node))
        parts = self.program.results
        bits = self._bits * (len(parts) - 1) + parts[-1]
        low, high = self.graph.nodes[node].entry.low, self.graph.nodes[node].entry.high
        require(
            -1 << (bits - 1) <= low and high < 1 << (bits - 1),
            f"the result must have room for {label}, in {low}..{high}, not {bits} bits",
        )
        for k, digit in enumerate(self._digits(wanted, len(parts))):
            require(k in self._given, f"the program must give part {k} of its result, {label}")
            form, number = self._given[k]
            require(form == digit, f"{self.program.named(number)} must give part {k} of {label}, not another value")
