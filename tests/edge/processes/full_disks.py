"""Commands on a full disk: a real one, a small file system in memory that only the command and its tools see."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import sosmith
from sosmith.model.text_files import to_json
from tests.commands.command_line import QUICK, reloadable
from tests.edge.processes.every_command import paths_written
from tests.gen.report.reports import report
from tests.instrument.calibration.measuring import readings, write_csv

ROOT = Path(__file__).parents[3]

SAVES = "from sosmith.studio.session import opened; from pathlib import Path; import sys; "
SAVES += "session = opened(Path('plain.toml'), Path('out/o.toml'), Path('.')); session.handle({'do': 'save'}, 'page'); "
SAVES += "problem = session.wait(-1, __import__('threading').Event())[1]['document'].get('problem'); session.close(); "
SAVES += "sys.exit(f'sosmith: error: {problem}' if problem else 0)"

WRITERS: dict[tuple[str, str], str] = {
    ("init", "file"): "init out/o.toml",
    ("import", "-o"): "import sos.csv --sample-rate 48000 -o out/o.toml",
    ("design", "--plot"): "design plain.toml --plot out/o.svg",
    ("generate", "-o"): "generate plain.toml -o out",
    ("package", "-o"): "package plain.toml -o out",
    ("verify", "--export"): "verify made/plain.certificate.json --export out",
    ("reload", "-o"): "reload core.toml next.toml -o out/o.json",
    ("studio", "-o"): "studio plain.toml -o out/o.toml",
    ("build", "-o"): "build plain.toml --board icebreaker -o out",
    ("simulate", "-o"): "simulate plain.toml --simulator icarus --seconds 0.1 -o out",
    ("emulate", "-o"): "emulate plain.toml noise -o out/o.csv",
    ("board", "-o"): "board plain.toml --virtual --model -o out",
    ("stream", "-o"): "stream PORT trace.csv -o out/o.csv",
    ("monitor", "-o"): "monitor PORT --trace trace.csv --speed 0 --files made -o out/o.csv",
    ("monitor", "--mqtt-keep"): "monitor PORT --trace trace.csv --speed 0 --files made --mqtt mqtt://127.0.0.1:9 "
    "--mqtt-keep out/o.db",
    ("compare", "-o"): "compare report.json report.json -o out/o.html",
    ("explore", "-o"): "explore plain.toml -p filter.order=1,2 --samples 100 --jobs 1 -o out",
    ("calibrate add", "--store"): "calibrate add a.csv --store out/o.db",
    ("calibrate export", "-o"): "calibrate export --store made.db -o out/o.toml",
    ("calibrate health", "--plot"): "calibrate health --store made.db --plot out/o.svg",
    ("calibrate plot", "-o"): "calibrate plot --store made.db -o out/o.svg",
    ("spectrum", "--into"): "spectrum ramp.csv --into out/o.toml",
    ("spectrum", "--plot"): "spectrum ramp.csv --plot out/o.svg",
    ("spectrum", "-o"): "spectrum ramp.csv -o out/o.toml",
    ("vehicle", "--plot"): "vehicle --model linear --plot out/o.svg",
    ("vehicle", "--write-parameters"): "vehicle --write-parameters out/o.toml",
    ("vehicle", "-o"): "vehicle --model linear -o out/o.csv",
    ("wear", "--plot"): "wear wheel.csv --initial 1.5 --warning 7 --limit 9 --plot out/o.svg",
    ("paper", "-o"): "paper -o out/o.md",
    ("demo", "-o"): "demo -o out",
}
"""A line for each path that a command writes; what it writes is in the folder `out`."""

PLACES = ("out", "tmp", "cache")
"""Folders that are full: that of the outputs, that of temporary files, that of caches."""

SIZES = (4, 16, 64, 256)
"""Sizes of the full file system in KiB."""

STATUSES = {0, 1, 2, 3, 130}
"""Those that docs and commands name; the last one is that of a board, which is interrupted."""

PATIENCE = 600.0
"""Seconds after which a command is taken to hang, on however busy a machine."""

_BOARD = 30.0
"""Seconds after which a board is interrupted, which would run on."""

_MOUNTED = (
    'trap : INT; mount -t tmpfs -o size="$1"k none "$2" && shift 2 && "$@"; status=$?; cp -r out/. after; exit $status'
)
"""The script around a command: what it has written is copied before the file system goes."""


@dataclass(frozen=True)
class Ended:
    """How a command ended.

    Attributes
    ----------
    status : int
    said : str
        What it wrote to stderr.
    findings : tuple of str
        What must not be.
    """

    status: int
    said: str
    findings: tuple[str, ...]


def missing() -> list[tuple[str, str]]:
    """Paths that a command writes, and that have no line here."""
    return [one for one in paths_written() if one not in WRITERS]


def possible() -> bool:
    """Whether this machine lets us have a file system of our own."""
    if shutil.which("unshare") is None:
        return False
    line = ["unshare", "-rm", "mount", "-t", "tmpfs", "none", tempfile.gettempdir()]
    return not subprocess.run(line, capture_output=True, check=False).returncode


def tried(writer: tuple[str, str], place: str, size: int) -> Ended:
    """Run the line of a writer while a folder is on a file system of `size` KiB."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name in (*PLACES, "after"):
            (folder / name).mkdir()
        _prepare(folder)
        with _board(folder, WRITERS[writer]) as line:
            script = ["sh", "-c", _MOUNTED, "sh", str(size), str(folder / place)]
            ended = _run(folder, ["unshare", "-rm", *script, *_program(line)])
        return Ended(ended.returncode, ended.stderr, tuple(_findings(ended, folder, place)))


def _findings(ended: subprocess.CompletedProcess[str], folder: Path, place: str) -> Iterator[str]:
    lines = ended.stderr.splitlines()
    if ended.returncode not in STATUSES:
        yield f"status {ended.returncode}: {ended.stderr[-300:]}"
    ours = ended.stderr.partition(" failed; the end of ")[0]  # what follows is quoted from the log of a tool
    if "Traceback" in ours:
        yield f"a traceback: {ended.stderr[-600:]}"
    if ended.returncode in {2, 3} and not any(line.startswith("sosmith: error: ") for line in lines):
        yield f"no sentence: {ended.stderr[-300:]}"
    if place != "out" and ended.returncode == 0 and not any((folder / "after").iterdir()):
        yield "good, and nothing is written"
    for path in (folder / "after").rglob("*"):
        if path.name.startswith(".") or path.suffix in {".tmp", ".part"}:
            yield f"{path.name} is left"
        elif (
            ended.returncode and path.suffix in {".toml", ".svg", ".html", ".md", ".json"} and path.stat().st_size == 0
        ):
            yield f"{path.name} is empty"
    for path in (folder / "tmp").iterdir():  # what was in the full one is gone with it
        yield f"{path.name} is left among temporary files"


def _run(folder: Path, line: list[str]) -> subprocess.CompletedProcess[str]:
    process = subprocess.Popen(
        line,
        cwd=folder,
        env=_surroundings(folder),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        _, said = process.communicate(timeout=_BOARD if "board" in line else PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGINT)  # a board runs until then
        _, said = process.communicate(timeout=PATIENCE)
    return subprocess.CompletedProcess(line, process.returncode, "", said)


def _surroundings(folder: Path) -> dict[str, str]:
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "TMPDIR": str(folder / "tmp"),
        "XDG_CACHE_HOME": str(folder / "cache"),
    }


def _program(line: str) -> list[str]:
    if line.startswith("studio"):
        return [sys.executable, "-c", SAVES]
    return [sys.executable, "-m", "sosmith.cli", *line.split()]


@contextmanager
def _board(folder: Path, line: str) -> Iterator[str]:
    """Have a board for a line that needs a port."""
    if "PORT" not in line:
        yield line
        return
    said = folder / "port"
    with said.open("w") as output:
        board = subprocess.Popen(
            _program("board plain.toml --virtual --model -q -o virtual"),
            cwd=folder,
            stdout=output,
            stdin=subprocess.DEVNULL,
        )
    try:
        deadline = time.monotonic() + PATIENCE
        while "\n" not in said.read_text() and board.poll() is None and time.monotonic() < deadline:
            time.sleep(0.05)
        yield line.replace("PORT", said.read_text().split("\n")[0])
    finally:
        board.terminate()
        board.wait()


def _prepare(folder: Path) -> None:
    shutil.copytree(_inputs(), folder, dirs_exist_ok=True)


@cache
def _inputs() -> Path:
    """Make what the commands read, once a process; it goes with the process' temporary folders."""
    folder = Path(tempfile.mkdtemp(prefix="sosmith-full-disks-"))
    texts = {
        "plain.toml": QUICK,
        "core.toml": reloadable("100.0"),
        "next.toml": reloadable("105.0").replace('"faithful"', "0.0006"),
        "report.json": to_json(report()),
        "sos.csv": "0.2,0.4,0.2,1,-0.5,0.2\n",
        "trace.csv": "\n".join(["x_code", *(str(n % 1024 - 512) for n in range(3000))]) + "\n",
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    write_csv(folder / "a.csv", readings(400))
    shutil.copy(ROOT / "examples" / "wear" / "wheel.csv", folder)
    sosmith.design(folder / "plain.toml").generate(folder / "made")
    example = ROOT / "examples" / "flange_wear_locomotive.toml"
    for line in (
        "calibrate add a.csv --store made.db",
        f"emulate {example} wear_ramp --core calibration --seconds 300 -o ramp.csv",
    ):
        subprocess.run(_program(line), cwd=folder, check=True, capture_output=True)
    return folder


def drawn(seed: int) -> tuple[tuple[str, str], str, int]:
    """Draw a writer, a place and a size."""
    rng = random.Random(seed)
    return list(WRITERS)[seed % len(WRITERS)], rng.choice(PLACES), rng.choice(SIZES)
