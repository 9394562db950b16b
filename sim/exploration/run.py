"""Runs an exploration: what is not yet on record, on the cores of this machine or on a cluster."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.specification.specification import Specification
from sosmith.sim.exploration.evaluation import Point
from sosmith.sim.exploration.front import pareto_front
from sosmith.sim.exploration.grid import Subject, Task, Traces, check_samples, tasks_of
from sosmith.sim.exploration.parameters import Parameters, in_json
from sosmith.sim.exploration.record import record_in
from sosmith.sim.exploration.search import Search

Progress = Callable[[str, int, int], None]
Runner = Callable[[Iterable[Sequence[Task]]], Generator[Point, None, None]]
"""Yields the results of batches of tasks, in any order within each; the next batch may depend on them."""

_COLUMNS = (
    "on_front",
    "passed",
    "realization",
    "architecture",
    "error.bound",
    "error.max_abs",
    "error.rms",
    "error.unit",
    "sqnr_db",
    "stopband_attenuation_db",
    "cost.value",
    "cost.unit",
    "cost.luts",
    "cost.multiplier_blocks",
    "cost.instructions",
    "cycles_per_sample",
    "latency_cycles",
    "refused",
)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A finished exploration.

    Attributes
    ----------
    name : str
        Of the specification.
    parameters : dict
        Swept keys and their values, in the types of JSON.
    search : int or None
        Number of designs that were searched for; None for a grid.
    samples : int
        Length of the trace for each channel.
    trace : str or None
        Name of the scenario or of the file; None for the default one.
    board : str or None
        Board of the synthesis.
    points : tuple of dict
        Results in the order of the grid or of the search, as `evaluate` returns them; those of the front that were
        co-simulated have ``report``, the path of their page from the folder.
    tasks : tuple of Task
        What they are results of.
    """

    name: str
    parameters: dict[str, Any]
    search: int | None
    samples: int
    trace: str | None
    board: str | None
    points: tuple[Point, ...]
    tasks: tuple[Task, ...]

    @property
    def front(self) -> list[Point]:
        """The Pareto front, see `pareto_front`."""
        return pareto_front(self.points)

    def as_dict(self) -> dict[str, Any]:
        """Everything but the tasks, in the types of JSON."""
        return {
            "name": self.name,
            "parameters": self.parameters,
            "search": self.search,
            "samples": self.samples,
            "trace": self.trace,
            "board": self.board,
            "front": self.front,
            "points": list(self.points),
        }

    def table(self) -> str:
        """All points as CSV: the swept keys, and the figures."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*self.parameters, *_COLUMNS])
        front = {point["key"] for point in self.front}
        for point in self.points:
            row = {**point, "on_front": point["key"] in front}
            writer.writerow(
                [*(point["changes"][key] for key in self.parameters), *(_at(row, column) for column in _COLUMNS)]
            )
        return stream.getvalue()


def _at(point: Mapping[str, Any], column: str) -> Any:
    value: Any = point
    for part in column.split("."):
        value = None if value is None else value.get(part)
    return "" if value is None else value


def explore(
    spec: Specification | ChainSpec,
    parameters: Parameters,
    folder: Path,
    runner: Runner,
    *,
    traces: Traces,
    search: int | None = None,
    core: str | None = None,
    samples: int = 20_000,
    seed: int = 1,
    board: str | None = None,
    progress: Progress = lambda step, done, total: None,
) -> Outcome:
    """Evaluate every combination, or search among them; what `folder` has a result of is not done again.

    Parameters
    ----------
    spec : Specification or ChainSpec
        The specification.
    parameters : mapping of str to sequence
        Keys with dots, and their values in the types of JSON.
    folder : Path
        Folder of the results, made if missing; they are written as they come.
    runner : callable
        Such as `sosmith.sim.exploration.processes.in_processes`.
    search : int or None
        Number of designs to search for, see `sosmith.sim.exploration.search.Search`; None for a grid.
    core, samples, seed, board, traces
        As in `Task`.
    progress : callable
        Called with the name of the step, the amount done and the total.

    Raises
    ------
    SpecificationError
        As `tasks_of`, `check_samples`, `Search` and `record_in`; a search checks the samples of its first batch.
    ToolError
        As the runner and `Search`, or if the disk is full.
    """
    progress("checking combinations", 0, 0)
    subject = Subject(spec=spec, core=core, samples=samples, seed=seed, board=board, traces=traces)
    tasks = tasks_of(subject, parameters) if search is None else []
    check_samples(tasks)
    with record_in(folder) as record:
        searched = None if search is None else Search(subject, parameters, search, record.points)
        done, total = 0, search or len(tasks)

        def missing() -> Iterator[list[Task]]:
            """Leave out of each batch what is on record."""
            nonlocal done
            for number, batch in enumerate([tasks] if searched is None else searched.batches()):
                if searched is not None and number == 0:
                    check_samples(batch)
                left = {task.key: task for task in batch if task.key not in record.points}
                done += len(batch) - len(left)
                progress("designs", done, total)
                yield list(left.values())

        results = runner(missing())
        with closing(results):
            for point in results:
                record.add(point)
                done += 1
                progress("designs", done, total)
        tasks = tasks if searched is None else searched.tasks
        # a point on record may be of another sweep, which came to the same specification by other changes
        points = tuple(record.points[task.key] | {"changes": task.changes} for task in tasks)
    return Outcome(
        name=spec.name,
        parameters=in_json(parameters),
        search=search,
        samples=samples,
        trace=traces.name,
        board=board,
        points=points,
        tasks=tuple(tasks),
    )
