"""A place in the tokens of a C text, from which wanted ones are taken."""

from __future__ import annotations

import re
from collections.abc import Iterator

from sosmith.verify.c_model.tokens import Token, tokens_of
from sosmith.verify.graph import RejectedError


class Cursor:
    """Takes tokens of a text in their order.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.
    """

    def __init__(self, text: str, file: str) -> None:
        self._tokens = tokens_of(text, file)
        self._file = file
        self._place = 0

    @property
    def next(self) -> str:
        """The next token; empty at the end."""
        return self._tokens[self._place].text if self._place < len(self._tokens) else ""

    def peek(self, count: int) -> str:
        """Return the token `count` places behind the next one."""
        index = self._place + count
        return self._tokens[index].text if index < len(self._tokens) else ""

    def take(self, pattern: str = ".+") -> str:
        """Take one token that is of a pattern.

        Raises
        ------
        RejectedError
            If the next one is not.
        """
        token = self.next
        if not token or re.fullmatch(pattern, token, re.ASCII) is None:
            raise self.refused(f"{pattern}")
        self._place += 1
        return token

    def expect(self, text: str) -> None:
        """Take exactly the tokens of a text.

        Raises
        ------
        RejectedError
            If others come.
        """
        for token in tokens_of(text, "what is expected"):
            if self.next != token.text:
                raise self.refused(token.text)
            self._place += 1

    def following(self, word: str, pattern: str) -> Iterator[re.Match[str]]:
        """Return the tokens of a pattern that stand two places behind a word, from here to the end."""
        texts = [token.text for token in self._tokens[self._place :]]
        for first, third in zip(texts, texts[2:], strict=False):
            match = re.fullmatch(pattern, third, re.ASCII) if first == word else None
            if match is not None:
                yield match

    def accepts(self, mark: str) -> bool:
        """Take a token if it is the next one, and say whether it was."""
        accepted = self.next == mark
        self._place += accepted
        return accepted

    def refused(self, wanted: str) -> RejectedError:
        """Return the error that something else is wanted here."""
        token = self._tokens[min(self._place, len(self._tokens) - 1)] if self._tokens else Token("", 1)
        read = "its end" if not self.next else token.text[:60]
        return RejectedError(f"line {token.line} of {self._file} must go on with {wanted}, not with {read!a}")

    def end(self) -> None:
        """Check that nothing is left.

        Raises
        ------
        RejectedError
            If there is.
        """
        if self.next:
            raise self.refused("nothing")
