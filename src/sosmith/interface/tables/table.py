"""Tables of texts: what a design or a report says, for a terminal or a notebook to show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape


@dataclass(frozen=True)
class Table:
    """Plain texts in rows and columns; whoever shows them escapes them.

    Attributes
    ----------
    title : str
        What the table is about.
    rows : sequence of sequences of str
        The first cell of each row is its heading: the name of a fact.
    head : sequence of str
        Titles of the columns; all empty for facts, which have a name and a text.
    styles : mapping of str to str
        How a terminal shows some of the headings, by the heading: "bold" for a sum, "red" for what falls short.
    passed : bool or None
        The verdict behind the title; None without one.
    """

    title: str
    rows: Sequence[Sequence[str]]
    head: Sequence[str] = ("", "")
    styles: Mapping[str, str] = field(default_factory=dict)
    passed: bool | None = None

    def html(self) -> str:
        """Return the table for a notebook."""
        title = self.title if self.passed is None else f"{self.title}: {'passed' if self.passed else 'fell short'}"
        return table_html(title, self.rows, self.head if any(self.head) else ())


def table_html(title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    """Return a table with the caption `title`; the first cell of each row is its heading."""
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in header)
    body = "".join(
        f'<tr><th scope="row">{escape(first)}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in rest)}</tr>'
        for first, *rest in rows
    )
    columns = f"<thead><tr>{head}</tr></thead>" if head else ""
    return f"<table><caption>{escape(title)}</caption>{columns}<tbody>{body}</tbody></table>"
