"""Builds the executable of a Verilated core with cocotb and the compiled loop, or takes it from the cache.

Verilator's own library, which takes far longer to compile than a core, is kept by its text and the compiler; what
writes waveforms is kept beside it, and its headers precompiled, which otherwise are half of the time that a core takes.
A model is kept by the core's text and all that goes into it besides.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import IO

import cocotb_tools.config

from sosmith.gen.output.comments import without_comments
from sosmith.sim.build_cache import BuildCache, cache_folder, key_of
from sosmith.sim.compilers import Compilers

LIBRARY_SECONDS = 20
"""About how long the library takes to compile on two cores."""

_ARGUMENTS = ("-Wno-fatal", "-O3", "--x-initial", "unique", "--timescale", "1ns/1ps")
"""Registers without a reset start at random, as they do in hardware."""

_LIBRARY = ("verilated", "verilated_dpi", "verilated_threads", "verilated_vpi")
_FLAGS = ("-O2", "-pthread", "-DVERILATOR=1", "-DVM_COVERAGE=0", "-DVM_SC=0", "-DVM_TIMING=0")
_HEADERS = ("verilated.h", "verilated_dpi.h", "verilated_vpi.h", "svdpi.h")
_ONE_FILE = 500_000  # bytes of C++ above which files are compiled by themselves, on all processors
_STREAM = Path(__file__).parent / "stream"
_MAIN, _LOOP = _STREAM / "verilated_core.cpp", _STREAM / "loop.h"


@dataclass(frozen=True, kw_only=True)
class Model:
    """What a model is made from.

    Attributes
    ----------
    source : Path
        The SystemVerilog file.
    top : str
        Name of its top module.
    ports : tuple of str
        Ports that the bench accesses.
    signals : tuple of str
        Those of the optional signals ``tdest`` and ``tuser`` that the streams have.
    waves : bool
        Whether it can write waveforms.
    """

    source: Path
    top: str
    ports: tuple[str, ...]
    signals: tuple[str, ...]
    waves: bool


class Builder:
    """Verilator and the compiler.

    Parameters
    ----------
    version : str
        Verilator's version.
    environment : mapping of str to str
        Environment that its processes need.
    folder : Path
        Folder for the files in between, without blanks in its path; the cache is there if the user has none.
    log : file or None
        Where the tools' output goes; None for that of this process.
    alone : bool
        As for `sosmith.sim.compilers.Compilers`.
    """

    def __init__(
        self,
        version: str,
        environment: Mapping[str, str],
        folder: Path,
        log: IO[str] | None = None,
        *,
        alone: bool = False,
    ) -> None:
        self._environment, self._folder = environment, folder
        self._compilers = Compilers(environment, log, alone=alone)
        self._cache = BuildCache(cache_folder() or folder / "cache")
        root = Path(self._output("verilator", "--getenv", "VERILATOR_ROOT").strip())
        self._include = root / "include"
        texts = sorted([*self._include.glob("*.cpp"), *self._include.glob("**/*.h")])
        self._tools = [
            version,
            self._output("g++", "--version"),
            self._output("g++", "-dumpmachine"),
            [hashlib.sha256(path.read_bytes()).hexdigest() for path in texts],
        ]

    def has_library(self) -> bool:
        """Whether Verilator's library is in the cache."""
        return self._cache.has("library", self._library_key(_LIBRARY))

    def build(self, model: Model, target: Path) -> None:
        """Write the model's executable to `target`.

        Raises
        ------
        subprocess.CalledProcessError
            If a tool fails; it has said why.
        """
        control = _control_file(model.top, model.ports)
        bench = cocotb_tools.config.share_dir / "lib" / "verilator"
        flags = [*_flags(waves=model.waves), *(f"-DBENCH_{signal.upper()}" for signal in model.signals), f"-I{bench}"]
        key = key_of(
            self._tools,
            flags,
            _ARGUMENTS,
            model.top,
            control,
            without_comments(model.source.read_text(encoding="utf-8")),
            _MAIN.read_text(encoding="utf-8"),
            _LOOP.read_text(encoding="utf-8"),
            (bench / "verilator.cpp").read_text(encoding="utf-8"),
            metadata.version("cocotb"),
            str(cocotb_tools.config.libs_dir),  # where the executable looks for cocotb
        )
        with self._cache.entry("model", key, lambda entry: self._make(model, control, flags, entry / "model")) as entry:
            shutil.copy(entry / "model", target)

    def build_program(
        self, source: Path, top: str, main: Path, header: Path, target: Path, *, control: str = "", define: str = ""
    ) -> None:
        """Write an executable to `target` whose main program, in C++, runs the module `top` of `source` as ``Vtop``.

        The main program includes `header`. `control` is the text of a control file of Verilator that makes signals
        accessible by VPI, and `define` a macro of the main program, if they are not empty.

        Raises
        ------
        subprocess.CalledProcessError
            If a tool fails; it has said why.
        """
        texts = [path.read_text(encoding="utf-8") for path in (source, main, header)]
        flags = [*_flags(waves=False), *([f"-D{define}"] if define else [])]
        key = key_of(self._tools, flags, _ARGUMENTS, top, texts, control)

        def make(entry: Path) -> None:
            objects = self._emptied()
            (objects / "control.vlt").write_text(control or "`verilator_config\n", encoding="utf-8")
            command = ["verilator", "-cc", "-Mdir", str(objects), "--prefix", "Vtop", "--top-module", top]
            command += [*_ARGUMENTS, *(["--vpi"] if control else []), "control.vlt", str(source)]
            self._compilers.run(command, objects)
            sources = _together([*sorted(objects.glob("Vtop*.cpp")), main], objects)
            included = self._precompiled(objects, waves=False)
            compiled = self._compile(sources, [*flags, f"-I{objects}", f"-I{header.parent}", *included], objects)
            with self._libraries() as library:
                parts = [*compiled, *library]
                self._compilers.run(["g++", "-pthread", "-o", str(entry / "program"), *map(str, parts)], objects)

        with self._cache.entry("program", key, make) as entry:
            target.unlink(missing_ok=True)  # one that runs cannot be written to, but goes on without its name
            shutil.copy(entry / "program", target)

    def _emptied(self) -> Path:
        """Return the folder for objects, which is empty."""
        objects = self._folder / "objects"
        shutil.rmtree(objects, ignore_errors=True)
        objects.mkdir(parents=True)
        return objects

    def _make(self, model: Model, control: str, flags: Sequence[str], target: Path) -> None:
        objects = self._emptied()
        (objects / "ports.vlt").write_text(control, encoding="utf-8")
        command = ["verilator", "-cc", "-Mdir", str(objects), "--prefix", "Vtop", "--top-module", model.top, "--vpi"]
        command += [*_ARGUMENTS, *(["--trace"] if model.waves else []), "ports.vlt", str(model.source)]
        self._compilers.run(command, objects)
        classes = (objects / "Vtop_classes.mk").read_text(encoding="utf-8")
        others = sorted({*re.findall(r"^\s+(verilated\w*) \\", classes, re.MULTILINE)} - {*_LIBRARY})
        sources = _together([*sorted(objects.glob("Vtop*.cpp")), _MAIN], objects)
        included = self._precompiled(objects, waves=model.waves)
        flags = [*flags, *_clock_before(objects / "Vtop___024root.h"), f"-I{objects}", *included]
        compiled = self._compile(sources, flags, objects)
        libraries = cocotb_tools.config.libs_dir
        with self._libraries(others) as library:
            parts = [*compiled, *library]
            cocotb = [f"-Wl,-rpath,{libraries}", f"-L{libraries}", "-lcocotbvpi_verilator"]
            # The compiled loop is called by name.
            self._compilers.run(["g++", "-pthread", "-rdynamic", "-o", str(target), *map(str, parts), *cocotb], objects)

    @contextmanager
    def _libraries(self, others: Sequence[str] = ()) -> Iterator[list[Path]]:
        """Yield the object files of Verilator's library, and of other files of it that not every model needs."""
        objects: list[Path] = []
        with ExitStack() as locked:
            for kind, names in (("library", _LIBRARY), ("extra", tuple(others))):
                if names:
                    make = partial(self._make_library, names)
                    entry = locked.enter_context(self._cache.entry(kind, self._library_key(names), make))
                    objects += [entry / f"{name}.o" for name in names]
            yield objects

    def _precompiled(self, objects: Path, *, waves: bool) -> list[str]:
        """Return flags that include Verilator's headers first, precompiled in the folder for objects."""
        flags = _flags(waves=waves)

        def make(entry: Path) -> None:
            (entry / "headers.h").write_text("".join(f"#include <{name}>\n" for name in _HEADERS), encoding="utf-8")
            self._compilers.run(
                ["g++", *flags, *self._include_flags(), "-x", "c++-header", "-o", "headers.h.gch", "headers.h"], entry
            )

        with self._cache.entry("headers", key_of(self._tools, _HEADERS, flags), make) as entry:
            for name in ("headers.h", "headers.h.gch"):
                shutil.copy2(entry / name, objects)  # a compiler may look at its time, too
        return ["-Winvalid-pch", "-include", str(objects / "headers.h")]

    def _include_flags(self) -> list[str]:
        return [f"-I{self._include}", f"-I{self._include / 'vltstd'}"]

    def _make_library(self, names: Sequence[str], entry: Path) -> None:
        self._compile([self._include / f"{name}.cpp" for name in names], _FLAGS, entry)

    def _library_key(self, names: Sequence[str]) -> str:
        return key_of(self._tools, names, _FLAGS)

    def _compile(self, sources: Sequence[Path], flags: Sequence[str], folder: Path) -> list[Path]:
        """Compile each file into `folder`, on all processors; return the object files."""

        def compiled(source: Path) -> Path:
            target = folder / f"{source.stem}.o"
            self._compilers.run(["g++", *flags, *self._include_flags(), "-c", "-o", str(target), str(source)], folder)
            return target

        with ThreadPoolExecutor(os.cpu_count()) as pool, self._compilers.ended_at_once():
            return list(pool.map(compiled, sources))

    def _output(self, *command: str) -> str:
        return subprocess.run(command, env=self._environment, check=True, capture_output=True, text=True).stdout


def _together(sources: list[Path], folder: Path) -> list[Path]:
    """Return one file in place of several if they are short: their headers are what takes time."""
    if sum(path.stat().st_size for path in sources) >= _ONE_FILE:
        return sources
    together = folder / "together.cpp"
    together.write_text("".join(f'#include "{path.resolve()}"\n' for path in sources), encoding="utf-8")
    return [together]


def _clock_before(header: Path) -> list[str]:
    """Return the flag with the member of a model that remembers the clock; none where its header has no such member.

    With it, one evaluation is enough for a clock. The name is of Verilator's own, and another version may have another.
    """
    names = {*re.findall(r"\b(__Vtrigprevexpr\w*?_aclk_\w*);", header.read_text(encoding="utf-8"))}
    return [f"-DBENCH_CLOCK_BEFORE={names.pop()}"] if len(names) == 1 else []


def _flags(*, waves: bool) -> list[str]:
    trace = {"VM_TRACE": waves, "VM_TRACE_VCD": waves, "VM_TRACE_FST": False, "VM_TRACE_SAIF": False}
    return [*_FLAGS, *(f"-D{name}={int(value)}" for name, value in trace.items())]


def _control_file(top: str, ports: Sequence[str]) -> str:
    """Control file that makes only these ports accessible, for faster builds and simulations than with all signals."""
    lines = [f'public_flat_rw -module "{top}" -var "{port}"' for port in ports]
    return "`verilator_config\n" + "\n".join(lines) + "\n"
