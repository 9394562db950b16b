"""What the logic of a netlist computes, as forms.

A word of w bits is given as a form that leaves the same remainder modulo ``2**w``, so bits that are dropped anyway cost
nothing; where the value itself counts, as in a comparison or an extension, it is made unsigned or signed first.

What a register or an input holds is asked of whoever evaluates. Control signals are 0 or 1, so that choices by them
have one side only; choices by anything else become ``b + select (a - b)``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.parallel.split import sliced
from sosmith.verify.program.normal_form import ONE, Form, constant, plus
from sosmith.verify.reader.syntax import (
    Bits,
    Choice,
    Expression,
    Joined,
    Load,
    Number,
    Operator,
    Statement,
    Word,
)

Content = Callable[[str], Form]
"""What a register or an input holds, as a word of its width."""

KnownBits = Callable[[str, int, int], Form | None]
"""Bits of a net, by its name, the lowest of them and their number; None if they are not known."""


def none_known(_name: str, _low: int, _width: int) -> Form | None:
    """Know no bits."""
    return None


_ONE_BIT = frozenset({"==", "!=", "<", ">", "<=", ">=", "!"})
_ARITHMETIC = frozenset({"+", "-", "*"})


def is_signed(value: Expression) -> bool:
    """Whether an expression is signed, so that it is extended by its top bit."""
    if not isinstance(value, Operator) or value.symbol in _ONE_BIT:
        return False
    if value.symbol == "signed":
        return True
    if value.symbol in {"&", "|", "^"} and len(value.operands) == 1:
        return False
    operands = value.operands[1:] if value.symbol == "?" else value.operands
    return all(is_signed(operand) for operand in operands)


class Evaluation:
    """The values of all nets, for one choice of what registers and inputs hold.

    Parameters
    ----------
    netlist : Netlist
        The core.
    forms : Forms
        The atoms.
    content : callable
        What a register or an input holds.
    shortened : callable
        Gives a word a shorter form, if it has one, by its width and whether it enters an instance.
    word : callable or None
        What a memory, by its name, has at an address.
    cuts : set of str
        Nets whose value is asked for like that of a register.
    fields : callable
        Gives bits of an input from one on, so many, where that is simpler than to cut them out; otherwise None.
    parts : callable
        Gives bits of any net, where they are known whatever drives it; otherwise None.
    """

    def __init__(
        self,
        netlist: Netlist,
        forms: Forms,
        content: Content,
        shortened: Callable[[Form, int, bool], Form] = lambda word, width, at_inlet: word,
        *,
        word: Callable[[str, Form], Form] | None = None,
        cuts: Set[str] = frozenset(),
        fields: KnownBits = none_known,
        parts: KnownBits = none_known,
    ) -> None:
        self._netlist, self._forms, self._content, self._shortened = netlist, forms, content, shortened
        self._word, self._cuts, self._fields = word, cuts, fields
        self._parts = parts
        self._known: dict[tuple[str, int, int], Form] = {}
        self._open: set[tuple[str, int, int]] = set()

    def word(self, value: Expression) -> Form:
        """Return an expression as a word of its own width.

        Raises
        ------
        RejectedError
            If it depends on itself or on what nothing drives, or uses an operator that is not known here.
        """
        return self._extended(value, self._netlist.width(value))

    def net(self, name: str, low: int = 0, width: int | None = None) -> Form:
        """Return bits of a net as a word."""
        count = self._netlist.widths[name] if width is None else width
        key = name, low, count
        if key not in self._known:
            require(key not in self._open, f"{name} must not depend on itself within a clock")
            self._open.add(key)
            word = self._net(*key)
            self._known[key] = self._shortened(word, count, name in self._netlist.inlets)
            self._open.discard(key)
        return self._known[key]

    def loaded(
        self, statements: Sequence[Statement], before: tuple[Expression, Form] | None = None
    ) -> tuple[Expression, Form] | None:
        """Return what statements load, as target and word; None if nothing is loaded.

        `before` is what statements before them load, which counts where these load nothing.

        Raises
        ------
        RejectedError
            If it depends on data whether anything is loaded, or words at two places are.
        """
        load = before
        for statement in statements:
            loaded = self._executed(statement, load)
            if load is not None and loaded is not None and load[0] != loaded[0]:
                raise RejectedError("it must not be loaded at two places at a clock")
            load = loaded or load
        return load

    def bit(self, value: Expression) -> Form:
        """Return whether an expression is not 0: a form that is 0 or 1."""
        return self._any(value)

    def product(self, a: Form, b: Form) -> Form:
        """Return the product of two forms."""
        return self._forms.times(a, b)

    def _executed(self, statement: Statement, before: tuple[Expression, Form] | None) -> tuple[Expression, Form] | None:
        if isinstance(statement, Load):
            return statement.target, self._extended(statement.value, self._netlist.width(statement.target))
        assert isinstance(statement, Choice)
        select = self._any(statement.condition)
        if not select.keys() - {ONE}:
            return self.loaded(statement.yes if select else statement.no, before)
        yes, no = self.loaded(statement.yes, before), self.loaded(statement.no, before)
        if yes is None and no is not None and isinstance(no[0], Bits):
            yes = no[0], self.word(no[0])  # it keeps what it holds
        if no is None and yes is not None and isinstance(yes[0], Bits):
            no = yes[0], self.word(yes[0])
        if yes is None or no is None or yes[0] != no[0]:
            raise RejectedError("it must not depend on data whether something is loaded")
        return yes[0], self._chosen(select, yes[1], no[1])

    def _net(self, name: str, low: int, width: int) -> Form:
        part = self._parts(name, low, width)
        if part is not None:
            return part
        if name in self._netlist.inlets and width < self._netlist.widths[name]:
            whole = self.net(name)
            if self._forms.is_variable(whole):
                return self._cut(whole, low)  # what stages hand on is a variable, and so are its bits made of it
        drivers = self._netlist.drivers.get(name)
        if drivers is None or name in self._cuts:
            known = name in self._cuts or name in self._netlist.registers or self._netlist.ports.get(name) == "input"
            none = "bits of x must not be used" if name.startswith("?") else f"{name} must be driven to be used"
            require(known, none)
            part = self._fields(name, low, width)
            return self._cut(self._content(name), low) if part is None else part
        total: Form = {}
        done = low
        for driver in drivers:
            first, last = max(driver.low, low), min(driver.low + driver.width, low + width)
            if first >= last:
                continue
            require(first == done, f"bit {done} of {name} must be driven to be used")
            part = self._driven(driver.value, driver.start + first - driver.low, last - first)
            if last < low + width:
                part = self._forms.unsigned(part, last - first)
            total = plus(total, part, 1 << (first - low))
            done = last
        require(done == low + width, f"bit {done} of {name} must be driven to be used")
        return total

    def _driven(self, value: Expression, low: int, width: int) -> Form:
        """Return bits of what drives a net as a word."""
        own = self._netlist.width(value)
        if isinstance(value, Bits) and low + width <= own:
            return self.net(value.name, value.low + low, width)
        if isinstance(value, Joined) and low + width <= own:
            bits = sliced(self._netlist, value, low, width, followed=0)
            if bits is not None and bits != value:
                return self._extended(bits, width)
        word = self._extended(value, max(low + width, own))
        short = self._shortened(word, max(low + width, own), False)
        if low and short is word and low + width < own:
            short = self._shortened(word, low + width, False)  # what is above these bits may be anything
        return self._cut(short, low)

    def _cut(self, word: Form, low: int) -> Form:
        return self._forms.floor(shifted(word, -low)) if low else word

    # Expressions.

    def _exact(self, value: Expression, *, signed: bool) -> Form:
        """Value of an expression by its own width."""
        width = self._netlist.width(value)
        word = self.word(value)
        return self._forms.signed(word, width) if signed else self._forms.unsigned(word, width)

    def _extended(self, value: Expression, width: int) -> Form:
        """Return an expression as a word of `width` bits, not less than its own unless the rest is dropped."""
        own = self._netlist.width(value)
        if isinstance(value, Operator) and value.symbol in _ARITHMETIC | {"~", "?"}:
            return self._widened(value, max(width, own))
        word = self._plain(value)
        if width <= own:
            return word
        signed = is_signed(value)
        return self._forms.signed(word, own) if signed else self._forms.unsigned(word, own)

    def _widened(self, value: Operator, width: int) -> Form:
        """Return an operation whose operands are extended to `width` bits, all by their sign or none."""
        signed = is_signed(value)

        def operand(of: Expression) -> Form:
            if self._netlist.width(of) >= width:
                return self.word(of)
            return self._exact(of, signed=signed)

        if value.symbol == "?":
            select = self._any(value.operands[0])
            if not select.keys() - {ONE}:
                return operand(value.operands[1 if select else 2])
            return self._chosen(select, operand(value.operands[1]), operand(value.operands[2]))
        parts = [operand(of) for of in value.operands]
        if value.symbol == "~":
            return plus(constant(-1), parts[0], -1)
        if len(parts) != 2:
            raise RejectedError(f"{value.symbol} must have two operands")
        if value.symbol == "*":
            return self._forms.times(parts[0], parts[1])
        return plus(parts[0], parts[1], 1 if value.symbol == "+" else -1)

    def _plain(self, value: Expression) -> Form:
        """Return anything whose operands are not extended with it, as a word of its own width."""
        if isinstance(value, Number):
            return constant(value.value)
        if isinstance(value, Bits):
            return self.net(value.name, value.low, value.width)
        if isinstance(value, Word):
            if self._word is None:
                raise RejectedError(f"a word of {value.name} must not be used here")
            return self._word(value.name, self._exact(value.address, signed=False))
        if isinstance(value, Joined):
            total: Form = {}
            at = 0
            for k, part in enumerate(reversed(value.parts)):
                last = k == len(value.parts) - 1
                total = plus(total, self.word(part) if last else self._exact(part, signed=False), 1 << at)
                at += self._netlist.width(part)
            return total
        if value.symbol == "signed":
            return self.word(value.operands[0])
        if value.symbol in {"&", "|", "^"} and len(value.operands) == 2:
            return self._bitwise(value)
        if value.symbol == "&":
            return self._all(value.operands[0])
        if value.symbol == "|":
            return self._any(value.operands[0])
        if value.symbol == "!":
            return plus(constant(1), self._any(value.operands[0]), -1)
        return self._compared(value)

    def _bitwise(self, value: Operator) -> Form:
        """Join two words of equal width, bit by bit."""
        first, second = value.operands
        width = self._netlist.width(first)
        require(width == self._netlist.width(second), f"{value.symbol} must join words of one width, not of two")
        a = self._exact(first, signed=False)
        if value.symbol == "&" and not a:
            return a
        if value.symbol == "|" and a == constant((1 << width) - 1):
            return a
        b = self._exact(second, signed=False)
        neutral = constant((1 << width) - 1 if value.symbol == "&" else 0)
        if neutral in (a, b):
            return a if b == neutral else b
        if value.symbol == "&" and width > 1:
            for word, other in ((a, b), (b, a)):
                repeated = self._repeated_bit(word, width)
                if repeated is not None:
                    return self._forms.times(repeated, other)
        total: Form = {}
        for place in range(width):
            x, y = (self._forms.unsigned(self._cut(word, place), 1) for word in (a, b)) if width > 1 else (a, b)
            both = self._forms.times(x, y)
            one = both if value.symbol == "&" else plus(plus(x, y), both, -1 if value.symbol == "|" else -2)
            total = plus(total, self._forms.bit(one), 1 << place)
        return total

    def _repeated_bit(self, word: Form, width: int) -> Form | None:
        """Return the bit that a word repeats in all its places; None if it does not."""
        ones = (1 << width) - 1
        if any(value % ones for value in word.values()):
            return None
        bit = {monomial: value // ones for monomial, value in word.items()}
        low, high = self._forms.limits(bit)
        return bit if low >= 0 and high <= 1 else None

    def _any(self, value: Expression) -> Form:
        """Whether a bit is set."""
        parts = value.parts if isinstance(value, Joined) else (value,)
        bit: Form = {}
        for part in parts:
            exact = self._exact(part, signed=False)
            one = exact if self._netlist.width(part) == 1 else self._forms.negative(plus({}, exact, -1))
            bit = self._forms.bit(plus(plus(bit, one), self._forms.times(bit, one), -1))
            if bit == constant(1):
                break
        return bit

    def _all(self, value: Expression) -> Form:
        """Whether all bits are set."""
        parts = value.parts if isinstance(value, Joined) else (value,)
        bit = constant(1)
        for part in parts:
            width = self._netlist.width(part)
            exact = self._exact(part, signed=False)
            other = self._forms.negative(plus(exact, constant((1 << width) - 1), -1))
            one = exact if width == 1 else plus(constant(1), other, -1)
            bit = self._forms.bit(self._forms.times(bit, one))
            if not bit:
                break
        return bit

    def _compared(self, value: Operator) -> Form:
        require(value.symbol in _ONE_BIT and len(value.operands) == 2, f"the operator {value.symbol} must be known")
        signed = all(is_signed(operand) for operand in value.operands)
        a, b = (self._exact(operand, signed=signed) for operand in value.operands)
        less, more = self._forms.negative(plus(a, b, -1)), self._forms.negative(plus(b, a, -1))
        one = constant(1)
        outcome = {
            "<": less,
            ">": more,
            "<=": plus(one, more, -1),
            ">=": plus(one, less, -1),
            "!=": plus(less, more),
            "==": plus(one, plus(less, more), -1),
        }[value.symbol]
        return self._forms.bit(outcome)

    def _chosen(self, select: Form, yes: Form, no: Form) -> Form:
        return plus(no, self._forms.times(select, plus(yes, no, -1)))
