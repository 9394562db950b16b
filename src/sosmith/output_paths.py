"""Options that name what a command writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

STDOUT = Path("-")


class OutputFile(click.Path):
    """A file that the command writes.

    Parameters
    ----------
    stdout : bool
        Whether `-` is taken, which means stdout.
    in_place : bool
        Whether it may be a file that the command reads.
    """

    def __init__(self, *, stdout: bool = False, in_place: bool = False) -> None:
        super().__init__(path_type=Path)
        self.stdout, self.in_place = stdout, in_place


class OutputFolder(click.Path):
    """A folder that the command writes into."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)


def output_option(text: str, *, stdout: bool = False, in_place: bool = False) -> Callable[[Any], Any]:
    """Return the option ``-o`` for a file, with the help `text`; without it, the function gets None.

    With `stdout`, that is so for ``-`` as well: the command then writes to stdout.
    """

    def taken(_context: click.Context, _option: click.Parameter, path: Path | None) -> Path | None:
        return None if stdout and path == STDOUT else path

    kind = OutputFile(stdout=stdout, in_place=in_place)
    return click.option("-o", "--output", type=kind, callback=taken, help=text)


def folder_option(text: str) -> Callable[[Any], Any]:
    """Return the option ``-o`` for a folder, with the help `text`."""
    return click.option("-o", "--output", type=OutputFolder(), help=text)


def plot_option(text: str) -> Callable[[Any], Any]:
    """Return the option ``--plot``, with the help `text`."""
    return click.option("--plot", type=OutputFile(), help=text)
