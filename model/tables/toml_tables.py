"""TOML files of checked tables: every error names the file and the key, what was expected and what was found.

The shape of a file is a pydantic model built from `Table`. Each field has a description that reads on from "must be";
a rule about several keys raises `UnfitKeyError`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean
from sosmith.model.tables.toml_file import read_toml

MAX_BYTES = 1 << 18
"""Largest file size in bytes; real files have a few thousand."""

MAX_SHOWN = 60
"""Longest value, in characters, that a message quotes in full."""


class UnfitKeyError(ValueError):
    """Keys that contradict each other.

    Parameters
    ----------
    where : str
        Path of the key, relative to the table with the rule.
    expected : str
        What was expected; reads on from "must be".
    found : str
        What was found.
    """

    def __init__(self, where: str, expected: str, found: str) -> None:
        self.where = where
        self.expected = expected
        self.found = found
        super().__init__(f"{where} must be {expected}, not {found}")


class Table(BaseModel):
    """An immutable table that accepts only its own keys, with strict types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, hide_input_in_errors=True)


Document = TypeVar("Document", bound=Table)


def read_tables(path: Path, shape: type[Document]) -> Document:
    """Read the file `path` as a table of type `shape`.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is not TOML, and for the first error in its content.
    """
    try:
        return shape.model_validate(read_toml(path, what="the file", max_bytes=MAX_BYTES))
    except ValidationError as error:
        findings = _own(error.errors(include_url=False))
        more = f" (and {len(findings) - 1} more)" if len(findings) > 1 else ""
        raise SpecificationError(f"{path}: {_sentence(shape, findings[0])}{more}") from None


def _own(findings: list[ErrorDetails]) -> list[ErrorDetails]:
    """Sort errors: unknown keys first, which often explain missing ones, and outer keys before inner ones.

    Drop the error that a list is too short if it is so only because items in it are invalid.
    """
    own = [
        finding
        for finding in findings
        if finding["type"] != "too_short"
        or not any(other["loc"][: len(finding["loc"])] == finding["loc"] for other in findings if other is not finding)
    ]
    return sorted(own, key=lambda finding: (finding["type"] != "extra_forbidden", len(finding["loc"])))


def _sentence(shape: type[Table], finding: ErrorDetails) -> str:
    path = finding["loc"]
    cause = finding.get("ctx", {}).get("error")
    if isinstance(cause, UnfitKeyError):
        return f"{_joined(_path_text(path), cause.where)} must be {cause.expected}, not {cause.found}"
    where = _path_text(path)
    owner, field = _field_at(shape, path)
    if finding["type"] == "extra_forbidden":
        hint = did_you_mean(str(path[-1]), owner.model_fields)
        return f"{where} must be one of the keys {', '.join(owner.model_fields)}, not an unknown one{hint}"
    assert field is not None
    assert field.description, f"{where} must have a description"
    given = "missing" if finding["type"] == "missing" else shown(finding["input"])
    inside = _path_text(path[_last_name(path) + 1 :])
    if inside:  # the description is of the whole list
        whole = _path_text(path[: _last_name(path) + 1])
        return f"{whole} must be {field.description}, not one with {given} at {inside}"
    return f"{where} must be {field.description}, not {given}"


def _last_name(path: tuple[int | str, ...]) -> int:
    return max(k for k, key in enumerate(path) if isinstance(key, str))


def _joined(first: str, second: str) -> str:
    return ".".join(filter(None, (first, second)))


def _path_text(path: tuple[int | str, ...]) -> str:
    text = ""
    for key in path:
        text = f"{text}[{key}]" if isinstance(key, int) else _joined(text, key)
    return text


def _field_at(shape: type[Table], path: tuple[int | str, ...]) -> tuple[type[Table], FieldInfo | None]:
    """Return the table and the field of the last key in `path`."""
    field = None
    for key in path:
        if isinstance(key, int):
            continue
        if field is not None:
            (shape,) = _tables_in(field.annotation)
        field = shape.model_fields.get(key)
    return shape, field


def _tables_in(annotation: Any) -> list[type[Table]]:
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return [annotation]
    return [table for part in get_args(annotation) for table in _tables_in(part)]


def shown(value: object) -> str:
    """Return a value from a TOML file as one line of limited length."""
    match value:
        case None:
            text = "missing"
        case bool():
            text = "true" if value else "false"
        case dict() | Table():
            text = "a table"
        case list() | tuple() if len(value) > 6 or any(isinstance(item, list | tuple | dict | Table) for item in value):
            text = f"a list of {len(value)} values"
        case list() | tuple():
            text = f"[{', '.join(map(shown, value))}]"
        case str() | int() | float():
            text = repr(value)
        case _:
            text = str(value)
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 4]} ..."
