(* The error bound: what a filter's output code differs from the exact filter, for ever and for all inputs.

   The code in front of the last rounding is a known response to what enters the sections and to the roundings (`Cascade`);
   the exact filter is a known response to the exact input (`Exact`). Their difference is one response to what enters, and
   the other roundings; to that come what the calibration adds, the first sample, and the last rounding. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Graph Ranges Linear Gains Cascade Exact.
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
   filter is followed with `more` bits than the graph, and the limits of its signals in units of 1 / fine. *)
Record parts_ := Parts { out : nat; last_ : nat; plan_ : plan; entry : nat; taken : nat; held_ : option nat; steady : bool;
  exact : list part; least_ : Z; fine : Z; more : Z; in_p : Z; in_q : Z }.
Definition error_holds (g : graph) (S : list source) (forms : list (option form)) (k : nat) (W : windows) (d : parts_)
    (sections : list (list Z * list Z)) (lo hi off_p off_q p q : Z) : bool :=
  match rounding_node g (out d) lo hi with
  | None => false
  | Some a =>
    match op (nth a g blank), rows_of g S forms k (length g) (last_ d) (plan_ d) with
    | Floor b, Some (row, R, K0) =>
      let K := 2 ^ more d * K0 in
      match affine g (last_ d) (held_ d) 100 b, exact_row sections (exact d) (least_ d * fine d) K with
      | Some (alpha, beta, gamma), Some (E, Re) =>
        let F := frac_of g b in
        let f := frac_of g (taken d) in
        let both := add_rows (scale_rows (2 ^ f * (2 ^ more d * alpha)) row) (place (entry d) (scale (- 2 ^ F) E)) in
        let from_first := if steady d
          then Z.abs (2 ^ f * K * match held_ d with Some _ => beta | None => 0 end - 2 ^ F * sum E) * size g (taken d) else 0 in
        let all := Z.max (most_of g S W both) (most_of g S W (scale_rows (-1) both)) + from_first
          + 2 ^ f * (2 ^ more d * Z.abs alpha) * R + 2 ^ F * 2 ^ f * (norm1 E * in_p d / in_q d + 1 + (Re / fine d + 1)) in
        let unit := 2 ^ F * 2 ^ f * K in
        let off := Z.abs (2 * off_q * gamma - 2 ^ F * off_q + 2 * 2 ^ F * off_p) in
        Nat.ltb (out d) (length g) && Nat.ltb a (length g) && Nat.ltb (last_ d) k && Nat.ltb (taken d) (length g)
        && forallb (known_source g (length g)) (used S both)
        && (frac_of g a =? 0) && (0 <=? F) && (0 <=? f) && (0 <? K) && (0 <? off_q) && (0 <? in_q d) && (0 <=? in_p d) && (0 <? q)
        && (0 <? fine d) && (0 <=? more d)
        && (steady d || match held_ d with None => true | Some _ => false end)
        && (q * (2 * (2 ^ F * off_q) * all + off * unit + 2 ^ F * off_q * unit) <=? p * (2 * (2 ^ F * off_q) * unit))
      | _, _ => false
      end
    | _, _ => false
    end
  end.

Theorem error_bound g x S forms k W d sections lo hi off_p off_q p q (c : nat -> R) (w0 : Z) (c0 : R) :
  ordered g = true -> closed k g = true -> every (fits_node g S forms) 0 (firstn k g) = true ->
  error_holds g S forms k W d sections lo hi off_p off_q p q = true ->
  (forall n i, (i < length g)%nat -> in_range g x i n) -> window_holds g x W ->
  (forall n, nth (entry d) (map (drive g x) S) (fun _ => 0%R) n = (IZR (code g x (taken d) n) - IZR w0)%R) ->
  w0 = (if steady d then code g x (taken d) 0 else 0) -> c0 = (if steady d then c O else 0%R) ->
  match held_ d with Some j => forall n, code g x j n = w0 | None => True end ->
  (forall n, (Rabs (c n - IZR (code g x (taken d) n) / IZR (2 ^ frac_of g (taken d))%Z) <= IZR (in_p d) / IZR (in_q d))%R
    /\ (Rabs (c n) <= IZR (least_ d))%R) ->
  forall y, exact_filter sections (after c0 c) y ->
  forall n, (Rabs (IZR (code g x (out d) n) - limited (IZR lo) (IZR hi) (y (Z.of_nat n) - IZR off_p / IZR off_q)) <= IZR p / IZR q)%R.
Proof.
  intros G C E H Known Wh Entry W0 C0 Held Near y Y n. unfold error_holds in H.
  destruct (rounding_node g (out d) lo hi) as [a|] eqn:Er; [|discriminate].
  destruct (op (nth a g blank)) as [| | | | | | |b| | | | | |] eqn:Ea; try discriminate.
  destruct (rows_of g S forms k (length g) (last_ d) (plan_ d)) as [[[row R] K1]|] eqn:Erow; [|discriminate].
  set (K := 2 ^ more d * K1) in *.
  destruct (affine g (last_ d) (held_ d) 100 b) as [[[alpha beta] gamma]|] eqn:Eaf; [|discriminate].
  destruct (exact_row sections (exact d) (least_ d * fine d) K) as [[Ex Re]|] eqn:Eex; [|discriminate].
  set (F := frac_of g b) in *. set (f := frac_of g (taken d)) in *.
  set (both := add_rows (scale_rows (2 ^ f * (2 ^ more d * alpha)) row) (place (entry d) (scale (- 2 ^ F) Ex))) in *.
  set (beta' := match held_ d with Some _ => beta | None => 0 end) in *.
  set (from_first := if steady d then Z.abs (2 ^ f * K * beta' - 2 ^ F * sum Ex) * size g (taken d) else 0) in *.
  set (cal := norm1 Ex * in_p d / in_q d + 1) in *.
  set (re := Re / fine d + 1) in *.
  set (m := Z.max (most_of g S W both) (most_of g S W (scale_rows (-1) both))) in *.
  set (all := m + from_first + 2 ^ f * (2 ^ more d * Z.abs alpha) * R + 2 ^ F * 2 ^ f * (cal + re)) in *.
  set (off := Z.abs (2 * off_q * gamma - 2 ^ F * off_q + 2 * 2 ^ F * off_p)) in *.
  repeat match type of H with _ && _ = true => let X := fresh "X" in apply andb_prop in H; destruct H as [H X] end.
  rename X1 into More. rename X2 into Fine. apply Z.leb_le in More. apply Z.ltb_lt in Fine.
  apply Nat.ltb_lt in H. apply Nat.ltb_lt in X14. apply Nat.ltb_lt in X13. apply Nat.ltb_lt in X12. apply Z.eqb_eq in X10.
  apply Z.leb_le in X9. apply Z.leb_le in X8. apply Z.ltb_lt in X7. apply Z.ltb_lt in X6. apply Z.ltb_lt in X5. apply Z.leb_le in X4.
  apply Z.ltb_lt in X3. apply Z.leb_le in X.
  assert (Lb : (b < a)%nat) by (apply (operands_before g G a b X14); rewrite Ea; left; reflexivity).
  set (u := map (drive g x) S) in *.
  (* The parts, all of them real numbers. *)
  destruct (rows_spec g x S forms k (length g) G C E Known (last_ d) (plan_ d) row R K1 n X13 Erow
    (fun m' _ => Known m' (last_ d) ltac:(pose proof (closed_length k g C); lia))) as [e1 [B1 H1]].
  fold u in H1. set (v := trace g x (last_ d) n) in *.
  set (mm := 2 ^ more d) in *. assert (M0 : 0 < mm) by (apply Z.pow_pos_nonneg; lia).
  assert (m0 : (0 < IZR mm)%R) by (apply IZR_lt; exact M0).
  assert (Kp : 0 < K) by assumption.
  set (wcode := fun j => IZR (code g x (taken d) j)) in *.
  set (ff := IZR (2 ^ f)) in *. set (FF := IZR (2 ^ F)).
  assert (ff0 : (0 < ff)%R) by (apply IZR_lt, Z.pow_pos_nonneg; lia). assert (FF0 : (0 < FF)%R) by (apply IZR_lt, Z.pow_pos_nonneg; lia).
  assert (K0 : (0 < IZR K)%R) by (apply IZR_lt; lia). assert (iq0 : (0 < IZR (in_q d))%R) by (apply IZR_lt; lia).
  assert (ip0 : (0 <= IZR (in_p d) / IZR (in_q d))%R)
    by (apply Rmult_le_pos; [apply IZR_le; lia|left; apply Rinv_0_lt_compat; exact iq0]).
  assert (Least : forall j, (Rabs (after c0 c j) <= IZR (least_ d))%R).
  { intros j. unfold after. destruct (j <? 0); [|apply Near]. rewrite C0. destruct (steady d); [apply Near|].
    rewrite Rabs_R0. apply Rle_trans with (Rabs (c O)); [apply Rabs_pos|apply Near]. }
  destruct (exact_row_fine sections (exact d) (least_ d) (fine d) K Ex Re (after c0 c) y Fine Eex Y Least (Z.of_nat n)) as [e2 [B2 H2]]. fold re in B2.
  set (eps := fun j => (after c0 c j - after (IZR w0 / ff) (fun i => wcode i / ff) j)%R).
  assert (Beps : forall j, (Rabs (eps j) <= IZR (in_p d) / IZR (in_q d))%R).
  { intros j. unfold eps, after. destruct (j <? 0); [|apply Near]. rewrite C0, W0. destruct (steady d); [apply Near|].
    replace (0 - 0 / ff)%R with 0%R by (field; lra). rewrite Rabs_R0. exact ip0. }
  set (e3 := taps Ex eps (Z.of_nat n)).
  assert (B3 : (Rabs e3 <= IZR cal)%R).
  { unfold e3. apply Rle_trans with (IZR (norm1 Ex) * (IZR (in_p d) / IZR (in_q d)))%R; [apply taps_bound; [exact ip0|intros; apply Beps]|].
    apply Rmult_le_reg_r with (IZR (in_q d)); [exact iq0|].
    replace (IZR (norm1 Ex) * (IZR (in_p d) / IZR (in_q d)) * IZR (in_q d))%R with (IZR (norm1 Ex * in_p d)) by (rewrite mult_IZR; field; lra).
    rewrite <- mult_IZR. apply IZR_le. unfold cal.
    pose proof (Z.div_mod (norm1 Ex * in_p d) (in_q d) ltac:(lia)). pose proof (Z.mod_pos_bound (norm1 Ex * in_p d) (in_q d) X5). lia. }
  assert (H3 : (taps Ex (after c0 c) (Z.of_nat n) = (conv Ex (fun j => wcode j - IZR w0) n + IZR (sum Ex) * IZR w0) / ff + e3)%R).
  { unfold e3.
    rewrite (taps_ext Ex (after c0 c) (fun j => 1 * after (IZR w0 / ff) (fun i => wcode i / ff) j + eps j)%R)
      by (intros; unfold eps; ring).
    rewrite (taps_plus Ex (fun j => 1 * after (IZR w0 / ff) (fun i => wcode i / ff) j)%R), taps_multiple, taps_after.
    rewrite (conv_ext Ex _ (fun j => / ff * (wcode j - IZR w0))%R) by (intros; field; lra). rewrite conv_multiple. field. lra. }
  assert (Hb : (IZR (code g x b n) = IZR alpha * v + IZR beta' * IZR w0 + IZR gamma)%R).
  { rewrite (affine_spec g x (last_ d) (held_ d) n G 100 b alpha beta gamma ltac:(lia) Eaf), !plus_IZR, !mult_IZR.
    unfold v, trace, beta', code_if. destruct (held_ d) as [j|]; [rewrite Held; reflexivity|ring]. }
  assert (Hboth : (total both u n = ff * (IZR mm * IZR alpha) * total row u n - FF * conv Ex (fun j => wcode j - IZR w0)%R n)%R).
  { unfold both. rewrite total_add_rows, total_scale_rows, total_place, conv_scale, !mult_IZR, opp_IZR.
    rewrite (conv_ext Ex (nth (entry d) u (fun _ => 0%R)) (fun j => wcode j - IZR w0)%R) by (intros; apply Entry). fold FF. fold ff. ring. }
  assert (Bboth : (Rabs (total both u n) <= IZR m)%R).
  { pose proof (most_of_spec g x S (length g) W G Known Wh both n X11) as U1.
    pose proof (most_of_spec g x S (length g) W G Known Wh (scale_rows (-1) both) n) as U2.
    rewrite used_scaled in U2. specialize (U2 X11). rewrite total_scale_rows in U2. fold u in U1, U2.
    assert (M1 : (IZR (most_of g S W both) <= IZR m)%R) by (apply IZR_le; lia).
    assert (M2 : (IZR (most_of g S W (scale_rows (-1) both)) <= IZR m)%R) by (apply IZR_le; lia).
    apply Rabs_le. lra. }
  set (e4 := ((ff * IZR K * IZR beta' - FF * IZR (sum Ex)) * IZR w0)%R).
  assert (B4 : (Rabs e4 <= IZR from_first)%R).
  { unfold e4, from_first. rewrite W0. destruct (steady d) eqn:Es.
    - rewrite mult_IZR, Rabs_mult, abs_IZR, minus_IZR, !mult_IZR. apply Rmult_le_compat_l; [apply Rabs_pos|].
      pose proof (size_spec g x (taken d) 0) as Sz. apply Sz, Known, X12.
    - rewrite Rmult_0_r, Rabs_R0. lra. }
  set (s := (IZR (code g x b n) / FF)%R).
  assert (Main : (FF * ff * IZR K * (s - IZR gamma / FF - y (Z.of_nat n))
      = total both u n + e4 + ff * (IZR mm * IZR alpha) * e1 - FF * ff * (e3 + e2))%R).
  { unfold s. rewrite Hb. unfold e4. rewrite Hboth.
    replace (FF * ff * IZR K * ((IZR alpha * v + IZR beta' * IZR w0 + IZR gamma) / FF - IZR gamma / FF - y (Z.of_nat n)))%R
      with (ff * IZR alpha * (IZR K * v) + ff * IZR K * IZR beta' * IZR w0 - FF * ff * (IZR K * y (Z.of_nat n)))%R by (field; lra).
    assert (Hv : (IZR K * v = IZR mm * (total row u n + e1))%R) by (rewrite <- H1; unfold K; rewrite mult_IZR; ring).
    rewrite Hv, H2, H3. field. lra. }
  assert (R0 : (0 <= IZR R)%R) by (apply Rle_trans with (Rabs e1); [apply Rabs_pos|exact B1]).
  assert (Size : (Rabs (FF * ff * IZR K * (s - IZR gamma / FF - y (Z.of_nat n))) <= IZR all)%R).
  { rewrite Main. unfold all. rewrite !plus_IZR, !mult_IZR, !plus_IZR, abs_IZR. fold ff. fold FF.
    assert (A1 : (Rabs (ff * (IZR mm * IZR alpha) * e1) <= ff * (IZR mm * Rabs (IZR alpha)) * IZR R)%R).
    { rewrite !Rabs_mult, (Rabs_pos_eq ff), (Rabs_pos_eq (IZR mm)) by lra. apply Rmult_le_compat_l; [|exact B1].
      apply Rmult_le_pos; [lra|apply Rmult_le_pos; [lra|apply Rabs_pos]]. }
    assert (A2 : (Rabs (FF * ff * (e3 + e2)) <= FF * ff * (IZR cal + IZR re))%R).
    { assert (Pos : (0 < FF * ff)%R) by (apply Rmult_lt_0_compat; assumption).
      rewrite Rabs_mult, (Rabs_pos_eq (FF * ff)) by lra. apply Rmult_le_compat_l; [lra|]. eapply Rle_trans; [apply Rabs_triang|lra]. }
    unfold Rminus. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp. apply Rplus_le_compat; [|exact A2].
    eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|exact A1].
    eapply Rle_trans; [apply Rabs_triang|]. lra. }
  set (unit := 2 ^ F * 2 ^ f * K) in *.
  assert (Unit : IZR unit = (FF * ff * IZR K)%R) by (unfold unit; rewrite !mult_IZR; reflexivity).
  assert (Unit0 : (0 < IZR unit)%R) by (rewrite Unit; repeat apply Rmult_lt_0_compat; assumption).
  assert (oq0 : (0 < IZR off_q)%R) by (apply IZR_lt; lia). assert (q0 : (0 < IZR q)%R) by (apply IZR_lt; lia).
  assert (T1 : (Rabs (s - IZR gamma / FF - y (Z.of_nat n)) <= IZR all / IZR unit)%R).
  { apply Rmult_le_reg_l with (IZR unit); [exact Unit0|]. rewrite <- (Rabs_pos_eq (IZR unit)) at 1 by lra. rewrite <- Rabs_mult, Unit.
    replace (FF * ff * IZR K * (IZR all / (FF * ff * IZR K)))%R with (IZR all) by (field; lra). exact Size. }
  assert (T2 : (Rabs (IZR gamma / FF - 1 / 2 + IZR off_p / IZR off_q) = IZR off / (2 * (FF * IZR off_q)))%R).
  { unfold off. rewrite abs_IZR, plus_IZR, minus_IZR, !mult_IZR. fold FF.
    replace (IZR gamma / FF - 1 / 2 + IZR off_p / IZR off_q)%R
      with ((2 * IZR off_q * IZR gamma - FF * IZR off_q + 2 * FF * IZR off_p) * / (2 * (FF * IZR off_q)))%R by (field; lra).
    rewrite Rabs_mult. unfold Rdiv. f_equal. apply Rabs_pos_eq. left. apply Rinv_0_lt_compat.
    apply Rmult_lt_0_compat; [lra|apply Rmult_lt_0_compat; assumption]. }
  assert (T3 : (IZR all / IZR unit + IZR off / (2 * (FF * IZR off_q)) + 1 / 2 <= IZR p / IZR q)%R).
  { apply IZR_le in X. rewrite !mult_IZR, !plus_IZR, !mult_IZR in X. fold FF in X.
    set (o := (FF * IZR off_q)%R) in *. assert (o0 : (0 < o)%R) by (apply Rmult_lt_0_compat; assumption).
    assert (P0 : (0 < IZR q * (2 * o * IZR unit))%R) by (apply Rmult_lt_0_compat; [exact q0|apply Rmult_lt_0_compat; lra]).
    apply Rmult_le_reg_r with (IZR q * (2 * o * IZR unit))%R; [exact P0|].
    replace ((IZR all / IZR unit + IZR off / (2 * o) + 1 / 2) * (IZR q * (2 * o * IZR unit)))%R
      with (IZR q * (2 * o * IZR all + IZR off * IZR unit + o * IZR unit))%R by (field; lra).
    replace (IZR p / IZR q * (IZR q * (2 * o * IZR unit)))%R with (IZR p * (2 * o * IZR unit))%R by (field; lra). exact X. }
  (* The last rounding. *)
  assert (Ca : code g x a n = code g x b n / 2 ^ F).
  { rewrite (code_spec g x G a n X14). unfold compute. rewrite Ea. change (frac (nth a g blank)) with (frac_of g a). rewrite X10.
    fold F. rewrite Z.sub_0_r. reflexivity. }
  assert (Rounded : (Rabs (IZR (code g x a n) - (s - 1 / 2)) <= 1 / 2)%R).
  { rewrite Ca. unfold s, FF. apply floor_near. apply Z.pow_pos_nonneg; lia. }
  assert (Out : IZR (code g x (out d) n) = limited (IZR lo) (IZR hi) (IZR (code g x a n))).
  { rewrite <- limited_code. f_equal. unfold rounding_node in Er. pose proof (Known n (out d) H) as Ro. unfold in_range in Ro.
    destruct (op (nth (out d) g blank)) as [| | | | | | |o'| | |o'| | |] eqn:Eo; try discriminate.
    - destruct ((lo <=? low (nth (out d) g blank)) && (high (nth (out d) g blank) <=? hi)) eqn:Ec; [|discriminate]. injection Er as <-.
      apply andb_prop in Ec. destruct Ec as [Ec1 Ec2]. apply Z.leb_le in Ec1. apply Z.leb_le in Ec2. lia.
    - destruct ((low (nth (out d) g blank) =? lo) && (high (nth (out d) g blank) =? hi)) eqn:Ec; [|discriminate]. injection Er as <-.
      apply andb_prop in Ec. destruct Ec as [Ec1 Ec2]. apply Z.eqb_eq in Ec1. apply Z.eqb_eq in Ec2.
      rewrite (code_spec g x G (out d) n H). unfold compute. rewrite Eo, Ec1, Ec2. reflexivity. }
  rewrite Out. eapply Rle_trans; [apply limited_near|].
  replace (IZR (code g x a n) - (y (Z.of_nat n) - IZR off_p / IZR off_q))%R
    with ((IZR (code g x a n) - (s - 1 / 2)) + ((s - IZR gamma / FF - y (Z.of_nat n)) + (IZR gamma / FF - 1 / 2 + IZR off_p / IZR off_q)))%R by ring.
  eapply Rle_trans; [apply Rabs_triang|]. eapply Rle_trans; [apply Rplus_le_compat_l, Rabs_triang|]. rewrite T2. lra.
Qed.
