(* A filter that starts from zero: the counter that flags its first samples, and how little of any other past is left behind
   them. What came before a sample acts on later codes by the tails of the responses alone. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Graph Ranges Linear Rows.
Open Scope Z_scope.

(* The nodes of the counter, by their places: counted is next one sample later, and
     left = counted - count, shifted = left / 2^bits, flag = floor shifted, sum = counted - flag, next = sum. *)
Record counter := Counter { counted : nat; count_ : nat; left_ : nat; shifted_ : nat; flag : nat; sum_ : nat; next : nat }.
Definition is_op (g : graph) (i : nat) (test : operation -> bool) : bool := Nat.ltb i (length g) && test (op (nth i g blank)).
Definition counts (g : graph) (c : counter) (N : Z) : bool :=
  let whole i := frac_of g i =? 0 in
  is_op g (counted c) (fun o => match o with Delay a => Nat.eqb a (next c) | _ => false end)
  && is_op g (count_ c) (fun o => match o with Constant k => k =? N | _ => false end)
  && is_op g (left_ c) (fun o => match o with Subtract a b => Nat.eqb a (counted c) && Nat.eqb b (count_ c) | _ => false end)
  && is_op g (shifted_ c) (fun o => match o with Shift a _ => Nat.eqb a (left_ c) | _ => false end)
  && is_op g (flag c) (fun o => match o with Floor a => Nat.eqb a (shifted_ c) | _ => false end)
  && is_op g (sum_ c) (fun o => match o with Subtract a b => Nat.eqb a (counted c) && Nat.eqb b (flag c) | _ => false end)
  && is_op g (next c) (fun o => match o with Bound a => Nat.eqb a (sum_ c) | _ => false end)
  && whole (counted c) && whole (count_ c) && whole (left_ c) && whole (flag c) && whole (sum_ c)
  && (0 <=? frac_of g (shifted_ c)) && (0 <? N) && (N <=? 2 ^ frac_of g (shifted_ c))
  && (low (nth (next c) g blank) <=? 0) && (N <=? high (nth (next c) g blank)).

Theorem flagged_from g x c N : ordered g = true -> counts g c N = true -> forall n,
  code g x (flag c) n = (if Z.of_nat n <? N then -1 else 0) /\ in_range g x (next c) n.
Proof.
  intros G H. unfold counts in H.
  repeat match type of H with _ && _ = true => let X := fresh "X" in apply andb_prop in H; destruct H as [H X] end.
  assert (Code : forall i test n, is_op g i test = true ->
    test (op (nth i g blank)) = true /\ code g x i n = compute g (run g x n) (before g x n) (x n) (nth i g blank)).
  { intros i test n Hi. apply andb_prop in Hi. destruct Hi as [Hl Ho]. apply Nat.ltb_lt in Hl. split; [exact Ho|apply (code_spec g x G i n Hl)]. }
  apply Z.leb_le in X, X0, X1, X3. apply Z.ltb_lt in X2. apply Z.eqb_eq in X4, X5, X6, X7, X8.
  set (p := frac_of g (shifted_ c)) in *.
  assert (Counted : forall n, code g x (counted c) n = match n with O => 0 | S m => code g x (next c) m end).
  { intros n. destruct (Code _ _ n H) as [Ho Hc]. rewrite Hc. unfold compute. destruct (op (nth (counted c) g blank)); try discriminate.
    apply Nat.eqb_eq in Ho. subst. apply before_code. }
  assert (Sub : forall i a b n, is_op g i (fun o => match o with Subtract a' b' => Nat.eqb a' a && Nat.eqb b' b | _ => false end) = true ->
    frac_of g i = 0 -> frac_of g a = 0 -> frac_of g b = 0 -> code g x i n = code g x a n - code g x b n).
  { intros i a b n Hi F1 F2 F3. destruct (Code _ _ n Hi) as [Ho Hc]. rewrite Hc. unfold compute. destruct (op (nth i g blank)); try discriminate.
    apply andb_prop in Ho. destruct Ho as [Ha Hb]. apply Nat.eqb_eq in Ha. apply Nat.eqb_eq in Hb. subst.
    change (frac (nth i g blank)) with (frac_of g i). rewrite F1, F2, F3. unfold code. change (2 ^ (0 - 0)) with 1. ring. }
  assert (Limit : forall n, code g x (count_ c) n = N).
  { intros n. destruct (Code _ _ n X14) as [Ho Hc]. rewrite Hc. unfold compute. destruct (op (nth (count_ c) g blank)); try discriminate.
    apply Z.eqb_eq, Ho. }
  assert (Flag : forall n, code g x (flag c) n = (code g x (counted c) n - N) / 2 ^ p).
  { intros n. destruct (Code _ _ n X11) as [Ho Hc]. rewrite Hc. unfold compute. destruct (op (nth (flag c) g blank)); try discriminate.
    apply Nat.eqb_eq in Ho. subst. change (frac (nth (flag c) g blank)) with (frac_of g (flag c)). rewrite X5. fold p. rewrite Z.sub_0_r. f_equal.
    destruct (Code _ _ n X12) as [Ho Hd]. change (nth (shifted_ c) (run g x n) 0) with (code g x (shifted_ c) n). rewrite Hd. unfold compute.
    destruct (op (nth (shifted_ c) g blank)); try discriminate. apply Nat.eqb_eq in Ho. subst.
    change (nth (left_ c) (run g x n) 0) with (code g x (left_ c) n). rewrite (Sub _ _ _ n X13), Limit by assumption. reflexivity. }
  assert (Next : forall n, code g x (next c) n = code g x (counted c) n - code g x (flag c) n).
  { intros n. destruct (Code _ _ n X9) as [Ho Hc]. rewrite Hc. unfold compute. destruct (op (nth (next c) g blank)); try discriminate.
    apply Nat.eqb_eq in Ho. subst. change (nth (sum_ c) (run g x n) 0) with (code g x (sum_ c) n). apply (Sub _ _ _ n X10); assumption. }
  assert (P : 0 < 2 ^ p) by (apply Z.pow_pos_nonneg; lia).
  assert (Main : forall n, code g x (counted c) n = Z.min (Z.of_nat n) N
    /\ code g x (flag c) n = (if Z.of_nat n <? N then -1 else 0)).
  { assert (Flagged : forall n, code g x (counted c) n = Z.min (Z.of_nat n) N -> code g x (flag c) n = (if Z.of_nat n <? N then -1 else 0)).
    { intros n Hn. rewrite Flag, Hn. destruct (Z.ltb_spec (Z.of_nat n) N) as [L|L].
      - symmetry. apply (Z.div_unique _ _ _ (Z.min (Z.of_nat n) N - N + 2 ^ p)); [left; lia|lia].
      - rewrite Z.min_r by lia. rewrite Z.sub_diag. apply Z.div_0_l. lia. }
    induction n as [|n [IHc IHf]].
    - assert (A : code g x (counted c) 0 = Z.min (Z.of_nat 0) N) by (rewrite Counted; lia). split; [exact A|apply Flagged, A].
    - assert (A : code g x (counted c) (S n) = Z.min (Z.of_nat (S n)) N).
      { rewrite Counted, Next, IHc, IHf. destruct (Z.ltb_spec (Z.of_nat n) N); lia. }
      split; [exact A|apply Flagged, A]. }
  intros n. destruct (Main n) as [Mc Mf]. split; [exact Mf|]. unfold in_range. rewrite Next, Mc, Mf.
  destruct (Z.ltb_spec (Z.of_nat n) N); lia.
Qed.

(* What was before sample m acts on the codes from there on by the tails of the responses. *)
Definition shifted (m : nat) (u : sequence) : sequence := fun n => u (m + n)%nat.
Lemma conv_shifted l : forall u m n, conv l u (S m + n) = (conv l (shifted (S m) u) n + conv (skipn (S n) l) u m)%R.
Proof.
  induction l as [|c l IH]; intros u m n; [simpl; ring|]. destruct n as [|n].
  - rewrite Nat.add_0_r. cbn [conv skipn]. unfold shifted. rewrite Nat.add_0_r. ring.
  - replace (S m + S n)%nat with (S (S m + n)) by lia. cbn [conv]. rewrite IH.
    change (skipn (S (S n)) (c :: l)) with (skipn (S n) l). unfold shifted at 2. replace (S m + S n)%nat with (S (S m + n)) by lia. ring.
Qed.
Lemma norm1_skipn l : forall a b, (a <= b)%nat -> norm1 (skipn b l) <= norm1 (skipn a l).
Proof.
  induction l as [|c l IH]; intros [|a] [|b] H; cbn [skipn norm1]; try lia.
  - pose proof (IH O b ltac:(lia)). cbn [skipn] in *. lia.
  - apply IH. lia.
Qed.
Definition mag (b : Z * Z) : Z := Z.max (Z.abs (fst b)) (Z.abs (snd b)).
Fixpoint late_sum (n : nat) (r : row) (b : list (Z * Z)) : Z :=
  match r, b with l :: r', x :: b' => norm1 (skipn n (expanded l)) * mag x + late_sum n r' b' | _, _ => 0 end.
Lemma within_mag u b : within u b -> forall n, (Rabs (u n) <= IZR (mag b))%R.
Proof.
  intros H n. destruct (H n) as [L T]. unfold mag. apply Rabs_le. split.
  - apply Rle_trans with (2 := L). rewrite <- opp_IZR. apply IZR_le. lia.
  - apply Rle_trans with (1 := T). apply IZR_le. lia.
Qed.
Theorem total_shifted k : forall r u b m n, Forall2 within u b -> (k <= n)%nat ->
  (Rabs (total (rows r) u (S m + n) - total (rows r) (map (shifted (S m)) u) n) <= IZR (late_sum (S k) r b))%R.
Proof.
  induction r as [|l r IH]; intros u b m n H K; [simpl; rewrite Rminus_0_r, Rabs_R0; lra|].
  destruct H as [|x y u b Hx H]; [simpl; rewrite Rminus_0_r, Rabs_R0; lra|].
  cbn [rows total map late_sum]. fold (rows r). set (c := expanded l). rewrite conv_shifted, plus_IZR.
  replace (conv c (shifted (S m) x) n + conv (skipn (S n) c) x m + total (rows r) u (S m + n)
    - (conv c (shifted (S m) x) n + total (rows r) (map (shifted (S m)) u) n))%R
    with (conv (skipn (S n) c) x m + (total (rows r) u (S m + n) - total (rows r) (map (shifted (S m)) u) n))%R by ring.
  eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|apply IH; assumption].
  assert (M0 : 0 <= mag y) by (unfold mag; lia).
  apply Rle_trans with (IZR (norm1 (skipn (S n) c)) * IZR (mag y))%R.
  - apply conv_bound; [apply IZR_le; exact M0|]. intros j _. apply within_mag, Hx.
  - rewrite <- mult_IZR. apply IZR_le, Z.mul_le_mono_nonneg_r; [exact M0|]. apply norm1_skipn. lia.
Qed.
Lemma within_shifted m u b : Forall2 within u b -> Forall2 within (map (shifted m) u) b.
Proof. intros H. induction H as [|x y u b Hx H IH]; constructor; [intros n; apply Hx|exact IH]. Qed.
