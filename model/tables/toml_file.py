"""TOML files as dicts, with one sentence for whatever keeps a file from being read."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any

from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_text

_DEEPEST = 100
"""Tables and lists in one another, at most."""


def read_toml(path: Path, *, what: str, max_bytes: int, parse_float: Callable[[str], Any] = float) -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    path, what, max_bytes
        As for `read_text`.
    parse_float : callable
        Makes a number of the text of a TOML float.

    Raises
    ------
    SpecificationError
        As `read_text`, or if the file is no TOML.
    """
    return parse_toml(read_text(path, what=what, max_bytes=max_bytes), str(path), what=what, parse_float=parse_float)


def parse_toml(text: str, name: str, *, what: str, parse_float: Callable[[str], Any] = float) -> dict[str, Any]:
    """Parse the `text` of a file called `name`; the other parameters are those of `read_toml`.

    Raises
    ------
    SpecificationError
        If the text is no TOML.
    """
    try:
        _check_keys(text)
        tree = tomllib.loads(text.removeprefix("\ufeff"), parse_float=parse_float)
        _check_depth(tree)
        return tree
    except tomllib.TOMLDecodeError as error:
        raise SpecificationError(f"{name}: {_syntax_error(str(error), text)}") from None
    except (ValueError, ArithmeticError, RecursionError):
        # Python's own limits: 4300 digits of an int, 18 of an exponent, some hundred lists in one another.
        raise SpecificationError(
            f"{name}: {what} must be TOML within reason, not lists some hundred deep or a number too long to read"
        ) from None


def _check_keys(text: str) -> None:
    """Raise RecursionError for a key of many dots, which Python's reader takes minutes for."""
    for line in text.splitlines():
        key, equals, _ = line.lstrip().partition("=")
        if key.count(".") > _DEEPEST and (equals or key.startswith("[")) and not key.startswith("#"):
            raise RecursionError


def _check_depth(tree: dict[str, Any]) -> None:
    """Raise RecursionError for tables and lists too deep in one another: a key of dots makes any depth."""
    level: list[Any] = [tree]
    for _ in range(_DEEPEST):
        level = [
            part
            for one in level
            for part in (one.values() if isinstance(one, dict) else one)
            if isinstance(part, dict | list)
        ]
        if not level:
            return
    raise RecursionError


def _syntax_error(message: str, text: str) -> str:
    """Turn tomllib's message "Problem (at line 3, column 7)" into a sentence."""
    problem, _, place = message.removesuffix(")").rpartition(" (at ")
    if not re.fullmatch(r"line \d+, column \d+", place):
        place = f"line {max(len(text.splitlines()), 1)}"  # "end of document"
    if problem.startswith(('Expected "\'"', "Illegal character '\\n'", "Expected '\"'")):  # it may be told at the end
        open_quote = next((at for at, line in enumerate(text.splitlines(), 1) if _odd_quotes(line)), None)
        if open_quote is not None:
            return f"line {open_quote} must end its text with the quote that begins it"
    cure = _cure(text, place)
    if cure:
        return f"{place.split(',')[0]} must be {cure}"
    return f"{place} must be valid TOML, not a syntax error: {problem[:1].lower()}{problem[1:]}"


_PREFIXES = {"k": 3, "K": 3, "M": 6, "G": 9, "m": -3}
_KEY, _END = r"\s*([A-Za-z][A-Za-z0-9_.-]{0,60})\s*=\s*", r"\s*(?:#.*)?"
_UNIT = re.compile(
    rf"{_KEY}([-+]?[0-9][0-9_]{{0,17}}(?:\.[0-9]{{1,18}})?)\s*([kKMGm]?)([A-Za-z][A-Za-z/]{{0,20}})?{_END}"
)
_WORD = re.compile(rf"{_KEY}([A-Za-z][A-Za-z0-9_-]{{0,60}}){_END}")
_COMMAS = re.compile(rf"{_KEY}([0-9]{{1,3}}(?:,[0-9]{{3}}){{1,5}}(?:\.[0-9]{{0,18}})?){_END}")
_COMMA = re.compile(rf"{_KEY}([-+]?[0-9]{{1,18}}),([0-9]{{1,18}}){_END}")
_NO_EQUALS = re.compile(rf"\s*([A-Za-z][A-Za-z0-9_.-]{{0,60}})\s+([-+]?[0-9][0-9.]{{0,20}}|\"[^\"]{{0,60}}\"){_END}")
_FLAGS = {"yes": "true", "on": "true", "True": "true", "TRUE": "true", "no": "false", "off": "false"}
_FLAGS |= {"False": "false", "FALSE": "false"}


def _odd_quotes(line: str) -> bool:
    code = line.split("#", maxsplit=1)[0]
    return bool(code.count('"') % 2 or code.count("'") % 2)


def _cure(text: str, place: str) -> str:
    """Return what the line of a syntax error must be, where it is one of the usual slips; empty elsewhere."""
    number = re.match(r"line (\d+)", place)
    lines = text.splitlines()
    line = lines[int(number[1]) - 1] if number and int(number[1]) <= len(lines) else ""
    if (match := _UNIT.fullmatch(line)) and (match[3] or match[4]):
        value = Decimal(match[2].replace("_", "")).scaleb(_PREFIXES.get(match[3], 0))
        return f"a number without a unit: {match[1]} = {value:f}"
    if match := _COMMAS.fullmatch(line):
        return f"a number without commas: {match[1]} = {match[2].replace(',', '')}"
    if match := _COMMA.fullmatch(line):
        return f"a number with a decimal point: {match[1]} = {match[2]}.{match[3]}"
    if match := _NO_EQUALS.fullmatch(line):
        return f"a key, an equals sign and a value: {match[1]} = {match[2]}"
    if match := _WORD.fullmatch(line):
        known = _FLAGS.get(match[2])
        return f"true or false: {match[1]} = {known}" if known else f'a text in quotes: {match[1]} = "{match[2]}"'
    if re.match(r"\s*[\w.-]+\s*:", line):
        return "a key, an equals sign and a value, as in order = 4: TOML has no colons there"
    return ""
