(* Filters in a row, each of which works on what the hardware of the one before gives, or on every r-th of that: how far the
   last one is from the exact filters in a row.

   Let w be what the exact filters behind a stage make of what the hardware has there. From one stage to the next, w changes
   by no more than the error of the stage times the gain of the filters behind it, and at the end it is the output. A stage
   between limits nothing if its range holds the exact value and all errors that have been made before it. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Rates Streams Responses Exact Bound.
Open Scope Z_scope.

Definition sections := list (list Z * list Z).
Definition begins (steady : bool) (u : nat -> R) : signal := after (if steady then u O else 0%R) u.

(* The exact filter: it sees values alone, can be split, and is linear. *)
Lemma exact_ext S : forall x x' y y', (forall k, x k = x' k) -> (forall k, y k = y' k) -> exact_filter S x y -> exact_filter S x' y'.
Proof.
  induction S as [|[B A] S IH]; intros x x' y y' X Y; cbn [exact_filter].
  - intros E k. rewrite <- X, <- Y. apply E.
  - intros [m [C [E F]]]. exists m. split; [exact C|split].
    + intros k. rewrite E. apply taps_ext. intros j _. apply X.
    + apply (IH m m y y'); [intros; reflexivity|exact Y|exact F].
Qed.
Lemma exact_app S : forall T x y, exact_filter (S ++ T) x y -> exists m, exact_filter S x m /\ exact_filter T m y.
Proof.
  induction S as [|[B A] S IH]; intros T x y; cbn [app exact_filter].
  - intros E. exists x. split; [intros k; reflexivity|exact E].
  - intros [m [C [E F]]]. destruct (IH T m y F) as [n [N1 N2]]. exists n. split; [exists m; auto|exact N2].
Qed.
Lemma exact_joined S : forall T x m y, exact_filter S x m -> exact_filter T m y -> exact_filter (S ++ T) x y.
Proof.
  induction S as [|[B A] S IH]; intros T x m y; cbn [app exact_filter].
  - intros E F. apply (exact_ext T m x y y); auto.
  - intros [n [C [E F]]] G. exists n. split; [exact C|split; [exact E|exact (IH T n m y F G)]].
Qed.
Lemma taps_minus l : forall u v k, taps l (fun j => u j - v j)%R k = (taps l u k - taps l v k)%R.
Proof. induction l as [|c l IH]; intros u v k; cbn [taps]; [ring|]. rewrite IH. ring. Qed.
Lemma exact_difference S : forall x1 y1 x2 y2, exact_filter S x1 y1 -> exact_filter S x2 y2 ->
  exact_filter S (fun k => x1 k - x2 k)%R (fun k => y1 k - y2 k)%R.
Proof.
  induction S as [|[B A] S IH]; intros x1 y1 x2 y2; cbn [exact_filter].
  - intros E F k. rewrite E, F. reflexivity.
  - intros [m [[s C] [E F]]] [n [[t D] [G Q]]]. exists (fun k => m k - n k)%R. split; [|split].
    + exists (s - t)%R. intros k K. rewrite C, D by exact K. reflexivity.
    + intros k. rewrite !taps_minus, E, G. reflexivity.
    + apply IH; assumption.
Qed.

(* Whatever is constant before sample 0 has an output, if no denominator begins with 0, or is 0 at zero frequency. *)
Definition sound (S : sections) : bool :=
  forallb (fun s => match snd s with a :: A => negb (a =? 0) && negb (sum (a :: A) =? 0) | [] => false end) S.
Lemma sound_app S T : sound (S ++ T) = true -> sound S = true /\ sound T = true.
Proof. unfold sound. rewrite forallb_app. intros H. apply andb_prop in H. exact H. Qed.

Fixpoint dot (A : list Z) (h : list R) (c : R) : R :=
  match A with [] => 0%R | q :: A' => (IZR q * hd c h + dot A' (tl h) c)%R end.
Fixpoint history (a : Z) (A : list Z) (c : R) (v : nat -> R) (n : nat) : list R :=
  match n with O => [] | S m => let h := history a A c v m in ((v m - dot A h c) / IZR a)%R :: h end.
Definition solution a A c v : signal := fun k => if k <? 0 then c else hd c (history a A c v (S (Z.to_nat k))).

Lemma constant_taps l u c k : (forall j, j <= k -> u j = c) -> taps l u k = (IZR (sum l) * c)%R.
Proof. intros H. rewrite (taps_ext l u (fun _ => c)) by exact H. apply taps_constant. Qed.
Lemma solution_before a A c v k : k < 0 -> solution a A c v k = c.
Proof. intros H. unfold solution. apply Z.ltb_lt in H. rewrite H. reflexivity. Qed.
Lemma dot_nil A c : dot A [] c = (IZR (sum A) * c)%R.
Proof. induction A as [|q A IH]; cbn [dot sum hd tl]; [ring|]. rewrite IH, plus_IZR. ring. Qed.
Lemma dot_history a A c v L : forall n, dot L (history a A c v n) c = taps L (solution a A c v) (Z.of_nat n - 1).
Proof.
  induction L as [|q L IH]; intros n; [reflexivity|]. destruct n as [|p].
  - cbn [history]. rewrite dot_nil. symmetry. apply constant_taps. intros j J. apply solution_before. lia.
  - cbn [dot taps]. replace (Z.of_nat (S p) - 1) with (Z.of_nat p) by lia. f_equal.
    + f_equal. unfold solution. destruct (Z.ltb_spec (Z.of_nat p) 0) as [N|_]; [lia|]. rewrite Nat2Z.id. reflexivity.
    + cbn [history tl]. apply IH.
Qed.
Lemma section_exists B a A x : a <> 0 -> sum (a :: A) <> 0 -> constant_before x ->
  exists m, constant_before m /\ forall k, taps (a :: A) m k = taps B x k.
Proof.
  intros A0 S0 [s X]. set (c := (IZR (sum B) * s / IZR (sum (a :: A)))%R).
  assert (a0 : IZR a <> 0%R) by (intros E; apply A0, eq_IZR, E).
  assert (s0 : IZR (sum (a :: A)) <> 0%R) by (intros E; apply S0, eq_IZR, E).
  exists (solution a A c (fun n => taps B x (Z.of_nat n))). split; [exists c; intros k K; apply solution_before, K|].
  intros k. destruct (Z.ltb_spec k 0) as [K|K].
  - rewrite (constant_taps (a :: A) _ c) by (intros j J; apply solution_before; lia).
    rewrite (constant_taps B x s) by (intros j J; apply X; lia). unfold c. field. exact s0.
  - rewrite <- (Z2Nat.id k K). set (n := Z.to_nat k). cbn [taps]. rewrite <- dot_history.
    unfold solution at 1. destruct (Z.ltb_spec (Z.of_nat n) 0) as [N|_]; [lia|]. rewrite Nat2Z.id. cbn [history hd]. field. exact a0.
Qed.
Lemma exact_exists S : forall x, sound S = true -> constant_before x -> exists y, exact_filter S x y.
Proof.
  induction S as [|[B A] S IH]; intros x H X.
  - exists x. intros k. reflexivity.
  - cbn [sound forallb snd] in H. apply andb_prop in H. destruct H as [H T]. destruct A as [|a A]; [discriminate|].
    apply andb_prop in H. destruct H as [H1 H2]. apply negb_true_iff, Z.eqb_neq in H1. apply negb_true_iff, Z.eqb_neq in H2.
    destruct (section_exists B a A x H1 H2 X) as [m [C E]]. destruct (IH m T C) as [y Y]. exists y. exists m. auto.
Qed.

(* As long as the input is as before sample 0, so is the output. *)
Lemma steady_until S : forall x y s, sound S = true -> (forall k, k <= 0 -> x k = s) -> exact_filter S x y ->
  exists c, forall k, k <= 0 -> y k = c.
Proof.
  induction S as [|[B A] S IH]; intros x y s H X; cbn [exact_filter].
  - intros E. exists s. intros k K. rewrite E. apply X, K.
  - intros [m [[c C] [E F]]]. cbn [sound forallb snd] in H. apply andb_prop in H. destruct H as [H T].
    destruct A as [|a A]; [discriminate|]. apply andb_prop in H. destruct H as [H1 _]. apply negb_true_iff, Z.eqb_neq in H1.
    assert (a0 : IZR a <> 0%R) by (intros Z0; apply H1, eq_IZR, Z0).
    assert (M0 : m 0 = c).
    { pose proof (E (-1)) as E1. pose proof (E 0) as E0.
      rewrite (constant_taps B x s) in E1, E0 by (intros j J; apply X; lia).
      rewrite (constant_taps (a :: A) m c) in E1 by (intros j J; apply C; lia).
      cbn [taps] in E0. rewrite (constant_taps A m c) in E0 by (intros j J; apply C; lia).
      rewrite <- E1 in E0. cbn [sum] in E0. rewrite plus_IZR in E0.
      apply (Rmult_eq_reg_l (IZR a)); [lra|exact a0]. }
    apply (IH m y c T); [|exact F]. intros k K. destruct (Z.eq_dec k 0) as [->|N]; [exact M0|apply C; lia].
Qed.
Lemma silent_before S : forall x y, sound S = true -> (forall k, k < 0 -> x k = 0%R) -> exact_filter S x y ->
  forall k, k < 0 -> y k = 0%R.
Proof.
  induction S as [|[B A] S IH]; intros x y H X; cbn [exact_filter].
  - intros E k K. rewrite E. apply X, K.
  - intros [m [[c C] [E F]]]. cbn [sound forallb snd] in H. apply andb_prop in H. destruct H as [H T].
    destruct A as [|a A]; [discriminate|]. apply andb_prop in H. destruct H as [_ H2]. apply negb_true_iff, Z.eqb_neq in H2.
    apply (IH m y T); [|exact F]. intros k K. rewrite C by exact K.
    pose proof (E (-1)) as E1. rewrite (constant_taps (a :: A) m c) in E1 by (intros j J; apply C; lia).
    rewrite (constant_taps B x 0) in E1 by (intros j J; apply X; lia). rewrite Rmult_0_r in E1.
    apply Rmult_integral in E1. destruct E1 as [Z0|Z0]; [exfalso; apply H2, eq_IZR, Z0|exact Z0].
Qed.

(* The output is what the input makes it, and constant before sample 0 with it. *)
Lemma section_unique a A m : a <> 0 -> sum (a :: A) <> 0 -> constant_before m -> (forall k, taps (a :: A) m k = 0%R) -> forall k, m k = 0%R.
Proof.
  intros A0 S0 [c C] E.
  assert (c0 : c = 0%R).
  { pose proof (E (-1)) as E1. rewrite (constant_taps (a :: A) m c) in E1 by (intros j J; apply C; lia).
    apply Rmult_integral in E1. destruct E1 as [Z0|Z0]; [exfalso; apply S0, eq_IZR, Z0|exact Z0]. }
  assert (H : forall n : nat, forall k, k < Z.of_nat n -> m k = 0%R).
  { induction n as [|n IH]; intros k K; [rewrite C by (simpl in K; lia); exact c0|].
    destruct (Z.eq_dec k (Z.of_nat n)) as [->|N]; [|apply IH; lia].
    specialize (E (Z.of_nat n)). cbn [taps] in E. rewrite (taps_silent A m) in E by (intros j J; apply IH; lia).
    rewrite Rplus_0_r in E. apply Rmult_integral in E. destruct E as [Z0|Z0]; [exfalso; apply A0, eq_IZR, Z0|exact Z0]. }
  intros k. apply (H (S (Z.to_nat (Z.max 0 k)))). lia.
Qed.
Lemma exact_unique S : forall x y y', sound S = true -> exact_filter S x y -> exact_filter S x y' -> forall k, y k = y' k.
Proof.
  induction S as [|[B A] S IH]; intros x y y' H; cbn [exact_filter].
  - intros E F k. rewrite E, F. reflexivity.
  - intros [m [[s C] [E F]]] [n [[t D] [G Q]]]. cbn [sound forallb snd] in H. apply andb_prop in H. destruct H as [H T].
    destruct A as [|a A]; [discriminate|]. apply andb_prop in H. destruct H as [H1 H2].
    apply negb_true_iff, Z.eqb_neq in H1. apply negb_true_iff, Z.eqb_neq in H2.
    assert (M : forall k, (m k - n k)%R = 0%R).
    { apply (section_unique a A (fun k => m k - n k)%R H1 H2).
      - exists (s - t)%R. intros k K. rewrite C, D by exact K. reflexivity.
      - intros k. rewrite taps_minus, E, G. ring. }
    apply (IH m y y' T F). apply (exact_ext S n m y' y'); [intros k; specialize (M k); lra|reflexivity|exact Q].
Qed.
Lemma exact_constant S : forall x y, constant_before x -> exact_filter S x y -> constant_before y.
Proof.
  induction S as [|[B A] S IH]; intros x y X; cbn [exact_filter].
  - intros E. destruct X as [s X]. exists s. intros k K. rewrite E. apply X, K.
  - intros [m [C [_ F]]]. exact (IH m y C F).
Qed.

(* Stages in a row: as each of them, so are all. *)
Definition stages_ := list (sections * nat).
Lemma every_constant r u : (0 < r)%nat -> constant_before u -> constant_before (one_in r u).
Proof. intros P [s U]. exists s. intros k K. apply U. nia. Qed.
Lemma chain_ext l : forall x x' y y', (forall k, x k = x' k) -> (forall k, y k = y' k) -> exact_chain l x y -> exact_chain l x' y'.
Proof.
  induction l as [|[S r] l IH]; intros x x' y y' X Y; cbn [exact_chain].
  - intros E k. rewrite <- X, <- Y. apply E.
  - intros [m [E F]]. exists m. split; [exact (exact_ext S x x' m m X (fun _ => eq_refl) E)|].
    exact (IH _ _ y y' (fun _ => eq_refl) Y F).
Qed.
Lemma chain_joined l : forall l' x m y, exact_chain l x m -> exact_chain l' m y -> exact_chain (l ++ l') x y.
Proof.
  induction l as [|[S r] l IH]; intros l' x m y; cbn [app exact_chain].
  - intros E F. exact (chain_ext l' m x y y E (fun _ => eq_refl) F).
  - intros [n [E F]] G. exists n. split; [exact E|exact (IH l' _ m y F G)].
Qed.
Lemma chain_difference l : forall x1 y1 x2 y2, exact_chain l x1 y1 -> exact_chain l x2 y2 ->
  exact_chain l (fun k => x1 k - x2 k)%R (fun k => y1 k - y2 k)%R.
Proof.
  induction l as [|[S r] l IH]; intros x1 y1 x2 y2; cbn [exact_chain].
  - intros E F k. rewrite E, F. reflexivity.
  - intros [m [E F]] [n [G Q]]. exists (fun k => m k - n k)%R. split; [apply exact_difference; assumption|exact (IH _ _ _ _ F Q)].
Qed.
Definition can_run (l : stages_) : bool := forallb (fun s => sound (fst s) && Nat.ltb 0 (snd s)) l.
Lemma can_run_next S r l : can_run ((S, r) :: l) = true -> sound S = true /\ (0 < r)%nat /\ can_run l = true.
Proof.
  cbn [can_run forallb fst snd]. intros H. apply andb_prop in H. destruct H as [H L]. apply andb_prop in H. destruct H as [H P].
  apply Nat.ltb_lt in P. auto.
Qed.
Lemma chain_exists l : forall x, can_run l = true -> constant_before x -> exists y, exact_chain l x y.
Proof.
  induction l as [|[S r] l IH]; intros x H X; [exists x; intros k; reflexivity|].
  apply can_run_next in H. destruct H as [H [P L]]. destruct (exact_exists S x H X) as [m M].
  destruct (IH (one_in r m) L (every_constant r m P (exact_constant S x m X M))) as [y Y]. exists y, m. auto.
Qed.

(* Such a chain is one filter at the first rate, of which some results remain: those behind have zeros between their taps. *)
Definition zeros_between (r : nat) (l : list Z) : list Z := flat_map (fun c => c :: repeat 0 (r - 1)) l.
Definition apart (r : nat) (S : sections) : sections := map (fun s => (zeros_between r (fst s), zeros_between r (snd s))) S.
Fixpoint at_first_rate (l : stages_) : sections := match l with [] => [] | (f, r) :: l' => f ++ apart r (at_first_rate l') end.

Lemma taps_zeros n : forall l u k, taps (repeat 0 n ++ l) u k = taps l u (k - Z.of_nat n).
Proof.
  induction n as [|n IH]; intros l u k; cbn [repeat app]; [rewrite Z.sub_0_r; reflexivity|].
  cbn [taps]. rewrite IH, Rmult_0_l, Rplus_0_l. f_equal. lia.
Qed.
Lemma taps_apart r l u : (0 < r)%nat -> forall k, taps (zeros_between r l) u (k * Z.of_nat r) = taps l (one_in r u) k.
Proof.
  intros P. induction l as [|c l IH]; intros k; cbn [zeros_between flat_map app taps]; [reflexivity|].
  fold (zeros_between r l). rewrite taps_zeros. unfold one_in at 1. f_equal. rewrite <- IH. f_equal. nia.
Qed.
Lemma exact_apart r S : (0 < r)%nat -> forall x y, exact_filter (apart r S) x y -> exact_filter S (one_in r x) (one_in r y).
Proof.
  intros P. induction S as [|[B A] S IH]; intros x y; cbn [apart map exact_filter fst snd].
  - intros E k. apply E.
  - intros [m [C [E F]]]. exists (one_in r m). split; [apply every_constant; assumption|split; [|exact (IH m y F)]].
    intros k. rewrite <- !taps_apart by exact P. apply E.
Qed.
Lemma sum_apart r l : (0 < r)%nat -> sum (zeros_between r l) = sum l.
Proof.
  intros P. induction l as [|c l IH]; [reflexivity|]. cbn [zeros_between flat_map app sum]. fold (zeros_between r l).
  assert (H : forall n m, sum (repeat 0 n ++ m) = sum m) by (induction n as [|n IHn]; intros m; cbn; [reflexivity|apply IHn]).
  rewrite H, IH. reflexivity.
Qed.
Lemma sound_apart r S : (0 < r)%nat -> sound S = true -> sound (apart r S) = true.
Proof.
  intros P. induction S as [|[B A] S IH]; [reflexivity|]. cbn [apart map sound forallb fst snd]. intros H.
  apply andb_prop in H. destruct H as [H T]. apply andb_true_intro. split; [|exact (IH T)].
  destruct A as [|a A]; [discriminate|]. rewrite <- (sum_apart r (a :: A) P) in H. cbn [zeros_between flat_map app] in *. exact H.
Qed.
Lemma sound_at_first_rate l : can_run l = true -> sound (at_first_rate l) = true.
Proof.
  induction l as [|[S r] l IH]; [reflexivity|]. intros H. apply can_run_next in H. destruct H as [H [P L]].
  cbn [at_first_rate]. unfold sound. rewrite forallb_app. apply andb_true_intro. split; [exact H|exact (sound_apart r _ P (IH L))].
Qed.
Lemma chain_at_first_rate l : forall x y, can_run l = true -> constant_before x -> exact_chain l x y ->
  exists Y d, exact_filter (at_first_rate l) x Y /\ forall k, Y (k * d) = y k.
Proof.
  induction l as [|[S r] l IH]; intros x y H X; cbn [exact_chain at_first_rate].
  - intros E. exists x, 1. split; [intros k; reflexivity|]. intros k. rewrite Z.mul_1_r. symmetry. apply E.
  - intros [m [M F]]. apply can_run_next in H. destruct H as [H [P L]].
    pose proof (exact_constant S x m X M) as C.
    destruct (IH (one_in r m) y L (every_constant r m P C) F) as [Y [d [G D]]].
    destruct (exact_exists (apart r (at_first_rate l)) m (sound_apart r _ P (sound_at_first_rate l L)) C) as [W HW].
    exists W, (d * Z.of_nat r). split; [exact (exact_joined _ _ _ _ _ M HW)|]. intros k. rewrite <- D.
    rewrite (exact_unique (at_first_rate l) _ Y (one_in r W) (sound_at_first_rate l L) G (exact_apart r _ P _ _ HW)).
    unfold one_in. f_equal. ring.
Qed.

Definition has_gain (l : stages_) (g : R) : Prop := forall x y M, (0 <= M)%R -> constant_before x -> exact_chain l x y ->
  (forall k, (Rabs (x k) <= M)%R) -> forall k, (Rabs (y k) <= g * M)%R.
Theorem gain_at_first_rate l parts least K p q : can_run l = true ->
  filter_gain_holds (at_first_rate l) parts least K p q = true -> has_gain l (IZR p / IZR q)%R.
Proof.
  intros Run H x y M M0 C E X k. destruct (chain_at_first_rate l x y Run C E) as [Y [d [F D]]]. rewrite <- D.
  exact (filter_gain _ _ _ _ _ _ H x Y M M0 F X _).
Qed.

Lemma begins_constant steady u : constant_before (begins steady u).
Proof. exists (if steady then u O else 0%R). intros k K. apply after_before, K. Qed.
Lemma near_at_all_times steady S r v Y v' e : sound S = true -> (0 < r)%nat -> exact_filter S (begins steady v) Y -> (0 <= e)%R ->
  (forall n, (Rabs (v' n - one_in r Y (Z.of_nat n)) <= e)%R) -> forall k, (Rabs (begins steady v' k - one_in r Y k) <= e)%R.
Proof.
  intros H P E e0 N k. destruct (Z.ltb_spec k 0) as [K|K].
  - unfold begins. rewrite after_before by exact K. destruct steady.
    + assert (X : forall j, j <= 0 -> begins true v j = v O).
      { intros j J. unfold begins. destruct (Z.eq_dec j 0) as [->|J0]; [apply (after_at (v O) v 0)|apply after_before; lia]. }
      destruct (steady_until S _ Y (v O) H X E) as [c C]. specialize (N O). unfold one_in in *.
      rewrite (C (k * Z.of_nat r)) by nia. rewrite (C (Z.of_nat 0 * Z.of_nat r)) in N by lia. exact N.
    + assert (X : forall j, j < 0 -> begins false v j = 0%R) by (intros j J; unfold begins; apply after_before, J).
      unfold one_in. rewrite (silent_before S _ Y H X E) by nia. rewrite Rminus_0_r, Rabs_R0. exact e0.
  - rewrite <- (Z2Nat.id k K). unfold begins. rewrite after_at. apply N.
Qed.

(* A stage but the last: its filter, one result for so many samples, its error, up to where its range reaches, and the gains
   of itself and of all behind it; `most` bounds the exact value at its output. *)
Record link := Link { filter_ : sections; every_ : nat; error_ : R; range_ : R; own_ : R; onward_ : R; most_ : R }.
Definition stages_of (l : list link) (rest : stages_) : stages_ := fold_right (fun s T => (filter_ s, every_ s) :: T) rest l.

(* What the hardware of the stages makes of v, one after the other. *)
Fixpoint made (steady : bool) (l : list link) (v last : nat -> R) : Prop :=
  match l with
  | [] => forall n, last n = v n
  | s :: l' => exists v', (forall Y, exact_filter (filter_ s) (begins steady v) Y ->
        (forall k, (Rabs (one_in (every_ s) Y k) <= range_ s)%R) ->
        forall n, (Rabs (v' n - one_in (every_ s) Y (Z.of_nat n)) <= error_ s)%R)
      /\ made steady l' v' last
  end.
(* D bounds the difference to the exact value before the first of these stages, and `before` are the stages there. *)
Fixpoint fits (before : stages_) (u : signal) (l : list link) (rest : stages_) (D : R) : Prop :=
  match l with
  | [] => True
  | s :: l' => (0 <= error_ s)%R /\ (0 <= own_ s)%R /\ has_gain [(filter_ s, every_ s)] (own_ s)
      /\ has_gain (stages_of l' rest) (onward_ s)
      /\ (forall z, exact_chain (before ++ [(filter_ s, every_ s)]) u z -> forall k, (Rabs (z k) <= most_ s)%R)
      /\ (most_ s + own_ s * D <= range_ s)%R
      /\ fits (before ++ [(filter_ s, every_ s)]) u l' rest (error_ s + own_ s * D)
  end.
Fixpoint added (l : list link) : R := match l with [] => 0%R | s :: l' => (onward_ s * error_ s + added l')%R end.

Theorem errors_add_up steady rest u y l : forall before v last z w D A,
  can_run (stages_of l rest) = true -> fits before u l rest D -> made steady l v last ->
  exact_chain before u z -> constant_before z -> exact_chain (stages_of l rest) z y ->
  exact_chain (stages_of l rest) (begins steady v) w ->
  (0 <= D)%R -> (forall k, (Rabs (begins steady v k - z k) <= D)%R) -> (forall k, (Rabs (w k - y k) <= A)%R) ->
  exists w', exact_chain rest (begins steady last) w' /\ forall k, (Rabs (w' k - y k) <= A + added l)%R.
Proof.
  induction l as [|s l IH]; intros before v last z w D A Run Fit Made Z Cz Y W D0 Near Far.
  - exists w. split.
    + apply (chain_ext rest (begins steady v) (begins steady last) w w); auto. intros k. unfold begins, after.
      cbn [made] in Made. destruct (k <? 0); [destruct steady; [symmetry; apply Made|reflexivity]|symmetry; apply Made].
    + intros k. cbn [added]. rewrite Rplus_0_r. apply Far.
  - cbn [stages_of fold_right] in *. fold (stages_of l rest) in *. cbn [fits] in Fit.
    destruct Fit as [E0 [O0 [Own [On [Most [Room Fit]]]]]]. destruct Made as [v' [Step Made]].
    apply can_run_next in Run. destruct Run as [So [P Run]].
    destruct W as [m [M1 M2]]. destruct Y as [z' [Z1 Z2]]. set (r := every_ s) in *.
    assert (Z3 : exact_chain (before ++ [(filter_ s, r)]) u (one_in r z')).
    { apply (chain_joined _ _ _ _ _ Z). exists z'. split; [exact Z1|intros k; reflexivity]. }
    assert (One : forall a b, exact_filter (filter_ s) a b -> exact_chain [(filter_ s, r)] a (one_in r b)).
    { intros a b E. exists b. split; [exact E|intros k; reflexivity]. }
    assert (Cd : forall a b, constant_before a -> constant_before b -> constant_before (fun k => a k - b k)%R).
    { intros a b [i I] [j J]. exists (i - j)%R. intros k K. rewrite I, J by exact K. reflexivity. }
    assert (Off : forall k, (Rabs (one_in r m k - one_in r z' k) <= own_ s * D)%R).
    { exact (Own _ _ D D0 (Cd _ _ (begins_constant steady v) Cz) (chain_difference _ _ _ _ _ (One _ _ M1) (One _ _ Z1)) Near). }
    assert (In : forall k, (Rabs (one_in r m k) <= range_ s)%R).
    { intros k. replace (one_in r m k) with (one_in r m k - one_in r z' k + one_in r z' k)%R by ring.
      eapply Rle_trans; [apply Rabs_triang|]. pose proof (Off k). pose proof (Most _ Z3 k). lra. }
    pose proof (near_at_all_times steady _ r v m v' _ So P M1 E0 (Step m M1 In)) as Close.
    destruct (chain_exists (stages_of l rest) (begins steady v') Run (begins_constant steady v')) as [w' W'].
    assert (D1 : (0 <= error_ s + own_ s * D)%R) by (pose proof (Rmult_le_pos _ _ O0 D0); lra).
    pose proof (every_constant r _ P (exact_constant _ _ _ Cz Z1)) as Cz'.
    pose proof (every_constant r _ P (exact_constant _ _ _ (begins_constant steady v) M1)) as Cm.
    destruct (IH (before ++ [(filter_ s, r)]) v' last (one_in r z') w' (error_ s + own_ s * D)%R (A + onward_ s * error_ s)%R)
      as [w2 [W2 F2]]; try assumption.
    + intros k. replace (begins steady v' k - one_in r z' k)%R
        with ((begins steady v' k - one_in r m k) + (one_in r m k - one_in r z' k))%R by ring.
      eapply Rle_trans; [apply Rabs_triang|]. pose proof (Close k). pose proof (Off k). lra.
    + intros k. replace (w' k - y k)%R with ((w' k - w k) + (w k - y k))%R by ring.
      eapply Rle_trans; [apply Rabs_triang|].
      pose proof (On _ _ _ E0 (Cd _ _ (begins_constant steady v') Cm) (chain_difference _ _ _ _ _ W' M2) Close k).
      pose proof (Far k). lra.
    + exists w2. split; [exact W2|]. intros k. cbn [added]. rewrite <- Rplus_assoc. apply F2.
Qed.

(* The last stage limits, and so does the exact result. *)
Theorem chain_error steady l S r v last y out lo hi off e :
  can_run (stages_of l [(S, r)]) = true -> fits [] (begins steady v) l [(S, r)] 0 -> made steady l v last ->
  (forall Y, exact_filter S (begins steady last) Y ->
    forall n : nat, (Rabs (out n - limited lo hi (one_in r Y (Z.of_nat n) - off)) <= e)%R) ->
  exact_chain (stages_of l [(S, r)]) (begins steady v) y ->
  forall n : nat, (Rabs (out n - limited lo hi (y (Z.of_nat n) - off)) <= added l + e)%R.
Proof.
  intros Run Fit Made Last Y n.
  destruct (errors_add_up steady [(S, r)] (begins steady v) y l [] v last (begins steady v) y 0 0 Run Fit Made) as [w [W F]];
    try (intros k; unfold Rminus; rewrite Rplus_opp_r, Rabs_R0); try lra; try exact Y; try apply begins_constant;
    [intros k; reflexivity|].
  destruct W as [Q [HQ W]]. pose proof (Last Q HQ n) as A. rewrite <- (W (Z.of_nat n)) in A. pose proof (F (Z.of_nat n)) as B.
  pose proof (limited_near lo hi (w (Z.of_nat n) - off) (y (Z.of_nat n) - off)) as C.
  replace (w (Z.of_nat n) - off - (y (Z.of_nat n) - off))%R with (w (Z.of_nat n) - y (Z.of_nat n))%R in C by ring.
  replace (out n - limited lo hi (y (Z.of_nat n) - off))%R
    with ((out n - limited lo hi (w (Z.of_nat n) - off))
      + (limited lo hi (w (Z.of_nat n) - off) - limited lo hi (y (Z.of_nat n) - off)))%R by ring.
  eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.

(* The theorem of a stage is in units of its own last place, each of which is u of the last place of the chain. *)
Lemma begins_scaled steady c v k : begins steady (fun n => c * v n)%R k = (c * begins steady v k)%R.
Proof. unfold begins, after. destruct (k <? 0); [destruct steady; ring|reflexivity]. Qed.
Lemma begins_ext steady v v' k : (forall n, v n = v' n) -> begins steady v k = begins steady v' k.
Proof. intros E. unfold begins, after. destruct (k <? 0); [destruct steady; [apply E|reflexivity]|apply E]. Qed.
Lemma begins_within steady v M : (0 <= M)%R -> (forall n, (Rabs (v n) <= M)%R) -> forall k, (Rabs (begins steady v k) <= M)%R.
Proof.
  intros M0 H k. unfold begins, after. destruct (k <? 0); [destruct steady; [apply H|rewrite Rabs_R0; exact M0]|apply H].
Qed.
Theorem stage_between steady S r (u b range e : R) (c v code : nat -> R) lo hi : (0 < u)%R -> (forall n, u * c n = v n)%R ->
  (forall Y, exact_filter S (begins steady c) Y ->
    forall n : nat, (Rabs (code n - limited lo hi (one_in r Y (Z.of_nat n))) <= b)%R) ->
  (range <= u * hi)%R -> (u * lo <= - range)%R -> (u * b <= e)%R ->
  forall Y, exact_filter S (begins steady v) Y -> (forall k, (Rabs (one_in r Y k) <= range)%R) ->
  forall n, (Rabs (u * code n - one_in r Y (Z.of_nat n)) <= e)%R.
Proof.
  intros U V H Hi Lo E Y F In n.
  assert (X : exact_filter S (begins steady c) (fun k => / u * Y k)%R).
  { apply (exact_ext S (fun k => / u * begins steady v k)%R _ (fun k => / u * Y k)%R); [|intros; reflexivity|apply exact_scaled, F].
    intros k. rewrite <- begins_scaled. apply begins_ext. intros j. rewrite <- V. field. lra. }
  specialize (H _ X n). specialize (In (Z.of_nat n)). unfold one_in in *. cbv beta in H. set (y := Y (Z.of_nat n * Z.of_nat r)) in *.
  assert (In' : (- range <= y <= range)%R).
  { split; [apply Ropp_le_cancel; rewrite Ropp_involutive; eapply Rle_trans; [apply Rle_abs|rewrite Rabs_Ropp; exact In]|].
    eapply Rle_trans; [apply Rle_abs|exact In]. }
  assert (N : limited lo hi (/ u * y) = (/ u * y)%R).
  { unfold limited. rewrite Rmin_right, Rmax_right; [reflexivity| |];
      apply (Rmult_le_reg_l u _ _ U); rewrite <- Rmult_assoc, Rinv_r, Rmult_1_l by lra; lra. }
  rewrite N in H. replace (u * code n - y)%R with (u * (code n - / u * y))%R by (field; lra).
  rewrite Rabs_mult, (Rabs_pos_eq u) by lra. pose proof (Rmult_le_compat_l u _ _ (Rlt_le _ _ U) H). lra.
Qed.
Lemma stage_at_the_end steady S (c v : nat -> R) : (forall n, c n = v n) ->
  forall Y, exact_filter S (begins steady v) Y -> exact_filter S (begins steady c) Y.
Proof.
  intros V Y. apply exact_ext; [|intros; reflexivity]. intros k. apply begins_ext. intros n. symmetry. apply V.
Qed.
