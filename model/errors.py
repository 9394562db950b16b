"""The errors a user can cause, and the exit status each one ends the program with.

Every message is one sentence that the user can act on: it names the file, key or line, what was expected
and what was found. Only the command line catches these errors.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class SosmithError(Exception):
    """An expected failure; `exit_status` is what the command line returns for it."""

    exit_status = 1


class ShortfallError(SosmithError):
    """The result falls short: a mismatch, a bound exceeded, a specification that cannot be met."""

    exit_status = 1


@contextmanager
def falling_short(path: Path) -> Iterator[None]:
    """Put the name of the file at `path` before what falls short of it as a whole, and so names no key."""
    try:
        yield
    except ShortfallError as error:
        raise ShortfallError(f"{path}: {error}") from None


class SpecificationError(SosmithError):
    """A usage error, an invalid specification or invalid measurement data."""

    exit_status = 2


class ToolError(SosmithError):
    """Something outside is missing or failed: a simulator, a compiler, the disk."""

    exit_status = 3


class LinkError(ToolError):
    """The link to a board, or the board at its other end, does not do what it must."""


class LinkLostError(LinkError):
    """The serial port is gone, or the board no longer answers."""


class RefusedError(LinkError):
    """The board answered that it did not carry out a request."""
