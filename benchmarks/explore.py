"""Measures how an exploration grows, for docs/scale.md: `python -m benchmarks.explore`.

A sweep of 1,000 designs, each proven and run bit-true on 20,000 samples, by the command `sosmith explore` with one
process and with two. The operating system tells the processor time of the command with all its processes. The same
command again, when nothing is left to do, gives the part that no process can share. The figures are recorded in
benchmarks/explore.json; `--document` only writes the document from that record again.

    --designs 100     takes fewer values of the last keys, for at most so many designs
    --same            also kills a sweep and goes on with it, and runs one on a Dask cluster of two workers; fails
                      unless all fronts are the same
    --busy-machine    records processor time only: for a machine that others use, where the clock says nothing
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.specification.specification import load
from sosmith.instrument.scenarios.traces import ChosenTraces
from sosmith.sim.exploration.grid import Subject

ROOT = Path(__file__).resolve().parent.parent
SPECIFICATION = ROOT / "examples" / "flange_wear_locomotive.toml"
RECORD = ROOT / "benchmarks" / "explore.json"
DOCUMENT = ROOT / "docs" / "scale.md"
SAMPLES = 20_000
SWEEP: dict[str, list[Any]] = {
    "hardware.realization": list(SECTIONS),
    "filter.order": [2, 3, 4, 5, 6],
    "filter.cutoff": [0.1, 0.2, 0.4, 0.8, 1.6],
    "output.max_error": [0.00025, 0.0005, 0.001, 0.002, 0.004],
}
"""8 x 5 x 5 x 5 = 1,000 combinations."""
EMPTY_TASKS = 1_000
"""Tasks that do nothing, to measure what a scheduler needs for one."""
DASK_OVERHEAD = 0.001
"""Seconds for a task, at most, by https://docs.dask.org/en/stable/best-practices.html; where none is measured."""
GOAL_MINUTES, GOAL_BUSY = 5, 85


@dataclass(frozen=True, kw_only=True)
class Run:
    """One run of the command.

    Attributes
    ----------
    jobs, designs : int
        Processes and combinations.
    processor : float
        Processor time in s, of all processes together.
    elapsed : float or None
        Time on the clock in s; None on a machine that others use.
    front : str
        SHA-256 of the front.
    """

    jobs: int
    designs: int
    processor: float
    elapsed: float | None
    front: str


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Everything that is recorded.

    Attributes
    ----------
    runs : tuple of Run
        With one process and with two.
    alone : float
        Processor time in s of the command when nothing is left to do.
    task_bytes, result_bytes : int
        Size of a task as it goes to a worker, and mean size of a line of the record.
    scheduler : float or None
        Time in s that a Dask scheduler with two workers needs for a task that does nothing; None if not measured.
    """

    runs: tuple[Run, ...]
    alone: float
    task_bytes: int
    result_bytes: int
    scheduler: float | None


def sweep(designs: int) -> dict[str, list[Any]]:
    """Return the grid with about as many combinations: fewer values of the last keys."""
    cut = {key: list(values) for key, values in SWEEP.items()}
    for key in reversed(cut):
        while _count(cut) > designs and len(cut[key]) > 1:
            cut[key].pop(len(cut[key]) // 2)
    return cut


def _count(grid: dict[str, list[Any]]) -> int:
    count = 1
    for values in grid.values():
        count *= len(values)
    return count


def command(grid: dict[str, list[Any]], folder: Path, *options: str) -> list[str]:
    """Return the command of a sweep."""
    swept = [f"{key}={','.join(map(str, values))}" for key, values in grid.items()]
    keys = [word for text in swept for word in ("-p", text)]
    base = [sys.executable, "-m", "sosmith.cli", "explore", str(SPECIFICATION), *keys]
    return [*base, "--samples", str(SAMPLES), "--json", "-o", str(folder), *options]


def run(arguments: Sequence[str]) -> tuple[float, float, str]:
    """Carry out a command; return processor time with that of its processes, time on the clock, and its front."""
    started = time.monotonic()
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(arguments, stdout=out, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        elapsed = time.monotonic() - started
        if process.returncode:
            sys.exit(f"a sweep must succeed, not exit with {process.returncode}: {' '.join(arguments)}")
        out.seek(0)
        front = json.load(out)["front"]
    return used.ru_utime + used.ru_stime, elapsed, hashlib.sha256(json.dumps(front).encode()).hexdigest()


def measure(designs: int, *, busy_machine: bool) -> Figures:
    """Measure sweeps with one process and with two."""
    grid = sweep(designs)
    runs = []
    with tempfile.TemporaryDirectory() as made:
        for jobs in (1, 2):
            arguments = command(grid, Path(made) / str(jobs), "--jobs", str(jobs))
            processor, elapsed, front = run(arguments)
            runs.append(
                Run(
                    jobs=jobs,
                    designs=_count(grid),
                    processor=round(processor, 1),
                    elapsed=None if busy_machine else round(elapsed, 1),
                    front=front,
                )
            )
            print(json.dumps(asdict(runs[-1])), flush=True)
        alone, _, _ = run(arguments)
        (record,) = (Path(made) / "2").glob("*.jsonl")
        lines = record.read_bytes().splitlines()
    subject = Subject(spec=load(SPECIFICATION), core=None, samples=SAMPLES, seed=1, board=None, traces=ChosenTraces())
    task = subject.task({key: values[0] for key, values in grid.items()})
    return Figures(
        runs=tuple(runs),
        alone=round(alone, 2),
        task_bytes=len(pickle.dumps(task)),
        result_bytes=round(sum(map(len, lines)) / len(lines)),
        scheduler=None if busy_machine else scheduler_overhead(),
    )


@contextmanager
def cluster() -> Iterator[str]:
    """Run a Dask scheduler with two workers of one thread each, in processes of their own; give its address."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as started:
        yield started.scheduler_address


def scheduler_overhead() -> float:
    """Return the time in s for a task that does nothing, with the scheduler and two workers."""
    from distributed import Client

    with cluster() as address, Client(address) as client:
        client.gather(client.map(_nothing, range(100)))
        started = time.monotonic()
        client.gather(client.map(_nothing, range(100, 100 + EMPTY_TASKS)))
        return round((time.monotonic() - started) / EMPTY_TASKS, 6)


def _nothing(number: int) -> int:
    return number


def same_fronts(designs: int) -> dict[str, str]:
    """Return the front of the sweep by the way it was made: one process, two, killed and resumed, on a cluster."""
    grid = sweep(designs)
    with tempfile.TemporaryDirectory() as made:
        fronts = {}
        for name, options in {"one process": ("--jobs", "1"), "two processes": ("--jobs", "2")}.items():
            fronts[name] = run(command(grid, Path(made) / name, *options))[2]
            print(name, fronts[name], flush=True)
        killed = Path(made) / "killed"
        _kill_half_way(command(grid, killed, "--jobs", "2"), killed, _count(grid) // 2)
        fronts["killed and resumed"] = run(command(grid, killed, "--jobs", "2"))[2]
        with cluster() as address:
            fronts["two workers of Dask"] = run(command(grid, Path(made) / "dask", "--scheduler", address))[2]
    return fronts


def _kill_half_way(arguments: Sequence[str], folder: Path, results: int) -> None:
    """Kill a sweep, with its processes, when it has some results."""
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(arguments, stdout=quiet, stderr=quiet, start_new_session=True)
    while process.poll() is None and _results(folder) < results:
        time.sleep(0.05)
    if process.poll() is not None:
        sys.exit("a sweep must be killed before it ends, not after")
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _results(folder: Path) -> int:
    return sum(path.read_bytes().count(b"\n") for path in folder.glob("*.jsonl")) if folder.is_dir() else 0


def document(figures: Figures) -> str:
    """Write docs/scale.md."""
    one, two = figures.runs
    each = one.processor / one.designs
    overhead = DASK_OVERHEAD if figures.scheduler is None else figures.scheduler
    keys = ", ".join(f"{len(values)} values of `{key}`" for key, values in SWEEP.items())
    goal = f"{GOAL_MINUTES} min for 1,000 designs with two processes"
    told = (
        f"The goal is {goal}, each busy for over {GOAL_BUSY} %."
        if two.elapsed is not None
        else f"Other programs ran on the machine, so only processor time is told. The goal is {goal}."
    )
    alike = "the same front" if one.front == two.front else "**different fronts**"
    text = f"""
# How exploration grows

`sosmith explore` on `examples/flange_wear_locomotive.toml`: {keys}; each design proven, and run bit-true on {SAMPLES:,}
samples. `python -m benchmarks.explore` measures this and writes this page; with `--same` it also kills a sweep and goes
on with it, runs one on a Dask cluster, and fails unless all fronts are the same.

{_table(figures)}

{told} Both runs have {alike}.

What no process can share is to check all combinations first, and to write the results at the end:
{figures.alone:.1f} s of processor time for {two.designs:,} designs, with the start of the command, or
{_percent(figures.alone / two.processor)} of the whole.

## Where the time goes

Nearly all of a design is the search for word lengths and the proof, in Python; the C compiler makes the bit-true model
of each in less than a tenth of a second, without optimizing, and the {SAMPLES:,} samples themselves take milliseconds.
Time grows in proportion
to the number of designs. It grows with the order, as more sections are searched and proven; with low cutoffs, whose
responses are long; and with state-space realizations, which have the most coefficients. It does not depend on the
samples until there are millions.

The processes tell Python's garbage collector to leave alone what was imported, and to look at the rest less often.

## Searches

`--search N` asks an optimizer for 24 designs at a time and waits for the slowest before it asks again, so that the same
designs are made by any number of processes. No more than 24 are ever busy; a grid has no such limit.

## To 1,000 workers, on paper

- **A task** is the specification with its changed values: {figures.task_bytes:,} bytes. A result is a line of
{figures.result_bytes:,} bytes. Neither grows with the samples, because workers make the trace themselves from its seed.
100,000 designs are {100_000 * figures.result_bytes / 1e6:.0f} MB of results.
- **The scheduler** hands out one task for each design: {_scheduler(figures)} about {_rounded(each / overhead)} workers
that are busy for {1000 * each:.0f} ms with each. Beyond that, workers wait for it.
- **The record and the front** are made by the command alone. It appends each result to a file as it comes, and computes
the front once, at the end.
- **The end of a sweep** is the slowest design alone: some seconds, in which other workers have nothing left to do. With
1,000 workers a sweep should have tens of designs for each.
- **The cache** of synthesis (`--board`) lies in the cache folder of each machine's user, and is found by content. Two
machines may each synthesize the same core once; nothing else is shared, and no worker waits for another.
- **A worker that dies** costs the design that it was at: the scheduler gives it to another one. If the command itself
dies, what is on record is not done again.
"""
    return "\n\n".join(map(_filled, text.strip().split("\n\n"))) + "\n"


def _filled(part: str) -> str:
    """Break a paragraph, or each item of a list, into lines."""
    if part.startswith(("#", "|")):
        return part
    items = re.split(r"\n(?=- )", part)
    hang = "  " if part.startswith("- ") else ""
    wrap = textwrap.TextWrapper(120, subsequent_indent=hang, break_long_words=False, break_on_hyphens=False)
    return "\n".join(map(wrap.fill, items))


def _table(figures: Figures) -> str:
    timed = all(row.elapsed is not None for row in figures.runs)
    titles = ["processes", "designs", "processor time", "a design", *(["on the clock", "busy"] if timed else [])]
    lines = [titles, ["---"] * len(titles)]
    for row in figures.runs:
        each = f"{1000 * row.processor / row.designs:.0f} ms"
        cells = [f"{row.jobs}", f"{row.designs:,}", f"{row.processor:.0f} s", each]
        if timed and row.elapsed is not None:
            cells += [f"{row.elapsed:.0f} s", _percent(row.processor / row.elapsed / row.jobs)]
        lines.append(cells)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _scheduler(figures: Figures) -> str:
    if figures.scheduler is None:
        return "Dask's best practices state 0.2 to 1 ms for a task; at 1 ms, a scheduler feeds"
    milliseconds = 1000 * figures.scheduler
    return f"with two workers on this machine, a task that does nothing takes {milliseconds:.2f} ms; so it feeds"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _rounded(value: float) -> str:
    return f"{float(f'{value:.1g}'):,.0f}"


def recorded() -> Figures:
    """Read the recorded figures."""
    tree = json.loads(RECORD.read_text(encoding="utf-8"))
    return Figures(**(tree | {"runs": tuple(Run(**row) for row in tree["runs"])}))


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, record and write the document."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=1000, help="combinations, at most")
    parser.add_argument("--same", action="store_true", help="compare the fronts of four ways to run the sweep")
    parser.add_argument("--busy-machine", action="store_true", help="record processor time only")
    parser.add_argument("--document", action="store_true", help="only write the document from the record")
    options = parser.parse_args(arguments)
    if options.same:
        fronts = same_fronts(options.designs)
        print("\n".join(f"{front}  {name}" for name, front in fronts.items()))
        if len(set(fronts.values())) > 1:
            sys.exit("the fronts must be the same, and are not")
        return
    if not options.document:
        figures = measure(options.designs, busy_machine=options.busy_machine)
        RECORD.write_text(json.dumps(asdict(figures), indent=2) + "\n", encoding="utf-8")
    DOCUMENT.write_text(document(recorded()), encoding="utf-8")
    print(_table(recorded()))


if __name__ == "__main__":
    main()
