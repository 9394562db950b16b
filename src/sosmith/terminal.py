"""What all commands share: JSON on stdout, progress and messages on stderr."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.live import Live
    from rich.progress import Progress, TaskID

_quiet = False

NARROWEST = 20
"""Columns of the narrowest terminal that tables are laid out for; narrower ones wrap the lines."""

JSON_OPTION = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables.")


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
    with suppress(OSError):  # a stream without a descriptor keeps nothing back
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextmanager
def undisturbed() -> Iterator[None]:
    """Let signals wait until the context ends: what is written to a terminal is not cut in two, or written twice.

    Python runs handlers between any two of its instructions, also between what was written and the note that it was.
    """
    if threading.current_thread() is not threading.main_thread():  # handlers run in the main thread only
        yield
        return
    came: list[int] = []

    def remember(number: int, frame: FrameType | None) -> None:
        came.append(number)

    before = {number: signal.getsignal(number) for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT)}
    held = {number: handler for number, handler in before.items() if callable(handler)}
    try:
        for number in held:
            signal.signal(number, remember)
        yield
    finally:
        for number, handler in held.items():
            signal.signal(number, handler)
        for stopped in came:
            signal.raise_signal(stopped)


@contextmanager
def live(display: Progress | Live) -> Iterator[None]:
    """Show a display of rich inside the context, and leave the terminal whole whatever ends it."""
    try:
        with undisturbed():
            display.start()
        yield
    finally:
        with undisturbed():
            display.stop()


class Step:
    """Progress on stderr: each call names the current step and can say how much of it is done."""

    def __call__(self, name: str, done: int = 0, total: int = 0) -> None:
        """Show the step; this one shows nothing."""


class _LogStep(Step):
    """One line a step, when it begins: what a log file or a CI page is to show."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._name = ""

    def __call__(self, name: str, done: int = 0, total: int = 0) -> None:
        if name != self._name:
            self._name = name
            minutes, seconds = divmod(int(time.monotonic() - self._began), 60)
            click.echo(f"[{minutes}:{seconds:02}] {printable(name)}", err=True)


class _BarStep(Step):
    """One line on a terminal, with the bar of the current step; nothing is left of it in the end."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._task: TaskID | None = None
        self._name = ""

    def __call__(self, name: str, done: int = 0, total: int = 0) -> None:
        with undisturbed():
            if name != self._name:
                self._name = name
                if self._task is not None:
                    self._progress.remove_task(self._task)
                self._task = self._progress.add_task(name, total=None)
            if total and self._task is not None:
                self._progress.update(self._task, completed=done, total=total)


def be_quiet(quiet: bool) -> None:
    """Show no progress from now on, or show it again."""
    global _quiet  # noqa: PLW0603
    _quiet = quiet


@contextmanager
def show_progress(*, remaining: bool = False) -> Iterator[Step]:
    """Show on stderr the progress of the steps inside the context: on a terminal one line, which then disappears.

    Elsewhere, one line a step. With `remaining`, the line on a terminal tells the time that is left as well.
    """
    if _quiet:
        yield Step()
        return
    if not sys.stderr.isatty():
        yield _LogStep()
        return
    # Imported only when something is shown: help and refusals start faster without rich.
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        ProgressColumn,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns: list[ProgressColumn] = [
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:>3.0f} %"),
        *([TimeRemainingColumn(), TextColumn("left")] if remaining else []),
        TimeElapsedColumn(),
    ]
    progress = Progress(*columns, console=Console(stderr=True, width=width()), transient=True)
    with live(progress):
        yield _BarStep(progress)


def width() -> int | None:
    """Return the width of a terminal that is too narrow to show anything as if it were wider; None for any other."""
    from rich.console import Console

    return NARROWEST if Console(stderr=True).width < NARROWEST else None


def printable(text: str) -> str:
    """Escape what a terminal would not show, or would obey: the text may come from a file or a device."""
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def note(text: str) -> None:
    """Print a message on stderr."""
    with undisturbed():
        click.echo(f"sosmith: {printable(text)}", err=True)


def print_json(tree: Any) -> None:
    """Print JSON on stdout."""
    click.echo(json.dumps(tree, indent=2, ensure_ascii=False, allow_nan=False))
