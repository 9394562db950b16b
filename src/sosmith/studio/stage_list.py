"""The list of stages in the text of a specification: one is added, removed or moved, with its comments.

No line of another table changes. Stages that are written as an array on one line become tables.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sosmith import ChainSpecification
from sosmith.studio.edits import STAGE, changed, parsed, sample_rate
from sosmith.studio.new_stages import fresh
from sosmith.studio.tables import cut, joined, written

_STAGE = f"[[{STAGE}]]"
_SINGLE = ("calibration", "filter")
"""Tables of a single core that are stages of a chain, in the order of the samples."""
_BEHIND = ("[limits]", "[output]", "[hardware]")
"""What stands behind the stages, where a text has none yet."""


def stages_of(text: str) -> list[dict[str, Any]] | None:
    """Return the tables of the stages in a text; None for that of a single core, and for what is no TOML."""
    tree = parsed(text)
    stages = None if tree is None else tree.get(STAGE)
    if not isinstance(stages, list):
        return [] if tree is not None and not set(_SINGLE) & set(tree) else None
    return [stage for stage in stages if isinstance(stage, dict)]


def added(text: str, kind: str, k: int) -> str:
    """Return a text with a new stage of a kind at place `k`, which has a name and keys that suit its place."""
    stages, tree = stages_of(text), parsed(text)
    if stages is None or tree is None:
        return text
    k = min(max(k, 0), len(stages))
    table = {"name": _free_name(kind, stages), "kind": kind}
    table |= fresh(kind, stages[:k], stages[k:], sample_rate(tree), {})
    return _rewritten(text, lambda tables: [*tables[:k], written(table, _STAGE), *tables[k:]])


def removed(text: str, k: int) -> str:
    """Return a text without stage `k`."""
    return _rewritten(text, lambda tables: [*tables[:k], *tables[k + 1 :]])


def moved(text: str, k: int, to: int) -> str:
    """Return a text in which stage `k` is number `to`."""

    def order(tables: list[str]) -> list[str]:
        rest = [*tables[:k], *tables[k + 1 :]]
        return [*rest[:to], *tables[k : k + 1], *rest[to:]]

    return _rewritten(text, order)


def chosen(text: str, stages: Sequence[Mapping[str, Any]], limits: Mapping[str, Any]) -> str:
    """Return a text with other stages, and the limits of the whole that they keep to."""
    tables = [written(stage, _STAGE) for stage in stages]
    return _rewritten(text, lambda _: [*tables, written(limits, "[limits]")])


def split(text: str) -> str:
    """Return the specification of a single core as that of a chain: with a stage each for calibration and filter."""
    tree = parsed(text)
    if tree is None or STAGE in tree:
        return text
    hardware = tree.get("hardware")
    realization = hardware.get("realization") if isinstance(hardware, dict) else None
    if realization is not None:
        text = changed(text, {"hardware.realization": None})
    pieces, tables = cut(text), []
    for name in _SINGLE:
        if isinstance(tree.get(name), dict):
            as_written = [piece.text for piece in pieces if piece.header == f"[{name}]"]
            tables.append(_as_stage(name, tree[name], *as_written[:1], realization=realization))
    made = joined(pieces, tables, {f"[{name}]" for name in _SINGLE}, _BEHIND)
    return made if len(stages_of(made) or ()) == len(tables) else text


def _as_stage(name: str, table: Mapping[str, Any], text: str = "", *, realization: Any) -> str:
    """Return the table of a single core as that of a stage."""
    kind = "polynomial"
    if name == "filter":
        is_fir = "taps" in table or "taps_file" in table or table.get("family") in ChainSpecification.families("fir")
        kind = "fir" if is_fir else "iir"
    text = text or written(table, f"[{name}]")
    head = f'{_STAGE}\nname = "{name}"\nkind = "{kind}"'
    if name == "filter":
        text = re.sub(r"(?m)^(\s*)kind(\s*=)", r"\1band\2", text, count=1)
        if realization not in {None, "auto"}:
            head += f'\nrealization = "{realization}"'
    return re.sub(rf"(?m)^\s*\[\s*['\"]?{name}['\"]?\s*\]", lambda _: head, text, count=1)


def _rewritten(text: str, order: Callable[[list[str]], list[str]]) -> str:
    """Return a text with the tables of its stages in another order, or with others; as it is if it is no TOML."""
    stages = stages_of(text)
    if stages is None:
        return text
    pieces = cut(text)
    if sum(piece.header == _STAGE for piece in pieces) != len(stages):
        text = changed(text, {STAGE: None})
        tables = [written(stage, _STAGE) for stage in stages]
        pieces = cut(joined(cut(text), tables, (), _BEHIND))
    tables = [piece.text for piece in pieces if piece.header == _STAGE]
    made = joined(pieces, order(tables), {_STAGE}, _BEHIND)
    return text if parsed(made) is None else made


def _free_name(kind: str, stages: Sequence[Mapping[str, Any]]) -> str:
    """Return the name of a new stage: its kind, with a number where that is taken."""
    taken = [str(stage.get("name", "")).lower() for stage in stages]
    number, name = 1, kind
    while any(name == each or each.startswith(f"{name}_") for each in taken):
        number += 1
        name = f"{kind}{number}"
    return name
