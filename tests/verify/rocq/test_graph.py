"""Whether a certificate's nodes are a graph, in Rocq: as our verifier says, whatever operand or output is edited."""

import json
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.verify.certificate_edits import at, edited, edits, numbers
from tests.verify.rocq.small import BOTH, SETTLING, checked, designed, library, needs_coqc, small

from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError, check_graph, inputs_of
from sosmith.verify.rocq.check import head
from sosmith.verify.rocq.flat import flattened, used_inputs
from sosmith.verify.rocq.ranges import core_definitions

NO_GRAPH = re.compile("must have operands before it|must be nodes of it|must have -?[0-9]+ fraction bits|must drop at")
"""What our verifier says of it."""


def verdicts(made: list[Certificate], folder: Path) -> list[bool]:
    """Return whether Rocq takes the nodes of each certificate for a graph."""
    library(folder)
    parts = [
        f"Module M{index}.\n{core_definitions(graph)}"
        f"Eval vm_compute in well_formed core ports {graph.layout()}.\nEnd M{index}.\n"
        for index, graph in enumerate(map(flattened, made))
    ]
    (folder / "Graphs.v").write_text("".join([head(("Definitions", "Graph")), *parts]), encoding="utf-8")
    line = ["coqc", "-q", "-w", "none", "-Q", ".", "Sosmith", "Graphs.v"]
    said = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=True).stdout
    return [word == "true" for word in re.findall(r"= (true|false)", said)]


def edited_places(made: Certificate) -> Iterator[Certificate]:
    tree: Any = json.loads(certificate_text(made))
    for place in numbers(tree["stages"]):
        if {"operands", "outputs"} & set(place):
            for new in edits(at(tree["stages"], place)):
                if new >= 0:
                    yield Certificate.model_validate(edited(tree, ("stages", *place), new))


def is_graph(made: Certificate) -> bool | None:
    """Ask our verifier, stage by stage; None where it refuses the range of a bound, and asks no further."""
    for stage in made.stages:
        try:
            check_graph(stage)
        except RejectedError as error:
            if "must have a range within" in str(error):
                return None
            if NO_GRAPH.search(str(error)):
                return False
    before = [[stage.nodes[at].frac for at in stage.outputs] for stage in made.stages]
    entering = [[stage.nodes[at].frac for at in inputs_of(stage)] for stage in made.stages]
    return before[:-1] == entering[1:]


@pytest.mark.slow
@needs_coqc
@pytest.mark.parametrize("each", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_rocq_and_our_verifier_take_the_same_for_a_graph(each: int, tmp_path: Path) -> None:
    expected = [(one, is_graph(one)) for one in [*edited_places(small(order=1, steady=True))][::each]]
    made = [(one, said) for one, said in expected if said is not None]
    assert len(made) > 60 // each
    assert 20 // each < sum(said for _, said in made) < len(made) - 20 // each
    assert verdicts([one for one, _ in made], tmp_path) == [said for _, said in made]


@pytest.mark.slow
@needs_coqc
def test_a_branch_that_only_passes_through_stages_is_handed_on(tmp_path: Path) -> None:
    made = small("lattice_wdf", order=5)
    assert any(set(stage.outputs) & set(inputs_of(stage)) - set(used_inputs(stage)) for stage in made.stages)
    assert verdicts([made], tmp_path) == [True]


def node(tree: Any, name: str) -> Any:
    return next(entry for stage in tree["stages"] for entry in stage["nodes"] if entry.get("name") == name)


def itself(tree: Any) -> None:
    """Let a node take itself."""
    nodes = tree["stages"][1]["nodes"]
    place, taker = next((place, entry) for place, entry in enumerate(nodes) if entry["op"] == "scale")
    taker["operands"] = [place]


def beyond(tree: Any) -> None:
    """Let a delay take a node of the next stage."""
    node(tree, "first")["operands"] = [len(tree["stages"][0]["nodes"])]


def no_output(tree: Any) -> None:
    """Let an output be a node of the next stage."""
    tree["stages"][0]["outputs"][1] = len(tree["stages"][0]["nodes"])


def other_point(tree: Any) -> None:
    """Move the binary point of a sum."""
    next(entry for entry in tree["stages"][1]["nodes"] if entry["op"] == "add")["frac"] += 1


def falling(tree: Any) -> None:
    """Let limits fall."""
    entry = tree["stages"][-1]["nodes"][-1]
    entry["low"], entry["high"] = entry["high"], entry["low"]


def ahead(tree: Any) -> None:
    """Let a node before the decimator take itself."""
    nodes = tree["decimation"]["calibration"]["stages"][0]["nodes"]
    place, taker = next((place, entry) for place, entry in enumerate(nodes) if entry["op"] == "multiply")
    taker["operands"][0] = place


def other_start(tree: Any) -> None:
    """Hold something else than the first sample."""
    node(tree, "first")["operands"] = [4]


def other_flag(tree: Any) -> None:
    """Let the flag be what it is rounded from."""
    tree["stages"][-1]["outputs"][1] -= 1


def growing(tree: Any) -> None:
    """Let a section be unstable."""
    node(tree, "product_A1")["parameter"] *= 4


def passing(tree: Any) -> None:
    """Let a section pass the first sample on instead of its result."""
    nodes = tree["stages"][1]["nodes"]
    tree["stages"][1]["outputs"][0] = [place for place, entry in enumerate(nodes) if entry["op"] == "input"][-1]


EDITS: dict[str, tuple[Callable[[Any], None], Callable[[], Certificate], str]] = {
    edit.__name__: (edit, base, claim)
    for edit, base, claim in (
        (itself, lambda: small(order=1, steady=True), "core_is_well_formed"),
        (other_start, lambda: small(order=1, steady=True), "starts_from_first"),
        (other_flag, lambda: designed(SETTLING), "flagged"),
        (growing, lambda: small(order=1, steady=True), "recursion_gain_0"),
        (beyond, lambda: small(order=1, steady=True), "core_is_well_formed"),
        (no_output, lambda: small(order=1, steady=True), "core_is_well_formed"),
        (other_point, lambda: small(order=1, steady=True), "core_is_well_formed"),
        (falling, lambda: small(order=1, steady=True), "core_is_well_formed"),
        (ahead, lambda: designed(BOTH), "ahead_is_well_formed"),
        (passing, lambda: small(order=1, steady=True), "core_is_well_formed"),
    )
}


@needs_coqc
@pytest.mark.sweep(1)
@pytest.mark.parametrize("edit", EDITS)
def test_the_kernel_refuses_what_is_not_built_as_it_must_be(edit: str, tmp_path: Path) -> None:
    change, base, claim = EDITS[edit]
    tree = json.loads(certificate_text(base()))
    change(tree)
    with pytest.raises(RejectedError, match=f"^Rocq must accept {claim} \\("):
        checked(Certificate.model_validate(tree), tmp_path)
