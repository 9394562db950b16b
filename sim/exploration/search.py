"""Searches a space of designs that is too large for a grid, with the optimizer TPE of the package optuna.

The optimizer is asked for a batch of designs, and told all their results in the order in which it was asked. What it
asks for next then depends on the specification, the parameters and the seed alone: not on how many processes took
part, nor on which result came first. So a search that was killed needs no record of its own. It is begun again, and
results that are on record are told without a design being made twice.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.sim.exploration.evaluation import Point
from sosmith.sim.exploration.grid import Subject, Task, refusal_of, tasks_of
from sosmith.sim.exploration.parameters import Parameters, Span, Values

_BATCH = 24
"""Designs that are asked for at a time, enough to keep some processors busy until the slowest is done."""

_TRIES = 20
"""How often the optimizer is asked for a design until it names one that is new."""

_DECADES = 10
"""Ratio of the ends from which a range is searched by factors and not by differences."""

_DIGITS = 4
"""Significant digits of a number from a range."""

_CHECKED = 200
"""Random combinations that must show, before a search begins, that each value fits some specification."""

_NO_DESIGN = (20.0, 20.0)
"""What the optimizer is told instead of the decades of cost and bound, together with a broken constraint."""


class Search:
    """A search of `count` designs for the front of proven error bound against cost.

    A space of no more combinations than that is done as a grid.

    Parameters
    ----------
    subject : Subject
        What the designs have in common.
    parameters : mapping
        Keys with their values or ranges.
    count : int
        Number of designs; fewer if no new ones are found.
    points : mapping of str to dict
        Results by the key of their task. After each batch it must hold those of the batch.

    Raises
    ------
    SpecificationError
        If a value fits no specification.
    ToolError
        If the package optuna is missing.
    """

    def __init__(self, subject: Subject, parameters: Parameters, count: int, points: Mapping[str, Point]) -> None:
        self._subject, self._parameters, self._count, self._points = subject, parameters, count, points
        self.tasks: list[Task] = []
        self._asked_for: set[str] = set()
        self._grid = _grid(parameters, count)
        if self._grid is not None:
            return
        _check(subject, parameters)
        self._study = _study(subject.seed)

    def batches(self) -> Iterator[Sequence[Task]]:
        """Yield batches of tasks; the results of each must be there before the next one is asked for."""
        if self._grid is not None:
            self.tasks = tasks_of(self._subject, self._grid)
            yield self.tasks
            return
        while len(self.tasks) < self._count:
            new, asked = self._batch(min(_BATCH, self._count - len(self.tasks)))
            if not new:
                return  # everything has been done, or nearly
            yield new
            for trial, task in asked:
                _tell(self._study, trial, self._points[task.key])

    def _batch(self, size: int) -> tuple[list[Task], list[tuple[Any, Task]]]:
        """Ask for new designs; return them, and all trials that wait for a result of theirs."""
        new: list[Task] = []
        waiting: list[tuple[Any, Task]] = []
        known = frozenset(self._asked_for)
        tries = 0
        while len(new) < size and tries < _TRIES:
            tries += 1
            trial = self._study.ask()
            task = self._subject.task(self._changes(trial))
            if task.key in known:
                _tell(self._study, trial, self._points[task.key])
                continue
            waiting.append((trial, task))
            if task.key not in self._asked_for:
                self._asked_for.add(task.key)
                new.append(task)
                tries = 0
        self.tasks += new
        return new, waiting

    def _changes(self, trial: Any) -> dict[str, Any]:
        return {key: _suggested(trial, key, values) for key, values in self._parameters.items()}


def _grid(parameters: Parameters, count: int) -> dict[str, Sequence[Any]] | None:
    """List all values if they make no more than `count` combinations."""
    values: dict[str, Sequence[Any]] = {}
    for key, of_key in parameters.items():
        if isinstance(of_key, Span):
            if not of_key.whole:
                return None
            values[key] = range(int(of_key.low), int(of_key.high) + 1)
        else:
            values[key] = of_key
    return values if math.prod(map(len, values.values())) <= count else None


def _check(subject: Subject, parameters: Parameters) -> None:
    """Refuse a value that its key cannot have, with some random combinations of the others."""
    draw = random.Random(subject.seed)
    refused: dict[tuple[str, str], list[str | None]] = {}
    for _ in range(_CHECKED):
        changes = {
            key: draw.choice([values.low, values.high] if isinstance(values, Span) else values)
            for key, values in parameters.items()
        }
        refusal = refusal_of(subject.task(changes))
        for key, value in changes.items():
            refused.setdefault((key, repr(value)), []).append(refusal)
    for (key, _), reasons in refused.items():
        if all(reason is not None and key in reason for reason in reasons):
            raise SpecificationError(f"{reasons[0]}")


def _study(seed: int) -> Any:
    """Begin a search for small costs and small bounds.

    A tree-structured Parzen estimator tells good values of each parameter from bad ones; Ozaki, Tanigaki, Watanabe,
    Nomura, Onishi, "Multiobjective tree-structured Parzen estimator", J. Artificial Intelligence Research 73, 2022.
    """
    try:
        import optuna
    except ImportError:
        raise ToolError(
            "the package optuna is needed for a search, and was not found: pip install 'sosmith[search]'"
        ) from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    sampler = optuna.samplers.TPESampler(n_startup_trials=_BATCH, seed=seed)
    return optuna.create_study(directions=["minimize", "minimize"], sampler=sampler)


def _suggested(trial: Any, key: str, values: Values) -> Any:
    """Have the optimizer choose a value; of a list its place, which lies between others only if all are numbers."""
    if isinstance(values, Span):
        if values.whole:
            return trial.suggest_int(key, values.low, values.high)
        by_factors = values.low > 0 and values.high / values.low >= _DECADES
        chosen = float(f"{trial.suggest_float(key, values.low, values.high, log=by_factors):.{_DIGITS}g}")
        return min(max(chosen, float(values.low)), float(values.high))
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return sorted(values)[trial.suggest_int(key, 0, len(values) - 1)]
    return values[trial.suggest_categorical(key, range(len(values)))]


def _tell(study: Any, trial: Any, point: Point) -> None:
    """Tell a result: the decades of cost and bound, and whether a constraint is broken."""
    if point["refused"] is not None:
        trial.set_constraint("design", 2.0)
        study.tell(trial, _NO_DESIGN)
        return
    trial.set_constraint("design", 0.0 if point["passed"] else 1.0)
    study.tell(trial, (_decades(point["cost"]["value"]), _decades(point["error"]["bound"])))


def _decades(value: float) -> float:
    return math.log10(max(value, 1e-300))
