"""What an expression of a C model computes: its type, the range of its values, and its form.

Forms are those of `sosmith.verify.c_model.forms`. Each operation is checked to stay in
its type, and each conversion to keep the value, so that C computes with integers as such. A shift of a
negative value to the right is taken to round down, which C leaves to the compiler.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from sosmith.verify.c_model.cursor import Cursor
from sosmith.verify.c_model.forms import Form, Forms, number, scaled, total, towards_zero
from sosmith.verify.graph import RejectedError

BITS = {"int": 32, "int32_t": 32, "int64_t": 64, "__int128": 128}
"""Bits of the signed types, which rise in rank. An int is the type of a small number such as that of places."""

HELD = tuple(kind for kind in BITS if kind != "int")
"""Types of what is held: an int may have 16 bits."""


class Value(NamedTuple):
    """An expression's type, the range of its values, and its form."""

    type: str
    low: int
    high: int
    form: Form


def fits(kind: str, low: int, high: int) -> bool:
    """Whether a type holds all values of a range."""
    limit = 1 << (BITS[kind] - 1)
    return -limit <= low and high < limit


class Reader:
    """Reads expressions.

    Parameters
    ----------
    cursor : Cursor
        Where they stand.
    names : mapping of str to Value
        What names mean, members such as ``w->n0_1`` too.
    forms : Forms
        The atoms of their forms.
    """

    def __init__(self, cursor: Cursor, names: Mapping[str, Value], forms: Forms) -> None:
        self._cursor, self._forms = cursor, forms
        self._names = names

    def expression(self) -> Value:
        """Read an expression.

        Raises
        ------
        RejectedError
            If it is no expression of a model, or may leave its type.
        """
        left = self._shift()
        if self._cursor.next == "&":
            return self._masked(left)
        if self._cursor.next not in {"<", ">"}:
            return left
        mark = self._cursor.take()
        right = self._shift()
        self._cursor.expect("?")
        then = self.expression()
        self._cursor.expect(":")
        other = self.expression()
        kind = _wider(then.type, other.type)
        form = self._forms.choice(mark, left.form, right.form, then.form, other.form)
        return Value(kind, min(then.low, other.low), max(then.high, other.high), form)

    def _masked(self, left: Value) -> Value:
        self._cursor.expect("&")
        mask = self._constant(self._shift(), "a mask")
        if mask.low + 1 & mask.low or mask.low < 0:
            raise self._cursor.refused("a mask of the lowest bits")
        if self._cursor.next in {"<", ">", "&"}:  # which C would take first
            raise self._cursor.refused("brackets around a remainder")
        return Value(_wider(left.type, mask.type), 0, mask.low, self._forms.masked(left.form, mask.low.bit_length()))

    def _shift(self) -> Value:
        left = self._sum()
        while self._cursor.next in {"<<", ">>"}:
            mark = self._cursor.take()
            places = self._constant(self._sum(), "a number of places").low
            if not 0 <= places < BITS[left.type]:
                raise self._cursor.refused("a shift by fewer places than there are")
            if mark == ">>":
                form = self._forms.shifted(left.form, places)
                left = Value(left.type, left.low >> places, left.high >> places, form)
            elif left.low < 0:
                raise self._cursor.refused("a shift to the left of what is not negative")
            else:
                form = scaled(left.form, 1 << places)
                left = self._held(Value(left.type, left.low << places, left.high << places, form))
        return left

    def _sum(self) -> Value:
        left = self._product()
        while self._cursor.next in {"+", "-"}:
            sign = 1 if self._cursor.take() == "+" else -1
            right = self._product()
            ends = sorted((sign * right.low, sign * right.high))
            form = total((left.form, 1), (right.form, sign))
            kind = _wider(left.type, right.type)
            left = self._held(Value(kind, left.low + ends[0], left.high + ends[1], form))
        return left

    def _product(self) -> Value:
        left = self._cast()
        while self._cursor.next in {"*", "/"}:
            if self._cursor.take() == "*":
                right = self._cast()
                ends = [a * b for a in (left.low, left.high) for b in (right.low, right.high)]
                kind = _wider(left.type, right.type)
                left = self._held(Value(kind, min(ends), max(ends), self._forms.product(left.form, right.form)))
            else:
                divisor = self._constant(self._cast(), "a divisor")
                if divisor.low <= 0:
                    raise self._cursor.refused("a positive divisor")
                low, high = (towards_zero(end, divisor.low) for end in (left.low, left.high))
                kind = _wider(left.type, divisor.type)
                left = Value(kind, low, high, self._forms.quotient(left.form, divisor.low))
        return left

    def _cast(self) -> Value:
        if self._cursor.next == "(" and self._cursor.peek(1) in HELD and self._cursor.peek(2) == ")":
            self._cursor.expect("(")
            kind = self._cursor.take()
            self._cursor.expect(")")
            return self._held(self._cast()._replace(type=kind))
        return self.primary()

    def primary(self) -> Value:
        """Read a name, a number, or an expression in parentheses.

        Raises
        ------
        RejectedError
            As `expression`.
        """
        if self._cursor.accepts("("):
            inner = self.expression()
            self._cursor.expect(")")
            return inner
        for bits in (32, 64):
            if self._cursor.accepts(f"INT{bits}_C"):
                return self._literal(bits)
        if self._cursor.next.isdigit():
            value = int(self._cursor.take(r"\d{1,9}"))
            return Value("int", value, value, number(value))
        if self._cursor.accepts("product"):
            return self._called()
        name = self._cursor.take(r"[A-Za-z_]\w*")
        if self._cursor.accepts("->"):
            name += "->" + self._cursor.take(r"\w+")
        if name not in self._names:
            raise self._cursor.refused(f"something other than {name!a}, which has no value here")
        return self._names[name]

    def _called(self) -> Value:
        """Read the arguments of the function that multiplies 32 by 32 bits, and return the product."""
        self._cursor.expect("(")
        left = self.expression()
        self._cursor.expect(",")
        right = self.expression()
        if max(BITS[left.type], BITS[right.type]) > 32:
            raise self._cursor.refused("factors of 32 bits")
        self._cursor.expect(")")
        ends = [a * b for a in (left.low, left.high) for b in (right.low, right.high)]
        return Value("int64_t", min(ends), max(ends), self._forms.product(left.form, right.form))

    def _literal(self, bits: int) -> Value:
        self._cursor.expect("(")
        sign = -1 if self._cursor.accepts("-") else 1
        value = sign * int(self._cursor.take(r"\d{1,19}"))
        self._cursor.expect(")")
        if abs(value) >= 1 << bits - 1:
            raise self._cursor.refused(f"a constant of {bits} bits")
        return Value(f"int{bits}_t", value, value, number(value))

    def _constant(self, value: Value, what: str) -> Value:
        if value.low != value.high:
            raise self._cursor.refused(f"{what} that is constant")
        return value

    def _held(self, value: Value) -> Value:
        if not fits(value.type, value.low, value.high):
            raise RejectedError(
                f"{self._cursor.refused('values in their range')}: {value.low}..{value.high} is not in {value.type}"
            )
        return value


def _wider(a: str, b: str) -> str:
    return a if BITS[a] >= BITS[b] else b
