"""The rooms that are mutated, and the tests that belong to each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, kw_only=True)
class Room:
    """Files that are mutated together.

    Attributes
    ----------
    files : tuple of str
        Patterns from the root of the checkout.
    tests : tuple of str
        Folders, files and single tests, from the root; slow ones in them are left out.
    whole_messages : tuple of str
        Files that do nothing but word messages; they are not mutated.
    """

    files: tuple[str, ...]
    tests: tuple[str, ...]
    whole_messages: tuple[str, ...] = ()

    def paths(self, root: Path) -> list[str]:
        """List the files, sorted, relative to `root`."""
        found = {path.relative_to(root).as_posix() for pattern in self.files for path in root.glob(pattern)}
        return sorted(name for name in found if not name.endswith("__init__.py"))

    def mutated(self, root: Path) -> list[str]:
        """List the files of `paths` that are mutated."""
        return [name for name in self.paths(root) if name not in self.whole_messages]

    def entries(self, root: Path) -> list[str]:
        """List the files of tests below the folders of `tests`, and what else stands there, in order."""
        found: list[str] = []
        for name in self.tests:
            files = sorted((root / name).rglob("test_*.py")) if (root / name).is_dir() else []
            found += [path.relative_to(root).as_posix() for path in files] or [name]
        return found

    def test_files(self, root: Path) -> list[str]:
        """List the files of the tests, sorted."""
        return sorted({name.partition("::")[0] for name in self.entries(root)})


ROOMS = {
    "proof": Room(
        files=("gen/proof/*.py",),
        tests=("tests/gen/proof",),
    ),
    "verifier": Room(
        files=("gen/verifier/**/*.py",),
        tests=("tests/gen/verifier",),
        whole_messages=("gen/verifier/program/fault.py",),
    ),
    "arithmetic": Room(
        files=("model/arithmetic/*.py",),
        tests=("tests/model/arithmetic",),
    ),
    "hdl": Room(
        files=("hdl/*.py",),
        tests=("tests/hdl",),
    ),
    "verdict": Room(
        files=(
            "gen/report/report.py",
            "gen/report/evidence.py",
            "gen/filter/response.py",
            "model/reference/accuracy.py",
        ),
        tests=("tests/gen/report/test_report.py", "tests/model/reference"),
    ),
}
"""Rooms by name. `verdict` holds what decides whether a report says that a run has passed."""
