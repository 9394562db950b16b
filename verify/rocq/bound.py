"""The theorem on the error bound of a filter: for all inputs, against the exact filter of the certificate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpz_poly

from sosmith.verify.certificate_file import Certificate, Operation
from sosmith.verify.rocq.calibration import Calibration, calibration_of
from sosmith.verify.rocq.cascade import Cascade, Row, Rows
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.exact import ExactRow, exact_row, sections_of, sections_term
from sosmith.verify.rocq.polynomials import number
from sosmith.verify.rocq.ranges import Windows, negative, windows_of
from sosmith.verify.rocq.start import StartNodes

_MORE_BITS = (4, 12, 28, 60, 124)
"""Precision beside what the certificate's grid needs, tried in this order."""

_GAIN_BITS = (96, 128, 192)
"""Precision of the coefficients for the gain of the exact filter, tried in this order."""

_FINE = 1 << 64
"""Limits of the exact filter's signals are in units of 1 over this."""


def why_no_bound(certificate: Certificate) -> str | None:
    """Why the theorem cannot be written for this certificate, whose ranges are proven; None if it can."""
    if certificate.decimation is not None:
        return "there is a decimator"
    if not certificate.ideal.sections:
        return "there are no sections"
    return None


@dataclass(frozen=True)
class _Task:
    """All that goes into the theorem but the precision."""

    certificate: Certificate
    cascade: Cascade
    start: StartNodes | None

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


def bound_claims(certificate: Certificate, cascade: Cascade, start: StartNodes | None) -> Iterator[Claim]:
    """Write the theorem of a certificate for which `why_no_bound` has nothing to say."""
    task = _Task(certificate, cascade, start)
    calibration = calibration_of(certificate, cascade.graph, task.taken)
    words = f"the input of the filter is within {float(calibration.error):.9g} of the exact one"
    yield Claim("calibrated_input", words, _calibrated(task, calibration))
    parts = ", ".join(f"{name} {float(value):.3g}" for name, value in certificate.claims.budget.items())
    words = f"the output is that of the exact filter and errors, each within its part of the budget, limited: {parts}"
    yield Claim("error_in_parts", words, _parts(task, calibration))
    yield Claim("bound_is_sum_of_parts", "the bound is the sum of the parts of the budget", _sum(certificate))
    bound = certificate.claims.bound
    words = f"for all inputs the output is within {float(bound):.9g} of its last place of the exact filter, limited"
    yield Claim("error_is_bounded", words, _bound(task))
    error, unit = certificate.max_error, f" {certificate.output.unit}".rstrip()
    yield Claim("error_is_allowed", f"the bound is at most {float(error):.9g}{unit}", _allowed(certificate))
    gain = certificate.claims.peak_gain
    if gain is not None:
        yield Claim("peak_gain", f"gain of the exact filter at most {float(gain):.9g}", _peak_gain(certificate, gain))


def _calibrated(task: _Task, calibration: Calibration) -> str:
    two = len(task.certificate.inputs) > 1
    second = "x m 1%nat" if two else "0"
    codes, names = ("x m 0%nat) (x m 1%nat", "a b") if two else ("x m 0%nat", "a")
    error = calibration.error
    return f"""\
(* The exact input of the filter from the codes x of the inputs, in units of the output's last place. *)
Definition calibrated (x : nat -> Z) : R := (
{calibration.physical})%R.
Definition in_codes : list (list Z) := {calibration.whole}.
Lemma calibrated_in_codes : forall x m,
  calibrated (x m)
  = (IZR (ev2 in_codes (at_input ports x 0 m) (at_input ports x 1 m)) / IZR {calibration.denominator})%R.
Proof.
  intros x m. change (at_input ports x 0 m) with (x m 0%nat). change (at_input ports x 1 m) with ({second}).
  unfold calibrated. generalize ({codes}). intros {names}. unfold in_codes. cbn [ev2 ev1].
  cbv zeta. repeat (rewrite plus_IZR || rewrite mult_IZR). field.
Qed.
Theorem calibrated_input : forall x, inputs_within ports x -> forall m,
  (Rabs (calibrated (x m) - IZR (code core x {task.taken} m)
    * IZR (units_of (frac_of core {task.taken})) / IZR (steps_of (frac_of core {task.taken})))
    <= IZR {error.numerator} / IZR {error.denominator})%R /\\ (Rabs (calibrated (x m)) <= IZR {calibration.most})%R.
Proof.
  intros x X m. rewrite calibrated_in_codes. apply (calibrated_within core ports x core_is_ordered X).
  - apply Nat.leb_le. reflexivity.
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
Qed.
"""


_PARTS = (
    ("calibration", "input scaling"),
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


def _statement(task: _Task) -> tuple[str, str]:
    """Return how both theorems begin, and the exact filter's output in them."""
    begins = "from_zero" if task.start is None else "from_first"
    over = f"IZR {number(task.offset.numerator)} / IZR {task.offset.denominator}"
    value = f"(y (Z.of_nat n) - {over})" if task.offset else "(y (Z.of_nat n))"
    head = f"""\
forall x, inputs_within ports x ->
  forall y, exact_filter exact_sections ({begins} (fun n => calibrated (x n))) y -> forall n,"""
    return head, value


def _parts(task: _Task, calibration: Calibration) -> str:
    certificate, cascade, start = task.certificate, task.cascade, task.start
    port, offset = certificate.output, task.offset
    rows, exact, more = _decided(task, calibration)
    held = "None" if task.held is None else f"(Some {task.held}%nat)"
    limits = f"{number(port.lowest)} {number(port.highest)} {number(offset.numerator)} {offset.denominator}"
    if start is None:
        entry = "intros n. rewrite Rminus_0_r. reflexivity"
    else:
        entry = (
            f"intros n. apply (start_entry core x begin {task.wire} n core_is_ordered start_is). "
            f"apply (wire_code core x {task.wire} {start.change} n core_is_ordered). vm_cast_no_check (eq_refl true)"
        )
    first = "exact I"
    if task.held is not None:
        first = "intros n. exact (proj2 (started_from core x begin core_is_ordered start_is n))"
    zero = "0" if start is None else f"(code core x {task.taken} 0)"
    value = "0%R" if start is None else "(calibrated (x 0%nat))"
    parts = " ".join(f"({number(part.numerator)}, {part.denominator})" for part in _claimed(certificate))
    head, exactly = _statement(task)
    places = f"Parts {task.out} {task.last} ({rows.plan}) {cascade.sections[0].wires[0]} {task.taken} {held}"
    error = calibration.error
    rewritten = "" if offset else "replace (y (Z.of_nat n)) with (y (Z.of_nat n) - IZR 0 / IZR 1)%R by field. "
    return f"""\
(* The sections of the exact filter, numerators and denominators. *)
Definition exact_sections : list (list Z * list Z) :=
  [{sections_term(sections_of(certificate.ideal.sections))[1:]}.
(* The claimed parts of the bound: at the input, by coefficients, by roundings, at the start, of the last rounding. *)
Definition claimed : budget := Budget {parts}.
Definition details : parts_ := {places} {"false" if start is None else "true"}
  {exact.parts}
  {calibration.most} (2 ^ 64) {more} {error.numerator} {error.denominator}.
Theorem error_in_parts : {head} exists e, in_parts claimed e
    /\\ IZR (code core x {task.out} n)
      = limited (IZR {number(port.lowest)}) (IZR {number(port.highest)}) ({exactly} + e).
Proof.
  intros x X y Y n. {rewritten}revert n. revert y Y.
  apply (error_parts core x sources forms {cascade.last} window details exact_sections {limits} claimed
    (fun n => calibrated (x n)) {zero} {value} core_is_ordered sections_are_closed forms_fit).
  - vm_cast_no_check (eq_refl true).
  - exact (every_code_in_range x X).
  - exact (window_is x X).
  - {entry}.
  - unfold details. cbn [steady taken]. reflexivity.
  - unfold details. cbn [steady taken]. reflexivity.
  - {first}.
  - exact (calibrated_input x X).
Qed.
"""


def _bound(task: _Task) -> str:
    port, bound = task.certificate.output, task.certificate.claims.bound
    head, exactly = _statement(task)
    return f"""\
Theorem error_is_bounded : {head}
  (Rabs (IZR (code core x {task.out} n) - limited (IZR {number(port.lowest)}) (IZR {number(port.highest)}) {exactly})
    <= IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof.
  intros x X y Y n. destruct (error_in_parts x X y Y n) as [e [P E]].
  eapply Rle_trans; [exact (within_sum claimed _ _ _ _ _ P E)|].
  rewrite bound_is_sum_of_parts. apply Rle_refl.
Qed.
"""


def _sum(certificate: Certificate) -> str:
    bound = certificate.claims.bound
    return f"""\
Theorem bound_is_sum_of_parts : sum_of claimed = (IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof. unfold sum_of, real, claimed. cbn [fst snd of_input of_coefficients of_roundings of_start of_output]. lra. Qed.
"""


def _allowed(certificate: Certificate) -> str:
    def real(value: Fraction) -> str:
        return f"IZR {number(value.numerator)} / IZR {value.denominator}"

    parts = [real(value) for value in (certificate.claims.bound, certificate.output.lsb, certificate.max_error)]
    return f"""\
Theorem error_is_allowed : ({parts[0]} * ({parts[1]}) <= {parts[2]})%R.
Proof. lra. Qed.
"""


def _peak_gain(certificate: Certificate, claimed: Fraction) -> str:
    sections = sections_of(certificate.ideal.sections)
    for bits in _GAIN_BITS:
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


def _decided(task: _Task, calibration: Calibration) -> tuple[Rows, ExactRow, int]:
    """Return rows that prove the bound, or those with the highest precision."""
    graph = task.cascade.graph
    last, index = graph.node(task.last), len(task.cascade.sections) - 1
    sections = sections_of(task.certificate.ideal.sections)
    size = max(abs(last.low), abs(last.high)).bit_length()
    for extra in _MORE_BITS:
        bits = 64 + 20 + size - last.frac + extra
        rows = task.cascade.rows(index, task.last, bits)
        near = 84 + size - last.frac + extra
        more = max(near + 8 - (rows.whole.bit_length() - bits), 0)
        exact = exact_row(sections, calibration.most * _FINE, rows.whole << more, near)
        if _fits(task, calibration, rows, exact, more):
            break
    return rows, exact, more


def _fits(task: _Task, calibration: Calibration, rows: Rows, exact: ExactRow, more: int) -> bool:
    """Whether `parts_hold` of the theories holds, but for the last stage, which is taken for what it should be."""
    graph, windows = task.cascade.graph, windows_of(task.cascade, task.start)
    taken, last = graph.node(task.taken), graph.node(task.last)
    entry = task.cascade.sections[0].wires[0]
    f, units, point, whole = max(taken.frac, 0), max(-taken.frac, 0), max(last.frac, 0), rows.whole << more
    up = f + more + point - last.frac
    others = {place: over * (1 << up) for place, over in rows.row.items()}
    entering = {entry: others.pop(entry, fmpz_poly()) - exact.row * (1 << point + units)}
    size = sum(abs(int(value)) for value in exact.row.coeffs())
    error = calibration.error
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
