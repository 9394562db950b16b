"""Splits registers that take over several words side by side, as those of an output buffer do, into one for each.

::

    always_ff @(posedge clk)                            always_ff @(posedge clk)
      if (e) o_data <= { flag, y[9], y[9], y };           if (e) o_data[12] <= flag;
                                                        always_ff @(posedge clk)
                                                          if (e) o_data[11:0] <= { y[9], y[9], y };
                                                        assign o_data = { o_data[12], o_data[11:0] };

Every bit is the same at every clock. So each word is a form of its own, and no word has to be found again in a sum of
them all, where it would be the rest of a division.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import replace
from itertools import pairwise
from typing import TypeGuard

from sosmith.verify.parallel.netlist import Netlist, Register, bits_name, retargeted
from sosmith.verify.reader.syntax import Bits, Expression, Joined, Load, Number, Operator, Statement

_FOLLOWED = 4
"""Most nets that are followed one after the other: from the output buffer there is one."""


def split(netlist: Netlist, kept: Set[str]) -> Netlist:
    """Return the netlist with several registers in place of each that takes over words side by side.

    Parameters
    ----------
    netlist : Netlist
    kept : set of str
        Registers that stay whole.

    Returns
    -------
    Netlist
        Its `fields` say which registers are new.
    """
    edges = _Edges(netlist, kept).cuts()
    cut = replace(
        netlist,
        widths=dict(netlist.widths),
        drivers=dict(netlist.drivers),
        registers=dict(netlist.registers),
        fields=dict(netlist.fields),
    )
    for name, cuts in edges.items():
        register = cut.registers.pop(name)
        for low, high in pairwise((0, *sorted(cuts), register.width)):
            width = high - low
            first = None if register.first is None else register.first >> low & ((1 << width) - 1)
            statements = _sliced_all(netlist, register.statements, low, width)
            own = bits_name(name, low, width)
            cut.add_field(name, Register(own, width, first, retargeted(statements, own)), low)
    return cut


def sliced(netlist: Netlist, value: Expression, low: int, width: int, followed: int = _FOLLOWED) -> Expression | None:
    """Return bits of an expression without what is computed for others; None if that cannot be said.

    Nets that are nothing but words side by side, or one of several such, are followed to these, so many of them one
    after the other.
    """
    if isinstance(value, Number):
        return Number(value.value >> low & ((1 << width) - 1), width)
    if isinstance(value, Bits):
        driver = _whole(netlist, value) if followed else None
        inside = None
        if driver is not None and (isinstance(driver, Joined) or _is_choice(driver)):
            inside = sliced(netlist, driver, value.low + low, width, followed - 1)
        return inside or Bits(value.name, value.low + low, width)
    if isinstance(value, Joined):
        return _sliced_parts(netlist, value, low, width, followed)
    if _is_choice(value) and _alike(netlist, value):
        condition, *sides = value.operands
        yes, no = (sliced(netlist, side, low, width, followed) for side in sides)
        return None if yes is None or no is None else Operator("?", (condition, yes, no))
    return None


def _sliced_parts(netlist: Netlist, value: Joined, low: int, width: int, followed: int) -> Expression | None:
    parts: list[Expression] = []
    at = 0
    for part in reversed(value.parts):
        own = netlist.width(part)
        first, last = max(low, at), min(low + width, at + own)
        if first < last:
            bits = sliced(netlist, part, first - at, last - first, followed)
            if bits is None and last - first < own:
                return None
            parts.append(bits or part)
        at += own
    return parts[0] if len(parts) == 1 else Joined(tuple(reversed(parts)))


def _can_be_sliced(netlist: Netlist, value: Expression) -> bool:
    """Whether any bits of an expression can be said."""
    if isinstance(value, Joined):
        return all(_can_be_sliced(netlist, part) for part in value.parts)
    if _is_choice(value):
        return _alike(netlist, value) and all(_can_be_sliced(netlist, side) for side in value.operands[1:])
    return isinstance(value, Number | Bits)


def _alike(netlist: Netlist, value: Operator) -> bool:
    """Whether the sides of a choice have the same width, so that neither is extended."""
    return netlist.width(value.operands[1]) == netlist.width(value.operands[2])


def _is_choice(value: Expression) -> TypeGuard[Operator]:
    return isinstance(value, Operator) and value.symbol == "?"


def _whole(netlist: Netlist, value: Bits) -> Expression | None:
    """Return the expression that drives a net, if there is one for all its bits and of its width."""
    drivers = netlist.drivers.get(value.name, ())
    width = netlist.widths[value.name]
    if len(drivers) != 1 or (drivers[0].low, drivers[0].start, drivers[0].width) != (0, 0, width):
        return None
    return drivers[0].value if netlist.width(drivers[0].value) == width else None


def _sliced_all(netlist: Netlist, statements: Sequence[Statement], low: int, width: int) -> tuple[Statement, ...]:
    sliced_statements: list[Statement] = []
    for statement in statements:
        if isinstance(statement, Load):
            value = sliced(netlist, statement.value, low, width)
            assert value is not None  # `_Edges` has asked
            sliced_statements.append(replace(statement, value=value))
        else:
            yes, no = (_sliced_all(netlist, side, low, width) for side in (statement.yes, statement.no))
            sliced_statements.append(replace(statement, yes=yes, no=no))
    return tuple(sliced_statements)


class _Edges:
    """Finds where registers are to be cut: between words of different nets, and where what they take over is cut."""

    def __init__(self, netlist: Netlist, kept: Set[str]) -> None:
        self._netlist = netlist
        loads = {name: list(_loaded(register.statements)) for name, register in netlist.registers.items()}
        self._loads = {
            name: values
            for name, values in loads.items()
            if name not in kept
            and all(netlist.width(value) == netlist.widths[name] and _can_be_sliced(netlist, value) for value in values)
        }
        self._cuts: dict[str, frozenset[int]] = {}
        self._known: dict[str, frozenset[int]] = {}

    def cuts(self) -> dict[str, frozenset[int]]:
        """Return the bits at which registers are to be cut, for those that are."""
        while True:
            self._known = {}
            cuts = {name: self._all(values) for name, values in self._loads.items()}
            cuts = {name: where for name, where in cuts.items() if where}
            if cuts == self._cuts:
                return cuts
            self._cuts = cuts

    def _all(self, values: Iterable[Expression]) -> frozenset[int]:
        return frozenset[int]().union(*(self._of(value) for value in values))

    def _of(self, value: Expression) -> frozenset[int]:
        """Return the bits at which an expression is cut."""
        if isinstance(value, Bits):
            width = self._netlist.width(value)
            return frozenset(at - value.low for at in self._of_net(value) if 0 < at - value.low < width)
        if isinstance(value, Joined):
            return frozenset(self._of_parts(value))
        if _is_choice(value):
            return self._all(value.operands[1:])
        return frozenset()

    def _of_parts(self, value: Joined) -> Iterator[int]:
        """Yield where words end: a part that repeats bits of the one below, or goes on with them, is of its word."""
        at, net, end = 0, "", 0
        for part in reversed(value.parts):
            width = self._netlist.width(part)
            if isinstance(part, Bits) and part.name == net and part.low <= end:
                end = max(end, part.low + width)
            elif not isinstance(part, Number):
                if net:
                    yield at
                net, end = (part.name, part.low + width) if isinstance(part, Bits) else ("{}", 0)
            yield from (at + inside for inside in self._of(part))
            at += width

    def _of_net(self, value: Bits) -> frozenset[int]:
        if value.name in self._loads:
            return self._cuts.get(value.name, frozenset())
        if value.name not in self._known:
            self._known[value.name] = frozenset()  # within a loop, which `Evaluation` refuses
            driver = _whole(self._netlist, value)
            self._known[value.name] = frozenset() if driver is None else self._of(driver)
        return self._known[value.name]


def _loaded(statements: Sequence[Statement]) -> Iterator[Expression]:
    for statement in statements:
        if isinstance(statement, Load):
            yield statement.value
        else:
            yield from _loaded(statement.yes)
            yield from _loaded(statement.no)
