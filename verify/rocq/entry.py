"""Theorems on what enters a filter: how near its codes are to the exact input, with and without a decimator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from sosmith.verify.certificate_file import Certificate, PortEntry
from sosmith.verify.multirate.decimation import calibration_alone
from sosmith.verify.rocq.calibration import Calibration, calibration_of, formula
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.flat import FlatGraph, flattened
from sosmith.verify.rocq.polynomials import number
from sosmith.verify.rocq.ranges import all_in_range, graph_claim, graph_definitions


@dataclass(frozen=True)
class Entry:
    """What enters a filter, as terms of Rocq.

    Attributes
    ----------
    claims : list of Claim
        The last one is `calibrated_input`.
    ports : str
        Ranges of the codes at the inputs.
    codes, within : str
        What the filter's graph takes of inputs `x`, and the proof that it is in its ranges of `X`, that these are.
    exact, late : str
        The exact input of the filter, and that of inputs `z` from sample `m` on.
    error : Fraction
        Bound on the difference of both, in the output's last places.
    most : int
        Bound on the exact input's magnitude.
    """

    claims: list[Claim]
    ports: str
    codes: str
    within: str
    exact: str
    late: str
    error: Fraction
    most: int


def real(value: Fraction) -> str:
    """Write a rational as a term of the real numbers."""
    return f"(IZR {number(value.numerator)} / IZR {value.denominator})"


def direct_entry(certificate: Certificate, graph: FlatGraph, taken: int) -> Entry:
    """Write the theorems for a filter whose graph takes the inputs themselves."""
    made = calibration_of(certificate, graph, taken)
    text = _followed("calibrated_input", ("calibrated", "core", "ports"), made, len(certificate.inputs), graph, taken)
    claims = [Claim("calibrated_input", _words(made.error), f"{_calibrated('calibrated', made.physical)}{text}")]
    exact, late = "(fun n => calibrated (x n))", "(fun n => calibrated (z (m + n)%nat))"
    return Entry(claims, "ports", "x", "X", exact, late, made.error, made.most)


def decimated_entry(certificate: Certificate, behind: Certificate, graph: FlatGraph, taken: int) -> Entry:
    """Write the theorems for a filter that takes what leaves a decimator.

    Parameters
    ----------
    certificate, behind : Certificate
        All of it, and what is behind the decimator.
    graph : FlatGraph
        Behind it.
    taken : int
        The node with the samples.
    """
    alone = calibration_alone(certificate)
    ports = certificate.inputs if alone is None else (alone.output,)
    claims = [_before(certificate, alone), _decimator(certificate, behind, ports[0], alone)]
    if alone is None:
        step, zero = (value / certificate.output.lsb for value in (ports[0].lsb, ports[0].zero))
        error = Fraction(0)
        most = max(abs(step * code + zero) for code in (ports[0].lowest, ports[0].highest))
    else:
        ahead = flattened(alone)
        place = ahead.offsets[-2] + alone.stages[-1].outputs[0]
        made = calibration_of(alone, ahead, place)
        claims += _ahead(alone, ahead, place, made)
        step, zero = alone.output.lsb / certificate.output.lsb, Fraction(0)
        error, most = made.error * step, made.most * step
    following = calibration_of(behind, graph, taken)
    half = behind.inputs[0].lsb / certificate.output.lsb / 2 if _dropped(certificate) else Fraction(0)
    whole = -int(-most // 1)
    total = error + half + following.error
    bounds = (step, zero, error, whole)
    text = _averaged(certificate, bounds, alone)
    text += _joined(certificate, bounds, half, total, behind, following, graph, taken)
    claims.append(Claim("calibrated_input", _words(total), text))
    exact, late = "(averaged_input x)", "(fun n => averaged_input z (m + n)%nat)"
    return Entry(claims, "given", "(decimated x)", "(decimated_within x X)", exact, late, total, whole)


def _words(error: Fraction) -> str:
    return f"the input of the filter is within {float(error):.9g} of the exact one"


def _calibrated(name: str, physical: str) -> str:
    return f"""\
(* The exact value of the codes x of the inputs, in units of the output's last place. *)
Definition {name} (x : nat -> Z) : R := (
{physical})%R.
"""


def _units(graph: str, node: int) -> str:
    return f"IZR (units_of (frac_of {graph} {node})) / IZR (steps_of (frac_of {graph} {node}))"


def _followed(
    name: str, terms: tuple[str, str, str], made: Calibration, inputs: int, graph: FlatGraph, node: int
) -> str:
    """Write that a node of a graph is near a function of the inputs' codes; `terms` are function, graph and ports."""
    function, core, ports = terms
    second = "x m 1%nat" if inputs > 1 else "0"
    codes, names = ("x m 0%nat) (x m 1%nat", "a b") if inputs > 1 else ("x m 0%nat", "a")
    error = made.error
    return f"""\
Definition {function}_in_codes : list (list Z) := {made.whole}.
Lemma {function}_is_polynomial : forall x m,
  {function} (x m) = (IZR (ev2 {function}_in_codes (at_input {ports} x 0 m) (at_input {ports} x 1 m))
    / IZR {made.denominator})%R.
Proof.
  intros x m. change (at_input {ports} x 0 m) with (x m 0%nat). change (at_input {ports} x 1 m) with ({second}).
  unfold {function}. generalize ({codes}). intros {names}. unfold {function}_in_codes. cbn [ev2 ev1].
  cbv zeta. repeat (rewrite plus_IZR || rewrite mult_IZR). field.
Qed.
Theorem {name} : forall x, inputs_within {ports} x -> forall m,
  (Rabs ({function} (x m) - IZR (code {core} x {node} m) * {_units(core, node)})
    <= IZR {error.numerator} / IZR {error.denominator})%R /\\ (Rabs ({function} (x m)) <= IZR {made.most})%R.
Proof.
  intros x X m. rewrite {function}_is_polynomial. apply (calibrated_within {core} {ports} x {core}_is_ordered X).
  - apply Nat.leb_le. reflexivity.
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
Qed.
"""


# With a decimator.


def _dropped(certificate: Certificate) -> int:
    entry = certificate.decimation
    return 0 if entry is None else entry.dropped


def _listed(ports: Sequence[PortEntry]) -> str:
    return "; ".join(f"({number(port.lowest)}, {number(port.highest)})" for port in ports)


def _given(certificate: Certificate) -> str:
    return f"""\
(* Ranges of the inputs, and what the decimator takes of their codes x. *)
Definition given : list (Z * Z) := [{_listed(certificate.inputs)}].
"""


def graph_ahead(alone: Certificate) -> tuple[FlatGraph, Claim]:
    """Return the graph of the calibration before the decimator, and the theorem that it is one."""
    graph = flattened(alone)
    claim = graph_claim(graph, "ahead", "given", " before the decimator")
    return graph, replace(claim, text=f"{_given(alone)}{graph_definitions(graph, 'ahead')}{claim.text}")


def _before(certificate: Certificate, alone: Certificate | None) -> Claim:
    """Write what the decimator takes: the input, or the output of the calibration's graph, in its range."""
    if alone is None:
        (port,) = certificate.inputs
        text = f"""\
{_given(certificate)}\
Definition taken_codes (x : nat -> nat -> Z) (n : nat) : Z := x n 0%nat.
Theorem taken_within : forall x, inputs_within given x ->
  forall n, {number(port.lowest)} <= taken_codes x n <= {number(port.highest)}.
Proof. intros x X n. exact (X n 0%nat (le_n 1)). Qed.
"""
        return Claim("taken_within", "ranges of what the decimator takes", text)
    graph, port = flattened(alone), alone.output
    place = graph.offsets[-2] + alone.stages[-1].outputs[0]
    text = f"""\
Definition taken_codes (x : nat -> nat -> Z) (n : nat) : Z := code ahead x {place} n.
Lemma ahead_is_tight : ranges_are_tight ahead given = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
{all_in_range("every_code_ahead_in_range", "ahead", "given", graph.size)}\
Theorem taken_within : forall x, inputs_within given x ->
  forall n, {number(port.lowest)} <= taken_codes x n <= {number(port.highest)}.
Proof.
  intros x X n. assert (H : (Nat.ltb {place} (length ahead)
    && Z.leb {number(port.lowest)} (low (nth {place} ahead blank))
    && Z.leb (high (nth {place} ahead blank)) {number(port.highest)})%bool = true) by (vm_cast_no_check (eq_refl true)).
  apply andb_prop in H. destruct H as [H T]. apply andb_prop in H. destruct H as [P L].
  apply Nat.ltb_lt in P. apply Z.leb_le in L. apply Z.leb_le in T.
  pose proof (every_code_ahead_in_range x X n {place} P) as B. unfold in_range in B. unfold taken_codes. lia.
Qed.
"""
    return Claim("taken_within", f"ranges of all {graph.size} nodes before the decimator", text)


def _decimator(certificate: Certificate, behind: Certificate, port: PortEntry, alone: Certificate | None) -> Claim:
    entry, (code,) = certificate.decimation, behind.inputs
    assert entry is not None
    signed, codes, at = "true" if port.signed else "false", _codes(certificate), _result(certificate, "n")
    low, high, *others = map(number, (port.lowest, port.highest, code.lowest, code.highest))
    ends = " ".join((low, high, *others))
    preceded = ""
    if certificate.ideal.start is None:
        preceded = f"""\
Lemma preceded_within : forall x, inputs_within given x -> forall n, {low} <= {codes} n <= {high}.
Proof.
  intros x X. apply (preceded_holds decimator_ (fun c => {low} <= c <= {high})); [lia|exact (taken_within x X)].
Qed.
"""
    text = f"""\
(* The decimator, and what the core takes of codes x of the inputs. *)
Definition decimator_ : decimator := Decimator {entry.factor} {entry.stages} {entry.width} {entry.dropped} {signed}.
Definition decimated (x : nat -> nat -> Z) (n p : nat) : Z := decimate decimator_ {codes} {at}.
Lemma decimator_is_fit : decimator_fits decimator_ {ends} = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
{preceded}\
Theorem decimated_within : forall x, inputs_within given x -> inputs_within ports (decimated x).
Proof.
  intros x X n [|p] P.
  - exact (decimate_within decimator_ {ends} {codes} decimator_is_fit {_within(certificate)} {at}).
  - simpl in P. inversion P as [|q Q]. inversion Q.
Qed.
"""
    return Claim("decimated_within", "what leaves the decimator is in the range of the core", text)


# From zero, the samples of one more result come before the first sample, all of them 0: result n is the next one.


def _codes(certificate: Certificate) -> str:
    """Write what the decimator works on of inputs `x`."""
    codes = "(taken_codes x)"
    return codes if certificate.ideal.start is not None else f"(preceded decimator_ 0%Z {codes})"


def _within(certificate: Certificate) -> str:
    """Write the proof that this is in its range."""
    return "(taken_within x X)" if certificate.ideal.start is not None else "(preceded_within x X)"


def _result(certificate: Certificate, n: str) -> str:
    """Write which of its results is number `n`."""
    return n if certificate.ideal.start is not None else f"(S {n})"


def _ahead(alone: Certificate, graph: FlatGraph, place: int, made: Calibration) -> list[Claim]:
    words = f"what the decimator takes is within {float(made.error):.9g} of its last place of the exact calibration"
    text = _calibrated("calibrated_ahead", made.physical) + _followed(
        "ahead_is_calibrated", ("calibrated_ahead", "ahead", "given"), made, len(alone.inputs), graph, place
    )
    claims = alone.claims
    parts = " + ".join(map(real, claims.budget.values())) or "0"
    bound = real(claims.bound)
    bounded = f"""\
Theorem ahead_is_bounded : ({real(made.error)} <= {bound} /\\ {bound} = {parts})%R.
Proof. split; lra. Qed.
"""
    return [
        Claim("ahead_is_calibrated", words, text),
        Claim("ahead_is_bounded", "that is within the bound of the calibration, the sum of its parts", bounded),
    ]


_Bounds = tuple[Fraction, Fraction, Fraction, int]


def _averaged(certificate: Certificate, bounds: _Bounds, alone: Certificate | None) -> str:
    """Write the exact input of the filter, and that the samples are near what it is the mean of."""
    step, zero, error, most = bounds
    exact = _exact(certificate, zero)
    near = f"(Rabs (calibrated (x m) - ({real(step)} * IZR (taken_codes x m) + {real(zero)})) <= {real(error)})%R"
    if alone is None:
        low, high = certificate.inputs[0].lowest, certificate.inputs[0].highest
        proof = f"""\
  pose proof (taken_within x X m) as [L T]. apply IZR_le in L. apply IZR_le in T. unfold calibrated. cbv zeta.
  unfold taken_codes in *.
  change (IZR {number(low)} <= IZR (x m 0%nat))%R in L. change (IZR (x m 0%nat) <= IZR {number(high)})%R in T.
  split; apply Rabs_le; split; lra."""
    else:
        proof = f"""\
  assert (E : calibrated (x m) = ({real(step)} * calibrated_ahead (x m))%R)
    by (unfold calibrated, calibrated_ahead; cbv zeta; field).
  destruct (ahead_is_calibrated x X m) as [A B]. rewrite ahead_unit in A.
  unfold taken_codes. rewrite E. apply abs_between in A. apply abs_between in B. split; apply Rabs_le; split; lra."""
    unit = ""
    if alone is not None:
        graph = flattened(alone)
        place = graph.offsets[-2] + alone.stages[-1].outputs[0]
        unit = f"""\
Lemma ahead_unit : forall c, (c * {_units("ahead", place)} = c)%R.
Proof.
  intros c. change (frac_of ahead {place}) with {number(graph.node(place).frac)}.
  unfold units_of, steps_of. simpl. field.
Qed.
"""
    return f"""\
{_calibrated("calibrated", formula(certificate))}\
(* The exact input of the filter: means of that, as many in a row as the decimator has stages. *)
Definition averaged_input (x : nat -> nat -> Z) (n : nat) : R :=
  averaged decimator_ {exact} {_result(certificate, "n")}.
{unit}\
Lemma calibrated_near : forall x, inputs_within given x -> forall m,
  {near} /\\ (Rabs (calibrated (x m)) <= IZR {most})%R.
Proof.
  intros x X m.
{proof}
Qed.
"""


def _exact(certificate: Certificate, zero: Fraction) -> str:
    """Write what the exact decimator works on of inputs `x`."""
    exact = "(fun m => calibrated (x m))"
    return exact if certificate.ideal.start is not None else f"(preceded decimator_ {real(zero)}%R {exact})"


def _joined(
    certificate: Certificate,
    bounds: _Bounds,
    half: Fraction,
    total: Fraction,
    behind: Certificate,
    following: Calibration,
    graph: FlatGraph,
    taken: int,
) -> str:
    """Write that the node with the samples is near the exact input of the filter."""
    step, zero, error, most = bounds
    (code,) = behind.inputs
    ends = " ".join(number(end) for end in (code.lowest, code.highest))
    lsb = Fraction(code.lsb / behind.output.lsb)
    exact, codes, at = _exact(certificate, zero), _codes(certificate), _result(certificate, "m")
    near = "(calibrated_near x X)"
    if certificate.ideal.start is None:
        holds = f"Rabs (c - ({real(step)} * IZR z + {real(zero)})) <= {real(error)} /\\ Rabs c <= IZR {most}"
        both = f"(fun c z => ({holds})%R)"
        near = (
            f"(preceded_near decimator_ {both} {real(zero)}%R 0%Z _ _ ltac:(split; apply Rabs_le; split; lra) {near})"
        )
    return f"""\
{_calibrated("scaled_behind", following.physical)}\
{_followed("behind_is_scaled", ("scaled_behind", "core", "ports"), following, 1, graph, taken)}\
Lemma decimator_step : ({real(step)} * IZR (2 ^ dropped decimator_) / IZR (gain_of decimator_) = {real(lsb)})%R.
Proof. vm_compute (2 ^ dropped decimator_). vm_compute (gain_of decimator_). field. Qed.
Lemma decimator_half : ({real(step)} * IZR (2 ^ dropped decimator_ / 2) / IZR (gain_of decimator_) = {real(half)})%R.
Proof. vm_compute (2 ^ dropped decimator_ / 2). vm_compute (gain_of decimator_). field. Qed.
Lemma averaged_is : forall x m, averaged_input x m = averaged decimator_ {exact} {at}.
Proof. reflexivity. Qed.
Lemma decimated_is : forall x m, decimated x m 0%nat = decimate decimator_ {codes} {at}.
Proof. reflexivity. Qed.
Lemma scaled_from : forall c, scaled_behind c = ({real(lsb)} * IZR (c 0%nat) + {real(zero)})%R.
Proof. intros c. unfold scaled_behind. cbv zeta. generalize (IZR (c 0%nat)). intros z. field. Qed.
Lemma scaled_is : forall x m,
  scaled_behind (decimated x m) = ({real(lsb)} * IZR (decimate decimator_ {codes} {at}) + {real(zero)})%R.
Proof. intros x m. rewrite scaled_from, decimated_is. reflexivity. Qed.
Theorem calibrated_input : forall x, inputs_within given x -> forall m,
  (Rabs (averaged_input x m - IZR (code core (decimated x) {taken} m) * {_units("core", taken)})
    <= IZR {total.numerator} / IZR {total.denominator})%R /\\ (Rabs (averaged_input x m) <= IZR {most})%R.
Proof.
  intros x X m. rewrite averaged_is.
  destruct (behind_is_scaled (decimated x) (decimated_within x X) m) as [A _]. rewrite scaled_is in A.
  destruct (decimate_near decimator_ _ _ {ends} {codes} decimator_is_fit {_within(certificate)}
    {exact} {real(step)} {real(zero)} {real(error)} (IZR {most})
    ltac:(lra) {near} {at}) as [B C].
  rewrite decimator_step, decimator_half in B. split; [|exact C].
  apply (near_near _ _ _ _ _ _ B A). lra.
Qed.
"""
