(* What the theorems of a certificate are about: all definitions that their statements use, and no proofs.

   1. A dataflow graph of integers, as a certificate lists it, and what it computes. *)
Require Import ZArith Reals List. Import ListNotations. Open Scope Z_scope.

(* A node is an operation on earlier nodes; a delay may take a later one. Every node has a code, an integer, and `frac`
   fraction bits: its value is code / 2^frac. `low` and `high` are claimed to be the limits of its codes. *)
Inductive operation :=
  | Input (port : nat)               (* the code at an input of the core *)
  | Constant (code : Z)
  | Add (a b : nat)                  (* binary points aligned *)
  | Subtract (a b : nat)
  | Multiply (a b : nat)
  | Scale (a : nat) (by_ bits : Z)   (* times by_ / 2^bits *)
  | Shift (a : nat) (by_ : Z)        (* times 2^by_: the same code with another binary point *)
  | Floor (a : nat)                  (* rounds down to `frac` fraction bits *)
  | Fraction (a : nat) (kept : Z)    (* what rounding down to `kept` fraction bits drops *)
  | Truncate (a : nat)               (* rounds towards 0 to `frac` fraction bits *)
  | Clamp (a : nat)                  (* limits to low .. high *)
  | Bound (a : nat)                  (* the same, and claimed to be in low .. high *)
  | Wire (a : nat)                   (* the same: the input of a stage *)
  | Delay (a : nat).                 (* the code at the sample before; 0 at the first one *)

Record node := Node { op : operation; frac : Z; low : Z; high : Z }.
Definition graph := list node.
Definition blank := Node (Constant 0) 0 0 0.
Definition frac_of (g : graph) (i : nat) := frac (nth i g blank).
(* A code with f fraction bits, which may be fewer than none, is worth code * units_of f / steps_of f. *)
Definition units_of (f : Z) : Z := 2 ^ Z.max 0 (- f).
Definition steps_of (f : Z) : Z := 2 ^ Z.max 0 f.

(* The code of a node, from the codes of the nodes before it at this sample, of all nodes at the last one, and of the
   inputs at this one. *)
Definition compute (g : graph) (now last : list Z) (inputs : nat -> Z) (v : node) : Z :=
  let code i := nth i now 0 in
  let aligned i := code i * 2 ^ (frac v - frac_of g i) in
  let dropped i := 2 ^ (frac_of g i - frac v) in
  match op v with
  | Input port => inputs port
  | Constant c => c
  | Add a b => aligned a + aligned b
  | Subtract a b => aligned a - aligned b
  | Multiply a b => code a * code b
  | Scale a c _ => code a * c
  | Shift a _ | Bound a | Wire a => code a
  | Floor a => code a / dropped a
  | Fraction a kept => code a mod 2 ^ (frac_of g a - kept)
  | Truncate a => Z.quot (code a) (dropped a)
  | Clamp a => Z.max (low v) (Z.min (high v) (code a))
  | Delay a => nth a last 0
  end.

Fixpoint step (g : graph) (rest : list node) (now last : list Z) (inputs : nat -> Z) : list Z :=
  match rest with
  | [] => now
  | v :: rest' => step g rest' (now ++ [compute g now last inputs v]) last inputs
  end.
Definition sample (g : graph) (last : list Z) (inputs : nat -> Z) : list Z := step g g [] last inputs.

(* The codes of all nodes at sample n, for inputs x: x n p is the code at input p. Before the first sample all are 0. *)
Fixpoint run (g : graph) (x : nat -> nat -> Z) (n : nat) : list Z :=
  sample g (match n with O => [] | S m => run g x m end) (x n).
Definition code (g : graph) (x : nat -> nat -> Z) (i n : nat) : Z := nth i (run g x n) 0.

(* Inputs within the limits of their ports, and a code within those of its node. *)
Definition inputs_within (ports : list (Z * Z)) (x : nat -> nat -> Z) : Prop :=
  forall n p, (p < length ports)%nat -> fst (nth p ports (0, 0)) <= x n p <= snd (nth p ports (0, 0)).
Definition in_range (g : graph) (x : nat -> nat -> Z) (i n : nat) : Prop :=
  low (nth i g blank) <= code g x i n <= high (nth i g blank).

(* 2. The exact filter: sequences of real numbers over all times, from minus infinity on. *)
Definition signal := Z -> R.

(* l0 u(k) + l1 u(k - 1) + l2 u(k - 2) + ... *)
Fixpoint taps (l : list Z) (u : signal) (k : Z) : R :=
  match l with [] => 0 | c :: l' => IZR c * u k + taps l' u (k - 1) end.

(* Sections in a row, each a numerator B and a denominator A: A * y = B * x at all times. Before sample 0 nothing
   changes. With poles inside the unit circle there is one such y for each x that is constant before sample 0. *)
Definition constant_before (u : signal) : Prop := exists s, forall k, k < 0 -> u k = s.
Fixpoint exact_filter (sections : list (list Z * list Z)) (x y : signal) : Prop :=
  match sections with
  | [] => forall k, y k = x k
  | (B, A) :: others => exists m, constant_before m /\ (forall k, taps A m k = taps B x k) /\ exact_filter others m y
  end.

(* A sequence that begins at sample 0, and before it is 0, or as if the first sample had been there for ever. *)
Definition after (p : R) (u : nat -> R) : signal := fun k => if k <? 0 then p else u (Z.to_nat k).
Definition from_zero (u : nat -> R) : signal := after 0 u.
Definition from_first (u : nat -> R) : signal := after (u O) u.

Definition limited (lowest highest y : R) : R := Rmax lowest (Rmin highest y).

(* 3. Gains of D * y = N1 * u1 + N2 * u2 + ...: whatever the inputs, y is never beyond p / q times their bound. *)
Fixpoint together (N : list (list Z)) (u : list signal) (k : Z) : R :=
  match N, u with c :: N', x :: u' => taps c x k + together N' u' k | _, _ => 0 end.
Definition gain_at_most (D : list Z) (N : list (list Z)) (p q : Z) : Prop :=
  forall (y : signal) (u : list signal) (M : R), (0 <= M)%R -> constant_before y ->
    (forall k, taps D y k = together N u k) -> Forall (fun x : signal => forall k, (Rabs (x k) <= M)%R) u ->
    forall k, (Rabs (y k) <= IZR p / IZR q * M)%R.

(* 4. The budget: claimed bounds of five errors, as rational numbers p / q. *)
Definition ratio := (Z * Z)%type.
Definition real (a : ratio) : R := (IZR (fst a) / IZR (snd a))%R.
(* Of the calibration at the input, the coefficients, the roundings, the first sample, and the last rounding. *)
Record budget := Budget { of_input : ratio; of_coefficients : ratio; of_roundings : ratio; of_start : ratio; of_output : ratio }.
Definition sum_of (c : budget) : R :=
  (real (of_input c) + real (of_coefficients c) + real (of_roundings c) + real (of_start c) + real (of_output c))%R.
Definition in_parts (c : budget) (e : R) : Prop := exists a b r s o : R, e = (a + b + r + s + o)%R
  /\ (Rabs a <= real (of_input c))%R /\ (Rabs b <= real (of_coefficients c))%R /\ (Rabs r <= real (of_roundings c))%R
  /\ (Rabs s <= real (of_start c))%R /\ (Rabs o <= real (of_output c))%R.

(* 5. A decimator: running sums in a row, every factor-th of what they give, and as many differences; all in words of `width`
   bits, so modulo 2^width. What leaves is one number with or without a sign, of which a rounding to nearest drops bits. *)
Record decimator := Decimator { factor : nat; stages : nat; width : Z; dropped : Z; signed : bool }.
Fixpoint summed (w : Z) (u : nat -> Z) (n : nat) : Z := (u n + match n with O => 0 | S m => summed w u m end) mod 2 ^ w.
Definition differed (w : Z) (u : nat -> Z) (n : nat) : Z := (u (S n) - u n) mod 2 ^ w.
Definition word (d : decimator) (z : Z) : Z :=
  if signed d then (z + 2 ^ (width d - 1)) mod 2 ^ width d - 2 ^ (width d - 1) else z mod 2 ^ width d.
(* First the sums take the first sample `stages * factor` times more; from zero, all are `preceded` by `factor` zeros. *)
Definition decimate (d : decimator) (u : nat -> Z) (n : nat) : Z :=
  let entering k := u (k - stages d * factor d)%nat in
  let sums := Nat.iter (stages d) (summed (width d)) entering in
  let result := Nat.iter (stages d) (differed (width d)) (fun k => sums (k * factor d)%nat) n in
  (word d result + 2 ^ dropped d / 2) / 2 ^ dropped d.

(* What it approximates: the mean of the last `factor` values, `stages` times over, at every factor-th sample. *)
Definition mean (count : nat) (u : signal) : signal := fun k => (taps (repeat 1%Z count) u k / IZR (Z.of_nat count))%R.
Definition averaged (d : decimator) (u : nat -> R) (n : nat) : R :=
  Nat.iter (stages d) (mean (factor d)) (from_first u) (Z.of_nat (n * factor d)).
Definition preceded {A} (d : decimator) (past : A) u n : A := if Nat.ltb n (factor d) then past else u (n - factor d)%nat.

(* 6. A filter of which every R-th result leaves: the first sample goes in so many times before it counts. *)
Definition filled (count : nat) (x : nat -> nat -> Z) : nat -> nat -> Z := fun n => x (n - count)%nat.

(* 7. What folds. A sinusoid of a frequency, in units of the sample rate, and of an amplitude of at most g. *)
Definition wave (frequency g : R) (u : signal) : Prop := exists a b, (a * a + b * b <= g * g)%R
  /\ forall k, u k = (a * cos (2 * PI * frequency * IZR k) + b * sin (2 * PI * frequency * IZR k))%R.
(* What sections in a row answer to it for ever: such a sinusoid behind each. *)
Fixpoint steady_answer (frequency : R) (sections : list (list Z * list Z)) (x y : signal) : Prop :=
  match sections with
  | [] => forall k, y k = x k
  | (B, A) :: others => exists m, (exists g, wave frequency g m) /\ (forall k, taps A m k = taps B x k)
      /\ steady_answer frequency others m y
  end.
(* The means of a decimator at the lower rate, without rounding. *)
Definition lowered (d : decimator) (u : signal) : signal := fun n => Nat.iter (stages d) (mean (factor d)) u (n * Z.of_nat (factor d)).
(* A sinusoid of amplitude 1 whose frequency is p, in units of the lower rate, away from the k-th multiple of that rate comes
   out at the frequency p: of an amplitude of at most the k-th of these gains, for all p up to an edge and all k. *)
Definition folds_at_most (d : decimator) (sections : list (list Z * list Z)) (edge : R) (gains : list ratio) : Prop :=
  forall k p f, (1 <= k <= factor d / 2)%nat -> (0 <= p <= edge)%R ->
    f = ((INR k - p) / INR (factor d))%R \/ f = ((INR k + p) / INR (factor d))%R ->
    forall x y, wave f 1 x -> steady_answer p sections (lowered d x) y ->
    forall n, (Rabs (y n) <= real (nth (k - 1) gains (0, 1)%Z))%R.
