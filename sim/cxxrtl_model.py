"""Builds a core's CXXRTL model with the compiled loop as a library, or takes it from the cache.

Yosys reads the SystemVerilog and writes C++, so that neither the reader nor the simulator is that of Verilator.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from sosmith.gen.fpga.yosys import run_yosys, share_folder, yosys_version
from sosmith.gen.output.comments import without_comments
from sosmith.sim.build_cache import BuildCache, cache_folder, key_of

USE = "simulation in CXXRTL"

# Registers without a reset start at random, as they do in hardware. With the higher level, waveforms show all signals;
# with the one below, the names of ports lead to their values. A wire's attribute `init` only repeats what each `reg`
# says, with x for bits that are wired to a constant: setundef would find two initial values of one constant.
_SCRIPT = (
    "read_verilog -sv core.sv; hierarchy -check -top {top}; rename -top core; setattr -unset init w:*; proc; flatten; "
    "memory_collect; setundef -undriven -init -random 1; write_cxxrtl -g{level} model.cc"
)
_LEVELS = {False: 2, True: 4}
_FLAGS = ("-O2", "-std=c++17", "-shared", "-fPIC", "-DCXXRTL_NDEBUG")
"""The last one lets a core read beyond the end of a memory, as in hardware: what it gets is 0."""
_STREAM = Path(__file__).parent / "stream"


def build_cxxrtl(
    source: Path,
    top: str,
    signals: Sequence[str],
    environment: Mapping[str, str],
    folder: Path,
    target: Path,
    *,
    waves: bool = False,
) -> None:
    """Write the model of a core to `target`, a shared library for `CxxrtlPins`.

    Parameters
    ----------
    source : Path
        The SystemVerilog file.
    top : str
        Name of its top module.
    signals : sequence of str
        Those of the optional signals ``tdest`` and ``tuser`` that the streams have.
    environment : mapping of str to str
        Environment for the compiler.
    folder : Path
        Folder for the files in between; the cache is there if the user has none.
    target : Path
        The library.
    waves : bool
        Whether waveforms show all signals.

    Raises
    ------
    ToolError
        If Yosys is missing or fails.
    subprocess.CalledProcessError
        If the compiler fails; it has said why.
    """
    script = _SCRIPT.format(top=top, level=_LEVELS[waves])
    headers = share_folder() / "include" / "backends" / "cxxrtl" / "runtime"
    flags = [*_FLAGS, *(f"-DBENCH_{signal.upper()}" for signal in signals)]
    main, loop = _STREAM / "cxxrtl_core.cpp", _STREAM / "loop.h"
    text = source.read_text(encoding="utf-8")
    key = key_of(
        yosys_version(USE),
        [hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(headers.glob("cxxrtl/*.h"))],
        subprocess.run(["g++", "-v"], env=environment, check=True, capture_output=True, text=True).stderr,
        script,
        flags,
        without_comments(text),
        main.read_text(encoding="utf-8"),
        loop.read_text(encoding="utf-8"),
    )

    def make(entry: Path) -> None:
        objects = folder / "objects"
        shutil.rmtree(objects, ignore_errors=True)
        objects.mkdir(parents=True)
        (objects / "core.sv").write_text(text, encoding="utf-8")
        run_yosys(script, objects, USE)
        command = ["g++", *flags, f"-I{objects}", f"-I{headers}", "-o", str(entry / "model.so"), str(main)]
        subprocess.run(command, cwd=objects, env=environment, check=True)

    with BuildCache(cache_folder() or folder / "cache").entry("cxxrtl", key, make) as entry:
        shutil.copy(entry / "model.so", target)
