(* Sequences of real numbers, and polynomials in the delay w = z^-1 that act on them.

   A sequence u : nat -> R begins at sample 0; before it everything is 0. The polynomial l = [l0; l1; ...], with integer
   coefficients, takes u to the sequence (l * u)(n) = l0 u(n) + l1 u(n - 1) + ... + ln u(0). Nothing here is about
   convergence: every sum is finite. *)
Require Import ZArith Reals List Lia Lra. Import ListNotations. Open Scope R_scope.

Definition sequence := nat -> R.

Fixpoint conv (l : list Z) (u : sequence) (n : nat) : R :=
  match l with [] => 0 | c :: l' => IZR c * u n + match n with O => 0 | S m => conv l' u m end end.

(* Sum, multiple and product of polynomials, and the sum of the magnitudes of their coefficients. *)
Fixpoint add (a b : list Z) : list Z :=
  match a, b with [], _ => b | _, [] => a | x :: a', y :: b' => (x + y)%Z :: add a' b' end.
Definition scale (c : Z) (l : list Z) : list Z := map (Z.mul c) l.
Fixpoint mul (a b : list Z) : list Z := match a with [] => [] | x :: a' => add (scale x b) (0%Z :: mul a' b) end.
Fixpoint norm1 (l : list Z) : Z := match l with [] => 0%Z | c :: l' => (Z.abs c + norm1 l')%Z end.

Lemma norm1_pos l : (0 <= norm1 l)%Z.
Proof. induction l; simpl; lia. Qed.

(* They act as they should. *)
Lemma conv_add a : forall b u n, conv (add a b) u n = conv a u n + conv b u n.
Proof.
  induction a as [|x a IH]; intros [|y b] u n; simpl; try ring.
  rewrite plus_IZR. destruct n; [ring|]. rewrite IH; ring.
Qed.
Lemma conv_scale c b : forall u n, conv (scale c b) u n = IZR c * conv b u n.
Proof.
  induction b as [|y b IH]; intros u n; simpl; [ring|].
  rewrite mult_IZR. destruct n; [ring|]. fold (scale c b). rewrite IH; ring.
Qed.

(* They are linear in the sequence, and see only its first n + 1 values. *)
Lemma conv_ext l : forall u v n, (forall k, (k <= n)%nat -> u k = v k) -> conv l u n = conv l v n.
Proof.
  induction l as [|c l IH]; intros u v n H; simpl; [reflexivity|].
  rewrite (H n) by lia. destruct n; [reflexivity|]. rewrite (IH u v n); [reflexivity|]. intros; apply H; lia.
Qed.
Lemma conv_plus l : forall u v n, conv l (fun k => u k + v k) n = conv l u n + conv l v n.
Proof. induction l as [|c l IH]; intros u v n; simpl; [ring|]. destruct n; [ring|]. rewrite IH; ring. Qed.
Lemma conv_multiple l : forall x u n, conv l (fun k => x * u k) n = x * conv l u n.
Proof. induction l as [|c l IH]; intros x u n; simpl; [ring|]. destruct n; [ring|]. rewrite IH; ring. Qed.
Lemma conv_zero l : forall n, conv l (fun _ => 0) n = 0.
Proof. induction l as [|c l IH]; intros n; simpl; [ring|]. destruct n; [ring|]. rewrite IH; ring. Qed.

(* Several sequences at once: N1 * u1 + N2 * u2 + ... *)
Fixpoint total (N : list (list Z)) (u : list sequence) (n : nat) : R :=
  match N, u with c :: N', x :: u' => conv c x n + total N' u' n | _, _ => 0 end.


(* |l * u| <= |l| M where |u| <= M. *)
Lemma conv_bound l : forall u n M, 0 <= M -> (forall k, (k <= n)%nat -> Rabs (u k) <= M) ->
  Rabs (conv l u n) <= IZR (norm1 l) * M.
Proof.
  induction l as [|c l IH]; intros u n M HM H; simpl; [rewrite Rabs_R0; lra|].
  rewrite plus_IZR, abs_IZR, Rmult_plus_distr_r. eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat.
  - rewrite Rabs_mult. apply Rmult_le_compat_l; [apply Rabs_pos|apply H; lia].
  - destruct n; [|apply IH; auto]. rewrite Rabs_R0. apply Rmult_le_pos; [apply IZR_le, norm1_pos|lra].
Qed.

(* The sum of the first n + 1 coefficients, and the largest such sum over all n. *)
Fixpoint prefix (l : list Z) (n : nat) : Z :=
  match l with [] => 0%Z | x :: l' => (x + match n with O => 0 | S m => prefix l' m end)%Z end.
Fixpoint highest (l : list Z) : Z := match l with [] => 0%Z | x :: l' => Z.max 0 (x + highest l') end.
Definition largest (l : list Z) : Z := match l with [] => 0%Z | x :: l' => (x + highest l')%Z end.

Lemma prefix_highest l : forall n, (prefix l n <= highest l)%Z.
Proof.
  induction l as [|x l IH]; intros n; simpl; [lia|].
  assert (0 <= highest l)%Z by (destruct l; simpl; lia).
  destruct n; [lia|]. specialize (IH n). lia.
Qed.
Lemma prefix_largest l n : (prefix l n <= largest l)%Z.
Proof.
  destruct l as [|x l]; simpl; [lia|].
  assert (0 <= highest l)%Z by (destruct l; simpl; lia).
  destruct n; [lia|]. pose proof (prefix_highest l n). lia.
Qed.
Lemma prefix_add a : forall b n, (prefix (add a b) n = prefix a n + prefix b n)%Z.
Proof. induction a as [|x a IH]; intros [|y b] n; simpl; try lia. destruct n; [lia|]. rewrite IH; lia. Qed.

(* The largest products of coefficients with a value between two integers. *)
Definition tops (l : list Z) (b : Z * Z) : list Z := map (fun g => Z.max (g * fst b) (g * snd b))%Z l.
Fixpoint all_tops (N : list (list Z)) (b : list (Z * Z)) : list Z :=
  match N, b with c :: N', x :: b' => add (tops c x) (all_tops N' b') | _, _ => [] end.

Definition within (u : sequence) (b : Z * Z) := forall n, IZR (fst b) <= u n <= IZR (snd b).

Lemma product_top g b x : IZR (fst b) <= x <= IZR (snd b) -> IZR g * x <= IZR (Z.max (g * fst b) (g * snd b)).
Proof.
  intros [L H]. destruct (Z.le_gt_cases 0 g) as [P|P].
  - apply Rle_trans with (IZR (g * snd b)); [|apply IZR_le; lia].
    rewrite mult_IZR. apply Rmult_le_compat_l; [apply IZR_le; lia|exact H].
  - apply Rle_trans with (IZR (g * fst b)); [|apply IZR_le; lia].
    assert (IZR g <= 0) by (apply IZR_le; lia). rewrite mult_IZR.
    apply Rmult_le_compat_neg_l; [assumption|exact L].
Qed.
Lemma conv_tops l : forall u b n, within u b -> conv l u n <= IZR (prefix (tops l b) n).
Proof.
  induction l as [|g l IH]; intros u b n H; simpl; [lra|].
  rewrite plus_IZR. apply Rplus_le_compat; [apply product_top, H|].
  destruct n; [lra|]. apply IH, H.
Qed.
Lemma total_tops N : forall u b n, Forall2 within u b -> total N u n <= IZR (prefix (all_tops N b) n).
Proof.
  induction N as [|c N IH]; intros u b n H; simpl; [lra|].
  destruct H as [|x y u b Hx H]; simpl; [lra|].
  rewrite prefix_add, plus_IZR. apply Rplus_le_compat; [apply conv_tops, Hx|apply IH, H].
Qed.

(* The same at less cost where ranges contain 0: then the sum over all samples is the largest, and the coefficients of each
   sign can be summed before they are multiplied. *)
Fixpoint by_sign (l : list Z) (p n : Z) : Z * Z :=
  match l with [] => (p, n) | c :: l' => if (0 <=? c)%Z then by_sign l' (p + c)%Z n else by_sign l' p (n + c)%Z end.
Definition has_zero (b : Z * Z) : bool := ((fst b <=? 0) && (0 <=? snd b))%Z%bool.

Lemma conv_by_sign l : forall u b p n m, has_zero b = true -> within u b ->
  conv l u m + IZR (p * snd b + n * fst b) <= IZR (fst (by_sign l p n) * snd b + snd (by_sign l p n) * fst b).
Proof.
  induction l as [|c l IH]; intros u b p n m Z0 H; cbn [conv by_sign fst snd]; [lra|].
  unfold has_zero in Z0. pose proof Z0 as Z1. apply Bool.andb_true_iff in Z1. rewrite !Z.leb_le in Z1. destruct Z1 as [L U].
  pose proof (product_top c b (u m) (H m)) as T.
  assert (Rest : forall p' n', match m with O => 0 | S m' => conv l u m' end + IZR (p' * snd b + n' * fst b)
    <= IZR (fst (by_sign l p' n') * snd b + snd (by_sign l p' n') * fst b)).
  { intros p' n'. destruct m as [|m']; [|apply IH; assumption].
    specialize (IH (fun _ => 0) b p' n' O Z0). rewrite conv_zero in IH. apply IH.
    intros k. split; [apply IZR_le|apply IZR_le]; assumption. }
  destruct (Z.leb_spec 0 c) as [P|P]; eapply Rle_trans; try apply Rest.
  - assert (IZR (Z.max (c * fst b) (c * snd b)) <= IZR (c * snd b)) by (apply IZR_le; nia).
    replace ((p + c) * snd b + n * fst b)%Z with (c * snd b + (p * snd b + n * fst b))%Z by ring. rewrite (plus_IZR (c * snd b)). lra.
  - assert (IZR (Z.max (c * fst b) (c * snd b)) <= IZR (c * fst b)) by (apply IZR_le; nia).
    replace (p * snd b + (n + c) * fst b)%Z with (c * fst b + (p * snd b + n * fst b))%Z by ring. rewrite (plus_IZR (c * fst b)). lra.
Qed.
Lemma conv_signs l u b m : has_zero b = true -> within u b -> conv l u m <= IZR (fst (by_sign l 0 0) * snd b + snd (by_sign l 0 0) * fst b).
Proof.
  intros Z0 H. pose proof (conv_by_sign l u b 0 0 m Z0 H) as C. replace (0 * snd b + 0 * fst b)%Z with 0%Z in C by ring. lra.
Qed.
Lemma conv_signs_opposite l u b m : has_zero b = true -> within u b ->
  - conv l u m <= IZR (- snd (by_sign l 0 0) * snd b + - fst (by_sign l 0 0) * fst b).
Proof.
  intros Z0 H. pose proof (conv_signs l (fun k => -1 * u k) (- snd b, - fst b)%Z m) as C. rewrite conv_multiple in C. cbn [fst snd] in C.
  replace (- snd (by_sign l 0 0) * snd b + - fst (by_sign l 0 0) * fst b)%Z
    with (fst (by_sign l 0 0) * - fst b + snd (by_sign l 0 0) * - snd b)%Z by ring.
  assert (Z1 : has_zero (- snd b, - fst b)%Z = true)
    by (unfold has_zero in *; cbn [fst snd]; apply Bool.andb_true_iff in Z0; rewrite !Z.leb_le in Z0; apply Bool.andb_true_iff; rewrite !Z.leb_le; lia).
  assert (W : within (fun k => -1 * u k) (- snd b, - fst b)%Z)
    by (intros k; cbn [fst snd]; rewrite !opp_IZR; specialize (H k); lra).
  specialize (C Z1 W). lra.
Qed.
