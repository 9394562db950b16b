"""Orders the sums of a program, instruction by instruction, and gives every digit a word of memory.

::

    sums: columns of products       instructions                       words
    v = 2 v1 - v2 + ..       -->    multiply   v2 * -1                 v1 0..3, v2 4..7: states
                                    move       v1 *  2, to v2          others: the lowest one that is free
                                    multiply   ..
                                    store      .. , to v1

- A column's products may come in any order, so that none waits for a word that is still in the pipeline. If all of
  them would have to, a sum that does not depend on this one comes before it.
- A state takes over a digit of another value without an instruction of its own: the digit is stored there at once if
  nothing needs the old one any more; otherwise, an instruction that multiplies the digit also moves it, once nothing
  needs the old one. Only where neither can be, there is a MOVE for nothing else.
- Other digits share words when they are not needed at the same time.
- Where there are two products a clock, one of a column is computed beside another one, unless its word is still in the
  pipeline. Only the first of the two can be moved, or be a product of two words.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from sosmith.model.dataflow.program import LATE_WRITES, Instruction, Opcode, distance_moved, distance_stored


class Digit(NamedTuple):
    """Digit number `number` of the value `value`."""

    value: int
    number: int


ONE = Digit(-1, 0)
"""The word that always holds 1."""


class Product(NamedTuple):
    """A digit times a constant, or times `other` if that is given."""

    digit: Digit
    constant: int = 0
    other: Digit | None = None

    @property
    def digits(self) -> tuple[Digit, ...]:
        """The digits that it reads."""
        return (self.digit,) if self.other is None else (self.digit, self.other)


class Column(NamedTuple):
    """Products to be added up, and what ends them: STORE or FINISH to `digit`, DROP, JUDGE, or GIVE of `part`."""

    products: tuple[Product, ...]
    end: Opcode
    digit: Digit = ONE
    part: int = 0


class Sum(NamedTuple):
    """The columns of a value, the lowest first; `value` is -1 for one that is not stored."""

    name: str
    value: int
    columns: tuple[Column, ...]

    @property
    def sources(self) -> set[int]:
        """The values whose digits it reads."""
        return {digit.value for column in self.columns for product in column.products for digit in product.digits}


@dataclass
class _State:
    """How far the program has come: what a trial of a sum must not change."""

    instructions: list[Instruction]
    reads: list[tuple[Digit, Digit]]
    where: dict[Digit, int]
    readable: dict[int, int]
    uses: Counter[Digit]
    pending: dict[Digit, list[Digit]]
    taken: set[int]
    operand: Digit | None = None

    def copy(self) -> _State:
        return _State(
            [*self.instructions],
            [*self.reads],
            {**self.where},
            {**self.readable},
            self.uses.copy(),
            {digit: [*there] for digit, there in self.pending.items()},
            {*self.taken},
            self.operand,
        )


@dataclass
class Scheduler:
    """Makes the instructions of one sample.

    Parameters
    ----------
    states : dict of Digit to int
        Addresses of the states' digits: all from 0 on.
    copies : dict of Digit to list of Digit
        The states that take over a digit, which must all have the values that it has.
    sums : sequence of Sum
        Everything that will be computed.
    products : int
        Products at each clock, 1 or 2.
    makes_way : bool
        Whether a digit is stored in a state at once where something has to be moved from there first; otherwise it is
        moved there later.

    Attributes
    ----------
    instructions : list of Instruction
        Those made so far. The address of the word that always holds 1 is -1.
    reads : list of (Digit, Digit)
        The digits that each of them reads; the second one is that of ONE without a second product.
    where : dict of Digit to int
        Address of each digit.
    schedule : list of (str, int, int)
        Name, first instruction and number of instructions, as in `sosmith.model.dataflow.program.Program`.
    words : int
        Words used so far, without the one that always holds 1.
    """

    states: Mapping[Digit, int]
    copies: Mapping[Digit, Sequence[Digit]]
    sums: Sequence[Sum]
    products: int = 1
    makes_way: bool = True
    schedule: list[tuple[str, int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        products = [product for one in self.sums for column in one.columns for product in column.products]
        self._now = _State(
            [],
            [],
            {ONE: -1, **self.states},
            {},
            Counter(digit for product in products for digit in product.digits),
            {digit: [*there] for digit, there in self.copies.items() if digit in self.states},
            set(),
        )
        self.words = len(self.states)

    @property
    def instructions(self) -> list[Instruction]:
        return self._now.instructions

    @property
    def reads(self) -> list[tuple[Digit, Digit]]:
        return self._now.reads

    @property
    def where(self) -> dict[Digit, int]:
        return self._now.where

    def take(self, digits: Iterable[Digit]) -> None:
        """Take the digits of the sample."""
        for number, digit in enumerate(digits):
            self._emit(Opcode.TAKE, ONE, number, self._place(digit, distance_moved(self.products)))
        self.note("input")

    def note(self, name: str) -> None:
        """Note that the instructions since the last note compute `name`."""
        start = sum(self.schedule[-1][1:]) if self.schedule else 0
        if len(self.instructions) > start:
            self.schedule.append((name, start, len(self.instructions) - start))

    def stalls(self, one: Sum) -> int:
        """Count the instructions that would do nothing if a sum came next."""
        kept, words = self._now, self.words
        self._now = kept.copy()
        before = len(self.instructions)
        self.compute(one)
        stalls = sum(
            i.opcode is Opcode.MULTIPLY and not i.constant and not i.second_constant and digits == (ONE, ONE)
            for i, digits in zip(self.instructions[before:], self.reads[before:], strict=True)
        )
        self._now, self.words = kept, words
        return stalls

    def is_unused(self, one: Sum) -> bool:
        """Whether nothing needs any more what a sum writes to a state."""
        own = [digit for digit in self.states if digit.value == one.value]
        return all(not self._now.uses[digit] and self._can_flush(digit) for digit in own)

    def compute(self, one: Sum) -> None:
        """Make the instructions of a sum. The states that it writes itself must not be needed any more."""
        for digit in self.states:
            if digit.value == one.value:
                self._flush(digit)
        for column in one.columns:
            self._column(column)

    def finish(self, one: Sum) -> None:
        """Make the instructions of the result, the last ones, and before their end what the states still need."""
        *columns, last = one.columns
        open_end = one._replace(columns=(*columns, last._replace(end=Opcode.MULTIPLY)))
        tried = [self._trial(one, before) for before in range(len(one.columns))]
        tried.append(self._trial(open_end, len(one.columns), Opcode.GIVE, last.part))
        self._now, self.words = min((trial for trial in tried if trial), key=lambda trial: len(trial[0].instructions))
        self.note("output")

    def _trial(self, one: Sum, before: int, *end: int) -> tuple[_State, int] | None:
        """Try to compute a sum with all that is left to be moved before one of its columns; None if it leaves more."""
        kept, words = self._now, self.words
        self._now = kept.copy()
        for column in one.columns[:before]:
            self._column(column)
        due = [digit for digit, there in self._now.pending.items() if there]
        possible = all(map(self._can_flush, due))
        for digit in due if possible else ():
            self._flush(digit)
        for column in one.columns[before:]:
            self._column(column)
        if end:
            opcode, part = end
            self._emit(Opcode(opcode), ONE, 0, part)
        trial = self._now, self.words
        self._now, self.words = kept, words
        return trial if possible and not any(trial[0].pending.values()) else None

    # Columns and products.

    def _column(self, column: Column) -> None:
        left = [*column.products]
        while left:
            product = min(left, key=lambda one: self._rank(one, left))
            left.remove(product)
            second = self._second(product, left)
            if second is not None:
                left.remove(second)
                product, second = self._ordered(product, second)
            if left or product.other is not None:
                self._add(product, column, second, last=not left)
            else:
                self._end(product, column, second)
        if not column.products and column.end is not Opcode.MULTIPLY:
            self._end(Product(ONE), column)

    def _second(self, product: Product, left: Sequence[Product]) -> Product | None:
        """Return the product to be computed beside another one of its column, without more waiting; None without."""
        if self.products == 1:
            return None
        wait = max(map(self._wait, product.digits))
        ready = [one for one in left if self._wait(one.other or one.digit) <= wait]  # an operand is read first
        if product.other is not None:
            ready = [one for one in ready if one.other is None]
        return min(
            ready, key=lambda one: (one.other is not None, self._moves(one), self._rank(one, left)), default=None
        )

    def _ordered(self, one: Product, other: Product) -> tuple[Product, Product]:
        """Return two products with the one first that only a first product can be: of two words, or to be moved."""
        if other.other is not None or (one.other is None and self._moves(other) and not self._moves(one)):
            return other, one
        return one, other

    def _moves(self, product: Product) -> bool:
        """Whether a product's digit has to be moved."""
        return bool(self._now.pending.get(product.digit))

    def _rank(self, product: Product, left: Sequence[Product]) -> tuple[int, int]:
        """Sort the products left in a column: first what need not wait, and what lets a digit be moved."""
        now = self._now
        wait = max(map(self._wait, product.digits))
        if wait:
            return 9, wait
        if product.other is not None:
            return 4, product.other != now.operand
        digit = product.digit
        if now.pending.get(digit):
            return (1 if self._movable(digit) else 3), 0
        sources = {other.digit for other in left}
        return (0 if any(digit in there for of, there in now.pending.items() if of in sources) else 2), 0

    def _add(self, product: Product, column: Column, second: Product | None, *, last: bool) -> None:
        """Add a product that does not end its column, or one of two digits, and a second one beside it."""
        now = self._now
        if product.other is None:
            self._read(product.digit)
            self._use(product, second)
            there = self._movable(product.digit)
            if there is not None:
                self._move(product.digit, there, product.constant, second)
            elif second is not None or not self._move_beside(product):
                self._emit(Opcode.MULTIPLY, product.digit, product.constant, second=second)
            self._release_all(product, second)
            return
        first, other = product.digits if product.digit == now.operand else reversed(product.digits)
        if first != now.operand:
            self._read(first)
            if second is not None:
                self._read(second.digit)
                now.uses[second.digit] -= 1
            self._emit(Opcode.OPERAND, first, second=second)
            if second is not None:
                self._release(second.digit)
            now.operand, second = first, None
        self._read(other)
        ends = {Opcode.STORE: Opcode.PRODUCT_STORE, Opcode.DROP: Opcode.PRODUCT_DROP}
        ends |= {Opcode.FINISH: Opcode.PRODUCT_FINISH}
        opcode = ends.get(column.end, Opcode.PRODUCT) if last else Opcode.PRODUCT
        self._use(product, second)
        target = 0
        if opcode is Opcode.PRODUCT_STORE or opcode is Opcode.PRODUCT_FINISH:
            self._make_way(column.digit)
            target = self._place(column.digit)
        self._emit(opcode, other, 0, target, second)
        self._release_all(product, second)
        if last and opcode is Opcode.PRODUCT and column.end is not Opcode.MULTIPLY:
            self._end(Product(ONE), column)

    def _end(self, product: Product, column: Column, second: Product | None = None) -> None:
        """Add the last product of a column, or the last two, and end it."""
        if column.end is Opcode.MULTIPLY:
            self._add(product, column, second, last=False)
            return
        target = column.part
        self._use(product, second)
        if column.end in {Opcode.STORE, Opcode.FINISH}:
            self._make_way(column.digit)
        self._read(product.digit)
        if second is not None:
            self._read(second.digit)
        if column.end in {Opcode.STORE, Opcode.FINISH}:
            target = self._place(column.digit)
        self._emit(column.end, product.digit, product.constant, target, second)
        self._release_all(product, second)

    def _use(self, product: Product, second: Product | None) -> None:
        """Count the uses of digits that the next instruction reads."""
        for digit in (*product.digits, *(() if second is None else second.digits)):
            self._now.uses[digit] -= 1

    def _release_all(self, product: Product, second: Product | None) -> None:
        """Free the words of digits that have been read."""
        for digit in (*product.digits, *(() if second is None else second.digits)):
            self._release(digit)

    # Words.

    def _place(self, digit: Digit, distance: int | None = None) -> int:
        """Give a digit that is stored by the next instruction its word; return the address."""
        now = self._now
        distance = distance_stored(self.products) if distance is None else distance
        due = [] if digit in self.states else [*self.copies.get(digit, ())]
        free = next((there for there in due if self._is_free(there)), None)
        if digit in self.states:
            address = self.states[digit]
        elif free is not None:
            due.remove(free)
            address = self.states[free]
        else:
            start = len(self.states)
            address = next(a for a in range(start, start + len(now.taken) + 1) if a not in now.taken)
            now.taken.add(address)
            self.words = max(self.words, address + 1)
        now.where[digit] = address
        now.readable[address] = len(now.instructions) + distance
        if due:
            now.pending[digit] = due
        self._release(digit)
        return address

    def _is_free(self, state: Digit) -> bool:
        """Whether nothing needs the old value of a state's digit any more."""
        return not self._now.uses[state] and not self._now.pending.get(state)

    def _release(self, digit: Digit) -> None:
        """Free a word that holds nothing but a digit that nothing needs any more."""
        now = self._now
        if now.where[digit] >= len(self.states) and not now.uses[digit] and not now.pending.get(digit):
            now.taken.discard(now.where[digit])

    def _movable(self, digit: Digit) -> Digit | None:
        """Return a state that the next instruction can move a digit to."""
        now = self._now
        if self.products == 1 and now.instructions and now.instructions[-1].opcode in LATE_WRITES:
            return None
        return next((there for there in now.pending.get(digit, ()) if self._is_free(there)), None)

    def _move(self, digit: Digit, there: Digit, constant: int = 0, second: Product | None = None) -> None:
        now = self._now
        now.pending[digit].remove(there)
        address = self.states[there]
        self._emit(Opcode.MOVE, digit, constant, address, second)
        now.readable[address] = len(now.instructions) - 1 + distance_moved(self.products)

    def _make_way(self, digit: Digit) -> None:
        """Move what only has to be moved before a digit can be stored in its state."""
        if not self.makes_way and digit not in self.states:
            return
        for there in self.copies.get(digit, ()):
            if not self._now.uses[there] and self._now.pending.get(there) and self._can_flush(there):
                self._flush(there)

    def _can_flush(self, digit: Digit) -> bool:
        """Whether a digit can be moved to all states that it must go to."""
        return all(
            self._is_free(there) or (not self._now.uses[there] and self._can_flush(there))
            for there in self._now.pending.get(digit, ())
        )

    def _flush(self, digit: Digit) -> None:
        """Move a digit to all states that it must go to."""
        now = self._now
        for there in [*now.pending.get(digit, ())]:
            self._flush(there)
            self._read(digit)
            while self._movable(digit) is None:
                self._wait_for(1)
            self._move(digit, there)
        self._release(digit)

    # Instructions.

    def _wait(self, digit: Digit) -> int:
        now = self._now
        return max(0, now.readable.get(now.where[digit], 0) - len(now.instructions))

    def _read(self, digit: Digit) -> None:
        self._wait_for(self._wait(digit))

    def _wait_for(self, instructions: int) -> None:
        for _ in range(instructions):
            if not self._move_beside(None):
                self._emit(Opcode.MULTIPLY, ONE)

    def _move_beside(self, product: Product | None) -> bool:
        """Move a digit by an instruction that has nothing but one product, or nothing at all, if there is one to move.

        Where there is one product a clock, digits are moved as they are multiplied.
        """
        if self.products == 1:
            return False
        for digit in sorted(self._now.pending, key=lambda one: self._now.uses[one] > 0):  # others move as they are read
            there = None if self._wait(digit) else self._movable(digit)
            if there is not None:
                self._move(digit, there, second=product)
                self._release(digit)
                return True
        return False

    def _emit(
        self, opcode: Opcode, digit: Digit, constant: int = 0, target: int = 0, second: Product | None = None
    ) -> None:
        beside = Product(ONE) if second is None else second
        where = self._now.where
        more = (where[beside.digit], beside.constant) if self.products > 1 else ()
        self._now.instructions.append(Instruction(opcode, where[digit], constant, target, *more))
        self._now.reads.append((digit, beside.digit))
