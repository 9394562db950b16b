(* What a cascade of sections can make of its inputs, for ever: K code = R1 * u1 + R2 * u2 + ... + e.

   The form of a node of the last section says D * code = N1 * u1 + ..., where some of the u are codes at the section's own
   inputs. Multiplied by the rounded response Q of 1 / D, the left becomes K code, but for a residual. What Q N does to an
   input of the section is then moved to the section before: that input is an output there, of which a form is known, and
   a polynomial Q' with Q' D' = Q N + r' is found by division. Each residual acts on codes whose range is known from
   before: so e is known, and in the end only what enters the first section and the roundings are left. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Graph Ranges Linear Rows.
Open Scope Z_scope.

Lemma conv_divided samples k a P Q r u n : 0 <= k -> divide samples k a P = (Q, r) ->
  exists e, (forall M, 0 <= M -> (forall m, Rabs (u m) <= M) -> Rabs e <= IZR r * M)%R
    /\ conv P u n = (conv Q (conv (monic k a) u) n + e)%R.
Proof.
  intros K E. destruct (divide_spec _ _ _ _ _ _ K E) as [rr [N H]]. exists (- conv rr u n)%R. split.
  - intros M HM Hu. rewrite Rabs_Ropp. apply Rle_trans with (IZR (norm1 rr) * M)%R; [apply conv_bound; auto|].
    apply Rmult_le_compat_r; [exact HM|apply IZR_le; exact N].
  - rewrite <- !taps_conv, (taps_ext Q _ (taps (monic k a) (from_zero u))) by (intros; apply from_zero_conv).
    rewrite H. ring.
Qed.

(* A denominator that begins with a power of two. *)
Definition split (D : list Z) : option (Z * list Z) :=
  match D with
  | d :: a => let k := Z.log2 d in if (0 <=? k) && (d =? 2 ^ k) then Some (k, a) else None
  | [] => None
  end.
Lemma split_spec D k a : split D = Some (k, a) -> 0 <= k /\ D = monic k a.
Proof.
  unfold split. destruct D as [|d l]; [discriminate|]. destruct ((0 <=? Z.log2 d) && (d =? 2 ^ Z.log2 d)) eqn:E; [|discriminate].
  intros X. injection X as <- <-. apply andb_prop in E. destruct E as [E1 E2]. apply Z.leb_le in E1. apply Z.eqb_eq in E2.
  split; [exact E1|]. unfold monic. rewrite <- E2. reflexivity.
Qed.

Definition size (g : graph) (i : nat) : Z := Z.max (Z.abs (low (nth i g blank))) (Z.abs (high (nth i g blank))).

(* Moves what acts on source s, the input of a section, to the section before. *)
Definition eliminate (g : graph) (S : list source) (forms : list (option form)) (k known : nat)
    (now : row * Z) (step : nat * N) : option (row * Z) :=
  match nth (fst step) S (Rounding 0 0) with
  | Of i =>
      match op (nth i g blank) with
      | Wire a =>
          match nth a forms None with
          | Some f =>
              match split (under f) with
              | Some (b, den) =>
                  let (Q, r) := divide (snd step) b den (expanded (nth (fst step) (fst now) [])) in
                  if Nat.ltb a k && Nat.ltb i known
                  then Some (join (without (fst step) (fst now)) (of_form (over f) Q), snd now + r * size g i)
                  else None
              | None => None
              end
          | None => None
          end
      | _ => None
      end
  | _ => None
  end.
Fixpoint eliminated (g : graph) (S : list source) (forms : list (option form)) (k known : nat)
    (now : row * Z) (steps : list (nat * N)) : option (row * Z) :=
  match steps with
  | [] => Some now
  | one :: others => match eliminate g S forms k known now one with
                     | Some next => eliminated g S forms k known next others
                     | None => None
                     end
  end.

(* Sources whose range is a mixture of two ranges, in the same shares for all times: that of a sample less the first one
   is wider than any sequence can use, since the first one is the same for all. *)
Definition windows := option (nat * (Z * Z) * (Z * Z)).
Definition reach_in (g : graph) (W : windows) (second : bool) (s : source) : Z * Z :=
  match W, s with
  | Some (j, w1, w2), Of i => if Nat.eqb i j then (if second then w2 else w1) else reach g s
  | _, _ => reach g s
  end.
Definition window_holds (g : graph) (x : nat -> nat -> Z) (W : windows) : Prop :=
  match W with
  | None => True
  | Some (j, w1, w2) => exists (lam : R) (v w : sequence), (0 <= lam <= 1)%R /\ within v w1 /\ within w w2
      /\ forall n, trace g x j n = ((1 - lam) * v n + lam * w n)%R
  end.
Definition mixed (u : list sequence) (b1 b2 : list (Z * Z)) : Prop :=
  exists (lam : R) (v w : list sequence), (0 <= lam <= 1)%R /\ Forall2 within v b1 /\ Forall2 within w b2
    /\ forall N n, total N u n = ((1 - lam) * total N v n + lam * total N w n)%R.

(* The largest value of the row, and of its opposite. *)
Definition most_merged (r : row) (b1 b2 : list (Z * Z)) : Z * Z :=
  if forallb has_zero b1 && forallb has_zero b2 then
    let s := map sums r in
    let t := map opposite s in
    (Z.max (dot s b1) (dot s b2), Z.max (dot t b1) (dot t b2))
  else
    let up := rows r in
    let down := scale_rows (-1) up in
    (Z.max (largest (all_tops up b1)) (largest (all_tops up b2)), Z.max (largest (all_tops down b1)) (largest (all_tops down b2))).
Definition most (r : row) (b1 b2 : list (Z * Z)) : Z * Z :=
  if Nat.eqb (length b1) (length b2) then let (sp, q) := merged r b1 b2 in let (s, p) := sp in most_merged s p q
  else most_merged r b1 b2.

Lemma mixture lam a b p q : (0 <= lam <= 1)%R -> (a <= IZR p)%R -> (b <= IZR q)%R -> ((1 - lam) * a + lam * b <= IZR (Z.max p q))%R.
Proof.
  intros L A B. assert (P : (IZR p <= IZR (Z.max p q))%R) by (apply IZR_le; lia). assert (Q : (IZR q <= IZR (Z.max p q))%R) by (apply IZR_le; lia).
  apply Rle_trans with ((1 - lam) * IZR (Z.max p q) + lam * IZR (Z.max p q))%R; [|lra].
  apply Rplus_le_compat; apply Rmult_le_compat_l; lra.
Qed.
Lemma total_largest r u b n : Forall2 within u b -> (total r u n <= IZR (largest (all_tops r b)))%R.
Proof. intros H. eapply Rle_trans; [apply total_tops; exact H|]. apply IZR_le, prefix_largest. Qed.
Lemma most_merged_spec r v w b1 b2 lam n : (0 <= lam <= 1)%R -> Forall2 within v b1 -> Forall2 within w b2 ->
  ((1 - lam) * total (rows r) v n + lam * total (rows r) w n <= IZR (fst (most_merged r b1 b2)))%R
  /\ ((1 - lam) * - total (rows r) v n + lam * - total (rows r) w n <= IZR (snd (most_merged r b1 b2)))%R.
Proof.
  intros L V W. unfold most_merged. destruct (forallb has_zero b1 && forallb has_zero b2) eqn:Z0; cbn [fst snd].
  - apply andb_prop in Z0. destruct Z0 as [Z1 Z2]. destruct (total_dot r v b1 n Z1 V). destruct (total_dot r w b2 n Z2 W).
    split; apply mixture; assumption.
  - assert (N : forall u, (- total (rows r) u n = total (scale_rows (-1) (rows r)) u n)%R) by (intros u'; rewrite total_scale_rows; ring).
    rewrite !N. split; apply mixture; try exact L; apply total_largest; assumption.
Qed.
Lemma most_spec r u b1 b2 n : mixed u b1 b2 ->
  (total (rows r) u n <= IZR (fst (most r b1 b2)))%R /\ (- total (rows r) u n <= IZR (snd (most r b1 b2)))%R.
Proof.
  intros [lam [v [w [L [V [W H]]]]]]. rewrite H.
  replace (- ((1 - lam) * total (rows r) v n + lam * total (rows r) w n))%R
    with ((1 - lam) * - total (rows r) v n + lam * - total (rows r) w n)%R by ring.
  unfold most. destruct (Nat.eqb (length b1) (length b2)) eqn:Len; [|apply most_merged_spec; assumption].
  apply Nat.eqb_eq in Len. destruct (merged r b1 b2) as [[s p] q] eqn:E.
  destruct (merged_spec r b1 b2 s p q Len E) as [A B]. destruct (A v V) as [v' [V' Hv]]. destruct (B w W) as [w' [W' Hw]].
  replace (total (rows r) v n) with (total (rows s) v' n) by (rewrite Hv; ring).
  replace (total (rows r) w n) with (total (rows s) w' n) by (rewrite Hw; ring). apply most_merged_spec; assumption.
Qed.

Lemma total_short row : forall u c n, (length row <= c)%nat -> total row u n = total row (firstn c u) n.
Proof.
  induction row as [|l row IH]; intros [|x u] [|c] n H; cbn [firstn total length] in *; try reflexivity; try lia.
  rewrite (IH u c) by lia. reflexivity.
Qed.

Section Cascades.
Variables (g : graph) (x : nat -> nat -> Z) (S : list source) (forms : list (option form)) (k known : nat) (W : windows).
Hypothesis G : ordered g = true.
Hypothesis C : closed k g = true.
Hypothesis E : every (fits_node g S forms) 0 (firstn k g) = true.
Hypothesis Known : forall n i, (i < known)%nat -> in_range g x i n.
Hypothesis Window : window_holds g x W.

Let u := map (drive g x) S.

Lemma size_spec i n : in_range g x i n -> (Rabs (trace g x i n) <= IZR (size g i))%R.
Proof.
  unfold in_range, trace, size. intros H. rewrite <- abs_IZR. apply IZR_le. lia.
Qed.
Lemma size_pos i : 0 <= size g i.
Proof. unfold size. lia. Qed.

Lemma eliminate_spec now step next n : eliminate g S forms k known now step = Some next ->
  exists e, (Rabs e <= IZR (snd next - snd now))%R /\ total (rows (fst now)) u n = (total (rows (fst next)) u n + e)%R.
Proof.
  unfold eliminate. destruct step as [s L]. cbn [fst snd].
  destruct (nth s S (Rounding 0 0)) as [i|i b|i b] eqn:Es; try discriminate.
  destruct (op (nth i g blank)) as [| | | | | | | | | | | |a|] eqn:Eo; try discriminate.
  destruct (nth a forms None) as [f|] eqn:Ef; [|discriminate].
  destruct (split (under f)) as [[b den]|] eqn:Ed; [|discriminate].
  destruct (divide L b den (expanded (nth s (fst now) []))) as [Q r] eqn:Eq.
  destruct (Nat.ltb a k && Nat.ltb i known) eqn:Eb; [|discriminate].
  intros X. injection X as <-. cbn [fst snd].
  apply andb_prop in Eb. destruct Eb as [Ea Ei]. apply Nat.ltb_lt in Ea. apply Nat.ltb_lt in Ei.
  destruct (split_spec _ _ _ Ed) as [B0 Du].
  assert (Si : (s < length S)%nat).
  { destruct (Nat.lt_ge_cases s (length S)) as [|O]; [assumption|]. rewrite nth_overflow in Es by exact O. discriminate. }
  assert (U : nth s u (fun _ => 0%R) = trace g x i).
  { unfold u. rewrite (nth_indep _ _ (drive g x (Rounding 0 0))) by (rewrite map_length; exact Si).
    rewrite map_nth, Es. reflexivity. }
  assert (Gi : (i < length g)%nat).
  { destruct (Nat.lt_ge_cases i (length g)) as [|O]; [assumption|]. rewrite nth_overflow in Eo by exact O. discriminate. }
  assert (T : forall m, trace g x i m = trace g x a m).
  { intros m. unfold trace. rewrite (code_spec g x G i m Gi). unfold compute. rewrite Eo. reflexivity. }
  destruct (conv_divided L b den (expanded (nth s (fst now) [])) Q r (trace g x i) n B0 Eq) as [e [Be He]].
  exists e. split.
  - replace (snd now + r * size g i - snd now) with (r * size g i) by lia. rewrite mult_IZR.
    apply Be; [apply IZR_le, size_pos|]. intros m. apply size_spec, Known, Ei.
  - rewrite (total_without s (rows (fst now))), rows_nth, U, He, total_join, rows_without, total_of_form.
    rewrite (conv_ext Q (conv (monic b den) (trace g x i)) (total (over f) u)); [ring|].
    intros m _. rewrite <- Du. rewrite (conv_ext (under f) (trace g x i) (trace g x a)) by (intros; apply T).
    apply (forms_hold g x S forms k G C E m a Ea f Ef).
Qed.

Lemma eliminated_spec steps : forall now last n, eliminated g S forms k known now steps = Some last ->
  exists e, (Rabs e <= IZR (snd last - snd now))%R /\ total (rows (fst now)) u n = (total (rows (fst last)) u n + e)%R.
Proof.
  induction steps as [|one steps IH]; intros now last n; cbn [eliminated].
  - intros X. injection X as <-. exists 0%R. rewrite Rabs_R0, Z.sub_diag. split; [lra|ring].
  - destruct (eliminate g S forms k known now one) as [next|] eqn:En; [|discriminate]. intros X.
    destruct (eliminate_spec now one next n En) as [e1 [B1 H1]]. destruct (IH next last n X) as [e2 [B2 H2]].
    exists (e1 + e2)%R. split; [|rewrite H1, H2; ring].
    eapply Rle_trans; [apply Rabs_triang|]. rewrite minus_IZR in *. lra.
Qed.

(* The response from the sources to a node: its row, what is left of residuals, and K. *)
Record plan := Plan { length_ : N; first : Z; steps : list (nat * N) }.
Definition rows_of (t : nat) (p : plan) : option (row * Z * Z) :=
  match nth t forms None with
  | Some f =>
      match split (under f) with
      | Some (b, den) =>
          let (Q, r) := impulse (length_ p) b den (first p) in
          match eliminated g S forms k known (of_form (over f) Q, r * size g t) (steps p) with
          | Some (row, R) => Some (row, R, first p * 2 ^ b)
          | None => None
          end
      | None => None
      end
  | None => None
  end.
Lemma rows_spec t p row R K n : (t < k)%nat -> rows_of t p = Some (row, R, K) ->
  (forall m, (m < n)%nat -> in_range g x t m) ->
  exists e, (Rabs e <= IZR R)%R /\ (IZR K * trace g x t n = total (rows row) u n + e)%R.
Proof.
  intros Ht. unfold rows_of. destruct (nth t forms None) as [f|] eqn:Ef; [|discriminate].
  destruct (split (under f)) as [[b den]|] eqn:Ed; [|discriminate].
  destruct (impulse (length_ p) b den (first p)) as [Q r] eqn:Eq.
  destruct (eliminated g S forms k known (of_form (over f) Q, r * size g t) (steps p)) as [[row' R']|] eqn:El; [|discriminate].
  intros X. injection X as -> -> <-. intros Past.
  destruct (split_spec _ _ _ Ed) as [B0 Du].
  destruct (eliminated_spec _ _ _ n El) as [e [Be He]]. cbn [fst snd] in Be, He.
  destruct (impulse_spec _ _ _ _ _ _ B0 Eq) as [rr [Nr Spec]].
  set (e0 := taps rr (from_zero (trace g x t)) (Z.of_nat n - 1)).
  assert (B1 : (Rabs e0 <= IZR (r * size g t))%R).
  { unfold e0. rewrite mult_IZR. apply Rle_trans with (IZR (norm1 rr) * IZR (size g t))%R.
    - apply taps_bound; [apply IZR_le, size_pos|]. intros j Hj. destruct (Z.ltb_spec j 0) as [N0|N0].
      + unfold from_zero. rewrite after_before by exact N0. rewrite Rabs_R0. apply IZR_le, size_pos.
      + rewrite <- (Z2Nat.id j N0). unfold from_zero. rewrite after_at. apply size_spec, Past. lia.
    - apply Rmult_le_compat_r; [apply IZR_le, size_pos|apply IZR_le; exact Nr]. }
  assert (F : total (rows (of_form (over f) Q)) u n = (IZR (first p * 2 ^ b)%Z * trace g x t n + e0)%R).
  { rewrite total_of_form, <- taps_conv.
    rewrite (taps_ext Q _ (taps (monic b den) (from_zero (trace g x t)))).
    - rewrite Spec. unfold from_zero at 1. rewrite after_at. reflexivity.
    - intros j _. rewrite <- from_zero_conv. unfold from_zero, after. destruct (j <? 0); [reflexivity|].
      rewrite <- Du. symmetry. apply (forms_hold g x S forms k G C E _ t Ht f Ef). }
  exists (e - e0)%R. split.
  - unfold Rminus. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp. rewrite minus_IZR in Be. lra.
  - rewrite He in F. lra.
Qed.

(* The sources that a row uses, and their ranges. *)
Definition used {A} (row : list A) : list source := firstn (length row) S.
Definition known_source (s : source) : bool :=
  match s with Of i => Ranges.known g known i | Rounding _ b | Truncation _ b => 0 <? b end.
Definition most_of (row : row) : Z * Z := most row (map (reach_in g W false) (used row)) (map (reach_in g W true) (used row)).

Lemma source_within s : known_source s = true -> within (drive g x s) (reach g s).
Proof.
  intros Hs n. destruct s as [i|i b|i b]; cbn [known_source reach drive fst snd] in *.
  - pose proof (known_in_range known g x i n G Known Hs) as Hr. unfold in_range in Hr. split; apply IZR_le; lia.
  - apply Z.ltb_lt in Hs. assert (D : 0 < 2 ^ b) by (apply Z.pow_pos_nonneg; lia).
    pose proof (Z.mod_pos_bound (code g x i n) _ D). split; apply IZR_le; lia.
  - apply Z.ltb_lt in Hs. assert (D : 0 < 2 ^ b) by (apply Z.pow_pos_nonneg; lia).
    pose proof (Z.rem_bound_abs (code g x i n) (2 ^ b) ltac:(lia)) as B.
    generalize dependent (Z.rem (code g x i n) (2 ^ b)). intros z B. split; apply IZR_le; lia.
Qed.
Lemma mixed_sources l : forallb known_source l = true ->
  mixed (map (drive g x) l) (map (reach_in g W false) l) (map (reach_in g W true) l).
Proof.
  intros H. assert (Plain : forall s, In s l -> within (drive g x s) (reach g s)).
  { intros s Hs. rewrite forallb_forall in H. apply source_within, H, Hs. }
  destruct W as [[[j w1] w2]|] eqn:EW.
  - destruct Window as [lam [v [w [L [V [W2 M]]]]]]. exists lam.
    exists (map (fun s => match s with Of i => if Nat.eqb i j then v else drive g x s | _ => drive g x s end) l).
    exists (map (fun s => match s with Of i => if Nat.eqb i j then w else drive g x s | _ => drive g x s end) l).
    split; [exact L|]. clear H. split; [|split].
    + induction l as [|s l IH]; cbn [map]; constructor; [|apply IH; intros; apply Plain; right; assumption].
      unfold reach_in. destruct s as [i|i b|i b]; try (apply Plain; left; reflexivity).
      destruct (Nat.eqb i j); [exact V|apply Plain; left; reflexivity].
    + induction l as [|s l IH]; cbn [map]; constructor; [|apply IH; intros; apply Plain; right; assumption].
      unfold reach_in. destruct s as [i|i b|i b]; try (apply Plain; left; reflexivity).
      destruct (Nat.eqb i j); [exact W2|apply Plain; left; reflexivity].
    + clear Plain. induction l as [|s l IH]; intros N n; destruct N as [|c N]; cbn [map total]; try ring.
      rewrite IH.
      assert (X : forall a b : sequence, (forall m, drive g x s m = (1 - lam) * a m + lam * b m)%R ->
        conv c (drive g x s) n = ((1 - lam) * conv c a n + lam * conv c b n)%R).
      { intros a b Hab. rewrite (conv_ext c _ (fun m => (1 - lam) * a m + lam * b m)%R) by (intros; apply Hab).
        rewrite (conv_plus c (fun m => (1 - lam) * a m)%R), !conv_multiple. reflexivity. }
      destruct s as [i|i b|i b].
      * destruct (Nat.eqb i j) eqn:Eij.
        -- apply Nat.eqb_eq in Eij. subst i. rewrite (X v w) by (intros m; apply M). ring.
        -- rewrite (X (drive g x (Of i)) (drive g x (Of i))) by (intros; ring). ring.
      * rewrite (X (drive g x (Rounding i b)) (drive g x (Rounding i b))) by (intros; ring). ring.
      * rewrite (X (drive g x (Truncation i b)) (drive g x (Truncation i b))) by (intros; ring). ring.
  - exists 0%R. exists (map (drive g x) l). exists (map (drive g x) l). split; [lra|].
    assert (P2 : forall s2, Forall2 within (map (drive g x) l) (map (reach_in g None s2) l)).
    { intros s2. clear H. induction l as [|s l IH]; cbn [map]; constructor; [|apply IH; intros; apply Plain; right; assumption].
      apply Plain. left. reflexivity. }
    split; [apply P2|]. split; [apply P2|]. intros. ring.
Qed.
Lemma total_used r n : total (rows r) u n = total (rows r) (map (drive g x) (used r)) n.
Proof. unfold u, used. rewrite <- firstn_map. apply total_short. unfold rows. rewrite map_length. apply le_n. Qed.
Lemma most_of_spec r n : forallb known_source (used r) = true ->
  (total (rows r) u n <= IZR (fst (most_of r)))%R /\ (- total (rows r) u n <= IZR (snd (most_of r)))%R.
Proof. intros H. rewrite total_used. apply most_spec, mixed_sources, H. Qed.

(* A target's codes stay in its node's range. *)
Definition target_holds (p : plan) (t : nat) : bool :=
  match rows_of t p with
  | Some (row, R, K) =>
      let (up, down) := most_of row in
      Nat.ltb t k && (0 <? K) && forallb known_source (used row)
      && (up + R <=? K * high (nth t g blank)) && (down + R <=? - (K * low (nth t g blank)))
  | None => false
  end.
Theorem target_in_range p t : target_holds p t = true -> forall n, in_range g x t n.
Proof.
  unfold target_holds. destruct (rows_of t p) as [[[row R] K]|] eqn:Er; [|discriminate].
  destruct (most_of row) as [up down] eqn:Em. intros H.
  apply andb_prop in H. destruct H as [H H5]. apply andb_prop in H. destruct H as [H H4].
  apply andb_prop in H. destruct H as [H H3]. apply andb_prop in H. destruct H as [H1 H2].
  apply Nat.ltb_lt in H1. apply Z.ltb_lt in H2. apply Z.leb_le in H4. apply Z.leb_le in H5.
  induction n as [n IH] using lt_wf_ind.
  destruct (rows_spec t p row R K n H1 Er IH) as [e [Be He]].
  destruct (most_of_spec row n H3) as [U L]. rewrite Em in U, L. cbn [fst snd] in U, L.
  assert (A : (- IZR R <= e <= IZR R)%R).
  { pose proof (Rle_abs e). pose proof (Rle_abs (- e)). rewrite Rabs_Ropp in *. lra. }
  apply IZR_le in H4. apply IZR_le in H5. rewrite plus_IZR in H4, H5. rewrite opp_IZR in H5. rewrite mult_IZR in H4, H5.
  assert (K0 : (0 < IZR K)%R) by (apply IZR_lt; exact H2).
  unfold in_range. unfold trace in *. split; apply le_IZR; apply Rmult_le_reg_l with (IZR K); try exact K0; lra.
Qed.
End Cascades.

(* The nodes of one more section: targets by their gains, all others by intervals. *)
Definition section_holds (g : graph) (S : list source) (forms : list (option form)) (k known : nat) (W : windows)
    (targets : list (nat * plan)) : bool :=
  forallb (fun t => target_holds g S forms k known W (snd t) (fst t)) targets.
Theorem targets_in_range g x S forms k known W targets :
  ordered g = true -> closed k g = true -> every (fits_node g S forms) 0 (firstn k g) = true ->
  section_holds g S forms k known W targets = true -> window_holds g x W ->
  (forall n i, (i < known)%nat -> in_range g x i n) ->
  forall t n, In t (map fst targets) -> in_range g x t n.
Proof.
  intros G C E H Hw B t n Ht. unfold section_holds in H. rewrite forallb_forall in H.
  apply in_map_iff in Ht. destruct Ht as [p [<- Hp]].
  apply (target_in_range g x S forms k known W G C E B Hw (snd p) (fst p) (H p Hp)).
Qed.
