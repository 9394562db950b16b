"""Folds a datapath into a program for one multiply-accumulate unit, which folded and serial hardware run.

::

    graphs of the stages       stored values           sums               columns            instructions
    +------------------+   +-----------------+   +---------------+   +-----------------+   +---------------+
    | x, y1, *, +,     |-->| ports, states,  |-->| multiples of  |-->| products digit  |-->| MULTIPLY ..   |
    | floor, ..        |   | what is cut or  |   | stored digits |   | by digit, by    |   | DROP or STORE |
    |                  |   | multiplied      |   | and a constant|   | their weight    |   | .. FINISH     |
    +------------------+   +-----------------+   +---------------+   +-----------------+   +---------------+
                                                                                   sosmith.model.dataflow.scheduling

- A value is stored if it is a port or a state, or if it is cut, delayed or multiplied as a whole. It gets just enough
  fraction bits to bring a quantizer's cut between two of its digits: ``floor(v)`` is then the upper digits of v, and
  what it drops the lower ones, at no cost.
- A sum is computed column by column, the lowest first. The last product of a column ends it: its low digit is stored
  and the rest is carried on by a shift. To drop the digit instead is the floor that the datapath asks for, so nothing
  is approximate.
- A state that holds nothing but the floor of another state is not kept again.

The program is made from the graphs alone and computes the same codes.

As an example, ``y(n) = floor(3 / 4 y(n-1) + 4 x(n))`` with digits of 4 bits. x takes one digit, y and its state y1 two:

>>> from fractions import Fraction
>>> from types import SimpleNamespace
>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> from sosmith.model.port import Port
>>> g = GraphBuilder()
>>> x = g.input("x", frac=0, low=-8, high=7)
>>> y1 = g.delay("y1", frac=0, low=-128, high=127)
>>> y = g.floor(g.add(g.shift(x, 2), g.scale(y1, 3, frac=2)), frac=0, name="y")
>>> g.connect(y1, y)
>>> section = SimpleNamespace(name="section", graph=g.build([y]))
>>> ports = [Port.from_range(name, bits, Fraction(-1), Fraction(1), signed=True) for name, bits in (("x", 4), ("y", 8))]
>>> datapath = Datapath(name="example", inputs=(ports[0],), output=ports[1], stages=(section,))
>>> folded = program(datapath, digit_bits=4)
>>> [(at.name, at.addresses) for at in folded.locations]
[('section.y1', (0, 1)), ('section.x', (2,)), ('section.y', (0, 1))]

3 / 4 is 12 / 16: the products of y1 begin one column below y, which is dropped. 4 is 64 / 16, whose digits are 0 and 4:
the product of x begins in the column of y's low digit. Nothing needs a digit of y1 any more when one of y is stored,
which takes its word and becomes the next y1:

>>> for number, (opcode, address, constant, target, *_) in enumerate(folded.instructions):
...     print(f"{number}  {opcode.mnemonic:8} {address}  {constant:2}  {target}")
0  take     3   0  2
1  drop     0  12  0
2  multiply 1  12  0
3  store    2   4  0
4  finish   3   0  1
5  multiply 3   0  0
6  multiply 3   0  0
7  give     0   1  0
8  give     1   1  1

The instructions 5 and 6 add nothing: they keep 7 far enough from 3, which stores the word that it reads.

Three samples, by the program and by the graph:

>>> words = folded.reset()
>>> [folded.step([code], words, [0]).code for code in (7, 7, -8)]
[28, 49, 4]
>>> datapath.compute_exact([[7], [7], [-8]])
[28, 49, 4]
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from functools import cached_property

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.columns import columns_of_sum
from sosmith.model.dataflow.folding.flat import Flat, flattened, share_delays
from sosmith.model.dataflow.folding.values import FoldingError, Form, Values
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.dataflow.program import (
    CARRIES,
    CLEARS,
    PRODUCTS,
    Judged,
    Location,
    Opcode,
    Program,
    Result,
    digits_of,
)
from sosmith.model.dataflow.scheduling import ONE, Column, Digit, Product, Scheduler, Sum

_SEED = 1
"""Of the orders that are tried."""


def program(
    datapath: Datapath,
    digit_bits: int,
    *,
    spare_words: int = 0,
    like: Program | None = None,
    products: int = 1,
    trials: int = 0,
) -> Program:
    """Fold a datapath.

    Parameters
    ----------
    datapath : Datapath
        What is to be computed.
    digit_bits : int
        Bits of a digit: one less than those of a factor of the multiplier.
    spare_words : int
        Words of memory beyond those that it needs.
    like : Program or None
        A program that the new one must be able to take over from at any sample, in the same hardware and with its
        states: a location gets at least as many digits as the one of the same name.
    products : int
        Products at each clock, 1 or 2.
    trials : int
        Other orders of the sums that are tried for a shorter program; the same ones in every run.

    Raises
    ------
    FoldingError
        If the datapath has an operation that cannot be folded, or the new program cannot take over from `like`.
    """
    kept = {} if like is None else {location.name: location.digits for location in like.locations}
    least = 0 if like is None else like.words
    flat = flattened(datapath)
    share_delays(flat.nodes)
    values = Values(flat, digit_bits, kept)
    ways = [values, *(values.repeating(index) for index in (values.repeatable() if products > 1 else ()))]
    foldings = [_Folding(way, datapath.calibrated, flat.settling) for way in ways]
    made = [(one, folded) for one in foldings for folded in one.programs(least, spare_words, products)]
    shorter = [one.shorter(folded, least, spare_words, trials // len(made)) for one, folded in made]
    folded = min(shorter, key=lambda one: (len(one.instructions), one.words))
    if like is None:
        return folded
    _check_can_take_over(folded, like)
    return replace(folded, accumulator_bits=like.accumulator_bits)


def columns_of(graph: Graph, digit_bits: int) -> list[Column]:
    """Return the columns that compute one stage's values, for an estimate of what it adds to a program.

    A program has an instruction for each product, and one for each column without products; besides those that take
    samples, move operands or states, and wait. An output that is the floor of a value costs nothing.

    Raises
    ------
    FoldingError
        If the stage has an operation that cannot be folded.
    """
    nodes = list(graph.nodes)
    share_delays(nodes)
    output = graph.outputs[0]
    if nodes[output].op is Op.FLOOR:
        (output,) = nodes[output].operands
    return _Folding(Values(Flat(nodes, list(graph.inputs), output), digit_bits, {}), (), None).columns()


def _check_can_take_over(new_program: Program, like: Program) -> None:
    """Check that states and ports are stored alike, and that the rest fits the hardware.

    Raises
    ------
    FoldingError
        If one of them does not.
    """
    for what, new, old in (
        ("digit_bits", new_program.digit_bits, like.digit_bits),
        ("its states", _states(new_program), _states(like)),
        ("digits and fraction bits of its inputs", _forms(new_program.inputs), _forms(like.inputs)),
        ("fraction bits and parts of its output", new_program.output[1:], like.output[1:]),
    ):
        if new != old:
            raise FoldingError(f"to take over, {what} must be {old}, not {new}")
    for what, new, old in (
        ("words of memory", new_program.words, like.words),
        ("bits of the accumulator", new_program.accumulator_bits, like.accumulator_bits),
    ):
        if new > old:
            raise FoldingError(f"to take over, {what} must be at most {old}, not {new}")


def _states(of: Program) -> list[tuple[str, tuple[int, ...], int]]:
    return [(at.name, at.addresses, at.frac) for at in of.locations if at.is_state]


def _forms(locations: Sequence[Location]) -> list[tuple[int, int]]:
    return [(location.digits, location.frac) for location in locations]


class _Folding:
    """Makes the sums that compute the values, and puts them in an order."""

    def __init__(self, values: Values, calibrated: Sequence[tuple[int, int]], settling: int | None) -> None:
        self._values = values
        self._calibrated = calibrated
        self._settling = settling
        self._order: list[int] = []

    def programs(self, least_words: int, spare_words: int, products: int) -> Iterator[Program]:
        """Make the program, if there is one; without sums that repeat others, there must be."""
        with nullcontext() if self._values.repeats < 0 else suppress(FoldingError):
            yield self.program(least_words, spare_words, products)

    def shorter(self, folded: Program, least_words: int, spare_words: int, trials: int) -> Program:
        """Return the shortest of some programs: each with one sum elsewhere in the order of the shortest one so far."""
        rng = random.Random(_SEED)
        order, ways = list(self._order), (True, False)
        for trial in range(trials if order else 0):
            kept = list(order)
            if trial:
                kept.insert(rng.randrange(len(order)), kept.pop(rng.randrange(len(order))))
            for makes_way in ways:
                other = self.program(least_words, spare_words, folded.products, kept, makes_way=makes_way)
                if (len(other.instructions), other.words) <= (len(folded.instructions), folded.words):
                    folded, order = other, list(self._order)
        return folded

    def program(
        self,
        least_words: int,
        spare_words: int,
        products: int,
        order: Sequence[int] | None = None,
        *,
        makes_way: bool = True,
    ) -> Program:
        """Make the program for a memory of at least `least_words` words, and with some that are not used.

        Sums come in the given order, as far as they can; without one, in that of the datapath.
        """
        states: dict[Digit, int] = {}
        for index in self._values.delays():
            states |= {Digit(index, k): len(states) + k for k in range(self._values.forms[index].digits)}
        copies = dict[Digit, list[Digit]]()
        for index in self._values.delays():
            for source, digit in self._values.copied(index):
                copies.setdefault(source, []).append(digit)
        computed = dict(self._sums)
        judged = [*self._judged()]
        settling = [] if self._settling is None else [self._flagged(self._settling)]
        result = self._result(computed, copies)
        scheduler = Scheduler(states, copies, [*judged, *computed.values(), *settling, result], products, makes_way)
        scheduler.take(
            Digit(index, k) for index in self._values.inputs for k in range(self._values.forms[index].digits)
        )
        for one in judged:
            scheduler.compute(one)
        scheduler.note("range")
        self._schedule(scheduler, computed, order)
        for one in settling:
            scheduler.compute(one)
        scheduler.note("settling")
        scheduler.finish(result)
        words = max(1 << (scheduler.words + spare_words).bit_length(), least_words)
        where = {digit: address % words for digit, address in scheduler.where.items()}  # that of ONE was -1
        locations = {
            index: Location(
                self._values.name(index),
                tuple(where[Digit(index, k)] for k in range(form.digits)),
                form.frac,
                self._values.nodes[index].op is Op.DELAY,
            )
            for index, form in sorted(
                self._values.forms.items(), key=lambda item: self._values.nodes[item[0]].op is not Op.DELAY
            )
            if Digit(index, 0) in where
        }
        folded = Program(
            digit_bits=self._values.bits,
            instructions=tuple(
                i._replace(address=i.address % words, second_address=i.second_address % words)
                for i in scheduler.instructions
            ),
            locations=tuple(locations.values()),
            inputs=tuple(locations[i] for i in self._values.inputs),
            output=Result(
                result.name,
                self._values.fracs[self._values.output],
                sum(column.end is Opcode.GIVE for column in result.columns),
            ),
            states=len(states),
            words=words,
            schedule=tuple(scheduler.schedule),
            accumulator_bits=self._accumulator_bits(scheduler),
            products=products,
        )
        while not folded.follows_itself:
            folded = folded.with_wait()
        return folded

    def columns(self) -> list[Column]:
        """Return the columns of all self._values."""
        return [column for one in self._sums.values() for column in one.columns]

    @cached_property
    def _sums(self) -> dict[int, Sum]:
        """Return the sums of all stored values but inputs, and states that take over a value as it is."""
        copied = {index for index in self._values.delays() if self._values.copied(index)}
        return {
            i: Sum(self._values.name(i), i, columns_of_sum(self._values, self._values.sum(i), self._values.forms[i], i))
            for i in sorted(self._values.stored)
            if i not in copied and i not in self._values.inputs
        }

    def _judged(self) -> Iterator[Sum]:
        """Compare an input with each end of its calibrated range that is not an end of its codes, by a subtraction."""
        for index, (low, high) in zip(self._values.inputs, self._calibrated, strict=True):
            node, form = self._values.nodes[index], self._values.forms[index]
            for end, sign in [(low, 1)] * (low > node.low) + [(high, -1)] * (high < node.high):
                columns = []
                for k, digit in enumerate(digits_of(end << (form.frac - node.frac), form.digits, self._values.bits)):
                    products = [Product(Digit(index, k), sign)] + [Product(ONE, -sign * digit)] * (digit != 0)
                    columns.append(Column(tuple(products), Opcode.JUDGE if k == form.digits - 1 else Opcode.DROP))
                yield Sum("range", -1, tuple(columns))

    def _flagged(self, index: int) -> Sum:
        """Return the sum that sets a flag if a value of one digit is negative."""
        (column,) = columns_of_sum(self._values, self._values.value(index), Form(1, 0), -1)
        return Sum("settling", -1, (column._replace(end=Opcode.JUDGE, part=Judged.SETTLING),))

    def _result(self, computed: dict[int, Sum], copies: Mapping[Digit, object]) -> Sum:
        """Return the sum that hands the result out, instead of one that stores it if nothing else needs it."""
        if self._values.output not in self._values.forms:
            raise FoldingError("the datapath must not give a constant to be folded")
        own = computed.get(self._values.output)
        needed = {digit.value for digit in copies}.union(
            *(one.sources for i, one in computed.items() if own is not one)
        )
        late = {i for i in computed if self._values.nodes[i].op is Op.DELAY}  # written before the result is computed
        if own is None or self._values.output in needed or own.sources & late:
            digits = range(self._values.forms[self._values.output].digits)
            products = [(Product(Digit(self._values.output, k), 1),) for k in digits]
            columns = [Column(product, Opcode.GIVE, part=k) for k, product in enumerate(products)]
        else:
            del computed[self._values.output]
            form = self._values.forms[self._values.output]._replace(digits=0)
            columns = [*columns_of_sum(self._values, self._values.sum(self._values.output), form, -1)]
        return Sum(self._values.name(self._values.output), -1, tuple(columns))

    def _schedule(self, scheduler: Scheduler, computed: Mapping[int, Sum], order: Sequence[int] | None) -> None:
        """Compute values in the order of the datapath; while the next one would have to wait, another one if it can.

        Or each as soon as it can be computed, the first of an order before the others.

        Raises
        ------
        FoldingError
            If there is no order in which each state is read before it is written.
        """
        left = dict(computed)
        places = {} if order is None else {index: place for place, index in enumerate(order)}
        self._order = []
        while left:
            needed = {i for i in left if self._values.nodes[i].op is not Op.DELAY}
            free = [
                i
                for i, one in left.items()
                if not one.sources & (needed - {i}) and (i in needed or scheduler.is_unused(one))
            ]
            if not free:
                raise FoldingError(f"{next(iter(left.values())).name!r} must not be needed after it is written")
            if order is not None:
                free.sort(key=places.__getitem__)
            elif scheduler.stalls(left[free[0]]):
                free.sort(key=lambda i: scheduler.stalls(left[i]))
            self._order.append(free[0])
            one = left.pop(free[0])
            scheduler.compute(one)
            scheduler.note(one.name)

    def _accumulator_bits(self, scheduler: Scheduler) -> int:
        """Return the width, by interval arithmetic with any values of the digits; at least that of a word."""
        low = high = least = most = 0
        operand = (0, 0)
        for instruction, digits in zip(scheduler.instructions, scheduler.reads, strict=True):
            opcode, constant, second = instruction.opcode, instruction.constant, instruction.second_constant
            word, beside = map(self._values.range_of, digits)
            factors = operand if opcode in PRODUCTS else (constant, constant)
            ends = [a * b for a in word for b in factors]
            more = [a * second for a in beside]
            low, high = low + min(ends) + min(more), high + max(ends) + max(more)
            if opcode is Opcode.OPERAND:
                operand = word
            if opcode is not Opcode.TAKE:
                least, most = min(least, low), max(most, high)
            if opcode in CARRIES:
                low, high = low >> self._values.bits, high >> self._values.bits
            elif opcode in CLEARS:
                low = high = 0
        return max((-least - 1).bit_length(), most.bit_length(), self._values.bits) + 1
