"""Writes docs/commands.md from the help of every command."""

from __future__ import annotations

from collections.abc import Iterator

import click
from click.testing import CliRunner

from sosmith.cli import cli

TITLE = """# Commands

Written by `python -m tests.documents.test_documents` from the commands themselves: what each one prints with
`--help`. In a clone of the repository, `./run` stands for `sosmith`.
"""

WIDTH = 100
"""Columns of the terminal that the help is set for."""


def page() -> str:
    """Return docs/commands.md."""
    entries = [
        f"\n{'###' if path else '##'} {' '.join(('sosmith', *path))}\n\n```text\n{help_of(path)}```\n"
        for path in paths(cli)
    ]
    return TITLE + "".join(entries)


def paths(command: click.Command, above: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Names that lead to `command` and to everything below it, in the order of its own list."""
    yield above
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from paths(below, (*above, name))


def help_of(path: tuple[str, ...]) -> str:
    """Return what a command prints with --help."""
    result = CliRunner().invoke(cli, [*path, "--help"], prog_name="sosmith", terminal_width=WIDTH)
    assert result.exit_code == 0
    return "".join(f"{line.rstrip()}\n" for line in result.stdout.strip().splitlines())
