(* Responses of recursions as polynomials, rounded, and what the rounding leaves.

   `divide` makes a polynomial Q with D' Q = P + r, sample by sample, each rounded down; |r| is at most what it counts.
   Here D' = [2^k; a1; a2; ...], and D and B are nearly multiples of D' and B': s D = c D' + .., s B = c B' + .. . Then
   D * y = B * x gives P * y = (B' Q) * x + e with a small e (`through`). No series is summed, and no limit is taken. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams.
Open Scope Z_scope.

(* Polynomials act on sequences over all times as they should. *)
Lemma taps_ext l : forall u v k, (forall j, j <= k -> u j = v j) -> taps l u k = taps l v k.
Proof.
  induction l as [|c l IH]; intros u v k H; simpl; [reflexivity|].
  rewrite (H k) by lia. rewrite (IH u v); [reflexivity|]. intros; apply H; lia.
Qed.
Lemma taps_zero l : forall k, taps l (fun _ => 0%R) k = 0%R.
Proof. induction l as [|c l IH]; intros k; simpl; [reflexivity|]. rewrite IH; ring. Qed.
Lemma taps_plus l : forall u v k, taps l (fun j => u j + v j)%R k = (taps l u k + taps l v k)%R.
Proof. induction l as [|c l IH]; intros u v k; simpl; [ring|]. rewrite IH; ring. Qed.
Lemma taps_multiple l : forall x u k, taps l (fun j => x * u j)%R k = (x * taps l u k)%R.
Proof. induction l as [|c l IH]; intros x u k; simpl; [ring|]. rewrite IH; ring. Qed.
Lemma taps_add a : forall b u k, taps (add a b) u k = (taps a u k + taps b u k)%R.
Proof. induction a as [|x a IH]; intros [|y b] u k; simpl; try ring. rewrite plus_IZR, IH; ring. Qed.
Lemma taps_scale c b : forall u k, taps (scale c b) u k = (IZR c * taps b u k)%R.
Proof. induction b as [|y b IH]; intros u k; simpl; [ring|]. fold (scale c b). rewrite mult_IZR, IH; ring. Qed.
Lemma taps_bound l : forall u k M, (0 <= M)%R -> (forall j, j <= k -> (Rabs (u j) <= M)%R) ->
  (Rabs (taps l u k) <= IZR (norm1 l) * M)%R.
Proof.
  induction l as [|c l IH]; intros u k M HM H; simpl; [rewrite Rabs_R0; lra|].
  rewrite plus_IZR, abs_IZR, Rmult_plus_distr_r. eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat.
  - rewrite Rabs_mult. apply Rmult_le_compat_l; [apply Rabs_pos|apply H; lia].
  - apply IH; [exact HM|]. intros; apply H; lia.
Qed.

(* Sequences that begin at sample 0. *)
Lemma after_at p u n : after p u (Z.of_nat n) = u n.
Proof. unfold after. destruct (Z.of_nat n <? 0) eqn:E; [apply Z.ltb_lt in E; lia|]. rewrite Nat2Z.id. reflexivity. Qed.
Lemma after_before p u k : k < 0 -> after p u k = p.
Proof. intros H. unfold after. apply Z.ltb_lt in H. rewrite H. reflexivity. Qed.
Lemma taps_silent l : forall u k, (forall j, j <= k -> u j = 0%R) -> taps l u k = 0%R.
Proof. intros u k H. rewrite (taps_ext l u (fun _ => 0%R)) by exact H. apply taps_zero. Qed.
Lemma taps_conv l : forall u n, taps l (from_zero u) (Z.of_nat n) = conv l u n.
Proof.
  induction l as [|c l IH]; intros u n; [reflexivity|].
  cbn [taps conv]. unfold from_zero at 1. rewrite after_at. f_equal. destruct n as [|m].
  - apply taps_silent. intros j Hj. apply after_before. simpl in Hj. lia.
  - replace (Z.of_nat (S m) - 1) with (Z.of_nat m) by lia. apply IH.
Qed.
Lemma from_zero_conv l u k : from_zero (conv l u) k = taps l (from_zero u) k.
Proof.
  destruct (Z.ltb_spec k 0) as [H|H].
  - unfold from_zero. rewrite after_before by exact H. symmetry. apply taps_silent. intros j Hj. apply after_before. lia.
  - rewrite <- (Z2Nat.id k H). unfold from_zero at 1. rewrite after_at. symmetry. apply taps_conv.
Qed.
Fixpoint sum (l : list Z) : Z := match l with [] => 0 | c :: l' => c + sum l' end.
Lemma taps_constant l c : forall k, taps l (fun _ => c) k = (IZR (sum l) * c)%R.
Proof. induction l as [|x l IH]; intros k; cbn [taps sum]; [ring|]. rewrite IH, plus_IZR. ring. Qed.
Lemma taps_after l p u n : taps l (after p u) (Z.of_nat n) = (conv l (fun m => u m - p)%R n + IZR (sum l) * p)%R.
Proof.
  rewrite <- (taps_conv l), <- (taps_constant l p (Z.of_nat n)), <- (taps_plus l). apply taps_ext. intros j _.
  unfold from_zero, after. destruct (j <? 0); ring.
Qed.

(* Many products with one coefficient: from a table of its multiples, six bits of the other factor at a time. *)
Inductive multiples := Multiple (v : Z) | Branch (last : Z) (even odd : multiples).
Fixpoint multiples_of (k : nat) (v step : Z) : multiples :=
  match k with O => Multiple v | S k' => Branch (v + step) (multiples_of k' v (2 * step)) (multiples_of k' (v + step) (2 * step)) end.
Definition table (c : Z) : multiples := multiples_of 6 0 c.
Definition times_64 (z : Z) : Z :=
  match z with Z0 => 0 | Zpos p => Zpos p~0~0~0~0~0~0 | Zneg p => Zneg p~0~0~0~0~0~0 end.
Fixpoint look_up (whole t : multiples) (p : positive) : Z :=
  match t with
  | Multiple _ => 0
  | Branch last even odd =>
      match p with
      | xH => last
      | xO q => match even with Multiple v => v + times_64 (look_up whole whole q) | _ => look_up whole even q end
      | xI q => match odd with Multiple v => v + times_64 (look_up whole whole q) | _ => look_up whole odd q end
      end
  end.
Definition times_by (t : multiples) (y : Z) : Z :=
  match y with Z0 => 0 | Zpos p => look_up t t p | Zneg p => - look_up t t p end.

Lemma times_64_spec z : times_64 z = 64 * z.
Proof. destruct z; reflexivity. Qed.
Lemma look_up_spec c : forall p k v step, (k < 6)%nat -> step * 2 ^ Z.of_nat k = 32 * c ->
  look_up (table c) (multiples_of (S k) v step) p = v + step * Zpos p.
Proof.
  assert (Even : forall (k : nat) step, step * 2 ^ Z.of_nat (S k) = 32 * c -> 2 * step * 2 ^ Z.of_nat k = 32 * c)
    by (intros k step H; rewrite <- H, Nat2Z.inj_succ, Z.pow_succ_r by lia; ring).
  assert (Whole : 1 * c * 2 ^ Z.of_nat 5 = 32 * c) by (change (2 ^ Z.of_nat 5) with 32; ring).
  induction p as [q IH|q IH|]; intros k v step K H.
  - destruct k as [|k]; cbn [multiples_of look_up].
    + fold (table c). unfold table at 2. rewrite (IH 5%nat 0 c) by (try lia; rewrite <- Whole; ring). rewrite times_64_spec.
      change (2 ^ Z.of_nat 0) with 1 in H. rewrite (Pos2Z.inj_xI q). nia.
    + specialize (IH k (v + step) (2 * step) ltac:(lia) (Even k step H)). cbn [multiples_of] in IH. rewrite IH, (Pos2Z.inj_xI q). ring.
  - destruct k as [|k]; cbn [multiples_of look_up].
    + fold (table c). unfold table at 2. rewrite (IH 5%nat 0 c) by (try lia; rewrite <- Whole; ring). rewrite times_64_spec.
      change (2 ^ Z.of_nat 0) with 1 in H. rewrite (Pos2Z.inj_xO q). nia.
    + specialize (IH k v (2 * step) ltac:(lia) (Even k step H)). cbn [multiples_of] in IH. rewrite IH, (Pos2Z.inj_xO q). ring.
  - cbn [multiples_of look_up]. ring.
Qed.
Lemma times_by_spec c y : times_by (table c) y = c * y.
Proof.
  assert (P : forall p, look_up (table c) (table c) p = c * Zpos p).
  { intros p. unfold table at 2. rewrite (look_up_spec c p 5 0 c); [ring|lia|]. change (2 ^ Z.of_nat 5) with 32. ring. }
  destruct y as [|p|p]; cbn [times_by]; [ring|apply P|]. rewrite P, <- Pos2Z.opp_pos. ring.
Qed.

(* What the samples so far, the last one first, still owe to the coming ones. *)
Fixpoint weighted (a past : list Z) : Z :=
  match a, past with x :: a', y :: past' => x * y + weighted a' past' | _, _ => 0 end.
Fixpoint owed (a past : list Z) : list Z := match a with [] => [] | _ :: a' => weighted a past :: owed a' past end.
Fixpoint response (samples : nat) (k : Z) (a past P : list Z) : list Z * Z :=
  match samples with
  | O => ([], norm1 (add (owed a past) (scale (-1) P)))
  | S m =>
      let y := Z.shiftr (hd 0 P - weighted a past) k in
      let (Q, r) := response m k a (y :: past) (tl P) in (y :: Q, r + 2 ^ k)
  end.

Fixpoint weighted_by (t : list multiples) (past : list Z) : Z :=
  match t, past with x :: t', y :: past' => times_by x y + weighted_by t' past' | _, _ => 0 end.
Lemma weighted_by_spec a : forall past, weighted_by (map table a) past = weighted a past.
Proof. induction a as [|x a IH]; intros [|y past]; cbn [map weighted_by weighted]; try reflexivity. rewrite times_by_spec, IH. reflexivity. Qed.
(* `response` with tables of a. *)
Fixpoint response_by (t : list multiples) (samples : nat) (k : Z) (a past P : list Z) : list Z * Z :=
  match samples with
  | O => ([], norm1 (add (owed a past) (scale (-1) P)))
  | S m =>
      let y := Z.shiftr (hd 0 P - weighted_by t past) k in
      let (Q, r) := response_by t m k a (y :: past) (tl P) in (y :: Q, r + 2 ^ k)
  end.
Lemma response_by_spec k a : forall samples past P, response_by (map table a) samples k a past P = response samples k a past P.
Proof. induction samples as [|m IH]; intros past P; cbn [response_by response]; [reflexivity|]. rewrite weighted_by_spec, IH. reflexivity. Qed.

Definition monic (k : Z) (a : list Z) : list Z := 2 ^ k :: a.
Lemma owed_next a : forall y past u k, taps (owed a (y :: past)) u k = (IZR y * taps a u k + taps (owed (tl a) past) u k)%R.
Proof.
  induction a as [|x a IH]; intros y past u k; [simpl; ring|].
  cbn [owed weighted taps tl]. rewrite plus_IZR, mult_IZR.
  destruct a as [|x' a']; [simpl; ring|].
  rewrite IH. cbn [tl owed taps]. ring.
Qed.
Lemma taps_first P u k : taps P u k = (IZR (hd 0%Z P) * u k + taps (tl P) u (k - 1))%R.
Proof. destruct P; simpl; ring. Qed.

Lemma response_spec (k : Z) (a : list Z) : 0 <= k -> forall samples past P Q r,
  response samples k a past P = (Q, r) ->
  exists rr, norm1 rr <= r /\ forall u t,
    (taps Q (taps (monic k a) u) t = taps P u t - taps (owed a past) u t + taps rr u t)%R.
Proof.
  intros K. induction samples as [|m IH]; intros past P Q r; cbn [response]; intros E.
  - injection E as <- <-. exists (add (owed a past) (scale (-1) P)). split; [lia|]. intros u t.
    rewrite taps_add, taps_scale. change (taps [] (taps (monic k a) u) t) with 0%R. change (IZR (-1)) with (-1)%R. ring.
  - set (v := hd 0 P - weighted a past) in *. set (y := Z.shiftr v k) in *.
    destruct (response m k a (y :: past) (tl P)) as [Q' r'] eqn:E'. injection E as <- <-.
    destruct (IH _ _ _ _ E') as [rr [N H]].
    assert (Y : exists e, y * 2 ^ k = v + e /\ Z.abs e <= 2 ^ k).
    { exists (y * 2 ^ k - v). split; [lia|]. unfold y. rewrite Z.shiftr_div_pow2 by exact K.
      assert (0 < 2 ^ k) by (apply Z.pow_pos_nonneg; lia).
      pose proof (Z.div_mod v (2 ^ k) ltac:(lia)). pose proof (Z.mod_pos_bound v (2 ^ k) ltac:(lia)). lia. }
    destruct Y as [e [Y Be]]. exists (e :: rr). split; [simpl; lia|]. intros u t.
    assert (W : (taps (owed a past) u t = IZR (weighted a past) * u t + taps (owed (tl a) past) u (t - 1))%R).
    { destruct a as [|x a']; [simpl; ring|reflexivity]. }
    rewrite W, (taps_first P). cbn [taps]. rewrite H, owed_next.
    unfold monic. cbn [taps].
    assert (V : (IZR y * IZR (2 ^ k)%Z = IZR (hd 0%Z P) - IZR (weighted a past) + IZR e)%R)
      by (rewrite <- mult_IZR, Y; unfold v; rewrite plus_IZR, minus_IZR; ring).
    rewrite Rmult_plus_distr_l, <- Rmult_assoc, V. ring.
Qed.

(* P / D', and one / D' from `one` on, of which the first residual is 0. *)
Definition divide (samples : N) (k : Z) (a P : list Z) : list Z * Z := response_by (map table a) (N.to_nat samples) k a [] P.
Definition impulse (samples : N) (k : Z) (a : list Z) (one : Z) : list Z * Z :=
  let (Q, r) := response_by (map table a) (N.to_nat samples) k a [one] [] in (one :: Q, r).

Lemma divide_spec samples k a P Q r : 0 <= k -> divide samples k a P = (Q, r) ->
  exists rr, norm1 rr <= r /\ forall u t, (taps Q (taps (monic k a) u) t = taps P u t + taps rr u t)%R.
Proof.
  unfold divide. rewrite response_by_spec. intros K E. destruct (response_spec k a K _ _ _ _ _ E) as [rr [N H]]. exists rr. split; [exact N|]. intros u t. rewrite H.
  assert (Z0 : taps (owed a []) u t = 0%R).
  { generalize t. clear. induction a as [|x a IH]; intros t; cbn [owed taps]; [reflexivity|].
    rewrite IH. destruct a; simpl; ring. }
  rewrite Z0. ring.
Qed.
Lemma impulse_spec samples k a one Q r : 0 <= k -> impulse samples k a one = (Q, r) ->
  exists rr, norm1 rr <= r /\ forall u t,
    (taps Q (taps (monic k a) u) t = IZR (one * 2 ^ k)%Z * u t + taps rr u (t - 1))%R.
Proof.
  intros K. unfold impulse. rewrite response_by_spec. destruct (response (N.to_nat samples) k a [one] []) as [Q' r'] eqn:E'. intros E.
  injection E as <- <-. destruct (response_spec k a K _ _ _ _ _ E') as [rr [N H]]. exists rr. split; [exact N|].
  intros u t. cbn [taps]. rewrite H, owed_next. unfold monic. cbn [taps].
  assert (Z0 : forall b t', taps (owed b []) u t' = 0%R).
  { induction b as [|x b IH]; intros t'; cbn [owed taps]; [reflexivity|]. rewrite IH. destruct b; simpl; ring. }
  rewrite Z0, mult_IZR. ring.
Qed.

(* A product c Q, coefficient by coefficient and with no list in between: lists of long integers are what takes time. Sums
   of its coefficients are then found without the product. `past` are the coefficients of Q so far, the last one first. *)
Fixpoint products (t : list multiples) (c past Q : list Z) : list Z :=
  match Q with [] => owed (tl c) past | q :: Q' => weighted_by t (q :: past) :: products t c (q :: past) Q' end.
Definition product (c Q : list Z) : list Z := products (map table c) c [] Q.
Fixpoint norm_of_products (t : list multiples) (c past Q : list Z) : Z :=
  match Q with
  | [] => norm1 (owed (tl c) past)
  | q :: Q' => Z.abs (weighted_by t (q :: past)) + norm_of_products t c (q :: past) Q'
  end.
Definition norm_of_product (c Q : list Z) : Z := norm_of_products (map table c) c [] Q.
Fixpoint signs_of_products (t : list multiples) (c past Q : list Z) (p n : Z) : Z * Z :=
  match Q with
  | [] => by_sign (owed (tl c) past) p n
  | q :: Q' =>
      let v := weighted_by t (q :: past) in
      if 0 <=? v then signs_of_products t c (q :: past) Q' (p + v) n else signs_of_products t c (q :: past) Q' p (n + v)
  end.
Definition signs_of_product (c Q : list Z) : Z * Z := signs_of_products (map table c) c [] Q 0 0.

Lemma owed_now a past u k : taps (owed a past) u k = (IZR (weighted a past) * u k + taps (owed (tl a) past) u (k - 1))%R.
Proof. destruct a as [|x a]; [simpl; ring|reflexivity]. Qed.
Lemma owed_nothing a u : forall k, taps (owed a []) u k = 0%R.
Proof. induction a as [|x a IH]; intros k; cbn [owed taps]; [reflexivity|]. rewrite IH. destruct a; simpl; ring. Qed.
Lemma taps_products c : forall Q past u k, taps (products (map table c) c past Q) u k = (taps (owed (tl c) past) u k + taps Q (taps c u) k)%R.
Proof.
  induction Q as [|q Q IH]; intros past u k; cbn [products taps]; [ring|].
  rewrite weighted_by_spec, IH, owed_next, (taps_first c), (owed_now (tl c)).
  assert (W : (IZR (weighted c (q :: past)) = IZR (hd 0%Z c) * IZR q + IZR (weighted (tl c) past))%R).
  { destruct c as [|x c]; [simpl; ring|]. cbn [weighted hd tl]. rewrite plus_IZR, mult_IZR. ring. }
  rewrite W. ring.
Qed.
Lemma taps_product c Q u k : taps (product c Q) u k = taps Q (taps c u) k.
Proof. unfold product. rewrite taps_products, owed_nothing. ring. Qed.
Lemma conv_product c Q u n : conv (product c Q) u n = conv Q (conv c u) n.
Proof.
  rewrite <- !taps_conv, taps_product. apply taps_ext. intros j _. symmetry. apply from_zero_conv.
Qed.
Lemma norm_of_product_is c Q : norm_of_product c Q = norm1 (product c Q).
Proof.
  unfold norm_of_product, product. generalize (@nil Z). induction Q as [|q Q IH]; intros past; cbn [norm_of_products products norm1]; [reflexivity|].
  rewrite IH. reflexivity.
Qed.
Lemma signs_of_product_is c Q : signs_of_product c Q = by_sign (product c Q) 0 0.
Proof.
  unfold signs_of_product, product. generalize (@nil Z). generalize 0 at 1 3. generalize 0.
  induction Q as [|q Q IH]; intros n p past; cbn [signs_of_products products by_sign]; [reflexivity|]. rewrite !IH. reflexivity.
Qed.

(* A recursion whose coefficients are replaced by others that are nearly in proportion: s D = c D' + .., s B = c B' + .. *)
Definition drift (s c : Z) (l l' : list Z) : list Z := add (scale s l) (scale (- c) l').
Lemma drift_spec s c l l' u t : (IZR s * taps l u t = IZR c * taps l' u t + taps (drift s c l l') u t)%R.
Proof. unfold drift. rewrite taps_add, !taps_scale, opp_IZR. ring. Qed.
