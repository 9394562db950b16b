"""Where a command may read and write: what is refused before anything is done."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

from sosmith.interface.files import check_file, check_input
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import STDOUT, OutputFile, OutputFolder


def check_paths(context: click.Context) -> None:
    """Refuse inputs that may never end, and outputs that could not be written or would replace what is read or written.

    Raises
    ------
    SpecificationError
        If an input is a device, a pipe or a socket; if an output is a folder or one of these, ``-`` where that does not
        mean stdout, a file that is also an input, or the same as another output.
    """
    read = [path for kind, path in _paths(context) if not isinstance(kind, OutputFile | OutputFolder)]
    for path in read:
        check_input(path)
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
