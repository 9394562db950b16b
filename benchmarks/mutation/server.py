"""Runs tests in forked processes: what they have in common, packages of other makers, is imported once.

A program of its own, started in a copy of the checkout: nothing of the house is imported before the fork, so every
run sees the files as they are. Reads requests and writes answers, one JSON object a line.

    request   tests      what pytest is to run, in this order, until the first failure
              without    the beginnings of tests that are not to be run
              trace      files whose executed lines are wanted, each with the tests that execute it; tests that
                         reach their limit are then left out instead of timed out
              limits     CPU seconds of a test by its identifier, after which it counts as timed out
              limit      the same for the import of the tests, and for all other tests
              wall       seconds of everything together
    answer    outcome    "passed", also by files in which all tests are slow, "failed", "timed out"
              test       the test that failed or timed out, empty if that was before the first one
              why        its message, shortened
              seconds    CPU seconds of each test that was not left out
              lines      lists of [file, line] by test; under "" those executed while tests were imported
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NoReturn, TextIO

import hypothesis
import pytest

MEMORY = 8 << 30
"""Bytes that a run may take: a wrong shift makes long numbers."""
_MESSAGE = 300
_PLUGIN = "_hypothesis_pytestplugin"
_KEPT = "tests.suite.kept_designs"
"""A plugin of the tests that is left out: a test is to execute what it looks at, whatever ran before it."""

Request = dict[str, Any]
Answer = dict[str, Any]


class Lines:
    """Which lines of some files a test executes; a line that has been seen is not traced any longer."""

    def __init__(self, files: list[str]) -> None:
        self._names = {os.path.realpath(name): name for name in files}
        self._wanted: dict[str, str | None] = {}
        self._left: dict[CodeType, set[int | None]] = {}
        self.seen: dict[str, list[tuple[str, int]]] = {}
        self.begin("")

    def begin(self, test: str) -> None:
        """Count from here on for this test."""
        self._now = self.seen.setdefault(test, [])
        self._left = {}

    def call(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        """Decide whether a function is traced, as `sys.settrace` wants it."""
        code = frame.f_code
        if code.co_filename not in self._wanted:
            self._wanted[code.co_filename] = self._names.get(os.path.realpath(code.co_filename))
        if self._wanted[code.co_filename] is None:
            return None
        left = self._left.setdefault(code, {line for _, _, line in code.co_lines()})
        return self._line if left else None

    def _line(self, frame: FrameType, event: str, _argument: Any) -> Any:
        code = frame.f_code
        left = self._left.setdefault(code, {line for _, _, line in code.co_lines()})
        if event == "line" and frame.f_lineno in left:
            left.discard(frame.f_lineno)
            name = self._wanted[code.co_filename]
            if name is not None:
                self._now.append((name, frame.f_lineno))
        return self._line if left else None


class Watch:
    """A plugin of pytest: limits the time of each test, and notes what happens as it happens."""

    def __init__(self, request: Request, notes: TextIO) -> None:
        self._request, self._notes = request, notes
        self._lines = Lines(request["trace"]) if request["trace"] else None
        self._began = time.process_time()
        if self._lines:
            sys.settrace(self._lines.call)
            signal.signal(signal.SIGPROF, _left_out)

    def note(self, kind: str, *values: Any) -> None:
        """Write down something that stays known even if the process is killed."""
        self._notes.write(json.dumps([kind, *values]) + "\n")
        self._notes.flush()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Start the clock of a test."""
        self.note("start", nodeid)
        if self._lines:
            self._lines.begin(nodeid)
            sys.settrace(self._lines.call)  # again: a test that was left out has ended the tracing as well
        self._began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, self._request["limits"].get(nodeid, self._request["limit"]))

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        """Note what a test has taken."""
        signal.setitimer(signal.ITIMER_PROF, 0)
        self.note("seconds", nodeid, time.process_time() - self._began)

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Note a failure, or a test that was left out."""
        if report.skipped:
            self.note("skipped", report.nodeid)
        if report.failed:
            self.note("failed", report.nodeid, str(report.longrepr)[-_MESSAGE:])

    def pytest_collectreport(self, report: Any) -> None:
        """Note that tests cannot even be imported."""
        if report.failed:
            self.note("failed", "", str(report.longrepr)[-_MESSAGE:])

    def close(self, status: int) -> None:
        """Note the end."""
        sys.settrace(None)
        if self._lines:
            for test, lines in self._lines.seen.items():
                self.note("lines", test, lines)
        self.note("end", status)


def _left_out(*_: Any) -> NoReturn:
    pytest.skip("too slow to be run for every mutant", allow_module_level=True)


def run_tests(request: Request, notes: TextIO) -> NoReturn:
    """Run the tests in this process, which ends here."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    if request["trace"]:
        sys.dont_write_bytecode = False  # pytest may keep what it compiles from the tests, which do not change
    else:
        signal.setitimer(signal.ITIMER_PROF, request["limit"])
    # The first counterexample will do, and none is kept for the next run.
    phases = [hypothesis.Phase.explicit, hypothesis.Phase.generate]
    hypothesis.settings.register_profile("mutation", phases=phases, database=None, deadline=None)
    hypothesis.settings.load_profile("mutation")
    watch = Watch(request, notes)
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    options = ["-x", "-q", "-m", "not slow", "-p", "no:cacheprovider", "-p", f"no:{_KEPT}", "-p", _PLUGIN]
    options += ["--hypothesis-seed=0"]
    if request["trace"]:  # a test that is left out in its middle closes nothing, and the next one is not to blame
        options += ["-W", "ignore::ResourceWarning", "-W", "ignore::pytest.PytestUnraisableExceptionWarning"]
    leave_out = [option for test in request["without"] for option in ("--deselect", test)]
    status = pytest.main([*options, "--basetemp", request["folder"], *leave_out, *request["tests"]], plugins=[watch])
    watch.close(int(status))
    os._exit(0)


def answer(request: Request) -> Answer:
    """Run the tests in a forked process and its session, of which nothing is left afterwards."""
    with tempfile.TemporaryDirectory(prefix="mutation-") as folder:
        notes = Path(folder) / "notes"
        request["folder"] = str(Path(folder) / "tests")
        child = os.fork()
        if not child:
            try:
                os.setsid()
                with notes.open("w", encoding="utf-8") as stream:
                    run_tests(request, stream)
            finally:
                os._exit(1)  # also after an exception: what follows is for the parent, the folder's end first of all
        late = False

        def leave(*_: Any) -> NoReturn:
            end(child)
            shutil.rmtree(folder, ignore_errors=True)
            os._exit(1)

        signal.signal(signal.SIGTERM, leave)
        handle = os.pidfd_open(child)
        try:
            over = select.select([handle, sys.stdin], [], [], request["wall"])[0]
            if over == [sys.stdin]:
                leave()  # whoever asked has gone
            late = not over
        finally:
            os.close(handle)
            end(child)
        _, status = os.waitpid(child, 0)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        return summary(notes, late or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGPROF))


def end(child: int) -> None:
    """Kill a run with all that it has started."""
    for kill in (os.killpg, os.kill):
        try:
            kill(child, signal.SIGKILL)
        except ProcessLookupError:
            continue


def summary(notes: Path, late: bool) -> Answer:
    """Make the answer from what a run has noted."""
    found: Answer = {"outcome": "failed", "test": "", "why": "", "seconds": {}, "lines": {}}
    skipped: list[str] = []
    for kind, *values in map(json.loads, notes.read_text(encoding="utf-8").splitlines()):
        if kind == "start":
            (found["test"],) = values
        elif kind == "failed":
            found["test"], found["why"] = values
            return found
        elif kind == "end" and values[0] in {pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED}:
            found["outcome"], found["test"] = "passed", ""
        elif kind in {"seconds", "lines"}:
            found[kind][values[0]] = values[1]
        elif kind == "skipped":
            skipped.append(values[0])
    for test in skipped:
        found["seconds"].pop(test, None)
        found["lines"].pop(test, None)
    if late:
        found["outcome"] = "timed out"
    return found


def main() -> None:
    """Import the packages named on the command line, then serve."""
    for name in sys.argv[1:]:
        importlib.import_module(name)
    sys.path[0] = ""  # as under `python -m pytest`: the copy, not this file's folder
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
