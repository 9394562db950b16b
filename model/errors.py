"""The errors a user can cause, and the exit status each one ends the program with.

Every message is one sentence a user can act on: it names the file, key or line, what was found
and what would be right. The command line is the only place that catches them.
"""


class SosmithError(Exception):
    """An expected failure; `exit_status` is what the command line returns for it."""

    exit_status = 1


class ShortfallError(SosmithError):
    """The result falls short: a mismatch, a bound exceeded, a specification that cannot be met."""

    exit_status = 1


class SpecificationError(SosmithError):
    """Bad usage, a bad specification or bad measurement data."""

    exit_status = 2


class ToolError(SosmithError):
    """A tool outside this package (simulator, compiler) is missing or failed."""

    exit_status = 3
