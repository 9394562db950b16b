(* Every code of a graph stays in its node's range, for all inputs in the ranges of their ports.

   Most ranges follow from those of the operands by interval arithmetic: induction over time and graph. Where recursion
   makes intervals grow without end, a node's range is given from elsewhere (`given`): from a peak gain. *)
Require Import Bool ZArith List Lia. Import ListNotations.
From Sosmith Require Import Definitions Graph.
Open Scope Z_scope.

(* The smallest and the largest code that an operation makes of codes within their ranges. *)
Definition interval (g : graph) (ports : list (Z * Z)) (v : node) : Z * Z :=
  let lo i := low (nth i g blank) in
  let hi i := high (nth i g blank) in
  let up i := 2 ^ (frac v - frac_of g i) in
  let down i := 2 ^ (frac_of g i - frac v) in
  match op v with
  | Input port => nth port ports (0, 0)
  | Constant c => (c, c)
  | Add a b => (lo a * up a + lo b * up b, hi a * up a + hi b * up b)
  | Subtract a b => (lo a * up a - hi b * up b, hi a * up a - lo b * up b)
  | Multiply a b =>
      (Z.min (Z.min (lo a * lo b) (lo a * hi b)) (Z.min (hi a * lo b) (hi a * hi b)),
       Z.max (Z.max (lo a * lo b) (lo a * hi b)) (Z.max (hi a * lo b) (hi a * hi b)))
  | Scale a c _ => (Z.min (lo a * c) (hi a * c), Z.max (lo a * c) (hi a * c))
  | Shift a _ | Bound a | Wire a => (lo a, hi a)
  | Floor a => (lo a / down a, hi a / down a)
  | Fraction a kept => (0, 2 ^ (frac_of g a - kept) - 1)
  | Truncate a => (Z.quot (lo a) (down a), Z.quot (hi a) (down a))
  | Clamp _ => (low v, high v)
  | Delay a => (Z.min 0 (lo a), Z.max 0 (hi a))
  end.
Definition has_port (ports : list (Z * Z)) (v : node) : bool :=
  match op v with Input p => Nat.ltb p (length ports) | _ => true end.
Definition follows (g : graph) (ports : list (Z * Z)) (given : list nat) (i : nat) (v : node) : bool :=
  existsb (Nat.eqb i) given
  || (let b := interval g ports v in (low v <=? fst b) && (snd b <=? high v) && (low v <=? high v)
      && has_port ports v).

(* The first k nodes are a graph of their own: delays among them take nodes among them. *)
Definition closed (k : nat) (g : graph) : bool :=
  Nat.leb k (length g)
  && every (fun _ v => match op v with Delay a => Nat.ltb a k | _ => true end) 0 (firstn k g).

Lemma nth_firstn {A} (d : A) : forall l k i, (i < k)%nat -> nth i (firstn k l) d = nth i l d.
Proof. induction l as [|x l IH]; intros [|k] [|i] H; simpl; try lia; try reflexivity. apply IH; lia. Qed.
Lemma closed_spec k g i a : closed k g = true -> (i < k)%nat -> op (nth i g blank) = Delay a -> (a < k)%nat.
Proof.
  unfold closed. intros C Hi Ho. apply andb_prop in C. destruct C as [L C]. apply Nat.leb_le in L.
  pose proof (every_spec _ _ 0 i C) as E. rewrite firstn_length in E. specialize (E ltac:(lia)).
  simpl in E. rewrite nth_firstn in E by exact Hi. rewrite Ho in E. apply Nat.ltb_lt, E.
Qed.
Lemma closed_length k g : closed k g = true -> (k <= length g)%nat.
Proof. unfold closed. intros C. apply andb_prop in C. apply Nat.leb_le, C. Qed.

(* Induction over time, and over the first k nodes. *)
Lemma by_time_and_graph (k : nat) (P : nat -> nat -> Prop) :
  (forall n i, (i < k)%nat -> (forall a, (a < i)%nat -> P a n) ->
    (forall m a, (m < n)%nat -> (a < k)%nat -> P a m) -> P i n) ->
  forall n i, (i < k)%nat -> P i n.
Proof.
  intros H. induction n as [n IHn] using lt_wf_ind.
  assert (Q : forall j i, (i < j)%nat -> (i < k)%nat -> P i n).
  { induction j as [|j IHj]; intros i Hj Hi; [lia|].
    apply H; [exact Hi| |].
    - intros a Ha. apply IHj; lia.
    - intros m a Hm Ha. apply IHn; assumption. }
  intros i Hi. apply (Q (S i)); lia.
Qed.

Lemma product_within a b c d x y : a <= x <= b -> c <= y <= d ->
  Z.min (Z.min (a * c) (a * d)) (Z.min (b * c) (b * d)) <= x * y
  <= Z.max (Z.max (a * c) (a * d)) (Z.max (b * c) (b * d)).
Proof.
  intros Hx Hy.
  assert (S : forall z lo hi k, lo <= z <= hi -> Z.min (lo * k) (hi * k) <= z * k <= Z.max (lo * k) (hi * k)).
  { intros z lo hi k Hz. destruct (Z.le_gt_cases 0 k).
    - assert (lo * k <= z * k) by (apply Z.mul_le_mono_nonneg_r; lia).
      assert (z * k <= hi * k) by (apply Z.mul_le_mono_nonneg_r; lia). lia.
    - assert (z * k <= lo * k) by (apply Z.mul_le_mono_nonpos_r; lia).
      assert (hi * k <= z * k) by (apply Z.mul_le_mono_nonpos_r; lia). lia. }
  pose proof (S y c d x Hy) as A. pose proof (S x a b c Hx) as B. pose proof (S x a b d Hx) as C.
  rewrite (Z.mul_comm y x), (Z.mul_comm c x), (Z.mul_comm d x) in A. lia.
Qed.

Theorem ranges (k : nat) (g : graph) (ports : list (Z * Z)) (given : list nat) (x : nat -> nat -> Z) :
  ordered g = true -> closed k g = true -> every (follows g ports given) 0 (firstn k g) = true ->
  inputs_within ports x ->
  (forall i n, In i given -> in_range g x i n) ->
  forall n i, (i < k)%nat -> in_range g x i n.
Proof.
  intros G C F X Y. pose proof (closed_length k g C) as L.
  apply by_time_and_graph. intros n i Hi Now Past.
  pose proof (every_spec _ _ 0 i F) as E. rewrite firstn_length in E. specialize (E ltac:(lia)).
  simpl in E. rewrite nth_firstn in E by exact Hi. unfold follows in E. apply orb_prop in E. destruct E as [E|E].
  { apply existsb_exists in E. destruct E as [j [Hj E]]. apply Nat.eqb_eq in E. subst j. apply Y, Hj. }
  apply andb_prop in E. destruct E as [E E4]. apply andb_prop in E. destruct E as [E E3]. apply andb_prop in E. destruct E as [E1 E2].
  apply Z.leb_le in E1. apply Z.leb_le in E2. apply Z.leb_le in E3.
  assert (O := fun a => operands_before g G i a ltac:(lia)).
  assert (P := points_fit g G i ltac:(lia)).
  unfold in_range. rewrite (code_spec g x G i n) by lia. set (v := nth i g blank) in *.
  assert (R : forall a, In a (operands (op v)) -> in_range g x a n) by (intros a Ha; apply Now, O, Ha).
  assert (A : forall a, In a (operands (op v)) -> forall c, 0 <= c ->
    low (nth a g blank) * c <= code g x a n * c <= high (nth a g blank) * c).
  { intros a Ha c Hc. specialize (R a Ha). unfold in_range in R. split; apply Z.mul_le_mono_nonneg_r; lia. }
  unfold compute, points, interval in *.
  destruct (op v) as [p|c|a b|a b|a b|a c bits|a s|a|a kept|a|a|a|a|a] eqn:Eo; simpl in *;
    fold (code g x) in *; repeat change (nth ?a (run g x n) 0) with (code g x a n).
  - unfold has_port in E4. rewrite Eo in E4. apply Nat.ltb_lt in E4. specialize (X n p E4). lia.
  - lia.
  - pose proof (A a (or_introl eq_refl) (2 ^ (frac v - frac_of g a)) (Z.pow_nonneg 2 _ ltac:(lia))).
    pose proof (A b (or_intror (or_introl eq_refl)) (2 ^ (frac v - frac_of g b)) (Z.pow_nonneg 2 _ ltac:(lia))).
    unfold code in *. lia.
  - pose proof (A a (or_introl eq_refl) (2 ^ (frac v - frac_of g a)) (Z.pow_nonneg 2 _ ltac:(lia))).
    pose proof (A b (or_intror (or_introl eq_refl)) (2 ^ (frac v - frac_of g b)) (Z.pow_nonneg 2 _ ltac:(lia))).
    unfold code in *. lia.
  - pose proof (product_within _ _ _ _ _ _ (R a (or_introl eq_refl)) (R b (or_intror (or_introl eq_refl)))).
    unfold code in *. lia.
  - specialize (R a (or_introl eq_refl)). unfold in_range, code in *.
    destruct (Z.le_gt_cases 0 c).
    + assert (low (nth a g blank) * c <= nth a (run g x n) 0 * c) by (apply Z.mul_le_mono_nonneg_r; lia).
      assert (nth a (run g x n) 0 * c <= high (nth a g blank) * c) by (apply Z.mul_le_mono_nonneg_r; lia). lia.
    + assert (nth a (run g x n) 0 * c <= low (nth a g blank) * c) by (apply Z.mul_le_mono_nonpos_r; lia).
      assert (high (nth a g blank) * c <= nth a (run g x n) 0 * c) by (apply Z.mul_le_mono_nonpos_r; lia). lia.
  - specialize (R a (or_introl eq_refl)). unfold in_range, code in *. lia.
  - apply Z.ltb_lt in P. assert (D : 0 < 2 ^ (frac_of g a - frac v)) by (apply Z.pow_pos_nonneg; lia).
    specialize (R a (or_introl eq_refl)). unfold in_range, code in *.
    pose proof (Z.div_le_mono _ _ _ D (proj1 R)). pose proof (Z.div_le_mono _ _ _ D (proj2 R)). lia.
  - apply andb_prop in P. destruct P as [_ P]. apply Z.ltb_lt in P.
    assert (D : 0 < 2 ^ (frac_of g a - kept)) by (apply Z.pow_pos_nonneg; lia).
    unfold code in *. pose proof (Z.mod_pos_bound (nth a (run g x n) 0) _ D). lia.
  - apply Z.ltb_lt in P. assert (D : 0 < 2 ^ (frac_of g a - frac v)) by (apply Z.pow_pos_nonneg; lia).
    specialize (R a (or_introl eq_refl)). unfold in_range, code in *.
    pose proof (Z.quot_le_mono _ _ _ D (proj1 R)). pose proof (Z.quot_le_mono _ _ _ D (proj2 R)). lia.
  - lia.
  - specialize (R a (or_introl eq_refl)). unfold in_range, code in *. lia.
  - specialize (R a (or_introl eq_refl)). unfold in_range, code in *. lia.
  - rewrite before_code. destruct n as [|m]; [lia|].
    assert (H : in_range g x a m) by (apply Past; [lia|apply (closed_spec k g i a C Hi Eo)]).
    unfold in_range in H. lia.
Qed.

(* The same, where the first nodes are known already. *)
Theorem ranges_further (known k : nat) (g : graph) (ports : list (Z * Z)) (given : list nat) (x : nat -> nat -> Z) :
  ordered g = true -> closed k g = true -> every (follows g ports (seq 0 known ++ given)) 0 (firstn k g) = true ->
  inputs_within ports x -> (forall n i, (i < known)%nat -> in_range g x i n) ->
  (forall i n, In i given -> in_range g x i n) ->
  forall n i, (i < k)%nat -> in_range g x i n.
Proof.
  intros G C F X K Y. apply (ranges k g ports (seq 0 known ++ given) x G C F X).
  intros i n H. apply in_app_or in H. destruct H as [H|H]; [apply in_seq in H; apply K; lia|apply Y, H].
Qed.

(* Nodes whose range needs nothing of the others: constants, and those that are known already, the first k. *)
Definition known (g : graph) (k i : nat) : bool :=
  Nat.ltb i k
  || Nat.ltb i (length g)
     && match op (nth i g blank) with
        | Constant c => (low (nth i g blank) <=? c) && (c <=? high (nth i g blank))
        | _ => false
        end.
Lemma known_in_range k g x i n : ordered g = true -> (forall m j, (j < k)%nat -> in_range g x j m) ->
  known g k i = true -> in_range g x i n.
Proof.
  unfold known. intros G H E. apply orb_prop in E. destruct E as [E|E]; [apply H, Nat.ltb_lt, E|].
  apply andb_prop in E. destruct E as [L E]. apply Nat.ltb_lt in L.
  unfold in_range. rewrite (code_spec g x G i n L). unfold compute.
  destruct (op (nth i g blank)); try discriminate. apply andb_prop in E. destruct E as [E1 E2].
  apply Z.leb_le in E1. apply Z.leb_le in E2. lia.
Qed.

(* That no range is wider than those of its operands make it: nothing that is proven of a filter rests on this. *)
(* Delays may be wider where their source has all of its operand's range. *)
Definition delay_is_tight (g : graph) (a : nat) (v : node) : bool :=
  let s := nth a g blank in
  let least := Z.min (low s) 0 in let most := Z.max (high s) 0 in
  let plain := (low v =? least) && (high v =? most) in
  let against i := let of := nth i g blank in
    ((low v =? least) || ((low s =? low of) && (low v <=? least))) && ((high v =? most) || ((high s =? high of) && (most <=? high v))) in
  match op s with
  | Input _ | Wire _ | Delay _ => plain
  | Bound b => against b
  | _ => against a
  end.
Definition tight (g : graph) (ports : list (Z * Z)) (i : nat) (v : node) : bool :=
  match op v with
  | Bound a => (low (nth a g blank) <=? low v) && (high v <=? high (nth a g blank)) && (low v <=? high v)
  | Clamp _ => low v <=? high v
  | Delay a => delay_is_tight g a v
  | _ => (low v =? fst (interval g ports v)) && (high v =? snd (interval g ports v)) && has_port ports v
  end.
Definition ranges_are_tight (g : graph) (ports : list (Z * Z)) : bool := every (tight g ports) 0 g.
