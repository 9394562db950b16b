r"""Reads the SystemVerilog of a core: modules of nets, assignments, registers, memories and instances.

The subset is what the generator writes, and each construct means what IEEE 1800 says. Anything else is refused::

    module NAME(port, ..);
      input|output|wire|reg [n:0] name;  reg [n:0] name = 4'h0;  reg [n:0] name [last:0];
      assign target = expression;
      always_ff @(posedge clock) if (..) register <= expression; else ..
      initial begin name[0] = 4'h0; .. end
      initial begin : label integer i; for (i = 0; i < 8; i = i + 1) name[i] = 4'h0; .. end
      MODULE instance (.port(expression), ..);
    endmodule

An expression is an operand, one operator with its operands, or a choice ``a ? b : c`` of operands. An operand is a
number with its width, a net, bits of one, a word of a memory, ``{a, b, ..}`` or ``$signed(a)``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from sosmith.verify.graph import RejectedError, require


@dataclass(frozen=True)
class Number:
    """A constant: a value, and its width in bits."""

    value: int
    width: int


@dataclass(frozen=True)
class Bits:
    """Bits of a net, from `low` on; without a width, all of it."""

    name: str
    low: int = 0
    width: int | None = None


@dataclass(frozen=True)
class Word:
    """A word of a memory."""

    name: str
    address: Expression


@dataclass(frozen=True)
class Joined:
    """A concatenation; the first part is the highest."""

    parts: tuple[Expression, ...]


@dataclass(frozen=True)
class Operator:
    """An operator with its operands.

    `symbol` is ``signed``, ``?``, a binary operator, or ``~``, ``!``, ``&``, ``|`` with one operand.
    """

    symbol: str
    operands: tuple[Expression, ...]


Expression = Number | Bits | Word | Joined | Operator


@dataclass(frozen=True)
class Load:
    """A non-blocking assignment."""

    target: Bits | Word
    value: Expression


@dataclass(frozen=True)
class Choice:
    """A statement ``if``."""

    condition: Expression
    yes: tuple[Statement, ...]
    no: tuple[Statement, ...]


Statement = Load | Choice


@dataclass
class Module:
    """A module as written.

    Attributes
    ----------
    ports : dict of str to str
        Direction of each port.
    widths : dict of str to int
        Width of each net, and of a word of each memory.
    registers : dict of str to int or None
        What each register holds before the first clock; None if that is not said.
    depths : dict of str to int
        Number of words of each memory.
    held : dict of str to dict of int to int
        What the words of each memory hold before the first clock.
    assigns : list
        Targets and expressions.
    clocked : list
        Clock, and the statements executed at its rising edge.
    instances : list
        Module, name, and the expression at each port.
    """

    ports: dict[str, str] = field(default_factory=dict)
    widths: dict[str, int] = field(default_factory=dict)
    registers: dict[str, int | None] = field(default_factory=dict)
    depths: dict[str, int] = field(default_factory=dict)
    held: dict[str, dict[int, int]] = field(default_factory=dict)
    assigns: list[tuple[Expression, Expression]] = field(default_factory=list)
    clocked: list[tuple[str, tuple[Statement, ...]]] = field(default_factory=list)
    instances: list[tuple[str, str, dict[str, Expression]]] = field(default_factory=list)


def read_modules(text: str) -> dict[str, Module]:
    """Read all modules of a text; the first is the top.

    Raises
    ------
    RejectedError
        If the text has anything that is not in the subset.
    """
    require(text.isascii(), "the SystemVerilog must be ASCII")
    tokens = _Tokens(text)
    modules: dict[str, Module] = {}
    while tokens.peek():
        tokens.expect("module")
        name = tokens.name()
        require(name not in modules, f"module {name} must be written once, not twice")
        try:
            modules[name] = _Reader(tokens).module()
        except RecursionError:
            raise RejectedError(f"expressions and statements of {name} must not be nested as deep as that") from None
    require(bool(modules), "the text must have a module")
    return modules


_TOKEN = re.compile(
    r"""/\*.*?\*/ | //[^\n]* | \(\*(?!\)).*?\*\)            # left out: comments and attributes
      | (?P<token>\\\S+ | [A-Za-z_$][\w$]* | \d+'[a-z]+[0-9a-fxz]+ | \d+ | <= | >= | == | != | << | >> | [^\s\w])""",
    re.VERBOSE | re.DOTALL,
)
_NUMBER = re.compile(r"(\d+)'(?:h([0-9a-f]+)|d(\d+)|b([01]+))")
_MAX_WORDS = 1 << 24
_BINARY = ("+", "-", "*", "&", "|", "^", "==", "!=", "<", ">", "<=", ">=")
_UNARY = ("~", "!", "&", "|")


class _Tokens:
    """The tokens of a text, one after the other."""

    def __init__(self, text: str) -> None:
        self._tokens = [found["token"] for found in _TOKEN.finditer(text) if found["token"]]
        self._at = 0

    def peek(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def next(self) -> str:
        self._at += 1
        return self._tokens[self._at - 1] if self._at <= len(self._tokens) else ""

    def take(self, token: str) -> bool:
        found = self.peek() == token
        self._at += found
        return found

    def expect(self, token: str) -> None:
        found = self.next()
        if found != token:
            raise self.refused(token, found)

    def name(self) -> str:
        token = self.next()
        if not (token.startswith("\\") or re.match(r"[A-Za-z_]", token)):
            raise self.refused("a name", token)
        return token.removeprefix("\\")

    def integer(self) -> int:
        token = self.next()
        if not token.isdigit():
            raise self.refused("an integer", token)
        return int(token)

    def refused(self, wanted: str, found: str) -> RejectedError:
        before = " ".join(self._tokens[max(self._at - 6, 0) : self._at - 1])
        return RejectedError(f"the SystemVerilog must have {wanted} after {before!r}, not {found!r}")


class _Reader:
    """Reads one module."""

    def __init__(self, tokens: _Tokens) -> None:
        self._tokens = tokens
        self._module = Module()

    def module(self) -> Module:
        tokens = self._tokens
        tokens.expect("(")
        names = [tokens.name()]
        while tokens.take(","):
            names.append(tokens.name())
        tokens.expect(")")
        tokens.expect(";")
        while not tokens.take("endmodule"):
            self._item()
        require(
            sorted(names) == sorted(self._module.ports),
            f"the ports {', '.join(names)} must all be declared, not {', '.join(self._module.ports)}",
        )
        return self._module

    def _item(self) -> None:
        tokens, module = self._tokens, self._module
        if tokens.peek() in {"input", "output", "wire", "reg"}:
            self._declaration()
        elif tokens.take("assign"):
            target = self._operand()
            tokens.expect("=")
            module.assigns.append((target, self._expression()))
            tokens.expect(";")
        elif tokens.take("always_ff"):
            for token in ("@", "(", "posedge"):
                tokens.expect(token)
            clock = tokens.name()
            tokens.expect(")")
            module.clocked.append((clock, self._statements()))
        elif tokens.take("initial"):
            tokens.expect("begin")
            if tokens.take(":"):
                tokens.name()
                for token in ("integer", "i", ";"):
                    tokens.expect(token)
            while not tokens.take("end"):
                if tokens.take("for"):
                    self._words()
                else:
                    self._word()
        else:
            self._instance()

    def _declaration(self) -> None:
        tokens, module = self._tokens, self._module
        kind = tokens.next()
        top = 0
        if tokens.take("["):
            top = tokens.integer()
            self._colon_zero()
        name = tokens.name()
        width = top + 1
        require(
            module.widths.setdefault(name, width) == width,
            f"{name} must have one width, not both {module.widths[name]} and {width}",
        )
        if kind in {"input", "output"}:
            require(name not in module.ports, f"the port {name} must be declared once, not twice")
            module.ports[name] = kind
        if kind == "reg":
            require(name not in module.registers, f"{name} must be declared once, not twice")
            if tokens.take("["):
                module.depths[name] = tokens.integer() + 1
                self._colon_zero()
            else:
                module.registers[name] = self._number().value if tokens.take("=") else None
        tokens.expect(";")

    def _colon_zero(self) -> None:
        self._tokens.expect(":")
        self._tokens.expect("0")
        self._tokens.expect("]")

    def _words(self) -> None:
        tokens = self._tokens

        def expect(*words: str) -> None:
            for token in words:
                tokens.expect(token)

        expect("(", "i", "=")
        first = tokens.integer()
        expect(";", "i", "<")
        end = tokens.integer()
        expect(";", "i", "=", "i", "+")
        require(tokens.integer() == 1, "a loop over words must go in steps of 1")
        expect(")")
        name = tokens.name()
        expect("[", "i", "]", "=")
        value = self._number().value
        expect(";")
        require(end - first <= _MAX_WORDS, f"a loop must be over at most {_MAX_WORDS} words, not {end - first}")
        held = self._module.held.setdefault(name, {})
        for address in range(first, end):
            require(address not in held, f"word {address} of {name} must be given once, not twice")
            held[address] = value

    def _word(self) -> None:
        tokens = self._tokens
        name = tokens.name()
        tokens.expect("[")
        address = tokens.integer()
        tokens.expect("]")
        tokens.expect("=")
        held = self._module.held.setdefault(name, {})
        require(address not in held, f"word {address} of {name} must be given once, not twice")
        held[address] = self._number().value
        tokens.expect(";")

    def _instance(self) -> None:
        tokens = self._tokens
        module, name = tokens.name(), tokens.name()
        ports: dict[str, Expression] = {}
        tokens.expect("(")
        while True:
            tokens.expect(".")
            port = tokens.name()
            require(port not in ports, f"the port {port} of {name} must be connected once, not twice")
            tokens.expect("(")
            ports[port] = self._operand()
            tokens.expect(")")
            if not tokens.take(","):
                break
        tokens.expect(")")
        tokens.expect(";")
        self._module.instances.append((module, name, ports))

    # Statements.

    def _statements(self) -> tuple[Statement, ...]:
        tokens = self._tokens
        if not tokens.take("begin"):
            return (self._statement(),)
        return tuple(self._until_end())

    def _until_end(self) -> Iterator[Statement]:
        while not self._tokens.take("end"):
            yield self._statement()

    def _statement(self) -> Statement:
        tokens = self._tokens
        if tokens.take("if"):
            tokens.expect("(")
            condition = self._expression()
            tokens.expect(")")
            yes = self._statements()
            return Choice(condition, yes, self._statements() if tokens.take("else") else ())
        target = self._operand()
        require(isinstance(target, Bits | Word), "a statement must load a register or a word, not anything else")
        assert isinstance(target, Bits | Word)
        tokens.expect("<=")
        value = self._expression()
        tokens.expect(";")
        return Load(target, value)

    # Expressions.

    def _expression(self) -> Expression:
        tokens = self._tokens
        if tokens.peek() in _UNARY:
            return Operator(tokens.next(), (self._operand(),))
        first = self._operand()
        if tokens.take("?"):
            yes = self._operand()
            tokens.expect(":")
            return Operator("?", (first, yes, self._operand()))
        if tokens.peek() in _BINARY:
            return Operator(tokens.next(), (first, self._operand()))
        return first

    def _operand(self) -> Expression:
        tokens = self._tokens
        if tokens.take("{"):
            parts = [self._operand()]
            while tokens.take(","):
                parts.append(self._operand())
            tokens.expect("}")
            return Joined(tuple(parts))
        if tokens.take("$signed"):
            tokens.expect("(")
            of = self._operand()
            tokens.expect(")")
            return Operator("signed", (of,))
        if "'" in tokens.peek():
            return self._number()
        return self._bits()

    def _bits(self) -> Bits | Word:
        tokens = self._tokens
        name = tokens.name()
        if name in self._module.depths:
            tokens.expect("[")
            address: Expression = Number(tokens.integer(), 32) if tokens.peek().isdigit() else self._operand()
            tokens.expect("]")
            return Word(name, address)
        if not tokens.take("["):
            return Bits(name)
        high = low = tokens.integer()
        if tokens.take(":"):
            low = tokens.integer()
        tokens.expect("]")
        require(low <= high, f"bits of {name} must be written from high to low, not {high}:{low}")
        return Bits(name, low, high - low + 1)

    def _number(self) -> Number:
        token = self._tokens.next()
        found = _NUMBER.fullmatch(token)
        if found is None:
            raise self._tokens.refused("a number with its width", token)
        digits, base = next((found[k], base) for k, base in ((2, 16), (3, 10), (4, 2)) if found[k])
        number = Number(int(digits, base), int(found[1]))
        require(number.value.bit_length() <= number.width, f"the number {token} must fit {number.width} bits")
        return number
