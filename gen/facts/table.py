"""Facts and tables of texts, as HTML and JSON; `commands` prints them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

from sosmith.gen.quantity import in_own_unit


@dataclass(frozen=True)
class Fact:
    """One figure, and what a reader must know beside it; as a row of a table it has two cells, its name and its text.

    Attributes
    ----------
    name : str
        What it is.
    value : float, int, str or None
        How large; a text where it is no number, None where the sentence says all.
    unit : str
        Unit of the value as in a specification, "" for a plain number or a text.
    sentence : str
        The rest; stands behind the value.
    show : callable or None
        Makes the text of a number that is no int from value and unit; None for three digits in the unit itself.
    share : float or None
        What part of its limit the value is; None where it has no limit.
    """

    name: str
    value: float | str | None = None
    unit: str = ""
    sentence: str = ""
    show: Callable[[float, str], str] | None = None
    share: float | None = None

    @property
    def shown(self) -> str:
        """The value with its unit."""
        if self.value is None or isinstance(self.value, str):
            return self.value or ""
        if isinstance(self.value, int):
            return f"{self.value:,} {self.unit}".rstrip()
        return (self.show or in_own_unit)(self.value, self.unit)

    @property
    def text(self) -> str:
        """Value and sentence."""
        return "; ".join(part for part in (self.shown, self.sentence) if part)

    def __iter__(self) -> Iterator[str]:
        """Give the cells of its row."""
        return iter((self.name, self.text))

    def as_dict(self) -> dict[str, Any]:
        """Return all of it, with the value also as text."""
        return {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "text": self.shown,
            "sentence": self.sentence,
            "share": self.share,
        }


@dataclass(frozen=True)
class Table:
    """Plain texts in rows and columns; whoever shows them escapes them.

    Attributes
    ----------
    title : str
        What the table is about.
    rows : sequence of iterables of str
        Facts, or rows of cells. The first cell of each row is its heading, empty where it is that of the row above.
    head : sequence of str
        Titles of the columns; all empty for facts.
    styles : mapping of str to str
        How a terminal shows some of the headings, by the heading: "bold" for a sum, "red" for what falls short.
    passed : bool or None
        The verdict behind the title; None without one.
    notes : sequence of str
        Sentences below the table.
    numbers, code : collection of int
        Columns that a page sets flush right, and those that it sets in monospace.
    """

    title: str
    rows: Sequence[Iterable[str]]
    head: Sequence[str] = ("", "")
    styles: Mapping[str, str] = field(default_factory=dict)
    passed: bool | None = None
    notes: Sequence[str] = ()
    numbers: Collection[int] = ()
    code: Collection[int] = ()

    def html(self, *, caption: bool = True) -> str:
        """Return the table for a notebook or a page, with its title as the caption."""
        verdict = "" if self.passed is None else f": {'passed' if self.passed else 'fell short'}"
        title = f"<caption>{escape(self.title + verdict)}</caption>" if caption else ""
        titles = "".join(_title("col", escape(name), self._aligned(k)) for k, name in enumerate(self.head))
        head = f"<thead><tr>{titles}</tr></thead>" if any(self.head) else ""
        body = "".join(map(self._row, self.rows))
        notes = "".join(f"<p>{escape(note)}</p>" for note in self.notes)
        return f"<table>{title}{head}<tbody>{body}</tbody></table>{notes}"

    def _row(self, row: Iterable[str]) -> str:
        first, *rest = map(escape, row)
        cells = "".join(
            f"<td{self._aligned(k)}>{f'<code>{cell}</code>' if k in self.code else cell}</td>"
            for k, cell in enumerate(rest, start=1)
        )
        same = "" if first else ' class="same"'
        return f"<tr{same}>{_title('row', first)}{cells}</tr>"

    def _aligned(self, column: int) -> str:
        return ' class="number"' if column in self.numbers else ""

    def as_dict(self) -> dict[str, Any]:
        """Return title, verdict, rows and notes in JSON types; facts have their values."""
        rows = [row.as_dict() if isinstance(row, Fact) else list(row) for row in self.rows]
        head = {"head": list(self.head)} if any(self.head) else {}
        verdict = {} if self.passed is None else {"passed": self.passed}
        return {"title": self.title, **verdict, **head, "rows": rows, "notes": list(self.notes)}


def _title(scope: str, text: str, attributes: str = "") -> str:
    """Return the cell of a title; without one it is an empty cell, which a screen reader passes over."""
    return f'<th scope="{scope}"{attributes}>{text}</th>' if text else f"<td{attributes}></td>"


class View:
    """What has tables to show: in a terminal, a notebook and a script."""

    def tables(self) -> list[Table]:
        """Return its tables."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        return "".join(table.html() for table in self.tables())
