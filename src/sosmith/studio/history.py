"""The texts of a session: the present one, those before it, and those that were undone."""

from __future__ import annotations

STEPS = 200
"""Most texts that are kept, before the present one and after it."""


class History:
    """A text and its changes, one step each, but for what is dragged: all of that is one.

    Parameters
    ----------
    text : str
        The text to begin with.

    Examples
    --------
    >>> history = History("a")
    >>> for text, moving in (("b", True), ("c", True), ("d", False)):
    ...     history.take(text, moving=moving)
    >>> history.undone(), history.redone(), history.redone()
    ('a', 'd', None)
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self._before: list[str] = []
        self._after: list[str] = []
        self._moving = False

    @property
    def steps(self) -> tuple[int, int]:
        """How many steps can be undone, and done again."""
        return len(self._before), len(self._after)

    def take(self, text: str, *, moving: bool) -> None:
        """Go on to another text; while something is `moving`, those on the way are not kept."""
        if text != self.text and not self._moving:
            self._before = [*self._before[1 - STEPS :], self.text]
            self._after.clear()
        self.text, self._moving = text, moving

    def undone(self) -> str | None:
        """Return to the text before; None if there is none."""
        return self._step(self._before, self._after)

    def redone(self) -> str | None:
        """Return to the text that was undone last; None if there is none."""
        return self._step(self._after, self._before)

    def _step(self, source: list[str], target: list[str]) -> str | None:
        self._moving = False
        if not source:
            return None
        target.append(self.text)
        self.text = source.pop()
        return self.text
