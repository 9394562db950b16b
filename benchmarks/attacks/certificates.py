"""Edits of a certificate: numbers, words, structure and layout, with all digests made right again."""

from __future__ import annotations

import copy
import random
import re
from collections.abc import Callable, Iterator
from typing import Any

Tree = dict[str, Any]
Place = tuple[str | int, ...]
Edit = Callable[[random.Random, Tree], None]


def leaves(tree: Any, place: Place = ()) -> Iterator[Place]:
    """Yield the places of all that is neither an object nor a list."""
    if isinstance(tree, dict | list):
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from leaves(value, (*place, key))
    else:
        yield place


def at(tree: Any, place: Place) -> Any:
    """Return what is at a place."""
    for key in place:
        tree = tree[key]
    return tree


def _containers(tree: Any, kind: type, place: Place = ()) -> Iterator[Place]:
    if isinstance(tree, dict | list):
        if isinstance(tree, kind) and tree:
            yield place
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from _containers(value, kind, (*place, key))


def _leaf(wanted: Callable[[Any], bool], new: Callable[[random.Random, Any], Any]) -> Edit:
    def edit(rng: random.Random, tree: Tree) -> None:
        places = [place for place in leaves(tree) if wanted(at(tree, place))]
        if places:
            place = rng.choice(places)
            at(tree, place[:-1])[place[-1]] = new(rng, at(tree, place))

    return edit


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def is_rational(value: Any) -> bool:
    """Whether a value is a rational number as a text."""
    return isinstance(value, str) and re.fullmatch(r"-?\d+(/\d+)?", value) is not None


def _is_word(value: Any) -> bool:
    return isinstance(value, str) and not is_rational(value) and re.fullmatch(r"[0-9a-f]{64}", value) is None


def _near(rng: random.Random, value: int) -> int:
    return value + rng.choice([-1, 1, -2, 2, 8, -8])


def _far(rng: random.Random, value: int) -> int:
    return rng.choice([-value, 0, 2 * value, value << 20, 10**9, -(2**4096), 2**4097, value ^ 1])


def _rational(rng: random.Random, value: str) -> str:
    p, _, q = value.partition("/")
    top, bottom = int(p), int(q or 1)
    new = rng.choice(
        [
            (top + 1, bottom), (top - 1, bottom), (top, bottom + 1), (top, max(bottom - 1, 1)), (-top, bottom), (0, 1),
            (top * 2, bottom), (top, bottom * 2), (top * 3, bottom * 3), (top * (2**64 - 1), bottom * 2**64),
            (top * (2**20 - 1), bottom * 2**20), (top, 0), (bottom, max(abs(top), 1)),
        ]
    )  # fmt: skip
    return f"{new[0]}/{new[1]}"


def _bomb(rng: random.Random, value: Any) -> Any:
    big = "9" * rng.choice([400, 1199, 1300, 6_000])
    return rng.choice([f"1/{big}", f"{big}/1", int(big[:1200]), 10**300, f"1/{3**700}", [value] * 50, "1/3"])


def _word(rng: random.Random, value: str) -> str:
    others = [
        "",
        "zero",
        "steady",
        "parallel",
        "folded",
        "serial",
        "online",
        "none",
        "detect",
        "add",
        "subtract",
        "delay",
    ]
    spoilt = [
        "\x1b[2K",
        "../" + value,
        value + " ",
        value.upper(),
        value * 3,
        "\u202e",
        value[:-1],
        "x" * 3_000,
        "\ud800",
    ]
    return rng.choice(others + spoilt)


def _words(rng: random.Random, tree: Tree) -> None:
    """Change a digit or a word of the specification in the certificate."""
    words = tree["about"]["specification"]
    pattern, new = rng.choice(
        [(r"\d", "0123456789"), (r"\w+", ["x", "true", "1"]), (r"\n", ["", "\n[wear]\n", "\n= 1\n"])]
    )
    places = list(re.finditer(pattern, words))
    place = rng.choice(places)
    tree["about"]["specification"] = words[: place.start()] + rng.choice(list(new)) + words[place.end() :]


def _structure(rng: random.Random, tree: Tree) -> None:
    if rng.random() < 0.5:
        found = at(tree, rng.choice(list(_containers(tree, list))))
        first, second = rng.randrange(len(found)), rng.randrange(len(found))
        action = rng.choice(["swap", "drop", "twice", "empty"])
        if action == "swap":
            found[first], found[second] = found[second], found[first]
        elif action == "drop":
            del found[first]
        elif action == "twice":
            found.insert(second, copy.deepcopy(found[first]))
        else:
            found.clear()
        return
    found = at(tree, rng.choice(list(_containers(tree, dict))))
    key = rng.choice(sorted(found))
    action = rng.choice(["drop", "null", "move", "more"])
    if action == "drop":
        del found[key]
    elif action == "null":
        found[key] = None
    elif action == "move":
        found[key + "_"] = found.pop(key)
    else:
        found[rng.choice(["operands", "parameter", "low", "x", "start", "hold", "reload"])] = rng.choice(
            [0, 1, "0", [], {}, True]
        )


def _node(rng: random.Random, tree: Tree) -> None:
    """Change an operand, an operation or a parameter of a node, or what a stage gives."""
    stage = rng.choice(tree["stages"])
    nodes = stage["nodes"]
    node = rng.choice(nodes)
    action = rng.randrange(5)
    if action == 0 and node.get("operands"):
        node["operands"][rng.randrange(len(node["operands"]))] = rng.randrange(len(nodes))
    elif action == 1:
        node["op"] = rng.choice(
            ["add", "subtract", "shift", "scale", "floor", "truncate", "clamp", "bound", "delay", "constant"]
        )
    elif action == 2:
        node["parameter"] = node.get("parameter", 0) + rng.choice([-1, 1, 2])
    elif action == 3:
        stage["outputs"][0] = rng.randrange(len(nodes))
    else:
        node["frac"] = node["frac"] + rng.choice([-1, 1])


def _item(rng: random.Random, tree: Tree) -> None:
    """Say something else of the item."""
    item = tree["about"]["item"]
    item |= rng.choice(
        [
            {"core": "calibration"}, {"core": "instrument"}, {"architecture": "folded"}, {"architecture": "parallel"},
            {"architecture": "online"}, {"channels": 2}, {"channels": 4096}, {"samples": 2}, {"start": "zero"},
            {"start": "steady"}, {"hold": True}, {"protect": "detect"}, {"protect": "correct"}, {"reload": True},
            {"reload": False}, {"protect": "none"}, {"ahead": "parallel"}, {"flags": {}}, {"flags": {"fault": 0}},
        ]
    )  # fmt: skip


def _files(rng: random.Random, tree: Tree) -> None:
    files = tree["about"]["files"]
    chosen = rng.choice(files)
    action = rng.randrange(4)
    if action == 0:
        chosen["name"] = rng.choice(
            ["../tiny.sv", "/etc/passwd", "tiny.SV", "tiny.sv ", "", "tiny.v", chosen["name"][:-1]]
        )
    elif action == 1:
        chosen["sha256"] = "0" * 64
    elif action == 2:
        files.remove(chosen)
    else:
        files.append({"name": rng.choice(["x", "tiny.vhd", chosen["name"]]), "sha256": "0" * 64})


CLASSES: dict[str, list[Edit]] = {
    "integers": [_leaf(_is_integer, _near), _leaf(_is_integer, _far)],
    "rationals": [_leaf(is_rational, _rational)],
    "size": [_leaf(lambda value: _is_integer(value) or is_rational(value), _bomb)],
    "words": [_leaf(_is_word, _word)],
    "truths": [_leaf(lambda value: isinstance(value, bool), lambda rng, value: not value)],
    "specification": [_words],
    "structure": [_structure],
    "graph": [_node],
    "item": [_item],
    "files": [_files],
}
"""Edits by class."""


def mutant(tree: Tree, seed: str) -> tuple[str, Tree]:
    """Return a class and a certificate with one edit of it, or now and then two; it differs from `tree`."""
    rng = random.Random(seed)
    while True:
        kind = rng.choice(sorted(CLASSES))
        found = copy.deepcopy(tree)
        try:
            for _ in range(1 + (rng.random() < 0.1)):
                rng.choice(CLASSES[kind])(rng, found)
        except (KeyError, IndexError, TypeError):  # an edit of what an edit has taken away
            continue
        if found != tree:
            return kind, found


def spoilt_layout(text: str, seed: str) -> str:
    """Return the text of a certificate that is another one, or none, as JSON."""
    rng = random.Random(seed)
    at_ = rng.randrange(len(text))
    new = rng.choice(
        ["", " ", "\n", "{", "[" * 2_000, "1.0", "NaN", "1e5", '"x": 1, ', "//", "\0", "\ufeff", "\\u0000"]
    )
    return text[:at_] + new + text[at_ + rng.randrange(2) :]
