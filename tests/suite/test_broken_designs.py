"""What tests replace in a design to break it is there: most of them are slow, and seldom run."""

import ast
import importlib
import inspect
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from _pytest.mark.structures import ParameterSet

TESTS = Path(__file__).resolve().parents[1]
FILES = sorted(
    path
    for path in TESTS.rglob("test_*.py")
    if path != Path(__file__) and "import broken" in path.read_text(encoding="utf-8")
)
BY_CASE = {"test_a_core_that_is_wrong_is_rejected"}
"""Tests in which the case decides on the module."""


def parameters_of(test: Callable[..., object]) -> Iterator[dict[str, Any]]:
    """Yield the parameters of a test by name, of each mark by itself."""
    for mark in getattr(test, "pytestmark", ()):
        if mark.name != "parametrize":
            continue
        names = mark.args[0].replace(" ", "").split(",") if isinstance(mark.args[0], str) else [*mark.args[0]]
        for case in mark.args[1]:
            values = case.values if isinstance(case, ParameterSet) else case if len(names) > 1 else (case,)
            yield dict(zip(names, values, strict=True))


def texts_of(module: ModuleType, test: Callable[..., object]) -> Iterator[tuple[ModuleType, str]]:
    """Yield what a test replaces, and in which module."""
    body = ast.parse(inspect.getsource(test))
    own = {name: value for node in ast.walk(body) if isinstance(node, ast.Assign) for name, value in constants_in(node)}
    for call in ast.walk(body):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "broken":
            for case in ({}, *parameters_of(test)):
                known = {**vars(module), **own, **case}
                values = [value for argument in call.args for value in evaluated(argument, known)]
                if len(values) > 1 and isinstance(values[0], ModuleType) and isinstance(values[1], str):
                    yield values[0], values[1]


def constants_in(node: ast.Assign) -> Iterator[tuple[str, Any]]:
    """Yield the names that an assignment gives constants to."""
    (target,) = node.targets
    pairs = (
        zip(target.elts, node.value.elts, strict=True)
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
        else [(target, node.value)]
    )
    for name, value in pairs:
        if isinstance(name, ast.Name) and isinstance(value, ast.Constant):
            yield name.id, value.value


def evaluated(argument: ast.expr, known: dict[str, Any]) -> Sequence[Any]:
    """Return the values of an argument, as far as it is a constant or a name."""
    if isinstance(argument, ast.Constant):
        return [argument.value]
    starred = isinstance(argument, ast.Starred)
    name = argument.value if isinstance(argument, ast.Starred) else argument
    value = known.get(name.id) if isinstance(name, ast.Name) else None
    return (value or ()) if starred else [value]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(TESTS).as_posix())
def test_what_a_test_replaces_is_there_once(path: Path) -> None:
    module = importlib.import_module(".".join(("tests", *path.relative_to(TESTS).with_suffix("").parts)))
    tests = [test for name, test in vars(module).items() if name.startswith("test_") and callable(test)]
    breaking = [test for test in tests if "broken(" in inspect.getsource(test) and test.__name__ not in BY_CASE]
    for test in breaking:
        texts = [*texts_of(module, test)]
        assert texts, f"{test.__name__} must name the text that it replaces"
        for changed, text in texts:
            count = Path(str(changed.__file__)).read_text(encoding="utf-8").count(text)
            assert count == 1, f"{changed.__name__} must hold {text!r} once for {test.__name__}, not {count} times"
