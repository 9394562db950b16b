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
        Files and folders of tests, from the root. Only fast tests of these are run.
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

    def test_files(self, root: Path) -> list[str]:
        """List everything under the tests that is Python, helpers included, sorted."""
        places = [root / name for name in self.tests]
        files = [path for place in places for path in ([place] if place.is_file() else place.rglob("*.py"))]
        return sorted({path.relative_to(root).as_posix() for path in files})


ROOMS = {
    "proof": Room(
        files=("gen/proof/*.py",),
        tests=("tests/gen/proof", "tests/gen/verifier/test_certificate.py"),
    ),
    "verifier": Room(
        files=("gen/verifier/**/*.py",),
        tests=("tests/gen/verifier",),
        whole_messages=("gen/verifier/program/fault.py",),
    ),
    "arithmetic": Room(
        files=("model/arithmetic/*.py",),
        tests=("tests/model/arithmetic", "tests/gen/filter", "tests/model/sensors/test_digitizer.py"),
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
