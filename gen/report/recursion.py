"""The recursion of a section as equations, read off its dataflow graph: each sum, coefficient and rounding."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.quantity import MINUS, power_of_ten
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.sections.truncated_products import constants_of

_ROUNDING = {Op.FLOOR: "⌊{}⌋", Op.TRUNCATE: "trunc({})", Op.FRACTION: "frac({})"}
_SUBSCRIPT = str.maketrans("-0123456789", "₋₀₁₂₃₄₅₆₇₈₉")


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of a section: ``integer * 2**-frac``."""

    name: str
    integer: int
    frac: int

    @property
    def words(self) -> str:
        """Integer, power of two and value."""
        power = power_of_ten(-self.frac).removeprefix("10")
        value = f"{self.integer / 2**self.frac:.10g}".replace("-", MINUS)
        return f"{self.integer:,} · 2{power} = {value}".replace("-", MINUS)


@dataclass(frozen=True)
class Term:
    """One term of a sum: ``gain * coefficient * signal``; a constant has an empty signal."""

    gain: Fraction
    coefficient: str
    signal: str


@dataclass(frozen=True)
class Equation:
    """``name = rounding(sum of terms)``; `rounding` is ``""`` or has the sum as ``{}``."""

    name: str
    terms: tuple[Term, ...]
    rounding: str = ""

    @property
    def words(self) -> str:
        """The equation in one line."""
        total = "".join(_signed(term, first=k == 0) for k, term in enumerate(self.terms)) or "0"
        return f"{self.name} = {self.rounding.format(total) if self.rounding else total}"


@dataclass(frozen=True)
class Recursion:
    """What a section computes at each sample.

    Attributes
    ----------
    section : str
        Its name.
    equations : tuple of Equation
        In the order of computation. Signals are those of this sample, but where ``(n−1)`` follows; a rounding has the
        fraction bits that it keeps, or, of ``frac``, drops.
    coefficients : tuple of Coefficient
        In the order of computation.
    """

    section: str
    equations: tuple[Equation, ...]
    coefficients: tuple[Coefficient, ...]


def recursion_of(section: str, graph: Graph) -> Recursion:
    """Write out the graph of a section."""
    return _Reader(graph).read(section)


class _Reader:
    """Reads equations off a graph: what has a name is a signal, and so is what a coefficient or a delay takes."""

    def __init__(self, graph: Graph) -> None:
        self._nodes = graph.nodes
        self._constants = constants_of(graph)
        unnamed = {Op.INPUT, Op.DELAY, Op.SCALE, Op.CONSTANT}
        self._names = {i: node.name for i, node in enumerate(graph.nodes) if node.name and node.op not in unnamed}
        self._equations: dict[int, Equation] = {}

    def read(self, section: str) -> Recursion:
        for index, name in list(self._names.items()):
            self._define(index, name)
        for node in self._nodes:
            if node.op is Op.DELAY:
                self._signal(node.operands[0])
        coefficients = {
            self._nodes[index].name: Coefficient(_coefficient_name(self._nodes[index].name, index), by.integer, by.frac)
            for index, by in self._constants.items()
        }
        ordered = sorted(self._equations.items())
        return Recursion(section, tuple(equation for _, equation in ordered), tuple(coefficients.values()))

    def _define(self, index: int, name: str) -> None:
        """Make the node a signal with an equation of its own."""
        if index in self._equations:
            return
        inner = index
        while self._nodes[inner].op is Op.BOUND:
            inner = self._nodes[inner].operands[0]
        self._names[index] = name
        node = self._nodes[inner]
        terms: tuple[Term, ...]
        if inner != index and inner in self._names:
            terms, rounding = (Term(Fraction(1), "", self._names[inner]),), ""
        elif node.op in _ROUNDING:
            terms, rounding = self._terms(node.operands[0]), self._rounding(inner)
        else:
            terms, rounding = self._sum(inner), ""
        self._equations[index] = Equation(name, terms, rounding)

    def _rounding(self, index: int) -> str:
        node = self._nodes[index]
        bits = node.parameter if node.op is Op.FRACTION else node.frac
        return _ROUNDING[node.op] + str(bits).translate(_SUBSCRIPT)

    def _terms(self, index: int) -> tuple[Term, ...]:
        """Return a node as a sum of signals."""
        node = self._nodes[index]
        if index in self._names or node.op in {Op.INPUT, Op.DELAY}:
            return (Term(Fraction(1), "", self._signal(index)),)
        return self._sum(index)

    def _sum(self, index: int) -> tuple[Term, ...]:
        node = self._nodes[index]
        first = node.operands[0] if node.operands else index
        if node.op is Op.ADD or node.op is Op.SUBTRACT:
            sign = 1 if node.op is Op.ADD else -1
            return _collected([*self._terms(first), *_times(self._terms(node.operands[1]), Fraction(sign))])
        if node.op is Op.SHIFT:
            return _times(self._terms(first), Fraction(2) ** node.parameter)
        if node.op is Op.BOUND:
            return self._terms(first)
        if node.op is Op.CONSTANT:
            return (Term(node.parameter * Fraction(2) ** -node.frac, "", ""),)
        if node.op is Op.SCALE:
            return (Term(Fraction(1), _coefficient_name(node.name, index), self._signal(first)),)
        return (Term(Fraction(1), "", self._signal(index)),)

    def _signal(self, index: int) -> str:
        """Return the name of a signal, and define what has none."""
        node = self._nodes[index]
        if index in self._names:
            return self._names[index]
        if node.op is Op.INPUT:
            return node.name
        if node.op is Op.DELAY:
            return _earlier(self._source(node.operands[0], node.name))
        if node.op in _ROUNDING and self._is_signal(node.operands[0]):
            return self._rounding(index).format(self._signal(node.operands[0]))
        self._define(index, f"w{index}")
        return self._names[index]

    def _is_signal(self, index: int) -> bool:
        return index in self._names or self._nodes[index].op in {Op.INPUT, Op.DELAY}

    def _source(self, index: int, name: str) -> str:
        """Return the name of what a delay takes; without one it gets that of the delay."""
        node = self._nodes[index]
        if node.op is Op.BOUND and index not in self._names and not node.name:
            return self._source(node.operands[0], name)
        if node.name and node.op is not Op.DELAY:
            return node.name
        if node.op in {Op.INPUT, Op.DELAY}:
            return self._signal(index)
        if index not in self._names:
            self._define(index, name)
        return self._names[index]


def _coefficient_name(name: str, index: int) -> str:
    return name.removeprefix("product_") or f"c{index}"


def _earlier(signal: str) -> str:
    """Return the name of a signal one sample before."""
    name, _, delay = signal.partition(f"(n{MINUS}")
    return f"{name}(n{MINUS}{int(delay.rstrip(')') or 0) + 1})"


def _times(terms: tuple[Term, ...], gain: Fraction) -> tuple[Term, ...]:
    return tuple(Term(term.gain * gain, term.coefficient, term.signal) for term in terms)


def _collected(terms: list[Term]) -> tuple[Term, ...]:
    """Add up what differs in its gain only."""
    gains: dict[tuple[str, str], Fraction] = {}
    for term in terms:
        key = (term.coefficient, term.signal)
        gains[key] = gains.get(key, Fraction(0)) + term.gain
    return tuple(Term(gain, *key) for key, gain in gains.items() if gain)


def gain_words(gain: Fraction) -> str:
    """Return a gain without its sign: a whole number, or a fraction with a slash."""
    size = abs(gain)
    return f"{size.numerator:,}" if size.denominator == 1 else f"{size.numerator:,}/{size.denominator:,}"


def _signed(term: Term, *, first: bool) -> str:
    sign = (MINUS if first else f" {MINUS} ") if term.gain < 0 else ("" if first else " + ")
    factors = [] if abs(term.gain) == 1 and term.signal else [gain_words(term.gain)]
    return sign + " · ".join([*factors, *filter(None, (term.coefficient, term.signal))])
