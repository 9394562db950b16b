"""The house: imports run one way among rooms and among the sub-rooms of a room, and no floor is crowded."""

import pytest

from tests.house import ROOMS, ROOT, WITH_SUB_ROOMS, arrows, floors, imported, modules

ABOVE = ("cli", "commands", "studio", "interface", "host", "terminal")
"""What stands above the rooms, in src/sosmith."""
MAX_PARTS = 20


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


def test_the_verifier_shares_nothing_with_what_it_checks() -> None:
    inside = [path for path in modules() if path.parts[0] == "verify"]
    assert len(inside) > 3
    allowed = ("sosmith.verify", "sosmith.model.errors")
    shared = {f"{path} from {name}" for path in inside for name in imported(path) if not name.startswith(allowed)}
    assert shared == set()


def test_the_studio_computes_with_the_public_interface_only() -> None:
    inside = sorted((ROOT / "src" / "sosmith" / "studio").glob("*.py"))
    assert len(inside) > 4
    # beside it: how a page is framed, and how a file is written
    allowed = ("sosmith.studio", "sosmith.model.templates", "sosmith.model.text_files", "sosmith.gen.report")
    others = {f"{path.name} from {name}" for path in inside for name in imported(path) if not name.startswith(allowed)}
    assert others == set()


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
