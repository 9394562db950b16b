(* What a recursion can make of bounded inputs, for ever, from finitely many integers.

   Let D * y = N1 * u1 + N2 * u2 + ... , and let h be any polynomial with h * D = K + r, where K is a number and r is small:
   |r| < K. Multiplied by h, the equation says K y = (h N1) * u1 + (h N2) * u2 + ... - r * y. Where |y| is largest among
   the samples up to some time, the last term is at most |r| |y|: so |y| (K - |r|) is at most what the inputs can add up to
   through the finitely many coefficients of h N1, h N2, ... . No series is summed, and no limit is taken. That the poles
   lie inside the unit circle is not assumed: where they do not, there is no such h.

   h comes from outside, or from a rounded recursion (`impulse`): the theorems only check it. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Streams.
Open Scope R_scope.

(* What h leaves: r = h * D - K. *)
Definition rest (D h : list Z) (K : Z) : list Z := add (mul h D) [(- K)%Z].

Lemma rest_spec D h K y n : conv (mul h D) y n = IZR K * y n + conv (rest D h K) y n.
Proof. unfold rest. rewrite conv_add. simpl. rewrite opp_IZR. destruct n; ring. Qed.

Lemma multiplied D h K N u y : (forall n, conv D y n = total N u n) ->
  forall n, IZR K * y n = total (map (mul h) N) u n - conv (rest D h K) y n.
Proof.
  intros H n. assert (X : conv (mul h D) y n = total (map (mul h) N) u n).
  { rewrite conv_mul, <- conv_total. apply conv_ext. intros; apply H. }
  rewrite (rest_spec D h K) in X. lra.
Qed.

(* If every sum through h N is at most A in magnitude, y is at most A / (K - |r|). *)
Lemma peak D h K N u y (A : R) : (forall n, conv D y n = total N u n) ->
  (norm1 (rest D h K) < K)%Z -> (forall n, Rabs (total (map (mul h) N) u n) <= A) ->
  forall n, Rabs (y n) * IZR (K - norm1 (rest D h K)) <= A.
Proof.
  intros H HK HA n. destruct (argmax y n) as [m [Hm Hmax]].
  assert (E := multiplied D h K N u y H m). set (r := rest D h K) in *.
  assert (B := conv_bound r y m (Rabs (y m)) (Rabs_pos _) (fun k Hk => Hmax k ltac:(lia))).
  assert (P : 0 < IZR (K - norm1 r)) by (apply IZR_lt; lia).
  assert (Q : IZR K * Rabs (y m) <= A + IZR (norm1 r) * Rabs (y m)).
  { assert (0 <= IZR K) by (apply IZR_le; pose proof (norm1_pos r); lia).
    rewrite <- (Rabs_pos_eq (IZR K)) by assumption. rewrite <- Rabs_mult, E.
    unfold Rminus. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp. specialize (HA m). lra. }
  rewrite minus_IZR in *.
  apply Rle_trans with (Rabs (y m) * (IZR K - IZR (norm1 r))); [|lra].
  apply Rmult_le_compat_r; [lra|]. apply Hmax; lia.
Qed.

(* 1. Gains. The sum of the magnitudes of h N1, h N2, ... , over K - |r|, is at most p / q. *)
Fixpoint norms (h : list Z) (N : list (list Z)) : Z :=
  match N with [] => 0%Z | c :: N' => (norm1 (mul h c) + norms h N')%Z end.
Definition gain_holds (D h : list Z) (K : Z) (N : list (list Z)) (p q : Z) : bool :=
  let left := (K - norm1 (rest D h K))%Z in
  ((0 <? left) && (0 <? q) && (norms h N * q <=? p * left))%Z.

Lemma total_norms h (M : R) : 0 <= M -> forall N u n, Forall (fun x : sequence => forall k, Rabs (x k) <= M) u ->
  Rabs (total (map (mul h) N) u n) <= IZR (norms h N) * M.
Proof.
  intros HM. induction N as [|c N IH]; intros u n H; simpl; [rewrite Rabs_R0; lra|].
  rewrite plus_IZR, Rmult_plus_distr_r. destruct H as [|x u Hx H]; simpl.
  - rewrite Rabs_R0. specialize (IH [] n (Forall_nil _)).
    pose proof (Rabs_pos (total (map (mul h) N) [] n)).
    assert (0 <= IZR (norm1 (mul h c)) * M) by (apply Rmult_le_pos; [apply IZR_le, norm1_pos|assumption]). lra.
  - eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|apply IH, H].
    apply conv_bound; auto.
Qed.

(* What a claim of a gain says: whatever bounded inputs there are, y is never beyond p / q times their bound. *)
Definition gain_at_most (D : list Z) (N : list (list Z)) (p q : Z) : Prop :=
  forall (y : sequence) (u : list sequence) (M : R),
    (forall n, conv D y n = total N u n) -> 0 <= M -> Forall (fun x : sequence => forall n, Rabs (x n) <= M) u ->
    forall n, Rabs (y n) <= IZR p / IZR q * M.

Theorem gain (D h : list Z) (K : Z) (N : list (list Z)) (p q : Z) : gain_holds D h K N p q = true -> gain_at_most D N p q.
Proof.
  unfold gain_holds, gain_at_most. intros C y u M H HM Hu n.
  apply andb_prop in C. destruct C as [C C3]. apply andb_prop in C. destruct C as [C1 C2].
  apply Z.ltb_lt in C1. apply Z.ltb_lt in C2. apply Z.leb_le in C3.
  assert (P := peak D h K N u y _ H ltac:(lia) (fun k => total_norms h M HM N u k Hu) n).
  set (left := (K - norm1 (rest D h K))%Z) in *.
  assert (L : 0 < IZR left) by (apply IZR_lt; lia).
  assert (Q : 0 < IZR q) by (apply IZR_lt; lia).
  apply IZR_le in C3. rewrite !mult_IZR in C3.
  apply Rmult_le_reg_r with (IZR q * IZR left); [apply Rmult_lt_0_compat; assumption|].
  replace (IZR p / IZR q * M * (IZR q * IZR left)) with (IZR p * IZR left * M) by (field; lra).
  apply Rle_trans with (IZR (norms h N) * IZR q * M); [|apply Rmult_le_compat_r; assumption].
  replace (Rabs (y n) * (IZR q * IZR left)) with (IZR q * (Rabs (y n) * IZR left)) by ring.
  replace (IZR (norms h N) * IZR q * M) with (IZR q * (IZR (norms h N) * M)) by ring.
  apply Rmult_le_compat_l; lra.
Qed.

(* 2. Ranges. Each input has its own range, which need not contain 0; then sums up to some sample may be beyond the whole
   sum, so the largest of all counts. y times q is within low .. high. *)
Definition opposite (b : Z * Z) : Z * Z := (- snd b, - fst b)%Z.
Definition range_fits (r K : Z) (g : list (list Z)) (b below : list (Z * Z)) (q low high : Z) : bool :=
  let up := largest (all_tops g b) in
  let down := largest (all_tops g below) in
  let most := Z.max up down in
  ((0 <=? q) && (q * (up * (K - r) + r * most) <=? high * (K * (K - r)))
   && (q * (down * (K - r) + r * most) <=? - low * (K * (K - r))))%Z.
Definition range_holds (D h : list Z) (K : Z) (N : list (list Z)) (b : list (Z * Z)) (q low high : Z) : bool :=
  let r := norm1 (rest D h K) in
  ((r <? K)%Z && range_fits r K (map (mul h) N) b (map opposite b) q low high).

Definition negated (u : sequence) : sequence := fun n => - u n.
Lemma total_negated N : forall u n, total N (map negated u) n = - total N u n.
Proof.
  induction N as [|c N IH]; intros [|x u] n; simpl; try ring. rewrite IH.
  replace (conv c (negated x) n) with (- conv c x n); [ring|].
  rewrite (conv_ext c (negated x) (fun k => -1 * x k)), conv_multiple; [ring|]. intros; unfold negated; ring.
Qed.
Lemma within_negated u b : Forall2 within u b -> Forall2 within (map negated u) (map opposite b).
Proof.
  induction 1; simpl; constructor; auto. intros n. unfold negated, opposite. simpl. rewrite !opp_IZR.
  specialize (H n). lra.
Qed.

Lemma between x a : Rabs x <= a -> - a <= x <= a.
Proof. intros H. pose proof (Rle_abs x). pose proof (Rle_abs (- x)). rewrite Rabs_Ropp in *. lra. Qed.

Theorem range (D h : list Z) (K : Z) (N : list (list Z)) (b : list (Z * Z)) (q low high : Z) :
  range_holds D h K N b q low high = true ->
  forall (y : sequence) (u : list sequence), (forall n, conv D y n = total N u n) -> Forall2 within u b ->
  forall n, IZR low <= IZR q * y n <= IZR high.
Proof.
  unfold range_holds, range_fits. intros C y u H Hu n.
  apply andb_prop in C. destruct C as [C2 C]. apply andb_prop in C. destruct C as [C C4].
  apply andb_prop in C. destruct C as [C1 C3].
  apply Z.leb_le in C1. apply Z.ltb_lt in C2. apply Z.leb_le in C3. apply Z.leb_le in C4.
  set (g := map (mul h) N) in *. set (up := largest (all_tops g b)) in *.
  set (down := largest (all_tops g (map opposite b))) in *. set (most := Z.max up down) in *.
  assert (U : forall k, total g u k <= IZR up).
  { intros k. eapply Rle_trans; [apply total_tops, Hu|]. apply IZR_le, prefix_largest. }
  assert (L : forall k, - total g u k <= IZR down).
  { intros k. rewrite <- total_negated. eapply Rle_trans; [apply total_tops, within_negated, Hu|].
    apply IZR_le, prefix_largest. }
  assert (A : forall k, Rabs (total g u k) <= IZR most).
  { intros k. specialize (U k). specialize (L k).
    assert (IZR up <= IZR most) by (apply IZR_le; lia). assert (IZR down <= IZR most) by (apply IZR_le; lia).
    apply Rabs_le. lra. }
  assert (P := peak D h K N u y _ H C2 A). assert (E := multiplied D h K N u y H n). fold g in E.
  assert (R0 := norm1_pos (rest D h K)).
  assert (B : Rabs (conv (rest D h K) y n) * IZR (K - norm1 (rest D h K)) <= IZR (norm1 (rest D h K)) * IZR most).
  { assert (0 < IZR (K - norm1 (rest D h K))) as X by (apply IZR_lt; lia).
    destruct (argmax y n) as [m [Hm Hmax]].
    assert (V := conv_bound (rest D h K) y n (Rabs (y m)) (Rabs_pos _) (fun k Hk => Hmax k Hk)).
    apply Rle_trans with (IZR (norm1 (rest D h K)) * Rabs (y m) * IZR (K - norm1 (rest D h K))).
    - apply Rmult_le_compat_r; [lra|exact V].
    - rewrite Rmult_assoc. apply Rmult_le_compat_l; [apply IZR_le; lia|apply P]. }
  set (r := norm1 (rest D h K)) in *. set (c := conv (rest D h K) y n) in *.
  assert (X : 0 < IZR (K - r)) by (apply IZR_lt; lia).
  assert (Kp : 0 < IZR K) by (apply IZR_lt; lia).
  assert (Q : 0 <= IZR q) by (apply IZR_le; lia).
  assert (G : 0 < IZR K * IZR (K - r)) by (apply Rmult_lt_0_compat; assumption).
  apply IZR_le in C3. apply IZR_le in C4.
  rewrite !mult_IZR, plus_IZR, !mult_IZR in C3, C4. rewrite opp_IZR in C4.
  assert (B' := B). rewrite <- (Rabs_pos_eq (IZR (K - r))) in B' by lra. rewrite <- Rabs_mult in B'.
  apply between in B'. specialize (U n). specialize (L n).
  assert (T1 : total g u n * IZR (K - r) <= IZR up * IZR (K - r)) by (apply Rmult_le_compat_r; lra).
  assert (T2 : - total g u n * IZR (K - r) <= IZR down * IZR (K - r)) by (apply Rmult_le_compat_r; lra).
  assert (E1 : IZR q * y n * (IZR K * IZR (K - r)) = IZR q * (total g u n * IZR (K - r) - c * IZR (K - r))).
  { replace (IZR q * y n * (IZR K * IZR (K - r))) with (IZR q * (IZR K * y n) * IZR (K - r)) by ring.
    rewrite E. ring. }
  split; apply Rmult_le_reg_r with (IZR K * IZR (K - r)); try exact G; rewrite E1.
  - assert (IZR q * - (total g u n * IZR (K - r) - c * IZR (K - r)) <= IZR q * (IZR down * IZR (K - r) + IZR r * IZR most))
      by (apply Rmult_le_compat_l; lra). lra.
  - assert (IZR q * (total g u n * IZR (K - r) - c * IZR (K - r)) <= IZR q * (IZR up * IZR (K - r) + IZR r * IZR most))
      by (apply Rmult_le_compat_l; lra). lra.
Qed.

(* A witness: the impulse response of one / D in units of 1 / one, rounded down sample by sample. D is [a0; a1; ...], and
   `next` divides by a0 or nearly so. *)
Fixpoint weighted (a past : list Z) : Z :=
  match a, past with x :: a', y :: past' => (x * y + weighted a' past')%Z | _, _ => 0%Z end.
Fixpoint response (n : nat) (next : Z -> Z) (a past : list Z) : list Z :=
  match n with
  | O => []
  | S m => let y := next (- weighted a past)%Z in y :: response m next a (y :: removelast past)
  end.
Definition impulse (D : list Z) (samples : N) (one : Z) : list Z :=
  match D with
  | [] => []
  | a0 :: a => one :: response (N.to_nat samples) (fun x => (x / a0)%Z) a (one :: repeat 0%Z (length a - 1))
  end.
