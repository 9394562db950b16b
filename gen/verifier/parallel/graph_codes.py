"""The codes of a certificate's nodes as forms of what enters a core, at the sample itself and at those before.

The variables are the codes of the inputs, ``(node, 0)``, and those that a DELAY remembers: ``(node, k)`` is the code
that `node`, which is not a DELAY, had k samples ago. So a delay of a delay is the same variable as what it repeats::

    v1 = delay of v, v2 = delay of v1        v1 at the sample before = v2 = (v, 2)

What one stage hands to the next is a variable too, ``(node, 0)``, so that forms stay short. The ranges that the
certificate states are known of all of them.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.verifier.certificate_file import Certificate, NodeEntry, Operation, StageEntry
from sosmith.gen.verifier.graph import label, require
from sosmith.gen.verifier.parallel.forms import Forms, shifted
from sosmith.gen.verifier.program.normal_form import Form, Monomial, constant, plus

Origin = tuple[int, int]
"""A node that is not a DELAY, and how many samples ago."""


@dataclass(frozen=True)
class CodeNode:
    """A node of the joined graph.

    Attributes
    ----------
    entry : NodeEntry
        The node; its operands are those of its stage.
    operands : tuple of int
        Its operands in the joined graph.
    stage, name : str
        Name of its stage, and of the node in the hardware.
    label : str
        Its name in messages.
    """

    entry: NodeEntry
    operands: tuple[int, ...]
    stage: str
    name: str
    label: str


class GraphCodes:
    """All stages of a certificate that `verify` has accepted, joined.

    Parameters
    ----------
    certificate : Certificate
        The certificate.
    forms : Forms
        The atoms; the ranges become known to them.

    Attributes
    ----------
    nodes : list of CodeNode
        The nodes, without the inputs of stages that others feed.
    inputs : list of int
        The inputs, in the order of the ports.
    output : int
        The output.
    settling : int or None
        What is negative for the samples that are flagged as settling; None without the flag.
    codes : list of Form
        Code of each node.
    """

    def __init__(self, certificate: Certificate, forms: Forms) -> None:
        self._forms = forms
        self.nodes: list[CodeNode] = []
        self.inputs: list[int] = []
        passed: list[int] = []
        between: set[int] = set()
        for number, stage in enumerate(certificate.stages):
            between.update(passed)
            passed = self._join(stage, passed if number else None)
        self.output, *flags = passed
        self.settling = flags[0] if flags else None
        self._ranges: dict[Origin, tuple[int, int]] = {}
        for index in self.delays:
            entry, origin = self.nodes[index].entry, self.origin(index)
            low, high = self._ranges.get(origin, (entry.low, entry.high))
            self._ranges[origin] = max(low, entry.low), min(high, entry.high)
        self.codes: list[Form] = []
        self._seams: dict[frozenset[tuple[Monomial, int | Fraction]], Form] = {}
        self._definitions: dict[Hashable, Form] = {}
        self._handed_on: dict[int, Form] = {}
        for index, node in enumerate(self.nodes):
            code = self._code(index, node)
            forms.know(code, node.entry.low, node.entry.high)
            if index in between and (len(code) > 1 or forms.keys(code) != {(index, 0)}):
                self._definitions[index, 0] = code
                short = forms.variable((index, 0), node.entry.low, node.entry.high)
                self._handed_on[index] = self._seams.setdefault(frozenset(code.items()), short)
            self.codes.append(code)

    @property
    def delays(self) -> list[int]:
        """The DELAY nodes."""
        return [index for index, node in enumerate(self.nodes) if node.entry.op is Operation.DELAY]

    def origin(self, index: int) -> Origin:
        """Return what a node repeats, and how many samples ago that was."""
        ago = 0
        while self.nodes[index].entry.op is Operation.DELAY:
            require(ago < len(self.nodes), f"{self.nodes[index].label} must not repeat itself")
            (index,) = self.nodes[index].operands
            ago += 1
        return index, ago

    def past(self, origin: Origin) -> Form | None:
        """Return the code that a node had some samples ago; None if that is still to come."""
        node, ago = origin
        if ago < 0:
            return None
        if ago == 0:
            return self.codes[node]
        low, high = self._ranges.get(origin) or self._widest(node)
        return self._forms.variable(origin, low, high)

    def shortened(self, code: Form) -> Form:
        """Return the variable of a stage's output whose code this is; any other code as it is."""
        return self._seams.get(frozenset(code.items()), code)

    def opened(self, code: Form) -> Form:
        """Return a code without the variables of stages' outputs."""
        return self._forms.settled(code, self._definitions)

    def _widest(self, node: int) -> tuple[int, int]:
        entry = self.nodes[node].entry
        return min(entry.low, 0), max(entry.high, 0)

    def _join(self, stage: StageEntry, fed: Sequence[int] | None) -> list[int]:
        """Add the nodes of a stage, whose inputs are the nodes `fed`; return its outputs."""
        names = _unique_names(stage)
        supply = iter(fed or ())
        at: list[int] = []
        count = len(self.nodes)
        for node in stage.nodes:
            if node.op is Operation.INPUT and fed is not None:
                at.append(next(supply))
            else:
                at.append(count)
                count += 1
        for index, node in enumerate(stage.nodes):
            if at[index] == len(self.nodes):
                operands = tuple(at[k] for k in node.operands)
                self.nodes.append(CodeNode(node, operands, stage.name, names[index], label(stage, index)))
        if fed is None:
            self.inputs = [at[k] for k, node in enumerate(stage.nodes) if node.op is Operation.INPUT]
        return [at[k] for k in stage.outputs]

    def _seen(self, index: int, stage: str) -> Form:
        """Code of a node as its own stage sees it, or as another one does."""
        own = self.nodes[index].stage == stage
        return self.codes[index] if own else self._handed_on.get(index, self.codes[index])

    def _code(self, index: int, node: CodeNode) -> Form:
        entry = node.entry
        if entry.op is Operation.INPUT:
            return self._forms.variable((index, 0), entry.low, entry.high)
        if entry.op is Operation.DELAY:
            found = self.past(self.origin(index))
            assert found is not None
            return found
        if entry.op is Operation.CONSTANT:
            return constant(entry.parameter)
        operands = [self._seen(k, node.stage) for k in node.operands]
        fracs = [self.nodes[k].entry.frac for k in node.operands]
        if entry.op in {Operation.ADD, Operation.SUBTRACT}:
            a, b = (shifted(code, entry.frac - frac) for code, frac in zip(operands, fracs, strict=True))
            return plus(a, b, 1 if entry.op is Operation.ADD else -1)
        if entry.op is Operation.MULTIPLY:
            return self._forms.times(*operands)
        return self._of_one(entry, operands[0], fracs[0])

    def _of_one(self, entry: NodeEntry, of: Form, frac: int) -> Form:
        """Code of an operation with one operand."""
        forms = self._forms
        if entry.op is Operation.SCALE:
            return forms.times(of, constant(entry.parameter))
        if entry.op is Operation.FLOOR:
            return forms.floor(shifted(of, entry.frac - frac))
        if entry.op is Operation.FRACTION:
            dropped = frac - entry.parameter
            return plus(of, forms.floor(shifted(of, -dropped)), -(1 << dropped))
        if entry.op is Operation.TRUNCATE:
            dropped = frac - entry.frac
            up = plus(of, forms.negative(of), (1 << dropped) - 1)
            return forms.floor(shifted(up, -dropped))
        if entry.op is Operation.CLAMP:
            low, high = constant(entry.low), constant(entry.high)
            below, above = forms.negative(plus(of, low, -1)), forms.negative(plus(high, of, -1))
            raised = plus(of, forms.times(below, plus(low, of, -1)))
            return plus(raised, forms.times(above, plus(high, of, -1)))
        return of  # SHIFT, BOUND


def _unique_names(stage: StageEntry) -> list[str]:
    """Return a name for each node of a stage: its own, or with its index where that is missing or taken."""
    seen: set[str] = set()
    names = []
    for index, node in enumerate(stage.nodes):
        name = node.name if node.name and node.name not in seen else f"{node.name or node.op.value}_{index}"
        seen.add(name)
        names.append(name)
    return names
