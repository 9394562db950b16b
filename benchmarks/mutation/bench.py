"""A copy of the checkout in which mutants are tried, one after the other, by a server of its own."""

from __future__ import annotations

import compileall
import json
import os
import py_compile
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PACKAGES = (
    "amaranth.back.rtlil",
    "amaranth.lib.memory",
    "amaranth.lib.stream",
    "amaranth.sim",
    "click",
    "flint",
    "jinja2",
    "matplotlib.backends.backend_svg",
    "matplotlib.figure",
    "pydantic",
    "rich.progress",
    "scipy.signal",
)
"""What the tests import from other makers, imported once before all runs."""

ALLOWANCE = 10.0
"""CPU seconds that every test may take more than `SLOWER` times its own."""
SLOWER = 5.0
SLOW = 16.0
"""CPU seconds, lines being noted, beyond which a test is not run for mutants."""
WALL = 900.0
"""Seconds after which a run is given up whatever it does: it may sleep, and then takes no CPU time."""


@dataclass(frozen=True)
class Coverage:
    """The tests of a room on the code as it is.

    Attributes
    ----------
    seconds : dict of str to float
        CPU time of each test.
    tests : dict of (str, int) to set of str
        Tests that execute a line of a file; ``""`` among them if the import of the tests does.
    """

    seconds: dict[str, float]
    tests: dict[tuple[str, int], set[str]]

    def limits(self, tests: Sequence[str]) -> dict[str, float]:
        """CPU seconds after which each test counts as timed out.

        The first test to need a design makes it, whichever that is: the time of the longest one is allowed for.
        """
        longest = max(self.seconds.values(), default=0.0)
        return {test: ALLOWANCE + longest + SLOWER * self.seconds[test] for test in tests}

    def of_file(self, path: str) -> set[str]:
        """Return the tests that execute any line of a file."""
        return {test for (name, _), tests in self.tests.items() if name == path for test in tests} - {""}

    def of_lines(self, path: str, lines: Sequence[int]) -> set[str]:
        """Return the tests that execute any of some lines; all of the file for lines executed at import."""
        found: set[str] = set().union(*(self.tests.get((path, line), set()) for line in lines))
        return self.of_file(path) if "" in found else found


def merged(parts: Iterable[Coverage]) -> Coverage:
    """Put the coverages of several files of tests together."""
    whole = Coverage({}, {})
    for part in parts:
        whole.seconds.update(part.seconds)
        for place, tests in part.tests.items():
            whole.tests.setdefault(place, set()).update(tests)
    return whole


class Bench:
    """A copy of a checkout and its server.

    Parameters
    ----------
    root : Path
        The checkout.
    folder : Path
        Where the copy is made, in a folder of its own that goes when the bench is closed.
    packages : sequence of str
        What is imported before all runs.
    """

    def __init__(self, root: Path, folder: Path, packages: Sequence[str] = PACKAGES) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = Path(tempfile.mkdtemp(prefix="copy-", dir=folder))
        self._copy = self._folder / "checkout"
        _copied(root, self._copy)
        # A file that has changed is compiled anew whatever its time says, and what is compiled then is not kept.
        mode = py_compile.PycInvalidationMode.CHECKED_HASH
        compileall.compile_dir(self._copy, quiet=1, invalidation_mode=mode)
        paths = [str(self._copy / "src"), str(self._copy), *filter(None, [os.environ.get("PYTHONPATH")])]
        one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        server = Path(__file__).with_name("server.py")
        self._server = subprocess.Popen(
            [sys.executable, str(server), *packages],
            cwd=self._copy,
            env=os.environ | one | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONDONTWRITEBYTECODE": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,  # an interrupt from the keyboard is for the command, which ends the server
        )

    def close(self) -> None:
        """End the server and what it runs, and remove the copy."""
        self._server.send_signal(signal.SIGTERM)
        self._server.communicate()
        shutil.rmtree(self._folder, ignore_errors=True)

    def coverage(self, test: str, without: Sequence[str], files: Sequence[str]) -> Coverage:
        """Run tests on the code as it is; note their times and which lines of `files` they execute.

        Tests that begin like one of `without` are left out, and those that take longer than `SLOW`.

        Raises
        ------
        RuntimeError
            If a test fails: every mutant would count as killed.
        """
        found = self._ask([test], {}, limit=SLOW, trace=files, without=without)
        if found["outcome"] != "passed":
            raise RuntimeError(f"the tests must pass before anything is mutated, and {found['test']} does not")
        lines: dict[tuple[str, int], set[str]] = {}
        for name, executed in found["lines"].items():
            for path, line in executed:
                lines.setdefault((path, line), set()).add(name)
        return Coverage(found["seconds"], lines)

    def try_mutant(self, path: str, text: str, tests: Sequence[str], limits: Mapping[str, float]) -> tuple[str, str]:
        """Run tests with another text in place of a file, until the first failure.

        Returns
        -------
        (str, str)
            ``killed``, ``timed out`` or ``survived``, and the test that decided; it is empty where the tests could not
            even be imported.
        """
        with self._replaced(path, text):
            found = self._ask(tests, limits, limit=max(limits.values(), default=ALLOWANCE))
        return {"passed": "survived", "failed": "killed"}.get(found["outcome"], found["outcome"]), found["test"]

    @contextmanager
    def _replaced(self, path: str, text: str) -> Iterator[None]:
        file = self._copy / path
        original = file.read_bytes()
        file.write_text(text, encoding="utf-8")
        try:
            yield
        finally:
            file.write_bytes(original)

    def _ask(
        self,
        tests: Sequence[str],
        limits: Mapping[str, float],
        *,
        limit: float,
        trace: Sequence[str] = (),
        without: Sequence[str] = (),
    ) -> dict[str, Any]:
        request = {"tests": tests, "without": without, "trace": trace, "limits": limits, "limit": limit, "wall": WALL}
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.write(json.dumps(request) + "\n")
        self._server.stdin.flush()
        line = self._server.stdout.readline()
        if not line:
            raise RuntimeError("the server of the tests must answer, and has ended")
        answer: dict[str, Any] = json.loads(line)
        return answer


def _copied(root: Path, copy: Path) -> None:
    """Copy what git keeps or would keep, links as links."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        if os.path.lexists(root / name):
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, copy / name, follow_symlinks=False)
