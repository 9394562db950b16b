"""The theorem on the error bound of a filter: for all inputs, against the exact filter of the certificate."""

from __future__ import annotations

from fractions import Fraction
from functools import reduce

from sosmith.verify.certificate_file import Certificate, Operation, StageEntry
from sosmith.verify.rocq.cascade import Cascade
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.polynomials import added, common_denominator, integers, number, numbers, product
from sosmith.verify.rocq.ranges import fits, reach
from sosmith.verify.rocq.witness import Witness, witness

_MORE_BITS = (0, 96, 256)
"""Precision beside what mostly decides a claim of a gain, tried in this order."""


def why_no_bound(certificate: Certificate) -> str | None:
    """Why the theorem cannot be written for this certificate; None if it can.

    Its ranges must be proven: it starts from zero.
    """
    if certificate.decimation is not None:
        return "there is a decimator"
    if certificate.ideal.polynomial is not None or certificate.stages[0].role != "section":
        return "there is a calibration or a scaling of the input"
    if not certificate.ideal.sections:
        return "there are no sections"
    if not _rounds(certificate.stages[-1]):
        return "the last stage is not one that rounds to nearest and limits"
    return None


def _rounds(stage: StageEntry) -> bool:
    """Whether a stage adds a half, rounds down and limits, as `rounds` of the theories wants."""
    wanted = [Operation.INPUT, Operation.CONSTANT, Operation.ADD, Operation.FLOOR, Operation.CLAMP]
    return [node.op for node in stage.nodes] == wanted and stage.outputs == (4,)


def bound_claim(certificate: Certificate, cascade: Cascade) -> Claim:
    """Write the theorem of a certificate for which `why_no_bound` has nothing to say."""
    graph, section, bound = cascade.graph, cascade.sections[-1], certificate.claims.bound
    (entry,) = cascade.entries
    exact = certificate.ideal.sections
    under = reduce(product, ([*one.denominator] for one in exact))
    unit = Fraction(2) ** -graph.stages[0].nodes[entry].frac
    over = [value * unit for value in reduce(product, ([*one.numerator] for one in exact))]
    scale = common_denominator([under, over])
    a, b = integers(under, scale), integers(over, scale)
    last = graph.feeds[-1][0]
    out = graph.offsets[-2] + certificate.stages[-1].outputs[0]
    chosen = _decided(cascade, a, b, last, bound)
    inner = numbers(section.under)
    port = certificate.output
    text = f"""\
(* The exact filter y, in units of the output's last place: exact_under * y = exact_over * x. *)
Definition exact_under : list Z := {numbers(a)}.
Definition exact_over : list Z := {numbers(b)}.
Theorem error_is_bounded : forall x, inputs_within ports x -> forall y : sequence,
  (forall n, conv exact_under y n = conv exact_over (fun m => IZR (x m 0%nat)) n) ->
  forall n, (Rabs (IZR (code core x {out} n) - limited (IZR {number(port.lowest)}) (IZR {number(port.highest)}) (y n))
    <= IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof.
  intros x X y Y. apply (error_bound core x sources factors forms {cascade.last} {cascade.first} {entry} {last} {out}
    exact_under exact_over (impulse (mul exact_under {inner}) {chosen.term}) ({chosen.whole}) _ _
    core_is_ordered sections_are_closed forms_fit sources_are_known); [|exact (ranges_before x X)|].
  - vm_cast_no_check (eq_refl true).
  - intros n. rewrite Y. apply conv_ext. intros m _. unfold signal.
    rewrite (code_spec core x core_is_ordered {entry} m); [reflexivity|]. apply Nat.ltb_lt. reflexivity.
Qed.
"""
    words = f"for all inputs the output is within {float(bound):.9g} of its last place of the exact filter, limited"
    return Claim("error_is_bounded", words, text)


def _decided(cascade: Cascade, a: list[int], b: list[int], last: int, bound: Fraction) -> Witness:
    """Return a witness that proves the bound, or that with the highest precision."""
    section = cascade.sections[-1]
    stage, offset = cascade.graph.stages[-2], cascade.graph.offsets[-3]
    unit = 1 << stage.nodes[last - offset].frac
    wide_a, wide_b = [Fraction(value) for value in a], [Fraction(value) for value in b]
    wide_d = [Fraction(value) for value in section.under]
    both = integers(product(wide_a, wide_d), 1)
    rows = {source: product(wide_a, value) for source, value in section.forms[last].items()}
    entry = ("node", cascade.entries[0], 0)
    rows[entry] = added(rows.get(entry, []), product(wide_d, wide_b), -unit)
    driven = [(reach(cascade.graph, source), integers(row, 1)) for source, row in rows.items()]
    most = unit * (2 * bound.numerator - bound.denominator)
    for extra in _MORE_BITS:
        chosen = witness(both, extra=extra)
        if fits(driven, chosen, (-most, most), 2 * bound.denominator):
            break
    return chosen
