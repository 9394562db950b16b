(* What sections and means make of a sinusoid: one of the same frequency. Of its amplitude, the square is multiplied by that
   of the magnitude of B(z) and divided by that of A(z), z on the unit circle: here as sums of cosines and sines. *)
Require Import ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Angles.
Open Scope R_scope.

Definition sinusoid (w a b : R) : signal := fun k => a * cos (w * IZR k) + b * sin (w * IZR k).

(* The sums of l_j cos (j w) and of l_j sin (j w), and the square of the magnitude of l. *)
Fixpoint even (l : list Z) (w : R) : R :=
  match l with [] => 0 | c :: l' => IZR c + cos w * even l' w - sin w * odd l' w end
with odd (l : list Z) (w : R) : R :=
  match l with [] => 0 | c :: l' => sin w * even l' w + cos w * odd l' w end.
Definition square (l : list Z) (w : R) : R := even l w * even l w + odd l w * odd l w.
Lemma square_pos l w : 0 <= square l w.
Proof. unfold square. nra. Qed.

Lemma step_back w k : w * IZR (k - 1) = w * IZR k - w.
Proof. rewrite minus_IZR. ring. Qed.
Lemma taps_sinusoid l w a b : forall k,
  taps l (sinusoid w a b) k = sinusoid w (a * even l w - b * odd l w) (a * odd l w + b * even l w) k.
Proof.
  induction l as [|c l IH]; intros k; cbn [taps even odd]; [unfold sinusoid; ring|].
  rewrite IH. unfold sinusoid. rewrite step_back, cos_minus, sin_minus. ring.
Qed.

(* Where sin w = 0, all samples of the sine are 0. *)
Lemma flat_forward w : sin w = 0 -> forall n, sin (w * IZR (Z.of_nat n)) = 0.
Proof.
  intros H n. induction n as [|n IH]; [simpl; rewrite Rmult_0_r; apply sin_0|].
  rewrite Nat2Z.inj_succ, succ_IZR, Rmult_plus_distr_l, Rmult_1_r, sin_plus, IH, H. ring.
Qed.
Lemma flat w k : sin w = 0 -> sin (w * IZR k) = 0.
Proof.
  intros H. destruct (Z.le_gt_cases 0 k) as [P|P].
  - rewrite <- (Z2Nat.id k P). apply flat_forward, H.
  - pose proof (flat_forward w H (Z.to_nat (- k))) as F. rewrite Z2Nat.id, opp_IZR, Ropp_mult_distr_r_reverse, sin_neg in F by lia. lra.
Qed.
Lemma odd_flat l w : sin w = 0 -> odd l w = 0.
Proof. intros H. induction l as [|c l IH]; cbn [odd]; [reflexivity|]. rewrite IH, H. ring. Qed.
Lemma same_sinusoid w a b c d : (forall k, sinusoid w a b k = sinusoid w c d k) -> a = c /\ (sin w <> 0 -> b = d).
Proof.
  intros H. pose proof (H 0%Z) as H0. pose proof (H 1%Z) as H1. unfold sinusoid in H0, H1.
  rewrite Rmult_0_r, cos_0, sin_0 in H0. rewrite Rmult_1_r in H1. assert (E : a = c) by lra. split; [exact E|].
  intros N. subst c. apply Rmult_eq_reg_r with (sin w); [lra|exact N].
Qed.

(* A section. The amplitude's square, c^2 + d^2, is bounded for one way of writing the answer; where sin w = 0 there are many. *)
Lemma section_answer w A B a b m e f :
  (forall k, m k = sinusoid w e f k) -> (forall k, taps A m k = taps B (sinusoid w a b) k) ->
  exists c d, (forall k, m k = sinusoid w c d k) /\ (c * c + d * d) * square A w <= (a * a + b * b) * square B w.
Proof.
  intros M H.
  assert (S : forall k, sinusoid w (e * even A w - f * odd A w) (e * odd A w + f * even A w) k
    = sinusoid w (a * even B w - b * odd B w) (a * odd B w + b * even B w) k).
  { intros k. rewrite <- !taps_sinusoid, <- H. apply taps_ext. intros. symmetry. apply M. }
  apply same_sinusoid in S. destruct S as [E O]. unfold square.
  destruct (Req_dec (sin w) 0) as [Z|N].
  - exists e, 0. split.
    + intros k. rewrite M. unfold sinusoid. rewrite (flat w k Z). ring.
    + rewrite !(odd_flat _ _ Z) in *. replace ((e * e + 0 * 0) * (even A w * even A w + 0 * 0)) with ((e * even A w) * (e * even A w)) by ring.
      replace (e * even A w) with (a * even B w) by lra.
      assert (0 <= b * b * (even B w * even B w)) by (apply Rmult_le_pos; nra).
      replace ((a * a + b * b) * (even B w * even B w + 0 * 0)) with ((a * even B w) * (a * even B w) + b * b * (even B w * even B w)) by ring. lra.
  - specialize (O N). exists e, f. split; [exact M|]. apply Req_le.
    replace ((e * e + f * f) * (even A w * even A w + odd A w * odd A w))
      with ((e * even A w - f * odd A w) * (e * even A w - f * odd A w) + (e * odd A w + f * even A w) * (e * odd A w + f * even A w)) by ring.
    rewrite E, O. ring.
Qed.

(* Sections in a row. *)
Definition squares (over : bool) (sections : list (list Z * list Z)) (w : R) : R :=
  fold_right (fun s r => square (if over then fst s else snd s) w * r) 1 sections.
Lemma squares_pos over sections w : 0 <= squares over sections w.
Proof. induction sections as [|s l IH]; cbn [squares fold_right]; [lra|]. apply Rmult_le_pos; [apply square_pos|exact IH]. Qed.
Lemma answer f sections : forall x y a b, (forall k, x k = sinusoid (2 * PI * f) a b k) -> steady_answer f sections x y ->
  exists c d, (forall k, y k = sinusoid (2 * PI * f) c d k)
    /\ (c * c + d * d) * squares false sections (2 * PI * f) <= (a * a + b * b) * squares true sections (2 * PI * f).
Proof.
  set (w := 2 * PI * f). induction sections as [|[B A] others IH]; intros x y a b X H; cbn [steady_answer] in H.
  - exists a, b. split; [intros k; rewrite H; apply X|]. cbn [squares fold_right]. lra.
  - destruct H as [m [[g [e [h [_ M]]]] [E H]]]. fold w in M.
    destruct (section_answer w A B a b m e h M) as [c1 [d1 [M1 L1]]].
    { intros k. rewrite E. apply taps_ext. intros. apply X. }
    destruct (IH m y c1 d1 M1 H) as [c [d [Y L]]]. exists c, d. split; [exact Y|].
    cbn [squares fold_right fst snd]. fold (squares false others w). fold (squares true others w).
    pose proof (square_pos A w) as PA. pose proof (squares_pos true others w) as PO.
    apply Rle_trans with (square A w * ((c1 * c1 + d1 * d1) * squares true others w)).
    + replace ((c * c + d * d) * (square A w * squares false others w)) with (square A w * ((c * c + d * d) * squares false others w)) by ring.
      apply Rmult_le_compat_l; assumption.
    + replace (square A w * ((c1 * c1 + d1 * d1) * squares true others w)) with ((c1 * c1 + d1 * d1) * square A w * squares true others w) by ring.
      replace ((a * a + b * b) * (square B w * squares true others w)) with ((a * a + b * b) * square B w * squares true others w) by ring.
      apply Rmult_le_compat_r; assumption.
Qed.

(* Ones in a row: sin^2 (w / 2) times the square is sin^2 (R w / 2). *)
Lemma ones_even r h : sin h * even (repeat 1%Z r) (2 * h) = sin (INR r * h) * cos ((INR r - 1) * h)
  /\ sin h * odd (repeat 1%Z r) (2 * h) = sin (INR r * h) * sin ((INR r - 1) * h).
Proof.
  induction r as [|r [IE IO]].
  - simpl. rewrite Rmult_0_l, sin_0. lra.
  - cbn [repeat even odd]. rewrite S_INR. set (q := INR r) in *.
    replace ((q + 1) * h) with (q * h + h) by ring. replace ((q + 1 - 1) * h) with (q * h) by ring.
    replace ((q - 1) * h) with (q * h - h) in * by ring. rewrite cos_minus in IE. rewrite sin_minus in IO.
    rewrite sin_plus. replace (2 * h) with (h + h) at 1 3 5 7 by ring. rewrite cos_plus, sin_plus.
    set (C := even _ _) in *. set (S := odd _ _) in *. set (s := sin h) in *. set (c := cos h) in *.
    set (sq := sin (q * h)) in *. set (cq := cos (q * h)) in *.
    assert (U : s * s + c * c = 1) by (pose proof (sin2_cos2 h) as T; unfold Rsqr in T; exact T).
    assert (V : sq * sq + cq * cq = 1) by (pose proof (sin2_cos2 (q * h)) as T; unfold Rsqr in T; exact T).
    split.
    + transitivity (s + (c * c - s * s) * (s * C) - (s * c + c * s) * (s * S)); [ring|]. rewrite IE, IO.
      transitivity (s + (sq * c * cq - s * sq * sq) * (s * s + c * c)); [ring|]. rewrite U.
      transitivity (s * (sq * sq + cq * cq) + sq * c * cq - s * sq * sq); [rewrite V; ring|ring].
    + transitivity ((s * c + c * s) * (s * C) + (c * c - s * s) * (s * S)); [ring|].
      rewrite IE, IO. transitivity ((s * cq * sq + c * sq * sq) * (c * c + s * s)); [ring|]. rewrite (Rplus_comm (c * c)), U. ring.
Qed.
Lemma ones_square r h : square (repeat 1%Z r) (2 * h) * (sin h * sin h) = sin (INR r * h) * sin (INR r * h).
Proof.
  destruct (ones_even r h) as [E O]. unfold square.
  replace ((even (repeat 1%Z r) (2 * h) * even (repeat 1%Z r) (2 * h) + odd (repeat 1%Z r) (2 * h) * odd (repeat 1%Z r) (2 * h)) * (sin h * sin h))
    with ((sin h * even (repeat 1%Z r) (2 * h)) * (sin h * even (repeat 1%Z r) (2 * h)) + (sin h * odd (repeat 1%Z r) (2 * h)) * (sin h * odd (repeat 1%Z r) (2 * h))) by ring.
  rewrite E, O. pose proof (sin2_cos2 ((INR r - 1) * h)) as T. unfold Rsqr in T.
  transitivity (sin (INR r * h) * sin (INR r * h) * (sin ((INR r - 1) * h) * sin ((INR r - 1) * h) + cos ((INR r - 1) * h) * cos ((INR r - 1) * h))); [ring|].
  rewrite T. ring.
Qed.

(* Means of a sinusoid. *)
Lemma mean_sinusoid r w u a b : (0 < r)%nat -> (forall k, u k = sinusoid w a b k) ->
  exists c d, (forall k, mean r u k = sinusoid w c d k)
    /\ (c * c + d * d) * (INR r * INR r) = (a * a + b * b) * square (repeat 1%Z r) w.
Proof.
  intros P U. set (l := repeat 1%Z r). assert (Q : 0 < INR r) by (apply lt_0_INR, P).
  exists ((a * even l w - b * odd l w) / INR r), ((a * odd l w + b * even l w) / INR r). split.
  - intros k. unfold mean. fold l. rewrite (taps_ext l u (sinusoid w a b)) by (intros; apply U).
    rewrite taps_sinusoid, <- INR_IZR_INZ. unfold sinusoid. field. lra.
  - unfold square. field. lra.
Qed.
Lemma means_sinusoid r w u n : (0 < r)%nat -> forall a b, (forall k, u k = sinusoid w a b k) ->
  exists c d, (forall k, Nat.iter n (mean r) u k = sinusoid w c d k)
    /\ (c * c + d * d) * (INR r * INR r) ^ n = (a * a + b * b) * square (repeat 1%Z r) w ^ n.
Proof.
  intros P a b U. induction n as [|n [c [d [H E]]]].
  - exists a, b. split; [exact U|]. simpl. ring.
  - destruct (mean_sinusoid r w _ c d P H) as [c' [d' [H' E']]]. exists c', d'. split; [exact H'|]. cbn [pow].
    transitivity ((c' * c' + d' * d') * (INR r * INR r) * (INR r * INR r) ^ n); [ring|]. rewrite E'.
    transitivity (square (repeat 1%Z r) w * ((c * c + d * d) * (INR r * INR r) ^ n)); [ring|]. rewrite E. ring.
Qed.

(* Every r-th sample of a sinusoid of the frequency (k - p) / r or (k + p) / r is one of p. *)
Lemma turns x k : cos (x + 2 * PI * IZR k) = cos x /\ sin (x + 2 * PI * IZR k) = sin x.
Proof.
  assert (H : forall y n, cos (y + 2 * PI * INR n) = cos y /\ sin (y + 2 * PI * INR n) = sin y).
  { intros y n. replace (2 * PI * INR n) with (2 * INR n * PI) by ring. split; [apply cos_period|apply sin_period]. }
  destruct (Z.le_gt_cases 0 k) as [P|P].
  - rewrite <- (Z2Nat.id k P), <- INR_IZR_INZ. apply H.
  - destruct (H (x + 2 * PI * IZR k) (Z.to_nat (- k))) as [C S]. rewrite INR_IZR_INZ, Z2Nat.id, opp_IZR in C, S by lia.
    replace (x + 2 * PI * IZR k + 2 * PI * - IZR k) with x in C, S by ring. split; congruence.
Qed.
Lemma every_rth r k p f a b : (0 < r)%nat -> f = (IZR k - p) / INR r \/ f = (IZR k + p) / INR r ->
  exists b', b' * b' = b * b /\ forall n, sinusoid (2 * PI * f) a b (n * Z.of_nat r)%Z = sinusoid (2 * PI * p) a b' n.
Proof.
  intros P F. assert (Q : 0 < INR r) by (apply lt_0_INR, P).
  assert (A : forall s n, f = (IZR k + s * p) / INR r -> 2 * PI * f * IZR (n * Z.of_nat r)%Z = s * (2 * PI * p * IZR n) + 2 * PI * IZR (n * k)).
  { intros s n E. rewrite !mult_IZR, <- INR_IZR_INZ, E. field. lra. }
  destruct F as [F|F].
  - exists (- b). split; [ring|]. intros n. unfold sinusoid. rewrite (A (-1) n) by (rewrite F; f_equal; ring).
    destruct (turns (-1 * (2 * PI * p * IZR n)) (n * k)%Z) as [C S]. rewrite C, S.
    replace (-1 * (2 * PI * p * IZR n)) with (- (2 * PI * p * IZR n)) by ring. rewrite cos_neg, sin_neg. ring.
  - exists b. split; [ring|]. intros n. unfold sinusoid. rewrite (A 1 n) by (rewrite F; f_equal; ring).
    destruct (turns (1 * (2 * PI * p * IZR n)) (n * k)%Z) as [C S]. rewrite C, S, Rmult_1_l. ring.
Qed.

(* Through a decimator and the sections behind it. *)
Theorem lowered_answer d sections k p f x y : (0 < factor d)%nat ->
  f = (IZR k - p) / INR (factor d) \/ f = (IZR k + p) / INR (factor d) ->
  wave f 1 x -> steady_answer p sections (lowered d x) y ->
  exists c e, (forall n, y n = sinusoid (2 * PI * p) c e n)
    /\ (c * c + e * e) * ((INR (factor d) * INR (factor d)) ^ stages d * squares false sections (2 * PI * p))
       <= square (repeat 1%Z (factor d)) (2 * PI * f) ^ stages d * squares true sections (2 * PI * p).
Proof.
  intros P F [a [b [A X]]] Y.
  destruct (means_sinusoid (factor d) (2 * PI * f) x (stages d) P a b X) as [c [e [M E]]].
  destruct (every_rth (factor d) k p f c e P F) as [e' [B L]].
  destruct (answer p sections (lowered d x) y c e') as [u [v [U V]]]; [|exact Y|].
  - intros n. unfold lowered. rewrite M. apply L.
  - exists u, v. split; [exact U|]. rewrite B in V. pose proof (squares_pos true sections (2 * PI * p)) as S.
    assert (Q : 0 <= (INR (factor d) * INR (factor d)) ^ stages d) by (apply pow_le; nra).
    assert (T : 0 <= square (repeat 1%Z (factor d)) (2 * PI * f) ^ stages d) by (apply pow_le, square_pos).
    set (big := (INR (factor d) * INR (factor d)) ^ stages d) in *. set (s := square _ _ ^ _) in *.
    replace ((u * u + v * v) * (big * squares false sections (2 * PI * p))) with (big * ((u * u + v * v) * squares false sections (2 * PI * p))) by ring.
    apply Rle_trans with (big * ((c * c + e * e) * squares true sections (2 * PI * p))); [apply Rmult_le_compat_l; assumption|].
    replace (big * ((c * c + e * e) * squares true sections (2 * PI * p))) with ((c * c + e * e) * big * squares true sections (2 * PI * p)) by ring.
    rewrite E. apply Rmult_le_compat_r; [exact S|]. replace s with (1 * s) at 2 by ring. apply Rmult_le_compat_r; lra.
Qed.
Lemma sinusoid_small w c e g n : 0 <= g -> c * c + e * e <= g * g -> Rabs (sinusoid w c e n) <= g.
Proof.
  intros G H. unfold sinusoid. pose proof (sin2_cos2 (w * IZR n)) as T. unfold Rsqr in T.
  set (s := sin _) in *. set (t := cos _) in *. apply Rabs_le.
  assert (B : (c * t + e * s) * (c * t + e * s) <= g * g).
  { apply Rle_trans with (c * c + e * e); [|exact H]. assert (0 <= (c * s - e * t) * (c * s - e * t)) by apply Rle_0_sqr.
    replace (c * c + e * e) with ((c * c + e * e) * (s * s + t * t)) by (rewrite T; ring). nra. }
  split; nra.
Qed.

(* From the frequency (k - p) / R or (k + p) / R, with u = sin^2 (pi p): N means let through (u / (R sin (pi f))^2)^N of the square, and
   the sine is the smaller one at (k - p) / R. So much follows for a gain g from one inequality about u. *)
Lemma double_angle p : cos (2 * PI * p) = 1 - 2 * (sin (PI * p) * sin (PI * p))
  /\ sin (2 * PI * p) * sin (2 * PI * p) = 4 * (sin (PI * p) * sin (PI * p)) * (1 - sin (PI * p) * sin (PI * p)).
Proof.
  replace (2 * PI * p) with (2 * (PI * p)) by ring. rewrite cos_2a_sin, sin_2a. split; [ring|].
  pose proof (sin2_cos2 (PI * p)) as H. unfold Rsqr in H. set (s := sin _) in *. set (c := cos _) in *.
  replace (2 * s * c * (2 * s * c)) with (4 * (s * s) * (c * c)) by ring. replace (c * c) with (1 - s * s) by lra. reflexivity.
Qed.
Section Place.
Variables (d : decimator) (sections : list (list Z * list Z)) (k : nat) (p : R).
Let r := INR (factor d).
Hypothesis K : (1 <= k <= factor d / 2)%nat.
Hypothesis P : 0 <= p <= 1 / 2.
Lemma factor_pos : (0 < factor d)%nat.
Proof. destruct (factor d); [simpl in K; lia|lia]. Qed.
Lemma r_pos : 0 < r.
Proof. apply lt_0_INR, factor_pos. Qed.
Lemma k_small : 1 <= INR k /\ 2 * INR k <= r.
Proof.
  split; [apply (le_INR 1); lia|]. unfold r. replace 2 with (INR 2) by (simpl; lra). rewrite <- mult_INR. apply le_INR.
  pose proof (Nat.mul_div_le (factor d) 2 ltac:(lia)). lia.
Qed.
(* The sine that is the smallest. *)
Definition lower_sine : R := sin (PI * (INR k - p) / r).
Lemma angles : 0 < PI * (INR k - p) / r /\ 0 <= PI * INR k / r <= PI / 2 /\ 0 <= PI * p / r <= PI / 2 /\ PI * (INR k - p) / r <= PI / 2.
Proof.
  pose proof r_pos as R0. destruct k_small as [K1 K2]. pose proof PI_RGT_0 as Q.
  assert (I : 0 < / r) by (apply Rinv_0_lt_compat; exact R0).
  assert (J : forall x, 2 * x <= r -> PI * x / r <= PI / 2).
  { intros x X. apply Rmult_le_reg_r with r; [exact R0|]. replace (PI * x / r * r) with (PI * x) by (field; lra). nra. }
  assert (N : forall x, 0 <= x -> 0 <= PI * x / r) by (intros; apply Rmult_le_pos; [apply Rmult_le_pos|]; lra).
  repeat split; try (apply J; lra); try (apply N; lra).
  apply Rmult_lt_0_compat; [apply Rmult_lt_0_compat|]; lra.
Qed.
Lemma lower_sine_pos : 0 < lower_sine.
Proof. destruct angles as [A [_ [_ B]]]. apply sin_gt_0; [exact A|]. pose proof PI_RGT_0. lra. Qed.
Lemma ones_small f : f = (INR k - p) / r \/ f = (INR k + p) / r ->
  square (repeat 1%Z (factor d)) (2 * PI * f) * (lower_sine * lower_sine) <= sin (PI * p) * sin (PI * p).
Proof.
  intros F. pose proof r_pos as R0. pose proof lower_sine_pos as L.
  pose proof (ones_square (factor d) (PI * f)) as O. fold r in O. replace (2 * (PI * f)) with (2 * PI * f) in O by ring.
  assert (U : sin (r * (PI * f)) * sin (r * (PI * f)) = sin (PI * p) * sin (PI * p)).
  { rewrite !sin2_half. f_equal. f_equal. rewrite INR_IZR_INZ in F. destruct F as [F|F].
    - replace (2 * (r * (PI * f))) with (- (2 * (PI * p)) + 2 * PI * IZR (Z.of_nat k)) by (rewrite F; field; lra).
      destruct (turns (- (2 * (PI * p))) (Z.of_nat k)) as [C _]. rewrite C. apply cos_neg.
    - replace (2 * (r * (PI * f))) with (2 * (PI * p) + 2 * PI * IZR (Z.of_nat k)) by (rewrite F; field; lra).
      destruct (turns (2 * (PI * p)) (Z.of_nat k)) as [C _]. exact C. }
  rewrite <- U, <- O. apply Rmult_le_compat_l; [apply square_pos|]. destruct F as [F|F].
  - right. unfold lower_sine. rewrite F. replace (PI * ((INR k - p) / r)) with (PI * (INR k - p) / r) by (field; lra). reflexivity.
  - assert (D : lower_sine <= sin (PI * f)).
    { unfold lower_sine. rewrite F. replace (PI * ((INR k + p) / r)) with (PI * INR k / r + PI * p / r) by (field; lra).
      replace (PI * (INR k - p) / r) with (PI * INR k / r - PI * p / r) by (field; lra). rewrite sin_minus, sin_plus.
      destruct angles as [_ [A [B _]]]. pose proof PI_RGT_0.
      assert (0 <= cos (PI * INR k / r)) by (apply cos_ge_0; lra). assert (0 <= sin (PI * p / r)) by (apply sin_ge_0; lra). nra. }
    nra.
Qed.
Theorem folds_here g f x y : 0 <= g ->
  0 < squares false sections (2 * PI * p) ->
  (sin (PI * p) * sin (PI * p)) ^ stages d * squares true sections (2 * PI * p)
    <= g * g * (r * r * (lower_sine * lower_sine)) ^ stages d * squares false sections (2 * PI * p) ->
  f = (INR k - p) / r \/ f = (INR k + p) / r -> wave f 1 x -> steady_answer p sections (lowered d x) y ->
  forall n, Rabs (y n) <= g.
Proof.
  intros G A H F X Y n. pose proof r_pos as R0. pose proof lower_sine_pos as L. pose proof (ones_small f F) as O.
  rewrite INR_IZR_INZ in F.
  destruct (lowered_answer d sections (Z.of_nat k) p f x y factor_pos F X Y) as [c [e [E B]]]. fold r in B.
  rewrite E. apply sinusoid_small; [exact G|].
  set (under := squares false sections _) in *. set (over := squares true sections _) in *.
  assert (OP : 0 <= over) by apply squares_pos. set (u := sin (PI * p) * sin (PI * p)) in *.
  set (s := square _ _) in *. assert (S : 0 <= s) by apply square_pos. set (l := lower_sine * lower_sine) in *.
  assert (LP : 0 < l) by (apply Rmult_lt_0_compat; exact L).
  assert (RP : 0 < (r * r) ^ stages d) by (apply pow_lt; nra). assert (LN : 0 < l ^ stages d) by (apply pow_lt, LP).
  rewrite Rpow_mult_distr in H.
  assert (T : s ^ stages d * l ^ stages d <= u ^ stages d) by (rewrite <- Rpow_mult_distr; apply pow_incr; split; [apply Rmult_le_pos; lra|exact O]).
  set (rn := (r * r) ^ stages d) in *. set (ln := l ^ stages d) in *. set (sn := s ^ stages d) in *. set (un := u ^ stages d) in *.
  apply Rmult_le_reg_r with (rn * ln * under); [apply Rmult_lt_0_compat; [apply Rmult_lt_0_compat|]; assumption|].
  apply Rle_trans with (ln * (sn * over)).
  - replace ((c * c + e * e) * (rn * ln * under)) with (ln * ((c * c + e * e) * (rn * under))) by ring.
    apply Rmult_le_compat_l; lra.
  - apply Rle_trans with (un * over).
    + replace (ln * (sn * over)) with (sn * ln * over) by ring. apply Rmult_le_compat_r; assumption.
    + lra.
Qed.
End Place.
