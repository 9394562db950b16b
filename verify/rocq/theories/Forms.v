(* Polynomials on an interval. With X and Y the distances from its ends, as shares of its length, a polynomial is a sum of
   c_i X^i Y^(n - i); a quotient of two of them is at most the largest quotient of their coefficients. *)
Require Import ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Angles Waves.
Open Scope R_scope.

(* Polynomials in u, and with them the squares of magnitudes. *)
Fixpoint value (l : list Z) (u : R) : R := match l with [] => 0 | c :: l' => IZR c + u * value l' u end.
Lemma value_add p : forall q u, value (add p q) u = value p u + value q u.
Proof. induction p as [|x p IH]; intros [|y q] u; cbn [add value]; try ring. rewrite IH, plus_IZR. ring. Qed.
Lemma value_scale c q u : value (scale c q) u = IZR c * value q u.
Proof. induction q as [|y q IH]; cbn [scale map value]; [ring|]. fold (scale c q). rewrite IH, mult_IZR. ring. Qed.
Lemma value_mul p : forall q u, value (mul p q) u = value p u * value q u.
Proof. induction p as [|x p IH]; intros q u; cbn [mul value]; [ring|]. rewrite value_add, value_scale. cbn [value]. rewrite IH. ring. Qed.
Fixpoint trim (l : list Z) : list Z :=
  match l with [] => [] | c :: l' => match trim l' with [] => if (c =? 0)%Z then [] else [c] | t => c :: t end end.
Lemma value_trim l u : value (trim l) u = value l u.
Proof.
  induction l as [|c l IH]; cbn [trim value]; [reflexivity|]. rewrite <- IH. destruct (trim l) as [|t l'].
  - destruct (Z.eqb_spec c 0) as [->|]; cbn [value]; ring.
  - reflexivity.
Qed.

(* With cos w = 1 - 2 u: the sum of cosines, and that of sines without the factor sin w. *)
Fixpoint even_odd (l : list Z) : list Z * list Z :=
  match l with
  | [] => ([], [])
  | c :: l' => let (C, V) := even_odd l' in
      (add [c] (add (mul [1; -2] C) (mul [0; -4; 4] V)), add C (mul [1; -2] V))%Z
  end.
Definition squared (l : list Z) : list Z := let (C, V) := even_odd l in trim (add (mul C C) (mul [0; 4; -4]%Z (mul V V))).
Lemma even_odd_is w u : cos w = 1 - 2 * u -> sin w * sin w = 4 * u * (1 - u) -> forall l,
  even l w = value (fst (even_odd l)) u /\ odd l w = sin w * value (snd (even_odd l)) u.
Proof.
  intros C S. induction l as [|c l [E O]]; [cbn; lra|]. cbn [even odd even_odd]. destruct (even_odd l) as [P V]. cbn [fst snd] in *.
  rewrite !value_add, !value_mul. cbn [value]. rewrite E, O, C. split; [|ring].
  replace (sin w * (sin w * value V u)) with (sin w * sin w * value V u) by ring. rewrite S. ring.
Qed.
Lemma squared_is w u l : cos w = 1 - 2 * u -> sin w * sin w = 4 * u * (1 - u) -> square l w = value (squared l) u.
Proof.
  intros C S. destruct (even_odd_is w u C S l) as [E O]. unfold square, squared. destruct (even_odd l) as [P V]. cbn [fst snd] in *.
  rewrite value_trim, value_add, !value_mul, E, O. cbn [value].
  replace (sin w * value V u * (sin w * value V u)) with (sin w * sin w * (value V u * value V u)) by ring. rewrite S. ring.
Qed.
Definition all_squared (over : bool) (sections : list (list Z * list Z)) : list Z :=
  fold_right (fun s r => mul (squared (if over then fst s else snd s)) r) [1%Z] sections.
Lemma all_squared_is over w u sections : cos w = 1 - 2 * u -> sin w * sin w = 4 * u * (1 - u) ->
  squares over sections w = value (all_squared over sections) u.
Proof.
  intros C S. unfold squares, all_squared. induction sections as [|s l IH]; cbn [fold_right]; [cbn [value]; ring|].
  rewrite IH, value_mul, (squared_is w u _ C S). reflexivity.
Qed.
Lemma value_zeros n l u : value (repeat 0%Z n ++ l) u = u ^ n * value l u.
Proof. induction n as [|n IH]; cbn [repeat app value pow]; [ring|]. rewrite IH. ring. Qed.

(* Sums of c_i X^i Y^(n - i): the same on the halves of the interval, and their quotients. *)
Fixpoint blend (l : list Z) (X Y : R) : R := match l with [] => 0 | c :: l' => IZR c * Y ^ length l' + X * blend l' X Y end.
(* acc (m Y + X) + c X^n, and m Y + X in place of Y. *)
Fixpoint grow (m before : Z) (acc : list Z) (c : Z) : list Z :=
  match acc with [] => [before + c]%Z | a :: acc' => (m * a + before)%Z :: grow m a acc' c end.
Definition inserted (m : Z) (l : list Z) : list Z := fold_left (grow m 0) l [].
Lemma grow_length m acc : forall b c, length (grow m b acc c) = S (length acc).
Proof. induction acc as [|a acc IH]; intros b c; cbn [grow length]; [reflexivity|]. rewrite IH. reflexivity. Qed.
Lemma grow_is m X Y acc : forall b c,
  blend (grow m b acc c) X Y = IZR b * Y ^ length acc + (IZR m * Y + X) * blend acc X Y + IZR c * X ^ length acc.
Proof.
  induction acc as [|a acc IH]; intros b c; cbn [grow blend length pow]; [rewrite plus_IZR; ring|].
  rewrite IH, grow_length, plus_IZR, mult_IZR. cbn [pow]. ring.
Qed.
Lemma inserted_from m X Y l : forall acc, blend (fold_left (grow m 0) l acc) X Y
  = (IZR m * Y + X) ^ length l * blend acc X Y + X ^ length acc * blend l X (IZR m * Y + X).
Proof.
  induction l as [|c l IH]; intros acc; cbn [fold_left blend length pow]; [ring|].
  rewrite IH, grow_is, grow_length. cbn [pow]. ring.
Qed.
Lemma inserted_is m l X Y : blend (inserted m l) X Y = blend l X (IZR m * Y + X).
Proof. unfold inserted. rewrite inserted_from. cbn [blend length pow]. ring. Qed.
Lemma inserted_length m l : length (inserted m l) = length l.
Proof.
  unfold inserted. assert (H : forall acc, length (fold_left (grow m 0) l acc) = (length l + length acc)%nat).
  { induction l as [|c l IH]; intros acc; cbn [fold_left length]; [reflexivity|]. rewrite IH, grow_length. lia. }
  rewrite H. cbn [length]. lia.
Qed.
Lemma blend_app a b X Y : blend (a ++ b) X Y = blend a X Y * Y ^ length b + X ^ length a * blend b X Y.
Proof. induction a as [|c a IH]; cbn [app blend length pow]; [ring|]. rewrite IH, app_length, pow_add. ring. Qed.
Lemma blend_rev l X Y : blend (rev l) X Y = blend l Y X.
Proof. induction l as [|c l IH]; [reflexivity|]. cbn [rev]. rewrite blend_app, IH, rev_length. cbn [blend length pow]. ring. Qed.
Lemma blend_scaled l c X Y : c * blend l (c * X) (c * Y) = c ^ length l * blend l X Y.
Proof.
  induction l as [|a l IH]; cbn [blend length pow]; [ring|].
  rewrite Rpow_mult_distr. transitivity (c * (c ^ length l * (IZR a * Y ^ length l) + X * (c * blend l (c * X) (c * Y)))); [ring|]. rewrite IH. ring.
Qed.
Lemma blend_halves l X Y : l <> [] -> blend l (2 * X) (2 * Y) = 2 ^ (length l - 1) * blend l X Y.
Proof.
  intros N. pose proof (blend_scaled l 2 X Y) as H. destruct l as [|a l]; [congruence|]. cbn [length pow] in *.
  rewrite Nat.sub_succ, Nat.sub_0_r. lra.
Qed.

Definition first_half (l : list Z) : list Z := inserted 2 l.
Definition second_half (l : list Z) : list Z := rev (inserted 2 (rev l)).
Lemma first_half_is l X Y : l <> [] -> X + Y = 1 -> blend (first_half l) X Y = 2 ^ (length l - 1) * blend l (X / 2) (1 - X / 2).
Proof.
  intros N E. unfold first_half. rewrite inserted_is, <- (blend_halves l _ _ N). f_equal; lra.
Qed.
Lemma second_half_is l X Y : l <> [] -> X + Y = 1 -> blend (second_half l) X Y = 2 ^ (length l - 1) * blend l (1 / 2 + X / 2) (1 / 2 - X / 2).
Proof.
  intros N E. unfold second_half. rewrite blend_rev, inserted_is, blend_rev, <- (blend_halves l _ _ N). f_equal; lra.
Qed.

(* Rounded, after division by 2^s. *)
Definition rounded_down (s : Z) (l : list Z) : list Z := map (fun c => Z.shiftr c s) l.
Definition rounded_up (s : Z) (l : list Z) : list Z := map (fun c => - Z.shiftr (- c) s)%Z l.
Lemma power_pos_Z s : (0 <= s)%Z -> (0 < 2 ^ s)%Z.
Proof. intros. apply Z.pow_pos_nonneg; lia. Qed.
Lemma down_is s l X Y : (0 <= s)%Z -> 0 <= X -> 0 <= Y -> IZR (2 ^ s) * blend (rounded_down s l) X Y <= blend l X Y.
Proof.
  intros S HX HY. induction l as [|c l IH]; cbn [rounded_down map blend]; [lra|]. fold (rounded_down s l).
  unfold rounded_down at 1. rewrite map_length. fold (rounded_down s l). rewrite Z.shiftr_div_pow2 by exact S.
  assert (P : 0 <= Y ^ length l) by (apply pow_le, HY).
  pose proof (Z.mul_div_le c (2 ^ s) (power_pos_Z s S)) as D. apply IZR_le in D. rewrite mult_IZR in D.
  apply Rle_trans with (IZR (2 ^ s) * IZR (c / 2 ^ s) * Y ^ length l + X * (IZR (2 ^ s) * blend (rounded_down s l) X Y)); [apply Req_le; ring|].
  apply Rplus_le_compat; [apply Rmult_le_compat_r; assumption|apply Rmult_le_compat_l; assumption].
Qed.
Lemma up_is s l X Y : (0 <= s)%Z -> 0 <= X -> 0 <= Y -> blend l X Y <= IZR (2 ^ s) * blend (rounded_up s l) X Y.
Proof.
  intros S HX HY. induction l as [|c l IH]; cbn [rounded_up map blend]; [lra|]. fold (rounded_up s l).
  unfold rounded_up at 1. rewrite map_length. fold (rounded_up s l). rewrite Z.shiftr_div_pow2 by exact S.
  assert (P : 0 <= Y ^ length l) by (apply pow_le, HY).
  assert (D : (c <= 2 ^ s * - (- c / 2 ^ s))%Z) by (pose proof (Z.mul_div_le (- c) (2 ^ s) (power_pos_Z s S)); lia). apply IZR_le in D. rewrite mult_IZR in D.
  apply Rle_trans with (IZR (2 ^ s) * IZR (- (- c / 2 ^ s)) * Y ^ length l + X * (IZR (2 ^ s) * blend (rounded_up s l) X Y)); [|apply Req_le; ring].
  apply Rplus_le_compat; [apply Rmult_le_compat_r; assumption|apply Rmult_le_compat_l; assumption].
Qed.

(* The largest quotient of coefficients, times 2^160, of 32 bits of each denominator; None if one is not positive. *)
Definition scale_bits : Z := 160.
Definition quotient_above (p q : Z) : option Z :=
  if (0 <? q)%Z then
    let s := Z.max 0 (Z.log2 q - 31) in let q' := Z.shiftr q s in
    if (0 <? q')%Z then Some (Z.max 0 ((Z.shiftr p s + 1) * 2 ^ scale_bits / q' + 1)) else None
  else None.
Fixpoint quotients_above (P Q : list Z) : option Z :=
  match P, Q with
  | [p], [q] => quotient_above p q
  | p :: P', q :: Q' => match quotient_above p q, quotients_above P' Q' with Some a, Some b => Some (Z.max a b) | _, _ => None end
  | _, _ => None
  end.
Lemma quotient_above_is p q M : quotient_above p q = Some M -> 0 < IZR q /\ 0 <= IZR M /\ IZR (2 ^ scale_bits) * IZR p <= IZR M * IZR q.
Proof.
  unfold quotient_above. destruct (Z.ltb_spec 0 q) as [Q|]; [|discriminate]. set (s := Z.max 0 (Z.log2 q - 31)). assert (S : (0 <= s)%Z) by lia.
  destruct (Z.ltb_spec 0 (Z.shiftr q s)) as [Q'|]; [|discriminate]. intros E. apply (f_equal (fun o => match o with Some z => z | None => 0%Z end)) in E. cbv beta iota in E. rewrite !Z.shiftr_div_pow2 in * by exact S.
  set (t := (2 ^ scale_bits)%Z) in *. assert (T : (0 < t)%Z) by reflexivity. pose proof (power_pos_Z s S) as B. set (b := (2 ^ s)%Z) in *.
  pose proof (Z.div_mod p b ltac:(lia)) as D1. pose proof (Z.mod_pos_bound p b B) as D2.
  pose proof (Z.mul_div_le q b B) as D3. set (q' := (q / b)%Z) in *. set (p' := (p / b + 1)%Z) in *.
  pose proof (Z.div_mod (p' * t) q' ltac:(lia)) as D4. pose proof (Z.mod_pos_bound (p' * t) q' Q') as D5. set (v := (p' * t / q')%Z) in *.
  split; [apply IZR_lt, Q|]. split; [apply IZR_le; lia|]. rewrite <- !mult_IZR. apply IZR_le.
  assert (L1 : (p <= p' * b)%Z) by (unfold p'; lia). assert (L2 : (p' * t <= M * q')%Z).
  { assert (V : (q' * (v + 1) <= q' * M)%Z) by (apply Z.mul_le_mono_nonneg_l; lia). lia. }
  assert (M0 : (0 <= M)%Z) by lia.
  assert (L3 : (M * (b * q') <= M * q)%Z) by (apply Z.mul_le_mono_nonneg_l; assumption).
  assert (L4 : (t * p <= t * (p' * b))%Z) by (apply Z.mul_le_mono_nonneg_l; lia).
  assert (L5 : (b * (p' * t) <= b * (M * q'))%Z) by (apply Z.mul_le_mono_nonneg_l; lia). lia.
Qed.
Lemma quotients_above_is P : forall Q M, quotients_above P Q = Some M -> length P = length Q /\ 0 <= IZR M
  /\ forall X Y, 0 <= X -> 0 <= Y -> 0 < X + Y -> IZR (2 ^ scale_bits) * blend P X Y <= IZR M * blend Q X Y /\ 0 < blend Q X Y.
Proof.
  induction P as [|p P IH]; intros Q M H; [discriminate|]. destruct Q as [|q Q]; [destruct P; discriminate|].
  assert (C : (P = [] /\ Q = [] /\ quotient_above p q = Some M)
    \/ exists a b, quotient_above p q = Some a /\ quotients_above P Q = Some b /\ M = Z.max a b).
  { assert (D : (P = [] /\ Q = []) \/ quotients_above (p :: P) (q :: Q)
      = match quotient_above p q, quotients_above P Q with Some a, Some b => Some (Z.max a b) | _, _ => None end)
      by (destruct P; destruct Q; [left; auto|right; reflexivity..]).
    destruct D as [[-> ->]|D]; [left; auto|]. rewrite D in H. right.
    destruct (quotient_above p q) as [a|]; [|discriminate]. destruct (quotients_above P Q) as [b|]; [|discriminate].
    exists a, b. split; [reflexivity|]. split; [reflexivity|]. congruence. }
  destruct C as [[-> [-> H1]]|[a [b [H1 [H2 ->]]]]].
  - destruct (quotient_above_is _ _ _ H1) as [A [B C]]. split; [reflexivity|]. split; [exact B|]. intros X Y _ _ _. cbn [blend length pow]. lra.
  - destruct (quotient_above_is _ _ _ H1) as [A [B C]]. destruct (IH _ _ H2) as [L [D F]]. split; [cbn [length]; lia|].
    assert (MA : IZR a <= IZR (Z.max a b)) by (apply IZR_le; lia). assert (MB : IZR b <= IZR (Z.max a b)) by (apply IZR_le; lia).
    split; [lra|]. intros X Y HX HY S. cbn [blend]. rewrite L.
    assert (P1 : 0 <= Y ^ length Q) by (apply pow_le, HY).
    assert (Z0 : IZR (2 ^ scale_bits) * (IZR p * Y ^ length Q) <= IZR (Z.max a b) * (IZR q * Y ^ length Q)).
    { rewrite <- !Rmult_assoc. apply Rmult_le_compat_r; [exact P1|].
      apply Rle_trans with (1 := C). apply Rmult_le_compat_r; lra. }
    destruct (F X Y HX HY S) as [F1 F2].
    assert (Z1 : IZR (2 ^ scale_bits) * (X * blend P X Y) <= IZR (Z.max a b) * (X * blend Q X Y)).
    { assert (P2 : 0 <= X * blend Q X Y) by (apply Rmult_le_pos; lra).
      apply Rle_trans with (X * (IZR b * blend Q X Y));
        [|replace (X * (IZR b * blend Q X Y)) with (IZR b * (X * blend Q X Y)) by ring; apply Rmult_le_compat_r; lra].
      replace (IZR (2 ^ scale_bits) * (X * blend P X Y)) with (X * (IZR (2 ^ scale_bits) * blend P X Y)) by ring. apply Rmult_le_compat_l; assumption. }
    split; [lra|]. destruct (Req_dec X 0) as [->|N].
    + rewrite Rmult_0_l, Rplus_0_r. apply Rmult_lt_0_compat; [exact A|]. apply pow_lt. lra.
    + assert (0 < X * blend Q X Y) by (apply Rmult_lt_0_compat; lra). assert (0 <= IZR q * Y ^ length Q) by (apply Rmult_le_pos; lra). lra.
Qed.
