(* What the theorem of a chain is about, beside the definitions of its stages, and no proofs: sections of a stage, and by how
   much it decimates. Each stage gives every r-th of its results to the next one. *)
Require Import ZArith Reals List. Import ListNotations. Open Scope Z_scope.
From Sosmith Require Import Definitions.

Definition one_in (r : nat) (u : signal) : signal := fun k => u (k * Z.of_nat r).
Fixpoint exact_chain (l : list (list (list Z * list Z) * nat)) (x y : signal) : Prop :=
  match l with
  | [] => forall k, y k = x k
  | (f, r) :: l' => exists m, exact_filter f x m /\ exact_chain l' (one_in r m) y
  end.
