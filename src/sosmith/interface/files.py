"""Files that commands read and write, these all or none, and the examples that come with the package."""

from __future__ import annotations

from pathlib import Path

from sosmith.gen.specification.examples import DEFAULT, contents, titles
from sosmith.model.foreign_files import check_input, read_text
from sosmith.model.text_files import check_file, to_json, write_contents, write_file, write_files

__all__ = [
    "DEFAULT",
    "check_file",
    "check_input",
    "contents",
    "default_folder",
    "read_text",
    "titles",
    "to_json",
    "write_contents",
    "write_file",
    "write_files",
]


def default_folder(name: str) -> Path:
    """Return the default output folder for the specification `name`."""
    return Path("build") / name
