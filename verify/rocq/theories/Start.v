(* A filter that starts from its first sample: the stage before its sections hands on how much each sample differs from the
   first one, and the first one itself. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Graph Ranges Linear Cascade.
Open Scope Z_scope.

(* The nodes of such a stage, by their places:
     since = x * started, change = since - first, held = x - change;
     started is 1 from the second sample on, and first is `held` one sample later. *)
Record start := Start { sample_ : nat; started : nat; one_ : nat; first_ : nat; since : nat; difference : nat; change : nat;
  remainder : nat; held : nat }.
Definition op_eqb (a b : operation) : bool :=
  match a, b with
  | Constant c, Constant d => c =? d
  | Subtract c d, Subtract e f | Multiply c d, Multiply e f => Nat.eqb c e && Nat.eqb d f
  | Bound c, Bound d | Delay c, Delay d => Nat.eqb c d
  | _, _ => false
  end.
Lemma op_eqb_eq a b : op_eqb a b = true -> a = b.
Proof.
  destruct a, b; cbn [op_eqb]; try discriminate; intros H; try (apply andb_prop in H; destruct H as [H Hb]; apply Nat.eqb_eq in Hb; subst);
    try (apply Nat.eqb_eq in H); try (apply Z.eqb_eq in H); subst; reflexivity.
Qed.
Definition starts (g : graph) (s : start) : bool :=
  let is i o := Nat.ltb i (length g) && op_eqb (op (nth i g blank)) o in
  let same i := frac_of g i =? frac_of g (sample_ s) in
  is (started s) (Delay (one_ s)) && is (one_ s) (Constant 1) && is (first_ s) (Delay (held s))
  && (is (since s) (Multiply (sample_ s) (started s)) || is (since s) (Multiply (started s) (sample_ s)))
  && is (difference s) (Subtract (since s) (first_ s)) && is (change s) (Bound (difference s))
  && is (remainder s) (Subtract (sample_ s) (change s)) && is (held s) (Bound (remainder s))
  && same (since s) && same (first_ s) && same (difference s) && same (change s) && same (remainder s).

Theorem started_from g x s : ordered g = true -> starts g s = true -> forall n,
  code g x (change s) n = code g x (sample_ s) n - code g x (sample_ s) 0 /\ code g x (held s) n = code g x (sample_ s) 0.
Proof.
  intros G H. unfold starts in H.
  repeat match type of H with _ && _ = true => let X := fresh "X" in apply andb_prop in H; destruct H as [H X] end.
  assert (Code : forall i o n, Nat.ltb i (length g) && op_eqb (op (nth i g blank)) o = true ->
    (i < length g)%nat /\ op (nth i g blank) = o
    /\ code g x i n = compute g (run g x n) (before g x n) (x n) (nth i g blank)).
  { intros i o n Hi. apply andb_prop in Hi. destruct Hi as [Hl Ho]. apply Nat.ltb_lt in Hl. apply op_eqb_eq in Ho.
    split; [exact Hl|]. split; [exact Ho|]. apply (code_spec g x G i n Hl). }
  apply Z.eqb_eq in X, X0, X1, X2, X3.
  set (f := frac_of g (sample_ s)) in *.
  assert (Start_ : forall n, code g x (started s) n = match n with O => 0 | S _ => 1 end).
  { intros n. destruct (Code _ _ n (andb_true_intro (conj H X11))) as [_ [Ho Hc]]. rewrite Hc. unfold compute. rewrite Ho, before_code. destruct n as [|m]; [reflexivity|].
    destruct (Code _ _ m X10) as [_ [Ho1 Hc1]]. rewrite Hc1. unfold compute. rewrite Ho1. reflexivity. }
  assert (First : forall n, code g x (first_ s) n = match n with O => 0 | S m => code g x (held s) m end).
  { intros n. destruct (Code _ _ n X9) as [_ [Ho Hc]]. rewrite Hc. unfold compute. rewrite Ho, before_code. reflexivity. }
  assert (Since : forall n, code g x (since s) n = code g x (sample_ s) n * code g x (started s) n).
  { intros n. apply orb_prop in X8. destruct X8 as [Y|Y]; destruct (Code _ _ n Y) as [_ [Ho Hc]]; rewrite Hc; unfold compute; rewrite Ho;
      unfold code; ring. }
  assert (Sub : forall i a b n, Nat.ltb i (length g) && op_eqb (op (nth i g blank)) (Subtract a b) = true ->
    frac_of g i = f -> frac_of g a = f -> frac_of g b = f -> code g x i n = code g x a n - code g x b n).
  { intros i a b n Hi F1 F2 F3. destruct (Code _ _ n Hi) as [_ [Ho Hc]]. rewrite Hc. unfold compute. rewrite Ho.
    change (frac (nth i g blank)) with (frac_of g i). rewrite F1, F2, F3, Z.sub_diag. unfold code. change (2 ^ 0) with 1. ring. }
  assert (Pass : forall i a n, Nat.ltb i (length g) && op_eqb (op (nth i g blank)) (Bound a) = true -> code g x i n = code g x a n).
  { intros i a n Hi. destruct (Code _ _ n Hi) as [_ [Ho Hc]]. rewrite Hc. unfold compute. rewrite Ho. reflexivity. }
  assert (Change : forall n, code g x (change s) n = code g x (sample_ s) n * code g x (started s) n - code g x (first_ s) n).
  { intros n. rewrite (Pass _ _ n X6), (Sub _ _ _ n X7) by assumption. rewrite Since. reflexivity. }
  assert (Held : forall n, code g x (held s) n = code g x (sample_ s) n - code g x (change s) n).
  { intros n. rewrite (Pass _ _ n X4), (Sub _ _ _ n X5) by (assumption || reflexivity). reflexivity. }
  induction n as [|n [_ IH]].
  - rewrite Held, Change, Start_, First. lia.
  - rewrite Held, Change, Start_, First, IH. lia.
Qed.

(* Its ranges, and the windows of what it hands on to the wire w. *)
Definition span (g : graph) (s : start) : Z := high (nth (sample_ s) g blank) - low (nth (sample_ s) g blank).
Definition start_fits (g : graph) (s : start) : bool :=
  let node i := nth i g blank in
  starts g s && (low (node (change s)) <=? - span g s) && (span g s <=? high (node (change s)))
  && (low (node (held s)) <=? low (node (sample_ s))) && (high (node (sample_ s)) <=? high (node (held s))).
Lemma start_fits_starts g s : start_fits g s = true -> starts g s = true.
Proof.
  unfold start_fits. intros H. repeat (apply andb_prop in H; destruct H as [H _]; try exact H).
Qed.
Definition is_wire (g : graph) (w a : nat) : bool :=
  Nat.ltb w (length g) && match op (nth w g blank) with Wire b => Nat.eqb a b | _ => false end.
Lemma wire_code g x w a n : ordered g = true -> is_wire g w a = true -> code g x w n = code g x a n.
Proof.
  unfold is_wire. intros G H. apply andb_prop in H. destruct H as [H1 H2]. apply Nat.ltb_lt in H1.
  rewrite (code_spec g x G w n H1). unfold compute. destruct (op (nth w g blank)); try discriminate.
  apply Nat.eqb_eq in H2. subst. reflexivity.
Qed.
Lemma start_entry g x s w n : ordered g = true -> starts g s = true -> code g x w n = code g x (change s) n ->
  (IZR (code g x w n) = IZR (code g x (sample_ s) n) - IZR (code g x (sample_ s) 0))%R.
Proof. intros G H W. rewrite W. destruct (started_from g x s G H n) as [C _]. rewrite C. apply minus_IZR. Qed.
Theorem start_ranges g x s : ordered g = true -> start_fits g s = true -> (forall n, in_range g x (sample_ s) n) ->
  forall t n, In t [change s; held s] -> in_range g x t n.
Proof.
  intros G H R t n Ht. unfold start_fits, span in H.
  repeat match type of H with _ && _ = true => let X := fresh "X" in apply andb_prop in H; destruct H as [H X] end.
  apply Z.leb_le in X, X0, X1, X2. destruct (started_from g x s G H n) as [C Hd].
  assert (R0 := R O). assert (Rn := R n). unfold in_range in *.
  destruct Ht as [<-|[<-|[]]]; lia.
Qed.

Definition windows_of (g : graph) (s : start) (w : nat) : windows := Some (w, (0, span g s), (- span g s, 0)).
Theorem start_windows g x s w : ordered g = true -> starts g s = true -> (forall n, in_range g x (sample_ s) n) ->
  (forall n, code g x w n = code g x (change s) n) -> window_holds g x (windows_of g s w).
Proof.
  intros G H R Hw. unfold windows_of, window_holds, span.
  set (lo := low (nth (sample_ s) g blank)) in *. set (hi := high (nth (sample_ s) g blank)) in *.
  assert (Between : forall n, (IZR lo <= IZR (code g x (sample_ s) n) <= IZR hi)%R).
  { intros n. specialize (R n). unfold in_range in R. fold lo in R. fold hi in R. split; apply IZR_le; lia. }
  assert (B0 := Between O). set (x0 := IZR (code g x (sample_ s) 0)) in *.
  assert (T : forall n, trace g x w n = (IZR (code g x (sample_ s) n) - x0)%R).
  { intros n. unfold trace, x0. rewrite Hw. destruct (started_from g x s G H n) as [C _]. rewrite C. apply minus_IZR. }
  destruct (Rle_lt_dec (IZR hi) (IZR lo)) as [Deg|Pos].
  - exists 0%R, (trace g x w), (trace g x w). split; [lra|]. repeat split; cbn [fst snd]; try (intros; ring); rewrite ?T, ?opp_IZR, ?minus_IZR;
      specialize (Between n); lra.
  - exists ((x0 - IZR lo) / (IZR hi - IZR lo))%R.
    exists (fun n => IZR (code g x (sample_ s) n) - IZR lo)%R, (fun n => IZR (code g x (sample_ s) n) - IZR hi)%R.
    split; [|split; [|split]].
    + split.
      * apply Rmult_le_pos; [lra|]. left. apply Rinv_0_lt_compat. lra.
      * apply Rmult_le_reg_r with (IZR hi - IZR lo)%R; [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra.
    + intros n. cbn [fst snd]. rewrite minus_IZR. specialize (Between n). lra.
    + intros n. cbn [fst snd]. rewrite opp_IZR, minus_IZR. specialize (Between n). lra.
    + intros n. rewrite T. field. lra.
Qed.
