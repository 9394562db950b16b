"""The mutation tester, on a toy package: what is killed, what survives, what is remembered, what does not count."""

import ast
import json
import re
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from benchmarks.mutation import __main__ as command
from benchmarks.mutation import record as records
from benchmarks.mutation.bench import Bench, Coverage
from benchmarks.mutation.campaign import Trial, room_record, share, try_room
from benchmarks.mutation.exempt import exempt_spans, exemption
from benchmarks.mutation.mutants import Change, Mutant, Population, place_digests, population, sample, statement_lines
from benchmarks.mutation.results import Cache, Equivalent, Outcome, equivalents, stale
from benchmarks.mutation.rooms import ROOMS, ROOT, Room

TOY = '''"""A toy."""


def larger(a: int, b: int) -> int:
    """Return the larger number."""
    return a if a > b else b


def days(weeks: int) -> int:
    """Return seven days for each week."""
    total = 0
    while weeks > 0:
        total, weeks = total + 7, weeks - 1
    return total


def unused(a: int) -> int:
    """Nobody calls this."""
    return a + 1
'''
TESTS = '''"""Tests of the toy, one of which looks at too little."""

from toy import days, larger


def test_larger() -> None:
    assert larger(2, 1) == larger(1, 2) == 2


def test_a_long_time() -> None:
    while larger(2, 1):
        pass


def test_days() -> None:
    assert days(1) > 0
'''
ROOM = Room(files=("src/toy.py",), tests=("tests",))


def mutant(before: str, after: str) -> Mutant:
    """Replace a piece of the toy, which must be there once."""
    assert TOY.count(before) == 1
    line = TOY[: TOY.index(before)].count("\n") + 1
    return Mutant(
        "src/toy.py", line, "larger", 0, place_digests(TOY)["larger"], before, after, "", TOY.replace(before, after)
    )


KILLED = mutant("a > b", "a < b")
SURVIVES = mutant("total + 7", "total + 8")
ENDLESS = mutant("weeks - 1", "weeks - 0")
EQUIVALENT = mutant("a > b ", "a >= b ")
UNTRIED = mutant("a + 1", "a - 1")
LISTED = Equivalent("src/toy.py", "larger", EQUIVALENT.digest, 0, "a > b ", "a >= b ", "equal numbers are the same")


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a checkout of the toy, and make fractions of a second count as long."""
    monkeypatch.setattr("benchmarks.mutation.bench.ALLOWANCE", 0.3)
    monkeypatch.setattr("benchmarks.mutation.bench.SLOW", 0.3)
    root = tmp_path / "toy"
    for name, text in {"src/toy.py": TOY, "tests/test_toy.py": TESTS, "pyproject.toml": ""}.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    subprocess.run(["git", "init", "-q", root], check=True)
    return root


@pytest.fixture
def cache(toy: Path) -> Iterator[Cache]:
    with closing(Cache(toy / "build/cache.sqlite", toy)) as opened:
        yield opened


class StandIn:
    """Counts what is tried in place of a bench; every mutant survives, and the third is where the user stops."""

    def __init__(self) -> None:
        self.tried: list[tuple[str, list[str]]] = []
        self.stops_at = 0

    def coverage(self, test: object, without: object, files: object) -> Coverage:
        seconds = {"tests/test_toy.py::test_larger": 2.0, "tests/test_toy.py::test_days": 1.0}
        return Coverage(
            seconds, {("src/toy.py", 6): {"tests/test_toy.py::test_larger"}, ("src/toy.py", 13): set(seconds)}
        )

    def try_mutant(self, path: str, text: str, tests: object, limits: object) -> tuple[str, str]:
        assert isinstance(tests, list)
        self.tried.append((text, tests))
        if len(self.tried) == self.stops_at:
            raise KeyboardInterrupt
        return "survived", ""


def kinds(trials: list[Trial]) -> list[str]:
    return [trial.kind for trial in trials]


@pytest.mark.slow
def test_a_toy_is_tried(toy: Path, cache: Cache) -> None:
    with closing(Bench(toy, toy / "build", packages=())) as bench:
        mutants = [KILLED, SURVIVES, ENDLESS, EQUIVALENT, UNTRIED]
        trials = try_room(toy, ROOM, mutants, lambda: bench, cache, [LISTED])
    known = cache.coverage(ROOM, "tests/test_toy.py")
    assert known is not None
    assert known.seconds.keys() == {"tests/test_toy.py::test_larger", "tests/test_toy.py::test_days"}
    assert kinds(trials) == ["killed", "survived", "timed_out", "equivalent", "survived"]
    assert [trial.outcome.test.rpartition("::")[2] for trial in trials] == ["test_larger", "", "test_days", "", ""]
    assert (toy / "src/toy.py").read_text(encoding="utf-8") == TOY
    assert [path.name for path in (toy / "build").iterdir()] == ["cache.sqlite"]
    entry = room_record(toy, ROOM, Population([[], []], {"message": 3}), trials)
    assert [entry[key] for key in records.COUNTED] == [0, 2, 5, 1, 1, 2, 1]
    assert share(entry) == 2 / 4


@pytest.mark.slow
def test_tests_that_fail_by_themselves_are_refused(toy: Path) -> None:
    (toy / "tests/test_toy.py").write_text(TESTS.replace("== 2", "== 3"), encoding="utf-8")
    slow = "import pytest\npytestmark = pytest.mark.slow\ndef test_nothing(): assert False\n"
    (toy / "tests/test_slow.py").write_text(slow, encoding="utf-8")
    sentence = "the tests must pass before anything is mutated, and tests/test_toy.py::test_larger does not"
    with closing(Bench(toy, toy / "build", packages=())) as bench:
        assert bench.coverage("tests/test_slow.py", (), ROOM.paths(toy)) == Coverage({}, {})
        with pytest.raises(RuntimeError, match=f"^{sentence}$"):
            bench.coverage(ROOM.tests[0], (), ROOM.paths(toy))


def test_what_is_known_is_not_tried_again(toy: Path, cache: Cache) -> None:
    stand_in = StandIn()
    first = try_room(toy, ROOM, [KILLED, EQUIVALENT], lambda: stand_in, cache, [])
    assert kinds(first) == ["survived", "survived"]
    assert len(stand_in.tried) == 2
    again = try_room(toy, ROOM, [KILLED, EQUIVALENT], lambda: pytest.fail("was tried"), cache, [])
    assert again == first


def test_other_tests_are_tried_the_decisive_one_first(toy: Path, cache: Cache) -> None:
    """A kill stands while other tests come or go, not when the test or a helper changes."""
    decided = Outcome("killed", "tests/test_toy.py::test_larger")
    cache.keep(ROOM, SURVIVES, decided)
    for text, known in (
        (TESTS, decided),
        (TESTS.replace("days(1) > 0", "days(1) > 6"), decided),
        (TESTS.replace("== 2", "== 1 + 1"), None),
        (TESTS.replace("import days, larger", "import larger, days"), None),
    ):
        (toy / "tests/test_toy.py").write_text(text, encoding="utf-8")
        with closing(Cache(toy / "build/cache.sqlite", toy)) as again:
            assert again.outcome(ROOM, SURVIVES) == known
    with closing(Cache(toy / "build/cache.sqlite", toy)) as again:
        stand_in = StandIn()
        try_room(toy, ROOM, [SURVIVES], lambda: stand_in, again, [])
        assert [name.rpartition("::")[2] for name in stand_in.tried[0][1]] == ["test_larger", "test_days"]
        assert again.outcome(ROOM, SURVIVES) == Outcome("survived", "")
    (toy / "tests/test_other.py").write_text('"""Others."""\n', encoding="utf-8")
    with closing(Cache(toy / "build/cache.sqlite", toy)) as again:
        assert again.outcome(ROOM, SURVIVES) is None


def test_quick_tests_of_the_statement_come_first(toy: Path, cache: Cache) -> None:
    stand_in = StandIn()
    try_room(toy, ROOM, [KILLED, SURVIVES], lambda: stand_in, cache, [])
    assert [[name.rpartition("::")[2] for name in tests] for _, tests in stand_in.tried] == [
        ["test_larger"],
        ["test_days", "test_larger"],
    ]


def test_a_run_that_was_stopped_goes_on(toy: Path, cache: Cache) -> None:
    stand_in = StandIn()
    stand_in.stops_at = 2
    mutants = [KILLED, SURVIVES, EQUIVALENT]
    with pytest.raises(KeyboardInterrupt):
        try_room(toy, ROOM, mutants, lambda: stand_in, cache, [])
    stand_in.stops_at = 0
    done: list[int] = []
    try_room(toy, ROOM, mutants, lambda: stand_in, cache, [], lambda count, _: done.append(count))
    assert done == [1, 2, 3]
    assert [text for text, _ in stand_in.tried] == [KILLED.text, SURVIVES.text, SURVIVES.text, EQUIVALENT.text]


def test_a_reason_is_void_once_the_code_has_changed(toy: Path) -> None:
    assert LISTED.stands_for(EQUIVALENT)
    assert not LISTED.stands_for(KILLED)
    assert not LISTED.stands_for(replace(EQUIVALENT, digest="0"))
    assert stale([LISTED], toy) == []
    (toy / "src/toy.py").write_text(TOY.replace("a + 1", "a + 2"), encoding="utf-8")
    assert stale([LISTED], toy) == []
    (toy / "src/toy.py").write_text(TOY.replace("else b", "else (b)"), encoding="utf-8")
    assert stale([LISTED], toy) == [LISTED]


SHOWN = """
@cache
@dataclass(frozen=True, eq=1 > 2)
class A:
    x: int | None = 1 + 1

    def __repr__(self) -> str:
        return "a" * 2

    def f(self, *, b: int | None = 2 * 3) -> list[int | str]:
        log.info("b %d", b + 1)
        require(b > 0, f"not {b + 1}")
        raise ValueError(f"é {b - 1}") if b - 2 else None
        raise ValueError(f"é {b - 3}")
"""


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("@cache", "memoization"),
        ("True", "dataclass"),
        ("> 2", "dataclass"),
        ("| None = 1", "annotation"),
        ("+ 1\n\n", None),
        ("* 2", "representation"),
        ("*, b", "signature"),
        ("| None = 2", "annotation"),
        ("* 3", None),
        ("| str", "annotation"),
        ("+ 1)\n        require", "logging"),
        ("> 0", None),
        ("+ 1}", "message"),
        ("- 2", None),
        ("- 3", "message"),
    ],
)
def test_rules_exempt_what_cannot_matter(text: str, rule: str | None) -> None:
    ast.parse(SHOWN)
    assert SHOWN.count(text) == 1
    before = SHOWN[: SHOWN.index(text)].split("\n")
    assert exemption(exempt_spans(SHOWN), (len(before), len(before[-1])), "core/NumberReplacer") == rule


def test_pydantic_evaluates_fields() -> None:
    source = (
        "import pydantic\nclass A(pydantic.BaseModel):\n    x: Annotated[int, 1 + 1]\n    def f(self) -> 1 + 1: ...\n"
    )
    assert exemption(exempt_spans(source), (3, 24), "") is None
    assert exemption(exempt_spans(source), (4, 21), "") == "annotation"


def test_identity_in_place_of_equality_is_exempt() -> None:
    name = "core/ReplaceComparisonOperator_{}_{}".format
    assert exemption([], (1, 0), name("Eq", "Is")) == "identity"
    assert exemption([], (1, 0), name("IsNot", "NotEq")) == "identity"
    assert exemption([], (1, 0), name("Eq", "IsNot")) is None


def test_a_statement_ends_before_its_body() -> None:
    source = "if (\n    a\n    and b\n):\n    c = [\n        1,\n    ]\n"
    assert [list(statement_lines(source, line)) for line in (2, 3, 5, 6)] == [
        [1, 2, 3, 4],
        [1, 2, 3, 4],
        [5, 6, 7],
        [5, 6, 7],
    ]


def test_every_room_has_files_and_tests() -> None:
    for room in ROOMS.values():
        assert room.mutated(ROOT)
        assert all(
            (ROOT / name.partition("::")[0]).exists() for name in (*room.tests, *room.without, *room.whole_messages)
        )
        assert all(name.endswith(".py") for name in room.test_files(ROOT))


def test_no_file_that_a_proof_rests_on_is_forgotten() -> None:
    """Patterns stay behind when files move; each file is in one room."""
    counts = Counter(path for room in ROOMS.values() for path in room.paths(ROOT))
    folders = ("gen/proof", "verify", "model/arithmetic", "hdl/cores/folded.py", "hdl/cores/parallel.py")
    assert max(counts.values()) == 1
    for folder in folders:
        found = [ROOT / folder] if folder.endswith(".py") else (ROOT / folder).rglob("*.py")
        assert [path for path in found if path.name != "__init__.py" and not counts[str(path.relative_to(ROOT))]] == []


def test_the_record_is_sound_and_every_survivor_has_its_reason() -> None:
    record = json.loads(command.RECORD.read_text(encoding="utf-8"))
    assert record["rooms"]
    assert list(record["rooms"]) == [name for name in ROOMS if name in record["rooms"]]
    for entry in record["rooms"].values():
        counts = Counter(trial["outcome"] for trial in entry["sample"])
        assert {kind: entry[kind] for kind in ("killed", "timed_out", "survived", "equivalent")} == {
            kind: counts[kind] for kind in ("killed", "timed_out", "survived", "equivalent")
        }
        assert entry["sampled"] == len(entry["sample"])
        assert share(entry) >= 0.9
    assert list(records.survivors(record)) == []
    assert all(entry.reason for entry in equivalents(command.EQUIVALENT))
    text = records.markdown(record)
    assert text.count("**not known**") == 0
    assert text.count("` becomes `") == sum(entry["equivalent"] for entry in record["rooms"].values())


def test_what_nobody_has_explained_is_told() -> None:
    trial = Trial(SURVIVES, Outcome("survived", ""))
    entry = room_record(ROOT, ROOMS["arithmetic"], Population([], {"message": 1}), [trial])
    record = {"rooms": {"arithmetic": entry}}
    assert "| `src/toy.py`, `larger`: `total + 7` becomes `total + 8` | **not known** |" in records.markdown(record)
    assert "| all | 0 | 0 | 1 | 0 | 0 | 1 | 0 | 0.0 % |" in records.markdown(record)
    (told,) = records.survivors(record)
    assert told.endswith('before = "total + 7"\nafter = "total + 8"\nreason = ""')


def toy_changes(source: str) -> list[Change]:
    """Offer two changes of each comparison, one of them no Python, and one of each plus that changes nothing."""
    found = []
    for count, sign in enumerate(part for part in re.finditer("[>+]", source) if source[part.start() - 1] != "-"):
        line = source[: sign.start()].count("\n") + 1
        column = sign.start() - source[: sign.start()].rfind("\n") - 1
        kinds = ("swap", "spoil") if sign.group() == ">" else ("space",)
        found += [Change(kind, count, (line, column), (line, column + 1)) for kind in kinds]
    return found


def toy_changed(source: str, change: Change) -> str:
    lines = source.splitlines(keepends=True)
    line, (_, column) = lines[change.start[0] - 1], change.start
    sign = {"swap": "<", "spoil": "?", "space": "+ "}[change.operator]
    lines[change.start[0] - 1] = line[:column] + sign + line[column + 1 :]
    return "".join(lines)


def test_a_sample_is_valid_and_stays_when_other_code_changes(toy: Path) -> None:
    found = population(toy, ["src/toy.py"], toy_changes)
    assert (found.mutants, len(found.sites), found.exempt) == (6, 4, {})
    drawn = sample(toy, found, 9, 1, toy_changed)
    assert {(one.place, one.offset, one.before, one.after) for one in drawn} == {
        ("larger", 2, "return a if a > b else b", "return a if a < b else b"),
        ("days", 3, "while weeks > 0:", "while weeks < 0:"),
    }
    assert sample(toy, found, 1, 1, toy_changed) == drawn[:1]
    assert drawn[::-1] in [sample(toy, found, 9, seed, toy_changed) for seed in range(2, 9)]
    (toy / "src/toy.py").write_text("X = 2 + 2\n" + TOY, encoding="utf-8")
    moved = sample(toy, population(toy, ["src/toy.py"], toy_changes), 9, 1, toy_changed)
    assert [(one.place, one.line, one.digest) for one in moved] == [
        (one.place, one.line + 1, one.digest) for one in drawn
    ]
