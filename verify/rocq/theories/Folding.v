(* How much of the frequencies around the multiples of the lower rate a decimator and its filter let through.

   With u = sin^2 (pi p), p the frequency at the output in units of the lower rate, the squares of the magnitudes of numerators
   and denominators are polynomials in u, and the means of N stages let through from (k - p) / R, in the square,
   (u / (R sin (pi (k - p) / R))^2)^N, and less from (k + p) / R. So a gain g is proven where

       u^N B(u) <= g^2 (R sin (pi (k - p) / R))^(2 N) A(u).

   The right side without A falls with p. On an interval of u, the quotient of u^N B(u) and A(u) is at most the largest one of
   their coefficients (Forms.v); the right side is at least that at the interval's end. Intervals are halved until that is
   enough for all k. A gain is then right whatever the numbers of the search were: they only decide whether it is found so. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Angles Waves Forms.
Open Scope R_scope.

(* 1. The right side, from below: sines and cosines of k in units of 1 / 2^w, and roots for an upper bound x of 2^w u. *)
Fixpoint power_below (w x : Z) (n : nat) : Z := match n with O => 2 ^ w | S m => Z.shiftr (power_below w x m * x) w end%Z.
Fixpoint half_above_times (w : Z) (r : nat) (x : Z) : Z := match r with O => x | S r' => half_above w (half_above_times w r' x) end.
Definition roots (w : Z) (r : nat) (x : Z) : Z * Z :=
  let v := half_above_times w r x in (root_below w (2 ^ w - v), root_above w v).
Definition sine_below (w s c : Z) (ab : Z * Z) : Z := Z.shiftr (s * fst ab - c * snd ab) w.
Definition right_side (w : Z) (r n : nat) (s c : Z) (ab : Z * Z) : Z :=
  let e := (2 ^ Z.of_nat r * sine_below w s c ab)%Z in power_below w (Z.shiftr (e * e) w) n.
Definition sine_of (w : Z) (r k : nat) : Z := root_below w (fst (sine w (r - 1) (Z.of_nat k))).
Definition cosine_of (w : Z) (r k : nat) : Z := root_above w (2 ^ w - fst (sine w (r - 1) (Z.of_nat k))).

Lemma floor_le w z : (0 <= w)%Z -> IZR (2 ^ w) * IZR (Z.shiftr z w) <= IZR z.
Proof. intros W. rewrite Z.shiftr_div_pow2 by exact W. rewrite <- mult_IZR. apply IZR_le, Z.mul_div_le, power_pos_Z, W. Qed.
Lemma power_below_is w x n t : (0 <= w)%Z -> (0 <= x)%Z -> IZR x <= IZR (2 ^ w) * t ->
  0 <= IZR (power_below w x n) <= IZR (2 ^ w) * t ^ n.
Proof.
  intros W X T. pose proof (one_pos w W) as O. apply IZR_le in X. assert (T0 : 0 <= t) by (apply Rmult_le_reg_l with (IZR (2 ^ w)); lra).
  induction n as [|n [L H]]; cbn [power_below pow]; [lra|]. set (y := power_below w x n) in *.
  split.
  - apply IZR_le. apply Z.shiftr_nonneg. apply Z.mul_nonneg_nonneg; apply le_IZR; lra.
  - apply Rmult_le_reg_l with (IZR (2 ^ w)); [exact O|]. eapply Rle_trans; [apply floor_le, W|]. rewrite mult_IZR.
    replace (IZR (2 ^ w) * (IZR (2 ^ w) * (t * t ^ n))) with ((IZR (2 ^ w) * t ^ n) * (IZR (2 ^ w) * t)) by ring.
    apply Rmult_le_compat; assumption.
Qed.
Lemma halvings w r x t : (0 <= w)%Z -> 0 <= t <= PI / 2 -> IZR (2 ^ w) * (sin t * sin t) <= IZR x ->
  IZR (2 ^ w) * (sin (t / 2 ^ r) * sin (t / 2 ^ r)) <= IZR (half_above_times w r x).
Proof.
  intros W T H. induction r as [|r IH]; cbn [half_above_times pow]; [replace (t / 1) with t by field; exact H|].
  set (y := half_above_times w r x) in *. assert (P : 1 <= 2 ^ r) by (apply pow_R1_Rle; lra).
  assert (D : 2 * (t / (2 * 2 ^ r)) = t / 2 ^ r) by (field; lra).
  assert (C : 0 <= cos (2 * (t / (2 * 2 ^ r)))).
  { rewrite D. assert (0 <= t / 2 ^ r <= t).
    { split; [apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; lra]|].
      apply Rmult_le_reg_r with (2 ^ r); [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. nra. }
    apply cos_ge_0; lra. }
  assert (E : enclosed w (0, y)%Z (sin (2 * (t / (2 * 2 ^ r))) * sin (2 * (t / (2 * 2 ^ r))))).
  { rewrite D. unfold enclosed. cbn [fst snd]. split; [|exact IH]. pose proof (one_pos w W). pose proof (sin2_bound (t / 2 ^ r)).
    apply Rmult_le_pos; lra. }
  exact (proj2 (halved_is w W _ _ C E)).
Qed.
Section Right.
Variables (d : decimator) (r k : nat) (p : R).
Hypothesis F : Z.of_nat (factor d) = (2 ^ Z.of_nat r)%Z.
Hypothesis K : (1 <= k <= factor d / 2)%nat.
Hypothesis P : 0 <= p <= 1 / 2.
Lemma factor_power : INR (factor d) = 2 ^ r.
Proof. rewrite INR_IZR_INZ, F, <- pow_IZR. reflexivity. Qed.
Lemma r_positive : (1 <= r)%nat.
Proof. destruct r; [|lia]. change (2 ^ Z.of_nat 0)%Z with 1%Z in F. assert (factor d = 1%nat) by lia. rewrite H in K. simpl in K. lia. Qed.
Lemma k_angle : angle (r - 1) (Z.of_nat k) = PI * INR k / INR (factor d).
Proof.
  unfold angle. rewrite factor_power, <- INR_IZR_INZ, <- pow_IZR. pose proof r_positive. replace r with (S (r - 1)) at 2 by lia.
  cbn [pow]. assert (0 < IZR 2 ^ (r - 1)) by (apply pow_lt; lra). field. lra.
Qed.
Lemma k_within : (0 <= Z.of_nat k <= 2 ^ Z.of_nat (r - 1))%Z.
Proof.
  split; [lia|]. pose proof r_positive. pose proof (Nat.mul_div_le (factor d) 2 ltac:(lia)).
  assert (Z.of_nat r = Z.succ (Z.of_nat (r - 1))) by lia. rewrite H1, Z.pow_succ_r in F by lia. lia.
Qed.
Lemma sine_cosine w : (0 <= w)%Z -> 0 <= IZR (sine_of w r k) <= IZR (2 ^ w) * sin (PI * INR k / INR (factor d))
  /\ IZR (2 ^ w) * cos (PI * INR k / INR (factor d)) <= IZR (cosine_of w r k).
Proof.
  intros W. pose proof (sine_is w W (r - 1) _ k_within) as [L U]. rewrite k_angle in L, U.
  destruct (angles d k p K P) as [_ [A _]]. set (t := PI * INR k / INR (factor d)) in *. pose proof PI_RGT_0.
  pose proof (sin2_bound t) as B. unfold sine_of, cosine_of. split; [split|].
  - apply IZR_le. apply Z.sqrt_nonneg.
  - rewrite <- (sqrt_square (sin t)) by (apply sin_ge_0; lra). apply root_below_is; [exact W|exact L|lra].
  - rewrite (cos_is_root t) by (apply cos_ge_0; lra). apply root_above_is; [exact W| |lra]. rewrite minus_IZR. lra.
Qed.
Lemma right_side_is w x : (0 <= w)%Z -> IZR (2 ^ w) * (sin (PI * p) * sin (PI * p)) <= IZR x ->
  (0 < sine_below w (sine_of w r k) (cosine_of w r k) (roots w r x))%Z ->
  0 <= IZR (right_side w r (stages d) (sine_of w r k) (cosine_of w r k) (roots w r x))
    <= IZR (2 ^ w) * (INR (factor d) * INR (factor d) * (lower_sine d k p * lower_sine d k p)) ^ stages d.
Proof.
  intros W X E. pose proof (one_pos w W) as O. pose proof PI_RGT_0 as Q. destruct (sine_cosine w W) as [S C].
  destruct (angles d k p K P) as [_ [A [B _]]]. set (R := INR (factor d)) in *. pose proof (r_pos d k K) as R0. fold R in R0.
  set (a := PI * INR k / R) in *. set (b := PI * p / R) in *.
  assert (V : IZR (2 ^ w) * (sin b * sin b) <= IZR (half_above_times w r x)).
  { unfold b, R. rewrite factor_power. apply halvings; [exact W|split; nra|exact X]. }
  set (s := sine_of w r k) in *. set (c := cosine_of w r k) in *. set (v := half_above_times w r x) in *.
  assert (SB : 0 <= sin b) by (apply sin_ge_0; lra). assert (CB : 0 <= cos b) by (apply cos_ge_0; lra).
  assert (SA : 0 <= sin a) by (apply sin_ge_0; lra). assert (CA : 0 <= cos a) by (apply cos_ge_0; lra).
  pose proof (sin2_bound b) as BB.
  assert (H1 : 0 <= IZR (root_below w (2 ^ w - v)) <= IZR (2 ^ w) * cos b).
  { split; [apply IZR_le, Z.sqrt_nonneg|]. rewrite (cos_is_root b CB). apply root_below_is; [exact W|rewrite minus_IZR; lra|lra]. }
  assert (H2 : IZR (2 ^ w) * sin b <= IZR (root_above w v)).
  { rewrite <- (sqrt_square (sin b)) by exact SB. apply root_above_is; [exact W|exact V|lra]. }
  assert (LS : lower_sine d k p = sin a * cos b - cos a * sin b).
  { unfold lower_sine. fold R. rewrite <- sin_minus. f_equal. unfold a, b. field. lra. }
  unfold right_side. unfold roots in *. fold v in E |- *. set (e := sine_below w s c (root_below w (2 ^ w - v), root_above w v)) in *.
  assert (EL : IZR e <= IZR (2 ^ w) * lower_sine d k p).
  { apply Rmult_le_reg_l with (IZR (2 ^ w)); [exact O|]. unfold e, sine_below. eapply Rle_trans; [apply floor_le, W|]. cbn [fst snd].
    rewrite minus_IZR, !mult_IZR, LS. set (al := IZR (root_below w (2 ^ w - v))) in *. set (be := IZR (root_above w v)) in *.
    assert (M1 : IZR s * al <= (IZR (2 ^ w) * sin a) * (IZR (2 ^ w) * cos b)) by (apply Rmult_le_compat; lra).
    assert (M2 : (IZR (2 ^ w) * cos a) * (IZR (2 ^ w) * sin b) <= IZR c * be) by (apply Rmult_le_compat; try (apply Rmult_le_pos; lra); lra).
    lra. }
  apply IZR_lt in E. assert (RP : IZR (2 ^ Z.of_nat r) = R) by (unfold R; rewrite factor_power, <- pow_IZR; reflexivity).
  assert (EE : IZR (2 ^ Z.of_nat r * e) <= IZR (2 ^ w) * (R * lower_sine d k p)).
  { rewrite mult_IZR, RP. replace (IZR (2 ^ w) * (R * lower_sine d k p)) with (R * (IZR (2 ^ w) * lower_sine d k p)) by ring. apply Rmult_le_compat_l; lra. }
  assert (EP : 0 <= IZR (2 ^ Z.of_nat r * e)) by (rewrite mult_IZR, RP; apply Rmult_le_pos; lra).
  set (f := (2 ^ Z.of_nat r * e)%Z) in *. replace (R * R * (lower_sine d k p * lower_sine d k p)) with ((R * lower_sine d k p) * (R * lower_sine d k p)) by ring.
  apply power_below_is; [exact W| |].
  - apply Z.shiftr_nonneg, Z.mul_nonneg_nonneg; apply le_IZR; exact EP.
  - apply Rmult_le_reg_l with (IZR (2 ^ w)); [exact O|]. eapply Rle_trans; [apply floor_le, W|]. rewrite mult_IZR.
    replace (IZR (2 ^ w) * (IZR (2 ^ w) * (R * lower_sine d k p * (R * lower_sine d k p))))
      with ((IZR (2 ^ w) * (R * lower_sine d k p)) * (IZR (2 ^ w) * (R * lower_sine d k p))) by ring.
    apply Rmult_le_compat; assumption.
Qed.
End Right.

(* 2. The search over intervals of u, from a / 2^48, of the length 2^e / 2^48, for all k at once. *)
Definition fine : Z := 80.
Record task := Task { k_of : nat; sine_k : Z; cosine_k : Z; up_to : Z; gain_p : Z; gain_q : Z }.
Definition gain_covers (r n : nat) (M : Z) (ab : Z * Z) (t : task) : bool :=
  (0 <? sine_below fine (sine_k t) (cosine_k t) ab)%Z
  && (M * (gain_q t * gain_q t * 2 ^ fine) <=? gain_p t * gain_p t * right_side fine r n (sine_k t) (cosine_k t) ab * 2 ^ scale_bits)%Z.
Definition undone (r n : nat) (a : Z) (e : nat) (P Q : list Z) (t : task) : bool :=
  (a <=? up_to t)%Z && match quotients_above P Q with
    | None => true
    | Some M => negb (gain_covers r n M (roots fine r ((a + 2 ^ Z.of_nat e) * 2 ^ (fine - 48))) t)
    end.
Definition left_of (r n : nat) (a : Z) (e : nat) (P Q : list Z) (tasks : list task) : list task :=
  match quotients_above P Q with
  | None => filter (fun t => a <=? up_to t)%Z tasks
  | Some M => let ab := roots fine r ((a + 2 ^ Z.of_nat e) * 2 ^ (fine - 48)) in
      filter (fun t => (a <=? up_to t)%Z && negb (gain_covers r n M ab t)) tasks
  end.
Definition shortened (round : Z -> list Z -> list Z) (l : list Z) : list Z := round (Z.of_nat (length l - 1)) l.
Fixpoint search (r n e : nat) (a : Z) (tasks : list task) (P Q : list Z) : bool :=
  match left_of r n a e P Q tasks with
  | [] => true
  | rest => match e with
      | O => false
      | S e' =>
          if search r n e' a rest (shortened rounded_up (first_half P)) (shortened rounded_down (first_half Q))
          then search r n e' (a + 2 ^ Z.of_nat e') rest (shortened rounded_up (second_half P)) (shortened rounded_down (second_half Q))
          else false
      end
  end.

Section Search.
Variables (r n : nat) (Over Under : R -> R) (unit : R).
Hypothesis Unit : 0 < unit.
Definition covers (e : nat) (a : Z) (P Q : list Z) : Prop := P <> [] /\ Q <> [] /\ forall X Y, 0 <= X -> 0 <= Y -> X + Y = 1 ->
  let u := (IZR a + 2 ^ e * X) / 2 ^ 48 in Over u <= unit * blend P X Y /\ unit * blend Q X Y <= Under u.
Definition is_covered (t : task) (u : R) : Prop := 0 < Under u /\ exists x : Z, 2 ^ 48 * u <= IZR x
  /\ (let ab := roots fine r (x * 2 ^ (fine - 48)) in (0 < sine_below fine (sine_k t) (cosine_k t) ab)%Z
      /\ Over u * IZR (gain_q t * gain_q t * 2 ^ fine)
         <= IZR (gain_p t * gain_p t * right_side fine r n (sine_k t) (cosine_k t) ab) * Under u).

Lemma first_half_length l : length (first_half l) = length l.
Proof. apply inserted_length. Qed.
Lemma second_half_length l : length (second_half l) = length l.
Proof. unfold second_half. rewrite rev_length, inserted_length, rev_length. reflexivity. Qed.
Lemma shortened_up_is (l m : list Z) X Y : length l = length m -> 0 <= X -> 0 <= Y -> blend l X Y <= 2 ^ (length m - 1) * blend (shortened rounded_up l) X Y.
Proof.
  intros L HX HY. unfold shortened. eapply Rle_trans; [apply (up_is (Z.of_nat (length l - 1)) l X Y); lia || assumption|].
  rewrite L, <- pow_IZR. lra.
Qed.
Lemma shortened_down_is (l m : list Z) X Y : length l = length m -> 0 <= X -> 0 <= Y -> 2 ^ (length m - 1) * blend (shortened rounded_down l) X Y <= blend l X Y.
Proof.
  intros L HX HY. unfold shortened. eapply Rle_trans; [|apply (down_is (Z.of_nat (length l - 1)) l X Y); lia || assumption].
  rewrite L, <- pow_IZR. lra.
Qed.
Lemma not_empty {A} (l m : list A) : length l = length m -> m <> [] -> l <> [].
Proof. intros L N E. subst l. destruct m; [congruence|discriminate]. Qed.
Lemma shortened_up_length l : length (shortened rounded_up l) = length l.
Proof. unfold shortened, rounded_up. apply map_length. Qed.
Lemma shortened_down_length l : length (shortened rounded_down l) = length l.
Proof. unfold shortened, rounded_down. apply map_length. Qed.

Lemma covers_half (h : list Z -> list Z) (low : R) e a b P Q : (forall l, length (h l) = length l) ->
  (forall l X Y, l <> [] -> X + Y = 1 -> blend (h l) X Y = 2 ^ (length l - 1) * blend l (low + X / 2) (1 - (low + X / 2))) ->
  0 <= low <= 1 / 2 -> IZR b = IZR a + 2 ^ S e * low -> covers (S e) a P Q ->
  covers e b (shortened rounded_up (h P)) (shortened rounded_down (h Q)).
Proof.
  intros L H Lo B [NP [NQ C]]. split; [apply (not_empty _ P); [rewrite shortened_up_length; apply L|exact NP]|].
  split; [apply (not_empty _ Q); [rewrite shortened_down_length; apply L|exact NQ]|]. intros X Y HX HY E. cbv zeta.
  specialize (C (low + X / 2) (1 - (low + X / 2)) ltac:(lra) ltac:(lra) ltac:(lra)). cbv zeta in C.
  replace ((IZR b + 2 ^ e * X) / 2 ^ 48) with ((IZR a + 2 ^ S e * (low + X / 2)) / 2 ^ 48) by (rewrite B; cbn [pow]; field).
  destruct C as [C1 C2]. pose proof (shortened_up_is (h P) P X Y (L P) HX HY) as U. pose proof (shortened_down_is (h Q) Q X Y (L Q) HX HY) as D.
  rewrite (H P X Y NP E) in U. rewrite (H Q X Y NQ E) in D.
  assert (P2 : forall m, 0 < 2 ^ m) by (intros; apply pow_lt; lra).
  apply Rmult_le_reg_l in U; [|apply P2]. apply Rmult_le_reg_l in D; [|apply P2]. split.
  - eapply Rle_trans; [exact C1|]. apply Rmult_le_compat_l; lra.
  - eapply Rle_trans; [|exact C2]. apply Rmult_le_compat_l; lra.
Qed.
Lemma covered_now e a P Q t u : covers e a P Q -> IZR a <= 2 ^ 48 * u <= IZR a + 2 ^ e -> 2 ^ 48 * u <= IZR (up_to t) ->
  undone r n a e P Q t = false -> is_covered t u.
Proof.
  intros [NP [NQ C]] U T N. unfold undone in N. apply andb_false_iff in N. destruct N as [N|N].
  { apply Z.leb_gt in N. apply IZR_lt in N. lra. }
  destruct (quotients_above P Q) as [M|] eqn:E; [|discriminate]. apply negb_false_iff in N. unfold gain_covers in N.
  apply andb_prop in N. destruct N as [N1 N2]. apply Z.ltb_lt in N1. apply Z.leb_le, IZR_le in N2. rewrite !(mult_IZR _ (2 ^ scale_bits)), (mult_IZR M) in N2.
  assert (P2 : 0 < 2 ^ e) by (apply pow_lt; lra). assert (P48 : 0 < 2 ^ 48) by (apply pow_lt; lra).
  set (X := (2 ^ 48 * u - IZR a) / 2 ^ e).
  assert (X0 : 0 <= X) by (apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; lra]).
  assert (X1 : X <= 1) by (apply Rmult_le_reg_r with (2 ^ e); [lra|]; unfold X, Rdiv; rewrite Rmult_assoc, Rinv_l by lra; lra).
  specialize (C X (1 - X) X0 ltac:(lra) ltac:(lra)). cbv zeta in C.
  assert (HU : (IZR a + 2 ^ e * X) / 2 ^ 48 = u) by (unfold X; field; apply Rgt_not_eq; assumption).
  rewrite HU in C. destruct C as [C1 C2].
  destruct (quotients_above_is _ _ _ E) as [_ [M0 G]]. destruct (G X (1 - X) X0 ltac:(lra) ltac:(lra)) as [G1 G2].
  assert (U0 : 0 < Under u) by (eapply Rlt_le_trans; [|exact C2]; apply Rmult_lt_0_compat; lra).
  split; [exact U0|]. exists (a + 2 ^ Z.of_nat e)%Z. split; [rewrite plus_IZR, <- pow_IZR; lra|]. cbv zeta. split; [exact N1|].
  set (ab := roots _ _ _) in *. set (rs := right_side _ _ _ _ _ _) in *. set (g := IZR (gain_p t * gain_p t * rs)) in *.
  assert (S0 : 0 < IZR (2 ^ scale_bits)) by (apply IZR_lt; reflexivity). set (sc := IZR (2 ^ scale_bits)) in *.
  set (q := IZR (gain_q t * gain_q t * 2 ^ fine)) in *.
  assert (Q0 : 0 <= q).
  { unfold q. apply IZR_le. apply Z.mul_nonneg_nonneg; [nia|apply Z.pow_nonneg; lia]. }
  apply Rmult_le_reg_l with sc; [exact S0|].
  assert (B1 : sc * Over u <= IZR M * Under u).
  { apply Rle_trans with (unit * (sc * blend P X (1 - X))).
    - replace (unit * (sc * blend P X (1 - X))) with (sc * (unit * blend P X (1 - X))) by ring. apply Rmult_le_compat_l; lra.
    - apply Rle_trans with (unit * (IZR M * blend Q X (1 - X))); [apply Rmult_le_compat_l; lra|].
      replace (unit * (IZR M * blend Q X (1 - X))) with (IZR M * (unit * blend Q X (1 - X))) by ring. apply Rmult_le_compat_l; assumption. }
  apply Rle_trans with (q * (IZR M * Under u)).
  - replace (sc * (Over u * q)) with (q * (sc * Over u)) by ring. apply Rmult_le_compat_l; assumption.
  - replace (q * (IZR M * Under u)) with (IZR M * q * Under u) by ring. replace (sc * (g * Under u)) with (g * sc * Under u) by ring.
    apply Rmult_le_compat_r; lra.
Qed.
Lemma left_of_is a e P Q tasks : left_of r n a e P Q tasks = filter (undone r n a e P Q) tasks.
Proof.
  unfold left_of, undone. destruct (quotients_above P Q); [reflexivity|]. apply filter_ext. intros t. rewrite andb_true_r. reflexivity.
Qed.
Theorem searched e : forall a tasks P Q, search r n e a tasks P Q = true -> covers e a P Q ->
  forall t, In t tasks -> forall u, IZR a <= 2 ^ 48 * u <= IZR a + 2 ^ e -> 2 ^ 48 * u <= IZR (up_to t) -> is_covered t u.
Proof.
  induction e as [|e IH]; intros a tasks P Q H C t T u U V.
  - cbn [search] in H. rewrite left_of_is in H. apply (covered_now 0 a P Q t u C U V).
    destruct (undone r n a 0 P Q t) eqn:N; [|reflexivity]. exfalso.
    assert (I : In t (filter (undone r n a 0 P Q) tasks)) by (apply filter_In; auto). destruct (filter _ tasks); [exact I|discriminate].
  - cbn [search] in H. rewrite left_of_is in H. destruct (undone r n a (S e) P Q t) eqn:N.
    2: exact (covered_now (S e) a P Q t u C U V N).
    assert (I : In t (filter (undone r n a (S e) P Q) tasks)) by (apply filter_In; auto).
    destruct (filter (undone r n a (S e) P Q) tasks) as [|t0 rest]; [destruct I|].
    match type of H with (if ?x then _ else _) = true => destruct x eqn:H1; [|discriminate] end.
    assert (P2 : 0 < 2 ^ e) by (apply pow_lt; lra). destruct (Rle_lt_dec (2 ^ 48 * u) (IZR a + 2 ^ e)) as [A|A].
    + apply (IH _ _ _ _ H1); [|exact I|lra|exact V].
      apply (covers_half first_half 0 e a a P Q); [apply first_half_length| |lra|ring|exact C].
      intros l X Y NL E. rewrite first_half_is by assumption. f_equal. f_equal; lra.
    + apply (IH _ _ _ _ H); [|exact I| |exact V].
      * apply (covers_half second_half (1 / 2) e a _ P Q); [apply second_half_length| |lra| |exact C].
        -- intros l X Y NL E. rewrite second_half_is by assumption. f_equal. f_equal; lra.
        -- rewrite plus_IZR, <- pow_IZR. cbn [pow]. lra.
      * rewrite plus_IZR, <- pow_IZR. cbn [pow] in U. lra.
Qed.
End Search.

(* 3. Gains of whole bands and into the pass band. The edge is a rational number of the lower rate, rounded up to K / 2^16. *)
Definition over_of (d : decimator) (sections : list (list Z * list Z)) : list Z := repeat 0%Z (stages d) ++ all_squared true sections.
Definition under_of (sections : list (list Z * list Z)) : list Z := all_squared false sections.
Definition spread (n : nat) (l : list Z) : list Z := inserted 1 (l ++ repeat 0%Z (n - length l)).
Definition up_of (K : Z) : Z := (Z.shiftr (snd (sine fine 15 K)) 32 + 1)%Z.
Definition tasks_of (r : nat) (K : Z) (gains : list ratio) : list task :=
  map (fun k => let g := nth (k - 1) gains (0, 1)%Z in Task k (sine_of fine r k) (cosine_of fine r k) (up_of K) (fst g) (snd g))
    (seq 1 (length gains)).
Definition gains_fit (d : decimator) (gains : list ratio) : bool :=
  Nat.eqb (length gains) (factor d / 2) && forallb (fun g => (0 <=? fst g) && (0 <? snd g))%Z gains.
Definition decimator_is_binary (d : decimator) (r : nat) : bool := (Z.of_nat (factor d) =? 2 ^ Z.of_nat r)%Z && Nat.leb 1 r.
Definition edge_fits (e : ratio) : bool := (0 <? fst e)%Z && (2 * fst e <? snd e)%Z.
Definition edge_above (e : ratio) : Z := (- (- fst e * 2 ^ 16 / snd e))%Z.
Definition bands_hold (d : decimator) (sections : list (list Z * list Z)) (r : nat) (s : Z) (e : ratio) (passing bands : list ratio) : bool :=
  let P := over_of d sections in let Q := under_of sections in let n := Nat.max (length P) (length Q) in
  decimator_is_binary d r && edge_fits e && (0 <=? s)%Z && (edge_above e <=? 2 ^ 15)%Z && gains_fit d passing && gains_fit d bands
  && negb (Nat.eqb (length P) 0) && negb (Nat.eqb (length Q) 0)
  && search r (stages d) 48 0 (tasks_of r (edge_above e) passing ++ tasks_of r (2 ^ 15) bands)
       (rounded_up s (spread n P)) (rounded_down s (spread n Q)).

Lemma blend_one l X : blend l X 1 = value l X.
Proof. induction l as [|c l IH]; cbn [blend value]; [reflexivity|]. rewrite IH, pow1. ring. Qed.
Lemma value_app_zeros l n u : value (l ++ repeat 0%Z n) u = value l u.
Proof.
  induction l as [|c l IH]; cbn [app value]; [|rewrite IH; reflexivity].
  induction n as [|n IH]; cbn [repeat value]; [reflexivity|]. rewrite IH. ring.
Qed.
Lemma spread_is n l X Y : X + Y = 1 -> blend (spread n l) X Y = value l X.
Proof. intros E. unfold spread. rewrite inserted_is. replace (1 * Y + X) with 1 by lra. rewrite blend_one. apply value_app_zeros. Qed.
Lemma spread_length n l : (length l <= n)%nat -> length (spread n l) = n.
Proof. intros L. unfold spread. rewrite inserted_length, app_length, repeat_length. lia. Qed.

Lemma sine_increases a b : 0 <= a -> a <= b -> b <= PI / 2 -> 0 <= sin a * sin a <= sin b * sin b.
Proof.
  intros A L B. pose proof PI_RGT_0. assert (0 <= sin a) by (apply sin_ge_0; lra).
  assert (sin a <= sin b) by (apply sin_incr_1; lra). split; [apply Rle_0_sqr|]. apply Rmult_le_compat; assumption.
Qed.
Lemma up_of_is K p : (0 <= K <= 2 ^ 15)%Z -> 0 <= p -> p <= IZR K / 2 ^ 16 -> 2 ^ 48 * (sin (PI * p) * sin (PI * p)) <= IZR (up_of K).
Proof.
  intros K0 P0 P1. pose proof PI_RGT_0 as Q. assert (W : (0 <= fine)%Z) by (unfold fine; lia).
  destruct (sine_is fine W 15 K K0) as [_ S]. pose proof (share_le 15 K (proj2 K0)) as L.
  assert (A : angle 15 K = PI * (IZR K / 2 ^ 16)).
  { unfold angle. change (2 ^ Z.of_nat 15)%Z with 32768%Z. replace (2 ^ 16) with 65536 by ring. field. }
  assert (A2 : angle 15 K <= PI / 2).
  { unfold angle. unfold Rdiv in *. rewrite Rmult_assoc. nra. }
  rewrite A in S, A2. destruct (sine_increases (PI * p) (PI * (IZR K / 2 ^ 16))) as [_ I]; [nra|nra|exact A2|].
  unfold up_of. set (z := snd (sine fine 15 K)) in *. rewrite Z.shiftr_div_pow2 by lia.
  assert (D : (z <= 2 ^ 32 * (z / 2 ^ 32 + 1))%Z) by (pose proof (Z.div_mod z (2 ^ 32) ltac:(lia)); pose proof (Z.mod_pos_bound z (2 ^ 32) ltac:(lia)); lia).
  apply IZR_le in D. rewrite mult_IZR in D. set (v := IZR (z / 2 ^ 32 + 1)) in *.
  assert (T1 : IZR (2 ^ fine) = 2 ^ 48 * IZR (2 ^ 32)).
  { unfold fine. change (2 ^ 80)%Z with (2 ^ Z.of_nat 48 * 2 ^ 32)%Z. rewrite mult_IZR, <- pow_IZR. reflexivity. }
  rewrite T1 in S. assert (P32 : 0 < IZR (2 ^ 32)) by (apply IZR_lt; reflexivity). assert (P48 : 0 < 2 ^ 48) by (apply pow_lt; lra).
  apply Rmult_le_reg_l with (IZR (2 ^ 32)); [exact P32|].
  apply Rle_trans with (2 ^ 48 * IZR (2 ^ 32) * (sin (PI * (IZR K / 2 ^ 16)) * sin (PI * (IZR K / 2 ^ 16)))); [|lra].
  replace (IZR (2 ^ 32) * (2 ^ 48 * (sin (PI * p) * sin (PI * p)))) with (2 ^ 48 * IZR (2 ^ 32) * (sin (PI * p) * sin (PI * p))) by ring.
  apply Rmult_le_compat_l; [|exact I]. apply Rmult_le_pos; lra.
Qed.
Lemma fit_gain d gains k : gains_fit d gains = true -> (1 <= k <= factor d / 2)%nat ->
  let g := nth (k - 1) gains (0, 1)%Z in (k - 1 < length gains)%nat /\ 0 <= IZR (fst g) /\ 0 < IZR (snd g) /\ 0 <= real g.
Proof.
  intros H K. unfold gains_fit in H. apply andb_prop in H. destruct H as [L H]. apply Nat.eqb_eq in L.
  assert (I : (k - 1 < length gains)%nat) by lia. rewrite forallb_forall in H. specialize (H _ (nth_In gains (0, 1)%Z I)).
  cbv zeta. set (g := nth (k - 1) gains (0, 1)%Z) in *. apply andb_prop in H. destruct H as [A B]. apply Z.leb_le, IZR_le in A. apply Z.ltb_lt, IZR_lt in B.
  split; [exact I|]. split; [exact A|]. split; [exact B|]. unfold real. apply Rmult_le_pos; [exact A|left; apply Rinv_0_lt_compat, B].
Qed.
Lemma folds_within d sections e e' gains : e <= e' -> folds_at_most d sections e' gains -> folds_at_most d sections e gains.
Proof. intros L H k p f K P. apply H; [exact K|lra]. Qed.

Section Bands.
Variables (d : decimator) (sections : list (list Z * list Z)) (r : nat).
Hypothesis Binary : decimator_is_binary d r = true.
Let Over u := value (over_of d sections) u.
Let Under u := value (under_of sections) u.
Lemma is_power : Z.of_nat (factor d) = (2 ^ Z.of_nat r)%Z.
Proof. unfold decimator_is_binary in Binary. apply andb_prop in Binary. destruct Binary as [H _]. apply Z.eqb_eq, H. Qed.
Lemma squares_at p : squares true sections (2 * PI * p) = value (all_squared true sections) (sin (PI * p) * sin (PI * p))
  /\ squares false sections (2 * PI * p) = Under (sin (PI * p) * sin (PI * p)).
Proof. destruct (double_angle p) as [C S]. split; apply all_squared_is; assumption. Qed.
Lemma covered_folds K gains all : gains_fit d gains = true -> (0 <= K <= 2 ^ 15)%Z -> incl (tasks_of r K gains) all ->
  (forall t, In t all -> forall u, 0 <= u <= 1 -> 2 ^ 48 * u <= IZR (up_to t) -> is_covered r (stages d) Over Under t u) ->
  folds_at_most d sections (IZR K / 2 ^ 16) gains.
Proof.
  intros Fit K0 I H k p f Kk P F x y X Y. destruct (fit_gain d gains k Fit Kk) as [L [G0 [G1 G2]]]. cbv zeta in L, G0, G1, G2.
  set (g := nth (k - 1) gains (0, 1)%Z) in *. assert (W : (0 <= fine)%Z) by (unfold fine; lia).
  assert (P2 : 0 <= p <= 1 / 2).
  { split; [lra|]. apply Rle_trans with (IZR K / 2 ^ 16); [lra|]. destruct K0 as [_ K0]. apply IZR_le in K0. change (IZR (2 ^ 15)) with 32768 in K0.
    apply Rmult_le_reg_r with (2 ^ 16); [apply pow_lt; lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by (apply pow_nonzero; lra). replace (2 ^ 16) with 65536 by ring. lra. }
  set (u := sin (PI * p) * sin (PI * p)). pose proof (sin2_bound (PI * p)) as U. fold u in U.
  assert (T : In (Task k (sine_of fine r k) (cosine_of fine r k) (up_of K) (fst g) (snd g)) all).
  { apply I. unfold tasks_of. apply (in_map_iff _ _ _). exists k. split; [reflexivity|]. apply in_seq. lia. }
  destruct (H _ T u U (up_of_is K p K0 (proj1 P) (proj2 P))) as [A [z [Z0 B]]]. cbv zeta in B. cbn [sine_k cosine_k gain_p gain_q] in B. destruct B as [B1 B2].
  assert (Z1 : IZR (2 ^ fine) * u <= IZR (z * 2 ^ (fine - 48))).
  { rewrite mult_IZR. change (2 ^ (fine - 48))%Z with (2 ^ 32)%Z. unfold fine. change (2 ^ 80)%Z with (2 ^ Z.of_nat 48 * 2 ^ 32)%Z. rewrite mult_IZR, <- pow_IZR.
    assert (P32 : 0 < IZR (2 ^ 32)) by (apply IZR_lt; reflexivity). 
    replace (2 ^ 48 * IZR (2 ^ 32) * u) with (2 ^ 48 * u * IZR (2 ^ 32)) by ring. apply Rmult_le_compat_r; lra. }
  destruct (right_side_is d r k p is_power Kk P2 fine _ W Z1 B1) as [R0 R1]. destruct (squares_at p) as [SO SU].
  apply (folds_here d sections k p Kk P2 (real g) f x y G2); [rewrite SU; exact A| |exact F|exact X|exact Y].
  rewrite SO, SU. fold u. unfold Over, over_of in B2. rewrite value_zeros in B2.
  set (un := u ^ stages d * value (all_squared true sections) u) in *. set (rs := right_side _ _ _ _ _ _) in *. set (big := (_ * _) ^ stages d) in *.
  pose proof (one_pos fine W) as O. rewrite !mult_IZR in B2. set (q := IZR (snd g)) in *. set (pp := IZR (fst g)) in *. unfold real. fold q pp.
  apply Rmult_le_reg_r with (q * q * IZR (2 ^ fine)); [apply Rmult_lt_0_compat; [nra|exact O]|].
  eapply Rle_trans; [exact B2|]. replace (pp / q * (pp / q) * big * Under u * (q * q * IZR (2 ^ fine))) with (pp * pp * (IZR (2 ^ fine) * big) * Under u) by (field; lra).
  apply Rmult_le_compat_r; [lra|]. apply Rmult_le_compat_l; [nra|exact R1].
Qed.
End Bands.
Theorem bands_fold d sections r s e passing bands : bands_hold d sections r s e passing bands = true ->
  folds_at_most d sections (real e) passing /\ folds_at_most d sections (1 / 2) bands.
Proof.
  unfold bands_hold. set (P := over_of d sections). set (Q := under_of sections). set (n := Nat.max _ _). intros H.
  apply andb_prop in H. destruct H as [H S]. apply andb_prop in H. destruct H as [H NQ]. apply andb_prop in H. destruct H as [H NP].
  apply andb_prop in H. destruct H as [H FB]. apply andb_prop in H. destruct H as [H FP].
  apply andb_prop in H. destruct H as [H KE]. apply andb_prop in H. destruct H as [H S0]. apply andb_prop in H. destruct H as [Bin Fe].
  apply Z.leb_le in S0. apply Z.leb_le in KE. apply negb_true_iff, Nat.eqb_neq in NQ. apply negb_true_iff, Nat.eqb_neq in NP.
  unfold edge_fits in Fe. apply andb_prop in Fe. destruct Fe as [E0 E1]. apply Z.ltb_lt in E0. apply Z.ltb_lt in E1.
  assert (NL : n <> O) by (unfold n; lia).
  assert (C : covers (value P) (value Q) (2 ^ Z.to_nat s) 48 0 (rounded_up s (spread n P)) (rounded_down s (spread n Q))).
  { assert (LP : length (spread n P) = n) by (apply spread_length; unfold n; lia). assert (LQ : length (spread n Q) = n) by (apply spread_length; unfold n; lia).
    split; [|split].
    - intros Z0. apply (f_equal (@length Z)) in Z0. unfold rounded_up in Z0. rewrite map_length, LP in Z0. exact (NL Z0).
    - intros Z0. apply (f_equal (@length Z)) in Z0. unfold rounded_down in Z0. rewrite map_length, LQ in Z0. exact (NL Z0).
    - intros X Y HX HY E. cbv zeta. replace ((0 + 2 ^ 48 * X) / 2 ^ 48) with X by (field).
      pose proof (up_is s (spread n P) X Y S0 HX HY) as U. pose proof (down_is s (spread n Q) X Y S0 HX HY) as D.
      rewrite spread_is in U, D by exact E. replace (2 ^ Z.to_nat s) with (IZR (2 ^ s)) by (rewrite <- (Z2Nat.id s S0) at 1; rewrite <- pow_IZR; reflexivity).
      split; assumption. }
  assert (Unit : 0 < 2 ^ Z.to_nat s) by (apply pow_lt; lra).
  pose proof (searched r (stages d) (value P) (value Q) (2 ^ Z.to_nat s) Unit 48 0 _ _ _ S C) as T.
  assert (T' : forall t, In t (tasks_of r (edge_above e) passing ++ tasks_of r (2 ^ 15) bands) -> forall u, 0 <= u <= 1 -> 2 ^ 48 * u <= IZR (up_to t) ->
    is_covered r (stages d) (value P) (value Q) t u).
  { intros t I u U V. apply (T t I u); [|exact V]. assert (0 < 2 ^ 48) by (apply pow_lt; lra). split; nra. }
  assert (B : (fst e * 2 ^ 16 <= snd e * edge_above e)%Z).
  { unfold edge_above. pose proof (Z.mul_div_le (- fst e * 2 ^ 16) (snd e) ltac:(lia)). lia. }
  split.
  - apply (folds_within _ _ _ (IZR (edge_above e) / 2 ^ 16)).
    + unfold real. assert (0 < IZR (snd e)) by (apply IZR_lt; lia). apply IZR_le in B. rewrite !mult_IZR in B. change (IZR (2 ^ 16)) with 65536 in B.
      replace (2 ^ 16) with 65536 by ring. apply Rmult_le_reg_r with (IZR (snd e) * 65536); [lra|].
      replace (IZR (fst e) / IZR (snd e) * (IZR (snd e) * 65536)) with (IZR (fst e) * 65536) by (field; lra).
      replace (IZR (edge_above e) / 65536 * (IZR (snd e) * 65536)) with (IZR (snd e) * IZR (edge_above e)) by field. exact B.
    + apply (covered_folds d sections r Bin _ _ _ FP) with (3 := T'); [|apply incl_appl, incl_refl]. split; [|exact KE]. nia.
  - apply (folds_within _ _ _ (IZR (2 ^ 15) / 2 ^ 16)); [change (IZR (2 ^ 15)) with 32768; replace (2 ^ 16) with 65536 by ring; lra|].
    apply (covered_folds d sections r Bin _ _ _ FB) with (3 := T'); [lia|apply incl_appr, incl_refl].
Qed.

(* 4. The decimator alone: there all is largest at the edge of the pass band, which is enclosed in units of 2^-w. *)
Fixpoint power_above (w x : Z) (n : nat) : Z := match n with O => 2 ^ w | S m => Z.shiftr (power_above w x m * x) w + 1 end%Z.
Definition edge_below (w : Z) (e : ratio) : Z := (2 * fst e * 2 ^ w / snd e)%Z.
Definition aliasing_holds (d : decimator) (r : nat) (w : Z) (e : ratio) (gains : list ratio) : bool :=
  let K := (edge_below w e + 1)%Z in let u := snd (sine w (Z.to_nat w) K) in
  let ab := roots w r u in let power := power_above w u (stages d) in
  decimator_is_binary d r && edge_fits e && (0 <=? w)%Z && (K <=? 2 ^ w)%Z && gains_fit d gains
  && forallb (fun k => let g := nth (k - 1) gains (0, 1)%Z in let s := sine_of w r k in let c := cosine_of w r k in
       (0 <? sine_below w s c ab)%Z && (power * (snd g * snd g) <=? fst g * fst g * right_side w r (stages d) s c ab)%Z)
     (seq 1 (length gains)).
Lemma power_above_is w x n t : (0 <= w)%Z -> 0 <= t -> IZR (2 ^ w) * t <= IZR x -> IZR (2 ^ w) * t ^ n <= IZR (power_above w x n).
Proof.
  intros W T X. pose proof (one_pos w W) as O. induction n as [|n IH]; cbn [power_above pow]; [lra|].
  rewrite Z.shiftr_div_pow2 by exact W. set (y := power_above w x n) in *. pose proof (Z.div_mod (y * x) (2 ^ w) ltac:(pose proof (power_pos_Z w W); lia)) as D.
  pose proof (Z.mod_pos_bound (y * x) (2 ^ w) (power_pos_Z w W)) as M.
  assert (B : (y * x <= 2 ^ w * (y * x / 2 ^ w + 1))%Z) by lia. apply IZR_le in B. rewrite !mult_IZR in B.
  apply Rmult_le_reg_l with (IZR (2 ^ w)); [exact O|]. eapply Rle_trans; [|exact B].
  replace (IZR (2 ^ w) * (IZR (2 ^ w) * (t * t ^ n))) with ((IZR (2 ^ w) * t ^ n) * (IZR (2 ^ w) * t)) by ring.
  assert (0 <= t ^ n) by (apply pow_le, T). apply Rmult_le_compat; try assumption; apply Rmult_le_pos; lra.
Qed.
Theorem aliasing_folds d r w e gains : aliasing_holds d r w e gains = true -> folds_at_most d [] (real e) gains.
Proof.
  unfold aliasing_holds. set (K := (edge_below w e + 1)%Z). set (top := snd (sine w (Z.to_nat w) K)). intros H.
  apply andb_prop in H. destruct H as [H All]. apply andb_prop in H. destruct H as [H Fit]. apply andb_prop in H. destruct H as [H KE].
  apply andb_prop in H. destruct H as [H W]. apply andb_prop in H. destruct H as [Bin Fe]. apply Z.leb_le in W. apply Z.leb_le in KE.
  unfold edge_fits in Fe. apply andb_prop in Fe. destruct Fe as [E0 E1]. apply Z.ltb_lt in E0. apply Z.ltb_lt in E1.
  intros k p f Kk P F x y X Y. destruct (fit_gain d gains k Fit Kk) as [L [G0 [G1 G2]]]. cbv zeta in L, G0, G1, G2.
  rewrite forallb_forall in All. specialize (All k ltac:(apply in_seq; lia)). cbv zeta in All. set (g := nth (k - 1) gains (0, 1)%Z) in *.
  apply andb_prop in All. destruct All as [A B]. apply Z.ltb_lt in A. apply Z.leb_le, IZR_le in B. rewrite !mult_IZR in B.
  assert (S0 : 0 < IZR (snd e)) by (apply IZR_lt; lia). pose proof (one_pos w W) as O. pose proof PI_RGT_0 as Q.
  assert (EK : real e <= IZR K / (2 * IZR (2 ^ w))).
  { unfold real, K, edge_below. pose proof (Z.div_mod (2 * fst e * 2 ^ w) (snd e) ltac:(lia)) as D.
    pose proof (Z.mod_pos_bound (2 * fst e * 2 ^ w) (snd e) ltac:(lia)) as M. set (v := (_ / snd e)%Z) in *.
    assert (V : (2 * fst e * 2 ^ w <= snd e * (v + 1))%Z) by lia. apply IZR_le in V. rewrite !mult_IZR in V.
    apply Rmult_le_reg_r with (IZR (snd e) * (2 * IZR (2 ^ w))); [apply Rmult_lt_0_compat; lra|].
    replace (IZR (fst e) / IZR (snd e) * (IZR (snd e) * (2 * IZR (2 ^ w)))) with (2 * IZR (fst e) * IZR (2 ^ w)) by (field; lra).
    replace (IZR (v + 1) / (2 * IZR (2 ^ w)) * (IZR (snd e) * (2 * IZR (2 ^ w)))) with (IZR (snd e) * IZR (v + 1)) by (field; lra). exact V. }
  assert (K0 : (0 <= K <= 2 ^ Z.of_nat (Z.to_nat w))%Z).
  { rewrite Z2Nat.id by exact W. split; [|exact KE]. unfold K, edge_below. pose proof (power_pos_Z w W).
    assert (0 <= 2 * fst e * 2 ^ w / snd e)%Z by (apply Z.div_pos; [nia|lia]). lia. }
  destruct (sine_is w W (Z.to_nat w) K K0) as [_ T]. fold top in T. pose proof (share_le (Z.to_nat w) K (proj2 K0)) as SL.
  unfold angle in T. rewrite Z2Nat.id in T, SL by exact W.
  replace (PI / 2 * IZR K / IZR (2 ^ w)) with (PI * (IZR K / (2 * IZR (2 ^ w)))) in T by (field; lra).
  assert (P1 : IZR K / (2 * IZR (2 ^ w)) <= 1 / 2).
  { replace (IZR K / (2 * IZR (2 ^ w))) with (IZR K / IZR (2 ^ w) / 2) by (field; lra). lra. }
  assert (P2 : 0 <= p <= 1 / 2) by lra.
  destruct (sine_increases (PI * p) (PI * (IZR K / (2 * IZR (2 ^ w))))) as [U0 U]; [nra|nra|nra|].
  set (u := sin (PI * p) * sin (PI * p)) in *.
  assert (V : IZR (2 ^ w) * u <= IZR top) by (eapply Rle_trans; [apply Rmult_le_compat_l; [lra|exact U]|exact T]).
  destruct (right_side_is d r k p (is_power d r Bin) Kk P2 w top W V A) as [R0 R1].
  apply (folds_here d [] k p Kk P2 (real g) f x y G2); [simpl; lra| |exact F|exact X|exact Y].
  cbn [squares fold_right]. rewrite !Rmult_1_r. fold u. pose proof (power_above_is w top (stages d) u W U0 V) as PA.
  set (pa := IZR (power_above w top (stages d))) in *. set (rs := IZR (right_side _ _ _ _ _ _)) in *. set (big := (_ * _) ^ stages d) in *.
  set (q := IZR (snd g)) in *. set (pp := IZR (fst g)) in *. unfold real. fold q pp.
  assert (QQ : 0 < q * q) by nra. apply Rmult_le_reg_r with (q * q * IZR (2 ^ w)); [apply Rmult_lt_0_compat; assumption|].
  replace (u ^ stages d * (q * q * IZR (2 ^ w))) with (IZR (2 ^ w) * u ^ stages d * (q * q)) by ring.
  replace (pp / q * (pp / q) * big * (q * q * IZR (2 ^ w))) with (pp * pp * (IZR (2 ^ w) * big)) by (field; lra).
  apply Rle_trans with (pa * (q * q)); [apply Rmult_le_compat_r; lra|]. apply Rle_trans with (1 := B).
  apply Rmult_le_compat_l; [nra|exact R1].
Qed.

(* 5. That no figure is larger than what follows: computations, not theorems. A gain of the decimator alone is the next number of
   the grid of 2^-64 above what is reached at the edge. One with the filter is that above 1 + 1 / 1024 times what is reached at the
   place that is given with it, a multiple of 2^-32 of the lower rate. *)
Fixpoint half_below_times (w : Z) (r : nat) (x : Z) : Z := match r with O => x | S r' => half_below w (half_below_times w r' x) end.
Definition right_sides (w : Z) (r n k : nat) (u : Z * Z) : Z * Z :=
  let b := sine w (r - 1) (Z.of_nat k) in let v := half_below_times w r (fst u) in
  let s := (root_above w (snd b) * root_above w (2 ^ w - v) - root_below w (2 ^ w - snd b) * root_below w v)%Z in
  let e := (2 ^ Z.of_nat r * (Z.shiftr s w + 1))%Z in
  (right_side w r n (root_below w (fst b)) (root_above w (2 ^ w - fst b)) (roots w r (snd u)), power_above w (Z.shiftr (e * e) w + 1) n).
(* Of a polynomial with coefficients between two. *)
Fixpoint enclosed_value (w : Z) (l m : list Z) (u : Z * Z) : Z * Z :=
  match l, m with
  | a :: l', b :: m' => let (low, high) := enclosed_value w l' m' u in
      (Z.shiftr (low * (if 0 <=? low then fst u else snd u)) w + Z.shiftl a w,
       Z.shiftr (high * (if 0 <=? high then snd u else fst u)) w + 1 + Z.shiftl b w)
  | _, _ => (0, 0)
  end%Z.
Definition enclosed_in (w s : Z) (l : list Z) : Z * Z -> Z * Z := enclosed_value w (rounded_down s l) (rounded_up s l).
(* The least number of the grid beyond times the root of x / y, whatever x and y are in their enclosures. *)
Definition next_beyond (times : ratio) (x y : Z * Z) (g : ratio) : bool :=
  let (p, q) := g in let (m, n) := times in
  ((0 <? fst y) && (0 <? fst x) && (p * 2 ^ 64 mod q =? 0) && (q <=? p * 2 ^ 64)
   && ((p * 2 ^ 64 - q) * (p * 2 ^ 64 - q) * (n * n) * snd y <=? m * m * fst x * (q * q * 2 ^ 128))
   && (m * m * snd x * (q * q) <? p * p * (n * n) * fst y))%Z.
Definition aliasing_follows (d : decimator) (r : nat) (w : Z) (e : ratio) (gains : list ratio) : bool :=
  let K := edge_below w e in let u := (fst (sine w (Z.to_nat w) K), snd (sine w (Z.to_nat w) (K + 1))) in
  let x := (power_below w (fst u) (stages d), power_above w (snd u) (stages d)) in
  forallb (fun k => next_beyond (1, 1)%Z x (right_sides w r (stages d) k u) (nth (k - 1) gains (0, 1)%Z)) (seq 1 (length gains)).
Definition gains_follow (d : decimator) (sections : list (list Z * list Z)) (r : nat) (w s K : Z) (gains places : list ratio) : bool :=
  let over := enclosed_in w s (over_of d sections) in let under := enclosed_in w s (under_of sections) in
  Nat.eqb (length places) (length gains) && forallb (fun k =>
    let (a, b) := nth (k - 1) places (0, 1)%Z in let at_ := (a * 2 ^ 32 / b)%Z in let u := sine w 31 at_ in
    let right := right_sides w r (stages d) k u in let below := under u in
    ((0 <=? a) && (0 <? b) && (a * 2 ^ 32 mod b =? 0) && (at_ <=? K * 2 ^ 16)
     && next_beyond (1025, 1024) (over u) (Z.shiftr (fst below * fst right) w, Z.shiftr (snd below * snd right) w + 1)
          (nth (k - 1) gains (0, 1)))%Z) (seq 1 (length gains)).

(* The last section, 1 + g - g / z, corrects the droop: g is the multiple of 1 / 1024 next to the best one. *)
Definition corrects (d : decimator) (sections : list (list Z * list Z)) (g : ratio) : bool :=
  let R := (Z.of_nat (factor d) * Z.of_nat (factor d))%Z in let best := (3 * R + Z.of_nat (stages d) * (R - 1))%Z in
  let side i := ((2 * (fst g * 1024 / snd g) + i + 1024) * (2 * (fst g * 1024 / snd g) + i + 1024) * (3 * R))%Z in
  ((0 <? fst g) && (0 <? snd g) && (fst g * 1024 mod snd g =? 0) && (side (-1) <=? best * 2 ^ 20) && (best * 2 ^ 20 <=? side 1))%Z
  && match last sections ([], []) with
     | ([b; c], [a]) => (negb (a =? 0) && (b * snd g =? a * (snd g + fst g)) && (c * snd g =? - a * fst g))%Z
     | _ => false
     end.
