"""Programs for small ARM cores, run in an emulator one instruction at a time and counted."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

STRING_H = "#include <stddef.h>\nvoid *memset(void *, int, size_t);\nvoid *memcpy(void *, const void *, size_t);\n"
_START = """
#include <stddef.h>
#include <stdint.h>
void run(void);
void *memset(void *at, int value, size_t size) { char *to = at; while (size--) *to++ = (char)value; return at; }
void *memcpy(void *at, const void *from, size_t size)
{ char *to = at; const char *next = from; while (size--) *to++ = *next++; return at; }
static void system_call(int number, int first, const void *second, int third)
{
    register int which __asm__("r7") = number;
    register int one __asm__("r0") = first;
    register const void *two __asm__("r1") = second;
    register int three __asm__("r2") = third;
    __asm__ volatile("svc 0" : "+r"(one) : "r"(which), "r"(two), "r"(three) : "memory");
}
void write_out(const void *data, int size) { system_call(4, 1, data, size); }
void _start(void)
{
    run();
    system_call(1, 0, NULL, 0);
}
"""


class Emulated(NamedTuple):
    """What a program wrote, how many instructions of the functions that count it took, and its functions.

    `functions` are their addresses and sizes by their names.
    """

    written: bytes
    instructions: int
    functions: dict[str, tuple[int, int]]


def emulated(
    place: Path, options: Sequence[str], texts: Mapping[str, str], sources: Sequence[str], counts: Callable[[str], bool]
) -> Emulated:
    """Compile a program whose function ``run`` hands its results to ``write_out(data, size)``, and run it.

    Parameters
    ----------
    place : Path
        An empty folder.
    options : sequence of str
        Of the compiler, such as the core.
    texts : mapping of str to str
        Files to write, by their names.
    sources : sequence of str
        Files to compile.
    counts : callable
        Whether the instructions of the function of a name count.
    """
    for file, text in {"start.c": _START, "string.h": STRING_H, **texts}.items():
        (place / file).write_text(text, encoding="utf-8")
    compiled = ["-mthumb", "-O2", "-std=gnu99", "-ffreestanding", "-ffunction-sections", "-I."]
    linked = ["-nostdlib", "-Wl,--gc-sections", *sources, "start.c", "-lgcc", "-o", "run.elf"]
    output(place, "arm-none-eabi-gcc", *options, *compiled, *linked)
    # A program of Linux: larger cores have the instructions of the small ones, and count alike.
    traced = ["qemu-arm", "-singlestep", "-d", "nochain,exec", "-D", "trace", "run.elf"]
    written = subprocess.run(traced, cwd=place, check=True, capture_output=True).stdout
    functions = _symbols(output(place, "arm-none-eabi-nm", "-S", "run.elf"))
    names: dict[int, str] = {}
    total = 0
    for at in _executed(place / "trace"):
        if at not in names:
            names[at] = _owner(functions, at)
        total += counts(names[at])
    return Emulated(written, total, functions)


def output(place: Path, *command: str) -> str:
    """Run a command, and return what it writes."""
    return subprocess.run(command, cwd=place, check=True, capture_output=True, text=True).stdout


def _symbols(text: str) -> dict[str, tuple[int, int]]:
    """Return address and size of each function by its name; of those without a size, up to the next."""
    rows = [line.split() for line in text.splitlines()]
    sized = {row[3]: (int(row[0], 16) & ~1, int(row[1], 16)) for row in rows if len(row) == 4 and row[2] in "tT"}
    bare = {row[2]: int(row[0], 16) & ~1 for row in rows if len(row) == 3 and row[1] in "tT"}
    starts = sorted({at for at, _ in sized.values()} | set(bare.values()))
    after = dict(zip(starts, [*starts[1:], starts[-1] + 4096], strict=True))
    return {name: (at, after[at] - at) for name, at in bare.items()} | sized


def _executed(trace: Path) -> Iterator[int]:
    """Return the addresses of the instructions in the order in which they were executed."""
    for line in trace.read_text(encoding="utf-8").splitlines():
        if found := re.match(r"Trace \d+: \S+ \[[0-9a-f]+/([0-9a-f]+)/", line):
            yield int(found[1], 16)


def _owner(symbols: dict[str, tuple[int, int]], address: int) -> str:
    return next((name for name, (at, size) in symbols.items() if at <= address < at + size), "")
