(* What a stage without memory computes: a polynomial in the codes at the inputs, within a radius.

   For each node an integer polynomial P, a number k and a radius say |code 2^k - P(a, b)| <= radius, where a and b are the
   codes at the first and the second input. They follow node by node; a rounding down adds half of what it can drop. What
   is left between two polynomials is bounded about the middle of the inputs' ranges, where it is smallest. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Graph Ranges Linear.
Open Scope Z_scope.

(* Polynomials in a with coefficients that are polynomials in b, and limits of their magnitudes for |a| <= A, |b| <= B. *)
Fixpoint ev1 (l : list Z) (b : Z) : Z := match l with [] => 0 | c :: l' => c + b * ev1 l' b end.
Fixpoint ev2 (P : list (list Z)) (a b : Z) : Z := match P with [] => 0 | l :: P' => ev1 l b + a * ev2 P' a b end.
Fixpoint mul2 (P Q : list (list Z)) : list (list Z) :=
  match P with [] => [] | l :: P' => add_rows (map (mul l) Q) ([] :: mul2 P' Q) end.
Definition size1 (l : list Z) (B : Z) : Z := ev1 (map Z.abs l) B.
Fixpoint size2 (P : list (list Z)) (A B : Z) : Z := match P with [] => 0 | l :: P' => size1 l B + A * size2 P' A B end.

Lemma ev1_add p : forall q b, ev1 (add p q) b = ev1 p b + ev1 q b.
Proof. induction p as [|x p IH]; intros [|y q] b; cbn [add ev1]; try ring. rewrite IH. ring. Qed.
Lemma ev1_scale c q b : ev1 (scale c q) b = c * ev1 q b.
Proof. induction q as [|y q IH]; cbn [scale map ev1]; [ring|]. fold (scale c q). rewrite IH. ring. Qed.
Lemma ev1_mul p : forall q b, ev1 (mul p q) b = ev1 p b * ev1 q b.
Proof. induction p as [|x p IH]; intros q b; cbn [mul ev1]; [ring|]. rewrite ev1_add, ev1_scale. cbn [ev1]. rewrite IH. ring. Qed.
Lemma ev2_add P : forall Q a b, ev2 (add_rows P Q) a b = ev2 P a b + ev2 Q a b.
Proof. induction P as [|l P IH]; intros [|m Q] a b; cbn [add_rows ev2]; try ring. rewrite ev1_add, IH. ring. Qed.
Lemma ev2_scale c P a b : ev2 (scale_rows c P) a b = c * ev2 P a b.
Proof. induction P as [|l P IH]; cbn [scale_rows map ev2]; [ring|]. fold (scale_rows c P). rewrite ev1_scale, IH. ring. Qed.
Lemma ev2_map l Q a b : ev2 (map (mul l) Q) a b = ev1 l b * ev2 Q a b.
Proof. induction Q as [|m Q IH]; cbn [map ev2]; [ring|]. rewrite ev1_mul, IH. ring. Qed.
Lemma ev2_mul P : forall Q a b, ev2 (mul2 P Q) a b = ev2 P a b * ev2 Q a b.
Proof. induction P as [|l P IH]; intros Q a b; cbn [mul2 ev2]; [ring|]. rewrite ev2_add, ev2_map. cbn [ev2 ev1]. rewrite IH. ring. Qed.

Lemma size1_pos l B : 0 <= B -> 0 <= size1 l B.
Proof. intros HB. unfold size1. induction l as [|c l IH]; cbn [map ev1]; [lia|]. nia. Qed.
Lemma size1_spec l b B : Z.abs b <= B -> Z.abs (ev1 l b) <= size1 l B.
Proof.
  intros H. induction l as [|c l IH]; cbn [ev1]; [reflexivity|]. unfold size1 in *. cbn [map ev1].
  assert (Z.abs (b * ev1 l b) <= B * ev1 (map Z.abs l) B) by (rewrite Z.abs_mul; apply Z.mul_le_mono_nonneg; lia). lia.
Qed.
Lemma size2_spec P a b A B : Z.abs a <= A -> Z.abs b <= B -> Z.abs (ev2 P a b) <= size2 P A B.
Proof.
  intros Ha Hb. induction P as [|l P IH]; cbn [ev2 size2]; [reflexivity|]. pose proof (size1_spec l b B Hb).
  assert (Z.abs (a * ev2 P a b) <= A * size2 P A B) by (rewrite Z.abs_mul; apply Z.mul_le_mono_nonneg; lia). lia.
Qed.

(* The same polynomial, times a power of two, in twice the distances from s / 2 and t / 2: those are integers. *)
Fixpoint middle1 (t : Z) (k : nat) (l : list Z) : list Z := match l, k with
  | c :: l', Datatypes.S k' => add [2 ^ Z.of_nat k * c] (mul [t; 1] (middle1 t k' l')) | _, _ => [] end.
Fixpoint middle2 (s t : Z) (n k : nat) (P : list (list Z)) : list (list Z) := match P, n with
  | l :: P', Datatypes.S n' =>
      add_rows [scale (2 ^ Z.of_nat n) (middle1 t k l)] (mul2 [[s]; [1]] (middle2 s t n' k P')) | _, _ => [] end.
Definition columns (P : list (list Z)) : nat := fold_right (fun l => Nat.max (length l)) O P.
Lemma middle1_spec t b l : forall k, (length l <= k)%nat -> ev1 (middle1 t k l) (2 * b - t) = 2 ^ Z.of_nat k * ev1 l b.
Proof.
  induction l as [|c l IH]; intros [|k] H; cbn [middle1 ev1 length] in *; try lia.
  rewrite ev1_add, ev1_mul, IH by lia. cbn [ev1]. rewrite Nat2Z.inj_succ, Z.pow_succ_r by lia. ring.
Qed.
Lemma middle2_spec s t a b k P : forall n, (length P <= n)%nat -> (columns P <= k)%nat ->
  ev2 (middle2 s t n k P) (2 * a - s) (2 * b - t) = 2 ^ Z.of_nat n * 2 ^ Z.of_nat k * ev2 P a b.
Proof.
  induction P as [|l P IH]; intros [|n] H K; cbn [middle2 ev2 length columns fold_right] in *; try lia.
  fold (columns P) in K. rewrite ev2_add, ev2_mul, IH by lia. cbn [ev2]. rewrite ev1_scale, middle1_spec by lia. cbn [ev1].
  rewrite Nat2Z.inj_succ, Z.pow_succ_r by lia. ring.
Qed.

Record enclosure := Enclosure { poly : list (list Z); up : Z; radius : Z }.
Section Enclosures.
Variables (g : graph) (ports : list (Z * Z)) (x : nat -> nat -> Z).
Hypothesis G : ordered g = true.
Hypothesis X : inputs_within ports x.

Definition ends_at (p : nat) : Z * Z := nth p ports (0, 0).
Definition largest_at (p : nat) : Z := Z.max (Z.abs (fst (ends_at p))) (Z.abs (snd (ends_at p))).
Definition middle_at (p : nat) : Z := fst (ends_at p) + snd (ends_at p).
Definition width_at (p : nat) : Z := Z.abs (snd (ends_at p) - fst (ends_at p)).
Definition at_input (p : nat) (n : nat) : Z := if Nat.ltb p (length ports) then x n p else 0.
Lemma at_input_within p n : (length ports <= p)%nat /\ ends_at p = (0, 0) /\ at_input p n = 0
  \/ fst (ends_at p) <= at_input p n <= snd (ends_at p).
Proof.
  unfold at_input, ends_at. destruct (Nat.ltb_spec p (length ports)) as [H|H].
  - right. exact (X n p H).
  - left. repeat split; [exact H|]. apply nth_overflow. exact H.
Qed.
Lemma at_input_spec p n : Z.abs (at_input p n) <= largest_at p.
Proof. unfold largest_at. destruct (at_input_within p n) as [(_ & E & A)|H]; [rewrite E, A; simpl|]; lia. Qed.
Lemma at_middle_spec p n : Z.abs (2 * at_input p n - middle_at p) <= width_at p.
Proof. unfold middle_at, width_at. destruct (at_input_within p n) as [(_ & E & A)|H]; [rewrite E, A; simpl|]; lia. Qed.

Definition bound_of (e : enclosure) : Z := size2 (poly e) (largest_at 0) (largest_at 1).
Definition encloses (e : enclosure) (c n : Z) (m : nat) : Prop :=
  0 <= up e /\ Z.abs (c * 2 ^ up e - ev2 (poly e) (at_input 0 m) (at_input 1 m)) <= radius e.
Definition enclose (known : list (option enclosure)) (v : node) : option enclosure :=
  let got a := nth a known None in
  let shift a := frac v - frac_of g a in
  let both a b s := match got a, got b with
    | Some e, Some f =>
        let k := Z.max (up e) (up f) in
        let m := 2 ^ (shift a + k - up e) in
        let n := 2 ^ (shift b + k - up f) in
        Some (Enclosure (add_rows (scale_rows m (poly e)) (scale_rows (s n) (poly f))) k (m * radius e + n * radius f))
    | _, _ => None end in
  match op v with
  | Input O => Some (Enclosure [[]; [1]] 0 0)
  | Input 1 => Some (Enclosure [[0; 1]] 0 0)
  | Constant c => Some (Enclosure [[c]] 0 0)
  | Add a b => both a b (fun z => z)
  | Subtract a b => both a b Z.opp
  | Multiply a b => match got a, got b with
    | Some e, Some f => Some (Enclosure (mul2 (poly e) (poly f)) (up e + up f)
        (bound_of e * radius f + bound_of f * radius e + radius e * radius f))
    | _, _ => None end
  | Scale a c _ => match got a with
    | Some e => Some (Enclosure (scale_rows c (poly e)) (up e) (Z.abs c * radius e)) | None => None end
  | Shift a _ | Bound a | Wire a => got a
  | Floor a => match got a with
    | Some e =>
        let d := frac_of g a - frac v in
        let most := (2 ^ d - 1) * 2 ^ up e in
        Some (Enclosure (add_rows (scale_rows 2 (poly e)) [[- most]]) (up e + d + 1) (radius e * 2 + most))
    | None => None end
  | _ => None
  end.
Fixpoint enclosures (known : list (option enclosure)) (rest : list node) : list (option enclosure) :=
  match rest with [] => known | v :: rest' => enclosures (known ++ [enclose known v]) rest' end.

Definition all_enclosed (known : list (option enclosure)) : Prop :=
  forall i e m, nth i known None = Some e -> encloses e (code g x i m) 0 m.

Hypothesis Two : (length ports <= 2)%nat.
Hypothesis Ports : every (fun _ v => has_port ports v) 0 g = true.

Lemma enclose_spec known i e m : (i < length g)%nat -> all_enclosed known ->
  enclose known (nth i g blank) = Some e -> encloses e (code g x i m) 0 m.
Proof.
  intros Hi K. assert (P := points_fit g G i Hi). assert (HP := every_spec _ g 0 i Ports Hi). simpl in HP.
  rewrite (code_spec g x G i m Hi). set (v := nth i g blank) in *.
  unfold enclose, compute, points, has_port in *.
  assert (Both : forall a b s sg e0 f0, (s = 1 \/ s = -1) -> (forall z, sg z = s * z) -> frac v = Z.max (frac_of g a) (frac_of g b) ->
    nth a known None = Some e0 -> nth b known None = Some f0 ->
    encloses (Enclosure (add_rows (scale_rows (2 ^ (frac v - frac_of g a + Z.max (up e0) (up f0) - up e0)) (poly e0))
        (scale_rows (sg (2 ^ (frac v - frac_of g b + Z.max (up e0) (up f0) - up f0))) (poly f0))) (Z.max (up e0) (up f0))
        (2 ^ (frac v - frac_of g a + Z.max (up e0) (up f0) - up e0) * radius e0
         + 2 ^ (frac v - frac_of g b + Z.max (up e0) (up f0) - up f0) * radius f0))
      (code g x a m * 2 ^ (frac v - frac_of g a) + s * (code g x b m * 2 ^ (frac v - frac_of g b))) 0 m).
  { intros a b s sg e0 f0 Hs Hsg Pf Ea Eb. destruct (K a e0 m Ea) as [U1 R1]. destruct (K b f0 m Eb) as [U2 R2].
    set (k := Z.max (up e0) (up f0)) in *. set (ta := frac v - frac_of g a) in *. set (tb := frac v - frac_of g b) in *.
    split; cbn [up poly radius]; [lia|]. rewrite Hsg, ev2_add, !ev2_scale.
    assert (A1 : 2 ^ ta * 2 ^ k = 2 ^ (ta + k - up e0) * 2 ^ up e0) by (rewrite <- !Z.pow_add_r by lia; f_equal; lia).
    assert (A2 : 2 ^ tb * 2 ^ k = 2 ^ (tb + k - up f0) * 2 ^ up f0) by (rewrite <- !Z.pow_add_r by lia; f_equal; lia).
    assert (N1 : 0 <= 2 ^ (ta + k - up e0)) by (apply Z.pow_nonneg; lia).
    assert (N2 : 0 <= 2 ^ (tb + k - up f0)) by (apply Z.pow_nonneg; lia).
    set (M := 2 ^ (ta + k - up e0)) in *. set (N := 2 ^ (tb + k - up f0)) in *.
    replace ((code g x a m * 2 ^ ta + s * (code g x b m * 2 ^ tb)) * 2 ^ k
      - (M * ev2 (poly e0) (at_input 0 m) (at_input 1 m) + s * N * ev2 (poly f0) (at_input 0 m) (at_input 1 m)))
      with (M * (code g x a m * 2 ^ up e0 - ev2 (poly e0) (at_input 0 m) (at_input 1 m))
            + s * (N * (code g x b m * 2 ^ up f0 - ev2 (poly f0) (at_input 0 m) (at_input 1 m)))).
    2:{ transitivity (code g x a m * (M * 2 ^ up e0) + s * (code g x b m * (N * 2 ^ up f0))
          - (M * ev2 (poly e0) (at_input 0 m) (at_input 1 m) + s * N * ev2 (poly f0) (at_input 0 m) (at_input 1 m))); [ring|].
        rewrite <- A1, <- A2. ring. }
    set (d1 := code g x a m * 2 ^ up e0 - ev2 (poly e0) (at_input 0 m) (at_input 1 m)) in *.
    set (d2 := code g x b m * 2 ^ up f0 - ev2 (poly f0) (at_input 0 m) (at_input 1 m)) in *.
    assert (Y1 : Z.abs (M * d1) <= M * radius e0) by (rewrite Z.abs_mul, (Z.abs_eq M) by lia; apply Z.mul_le_mono_nonneg_l; lia).
    assert (Y2 : Z.abs (N * d2) <= N * radius f0) by (rewrite Z.abs_mul, (Z.abs_eq N) by lia; apply Z.mul_le_mono_nonneg_l; lia).
    clear - Hs Y1 Y2. destruct Hs; subst s; lia. }
  assert (Opp : forall z, Z.opp z = -1 * z) by (intros; lia).
  destruct (op v) as [p|c|a b|a b|a b|a c bits|a s|a|a kept|a|a|a|a|a]; try discriminate.
  - apply Nat.ltb_lt in HP. destruct p as [|[|p]]; try discriminate; intros Q; injection Q as <-; unfold encloses; cbn [up poly radius ev2 ev1].
    + unfold at_input. replace (Nat.ltb 0 (length ports)) with true by (symmetry; apply Nat.ltb_lt; lia). change (2 ^ 0) with 1. lia.
    + unfold at_input. replace (Nat.ltb 1 (length ports)) with true by (symmetry; apply Nat.ltb_lt; lia). change (2 ^ 0) with 1. lia.
  - intros Q; injection Q as <-. unfold encloses; cbn [up poly radius ev2 ev1]. change (2 ^ 0) with 1. lia.
  - destruct (nth a known None) as [e0|] eqn:Ea; [|discriminate]. destruct (nth b known None) as [f0|] eqn:Eb; [|discriminate].
    intros Q; injection Q as <-. apply Z.eqb_eq in P. pose proof (Both a b 1 (fun z => z) e0 f0 (or_introl eq_refl) (fun z => eq_sym (Z.mul_1_l z)) P Ea Eb) as Y.
    cbv beta in Y. rewrite Z.mul_1_l in Y. exact Y.
  - destruct (nth a known None) as [e0|] eqn:Ea; [|discriminate]. destruct (nth b known None) as [f0|] eqn:Eb; [|discriminate].
    intros Q; injection Q as <-. apply Z.eqb_eq in P. pose proof (Both a b (-1) Z.opp e0 f0 (or_intror eq_refl) Opp P Ea Eb) as Y.
    unfold encloses in *. unfold code in Y. replace (nth a (run g x m) 0 * 2 ^ (frac v - frac_of g a) - nth b (run g x m) 0 * 2 ^ (frac v - frac_of g b))
      with (nth a (run g x m) 0 * 2 ^ (frac v - frac_of g a) + -1 * (nth b (run g x m) 0 * 2 ^ (frac v - frac_of g b))) by ring. exact Y.
  - destruct (nth a known None) as [e0|] eqn:Ea; [|discriminate]. destruct (nth b known None) as [f0|] eqn:Eb; [|discriminate].
    intros Q; injection Q as <-. destruct (K a e0 m Ea) as [U1 R1]. destruct (K b f0 m Eb) as [U2 R2].
    unfold encloses. cbn [up poly radius]. split; [lia|]. rewrite ev2_mul, Z.pow_add_r by lia.
    change (nth a (run g x m) 0) with (code g x a m). change (nth b (run g x m) 0) with (code g x b m).
    pose proof (size2_spec (poly e0) _ _ _ _ (at_input_spec 0 m) (at_input_spec 1 m)) as S1. fold (bound_of e0) in S1.
    pose proof (size2_spec (poly f0) _ _ _ _ (at_input_spec 0 m) (at_input_spec 1 m)) as S2. fold (bound_of f0) in S2.
    set (p := ev2 (poly e0) (at_input 0 m) (at_input 1 m)) in *. set (q := ev2 (poly f0) (at_input 0 m) (at_input 1 m)) in *.
    set (d1 := code g x a m * 2 ^ up e0 - p) in *. set (d2 := code g x b m * 2 ^ up f0 - q) in *.
    replace (code g x a m * code g x b m * (2 ^ up e0 * 2 ^ up f0) - p * q) with (p * d2 + q * d1 + d1 * d2) by (unfold d1, d2; ring).
    assert (Z.abs (p * d2) <= bound_of e0 * radius f0) by (rewrite Z.abs_mul; apply Z.mul_le_mono_nonneg; lia).
    assert (Z.abs (q * d1) <= bound_of f0 * radius e0) by (rewrite Z.abs_mul; apply Z.mul_le_mono_nonneg; lia).
    assert (Z.abs (d1 * d2) <= radius e0 * radius f0) by (rewrite Z.abs_mul; apply Z.mul_le_mono_nonneg; lia). lia.
  - destruct (nth a known None) as [e0|] eqn:Ea; [|discriminate]. intros Q; injection Q as <-. destruct (K a e0 m Ea) as [U1 R1].
    unfold encloses. cbn [up poly radius]. split; [lia|]. rewrite ev2_scale. change (nth a (run g x m) 0) with (code g x a m).
    replace (code g x a m * c * 2 ^ up e0 - c * ev2 (poly e0) (at_input 0 m) (at_input 1 m))
      with (c * (code g x a m * 2 ^ up e0 - ev2 (poly e0) (at_input 0 m) (at_input 1 m))) by ring.
    rewrite Z.abs_mul. apply Z.mul_le_mono_nonneg_l; lia.
  - intros Ea. exact (K a e m Ea).
  - destruct (nth a known None) as [e0|] eqn:Ea; [|discriminate]. intros Q; injection Q as <-. destruct (K a e0 m Ea) as [U1 R1].
    apply Z.ltb_lt in P. set (d := frac_of g a - frac v) in *. unfold encloses. cbn [up poly radius]. split; [lia|].
    rewrite ev2_add, ev2_scale. cbn [ev2 ev1]. change (nth a (run g x m) 0) with (code g x a m).
    assert (D0 : 0 < 2 ^ d) by (apply Z.pow_pos_nonneg; lia). assert (U0 : 0 < 2 ^ up e0) by (apply Z.pow_pos_nonneg; lia).
    rewrite !Z.pow_add_r by lia. change (2 ^ 1) with 2. pose proof (Z.div_mod (code g x a m) (2 ^ d) ltac:(lia)) as M.
    pose proof (Z.mod_pos_bound (code g x a m) (2 ^ d) ltac:(lia)) as B.
    set (z := code g x a m / 2 ^ d) in *. set (r := code g x a m mod 2 ^ d) in *. set (u := 2 ^ up e0) in *.
    assert (W : Z.abs ((2 ^ d - 1 - 2 * r) * u) <= (2 ^ d - 1) * u)
      by (rewrite Z.abs_mul, (Z.abs_eq u) by lia; apply Z.mul_le_mono_nonneg_r; lia).
    replace (z * (u * 2 ^ d * 2)
        - (2 * ev2 (poly e0) (at_input 0 m) (at_input 1 m) + (- ((2 ^ d - 1) * u) + at_input 1 m * 0 + at_input 0 m * 0)))
      with (2 * (code g x a m * u - ev2 (poly e0) (at_input 0 m) (at_input 1 m)) + (2 ^ d - 1 - 2 * r) * u)
      by (rewrite M; ring).
    clear - R1 W. set (one := (2 ^ d - 1 - 2 * r) * u) in *. set (two := code g x a m * u - _) in *. lia.
  - intros Ea. exact (K a e m Ea).
  - intros Ea. exact (K a e m Ea).
Qed.

Lemma enclosures_spec rest : forall known, (length known + length rest <= length g)%nat ->
  (forall j, (j < length rest)%nat -> nth (length known + j) g blank = nth j rest blank) ->
  all_enclosed known -> all_enclosed (enclosures known rest).
Proof.
  induction rest as [|v rest IH]; intros known L H K; cbn [enclosures]; [exact K|]. cbn [length] in L.
  apply IH.
  - rewrite app_length. simpl. lia.
  - intros j Hj. rewrite app_length. simpl. specialize (H (Datatypes.S j) ltac:(cbn [length]; lia)). simpl in H.
    rewrite <- H. f_equal. lia.
  - intros i e m Hi. destruct (Nat.lt_ge_cases i (length known)) as [Lt|Ge].
    + rewrite app_nth1 in Hi by exact Lt. exact (K i e m Hi).
    + rewrite app_nth2 in Hi by exact Ge. destruct (i - length known)%nat as [|d] eqn:Ed; [|destruct d; discriminate].
      assert (i = length known) by lia. subst i. simpl in Hi.
      apply (enclose_spec known); [lia|exact K|]. specialize (H O ltac:(cbn [length]; lia)). rewrite Nat.add_0_r in H. rewrite H. exact Hi.
Qed.

(* The code of node w is within p / q of the polynomial Q / d, which is at most M in magnitude. *)
Definition calibration_holds (w : nat) (Q : list (list Z)) (d p q M : Z) : bool :=
  let A := largest_at 0 in let B := largest_at 1 in
  match nth w (enclosures [] (firstn (Datatypes.S w) g)) None with
  | Some e =>
      let u := units_of (frac_of g w) in
      let all := steps_of (frac_of g w) * 2 ^ up e in
      let D := add_rows (scale_rows (d * u) (poly e)) (scale_rows (- all) Q) in
      let more := 2 ^ Z.of_nat (length D) * 2 ^ Z.of_nat (columns D) in
      let far := size2 (middle2 (middle_at 0) (middle_at 1) (length D) (columns D) D) (width_at 0) (width_at 1) in
      Nat.ltb w (length g) && (0 <? d) && (0 <? q)
      && ((more * (d * u * radius e) + far) * q <=? more * (p * (d * all))) && (size2 Q A B <=? M * d)
  | None => false
  end.
Theorem calibrated_within w Q d p q M : calibration_holds w Q d p q M = true -> forall m,
  (Rabs (IZR (ev2 Q (at_input 0 m) (at_input 1 m)) / IZR d 
    - IZR (code g x w m) * IZR (units_of (frac_of g w)) / IZR (steps_of (frac_of g w))) <= IZR p / IZR q)%R
  /\ (Rabs (IZR (ev2 Q (at_input 0 m) (at_input 1 m)) / IZR d) <= IZR M)%R.
Proof.
  unfold calibration_holds. destruct (nth w (enclosures [] (firstn (Datatypes.S w) g)) None) as [e|] eqn:Ee; [|discriminate].
  intros H m. apply andb_prop in H. destruct H as [H H6]. apply andb_prop in H. destruct H as [H H5].
  apply andb_prop in H. destruct H as [H H4]. apply andb_prop in H. destruct H as [H1 H3].
  apply Nat.ltb_lt in H1. apply Z.ltb_lt in H3. apply Z.ltb_lt in H4. apply Z.leb_le in H5. apply Z.leb_le in H6.
  assert (K : all_enclosed (enclosures [] (firstn (Datatypes.S w) g))).
  { apply enclosures_spec.
    - rewrite firstn_length. cbn [length]. lia.
    - intros j Hj. cbn [length plus]. symmetry. apply nth_firstn. rewrite firstn_length in Hj. lia.
    - intros i e0 m0 Hi. destruct i; discriminate. }
  destruct (K w e m Ee) as [U0 R0]. set (s := steps_of (frac_of g w)) in *.
  set (u := units_of (frac_of g w)) in *.
  set (D := add_rows (scale_rows (d * u) (poly e)) (scale_rows (- (s * 2 ^ up e)) Q)) in *.
  pose proof (size2_spec (middle2 (middle_at 0) (middle_at 1) (length D) (columns D) D) _ _ _ _ (at_middle_spec 0 m)
    (at_middle_spec 1 m)) as S1.
  rewrite middle2_spec in S1 by lia. set (more := 2 ^ Z.of_nat (length D) * 2 ^ Z.of_nat (columns D)) in *.
  assert (More : 0 < more) by (apply Z.mul_pos_pos; apply Z.pow_pos_nonneg; lia).
  pose proof (size2_spec Q _ _ _ _ (at_input_spec 0 m) (at_input_spec 1 m)) as S2.
  set (far := size2 (middle2 _ _ _ _ _) _ _) in S1, H5. unfold D in S1. rewrite ev2_add, !ev2_scale in S1.
  set (P := ev2 (poly e) (at_input 0 m) (at_input 1 m)) in *. set (V := ev2 Q (at_input 0 m) (at_input 1 m)) in *.
  set (c := code g x w m) in *. assert (N0 : 0 < u) by (apply Z.pow_pos_nonneg; lia).
  assert (F0 : 0 < s) by (apply Z.pow_pos_nonneg; lia). assert (E0 : 0 < 2 ^ up e) by (apply Z.pow_pos_nonneg; lia).
  assert (dpos : (0 < IZR d)%R) by (apply IZR_lt; lia). assert (qpos : (0 < IZR q)%R) by (apply IZR_lt; lia).
  assert (fpos : (0 < IZR s)%R) by (apply IZR_lt; lia). assert (epos : (0 < IZR (2 ^ up e))%R) by (apply IZR_lt; lia).
  split.
  - assert (A : more * Z.abs (s * 2 ^ up e * V - d * (c * u) * 2 ^ up e) <= more * (d * u * radius e) + far).
    { assert (R1 : Z.abs (d * u * (c * 2 ^ up e - P)) <= d * u * radius e)
        by (rewrite Z.abs_mul, (Z.abs_eq (d * u)) by nia; apply Z.mul_le_mono_nonneg_l; nia).
      replace (s * 2 ^ up e * V - d * (c * u) * 2 ^ up e)
        with (- (d * u * (c * 2 ^ up e - P)) - (d * u * P + - (s * 2 ^ up e) * V)) by ring.
      rewrite Z.abs_mul, (Z.abs_eq more) in S1 by lia.
      apply Z.le_trans with (more * (d * u * radius e + Z.abs (d * u * P + - (s * 2 ^ up e) * V))); [|lia].
      apply Z.mul_le_mono_nonneg_l; lia. }
    assert (B : Z.abs (s * 2 ^ up e * V - d * (c * u) * 2 ^ up e) * q <= p * (d * (s * 2 ^ up e))).
    { apply Z.mul_le_mono_pos_l with more; [exact More|]. apply Z.le_trans with (2 := H5). rewrite Z.mul_assoc.
      apply Z.mul_le_mono_nonneg_r; lia. }
    apply IZR_le in B. rewrite !mult_IZR, abs_IZR, minus_IZR, !mult_IZR in B.
    set (ff := IZR s) in *. set (ee := IZR (2 ^ up e)) in *. set (dd := IZR d) in *. set (qq := IZR q) in *.
    apply Rmult_le_reg_r with (qq * (dd * (ff * ee)))%R; [repeat apply Rmult_lt_0_compat; assumption|].
    replace (IZR p / qq * (qq * (dd * (ff * ee))))%R with (IZR p * (dd * (ff * ee)))%R by (field; lra).
    apply Rle_trans with (2 := B).
    replace (qq * (dd * (ff * ee)))%R with (Rabs (dd * (ff * ee)) * qq)%R
      by (rewrite Rabs_pos_eq by (repeat apply Rmult_le_pos; lra); ring).
    rewrite <- Rmult_assoc, <- Rabs_mult. apply Rmult_le_compat_r; [lra|]. apply Req_le. f_equal. field. lra.
  - assert (B : Z.abs V <= M * d) by lia. apply IZR_le in B. rewrite abs_IZR, mult_IZR in B.
    unfold Rdiv. rewrite Rabs_mult, (Rabs_pos_eq (/ IZR d)) by (left; apply Rinv_0_lt_compat; exact dpos).
    apply Rmult_le_reg_r with (IZR d); [exact dpos|]. rewrite Rmult_assoc, Rinv_l by lra. lra.
Qed.
End Enclosures.
