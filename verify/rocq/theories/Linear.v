(* Linear graphs: each code as a quotient of polynomials in the delay, driven by sources.

   A source is the code of a node that is taken as it is (the input of a filter), or what a quantizer drops: rounding a code
   down by b bits takes away its remainder modulo 2^b, whatever the code is. So no assumption is made on roundings: the
   equations hold for integers of any size.

   For a node a form (D, [N1; N2; ...]) says D * code = N1 * u1 + N2 * u2 + ... Forms come from outside. They are checked
   node by node, each against those of its operands (`fits_node`): what they leave of the equations then obeys the same
   equations without any source, from states of 0, and so is 0, by induction over time and graph. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Graph Ranges.
Open Scope Z_scope.

Inductive source :=
  | Of (i : nat)                    (* the code of a node *)
  | Rounding (i : nat) (bits : Z)   (* what rounding it down by so many bits drops *)
  | Truncation (i : nat) (bits : Z) (* what rounding it towards 0 drops *).

Definition source_eqb (s t : source) : bool :=
  match s, t with
  | Of i, Of j => Nat.eqb i j
  | Rounding i b, Rounding j c | Truncation i b, Truncation j c => Nat.eqb i j && (b =? c)
  | _, _ => false
  end.
Lemma source_eqb_eq s t : source_eqb s t = true -> s = t.
Proof.
  destruct s, t; simpl; try discriminate; intros H; try (apply andb_prop in H; destruct H as [H Hb]; apply Z.eqb_eq in Hb; subst);
    apply Nat.eqb_eq in H; subst; reflexivity.
Qed.
Fixpoint find (s : source) (l : list source) : option nat :=
  match l with [] => None | t :: l' => if source_eqb s t then Some O else option_map S (find s l') end.
Lemma find_spec s : forall l k, find s l = Some k -> nth_error l k = Some s.
Proof.
  induction l as [|t l IH]; simpl; intros k H; [discriminate|].
  destruct (source_eqb s t) eqn:E.
  - injection H as <-. apply source_eqb_eq in E. subst. reflexivity.
  - destruct (find s l) as [j|]; [|discriminate]. injection H as <-. simpl. apply IH. reflexivity.
Qed.

Definition drive (g : graph) (x : nat -> nat -> Z) (s : source) : sequence := fun n =>
  match s with
  | Of i => IZR (code g x i n)
  | Rounding i b => IZR (code g x i n mod 2 ^ b)
  | Truncation i b => IZR (Z.rem (code g x i n) (2 ^ b))
  end.
Definition reach (g : graph) (s : source) : Z * Z :=
  match s with
  | Of i => (low (nth i g blank), high (nth i g blank))
  | Rounding _ b => (0, 2 ^ b - 1)
  | Truncation _ b => (1 - 2 ^ b, 2 ^ b - 1)
  end.
Definition proper (s : source) : bool := match s with Of _ => true | Rounding _ b | Truncation _ b => 0 <? b end.

Record form := Form { under : list Z; over : list (list Z) }.
Definition trace (g : graph) (x : nat -> nat -> Z) (i : nat) : sequence := fun n => IZR (code g x i n).

(* Rows of numerators. *)
Fixpoint add_rows (A B : list (list Z)) : list (list Z) :=
  match A, B with [], _ => B | _, [] => A | a :: A', b :: B' => add a b :: add_rows A' B' end.
Definition scale_rows (c : Z) (A : list (list Z)) := map (scale c) A.
Fixpoint place {A} (s : nat) (l : list A) : list (list A) := match s with O => [l] | S s' => [] :: place s' l end.
Definition delayed (k : nat) (l : list Z) : list Z := repeat 0 k ++ l.
Fixpoint same (a b : list Z) : bool :=
  match a, b with
  | [], _ => forallb (Z.eqb 0) b
  | _, [] => forallb (Z.eqb 0) a
  | x :: a', y :: b' => (x =? y) && same a' b'
  end.
Fixpoint same_rows (A B : list (list Z)) : bool :=
  match A, B with
  | [], _ => forallb (same []) B
  | _, [] => forallb (same []) A
  | a :: A', b :: B' => same a b && same_rows A' B'
  end.

Lemma zeros_conv a : forallb (Z.eqb 0) a = true -> forall u n, conv a u n = 0%R.
Proof.
  induction a as [|c a IH]; simpl; intros H u n; [reflexivity|].
  apply andb_prop in H. destruct H as [H1 H2]. destruct c; try discriminate.
  destruct n; [ring|]. rewrite IH by exact H2. ring.
Qed.
Lemma same_conv a : forall b, same a b = true -> forall u n, conv a u n = conv b u n.
Proof.
  induction a as [|x a IH]; intros [|y b] H u n; simpl in H.
  - reflexivity.
  - symmetry. apply (zeros_conv (y :: b)). exact H.
  - apply (zeros_conv (x :: a)). exact H.
  - apply andb_prop in H. destruct H as [H1 H2]. apply Z.eqb_eq in H1. subst y. simpl.
    destruct n; [reflexivity|]. rewrite (IH b H2). reflexivity.
Qed.
Lemma zero_rows A : forallb (same []) A = true -> forall u n, total A u n = 0%R.
Proof.
  induction A as [|a A IH]; simpl; intros H [|x u] n; try reflexivity.
  apply andb_prop in H. destruct H as [H1 H2]. rewrite IH by exact H2. rewrite zeros_conv by exact H1. ring.
Qed.
Lemma same_rows_total A : forall B, same_rows A B = true -> forall u n, total A u n = total B u n.
Proof.
  induction A as [|a A IH]; intros [|b B] H u n; simpl in H.
  - reflexivity.
  - symmetry. apply (zero_rows (b :: B)). exact H.
  - apply (zero_rows (a :: A)). exact H.
  - apply andb_prop in H. destruct H as [H1 H2]. destruct u as [|x u]; [reflexivity|]. simpl.
    rewrite (IH B H2), (same_conv a b H1). reflexivity.
Qed.
Lemma total_add_rows A : forall B u n, total (add_rows A B) u n = (total A u n + total B u n)%R.
Proof.
  induction A as [|a A IH]; intros [|b B] [|x u] n; simpl; try ring. rewrite conv_add, IH. ring.
Qed.
Lemma total_scale_rows c A : forall u n, total (scale_rows c A) u n = (IZR c * total A u n)%R.
Proof.
  induction A as [|a A IH]; intros [|x u] n; simpl; try ring.
  fold (scale_rows c A). rewrite conv_scale, IH. ring.
Qed.
Lemma total_place s : forall l u n, total (place s l) u n = conv l (nth s u (fun _ => 0%R)) n.
Proof.
  induction s as [|s IH]; intros l [|x u] n; simpl; try (symmetry; apply conv_zero); try ring.
  rewrite IH. ring.
Qed.
Lemma total_late A : forall u n,
  total (map (cons 0) A) u n = match n with O => 0%R | S m => total A u m end.
Proof.
  induction A as [|a A IH]; intros [|x u] n; simpl; destruct n; try reflexivity; rewrite IH; ring.
Qed.

(* A sequence k samples later. *)
Fixpoint late (k : nat) (u : sequence) : sequence :=
  match k with O => u | S k' => fun n => match n with O => 0%R | S m => late k' u m end end.
Lemma conv_late_one l : forall (u : sequence) n,
  conv l (fun n => match n with O => 0%R | S m => u m end) n = match n with O => 0%R | S m => conv l u m end.
Proof.
  induction l as [|c l IH]; intros u n; simpl; [destruct n; reflexivity|].
  destruct n as [|m]; [ring|]. rewrite IH. reflexivity.
Qed.
Lemma conv_late k l u : forall n, conv l (late k u) n = conv (delayed k l) u n.
Proof.
  induction k as [|k IH]; intros n; [reflexivity|].
  simpl late. rewrite (conv_late_one l (late k u)). simpl. destruct n as [|m]; [ring|].
  rewrite IH. unfold delayed. ring.
Qed.

(* Behind delays, the node that is delayed. *)
Fixpoint chain (g : graph) (fuel a : nat) : nat * nat :=
  match fuel with
  | O => (a, O)
  | S f => match op (nth a g blank) with Delay b => let (r, k) := chain g f b in (r, S k) | _ => (a, O) end
  end.
Definition depth : nat := 8.

(* Whether the form of a node follows from those of its operands. *)
Definition same_under (f h : form) : bool := same (under f) (under h).
Definition fits_node (g : graph) (sources : list source) (forms : list (option form))
    (i : nat) (v : node) : bool :=
  match nth i forms None with
  | None => true
  | Some f =>
    let one a (test : form -> bool) := match nth a forms None with Some h => same_under f h && test h | None => false end in
    let up a := 2 ^ (frac v - frac_of g a) in
    let lost a kept (kind : nat -> Z -> source) (test : nat -> list Z -> bool) :=
      let (root, k) := chain g depth a in
      match find (kind root (frac_of g a - kept)) sources with
      | Some s => test s (delayed k (under f))
      | None => false
      end in
    let rounded a kind :=
      one a (fun h => lost a (frac v) kind (fun s d =>
        same_rows (scale_rows (2 ^ (frac_of g a - frac v)) (over f)) (add_rows (over h) (place s (scale (-1) d))))) in
    match find (Of i) sources with Some s => same_rows (over f) (place s (under f)) | None => false end
    || match op v with
       | Add a b => one a (fun h => one b (fun k =>
           same_rows (over f) (add_rows (scale_rows (up a) (over h)) (scale_rows (up b) (over k)))))
       | Subtract a b => one a (fun h => one b (fun k =>
           same_rows (over f) (add_rows (scale_rows (up a) (over h)) (scale_rows (- up b) (over k)))))
       | Scale a c _ => one a (fun h => same_rows (over f) (scale_rows c (over h)))
       | Shift a _ | Bound a => one a (fun h => same_rows (over f) (over h))
       | Delay a => one a (fun h => same_rows (over f) (map (cons 0) (over h)))
       | Floor a => rounded a Rounding
       | Truncate a => rounded a Truncation
       | Fraction a kept => lost a kept Rounding (fun s d => same_rows (over f) (place s d))
       | _ => false
       end
  end.

Section Forms.
Variables (g : graph) (x : nat -> nat -> Z) (sources : list source).
Variables (forms : list (option form)) (k : nat).
Hypothesis G : ordered g = true.
Hypothesis C : closed k g = true.
Hypothesis E : every (fits_node g sources forms) 0 (firstn k g) = true.

Let u := map (drive g x) sources.

Lemma driven s t : find t sources = Some s -> nth s u (fun _ => 0%R) = drive g x t.
Proof.
  intros H. apply find_spec in H. unfold u.
  rewrite (nth_indep _ _ (drive g x (Of 0))).
  - rewrite map_nth. f_equal. apply nth_error_nth. exact H.
  - rewrite map_length. apply nth_error_Some. rewrite H. discriminate.
Qed.

Lemma delay_length i a : (i < length g)%nat -> op (nth i g blank) = Delay a -> (a < length g)%nat.
Proof.
  intros H Ho. pose proof (ordered_node g G i H) as O. unfold ordered_at in O. rewrite Ho in O.
  apply andb_prop in O. destruct O as [_ O]. apply Nat.ltb_lt, O.
Qed.

Lemma chain_spec (f : Z -> R) : f 0 = 0%R -> forall fuel a, (a < length g)%nat ->
  forall n, f (code g x a n) = late (snd (chain g fuel a)) (fun m => f (code g x (fst (chain g fuel a)) m)) n.
Proof.
  intros F0. induction fuel as [|fuel IH]; intros a Ha n; [reflexivity|].
  simpl. destruct (op (nth a g blank)) as [| | | | | | | | | | | | |b] eqn:Eo; try reflexivity.
  assert (Hb := delay_length a b Ha Eo). specialize (IH b Hb). destruct (chain g fuel b) as [r j]. simpl in *.
  rewrite (code_spec g x G a n Ha). unfold compute. rewrite Eo, before_code. destruct n as [|m]; [exact F0|apply IH].
Qed.

Definition holds (f : form) (i n : nat) : Prop := conv (under f) (trace g x i) n = total (over f) u n.

Lemma two_terms d (y a b : sequence) p q n : (forall m, y m = p * a m + q * b m)%R ->
  conv d y n = (p * conv d a n + q * conv d b n)%R.
Proof.
  intros H. rewrite (conv_ext d y (fun m => p * a m + q * b m)%R) by (intros; apply H).
  rewrite (conv_plus d (fun m => p * a m)%R), !conv_multiple. reflexivity.
Qed.
Lemma lost_term a kept kind (fn : Z -> R) s d n :
  (a < length g)%nat -> fn 0 = 0%R ->
  (forall r m, drive g x (kind r (frac_of g a - kept)) m = fn (code g x r m)) ->
  find (kind (fst (chain g depth a)) (frac_of g a - kept)) sources = Some s ->
  conv (delayed (snd (chain g depth a)) d) (nth s u (fun _ => 0%R)) n = conv d (fun m => fn (code g x a m)) n.
Proof.
  intros Ha F0 Hd Hs. rewrite (driven _ _ Hs), <- conv_late. apply conv_ext. intros m _.
  rewrite (chain_spec fn F0 depth a Ha m).
  generalize (snd (chain g depth a)). intros j. generalize m. clear m. induction j as [|j IH]; intros m; simpl.
  - apply Hd.
  - destruct m; [reflexivity|apply IH].
Qed.

Theorem forms_hold : forall n i, (i < k)%nat -> forall f, nth i forms None = Some f -> holds f i n.
Proof.
  pose proof (closed_length k g C) as L.
  apply (by_time_and_graph k (fun i n => forall f, nth i forms None = Some f -> holds f i n)).
  intros n i Hi Now Past f Hf.
  pose proof (every_spec _ _ 0 i E) as T. rewrite firstn_length in T. specialize (T ltac:(lia)).
  simpl in T. rewrite nth_firstn in T by exact Hi. unfold fits_node in T. rewrite Hf in T.
  assert (Hl : (i < length g)%nat) by lia.
  assert (O := fun a => operands_before g G i a Hl). assert (P := points_fit g G i Hl).
  assert (Code := fun m => code_spec g x G i m Hl). set (v := nth i g blank) in *.
  apply orb_prop in T. destruct T as [T|T].
  { destruct (find (Of i) sources) as [s|] eqn:Es; [|discriminate]. unfold holds.
    rewrite (same_rows_total _ _ T), total_place, (driven _ _ Es). reflexivity. }
  assert (One : forall a (test : form -> bool), In a (operands (op v)) ->
    match nth a forms None with Some h => same_under f h && test h | None => false end = true ->
    exists h, test h = true /\ conv (under f) (trace g x a) n = total (over h) u n).
  { intros a test Ha Ht. destruct (nth a forms None) as [h|] eqn:Eh; [|discriminate].
    apply andb_prop in Ht. destruct Ht as [H1 H2]. exists h. split; [exact H2|].
    rewrite (same_conv _ _ H1). apply (Now a (O a Ha) h Eh). }
  assert (Rounded : forall a (kind : nat -> Z -> source) (rem : Z -> Z -> Z), (op v = Floor a \/ op v = Truncate a) ->
    (forall r b m, drive g x (kind r b) m = IZR (rem (code g x r m) (2 ^ b))) ->
    rem 0 (2 ^ (frac_of g a - frac v)) = 0 ->
    (forall m, code g x a m = 2 ^ (frac_of g a - frac v) * code g x i m + rem (code g x a m) (2 ^ (frac_of g a - frac v))) ->
    match nth a forms None with
    | Some h => same_under f h &&
        (let (root, j) := chain g depth a in
         match find (kind root (frac_of g a - frac v)) sources with
         | Some s => same_rows (scale_rows (2 ^ (frac_of g a - frac v)) (over f))
                       (add_rows (over h) (place s (scale (-1) (delayed j (under f)))))
         | None => false
         end)
    | None => false
    end = true -> 0 < 2 ^ (frac_of g a - frac v) -> holds f i n).
  { intros a kind rem Ho Hd H0 Hc Ht Hp.
    assert (Ia : In a (operands (op v))) by (destruct Ho as [Ho|Ho]; rewrite Ho; left; reflexivity).
    destruct (nth a forms None) as [h|] eqn:Eh; [|discriminate].
    apply andb_prop in Ht. destruct Ht as [H1 H2].
    rewrite (surjective_pairing (chain g depth a)) in H2.
    destruct (find (kind (fst (chain g depth a)) (frac_of g a - frac v)) sources) as [s|] eqn:Es; [|discriminate].
    pose proof (same_rows_total _ _ H2 u n) as H3.
    rewrite total_scale_rows, total_add_rows, total_place, conv_scale in H3.
    assert (Ha : (a < length g)%nat) by (specialize (O a Ia); lia).
    rewrite (lost_term a (frac v) kind (fun z => IZR (rem z (2 ^ (frac_of g a - frac v)))) s (under f) n Ha) in H3;
      [|rewrite H0; reflexivity|intros; apply Hd|exact Es].
    assert (H4 : conv (under f) (trace g x a) n = total (over h) u n)
      by (rewrite (same_conv _ _ H1); apply (Now a (O a Ia) h Eh)).
    assert (H5 : conv (under f) (trace g x a) n
      = (IZR (2 ^ (frac_of g a - frac v))%Z * conv (under f) (trace g x i) n
         + 1 * conv (under f) (fun m => IZR (rem (code g x a m) (2 ^ (frac_of g a - frac v))%Z)) n)%R).
    { apply two_terms. intros m. unfold trace. rewrite (Hc m) at 1. rewrite plus_IZR, mult_IZR. ring. }
    assert (H6 : (0 < IZR (2 ^ (frac_of g a - frac v)))%R) by (apply IZR_lt; exact Hp).
    unfold holds. apply Rmult_eq_reg_l with (IZR (2 ^ (frac_of g a - frac v))); [|lra].
    rewrite H3, <- H4, H5. ring. }
  unfold compute, points in *.
  destruct (op v) as [p|c|a b|a b|a b|a c bits|a s|a|a kept|a|a|a|a|a] eqn:Eo; simpl in O; try discriminate.
  - destruct (One a _ (or_introl eq_refl) T) as [h [T2 Ha]].
    destruct (One b _ (or_intror (or_introl eq_refl)) T2) as [h' [T3 Hb]].
    unfold holds. rewrite (same_rows_total _ _ T3), total_add_rows, !total_scale_rows, <- Ha, <- Hb.
    apply two_terms. intros m. unfold trace. rewrite Code, plus_IZR, !mult_IZR. unfold code. ring.
  - destruct (One a _ (or_introl eq_refl) T) as [h [T2 Ha]].
    destruct (One b _ (or_intror (or_introl eq_refl)) T2) as [h' [T3 Hb]].
    unfold holds. rewrite (same_rows_total _ _ T3), total_add_rows, !total_scale_rows, <- Ha, <- Hb.
    apply two_terms. intros m. unfold trace. rewrite Code, minus_IZR, opp_IZR, !mult_IZR. unfold code. ring.
  - destruct (One a _ (or_introl eq_refl) T) as [h [T2 Ha]].
    unfold holds. rewrite (same_rows_total _ _ T2), total_scale_rows, <- Ha, <- conv_multiple.
    apply conv_ext. intros m _. unfold trace. rewrite Code, mult_IZR. unfold code. ring.
  - destruct (One a _ (or_introl eq_refl) T) as [h [T2 Ha]].
    unfold holds. rewrite (same_rows_total _ _ T2), <- Ha. apply conv_ext. intros m _. unfold trace. rewrite Code. reflexivity.
  - apply Z.ltb_lt in P. assert (D : 0 < 2 ^ (frac_of g a - frac v)) by (apply Z.pow_pos_nonneg; lia).
    apply (Rounded a Rounding Z.modulo); try exact D; auto.
    + intros m. rewrite Code. unfold code. apply Z.div_mod. lia.
  - apply andb_prop in P. destruct P as [_ P]. apply Z.ltb_lt in P.
    rewrite (surjective_pairing (chain g depth a)) in T.
    destruct (find (Rounding (fst (chain g depth a)) (frac_of g a - kept)) sources) as [s|] eqn:Es; [|discriminate].
    assert (Ha : (a < length g)%nat) by (specialize (O a (or_introl eq_refl)); lia).
    unfold holds. rewrite (same_rows_total _ _ T), total_place.
    rewrite (lost_term a kept Rounding (fun z => IZR (z mod 2 ^ (frac_of g a - kept))) s (under f) n Ha);
      [|reflexivity|reflexivity|exact Es].
    apply conv_ext. intros m _. unfold trace. rewrite Code. reflexivity.
  - apply Z.ltb_lt in P. assert (D : 0 < 2 ^ (frac_of g a - frac v)) by (apply Z.pow_pos_nonneg; lia).
    apply (Rounded a Truncation Z.rem); try exact D; auto.
    + intros m. rewrite Code. unfold code. apply Z.quot_rem. lia.
  - destruct (One a _ (or_introl eq_refl) T) as [h [T2 Ha]].
    unfold holds. rewrite (same_rows_total _ _ T2), <- Ha. apply conv_ext. intros m _. unfold trace. rewrite Code. reflexivity.
  - destruct (nth a forms None) as [h|] eqn:Eh; [|discriminate].
    apply andb_prop in T. destruct T as [T1 T2]. unfold holds.
    rewrite (same_rows_total _ _ T2), total_late, (same_conv _ _ T1).
    rewrite (conv_ext (under h) (trace g x i) (fun m => match m with O => 0%R | S j => trace g x a j end)).
    + rewrite (conv_late_one (under h) (trace g x a)). destruct n as [|m]; [reflexivity|].
      apply (Past m a ltac:(lia) (closed_spec k g i a C Hi Eo) h Eh).
    + intros m _. unfold trace. rewrite Code, before_code. destruct m; reflexivity.
Qed.

(* Sources stay in their ranges, where those that are codes of nodes do. *)
Lemma sources_within : forallb proper sources = true ->
  (forall i n, In (Of i) sources -> in_range g x i n) -> Forall2 within u (map (reach g) sources).
Proof.
  intros Hp Hr. unfold u. clear E. induction sources as [|s l IH]; simpl; constructor.
  - simpl in Hp. apply andb_prop in Hp. destruct Hp as [Hs _]. intros n. destruct s as [i|i b|i b]; cbn [reach drive fst snd].
    + specialize (Hr i n (or_introl eq_refl)). unfold in_range in Hr. split; apply IZR_le; lia.
    + apply Z.ltb_lt in Hs. assert (D : 0 < 2 ^ b) by (apply Z.pow_pos_nonneg; lia).
      pose proof (Z.mod_pos_bound (code g x i n) _ D). split; apply IZR_le; lia.
    + apply Z.ltb_lt in Hs. assert (D : 0 < 2 ^ b) by (apply Z.pow_pos_nonneg; lia).
      pose proof (Z.rem_bound_abs (code g x i n) (2 ^ b) ltac:(lia)) as B.
      generalize dependent (Z.rem (code g x i n) (2 ^ b)). intros z B. split; apply IZR_le; lia.
  - simpl in Hp. apply andb_prop in Hp. destruct Hp as [_ Hp]. apply IH; [exact Hp|].
    intros i n Hi. apply Hr. right. exact Hi.
Qed.
End Forms.

(* Forms from those of states and sources: a help to write less, as every form is checked. *)
Definition derived (g : graph) (sources : list source) (W : list (nat * form))
    (forms : list (option form)) (i : nat) (v : node) : option form :=
  let got a := nth a forms None in
  let up a := 2 ^ (frac v - frac_of g a) in
  let both a b s := match got a, got b with
    | Some f, Some h => Some (Form (under f) (add_rows (scale_rows (up a) (over f)) (scale_rows (s * up b) (over h))))
    | _, _ => None end in
  let rounded a kind := match got a with
    | Some f => let (root, k) := chain g depth a in
      match find (kind root (frac_of g a - frac v)) sources with
      | Some s => Some (Form (under f) (map (map (fun z => z / 2 ^ (frac_of g a - frac v)))
          (add_rows (over f) (place s (scale (-1) (delayed k (under f)))))))
      | None => None end
    | None => None end in
  match List.find (fun p => Nat.eqb i (fst p)) W with
  | Some p => Some (snd p)
  | None => match op v with
    | Add a b => both a b 1
    | Subtract a b => both a b (-1)
    | Scale a c _ => match got a with Some f => Some (Form (under f) (scale_rows c (over f))) | None => None end
    | Shift a _ | Bound a => got a
    | Floor a => rounded a Rounding
    | Truncate a => rounded a Truncation
    | _ => None end
  end.
Fixpoint fill (g : graph) (sources : list source) (W : list (nat * form))
    (forms : list (option form)) (rest : list node) : list (option form) :=
  match rest with
  | [] => forms
  | v :: rest' => fill g sources W (forms ++ [derived g sources W forms (length forms) v]) rest'
  end.
