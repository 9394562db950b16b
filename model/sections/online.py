"""Sections in on-line arithmetic: signed digits, the most significant first, from a residual in carry-save form.

A section in direct form I, ``y(n) = floor(v(n))``, is one recurrence. With e(n) = v(n) - y(n) and the centred error
r = e - 1/2, what has to be rounded to the nearest is::

    v(n) - 1/2 = b0 x(n) + b1 x(n-1) + b2 x(n-2) + g1 y(n-1) + g2 y(n-2) + f1 r(n-1) + f2 r(n-2)

in LSBs of y, g = -a and f = -k of `sosmith.model.sections.direct_form`. Its digits d in {-1, 0, 1} come one a step;
digit j has the weight ``2**(M - j)``::

    v = 2 w + increment        the five digits that arrive at step j, times their coefficients, times 2**-delay
    d = select(v)              from an estimate of v: both words of the carry-save pair cut to quarters
    w = v - d

The digits that arrive are `delay` places less significant than the one that leaves. With ``-3/4 <= w < 3/4`` and an
increment of at most 1/4, w stays there: as the estimate u has u <= v < u + 1/2 ::

    u >= 1/2            ->  d =  1,   1/2 <= v < 7/4,     w in [-1/2, 3/4)
    -1/2 <= u <= 1/4    ->  d =  0,  -1/2 <= v < 3/4,     w in [-1/2, 3/4)
    u <= -3/4           ->  d = -1,  -7/4 <= v < -1/4,    w in [-3/4, 3/4)

The last digit is the exact v, both words added, rounded to the nearest. What is rounded off is r(n), and the result
is the graph's, bit for bit. The bound on its error is therefore that of the graph.

>>> from sosmith.model.sections.direct_form import DirectForm1, Product
>>> from sosmith.model.dataflow.graph import Range
>>> direct = DirectForm1(
...     name="section0",
...     products=(Product("A1", 3, 3, (1, 1, 0), (-2, 0), 1),),
...     integer_part=(-1, 0),
...     feedback=(-1, 0),
...     x=Range(0, -128, 127),
...     y_frac=2,
...     v_range=(-16384, 16383),
... )
>>> section = online_section("section0", direct.graph)
>>> section.numerator, section.recursion, section.feedback
((Fraction(3, 16), Fraction(3, 16)), (Fraction(5, 8),), (1,))
>>> section.delay, section.digits
(3, 12)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage
from sosmith.model.sections.start import StartStage

MOST_INCREMENT = Fraction(1, 4)
"""What the digits that arrive at a step may add at most, in units of the digit that leaves."""

TOP_BITS = 4
"""Bits of the residual that the estimate looks at: two before and two behind the binary point, modulo 4."""

QUIET_STEPS = 2
"""Last steps of a result, at which nothing is added to the residual."""

LOOP_CLOCKS = 3
"""Clocks from a digit that leaves to the next section's or sample's step that takes it, beyond the delay."""

FORWARD_CLOCKS = 5
"""The same to the section behind, whose numerator takes two clocks more."""


_BESIDE = (HornerStep, StartStage, OutputStage)
"""Stages before and behind the sections."""


class OnlineError(ValueError):
    """A stage is no section that on-line arithmetic computes."""


@dataclass(frozen=True, kw_only=True)
class OnlineSection:
    """What the recurrence of a section needs; all of it is read off the section's graph.

    Attributes
    ----------
    name : str
        Name of the section.
    numerator : tuple of Fraction
        Factors of x(n), x(n-1) and so on; one to three.
    recursion : tuple of Fraction
        Factors of y(n-1) and y(n-2); one or two.
    feedback : tuple of int
        Factors of r(n-1) and r(n-2); empty without error feedback.
    x_frac, y_frac : int
        Fraction bits of the input and the output.
    largest : Fraction
        Largest magnitude of what is rounded, in units of 1.
    """

    name: str
    numerator: tuple[Fraction, ...]
    recursion: tuple[Fraction, ...]
    feedback: tuple[int, ...]
    x_frac: int
    y_frac: int
    largest: Fraction

    @property
    def gain(self) -> Fraction:
        """Sum of the magnitudes of all coefficients: the largest increment before it is scaled by the delay."""
        return sum(map(abs, (*self.numerator, *self.recursion)), Fraction(0))

    @property
    def finer(self) -> int:
        """Digits that the input has beyond the last one of the output."""
        return max(0, self.x_frac - self.y_frac)

    @cached_property
    def delay(self) -> int:
        """The on-line delay in digits: the smallest with which no increment is larger than 1/4.

        The rounding errors that are fed back enter once all other digits have arrived; at the last two steps nothing
        does, so that there is time to add the words of the residual.
        """
        delay = QUIET_STEPS + bool(self.feedback) + self.finer
        while self.gain > MOST_INCREMENT * 2**delay or self.largest_feedback(delay) > MOST_INCREMENT:
            delay += 1
        return delay

    def largest_feedback(self, delay: int) -> Fraction:
        """Largest increment that fed back errors make, at the step that takes them."""
        return Fraction(sum(map(abs, self.feedback)), 2) * Fraction(2) ** (1 + self.finer - delay)

    @cached_property
    def leading(self) -> int:
        """M, the exponent of the first digit: what is rounded has at most the magnitude ``2**M``."""
        exponent = self.delay - self.y_frac
        while Fraction(2) ** exponent < self.largest:
            exponent += 1
        return exponent

    @property
    def digits(self) -> int:
        """Number of digits of a result."""
        return self.leading + self.y_frac + 1

    def first_step(self, exponent: int) -> int:
        """Step that takes the first digit of an operand, whose weight is 2**exponent."""
        return self.leading - exponent - self.delay

    @property
    def feedback_step(self) -> int:
        """Step that takes the errors that are fed back: the first without any other digit."""
        return self.digits - self.delay + self.finer

    @cached_property
    def residual_frac(self) -> int:
        """Fraction bits of the residual: with these, every increment is exact."""
        bits = [f.denominator.bit_length() - 1 + self.delay for f in (*self.numerator, *self.recursion)]
        fed_back = self.error_frac + self.delay - 1 - self.finer
        return max(*bits, fed_back if self.feedback else 0, self.error_frac + QUIET_STEPS, TOP_BITS)

    @cached_property
    def error_frac(self) -> int:
        """Fraction bits of the centred error r in LSBs of the output; at least 1."""
        numerator = max(f.denominator.bit_length() - 1 for f in self.numerator) + self.x_frac - self.y_frac
        return max(1, numerator, *(f.denominator.bit_length() - 1 for f in self.recursion))

    @property
    def residual_bits(self) -> int:
        """Width of each word of the residual."""
        return 2 + self.residual_frac

    def select(self, top: int) -> int:
        """Digit for an estimate `top` in quarters, modulo 16."""
        return 1 if 2 <= top <= 6 else (-1 if 7 <= top <= 13 else 0)

    def step(self, word: int, carries: int, increment: int, *, selects: bool = True) -> tuple[int, int, int]:
        """Make one step of the recurrence on codes of `residual_bits` bits; return both words and the digit."""
        bits = self.residual_bits
        mask, low = (1 << bits) - 1, bits - TOP_BITS
        a, b = 2 * word & mask, 2 * carries & mask
        total, carry = a ^ b ^ increment, 2 * (a & b | a & increment | b & increment) & mask
        top = (total >> low) + (carry >> low) & 15
        digit = self.select(top) if selects else 0
        rest = (1 << low) - 1
        return total & rest | ((top - 4 * digit) & 15) << low, carry & rest, digit

    def value(self, word: int, carries: int) -> Fraction:
        """Value of a residual, modulo 4, in [-2, 2)."""
        bits = self.residual_bits
        return _signed(word + carries & (1 << bits) - 1, bits) * Fraction(2) ** -self.residual_frac

    def run(
        self,
        numerator: Sequence[Mapping[int, int]],
        recursion: Sequence[Mapping[int, int]],
        errors: Sequence[Fraction],
    ) -> tuple[dict[int, int], Fraction]:
        """Compute one result digit by digit, with the carry-save pair of the hardware.

        Parameters
        ----------
        numerator, recursion : sequence of mapping
            Digits of x(n), x(n-1), .. and of y(n-1), y(n-2), by the exponents of their weights.
        errors : sequence of Fraction
            r(n-1) and r(n-2).

        Returns
        -------
        digits : dict of int to int
            Digits of y(n), by the exponents of their weights.
        error : Fraction
            r(n), in LSBs of y.

        Raises
        ------
        ArithmeticError
            If the residual leaves its range: the delay is too short.
        """
        terms = [*zip(self.numerator, numerator, strict=True), *zip(self.recursion, recursion, strict=True)]
        first = min(0, *(self.first_step(max(digits)) for _, digits in terms if digits))
        unit, mask = Fraction(2) ** -self.residual_frac, (1 << self.residual_bits) - 1
        word, carries, result = 0, 0, {}
        for step in range(first, self.digits - 1):
            exponent = self.leading - step - self.delay
            increment = sum((f * digits.get(exponent, 0) for f, digits in terms), Fraction(0)) / 2**self.delay
            if self.feedback and step == self.feedback_step:
                shift = Fraction(2) ** (step - self.digits + 1)
                increment += sum((f * r for f, r in zip(self.feedback, errors, strict=True)), Fraction(0)) * shift
            if abs(increment) > MOST_INCREMENT:
                raise ArithmeticError(f"an increment must be at most {MOST_INCREMENT}, not {increment}")
            code = int(increment / unit) & mask
            if (increment / unit).denominator != 1:
                raise ArithmeticError(f"an increment must be a multiple of {unit}, not {increment}")
            word, carries, digit = self.step(word, carries, code, selects=step >= 0)
            value = self.value(word, carries)
            if not -Fraction(3, 4) <= value < Fraction(3, 4):
                raise ArithmeticError(f"the residual must be in [-3/4, 3/4), not {value}")
            if step >= 0:
                result[self.leading - step] = digit
        last = 2 * self.value(word, carries)
        digit = (last + Fraction(1, 2)).__floor__()
        result[-self.y_frac] = digit
        return result, last - digit


def _signed(code: int, bits: int) -> int:
    return code - (code >> (bits - 1) << bits)


def online_section(name: str, graph: Graph) -> OnlineSection:
    """Read a section off its graph.

    Parameters
    ----------
    name : str
        Name of the section.
    graph : Graph
        Its graph, whose first input and first output are those of the section; others must only pass through.

    Raises
    ------
    OnlineError
        If it is no section of first or second order with one quantizer, at its output.
    """
    return _named(name, *_recurrence(graph))


def _named(name: str, numerator: _Row, recursion: _Row, feedback: tuple[int, ...], rest: _Rest) -> OnlineSection:
    x_frac, y_frac, largest = rest
    return OnlineSection(
        name=name,
        numerator=numerator,
        recursion=recursion,
        feedback=feedback,
        x_frac=x_frac,
        y_frac=y_frac,
        largest=largest,
    )


_Row = tuple[Fraction, ...]
_Rest = tuple[int, int, Fraction]
_Key = tuple[str, int]
_Form = dict[_Key, Fraction]
_ONE: _Key = "one", 0


@lru_cache(maxsize=256)
def _recurrence(graph: Graph) -> tuple[_Row, _Row, tuple[int, ...], _Rest]:
    """Follow the graph of a section as linear forms of its taps."""
    if graph.inputs[1:] != graph.outputs[1:]:
        raise OnlineError("only the first input may enter the computation")
    x, y = graph.inputs[0], graph.nodes[graph.outputs[0]]
    # Without a FLOOR, the total has no further fraction bits.
    inner = y.operands[0] if y.op is Op.FLOOR else graph.outputs[0]
    v = graph.nodes[inner]
    taps = _taps(graph, x, inner)
    forms: list[_Form | None] = []
    for index, node in enumerate(graph.nodes):
        forms.append({("x", 0): Fraction(1)} if index == x else _form(graph, node, forms, taps.get(index), y.frac))
    total = forms[inner]
    if v.op is not Op.BOUND or total is None:
        raise OnlineError("its output must be the floor of a sum of taps, without a quantizer before")
    rows = {kind: _row(total, kind) for kind in "xye"}
    if not rows["y"]:
        raise OnlineError("a section must be recursive")
    unit = Fraction(2) ** -y.frac
    centre = total.get(_ONE, Fraction(0)) / unit
    wanted = (1 - sum(rows["e"], Fraction(0))) / 2
    if centre != (wanted if v.frac > y.frac else 0) or (v.frac <= y.frac and any(rows["e"])):
        raise OnlineError("its quantizer must round to the nearest on average")
    if any(f.denominator != 1 for f in rows["e"]):
        raise OnlineError("its error feedback must be whole")
    feedback = tuple(map(int, rows["e"]))
    half = unit / 2 if v.frac > y.frac else Fraction(0)
    largest = max(abs(end * Fraction(2) ** -v.frac - half) for end in (v.low, v.high))
    return rows["x"] or (Fraction(0),), rows["y"], feedback, (graph.nodes[x].frac, y.frac, largest)


def _taps(graph: Graph, x: int, v: int) -> dict[int, _Key]:
    """DELAY nodes that hold the input or v of an earlier sample, with how many samples ago."""
    taps: dict[int, _Key] = {}
    for index in graph.delays:
        source, ago = graph.nodes[index].operands[0], 1
        while graph.nodes[source].op is Op.DELAY:
            source, ago = graph.nodes[source].operands[0], ago + 1
        if source in {x, v}:
            taps[index] = ("x" if source == x else "v", ago)
    return taps


def _form(graph: Graph, node: Node, forms: list[_Form | None], tap: _Key | None, y_frac: int) -> _Form | None:
    """Linear form of a node; None for one that does not have one, which the output must not depend on."""
    if tap is not None:
        kind, ago = tap
        one = Fraction(1)
        return {("x", ago): one} if kind == "x" else {("y", ago): one, ("e", ago): one}
    if node.op is Op.CONSTANT:
        return {_ONE: node.parameter * Fraction(2) ** -node.frac}
    operands = [forms[i] if i < len(forms) else None for i in node.operands]
    known = [form for form in operands if form is not None]
    if len(known) < len(operands) or not known:
        return None
    first = known[0]
    if node.op in {Op.ADD, Op.SUBTRACT}:
        sign = 1 if node.op is Op.ADD else -1
        return {key: first.get(key, Fraction(0)) + sign * known[1].get(key, 0) for key in first | known[1]}
    if node.op is Op.SHIFT:
        return {key: value * Fraction(2) ** node.parameter for key, value in first.items()}
    if node.op is Op.SCALE:
        return {key: value * node.parameter * Fraction(2) ** -node.parameter_frac for key, value in first.items()}
    if node.op is Op.BOUND:
        return first
    past = graph.nodes[node.operands[0]].op is Op.DELAY and {kind for kind, _ in first} == {"y", "e"}
    if past and node.op is Op.FLOOR and node.frac == y_frac:
        return {key: value for key, value in first.items() if key[0] == "y"}
    if past and node.op is Op.FRACTION and node.parameter == y_frac:
        return {key: value for key, value in first.items() if key[0] == "e"}
    return None


def _row(form: _Form, kind: str) -> _Row:
    """Coefficients of the taps of a kind, from the newest one on, without zeros at the end."""
    reach = max((ago for (k, ago), value in form.items() if k == kind and value), default=-1)
    return tuple(form.get((kind, ago), Fraction(0)) for ago in range(0 if kind == "x" else 1, reach + 1))


@dataclass(frozen=True)
class OnlineSchedule:
    """When the units of a cascade work; clocks are counted from the one that accepts a sample.

    A section has as many units as samples overlap in it. They take turns: each starts a sample every `period` clocks,
    `interval` clocks after the one before it, whether there is a sample or not.

    Attributes
    ----------
    sections : tuple of OnlineSection
        The sections in their order; at least one.
    input_bits : int
        Bits of the input, a sign bit included.
    lead_in : int
        Clocks before the input's digits leave its register.
    """

    sections: tuple[OnlineSection, ...]
    input_bits: int
    lead_in: int

    @cached_property
    def interval(self) -> int:
        """Clocks between samples: what the longest loop takes from a digit to the same one of the next sample."""
        return max(section.delay for section in self.sections) + LOOP_CLOCKS

    @property
    def exponents(self) -> tuple[int, ...]:
        """Exponents of the first digit that each section takes, and of the result's."""
        first = self.input_bits - 1 - self.sections[0].x_frac
        return (first, *(section.leading for section in self.sections))

    @cached_property
    def units(self) -> int:
        """Units of each section: none starts a sample before it has done with its last, and that has left."""
        steps = [
            section.digits - section.first_step(max(exponent, section.leading))
            for section, exponent in zip(self.sections, self.exponents, strict=False)
        ]
        return max(2, -(-max(*steps, self.sections[-1].digits + 3) // self.interval))

    @property
    def period(self) -> int:
        """Clocks from one sample of a unit to its next."""
        return self.units * self.interval

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """Clock in which each section computes its first digit, for unit 0; before them, that of the input."""
        starts = [self.lead_in]
        for section, before, leading in zip(self.sections, self.exponents, self.exponents[1:], strict=False):
            starts.append(starts[-1] + FORWARD_CLOCKS + section.delay + before - leading)
        return tuple(starts)

    def check(self) -> None:
        """Check that each section starts while the one before it still has the sample.

        Raises
        ------
        OnlineError
            If the signals of two sections differ too much in size.
        """
        for section, before, start in zip(self.sections, self.starts, self.starts[1:], strict=False):
            if not 2 < start - before <= self.period:
                raise OnlineError(
                    f"the signals before and behind {section.name} must differ less in size: it would start "
                    f"{start - before} clocks after the one before it, where 3 to {self.period} can be"
                )

    @property
    def done(self) -> int:
        """Clock in which the result is there."""
        return self.starts[-1] + self.sections[-1].digits + 2


def sections_of(datapath: Datapath) -> range:
    """Numbers of the stages of a datapath that are filter sections.

    Raises
    ------
    OnlineError
        If there is none.
    """
    numbers = [k for k, stage in enumerate(datapath.stages) if not isinstance(stage, _BESIDE)]
    if not numbers:
        raise OnlineError("there must be filter sections, and there are none")
    return range(numbers[0], numbers[-1] + 1)


def online_schedule(datapath: Datapath, lead_in: int) -> OnlineSchedule:
    """Schedule the sections of a datapath, before which a sample takes `lead_in` clocks.

    Raises
    ------
    OnlineError
        If a section is not one for on-line arithmetic.
    """
    stages = [datapath.stages[k] for k in sections_of(datapath)]
    sections = []
    for stage in stages:
        try:
            sections.append(online_section(stage.name, stage.graph))
        except OnlineError as error:
            raise OnlineError(f"{stage.name} is not a section in direct form I: {error}") from None
    node = stages[0].graph.nodes[stages[0].graph.inputs[0]]
    schedule = OnlineSchedule(tuple(sections), node.width + (not node.signed), lead_in)
    schedule.check()
    return schedule
