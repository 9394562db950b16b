"""Which registers and inputs the logic of a netlist depends on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set

from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.reader.syntax import Bits, Choice, Expression, Joined, Load, Operator, Statement, Word


class Dependence:
    """The registers and inputs that nets, and what registers take over, depend on within a clock.

    Parameters
    ----------
    netlist : Netlist
    cuts : set of str
        Nets that are taken as inputs.
    """

    def __init__(self, netlist: Netlist, cuts: Set[str]) -> None:
        self._netlist, self._cuts = netlist, cuts
        self._reached: dict[str, frozenset[str]] = {}

    def of_net(self, name: str) -> frozenset[str]:
        """Return what a net depends on: itself, if it is a register or an input."""
        if name not in self._reached:
            drivers = None if name in self._cuts else self._netlist.drivers.get(name)
            self._reached[name] = frozenset()  # within a loop, which `Evaluation` refuses
            self._reached[name] = frozenset({name}) if drivers is None else self.of(driver.value for driver in drivers)
        return self._reached[name]

    def of(self, values: Iterable[Expression]) -> frozenset[str]:
        """Return what expressions depend on; of a memory, what its address does."""
        sources: set[str] = set()
        for value in values:
            for name in _nets(value):
                sources |= self.of_net(name)
        return frozenset(sources)

    def of_conditions(self, statements: Sequence[Statement]) -> frozenset[str]:
        """Return what it depends on whether statements load anything."""
        return self.of(_conditions(statements))

    def of_loads(self, statements: Sequence[Statement]) -> frozenset[str]:
        """Return what it depends on what statements load."""
        return self.of(_values(statements))


def _conditions(statements: Sequence[Statement]) -> list[Expression]:
    conditions: list[Expression] = []
    for statement in statements:
        if isinstance(statement, Choice):
            conditions += [statement.condition, *_conditions(statement.yes), *_conditions(statement.no)]
    return conditions


def _values(statements: Sequence[Statement]) -> list[Expression]:
    values: list[Expression] = []
    for statement in statements:
        if isinstance(statement, Load):
            values.append(statement.value)
        else:
            values += [statement.condition, *_values(statement.yes), *_values(statement.no)]
    return values


def _nets(value: Expression) -> list[str]:
    if isinstance(value, Bits):
        return [value.name]
    if isinstance(value, Word):
        return _nets(value.address)
    if isinstance(value, Joined):
        return [name for part in value.parts for name in _nets(part)]
    if isinstance(value, Operator):
        return [name for operand in value.operands for name in _nets(operand)]
    return []
