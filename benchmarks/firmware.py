"""Instructions that the C model takes on microcontrollers, counted in an emulator: `python -m benchmarks.firmware`.

Needs gcc-arm-none-eabi and qemu-user. The step of each generated model is compiled for a core of a microcontroller, run
by qemu one instruction at a time, and counted; the codes that come out must be those of the datapath. Writes
benchmarks/firmware.json and docs/firmware.md; `--document` writes the page alone, from the figures recorded.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import load
from sosmith.model.dataflow.c_model import c_header, c_source, state_bytes
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "firmware.json"
PAGE = ROOT / "docs" / "firmware.md"

EXAMPLES = ("audio_lowpass", "flange_wear_bench", "flange_wear_locomotive")
CORES = {"Cortex-M4": "cortex-m4", "Cortex-M0+": "cortex-m0plus"}
"""Options of the compiler by the names of the cores."""

SAMPLES = 200
_SEED = 1
_FACTOR, _ADDED = 1664525, 1013904223  # of the generator of random numbers in Numerical Recipes, section 7.1

_STRING_H = "#include <stddef.h>\nvoid *memset(void *at, int value, size_t size);\n"
_START = """
#include <stddef.h>
#include <stdint.h>
uint32_t checksum(void);
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
void _start(void)
{
    static char text[8];
    uint32_t sum = checksum();
    for (int k = 0; k < 8; k++)
        text[k] = "0123456789abcdef"[sum >> (28 - 4 * k) & 15];
    system_call(4, 1, text, 8);
    system_call(1, 0, NULL, 0);
}
"""


@dataclass(frozen=True)
class Firmware:
    """A model on a core.

    Attributes
    ----------
    example, core : str
    instructions : float
        Taken for a sample, without the call itself, on average over `SAMPLES` samples; with the compiler's helpers.
    calls : int
        Calls of such helpers in the text of a step.
    code, state : int
        Bytes of a step's code, and of the state of a channel.
    """

    example: str
    core: str
    instructions: float
    calls: int
    code: int
    state: int


def _stimulus(datapath: Datapath) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """Return random codes over the whole range of each input, shape (samples, inputs); `_main` makes the same."""
    state, rows = _SEED, []
    for _ in range(SAMPLES):
        row = []
        for port in datapath.inputs:
            state = (state * _FACTOR + _ADDED) % 2**32
            row.append(port.lowest + (state >> 8) % _span(port))
        rows.append(row)
    return np.array(rows, dtype=np.int64)


def _span(port: Port) -> int:
    return port.highest - port.lowest + 1


def _main(datapath: Datapath) -> str:
    name = datapath.name
    given = "".join(
        f"        random = random * {_FACTOR}u + {_ADDED}u;\n"
        f"        const int32_t code{k} = {port.lowest} + (int32_t)((random >> 8) % {_span(port)}u);\n"
        for k, port in enumerate(datapath.inputs)
    )
    codes = ", ".join(f"code{k}" for k in range(len(datapath.inputs)))
    return (
        f'#include "{name}.h"\nuint32_t checksum(void);\nuint32_t checksum(void)\n{{\n    static {name}_state state;\n'
        f"    uint32_t random = {_SEED}, sum = 0;\n    for (int n = 0; n < {SAMPLES}; n++) {{\n{given}"
        f"        sum = sum * 31u + (uint32_t){name}_step(&state, {codes}, NULL);\n    }}\n    return sum;\n}}\n"
    )


def measured(example: str, core: str) -> Firmware:
    """Compile, run and count.

    Raises
    ------
    RuntimeError
        If the codes are not those of the datapath.
    """
    datapath = design_core(load(ROOT / "examples" / f"{example}.toml")).datapath.behind_decimator
    name = datapath.name
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        texts = {"start.c": _START, "main.c": _main(datapath), "string.h": _STRING_H}
        texts |= {f"{name}.c": c_source(datapath), f"{name}.h": c_header(datapath)}
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")
        options = [
            f"-mcpu={CORES[core]}",
            "-mthumb",
            "-O2",
            "-std=gnu99",
            "-ffreestanding",
            "-ffunction-sections",
            "-I.",
        ]
        sources = [f"{name}.c", "main.c", "start.c"]
        _run(place, "arm-none-eabi-gcc", *options, "-nostdlib", "-Wl,--gc-sections", *sources, "-lgcc", "-o", "run.elf")
        # A program of Linux: larger cores have the instructions of the small ones, and count alike.
        emulated = ["qemu-arm", "-singlestep", "-d", "nochain,exec", "-D", "trace", "run.elf"]
        found = int(_run(place, *emulated)[:8], 16)
        wanted = 0
        for code in datapath.compute(_stimulus(datapath)).tolist():
            wanted = (wanted * 31 + code) % 2**32
        if found != wanted:
            raise RuntimeError(f"{example} on {core} must compute the codes of the datapath, and computes others")
        symbols = _symbols(_run(place, "arm-none-eabi-nm", "-S", "run.elf"))
        outside = {"_start", "checksum", "memset", "memcpy", "system_call"}
        counted = sum(1 for at in _executed(place / "trace") if _owner(symbols, at) not in outside)
        text = _run(place, "arm-none-eabi-objdump", "-d", "--no-show-raw-insn", f"--disassemble={name}_step", "run.elf")
    return Firmware(
        example=example,
        core=core,
        instructions=counted / SAMPLES,
        calls=len(re.findall(r"\tbl\t", text)),
        code=symbols[f"{name}_step"][1],
        state=state_bytes(datapath),
    )


def _run(place: Path, *command: str) -> str:
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


def document(record: Sequence[Firmware]) -> str:
    """Return the page about the C model in firmware."""
    rows = "".join(
        f"| {each.example} | {each.core} | {each.instructions:.0f} | {each.calls} | {each.code} | {each.state} |\n"
        for each in record
    )
    return f"""# In firmware

Written by `python -m benchmarks.firmware` from the figures that it records in `benchmarks/firmware.json`.

The C model that `sosmith generate` writes is the datapath itself: on a microcontroller it gives the codes of the
hardware, bit for bit, with the bound of the same certificate, and `sosmith verify --files` proves its text. It needs no
library, no floating point and no memory but the state that it is given.

```c
#include "audio_lowpass.h"

static audio_lowpass_state state;          /* zero is the state after reset */

int16_t filtered(int16_t sample)
{{
    return (int16_t)audio_lowpass_step(&state, sample, NULL);
}}
```

Each value has the narrowest type of 32 and 64 bits that holds all that the certificate says it can be, so that a core
of 32 bits multiplies 32 by 32 bits, and adds 64 bits only where a sum needs them. `_block` takes many samples of many
channels; with one input, `out` may be `in`. The header is for C++ as well.

| example | core | instructions a sample | calls of helpers | code, bytes | state of a channel, bytes |
|---|---|---|---|---|---|
{rows}
Compiled by GCC with `-O2`, a step without its status, random codes over the whole range, {SAMPLES} samples.
Instructions are counted by qemu; each takes one clock or more, which depends on the part and its memory. Helpers are
functions of the compiler, on a Cortex-M0+ those that multiply 64 bits; their instructions are counted too. A
calibration before a decimator and the decimator itself are not in a step.
"""


def recorded() -> list[Firmware]:
    """Return the figures recorded."""
    return [Firmware(**each) for each in json.loads(RECORD.read_text(encoding="utf-8"))]


def main() -> None:
    """Measure, record and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--document", action="store_true", help="only write the page from recorded figures")
    if not parser.parse_args().document:
        found = [measured(example, core) for example in EXAMPLES for core in CORES]
        RECORD.write_text(json.dumps([asdict(each) for each in found], indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(document(recorded()), encoding="utf-8")


if __name__ == "__main__":
    main()
