"""What the nodes of a certificate's stages are worth, as forms."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from sosmith.verify.c_model.forms import Form, Forms, number, scaled, total
from sosmith.verify.certificate_file import Operation, PortEntry, StageEntry
from sosmith.verify.graph import inputs_of, label, require

Place = tuple[int, int]
"""A node by its stage and its index; inputs have the stage -1."""

_KEPT = {Operation.SHIFT, Operation.BOUND}
"""Operations that keep the code."""

_MOST_TERMS = 64
"""Terms of a form from which on its node is a variable, if a text declares it."""


@dataclass
class Worths:
    """The forms of nodes, computed as they are asked for.

    A node is a variable if it feeds itself back through delays and is what a delay takes, or if its form is long and
    the node is declared: a text then has to compute it, and `computed` says from what. Other nodes are what they are
    computed from.

    Attributes
    ----------
    stages : sequence of StageEntry
        In a chain.
    inputs : sequence of PortEntry
        What the first of them takes.
    declared : collection of Place
        The nodes that the text declares.
    forms : Forms
    """

    stages: Sequence[StageEntry]
    inputs: Sequence[PortEntry]
    declared: Collection[Place]
    forms: Forms = field(default_factory=Forms)
    _computed: dict[Place, Form] = field(default_factory=dict)
    _fed_back: dict[int, set[int]] = field(default_factory=dict)

    def input(self, index: int) -> Form:
        """Return the form of what comes in."""
        port = self.inputs[index]
        return self.forms.variable(("input", index), port.lowest, port.highest)

    def worth(self, place: Place) -> Form:
        """Return the form of a node."""
        place = self._base(place)
        stage, index = place
        if index in self._feedback(stage):
            return self._variable(place)
        form = self.computed(place)
        return self._variable(place) if len(form) > _MOST_TERMS and place in self._declared_bases else form

    @cached_property
    def _declared_bases(self) -> set[Place]:
        known = [(s, i) for s, i in self.declared if s < len(self.stages) and i < len(self.stages[s].nodes)]
        return {self._base(place) for place in known}

    def _base(self, place: Place) -> Place:
        """Return the node whose code a node keeps."""
        stage, index = place
        nodes = self.stages[stage].nodes
        while nodes[index].op in _KEPT:
            index = nodes[index].operands[0]
        return stage, index

    def _variable(self, place: Place) -> Form:
        node = self.stages[place[0]].nodes[place[1]]
        return self.forms.variable(place, node.low, node.high)

    def computed(self, place: Place) -> Form:
        """Return the form of what a node computes from other nodes.

        Raises
        ------
        RejectedError
            If nothing but delays feed each other.
        """
        place = self._base(place)
        waiting = [place]
        while waiting:
            if waiting[-1] in self._computed:
                waiting.pop()
                continue
            before = [each for each in self._before(waiting[-1]) if each not in self._computed]
            if before:
                waiting += before
            else:
                each = waiting.pop()
                self._computed[each] = self._form(each)
        return self._computed[place]

    def _before(self, place: Place) -> Iterator[Place]:
        """Return the nodes whose forms that of a node is made of."""
        stage, index = place
        node = self.stages[stage].nodes[index]
        if node.op is Operation.INPUT and stage:
            entry = inputs_of(self.stages[stage]).index(index)
            yield from self._expanded(stage - 1, (self.stages[stage - 1].outputs[entry],))
        yield from self._expanded(stage, node.operands)

    def _expanded(self, stage: int, indices: Sequence[int]) -> Iterator[Place]:
        bases = (self._base((stage, index)) for index in indices)
        yield from (place for place in bases if place[1] not in self._feedback(stage))

    def _feedback(self, stage: int) -> set[int]:
        """Return the nodes of a stage that delays take and that depend on their own past."""
        if stage not in self._fed_back:
            entry = self.stages[stage]
            sources = {_undelayed(entry, i) for i, node in enumerate(entry.nodes) if node.op is Operation.DELAY}
            self._fed_back[stage] = {index for index in sources if _depends_on_itself(entry, index)}
        return self._fed_back[stage]

    def _form(self, place: Place) -> Form:
        stage, index = place
        entry, forms = self.stages[stage], self.forms
        node = entry.nodes[index]
        if node.op is Operation.CONSTANT:
            return number(node.parameter)
        if node.op is Operation.INPUT:
            taken = inputs_of(entry).index(index)
            return self.worth((stage - 1, self.stages[stage - 1].outputs[taken])) if stage else self.input(taken)
        operands = [entry.nodes[i] for i in node.operands]
        given = [self.worth((stage, i)) for i in node.operands]
        if node.op in {Operation.ADD, Operation.SUBTRACT}:
            sign = 1 if node.op is Operation.ADD else -1
            a, b = (1 << node.frac - operand.frac for operand in operands)
            return total((given[0], a), (given[1], sign * b))
        if node.op is Operation.MULTIPLY:
            return forms.product(*given)
        if node.op is Operation.SCALE:
            return scaled(given[0], node.parameter)
        if node.op is Operation.FLOOR:
            return forms.shifted(given[0], operands[0].frac - node.frac)
        if node.op is Operation.FRACTION:
            return forms.masked(given[0], operands[0].frac - node.parameter)
        if node.op is Operation.TRUNCATE:
            return forms.quotient(given[0], 1 << operands[0].frac - node.frac)
        if node.op is Operation.CLAMP:
            low, high = number(node.low), number(node.high)
            return forms.choice("<", given[0], low, low, forms.choice(">", given[0], high, high, given[0]))
        return forms.past(given[0])


def _undelayed(stage: StageEntry, index: int) -> int:
    """Return the node that a node is a delayed copy of."""
    passed = set()
    while stage.nodes[index].op in {Operation.DELAY, *_KEPT}:
        require(index not in passed, f"{label(stage, index)} must not be fed by delays alone")
        passed.add(index)
        index = stage.nodes[index].operands[0]
    return index


def _depends_on_itself(stage: StageEntry, index: int) -> bool:
    reached: set[int] = set()
    waiting = list(stage.nodes[index].operands)
    while waiting:
        each = waiting.pop()
        if each == index:
            return True
        if each not in reached:
            reached.add(each)
            waiting += stage.nodes[each].operands
    return False
