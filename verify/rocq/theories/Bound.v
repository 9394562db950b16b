(* The error bound: what a filter's output code differs from the exact filter, for ever and for all inputs.

   The code in front of the last rounding is a known response to what enters the sections and to the roundings (`Cascade`);
   the exact filter is a known response to the exact input (`Exact`). Their difference is one response to what enters, and
   the other roundings; to that come what the calibration adds, the first sample, and the last rounding. Behind the samples
   that are flagged as settling the same holds whatever was before, but for the tails of the responses. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Graph Ranges Linear Rows Gains Cascade Settling Exact.
Open Scope Z_scope.

Lemma min_near h a b : (Rabs (Rmin h a - Rmin h b) <= Rabs (a - b))%R.
Proof.
  pose proof (Rle_abs (a - b)). pose proof (Rle_abs (- (a - b))). rewrite Rabs_Ropp in *.
  apply Rabs_le. unfold Rmin. destruct (Rle_dec h a), (Rle_dec h b); lra.
Qed.
Lemma max_near l a b : (Rabs (Rmax l a - Rmax l b) <= Rabs (a - b))%R.
Proof.
  pose proof (Rle_abs (a - b)). pose proof (Rle_abs (- (a - b))). rewrite Rabs_Ropp in *.
  apply Rabs_le. unfold Rmax. destruct (Rle_dec l a), (Rle_dec l b); lra.
Qed.
Lemma limited_near lo hi a b : (Rabs (limited lo hi a - limited lo hi b) <= Rabs (a - b))%R.
Proof. eapply Rle_trans; [apply max_near|apply min_near]. Qed.
Lemma limited_code lo hi r : IZR (Z.max lo (Z.min hi r)) = limited (IZR lo) (IZR hi) (IZR r).
Proof.
  unfold limited. assert (Mi : forall a' b', IZR (Z.min a' b') = Rmin (IZR a') (IZR b')).
  { intros a' b'. unfold Rmin. destruct (Rle_dec (IZR a') (IZR b')) as [l|l].
    - apply le_IZR in l. f_equal. lia.
    - f_equal. assert (~ a' <= b') by (intros X; apply l, IZR_le, X). lia. }
  assert (Ma : forall a' b', IZR (Z.max a' b') = Rmax (IZR a') (IZR b')).
  { intros a' b'. unfold Rmax. destruct (Rle_dec (IZR a') (IZR b')) as [l|l].
    - apply le_IZR in l. f_equal. lia.
    - f_equal. assert (~ a' <= b') by (intros X; apply l, IZR_le, X). lia. }
  rewrite Ma, Mi. reflexivity.
Qed.
Lemma floor_near z d : 0 < d -> (Rabs (IZR (z / d) - (IZR z / IZR d - 1 / 2)) <= 1 / 2)%R.
Proof.
  intros D. pose proof (Z.div_mod z d ltac:(lia)) as M. pose proof (Z.mod_pos_bound z d D) as B.
  set (q := z / d) in *. set (r := z mod d) in *. assert (D0 : (0 < IZR d)%R) by (apply IZR_lt; exact D).
  assert (E : (IZR z / IZR d = IZR q + IZR r / IZR d)%R) by (rewrite M, plus_IZR, mult_IZR; field; lra).
  assert (B0 : (0 <= IZR r)%R) by (apply IZR_le; lia). assert (B1 : (IZR r <= IZR d)%R) by (apply IZR_le; lia).
  assert (V : (0 <= IZR r / IZR d <= 1)%R).
  { split; [apply Rmult_le_pos; [exact B0|left; apply Rinv_0_lt_compat; exact D0]|].
    apply Rmult_le_reg_r with (IZR d); [exact D0|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra. }
  rewrite E. apply Rabs_le. lra.
Qed.

(* In front of the last rounding: alpha v + beta h + gamma, with codes of nodes v and h. *)
Fixpoint affine (g : graph) (v : nat) (h : option nat) (fuel i : nat) : option (Z * Z * Z) :=
  match fuel with
  | O => None
  | S f =>
      if Nat.eqb i v then Some (1, 0, 0)
      else if match h with Some j => Nat.eqb i j | None => false end then Some (0, 1, 0)
      else
        let up a := 2 ^ (frac_of g i - frac_of g a) in
        let both a b s := match affine g v h f a, affine g v h f b with
          | Some (p, q, r), Some (p', q', r') =>
              Some (up a * p + up b * s * p', up a * q + up b * s * q', up a * r + up b * s * r')
          | _, _ => None end in
        match op (nth i g blank) with
        | Constant c => Some (0, 0, c)
        | Wire a | Shift a _ | Bound a => affine g v h f a
        | Scale a c _ => match affine g v h f a with Some (p, q, r) => Some (c * p, c * q, c * r) | None => None end
        | Add a b => both a b 1
        | Subtract a b => both a b (-1)
        | _ => None
        end
  end.
Definition code_if (g : graph) (x : nat -> nat -> Z) (h : option nat) (n : nat) : Z :=
  match h with Some j => code g x j n | None => 0 end.
Lemma affine_spec g x v h n : ordered g = true -> forall fuel i p q r, (i < length g)%nat -> affine g v h fuel i = Some (p, q, r) ->
  code g x i n = p * code g x v n + q * code_if g x h n + r.
Proof.
  intros G. induction fuel as [|f IH]; intros i p q r Hi; cbn [affine]; [discriminate|].
  destruct (Nat.eqb_spec i v) as [->|Nv]; [intros X; injection X as <- <- <-; ring|].
  destruct (match h with Some j => Nat.eqb i j | None => false end) eqn:Eh.
  { destruct h as [j|]; [|discriminate]. apply Nat.eqb_eq in Eh. subst j. intros X; injection X as <- <- <-. cbn [code_if]. ring. }
  assert (O := fun a => operands_before g G i a Hi). rewrite (code_spec g x G i n Hi). unfold compute.
  change (frac (nth i g blank)) with (frac_of g i).
  destruct (op (nth i g blank)) as [|c|a b|a b| |a c bits|a s| | | | |a|a|]; try discriminate; cbn [operands] in O.
  - intros X; injection X as <- <- <-. ring.
  - destruct (affine g v h f a) as [[[p1 q1] r1]|] eqn:Ea; [|discriminate]. destruct (affine g v h f b) as [[[p2 q2] r2]|] eqn:Eb; [|discriminate].
    intros X; injection X as <- <- <-. pose proof (IH a _ _ _ ltac:(specialize (O a (or_introl eq_refl)); lia) Ea) as Ha.
    pose proof (IH b _ _ _ ltac:(specialize (O b (or_intror (or_introl eq_refl))); lia) Eb) as Hb. unfold code in Ha, Hb |- *. rewrite Ha, Hb. ring.
  - destruct (affine g v h f a) as [[[p1 q1] r1]|] eqn:Ea; [|discriminate]. destruct (affine g v h f b) as [[[p2 q2] r2]|] eqn:Eb; [|discriminate].
    intros X; injection X as <- <- <-. pose proof (IH a _ _ _ ltac:(specialize (O a (or_introl eq_refl)); lia) Ea) as Ha.
    pose proof (IH b _ _ _ ltac:(specialize (O b (or_intror (or_introl eq_refl))); lia) Eb) as Hb. unfold code in Ha, Hb |- *. rewrite Ha, Hb. ring.
  - destruct (affine g v h f a) as [[[p1 q1] r1]|] eqn:Ea; [|discriminate]. intros X; injection X as <- <- <-.
    pose proof (IH a _ _ _ ltac:(specialize (O a (or_introl eq_refl)); lia) Ea) as Ha. unfold code in Ha |- *. rewrite Ha. ring.
  - intros Ea. exact (IH a _ _ _ ltac:(specialize (O a (or_introl eq_refl)); lia) Ea).
  - intros Ea. exact (IH a _ _ _ ltac:(specialize (O a (or_introl eq_refl)); lia) Ea).
  - intros Ea. exact (IH a _ _ _ ltac:(specialize (O a (or_introl eq_refl)); lia) Ea).
Qed.

(* The node that rounds, behind which a code may be limited to lo .. hi. *)
Definition rounding_node (g : graph) (out : nat) (lo hi : Z) : option nat :=
  let v := nth out g blank in
  match op v with
  | Clamp a => if (low v =? lo) && (high v =? hi) then Some a else None
  | Floor _ => if (lo <=? low v) && (high v <=? hi) then Some out else None
  | _ => None
  end.

(* All that goes into the bound. `entry` is the place of the source that enters the sections, `taken` the node with the
   samples, and `held` that with the first sample; in_p / in_q bounds what the calibration adds at the input. The exact
   filter is followed with `more` bits than the graph, and the limits of its signals in units of 1 / fine. Of a filter that
   starts from zero, so many samples are flagged as `settling_`. *)
Record parts_ := Parts { out : nat; last_ : nat; plan_ : plan; entry : nat; taken : nat; held_ : option nat; steady : bool;
  exact : list part; least_ : Z; fine : Z; more : Z; in_p : Z; in_q : Z; settling_ : option N }.
Definition at_most_ (value unit : Z) (a : ratio) : bool := (0 <? snd a) && (value * snd a <=? fst a * unit).
Lemma at_most_spec value unit a : 0 < unit -> at_most_ value unit a = true -> (IZR value / IZR unit <= real a)%R.
Proof.
  unfold at_most_, real. intros U H. apply andb_prop in H. destruct H as [H1 H2]. apply Z.ltb_lt in H1. apply Z.leb_le in H2.
  apply IZR_le in H2. rewrite !mult_IZR in H2. assert (A : (0 < IZR unit)%R) by (apply IZR_lt; exact U).
  assert (B : (0 < IZR (snd a))%R) by (apply IZR_lt; exact H1).
  apply Rmult_le_reg_r with (IZR unit * IZR (snd a))%R; [apply Rmult_lt_0_compat; assumption|].
  replace (IZR value / IZR unit * (IZR unit * IZR (snd a)))%R with (IZR value * IZR (snd a))%R by (field; lra).
  replace (IZR (fst a) / IZR (snd a) * (IZR unit * IZR (snd a)))%R with (IZR (fst a) * IZR unit)%R by (field; lra). exact H2.
Qed.
Lemma part_small e value unit a : 0 < unit -> (Rabs (IZR unit * e) <= IZR value)%R -> at_most_ value unit a = true -> (Rabs e <= real a)%R.
Proof.
  intros U H A. apply Rle_trans with (2 := at_most_spec value unit a U A). assert (P : (0 < IZR unit)%R) by (apply IZR_lt; exact U).
  rewrite Rabs_mult, (Rabs_pos_eq (IZR unit)) in H by lra. apply Rmult_le_reg_l with (IZR unit); [exact P|].
  replace (IZR unit * (IZR value / IZR unit))%R with (IZR value) by (field; lra). exact H.
Qed.

Definition either (g : graph) (S : list source) (W : windows) (r : row) : Z :=
  let (up, down) := most_of g S W r in Z.max up down.
(* The parts as numbers, in units of 1 / (2^F steps_of f K) but for the last one, which is in units of 1 / (2 2^F off_q). *)
Record values := Values { input_ : Z; coefficients_ : Z; roundings_ : Z; start_ : Z; output_ : Z; unit_ : Z; unit_out : Z; late_ : Z }.
Definition late_of (g : graph) (S : list source) (W : windows) (d : parts_) (r : row) : Z :=
  match settling_ d with Some n => late_sum (Datatypes.S (N.to_nat n)) r (map (reach g) (used S r)) | None => 0 end.
Definition parts_of (g : graph) (S : list source) (forms : list (option form)) (k : nat) (W : windows) (d : parts_)
    (sections : list (list Z * list Z)) (lo hi off_p off_q : Z) : option values :=
  match rounding_node g (out d) lo hi with
  | None => None
  | Some a =>
    match op (nth a g blank), rows_of g S forms k (length g) (last_ d) (plan_ d) with
    | Floor b, Some (row, R, K0) =>
      let K := 2 ^ more d * K0 in
      match affine g (last_ d) (held_ d) 100 b, exact_row sections (exact d) (least_ d * fine d) K with
      | Some (alpha, beta, gamma), Some (E, Re) =>
        let F := frac_of g b in
        let f := frac_of g (taken d) in
        let both := join (times_row (steps_of f * (2 ^ more d * alpha)) row)
          (place (entry d) [([- (2 ^ F * units_of f)], E)]) in
        let entering := place (entry d) (nth (entry d) both []) in
        let others := without (entry d) both in
        let from_first := if steady d
          then Z.abs (steps_of f * K * match held_ d with Some _ => beta | None => 0 end - 2 ^ F * units_of f * sum E) * size g (taken d) else 0 in
        if Nat.ltb (out d) (length g) && Nat.ltb a (length g) && Nat.ltb (last_ d) k && Nat.ltb (taken d) (length g)
           && forallb (known_source g (length g)) (used S entering) && forallb (known_source g (length g)) (used S others)
           && (frac_of g a =? 0) && (0 <=? F) && (0 <? K) && (0 <? off_q) && (0 <? in_q d) && (0 <=? in_p d)
           && (0 <? fine d) && (0 <=? more d)
           && (steady d || match held_ d with None => true | Some _ => false end)
           && match settling_ d with None => true | Some _ => negb (steady d) && forallb (known_source g (length g)) (used S row) end
        then Some (Values (2 ^ F * steps_of f * ((norm1 E * in_p d + in_q d - 1) / in_q d))
               (either g S W entering + 2 ^ F * steps_of f * (Re / fine d + 1))
               (either g S W others + steps_of f * (2 ^ more d * Z.abs alpha) * R) from_first
               (Z.abs (2 * off_q * gamma - 2 ^ F * off_q + 2 * 2 ^ F * off_p) + 2 ^ F * off_q)
               (2 ^ F * steps_of f * K) (2 * (2 ^ F * off_q)) (steps_of f * (2 ^ more d * Z.abs alpha) * late_of g S W d row))
        else None
      | _, _ => None
      end
    | _, _ => None
    end
  end.
Definition parts_hold (v : option values) (c : budget) : bool :=
  match v with
  | Some v => at_most_ (input_ v) (unit_ v) (of_input c) && at_most_ (coefficients_ v) (unit_ v) (of_coefficients c)
      && at_most_ (roundings_ v) (unit_ v) (of_roundings c) && at_most_ (start_ v) (unit_ v) (of_start c)
      && at_most_ (output_ v) (unit_out v) (of_output c)
      && (close (input_ v) (unit_ v) (of_input c) && close (coefficients_ v) (unit_ v) (of_coefficients c)
          && close (roundings_ v) (unit_ v) (of_roundings c) && close (start_ v) (unit_ v) (of_start c)
          && close (output_ v) (unit_out v) (of_output c))
      && (2 * late_ v <=? unit_ v)
  | None => false
  end.

Lemma all_within {A} g x S (row : list A) : (forall n i, (i < length g)%nat -> in_range g x i n) -> ordered g = true ->
  forallb (known_source g (length g)) (used S row) = true -> Forall2 within (map (drive g x) (used S row)) (map (reach g) (used S row)).
Proof.
  intros K G H. rewrite forallb_forall in H. induction (used S row) as [|s l IH]; constructor.
  - apply (source_within g x (length g) G K). apply H. left. reflexivity.
  - apply IH. intros t Ht. apply H. right. exact Ht.
Qed.
Lemma most_of_shifted g x S l m n : (forall n i, (i < length g)%nat -> in_range g x i n) -> ordered g = true ->
  forallb (known_source g (length g)) (used S l) = true ->
  (total (rows l) (map (shifted m) (map (drive g x) S)) n <= IZR (fst (most_of g S None l)))%R
  /\ (- total (rows l) (map (shifted m) (map (drive g x) S)) n <= IZR (snd (most_of g S None l)))%R.
Proof.
  intros K G H. rewrite (total_short (rows l) _ (length l)) by (unfold rows; rewrite map_length; reflexivity).
  rewrite !firstn_map. fold (used S l). apply most_spec.
  assert (A : Forall2 within (map (shifted m) (map (drive g x) (used S l))) (map (reach g) (used S l)))
    by (apply within_shifted, all_within; assumption).
  assert (R0 : forall b, map (reach_in g None b) (used S l) = map (reach g) (used S l)) by (intros b; apply map_ext; intros [i|i k|i k]; reflexivity).
  rewrite !R0. exists 0%R. exists (map (shifted m) (map (drive g x) (used S l))). exists (map (shifted m) (map (drive g x) (used S l))).
  split; [lra|]. split; [exact A|]. split; [exact A|]. intros. ring.
Qed.

(* The code is that of the exact filter and five errors, limited. Of the first m samples, which the exact filter did not see,
   less than half a code is left once n are behind them. *)
Theorem error_parts g x S forms k W d sections lo hi off_p off_q bud (m : nat) (c : nat -> R) (w0 : Z) (c0 : R) :
  ordered g = true -> closed k g = true -> every (fits_node g S forms) 0 (firstn k g) = true ->
  parts_hold (parts_of g S forms k W d sections lo hi off_p off_q) bud = true ->
  (forall n i, (i < length g)%nat -> in_range g x i n) -> window_holds g x W ->
  (forall n, nth (entry d) (map (drive g x) S) (fun _ => 0%R) n = (IZR (code g x (taken d) n) - IZR w0)%R) ->
  (m = O \/ W = None) ->
  w0 = (if steady d then code g x (taken d) 0 else 0) -> c0 = (if steady d then c O else 0%R) ->
  match held_ d with Some j => forall n, code g x j n = w0 | None => True end ->
  (forall n, (Rabs (c n - IZR (code g x (taken d) (m + n)) * IZR (units_of (frac_of g (taken d))) / IZR (steps_of (frac_of g (taken d)))) <= IZR (in_p d) / IZR (in_q d))%R
    /\ (Rabs (c n) <= IZR (least_ d))%R) ->
  forall y, exact_filter sections (after c0 c) y ->
  forall n, match m, settling_ d with O, _ => True | _, Some s => (N.to_nat s <= n)%nat | _, None => False end ->
  exists e t, in_parts bud e /\ (Rabs t <= 1 / 2)%R /\ (m = O -> t = 0%R)
    /\ IZR (code g x (out d) (m + n)) = limited (IZR lo) (IZR hi) (y (Z.of_nat n) - IZR off_p / IZR off_q + e + t).
Proof.
  intros G C E H Known Wh Entry MW W0 C0 Held Near y Y n Late. unfold parts_hold, parts_of in H.
  destruct (rounding_node g (out d) lo hi) as [a|] eqn:Er; [|discriminate].
  destruct (op (nth a g blank)) as [| | | | | | |b| | | | | |] eqn:Ea; try discriminate.
  destruct (rows_of g S forms k (length g) (last_ d) (plan_ d)) as [[[row R] K1]|] eqn:Erow; [|discriminate].
  set (K := 2 ^ more d * K1) in *.
  destruct (affine g (last_ d) (held_ d) 100 b) as [[[alpha beta] gamma]|] eqn:Eaf; [|discriminate].
  destruct (exact_row sections (exact d) (least_ d * fine d) K) as [[Ex Re]|] eqn:Eex; [|discriminate].
  set (F := frac_of g b) in *. set (f := frac_of g (taken d)) in *.
  set (both := join (times_row (steps_of f * (2 ^ more d * alpha)) row) (place (entry d) [([- (2 ^ F * units_of f)], Ex)])) in *.
  set (entering := place (entry d) (nth (entry d) both [])) in *. set (others := without (entry d) both) in *.
  set (beta' := match held_ d with Some _ => beta | None => 0 end) in *.
  set (from_first := if steady d then Z.abs (steps_of f * K * beta' - 2 ^ F * units_of f * sum Ex) * size g (taken d) else 0) in *.
  set (cal := (norm1 Ex * in_p d + in_q d - 1) / in_q d) in *.
  set (re := Re / fine d + 1) in *.
  set (unit := 2 ^ F * steps_of f * K) in *.
  match type of H with match (if ?b then _ else _) with Some _ => _ | None => _ end = _ => destruct b eqn:Hc; [|discriminate] end.
  cbn [input_ coefficients_ roundings_ start_ output_ unit_ unit_out late_] in H.
  apply andb_prop in H. destruct H as [H Half]. apply Z.leb_le in Half. apply andb_prop in H. destruct H as [H _]. apply andb_prop in H. destruct H as [H P5]. apply andb_prop in H. destruct H as [H P4].
  apply andb_prop in H. destruct H as [H P3]. apply andb_prop in H. destruct H as [P1 P2].
  rename Hc into H.
  apply andb_prop in H. destruct H as [H Settles].
  repeat match type of H with _ && _ = true => let X := fresh "X" in apply andb_prop in H; destruct H as [H X] end.
  rename X0 into More. rename X1 into Fine. apply Z.leb_le in More. apply Z.ltb_lt in Fine.
  apply Nat.ltb_lt in H. apply Nat.ltb_lt in X12. apply Nat.ltb_lt in X11. apply Nat.ltb_lt in X10. apply Z.eqb_eq in X7.
  apply Z.leb_le in X6. apply Z.ltb_lt in X5. apply Z.ltb_lt in X4. apply Z.ltb_lt in X3. apply Z.leb_le in X2.
  assert (Lb : (b < a)%nat) by (apply (operands_before g G a b X12); rewrite Ea; left; reflexivity).
  set (u0 := map (drive g x) S) in *. set (u := map (shifted m) u0).
  assert (Zero : m = O -> u = u0).
  { intros M0. unfold u. rewrite M0. rewrite (map_ext (shifted 0) (fun z => z)) by reflexivity. apply map_id. }
  assert (Steady : steady d = true -> m = O).
  { intros Sd. rewrite Sd in Settles. destruct m; [reflexivity|]. destruct (settling_ d); [discriminate|contradiction]. }
  (* The parts, all of them real numbers. *)
  destruct (rows_spec g x S forms k (length g) G C E Known (last_ d) (plan_ d) row R K1 (m + n) X11 Erow
    (fun m' _ => Known m' (last_ d) ltac:(pose proof (closed_length k g C); lia))) as [e1 [B1 H0]].
  fold u0 in H0. set (v := trace g x (last_ d) (m + n)%nat) in *.
  set (late := (total (rows row) u0 (m + n) - total (rows row) u n)%R).
  assert (H1 : (IZR K1 * v = total (rows row) u n + (e1 + late))%R) by (unfold late; lra).
  assert (Now : m = O -> late = 0%R) by (intros M0; unfold late; rewrite (Zero M0), M0; simpl; ring).
  assert (Bl : (Rabs late <= IZR (late_of g S W d row))%R).
  { unfold late_of. destruct (settling_ d) as [ns|] eqn:En.
    - apply andb_prop in Settles. destruct Settles as [_ Settles]. destruct m as [|m'].
      + rewrite (Now eq_refl), Rabs_R0. apply IZR_le. clear. generalize (map (reach g) (used S row)). induction row as [|l N IH]; intros [|b r]; cbn [late_sum]; try lia.
        specialize (IH r). pose proof (norm1_pos (skipn (Datatypes.S (N.to_nat ns)) (expanded l))). assert (0 <= mag b) by (unfold mag; lia). nia.
      + unfold late, u. rewrite (total_short (rows row) u0 (length row)), (total_short (rows row) (map _ u0) (length row)) by (unfold rows; rewrite map_length; reflexivity).
        rewrite firstn_map. apply total_shifted; [|exact Late]. unfold u0, used. rewrite firstn_map. apply all_within; assumption.
    - destruct m as [|m']; [|contradiction]. rewrite (Now eq_refl), Rabs_R0. lra. }
  set (mm := 2 ^ more d) in *. assert (M0 : 0 < mm) by (apply Z.pow_pos_nonneg; lia).
  assert (m0 : (0 < IZR mm)%R) by (apply IZR_lt; exact M0).
  assert (Kp : 0 < K) by assumption.
  set (wcode := fun j => IZR (code g x (taken d) (m + j))) in *.
  set (ff := IZR (steps_of f)) in *. set (uu := IZR (units_of f)) in *. set (FF := IZR (2 ^ F)).
  assert (ff0 : (0 < ff)%R) by (apply IZR_lt, Z.pow_pos_nonneg; lia). assert (FF0 : (0 < FF)%R) by (apply IZR_lt, Z.pow_pos_nonneg; lia).
  assert (K0 : (0 < IZR K)%R) by (apply IZR_lt; lia). assert (iq0 : (0 < IZR (in_q d))%R) by (apply IZR_lt; lia).
  assert (ip0 : (0 <= IZR (in_p d) / IZR (in_q d))%R)
    by (apply Rmult_le_pos; [apply IZR_le; lia|left; apply Rinv_0_lt_compat; exact iq0]).
  assert (Least : forall j, (Rabs (after c0 c j) <= IZR (least_ d))%R).
  { intros j. unfold after. destruct (j <? 0); [|apply Near]. rewrite C0. destruct (steady d); [apply Near|].
    rewrite Rabs_R0. apply Rle_trans with (Rabs (c O)); [apply Rabs_pos|apply Near]. }
  destruct (exact_row_fine sections (exact d) (least_ d) (fine d) K Ex Re (after c0 c) y Fine Eex Y Least (Z.of_nat n)) as [e2 [B2 H2]]. fold re in B2.
  assert (Entered : forall j, nth (entry d) u (fun _ => 0%R) j = (wcode j - IZR w0)%R).
  { intros j. unfold u. change (fun _ : nat => 0%R) with (shifted m (fun _ => 0%R)). rewrite map_nth. unfold shifted. apply Entry. }
  set (eps := fun j => (after c0 c j - after (IZR w0 * uu / ff) (fun i => wcode i * uu / ff) j)%R).
  assert (Beps : forall j, (Rabs (eps j) <= IZR (in_p d) / IZR (in_q d))%R).
  { intros j. unfold eps, after. destruct (j <? 0); [|apply Near]. rewrite C0, W0. destruct (steady d); [specialize (Steady eq_refl); rewrite Steady in *; apply Near|].
    replace (0 - 0 * uu / ff)%R with 0%R by (field; lra). rewrite Rabs_R0. exact ip0. }
  set (e3 := taps Ex eps (Z.of_nat n)).
  assert (B3 : (Rabs e3 <= IZR cal)%R).
  { unfold e3. apply Rle_trans with (IZR (norm1 Ex) * (IZR (in_p d) / IZR (in_q d)))%R; [apply taps_bound; [exact ip0|intros; apply Beps]|].
    apply Rmult_le_reg_r with (IZR (in_q d)); [exact iq0|].
    replace (IZR (norm1 Ex) * (IZR (in_p d) / IZR (in_q d)) * IZR (in_q d))%R with (IZR (norm1 Ex * in_p d)) by (rewrite mult_IZR; field; lra).
    rewrite <- mult_IZR. apply IZR_le. unfold cal.
    pose proof (Z.div_mod (norm1 Ex * in_p d + in_q d - 1) (in_q d) ltac:(lia)).
    pose proof (Z.mod_pos_bound (norm1 Ex * in_p d + in_q d - 1) (in_q d) X3). lia. }
  assert (H3 : (taps Ex (after c0 c) (Z.of_nat n) = (conv Ex (fun j => wcode j - IZR w0) n + IZR (sum Ex) * IZR w0) * uu / ff + e3)%R).
  { unfold e3.
    rewrite (taps_ext Ex (after c0 c) (fun j => 1 * after (IZR w0 * uu / ff) (fun i => wcode i * uu / ff) j + eps j)%R)
      by (intros; unfold eps; ring).
    rewrite (taps_plus Ex (fun j => 1 * after (IZR w0 * uu / ff) (fun i => wcode i * uu / ff) j)%R), taps_multiple, taps_after.
    rewrite (conv_ext Ex _ (fun j => (uu / ff) * (wcode j - IZR w0))%R) by (intros; field; lra). rewrite conv_multiple. field. lra. }
  assert (Hb : (IZR (code g x b (m + n)) = IZR alpha * v + IZR beta' * IZR w0 + IZR gamma)%R).
  { rewrite (affine_spec g x (last_ d) (held_ d) (m + n) G 100 b alpha beta gamma ltac:(lia) Eaf), !plus_IZR, !mult_IZR.
    unfold v, trace, beta', code_if. destruct (held_ d) as [j|]; [rewrite Held; reflexivity|ring]. }
  assert (Hboth : (total (rows both) u n = ff * (IZR mm * IZR alpha) * total (rows row) u n - FF * uu * conv Ex (fun j => wcode j - IZR w0)%R n)%R).
  { unfold both. rewrite total_join, total_times_row, rows_place, total_place, conv_expanded_one, !mult_IZR.
    rewrite (conv_ext Ex _ (fun j => - (FF * uu) * (wcode j - IZR w0))%R); [rewrite conv_multiple; fold FF ff uu; ring|].
    intros j _. cbn [conv]. rewrite Entered, opp_IZR, mult_IZR. fold FF uu. destruct j; ring. }
  assert (Apart : total (rows both) u n = (total (rows others) u n + total (rows entering) u n)%R).
  { unfold others, entering. rewrite rows_without, rows_place, <- rows_nth, (total_without (entry d) (rows both)), total_place. ring. }
  assert (Either : forall l, forallb (known_source g (length g)) (used S l) = true -> (Rabs (total (rows l) u n) <= IZR (either g S W l))%R).
  { intros l Hl.
    assert (Most : (total (rows l) u n <= IZR (fst (most_of g S W l)))%R /\ (- total (rows l) u n <= IZR (snd (most_of g S W l)))%R).
    { destruct MW as [MZ|WN].
      - rewrite (Zero MZ). apply (most_of_spec g x S (length g) W G Known Wh). exact Hl.
      - rewrite WN. apply most_of_shifted; assumption. }
    unfold either. destruct (most_of g S W l) as [up down]. cbn [fst snd] in Most. destruct Most as [U1 U2].
    assert (M1 : (IZR up <= IZR (Z.max up down))%R) by (apply IZR_le; lia).
    assert (M2 : (IZR down <= IZR (Z.max up down))%R) by (apply IZR_le; lia).
    apply Rabs_le. lra. }
  set (e4 := ((ff * IZR K * IZR beta' - FF * uu * IZR (sum Ex)) * IZR w0)%R).
  assert (B4 : (Rabs e4 <= IZR from_first)%R).
  { unfold e4, from_first. rewrite W0. destruct (steady d) eqn:Es.
    - rewrite mult_IZR, Rabs_mult, abs_IZR, minus_IZR, !mult_IZR. apply Rmult_le_compat_l; [apply Rabs_pos|].
      pose proof (size_spec g x (taken d) 0) as Sz. apply Sz, Known, X10.
    - rewrite Rmult_0_r, Rabs_R0. lra. }
  set (s := (IZR (code g x b (m + n)) / FF)%R).
  assert (Main : (FF * ff * IZR K * (s - IZR gamma / FF - y (Z.of_nat n))
      = total (rows both) u n + e4 + ff * (IZR mm * IZR alpha) * (e1 + late) - FF * ff * (e3 + e2))%R).
  { unfold s. rewrite Hb. unfold e4. rewrite Hboth.
    replace (FF * ff * IZR K * ((IZR alpha * v + IZR beta' * IZR w0 + IZR gamma) / FF - IZR gamma / FF - y (Z.of_nat n)))%R
      with (ff * IZR alpha * (IZR K * v) + ff * IZR K * IZR beta' * IZR w0 - FF * ff * (IZR K * y (Z.of_nat n)))%R by (field; lra).
    assert (Hv : (IZR K * v = IZR mm * (total (rows row) u n + (e1 + late)))%R) by (rewrite <- H1; unfold K; rewrite mult_IZR; ring).
    rewrite Hv, H2, H3. field. lra. }
  assert (R0 : (0 <= IZR R)%R) by (apply Rle_trans with (Rabs e1); [apply Rabs_pos|exact B1]).
  assert (Unit : IZR unit = (FF * ff * IZR K)%R) by (unfold unit; rewrite !mult_IZR; reflexivity).
  assert (unit0 : 0 < unit) by (unfold unit; apply Z.mul_pos_pos; [apply Z.mul_pos_pos; apply Z.pow_pos_nonneg; lia|exact Kp]).
  assert (Unit0 : (0 < IZR unit)%R) by (apply IZR_lt; exact unit0).
  assert (oq0 : (0 < IZR off_q)%R) by (apply IZR_lt; lia). assert (Pos : (0 < FF * ff)%R) by (apply Rmult_lt_0_compat; assumption).
  set (ea := (- (FF * ff * e3) / IZR unit)%R). set (eb := ((total (rows entering) u n - FF * ff * e2) / IZR unit)%R).
  set (er := ((total (rows others) u n + ff * (IZR mm * IZR alpha) * e1) / IZR unit)%R). set (es := (e4 / IZR unit)%R).
  set (et := (ff * (IZR mm * IZR alpha) * late / IZR unit)%R).
  assert (Split : (s - IZR gamma / FF - y (Z.of_nat n) = ea + eb + er + es + et)%R).
  { apply Rmult_eq_reg_l with (IZR unit); [|lra]. rewrite Unit at 1. rewrite Main, Apart. unfold ea, eb, er, es, et. field. lra. }
  assert (Ba : (Rabs ea <= real (of_input bud))%R).
  { apply (part_small ea _ unit _ unit0) with (2 := P1). replace (IZR unit * ea)%R with (- (FF * ff * e3))%R by (unfold ea; field; lra).
    rewrite Rabs_Ropp, Rabs_mult, (Rabs_pos_eq (FF * ff)), !mult_IZR by lra. fold FF. fold ff. apply Rmult_le_compat_l; [lra|exact B3]. }
  assert (Bb : (Rabs eb <= real (of_coefficients bud))%R).
  { apply (part_small eb _ unit _ unit0) with (2 := P2).
    replace (IZR unit * eb)%R with (total (rows entering) u n - FF * ff * e2)%R by (unfold eb; field; lra).
    rewrite plus_IZR, !mult_IZR. fold FF. fold ff. unfold Rminus. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp.
    apply Rplus_le_compat; [apply Either; exact X9|]. rewrite Rabs_mult, (Rabs_pos_eq (FF * ff)) by lra. apply Rmult_le_compat_l; [lra|exact B2]. }
  assert (Br : (Rabs er <= real (of_roundings bud))%R).
  { apply (part_small er _ unit _ unit0) with (2 := P3).
    replace (IZR unit * er)%R with (total (rows others) u n + ff * (IZR mm * IZR alpha) * e1)%R by (unfold er; field; lra).
    rewrite plus_IZR, !mult_IZR, abs_IZR. fold ff. fold mm. eapply Rle_trans; [apply Rabs_triang|].
    apply Rplus_le_compat; [apply Either; exact X8|]. rewrite !Rabs_mult, (Rabs_pos_eq ff), (Rabs_pos_eq (IZR mm)) by lra.
    apply Rmult_le_compat_l; [|exact B1]. apply Rmult_le_pos; [lra|apply Rmult_le_pos; [lra|apply Rabs_pos]]. }
  assert (Bs : (Rabs es <= real (of_start bud))%R).
  { apply (part_small es _ unit _ unit0) with (2 := P4). replace (IZR unit * es)%R with e4 by (unfold es; field; lra). exact B4. }
  assert (Bt : (Rabs et <= 1 / 2)%R).
  { apply Rmult_le_reg_l with (IZR unit); [exact Unit0|]. rewrite <- (Rabs_pos_eq (IZR unit)) at 1 by lra. rewrite <- Rabs_mult.
    replace (IZR unit * et)%R with (ff * (IZR mm * IZR alpha) * late)%R by (unfold et; field; lra).
    apply IZR_le in Half. rewrite !mult_IZR, abs_IZR in Half. fold ff in Half. fold mm in Half.
    rewrite !Rabs_mult, (Rabs_pos_eq ff), (Rabs_pos_eq (IZR mm)) by lra.
    assert (A0 : (0 <= ff * (IZR mm * Rabs (IZR alpha)))%R) by (repeat apply Rmult_le_pos; try lra; apply Rabs_pos).
    pose proof (Rmult_le_compat_l _ _ _ A0 Bl). lra. }
  (* The last rounding. *)
  assert (Ca : code g x a (m + n) = code g x b (m + n) / 2 ^ F).
  { rewrite (code_spec g x G a (m + n) X12). unfold compute. rewrite Ea. change (frac (nth a g blank)) with (frac_of g a). rewrite X7.
    fold F. rewrite Z.sub_0_r. reflexivity. }
  assert (Rounded : (Rabs (IZR (code g x a (m + n)) - (s - 1 / 2)) <= 1 / 2)%R).
  { rewrite Ca. unfold s, FF. apply floor_near. apply Z.pow_pos_nonneg; lia. }
  assert (Out : IZR (code g x (out d) (m + n)) = limited (IZR lo) (IZR hi) (IZR (code g x a (m + n)))).
  { rewrite <- limited_code. f_equal. unfold rounding_node in Er. pose proof (Known (m + n)%nat (out d) H) as Ro. unfold in_range in Ro.
    destruct (op (nth (out d) g blank)) as [| | | | | | |o'| | |o'| | |] eqn:Eo; try discriminate.
    - destruct ((lo <=? low (nth (out d) g blank)) && (high (nth (out d) g blank) <=? hi)) eqn:Ec; [|discriminate]. injection Er as <-.
      apply andb_prop in Ec. destruct Ec as [Ec1 Ec2]. apply Z.leb_le in Ec1. apply Z.leb_le in Ec2. lia.
    - destruct ((low (nth (out d) g blank) =? lo) && (high (nth (out d) g blank) =? hi)) eqn:Ec; [|discriminate]. injection Er as <-.
      apply andb_prop in Ec. destruct Ec as [Ec1 Ec2]. apply Z.eqb_eq in Ec1. apply Z.eqb_eq in Ec2.
      rewrite (code_spec g x G (out d) (m + n) H). unfold compute. rewrite Eo, Ec1, Ec2. reflexivity. }
  set (shift := (IZR gamma / FF - 1 / 2 + IZR off_p / IZR off_q)%R).
  set (eo := (IZR (code g x a (m + n)) - (s - 1 / 2) + shift)%R).
  assert (Bo : (Rabs eo <= real (of_output bud))%R).
  { assert (o0 : 0 < 2 * (2 ^ F * off_q)) by (apply Z.mul_pos_pos; [lia|apply Z.mul_pos_pos; [apply Z.pow_pos_nonneg; lia|lia]]).
    apply (part_small eo _ _ _ o0) with (2 := P5). rewrite plus_IZR, abs_IZR, plus_IZR, minus_IZR, !mult_IZR. fold FF.
    set (h := (IZR (code g x a (m + n)) - (s - 1 / 2))%R) in *.
    replace (2 * (FF * IZR off_q) * eo)%R with ((2 * (FF * IZR off_q)) * h
      + (2 * IZR off_q * IZR gamma - FF * IZR off_q + 2 * FF * IZR off_p))%R by (unfold eo, shift; field; lra).
    eapply Rle_trans; [apply Rabs_triang|]. rewrite Rplus_comm. apply Rplus_le_compat_l.
    assert (W2 : (0 < FF * IZR off_q)%R) by (apply Rmult_lt_0_compat; assumption).
    rewrite Rabs_mult, (Rabs_pos_eq (2 * (FF * IZR off_q))) by lra.
    replace (FF * IZR off_q)%R with (2 * (FF * IZR off_q) * (1 / 2))%R at 2 by field. apply Rmult_le_compat_l; [lra|exact Rounded]. }
  exists (ea + eb + er + es + eo)%R, et. split; [exists ea, eb, er, es, eo; repeat split; assumption|].
  split; [exact Bt|]. split; [intros MZ; unfold et; rewrite (Now MZ); field; lra|].
  rewrite Out. f_equal. replace (y (Z.of_nat n)) with (s - IZR gamma / FF - (ea + eb + er + es + et))%R by (rewrite <- Split; ring).
  unfold eo, shift. ring.
Qed.

(* So the code is within the sum of the parts of that of the exact filter. *)
Theorem within_sum c code lo hi y e : in_parts c e -> code = limited lo hi (y + e) -> (Rabs (code - limited lo hi y) <= sum_of c)%R.
Proof.
  intros [a [b [r [s [o [-> [Ba [Bb [Br [Bs Bo]]]]]]]]]] ->. eapply Rle_trans; [apply limited_near|]. unfold sum_of.
  replace (y + (a + b + r + s + o) - y)%R with (a + b + r + s + o)%R by ring.
  eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|exact Bo].
  eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|exact Bs].
  eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|exact Br].
  eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [exact Ba|exact Bb].
Qed.
Theorem within_late c code lo hi y e t : in_parts c e -> (Rabs t <= 1 / 2)%R -> code = limited lo hi (y + e + t) ->
  (Rabs (code - limited lo hi y) <= sum_of c + 1 / 2)%R.
Proof.
  intros P T E. pose proof (within_sum c (limited lo hi (y + e)) lo hi y e P eq_refl) as A. rewrite E.
  pose proof (limited_near lo hi (y + e + t) (y + e)) as B. replace (y + e + t - (y + e))%R with t in B by ring.
  replace (limited lo hi (y + e + t) - limited lo hi y)%R
    with ((limited lo hi (y + e + t) - limited lo hi (y + e)) + (limited lo hi (y + e) - limited lo hi y))%R by ring.
  eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
