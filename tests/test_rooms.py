"""The house: imports run one way among rooms and among the sub-rooms of a room, and no floor is crowded."""

import ast
import re
from collections.abc import Iterable
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.realizations.registry import REALIZATIONS
from tests.house import ROOMS, ROOT, WITH_SUB_ROOMS, arrows, floors, imported, modules

ABOVE = ("cli", "commands", "studio", "interface", "host", "terminal")
"""What stands above the rooms, in src/sosmith."""
MAX_PARTS = 20
INTERFACE = (
    "sosmith.interface",
    "sosmith.studio",
    "sosmith.commands",
    "sosmith.terminal",
    "sosmith.output_paths",
    "sosmith.model.errors",
)
"""What commands import."""


def test_there_are_rooms_and_sub_rooms_to_look_at() -> None:
    assert len(modules()) > 150
    assert len(arrows("model")) > 10
    assert "dataflow" in arrows("model")["sections"]


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_imports_from_one_above(room: str) -> None:
    above = {*ROOMS[ROOMS.index(room) + 1 :], *ABOVE}
    upward = {
        f"{path} from {name}"
        for path in modules()
        if path.parts[0] == room
        for name in imported(path)
        if name.split(".")[1] in above
    }
    assert upward == set()


@pytest.mark.parametrize(("room", "other"), [("instrument", "sim"), ("sim", "instrument"), ("verify", "gen")])
def test_rooms_side_by_side_know_nothing_of_each_other(room: str, other: str) -> None:
    names = {name for path in modules() if path.parts[0] == room for name in imported(path)}
    assert {name for name in names if name.startswith(f"sosmith.{other}.")} == set()


@pytest.mark.parametrize("room", WITH_SUB_ROOMS)
def test_sub_rooms_import_in_no_circle(room: str) -> None:
    parts = [part for floor in floors(room) for part in floor]
    assert sorted(parts) == sorted(arrows(room))


def test_no_files_import_each_other() -> None:
    files = {"sosmith." + ".".join(path.with_suffix("").parts): path for path in modules() if path.stem != "__init__"}
    order = TopologicalSorter({name: imported(path) & files.keys() for name, path in files.items()})
    assert len([*order.static_order()]) == len(files)  # a CycleError names those of a circle


def test_the_verifier_shares_nothing_with_what_it_checks() -> None:
    inside = [path for path in modules() if path.parts[0] == "verify"]
    assert len(inside) > 3
    allowed = ("sosmith.verify", "sosmith.model.errors")
    shared = {f"{path} from {name}" for path in inside for name in imported(path) if not name.startswith(allowed)}
    assert shared == set()


def test_the_studio_computes_with_the_public_interface_only() -> None:
    inside = sorted((ROOT / "src" / "sosmith" / "studio").glob("*.py"))
    assert len(inside) > 4
    # beside it: how a page is framed and served
    allowed = (
        "sosmith.studio",
        "sosmith.interface",
        "sosmith.host.loopback",
        "sosmith.model.templates",
        "sosmith.gen.report",
    )
    others = {f"{path.name} from {name}" for path in inside for name in imported(path) if not name.startswith(allowed)}
    assert others == set()


def compared_texts(path: Path, names: Iterable[str]) -> set[str]:
    """Texts that the code at `path` compares something with, or looks up by, one by one or in a collection.

    A file that has none of the `names` anywhere is not parsed.
    """
    text = (ROOT / path).read_text(encoding="utf-8")
    if not any(name in text for name in names):
        return set()
    places = [
        node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Compare, ast.MatchValue, ast.Subscript))
    ]
    inside = [part for place in places for part in ast.walk(place)]
    return {part.value for part in inside if isinstance(part, ast.Constant) and isinstance(part.value, str)}


def test_only_registries_tell_architectures_and_realizations_apart() -> None:
    """Everything else asks the class: a new one is then registered, and nothing else changes."""
    names = {
        **dict.fromkeys(ARCHITECTURES, "gen/architectures"),
        **dict.fromkeys((realization.name for realization in REALIZATIONS.values()), "gen/realizations"),
    }
    top = ROOT / "src" / "sosmith"
    above = [
        path.relative_to(ROOT) for part in ABOVE for path in (*top.glob(f"{part}.py"), *top.glob(f"{part}/**/*.py"))
    ]
    places = {path: compared_texts(path, names) for path in (*modules(), *above)}
    apart = {
        f"{path.as_posix()}: {name}"
        for path, texts in places.items()
        for name in texts & names.keys()
        if not path.as_posix().startswith(names[name]) and path.parts[0] not in _KNOW_FILES_ALONE
    }
    assert apart - _OTHER_MEANINGS == set()


_KNOW_FILES_ALONE = ("verify",)
"""Rooms that share nothing with the registries."""

_OTHER_MEANINGS = {
    "instrument/uncertainty/budget.py: normal",  # a distribution
}


def test_contributing_names_files_that_are_there() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("## What to change")[2]
    named = re.findall(r"`((?:[\w.]+/)+(?:\w+\.(?:py|md))?)`", text)
    assert len(named) > 20
    assert [path for path in named if not any(ROOT.glob(path.replace("NAME", "*")))] == []


def test_commands_stand_on_the_public_interface() -> None:
    folder = ROOT / "src" / "sosmith" / "commands"
    paths = sorted(folder.rglob("*.py"))
    assert len(paths) > 20
    past = {
        f"{path.relative_to(folder)} from {name}"
        for path in paths
        for name in imported(path)
        if name.startswith("sosmith.") and not name.startswith(INTERFACE)
    }
    assert past == set()


@pytest.mark.parametrize("folder", [*ROOMS, "src/sosmith/commands", "tests"])
def test_no_folder_is_crowded(folder: str) -> None:
    for place in [ROOT / folder, *(path for path in (ROOT / folder).rglob("*") if path.is_dir())]:
        inside = [path for path in place.iterdir() if path.suffix == ".py" or (path.is_dir() and path.name[0] != "_")]
        assert len(inside) <= MAX_PARTS, f"{place.relative_to(ROOT)} must have at most {MAX_PARTS} parts"


def test_every_sub_room_says_what_it_holds() -> None:
    folders = {path.parent for path in modules()}
    assert [str(folder) for folder in sorted(folders) if not (ROOT / folder / "__init__.py").exists()] == []
    texts = [(ROOT / folder / "__init__.py").read_text(encoding="utf-8") for folder in sorted(folders)]
    assert all(text.startswith('"""') for text in texts)
    assert len(set(texts)) == len(texts)


def test_helpers_stand_in_modules_of_their_own() -> None:
    """No file of tests imports from another one: to find, move or delete one is then to know all of it."""
    named = re.compile(r"^\s*(?:from|import) (tests\.(?:\w+\.)*test_\w+)", re.MULTILINE)
    paths = [*(ROOT / "tests").rglob("*.py"), *(ROOT / "benchmarks").rglob("*.py")]
    assert len(paths) > 400
    found = {f"{p.relative_to(ROOT)}: {name}" for p in paths for name in named.findall(p.read_text(encoding="utf-8"))}
    assert found == set()


OF_NO_ROOM = ("documents", "edge", "formal", "machines", "sim/peers", "suite")
"""Folders of tests of no one part of the source: documents, proofs and peers across rooms, machines, the suite."""


def test_tests_lie_where_their_subject_lies() -> None:
    folders = {path.parent.relative_to(ROOT / "tests") for path in (ROOT / "tests").rglob("test_*.py")}
    inside = sorted(folder for folder in folders if folder.parts and not str(folder).startswith(OF_NO_ROOM))
    assert len(inside) > 40
    homes = (ROOT, ROOT / "src" / "sosmith")
    named = [home / folder for folder in inside for home in homes]
    found = {path.relative_to(ROOT) for path in named if path.is_dir() or path.with_suffix(".py").exists()}
    assert [str(folder) for folder in inside if not {folder, Path("src/sosmith", folder)} & found] == []
