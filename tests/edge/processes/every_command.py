"""All commands and their paths, as the commands say of themselves: so none is missed."""

from __future__ import annotations

from collections.abc import Iterator

import click

from sosmith.cli import cli
from sosmith.output_paths import OutputFile, OutputFolder

WRITTEN = {
    ("init", "file"),
    ("calibrate add", "store"),
    ("monitor", "mqtt_keep"),
    ("spectrum", "into"),
    ("verify", "export"),
}
"""Paths that are written, though their options are of the common kind."""

_ONLY_WRITTEN = WRITTEN - {("calibrate add", "store"), ("spectrum", "into")}


def commands(group: click.Group = cli, before: str = "") -> Iterator[tuple[str, click.Command]]:
    """Yield the commands with their names, such as ``calibrate add``."""
    context = click.Context(group)
    for part in group.list_commands(context):
        command = group.get_command(context, part)
        assert command is not None
        if isinstance(command, click.Group):
            yield from commands(command, f"{before}{part} ")
        else:
            yield before + part, command


def paths_read() -> Iterator[tuple[str, click.Command, click.Parameter]]:
    """Yield each path that a command reads, with the command."""
    for name, command in commands():
        for parameter in command.params:
            is_other = isinstance(parameter.type, OutputFile | OutputFolder) or (name, parameter.name) in _ONLY_WRITTEN
            if isinstance(parameter.type, click.Path) and not is_other:
                yield name, command, parameter


def paths_written() -> Iterator[tuple[str, str]]:
    """Yield each path that a command writes: the command's name and the first of the option's names."""
    for name, command in commands():
        for parameter in command.params:
            if isinstance(parameter.type, OutputFile | OutputFolder) or (name, parameter.name) in WRITTEN:
                yield name, parameter.opts[0]
