"""The cascade of sections as forms: each node as a quotient of polynomials to the sources up to its own section.

Nothing proven depends on this: Rocq checks each form against the graph.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from sosmith.verify.certificate_file import Operation
from sosmith.verify.graph import inputs_of
from sosmith.verify.rocq.flat import FlatGraph
from sosmith.verify.rocq.linear import LinearStage, Source
from sosmith.verify.rocq.polynomials import (
    Polynomial,
    added,
    common_denominator,
    integers,
    number,
    numbers,
    product,
    rows,
)

Row = dict[Source, Polynomial]
"""Numerators by source; the nodes of sources are counted in the whole graph."""

_WRITTEN = {Operation.DELAY, Operation.FRACTION, Operation.CONSTANT}
"""Nodes whose forms are written out; Rocq derives the others from theirs."""


@dataclass(frozen=True)
class SectionForms:
    """Forms of one section.

    Attributes
    ----------
    under : list of int
        The denominator of all its nodes: that of the sections up to this one, times a number.
    factor : list of int
        What the forms at its inputs are multiplied by.
    forms : mapping from node to Row
        Numerators, in integers.
    targets : list of int
        Nodes whose range needs a peak gain.
    """

    under: list[int]
    factor: list[int]
    forms: Mapping[int, Row]
    targets: list[int]


@dataclass(frozen=True)
class Cascade:
    """Forms of all sections.

    Attributes
    ----------
    first, last : int
        The first node of the sections, and the one behind them.
    entries : list of int
        The nodes before the sections that drive them.
    sources : list of Source
    sections : list of SectionForms
    """

    graph: FlatGraph
    first: int
    last: int
    entries: list[int]
    sources: list[Source]
    sections: list[SectionForms]

    def row(self, form: Row) -> list[list[int]]:
        """Return numerators in the order of the sources."""
        return [[int(value) for value in form.get(source, [])] for source in self.sources]

    def definitions(self) -> str:
        """Write sources, factors and forms as terms of Rocq."""
        written: list[str] = []
        for entry in self.entries if self._placed()[0][0] else ():
            alone: Row = {("node", entry, 0): [Fraction(1)]}
            written.append(f"({entry}%nat, Form [1] {rows(self.row(alone))})")
        factors: list[str] = []
        for place, section in self._placed():
            stage = self.graph.stages[place]
            offset = self.graph.offsets[place]
            factors += [f"({offset + at}%nat, {numbers(section.factor)})" for at in inputs_of(stage)]
            for at, node in enumerate(stage.nodes):
                if node.op in _WRITTEN or (node.op is Operation.INPUT and place == 0):
                    form = rows(self.row(section.forms[offset + at]))
                    written.append(f"({offset + at}%nat, Form {numbers(section.under)} {form})")
        return f"""\
Definition sources : list source := [{"; ".join(map(_source, self.sources))}].
Definition factors : list (nat * list Z) := [{"; ".join(factors)}].
Definition written : list (nat * form) := [
   {(";" + chr(10) + "   ").join(written)}].
Definition forms := Eval vm_compute in fill core sources factors written [] (firstn {self.last} core).
"""

    def _placed(self) -> list[tuple[int, SectionForms]]:
        places = [index for index, stage in enumerate(self.graph.stages) if stage.role == "section"]
        return list(zip(places, self.sections, strict=True))


def _source(source: Source) -> str:
    kind, node, bits = source
    if kind == "node":
        return f"Of {node}"
    return f"{'Rounding' if kind == 'floor' else 'Truncation'} {node} {number(bits)}"


def cascade_of(graph: FlatGraph) -> Cascade:
    """Find the forms of all sections.

    Raises
    ------
    RejectedError
        If a section is not linear.
    """
    places = [index for index, stage in enumerate(graph.stages) if stage.role == "section"]
    first = places[0]
    entries = graph.feeds[first] if first else inputs_of(graph.stages[0])
    wires: list[Row] = [{("node", entry, 0): [Fraction(1)]} for entry in entries]
    under: Polynomial = [Fraction(1)]
    sources: dict[Source, None] = {("node", entry, 0): None for entry in entries}
    sections = []
    for place in places:
        made, under, wires = _section(graph, place, under, wires)
        sections.append(made)
        for row in made.forms.values():
            sources.update(dict.fromkeys(row))
    return Cascade(
        graph,
        max(graph.offsets[first], max(entries) + 1),
        graph.offsets[places[-1] + 1],
        list(dict.fromkeys(entries)),
        list(sources),
        sections,
    )


def _section(
    graph: FlatGraph, place: int, before: Polynomial, wires: list[Row]
) -> tuple[SectionForms, Polynomial, list[Row]]:
    stage, offset = graph.stages[place], graph.offsets[place]
    model = LinearStage(stage)
    arriving = {("node", at, 0): row for at, row in zip(inputs_of(stage), wires, strict=True)}
    forms: dict[int, Row] = {}
    for at in range(len(stage.nodes)):
        row: Row = {}
        for source in model.sources:
            through = model.numerator(at, source)
            if not through:
                continue
            if source in arriving:
                parts = [(key, product(through, value)) for key, value in arriving[source].items()]
            else:
                kind, node, bits = source
                parts = [((kind, offset + node, bits), product(through, before))]
            for key, value in parts:
                row[key] = added(row.get(key, []), value)
        forms[offset + at] = row
    own = model.denominator
    scale = common_denominator([own, *(value for row in forms.values() for value in row.values())])
    whole = {node: {key: [value * scale for value in part] for key, part in row.items()} for node, row in forms.items()}
    factor = [value * scale for value in own]
    under = product(factor, before)
    targets = [
        offset + at
        for at, node in enumerate(stage.nodes)
        if node.op is Operation.BOUND
        and not node.low <= stage.nodes[node.operands[0]].low <= stage.nodes[node.operands[0]].high <= node.high
    ]
    made = SectionForms(integers(under, 1), integers(factor, 1), whole, targets)
    return made, under, [whole[offset + output] for output in stage.outputs]
