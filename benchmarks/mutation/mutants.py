"""All mutants of some files, and a seeded sample of them."""

from __future__ import annotations

import ast
import difflib
import hashlib
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

from benchmarks.mutation.exempt import Position, exempt_spans, exemption


class Change(NamedTuple):
    """Something that an operator can do to a file.

    Attributes
    ----------
    operator : str
        Name of the operator.
    occurrence : int
        Which of the changes that the operator can make to the file, from 0.
    start, end : Position
        What is changed.
    """

    operator: str
    occurrence: int
    start: Position
    end: Position


@dataclass(frozen=True)
class Mutation:
    """A change of the file at `path`, and the same told by the function around it, `where`, for when others change."""

    path: str
    change: Change
    where: str


@dataclass(frozen=True)
class Mutant:
    """A file with one change.

    Attributes
    ----------
    path : str
        File, from the root.
    line : int
        Line that changes.
    place : str
        Qualified name of the innermost function or class around it, or of the constant of the module; else ``module``.
    offset : int
        Lines from the beginning of `place` to the change.
    digest : str
        Of the text of `place` as it is: a listed equivalence is void as soon as it changes.
    before, after : str
        The changed lines without their indentation.
    operator : str
        Name of cosmic-ray's operator.
    text : str
        The whole mutated file.
    """

    path: str
    line: int
    place: str
    offset: int
    digest: str
    before: str
    after: str
    operator: str
    text: str


@dataclass(frozen=True)
class Population:
    """What can be mutated in some files.

    Attributes
    ----------
    sites : list of list of Mutation
        The mutations by the piece of text that they change.
    exempt : dict of str to int
        Mutations that do not count, by rule.
    """

    sites: list[list[Mutation]]
    exempt: dict[str, int]

    @property
    def mutants(self) -> int:
        """Number of mutants that count."""
        return sum(map(len, self.sites))


def short_digest(*parts: str) -> str:
    """Return 16 hexadecimal digits that stand for some texts."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


def population(root: Path, paths: Iterable[str], changes: Callable[[str], list[Change]]) -> Population:
    """List every mutation of the files at `paths` below `root`; `changes` lists those of a text."""
    sites: dict[str, list[Mutation]] = defaultdict(list)
    exempt: Counter[str] = Counter()
    for path in paths:
        source = (root / path).read_text(encoding="utf-8")
        spans = exempt_spans(source)
        for change in changes(source):
            rule = exemption(spans, change.start, change.operator)
            if rule is not None:
                exempt[rule] += 1
                continue
            place, first, _ = _place(source, change.start[0])
            lines = (change.start[0] - first, change.end[0] - first)
            where = f"{path} {place} {lines[0]} {change.start[1]} {lines[1]} {change.end[1]}"
            sites[where].append(Mutation(path, change, where))
    return Population(list(sites.values()), dict(sorted(exempt.items())))


def sample(root: Path, found: Population, size: int, seed: int, changed: Callable[[str, Change], str]) -> list[Mutant]:
    """Draw sites at random, and at each site one mutant that is valid Python and another program.

    The order of the draw hangs on the seed and on the place of each site in the function around it: a larger sample
    begins with the smaller one, and a change of other functions leaves the draw as it is.
    """
    drawn: list[Mutant] = []
    for site in sorted(found.sites, key=lambda site: short_digest(str(seed), site[0].where)):
        if len(drawn) == size:
            break
        for mutation in sorted(site, key=lambda one: short_digest(str(seed), one.where, one.change.operator)):
            made = mutant(root, mutation, changed)
            if made is not None:
                drawn.append(made)
                break
    return drawn


def mutant(root: Path, mutation: Mutation, changed: Callable[[str, Change], str]) -> Mutant | None:
    """Apply a mutation; return None if what comes out is no valid Python, or the same program."""
    source = (root / mutation.path).read_text(encoding="utf-8")
    text = changed(source, mutation.change)
    try:
        with warnings.catch_warnings(action="error"):
            compile(text, mutation.path, "exec")
    except (SyntaxError, SyntaxWarning):
        return None
    if ast.dump(ast.parse(text)) == ast.dump(ast.parse(source)):
        return None
    line = mutation.change.start[0]
    place, first, digest = _place(source, line)
    before, after = _changed(source.splitlines(), text.splitlines())
    operator = mutation.change.operator
    return Mutant(mutation.path, line, place, line - first, digest, before, after, operator, text)


def statement_lines(source: str, line: int) -> range:
    """Lines of the innermost statement around a line; of a compound one, only those before its body."""
    best = range(line, line + 1)
    size = None
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.stmt):
            continue
        body = getattr(node, "body", None)
        last = body[0].lineno - 1 if body else node.end_lineno or node.lineno
        reach = range(node.lineno, max(last, node.lineno) + 1)
        if line in reach and (size is None or len(reach) <= size):
            best, size = reach, len(reach)
    return best


def place_digests(source: str) -> dict[str, str]:
    """Digest of every function, class and constant of a file by its name, and of the file itself under ``module``."""
    return {name: digest for name, _, _, digest in _places(source)}


def _changed(before: Sequence[str], after: Sequence[str]) -> tuple[str, str]:
    """Return the lines that differ."""
    parts = [
        ([line.strip() for line in before[a:b]], [line.strip() for line in after[c:d]])
        for tag, a, b, c, d in difflib.SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
        if tag != "equal"
    ]
    return " ".join(line for old, _ in parts for line in old), " ".join(line for _, new in parts for line in new)


@cache
def _places(source: str) -> list[tuple[str, int, int, str]]:
    """Name, first line, last line and digest of the module and of every function, class and constant in it."""
    lines = source.splitlines()
    found = [("module", 1, len(lines), short_digest(source))]

    def add(name: str, node: ast.stmt, first: int) -> None:
        last = node.end_lineno or first
        found.append((name, first, last, short_digest("\n".join(lines[first - 1 : last]))))

    def visit(node: ast.AST, prefix: str) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                add(prefix + child.name, child, min([child.lineno, *(one.lineno for one in child.decorator_list)]))
                visit(child, f"{prefix}{child.name}.")
            elif isinstance(node, ast.Module) and isinstance(child, ast.Assign | ast.AnnAssign):
                target = child.targets[0] if isinstance(child, ast.Assign) else child.target
                add(ast.unparse(target), child, child.lineno)
            else:
                visit(child, prefix)

    visit(ast.parse(source), "")
    return found


def _place(source: str, line: int) -> tuple[str, int, str]:
    """Name, first line and digest of the innermost place around a line."""
    name, first, _, digest = min(
        (place for place in _places(source) if place[1] <= line <= place[2]), key=lambda place: place[2] - place[1]
    )
    return name, first, digest
