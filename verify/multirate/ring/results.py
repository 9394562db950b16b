"""The results of a sample: the graphs that say what they must be, with one set of samples and one count for all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.graph_codes import GraphCodes, LanePorts
from sosmith.verify.program.normal_form import Form


class Result(NamedTuple):
    """A result of a sample: what it must be, and the node that counts samples since a start, if one does."""

    certificate: Certificate
    graph: GraphCodes
    lane: LanePorts
    counter: int | None


class Results:
    """All results of a sample, in their order.

    Parameters
    ----------
    certificates : sequence of Certificate
        Those of the results, with a downsampling; by 1 if there are several.
    forms : Forms
        The atoms of all graphs.

    Attributes
    ----------
    all : list of Result
    input : int
        The input, in each graph.
    remembered : int
        Samples that the graphs remember.

    Raises
    ------
    RejectedError
        If they do not take the same samples, or start differently.
    """

    def __init__(self, certificates: Sequence[Certificate], forms: Forms) -> None:
        self._forms = forms
        first, *others = certificates
        for other in others:
            self._check_alike(first, other)
        graphs = [GraphCodes(each, forms, space=space) for space, each in enumerate(certificates)]
        (self.input,) = graphs[0].lanes[0].inputs
        self.all, self.remembered = list[Result](), 0
        for certificate, graph in zip(certificates, graphs, strict=True):
            remembered, counter = self._memory_of(graph)
            self.remembered = max(self.remembered, remembered)
            self.all.append(Result(certificate, graph, graph.lanes[0], counter))
        for each in self.all[1:]:
            self._check_counts_alike(each)

    @property
    def first(self) -> Result:
        """The first result."""
        return self.all[0]

    def with_one_count(self, result: Result, form: Form) -> Form:
        """Return a form of a result's graph with the count of the first one's in place of its own."""
        if result.counter is None or self.first.counter is None:
            return form
        own, first = result.graph.origin(result.counter), self.first.graph.origin(self.first.counter)
        return form if own == first else self._forms.settled(form, {own: self.first.graph.codes[self.first.counter]})

    @staticmethod
    def _check_alike(first: Certificate, other: Certificate) -> None:
        downs = [each.downsampling for each in (first, other)]
        starts = [(down.factor, down.filled > 0) for down in downs if down is not None]
        require(starts[0] == (1, starts[0][1]), "only where all results leave may there be several of a sample")
        alike = starts[0] == starts[1] and (first.inputs, first.output) == (other.inputs, other.output)
        require(alike, f"{other.name} must have the streams and the start of {first.name}")

    def _memory_of(self, graph: GraphCodes) -> tuple[int, int | None]:
        """Return how many samples a graph remembers, and the node that counts those since a start, if one does."""
        remembered, counter = 0, None
        require(graph.lanes[0].inputs == (self.input,), "all results must have the same input")
        for index in graph.delays:
            node, ago = graph.origin(index)
            if node == self.input:
                remembered = max(remembered, ago)
            else:
                require(counter is None and ago == 1, "the graphs must remember samples alone, and their number")
                counter = index
        return remembered, counter

    def _check_counts_alike(self, result: Result) -> None:
        """Check that a result's graph counts the samples since a start as that of the first result does."""
        require((result.counter is None) == (self.first.counter is None), "all results must have the same flags")
        if result.counter is None:
            return
        counted = [(self._increment(each), self._most(each)) for each in (self.first, result)]
        require(counted[0] == counted[1], "all results must count the samples since a start alike")

    def _increment(self, result: Result) -> Form:
        if result.counter is None:
            raise RejectedError("all results must have the same flags")
        (operand,) = result.graph.nodes[result.counter].operands
        return self.with_one_count(result, result.graph.codes[operand])

    @staticmethod
    def _most(result: Result) -> int:
        assert result.counter is not None
        return result.graph.nodes[result.counter].entry.high
