"""The codes of a certificate's nodes as forms of what enters a core, at the sample itself and at those before.

The variables are the codes of the inputs, ``(node, 0)``, and those that a DELAY remembers: ``(node, k)`` is the code
that `node`, which is not a DELAY, had k samples ago. So a delay of a delay is the same variable as what it repeats::

    v1 = delay of v, v2 = delay of v1        v1 at the sample before = v2 = (v, 2)

Where a stage remembers whether there was a sample before, as the delay of a constant, all that it remembers of that one
is ``begun`` times the variable: without one, it is 0. What then keeps its code from one sample to the next `lasts`:
later samples change nothing.

With several samples a clock, a beat takes the place of a sample, and a node is in one of its lanes
(`sosmith.verify.parallel.lanes`). With look-ahead, what a loop remembers of T samples ago or more is ``warm``
times the variable, 0 for the first T samples (`sosmith.verify.parallel.turn_memories`). What a stage hands to the
next, or a lane to the next, is a variable too, ``(node, 0)``, so that forms stay short. The ranges that the certificate
states are known of all of them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation, StageEntry
from sosmith.verify.graph import require
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.lanes import LaneNode, in_lanes
from sosmith.verify.program.normal_form import ONE, Form, Monomial, constant, plus

DATA = "s_axis_tdata"

_BEGUN = "begun"
"""Key of the variable that says whether there was a sample, or a beat, before."""

_Key = frozenset[tuple[Monomial, int | Fraction]]
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


@dataclass(frozen=True)
class LanePorts:
    """What enters and leaves a core in one lane, by the indices of nodes.

    Attributes
    ----------
    inputs : tuple of int
        The inputs, in the order of the ports.
    output : int
        The output.
    settling : int or None
        What is negative for the samples that are flagged as settling; None without the flag.
    """

    inputs: tuple[int, ...]
    output: int
    settling: int | None


class Field(NamedTuple):
    """Bits of the input: their place, and what they hold as an unsigned word."""

    offset: int
    width: int
    word: Form


class GraphCodes:
    """All stages of a certificate that `verify` has accepted, joined.

    Parameters
    ----------
    certificate : Certificate
        The certificate.
    forms : Forms
        The atoms; the ranges become known to them.
    lanes : int
        Samples of a beat.
    memories : mapping of str to int
        Number of words of each memory of a core with look-ahead, by its name.
    prefix : str
        Prefix of the core's nets.
    space : int
        Another number for each of several graphs of the same inputs, whose forms are mixed: what their stages hand on
        then has variables of its own.

    Attributes
    ----------
    turned : dict of Origin to int
        The origins of DELAY nodes in `memories`, and how many samples take turns there.
    nodes : list of CodeNode
        The nodes, without the inputs of stages that others feed.
    forms : Forms
    lanes : list of LanePorts
        What enters and leaves in each lane.
    codes : list of Form
        Code of each node.
    """

    def __init__(
        self,
        certificate: Certificate,
        forms: Forms,
        lanes: int = 1,
        memories: Mapping[str, int] = MappingProxyType({}),
        prefix: str = "",
        space: int = 0,
    ) -> None:
        self._prefix = prefix
        self.forms = forms
        self.nodes: list[CodeNode] = []
        self._remembered: set[int] = set()
        passed: list[int] = []
        between: set[int] = set()
        for number, stage in enumerate(certificate.stages):
            between.update(passed)
            passed = self._join(stage, lanes, passed if number else None)
        inputs = [index for index, node in enumerate(self.nodes) if node.entry.op is Operation.INPUT]
        self.lanes = [
            LanePorts(tuple(entering), output, flags[0] if flags else None)
            for entering, (output, *flags) in zip(_split(inputs, lanes), _split(passed, lanes), strict=True)
        ]
        self.turned = {
            self.origin(index): memories[self.memory_name(index)]
            for index in self.delays
            if self.memory_name(index) in memories
        }
        self._begun = self._begins()
        self._ranges: dict[Origin, tuple[int, int]] = {}
        for index in self.delays:
            entry, origin = self.nodes[index].entry, self.origin(index)
            low, high = self._ranges.get(origin) or self._widest(origin[0])  # it is 0 at first, or what it repeats
            self._ranges[origin] = max(low, entry.low), min(high, entry.high)
        self.codes: list[Form] = []
        self._seams: dict[_Key, Form] = {}
        self._definitions: dict[Hashable, Form] = {}
        self._kept: dict[_Key, Form] = {}
        self._kept_of: dict[int, dict[_Key, Form]] = {}
        self._seams_of: dict[int, dict[_Key, Form]] = {}
        self._handed_on: dict[int, Form] = {}
        for index, node in enumerate(self.nodes):
            code = self._code(index, node)
            forms.know(code, node.entry.low, node.entry.high)
            self.codes.append(code)
            if forms.is_variable(code) and (lanes > 1 or forms.keys(code) == {(index, 0)}):
                continue
            if index in between or index in self._remembered:
                key: Hashable = (index, 0, space) if space else (index, 0)
                self._definitions[key] = code
                short = forms.variable(key, node.entry.low, node.entry.high)
            if index in between:
                self._handed_on[index] = self._seams.setdefault(frozenset(code.items()), short)
            if index in self._remembered and len(code) > 1:
                self._kept.setdefault(frozenset(code.items()), short)

    @property
    def definitions(self) -> Mapping[Hashable, Form]:
        """What the variables stand for that stages hand on, by their keys."""
        return self._definitions

    @property
    def delays(self) -> list[int]:
        """The DELAY nodes."""
        return [index for index, node in enumerate(self.nodes) if node.entry.op is Operation.DELAY]

    def state_name(self, index: int) -> str:
        """Return the name of the register that holds a DELAY node, or of the net that has any other."""
        return f"{self._prefix}{self.nodes[index].stage}.{self.nodes[index].name}"

    def memory_name(self, index: int) -> str:
        """Return the name of the memory that holds a DELAY node."""
        return f"{self.state_name(index)}_memory"

    def turn(self, turns: int) -> Form:
        """Return the number of the sample modulo `turns`."""
        return self.forms.variable(("turn", turns), 0, turns - 1)

    def warm(self, turns: int) -> Form:
        """Return whether there are as many samples before."""
        return self.forms.variable(("warm", turns), 0, 1)

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
            return self.seen(node, self.nodes[node].stage)
        low, high = self._ranges.get(origin) or self._widest(node)
        code = self.forms.variable(origin, low, high)
        if origin in self._begun:
            entry = self.nodes[node].entry
            known = constant(entry.parameter) if entry.op is Operation.CONSTANT else code
            return self.forms.times(self.forms.variable(_BEGUN, 0, 1), known)
        return self.forms.times(self.warm(self.turned[origin]), code) if origin in self.turned else code

    def lasts(self, index: int) -> bool:
        """Whether a node keeps its code from its first sample on."""
        if (index, 1) not in self._begun:
            return False
        one: dict[Hashable, Form] = {_BEGUN: constant(1)}
        past = self.past((index, 1))
        return past is not None and self.forms.settled(self.codes[index], one) == self.forms.settled(past, one)

    def shortened(self, word: Form, width: int, at_inlet: bool = False) -> Form:
        """Return the variable whose code a word of `width` bits is; any other word as it is.

        Those are what the next lane takes over, and, where a word enters an instance, what stages hand on. A constant
        stays: its few bits are also the lowest ones of a code that is a multiple of a power of two.
        """
        if not word.keys() - {ONE}:
            return word
        for codes, by_width in ((self._seams, self._seams_of), (self._kept, self._kept_of)):
            if not codes or (len(word) < 2 if codes is self._kept else not at_inlet):
                continue
            variable = codes.get(frozenset(word.items()))
            if variable is None:
                if width not in by_width:
                    by_width[width] = {_rest(code, width): short for code, short in codes.items()}
                variable = by_width[width].get(_rest(word.items(), width))
            if variable is not None:
                return variable
        return word

    def seen(self, index: int, stage: str) -> Form:
        """Return the code of a node as its own stage sees it, or as another one or another lane does."""
        code = self.codes[index]
        if self.nodes[index].stage != stage:
            return self._handed_on.get(index, code)
        return self._kept.get(frozenset(code.items()), code)

    def opened(self, a: Form, b: Form) -> tuple[Form, Form] | None:
        """Return two codes without one of the variables of what is handed on; None if there is none left in them.

        It is the last in the order of the graph, of those that only one of them has, if there are such.
        """
        first, second = (self.forms.keys(code) & self._definitions.keys() for code in (a, b))
        candidates = first ^ second or first
        if not candidates:
            return None
        key = next(key for key in reversed(self._definitions) if key in candidates)
        meant = {key: self._definitions[key]}
        return self.forms.settled(a, meant), self.forms.settled(b, meant)

    def _begins(self) -> set[Origin]:
        """Return what stages with the delay of a constant remember of the sample before."""
        origins = {index: self.origin(index) for index in self.delays}
        stages = {
            self.nodes[index].stage
            for index, (node, ago) in origins.items()
            if ago == 1 and self.nodes[node].entry.op is Operation.CONSTANT
        }
        return {
            origin
            for index, origin in origins.items()
            if self.nodes[index].stage in stages and origin[1] == 1 and origin not in self.turned
        }

    def _widest(self, node: int) -> tuple[int, int]:
        entry = self.nodes[node].entry
        return min(entry.low, 0), max(entry.high, 0)

    def _join(self, stage: StageEntry, lanes: int, fed: Sequence[int] | None) -> list[int]:
        """Add the nodes of a stage, whose inputs are the nodes `fed`; return its outputs."""
        nodes, outputs = in_lanes(stage, lanes)
        names = _unique_names(nodes)
        supply = iter(fed or ())
        at: list[int] = []
        count = len(self.nodes)
        for node in nodes:
            if node.entry.op is Operation.INPUT and fed is not None:
                at.append(next(supply))
            else:
                at.append(count)
                count += 1
        here = len(self.nodes)
        self._remembered |= {k for k, node in zip(at, nodes, strict=True) if node.remembered and k >= here}
        for index, node in enumerate(nodes):
            if at[index] == len(self.nodes):
                operands = tuple(at[k] for k in node.operands)
                self.nodes.append(CodeNode(node.entry, operands, stage.name, names[index], node.label))
        return [at[k] for k in outputs]

    def _code(self, index: int, node: CodeNode) -> Form:
        entry = node.entry
        if entry.op is Operation.INPUT:
            return self.forms.variable((index, 0), entry.low, entry.high)
        if entry.op is Operation.DELAY:
            past = self.past(self.origin(index))
            assert past is not None
            return past
        if entry.op is Operation.CONSTANT:
            return constant(entry.parameter)
        operands = [self.seen(k, node.stage) for k in node.operands]
        fracs = [self.nodes[k].entry.frac for k in node.operands]
        if entry.op in {Operation.ADD, Operation.SUBTRACT}:
            a, b = (shifted(code, entry.frac - frac) for code, frac in zip(operands, fracs, strict=True))
            return plus(a, b, 1 if entry.op is Operation.ADD else -1)
        if entry.op is Operation.MULTIPLY:
            return self.forms.times(*operands)
        return self._of_one(entry, operands[0], fracs[0])

    def _of_one(self, entry: NodeEntry, of: Form, frac: int) -> Form:
        """Code of an operation with one operand."""
        forms = self.forms
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


def fields_of(graph: GraphCodes, certificate: Certificate, width: int, input_flags: Sequence[Form]) -> list[Field]:
    """Return the fields of the input and what is beside them; each begins a byte. Above them are flags of inputs.

    Raises
    ------
    RejectedError
        If they do not fill the input, which has `width` bits.
    """
    fields: list[Field] = []
    offset = 0
    for lane in graph.lanes:
        for node, port in zip(lane.inputs, certificate.inputs, strict=True):
            fields.append(Field(offset, port.bits, graph.forms.unsigned(graph.codes[node], port.bits)))
            offset += port.bits
            beside = -offset % 8
            if beside:
                padding = graph.forms.variable(("padding", node), 0, (1 << beside) - 1)
                fields.append(Field(offset, beside, padding))
            offset += beside
    for flag in input_flags:
        fields.append(Field(offset, 1, flag))
        offset += 1
    require(width == offset, f"the port {DATA} must have {offset} bits, not {width}")
    return fields


def _rest(word: Iterable[tuple[Monomial, int | Fraction]], width: int) -> _Key:
    """Return the coefficients of a word of `width` bits, each as the least that means the same."""
    rests = ((monomial, coefficient % (1 << width)) for monomial, coefficient in word)
    return frozenset((monomial, coefficient) for monomial, coefficient in rests if coefficient)


def _split(indices: Sequence[int], parts: int) -> list[Sequence[int]]:
    """Split a list into so many parts of the same length."""
    each = len(indices) // parts
    return [indices[each * k : each * (k + 1)] for k in range(parts)]


def _unique_names(nodes: Sequence[LaneNode]) -> list[str]:
    """Return a name for each node of a stage: its own, or with its index where that is missing or taken."""
    seen: set[str] = set()
    names = []
    for index, node in enumerate(nodes):
        name = node.name if node.name and node.name not in seen else f"{node.name or node.entry.op.value}_{index}"
        seen.add(name)
        names.append(name)
    return names
