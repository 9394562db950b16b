"""Theorems that join those of a chain's stages: what enters each, by how much it errs, what that adds at the end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from sosmith.verify.certificate_file import Certificate, on_grid
from sosmith.verify.chain.chain_file import ChainCertificate
from sosmith.verify.graph import require
from sosmith.verify.rocq.bound import GAIN_BITS
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.entry import real
from sosmith.verify.rocq.exact import exact_row, sections_of
from sosmith.verify.rocq.flat import flattened
from sosmith.verify.rocq.polynomials import number

_FINE = 1 << 64
"""Limits of the exact filters' signals are in units of 1 over this."""

_BITS = 128
"""Precision of gains that nobody claims."""

_Sections = list[tuple[list[int], list[int]]]


@dataclass(frozen=True)
class Stage:
    """A stage, as its theorems are joined to those of others.

    Attributes
    ----------
    index : int
        Its number, from 0 on.
    certificate : Certificate
    unit, error : Fraction
        Its last place, and its claimed error, in last places of the chain's output.
    gain : Fraction
        Claimed gain from its output to the end.
    """

    index: int
    certificate: Certificate
    unit: Fraction
    error: Fraction
    gain: Fraction

    @property
    def file(self) -> str:
        """Name of the file with its theorems."""
        return f"Stage{self.index}"

    @property
    def every(self) -> int:
        """Samples for each result."""
        down = self.certificate.downsampling
        return 1 if down is None else down.factor

    @property
    def steady(self) -> bool:
        """Whether it starts as if its first sample had been there for ever."""
        down = self.certificate.downsampling
        return self.certificate.ideal.start is not None or (down is not None and down.filled > 0)

    @property
    def sections(self) -> _Sections:
        """The exact filter."""
        return sections_of(self.certificate.ideal.sections)

    @property
    def term(self) -> str:
        """That with the samples for each result, as a term."""
        return f"({self.file}.exact_sections, {self.every}%nat)"

    @property
    def out(self) -> int:
        """The node with the output's code."""
        graph = flattened(self.certificate)
        return graph.offsets[-2] + self.certificate.stages[-1].outputs[0]

    @property
    def _filled(self) -> int:
        down = self.certificate.downsampling
        return 0 if down is None else down.filled

    def codes(self, x: str) -> str:
        """Write what its graph takes of codes `x`: the first one several times, if it fills its window."""
        return f"(filled {self._filled} {x})" if self._filled else x

    def at(self, n: str) -> str:
        """Write which of the graph's results is number `n`."""
        if self.certificate.downsampling is None:
            return n
        return f"({self._filled} + {self.every} * {n})%nat" if self._filled else f"({self.every} * {n})%nat"

    def within(self, proof: str) -> str:
        """Write the proof that these codes are in the range of the ports, from that of `x`."""
        return f"(filled_within {self._filled} {self.file}.ports _ {proof})" if self._filled else proof

    def code(self, x: str, n: str) -> str:
        """Write the code of result `n`."""
        return f"code {self.file}.core {self.codes(x)} {self.out} {self.at(n)}"

    def bounded(self) -> str:
        """Write tactics that prove the error of its result `n` for a signal Y of its exact filter, known by E."""
        k, all_leave = self.index, self.certificate.downsampling is None
        name = "error_is_bounded" if all_leave else "results_are_bounded"
        where = "Z.of_nat n" if all_leave else f"Z.of_nat ({self.every} * n)"
        return (
            f"unfold one_in; replace (Z.of_nat n * Z.of_nat {self.every}) with ({where}) by lia; "
            f"exact ({self.file}.{name} (codes_{k} x) (codes_{k}_within x X) Y E n)"
        )


def joining_claims(chain: ChainCertificate, stages: Sequence[Stage]) -> Iterator[Claim]:
    """Write theorem by theorem, each of which may need those before it to be true.

    Raises
    ------
    RejectedError
        If stages do not start alike, or a port between them has an offset.
    """
    steady = {stage.steady for stage in stages}
    require(len(steady) == 1, "all stages must start alike")
    begins = "true" if steady.pop() else "false"
    (port,) = stages[0].certificate.inputs
    lsb = stages[-1].certificate.output.lsb
    most = max(abs(port.zero + port.lsb * code) for code in (port.lowest, port.highest)) / lsb
    yield _entering(stages[0], most, begins)
    for before, stage in pairwise(stages):
        yield _taken(before, stage)
    margins = _Margins(stages, most)
    for k, stage in enumerate(stages[:-1]):
        yield from margins.claims(k)
        yield _between(stage, margins.range_of(k), begins)
    yield margins.fit(begins)
    yield _whole(chain, stages, begins)
    bound, unit = chain.bound / lsb, f" {chain.output.unit}".rstrip()
    text = f"Theorem chain_is_allowed : ({real(bound)} * {real(lsb)} <= {real(chain.max_error)})%R.\nProof. lra. Qed.\n"
    yield Claim("chain_is_allowed", f"that is at most {float(chain.max_error):.9g}{unit}", text)


def _entering(stage: Stage, most: Fraction, begins: str) -> Claim:
    port = stage.certificate.inputs[0]
    low, high = number(port.lowest), number(port.highest)
    text = f"""\
(* Codes that a stage takes, given those of the inputs, and what they are worth in units of the chain's last place. *)
Definition codes_0 (x : nat -> nat -> Z) : nat -> nat -> Z := x.
Definition values_0 (x : nat -> nat -> Z) (n : nat) : R := ({real(stage.unit)} * Stage0.calibrated (x n))%R.
Lemma codes_0_within : forall x, inputs_within Stage0.ports x -> inputs_within Stage0.ports (codes_0 x).
Proof. intros x X. exact X. Qed.
Lemma entering_0 : forall x n, ({real(stage.unit)} * Stage0.calibrated (codes_0 x n))%R = values_0 x n.
Proof. intros. reflexivity. Qed.
Theorem input_is_limited : forall x, inputs_within Stage0.ports x ->
  forall k, (Rabs (begins {begins} (values_0 x) k) <= {real(most)})%R.
Proof.
  intros x X. apply begins_within; [lra|]. intros n. pose proof (X n 0%nat (le_n 1)) as [L T].
  apply IZR_le in L. apply IZR_le in T. unfold values_0, Stage0.calibrated. cbv zeta.
  change (IZR {low} <= IZR (x n 0%nat))%R in L. change (IZR (x n 0%nat) <= IZR {high})%R in T.
  apply Rabs_le. split; lra.
Qed.
"""
    return Claim("input_is_limited", f"the exact input is at most {float(most):.9g} last places of the output", text)


def _taken(before: Stage, stage: Stage) -> Claim:
    """Write that a stage takes what the one before it gives, in its range and with its unit."""
    port, k, core = stage.certificate.inputs[0], stage.index, f"{before.file}.core"
    low, high, node = number(port.lowest), number(port.highest), f"(nth {before.out} {core} blank)"
    codes, at = before.codes(f"(codes_{k - 1} x)"), before.at("n")
    within = before.within(f"(codes_{k - 1}_within x X)")
    text = f"""\
Definition codes_{k} (x : nat -> nat -> Z) (n p : nat) : Z := {before.code(f"(codes_{k - 1} x)", "n")}.
Definition values_{k} (x : nat -> nat -> Z) (n : nat) : R := ({real(before.unit)} * IZR (codes_{k} x n 0%nat))%R.
Lemma entering_{k} : forall x n, ({real(stage.unit)} * {stage.file}.calibrated (codes_{k} x n))%R = values_{k} x n.
Proof.
  intros x n. assert (E : forall f : nat -> Z, ({real(stage.unit)} * {stage.file}.calibrated f
    = {real(before.unit)} * IZR (f 0%nat))%R) by (intros f; unfold {stage.file}.calibrated; cbv zeta; field).
  exact (E (codes_{k} x n)).
Qed.
Theorem codes_{k}_within : forall x, inputs_within Stage0.ports x -> inputs_within {stage.file}.ports (codes_{k} x).
Proof.
  intros x X n [|p] P; [|unfold {stage.file}.ports in P; simpl in P; lia].
  assert (H : (Nat.ltb {before.out} (length {core})
    && Z.leb {low} (low {node}) && Z.leb (high {node}) {high})%bool = true) by (vm_cast_no_check (eq_refl true)).
  apply andb_prop in H. destruct H as [H T]. apply andb_prop in H. destruct H as [I L].
  apply Nat.ltb_lt in I. apply Z.leb_le in L. apply Z.leb_le in T.
  pose proof ({before.file}.every_code_in_range {codes} {within} {at} {before.out} I) as B.
  unfold in_range in B. change ({low} <= code {core} {codes} {before.out} {at} <= {high}). lia.
Qed.
"""
    return Claim(f"codes_{k}_within", f"stage {k} takes what the stage before gives, in its range", text)


def _between(stage: Stage, reach: Fraction, begins: str) -> Claim:
    """Write that the output of a stage is near what its exact filter makes of its input, and not limited."""
    k, port, bound = stage.index, stage.certificate.output, stage.certificate.claims.bound
    require(port.zero == 0, f"the port behind stage {k} must have the value 0 for the code 0")
    low, high = number(port.lowest), number(port.highest)
    text = f"""\
Theorem stage_{k} : forall x, inputs_within Stage0.ports x ->
  forall Y, exact_filter {stage.file}.exact_sections (begins {begins} (values_{k} x)) Y ->
  (forall j, (Rabs (one_in {stage.every} Y j) <= {real(reach)})%R) ->
  forall n, (Rabs (values_{k + 1} x n - one_in {stage.every} Y (Z.of_nat n)) <= {real(stage.error)})%R.
Proof.
  intros x X. apply (stage_between {begins} {stage.file}.exact_sections {stage.every} {real(stage.unit)} {real(bound)}
    {real(reach)} {real(stage.error)} (fun n => {stage.file}.calibrated (codes_{k} x n)) (values_{k} x)
    (fun n => IZR (codes_{k + 1} x n 0%nat)) (IZR {low}) (IZR {high})); try lra.
  - intros n. apply entering_{k}.
  - intros Y E n. {stage.bounded()}.
Qed.
"""
    words = f"the output of stage {k} is within {float(stage.error):.9g} last places of the chain of its exact filter"
    return Claim(f"stage_{k}", words, text)


def _flat(stages: Sequence[Stage]) -> _Sections:
    """Return stages as one filter at the first rate: zeros between the taps of those behind one that decimates."""
    if not stages:
        return []
    first, *others = stages
    return first.sections + [(_apart(over, first.every), _apart(under, first.every)) for over, under in _flat(others)]


def _apart(taps: Sequence[int], every: int) -> list[int]:
    return [value for tap in taps for value in (tap, *[0] * (every - 1))]


def _row(sections: _Sections, bits: int) -> tuple[str, Fraction]:
    """Return the parts of a response with this precision, and the gain that it proves."""
    whole = 1 << 2 * bits
    made = exact_row(sections, _FINE, whole, bits)
    total = sum(abs(int(value)) for value in made.row.coeffs()) * _FINE + made.rest
    return made.parts, Fraction(total, whole * _FINE)


def _gain(name: str, words: str, stages: Sequence[Stage], claimed: Fraction) -> Claim:
    sections = _flat(stages)
    for bits in GAIN_BITS:
        parts, proven = _row(sections, bits)
        if proven <= claimed:
            break
    text = f"""\
Theorem {name} : has_gain [{"; ".join(stage.term for stage in stages)}] {real(claimed)}.
Proof.
  apply (gain_at_first_rate _ {parts} (2 ^ 64) (2 ^ {2 * bits})); vm_cast_no_check (eq_refl true).
Qed.
"""
    return Claim(name, f"{words} at most {float(claimed):.9g}", text)


class _Margins:
    """How large signals between stages are, and how far from the exact ones: what their ranges must hold.

    Attributes
    ----------
    most : Fraction
        Largest magnitude of the exact input.
    """

    def __init__(self, stages: Sequence[Stage], most: Fraction) -> None:
        self.most = most
        self._stages = stages
        early = range(len(stages) - 1)
        self._own = [on_grid(_row(stages[k].sections, _BITS)[1]) for k in early]
        self._reached = [on_grid(_row(_flat(stages[: k + 1]), _BITS)[1]) for k in early]

    def range_of(self, k: int) -> Fraction:
        """Return up to where the output of a stage reaches, on both sides."""
        stage = self._stages[k]
        port = stage.certificate.output
        return stage.unit * min(port.highest, -port.lowest)

    def claims(self, k: int) -> Iterator[Claim]:
        """Write the theorems on the gains of a stage, of all up to it, and of all behind it."""
        stages = self._stages
        yield _gain(f"own_gain_{k}", f"stage {k}: its gain", stages[k : k + 1], self._own[k])
        words = f"gain from the input to the output of stage {k}"
        yield _gain(f"gain_up_to_{k}", words, stages[: k + 1], self._reached[k])
        words = f"gain from the output of stage {k} to the end"
        yield _gain(f"gain_behind_{k}", words, stages[k + 1 :], stages[k].gain)

    def fit(self, begins: str) -> Claim:
        """Write that the ranges hold that."""
        *early, last = self._stages
        links = ";\n   ".join(
            f"Link {stage.file}.exact_sections {stage.every} "
            + " ".join(
                map(real, (stage.error, self.range_of(k), self._own[k], stage.gain, self._reached[k] * self.most))
            )
            for k, stage in enumerate(early)
        )
        steps = "".join(
            f"  split; [lra|]. split; [lra|]. split; [exact own_gain_{k}|]. split; [exact gain_behind_{k}|]. split.\n"
            f"  {{ intros z Z k. eapply Rle_trans; [exact (gain_up_to_{k} _ _ {real(self.most)}%R ltac:(lra)\n"
            f"      (begins_constant _ _) Z (input_is_limited x X) k)|lra]. }}\n"
            f"  split; [lra|].\n"
            for k in range(len(early))
        )
        text = f"""\
Definition links : list link :=
  [{links}].
Theorem no_port_limits : forall x, inputs_within Stage0.ports x ->
  fits [] (begins {begins} (values_0 x)) links [{last.term}] 0.
Proof.
  intros x X. unfold links. cbn [fits filter_ every_ error_ range_ own_ onward_ most_].
{steps}  exact I.
Qed.
"""
        words = "no port between stages limits anything: each holds the exact value and all errors before it"
        return Claim("no_port_limits", words, text)


def _whole(chain: ChainCertificate, stages: Sequence[Stage], begins: str) -> Claim:
    *early, last = stages
    k, output = last.index, last.certificate.output
    bound, offset = chain.bound / output.lsb, output.zero / output.lsb
    low, high = number(output.lowest), number(output.highest)
    over = f"IZR {number(offset.numerator)} / IZR {offset.denominator}" if offset else "0"
    exactly = f"(y (Z.of_nat n) - {over})" if offset else "(y (Z.of_nat n))"
    code = f"IZR ({last.code(f'(codes_{k} x)', 'n')})"
    steps = "".join(f"exists (values_{j + 1} x). split; [exact (stage_{j} x X)|]. " for j in range(len(early)))
    tidied, tidy = ("", "") if offset else ("rewrite <- (Rminus_0_r (y (Z.of_nat n))). ", "rewrite Rminus_0_r. ")
    start = "from_first" if begins == "true" else "from_zero"
    text = f"""\
Lemma last_stage_takes : forall x n, {last.file}.calibrated (codes_{k} x n) = values_{k} x n.
Proof. intros x n. rewrite <- (entering_{k} x n). field. Qed.
Theorem chain_is_bounded : forall x, inputs_within Stage0.ports x ->
  forall y, exact_chain [{"; ".join(stage.term for stage in stages)}]
    ({start} (fun n => {real(stages[0].unit)} * Stage0.calibrated (x n))%R) y ->
  forall n, (Rabs ({code} - limited (IZR {low}) (IZR {high}) {exactly}) <= {real(bound)})%R.
Proof.
  intros x X y W n. apply Rle_trans with (added links + {real(last.error)})%R;
    [|unfold links; cbn [added onward_ error_]; lra].
  assert (M : made {begins} links (values_0 x) (values_{k} x)).
  {{ unfold links. cbn [made filter_ every_ range_ error_]. {steps}intros m. reflexivity. }}
  pose proof (chain_error {begins} links {last.file}.exact_sections {last.every} (values_0 x) (values_{k} x) y
    (fun n => {code}) (IZR {low}) (IZR {high}) ({over})%R {real(last.error)}) as H.
  assert (C : can_run [{"; ".join(stage.term for stage in stages)}] = true) by (vm_cast_no_check (eq_refl true)).
  specialize (H C (no_port_limits x X) M). cbv beta in H. {tidied}apply H; [|exact W].
  clear H M C W n y. intros Y Z n. {tidy}
  pose proof (stage_at_the_end {begins} _ (fun j => {last.file}.calibrated (codes_{k} x j)) (values_{k} x)
    (last_stage_takes x) Y Z) as E. eapply Rle_trans; [{last.bounded()}|lra].
Qed.
"""
    words = f"for all inputs the output is within {float(bound):.9g} of its last place of all exact filters in a row"
    return Claim("chain_is_bounded", f"{words}, limited", text)
