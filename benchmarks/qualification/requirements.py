"""The requirements and malfunctions of requirements.toml, as they stand in docs/assurance.md."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_TABLE = Path(__file__).with_name("requirements.toml")


@dataclass(frozen=True)
class Requirement:
    """What has to hold.

    Attributes
    ----------
    id : str
        Its identifier, which stays with it.
    claim : str
        The claim of docs/assurance.md that it belongs to.
    text : str
        What it says.
    tests : tuple of str
        Files and folders of tests that show it.
    """

    id: str
    claim: str
    text: str
    tests: tuple[str, ...]

    def shown_by(self, test: str) -> bool:
        """Whether a test, by its identifier, is one of those."""
        path = test.split("::", maxsplit=1)[0]
        return any(path == one or path.startswith(f"{one}/") for one in self.tests)


@dataclass(frozen=True)
class Malfunction:
    """What may go wrong, what detects it, and which tests show that."""

    what: str
    detected: str
    tests: tuple[str, ...]


def requirements() -> tuple[Requirement, ...]:
    """Return all requirements, in their order."""
    return tuple(Requirement(**{**row, "tests": tuple(row["tests"])}) for row in _tree()["requirement"])


def malfunctions() -> tuple[Malfunction, ...]:
    """Return all malfunctions, in their order."""
    return tuple(Malfunction(**{**row, "tests": tuple(row["tests"])}) for row in _tree()["malfunction"])


def tables() -> dict[str, str]:
    """Return the tables of the document by their marks, in Markdown."""
    rows = "".join(f"| {one.id} | {one.claim} | {one.text} | {_links(one.tests)} |\n" for one in requirements())
    faults = "".join(f"| {one.what} | {one.detected} | {_links(one.tests)} |\n" for one in malfunctions())
    return {
        "requirements": f"| | claim | requirement | shown by |\n|---|---|---|---|\n{rows}",
        "malfunctions": f"| malfunction | detected by | shown by |\n|---|---|---|\n{faults}",
    }


def _links(tests: tuple[str, ...]) -> str:
    return ", ".join(f"`{one}`" for one in tests)


def _tree() -> dict[str, list[dict[str, object]]]:
    return tomllib.loads(_TABLE.read_text(encoding="utf-8"))
