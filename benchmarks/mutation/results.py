"""What is kept between runs: outcomes in a cache, and the mutants that are known to be equivalent, with reasons."""

from __future__ import annotations

import ast
import json
import sqlite3
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.mutation.bench import SLOW, Coverage
from benchmarks.mutation.mutants import Mutant, place_digests, short_digest
from benchmarks.mutation.rooms import Room


@dataclass(frozen=True)
class Outcome:
    """What came of a mutant: ``killed``, ``timed out`` or ``survived``, and the test that decided, if one did."""

    kind: str
    test: str


@dataclass(frozen=True)
class Equivalent:
    """A mutant of which no test can exist, since it does the same.

    Attributes
    ----------
    path, place, digest, offset, before, after : str, int
        As of the `Mutant`.
    reason : str
        Why nothing can tell it apart.
    """

    path: str
    place: str
    digest: str
    offset: int
    before: str
    after: str
    reason: str

    def stands_for(self, mutant: Mutant) -> bool:
        """Tell whether this is that mutant, of code that has not changed since."""
        return all(
            getattr(self, name) == getattr(mutant, name)
            for name in ("path", "place", "digest", "offset", "before", "after")
        )


def equivalents(file: Path) -> list[Equivalent]:
    """Read the listed equivalent mutants."""
    tables = tomllib.loads(file.read_text(encoding="utf-8")).get("equivalent", [])
    return [Equivalent(**table) for table in tables]


def stale(listed: Iterable[Equivalent], root: Path) -> list[Equivalent]:
    """Return those whose code has changed since they were listed: their reason must be thought through again."""

    def digest(entry: Equivalent) -> str | None:
        file = root / entry.path
        return place_digests(file.read_text(encoding="utf-8")).get(entry.place) if file.exists() else None

    return [entry for entry in listed if digest(entry) != entry.digest]


class Cache:
    """Outcomes by the content of the mutated file and of the tests that decided.

    A mutant stays killed while the test that killed it and what its file has beside tests are the same, and survives
    while all tests of its room are the same. Where tests have changed, the one that decided before is told, and may be
    tried first. Changes of other code are not noticed: a run that must not lean on earlier ones takes another file.
    """

    def __init__(self, file: Path, root: Path) -> None:
        file.parent.mkdir(parents=True, exist_ok=True)
        self._root = root
        self._texts: dict[str, str] = {}
        self._base = sqlite3.connect(file, isolation_level=None, timeout=600)
        self._base.execute("CREATE TABLE IF NOT EXISTS outcome (key TEXT PRIMARY KEY, kind TEXT, test TEXT, mark TEXT)")
        self._base.execute("CREATE TABLE IF NOT EXISTS coverage (key TEXT PRIMARY KEY, content TEXT)")

    def close(self) -> None:
        """Close the file; everything is in it already."""
        self._base.close()

    def outcome(self, room: Room, mutant: Mutant) -> Outcome | None:
        """Return what came of a mutant with the same tests, None if that is not known."""
        row = self._row(mutant)
        return Outcome(row[0], row[1]) if row and row[2] == self._mark(room, row[1]) else None

    def earlier_test(self, mutant: Mutant) -> str:
        """Return the test that decided about a mutant when tests were others, perhaps; empty if none is known."""
        row = self._row(mutant)
        return row[1] if row else ""

    def keep(self, room: Room, mutant: Mutant, outcome: Outcome) -> None:
        """Keep what came of a mutant, on the disk at once."""
        row = (_key(mutant), outcome.kind, outcome.test, self._mark(room, outcome.test))
        self._base.execute("INSERT OR REPLACE INTO outcome VALUES (?, ?, ?, ?)", row)

    def coverage(self, room: Room, test: str) -> Coverage | None:
        """Return which lines one of the room's entries of tests executes, None if it or the files have changed."""
        found = self._base.execute("SELECT content FROM coverage WHERE key = ?", (self._state(room, test),)).fetchone()
        if found is None:
            return None
        content = json.loads(found[0])
        return Coverage(content["seconds"], {(path, line): set(tests) for path, line, tests in content["tests"]})

    def keep_coverage(self, room: Room, test: str, coverage: Coverage) -> None:
        """Keep which lines one of the room's entries of tests executes."""
        tests = [(path, line, sorted(tests)) for (path, line), tests in coverage.tests.items()]
        content = json.dumps({"seconds": coverage.seconds, "tests": tests})
        self._base.execute("INSERT OR REPLACE INTO coverage VALUES (?, ?)", (self._state(room, test), content))

    def _row(self, mutant: Mutant) -> tuple[str, str, str] | None:
        query = "SELECT kind, test, mark FROM outcome WHERE key = ?"
        row: tuple[str, str, str] | None = self._base.execute(query, (_key(mutant),)).fetchone()
        return row

    def _mark(self, room: Room, test: str) -> str:
        """Content of a test and of what its file has beside tests; of all tests of the room where there is none."""
        name, _, function = test.partition("::")
        if not function or not (self._root / name).exists():
            return self._tests(room)
        return short_digest(*_with_one_test(self._text(name), function.partition("[")[0]))

    def _text(self, name: str) -> str:
        """Text of a file when it was first needed: what is edited during a run has not been tried."""
        if name not in self._texts:
            self._texts[name] = (self._root / name).read_text(encoding="utf-8")
        return self._texts[name]

    def _tests(self, room: Room) -> str:
        return short_digest(str(SLOW), self._content(room.test_files(self._root)))

    def _state(self, room: Room, test: str) -> str:
        names = [test.partition("::")[0], *room.paths(self._root)]
        return short_digest(str(SLOW), test, *room.without, self._content(names))

    def _content(self, names: Iterable[str]) -> str:
        return short_digest(*(f"{name}\0{self._text(name)}" for name in names))


def _key(mutant: Mutant) -> str:
    return short_digest(mutant.path, mutant.text)


def _with_one_test(text: str, function: str) -> list[str]:
    """Top-level statements of a file of tests without the other tests."""
    body = ast.parse(text).body
    lines = text.splitlines()
    kept = [
        node
        for node in body
        if not (isinstance(node, ast.FunctionDef) and node.name.startswith("test_") and node.name != function)
    ]
    return ["\n".join(lines[_first_line(node) - 1 : node.end_lineno]) for node in kept]


def _first_line(node: ast.stmt) -> int:
    return min([node.lineno, *(decorator.lineno for decorator in getattr(node, "decorator_list", []))])
