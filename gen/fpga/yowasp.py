"""YoWASP programs compile themselves for the machine on their first run, which takes a minute: once, one at a time.

A second process that starts meanwhile would load half a program, and die of it.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path

import platformdirs

from sosmith.gen.fpga.tool_cache import tool_cache


@contextmanager
def own_temporary_folder() -> Iterator[dict[str, str]]:
    """Environment for a YoWASP program, whose temporary files are deleted even if it is killed."""
    with tempfile.TemporaryDirectory(prefix="sosmith-") as folder:
        yield os.environ | tool_cache() | {"TMPDIR": folder}


@cache
def compile_first(command: tuple[str, ...], program: str, package: str) -> None:
    """Have a program compile itself unless it has done so; other processes that want to do the same wait.

    Parameters
    ----------
    command : tuple of str
        What runs it.
    program : str
        Its usual name, such as "yosys".
    package : str
        The package from pip that it belongs to.
    """
    module = package.replace("-", "_")
    binary = f"{program}.wasm"
    source = Path(str(metadata.distribution(package).locate_file(module))) / binary
    # As the package `yowasp_runtime` names its cache.
    folder = Path(os.environ.get("YOWASP_CACHE_DIR", platformdirs.user_cache_dir("YoWASP", appauthor=False))) / module
    try:
        compiled = folder / binary / hashlib.sha1(source.read_bytes(), usedforsecurity=False).hexdigest()
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / f"{binary}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not compiled.exists():
                _compile(command, compiled)
    except OSError:
        return  # no such program, or no place to keep it: the program itself says so


def _compile(command: tuple[str, ...], compiled: Path) -> None:
    try:
        with own_temporary_folder() as environment:
            subprocess.run([*command, "--version"], env=environment, capture_output=True, check=False)
    except BaseException:
        compiled.unlink(missing_ok=True)  # half of it, after an interrupt
        raise
