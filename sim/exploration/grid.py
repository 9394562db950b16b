"""The grid of an exploration: every combination of the values of some keys of a specification."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, cast

from sosmith.gen.chain.reading import chain_from_tree, is_chain
from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.core import CoreDesign
from sosmith.gen.specification.exact_values import exact
from sosmith.gen.specification.specification import STAGE, Specification, from_tree
from sosmith.gen.version import __version__
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.suggestion import did_you_mean
from sosmith.model.traces.trace import Trace
from sosmith.sim.exploration.parameters import Parameters, Span


class Traces(Protocol):
    """Makes what designs are run on; can be pickled."""

    def __call__(self, design: CoreDesign, seed: int, seconds: float) -> tuple[Trace, ...]:
        """Make a trace for each channel of a core, from a seed and a length in s."""
        ...

    def least(self, spec: Specification, core: str | None) -> int:
        """Return the lowest number of samples, before there is a design."""
        ...

    @property
    def name(self) -> str | None:
        """Name of the source; None for the default one."""
        ...

    def identity(self) -> list[str]:
        """Return what tells them from those of another source; nothing for the default one."""
        ...


MAX_POINTS = 100_000
"""Combinations, at most."""

_NAMING = ("data", "sos_file", "taps_file")
"""Keys whose values are names of files beside the specification."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One design to be made and measured; everything that the result depends on.

    Attributes
    ----------
    key : str
        Digest of all the others; of `traces`, what they tell of themselves.
    changes : dict
        Values of the swept keys, with dots, in the types of JSON.
    tree : dict
        The specification with these values, in the types of JSON.
    path : Path
        Its name in messages; measurements are looked up beside it.
    core : str or None
        Part of the specification; None for all of it.
    samples : int
        Length of the trace for each channel.
    seed : int
        Seed of its noise.
    board : str or None
        Board to synthesize for; None for a cost without synthesis.
    traces : callable
        Makes the traces that designs are run on.
    """

    key: str
    changes: dict[str, Any]
    tree: dict[str, Any]
    path: Path
    core: str | None
    samples: int
    seed: int
    board: str | None
    traces: Traces

    def specification(self) -> Specification | ChainSpec:
        """Check the specification.

        Raises
        ------
        SpecificationError
            If its values do not go together.
        """
        tree = exact(self.tree)
        return chain_from_tree(tree, self.path) if is_chain(tree) else from_tree(tree, self.path)


@dataclass(frozen=True, kw_only=True)
class Subject:
    """What all tasks of an exploration have in common.

    Attributes
    ----------
    spec : Specification or ChainSpec
        The specification that tasks change.
    core, samples, seed, board, traces
        As in `Task`.
    """

    spec: Specification | ChainSpec
    core: str | None
    samples: int
    seed: int
    board: str | None
    traces: Traces

    @cached_property
    def _read(self) -> dict[str, str]:
        """Digests of the files that have been looked at, by their names; that of one that is not there is empty."""
        return {}

    def _files(self, tree: Any) -> str:
        """Return the digests of the files that a specification names, one after the other."""
        if isinstance(tree, list):
            return "".join(map(self._files, tree))
        if not isinstance(tree, Mapping):
            return ""
        return "".join(
            self._file(value) if key in _NAMING and isinstance(value, str) else self._files(value)
            for key, value in tree.items()
        )

    def _file(self, name: str) -> str:
        path = common_part(self.spec).path.parent / name
        if name not in self._read:
            self._read[name] = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
        return self._read[name]

    @cached_property
    def _stimuli(self) -> list[str]:
        return self.traces.identity()

    def task(self, changes: dict[str, Any]) -> Task:
        """Make the task with these values.

        Raises
        ------
        SpecificationError
            If a key is of a table that the specification lacks.
        """
        tree = changed(self.spec.source, changes)
        determined_by = [
            tree,
            self.core,
            self.samples,
            self.seed,
            self.board,
            self._files(tree),
            __version__,
            *self._stimuli,
        ]
        return Task(
            key=hashlib.sha256(json.dumps(determined_by, sort_keys=True).encode()).hexdigest(),
            changes=changes,
            tree=tree,
            path=common_part(self.spec).path,
            core=self.core,
            samples=self.samples,
            seed=self.seed,
            board=self.board,
            traces=self.traces,
        )


def common_part(spec: Specification | ChainSpec) -> Specification:
    """Return the specification itself; of a chain, what is common to its stages, with the calibration if it has one."""
    return spec.base if isinstance(spec, ChainSpec) else spec


def tasks_of(subject: Subject, parameters: Parameters) -> list[Task]:
    """Make a task for every combination, the last parameter changing fastest.

    Combinations that do not go together are for the evaluation to refuse; a value that goes with nothing is refused
    here.

    Raises
    ------
    SpecificationError
        If a key is of a table that the specification lacks, a value fits no combination, there are too many, or a
        parameter is a range.
    """
    count = 1
    for key, values in parameters.items():
        if isinstance(values, Span):
            raise SpecificationError(f"{key} must be a list of values unless there is a search, not {values}")
        count *= len(values)
    if count > MAX_POINTS:
        raise SpecificationError(f"there must be at most {MAX_POINTS:,} combinations, not {count:,}")
    tasks = [
        subject.task(dict(zip(parameters, values, strict=True)))
        for values in itertools.product(*cast("Iterable[Sequence[Any]]", parameters.values()))
    ]
    refusals = [refusal_of(task) for task in tasks]
    for key, values in parameters.items():
        for value in cast("Sequence[Any]", values):
            of_it = [refusal for task, refusal in zip(tasks, refusals, strict=True) if task.changes[key] == value]
            if of_it and all(of_it):  # it is mistyped
                raise SpecificationError(f"{of_it[0]}")
    return tasks


def refusal_of(task: Task) -> str | None:
    """Say why the values of a specification do not go together, if they do not."""
    try:
        task.specification()
    except SpecificationError as error:
        return str(error)
    return None


def check_samples(tasks: Sequence[Task]) -> None:
    """Check that there is a task whose filter settles within its samples, or that has another reason to be refused.

    Raises
    ------
    SpecificationError
        If every task would be refused, after its design, for the samples that all have.
    """
    least: dict[str, int] = {}
    for task in tasks:
        filtered = json.dumps({key: value for key, value in task.tree.items() if key != "hardware"}, sort_keys=True)
        if filtered not in least:
            try:
                least[filtered] = task.traces.least(common_part(task.specification()), task.core)
            except (SpecificationError, ShortfallError):
                return  # it is for the evaluation to tell
        if least[filtered] <= task.samples:
            return
    if least:
        low, high = min(least.values()), max(least.values())
        slower = "" if low == high else f", and {high:,} for the slowest of these"
        raise SpecificationError(
            f"samples must be at least {low:,} for the filter to settle{slower}, not {tasks[0].samples:,}"
        )


def changed(source: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Copy a specification in the types of JSON, with other values of some keys, given with dots.

    Those of a stage of a chain begin with ``stage.NAME``.

    Raises
    ------
    SpecificationError
        If a key is inside of something that is no table, or of a stage that there is not.
    """
    tree = deepcopy(dict(source))
    for key, value in changes.items():
        *tables, last = key.split(".")
        place: Any = tree
        if tables[:1] == [STAGE] and is_chain(tree):
            place, tables = _stage(tree[STAGE], key), tables[2:]
        for name in tables:
            place = place.setdefault(name, {})
            if not isinstance(place, dict):
                raise SpecificationError(f"a parameter must be a key of the specification, not {key}")
        place[last] = value
    return tree


def _stage(stages: Sequence[dict[str, Any]], key: str) -> dict[str, Any]:
    """Return the table of the stage that a key is of."""
    names = [str(stage["name"]) for stage in stages]
    _, name, *keys = key.split(".")
    if name not in names or not keys:
        raise SpecificationError(
            f"a parameter of a stage must be stage.NAME.KEY with one of the names {', '.join(names)}, not {key}"
            f"{'' if name in names else did_you_mean(name, names)}"
        )
    return stages[names.index(name)]
