"""The examples that come with the package, by name: specifications, recipes, scenarios, measurements."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean

DEFAULT = "flange_wear"
"""The specification that explains every key."""
ALL = "all"
"""The name that stands for every example, in the folder `examples` that the documentation's commands name."""

_FOLDER = Path(__file__).parents[2] / "examples"


def titles() -> dict[str, str]:
    """Return a line on each example by its name: what a file's first comment says, and what a folder holds."""
    return {
        name: f"files of the folder: {len(_inside(place))}" if place.is_dir() else _first_sentence(place)
        for name, place in _places().items()
    }


def contents(name: str, target: Path | None = None) -> dict[Path, bytes]:
    """Return the content of each file of the example `name`, by the path where it goes.

    A specification brings the files that it names along.

    Parameters
    ----------
    target : Path, optional
        File, or for a folder the folder, where it goes; by default the last part of its name.

    Raises
    ------
    SpecificationError
        If no example has that name.
    """
    places = _places()
    if name not in places:
        raise SpecificationError(
            f"the example must be one that sosmith init --list shows, not {name!r}{did_you_mean(name, places)}"
        )
    place = places[name]
    if place.is_dir():
        folder = target or Path(place.name)
        return {folder / path.relative_to(place): path.read_bytes() for path in _inside(place)}
    file = target or Path(f"{name.rpartition('/')[2]}.toml")
    tree = tomllib.loads(place.read_text(encoding="utf-8"))
    beside = {file.parent / named: (place.parent / named).read_bytes() for named in _files_named(tree, place.parent)}
    return {file: place.read_bytes(), **beside}


def _places() -> dict[str, Path]:
    """Path of each example by its name."""
    files = [path for path in _inside(_FOLDER) if path.suffix == ".toml" and not (path.parent / "__main__.py").exists()]
    folders = sorted({parent for path in _inside(_FOLDER) for parent in path.parents if _FOLDER in parent.parents})
    return {
        DEFAULT: Path(__file__).with_name("example.toml"),
        **{path.relative_to(_FOLDER).with_suffix("").as_posix(): path for path in files},
        **{path.relative_to(_FOLDER).as_posix(): path for path in folders},
        ALL: _FOLDER,
    }


def _inside(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)


def _first_sentence(path: Path) -> str:
    comment = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("# "):
            break
        comment.append(line[2:])
    return " ".join(comment).split(". ")[0].rstrip(".:")


def _files_named(tree: Any, folder: Path) -> Iterator[str]:
    """Texts in a document that name a file of `folder`."""
    if isinstance(tree, dict):
        for value in tree.values():
            yield from _files_named(value, folder)
    elif isinstance(tree, str) and (folder / tree).is_file():
        yield tree
