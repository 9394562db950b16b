(* What makes a list of nodes a graph. Then each code obeys the equation of its node's operation, and what holds at all
   earlier ones holds for ever. *)
Require Import Bool ZArith List Lia. Import ListNotations.
From Sosmith Require Import Definitions.
Open Scope Z_scope.

Definition before (g : graph) (x : nat -> nat -> Z) (n : nat) : list Z :=
  match n with O => [] | S m => run g x m end.

(* Operands are before the node that takes them, but for a delay; binary points fit. Then each code obeys the equation
   of its operation. *)
Definition operands (o : operation) : list nat :=
  match o with
  | Input _ | Constant _ | Delay _ => []
  | Add a b | Subtract a b | Multiply a b => [a; b]
  | Scale a _ _ | Shift a _ | Floor a | Fraction a _ | Truncate a | Clamp a | Bound a | Wire a => [a]
  end.
Definition points (g : graph) (v : node) : bool :=
  let f := frac_of g in
  match op v with
  | Input _ | Constant _ => true
  | Add a b | Subtract a b => frac v =? Z.max (f a) (f b)
  | Multiply a b => frac v =? f a + f b
  | Scale a _ bits => frac v =? f a + bits
  | Shift a by_ => frac v =? f a - by_
  | Floor a | Truncate a => frac v <? f a
  | Fraction a kept => (frac v =? f a) && (kept <? f a)
  | Clamp a | Bound a | Wire a | Delay a => frac v =? f a
  end.
Definition ordered_at (g : graph) (i : nat) (v : node) : bool :=
  forallb (fun a => Nat.ltb a i) (operands (op v)) && points g v
  && match op v with Delay a => Nat.ltb a (length g) | _ => true end.
Fixpoint every (f : nat -> node -> bool) (i : nat) (rest : list node) : bool :=
  match rest with [] => true | v :: rest' => f i v && every f (S i) rest' end.
Definition ordered (g : graph) : bool := every (ordered_at g) 0 g.

Lemma every_spec f : forall rest i k, every f i rest = true -> (k < length rest)%nat ->
  f (i + k)%nat (nth k rest blank) = true.
Proof.
  induction rest as [|v rest IH]; simpl; intros i k H Hk; [lia|].
  apply andb_prop in H. destruct H as [H1 H2].
  destruct k as [|k]; [rewrite Nat.add_0_r; exact H1|].
  replace (i + S k)%nat with (S i + k)%nat by lia. apply IH; [exact H2|lia].
Qed.

(* A certificate lists stages, one behind another; for each the number of its nodes, and its outputs, counted from its first
   node. `laid_out` says that the graph has just these stages: the first one takes all inputs of the core, each later one by
   its wires what the one before it hands on, and no other node takes anything of another stage. *)
Definition layout := list (nat * list nat).
Definition takes (o : operation) : list nat := match o with Delay a => [a] | _ => operands o end.
Definition of_stage (first last : nat) (v : node) : bool :=
  match op v with Wire _ => true | o => forallb (fun a => Nat.leb first a && Nat.ltb a last) (takes o) end.
Definition inputs_in (l : list node) : list nat := flat_map (fun v => match op v with Input p => [p] | _ => [] end) l.
Definition wires_in (l : list node) : list nat := flat_map (fun v => match op v with Wire a => [a] | _ => [] end) l.
Fixpoint same_places (a b : list nat) : bool :=
  match a, b with [], [] => true | i :: a', j :: b' => Nat.eqb i j && same_places a' b' | _, _ => false end.
(* The outputs; for one that only passes through the stage, which nothing there takes, where it comes from. *)
Definition handed_on (first : nat) (l : list node) (outputs : list nat) : list nat :=
  map (fun o => let i := (first + o)%nat in
    match op (nth o l blank) with
    | Wire a => if existsb (fun v => existsb (Nat.eqb i) (takes (op v))) l then i else a
    | _ => i
    end) outputs.
Fixpoint laid_out (inputs wires : list nat) (first : nat) (stages : layout) (rest : list node) : bool :=
  match stages with
  | [] => match rest with [] => true | _ => false end
  | (size, outputs) :: others =>
      let l := firstn size rest in
      Nat.eqb (length l) size && same_places (inputs_in l) inputs && same_places (wires_in l) wires
      && forallb (of_stage first (first + size)) l && forallb (fun o => Nat.ltb o size) outputs
      && laid_out [] (handed_on first l outputs) (first + size) others (skipn size rest)
  end.
(* So every node can be computed, in the order of the list, and what the stages hand on is what the certificate says. *)
Definition well_formed (g : graph) (ports : list (Z * Z)) (stages : layout) : bool :=
  ordered g && every (fun _ v => low v <=? high v) 0 g && laid_out (seq 0 (length ports)) [] 0 stages g.
Lemma well_formed_ordered g ports stages : well_formed g ports stages = true -> ordered g = true.
Proof. unfold well_formed. intros H. apply andb_prop in H. destruct H as [H _]. apply andb_prop in H. apply H. Qed.

(* Computing the rest appends to what is there. *)
Lemma step_length g : forall rest now last inputs,
  length (step g rest now last inputs) = (length now + length rest)%nat.
Proof.
  induction rest as [|v rest IH]; simpl; intros; [lia|]. rewrite IH, app_length. simpl. lia.
Qed.
Lemma step_keeps g : forall rest now last inputs k, (k < length now)%nat ->
  nth k (step g rest now last inputs) 0 = nth k now 0.
Proof.
  induction rest as [|v rest IH]; simpl; intros now last inputs k H; [reflexivity|].
  rewrite IH by (rewrite app_length; simpl; lia). apply app_nth1, H.
Qed.
Lemma compute_ext g now now' last inputs v :
  (forall a, In a (operands (op v)) -> nth a now 0 = nth a now' 0) ->
  compute g now last inputs v = compute g now' last inputs v.
Proof.
  unfold compute. destruct (op v); simpl; intros H; try reflexivity;
    repeat match goal with |- context [nth ?a now 0] => rewrite (H a) by auto end; reflexivity.
Qed.
Lemma step_nth g : forall rest now last inputs k, (k < length rest)%nat ->
  (forall a, In a (operands (op (nth k rest blank))) -> (a < length now + k)%nat) ->
  nth (length now + k) (step g rest now last inputs) 0
  = compute g (step g rest now last inputs) last inputs (nth k rest blank).
Proof.
  induction rest as [|v rest IH]; simpl; intros now last inputs k Hk Ho; [lia|].
  destruct k as [|k].
  - rewrite Nat.add_0_r in *. rewrite step_keeps by (rewrite app_length; simpl; lia).
    rewrite app_nth2, Nat.sub_diag by lia. simpl. apply compute_ext. intros a Ha.
    specialize (Ho a Ha). rewrite step_keeps by (rewrite app_length; simpl; lia). rewrite app_nth1 by lia. reflexivity.
  - specialize (IH (now ++ [compute g now last inputs v]) last inputs k ltac:(lia)).
    rewrite app_length in IH. simpl in IH. replace (length now + S k)%nat with (length now + 1 + k)%nat by lia.
    apply IH. intros a Ha. specialize (Ho a Ha). lia.
Qed.

Section Codes.
Variables (g : graph) (x : nat -> nat -> Z).
Hypothesis G : ordered g = true.

Lemma ordered_node i : (i < length g)%nat -> ordered_at g i (nth i g blank) = true.
Proof. intros H. exact (every_spec _ g 0 i G H). Qed.
Lemma operands_before i a : (i < length g)%nat -> In a (operands (op (nth i g blank))) -> (a < i)%nat.
Proof.
  intros H Ha. pose proof (ordered_node i H) as O. unfold ordered_at in O.
  apply andb_prop in O. destruct O as [O _]. apply andb_prop in O. destruct O as [O _].
  rewrite forallb_forall in O. apply Nat.ltb_lt, O, Ha.
Qed.
Lemma points_fit i : (i < length g)%nat -> points g (nth i g blank) = true.
Proof.
  intros H. pose proof (ordered_node i H) as O. unfold ordered_at in O.
  apply andb_prop in O. destruct O as [O _]. apply andb_prop in O. apply O.
Qed.

(* The equation of each node, at each sample. *)
Theorem code_spec i n : (i < length g)%nat ->
  code g x i n = compute g (run g x n) (before g x n) (x n) (nth i g blank).
Proof.
  intros H. unfold code.
  assert (R : run g x n = step g g [] (before g x n) (x n)) by (destruct n; reflexivity).
  rewrite R at 1. pose proof (step_nth g g [] (before g x n) (x n) i H) as S. simpl in S.
  rewrite S, <- R; [reflexivity|]. intros a Ha. apply (operands_before i); assumption.
Qed.
Lemma before_code a n : nth a (before g x n) 0 = match n with O => 0 | S m => code g x a m end.
Proof. destruct n; simpl; [destruct a|]; reflexivity. Qed.

(* A property of codes that holds at each node when it holds at all nodes before it, and at all of the sample before,
   holds at all nodes and samples: induction over time and graph. *)
Lemma by_induction (P : nat -> nat -> Prop) :
  (forall n i, (i < length g)%nat -> (forall a, (a < i)%nat -> P a n) ->
    (forall m a, n = S m -> (a < length g)%nat -> P a m) -> P i n) ->
  forall n i, (i < length g)%nat -> P i n.
Proof.
  intros H. induction n as [n IHn] using lt_wf_ind.
  assert (Q : forall k i, (i < k)%nat -> (i < length g)%nat -> P i n).
  { induction k as [|k IHk]; intros i Hk Hi; [lia|].
    apply H; [exact Hi| |].
    - intros a Ha. apply IHk; lia.
    - intros m a -> Ha. apply IHn; [lia|exact Ha]. }
  intros i Hi. apply (Q (S i)); lia.
Qed.
End Codes.
