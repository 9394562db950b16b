"""Theorems that every code of the graph stays in its range, for all inputs in the ranges of their ports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce

from flint import fmpz_poly

from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.cascade import Cascade, SectionForms
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.flat import FlatGraph
from sosmith.verify.rocq.linear import Source
from sosmith.verify.rocq.polynomials import number, numbers
from sosmith.verify.rocq.witness import Witness, largest, witness

_MORE_BITS = (-48, 0, 64)
"""Precision beside what mostly decides a claim of a gain, tried in this order."""

Range = tuple[int, int]


def graph_definitions(graph: FlatGraph) -> str:
    """Write the graph and the ranges of its inputs."""
    ports = "; ".join(f"({number(low)}, {number(high)})" for low, high in graph.ports)
    return f"""\
(* The core: all nodes of all stages in a row, and the ranges of its inputs. *)
Definition core : graph :=
  [{graph.term()[1:]}.
Definition ports : list (Z * Z) := [{ports}].
Lemma core_is_ordered : ordered core = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
"""


def range_claims(graph: FlatGraph, cascade: Cascade | None) -> Iterator[Claim]:
    """Write the theorems: before the sections, those that need peak gains section by section, and of all nodes."""
    if cascade is None:
        yield Claim("every_code_in_range", f"ranges of all {graph.size} nodes", _all(graph, [], []))
        return
    yield Claim("ranges_before", f"ranges of the {cascade.first} nodes before the sections", _before(cascade))
    names, targets = [], []
    for index, section in enumerate(cascade.sections):
        if section.targets:
            name = f"ranges_of_section_{index}"
            names.append(name)
            targets.append(section.targets)
            words = f"section {index}: ranges of {len(section.targets)} nodes by their peak gains"
            yield Claim(name, words, _section(name, cascade, section))
    yield Claim("every_code_in_range", f"ranges of all {graph.size} nodes", _all(graph, names, targets))


def _before(cascade: Cascade) -> str:
    return f"""\
Theorem ranges_before : forall x, inputs_within ports x ->
  forall n i, (i < {cascade.first})%nat -> in_range core x i n.
Proof.
  intros x X. apply (ranges {cascade.first} core ports [] x core_is_ordered); try exact X; try (intros i n []).
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
Qed.
{cascade.definitions()}\
Lemma sections_are_closed : closed {cascade.last} core = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Lemma forms_fit : every (fits_node core sources factors forms) 0 (firstn {cascade.last} core) = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Lemma sources_are_known : forallb (known_source core {cascade.first}) sources = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
"""


def _section(name: str, cascade: Cascade, section: SectionForms) -> str:
    chosen = _decided(cascade, section)
    under = numbers(section.under)
    return f"""\
Theorem {name} : forall x, inputs_within ports x ->
  forall t n, In t {numbers(section.targets)}%nat -> in_range core x t n.
Proof.
  intros x X. apply (ranges_of_targets core x sources factors forms {cascade.first} {cascade.last}
    {under} (impulse {under} {chosen.term}) ({chosen.whole}) _
    core_is_ordered sections_are_closed forms_fit sources_are_known); [|exact (ranges_before x X)].
  vm_cast_no_check (eq_refl true).
Qed.
"""


def _all(graph: FlatGraph, names: Sequence[str], targets: Sequence[Sequence[int]]) -> str:
    given = " ++ ".join(f"{numbers(some)}%nat" for some in targets) or "[]"
    cases = reduce(
        lambda rest, name: (
            f"(fun H => match in_app_or _ _ _ H with or_introl H => {name} x X i n H | or_intror H => {rest} H end)"
        ),
        reversed(names[:-1]),
        f"(fun H => {names[-1]} x X i n H)" if names else "(fun H => match H with end)",
    )
    return f"""\
Theorem every_code_in_range : forall x, inputs_within ports x ->
  forall n i, (i < length core)%nat -> in_range core x i n.
Proof.
  intros x X. apply (ranges (length core) core ports ({given}) x core_is_ordered); try exact X.
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
  - intros i n. exact {cases}.
Qed.
"""


def _decided(cascade: Cascade, section: SectionForms) -> Witness:
    """Return a witness that proves the ranges of all targets, or that with the highest precision."""
    for extra in _MORE_BITS:
        chosen = witness(section.under, extra=extra)
        if all(_fits(cascade, section, target, chosen) for target in section.targets):
            break
    return chosen


def _fits(cascade: Cascade, section: SectionForms, target: int, chosen: Witness) -> bool:
    forms = section.forms[target].items()
    driven = [(reach(cascade.graph, source), [int(value) for value in over]) for source, over in forms]
    return fits(driven, chosen, node_at(cascade.graph, target))


def fits(driven: Sequence[tuple[Range, Sequence[int]]], chosen: Witness, within: Range, times: int = 1) -> bool:
    """Whether `range_fits` of the theories holds.

    Parameters
    ----------
    driven : sequence of pairs
        Range and numerator of each source.
    chosen : Witness
    within : tuple of int
        Where the sum must stay, `times` which it is taken.
    """
    h = fmpz_poly(chosen.values)
    left = chosen.whole - chosen.rest
    if left <= 0:
        return False
    responses = [(ends, [int(value) for value in (h * fmpz_poly(list(over))).coeffs()]) for ends, over in driven]
    up = largest(_summed([[max(g * low, g * high) for g in response] for (low, high), response in responses]))
    down = largest(_summed([[max(-g * low, -g * high) for g in response] for (low, high), response in responses]))
    more, whole = chosen.rest * max(up, down), chosen.whole * left
    return times * (up * left + more) <= within[1] * whole and times * (down * left + more) <= -within[0] * whole


def _summed(lists: Sequence[Sequence[int]]) -> list[int]:
    size = max(map(len, lists), default=0)
    return [sum(one[k] for one in lists if k < len(one)) for k in range(size)]


def node_at(graph: FlatGraph, node: int) -> Range:
    """Return the range of a node by its place in the whole graph."""
    for stage, offset in zip(reversed(graph.stages), reversed(graph.offsets[:-1]), strict=True):
        if node >= offset:
            entry = stage.nodes[node - offset]
            return entry.low, entry.high
    raise RejectedError(f"the graph must have a node {node}")


def reach(graph: FlatGraph, source: Source) -> Range:
    """Return the range of a source."""
    kind, node, bits = source
    most = (1 << bits) - 1
    if kind == "node":
        return node_at(graph, node)
    return (0, most) if kind == "floor" else (-most, most)
