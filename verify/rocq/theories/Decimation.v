(* A decimator in words of a fixed width gives what it approximates, but for one rounding.

   Modulo 2^width, differences of running sums are moving sums. These have coefficients that are not negative, so that all
   lies between the least and the greatest sample times their sum: a number that fits the word is then no remainder. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses.
Open Scope Z_scope.

Fixpoint running (u : nat -> Z) (n : nat) : Z := u n + match n with O => 0 | S m => running u m end.
Definition diff (u : nat -> Z) (n : nat) : Z := u (S n) - u n.
Definition apart (r : nat) (u : nat -> Z) (n : nat) : Z := u (n + r)%nat - u n.
Fixpoint box (r : nat) (u : nat -> Z) (n : nat) : Z := match r with O => 0 | S q => u (n + r)%nat + box q u n end.
Definition like (a b : nat -> Z) : Prop := forall n, a n = b n.
Definition congruent (M : Z) (a b : nat -> Z) : Prop := forall n, a n mod M = b n mod M.

Lemma iter_congruent M (F G : (nat -> Z) -> nat -> Z) (H : forall a b, congruent M a b -> congruent M (F a) (G b)) k :
  forall a b, congruent M a b -> congruent M (Nat.iter k F a) (Nat.iter k G b).
Proof. induction k as [|k IH]; intros a b E; cbn [Nat.iter nat_rect]; [exact E|]. apply H, IH, E. Qed.
Lemma iter_like (F : (nat -> Z) -> nat -> Z) (H : forall a b, like a b -> like (F a) (F b)) k :
  forall a b, like a b -> like (Nat.iter k F a) (Nat.iter k F b).
Proof. induction k as [|k IH]; intros a b E; cbn [Nat.iter nat_rect]; [exact E|]. apply H, IH, E. Qed.
Lemma summed_running w a b : 0 <= w -> congruent (2 ^ w) a b -> congruent (2 ^ w) (summed w a) (running b).
Proof.
  intros W E. assert (M : 2 ^ w <> 0) by (apply Z.pow_nonzero; lia). intros n. induction n as [|n IH]; cbn [summed running].
  - rewrite Z.mod_mod by exact M. rewrite !Z.add_0_r. apply E.
  - rewrite Z.mod_mod by exact M. rewrite Z.add_mod, (Z.add_mod (b (S n))) by exact M. rewrite IH, E. reflexivity.
Qed.
Lemma differed_diff w a b : 0 <= w -> congruent (2 ^ w) a b -> congruent (2 ^ w) (differed w a) (diff b).
Proof.
  intros W E. assert (M : 2 ^ w <> 0) by (apply Z.pow_nonzero; lia). intros n. unfold differed, diff.
  rewrite Z.mod_mod by exact M. rewrite Zminus_mod, (Zminus_mod (b (S n))), !E. reflexivity.
Qed.
Lemma every_other k r f : forall n, Nat.iter k diff (fun j => f (j * r)%nat) n = Nat.iter k (apart r) f (n * r)%nat.
Proof.
  induction k as [|k IH]; intros n; cbn [Nat.iter nat_rect]; [reflexivity|]. unfold diff at 1, apart at 1.
  fold (Nat.iter k diff (fun j => f (j * r)%nat)). fold (Nat.iter k (apart r) f). rewrite !IH.
  replace (S n * r)%nat with (n * r + r)%nat by lia. reflexivity.
Qed.
Lemma running_box r u n : running u (n + r) - running u n = box r u n.
Proof.
  induction r as [|r IH]; cbn [box]; [rewrite Nat.add_0_r; ring|]. replace (n + S r)%nat with (S (n + r)) by lia.
  cbn [running]. lia.
Qed.
Lemma box_like r a b : like a b -> like (box r a) (box r b).
Proof. intros E n. induction r as [|r IH]; cbn [box]; [reflexivity|]. rewrite E, IH. reflexivity. Qed.
Lemma apart_like r a b : like a b -> like (apart r a) (apart r b).
Proof. intros E n. unfold apart. rewrite !E. reflexivity. Qed.
Lemma apart_box r q u : like (apart r (box q u)) (box q (apart r u)).
Proof.
  intros n. unfold apart at 1. induction q as [|q IH]; cbn [box]; [reflexivity|]. unfold apart at 1.
  replace (n + r + S q)%nat with (n + S q + r)%nat by lia. lia.
Qed.
Lemma apart_box_iter r k : forall u, like (Nat.iter k (apart r) (box r u)) (box r (Nat.iter k (apart r) u)).
Proof.
  induction k as [|k IH]; intros u n; cbn [Nat.iter nat_rect]; [reflexivity|].
  fold (Nat.iter k (apart r) (box r u)). fold (Nat.iter k (apart r) u).
  rewrite (apart_like r _ _ (IH u) n). apply apart_box.
Qed.
Lemma iter_after {A} (F : A -> A) k a : Nat.iter (S k) F a = Nat.iter k F (F a).
Proof. induction k as [|k IH]; [reflexivity|]. change (F (Nat.iter (S k) F a) = F (Nat.iter k F (F a))). rewrite IH. reflexivity. Qed.
Lemma sums_of_differences r k : forall u, like (Nat.iter k (apart r) (Nat.iter k running u)) (Nat.iter k (box r) u).
Proof.
  induction k as [|k IH]; intros u n; [reflexivity|].
  rewrite iter_after. change (Nat.iter (S k) running u) with (running (Nat.iter k running u)).
  rewrite (iter_like (apart r) (apart_like r) k (apart r (running (Nat.iter k running u))) (box r (Nat.iter k running u)) (fun m => running_box r _ m) n).
  rewrite apart_box_iter. change (Nat.iter (S k) (box r) u) with (box r (Nat.iter k (box r) u)).
  apply box_like. exact (IH u).
Qed.

Lemma abs_between x e : (Rabs x <= e -> - e <= x <= e)%R.
Proof. intros H. pose proof (Rle_abs x). pose proof (Rle_abs (- x)). rewrite Rabs_Ropp in *. lra. Qed.

(* Moving sums of sequences over all times. *)
Definition moving (r : nat) (u : signal) : signal := taps (repeat 1%Z r) u.
Lemma repeat_last r : repeat 1 (S r) = repeat 1 r ++ [1].
Proof. induction r as [|r IH]; [reflexivity|]. cbn [repeat app]. f_equal. exact IH. Qed.
Lemma box_moving r f (U : signal) n K : (forall i, IZR (f (n + i)%nat) = U (K + Z.of_nat i)) ->
  IZR (box r f n) = moving r U (K + Z.of_nat r).
Proof.
  intros H. induction r as [|r IH]; [reflexivity|]. cbn [box]. unfold moving in *. cbn [repeat taps]. rewrite plus_IZR, H, IH.
  replace (K + Z.of_nat (S r) - 1) with (K + Z.of_nat r) by lia. ring.
Qed.
Definition real_of (z : nat -> Z) : nat -> R := fun n => IZR (z n).
Lemma boxes_moving r k z q : forall n,
  IZR (Nat.iter k (box r) (fun j => z (j - q)%nat) n)
  = Nat.iter k (moving r) (from_first (real_of z)) (Z.of_nat n - Z.of_nat q + Z.of_nat (k * r)).
Proof.
  induction k as [|k IH]; intros n; cbn [Nat.iter nat_rect].
  - rewrite Z.add_0_r. unfold from_first, after, real_of. destruct (Z.ltb_spec (Z.of_nat n - Z.of_nat q) 0) as [L|L].
    + replace (n - q)%nat with O by lia. reflexivity.
    + f_equal. f_equal. lia.
  - fold (Nat.iter k (box r) (fun j => z (j - q)%nat)). fold (Nat.iter k (moving r) (from_first (real_of z))).
    rewrite (box_moving r _ (Nat.iter k (moving r) (from_first (real_of z))) n (Z.of_nat n - Z.of_nat q + Z.of_nat (k * r))).
    + f_equal. lia.
    + intros i. rewrite IH. f_equal. lia.
Qed.

Section Means.
Variable r : nat.
Hypothesis Rp : (0 < r)%nat.
Lemma count_pos : (0 < IZR (Z.of_nat r))%R.
Proof. apply IZR_lt. lia. Qed.
Lemma moving_between lo hi u : (forall k, (lo <= u k <= hi)%R) ->
  forall q k, (IZR (Z.of_nat q) * lo <= moving q u k <= IZR (Z.of_nat q) * hi)%R.
Proof.
  intros H. unfold moving. induction q as [|q IH]; intros k; [simpl; lra|]. cbn [repeat taps].
  rewrite Nat2Z.inj_succ, succ_IZR. specialize (IH (k - 1)). specialize (H k). lra.
Qed.
Lemma mean_between lo hi u : (forall k, (lo <= u k <= hi)%R) -> forall k, (lo <= mean r u k <= hi)%R.
Proof.
  intros H k. pose proof (moving_between lo hi u H r k) as B. pose proof count_pos as C. unfold mean. fold (moving r u k).
  set (s := moving r u k) in *. set (c := IZR (Z.of_nat r)) in *.
  split; apply Rmult_le_reg_l with c; try exact C; replace (c * (s / c))%R with s by (field; lra); lra.
Qed.
Lemma means_between lo hi u j : (forall k, (lo <= u k <= hi)%R) -> forall k, (lo <= Nat.iter j (mean r) u k <= hi)%R.
Proof. intros H. induction j as [|j IH]; [exact H|]. intros k. apply (mean_between lo hi (Nat.iter j (mean r) u) IH). Qed.
Lemma mean_affine u v w a b k : (forall i, u i = a * v i + b * w i)%R -> mean r u k = (a * mean r v k + b * mean r w k)%R.
Proof.
  intros H. unfold mean. rewrite (taps_ext _ u (fun i => a * v i + b * w i)%R) by (intros; apply H).
  rewrite (taps_plus _ (fun i => a * v i)%R), !taps_multiple. pose proof count_pos. field. lra.
Qed.
Lemma means_affine j : forall u v w a b, (forall i, u i = a * v i + b * w i)%R ->
  forall k, Nat.iter j (mean r) u k = (a * Nat.iter j (mean r) v k + b * Nat.iter j (mean r) w k)%R.
Proof. induction j as [|j IH]; intros u v w a b H k; [apply H|]. apply (mean_affine (Nat.iter j (mean r) u)). apply IH, H. Qed.
Lemma means_moving j u : forall k, Nat.iter j (moving r) u k = (IZR (Z.of_nat r ^ Z.of_nat j) * Nat.iter j (mean r) u k)%R.
Proof.
  induction j as [|j IH]; intros k; [simpl; ring|].
  change (Nat.iter (S j) (moving r) u k) with (taps (repeat 1%Z r) (Nat.iter j (moving r) u) k).
  change (Nat.iter (S j) (mean r) u k) with (taps (repeat 1%Z r) (Nat.iter j (mean r) u) k / IZR (Z.of_nat r))%R.
  rewrite (taps_ext _ _ (fun i => IZR (Z.of_nat r ^ Z.of_nat j) * Nat.iter j (mean r) u i)%R) by (intros; apply IH).
  rewrite taps_multiple, Nat2Z.inj_succ, Z.pow_succ_r, mult_IZR by lia. pose proof count_pos. field. lra.
Qed.
End Means.

(* What leaves lies between `least_out` and `most_out` for samples between lo and hi, which the word holds. *)
Definition gain_of (d : decimator) : Z := Z.of_nat (factor d) ^ Z.of_nat (stages d).
Definition rounded_by (d : decimator) (z : Z) : Z := (z + 2 ^ dropped d / 2) / 2 ^ dropped d.
Definition decimator_fits (d : decimator) (lo hi lo' hi' : Z) : bool :=
  Nat.ltb 0 (factor d) && (0 <? width d) && (0 <=? dropped d)
  && (if signed d then (- 2 ^ (width d - 1) <=? lo * gain_of d) && (hi * gain_of d <? 2 ^ (width d - 1))
      else (0 <=? lo * gain_of d) && (hi * gain_of d <? 2 ^ width d))
  && (lo' <=? rounded_by d (lo * gain_of d)) && (rounded_by d (hi * gain_of d) <=? hi').

Section Decimated.
Variables (d : decimator) (lo hi lo' hi' : Z) (z : nat -> Z).
Hypothesis Fits : decimator_fits d lo hi lo' hi' = true.
Hypothesis Within : forall m, lo <= z m <= hi.

Let sum n : Z := Nat.iter (stages d) (box (factor d)) (fun j => z (j - stages d * factor d)%nat) (n * factor d)%nat.
Let exact_mean n : R := averaged d (real_of z) n.
Lemma shape : (0 < factor d)%nat /\ 0 <= dropped d.
Proof.
  pose proof Fits as H. unfold decimator_fits in H. do 3 (apply andb_prop in H; destruct H as [H _]).
  apply andb_prop in H. destruct H as [H D]. apply andb_prop in H. destruct H as [H _].
  split; [apply Nat.ltb_lt, H|apply Z.leb_le, D].
Qed.
Lemma gain_pos : 0 < gain_of d.
Proof. destruct shape as [F _]. unfold gain_of. apply Z.pow_pos_nonneg; lia. Qed.
Lemma sum_is n : IZR (sum n) = (IZR (gain_of d) * exact_mean n)%R.
Proof.
  unfold sum, exact_mean, averaged, gain_of. rewrite boxes_moving.
  replace (Z.of_nat (n * factor d) - Z.of_nat (stages d * factor d) + Z.of_nat (stages d * factor d)) with (Z.of_nat (n * factor d)) by lia.
  apply means_moving, shape.
Qed.
Lemma sum_within n : lo * gain_of d <= sum n <= hi * gain_of d.
Proof.
  destruct shape as [F _].
  assert (B : (IZR lo <= exact_mean n <= IZR hi)%R).
  { apply (means_between (factor d) F). intros k. unfold from_first, after, real_of.
    destruct (k <? 0); split; apply IZR_le, Within. }
  pose proof gain_pos as P. apply IZR_lt in P. rewrite (Z.mul_comm lo), (Z.mul_comm hi).
  split; apply le_IZR; rewrite mult_IZR, sum_is; apply Rmult_le_compat_l; lra.
Qed.
Lemma decimate_is n : decimate d z n = rounded_by d (sum n).
Proof.
  pose proof (sum_within n) as B. unfold decimate, rounded_by. f_equal. f_equal.
  set (u := fun k => z (k - stages d * factor d)%nat). pose proof Fits as H. unfold decimator_fits in H.
  apply andb_prop in H. destruct H as [H _]. apply andb_prop in H. destruct H as [H _]. apply andb_prop in H. destruct H as [H H4].
  apply andb_prop in H. destruct H as [H _]. apply andb_prop in H. destruct H as [_ H2]. apply Z.ltb_lt in H2.
  assert (C : Nat.iter (stages d) (differed (width d)) (fun k => Nat.iter (stages d) (summed (width d)) u (k * factor d)%nat) n mod 2 ^ width d
    = sum n mod 2 ^ width d).
  { rewrite (iter_congruent (2 ^ width d) (differed (width d)) diff (fun a b => differed_diff (width d) a b ltac:(lia)) (stages d) _
      (fun k => Nat.iter (stages d) running u (k * factor d)%nat)).
    - rewrite every_other. unfold sum. f_equal. apply sums_of_differences.
    - intros k. apply (iter_congruent (2 ^ width d) (summed (width d)) running (fun a b => summed_running (width d) a b ltac:(lia))).
      intros i. reflexivity. }
  set (res := Nat.iter _ _ _ n) in *. unfold word. assert (M : 0 < 2 ^ width d) by (apply Z.pow_pos_nonneg; lia).
  destruct (signed d); apply andb_prop in H4; destruct H4 as [L T]; apply Z.leb_le in L; apply Z.ltb_lt in T.
  - rewrite Z.add_mod, C, <- Z.add_mod by lia.
    assert (D : 2 ^ width d = 2 * 2 ^ (width d - 1)) by (rewrite <- Z.pow_succ_r by lia; f_equal; lia).
    rewrite Z.mod_small by lia. lia.
  - rewrite C. apply Z.mod_small. lia.
Qed.
Theorem decimate_within n : lo' <= decimate d z n <= hi'.
Proof.
  rewrite decimate_is. pose proof (sum_within n) as B. pose proof Fits as H. unfold decimator_fits in H.
  apply andb_prop in H. destruct H as [H H6]. apply andb_prop in H. destruct H as [H H5]. apply Z.leb_le in H5. apply Z.leb_le in H6.
  apply andb_prop in H. destruct H as [H _]. apply andb_prop in H. destruct H as [_ H3]. apply Z.leb_le in H3.
  assert (P : 0 < 2 ^ dropped d) by (apply Z.pow_pos_nonneg; lia). unfold rounded_by in *. split.
  - apply Z.le_trans with (1 := H5). apply Z.div_le_mono; lia.
  - apply Z.le_trans with (2 := H6). apply Z.div_le_mono; lia.
Qed.

(* With c near a z + b, the mean of c is near a times what leaves, in its units, + b. *)
Theorem decimate_near (c : nat -> R) (a b e M : R) : (0 <= a)%R ->
  (forall m, (Rabs (c m - (a * IZR (z m) + b)) <= e)%R /\ (Rabs (c m) <= M)%R) -> forall n,
  (Rabs (averaged d c n - (a * IZR (2 ^ dropped d) / IZR (gain_of d) * IZR (decimate d z n) + b))
     <= e + a * IZR (2 ^ dropped d / 2) / IZR (gain_of d))%R /\ (Rabs (averaged d c n) <= M)%R.
Proof.
  intros A H n. destruct shape as [F D0].
  split.
  - set (near := fun k => (from_first c k - (a * from_first (real_of z) k + b))%R).
    assert (Near : forall k, (- e <= near k <= e)%R).
    { intros k. unfold near, from_first, after, real_of. destruct (k <? 0); apply abs_between, H. }
    assert (E : averaged d c n = (a * exact_mean n + b + Nat.iter (stages d) (mean (factor d)) near (Z.of_nat (n * factor d)))%R).
    { unfold averaged, exact_mean, averaged.
      rewrite (means_affine _ F (stages d) (from_first c) (fun k => a * from_first (real_of z) k + b * 1)%R near 1 1) by (intros; unfold near; ring).
      rewrite (means_affine _ F (stages d) (fun k => a * from_first (real_of z) k + b * 1)%R (from_first (real_of z)) (fun _ => 1%R) a b) by (intros; ring).
      assert (One : forall k, (1 <= Nat.iter (stages d) (mean (factor d)) (fun _ => 1%R) k <= 1)%R)
        by (apply (means_between _ F); intros; lra).
      specialize (One (Z.of_nat (n * factor d))). replace (Nat.iter (stages d) (mean (factor d)) (fun _ => 1%R) (Z.of_nat (n * factor d))) with 1%R by lra.
      ring. }
    pose proof (means_between _ F (- e) e near (stages d) Near (Z.of_nat (n * factor d))) as B.
    set (rest := Nat.iter (stages d) (mean (factor d)) near (Z.of_nat (n * factor d))) in *.
    pose proof gain_pos as P. assert (P' := P). apply IZR_lt in P. rewrite decimate_is. set (s := sum n) in *.
    assert (Sm : exact_mean n = (IZR s / IZR (gain_of d))%R) by (unfold s; rewrite sum_is; field; lra).
    assert (Ro : (Rabs (IZR s - IZR (2 ^ dropped d) * IZR (rounded_by d s)) <= IZR (2 ^ dropped d / 2))%R).
    { rewrite <- mult_IZR, <- minus_IZR, <- abs_IZR. apply IZR_le.
      unfold rounded_by. set (t := 2 ^ dropped d) in *. assert (T : 0 < t) by (apply Z.pow_pos_nonneg; lia).
      pose proof (Z.div_mod (s + t / 2) t ltac:(lia)) as D1. pose proof (Z.mod_pos_bound (s + t / 2) t T) as D2.
      assert (T2 : t = 1 \/ t = 2 * (t / 2)).
      { unfold t. destruct (Z.eq_dec (dropped d) 0) as [->|N0]; [left; reflexivity|right].
        replace (dropped d) with (Z.succ (dropped d - 1)) by lia. rewrite Z.pow_succ_r by lia.
        rewrite (Z.mul_comm 2 (2 ^ _)), Z.div_mul by lia. lia. }
      destruct T2 as [T2|T2]; [rewrite T2 in *; change (1 / 2) with 0 in *; lia|lia]. }
    set (h := IZR (2 ^ dropped d / 2)) in *. set (t := IZR (2 ^ dropped d)) in *. set (g := IZR (gain_of d)) in *.
    replace (averaged d c n - (a * t / g * IZR (rounded_by d s) + b))%R with (rest + a / g * (IZR s - t * IZR (rounded_by d s)))%R
      by (rewrite E, Sm; field; lra).
    eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [apply Rabs_le; exact B|].
    assert (Q : (0 <= a / g)%R) by (apply Rmult_le_pos; [exact A|left; apply Rinv_0_lt_compat; exact P]).
    rewrite Rabs_mult, (Rabs_pos_eq (a / g)) by exact Q. replace (a * h / g)%R with (a / g * h)%R by (field; lra).
    apply Rmult_le_compat_l; [exact Q|exact Ro].
  - apply Rabs_le. apply (means_between _ F). intros k. unfold from_first, after. destruct (k <? 0); apply abs_between, H.
Qed.
End Decimated.

(* What holds of the past and of all that follows holds of both. *)
Lemma preceded_near {A B : Type} d (P : A -> B -> Prop) p q u v : P p q -> (forall m, P (u m) (v m)) ->
  forall m, P (preceded d p u m) (preceded d q v m).
Proof. intros H N m. unfold preceded. destruct (Nat.ltb m (factor d)); [exact H|apply N]. Qed.
Lemma preceded_holds {A : Type} d (P : A -> Prop) p u : P p -> (forall m, P (u m)) -> forall m, P (preceded d p u m).
Proof. intros H N m. unfold preceded. destruct (Nat.ltb m (factor d)); [exact H|apply N]. Qed.
Lemma near_near a b c d e f : (Rabs (a - b) <= d -> Rabs (b - c) <= e -> d + e <= f -> Rabs (a - c) <= f)%R.
Proof. intros A B F. replace (a - c)%R with ((a - b) + (b - c))%R by ring. eapply Rle_trans; [apply Rabs_triang|]. lra. Qed.
