(* An FIR filter of which only some results leave. It starts from zero, and its first sample goes in until the window is full:
   from there on its results are those of the filter that had its first sample for ever. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From Sosmith Require Import Definitions Streams Responses.
Open Scope Z_scope.

Definition window_full (count : nat) (sections : list (list Z * list Z)) : bool :=
  match sections with [(B, [a])] => negb (a =? 0) && Nat.leb (length B) (S count) | _ => false end.

Lemma taps_window l : forall u v k m, (forall j, 0 <= j < Z.of_nat (length l) -> u (k - j) = v (m - j)) -> taps l u k = taps l v m.
Proof.
  induction l as [|c l IH]; intros u v k m H; cbn [taps]; [reflexivity|]. cbn [length] in H.
  rewrite (IH u v (k - 1) (m - 1)).
  - specialize (H 0 ltac:(lia)). rewrite !Z.sub_0_r in H. rewrite H. reflexivity.
  - intros j Hj. specialize (H (j + 1) ltac:(lia)). replace (k - 1 - j) with (k - (j + 1)) by lia.
    replace (m - 1 - j) with (m - (j + 1)) by lia. exact H.
Qed.

Theorem filled_results sections count u y n : window_full count sections = true -> exact_filter sections (from_first u) y ->
  exists z, exact_filter sections (from_zero (fun k => u (k - count)%nat)) z /\ z (Z.of_nat (count + n)) = y (Z.of_nat n).
Proof.
  unfold window_full. destruct sections as [|[B [|a [|b A]]] [|two sections]]; try discriminate. intros H [m [_ [E Y]]].
  apply andb_prop in H. destruct H as [H L]. apply negb_true_iff, Z.eqb_neq in H. apply Nat.leb_le in L.
  assert (A0 : IZR a <> 0%R) by (intros X; apply H, eq_IZR, X).
  set (w := from_zero (fun k => u (k - count)%nat)). set (z := fun k => (taps B w k / IZR a)%R). exists z. split.
  - exists z. split; [exists 0%R|split].
    + intros k K. unfold z. rewrite (taps_silent B w k); [field; exact A0|]. intros j J. unfold w, from_zero. apply after_before. lia.
    + intros k. unfold z. cbn [taps]. field. exact A0.
    + intros k. reflexivity.
  - rewrite (Y (Z.of_nat n)). unfold z. specialize (E (Z.of_nat n)). cbn [taps] in E.
    rewrite (taps_window B w (from_first u) (Z.of_nat (count + n)) (Z.of_nat n)).
    + rewrite <- E. field. exact A0.
    + intros j J. unfold w, from_zero, from_first, after.
      destruct (Z.ltb_spec (Z.of_nat (count + n) - j) 0) as [N|_]; [lia|].
      destruct (Z.ltb_spec (Z.of_nat n - j) 0) as [N|N]; f_equal; lia.
Qed.
Lemma filled_within count ports x : inputs_within ports x -> inputs_within ports (filled count x).
Proof. intros X n p P. exact (X (n - count)%nat p P). Qed.
