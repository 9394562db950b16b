"""The tokens of a C text, read so strictly that no compiler can read others.

Comments are ``/* */`` only. Trigraphs, digraphs, line splices, strings, floating-point numbers and hexadecimal
ones beyond a byte do not occur, and lines of the preprocessor are tokens as a whole.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from sosmith.verify.graph import require

_TOKEN = re.compile(
    r"(?P<space>[ \n]+)"
    r"|(?P<comment>/\*.*?\*/)"
    r"|(?P<directive>(?<=\n)#[^\n]*|\A#[^\n]*)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<number>0x[0-9a-f]{2}|0|[1-9][0-9]*)"
    r'|(?P<mark>"C"|->|\+\+|\+=|-=|\|=|&&|\|\||==|!=|<=|>=|<<|>>|[-+*/%&|~!<>=?:;,.(){}\[\]])',
    re.ASCII | re.DOTALL,
)
_ALIKE = re.compile(r"\?\?|<:|:>|<%|%>|%:|//")
"""What means other characters to a compiler, or a comment."""

_IN_COMMENT = re.compile(r"\?\?|\\[ \t]*$|/\*", re.MULTILINE)
"""What might end a comment elsewhere, or does not where comments may be nested."""

_AFTER_NUMBER = re.compile(r"[\w.]")


class Token(NamedTuple):
    """A token and its line."""

    text: str
    line: int


def tokens_of(text: str, file: str) -> list[Token]:
    """Return the tokens of a text without comments.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.

    Raises
    ------
    RejectedError
        If it has anything else.
    """
    tokens: list[Token] = []
    place, line = 0, 1
    while place < len(text):
        match, where = _TOKEN.match(text, place), f"line {line} of {file}"
        require(match is not None, f"{where} must be of the C that is written for a model")
        assert match is not None
        word, kind = match[0], match.lastgroup
        if kind == "directive":
            tokens.append(Token(_directive(word, where), line))
        elif kind == "comment":
            require(_is_plain(word), f"{where} must have a comment of plain letters")
        elif kind != "space":
            after = None if kind != "number" else _AFTER_NUMBER.match(text, match.end())
            require(after is None, f"{where} must have numbers apart from names")
            require(_ALIKE.match(text, place) is None, f"{where} must not have what means something else")
            tokens.append(Token(word, line))
        place, line = match.end(), line + word.count("\n")
    return tokens


def _is_plain(comment: str) -> bool:
    printable = all(each.isprintable() for each in comment if each != "\n")
    return printable and _IN_COMMENT.search(comment, 2) is None


def _directive(word: str, where: str) -> str:
    """Return a line of the preprocessor without its comment, and with single blanks."""
    bare, mark, comment = word.partition("/*")
    ends = not mark or comment.find("*/") == len(comment) - 2
    require(ends and _is_plain(mark + comment), f"{where} must have a comment of plain letters that ends there")
    plain = bare.isprintable() and bare.isascii() and "\\" not in bare and _ALIKE.search(bare) is None
    require(plain, f"{where} must not have what means something else")
    return " ".join(bare.split())
