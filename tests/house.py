"""The structure of the code, read off its files: rooms, sub-rooms, what imports what, first lines of docstrings.

Imports are taken from the syntax tree wherever they stand, inside functions and under TYPE_CHECKING as well.
"""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("model", "verify", "hdl", "gen", "sim", "instrument")
"""The rooms below the command line, the lowest first."""
WITH_SUB_ROOMS = ("model", "verify", "hdl", "gen", "sim", "instrument")


@cache
def modules() -> tuple[Path, ...]:
    """Every module of the rooms, relative to the root, in the order of their paths; packages by their `__init__.py`."""
    return tuple(path.relative_to(ROOT) for room in ROOMS for path in sorted((ROOT / room).rglob("*.py")))


@cache
def _read(path: Path) -> tuple[frozenset[str], str | None]:
    """Read a file once: the modules of the package that it names in its imports, and its docstring."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    return _imported(tree, path), ast.get_docstring(tree)


def imported(path: Path) -> frozenset[str]:
    """Modules of the package that the file at `path` names in its imports, with dots."""
    return _read(path)[0]


def _imported(tree: ast.Module, path: Path) -> frozenset[str]:
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            raise AssertionError(f"{path} must import absolutely, not from {'.' * node.level}{node.module or ''}")
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.add(node.value)  # import_module("sosmith.x") counts, whoever calls it
    return frozenset(name for name in found if name.startswith("sosmith.") and is_module(name))


@cache
def is_module(name: str) -> bool:
    """Whether `name`, with dots, is a module or a package of the rooms or beside them."""
    parts = name.split(".")[1:]
    place = ROOT.joinpath(*parts) if parts[0] in ROOMS else ROOT.joinpath("src", "sosmith", *parts)
    return place.with_suffix(".py").exists() or (place / "__init__.py").exists()


def part_of(path: Path) -> str:
    """Name the part of its room that a module belongs to: its sub-room, or itself where it stands beside them."""
    return path.parts[1].removesuffix(".py") if len(path.parts) > 1 else ""


@cache
def arrows(room: str) -> dict[str, set[str]]:
    """For each part of `room`, the other parts that it imports from."""
    found: dict[str, set[str]] = {}
    for path in modules():
        if path.parts[0] == room and path != Path(room, "__init__.py"):
            others = {name.split(".")[2] for name in imported(path) if name.startswith(f"sosmith.{room}.")}
            found.setdefault(part_of(path), set()).update(others - {part_of(path)})
    return found


def floors(room: str) -> list[list[str]]:
    """Parts of `room` by floors, the lowest first: each imports from floors below only.

    Raises
    ------
    graphlib.CycleError
        If parts import each other in a circle.
    """
    graph = arrows(room)
    level: dict[str, int] = {}
    for part in TopologicalSorter(graph).static_order():
        level[part] = 1 + max((level[below] for below in graph[part]), default=-1)
    return [sorted(part for part in level if level[part] == height) for height in range(max(level.values()) + 1)]


def summary(path: Path) -> str:
    """First line of the module's docstring, without its full stop."""
    text = _read(path)[1]
    assert text, f"{path} must have a docstring"
    return text.splitlines()[0].rstrip(".").replace("``", "`")


def picture(room: str) -> str:
    """Draw the parts of `room` floor by floor, the highest first, each with the parts that it stands on."""
    graph = arrows(room)
    wide = max(map(len, graph))
    lines = []
    for height, parts in reversed(list(enumerate(floors(room)))):
        for k, part in enumerate(parts):
            folder = f"{part}/" if (ROOT / room / part).is_dir() else part
            below = " ".join(sorted(graph[part]))
            floor = f"floor {height}" if k == 0 else " " * 7
            lines.append(f"    {floor}   {folder.ljust(wide + 1)}{'  -> ' + below if below else ''}".rstrip() + "\n")
    return "".join(lines)


def file_table(room: str) -> str:
    """One row for each module of `room`: its path, and the first line of its docstring."""
    rows = [
        f"| `{path}` | {summary(path)} |\n" for path in modules() if path.parts[0] == room and path.stem != "__init__"
    ]
    return "| file | holds |\n|---|---|\n" + "".join(rows)
