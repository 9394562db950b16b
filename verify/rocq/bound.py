"""The theorem on the error bound of a filter: for all inputs, against the exact filter of the certificate."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpz_poly

from sosmith.verify.certificate_file import Certificate, DownsamplingEntry, Operation
from sosmith.verify.graph import require
from sosmith.verify.rocq.cascade import Cascade, Row, Rows
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.entry import Entry, decimated_entry, direct_entry, real
from sosmith.verify.rocq.exact import ExactRow, exact_row, sections_of, sections_term
from sosmith.verify.rocq.polynomials import number
from sosmith.verify.rocq.ranges import Windows, negative, windows_of
from sosmith.verify.rocq.settling import Counter
from sosmith.verify.rocq.start import StartNodes

_MORE_BITS = (4, 12, 28, 60, 124)
"""Precision beside what the certificate's grid needs, tried in this order."""

GAIN_BITS = (96, 128, 192)
"""Precision of the coefficients for the gain of the exact filter, tried in this order."""

_FINE = 1 << 64
"""Limits of the exact filter's signals are in units of 1 over this."""


def why_no_bound(certificate: Certificate) -> str | None:
    """Why the theorem cannot be written for this certificate, whose ranges are proven; None if it can."""
    if not certificate.ideal.sections:
        return "there are no sections"
    if not _rounds(certificate):
        return "its output is not rounded"
    entry = certificate.decimation
    if entry is not None and entry.calibration is not None and entry.calibration.output.zero:
        return "the decimator takes values of which 0 has another code than 0"
    return None


def _rounds(certificate: Certificate) -> bool:
    """Whether the output is rounded, and then perhaps limited."""
    last = certificate.stages[-1]
    node = last.nodes[last.outputs[0]]
    if node.op is Operation.CLAMP:
        node = last.nodes[node.operands[0]]
    return node.op is Operation.FLOOR


@dataclass(frozen=True)
class _Task:
    """All that goes into the theorem but the precision."""

    certificate: Certificate
    cascade: Cascade
    start: StartNodes | None
    counter: Counter | None

    @property
    def wire(self) -> int:
        """The input of the first section."""
        return self.cascade.sources[self.cascade.sections[0].wires[0]][1]

    @property
    def taken(self) -> int:
        """The node with the samples."""
        return self.wire if self.start is None else self.start.sample

    @property
    def last(self) -> int:
        """The node of the last section that the output stage takes."""
        return self.cascade.graph.feeds[-1][0]

    @property
    def out(self) -> int:
        """The node with the output's code."""
        return self.cascade.graph.offsets[-2] + self.certificate.stages[-1].outputs[0]

    @property
    def held(self) -> int | None:
        """The node with the first sample, if that passes beside the sections."""
        return self.start.held if self.start is not None and len(self.cascade.graph.feeds[-1]) > 1 else None

    @property
    def offset(self) -> Fraction:
        """The physical value of the output's code 0, in units of its last place."""
        return self.certificate.output.zero / self.certificate.output.lsb


def bound_claims(
    certificate: Certificate, behind: Certificate, cascade: Cascade, start: StartNodes | None, counter: Counter | None
) -> Iterator[Claim]:
    """Write the theorems of a certificate for which `why_no_bound` has nothing to say.

    Parameters
    ----------
    certificate, behind : Certificate
        All of it, and what is behind its decimator, if there is one.
    cascade : Cascade
        Of what is behind.
    start : StartNodes or None
    counter : Counter or None
    """
    task = _Task(certificate, cascade, start, counter)
    entry = (
        direct_entry(certificate, cascade.graph, task.taken)
        if certificate.decimation is None
        else decimated_entry(certificate, behind, cascade.graph, task.taken)
    )
    yield from entry.claims
    parts = ", ".join(f"{name} {float(value):.3g}" for name, value in certificate.claims.budget.items())
    words = f"the output is that of the exact filter and errors, each within its part of the budget, limited: {parts}"
    yield Claim("error_in_parts", words, _parts(task, entry))
    yield Claim("bound_is_sum_of_parts", "the bound is the sum of the parts of the budget", _sum(certificate))
    bound = certificate.claims.bound
    words = f"for all inputs the output is within {float(bound):.9g} of its last place of the exact filter, limited"
    yield Claim("error_is_bounded", words, _bound(task, entry))
    if counter is not None:
        words = f"from sample {counter.samples} on, the same and half a code, whatever the inputs were before the start"
        yield Claim("settled", words, _settled(task, entry, counter))
    if certificate.downsampling is not None:
        every = certificate.downsampling.factor
        some = f"result that leaves, one for {every} samples" if every > 1 else "result"
        words = f"so is each {some}, of the exact filter from its first sample on"
        yield Claim("results_are_bounded", words, _results(task, entry, certificate.downsampling))
    error, unit = certificate.max_error, f" {certificate.output.unit}".rstrip()
    yield Claim("error_is_allowed", f"the bound is at most {float(error):.9g}{unit}", _allowed(certificate))
    gain = certificate.claims.peak_gain
    if gain is not None:
        yield Claim("peak_gain", f"gain of the exact filter at most {float(gain):.9g}", _peak_gain(certificate, gain))


_PARTS = (
    ("calibration", "input scaling", "decimation"),
    ("filter coefficients",),
    ("filter rounding",),
    ("start",),
    ("output rounding",),
)
"""Names of the parts of the budget, in the order of the theories."""


def _claimed(certificate: Certificate) -> list[Fraction]:
    """Return the claimed parts of the budget; 0 for those that it does not have."""
    budget = certificate.claims.budget
    return [sum((budget.get(name, Fraction(0)) for name in names), Fraction(0)) for names in _PARTS]


def _statement(task: _Task, entry: Entry) -> tuple[str, str]:
    """Return how the theorems begin, and the exact filter's output in them."""
    begins = "from_zero" if task.start is None else "from_first"
    head = f"""\
forall x, inputs_within {entry.ports} x ->
  forall y, exact_filter exact_sections ({begins} {entry.exact}) y -> forall n,"""
    return head, _exactly(task)


def _exactly(task: _Task) -> str:
    over = f"IZR {number(task.offset.numerator)} / IZR {task.offset.denominator}"
    return f"(y (Z.of_nat n) - {over})" if task.offset else "(y (Z.of_nat n))"


def _parts(task: _Task, entry: Entry) -> str:
    certificate, cascade, start, counter = task.certificate, task.cascade, task.start, task.counter
    rows, exact, more = _decided(task, entry)
    held = "None" if task.held is None else f"(Some {task.held}%nat)"
    parts = " ".join(f"({number(part.numerator)}, {part.denominator})" for part in _claimed(certificate))
    head, exactly = _statement(task, entry)
    places = f"Parts {task.out} {task.last} ({rows.plan}) {cascade.sections[0].wires[0]} {task.taken} {held}"
    error, out = entry.error, certificate.output
    settling = "None" if counter is None else f"(Some {counter.samples}%N)"
    first = "exact I"
    if task.held is not None:
        first = f"intros j; exact (proj2 (started_from core {entry.codes} begin core_is_ordered start_is j))"
    value = "0%R" if start is None else f"({entry.exact} 0%nat)"
    return f"""\
(* The sections of the exact filter, numerators and denominators. *)
Definition exact_sections : list (list Z * list Z) :=
  [{sections_term(sections_of(certificate.ideal.sections))[1:]}.
(* The claimed parts of the bound: at the input, by coefficients, by roundings, at the start, of the last rounding. *)
Definition claimed : budget := Budget {parts}.
Definition details : parts_ := {places} {"false" if start is None else "true"}
  {exact.parts}
  {entry.most} (2 ^ 64) {more} {error.numerator} {error.denominator} {settling}.
Lemma parts_are_claimed :
  parts_hold (parts_of core sources forms {cascade.last} window details exact_sections {_limits(task)}) claimed = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Theorem error_in_parts : {head} exists e, in_parts claimed e
    /\\ IZR (code core {entry.codes} {task.out} n)
      = limited (IZR {number(out.lowest)}) (IZR {number(out.highest)}) ({exactly} + e).
Proof.
  intros x X y Y n.
  destruct (error_parts core {entry.codes} sources forms {cascade.last} window details exact_sections
    {_limits(task)} claimed 0 {entry.exact} {_zero(task, entry.codes)} {value}
    core_is_ordered sections_are_closed forms_fit parts_are_claimed
    (every_code_in_range {entry.codes} {entry.within}) (window_is {entry.codes} {entry.within})
    ltac:({_first_input(task, entry.codes)}) (or_introl eq_refl) ltac:({_EASY}) ltac:({_EASY}) ltac:({first})
    (calibrated_input x X) y Y n I) as [e [t [P [_ [T E]]]]].
  exists e. split; [exact P|]. rewrite (T eq_refl), Rplus_0_r in E. {_tidied(task)}exact E.
Qed.
"""


_EASY = "unfold details; cbn [steady taken]; reflexivity"
"""How it is proven what `details` is."""


def _limits(task: _Task) -> str:
    port, offset = task.certificate.output, task.offset
    return f"{number(port.lowest)} {number(port.highest)} {number(offset.numerator)} {offset.denominator}"


def _tidied(task: _Task) -> str:
    return "" if task.offset else "replace (y (Z.of_nat n) - IZR 0 / IZR 1)%R with (y (Z.of_nat n)) in E by field. "


def _zero(task: _Task, codes: str) -> str:
    """Return what is taken off the samples before the sections."""
    return "0" if task.start is None else f"(code core {codes} {task.taken} 0)"


def _first_input(task: _Task, codes: str) -> str:
    """Return how it is proven that the sections take the samples less that."""
    if task.start is None:
        return "intros j; rewrite Rminus_0_r; reflexivity"
    return (
        f"intros j; apply (start_entry core {codes} begin {task.wire} j core_is_ordered start_is); "
        f"apply (wire_code core {codes} {task.wire} {task.start.change} j core_is_ordered); "
        f"vm_cast_no_check (eq_refl true)"
    )


def _difference(task: _Task, codes: str, at: str, exactly: str) -> str:
    port = task.certificate.output
    code = f"IZR (code core {codes} {task.out} {at})"
    return f"{code} - limited (IZR {number(port.lowest)}) (IZR {number(port.highest)}) {exactly}"


def _bound(task: _Task, entry: Entry) -> str:
    bound = task.certificate.claims.bound
    head, exactly = _statement(task, entry)
    return f"""\
Theorem error_is_bounded : {head}
  (Rabs ({_difference(task, entry.codes, "n", exactly)})
    <= IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof.
  intros x X y Y n. destruct (error_in_parts x X y Y n) as [e [P E]].
  eapply Rle_trans; [exact (within_sum claimed _ _ _ _ _ P E)|].
  rewrite bound_is_sum_of_parts. apply Rle_refl.
Qed.
"""


def _settled(task: _Task, entry: Entry, counter: Counter) -> str:
    """Write the theorem on what is left of anything before: of m samples that the exact filter did not see."""
    bound, samples = task.certificate.claims.bound, counter.samples
    codes, within = (re.sub(r"\bx\b", "z", text) for text in (entry.codes, entry.within))
    return f"""\
Theorem settled : forall z, inputs_within {entry.ports} z ->
  forall m y, exact_filter exact_sections (from_zero {entry.late}) y -> forall n, {samples} <= Z.of_nat n ->
  (Rabs ({_difference(task, codes, "(m + n)", _exactly(task))})
    <= IZR {number(bound.numerator)} / IZR {bound.denominator} + 1 / 2)%R.
Proof.
  intros z X m y Y n N.
  destruct (error_parts core {codes} sources forms {task.cascade.last} window details exact_sections
    {_limits(task)} claimed m {entry.late} {_zero(task, codes)} 0%R
    core_is_ordered sections_are_closed forms_fit parts_are_claimed
    (every_code_in_range {codes} {within}) (window_is {codes} {within})
    ltac:({_first_input(task, codes)}) (or_intror eq_refl) ltac:({_EASY}) ltac:({_EASY}) I
    (fun j => calibrated_input z X (m + j)%nat) y Y n
    ltac:(destruct m; [exact I|unfold details; cbn [settling_]; lia])) as [e [t [P [T [_ E]]]]].
  {_tidied(task)}rewrite <- bound_is_sum_of_parts. exact (within_late claimed _ _ _ _ _ _ P T E).
Qed.
"""


def _results(task: _Task, entry: Entry, kept: DownsamplingEntry) -> str:
    """Write the theorem on the results of a filter that decimates, which may fill its window with its first sample."""
    require(task.start is None, "a filter of which every R-th result leaves must start from zero")
    if not kept.filled:
        return _kept(task, entry, kept)
    bound, codes = task.certificate.claims.bound, f"(filled {kept.filled} {entry.codes})"
    exactly = _exactly(task).replace("(Z.of_nat n)", f"(Z.of_nat ({kept.factor} * n))")
    difference = _difference(task, codes, f"({kept.filled} + {kept.factor} * n)", exactly)
    return f"""\
Theorem results_are_bounded : forall x, inputs_within {entry.ports} x ->
  forall y, exact_filter exact_sections (from_first {entry.exact}) y -> forall n : nat,
  (Rabs ({difference})
    <= IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof.
  intros x X y Y n.
  destruct (filled_results exact_sections {kept.filled} {entry.exact} y ({kept.factor} * n) eq_refl Y) as [z [Z E]].
  rewrite <- E. exact (error_is_bounded {codes} (filled_within {kept.filled} {entry.ports} x X) z Z _).
Qed.
"""


def _kept(task: _Task, entry: Entry, kept: DownsamplingEntry) -> str:
    """Write the same of one that starts from zero."""
    bound, head = task.certificate.claims.bound, f"forall x, inputs_within {entry.ports} x ->"
    exactly = _exactly(task).replace("(Z.of_nat n)", f"(Z.of_nat ({kept.factor} * n))")
    difference = _difference(task, entry.codes, f"({kept.factor} * n)", exactly)
    return f"""\
Theorem results_are_bounded : {head}
  forall y, exact_filter exact_sections (from_zero {entry.exact}) y -> forall n : nat,
  (Rabs ({difference})
    <= IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof. intros x X y Y n. exact (error_is_bounded x X y Y _). Qed.
"""


def _sum(certificate: Certificate) -> str:
    bound = certificate.claims.bound
    return f"""\
Theorem bound_is_sum_of_parts : sum_of claimed = (IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof. unfold sum_of, real, claimed. cbn [fst snd of_input of_coefficients of_roundings of_start of_output]. lra. Qed.
"""


def _allowed(certificate: Certificate) -> str:
    parts = [real(value) for value in (certificate.claims.bound, certificate.output.lsb, certificate.max_error)]
    return f"""\
Theorem error_is_allowed : ({parts[0]} * {parts[1]} <= {parts[2]})%R.
Proof. lra. Qed.
"""


def _peak_gain(certificate: Certificate, claimed: Fraction) -> str:
    sections = sections_of(certificate.ideal.sections)
    for bits in GAIN_BITS:
        whole = 1 << 2 * bits
        made = exact_row(sections, _FINE, whole, bits)
        total = sum(abs(int(value)) for value in made.row.coeffs()) * _FINE + made.rest
        if total <= claimed * whole * _FINE:
            break
    p, q = number(claimed.numerator), claimed.denominator
    return f"""\
Theorem peak_gain : forall x y M, (0 <= M)%R -> exact_filter exact_sections x y -> (forall k, (Rabs (x k) <= M)%R) ->
  forall k, (Rabs (y k) <= IZR {p} / IZR {q} * M)%R.
Proof.
  apply (filter_gain exact_sections {made.parts} (2 ^ 64) (2 ^ {2 * bits})).
  vm_cast_no_check (eq_refl true).
Qed.
"""


def _decided(task: _Task, entry: Entry) -> tuple[Rows, ExactRow, int]:
    """Return rows that prove the bound, or those with the highest precision."""
    graph = task.cascade.graph
    last, index = graph.node(task.last), len(task.cascade.sections) - 1
    sections = sections_of(task.certificate.ideal.sections)
    size = max(abs(last.low), abs(last.high)).bit_length()
    for extra in _MORE_BITS:
        bits = 64 + 20 + size - last.frac + extra + task.cascade.bits_lost(index)
        rows = task.cascade.rows(index, task.last, bits)
        near = 84 + size - last.frac + extra
        more = max(near + 8 - (rows.whole.bit_length() - bits), 0)
        exact = exact_row(sections, entry.most * _FINE, rows.whole << more, near)
        if _fits(task, entry, rows, exact, more):
            break
    return rows, exact, more


def _fits(task: _Task, entry: Entry, rows: Rows, exact: ExactRow, more: int) -> bool:
    """Whether `parts_hold` of the theories holds, but for the last stage, which is taken for what it should be."""
    graph, windows = task.cascade.graph, windows_of(task.cascade, task.start)
    taken, last = graph.node(task.taken), graph.node(task.last)
    place = task.cascade.sections[0].wires[0]
    f, units, point, whole = max(taken.frac, 0), max(-taken.frac, 0), max(last.frac, 0), rows.whole << more
    up = f + more + point - last.frac
    others = {key: over * (1 << up) for key, over in rows.row.items()}
    entering = {place: others.pop(place, fmpz_poly()) - exact.row * (1 << point + units)}
    size = sum(abs(int(value)) for value in exact.row.coeffs())
    error = entry.error
    at_rest = Fraction(0)
    if task.start is not None:
        gain = _gain(task) if task.held is not None else Fraction(0)
        at_rest = abs(whole * gain - sum(int(value) for value in exact.row.coeffs())) * (1 << point + units)
    values: list[Fraction | int] = [
        -(-size * error.numerator // error.denominator) << point + f,
        _either(windows, entering) + ((exact.rest // _FINE + 1) << point + f),
        _either(windows, others) + (rows.rest << up),
        at_rest * max(abs(taken.low), abs(taken.high)),
    ]
    unit = whole << point + f
    return all(value <= claim * unit for value, claim in zip(values, _claimed(task.certificate), strict=False))


def _either(windows: Windows, row: Row) -> int:
    return max(windows.most(row), windows.most(negative(row)))


def _gain(task: _Task) -> Fraction:
    """Gain with which the last stage adds the first sample."""
    for node in task.certificate.stages[-1].nodes:
        if node.op is Operation.SCALE:
            return node.parameter * Fraction(2) ** -node.parameter_frac
    return Fraction(1)
