(* Peak gains from finitely many integers: with the rounded response Q of 1 / D', K y = (s / c) (N1 Q) * u1 + ... + e, and e
   is at most a small share of the largest |y| so far. Where |y| is largest among the samples up to some time, that bounds it.
   That the poles lie inside the unit circle is not assumed: where they do not, no response leaves so little. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses.
Open Scope Z_scope.

Lemma largest_before (u : signal) k : constant_before u ->
  exists m, m <= k /\ forall j, j <= k -> (Rabs (u j) <= Rabs (u m))%R.
Proof.
  intros [s S]. destruct (Z.ltb_spec k 0) as [H|H].
  { exists k. split; [lia|]. intros j Hj. rewrite (S j), (S k) by lia. lra. }
  rewrite <- (Z2Nat.id k H). induction (Z.to_nat k) as [|n [m [Hm IH]]].
  - destruct (Rle_dec (Rabs (u 0)) (Rabs s)) as [L|L].
    + exists (-1). split; [lia|]. intros j Hj. rewrite (S (-1)) by lia.
      destruct (Z.eq_dec j 0) as [->|]; [exact L|]. rewrite (S j) by lia. lra.
    + exists 0. split; [lia|]. intros j Hj. destruct (Z.eq_dec j 0) as [->|]; [lra|]. rewrite (S j) by lia. lra.
  - destruct (Rle_dec (Rabs (u (Z.of_nat (Datatypes.S n)))) (Rabs (u m))) as [L|L].
    + exists m. split; [lia|]. intros j Hj. destruct (Z.eq_dec j (Z.of_nat (Datatypes.S n))) as [->|]; [exact L|]. apply IH. lia.
    + exists (Z.of_nat (Datatypes.S n)). split; [lia|]. intros j Hj.
      destruct (Z.eq_dec j (Z.of_nat (Datatypes.S n))) as [->|]; [lra|].
      apply Rle_trans with (Rabs (u m)); [apply IH; lia|lra].
Qed.

Fixpoint norms (N : list (list Z)) (Q : list Z) : Z :=
  match N with [] => 0 | c :: N' => norm_of_product c Q + norms N' Q end.
Lemma norms_pos N Q : 0 <= norms N Q.
Proof. induction N as [|c N IH]; cbn [norms]; [lia|]. rewrite norm_of_product_is. pose proof (norm1_pos (product c Q)). lia. Qed.
Lemma together_norms Q (M : R) : (0 <= M)%R -> forall N u t,
  Forall (fun x : signal => forall k, (Rabs (x k) <= M)%R) u -> (Rabs (taps Q (together N u) t) <= IZR (norms N Q) * M)%R.
Proof.
  intros HM. induction N as [|c N IH]; intros u t H.
  - rewrite taps_silent by reflexivity. rewrite Rabs_R0. simpl. lra.
  - cbn [norms]. rewrite norm_of_product_is, plus_IZR, Rmult_plus_distr_r. destruct u as [|x u].
    + rewrite taps_silent by reflexivity. rewrite Rabs_R0. pose proof (norm1_pos (product c Q)). pose proof (norms_pos N Q).
      assert (0 <= IZR (norm1 (product c Q)) * M)%R by (apply Rmult_le_pos; [apply IZR_le; lia|lra]).
      assert (0 <= IZR (norms N Q) * M)%R by (apply Rmult_le_pos; [apply IZR_le; lia|lra]). lra.
    + inversion H; subst. cbn [together]. rewrite (taps_plus Q (taps c x)).
      eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|apply IH; assumption].
      rewrite <- taps_product. apply taps_bound; auto.
Qed.

(* With how many samples of 1 / D', D' = [2^k; a1; ...], s D being nearly c D'; the first sample is `one`. *)
Record witness := Witness { samples : N; bits : Z; tail : list Z; times : Z; share : Z; one : Z }.
Definition near (w : witness) : list Z := monic (bits w) (tail w).
(* What the sums come to, and in which units. *)
Definition gain_figures (D : list Z) (N : list (list Z)) (w : witness) : Z * Z :=
  let (Q, r) := impulse (samples w) (bits w) (tail w) (one w) in
  (times w * norms N Q,
   share w * (one w * 2 ^ bits w) - share w * r - norm1 Q * norm1 (drift (times w) (share w) D (near w))).
Definition gain_holds (D : list Z) (N : list (list Z)) (w : witness) (p q : Z) : bool :=
  let (value, left) := gain_figures D N w in
  (0 <=? bits w) && (0 <? times w) && (0 <? share w) && (0 <? left) && (0 <? q) && (value * q <=? p * left).

(* A claim p / q is also refused if it is more than a unit of the certificate's grid, 2^-64, and what it is at least above a
   figure, 2^-128, above value / unit. *)
Definition close (value unit : Z) (a : ratio) : bool :=
  (fst a * 2 ^ 128 - snd a * (2 ^ 64 + 1)) * unit <=? value * 2 ^ 128 * snd a.
Definition claimed_gain_holds (D : list Z) (N : list (list Z)) (w : witness) (p q : Z) : bool :=
  let (value, left) := gain_figures D N w in
  (0 <=? bits w) && (0 <? times w) && (0 <? share w) && (0 <? left) && (0 <? q) && (value * q <=? p * left)
  && close value left (p, q).

Theorem gain D N w p q : gain_holds D N w p q = true -> gain_at_most D N p q.
Proof.
  unfold gain_holds, gain_figures. destruct (impulse (samples w) (bits w) (tail w) (one w)) as [Q r] eqn:E.
  set (d := drift (times w) (share w) D (near w)). set (K := one w * 2 ^ bits w).
  set (left := share w * K - share w * r - norm1 Q * norm1 d). intros H y u M HM Y Eq Hu k.
  apply andb_prop in H. destruct H as [H H6]. apply andb_prop in H. destruct H as [H H5].
  apply andb_prop in H. destruct H as [H H4]. apply andb_prop in H. destruct H as [H H3].
  apply andb_prop in H. destruct H as [H1 H2].
  apply Z.leb_le in H1. apply Z.ltb_lt in H2. apply Z.ltb_lt in H3. apply Z.ltb_lt in H4. apply Z.ltb_lt in H5. apply Z.leb_le in H6.
  destruct (impulse_spec _ _ _ _ _ _ H1 E) as [rr [Hr Spec]].
  destruct (largest_before y k Y) as [m [Hm Top]].
  pose proof (together_norms Q M HM N u m Hu) as U.
  assert (B1 : (Rabs (taps rr y (m - 1)) <= IZR r * Rabs (y m))%R).
  { apply Rle_trans with (IZR (norm1 rr) * Rabs (y m))%R.
    - apply taps_bound; [apply Rabs_pos|]. intros j Hj. apply Top. lia.
    - apply Rmult_le_compat_r; [apply Rabs_pos|apply IZR_le; exact Hr]. }
  assert (B2 : (Rabs (taps Q (taps d y) m) <= IZR (norm1 Q * norm1 d) * Rabs (y m))%R).
  { rewrite mult_IZR, Rmult_assoc. apply taps_bound.
    - apply Rmult_le_pos; [apply IZR_le, norm1_pos|apply Rabs_pos].
    - intros j Hj. apply taps_bound; [apply Rabs_pos|]. intros i Hi. apply Top. lia. }
  assert (F : (IZR (share w) * (IZR K * y m) = IZR (times w) * taps Q (together N u) m
      - IZR (share w) * taps rr y (m - 1) - taps Q (taps d y) m)%R).
  { assert (T : (taps Q (fun j => IZR (share w) * taps (near w) y j) m = taps Q (fun j => IZR (times w) * together N u j + (-1) * taps d y j) m)%R).
    { apply taps_ext. intros j _. rewrite <- Eq. pose proof (drift_spec (times w) (share w) D (near w) y j) as X. fold d in X. lra. }
    rewrite taps_multiple in T. unfold near in T. rewrite Spec in T. fold K in T.
    rewrite (taps_plus Q (fun j => IZR (times w) * together N u j)%R), !taps_multiple in T. lra. }
  assert (S0 : (0 < IZR (share w))%R) by (apply IZR_lt; lia). assert (T0 : (0 < IZR (times w))%R) by (apply IZR_lt; lia).
  assert (L0 : (0 < IZR left)%R) by (apply IZR_lt; lia). assert (Q0 : (0 < IZR q)%R) by (apply IZR_lt; lia).
  assert (K0 : 0 <= K).
  { assert (0 <= norm1 Q * norm1 d) by (apply Z.mul_nonneg_nonneg; apply norm1_pos).
    pose proof (norm1_pos rr). assert (0 < share w * K - share w * r) by lia. nia. }
  assert (G : (Rabs (y m) * IZR left <= IZR (times w) * (IZR (norms N Q) * M))%R).
  { unfold left. rewrite !minus_IZR, !mult_IZR in *.
    assert (A : (IZR (share w) * IZR K * Rabs (y m) <= IZR (times w) * (IZR (norms N Q) * M)
        + IZR (share w) * (IZR r * Rabs (y m)) + IZR (norm1 Q) * IZR (norm1 d) * Rabs (y m))%R).
    { replace (IZR (share w) * IZR K * Rabs (y m))%R with (Rabs (IZR (share w) * (IZR K * y m))).
      - rewrite F. unfold Rminus. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp.
        apply Rplus_le_compat; [|exact B2]. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp.
        apply Rplus_le_compat; rewrite Rabs_mult, Rabs_pos_eq by lra; apply Rmult_le_compat_l; lra.
      - rewrite !Rabs_mult, !Rabs_pos_eq by (try lra; apply IZR_le; exact K0). ring. }
    lra. }
  apply IZR_le in H6. rewrite !mult_IZR in H6.
  apply Rle_trans with (Rabs (y m)); [apply Top; lia|].
  apply Rmult_le_reg_r with (IZR q * IZR left)%R; [apply Rmult_lt_0_compat; assumption|].
  replace (IZR p / IZR q * M * (IZR q * IZR left))%R with (IZR p * IZR left * M)%R by (field; lra).
  apply Rle_trans with (IZR (times w) * IZR (norms N Q) * IZR q * M)%R; [|apply Rmult_le_compat_r; assumption].
  replace (Rabs (y m) * (IZR q * IZR left))%R with (IZR q * (Rabs (y m) * IZR left))%R by ring.
  replace (IZR (times w) * IZR (norms N Q) * IZR q * M)%R with (IZR q * (IZR (times w) * (IZR (norms N Q) * M)))%R by ring.
  apply Rmult_le_compat_l; lra.
Qed.
Corollary claimed_gain D N w p q : claimed_gain_holds D N w p q = true -> gain_at_most D N p q.
Proof.
  intros H. apply (gain D N w p q). unfold claimed_gain_holds, gain_holds in *. destruct (gain_figures D N w) as [value left].
  apply andb_prop in H. apply H.
Qed.
