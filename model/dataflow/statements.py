"""The statements of the C model: what each stage computes, and the types in which it does.

Signals (`sosmith.model.dataflow.signals`) are computed once, under the name of a node, ``n<stage>_<node>``. A sum of 64
bits whose floor is used is kept times ``2**s``, so that the floor is its upper word: its name ends with ``s<s>``, and a
product by 32 bits goes to it in one instruction where a processor multiplies and accumulates. Each value has the
narrowest type of 32, 64 and 128 bits that holds all that it can be, and is computed in the narrowest that holds all on
the way there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sosmith.model.dataflow.c_types import TYPES, Range, Span, bits_of, literal
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.dataflow.signals import Floor, Signal, StageSums, Sum, live_nodes, signals_of
from sosmith.model.dataflow.stage_plan import StagePlan, halves, term_ranges


class StageText(NamedTuple):
    """A stage as a C function: its name, the statements of the body, and types and names of what it hands on."""

    name: str
    statements: list[str]
    members: list[tuple[str, str]]


class ModelText(NamedTuple):
    """All stages, the bits of the words that they keep, and the names of the nodes that are wanted of the last one."""

    stages: list[StageText]
    states: list[int]
    names: dict[int, str]


def statements_of(
    names: Sequence[str], graphs: Sequence[Graph], exported: Sequence[int], inputs: Sequence[str]
) -> ModelText:
    """Write the stages of a chain.

    Parameters
    ----------
    names : sequence of str
        Names of the stages.
    graphs : sequence of Graph
    exported : sequence of int
        Nodes of the last stage that have to be handed on.
    inputs : sequence of str
        Members that hold what goes in.
    """
    signals = signals_of(graphs)
    live = live_nodes(graphs, exported)
    stages: list[StagePlan] = []
    for index, graph in enumerate(graphs):
        following = graph.outputs if index + 1 < len(graphs) else exported
        wanted = [i for i in following if i in live[index]]
        before = stages[-1] if stages else None
        widest = max(bits_of(graph.nodes[i]) for i in live[index])
        for expanded in (True, False):
            sums = StageSums(graph, signals[index], live[index], wanted, expanded=expanded)
            plan = StagePlan(index, graph, signals[index], sums, wanted, before)
            if plan.width() <= max(widest, 64):
                break
        stages.append(plan)
    for stage in stages:
        stage.choose_scales()
    offset = 0
    texts, states = [], []
    for name, stage in zip(names, stages, strict=True):
        texts.append(StageText(name, _Writer(stage, inputs, offset).statements(), stage.members()))
        states += [bits_of(stage.values(signal)) for signal in stage.states]
        offset = len(states)
    last = stages[-1]
    return ModelText(texts, states, {index: last.name(last.signals[index]) for index in exported})


class _Term(NamedTuple):
    """A term of a sum: its text, the bits of the type that it has, and the range of its values."""

    text: str
    bits: int
    values: Range


class _Writer:
    def __init__(self, plan: StagePlan, inputs: Sequence[str], offset: int) -> None:
        self._plan, self._inputs = plan, inputs
        self._words = {signal: offset + k for k, signal in enumerate(plan.states)}
        self._written: dict[Signal, str] = {}

    def statements(self) -> list[str]:
        """Compute what is needed in the order of its nodes, then store the words and what is handed on."""
        plan = self._plan
        for signal in sorted(self._used(), key=lambda each: plan.sums.nodes[each]):
            self._write(signal)
        text = list(self._written.values())
        text += [f"state->s{number} = {plan.name(plan.stored(each))};" for each, number in self._words.items()]
        text += [f"w->{plan.name(each)} = {plan.name(each)};" for each in plan.handed_on]
        if not self._words:
            text.append("(void)state;")
        return text

    def _used(self) -> set[Signal]:
        """Return what leads to words or to what is handed on: the next stage may take less than all outputs."""
        used: set[Signal] = set()
        waiting = [*self._plan.handed_on, *map(self._plan.stored, self._words)]
        while waiting:
            each = waiting.pop()
            if each not in used:
                used.add(each)
                waiting += self._plan.sources(each)
        return used

    def _write(self, signal: Signal) -> None:
        """Declare a signal, and before it what it is computed from."""
        waiting = [signal]
        while waiting:
            each = waiting[-1]
            before = [source for source in self._plan.sources(each) if source not in self._written]
            if before:
                waiting += before
            else:
                waiting.pop()
                if each not in self._written:
                    self._written[each] = self._declaration(each)

    def _declaration(self, signal: Signal) -> str:
        plan, node = self._plan, self._plan.node(signal)
        scale = plan.scale(signal)
        meaning = ", ".join([*filter(None, [node.name]), node.format]) if node.name else ""
        if scale:
            meaning = f"{meaning or node.format} times 2**{scale}"
        comment = f" /* {meaning} */" if meaning else ""
        kind = TYPES[bits_of(plan.values(signal))]
        return f"const {kind} {plan.name(signal)} = {self._value(signal)};{comment}"

    def _value(self, signal: Signal) -> str:
        plan = self._plan
        if signal in plan.taken:
            assert plan.before is not None
            return f"w->{plan.before.name(signal)}"
        if signal in self._words:
            return f"state->s{self._words[signal]}"
        if signal in plan.sums.sums:
            return self._sum(signal, plan.sums.sums[signal])
        if isinstance(signal.root, Floor):
            of = plan.floored(signal)
            return self._floor(signal, of, signal.root.bits + plan.scale(of))
        node = plan.operation(signal)
        if node.op is Op.INPUT:
            return f"w->{self._inputs[plan.graph.inputs.index(signal.root[1])]}"
        return self._operation(signal, node)

    def _floor(self, signal: Signal, of: Signal, places: int) -> str:
        """Shift to the right, which by as many places as there are bits leaves the sign."""
        plan = self._plan
        bits = bits_of(plan.values(of))
        while places >= bits and bits < max(TYPES):
            bits *= 2
        name = self._cast(bits, plan.name(of), plan.values(of))
        return self._narrowed(signal, bits, f"{name} >> {min(places, bits - 1)}")

    def _operation(self, signal: Signal, node: Node) -> str:
        plan = self._plan
        sources = plan.sources(signal)
        names = [plan.name(each) for each in sources]
        ranges = [plan.values(each) for each in sources]
        if node.op is Op.MULTIPLY:
            ends = [Span(*sorted((ranges[0].low * end, ranges[0].high * end))) for end in ranges[1]]
            kind = bits_of(*ranges, *ends)
            if kind == 64 and bits_of(*ranges) == 32:
                return f"product({names[0]}, {names[1]})"
            return self._narrowed(signal, kind, f"{self._cast(kind, names[0], ranges[0])} * {names[1]}")
        kind, name = bits_of(*ranges), names[0]
        dropped = plan.graph.nodes[node.operands[0]].frac - node.frac
        if node.op is Op.TRUNCATE:  # as C99 divides
            divisor = 1 << dropped
            kind = max(kind, bits_of(Span(divisor, divisor)))
            return self._narrowed(signal, kind, f"{self._cast(kind, name, ranges[0])} / {literal(divisor)}")
        if node.op is Op.FRACTION:
            mask = (1 << plan.graph.nodes[node.operands[0]].frac - node.parameter) - 1
            kind = max(kind, bits_of(Span(mask, mask)))
            return self._narrowed(signal, kind, f"{self._cast(kind, name, ranges[0])} & {literal(mask)}")
        assert node.op is Op.CLAMP
        low, high = literal(node.low), literal(node.high)
        kind = max(kind, bits_of(Span(node.low, node.high)))
        text = f"{name} < {low} ? {low} : {name} > {high} ? {high} : {name}"
        return self._narrowed(signal, kind, text)

    def _sum(self, signal: Signal, whole: Sum) -> str:
        """Write a sum; products by factors of more than 32 bits in two parts, of which one goes to the upper word."""
        plan, scale = self._plan, self._plan.scale(signal)
        constant = whole.constant << scale
        terms = [(each, (factor << scale) >> plan.scale(each)) for each, factor in whole.terms.items()]
        spans = [part for each, factor in whole.terms.items() for part in term_ranges(plan, each, factor, scale)]
        kind = bits_of(plan.values(signal), *_on_the_way([*spans, Span(constant, constant)]))
        ordered = sorted(terms, key=lambda term: (-bits_of(plan.values(term[0])), term[1] < 0))
        text = self._grouped(ordered) if kind == min(TYPES) else ""
        if not text:
            for each, factor in ordered:
                for part in halves(factor):
                    text = self._joined(text, kind, each, part)
        if constant or not text:
            size = abs(constant)
            text = f"{text} {'-' if constant < 0 else '+'} {literal(size)}" if text else literal(constant)
            kind = kind if ordered else bits_of(Span(constant, constant))
        return self._narrowed(signal, kind, text)

    def _grouped(self, terms: Sequence[tuple[Signal, int]]) -> str:
        """Write those terms that have a power of two in common as that times a sum; nothing if none of them have."""
        powers = [factor & -factor for _, factor in terms]
        common = min((power for power in powers if power > 1), default=0)
        inside = [(each, factor // common) for (each, factor), power in zip(terms, powers, strict=True) if power > 1]
        if len(inside) < 2 or max(factor for _, factor in inside) < 0:
            return ""
        kind, group = min(TYPES), ""
        for each, factor in sorted(inside, key=lambda term: term[1] < 0):
            group = self._joined(group, kind, each, factor)
        text = f"({group}) * {literal(common)}"
        for (each, factor), power in zip(terms, powers, strict=True):
            if power == 1:
                text = self._joined(text, kind, each, factor)
        return text

    def _joined(self, text: str, kind: int, each: Signal, factor: int) -> str:
        """Add a term to a sum."""
        name, values = self._plan.name(each), self._plan.values(each)
        size = abs(factor) if text else factor
        if size == 1:
            term = self._cast(kind, name, values)
        elif kind == 64 and bits_of(values, Span(size, size)) == 32 and size & (size - 1):
            term = f"product({name}, {literal(size)})"
        else:
            term = f"{self._cast(kind, name, values)} * {literal(size)}"
        return f"{text} {'-' if factor < 0 else '+'} {term}" if text else term

    @staticmethod
    def _cast(kind: int, name: str, values: Range) -> str:
        """Return a name in the type that is computed in."""
        return name if bits_of(values) == kind else f"({TYPES[kind]}){name}"

    def _narrowed(self, signal: Signal, kind: int, expression: str) -> str:
        """Return an expression of the type `kind` in the type of its signal."""
        wanted = bits_of(self._plan.values(signal))
        if wanted >= kind:
            return expression
        return f"({TYPES[wanted]})" + (expression if expression.isidentifier() else f"({expression})")


def _on_the_way(spans: Sequence[Span]) -> list[Span]:
    """Return all terms and what they can add up to in any order."""
    low = sum(min(each.low, 0) for each in spans)
    high = sum(max(each.high, 0) for each in spans)
    return [*spans, Span(low, high)]
