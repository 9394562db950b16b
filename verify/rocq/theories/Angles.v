(* Enclosures of sines by square roots of integers. Angles are fractions k / 2^r of a right angle: from sin^2 of an angle
   follows that of its half, sin^2 (t / 2) = (1 - cos t) / 2, and cos t is the root of 1 - sin^2 t. Pi is never computed.

   Numbers are in units of 1 / 2^w: a pair (l, h) encloses x if l <= 2^w x <= h. *)
Require Import ZArith Reals List Lia Lra. Import ListNotations.
Open Scope Z_scope.

Definition enclosed (w : Z) (b : Z * Z) (x : R) : Prop := (IZR (fst b) <= IZR (2 ^ w) * x <= IZR (snd b))%R.

(* Of the root of x / 2^w. *)
Definition root_below (w x : Z) : Z := Z.sqrt (Z.shiftl x w).
Definition root_above (w x : Z) : Z := Z.sqrt_up (Z.shiftl x w).

(* sin^2 of half an angle of at most a right one, and of the rest of half a turn, halved. *)
Definition half_above (w x : Z) : Z := (2 ^ w - root_below w (2 ^ w - x) + 1) / 2.
Definition half_below (w x : Z) : Z := (2 ^ w - root_above w (2 ^ w - x)) / 2.
Definition halved (w : Z) (b : Z * Z) : Z * Z := (half_below w (fst b), half_above w (snd b)).
Definition rest_halved (w : Z) (b : Z * Z) : Z * Z :=
  ((2 ^ w + root_below w (2 ^ w - snd b)) / 2, (2 ^ w + root_above w (2 ^ w - fst b) + 1) / 2).

(* sin^2 of k / 2^r of a right angle, 0 <= k <= 2^r. *)
Fixpoint sine (w : Z) (r : nat) (k : Z) : Z * Z :=
  match r with
  | O => (k * 2 ^ w, k * 2 ^ w)
  | S r' => if k <=? 2 ^ Z.of_nat r' then halved w (sine w r' k) else rest_halved w (sine w r' (2 ^ Z.of_nat r - k))
  end.

Section Units.
Variable w : Z.
Hypothesis W : 0 <= w.
Let one := IZR (2 ^ w).
Lemma one_pos : (0 < IZR (2 ^ w))%R.
Proof. apply IZR_lt. apply Z.pow_pos_nonneg; lia. Qed.

Lemma root_above_is x y : (IZR (2 ^ w) * y <= IZR x)%R -> (0 <= y)%R -> (IZR (2 ^ w) * sqrt y <= IZR (root_above w x))%R.
Proof.
  intros H Y. pose proof one_pos as P. unfold root_above. rewrite Z.shiftl_mul_pow2 by exact W.
  assert (X : 0 <= x) by (apply le_IZR; apply Rle_trans with (2 := H); apply Rmult_le_pos; lra).
  assert (N : 0 <= x * 2 ^ w) by (apply Z.mul_nonneg_nonneg; [exact X|apply Z.pow_nonneg; lia]).
  pose proof (Z.sqrt_sqrt_up_spec _ N) as [_ S]. pose proof (Z.sqrt_up_nonneg (x * 2 ^ w)) as Q.
  apply IZR_le in S. apply IZR_le in Q. rewrite !mult_IZR in S. set (t := IZR (Z.sqrt_up _)) in *.
  assert (E : (IZR (2 ^ w) * sqrt y = sqrt (IZR (2 ^ w) * IZR (2 ^ w) * y))%R).
  { rewrite sqrt_mult, sqrt_square by nra. reflexivity. }
  rewrite E. apply Rle_trans with (sqrt (t * t)); [apply sqrt_le_1; nra|]. rewrite sqrt_square; lra.
Qed.
Lemma root_below_is x y : (IZR x <= IZR (2 ^ w) * y)%R -> (0 <= y)%R -> (IZR (root_below w x) <= IZR (2 ^ w) * sqrt y)%R.
Proof.
  intros H Y. pose proof one_pos as P. unfold root_below. rewrite Z.shiftl_mul_pow2 by exact W.
  pose proof (sqrt_pos y) as Q.
  destruct (Z.le_gt_cases 0 (x * 2 ^ w)) as [N|N].
  2: { rewrite Z.sqrt_neg by exact N. apply Rmult_le_pos; lra. }
  pose proof (Z.sqrt_spec _ N) as [S _]. apply IZR_le in S. rewrite !mult_IZR in S.
  pose proof (Z.sqrt_nonneg (x * 2 ^ w)) as T. apply IZR_le in T. set (t := IZR (Z.sqrt _)) in *.
  assert (E : (IZR (2 ^ w) * sqrt y = sqrt (IZR (2 ^ w) * IZR (2 ^ w) * y))%R).
  { rewrite sqrt_mult, sqrt_square by nra. reflexivity. }
  rewrite E. apply Rle_trans with (sqrt (t * t)); [rewrite sqrt_square; lra|]. apply sqrt_le_1; nra.
Qed.
Lemma floor_half z : (IZR (z / 2) <= IZR z / 2)%R.
Proof. pose proof (Z.mul_div_le z 2 ltac:(lia)) as H. apply IZR_le in H. rewrite mult_IZR in H. lra. Qed.
Lemma ceiling_half z : (IZR z / 2 <= IZR ((z + 1) / 2))%R.
Proof. assert (H : z <= 2 * ((z + 1) / 2)) by (pose proof (Z.div_mod (z + 1) 2 ltac:(lia)); pose proof (Z.mod_pos_bound (z + 1) 2); lia).
  apply IZR_le in H. rewrite mult_IZR in H. lra. Qed.

Lemma sin2_bound t : (0 <= sin t * sin t <= 1)%R.
Proof. pose proof (sin2_cos2 t) as H. unfold Rsqr in H. nra. Qed.
Lemma cos_is_root t : (0 <= cos t)%R -> cos t = sqrt (1 - sin t * sin t).
Proof. intros C. pose proof (sin2_cos2 t) as H. unfold Rsqr in H. rewrite <- (sqrt_square (cos t)) at 1 by exact C. f_equal. lra. Qed.
Lemma sin2_half t : (sin t * sin t = (1 - cos (2 * t)) / 2)%R.
Proof. rewrite cos_2a_sin. lra. Qed.
Lemma complement_below b t : enclosed w b (sin t * sin t) -> (IZR (2 ^ w - snd b) <= IZR (2 ^ w) * (1 - sin t * sin t))%R.
Proof. intros [_ H]. rewrite minus_IZR. lra. Qed.
Lemma complement_above b t : enclosed w b (sin t * sin t) -> (IZR (2 ^ w) * (1 - sin t * sin t) <= IZR (2 ^ w - fst b))%R.
Proof. intros [H _]. rewrite minus_IZR. lra. Qed.

Lemma halved_is b t : (0 <= cos (2 * t))%R -> enclosed w b (sin (2 * t) * sin (2 * t)) -> enclosed w (halved w b) (sin t * sin t).
Proof.
  intros C H. rewrite (sin2_half t), (cos_is_root (2 * t) C). pose proof (sin2_bound (2 * t)) as B.
  pose proof (root_above_is _ _ (complement_above b (2 * t) H) ltac:(lra)) as U.
  pose proof (root_below_is _ _ (complement_below b (2 * t) H) ltac:(lra)) as L.
  unfold halved, half_below, half_above, enclosed. cbn [fst snd]. split.
  - eapply Rle_trans; [apply floor_half|]. rewrite minus_IZR. lra.
  - eapply Rle_trans; [|apply ceiling_half]. rewrite minus_IZR. lra.
Qed.
Lemma rest_halved_is b t : (cos (2 * t) <= 0)%R -> enclosed w b (sin (2 * t) * sin (2 * t)) -> enclosed w (rest_halved w b) (sin t * sin t).
Proof.
  intros C H. assert (E : cos (2 * t) = (- sqrt (1 - sin (2 * t) * sin (2 * t)))%R).
  { pose proof (sin2_cos2 (2 * t)) as S. unfold Rsqr in S.
    replace (1 - sin (2 * t) * sin (2 * t))%R with ((- cos (2 * t)) * (- cos (2 * t)))%R by lra.
    rewrite sqrt_square; lra. }
  rewrite (sin2_half t), E. pose proof (sin2_bound (2 * t)) as B.
  pose proof (root_above_is _ _ (complement_above b (2 * t) H) ltac:(lra)) as U.
  pose proof (root_below_is _ _ (complement_below b (2 * t) H) ltac:(lra)) as L.
  unfold rest_halved, enclosed. cbn [fst snd]. split.
  - eapply Rle_trans; [apply floor_half|]. rewrite plus_IZR. lra.
  - eapply Rle_trans; [|apply ceiling_half]. rewrite plus_IZR. lra.
Qed.

(* The angle k / 2^r of a right one. *)
Definition angle (r : nat) (k : Z) : R := (PI / 2 * IZR k / IZR (2 ^ Z.of_nat r))%R.
Lemma power_next r : IZR (2 ^ Z.of_nat (S r)) = (2 * IZR (2 ^ Z.of_nat r))%R.
Proof. rewrite Nat2Z.inj_succ, Z.pow_succ_r, mult_IZR by lia. reflexivity. Qed.
Lemma power_pos r : (0 < IZR (2 ^ Z.of_nat r))%R.
Proof. apply IZR_lt. apply Z.pow_pos_nonneg; lia. Qed.
Lemma share_le r k : k <= 2 ^ Z.of_nat r -> (IZR k / IZR (2 ^ Z.of_nat r) <= 1)%R.
Proof. intros H. apply IZR_le in H. pose proof (power_pos r) as P. apply Rmult_le_reg_r with (IZR (2 ^ Z.of_nat r)); [exact P|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra. Qed.
Lemma share_ge r k : 0 <= k -> (0 <= IZR k / IZR (2 ^ Z.of_nat r))%R.
Proof. intros H. apply IZR_le in H. pose proof (power_pos r) as P. apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; lra]. Qed.

Lemma sine_is r : forall k, 0 <= k <= 2 ^ Z.of_nat r -> enclosed w (sine w r k) (sin (angle r k) * sin (angle r k)).
Proof.
  induction r as [|r IH]; intros k K.
  - assert (C : k = 0 \/ k = 1) by (change (2 ^ Z.of_nat 0) with 1 in K; lia). unfold angle. change (2 ^ Z.of_nat 0) with 1.
    cbn [sine]. unfold enclosed. cbn [fst snd]. rewrite mult_IZR. destruct C as [-> | ->].
    + replace (PI / 2 * 0 / 1)%R with 0%R by field. rewrite sin_0. lra.
    + replace (PI / 2 * 1 / 1)%R with (PI / 2)%R by field. rewrite sin_PI2. lra.
  - cbn [sine]. pose proof (power_pos r) as P. pose proof (power_next r) as N. pose proof PI_RGT_0 as Q.
    destruct (Z.leb_spec k (2 ^ Z.of_nat r)) as [L|L].
    + assert (D : (2 * angle (S r) k = angle r k)%R) by (unfold angle; rewrite N; field; lra).
      pose proof (share_le r k L) as U. pose proof (share_ge r k ltac:(lia)) as G.
      assert (A : (0 <= angle r k <= PI / 2)%R).
      { unfold angle. replace (PI / 2 * IZR k / IZR (2 ^ Z.of_nat r))%R with (PI / 2 * (IZR k / IZR (2 ^ Z.of_nat r)))%R by (field; lra). nra. }
      apply halved_is; rewrite D; [apply cos_ge_0; lra|]. apply IH. lia.
    + set (j := 2 ^ Z.of_nat (S r) - k).
      assert (J : 0 <= j <= 2 ^ Z.of_nat r).
      { unfold j. rewrite Nat2Z.inj_succ, Z.pow_succ_r in * by lia. lia. }
      assert (D : (2 * angle (S r) k = PI - angle r j)%R).
      { unfold angle, j. rewrite minus_IZR, N. field; lra. }
      pose proof (share_le r j ltac:(lia)) as U. pose proof (share_ge r j ltac:(lia)) as G.
      assert (A : (0 <= angle r j <= PI / 2)%R).
      { unfold angle. replace (PI / 2 * IZR j / IZR (2 ^ Z.of_nat r))%R with (PI / 2 * (IZR j / IZR (2 ^ Z.of_nat r)))%R by (field; lra). nra. }
      apply rest_halved_is; rewrite D.
      * apply Rle_trans with (- cos (angle r j))%R; [rewrite Rtrigo_facts.cos_pi_minus; lra|].
        assert (0 <= cos (angle r j))%R by (apply cos_ge_0; lra). lra.
      * rewrite Rtrigo_facts.sin_pi_minus. apply IH. exact J.
Qed.
End Units.
