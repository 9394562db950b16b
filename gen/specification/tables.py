"""Tables of a specification: each key has a reader, and all values that do not fit are found at once.

A table is a class with an attribute for each key::

    class Format(Table):
        bits: int = key(whole(2, 32), "a whole number from 2 to 32")    must be there
        signed: bool = key(flag, default=False)                         need not
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, TypeVar

from sosmith.gen.specification.values import UnfitError, key_text, literal, together
from sosmith.model.suggestion import did_you_mean

Reader = Callable[[object], Any]
"""Takes a value as `tomllib` gives it, and returns it checked or raises `UnfitError`."""

_REQUIRED: Any = object()

_Shape = TypeVar("_Shape", bound="Table")


class MisfitsError(ValueError):
    """Values of a table that do not fit, each with the path of its key from that table on."""

    def __init__(self, findings: list[tuple[tuple[str, ...], UnfitError]]) -> None:
        self.findings = findings
        super().__init__(str(findings))


class _Key:
    def __init__(self, read: Callable[[object, Mapping[str, Any]], Any], expected: str, default: Any) -> None:
        self.read, self.expected, self.default = read, expected, default


def key(read: Reader, expected: str = "", *, default: Any = _REQUIRED) -> Any:
    """Return a key of a table with its reader; without a default, the message that it is missing has `expected`."""
    return _Key(lambda value, _earlier: read(value), expected, default)


def key_after(read: Callable[[object, Mapping[str, Any]], Any], *, default: Any) -> Any:
    """Return a key whose reader also takes the values of the keys above it, as far as these fit."""
    return _Key(read, "", default)


def table(shape: type[Table], expected: str, *, default: Any = _REQUIRED) -> Any:
    """Return a key that holds a table; where None is its default, it may be that, too."""

    def read(value: object) -> Table | None:
        return None if value is default is None else _table(shape, value, expected)

    return key(read, expected, default=default)


def tables(shape: type[Table], expected: str, *, default: Any = _REQUIRED) -> Any:
    """Return a key that holds a table of tables, all of one shape, under any names."""

    def read(value: object) -> dict[str, Table]:
        if not isinstance(value, dict):
            raise UnfitError(expected, literal(value))
        made, findings = dict[str, Table](), list[tuple[tuple[str, ...], UnfitError]]()
        for name, each in value.items():
            try:
                made[name] = _table(shape, each, "a table")
            except ValueError as error:
                findings += _inside(name, error)
        if findings:
            raise MisfitsError(findings)
        return made

    return key(read, expected, default=default)


class Table:
    """A table of a specification, without unknown keys.

    Parameters
    ----------
    values : dict
        The checked values of keys; those that are missing have their defaults.
    """

    keys: ClassVar[dict[str, _Key]] = {}

    def __init_subclass__(cls) -> None:
        cls.keys = cls.keys | {name: each for name, each in vars(cls).items() if isinstance(each, _Key)}

    def __init__(self, values: dict[str, Any]) -> None:
        vars(self).update({name: each.default for name, each in self.keys.items()} | values)

    @classmethod
    def read(cls: type[_Shape], tree: dict[str, Any]) -> _Shape:
        """Check the shape of a table.

        Parameters
        ----------
        tree : dict
            As `tomllib` gives it, with every float as `decimal.Decimal`.

        Raises
        ------
        MisfitsError
            For all errors.
        """
        values, findings = dict[str, Any](), list[tuple[tuple[str, ...], UnfitError]]()
        for name, each in cls.keys.items():
            if name in tree:
                try:
                    values[name] = each.read(tree[name], values)
                except ValueError as error:
                    findings += _inside(name, error)
            elif each.default is _REQUIRED:
                findings.append(((name,), UnfitError(each.expected, "missing")))
        for name in tree:
            if name not in cls.keys:
                hint = did_you_mean(name, cls.keys)
                findings.append(
                    ((name,), UnfitError(f"one of the keys {', '.join(cls.keys)}", f"an unknown one{hint}"))
                )
        if findings:
            raise MisfitsError(findings)
        return cls(values)


def read_whole(shape: type[_Shape], tree: dict[str, Any]) -> _Shape:
    """Check the shape of a whole file; parameters as of `Table.read`.

    Raises
    ------
    UnfitError
        For all errors, in the order of the file.
    """
    try:
        return shape.read(tree)
    except MisfitsError as error:
        findings = sorted(error.findings, key=lambda finding: _position(tree, finding[0]))
    raise together([unfit.inside(".".join(map(key_text, path))) for path, unfit in findings])


def _table(shape: type[Table], value: object, expected: str) -> Table:
    if not isinstance(value, dict):
        raise UnfitError(expected, literal(value))
    return shape.read(value)


def _inside(name: str, error: ValueError) -> list[tuple[tuple[str, ...], UnfitError]]:
    """Return what a key's reader has found, with that key in front."""
    if isinstance(error, MisfitsError):
        return [((name, *path), unfit) for path, unfit in error.findings]
    assert isinstance(error, UnfitError)
    return [((name,), error)]


def _position(tree: Any, path: tuple[str, ...]) -> list[int]:
    """Return the position of a key in the file; a missing key is at the end of its table."""
    position = []
    for name in path:
        position.append(list(tree).index(name) if name in tree else len(tree))
        tree = tree.get(name)
    return position
