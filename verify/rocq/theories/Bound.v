(* The error bound: what a filter's output code differs from the exact filter, for ever and for all inputs.

   The exact filter is any sequence y of real numbers with A * y = B * x, in units of the output's last place. The code v in
   front of the last rounding has f fraction bits and D * v = N1 * u1 + N2 * u2 + ... Then z = v - 2^f y, the error so far,
   obeys A D * z = A N1 * u1 + A N2 * u2 + ... - 2^f D B * x: one more recursion, of which a peak gain is known. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Streams PeakGain Graph Ranges Linear.
Open Scope Z_scope.

Definition limited (lowest highest y : R) : R := Rmax lowest (Rmin highest y).

Lemma conv_comm a : forall b u n, conv a (conv b u) n = conv b (conv a u) n.
Proof.
  induction a as [|c a IH]; intros b u n; [symmetry; apply conv_zero|].
  rewrite (conv_ext b (conv (c :: a) u) (fun m => IZR c * u m + 1 * match m with O => 0 | S j => conv a u j end)%R).
  - rewrite (conv_plus b (fun m => IZR c * u m)%R), !conv_multiple, (conv_late_one b (conv a u)). simpl.
    destruct n as [|m]; [ring|]. rewrite IH. ring.
  - intros m _. simpl. destruct m; ring.
Qed.

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

(* The last stage adds one half and rounds down: to nearest. Then it limits the code. *)
Definition rounds (g : graph) (v out : nat) : bool :=
  let at_ i := nth i g blank in
  Nat.ltb out (length g)
  && match op (at_ out) with
     | Clamp a => match op (at_ a) with
       | Floor b => match op (at_ b) with
         | Add c d => match op (at_ c), op (at_ d) with
           | Wire w, Constant one =>
               Nat.eqb w v && (one =? 1) && (frac (at_ d) =? 1) && (frac (at_ a) =? 0) && (0 <? frac (at_ c))
           | _, _ => false end
         | _ => false end
       | _ => false end
     | _ => false
     end.

Lemma rounds_spec g x v out n : ordered g = true -> rounds g v out = true ->
  (Rabs (IZR (code g x out n)
         - limited (IZR (low (nth out g blank))) (IZR (high (nth out g blank)))
             (IZR (code g x v n) / IZR (2 ^ frac_of g v))) <= 1 / 2)%R.
Proof.
  intros G H. unfold rounds in H. apply andb_prop in H. destruct H as [L H]. apply Nat.ltb_lt in L.
  assert (Code : forall i, (i < length g)%nat -> code g x i n = compute g (run g x n) (before g x n) (x n) (nth i g blank))
    by (intros i Hi; apply (code_spec g x G i n Hi)).
  destruct (op (nth out g blank)) as [| | | | | | | | | |a| | |] eqn:Eo; try discriminate.
  assert (La : (a < out)%nat) by (apply (operands_before g G out a L); rewrite Eo; left; reflexivity).
  destruct (op (nth a g blank)) as [| | | | | | |b| | | | | |] eqn:Ea; try discriminate.
  assert (Lb : (b < a)%nat) by (apply (operands_before g G a b ltac:(lia)); rewrite Ea; left; reflexivity).
  destruct (op (nth b g blank)) as [| |c d| | | | | | | | | | |] eqn:Eb; try discriminate.
  assert (Lc : (c < b)%nat) by (apply (operands_before g G b c ltac:(lia)); rewrite Eb; left; reflexivity).
  assert (Ld : (d < b)%nat) by (apply (operands_before g G b d ltac:(lia)); rewrite Eb; right; left; reflexivity).
  destruct (op (nth c g blank)) as [| | | | | | | | | | | |w|] eqn:Ec; try discriminate.
  destruct (op (nth d g blank)) as [|one| | | | | | | | | | | |] eqn:Ed; try discriminate.
  apply andb_prop in H. destruct H as [H H5]. apply andb_prop in H. destruct H as [H H4].
  apply andb_prop in H. destruct H as [H H3]. apply andb_prop in H. destruct H as [H1 H2].
  apply Nat.eqb_eq in H1. apply Z.eqb_eq in H2. apply Z.eqb_eq in H3. apply Z.eqb_eq in H4. apply Z.ltb_lt in H5.
  subst w one.
  pose proof (points_fit g G c ltac:(lia)) as Pc. unfold points in Pc. rewrite Ec in Pc. apply Z.eqb_eq in Pc.
  pose proof (points_fit g G b ltac:(lia)) as Pb. unfold points in Pb. rewrite Eb in Pb. apply Z.eqb_eq in Pb.
  set (f := frac_of g v) in *.
  assert (Fc : frac_of g c = f) by exact Pc. assert (Fd : frac_of g d = 1) by exact H3.
  assert (Fb : frac_of g b = f) by (unfold frac_of at 1; rewrite Pb, Fc, Fd; unfold frac_of in Fc; lia).
  assert (Fp : 0 < f) by (unfold frac_of in Fc; lia).
  assert (Ca := Code a ltac:(lia)). assert (Cb := Code b ltac:(lia)). assert (Cc := Code c ltac:(lia)).
  assert (Cd := Code d ltac:(lia)). rewrite (Code out L).
  unfold compute in *. rewrite Eo. rewrite Ea in Ca. rewrite Eb in Cb. rewrite Ec in Cc. rewrite Ed in Cd.
  change (nth a (run g x n) 0) with (code g x a n). change (nth b (run g x n) 0) with (code g x b n) in Ca.
  change (nth c (run g x n) 0) with (code g x c n) in Cb. change (nth d (run g x n) 0) with (code g x d n) in Cb.
  change (nth v (run g x n) 0) with (code g x v n) in Cc.
  rewrite H4, Fb, Z.sub_0_r in Ca. change (frac (nth b g blank)) with (frac_of g b) in Cb.
  rewrite Fb, Fc, Fd, Z.sub_diag, Cc, Cd in Cb. change (2 ^ 0) with 1 in Cb.
  set (q := 2 ^ (f - 1)) in *. assert (Q : 2 ^ f = 2 * q) by (unfold q; rewrite <- Z.pow_succ_r by lia; f_equal; lia).
  assert (Qp : 0 < q) by (apply Z.pow_pos_nonneg; lia).
  rewrite Q in *. set (t := code g x v n) in *.
  assert (E : code g x b n = t + q) by lia. rewrite E in Ca.
  pose proof (Z.div_mod (t + q) (2 * q) ltac:(lia)) as M. pose proof (Z.mod_pos_bound (t + q) (2 * q) ltac:(lia)) as B.
  rewrite <- Ca in M. set (r := code g x a n) in *. set (e := (t + q) mod (2 * q)) in *.
  assert (Hr : (Rabs (IZR r - IZR t / IZR (2 * q)) <= 1 / 2)%R).
  { assert (X : (IZR t = IZR (2 * q) * IZR r + (IZR e - IZR q))%R) by (rewrite <- mult_IZR, <- minus_IZR, <- plus_IZR; f_equal; lia).
    assert (Y : (0 < IZR q)%R) by (apply IZR_lt; lia). assert (Z1 : (IZR (2 * q) = 2 * IZR q)%R) by (rewrite mult_IZR; ring).
    assert (B1 : (0 <= IZR e)%R) by (apply IZR_le; lia). assert (B2 : (IZR e <= 2 * IZR q)%R) by (rewrite <- Z1; apply IZR_le; lia).
    rewrite X, Z1. replace (IZR r - (2 * IZR q * IZR r + (IZR e - IZR q)) / (2 * IZR q))%R
      with ((IZR q - IZR e) / (2 * IZR q))%R by (field; lra).
    assert (V : ((IZR q - IZR e) / (2 * IZR q) * (2 * IZR q) = IZR q - IZR e)%R) by (field; lra).
    apply Rabs_le. split; apply Rmult_le_reg_r with (2 * IZR q)%R; try lra; rewrite V; lra. }
  assert (Hl : IZR (Z.max (low (nth out g blank)) (Z.min (high (nth out g blank)) r))
    = limited (IZR (low (nth out g blank))) (IZR (high (nth out g blank))) (IZR r)).
  { unfold limited. assert (Mi : forall a' b', IZR (Z.min a' b') = Rmin (IZR a') (IZR b')).
    { intros a' b'. unfold Rmin. destruct (Rle_dec (IZR a') (IZR b')) as [l|l].
      - apply le_IZR in l. f_equal. lia.
      - f_equal. assert (~ a' <= b') by (intros X; apply l, IZR_le, X). lia. }
    assert (Ma : forall a' b', IZR (Z.max a' b') = Rmax (IZR a') (IZR b')).
    { intros a' b'. unfold Rmax. destruct (Rle_dec (IZR a') (IZR b')) as [l|l].
      - apply le_IZR in l. f_equal. lia.
      - f_equal. assert (~ a' <= b') by (intros X; apply l, IZR_le, X). lia. }
    rewrite Ma, Mi. reflexivity. }
  rewrite Hl. eapply Rle_trans; [apply limited_near|exact Hr].
Qed.

(* h is a witness for A D. The error of v is at most 2^f (p / q - 1 / 2), and that of the output p / q. *)
Definition error_holds (g : graph) (sources : list source) (forms : list (option form)) (k input v out : nat)
    (A B h : list Z) (K p q : Z) : bool :=
  match nth v forms None, find (Of input) sources with
  | Some f, Some s =>
      let AD := mul A (under f) in
      let N := add_rows (map (mul A) (over f)) (place s (scale (- 2 ^ frac_of g v) (mul (under f) B))) in
      let most := 2 ^ frac_of g v * (2 * p - q) in
      let b := map (reach g) sources in
      let r := norm1 (rest AD h K) in
      rounds g v out && (0 <=? frac_of g v) && (0 <? q) && Nat.ltb v k && forallb proper sources && (r <? K)
      && range_fits r K (map (mul h) N) b (map opposite b) (2 * q) (- most) most
  | _, _ => false
  end.

Theorem error_bound (g : graph) (x : nat -> nat -> Z) sources F forms k first input v out A B h K p q :
  ordered g = true -> closed k g = true -> every (fits_node g sources F forms) 0 (firstn k g) = true ->
  forallb (known_source g first) sources = true ->
  error_holds g sources forms k input v out A B h K p q = true ->
  (forall n i, (i < first)%nat -> in_range g x i n) ->
  forall y : sequence, (forall n, conv A y n = conv B (signal g x input) n) ->
  forall n, (Rabs (IZR (code g x out n)
    - limited (IZR (low (nth out g blank))) (IZR (high (nth out g blank))) (y n)) <= IZR p / IZR q)%R.
Proof.
  intros G C E S H Known y Y n. unfold error_holds in H.
  destruct (nth v forms None) as [f|] eqn:Ef; [|discriminate].
  destruct (find (Of input) sources) as [s|] eqn:Es; [|discriminate].
  set (AD := mul A (under f)) in *.
  set (N := add_rows (map (mul A) (over f)) (place s (scale (- 2 ^ frac_of g v) (mul (under f) B)))) in *.
  set (most := 2 ^ frac_of g v * (2 * p - q)) in *.
  apply andb_prop in H. destruct H as [H H7]. apply andb_prop in H. destruct H as [H H6].
  apply andb_prop in H. destruct H as [H H5]. apply andb_prop in H. destruct H as [H H4].
  apply andb_prop in H. destruct H as [H H3]. apply andb_prop in H. destruct H as [H1 H2].
  apply Z.leb_le in H2. apply Z.ltb_lt in H3. apply Nat.ltb_lt in H4.
  set (u := map (drive g x) sources).
  set (z := fun m => (signal g x v m - IZR (2 ^ frac_of g v) * y m)%R).
  assert (Form_ : forall m, conv (under f) (signal g x v) m = total (over f) u m)
    by (intros m; apply (forms_hold g x sources F forms k G C E m v H4 f Ef)).
  assert (Input_ : nth s u (fun _ => 0%R) = signal g x input) by (apply (driven g x sources s (Of input)); exact Es).
  assert (Z1 : forall m, conv AD z m = total N u m).
  { intros m. unfold N, AD. rewrite total_add_rows, total_place, Input_, conv_scale, <- conv_total, !conv_mul, opp_IZR.
    rewrite (conv_ext A (conv (under f) z)
      (fun j => total (over f) u j + (- IZR (2 ^ frac_of g v)) * conv (under f) y j)%R).
    - rewrite (conv_plus A (total (over f) u)), conv_multiple, (conv_comm A (under f) y).
      rewrite (conv_ext (under f) (conv A y) (conv B (signal g x input))) by (intros; apply Y). reflexivity.
    - intros j _. rewrite <- Form_. unfold z.
      rewrite (conv_ext (under f) _ (fun i => signal g x v i + (- IZR (2 ^ frac_of g v)) * y i)%R) by (intros; ring).
      rewrite (conv_plus (under f) (signal g x v)), conv_multiple. reflexivity. }
  assert (R := range AD h K N (map (reach g) sources) (2 * q) (- most) most).
  unfold range_holds in R. rewrite H6, H7 in R.
  specialize (R eq_refl z u Z1).
  assert (W : Forall2 within u (map (reach g) sources)).
  { apply (sources_within g x sources); try assumption.
    intros i m Hi. rewrite forallb_forall in S. apply (known_in_range first g x i m G Known). exact (S (Of i) Hi). }
  specialize (R W n). assert (T := rounds_spec g x v out n G H1).
  set (lo := IZR (low (nth out g blank))) in *. set (hi := IZR (high (nth out g blank))) in *.
  assert (L := limited_near lo hi (IZR (code g x v n) / IZR (2 ^ frac_of g v)) (y n)).
  assert (P : (0 < IZR (2 ^ frac_of g v))%R) by (apply IZR_lt, Z.pow_pos_nonneg; lia).
  assert (Q : (0 < IZR q)%R) by (apply IZR_lt; lia).
  assert (M : (Rabs (IZR (code g x v n) / IZR (2 ^ frac_of g v) - y n) <= IZR p / IZR q - 1 / 2)%R).
  { unfold z, signal, most in R. rewrite opp_IZR, !mult_IZR, minus_IZR, mult_IZR in R.
    set (c := IZR (2 ^ frac_of g v)) in *. set (a := IZR (code g x v n)) in *.
    replace (a / c - y n)%R with ((a - c * y n) / c)%R by (field; lra).
    replace (IZR p / IZR q - 1 / 2)%R with ((c * (2 * IZR p - IZR q)) / (2 * IZR q * c))%R by (field; lra).
    set (d := (a - c * y n)%R) in *. set (m := (c * (2 * IZR p - IZR q))%R) in *.
    assert (X : (0 < 2 * IZR q * c)%R) by (apply Rmult_lt_0_compat; lra).
    replace (d / c)%R with ((2 * IZR q * d) / (2 * IZR q * c))%R by (field; lra).
    apply Rabs_le. unfold Rdiv. rewrite Ropp_mult_distr_l.
    split; (apply Rmult_le_compat_r; [left; apply Rinv_0_lt_compat; exact X|lra]). }
  replace (IZR (code g x out n) - limited lo hi (y n))%R
    with ((IZR (code g x out n) - limited lo hi (IZR (code g x v n) / IZR (2 ^ frac_of g v)))
          + (limited lo hi (IZR (code g x v n) / IZR (2 ^ frac_of g v)) - limited lo hi (y n)))%R by ring.
  eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
