"""Instructions that the C model takes on microcontrollers, counted in an emulator: `python -m benchmarks.firmware`.

Needs gcc-arm-none-eabi and qemu-user. The step of each generated model is compiled for a core of a microcontroller, run
by qemu one instruction at a time, and counted; the codes that come out must be those of the datapath. Writes
benchmarks/firmware.json and docs/firmware.md; `--document` writes the page alone, from the figures recorded, `--cmsis`
measures CMSIS-DSP as well.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from benchmarks.emulated_core import emulated, output
from benchmarks.firmware_peers import EXAMPLE, Peer
from benchmarks.firmware_peers import SAMPLES as PEER_SAMPLES
from benchmarks.firmware_peers import measured as measured_peers

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


@dataclass(frozen=True)
class Record:
    """What is on the page: the models on the cores, and the filters beside one of them."""

    models: list[Firmware]
    peers: list[Peer]


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
        f'#include "{name}.h"\nvoid write_out(const void *, int);\nvoid run(void);\nvoid run(void)\n{{\n'
        f"    static {name}_state state;\n    static int32_t codes[{SAMPLES}];\n    uint32_t random = {_SEED};\n"
        f"    for (int n = 0; n < {SAMPLES}; n++) {{\n{given}"
        f"        codes[n] = (int32_t){name}_step(&state, {codes}, NULL);\n    }}\n"
        f"    write_out(codes, (int)sizeof codes);\n}}\n"
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
    outside = {"_start", "run", "write_out", "memset", "memcpy", "system_call"}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        texts = {"main.c": _main(datapath), f"{name}.c": c_source(datapath), f"{name}.h": c_header(datapath)}
        sources = [f"{name}.c", "main.c"]
        found = emulated(place, [f"-mcpu={CORES[core]}"], texts, sources, lambda function: function not in outside)
        if np.frombuffer(found.written, dtype=np.int32).tolist() != datapath.compute(_stimulus(datapath)).tolist():
            raise RuntimeError(f"{example} on {core} must compute the codes of the datapath, and computes others")
        text = output(
            place, "arm-none-eabi-objdump", "-d", "--no-show-raw-insn", f"--disassemble={name}_step", "run.elf"
        )
    return Firmware(
        example=example,
        core=core,
        instructions=found.instructions / SAMPLES,
        calls=len(re.findall(r"\tbl\t", text)),
        code=found.functions[f"{name}_step"][1],
        state=state_bytes(datapath),
    )


def document(record: Record) -> str:
    """Return the page about the C model in firmware."""
    rows = "".join(
        f"| {each.example} | {each.core} | {each.instructions:.0f} | {each.calls} | {each.code} | {each.state} |\n"
        for each in record.models
    )
    peers = "".join(f"| {each.filter} | {each.instructions:.0f} | {each.error:.3g} |\n" for each in record.peers)
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

Each value has the narrowest type of 32 and 64 bits that holds all that the certificate says it can be. What two
sections need is computed and kept once: the past inputs of a section are the past outputs of the one before it. A sum
of 64 bits is kept times a power of two, so that what is left of it after rounding is its upper word, and a product by
32 bits goes to it in one instruction where the core has that. Where it has no product of 64 bits, that is put together
from four of 32 bits, without a call. Nothing is rounded otherwise than in the hardware. `_block` takes many samples of
many channels; with one input, `out` may be `in`. The header is for C++ as well.

| example | core | instructions a sample | calls of helpers | code, bytes | state of a channel, bytes |
|---|---|---|---|---|---|
{rows}
Compiled by GCC with `-O2`, a step without its status, random codes over the whole range, {SAMPLES} samples.
Instructions are counted by qemu; each takes one clock or more, which depends on the part and its memory. Helpers are
functions of the compiler; their instructions are counted too. A calibration before a decimator and the decimator itself
are not in a step.

## Beside CMSIS-DSP

The filter of {EXAMPLE} on a Cortex-M4, against scipy's `sosfilt` in double precision, for a step of 16,000, noise of
that amplitude and a step of 20, {PEER_SAMPLES} samples each. The error is the worst, in steps of 16 bits, to which the
results are rounded: 0.5 is what rounding leaves.

| filter | instructions a sample | worst error |
|---|---|---|
{peers}
CMSIS-DSP 1.10.3 (Apache 2.0) is compiled from its plain C, without the pairs of 16 bits that its q15 uses where the
headers of the core are at hand; its float needs a core with a floating-point unit. Its filters are called once for all
samples of a signal, ours for each. Their coefficients are those of scipy with a gain of 1 at 0 Hz in each section,
rounded to nearest: nothing says how far off they are for other signals, or whether they come to rest.
"""


def recorded() -> Record:
    """Return the figures recorded."""
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    return Record([Firmware(**each) for each in record["models"]], [Peer(**each) for each in record["peers"]])


def main() -> None:
    """Measure, record and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--document", action="store_true", help="only write the page from recorded figures")
    parser.add_argument("--cmsis", type=Path, help="folder with the source of CMSIS-DSP, to measure that as well")
    options = parser.parse_args()
    if not options.document:
        models = [measured(example, core) for example in EXAMPLES for core in CORES]
        peers = recorded().peers if options.cmsis is None else measured_peers(options.cmsis.resolve())
        record = {"models": [asdict(each) for each in models], "peers": [asdict(each) for each in peers]}
        RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(document(recorded()), encoding="utf-8")


if __name__ == "__main__":
    main()
