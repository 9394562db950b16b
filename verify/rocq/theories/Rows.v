(* Rows of numerators as products: for each source a sum of c Q, with short c and the long responses Q that they share.

   A row stands for the list of its expanded products (`rows`), which is computed for one source at a time, where it is
   needed at all. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses Graph Ranges Linear.
Open Scope Z_scope.

Definition row := list (list (list Z * list Z)).
Definition expanded (l : list (list Z * list Z)) : list Z := fold_right (fun p rest => add (product (fst p) (snd p)) rest) [] l.
Definition rows (r : row) : list (list Z) := map expanded r.
Lemma expanded_cons p l : expanded (p :: l) = add (product (fst p) (snd p)) (expanded l).
Proof. reflexivity. Qed.

Fixpoint join (A B : row) : row := match A, B with [], _ => B | _, [] => A | a :: A', b :: B' => (a ++ b) :: join A' B' end.
Definition times_row (k : Z) (r : row) : row := map (map (fun p => (scale k (fst p), snd p))) r.
Definition of_form (N : list (list Z)) (Q : list Z) : row := map (fun c => match c with [] => [] | _ => [(c, Q)] end) N.
Fixpoint without {A} (s : nat) (r : list (list A)) : list (list A) :=
  match r, s with [], _ => [] | _ :: r', O => [] :: r' | c :: r', S s' => c :: without s' r' end.

Lemma conv_expanded_app a : forall b u n, conv (expanded (a ++ b)) u n = (conv (expanded a) u n + conv (expanded b) u n)%R.
Proof.
  induction a as [|p a IH]; intros b u n; [change (expanded []) with (@nil Z); cbn [app conv]; ring|].
  rewrite <- app_comm_cons, !expanded_cons, !conv_add, IH. ring.
Qed.
Lemma conv_expanded_one c Q u n : conv (expanded [(c, Q)]) u n = conv Q (conv c u) n.
Proof. rewrite expanded_cons, conv_add, conv_product. cbn [expanded fold_right conv fst snd]. ring. Qed.
Lemma total_join A : forall B u n, total (rows (join A B)) u n = (total (rows A) u n + total (rows B) u n)%R.
Proof.
  induction A as [|a A IH]; intros [|b B] [|x u] n; cbn [join rows map total]; try ring.
  fold (rows (join A B)). fold (rows A). fold (rows B). rewrite conv_expanded_app, IH. ring.
Qed.
Lemma total_times_row k r : forall u n, total (rows (times_row k r)) u n = (IZR k * total (rows r) u n)%R.
Proof.
  induction r as [|l r IH]; intros [|x u] n; cbn [times_row rows map total]; try ring.
  fold (times_row k r). fold (rows (times_row k r)). fold (rows r). rewrite IH.
  assert (E : conv (expanded (map (fun p => (scale k (fst p), snd p)) l)) x n = (IZR k * conv (expanded l) x n)%R).
  { induction l as [|p l IHl]; cbn [map]; [cbn [expanded fold_right conv]; ring|].
    rewrite !expanded_cons, !conv_add, IHl, !conv_product. cbn [fst snd].
    rewrite (conv_ext (snd p) _ (fun m => IZR k * conv (fst p) x m)%R) by (intros; apply conv_scale). rewrite conv_multiple. ring. }
  rewrite E. ring.
Qed.
Lemma total_of_form N Q : forall u n, total (rows (of_form N Q)) u n = conv Q (total N u) n.
Proof.
  induction N as [|c N IH]; intros [|x u] n; cbn [of_form rows map total]; try (symmetry; apply conv_zero).
  fold (of_form N Q). fold (rows (of_form N Q)). rewrite IH, (conv_plus Q (conv c x)). f_equal.
  destruct c as [|k c]; [cbn [expanded fold_right conv]; symmetry; apply conv_zero|apply conv_expanded_one].
Qed.
Lemma rows_without s : forall r, rows (without s r) = without s (rows r).
Proof. induction s as [|s IH]; intros [|l r]; cbn [without rows map]; try reflexivity. f_equal. apply IH. Qed.
Lemma rows_place s l : rows (place s l) = place s (expanded l).
Proof. induction s as [|s IH]; cbn [place rows map]; [reflexivity|]. f_equal. exact IH. Qed.
Lemma rows_nth s r : nth s (rows r) [] = expanded (nth s r []).
Proof. exact (map_nth expanded r [] s). Qed.
Lemma total_without s : forall r u n,
  total r u n = (total (without s r) u n + conv (nth s r []) (nth s u (fun _ => 0%R)) n)%R.
Proof.
  induction s as [|s IH]; intros [|c r] [|x u] n; cbn [without total nth conv]; rewrite ?conv_zero; try ring.
  rewrite (IH r u n). ring.
Qed.

(* How large the row and its opposite can get, for values of the sources in ranges that contain 0. *)
Definition sums (l : list (list Z * list Z)) : Z * Z :=
  match l with [(c, Q)] => signs_of_product c Q | _ => by_sign (expanded l) 0 0 end.
Definition opposite (s : Z * Z) : Z * Z := (- snd s, - fst s).
Fixpoint dot (s b : list (Z * Z)) : Z :=
  match s, b with p :: s', x :: b' => fst p * snd x + snd p * fst x + dot s' b' | _, _ => 0 end.

Lemma add_nothing l : add l [] = l.
Proof. destruct l; reflexivity. Qed.
Lemma sums_is l : sums l = by_sign (expanded l) 0 0.
Proof.
  destruct l as [|[c Q] [|p l]]; try reflexivity. cbn [sums expanded fold_right fst snd].
  rewrite signs_of_product_is, add_nothing. reflexivity.
Qed.
Lemma total_dot r : forall u b n, forallb has_zero b = true -> Forall2 within u b ->
  (total (rows r) u n <= IZR (dot (map sums r) b))%R /\ (- total (rows r) u n <= IZR (dot (map opposite (map sums r)) b))%R.
Proof.
  induction r as [|l r IH]; intros u b n Z0 H; cbn [rows map total dot]; [lra|].
  destruct H as [|x y u b Hx H]; [lra|]. cbn [forallb] in Z0. apply andb_prop in Z0. destruct Z0 as [Z1 Z2].
  fold (rows r). destruct (IH u b n Z2 H) as [A B]. rewrite sums_is. cbn [opposite fst snd].
  pose proof (conv_signs (expanded l) x y n Z1 Hx). pose proof (conv_signs_opposite (expanded l) x y n Z1 Hx). rewrite !(plus_IZR _ (dot _ _)). lra.
Qed.

(* A constant that is added before a rounding acts as the rounding does, times m: so the two are one source, in a range that
   is m constants further, and that contains 0 where the constant is a half. `b` and `c` are the ranges of two windows. *)
Fixpoint multiple (c d : list Z) : Z := match c, d with x :: c', y :: d' => if y =? 0 then multiple c' d' else x / y | _, _ => 0 end.
Definition moved (m : Z) (x : Z * Z) : Z * Z := (fst x + m, snd x + m).
Fixpoint absorb (k : Z) (l Q : list Z) (r : row) (b c : list (Z * Z)) : option (list (Z * Z) * list (Z * Z)) :=
  match r, b, c with
  | h :: r', x :: b', y :: c' =>
      let further := match absorb k l Q r' b' c' with Some (p, q) => Some (x :: p, y :: q) | None => None end in
      match h with
      | [(l', Q')] =>
          let m := multiple l l' in
          if same l (scale m l') && same Q Q' then Some (moved (m * k) x :: b', moved (m * k) y :: c') else further
      | _ => further
      end
  | _, _, _ => None
  end.
Definition absorbed (h : list (list Z * list Z)) (x y : Z * Z) (r : row) (b c : list (Z * Z)) :=
  match h with
  | [(l, Q)] => if (fst x =? snd x) && (fst y =? fst x) && (snd y =? fst x) then absorb (fst x) l Q r b c else None
  | _ => None
  end.
Fixpoint merged (r : row) (b c : list (Z * Z)) : row * list (Z * Z) * list (Z * Z) :=
  match r, b, c with
  | h :: r', x :: b', y :: c' =>
      match absorbed h x y r' b' c' with
      | Some (p, q) => merged r' p q
      | None => let (sp, q) := merged r' b' c' in let (s, p) := sp in (h :: s, x :: p, y :: q)
      end
  | _, _, _ => ([], [], [])
  end.

(* The same sums, of other sequences in their ranges. *)
Definition as_well (r s : row) (extra : nat -> R) (b p : list (Z * Z)) : Prop := forall u, Forall2 within u b ->
  exists v, Forall2 within v p /\ forall n, total (rows s) v n = (extra n + total (rows r) u n)%R.
Lemma as_well_further h x r s e b p : as_well r s e b p -> as_well (h :: r) (h :: s) e (x :: b) (x :: p).
Proof.
  intros H u U. inversion U as [|y z u' b' Y U' E1 E2]. subst. destruct (H u' U') as [v [V T]]. exists (y :: v).
  split; [constructor; assumption|]. intros n. cbn [rows map total]. fold (rows r). fold (rows s). rewrite T. ring.
Qed.
Lemma as_well_moved k l Q l' Q' m x r b : same l (scale m l') = true -> same Q Q' = true ->
  as_well ([(l', Q')] :: r) ([(l', Q')] :: r) (fun n => conv Q (conv l (fun _ => IZR k)) n) (x :: b) (moved (m * k) x :: b).
Proof.
  intros L E u U. inversion U as [|y z u' b' Y U' E1 E2]. subst. exists ((fun n => y n + IZR (m * k))%R :: u'). split.
  - constructor; [|exact U']. intros n. cbn [moved fst snd]. rewrite !(plus_IZR _ (m * k)). specialize (Y n). lra.
  - intros n. cbn [rows map total]. rewrite !conv_expanded_one, <- !(same_conv Q Q' E).
    rewrite (conv_ext Q (conv l (fun _ => IZR k)) (conv l' (fun _ => IZR (m * k)))).
    + rewrite (conv_ext Q (conv l' (fun n0 => y n0 + IZR (m * k))%R) (fun j => conv l' y j + conv l' (fun _ => IZR (m * k)) j)%R)
        by (intros; apply (conv_plus l' y (fun _ => IZR (m * k)))).
      rewrite conv_plus. ring.
    + intros j _. rewrite (same_conv l _ L), conv_scale, <- conv_multiple. apply conv_ext. intros. rewrite mult_IZR. ring.
Qed.
Lemma absorb_spec k l Q : forall r b c p q, absorb k l Q r b c = Some (p, q) ->
  let e := fun n => conv Q (conv l (fun _ => IZR k)) n in
  as_well r r e b p /\ as_well r r e c q /\ length p = length b /\ length q = length c.
Proof.
  induction r as [|h r IH]; intros [|x b] [|y c] p q; cbn [absorb]; try discriminate. intros H.
  set (e := fun n : nat => conv Q (conv l (fun _ : nat => IZR k)) n).
  assert (Further : match absorb k l Q r b c with Some (p, q) => Some (x :: p, y :: q) | None => None end = Some (p, q) ->
    as_well (h :: r) (h :: r) e (x :: b) p /\ as_well (h :: r) (h :: r) e (y :: c) q
    /\ length p = length (x :: b) /\ length q = length (y :: c)).
  { destruct (absorb k l Q r b c) as [[p' q']|] eqn:E; [|discriminate]. intros X. injection X as <- <-.
    destruct (IH b c p' q' E) as [A [B [Lp Lq]]]. cbn [length]. rewrite Lp, Lq.
    split; [apply as_well_further; exact A|split; [apply as_well_further; exact B|split; reflexivity]]. }
  destruct h as [|[l' Q'] [|two h]]; [apply Further; exact H| |apply Further; exact H].
  destruct (same l (scale (multiple l l') l') && same Q Q') eqn:E; [|apply Further; exact H].
  apply andb_prop in E. destruct E as [E1 E2]. injection H as <- <-. cbn [length].
  split; [apply as_well_moved; assumption|split; [apply as_well_moved; assumption|split; reflexivity]].
Qed.
Lemma as_well_dropped l Q x k r s b p : fst x = k -> snd x = k ->
  as_well r r (fun n => conv Q (conv l (fun _ => IZR k)) n) b p -> forall q, as_well r s (fun _ => 0%R) p q ->
  as_well ([(l, Q)] :: r) s (fun _ => 0%R) (x :: b) q.
Proof.
  intros F S A q B u U. inversion U as [|y z u' b' Y U' E1 E2]. subst. destruct (A u' U') as [v [V T]].
  destruct (B v V) as [w [W T2]]. exists w. split; [exact W|]. intros n. rewrite T2, T. cbn [rows map total]. fold (rows r).
  rewrite conv_expanded_one, !Rplus_0_l. f_equal. apply conv_ext. intros j _. apply conv_ext. intros i _.
  specialize (Y i). rewrite S in Y. lra.
Qed.
Lemma merged_spec : forall r b c s p q, length b = length c -> merged r b c = (s, p, q) ->
  as_well r s (fun _ => 0%R) b p /\ as_well r s (fun _ => 0%R) c q.
Proof.
  induction r as [|h r IH]; intros b c s p q Len.
  - cbn [merged]. intros H. injection H as <- <- <-.
    split; intros u U; exists []; (split; [constructor|intros; simpl; ring]).
  - destruct b as [|x b], c as [|y c]; try discriminate; cbn [merged].
    + intros H. injection H as <- <- <-.
      split; intros u U; inversion U; exists []; (split; [constructor|intros; simpl; ring]).
    + injection Len as Len. destruct (absorbed h x y r b c) as [[p1 q1]|] eqn:E.
      * unfold absorbed in E. destruct h as [|[l Q] [|two h]]; try discriminate.
        destruct ((fst x =? snd x) && (fst y =? fst x) && (snd y =? fst x)) eqn:Ex; [|discriminate].
        apply andb_prop in Ex. destruct Ex as [Ex E3]. apply andb_prop in Ex. destruct Ex as [E1 E2].
        apply Z.eqb_eq in E1. apply Z.eqb_eq in E2. apply Z.eqb_eq in E3.
        destruct (absorb_spec _ _ _ _ _ _ _ _ E) as [A [B [Lp Lq]]]. intros H.
        destruct (IH p1 q1 s p q ltac:(congruence) H) as [C D].
        split; [apply (as_well_dropped l Q x (fst x) r s b p1)|apply (as_well_dropped l Q y (fst x) r s c q1)]; try assumption;
          try reflexivity; symmetry; assumption.
      * destruct (merged r b c) as [[s' p'] q'] eqn:Em. intros H. injection H as <- <- <-.
        destruct (IH b c s' p' q' Len Em) as [C D]. split; apply as_well_further; assumption.
Qed.
