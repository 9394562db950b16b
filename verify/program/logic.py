"""Evaluates combinational logic of generated SystemVerilog, bit by bit.

The text is that of Yosys: each assignment stands on one line and has at most one operator. A bit is 0, 1, a bit of a
signal that has no value (a port or a register), or unknown, where it would depend on several of these.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from sosmith.verify.graph import require

Bit = int | tuple[str, int] | None
"""0, 1, a bit of a signal without a value, or None if unknown."""

_NET = re.compile(r"^ *(?:input|output|wire|reg) (?:\[(\d+):0\] )?(\S+) *(?:=.*)?;$", re.MULTILINE)
_ASSIGN = re.compile(r"^ *assign (.*?) = (.*);$", re.MULTILINE)
_TOKEN = re.compile(r"\s*(\\\S+|\d+'s?[hdb][0-9a-fx]+|\d+|\w+|==|.)")


class Logic:
    """The assignments of a text.

    Parameters
    ----------
    text : str
        A module in SystemVerilog, as the generator writes it.
    """

    def __init__(self, text: str) -> None:
        self.widths = {name.lstrip("\\"): int(top or 0) + 1 for top, name in _NET.findall(text)}
        self._drivers: dict[str, list[tuple[int, int, str, int]]] = {}
        for left, right in _ASSIGN.findall(text):
            self._assign(left, right)

    def value(self, expression: str, bound: Mapping[str, Sequence[Bit]]) -> list[Bit]:
        """Return the bits of an expression, the lowest first, with the given bits for some of the signals.

        Raises
        ------
        RejectedError
            If it uses an operator that is not known here.
        """
        return _Evaluation(self, bound).of(expression)

    def drivers(self, name: str) -> list[tuple[int, int, str, int]]:
        """Return what is assigned to a signal: first bit, number of bits, expression, first bit of that."""
        return self._drivers.get(name, [])

    def _assign(self, left: str, right: str) -> None:
        tokens = _Tokens(left)
        targets = []
        braces = tokens.take("{")
        while True:
            name, low, width = _slice(tokens, self.widths)
            targets.append((name, low, width))
            if not (braces and tokens.take(",")):
                break
        start = 0
        for name, low, width in reversed(targets):
            self._drivers.setdefault(name, []).append((low, width, right, start))
            start += width


class _Tokens:
    """The tokens of an expression, one after the other."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = [match[1] for match in _TOKEN.finditer(text) if match[1].strip()]
        self._at = 0

    def peek(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def next(self) -> str:
        self._at += 1
        return self._tokens[self._at - 1] if self._at <= len(self._tokens) else ""

    def take(self, token: str) -> bool:
        if self.peek() != token:
            return False
        self._at += 1
        return True

    def expect(self, token: str) -> None:
        read = self.next()
        require(read == token, f"logic must have {token!r} after what stands before it in {self._text!r}, not {read!r}")


def _slice(tokens: _Tokens, widths: Mapping[str, int]) -> tuple[str, int, int]:
    """Read the name of a signal and its bits: return name, lowest bit, and number of bits."""
    name = tokens.next().lstrip("\\")
    require(name in widths, f"logic must be made of declared signals, not {name!r}")
    if not tokens.take("["):
        return name, 0, widths[name]
    high = low = int(tokens.next())
    if tokens.take(":"):
        low = int(tokens.next())
    tokens.expect("]")
    return name, low, high - low + 1


class _Evaluation:
    """Evaluates expressions for one choice of the bound signals."""

    def __init__(self, logic: Logic, bound: Mapping[str, Sequence[Bit]]) -> None:
        self._logic = logic
        self._bound = bound
        self._known: dict[str, list[Bit]] = {}

    def of(self, expression: str) -> list[Bit]:
        tokens = _Tokens(expression)
        value = self._expression(tokens)()
        require(not tokens.peek(), f"logic must have one operator at most, not as {expression!r} does")
        return value

    def _signal(self, name: str) -> list[Bit]:
        if name in self._bound:
            return list(self._bound[name])
        if name not in self._known:
            bits: list[Bit] = [(name, i) for i in range(self._logic.widths[name])]
            for low, width, expression, start in self._logic.drivers(name):
                value = _extended(self.of(expression), start + width)
                bits[low : low + width] = value[start : start + width]
            self._known[name] = bits
        return self._known[name]

    def _expression(self, tokens: _Tokens) -> Callable[[], list[Bit]]:
        """Read an expression; return what evaluates it, so that of a choice only one side is evaluated."""
        if tokens.peek() in _UNARY:
            operation = _UNARY[tokens.next()]
            operand = self._operand(tokens)
            return lambda: operation(operand())
        first = self._operand(tokens)
        if tokens.take("?"):
            yes = self._operand(tokens)
            tokens.expect(":")
            no = self._operand(tokens)
            return lambda: _chosen(first(), yes, no)
        if tokens.peek() in _BINARY:
            combined = _BINARY[tokens.next()]
            second = self._operand(tokens)
            return lambda: combined(first(), second())
        return first

    def _operand(self, tokens: _Tokens) -> Callable[[], list[Bit]]:
        if tokens.take("{"):
            parts = [self._operand(tokens)]
            while tokens.take(","):
                parts.append(self._operand(tokens))
            tokens.expect("}")
            return lambda: [bit for part in reversed(parts) for bit in part()]
        if tokens.peek()[:1].isdigit():
            bits = list(_constant(tokens.next()))
            return lambda: bits
        name, low, width = _slice(tokens, self._logic.widths)
        return lambda: self._signal(name)[low : low + width]


def _constant(token: str) -> Iterator[Bit]:
    size, rest = token.split("'")
    rest = rest.lstrip("s")
    bits_each = {"h": 4, "b": 1}.get(rest[0])
    if bits_each is None:
        yield from (int(rest[1:]) >> i & 1 for i in range(int(size)))
        return
    bits: list[Bit] = []
    for digit in reversed(rest[1:]):
        bits += [None if digit == "x" else int(digit, 16) >> i & 1 for i in range(bits_each)]
    yield from _extended(bits, int(size))[: int(size)]


def _extended(bits: Sequence[Bit], width: int) -> list[Bit]:
    return [*bits, *[0] * (width - len(bits))]


def _chosen(select: Sequence[Bit], yes: Callable[[], list[Bit]], no: Callable[[], list[Bit]]) -> list[Bit]:
    (condition,) = _any(select)
    if condition in {0, 1}:
        return yes() if condition else no()
    a, b = yes(), no()
    width = max(len(a), len(b))
    return [x if x == y else None for x, y in zip(_extended(a, width), _extended(b, width), strict=True)]


def _not(bits: Sequence[Bit]) -> list[Bit]:
    return [1 - bit if isinstance(bit, int) else None for bit in bits]


def _any(bits: Sequence[Bit]) -> list[Bit]:
    return [1 if 1 in bits else _common(bits, 0)]


def _all(bits: Sequence[Bit]) -> list[Bit]:
    return [0 if 0 in bits else _common(bits, 1)]


def _common(bits: Sequence[Bit], neutral: int) -> Bit:
    """Return the one bit that there is besides those that change nothing; unknown if there are several."""
    others = {*bits} - {neutral}
    return neutral if not others else others.pop() if len(others) == 1 else None


def _bitwise(of: Callable[[Sequence[Bit]], list[Bit]]) -> Callable[[Sequence[Bit], Sequence[Bit]], list[Bit]]:
    def combined(a: Sequence[Bit], b: Sequence[Bit]) -> list[Bit]:
        width = max(len(a), len(b))
        return [of([x, y])[0] for x, y in zip(_extended(a, width), _extended(b, width), strict=True)]

    return combined


def _equal(a: Sequence[Bit], b: Sequence[Bit]) -> list[Bit]:
    width = max(len(a), len(b))
    same: list[Bit] = [
        int(x == y) if isinstance(x, int) and isinstance(y, int) else None
        for x, y in zip(_extended(a, width), _extended(b, width), strict=True)
    ]
    return _all(same)


_UNARY = {"~": _not, "!": lambda bits: _not(_any(bits)), "|": _any, "&": _all}
_BINARY = {"|": _bitwise(_any), "&": _bitwise(_all), "==": _equal}
