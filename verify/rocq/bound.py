"""The theorem on the error bound of a filter: for all inputs, against the exact filter of the certificate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpz_poly

from sosmith.verify.certificate_file import Certificate, Operation
from sosmith.verify.rocq.calibration import Calibration, calibration_of
from sosmith.verify.rocq.cascade import Cascade, Rows
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.exact import ExactRow, exact_row, sections_of, sections_term
from sosmith.verify.rocq.polynomials import number
from sosmith.verify.rocq.ranges import negative, windows_of
from sosmith.verify.rocq.start import StartNodes

_MORE_BITS = (4, 12, 28, 60, 124)
"""Precision beside what the certificate's grid needs, tried in this order."""

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
    bound = certificate.claims.bound
    words = f"for all inputs the output is within {float(bound):.9g} of its last place of the exact filter, limited"
    yield Claim("error_is_bounded", words, _theorem(task, calibration))


def _calibrated(task: _Task, calibration: Calibration) -> str:
    second = "x m 1%nat" if len(task.certificate.inputs) > 1 else "0"
    codes = "x m 0%nat" if second == "0" else "x m 0%nat) (x m 1%nat"
    names = "a" if second == "0" else "a b"
    cases = " | ".join(["[|m]"] if second == "0" else ["[|[|m]]"])
    del cases
    error = calibration.error
    return f"""\
(* The exact input of the filter from the codes x of the inputs, in units of the output's last place. *)
Definition calibrated (x : nat -> Z) : R := (
{calibration.physical})%R.
Definition in_codes : list (list Z) := {calibration.whole}.
Lemma calibrated_in_codes : forall x m,
  calibrated (x m) = (IZR (ev2 in_codes (at_input ports x 0 m) (at_input ports x 1 m)) / IZR {calibration.denominator})%R.
Proof.
  intros x m. change (at_input ports x 0 m) with (x m 0%nat). change (at_input ports x 1 m) with ({second}).
  unfold calibrated. generalize ({codes}). intros {names}. unfold in_codes. cbn [ev2 ev1].
  rewrite ?plus_IZR, ?mult_IZR. cbv zeta. rewrite ?plus_IZR, ?mult_IZR. field.
Qed.
Theorem calibrated_input : forall x, inputs_within ports x -> forall m,
  (Rabs (calibrated (x m) - IZR (code core x {task.taken} m) / IZR (2 ^ frac_of core {task.taken})%Z)
    <= IZR {error.numerator} / IZR {error.denominator})%R /\\ (Rabs (calibrated (x m)) <= IZR {calibration.most})%R.
Proof.
  intros x X m. rewrite calibrated_in_codes. apply (calibrated_within core ports x core_is_ordered X).
  - apply Nat.leb_le. reflexivity.
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
Qed.
"""


def _theorem(task: _Task, calibration: Calibration) -> str:
    certificate, cascade, start = task.certificate, task.cascade, task.start
    port, bound, offset = certificate.output, certificate.claims.bound, task.offset
    rows, exact, more = _decided(task, calibration)
    steady = start is not None
    begins = "from_first" if steady else "from_zero"
    held = "None" if task.held is None else f"(Some {task.held}%nat)"
    limits = f"{number(port.lowest)} {number(port.highest)}"
    if start is None:
        entry = "intros n. rewrite Rminus_0_r. reflexivity"
    else:
        entry = (
            f"intros n. apply (start_entry core x begin {task.wire} n core_is_ordered "
            f"(start_fits_starts _ _ start_fits_core)). apply (wire_code core x {task.wire} {start.change} n "
            "core_is_ordered). vm_cast_no_check (eq_refl true)"
        )
    first = (
        "intros n. exact (proj2 (started_from core x begin core_is_ordered (start_fits_starts _ _ start_fits_core) n))"
        if task.held is not None
        else "exact I"
    )
    zero = f"(code core x {task.taken} 0)" if steady else "0"
    value = "(calibrated (x 0%nat))" if steady else "0%R"
    return f"""\
(* The sections of the exact filter, numerators and denominators. *)
Definition exact_sections : list (list Z * list Z) :=
  [{sections_term(sections_of(certificate.ideal.sections))[1:]}.
Definition details : parts_ := Parts {task.out} {task.last} ({rows.plan}) {cascade.sections[0].wires[0]} {task.taken} {held}
  {"true" if steady else "false"}
  {exact.parts}
  {calibration.most} (2 ^ 64) {more} {calibration.error.numerator} {calibration.error.denominator}.
Theorem error_is_bounded : forall x, inputs_within ports x ->
  forall y, exact_filter exact_sections ({begins} (fun n => calibrated (x n))) y ->
  forall n, (Rabs (IZR (code core x {task.out} n)
      - limited (IZR {number(port.lowest)}) (IZR {number(port.highest)}) (y (Z.of_nat n) - IZR {number(offset.numerator)} / IZR {offset.denominator}))
    <= IZR {number(bound.numerator)} / IZR {bound.denominator})%R.
Proof.
  intros x X. apply (error_bound core x sources forms {cascade.last} window details exact_sections {limits}
    {number(offset.numerator)} {offset.denominator} {number(bound.numerator)} {bound.denominator} (fun n => calibrated (x n)) {zero} {value}
    core_is_ordered sections_are_closed forms_fit).
  - vm_cast_no_check (eq_refl true).
  - exact (every_code_in_range x X).
  - exact (window_is x X).
  - {entry}.
  - reflexivity.
  - reflexivity.
  - {first}.
  - exact (calibrated_input x X).
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
    """Whether `error_holds` of the theories holds, but for the last stage, which is taken for what it should be."""
    graph, windows = task.cascade.graph, windows_of(task.cascade, task.start)
    taken, last = graph.node(task.taken), graph.node(task.last)
    entry = task.cascade.sections[0].wires[0]
    f, unit = taken.frac, last.frac
    both = {place: over * (1 << f + more) for place, over in rows.row.items()}
    both[entry] = both.get(entry, fmpz_poly()) - exact.row * (1 << unit)
    whole = rows.whole << more
    total = max(windows.most(both), windows.most(negative(both)))
    if task.start is not None:
        gain = _gain(task) if task.held is not None else Fraction(0)
        at_rest = abs(whole * gain - sum(int(value) for value in exact.row.coeffs()))
        total += int(at_rest * (1 << unit)) * max(abs(taken.low), abs(taken.high))
    total += (rows.rest << f + more)
    size = sum(abs(int(value)) for value in exact.row.coeffs())
    error = calibration.error
    total += (size * error.numerator // error.denominator + 1 + exact.rest // _FINE + 1) << unit + f
    return Fraction(total, whole << unit + f) + Fraction(1, 2) <= task.certificate.claims.bound


def _gain(task: _Task) -> Fraction:
    """Gain with which the last stage adds the first sample."""
    for node in task.certificate.stages[-1].nodes:
        if node.op is Operation.SCALE:
            return node.parameter * Fraction(2) ** -node.parameter_frac
    return Fraction(1)
