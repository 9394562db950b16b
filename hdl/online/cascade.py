"""A cascade of sections in on-line arithmetic: words in, words out, signed digits in between.

With three units a section, the units of a column work on the same sample; each has its digits from the unit on its
left, and what the samples before were from the unit above it, round about::

             input_register       section0                       section1                    number
    word --> unit0: x, x1, x2 --> unit0: residual --- digit ---> unit0: residual -- digit --> unit0 --+
                                    |  y1, y2                      |  y1, y2                          |
             unit1: x, x1, x2 --> unit1: residual -------------> unit1: residual -----------> unit1 --+--> word
                                    |                              |                                  |
             unit2: x, x1, x2 --> unit2: residual -------------> unit2: residual -----------> unit2 --+
                                    |                              |
                                    +--> unit0                     +--> unit0

A unit, with the clocks of the pipeline from left to right; the path through the word `increment` and the digit is the
loop that limits the interval::

    x, x1 --> table --+
    x2, y2 -> table --+--> + --> [early] --> + --> [increment] --> 3:2 --> select --+--> [digit] --+--> [o] --> y1 of
    r1, r2 -----------+                      ^                      ^               |              |      the next unit
    y1 --------------------------------------+                      +-- [word] <----+       last --+
                                                                        [carries]
                                                                           |
    the unit's last steps:  [final_word] + [final_carries] --> [rounded] of the section --> last digit; the rest is r1

A sample enters at every `interval` clocks, in a slot that is always the same one of the period. A slot without a sample
passes on the digits of the samples before it, and changes no rounding error that is fed back.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from operator import or_

from amaranth.hdl import Cat, Const, Module, Mux, Shape, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.online.digits import digit, line, multiples, on_the_fly, shifted_out, with_multiple
from sosmith.hdl.online.residual import Residual
from sosmith.model.sections.online import OnlineSchedule, OnlineSection


@dataclass(frozen=True)
class _Unit:
    """What the units of a section show to others: digits of this sample and of those before, in the same clock."""

    digits: tuple[Value, ...]
    tag: Value


@dataclass(frozen=True)
class _Past:
    """Signals of a unit that the next one reads: its result's digits, and those of the sample before."""

    newest: Signal
    older: Signal


class OnlineCascade(wiring.Component):
    """Sections on signed digits; see the schedule for its clocks.

    Latency: `schedule.done` clocks from the one with `tick` in which a sample is accepted to the one with its result,
    if it arrives at `i` after the `lead_in` of the schedule. Throughput: one sample in `schedule.interval` clocks.

    Parameters
    ----------
    schedule : OnlineSchedule
        The sections and their clocks.
    input_shape, output_shape : Shape
        Of the words.
    tag_bits : int
        Bits that accompany each sample.

    Members
    -------
    tick : Out(1)
        Whether a sample may be accepted at this clock.
    i, i_valid, i_tag
        Word, whether it is a sample's, and its tag, `lead_in` clocks later.
    o, o_valid, o_tag
        The result.
    """

    def __init__(self, schedule: OnlineSchedule, input_shape: Shape, output_shape: Shape, tag_bits: int) -> None:
        self.schedule = schedule
        self.tag_bits = tag_bits
        super().__init__(
            {
                "tick": Out(1),
                "i": In(input_shape),
                "i_valid": In(1),
                "i_tag": In(tag_bits),
                "o": Out(output_shape),
                "o_valid": Out(1),
                "o_tag": Out(tag_bits),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        schedule = self.schedule
        self._phase = Signal(range(schedule.period))
        m.d.sync += self._phase.eq(Mux(self._phase == schedule.period - 1, 0, self._phase + 1))
        tick = Signal(init=1)
        m.d.sync += tick.eq(reduce(or_, (self._now(-1, unit) for unit in range(schedule.units))))
        m.d.comb += self.tick.eq(tick)
        column = self._input(m)
        for number, section in enumerate(schedule.sections):
            following = schedule.sections[number + 1 : number + 2]
            taps = max(1, len(following[0].numerator)) if following else 1
            column = self._section(m, number, section, column, taps)
        self._output(m, column)
        return m

    def _now(self, clock: int, unit: int) -> Value:
        """Whether this is the clock `clock` of the samples of a unit."""
        phase = (clock + unit * self.schedule.interval) % self.schedule.period
        return self._phase == phase if phase else ~self._phase.any()

    def _then(self, m: Module, clock: int, unit: int, name: str, init: bool = False) -> Signal:
        """Return a register that is high in the clock `clock` of the samples of a unit, and at a reset if `init`."""
        flag = Signal(name=name, init=init)
        m.d.sync += flag.eq(self._now(clock - 1, unit))
        return flag

    def _tag(self, m: Module, clock: int, unit: int, source: Value, name: str) -> Signal:
        """Return the tag of a unit's sample, from the clock `clock` on."""
        tag = Signal(1 + self.tag_bits, name=name)
        with m.If(self._now(clock - 1, unit)):
            m.d.sync += tag.eq(source)
        return tag

    def _input(self, m: Module) -> list[_Unit]:
        """Turn the words of this sample and those before into digits, with a register for each unit."""
        taps = len(self.schedule.sections[0].numerator)
        signed = self.i if self.i.shape().signed else Cat(self.i, Const(0, 1))
        words: list[Value] = [signed]
        column = []
        for k in range(1, taps):
            before = Signal(len(signed), name=f"input{k}")
            words.append(before)
        lead_in = self.schedule.lead_in
        loads = [
            self._then(m, lead_in, q, f"input_load_unit{q}", lead_in == 0 == q) for q in range(self.schedule.units)
        ]
        with m.If(reduce(or_, loads) & self.i_valid):
            m.d.sync += [later.eq(word) for word, later in pairwise(words)]
        for unit, load in enumerate(loads):
            digits = [shifted_out(m, load, word, f"input{k}_unit{unit}") for k, word in enumerate(words)]
            tag = Signal(1 + self.tag_bits, name=f"input_tag_unit{unit}")
            with m.If(load):
                m.d.sync += tag.eq(Cat(self.i_valid, self.i_tag))
            column.append(_Unit(tuple(digits), tag))
        return column

    def _section(self, m: Module, number: int, section: OnlineSection, column: list[_Unit], taps: int) -> list[_Unit]:
        """Build the units of a section; `taps` is how many samples the next section looks at."""
        units, start = self.schedule.units, self.schedule.starts[number + 1]
        name = f"section{number}"
        older = len(section.recursion) > 1 or taps > 2
        past = [_Past(digit(f"{name}_unit{q}_digit"), digit(f"{name}_unit{q}_older")) for q in range(units)]
        pairs = [Residual.of(section, f"{name}_unit{q}") for q in range(units)]
        final = [self._then(m, start + section.digits - 2, q, f"{name}_unit{q}_final") for q in range(units)]
        tags = [self._tag(m, start - 1, q, column[q].tag, f"{name}_tag_unit{q}") for q in range(units)]
        ends = [self._then(m, start + section.digits - 3, q, f"{name}_unit{q}_ends") for q in range(units)]
        rounded = _Rounded(m, section, pairs, ends, final, [tag[0] for tag in tags], name)
        built = []
        for q in range(units):
            own = f"{name}_unit{q}"
            before = past[q - 1]
            reach = self.schedule.interval - 1
            y1 = line(m, before.newest, reach, f"{own}_y1")
            y2 = line(m, before.older, reach + 2, f"{own}_y2") if older else []
            waits = self.schedule.interval - section.delay - 3
            fed = self._then(m, start + section.feedback_step - 3, q, f"{own}_fed") if section.feedback else None
            terms = [
                term
                for term in [
                    *zip(section.numerator, column[q].digits, strict=False),
                    *zip(section.recursion[1:], y2[waits : waits + 1], strict=False),
                ]
                if term[0]
            ]
            early = _early(m, section, terms, rounded, fed, own)
            increment = Signal(section.residual_bits, name=f"{own}_increment")
            frac = section.residual_frac - section.delay
            m.d.sync += increment.eq(with_multiple(early, y1[waits], section.recursion[0], frac))
            selects = self._window(m, start - 1, start + section.digits - 2, q, f"{own}_selects")
            chosen = pairs[q].step(m, increment, selects, final[q])
            last = Signal(name=f"{own}_last")
            m.d.sync += last.eq(final[q])
            valid = tags[q][0]
            m.d.sync += past[q].newest.eq(Mux(valid, chosen | Mux(last, rounded.digit, 0), y1[reach]))
            if older:
                m.d.comb += past[q].older.eq(Mux(valid, y1[reach - 1], y2[reach + 1]))
            shown: list[Value] = [past[q].newest]
            for k, source in enumerate([y1[reach], *y2[reach + 2 :]][: taps - 1], start=1):
                register = digit(f"{own}_past{k}")
                m.d.sync += register.eq(source)
                shown.append(register)
            built.append(_Unit(tuple(shown), tags[q]))
        return built

    def _window(self, m: Module, first: int, last: int, unit: int, name: str) -> Signal:
        """Return a register that is high from the clock `first` of a unit's sample to the one before `last`."""
        flag = Signal(name=name)
        with m.If(self._now(first - 1, unit)):
            m.d.sync += flag.eq(1)
        with m.If(self._now(last - 1, unit)):
            m.d.sync += flag.eq(0)
        return flag

    def _output(self, m: Module, column: list[_Unit]) -> None:
        """Turn the digits of the last section into words, and hand out that of the unit which is done."""
        start, section = self.schedule.starts[-1], self.schedule.sections[-1]
        words, tags = [], []
        for q, unit in enumerate(column):
            clear = self._then(m, start, q, f"number_unit{q}_clear")
            number = on_the_fly(m, unit.digits[0], clear, len(self.o), f"number_unit{q}")
            done = self._then(m, start + section.digits + 1, q, f"number_unit{q}_done")
            words.append(Mux(done, number, 0))
            tags.append(Mux(done, unit.tag, 0))
        m.d.sync += [self.o.eq(reduce(or_, words)), Cat(self.o_valid, self.o_tag).eq(reduce(or_, tags))]


class _Rounded:
    """The last digit of the units of a section, and the error that is fed back, from the exact residual.

    Nothing is added to the residual at the last two steps. With the exact w two steps before the end, and the digit d
    before the last one, the last digit is ``floor(4 w + 1/2) - 2 d``, and what is left of 4 w is the centred error.
    """

    def __init__(
        self,
        m: Module,
        section: OnlineSection,
        pairs: list[Residual],
        ends: list[Signal],
        final: list[Signal],
        valid: list[Value],
        name: str,
    ) -> None:
        error = section.error_frac
        unused = section.residual_frac - error - 2  # bits that are 0 once all digits have come
        word = Signal(error + 2, name=f"{name}_final_word", reset_less=True)
        carries = Signal(error + 2, name=f"{name}_final_carries", reset_less=True)
        for register, sources in ((word, [pair.word for pair in pairs]), (carries, [pair.carries for pair in pairs])):
            chosen = reduce(or_, (Mux(now, source, 0) for now, source in zip(ends, sources, strict=True)))
            m.d.sync += register.eq(chosen[unused:])
        # At a reset, nothing has been rounded off: the centred error is -1/2.
        exact = Signal(error + 2, name=f"{name}_rounded", init=1 << (error - 1))
        odd = Signal(name=f"{name}_digit_before")
        update = reduce(or_, (now & there for now, there in zip(final, valid, strict=True)))
        with m.If(update):
            m.d.sync += exact.eq(word + carries)
        m.d.sync += odd.eq(reduce(or_, (now & pair.digit.any() for now, pair in zip(final, pairs, strict=True))))
        half, quarter, eighth = exact[-1], exact[-2], exact[-3]
        # 2 half + quarter + eighth - 2 d is -1, 0 or 1, modulo 4; without a carry from the last two unless it is 0.
        nonzero, minus = quarter ^ eighth, half ^ odd
        self.digit = Cat(nonzero & ~minus, nonzero & minus)
        self.newest = exact[:error].as_signed()
        self.older: Value = Const(0, 1)
        if len(section.feedback) > 1:
            factor = section.feedback[1]
            older = Signal(Shape(error + 2, signed=True), name=f"{name}_older_error", init=-factor << (error - 1))
            with m.If(update):
                m.d.sync += older.eq(self.newest * factor)
            self.older = older


def _early(
    m: Module,
    section: OnlineSection,
    terms: list[tuple[Fraction, Value]],
    rounded: _Rounded,
    fed: Signal | None,
    name: str,
) -> Signal:
    """Return the sum of all digits that are known a clock earlier, and of the errors that are fed back."""
    bits, frac = section.residual_bits, section.residual_frac - section.delay
    words: list[Value] = []
    for k in range(0, max(len(terms), 1), 2):
        factors, digits = [t[0] for t in terms[k : k + 2]], [t[1] for t in terms[k : k + 2]]
        if digits:
            register = Signal(bits, name=f"{name}_multiples{k // 2}")
            m.d.sync += register.eq(multiples(digits, factors, bits, frac))
            words.append(register)
    words += [Const(0, bits)] * (2 - len(words))
    carry: Value = Const(0, 1)
    if fed is not None:
        shift = section.residual_frac - section.error_frac + 1 - section.delay + section.finer
        factor = section.feedback[0]
        newest = (rounded.newest * abs(factor)).shift_left(shift)
        pieces = [_extended(newest, bits), _extended(rounded.older.as_signed().shift_left(shift), bits)]
        if factor < 0:
            pieces[0], carry = ~pieces[0], fed
        if len(section.feedback) < 2:
            pieces = pieces[:1]
        words = [word | Mux(fed, piece, 0) for word, piece in zip(words, pieces, strict=False)] + words[len(pieces) :]
    early = Signal(bits, name=f"{name}_early")
    m.d.sync += early.eq((Cat(Const(1, 1), words[0]) + Cat(carry, words[1]))[1 : bits + 1])
    return early


def _extended(value: Value, bits: int) -> Value:
    """Return a signed value in exactly `bits` bits."""
    return Cat(value, *([value[-1]] * bits))[:bits]
