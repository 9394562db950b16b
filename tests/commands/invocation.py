"""A subcommand of `sosmith` called in this process, as the tests of the commands do."""

from __future__ import annotations

from dataclasses import dataclass

from click.testing import CliRunner, Result

from sosmith.cli import cli
from sosmith.model.errors import SpecificationError


@dataclass(frozen=True)
class Invocation:
    """One subcommand, on a terminal of a width in characters."""

    command: str
    columns: int = 100

    def run(self, *arguments: str) -> Result:
        """Call it, whatever comes of it."""
        return CliRunner(env={"COLUMNS": str(self.columns)}).invoke(cli, [self.command, *arguments])

    def good(self, *arguments: str) -> Result:
        """Call it, which must succeed."""
        result = self.run(*arguments)
        assert (result.exit_code, result.exception) == (0, None)
        return result

    def refused(self, message: str, *arguments: str, kind: type[Exception] = SpecificationError) -> Result:
        """Call it, which must end in an error with just that message."""
        result = self.run(*arguments)
        assert isinstance(result.exception, kind)
        assert str(result.exception) == message
        return result
