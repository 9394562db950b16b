"""The stage that starts a filter from its first sample, as Rocq's `starts` knows it."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.verify.certificate_file import NodeEntry, Operation
from sosmith.verify.graph import inputs_of, require
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.flat import FlatGraph


@dataclass(frozen=True)
class StartNodes:
    """Places of the nodes of such a stage in the whole graph.

    Attributes
    ----------
    sample, change, held : int
        The input, how much it differs from the first sample, and that.
    term : str
        All of them as a term of Rocq.
    span : int
        Largest difference of two samples.
    """

    sample: int
    change: int
    held: int
    term: str
    span: int

    def claim(self) -> Claim:
        """Write the theorem on what is handed on."""
        text = f"""\
Definition begin : start := {self.term}.
Lemma start_fits_core : start_fits core begin = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Definition start_is : starts core begin = true := start_fits_starts _ _ start_fits_core.
Theorem starts_from_first : forall x n,
  code core x {self.change} n = code core x {self.sample} n - code core x {self.sample} 0
  /\\ code core x {self.held} n = code core x {self.sample} 0.
Proof. intros x n. exact (started_from core x begin core_is_ordered start_is n). Qed.
"""
        words = "the start hands on how much each sample differs from the first one, and that"
        return Claim("starts_from_first", words, text)


def start_of(graph: FlatGraph) -> StartNodes | None:
    """Find the nodes of the stage that starts a filter; None if there is no such stage.

    They are found from its first output on, by their operands. Whether they are a start is for Rocq to say.

    Raises
    ------
    RejectedError
        If there is such a stage, and it does not have one input.
    """
    places = [index for index, stage in enumerate(graph.stages) if stage.role == "start"]
    if not places:
        return None
    stage, offset = graph.stages[places[0]], graph.offsets[places[0]]
    nodes = stage.nodes
    inputs = inputs_of(stage)
    require(len(inputs) == 1, f"a start must have one input, not {len(inputs)}")
    (sample,) = inputs
    change = stage.outputs[0]
    difference = _operand(nodes, change)
    since, first = nodes[difference].operands if nodes[difference].op is Operation.SUBTRACT else (0, 0)
    held = _operand(nodes, first)
    remainder = _operand(nodes, held)
    factors = nodes[since].operands if nodes[since].op is Operation.MULTIPLY else (0, 0)
    started = next((at for at in factors if nodes[at].op is Operation.DELAY), 0)
    one = _operand(nodes, started)
    chosen = (sample, started, one, first, since, difference, change, remainder, held)
    term = f"Start {' '.join(str(offset + at) for at in chosen)}"
    span = nodes[sample].high - nodes[sample].low
    return StartNodes(offset + sample, offset + change, offset + held, term, span)


def _operand(nodes: tuple[NodeEntry, ...], at: int) -> int:
    return nodes[at].operands[0] if nodes[at].operands else at
