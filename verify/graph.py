"""Checks a certificate's dataflow graphs on their own, and reads transfer functions off them by determinants.

This shares no code with the module that builds the graphs (`sosmith.model.dataflow.graph`) or with the linear models
that word lengths are chosen from (`sosmith.gen.proof.linear_model`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from flint import fmpq, fmpq_mat, fmpq_poly

from sosmith.model.errors import ShortfallError
from sosmith.verify.certificate_file import NodeEntry, Operation, StageEntry

Interval = tuple[int, int]
"""Smallest and largest code."""


class RejectedError(ShortfallError):
    """A certificate does not prove what it claims."""


def require(condition: bool, message: str) -> None:
    """Reject the certificate with `message` unless `condition` holds."""
    if not condition:
        raise RejectedError(message)


_MOST_TERMS, _MOST_FACTORS = 1 << 14, 64
"""Of a product of polynomials: far more than a calibration or a section has."""


def check_product(terms: int, factors: int) -> None:
    """Reject a product of polynomials that nothing could be proven of in a bearable time.

    `terms` is the product of the numbers of their terms, `factors` the degree of the result.
    """
    require(terms <= _MOST_TERMS, f"a product must have at most {_MOST_TERMS} terms, not {terms}")
    require(factors <= _MOST_FACTORS, f"a product must have at most {_MOST_FACTORS} factors, not {factors}")


def label(stage: StageEntry, index: int) -> str:
    """Name of a node, for messages."""
    node = stage.nodes[index]
    return f"node {index} ({f'{node.op.value} {node.name}'.strip()}) of {stage.name}"


def inputs_of(stage: StageEntry) -> list[int]:
    """Return the indices of the stage's inputs, in order."""
    return [index for index, node in enumerate(stage.nodes) if node.op is Operation.INPUT]


_OPERANDS = {
    Operation.INPUT: 0,
    Operation.CONSTANT: 0,
    Operation.ADD: 2,
    Operation.SUBTRACT: 2,
    Operation.MULTIPLY: 2,
}
"""Numbers of operands; all other operations take one."""

_PARAMETERS = {Operation.CONSTANT: 1, Operation.SHIFT: 1, Operation.FRACTION: 1, Operation.SCALE: 2}
"""How many of `parameter`, `parameter_frac` an operation uses; all other operations use none."""


def check_graph(stage: StageEntry) -> None:
    """Check that a stage can be computed in the order of its nodes, and that each range follows from earlier ones.

    The range of an INPUT is checked where stages meet. For a BOUND, only that it lies within its operand's range is
    checked here; the rest is checked where it is proven.

    Raises
    ------
    RejectedError
        If a node refers to one that is not computed yet, or its format or range does not follow from its operands.
    """
    for index, node in enumerate(stage.nodes):
        name = label(stage, index)
        wanted = _OPERANDS.get(node.op, 1)
        require(len(node.operands) == wanted, f"{name} must have {wanted} operands, not {len(node.operands)}")
        last = len(stage.nodes) if node.op is Operation.DELAY else index
        require(all(i < last for i in node.operands), f"{name} must have operands before it, not {node.operands}")
        unused = (node.parameter, node.parameter_frac)[_PARAMETERS.get(node.op, 0) :]
        require(not any(unused), f"{name} must have no parameter that it does not use, not {unused}")
        require(node.low <= node.high, f"{name} must have a range that rises, not {node.low}..{node.high}")
    for index, node in enumerate(stage.nodes):
        name = label(stage, index)
        if node.operands:
            frac, low, high = _expected(stage, node, name)
            require(node.frac == frac, f"{name} must have {frac} fraction bits, not {node.frac}")
            require(
                (node.low, node.high) == (low, high),
                f"{name} must have the range {low}..{high}, not {node.low}..{node.high}",
            )
        elif node.op is Operation.CONSTANT:
            require(
                node.low == node.high == node.parameter,
                f"{name} must have the range of its value {node.parameter}, not {node.low}..{node.high}",
            )
    require(
        all(index < len(stage.nodes) for index in stage.outputs),
        f"outputs of {stage.name} must be nodes of it, not {stage.outputs}",
    )


def _expected(stage: StageEntry, node: NodeEntry, name: str) -> tuple[int, int, int]:
    """Fraction bits and range that a node must have."""
    operands = [stage.nodes[i] for i in node.operands]
    if node.op is Operation.DELAY:
        return operands[0].frac, *_delayed(stage, node)
    if node.op is Operation.BOUND:
        (of,) = operands
        require(
            of.low <= node.low and node.high <= of.high,
            f"{name} must have a range within {of.low}..{of.high}, not {node.low}..{node.high}",
        )
        return of.frac, node.low, node.high
    if node.op in {Operation.FLOOR, Operation.FRACTION, Operation.TRUNCATE}:
        dropped = operands[0].frac - _kept(node)
        require(dropped > 0, f"{name} must drop at least one bit, not {dropped}")
        return _dropped_bits(node, operands[0], dropped)
    return _RULES[node.op](node, operands)


def _delayed(stage: StageEntry, node: NodeEntry) -> Interval:
    """Range of a delay: that of its source, extended to contain the zero of reset.

    A wider range does no harm. It is accepted where interval arithmetic gives the source a tighter limit than the
    one that was proven.
    """
    source = stage.nodes[node.operands[0]]
    low, high = min(source.low, 0), max(source.high, 0)
    if source.op not in {Operation.INPUT, Operation.DELAY}:
        inner = stage.nodes[source.operands[0]] if source.op is Operation.BOUND else source
        low = min(low, node.low) if source.low == inner.low else low
        high = max(high, node.high) if source.high == inner.high else high
    return low, high


def _aligned(operands: Sequence[NodeEntry]) -> tuple[int, list[Interval]]:
    frac = max(of.frac for of in operands)
    return frac, [(of.low << (frac - of.frac), of.high << (frac - of.frac)) for of in operands]


def _add(_node: NodeEntry, operands: Sequence[NodeEntry]) -> tuple[int, int, int]:
    frac, ((al, ah), (bl, bh)) = _aligned(operands)
    return frac, al + bl, ah + bh


def _subtract(_node: NodeEntry, operands: Sequence[NodeEntry]) -> tuple[int, int, int]:
    frac, ((al, ah), (bl, bh)) = _aligned(operands)
    return frac, al - bh, ah - bl


def _scale(node: NodeEntry, operands: Sequence[NodeEntry]) -> tuple[int, int, int]:
    (of,) = operands
    ends = (of.low * node.parameter, of.high * node.parameter)
    return of.frac + node.parameter_frac, min(ends), max(ends)


def _multiply(_node: NodeEntry, operands: Sequence[NodeEntry]) -> tuple[int, int, int]:
    a, b = operands
    ends = [x * y for x in (a.low, a.high) for y in (b.low, b.high)]
    return a.frac + b.frac, min(ends), max(ends)


_RULES: Mapping[Operation, Callable[[NodeEntry, Sequence[NodeEntry]], tuple[int, int, int]]] = {
    Operation.ADD: _add,
    Operation.SUBTRACT: _subtract,
    Operation.SHIFT: lambda node, operands: (operands[0].frac - node.parameter, operands[0].low, operands[0].high),
    Operation.SCALE: _scale,
    Operation.MULTIPLY: _multiply,
    Operation.CLAMP: lambda node, operands: (operands[0].frac, node.low, node.high),
}


def _kept(node: NodeEntry) -> int:
    return node.parameter if node.op is Operation.FRACTION else node.frac


def _dropped_bits(node: NodeEntry, of: NodeEntry, count: int) -> tuple[int, int, int]:
    step = 1 << count
    if node.op is Operation.FRACTION:
        return of.frac, 0, step - 1
    ends = [Fraction(of.low, step), Fraction(of.high, step)]
    if node.op is Operation.FLOOR:
        return node.frac, ends[0].__floor__(), ends[1].__floor__()
    return node.frac, int(ends[0]), int(ends[1])


Source = tuple[Operation, int, int]
"""What drives a stage: (INPUT, node, 0), (CONSTANT, node, 0), or a quantization error: (FLOOR or TRUNCATE, the
undelayed node that is quantized, fraction bits kept). All quantizers of one node that keep the same bits are one
source."""

_State = int
_Form = dict["_State | tuple[Source, int]", fmpq]
"""A value as a sum over states (by index of the DELAY) and sources (with a delay in samples)."""


@dataclass(frozen=True)
class Transfer:
    """Exact transfer functions of a linear stage; every polynomial is in ``w = z**-1``.

    Attributes
    ----------
    stage : StageEntry
        The stage, checked by `check_graph`.
    """

    stage: StageEntry

    @cached_property
    def sources(self) -> dict[Source, tuple[Fraction, Fraction]]:
        """Every source with the range of its values; the inputs come first."""
        nodes = self.stage.nodes
        ranges: dict[Source, tuple[Fraction, Fraction]] = {}
        for form in self._forms:
            for key in form:
                if isinstance(key, tuple):
                    (op, index, kept), _ = key
                    unit = Fraction(2) ** -nodes[index].frac
                    if op in {Operation.INPUT, Operation.CONSTANT}:
                        ranges[key[0]] = nodes[index].low * unit, nodes[index].high * unit
                    else:
                        most = (2 ** (nodes[index].frac - kept) - 1) * unit
                        ranges[key[0]] = (Fraction(0) if op is Operation.FLOOR else -most), most
        return dict(sorted(ranges.items(), key=lambda item: item[0][0] is not Operation.INPUT))

    @property
    def inputs(self) -> list[Source]:
        """The stage's inputs as sources, in order."""
        return [(Operation.INPUT, index, 0) for index in inputs_of(self.stage)]

    @cached_property
    def denominator(self) -> fmpq_poly:
        """``det(I - w A)`` for the state matrix A; 1 without recursion."""
        return _reversed_characteristic(self.matrix) if self._in_order is None else fmpq_poly([1])

    def numerator(self, source: Source, node: int) -> fmpq_poly:
        """Numerator from `source` to `node`, over `denominator`.

        With the states ``s = w (A s + b u)`` and the node ``c s + d u`` it is ``det(I - w A + w b c) + (d - 1)
        det(I - w A)``, by the matrix determinant lemma. A source that enters with several delays contributes one such
        term for each. Without recursion, each state has its own numerator, from those that it follows.
        """
        if self._in_order is not None:
            return self._from(source, self._forms[node], self._numerators(source))
        states = self.states
        c = [self._forms[node].get(state, fmpq(0)) for state in states]
        delays = {key[1] for form in self._forms for key in form if isinstance(key, tuple) and key[0] == source}
        total = fmpq_poly([0])
        for delay in delays:
            b = [self._next(state).get((source, delay), fmpq(0)) for state in states]
            d = self._forms[node].get((source, delay), fmpq(0))
            changed = [[a - x * y for a, y in zip(row, c, strict=True)] for row, x in zip(self.matrix, b, strict=True)]
            part = _reversed_characteristic(changed) + (d - 1) * self.denominator
            total += fmpq_poly([0] * delay + [1]) * part
        return total

    def _numerators(self, source: Source) -> dict[_State, fmpq_poly]:
        """Return the numerator from a source to each state, where there is no recursion."""
        numerators: dict[_State, fmpq_poly] = {}
        for state in self._in_order or ():
            numerators[state] = fmpq_poly([0, 1]) * self._from(source, self._next(state), numerators)
        return numerators

    def _from(self, source: Source, form: _Form, numerators: Mapping[_State, fmpq_poly]) -> fmpq_poly:
        """Return the numerator from a source to a form of states that have theirs."""
        total = fmpq_poly([0])
        for key, value in form.items():
            if isinstance(key, int):
                total += value * numerators[key] if value else 0
            elif key[0] == source:
                total += fmpq_poly([0] * key[1] + [value])
        return total

    @cached_property
    def _in_order(self) -> list[_State] | None:
        """The states, each behind those that it follows within a sample; None if any follows itself: recursion."""
        followed = {state: self.weights(self.stage.nodes[state].operands[0]).keys() for state in self.states}
        order: list[_State] = []
        placed: set[_State] = set()
        waiting = self.states
        while waiting:
            ready = [state for state in waiting if followed[state] <= placed]
            if not ready:
                return None
            order += ready
            placed.update(ready)
            waiting = [state for state in waiting if state not in placed]
        return order

    @cached_property
    def states(self) -> list[_State]:
        """Indices of the DELAY nodes."""
        return [index for index, node in enumerate(self.stage.nodes) if node.op is Operation.DELAY]

    @cached_property
    def matrix(self) -> list[list[fmpq]]:
        """The state matrix A: what each state takes over is its row times the states."""
        return [[self._next(state).get(other, fmpq(0)) for other in self.states] for state in self.states]

    def weights(self, node: int) -> dict[int, fmpq]:
        """Return the states that a node adds up, by index of the DELAY, with their factors."""
        return {key: value for key, value in self._forms[node].items() if isinstance(key, int) and value}

    def input_weights(self) -> list[fmpq]:
        """Return the factors with which the states take over an input, of all states and inputs."""
        entries = [(source, 0) for source in self.inputs]
        return [self._next(state).get(entry, fmpq(0)) for state in self.states for entry in entries]

    def _next(self, state: _State) -> _Form:
        return self._forms[self.stage.nodes[state].operands[0]]

    @cached_property
    def _forms(self) -> list[_Form]:
        forms: list[_Form] = []
        for index, node in enumerate(self.stage.nodes):
            operands = [] if node.op is Operation.DELAY else [forms[i] for i in node.operands]
            forms.append(self._form(index, node, operands))
        return forms

    def _form(self, index: int, node: NodeEntry, operands: Sequence[_Form]) -> _Form:
        if node.op is Operation.DELAY:
            return {index: fmpq(1)}
        if node.op in {Operation.INPUT, Operation.CONSTANT}:
            return {((node.op, index, 0), 0): fmpq(1)}
        if node.op in {Operation.FLOOR, Operation.FRACTION, Operation.TRUNCATE}:
            root, delay = self.undelayed(node.operands[0])
            kind = Operation.TRUNCATE if node.op is Operation.TRUNCATE else Operation.FLOOR
            error: _Form = {((kind, root, _kept(node)), delay): fmpq(1)}
            return error if node.op is Operation.FRACTION else _sum(operands[0], error, fmpq(-1))
        if node.op in {Operation.ADD, Operation.SUBTRACT}:
            return _sum(operands[0], operands[1], fmpq(1 if node.op is Operation.ADD else -1))
        if node.op is Operation.BOUND:
            return operands[0]
        require(node.op in {Operation.SHIFT, Operation.SCALE}, f"{label(self.stage, index)} must be linear")
        factor = (
            fmpq(2) ** node.parameter
            if node.op is Operation.SHIFT
            else node.parameter * fmpq(2) ** -node.parameter_frac
        )
        return {key: value * factor for key, value in operands[0].items()}

    def undelayed(self, index: int) -> tuple[int, int]:
        """Return the node that a chain of DELAY nodes begins with, and by how many samples a node is behind it."""
        delay = 0
        while self.stage.nodes[index].op is Operation.DELAY:
            require(delay < len(self.stage.nodes), f"{label(self.stage, index)} must not be its own source")
            index, delay = self.stage.nodes[index].operands[0], delay + 1
        return index, delay


def _sum(a: _Form, b: _Form, factor: fmpq) -> _Form:
    result = dict(a)
    for key, value in b.items():
        result[key] = result.get(key, fmpq(0)) + factor * value
    return result


def _reversed_characteristic(matrix: list[list[fmpq]]) -> fmpq_poly:
    """``det(I - w matrix)``."""
    if not matrix:
        return fmpq_poly([1])
    return fmpq_poly(fmpq_mat(matrix).charpoly().coeffs()[::-1])
