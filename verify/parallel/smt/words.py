"""What the logic of a netlist is, as bit vectors: widths and signs as IEEE 1800 has them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.parallel.smt.script import Script, Term, chosen, cut, joined, number, sized
from sosmith.verify.reader.syntax import Bits, Choice, Expression, Joined, Load, Number, Operator, Statement
from sosmith.verify.reader.widths import is_signed

_CONTEXT = {"+": "bvadd", "-": "bvsub", "*": "bvmul", "&": "bvand", "|": "bvor", "^": "bvxor"}
_COMPARED = {"<": "lt", ">": "gt", "<=": "le", ">=": "ge"}


class Words:
    """The values of all nets, where registers and inputs hold what `content` says.

    Parameters
    ----------
    netlist : Netlist
    script : Script
    content : callable
        What a register or an input holds, and the nets in `cuts`.
    cuts : frozenset of str
        Nets that are not followed.
    """

    def __init__(
        self, netlist: Netlist, script: Script, content: Callable[[str], Term], cuts: frozenset[str] = frozenset()
    ) -> None:
        self._netlist, self._script, self._content, self._cuts = netlist, script, content, cuts
        self._known: dict[str, Term] = {}
        self._open: set[str] = set()

    def following(self, statements: Sequence[Statement], before: Term) -> Term:
        """Return what a register holds after its statements, if it holds `before`."""
        for statement in statements:
            if isinstance(statement, Load):
                whole = isinstance(statement.target, Bits) and statement.target.width is None
                require(whole, "a register must be loaded as a whole")
                before = self._script.define(self._assigned(statement.value, before.width))
            else:
                assert isinstance(statement, Choice)
                yes, no = (self.following(side, before) for side in (statement.yes, statement.no))
                before = self._script.define(chosen(self._any(statement.condition), yes, no))
        return before

    def net(self, name: str) -> Term:
        """Return a net."""
        if name not in self._known:
            require(name not in self._open, f"{name} must not depend on itself within a clock")
            self._open.add(name)
            self._known[name] = self._script.define(self._net(name))
            self._open.discard(name)
        return self._known[name]

    def _net(self, name: str) -> Term:
        drivers = self._netlist.drivers.get(name)
        if drivers is None or name in self._cuts:
            require(not name.startswith("?"), "bits of x must not be used")
            return self._content(name)
        parts: list[Term] = []
        end = 0
        for driver in drivers:
            require(driver.low == end, f"bit {end} of {name} must be driven to be used")
            end = driver.low + driver.width
            parts.append(cut(self._assigned(driver.value, driver.start + driver.width), driver.start, driver.width))
        require(end == self._netlist.widths[name], f"bit {end} of {name} must be driven to be used")
        return joined(parts[::-1])

    def _assigned(self, value: Expression, width: int) -> Term:
        size = max(width, self._netlist.width(value))
        return cut(self._sized(value, size, signed=is_signed(value)), 0, width)

    def _whole(self, value: Expression) -> Term:
        return self._sized(value, self._netlist.width(value), signed=is_signed(value))

    def _sized(self, value: Expression, size: int, *, signed: bool) -> Term:
        """Return an expression in a context of `size` bits, at least its own width."""
        if isinstance(value, Operator):
            if value.symbol == "?":
                yes, no = (self._sized(of, size, signed=signed) for of in value.operands[1:])
                return self._script.define(chosen(self._any(value.operands[0]), yes, no))
            if value.symbol == "~":
                return Term(f"(bvnot {self._sized(value.operands[0], size, signed=signed).text})", size)
            if value.symbol in _CONTEXT and len(value.operands) == 2:
                a, b = (self._sized(of, size, signed=signed) for of in value.operands)
                return self._script.define(Term(f"({_CONTEXT[value.symbol]} {a.text} {b.text})", size))
        return sized(self._own(value), size, signed=signed)

    def _own(self, value: Expression) -> Term:
        """Return what no context reaches into."""
        if isinstance(value, Number):
            return number(value.value, value.width)
        if isinstance(value, Bits):
            width = self._netlist.width(value)
            return cut(self.net(value.name), value.low, width)
        if isinstance(value, Joined):
            return joined([self._whole(part) for part in value.parts])
        if not isinstance(value, Operator):
            raise RejectedError("words of memories must not be used where goals are written for solvers")
        if value.symbol == "signed":
            return self._whole(value.operands[0])
        if value.symbol in {"!", "|"} and len(value.operands) == 1:
            bit = self._any(value.operands[0])
            return Term(f"(bvnot {bit.text})", 1) if value.symbol == "!" else bit
        if value.symbol == "&" and len(value.operands) == 1:
            word = self._whole(value.operands[0])
            return Term(f"(bvcomp {word.text} {number(-1, word.width).text})", 1)
        return self._compared(value)

    def _any(self, value: Expression) -> Term:
        """Return whether an expression is not 0."""
        word = self._whole(value)
        if word.width == 1:
            return word
        return self._script.define(Term(f"(bvnot (bvcomp {word.text} {number(0, word.width).text}))", 1))

    def _compared(self, value: Operator) -> Term:
        known = value.symbol in {*_COMPARED, "==", "!="} and len(value.operands) == 2
        require(known, f"the operator {value.symbol} must be known")
        size = max(self._netlist.width(of) for of in value.operands)
        signed = all(is_signed(of) for of in value.operands)
        a, b = (self._sized(of, size, signed=signed) for of in value.operands)
        if value.symbol in {"==", "!="}:
            same = f"(bvcomp {a.text} {b.text})"
            return Term(same if value.symbol == "==" else f"(bvnot {same})", 1)
        relation = f"bv{'s' if signed else 'u'}{_COMPARED[value.symbol]}"
        return Term(f"(ite ({relation} {a.text} {b.text}) #b1 #b0)", 1)
