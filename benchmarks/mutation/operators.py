"""What cosmic-ray's operators can change in a file; the only module that needs the extra "mutation"."""

from __future__ import annotations

from importlib.metadata import version

from benchmarks.mutation.mutants import Change
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

TOOL = f"cosmic-ray {version('cosmic-ray')}"


def changes(source: str) -> list[Change]:
    """List what every operator can do, but for those that would have to be told names of variables."""
    nodes = list(ast_nodes(get_ast(source)))
    found = []
    for name in operator_names():
        made = get_operator(name)
        if made.arguments():
            continue
        operator = made()
        positions = (position for node in nodes for position in operator.mutation_positions(node))
        found += [Change(name, count, start, end) for count, (start, end) in enumerate(positions)]
    return found


def changed(source: str, change: Change) -> str:
    """Return the source with one change."""
    text: str | None = mutate_code(source, get_operator(change.operator)(), change.occurrence)
    assert text is not None, "the operator has found this place before"
    return text
