"""The C model beside the filters of CMSIS-DSP on a Cortex-M4: instructions a sample, and the worst error.

The source of CMSIS-DSP (Apache 2.0) is in the source archive of the PyPI package cmsisdsp; it is compiled as the plain
C that it has for compilers without the headers of a core. Its filters are given the sections of scipy, in the formats
that its documentation asks for, and run in blocks of all samples of a signal; ours is called for each.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from benchmarks.emulated_core import emulated
from scipy import signal

from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import load
from sosmith.model.dataflow.c_model import c_header, c_source

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = "audio_lowpass"
SAMPLES = 600
_CORE = "-mcpu=cortex-m4"
_FLOAT = ("-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
_KINDS = {
    "q15": ("int16_t", "arm_biquad_cascade_df1_q15", "arm_biquad_cascade_df1_init_q15", "arm_biquad_casd_df1_inst_q15"),
    "q31": ("int32_t", "arm_biquad_cascade_df1_q31", "arm_biquad_cascade_df1_init_q31", "arm_biquad_casd_df1_inst_q31"),
    "float": (
        "float",
        "arm_biquad_cascade_df2T_f32",
        "arm_biquad_cascade_df2T_init_f32",
        "arm_biquad_cascade_df2T_instance_f32",
    ),
}
"""Type, functions and instance of each filter of CMSIS-DSP."""


@dataclass(frozen=True)
class Peer:
    """A filter on the core.

    Attributes
    ----------
    filter : str
    instructions : float
        A sample.
    error : float
        Worst of all signals, in steps of 16 bits, against scipy's `sosfilt`.
    """

    filter: str
    instructions: float
    error: float


def signals() -> list[np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Return the signals, which begin with 0: a step, noise, and a small step."""
    step = np.full(SAMPLES, 16000)
    small = np.full(SAMPLES, 20)
    noise = np.random.default_rng(1).integers(-16000, 16001, SAMPLES)
    for each in (step, small, noise):
        each[0] = 0
    return [step, noise, small]


def measured(source: Path) -> list[Peer]:
    """Compile and run ours and those of CMSIS-DSP, whose source is in a folder."""
    spec = load(ROOT / "examples" / f"{EXAMPLE}.toml")
    sections = signal.butter(5, 2 * 1000 / spec.sample_rate, output="sos")
    rows = [_ours(sections)]
    for kind in _KINDS:
        rows.append(_theirs(kind, source, sections))
    return rows


def _error(results: Sequence[np.ndarray[tuple[int], np.dtype[np.int64]]], sections: np.ndarray) -> float:
    return max(
        float(np.abs(result - signal.sosfilt(sections, each.astype(float))).max())
        for result, each in zip(results, signals(), strict=True)
    )


def _array(values: Sequence[object]) -> str:
    return "{" + ", ".join(map(str, values)) + "}"


def _ours(sections: np.ndarray) -> Peer:
    datapath = design_core(load(ROOT / "examples" / f"{EXAMPLE}.toml")).datapath
    given = ", ".join(_array(each.tolist()) for each in signals())
    main = f"""#include "{EXAMPLE}.h"
void write_out(const void *, int);
static const int16_t given[3][{SAMPLES}] = {{ {given} }};
void run(void)
{{
    static int32_t results[{SAMPLES}];
    for (int k = 0; k < 3; k++) {{
        {EXAMPLE}_state state = {{0}};
        for (int n = 0; n < {SAMPLES}; n++)
            results[n] = (int32_t){EXAMPLE}_step(&state, given[k][n], NULL);
        write_out(results, (int)sizeof results);
    }}
}}
"""
    with tempfile.TemporaryDirectory() as folder:
        texts = {"main.c": main, f"{EXAMPLE}.c": c_source(datapath), f"{EXAMPLE}.h": c_header(datapath)}
        run = emulated(Path(folder), [_CORE], texts, [f"{EXAMPLE}.c", "main.c"], lambda name: name.endswith("_step"))
    results = np.frombuffer(run.written, dtype=np.int32).reshape(3, SAMPLES).astype(np.int64)
    return Peer("sosmith", run.instructions / (3 * SAMPLES), _error(list(results), sections))


def _theirs(kind: str, source: Path, sections: np.ndarray) -> Peer:
    number, process, prepare, instance = _KINDS[kind]
    scale = {"q15": 1, "q31": 1 << 16, "float": 2.0**-15}[kind]
    coefficients: list[object] = []
    for row in sections.tolist():
        gain = sum(row[3:]) / sum(row[:3])  # then each section has a gain of 1 at 0 Hz, as fixed point needs
        b0, b1, b2 = (value * gain for value in row[:3])
        a1, a2 = row[4:]
        if kind == "float":
            coefficients += [b0, b1, b2, -a1, -a2]
            continue
        bits = {"q15": 14, "q31": 30}[kind]  # halves, as they are below 2
        words = [round(value * 2**bits) for value in (b0, b1, b2, -a1, -a2)]
        coefficients += [words[0], 0, *words[1:]] if kind == "q15" else words
    shift = "" if kind == "float" else ", 1"
    given = ", ".join(_array([value * scale for value in each.tolist()]) for each in signals())
    main = f"""#include "dsp/filtering_functions.h"
void write_out(const void *, int);
static const {number} given[3][{SAMPLES}] = {{ {given} }};
static const {number} coefficients[] = {_array(coefficients)};
void run(void)
{{
    static {number} results[{SAMPLES}], state[{4 * len(sections)}];
    for (int k = 0; k < 3; k++) {{
        {instance} filter;
        {prepare}(&filter, {len(sections)}, coefficients, state{shift});
        {process}(&filter, given[k], results, {SAMPLES});
        write_out(results, (int)sizeof results);
    }}
}}
"""
    functions = source / "Source" / "FilteringFunctions"
    options = [_CORE, *_FLOAT, "-D__GNUC_PYTHON__", f"-I{source / 'Include'}", f"-I{source / 'PrivateInclude'}"]
    with tempfile.TemporaryDirectory() as folder:
        sources = ["main.c", *(str(functions / f"{name}.c") for name in (process, prepare))]
        texts = {"main.c": main, "math.h": "float sqrtf(float);\n"}
        run = emulated(Path(folder), options, texts, sources, lambda name: name == process or name.startswith("__"))
    results = np.frombuffer(run.written, dtype={"int16_t": np.int16, "int32_t": np.int32, "float": np.float32}[number])
    rounded = np.floor(results.reshape(3, SAMPLES).astype(float) / scale + 0.5)
    return Peer(f"CMSIS-DSP {kind}", run.instructions / (3 * SAMPLES), _error(list(rounded), sections))
