"""Tries mutants of the code that proofs, hardware and verdicts hang on: `python -m benchmarks.mutation`."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.mutation.bench import ALLOWANCE, SLOW, SLOWER, Bench
from benchmarks.mutation.campaign import GOAL, Progress, room_record, share, try_room
from benchmarks.mutation.exempt import RULES
from benchmarks.mutation.mutants import population, sample
from benchmarks.mutation.record import RECORD, heads, markdown, survivors, table
from benchmarks.mutation.results import Cache, equivalents, stale
from benchmarks.mutation.rooms import ROOMS, ROOT
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars
from rich.table import Table

EQUIVALENT = Path(__file__).with_name("equivalent.toml")
SAMPLE = 52

_DESCRIPTION = f"""\
Change one operator, number, comparison, keyword or loop of the code, run the tests that execute it, and see whether
one of them fails: the mutant is killed. A mutant that survives shows what no test looks at, unless it is equivalent:
another text for the same function. cosmic-ray makes the mutants, of these rooms:

{{rooms}}

All mutants would take days. A sample is drawn with a seed: places in the text at random, and at each place one
mutant. Killed means that a test fails which passes on the code as it is. Timed out means that a test takes more CPU
time than {SLOWER:g} times its own, that of the longest test, and {ALLOWANCE:g} s together; time-outs count as killed
and are told apart. Tests that take more than {SLOW:g} s by themselves are not run.

What cannot matter by construction is left out and counted:

{{rules}}
"""
_EPILOG = f"""\
examples:
  python -m benchmarks.mutation --list                  how many mutants there are
  python -m benchmarks.mutation                         the whole sample; goes on where it was stopped (Ctrl-C)
  python -m benchmarks.mutation --room proof --sample 9
  python -m benchmarks.mutation --markdown              tables of what was recorded last

A survivor is printed as an entry for {EQUIVALENT.name}. Write a test that kills it, or, if it is equivalent, add
the entry there with the reason. An entry is void as soon as the function around it changes.

Outcomes are cached by the content of the mutated file and of the tests; after changes of other code, --cache names
another file. Nothing is mutated in place: mutants are tried in a copy under build/. Needs the extra "mutation".

Exit status: 0 if tests kill {100 * GOAL:.0f} % in every room and all survivors are listed, 1 if not, 130 if stopped.
"""


@contextmanager
def progress_bar(room: str, total: int) -> Iterator[Progress]:
    """Show on stderr how many mutants of a room are done, and what came out."""
    columns = (TextColumn("{task.description}"), BarColumn(bar_width=30), MofNCompleteColumn(), TimeElapsedColumn())
    with Bars(*columns, console=Console(stderr=True)) as bars:
        task = bars.add_task(room, total=total)

        def show(done: int, counts: Counter[str]) -> None:
            words = ", ".join(f"{count} {kind.replace('_', ' ')}" for kind, count in sorted(counts.items()))
            bars.update(task, completed=done, description=f"{room}: {words}")

        yield show


def run(names: Iterable[str], size: int, seed: int, cache_file: Path) -> dict[str, Any]:
    """Try the sample of each room; return the record."""
    from benchmarks.mutation import operators

    listed = equivalents(EQUIVALENT)
    for entry in stale(listed, ROOT):
        print(f"void, the code has changed: {entry.path}, {entry.place}: {entry.before}", file=sys.stderr)
    known = Cache(cache_file, ROOT)
    opened: list[Bench] = []

    @cache
    def bench() -> Bench:
        opened.append(Bench(ROOT, cache_file.parent))
        return opened[0]

    record: dict[str, Any] = {"tool": operators.TOOL, "seed": seed, "rooms": {}}
    try:
        for name in names:
            room = ROOMS[name]
            found = population(ROOT, room.mutated(ROOT), operators.changes)
            mutants = sample(ROOT, found, size, seed, operators.changed)
            with progress_bar(name, len(mutants)) as show:
                trials = try_room(ROOT, room, mutants, bench, known, listed, show)
            record["rooms"][name] = room_record(ROOT, room, found, trials)
    finally:
        known.close()
        for one in opened:
            one.close()
    return record


def joined(record: dict[str, Any]) -> dict[str, Any]:
    """Add the rooms that were recorded before, with the same tool and seed, to those of this run."""
    before = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {"rooms": {}}
    same = all(before.get(key) == record[key] for key in ("tool", "seed"))
    rooms = (before["rooms"] if same else {}) | record["rooms"]
    return record | {"rooms": {name: rooms[name] for name in ROOMS if name in rooms}}


def main() -> int:
    """Run what the command line asks for; return the exit status."""
    options = _parser().parse_args()
    if options.markdown:
        print(markdown(json.loads(RECORD.read_text(encoding="utf-8"))), end="")
        return 0
    names = options.room or list(ROOMS)
    if options.list:
        from benchmarks.mutation import operators

        for name in names:
            found = population(ROOT, ROOMS[name].mutated(ROOT), operators.changes)
            left_out = ", ".join(f"{count:,} {rule}" for rule, count in found.exempt.items()) or "none"
            print(f"{name}: {found.mutants:,} mutants at {len(found.sites):,} places; left out: {left_out}")
        return 0
    for number in (signal.SIGTERM, signal.SIGINT):  # a shell lets what runs in the background ignore the latter
        signal.signal(number, signal.default_int_handler)
    try:
        record = run(names, options.sample, options.seed, options.cache)
    except KeyboardInterrupt:
        print("stopped; the same command goes on here", file=sys.stderr)
        return 130
    shown = Table(*heads())
    for row in table(record):
        shown.add_row(*row)
    Console(width=None if sys.stdout.isatty() else 120).print(shown)
    left = list(survivors(record))
    for entry in left:
        print(f"\n{entry}")
    RECORD.write_text(json.dumps(joined(record), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return int(bool(left) or any(share(entry) < GOAL for entry in record["rooms"].values()))


def _parser() -> argparse.ArgumentParser:
    rooms = "\n".join(f"  {name:11} {', '.join(room.files)}" for name, room in ROOMS.items())
    rules = "\n".join(f"  {name:15} {text}" for name, text in RULES.items())
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.mutation",
        description=_DESCRIPTION.format(rooms=rooms, rules=rules),
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--room", action="append", choices=list(ROOMS), help="only this room; may be repeated")
    parser.add_argument("--sample", type=int, default=SAMPLE, help=f"mutants of each room (default {SAMPLE})")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (default 1)")
    parser.add_argument("--cache", type=Path, default=ROOT / "build/mutation/cache.sqlite", help="file of outcomes")
    parser.add_argument("--list", action="store_true", help="only count the mutants")
    parser.add_argument("--markdown", action="store_true", help="only print the record as Markdown tables")
    return parser


if __name__ == "__main__":
    sys.exit(main())
