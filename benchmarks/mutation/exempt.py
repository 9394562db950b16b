"""Mutants that cannot matter by construction, by stated rules."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass

RULES = {
    "annotation": "type annotations, but for those that pydantic evaluates",
    "message": "the text of errors: arguments of an exception that is raised, the message of `require`",
    "representation": "`__repr__` and `__str__`",
    "logging": "calls of a logger",
    "signature": "stars and slashes of a signature, which are no operators",
    "dataclass": "options of dataclass decorators, which only hold programmers back",
    "memoization": "decorators that keep results: `cache`, `lru_cache`",
    "identity": "`is` in place of `==` and the reverse, which are one for small integers, None and members of enums",
}
"""What each rule exempts. Docstrings need none: no operator mutates text."""

Position = tuple[int, int]
"""Line from 1 and column from 0, in characters."""

_LOGGERS = {"log", "logger", "logging"}
_IDENTITY = {("Eq", "Is"), ("Is", "Eq"), ("NotEq", "IsNot"), ("IsNot", "NotEq")}


@dataclass(frozen=True)
class Span:
    """A piece of a file, its end excluded, and the rule that exempts it."""

    start: Position
    end: Position
    rule: str


def exemption(spans: list[Span], start: Position, operator: str) -> str | None:
    """Return the rule that exempts a mutation, None if there is none.

    Parameters
    ----------
    spans : list of Span
        Those of the file, from `exempt_spans`.
    start : Position
        Where the mutation begins.
    operator : str
        Name of cosmic-ray's operator.
    """
    if operator.startswith("core/ReplaceComparisonOperator_") and tuple(operator.split("_")[-2:]) in _IDENTITY:
        return "identity"
    return next((span.rule for span in spans if span.start <= start < span.end), None)


def exempt_spans(source: str) -> list[Span]:
    """Find the pieces of a file that the rules exempt."""
    lines = source.splitlines()

    def position(line: int, offset: int) -> Position:
        return line, len(lines[line - 1].encode()[:offset].decode())  # the parser counts bytes

    def span(piece: ast.expr | ast.stmt, rule: str) -> Span:
        end = position(piece.end_lineno or 0, piece.end_col_offset or 0)
        return Span(position(piece.lineno, piece.col_offset), end, rule)

    found: list[Span] = []
    tree = ast.parse(source)
    fields = set(_fields(tree)) if "pydantic" in source else set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found += [span(piece, "annotation") for piece in _annotations(node)]
            if node.name in {"__repr__", "__str__"}:
                found.append(span(node, "representation"))
            found += [
                Span((number, column), (number, column + 1), "signature")
                for number, column in _stars(lines, node, position)
            ]
        elif isinstance(node, ast.AnnAssign) and node not in fields:
            found.append(span(node.annotation, "annotation"))
        elif isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            found += [span(piece, "message") for piece in _arguments(node.exc)]
        elif isinstance(node, ast.Call) and _name(node.func) == "require":
            found += [span(piece, "message") for piece in _arguments(node)[1:]]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and _name(node.func.value) in _LOGGERS:
            found.append(span(node, "logging"))
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            for decorator in node.decorator_list:
                name = _name(decorator.func if isinstance(decorator, ast.Call) else decorator)
                if name in {"cache", "lru_cache"}:
                    start = position(decorator.lineno, decorator.col_offset)
                    end = position(decorator.end_lineno or 0, decorator.end_col_offset or 0)
                    found.append(Span((start[0], start[1] - 1), end, "memoization"))  # with the @
                elif name == "dataclass" and isinstance(decorator, ast.Call):
                    found += [span(piece, "dataclass") for piece in _arguments(decorator)]
    return found


def _fields(tree: ast.Module) -> Iterator[ast.AST]:
    """Fields of classes: pydantic, unlike all others, evaluates what is said of them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            yield from node.body


def _annotations(node: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[ast.expr]:
    arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
    yield from (argument.annotation for argument in arguments if argument and argument.annotation)
    if node.returns:
        yield node.returns


def _stars(
    lines: list[str], node: ast.FunctionDef | ast.AsyncFunctionDef, position: Callable[[int, int], Position]
) -> Iterator[Position]:
    """Places of the stars and slashes of a signature, which ends where the body begins."""
    defaults = [piece for piece in (*node.args.defaults, *node.args.kw_defaults) if piece]
    kept = [
        (position(piece.lineno, piece.col_offset), position(piece.end_lineno or 0, piece.end_col_offset or 0))
        for piece in defaults
    ]
    first, last = (node.lineno, node.col_offset), position(node.body[0].lineno, node.body[0].col_offset)
    for number in range(first[0], last[0] + 1):
        for column, character in enumerate(lines[number - 1]):
            place = (number, column)
            if character in "*/" and first <= place < last and not any(start <= place < end for start, end in kept):
                yield place


def _arguments(call: ast.Call) -> list[ast.expr]:
    return [*call.args, *(keyword.value for keyword in call.keywords)]


def _name(node: ast.expr) -> str:
    """Last part of a dotted name, empty for anything else."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""
