"""The grid of an exploration: every combination of the values of some keys of a specification."""

from __future__ import annotations

import hashlib
import itertools
import json
import tomllib
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

from sosmith.gen.specification.choices import REALIZATIONS
from sosmith.gen.specification.exact_values import exact
from sosmith.gen.specification.specification import Specification, from_tree
from sosmith.gen.version import __version__
from sosmith.model.errors import SpecificationError

MAX_POINTS = 100_000
"""Combinations, at most."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One design to be made and measured; everything that the result depends on.

    Attributes
    ----------
    key : str
        Digest of all the others.
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
    """

    key: str
    changes: dict[str, Any]
    tree: dict[str, Any]
    path: Path
    core: str | None
    samples: int
    seed: int
    board: str | None

    def specification(self) -> Specification:
        """Check the specification.

        Raises
        ------
        SpecificationError
            If its values do not go together.
        """
        return from_tree(exact(self.tree), self.path)


def default_parameters(spec: Specification) -> dict[str, list[Any]]:
    """Return what is swept if nothing is asked for: realizations, architectures, word lengths by the allowed error."""
    allowed = spec.max_error
    return {
        "hardware.realization": [name for name in REALIZATIONS if name != "auto"],
        "hardware.architecture": ["parallel", "folded"],
        "output.max_error": [float(allowed * factor) for factor in (1, 2, 4)],
    }


def read_parameter(text: str) -> tuple[str, list[Any]]:
    """Read ``KEY=V1,V2``: a key of the specification with dots, and values as in TOML; names need no quotes.

    Raises
    ------
    SpecificationError
        If there is no key or no value, or a value cannot be read.
    """
    key, _, values = (part.strip() for part in text.partition("="))
    if not key or not values:
        raise SpecificationError(f"a parameter must be KEY=V1,V2,..., not {text}")
    return key, [_value(part, text) for part in _parts(values)]


def _parts(values: str) -> list[str]:
    """Split at commas outside of brackets and quotes."""
    parts, depth, quote = [""], 0, ""
    for sign in values:
        if sign in "\"'" and quote in {"", sign}:
            quote = "" if quote else sign
        depth += 0 if quote else (sign == "[") - (sign == "]")
        if sign == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += sign
    return [part.strip() for part in parts]


def _value(part: str, text: str) -> Any:
    if part.isidentifier() and part not in {"true", "false", "inf", "nan"}:
        return part
    try:
        return _to_json(tomllib.loads(f"value = {part}\n", parse_float=Decimal)["value"])
    except (tomllib.TOMLDecodeError, RecursionError):
        raise SpecificationError(f"a value must be one of TOML, or a name, not {part} in {text}") from None


def _to_json(value: Any) -> Any:
    if isinstance(value, list):
        return [_to_json(item) for item in value]
    return float(value) if isinstance(value, Decimal) else value


def tasks_of(
    spec: Specification,
    parameters: Mapping[str, Sequence[Any]],
    *,
    core: str | None,
    samples: int,
    seed: int,
    board: str | None,
) -> list[Task]:
    """Make a task for every combination, the last parameter changing fastest.

    Combinations that do not go together are for the evaluation to refuse; a value that goes with nothing is refused
    here.

    Raises
    ------
    SpecificationError
        If a key is of a table that the specification lacks, a value fits no combination, or there are too many.
    """
    count = 1
    for values in parameters.values():
        count *= len(values)
    if count > MAX_POINTS:
        raise SpecificationError(f"there must be at most {MAX_POINTS:,} combinations, not {count:,}")
    measured = None if spec.calibration is None or spec.calibration.data is None else spec.calibration.data
    data = "" if measured is None else hashlib.sha256(measured.read_bytes()).hexdigest()
    tasks = []
    for values in itertools.product(*parameters.values()):
        changes = dict(zip(parameters, values, strict=True))
        tree = changed(spec.source, changes)
        subject = [tree, core, samples, seed, board, data, __version__]
        key = hashlib.sha256(json.dumps(subject, sort_keys=True).encode()).hexdigest()
        tasks.append(
            Task(
                key=key,
                changes=changes,
                tree=tree,
                path=spec.path,
                core=core,
                samples=samples,
                seed=seed,
                board=board,
            )
        )
    _check_values(tasks, parameters)
    return tasks


def changed(source: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Copy a specification in the types of JSON, with other values of some keys, given with dots.

    Raises
    ------
    SpecificationError
        If a key is inside of something that is no table.
    """
    tree = deepcopy(dict(source))
    for key, value in changes.items():
        *tables, last = key.split(".")
        place: Any = tree
        for name in tables:
            place = place.setdefault(name, {})
            if not isinstance(place, dict):
                raise SpecificationError(f"a parameter must be a key of the specification, not {key}")
        place[last] = value
    return tree


def _check_values(tasks: Sequence[Task], parameters: Mapping[str, Sequence[Any]]) -> None:
    """Refuse a value that no combination accepts: it is mistyped."""
    refusals: list[str | None] = []
    for task in tasks:
        try:
            task.specification()
            refusals.append(None)
        except SpecificationError as error:
            refusals.append(str(error))
    for key, values in parameters.items():
        for value in values:
            of_it = [refusal for task, refusal in zip(tasks, refusals, strict=True) if task.changes[key] == value]
            if of_it and all(of_it):
                raise SpecificationError(f"{of_it[0]}")
