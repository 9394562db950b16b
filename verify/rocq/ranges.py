"""Theorems that every code of the graph stays in its range, for all inputs in the ranges of their ports."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sosmith.verify.graph import require
from sosmith.verify.rocq.cascade import Cascade, Row, Rows
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.flat import FlatGraph
from sosmith.verify.rocq.linear import Source
from sosmith.verify.rocq.polynomials import number
from sosmith.verify.rocq.settling import Counter
from sosmith.verify.rocq.start import StartNodes

_FEWER_BITS = (28, 20, 12, 4, -8, -40)
"""By how much the response is less precise than the range of a node: first shorter ones, tried in this order."""

Range = tuple[int, int]


@dataclass(frozen=True)
class Windows:
    """Ranges of the sources: of what enters the sections, two between which the true one lies.

    Attributes
    ----------
    cascade : Cascade
    entry : int or None
        The place of the source that has two; None if there is none.
    span : int
    """

    cascade: Cascade
    entry: int | None
    span: int

    def of(self, place: int, *, second: bool) -> Range:
        """Return the range of a source."""
        if place == self.entry:
            return (-self.span, 0) if second else (0, self.span)
        return reach(self.cascade.graph, self.cascade.sources[place])

    def most(self, row: Row) -> int:
        """Largest sum that a row can make, at any time; as Rocq's `most_of`."""
        return max(self._most(row, second=second) for second in ((False, True) if self.entry is not None else (False,)))

    def _most(self, row: Row, *, second: bool) -> int:
        total: list[int] = []
        for place, over in row.items():
            low, high = self.of(place, second=second)
            for at, value in enumerate(over.coeffs()):
                extreme = int(value) * (high if value > 0 else low)
                if at < len(total):
                    total[at] += extreme
                else:
                    total.append(extreme)
        largest = summed = 0
        for at, top in enumerate(total):
            summed += top
            largest = max(summed, largest) if at else summed
        return largest


def reach(graph: FlatGraph, source: Source) -> Range:
    """Return the range of a source."""
    kind, node, bits = source
    most = (1 << bits) - 1
    if kind == "node":
        entry = graph.node(node)
        return entry.low, entry.high
    return (0, most) if kind == "floor" else (-most, most)


def negative(row: Row) -> Row:
    """Return a row with the other sign."""
    return {place: -over for place, over in row.items()}


def core_definitions(graph: FlatGraph) -> str:
    """Write the core's graph and the ranges of its inputs."""
    ports = "; ".join(f"({number(low)}, {number(high)})" for low, high in graph.ports)
    return f"""\
(* The core: all nodes of all stages in a row, and the ranges of its inputs. *)
Definition ports : list (Z * Z) := [{ports}].
{graph_definitions(graph, "core")}"""


def graph_definitions(graph: FlatGraph, name: str) -> str:
    """Write a graph."""
    return f"""\
Definition {name} : graph :=
  [{graph.term()[1:]}.
"""


def graph_claim(graph: FlatGraph, name: str, ports: str, where: str = "") -> Claim:
    """Write that the nodes are a graph, in the certificate's stages: what all that follows rests on."""
    text = f"""\
(* The stages, one behind another: of each the number of its nodes, and its outputs, counted from its first node. *)
Definition {name}_stages : layout := {graph.layout()}.
Theorem {name}_is_well_formed : well_formed {name} {ports} {name}_stages = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Lemma {name}_is_ordered : ordered {name} = true.
Proof. exact (well_formed_ordered _ _ _ {name}_is_well_formed). Qed.
"""
    words = f"all {graph.size} nodes{where} can be computed in their order, and each stage takes what is handed to it"
    return Claim(f"{name}_is_well_formed", words, text)


def tight_claim() -> Claim:
    """Write that no range is wider than what its operands give."""
    text = (
        "Lemma ranges_are_tight_ : ranges_are_tight core ports = true.\nProof. vm_cast_no_check (eq_refl true). Qed.\n"
    )
    return Claim("ranges_are_tight_", "no range is wider than what its operands give", text)


def range_claims(
    graph: FlatGraph, cascade: Cascade | None, start: StartNodes | None, counter: Counter | None
) -> Iterator[Claim]:
    """Write the theorems: before the sections, section by section, and of all nodes."""
    if cascade is None:
        text = all_in_range("every_code_in_range", "core", "ports", graph.size)
        yield Claim("every_code_in_range", f"ranges of all {graph.size} nodes", text)
        return
    known = cascade.sections[0].known
    if start is not None:
        words = f"ranges of the {start.sample + 1} nodes up to the start"
        yield Claim("ranges_before_start", words, _through("ranges_before_start", start.sample + 1))
    text = (
        _definitions(cascade)
        + (_through("ranges_before", known) if start is None else _start(start, known))
        + _window(cascade, start)
    )
    yield Claim("ranges_before", f"ranges of the {known} nodes before the sections", text)
    windows = windows_of(cascade, start)
    before = "ranges_before"
    for index, section in enumerate(cascade.sections):
        name, last = f"ranges_of_section_{index}", index + 1 == len(cascade.sections)
        through = graph.size if last else cascade.sections[index + 1].known
        words = f"section {index}: ranges of {len(section.targets)} nodes by peak gains, of all nodes before {through}"
        yield Claim(name, words, _section(name, before, windows, index, through, counter if last else None))
        before = name
    text = f"""\
Theorem every_code_in_range : forall x, inputs_within ports x ->
  forall n i, (i < length core)%nat -> in_range core x i n.
Proof. exact {before}. Qed.
"""
    yield Claim("every_code_in_range", f"ranges of all {graph.size} nodes", text)


def windows_of(cascade: Cascade, start: StartNodes | None) -> Windows:
    """Return the ranges of the sources."""
    if start is None:
        return Windows(cascade, None, 0)
    wires = cascade.sections[0].wires
    require(len(wires) == 1, f"the first section must use one input behind a start, not {len(wires)}")
    (entry,) = wires
    return Windows(cascade, entry, start.span)


def _through(name: str, known: int) -> str:
    return f"""\
Theorem {name} : forall x, inputs_within ports x -> forall n i, (i < {known})%nat -> in_range core x i n.
Proof.
  intros x X. apply (ranges {known} core ports [] x core_is_ordered); try exact X; try (intros i n []).
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
Qed.
"""


def _start(start: StartNodes, known: int) -> str:
    return f"""\
Theorem ranges_before : forall x, inputs_within ports x -> forall n i, (i < {known})%nat -> in_range core x i n.
Proof.
  intros x X. apply (ranges_further {start.sample + 1} {known} core ports [change begin; held begin] x core_is_ordered).
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
  - exact X.
  - exact (ranges_before_start x X).
  - apply (start_ranges core x begin core_is_ordered start_fits_core). intros n.
    exact (ranges_before_start x X n {start.sample} (le_n _)).
Qed.
"""


def _definitions(cascade: Cascade) -> str:
    return f"""\
{cascade.definitions()}\
Lemma sections_are_closed : closed {cascade.last} core = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Lemma forms_fit : every (fits_node core sources forms) 0 (firstn {cascade.last} core) = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
"""


def _window(cascade: Cascade, start: StartNodes | None) -> str:
    statement = "Lemma window_is : forall x, inputs_within ports x -> window_holds core x window.\n"
    if start is None:
        return f"Definition window : windows := None.\n{statement}Proof. intros x X. exact I. Qed.\n"
    wire = cascade.sources[cascade.sections[0].wires[0]][1]
    return f"""\
Definition window : windows := windows_of core begin {wire}.
{statement}\
Proof.
  intros x X. apply (start_windows core x begin {wire} core_is_ordered start_is).
  - intros n. exact (ranges_before_start x X n {start.sample} (le_n _)).
  - intros n. apply (wire_code core x {wire} {start.change} n core_is_ordered). vm_cast_no_check (eq_refl true).
Qed.
"""


def _section(name: str, before: str, windows: Windows, index: int, through: int, counter: Counter | None) -> str:
    cascade = windows.cascade
    section = cascade.sections[index]
    plans = "; ".join(f"({target}%nat, {decided(windows, index, target).plan})" for target in section.targets)
    given, counts = f"map fst plans_{index}", ""
    if counter is not None:
        given = f"{counter.next}%nat :: {given}"
        held = f"flagged_from core x flags {counter.samples} core_is_ordered flags_count n"
        counts = f"intros t n [<-|T]; [exact (proj2 ({held}))|]. revert t n T.\n    "
    return f"""\
Definition plans_{index} : list (nat * plan) := [{plans}].
Theorem {name} : forall x, inputs_within ports x -> forall n i, (i < {through})%nat -> in_range core x i n.
Proof.
  intros x X. apply (ranges_further {section.known} {through} core ports ({given}) x core_is_ordered).
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
  - exact X.
  - exact ({before} x X).
  - {counts}apply (targets_in_range core x sources forms {cascade.last} {section.known} window plans_{index}
      core_is_ordered sections_are_closed forms_fit); [|exact (window_is x X)|exact ({before} x X)].
    vm_cast_no_check (eq_refl true).
Qed.
"""


def all_in_range(name: str, graph: str, ports: str, size: int) -> str:
    """Write that every code of a graph without memory is in its range."""
    return f"""\
Theorem {name} : forall x, inputs_within {ports} x -> forall n i, (i < length {graph})%nat -> in_range {graph} x i n.
Proof.
  intros x X. apply (ranges {size} {graph} {ports} [] x {graph}_is_ordered); try exact X; try (intros i n []).
  - vm_cast_no_check (eq_refl true).
  - vm_cast_no_check (eq_refl true).
Qed.
"""


def decided(windows: Windows, index: int, target: int) -> Rows:
    """Return a plan that proves the range of a target, or that with the highest precision."""
    entry = windows.cascade.graph.node(target)
    size = max(abs(entry.low), abs(entry.high)).bit_length() + windows.cascade.bits_lost(index)
    for fewer in _FEWER_BITS:
        made = windows.cascade.rows(index, target, max(size + 16 - fewer, 8))
        if _fits(windows, made, (entry.low, entry.high)):
            break
    return made


def _fits(windows: Windows, made: Rows, within: Range) -> bool:
    return (
        windows.most(made.row) + made.rest <= made.whole * within[1]
        and windows.most(negative(made.row)) + made.rest <= -made.whole * within[0]
    )
