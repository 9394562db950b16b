(* The response of the exact filter, from finitely many integers: K y = E * x + e, for all inputs of limited size.

   As in a cascade of the graph, from the last section to the first; but the coefficients are rationals with many digits, so
   each section is replaced by a near one, and what that changes counts as residual. The outputs of the sections have no
   ranges that are known from before: a rough gain of each gives one. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Gains.
Open Scope Z_scope.

(* For a section: its response, a near numerator, a rough gain, and the limit M that follows for its output. *)
Record part := Part { main : witness; near_over : list Z; rough : witness; limit : Z }.
Fixpoint exact_row (sections : list (list Z * list Z)) (parts : list part) (least K : Z) : option (list Z * Z) :=
  match sections, parts with
  | [], [] => Some ([K], 0)
  | (B, A) :: sections', p :: parts' =>
      match exact_row sections' parts' (limit p) K with
      | Some (E, R) =>
          let w := main p in
          let (Q, r) := divide (samples w) (bits w) (tail w) E in
          let far := norm1 (drift (times w) (share w) B (near_over p)) * least
                     + norm1 (drift (times w) (share w) A (near w)) * limit p in
          if (0 <? least) && (0 <=? limit p) && (0 <=? bits w) && (0 <? share w) && gain_holds A [B] (rough p) (limit p) least
          then Some (product (near_over p) Q, R + r * limit p + (norm1 Q * far) / share w + 1)
          else None
      | None => None
      end
  | _, _ => None
  end.

Theorem exact_row_spec sections : forall parts least K E R x y, exact_row sections parts least K = Some (E, R) ->
  exact_filter sections x y -> (forall k, (Rabs (x k) <= IZR least)%R) ->
  forall k, exists e, (Rabs e <= IZR R)%R /\ (IZR K * y k = taps E x k + e)%R.
Proof.
  induction sections as [|[B A] sections IH]; intros [|p parts] least K E R x y H Ex Hx k; cbn [exact_row] in H; try discriminate.
  - injection H as <- <-. exists 0%R. rewrite Rabs_R0. split; [lra|]. rewrite (Ex k). simpl. ring.
  - destruct (exact_row sections parts (limit p) K) as [[E' R']|] eqn:Er; [|discriminate].
    set (w := main p) in *. destruct (divide (samples w) (bits w) (tail w) E') as [Q r] eqn:Eq.
    set (dB := drift (times w) (share w) B (near_over p)) in *. set (dA := drift (times w) (share w) A (near w)) in *.
    set (far := norm1 dB * least + norm1 dA * limit p) in *.
    match type of H with (if ?c then _ else _) = _ => destruct c eqn:Ec; [|discriminate] end.
    injection H as <- <-.
    apply andb_prop in Ec. destruct Ec as [Ec H5]. apply andb_prop in Ec. destruct Ec as [Ec H4].
    apply andb_prop in Ec. destruct Ec as [Ec H3]. apply andb_prop in Ec. destruct Ec as [H1 H2].
    apply Z.ltb_lt in H1. apply Z.leb_le in H2. apply Z.leb_le in H3. apply Z.ltb_lt in H4.
    destruct Ex as [m [Cm [Eqm Rest]]].
    assert (Least : (0 < IZR least)%R) by (apply IZR_lt; exact H1).
    assert (Hm : forall j, (Rabs (m j) <= IZR (limit p))%R).
    { intros j. pose proof (gain A [B] (rough p) (limit p) least H5 m [x] (IZR least) ltac:(lra) Cm) as Gm.
      replace (IZR (limit p)) with (IZR (limit p) / IZR least * IZR least)%R by (field; lra).
      apply Gm.
      - intros i. cbn [together]. rewrite Eqm. ring.
      - constructor; [exact Hx|constructor]. }
    destruct (IH parts (limit p) K E' R' m y Er Rest Hm k) as [e' [Be' He']].
    destruct (divide_spec _ _ _ _ _ _ H3 Eq) as [rr [Nr Spec]].
    assert (S0 : (0 < IZR (share w))%R) by (apply IZR_lt; exact H4).
    set (f := taps Q (fun j => taps dB x j + (-1) * taps dA m j)%R k).
    assert (Far : (Rabs f <= IZR (norm1 Q * far))%R).
    { unfold f. rewrite mult_IZR. apply taps_bound.
      - apply IZR_le. unfold far. pose proof (norm1_pos dB). pose proof (norm1_pos dA). nia.
      - intros j _. unfold far. rewrite plus_IZR, !mult_IZR. eapply Rle_trans; [apply Rabs_triang|].
        apply Rplus_le_compat; [apply taps_bound; [lra|intros; apply Hx]|].
        rewrite Rabs_mult. replace (Rabs (-1)) with 1%R by (rewrite Rabs_left; lra). rewrite Rmult_1_l.
        apply taps_bound; [apply IZR_le; exact H2|intros; apply Hm]. }
    assert (F : (taps E' m k = taps (product (near_over p) Q) x k + f / IZR (share w) - taps rr m k)%R).
    { pose proof (Spec m k) as T.
      assert (T2 : (IZR (share w) * taps Q (taps (monic (bits w) (tail w)) m) k
          = IZR (share w) * taps (product (near_over p) Q) x k + f)%R).
      { rewrite taps_product. rewrite <- !taps_multiple. unfold f. rewrite <- taps_plus. apply taps_ext.
        intros j _. fold (near w).
        pose proof (drift_spec (times w) (share w) A (near w) m j) as D1. fold dA in D1.
        pose proof (drift_spec (times w) (share w) B (near_over p) x j) as D2. fold dB in D2. rewrite Eqm in D1. lra. }
      assert (T3 : (IZR (share w) * taps E' m k = IZR (share w) * taps (product (near_over p) Q) x k + f - IZR (share w) * taps rr m k)%R)
        by (rewrite <- T2, T; ring).
      apply Rmult_eq_reg_l with (IZR (share w)); [|lra]. rewrite T3. field. lra. }
    exists (e' + f / IZR (share w) - taps rr m k)%R. split; [|rewrite He', F; ring].
    assert (B1 : (Rabs (taps rr m k) <= IZR (r * limit p))%R).
    { rewrite mult_IZR. apply Rle_trans with (IZR (norm1 rr) * IZR (limit p))%R.
      - apply taps_bound; [apply IZR_le; exact H2|intros; apply Hm].
      - apply Rmult_le_compat_r; [apply IZR_le; exact H2|apply IZR_le; exact Nr]. }
    assert (B2 : (Rabs (f / IZR (share w)) <= IZR (norm1 Q * far / share w + 1))%R).
    { unfold Rdiv. rewrite Rabs_mult, (Rabs_pos_eq (/ IZR (share w))) by (left; apply Rinv_0_lt_compat; exact S0).
      apply Rmult_le_reg_r with (IZR (share w)); [exact S0|]. rewrite Rmult_assoc, Rinv_l, Rmult_1_r by lra.
      apply Rle_trans with (1 := Far). rewrite <- mult_IZR. apply IZR_le.
      pose proof (Z.div_mod (norm1 Q * far) (share w) ltac:(lia)). pose proof (Z.mod_pos_bound (norm1 Q * far) (share w) H4). lia. }
    rewrite !plus_IZR in *. unfold Rminus. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp.
    pose proof (Rabs_triang e' (f / IZR (share w))). lra.
Qed.

(* The peak gain of the exact filter: at most p / q. *)
Lemma exact_scaled sections c : forall x y, exact_filter sections x y ->
  exact_filter sections (fun k => c * x k)%R (fun k => c * y k)%R.
Proof.
  induction sections as [|[B A] sections IH]; intros x y; cbn [exact_filter].
  - intros H k. rewrite (H k). reflexivity.
  - intros [m [[s Hs] [Eq Rest]]]. exists (fun k => c * m k)%R. split; [|split].
    + exists (c * s)%R. intros k Hk. rewrite (Hs k Hk). reflexivity.
    + intros k. rewrite !taps_multiple, Eq. reflexivity.
    + apply IH, Rest.
Qed.
Corollary exact_row_fine sections parts least U K E R x y : 0 < U -> exact_row sections parts (least * U) K = Some (E, R) ->
  exact_filter sections x y -> (forall k, (Rabs (x k) <= IZR least)%R) ->
  forall k, exists e, (Rabs e <= IZR (R / U + 1))%R /\ (IZR K * y k = taps E x k + e)%R.
Proof.
  intros HU H Ex Hx k. assert (U0 : (0 < IZR U)%R) by (apply IZR_lt; exact HU).
  destruct (exact_row_spec sections parts (least * U) K E R _ _ H (exact_scaled sections (IZR U) x y Ex)) with (k := k) as [e [Be He]].
  - intros j. rewrite Rabs_mult, (Rabs_pos_eq (IZR U)), mult_IZR by lra. rewrite Rmult_comm. apply Rmult_le_compat_r; [lra|apply Hx].
  - exists (e / IZR U)%R. split.
    + unfold Rdiv. rewrite Rabs_mult, (Rabs_pos_eq (/ IZR U)) by (left; apply Rinv_0_lt_compat; exact U0).
      apply Rmult_le_reg_r with (IZR U); [exact U0|]. rewrite Rmult_assoc, Rinv_l, Rmult_1_r by lra.
      apply Rle_trans with (1 := Be). rewrite <- mult_IZR. apply IZR_le.
      pose proof (Z.div_mod R U ltac:(lia)). pose proof (Z.mod_pos_bound R U HU). lia.
    + rewrite taps_multiple in He. apply Rmult_eq_reg_l with (IZR U); [|lra].
      replace (IZR U * (taps E x k + e / IZR U))%R with (IZR U * taps E x k + e)%R by (field; lra). rewrite <- He. ring.
Qed.

Definition filter_gain_holds (sections : list (list Z * list Z)) (parts : list part) (least K p q : Z) : bool :=
  match exact_row sections parts least K with
  | Some (E, R) => (0 <? least) && (0 <? K) && (0 <? q) && ((norm1 E * least + R) * q <=? p * (K * least))
      && close (norm1 E * least + R) (K * least) (p, q)
  | None => false
  end.
Theorem filter_gain sections parts least K p q : filter_gain_holds sections parts least K p q = true -> forall x y M, (0 <= M)%R ->
  exact_filter sections x y -> (forall k, (Rabs (x k) <= M)%R) -> forall k, (Rabs (y k) <= IZR p / IZR q * M)%R.
Proof.
  unfold filter_gain_holds. destruct (exact_row sections parts least K) as [[E R]|] eqn:Er; [|discriminate].
  intros H x y M HM Ex Hx k. apply andb_prop in H. destruct H as [H _]. apply andb_prop in H. destruct H as [H H4]. apply andb_prop in H. destruct H as [H H3].
  apply andb_prop in H. destruct H as [H1 H2]. apply Z.ltb_lt in H1. apply Z.ltb_lt in H2. apply Z.ltb_lt in H3. apply Z.leb_le in H4.
  assert (L : (0 < IZR least)%R) by (apply IZR_lt; lia). assert (K0 : (0 < IZR K)%R) by (apply IZR_lt; lia).
  assert (Q0 : (0 < IZR q)%R) by (apply IZR_lt; lia).
  assert (Any : forall c, (0 <= c)%R -> (c * M <= IZR least)%R -> (c * Rabs (y k) <= IZR p / IZR q * IZR least)%R).
  { intros c C0 C1. assert (Hc : forall j, (Rabs (c * x j) <= IZR least)%R).
    { intros j. rewrite Rabs_mult, (Rabs_pos_eq c) by exact C0. apply Rle_trans with (c * M)%R; [|exact C1].
      apply Rmult_le_compat_l; [exact C0|apply Hx]. }
    destruct (exact_row_spec sections parts least K E R _ _ Er (exact_scaled sections c x y Ex) Hc k) as [e [Be He]].
    assert (B : (Rabs (IZR K * (c * y k)) <= IZR (norm1 E) * IZR least + IZR R)%R).
    { rewrite He. eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [|exact Be].
      apply taps_bound; [lra|intros; apply Hc]. }
    rewrite !Rabs_mult, (Rabs_pos_eq (IZR K)), (Rabs_pos_eq c) in B by lra.
    apply IZR_le in H4. rewrite !mult_IZR, plus_IZR, mult_IZR in H4.
    apply Rmult_le_reg_r with (IZR K * IZR q)%R; [apply Rmult_lt_0_compat; assumption|].
    replace (IZR p / IZR q * IZR least * (IZR K * IZR q))%R with (IZR p * (IZR K * IZR least))%R by (field; lra).
    apply Rle_trans with ((IZR (norm1 E) * IZR least + IZR R) * IZR q)%R; [|exact H4].
    replace (c * Rabs (y k) * (IZR K * IZR q))%R with (IZR K * (c * Rabs (y k)) * IZR q)%R by ring.
    apply Rmult_le_compat_r; lra. }
  destruct (Rle_lt_dec M 0) as [Zero|Pos].
  - assert (M = 0%R) by lra. subst M. rewrite Rmult_0_r.
    destruct (Rle_lt_dec (Rabs (y k)) 0) as [|Y]; [assumption|]. exfalso.
    assert (P := Any (2 * (Rabs (IZR p / IZR q * IZR least) / Rabs (y k) + 1))%R).
    pose proof (Rle_abs (IZR p / IZR q * IZR least)) as A1. pose proof (Rabs_pos (IZR p / IZR q * IZR least)) as A2.
    set (z := Rabs (IZR p / IZR q * IZR least)) in *.
    assert (A3 : (0 <= z / Rabs (y k))%R) by (apply Rmult_le_pos; [exact A2|left; apply Rinv_0_lt_compat; exact Y]).
    specialize (P ltac:(lra) ltac:(lra)).
    replace (2 * (z / Rabs (y k) + 1) * Rabs (y k))%R with (2 * z + 2 * Rabs (y k))%R in P by (field; lra). lra.
  - assert (P := Any (IZR least / M)%R).
    assert (C0 : (0 <= IZR least / M)%R) by (apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; exact Pos]).
    specialize (P C0 ltac:(apply Req_le; field; lra)).
    apply Rmult_le_reg_l with (IZR least / M)%R.
    + apply Rmult_lt_0_compat; [exact L|apply Rinv_0_lt_compat; exact Pos].
    + replace (IZR least / M * (IZR p / IZR q * M))%R with (IZR p / IZR q * IZR least)%R by (field; lra). exact P.
Qed.
