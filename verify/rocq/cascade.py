"""The cascade of sections as forms: each node as a quotient of polynomials to the inputs and roundings of its section.

Nothing proven depends on this: Rocq checks each form against the graph.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flint import fmpz_poly

from sosmith.verify.certificate_file import Operation
from sosmith.verify.graph import inputs_of
from sosmith.verify.rocq.flat import FlatGraph, used_inputs
from sosmith.verify.rocq.linear import LinearStage, Source
from sosmith.verify.rocq.polynomials import common_denominator, integers, number, numbers, rows
from sosmith.verify.rocq.responses import divide, impulse, split

_WRITTEN = {Operation.DELAY, Operation.FRACTION, Operation.CONSTANT, Operation.INPUT}
"""Nodes whose forms are written out; Rocq derives the others from theirs."""

Row = dict[int, fmpz_poly]
"""Polynomials by the place of the source that each acts on."""


@dataclass(frozen=True)
class Section:
    """A section, with its nodes counted in the whole graph.

    Attributes
    ----------
    under : list of int
        The denominator of all its nodes, which begins with a power of two.
    forms : mapping from node to Row
        Numerators of what it computes.
    wires : list of int
        Places of the sources that are its inputs.
    targets : list of int
        Nodes whose range needs a peak gain.
    known : int
        All nodes before this one have known ranges when those of this section are looked for.
    """

    under: list[int]
    forms: Mapping[int, Row]
    wires: list[int]
    targets: list[int]
    known: int


@dataclass(frozen=True)
class Rows:
    """What Rocq's `rows_of` finds of a node: ``K code = row * sources``, within `rest`; and the plan it follows."""

    row: Row
    rest: int
    whole: int
    plan: str


@dataclass(frozen=True)
class Cascade:
    """Forms of all sections.

    Attributes
    ----------
    graph : FlatGraph
    last : int
        The first node behind the sections.
    sources : list of Source
    sections : list of Section
    """

    graph: FlatGraph
    last: int
    sources: list[Source]
    sections: list[Section]

    def definitions(self) -> str:
        """Write sources and forms as terms of Rocq."""
        written: list[str] = []
        for section in self.sections:
            for node, form in section.forms.items():
                if self.graph.node(node).op in _WRITTEN:
                    written.append(f"({node}%nat, Form {numbers(section.under)} {_row(form)})")
        return f"""\
(* What drives the sections, and each code as a quotient to these, D * code = N1 * u1 + ...: a help, all checked. *)
Definition sources : list source := [{"; ".join(map(_source, self.sources))}].
Definition written : list (nat * form) := [
   {(";" + chr(10) + "   ").join(written)}].
Definition forms := Eval vm_compute in fill core sources written [] (firstn {self.last} core).
"""

    def rows(self, section: int, node: int, bits: int) -> Rows:
        """Follow `rows_of`: the response of a node of a section, its first sample being ``2**bits``.

        Of a node that no section computes there is none, and what a section takes of one stays as it is.
        """
        at = self.sections[section]
        exponent, tail = split(at.under)
        first = impulse(exponent, tail, 1 << bits)
        row = _times(self._form(section, node), first.values)
        rest = first.rest * self._size(node)
        steps = []
        for index in range(section, 0, -1):
            for place in self.sections[index].wires:
                wire = self.sources[place][1]
                before = self._computes(self.graph.fed_by(wire), index)
                if not row.get(place) or before is None:
                    continue
                exponent, tail = split(self.sections[before].under)
                moved = divide(exponent, tail, [int(value) for value in row.pop(place).coeffs()])
                steps.append(f"({place}%nat, {moved.samples}%N)")
                for key, value in _times(self._form(before, self.graph.fed_by(wire)), moved.values).items():
                    row[key] = row.get(key, fmpz_poly()) + value
                rest += moved.rest * self._size(wire)
        plan = f"Plan {first.samples} (2 ^ {bits}) [{'; '.join(steps)}]"
        return Rows(row, rest, 1 << bits + split(at.under)[0], plan)

    def bits_lost(self, section: int) -> int:
        """By how many bits the largest first coefficient up to a section exceeds its own: what rows lose on the way."""
        first = [split(one.under)[0] for one in self.sections[: section + 1]]
        return max(first) - first[-1]

    def _computes(self, node: int, section: int) -> int | None:
        """Return the section before another one that computes a node."""
        return next((at for at in range(section) if node in self.sections[at].forms), None)

    def _form(self, section: int, node: int) -> Row:
        return self.sections[section].forms.get(node, {})

    def _size(self, node: int) -> int:
        entry = self.graph.node(node)
        return max(abs(entry.low), abs(entry.high))


def _times(form: Row, values: list[int]) -> Row:
    response = fmpz_poly(values)
    return {key: over * response for key, over in form.items()}


def _row(form: Row) -> str:
    return rows(
        [int(value) for value in form[k].coeffs()] if k in form else [] for k in range(max(form, default=-1) + 1)
    )


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
    sources: list[Source] = []
    sections = [_section(graph, place, sources) for place in places]
    return Cascade(graph, graph.offsets[places[-1] + 1], sources, sections)


def _section(graph: FlatGraph, place: int, sources: list[Source]) -> Section:
    stage, offset = graph.stages[place], graph.offsets[place]
    model = LinearStage(stage)
    inputs = used_inputs(stage)
    beside = set(inputs_of(stage)) - set(inputs)
    mine = {key: (key[0], offset + key[1], key[2]) for key in model.sources if key[1] not in beside or key[0] != "node"}
    start = len(sources)
    sources += mine.values()
    found = {
        node: {start + at: model.numerator(node, key) for at, key in enumerate(mine)}
        for node in range(len(stage.nodes))
        if node not in beside
    }
    own = model.denominator
    scale = common_denominator([own, *(value for row in found.values() for value in row.values())])
    forms = {
        offset + node: {key: fmpz_poly(integers(value, scale)) for key, value in row.items() if any(value)}
        for node, row in found.items()
    }
    wires = [start + at for at, key in enumerate(mine) if key[0] == "node" and key[1] in inputs]
    targets = [
        offset + at
        for at, node in enumerate(stage.nodes)
        if node.op is Operation.BOUND
        and not node.low <= stage.nodes[node.operands[0]].low <= stage.nodes[node.operands[0]].high <= node.high
    ]
    return Section(integers(own, scale), forms, wires, targets, offset + max(inputs, default=-1) + 1)
