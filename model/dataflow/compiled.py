"""Compiles a datapath's C model and calls it on arrays."""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sosmith.model.dataflow.c_model import c_header, c_source, state_bytes
from sosmith.model.dataflow.structure import Structure
from sosmith.model.errors import ToolError


class Block(Protocol):
    """A compiled datapath."""

    def __call__(
        self,
        codes: npt.NDArray[np.int64],
        *,
        with_status: bool = False,
        states: npt.NDArray[np.uint8] | None = None,
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint8]]:
        """Compute output codes and status, both of shape (samples, channels); without `with_status`, that is empty.

        The computation begins with `states`, and leaves its own there; without them, it begins at reset.
        """
        ...

    def reset(self, channels: int) -> npt.NDArray[np.uint8]:
        """Return the states after reset, one row of bytes for each channel."""
        ...


_FLAGS = ("-std=gnu99", "-shared", "-fPIC")

_FEW = 500_000
"""Samples that are computed sooner than the compiler has optimized the loop: it takes twice as long as without."""


def block_for(datapath: Structure, samples: int) -> Block:
    """Compile the C model of `datapath` for a run of so many samples of all channels together, as `compile_block`."""
    return compile_block(datapath, optimized=samples > _FEW)


@functools.lru_cache(maxsize=64)
def compile_block(datapath: Structure, *, optimized: bool = True) -> Block:
    """Compile the C model of `datapath`; the returned function takes codes of shape (samples, channels, inputs).

    Raises
    ------
    ToolError
        If no C compiler is found or it fails.
    """
    library = _load(datapath.name, c_header(datapath), c_source(datapath), "-O2" if optimized else "-O0")
    function = getattr(library, f"{datapath.name}_block")
    function.restype = None
    function.argtypes = [
        ctypes.c_void_p,
        ctypes.c_size_t,
        ctypes.c_size_t,
        ctypes.c_void_p,
        ctypes.c_void_p,
        ctypes.c_void_p,
    ]
    return _Compiled(function, state_bytes(datapath))


_SIZE = """
size_t {name}_decimator_bytes(void)
{{
    return sizeof({name}_decimator);
}}
"""
_ALIGNMENT = 16
"""That of states of 128 bits, in bytes."""


class Pushed:
    """A compiled datapath of which one result out of several leaves, which takes one sample of one channel at a time.

    Parameters
    ----------
    datapath : Structure
        What is computed.

    Raises
    ------
    ToolError
        If no C compiler is found or it fails.
    """

    def __init__(self, datapath: Structure) -> None:
        self._inputs = len(datapath.inputs)
        source = c_source(datapath) + _SIZE.format(name=datapath.name)
        library = _load(datapath.name, c_header(datapath), source, "-O2")
        size = getattr(library, f"{datapath.name}_decimator_bytes")
        size.restype, size.argtypes = ctypes.c_size_t, []
        self._bytes: int = size()
        self._push = getattr(library, f"{datapath.name}_push")
        self._push.restype = ctypes.c_int
        self._push.argtypes = [ctypes.c_void_p, *[ctypes.c_int64] * self._inputs, ctypes.c_void_p, ctypes.c_void_p]
        self.reset()

    def reset(self) -> None:
        """Return to the state after reset."""
        memory = np.zeros(self._bytes + _ALIGNMENT, dtype=np.uint8)
        self._state = memory[-memory.ctypes.data % _ALIGNMENT :]

    def __call__(self, codes: npt.NDArray[np.int64]) -> tuple[int, int] | None:
        """Take the codes of one sample, shape (inputs,); return output code and status if it brings a result."""
        result, status = ctypes.c_int64(), ctypes.c_uint8()
        has_result = self._push(self._state.ctypes.data, *codes.tolist(), ctypes.byref(result), ctypes.byref(status))
        return (result.value, status.value) if has_result else None


class _Compiled:
    """The loop of a loaded C model, and the size of its state in bytes."""

    def __init__(self, function: Callable[..., None], size: int) -> None:
        self._function, self._size = function, size

    def reset(self, channels: int) -> npt.NDArray[np.uint8]:
        # States of 128 bits need an alignment of 16 bytes, which numpy's allocator has for large arrays.
        return np.zeros((channels, self._size), dtype=np.uint8)

    def __call__(
        self,
        codes: npt.NDArray[np.int64],
        *,
        with_status: bool = False,
        states: npt.NDArray[np.uint8] | None = None,
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint8]]:
        samples, channels, _ = codes.shape
        source = np.ascontiguousarray(codes, dtype=np.int64)
        result = np.empty((samples, channels), dtype=np.int64)
        own = self.reset(channels) if states is None else states
        status = np.empty((samples, channels) if with_status else (0, 0), dtype=np.uint8)
        self._function(
            own.ctypes.data,
            samples,
            channels,
            source.ctypes.data,
            result.ctypes.data,
            status.ctypes.data if with_status else None,
        )
        return result, status


def _load(name: str, header: str, source: str, level: str) -> ctypes.CDLL:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise ToolError("a C compiler is needed for the bit-true model, and none was found: apt-get install gcc")
    return _built(compiler, name, header, source, level)


@functools.lru_cache(
    maxsize=16
)  # models of one datapath are asked for again and again; they keep no state of their own
def _built(compiler: str, name: str, header: str, source: str, level: str) -> ctypes.CDLL:
    with tempfile.TemporaryDirectory(prefix="sosmith-") as folder:
        directory = Path(folder)
        (directory / f"{name}.h").write_text(header, encoding="utf-8")
        (directory / f"{name}.c").write_text(source, encoding="utf-8")
        library = directory / f"{name}.so"
        result = subprocess.run(
            [compiler, level, *_FLAGS, "-o", str(library), f"{name}.c"],
            cwd=directory,
            capture_output=True,
            text=True,
            check=False,
        )
        if result.returncode:
            raise ToolError(f"{compiler} failed on the bit-true model: {result.stderr.strip()[-500:]}")
        # The library stays mapped after its file has been deleted.
        return ctypes.CDLL(str(library))
