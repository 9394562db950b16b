"""The counter that flags the first samples of a filter from zero, as Rocq's `counts` knows it."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import require
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.flat import FlatGraph


@dataclass(frozen=True)
class Counter:
    """Such a counter.

    Attributes
    ----------
    samples : int
        How many are flagged.
    flag, next : int
        Places of its output and of its next state in the whole graph.
    term : str
        All its nodes as a term of Rocq.
    """

    samples: int
    flag: int
    next: int
    term: str

    def claim(self) -> Claim:
        """Write the theorem on what is flagged."""
        text = f"""\
Definition flags : counter := {self.term}.
Lemma flags_count : counts core flags {self.samples} = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Theorem flagged : forall x n, code core x {self.flag} n = (if Z.of_nat n <? {self.samples} then -1 else 0).
Proof. intros x n. exact (proj1 (flagged_from core x flags {self.samples} core_is_ordered flags_count n)). Qed.
"""
        return Claim("flagged", f"exactly the first {self.samples} samples are flagged as settling", text)


def counter_of(certificate: Certificate, graph: FlatGraph) -> Counter | None:
    """Find the nodes of the counter; None if settling is not claimed.

    They are found from the flag on, by their operands. Whether they are a counter is for Rocq to say.

    Raises
    ------
    RejectedError
        If it is claimed, and there is no flag.
    """
    samples = certificate.claims.settling
    if samples is None:
        return None
    stage, offset = certificate.stages[-1], graph.offsets[-2]
    require(len(stage.outputs) == 2, f"{stage.name} must have a code and a flag as outputs, not {len(stage.outputs)}")
    nodes = stage.nodes

    def operand(at: int, place: int = 0) -> int:
        found = nodes[at].operands
        return found[place] if place < len(found) else at

    flag = stage.outputs[1]
    shifted = operand(flag)
    left = operand(shifted)
    counted, count = operand(left), operand(left, 1)
    following = operand(counted)
    total = operand(following)
    chosen = (counted, count, left, shifted, flag, total, following)
    term = f"Counter {' '.join(str(offset + at) for at in chosen)}"
    return Counter(samples, offset + flag, offset + following, term)
