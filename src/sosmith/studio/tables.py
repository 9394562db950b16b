"""The tables of a TOML text as they are written, so that they can change places with their comments."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"""'  # in strings, nothing is what it looks like
    r"|'''.*?'''"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|[^\S\n]+"
    r"|.",
    re.DOTALL,
)
_HEADER = re.compile(r"\s*(\[\[?)([^\]\n]*)(\]\]?)")
_QUOTES = "\"'"
_COMMENT = re.compile(r"\s*#")


@dataclass(frozen=True)
class Piece:
    """A table as it is written.

    Attributes
    ----------
    header : str
        Such as ``[filter]`` or ``[[stage]]``; empty for what stands before the first table.
    text : str
        All of it, with the comment directly above, up to its last line that is not blank.
    blank : str
        The blank lines behind it.
    """

    header: str
    text: str
    blank: str


def cut(text: str) -> list[Piece]:
    r"""Cut a valid TOML text into its tables; put together, they are the text.

    Examples
    --------
    >>> for piece in cut("a = [\n[1],\n]\n\n# as asked\n[filter]\norder = 1\n"):
    ...     print(piece)
    Piece(header='', text='a = [\n[1],\n]\n', blank='\n')
    Piece(header='[filter]', text='# as asked\n[filter]\norder = 1\n', blank='')
    """
    starts = [0]
    depth, begins, header = 0, True, False  # of brackets; whether a line has begun with blanks alone; within a header
    for token in _TOKEN.finditer(text):
        mark = token.group()
        if begins and not depth and mark == "[":
            header = True
            starts.append(_above(text, text.rfind("\n", 0, token.start()) + 1))
        if not header:
            depth += (mark in "[{") - (mark in "]}")
        if mark == "\n":
            begins, header = True, False
        elif not mark.isspace():
            begins = False
    pieces = (text[start:end] for start, end in zip(starts, [*starts[1:], len(text)], strict=True))
    return [_piece(each) for each in pieces if each]


def _above(text: str, start: int) -> int:
    """Return where the comment directly above a line begins, or the line itself."""
    while start:
        before = text.rfind("\n", 0, start - 1) + 1
        if not _COMMENT.match(text[before:start]):
            break
        start = before
    return start


def _piece(text: str) -> Piece:
    body = text.rstrip("\n \t")
    end = text.find("\n", len(body)) + 1 or len(text)
    lines = (line for line in text.splitlines() if not _COMMENT.match(line) and line.strip())
    found = _HEADER.match(next(lines, ""))
    header = "" if found is None else f"{found[1]}{found[2].strip().strip(_QUOTES)}{found[3]}"
    return Piece(header, text[:end], text[end:])


def joined(pieces: Sequence[Piece], texts: Sequence[str], places: Collection[str], before: Collection[str]) -> str:
    """Return the text of tables, of which those with some headers are others.

    Parameters
    ----------
    pieces : sequence of Piece
    texts : sequence of str
        The others: they take the places in order, and where there are more of them, stand behind the last place.
    places : collection of str
        The headers.
    before : collection of str
        Headers before which they stand if there is no such place.
    """
    slots = [k for k, piece in enumerate(pieces) if piece.header in places]
    first = next((k for k, piece in enumerate(pieces) if piece.header in before), len(pieces))
    behind = slots[-1] if slots else first - 1
    made: list[Piece] = []
    for k, piece in enumerate(pieces):
        if k not in slots:
            made.append(piece)
        elif slots.index(k) < len(texts):
            made.append(replace(piece, text=_ended(texts[slots.index(k)])))
        if k == behind:
            made += [Piece("", _ended(text), "\n") for text in texts[len(slots) :]]
    if behind < 0:
        made = [*(Piece("", _ended(text), "\n") for text in texts), *made]
    apart = [replace(each, blank=each.blank or "\n" * (len(texts) > len(slots))) for each in made]
    return "".join(_ended(each.text) + each.blank for each in apart).rstrip("\n") + "\n"


def _ended(text: str) -> str:
    return f"{text.rstrip()}\n"


def written(table: Mapping[str, Any], header: str) -> str:
    """Return a table as text, below its header."""
    import tomlkit

    lines = (f"{key} = {tomlkit.item(value).as_string()}\n" for key, value in table.items())
    return f"{header}\n{''.join(lines)}"
