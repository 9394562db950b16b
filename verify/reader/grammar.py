r"""The grammar of the SystemVerilog that is read, and the layout in which it is printed.

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
number with its width, a net, bits of one, a word of a memory, ``{a, b, ..}`` or ``$signed(a)``. A number all of whose
bits are x is an operand too where what is said has to hold for any value of it; it is then a net that nothing drives.

Every token is printed again as it is taken, in one layout: what is read has been understood, and nothing else is there.
"""

from __future__ import annotations

import re

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.syntax import (
    Bits,
    Choice,
    Expression,
    Joined,
    Load,
    Module,
    Number,
    Operator,
    Statement,
    Word,
)
from sosmith.verify.reader.tokens import KEPT, UNCHECKED, Tokens

_NUMBER = re.compile(r"(\d+)'(?:h([0-9a-f]+)|d(\d+)|b([01]+))")
_UNKNOWN = re.compile(r"(\d+)'[hb]x+")
MAX_WORDS = 1 << 20
"""Words of all memories of a text: 4,096 channels with 256 each."""

_MAX_WIDTH = 1 << 13
_DEEPEST = 400
"""Blanks before a statement, at most: two for each ``if`` around it."""
_BINARY = ("+", "-", "*", "&", "|", "^", "==", "!=", "<", ">", "<=", ">=")
_UNARY = ("~", "!", "&", "|", "^")


class Reader:
    """Reads one module, and prints it.

    Parameters
    ----------
    tokens : Tokens
        Those of the text, behind the word ``module`` and the name.
    name : str
        Name of the module.
    unknowns : bool
        Whether numbers of x bits are taken: each is a net that nothing drives, whose name no net can have.

    Attributes
    ----------
    lines : list of str
        The module in its one layout.
    """

    def __init__(self, tokens: Tokens, name: str, *, unknowns: bool) -> None:
        self._tokens = tokens
        self._name = name
        self._unknowns = unknowns
        self._module = Module()
        self._kinds: dict[str, list[str]] = {}
        self._scalars: set[str] = set()
        self._start = tokens.place
        self.lines: list[str] = []

    def module(self) -> Module:
        """Read the module up to its end.

        Raises
        ------
        RejectedError
            If anything is not in the subset.
        """
        tokens = self._tokens
        tokens.expect("(")
        names = [tokens.name()]
        while tokens.take(","):
            names.append(tokens.name())
        tokens.expect(")", ";")
        self._line(0, f"module {self._name}")
        while tokens.peek() != "endmodule":
            self._item()
        tokens.expect("endmodule")
        self._line(0)
        require(
            sorted(names) == sorted(self._module.ports),
            f"the ports {', '.join(names)} must all be declared, not {', '.join(self._module.ports)}",
        )
        return self._module

    def _line(self, indent: int, before: str = "", *, declares: bool = False) -> None:
        """Print what was taken since the last line."""
        taken = self._tokens.since(self._start)
        self._start = self._tokens.place
        self.lines.append(" " * indent + before + laid_out(taken, declares=declares))

    def _named(self, name: str, kind: str) -> None:
        """Note that a name is declared as `kind`, which goes with the others it has."""
        kinds = self._kinds.setdefault(name, [])
        kinds.append(kind)
        require(
            tuple(kinds) in _TOGETHER, f"{name} must be declared once in {self._name}, not as {' and as '.join(kinds)}"
        )

    def _item(self) -> None:
        tokens, module = self._tokens, self._module
        if tokens.peek() in {"input", "output", "wire", "reg"}:
            self._declaration()
        elif tokens.take("assign"):
            target = self._operand()
            tokens.expect("=")
            module.assigns.append((target, self._expression()))
            tokens.expect(";")
            self._line(2)
        elif tokens.take("always_ff"):
            tokens.expect("@", "(", "posedge")
            clock = tokens.name()
            tokens.expect(")")
            module.clocked.append((clock, self._statements(2)))
        elif tokens.take("initial"):
            tokens.expect("begin")
            labelled = tokens.take(":")
            if labelled:
                self._named(tokens.name(), "block")
                self._line(2)
                tokens.expect("integer", "i", ";")
                self._line(4)
            else:
                self._line(2)
            while tokens.peek() != "end":
                if labelled and tokens.take("for"):
                    self._words()
                else:
                    self._word()
                self._line(4)
            tokens.expect("end")
            self._line(2)
        else:
            self._instance()

    def _declaration(self) -> None:
        tokens, module = self._tokens, self._module
        marks = tokens.marks
        kind = tokens.next()
        top = 0
        ranged = tokens.take("[")
        if ranged:
            top = tokens.integer()
            tokens.expect(":", "0", "]")
        name = tokens.name()
        known = name in module.widths
        require(
            not known or (name in self._scalars) != ranged, f"{name} must have a range in both declarations or none"
        )
        if not ranged:
            self._scalars.add(name)
        width = top + 1
        require(width <= _MAX_WIDTH, f"{name} must have at most {_MAX_WIDTH} bits, not {width}")
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
                kind = "memory"
                if UNCHECKED in marks:
                    module.unchecked.add(name)
                module.depths[name] = tokens.integer() + 1
                require(module.depths[name] <= MAX_WORDS, f"{name} must have at most {MAX_WORDS} words")
                tokens.expect(":", "0", "]")
            else:
                module.registers[name] = self._number().value if tokens.take("=") else None
        if KEPT in marks:
            require(name not in module.ports, f"{name} must be no port to be kept")
            module.kept.add(name)
        self._named(name, kind)
        tokens.expect(";")
        self._line(2, declares=True)

    def _words(self) -> None:
        tokens = self._tokens
        tokens.expect("(", "i", "=")
        first = tokens.integer()
        tokens.expect(";", "i", "<")
        end = tokens.integer()
        tokens.expect(";", "i", "=", "i", "+")
        require(tokens.integer() == 1, "a loop over words must go in steps of 1")
        tokens.expect(")")
        name = tokens.name()
        tokens.expect("[", "i", "]", "=")
        value = self._number().value
        tokens.expect(";")
        require(end - first <= MAX_WORDS, f"a loop must be over at most {MAX_WORDS} words, not {end - first}")
        self._hold(name, range(first, end), value)

    def _word(self) -> None:
        tokens = self._tokens
        name = tokens.name()
        tokens.expect("[")
        address = tokens.integer()
        tokens.expect("]", "=")
        self._hold(name, range(address, address + 1), self._number().value)
        tokens.expect(";")

    def _hold(self, name: str, addresses: range, value: int) -> None:
        module = self._module
        require(
            name in module.depths and addresses.stop <= module.depths[name],
            f"{name} must be a memory with the words {addresses.start}..{addresses.stop - 1}",
        )
        require(
            value >> module.widths[name] == 0, f"the words of {name} must have {module.widths[name]} bits, not more"
        )
        content = module.contents.setdefault(name, {})
        for address in addresses:
            require(address not in content, f"word {address} of {name} must be given once, not twice")
            content[address] = value

    def _instance(self) -> None:
        tokens = self._tokens
        module, name = tokens.name(), tokens.name()
        self._named(name, "instance")
        ports: dict[str, Expression] = {}
        tokens.expect("(")
        self._line(2, declares=True)
        while True:
            tokens.expect(".")
            port = tokens.name()
            require(port not in ports, f"the port {port} of {name} must be connected once, not twice")
            tokens.expect("(")
            ports[port] = self._operand()
            tokens.expect(")")
            more = tokens.take(",")
            self._line(4)
            if not more:
                break
        tokens.expect(")", ";")
        self._line(2)
        self._module.instances.append((module, name, ports))

    # Statements.

    def _statements(self, indent: int) -> tuple[Statement, ...]:
        """Read a statement, or those between ``begin`` and ``end``; the line that leads to them is still open."""
        tokens = self._tokens
        if not tokens.take("begin"):
            self._line(indent)
            return (self._statement(indent + 2),)
        self._line(indent)
        statements = []
        while tokens.peek() != "end":
            statements.append(self._statement(indent + 2))
        tokens.expect("end")
        if tokens.peek() != "else":
            self._line(indent)
        return tuple(statements)

    def _statement(self, indent: int) -> Statement:
        tokens = self._tokens
        require(indent < _DEEPEST, f"statements of {self._name} must not be nested as deep as that")
        if not tokens.take("if"):
            load = self._load()
            self._line(indent)
            return load
        tokens.expect("(")
        condition = self._expression()
        tokens.expect(")")
        yes = self._branch(indent)
        if not tokens.take("else"):
            return Choice(condition, yes, ())
        if tokens.peek() == "if":
            return Choice(condition, yes, (self._statement(indent),))
        return Choice(condition, yes, self._branch(indent))

    def _branch(self, indent: int) -> tuple[Statement, ...]:
        """Read a branch: a load in the same line, or statements in lines of their own."""
        if self._tokens.peek() in {"begin", "if"}:
            return self._statements(indent)
        if self._tokens.peek() in self._module.depths:
            self._line(indent)
            indent += 2
        load = self._load()
        self._line(indent)
        return (load,)

    def _load(self) -> Load:
        tokens = self._tokens
        target = self._operand()
        if not isinstance(target, Bits | Word):
            raise RejectedError("a statement must load a register or a word, not anything else")
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
        unknown = _UNKNOWN.fullmatch(tokens.peek()) if self._unknowns else None
        if unknown is not None:
            tokens.next()
            name = f"?{len(self._module.widths)}"
            self._module.widths[name] = int(unknown[1])
            return Bits(name)
        if "'" in tokens.peek():
            return self._number()
        return self._bits()

    def _bits(self) -> Bits | Word:
        tokens, widths = self._tokens, self._module.widths
        name = tokens.name()
        require(name in widths, f"{name} must be declared in {self._name} before it is used")
        if name in self._module.depths:
            tokens.expect("[")
            address: Expression = Number(tokens.integer(), 32) if tokens.peek().isdigit() else self._operand()
            tokens.expect("]")
            return Word(name, address)
        if not tokens.take("["):
            return Bits(name)
        require(name not in self._scalars, f"{name} must be used as a whole, as it has no range")
        high = low = tokens.integer()
        if tokens.take(":"):
            low = tokens.integer()
        tokens.expect("]")
        require(low <= high, f"bits of {name} must be written from high to low, not {high}:{low}")
        require(high < widths[name], f"{name} must have bit {high}, not {widths[name]} bits")
        return Bits(name, low, high - low + 1)

    def _number(self) -> Number:
        token = self._tokens.next()
        match = _NUMBER.fullmatch(token)
        if match is None:
            raise self._tokens.refused("a number with its width", token)
        digits, base = next((match[k], base) for k, base in ((2, 16), (3, 10), (4, 2)) if match[k])
        number = Number(int(digits, base), int(match[1]))
        require(number.width <= _MAX_WIDTH, f"a number must have at most {_MAX_WIDTH} bits, not {number.width}")
        require(number.value.bit_length() <= number.width, f"the number {token} must fit {number.width} bits")
        return number


_TOGETHER = {
    ("input",),
    ("output",),
    ("wire",),
    ("reg",),
    ("memory",),
    ("instance",),
    ("block",),
    ("input", "wire"),
    ("output", "wire"),
    ("output", "reg"),
}
"""As what a name may be declared: a port may be a net as well."""


def laid_out(tokens: list[str], *, declares: bool) -> str:
    """Print tokens in a line; `declares` says whether a bracket behind a name is that of a memory or of ports."""
    text, last = "", ""
    inside: list[str] = []
    for token in tokens:
        text += ("" if _joined(last, token, "[" in inside[-1:], declares=declares) else " ") + token
        if token in _OPENING:
            inside.append(token)
        elif token in _CLOSING and inside:
            inside.pop()
        last = token
    return text


_OPENING, _CLOSING = {"(", "[", "{"}, {")", "]", "}"}


def _joined(last: str, token: str, index: bool, *, declares: bool) -> bool:
    """Whether a token follows the last one without a blank; `index` says that it stands between brackets."""
    if (
        not last
        or (index and token != "{")
        or token in {",", ";", ")", "]"}
        or last in {"(", "[", "!", "$signed", ".", "@"}
    ):
        return True
    if token == "(":
        return last not in {"if", "for"} and not declares
    return token == "[" and not declares
