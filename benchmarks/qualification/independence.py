"""What the verifier's parts stand on, read from their imports: nothing of the house but the classes of errors."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def table() -> str:
    """Return the table of docs/assurance.md: each part of the verifier, and what it imports from outside."""
    rows = []
    for part in sorted(one for one in (ROOT / "verify").iterdir() if one.is_dir() and one.name[0] not in "_."):
        rows.append(_row(f"{part.name}/", sorted(part.rglob("*.py"))))
    rows.append(_row("files beside them", sorted((ROOT / "verify").glob("*.py"))))
    return "| part of `verify/` | of sosmith, outside `verify/` | of others |\n|---|---|---|\n" + "".join(rows)


def imported(path: Path) -> set[str]:
    """Return the modules that a file imports."""
    found = set[str]()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def _row(name: str, paths: list[Path]) -> str:
    modules = set[str]().union(*(imported(path) for path in paths))
    own = {one for one in modules if one.startswith("sosmith.") and not one.startswith("sosmith.verify")}
    outside = {one.split(".")[0] for one in modules} - {"sosmith", "__future__", *sys.stdlib_module_names}
    return f"| {name} | {_listed(own)} | {_listed(outside)} |\n"


def _listed(names: set[str]) -> str:
    return ", ".join(f"`{one}`" for one in sorted(names)) or "nothing"
