"""Tries a sample of mutants of one room, and puts what came out into the record."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from benchmarks.mutation.bench import Coverage, merged
from benchmarks.mutation.mutants import Mutant, Population, short_digest, statement_lines
from benchmarks.mutation.results import Cache, Equivalent, Outcome
from benchmarks.mutation.rooms import Room

GOAL = 0.9
"""Least share of the mutants that tests must kill, equivalent ones left out."""

Progress = Callable[[int, Counter[str]], None]
"""Called after each mutant with the number done and how many came out how."""


class Trier(Protocol):
    """What mutants are tried on: a `Bench`, or what stands for one in a test."""

    def coverage(self, test: str, without: Sequence[str], files: Sequence[str]) -> Coverage:
        """Run tests on the code as it is."""

    def try_mutant(self, path: str, text: str, tests: Sequence[str], limits: dict[str, float]) -> tuple[str, str]:
        """Run tests with another text in place of a file."""


@dataclass(frozen=True)
class Trial:
    """A mutant and what came of it; the reason is given for an equivalent one."""

    mutant: Mutant
    outcome: Outcome
    reason: str | None = None

    @property
    def kind(self) -> str:
        """``killed``, ``timed_out``, ``equivalent`` or ``survived``."""
        if self.outcome.kind == "survived" and self.reason is not None:
            return "equivalent"
        return self.outcome.kind.replace(" ", "_")


def try_room(
    root: Path,
    room: Room,
    mutants: Sequence[Mutant],
    bench: Callable[[], Trier],
    cache: Cache,
    listed: Sequence[Equivalent],
    progress: Progress = lambda done, counts: None,
) -> list[Trial]:
    """Try every mutant that the cache does not know; each outcome is kept at once.

    The bench is made when the first one has to be tried. Run are the tests that have been seen to execute the mutated
    statement, the quick ones first. A test that found its result in a cache is not among them: a mutant may count as
    surviving that it would kill, never the reverse. A mutant in a statement that no test executes survives untried.
    """
    trials: list[Trial] = []
    counts: Counter[str] = Counter()
    for mutant in mutants:
        outcome = cache.outcome(room, mutant)
        if outcome is None:
            outcome = _tried(root, room, mutant, bench(), cache)
            cache.keep(room, mutant, outcome)
        reason = next((entry.reason for entry in listed if entry.stands_for(mutant)), None)
        trials.append(Trial(mutant, outcome, reason))
        counts[trials[-1].kind] += 1
        progress(len(trials), counts)
    return trials


def _tried(root: Path, room: Room, mutant: Mutant, bench: Trier, cache: Cache) -> Outcome:
    coverage = _coverage(root, room, bench, cache)
    source = (root / mutant.path).read_text(encoding="utf-8")
    found = coverage.of_lines(mutant.path, statement_lines(source, mutant.line))
    if not found:
        return Outcome("survived", "")
    earlier = cache.earlier_test(mutant)
    tests = sorted(found, key=lambda test: (test != earlier, coverage.seconds[test], test))
    return Outcome(*bench.try_mutant(mutant.path, mutant.text, tests, coverage.limits(tests)))


def _coverage(root: Path, room: Room, bench: Trier, cache: Cache) -> Coverage:
    """Find out which tests of the room execute which lines, file by file, each kept at once."""
    parts = []
    for test in room.entries(root):
        part = cache.coverage(room, test)
        if part is None:
            part = bench.coverage(test, room.without, room.paths(root))
            cache.keep_coverage(room, test, part)
        parts.append(part)
    return merged(parts)


def room_record(root: Path, room: Room, found: Population, trials: Sequence[Trial]) -> dict[str, Any]:
    """Return the entry of a room in the record."""
    counts = Counter(trial.kind for trial in trials)
    return {
        "files": {path: short_digest((root / path).read_text(encoding="utf-8")) for path in room.paths(root)},
        "mutants": found.mutants,
        "sites": len(found.sites),
        "exempt": found.exempt,
        "sampled": len(trials),
        **{kind: counts[kind] for kind in ("killed", "timed_out", "survived", "equivalent")},
        "sample": [
            {
                "path": trial.mutant.path,
                "line": trial.mutant.line,
                "place": trial.mutant.place,
                "digest": trial.mutant.digest,
                "offset": trial.mutant.offset,
                "operator": trial.mutant.operator.removeprefix("core/"),
                "before": trial.mutant.before,
                "after": trial.mutant.after,
                "outcome": trial.kind,
                **({"test": trial.outcome.test} if trial.outcome.test else {}),
                **({"reason": trial.reason} if trial.kind == "equivalent" else {}),
            }
            for trial in trials
        ],
    }


def share(entry: dict[str, Any]) -> float:
    """Share of the mutants that are not equivalent, of one room or of all, that tests have noticed."""
    noticed: int = entry["killed"] + entry["timed_out"]
    return noticed / max(1, entry["sampled"] - entry["equivalent"])
