"""What all commands share: JSON on stdout, progress and messages on stderr."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.progress import Progress

JSON_OPTION = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables.")


def output_option(text: str) -> Callable[[Any], Any]:
    """Return the option ``-o`` with the help `text`."""
    return click.option("-o", "--output", type=click.Path(path_type=Path), help=text)


@contextmanager
def reader_may_leave() -> Iterator[None]:
    """Do not count it as an error when the reader of our output, such as ``head``, exits early."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        silence_stdout()


def silence_stdout() -> None:
    """Discard the output that is still buffered: flushing it at exit would fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class Step:
    """Progress display on stderr; each call names the current step and can say how much of it is done."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._task = progress.add_task("", total=None)
        self._name = ""

    def __call__(self, name: str, done: int = 0, total: int = 0) -> None:
        if name != self._name:
            self._finish()
            self._name = name
            self._task = self._progress.add_task(name, total=None)
        if total:
            self._progress.update(self._task, completed=done, total=total)

    def _finish(self) -> None:
        if self._name:
            self._progress.update(self._task, total=1, completed=1)
        else:
            self._progress.remove_task(self._task)

    def close(self) -> None:
        """Mark the last step as done."""
        self._finish()


@contextmanager
def show_progress() -> Iterator[Step]:
    """Show on stderr the progress of the steps inside the context."""
    # Imported only when something is shown: help and refusals start faster without rich.
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(finished_text="[green]✓[/]"),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        step = Step(progress)
        yield step
        step.close()


def note(text: str) -> None:
    """Print a message on stderr, with escapes for what a terminal would not show: the text may come from a file."""
    shown = "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)
    click.echo(f"sosmith: {shown}", err=True)


def print_json(tree: Any) -> None:
    """Print JSON on stdout."""
    click.echo(json.dumps(tree, indent=2, ensure_ascii=False, allow_nan=False))
