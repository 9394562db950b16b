"""Edits of certificates, and what is said of them."""

import copy
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sosmith.gen.output.certificate import certificate
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.verification import RejectedError, verify


def proven(quantized: Quantized, max_error: Fraction | None = None) -> None:
    """Certify a design for one LSB, prove it again from the text, and compare with what it was designed on."""
    text = certificate_text(certificate(quantized, max_error or quantized.datapath.output.lsb))
    verdict = verify(Certificate.model_validate(json.loads(text)))
    assert verdict.budget.keys() == quantized.budget.keys()
    for part, value in quantized.budget.items():
        assert -(2**-60) < value - verdict.budget[part] < 2**-16
    if not quantized.sections:
        assert (verdict.ranges, verdict.margin) == (0, 0)


PLACE = tuple[str | int, ...]


def numbers(tree: Any, place: PLACE = ()) -> Iterator[PLACE]:
    """Places of all integers, truth values and rationals of a certificate."""
    if isinstance(tree, dict | list):
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from numbers(value, (*place, key))
    elif isinstance(tree, int) or (isinstance(tree, str) and re.fullmatch(r"-?\d+(/\d+)?", tree)):
        yield place


def edits(value: Any, bits: int | None = None) -> list[Any]:
    """Return a number one unit up and down in each of its integers, or the last of `bits` significant bits."""
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, int):
        return [value - 1, value + 1]
    p, q = Fraction(value).as_integer_ratio()
    up, down = (1 if bits is None else max(1, abs(integer) >> bits) for integer in (p, q))
    changed = [(p - up, q), (p + up, q), (p, q - down), (p, q + down)]
    return [f"{a}/{b}" for a, b in changed if b > 0 and a * q != p * b]


def all_edits(tree: Any) -> list[tuple[PLACE, Any]]:
    """Edit every number. Ideal sections have many more bits than any claim about them depends on."""
    return [
        (place, new)
        for place in numbers(tree)
        for new in edits(at(tree, place), 52 if place[:2] == ("ideal", "sections") else None)
    ]


def at(tree: Any, place: PLACE) -> Any:
    for key in place:
        tree = tree[key]
    return tree


def edited(tree: Any, place: PLACE, new: Any) -> Any:
    result = copy.deepcopy(tree)
    at(result, place[:-1])[place[-1]] = new
    return result


def is_rejected(tree: Any) -> bool:
    try:
        verify(Certificate.model_validate(tree))
    except (RejectedError, ValidationError):
        return True
    return False


def does_not_matter(before: Any, after: Any, place: PLACE) -> bool:
    """Whether an edit leaves a certificate of the same thing, or of something as good.

    `max_error` is a wish, of which the certificate holds that it is met. A BOUND may state any range that holds
    what is possible, as long as no other node's range comes from it. And an operand may be replaced by a node that
    always has the same value, or be that of a node that nothing depends on.
    """
    if place == ("max_error",):
        return True
    if place[-1] in {"low", "high"}:
        return bool(at(before, place[:-1])["op"] == "bound")
    if "operands" in place or "outputs" in place:
        return same_results(*(graph(tree["stages"][place[1]]) for tree in (before, after)))
    return False


def graph(stage: Any) -> Graph:
    nodes = tuple(
        Node(**(node | {"op": Op(node["op"]), "operands": tuple(node.get("operands", ()))})) for node in stage["nodes"]
    )
    inputs = tuple(index for index, node in enumerate(nodes) if node.op is Op.INPUT)
    return Graph(nodes, inputs, tuple(stage["outputs"]))


def same_results(one: Graph, other: Graph) -> bool:
    rng = np.random.default_rng(5)
    ranges = [(one.nodes[i].low, one.nodes[i].high + 1) for i in one.inputs]
    samples = [[int(rng.integers(*ends)) for ends in ranges] for _ in range(300)]
    return unlimited(one).run(samples) == unlimited(other).run(samples)


def unlimited(made: Graph) -> Graph:
    """Let nodes leave their ranges: a section's hold for what the sections before it give, which noise is not."""
    keep = {Op.INPUT, Op.CLAMP}
    return replace(
        made, nodes=tuple(n if n.op in keep else n._replace(low=-(1 << 256), high=1 << 256) for n in made.nodes)
    )


def wrongly_accepted(tree: Any, chosen: list[tuple[PLACE, Any]]) -> list[tuple[PLACE, Any]]:
    result = []
    for place, new in chosen:
        changed = edited(tree, place, new)
        if not is_rejected(changed) and not does_not_matter(tree, changed, place):
            result.append((place, new))
    return result


def rejected(tree: Any, message: str) -> None:
    with pytest.raises(RejectedError, match=f"^{message}$"):
        verify(Certificate.model_validate(tree))
