"""The console on stdout, and the table style of all commands."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from sosmith import Table as Facts
from sosmith.terminal import NARROWEST

_VERDICTS = {None: "", True: ": [bold green]passed[/]", False: ": [bold red]fell short[/]"}

_PATH = re.compile(r"[^\s\[]/[^\s\]]")
"""What makes a text one with a path; not the end of a style."""

_PIECE = re.compile(r"\S+?/(?=[^\s/])|\S+\s*|\s+")
"""What is not broken: a word, up to a slash in it."""

_MAX_TITLE = 76
"""Columns that the narrowest terminals have."""


class TableConsole(Console):
    """A console that leaves a closed pipe to `sosmith.terminal.reader_may_leave`, and no blanks at the ends of lines.

    Without a terminal there is nothing that blanks could paint over; a diff or a quotation shows them.
    """

    def __init__(self) -> None:
        super().__init__()
        self.width = max(self.width, NARROWEST)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as `rich.console.Console.print` does."""
        if self.is_terminal:
            super().print(*objects, **options)
            return
        with self.capture() as captured:
            super().print(*objects, **options)
        self.file.write("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))


class _Cell:
    """A cell that may be broken after a slash, so that the names in a path stay whole."""

    def __init__(self, text: Text) -> None:
        self._text = text
        self._pieces = list(_PIECE.finditer(text.plain))

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        """Return the widths of the longest piece and of the whole text."""
        shortest = max((cell_len(piece[0].rstrip()) for piece in self._pieces), default=0)
        return Measurement(shortest, cell_len(self._text.plain)).with_maximum(options.max_width)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Put as many pieces on each line as there is room for."""
        breaks, width = [], 0
        for piece in self._pieces:
            if width + cell_len(piece[0].rstrip()) > options.max_width and width:
                breaks.append(piece.start())
                width = 0
            width += cell_len(piece[0])
        for line in self._text.divide(breaks):
            line.rstrip()
            line.overflow = "fold"
            yield line


class _Table(Table):
    """A table whose cells are broken after a blank or a slash."""

    def add_row(self, *cells: RenderableType | None, **options: Any) -> None:
        """Add a row, as `rich.table.Table.add_row` does."""
        super().add_row(
            *(
                _Cell(Text.from_markup(cell)) if isinstance(cell, str) and _PATH.search(cell) else cell
                for cell in cells
            ),
            **options,
        )


def new_table(title: str, columns: list[str]) -> Table:
    """Make an empty table; it has no header if all column names are empty."""
    table = _Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold", show_header=any(columns))
    table.min_width = min(cell_len(Text.from_markup(title).plain), _MAX_TITLE)  # a title is wrapped to its table
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def plain(text: str) -> str:
    """Return a text, which may be from a file, without characters that control a terminal."""
    return "".join(character if character.isprintable() else "?" for character in text)


def _shown(text: str) -> str:
    return escape("\n".join(map(plain, text.split("\n"))))


def print_all(tables: Iterable[Facts]) -> None:
    """Print what the interface says in tables."""
    console = TableConsole()
    for facts in tables:
        table = new_table(f"{_shown(facts.title)}{_VERDICTS[facts.passed]}", [_shown(name) for name in facts.head])
        for first, *rest in facts.rows:
            style = facts.styles.get(first)
            heading = _shown(first) if style is None else f"[{style}]{_shown(first)}[/]"
            table.add_row(heading, *map(_shown, rest))
        console.print(table)
        for sentence in facts.notes:
            console.print(_shown(sentence), highlight=False)
