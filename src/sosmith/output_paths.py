"""Where a command may write: options that name outputs, and what is refused before anything is done."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click

from sosmith.interface.files import check_file
from sosmith.model.errors import SpecificationError

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


def check_outputs(context: click.Context) -> None:
    """Refuse outputs of a command that could not be written or would replace what the command reads or writes.

    Raises
    ------
    SpecificationError
        If an output is a folder, a device or a pipe, ``-`` where that does not mean stdout, a file that is also an
        input, or the same as another output.
    """
    read = [path for kind, path in _paths(context) if not isinstance(kind, OutputFile | OutputFolder)]
    written: list[Path] = []
    for kind, path in _paths(context):
        if not isinstance(kind, OutputFile):
            continue
        if path == STDOUT:
            raise SpecificationError("the output must be the name of a file here, not - for stdout")
        check_file(path)
        if not kind.in_place and any(_same(path, one) for one in read):
            raise SpecificationError(f"{path}: the output file must be another than what is read, not the same")
        if any(_same(path, one) for one in written):
            raise SpecificationError(f"{path}: each output must be a file of its own, not that of another output")
        written.append(path)


def _paths(context: click.Context) -> Iterator[tuple[click.Path, Path]]:
    """Yield all paths among the values of a command's parameters, each with its type."""
    for parameter in context.command.params:
        value = context.params.get(parameter.name or "")
        if isinstance(parameter.type, click.Path):
            for path in value if isinstance(value, tuple) else (value,):
                if isinstance(path, Path):
                    yield parameter.type, path


def _same(one: Path, other: Path) -> bool:
    """Whether two paths name one file, by whatever links."""
    try:
        return one.samefile(other)
    except OSError:  # one of them is not there yet
        return one.resolve() == other.resolve()
