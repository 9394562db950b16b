"""Commands in any environment: closed streams, tiny terminals, other users, full disks, places that take nothing."""

from __future__ import annotations

import io
import os
import pty
import random
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import chdir
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from sosmith import cli
from sosmith.model.text_files import to_json
from tests.commands.command_line import FILTER
from tests.commands.invocation import Invocation
from tests.edge.processes.forks import Ended, forked
from tests.gen.report.reports import report
from tests.instrument.calibration.measuring import readings, write_csv

COMMANDS = {
    "init": ("out.toml", "init out.toml"),
    "list": (None, "init --list"),
    "design": (None, "design plain.toml"),
    "design --json": (None, "design plain.toml --json"),
    "generate": ("out", "generate plain.toml -o out"),
    "verify": (None, "verify plain.certificate.json"),
    "combinations": (None, "combinations"),
    "emulate": ("out.csv", "emulate plain.toml noise -o out.csv"),
    "compare": ("out.html", "compare report.json report.json -o out.html"),
    "calibrate": ("out.db", "calibrate add a.csv --store out.db"),
    "stream": ("out.csv", "stream none trace.csv -o out.csv"),
    "help": (None, "monitor --help"),
}
"""What a command writes, if anything, and its line."""

CHANGING = {"out.db"}
"""Outputs whose bytes tell when they were made."""

STATUSES = {0, 1, 2, 3, 4}
SECONDS, MEMORY = 120.0, 600.0
"""Most of a command, on however busy a machine, and most of its memory in MB."""

NOBODY = 65_534

CERTIFICATE = "plain.certificate.json"

LINKED = "linked.txt"
"""A file that an output may be a link to."""


class Place:
    """A child that is to run a command: it changes what is around itself, in its folder.

    Attributes
    ----------
    said : int
        Where its stdout and stderr go unless they are changed.
    folder : Path
        Where it runs.
    output : str or None
        What the command writes.
    """

    def __init__(self, folder: Path, output: str | None, rng: random.Random) -> None:
        self.folder, self.output, self._rng = folder, output, rng

    # Those that nothing may depend on

    def columns(self) -> None:
        os.environ["COLUMNS"] = self._rng.choice(("-1", "0", "1", "2", "3", "4", "5", "x", "", "999999999"))

    def term(self) -> None:
        os.environ["TERM"] = self._rng.choice(("", "dumb", "xterm-256color", "none-such", "\x1b"))
        os.environ |= self._rng.choice(({}, {"NO_COLOR": "1"}, {"FORCE_COLOR": "1"}, {"PAGER": "/none"}))

    def encoding(self) -> None:
        name = self._rng.choice(("ascii", "latin-1", "utf-8", "cp037"))
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), encoding=name, errors="strict")
        sys.stderr = sys.__stderr__ = io.TextIOWrapper(io.FileIO(2, "w", closefd=False), encoding=name)
        os.environ["LC_ALL"] = self._rng.choice(("C", "POSIX", "xx_YY.none", "tr_TR.UTF-8"))

    def umask(self) -> None:
        os.umask(self._rng.choice((0, 0o27, 0o77, 0o777)))

    def stdin(self) -> None:
        if self._rng.random() < 0.5:
            os.close(0)
            sys.stdin = None  # type: ignore[assignment]
        else:
            os.dup2(os.open(self._rng.choice((".", os.devnull, "/dev/zero")), os.O_RDONLY), 0)

    def stderr(self) -> None:
        kind = self._rng.randrange(3)
        if kind == 0:
            os.close(2)
            sys.stderr = sys.__stderr__ = None  # type: ignore[assignment,misc]
            return
        os.dup2(os.open("/dev/full", os.O_WRONLY) if kind == 1 else _without_reader(), 2)
        sys.stderr = sys.__stderr__ = io.TextIOWrapper(io.FileIO(2, "w", closefd=False), line_buffering=True)

    def clock(self) -> None:
        """Set the clock far back or ahead."""
        now = self._rng.choice((0.0, -1e9, 1e6, 4.2e9, 2.5e11))
        time.time, time.time_ns = lambda: now, lambda: int(now * 1e9)

    def signals(self) -> None:
        for number in (signal.SIGPIPE, signal.SIGHUP, signal.SIGXFSZ, signal.SIGINT):
            signal.signal(number, self._rng.choice((signal.SIG_IGN, signal.SIG_DFL)))
        if signal.getsignal(signal.SIGPIPE) == signal.SIG_DFL:
            signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # as Python begins

    def home(self) -> None:
        os.environ["HOME"] = self._rng.choice(("", "/proc/none", "/proc", "plain.toml", "\udcff"))
        os.environ["XDG_CACHE_HOME"] = self._rng.choice(("", "relative", str(self.folder / "plain.toml"), "/proc"))
        os.environ["XDG_CONFIG_HOME"] = os.environ["HOME"]

    def tmpdir(self) -> None:
        os.environ["TMPDIR"] = self._rng.choice(("/none", "/dev/full", str(self.folder / "plain.toml"), ""))
        tempfile.tempdir = None

    # Those that may keep a command from its work

    def stdout(self) -> None:
        kind = self._rng.randrange(4)
        if kind == 0:
            os.close(1)
            sys.stdout = sys.__stdout__ = None  # type: ignore[assignment,misc]
            return
        ends = (lambda: os.open("/dev/full", os.O_WRONLY), _without_reader, lambda: pty.openpty()[1])
        os.dup2(ends[kind - 1](), 1)
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(io.FileIO(1, "w", closefd=False)), line_buffering=kind == 3)

    def disk(self) -> None:
        """Let no file have more than so many bytes, as on a disk that becomes full."""
        most = self._rng.choice((0, 1, 1000, 20_000))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    def files(self) -> None:
        most = self._rng.choice((3, 4, 6, 12, 20))
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))

    def folder_is_gone(self) -> None:
        gone = self.folder / "gone"
        gone.mkdir()
        os.chdir(gone)
        gone.rmdir()

    def folder_takes_nothing(self) -> None:
        """Become another user, for whom the folder is closed, or a link to a place that takes nothing."""
        if os.geteuid() == 0:
            self._become_nobody()
        else:
            self.folder.chmod(0o555)

    def another_user(self) -> None:
        """Become another user, whom the folder belongs to."""
        if os.geteuid() == 0:
            for place in (self.folder, *self.folder.rglob("*")):
                os.chown(place, NOBODY, NOBODY)
            self._become_nobody()

    def output_is_taken(self) -> None:
        """Put something else at the place of the output."""
        if self.output is None:
            return
        place = self.folder / self.output
        kinds: tuple[Callable[[], object], ...] = (
            lambda: place.symlink_to("/dev/full"),
            lambda: place.symlink_to(place.name),
            lambda: place.symlink_to("/proc/none"),
            lambda: place.symlink_to(LINKED),
            lambda: os.mkfifo(place),
            lambda: place.mkdir() if "." in place.name else place.write_text("a file"),
            lambda: place.hardlink_to(self.folder / LINKED),
        )
        self._rng.choice(kinds)()

    def _become_nobody(self) -> None:
        os.setgroups([])
        os.setgid(NOBODY)
        os.setuid(NOBODY)


HARMLESS = ("columns", "term", "encoding", "umask", "stdin", "stderr", "clock", "signals", "home", "tmpdir")
"""Changes that leave every result and every status as they are."""

HARMFUL = ("stdout", "disk", "files", "folder_is_gone", "folder_takes_nothing", "another_user", "output_is_taken")
"""Changes that a command may fail from: it then says so, and what it leaves is whole."""


@dataclass(frozen=True)
class Environment:
    """What was around a command.

    Attributes
    ----------
    command : str
        Its name in `COMMANDS`.
    changes : tuple of str
        Names of the changes.
    status : int
        How it ended.
    findings : tuple of str
        What must not be.
    """

    command: str
    changes: tuple[str, ...]
    status: int
    findings: tuple[str, ...]


def tried(seed: int, names: Sequence[str] = tuple(COMMANDS)) -> Environment:
    """Run one of these commands in an environment that the seed draws; every third has only harmless changes."""
    rng = random.Random(seed)
    name = names[seed // 3 % len(names)]
    changes = rng.sample(HARMLESS, rng.randint(1, 4))
    if seed % 3:
        changes = [rng.choice(HARMFUL), *changes[:2]]
        changes = [one for one in changes if not (one == "encoding" and "stdout" in changes)]
    output, line = COMMANDS[name]
    wanted = good(name)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        prepare(folder, line)
        before = contents(folder)
        place = Place(folder, output, rng)

        def act() -> None:
            os.chdir(folder)
            for change in sorted(changes, key=_LATE.get):  # type: ignore[arg-type]
                getattr(place, change)()
            run(line)

        ended = forked(act)
        findings = list(_findings(ended, before, contents(folder), wanted, output))
        if set(changes) <= set(HARMLESS) and ended.status != wanted.status:
            findings.append(f"status {ended.status}, not {wanted.status}: {ended.said[-300:]}")
    found = tuple(f"{line} with {', '.join(changes)}, seed {seed}: {one}" for one in findings)
    return Environment(name, tuple(changes), ended.status, found)


_LATE = dict.fromkeys(HARMLESS, 0) | dict.fromkeys(HARMFUL, 1) | {"encoding": -1, "files": 2}
"""Order of the changes: what needs open streams comes first, what forbids the others last."""


@dataclass(frozen=True)
class Good:
    """What a command does where nothing is wrong: its status, and the files that it leaves."""

    status: int
    files: dict[str, bytes]


@cache
def good(name: str) -> Good:
    """Run a command in this process, which then has loaded all that it takes, and in a child."""
    output, line = COMMANDS[name]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        prepare(folder, line)
        with chdir(folder):
            Invocation(line.split()[0]).run(*line.split()[1:])
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        prepare(folder, line)

        def act() -> None:
            os.chdir(folder)
            run(line)

        ended = forked(act)
        return Good(ended.status, {n: data for n, data in contents(folder).items() if _of(n, output)})


def run(line: str) -> None:
    """Be the command."""
    sys.argv = ["sosmith", *line.split()]
    cli.main()


def prepare(folder: Path, line: str) -> None:
    """Put the inputs of a command into a folder that others may read."""
    folder.chmod(0o755)
    for path, text in _inputs().items():
        (folder / path).write_text(text, encoding="utf-8")
    if CERTIFICATE in line:
        (folder / CERTIFICATE).write_text(_certificate(), encoding="utf-8")
    write_csv(folder / "a.csv", readings(40))


@cache
def _inputs() -> dict[str, str]:
    return {
        "plain.toml": FILTER,
        "report.json": to_json(report()),
        "trace.csv": "x_code\n1\n",
        LINKED: "what was there before",
    }


@cache
def _certificate() -> str:
    with tempfile.TemporaryDirectory() as scratch:
        (Path(scratch) / "plain.toml").write_text(FILTER, encoding="utf-8")
        Invocation("generate").good(f"{scratch}/plain.toml", "-o", scratch)
        return (Path(scratch) / CERTIFICATE).read_text(encoding="utf-8")


def contents(folder: Path) -> dict[str, bytes]:
    """Return the regular files of a folder, by their names from there."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not path.is_symlink()
    }


def _findings(
    ended: Ended, before: dict[str, bytes], after: dict[str, bytes], wanted: Good, output: str | None
) -> list[str]:
    found = []
    if ended.status not in STATUSES:
        found.append(f"status {ended.status}: {ended.said[-300:]}")
    if "Traceback" in ended.said:
        found.append(f"a traceback: {ended.said[-500:]}")
    if ended.seconds > SECONDS or ended.peak > MEMORY:
        found.append(f"{ended.seconds:.0f} s and {ended.peak:.0f} MB")
    for name, data in after.items():
        if name not in before and not _of(name, output):
            found.append(f"{name} is left")
        elif name == LINKED and data in wanted.files.values():
            pass  # by a link, it is the output
        elif name == output and data == before[LINKED]:
            pass  # the link that was put there
        elif name not in CHANGING and data != before.get(name) and data != wanted.files.get(name):
            found.append(f"{name} is not whole")
    found += [f"{name} is gone" for name in before if name not in after]
    return found


def _of(name: str, output: str | None) -> bool:
    return output is not None and (name == output or name.startswith(f"{output}/"))


def _without_reader() -> int:
    """Return the end of a pipe that nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    return writer
