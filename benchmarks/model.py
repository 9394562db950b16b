"""Measures how fast the compiled integer model is beside scipy, for docs/speed.md: `python -m benchmarks.model`.

Both compute the same channels of the same random codes, in turn. A rate is that of the fastest of several runs, in
samples a second of processor time, over all channels; where the core has a calibration, scipy's side evaluates the
polynomial in NumPy before it filters. The rates are recorded in benchmarks/model.json; `--document` only writes the
section of the document from that record again. `--check` writes nothing, and fails if the model has lost more than 25 %
of its recorded speed beside scipy, or is slower than scipy.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from benchmarks.speed_page import ROOT, Benchmark
from scipy import signal

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import load
from sosmith.model.arrays import Codes, Values

EXAMPLES = ROOT / "examples"
CORES = (
    ("audio_lowpass", "filter"),
    ("flange_wear_bench", "filter"),
    ("flange_wear_bench", "instrument"),
    ("flange_wear_locomotive", "filter"),
    ("flange_wear_locomotive", "instrument"),
)
CHANNELS = (1, 12)
SAMPLES = 1_200_000
"""Samples in one run, over all channels."""
LOSS = 0.25
"""Share of the recorded ratio that may be lost."""


@dataclass(frozen=True)
class Rates:
    """Speed of one core's model.

    Attributes
    ----------
    example, core : str
        Name of the specification, and whether its calibration is part of the core.
    channels : int
        Channels computed at once.
    model, scipy : float
        Samples a second, over all channels, of the integer model and of scipy.
    """

    example: str
    core: str
    channels: int
    model: float
    scipy: float

    @property
    def ratio(self) -> float:
        """Speed of the model beside that of scipy."""
        return self.model / self.scipy


def in_scipy(design: CoreDesign) -> Callable[[Codes], Values]:
    """Return scipy's side: codes, shape (samples, channels, inputs), to values, shape (samples, channels)."""
    inputs, polynomial, filtering = design.datapath.inputs, design.quantized.polynomial, design.quantized.filter
    assert filtering is not None

    def chain(codes: Codes) -> Values:
        physical = [port.decode(codes[..., index]) for index, port in enumerate(inputs)]
        values = physical[0] if polynomial is None else polynomial(*physical)
        return np.asarray(signal.sosfilt(filtering.sos, values, axis=0))

    return chain


def measured(design: CoreDesign, channels: int, samples: int, repeats: int) -> tuple[float, float]:
    """Measure the samples a second of model and scipy: `samples` of each channel, the fastest of `repeats` runs."""
    rng = np.random.default_rng(1)
    ports = design.datapath.inputs
    codes = np.stack([rng.integers(port.lowest, port.highest + 1, (samples, channels)) for port in ports], axis=-1)
    sides: tuple[Callable[[Codes], object], ...] = (design.datapath.compute, in_scipy(design))
    seconds: tuple[list[float], ...] = ([], [])
    design.datapath.compute(codes[:1])  # compiles it
    for _ in range(repeats):
        for side, durations in zip(sides, seconds, strict=True):
            start = time.thread_time()
            side(codes)
            durations.append(time.thread_time() - start)
    ours, theirs = (samples * channels / min(durations) for durations in seconds)
    return ours, theirs


def measure(repeats: int) -> list[Rates]:
    """Measure every core with every number of channels."""
    rows = []
    for example, core in CORES:
        design = design_core(load(EXAMPLES / f"{example}.toml"), core=core)
        for channels in CHANNELS:
            rates = measured(design, channels, SAMPLES // channels, repeats)
            rows.append(Rates(example, core, channels, *rates))
    return rows


def table(rows: list[Rates]) -> str:
    """Return the rates as a table in Markdown."""
    lines = [
        "| specification | core | channels | integer model | scipy | beside scipy |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        figures = f"{row.model / 1e6:.0f} | {row.scipy / 1e6:.0f} | {row.ratio:.2f}"
        lines.append(f"| {row.example} | {row.core} | {row.channels} | {figures} |")
    return "\n".join(lines) + "\n"


def section(rows: list[Rates]) -> str:
    """Return the section of the document."""
    return f"""
## The bit-true model

Written by `python -m benchmarks.model` from the rates that it records in `benchmarks/model.json`. `--check` measures
again and fails if the model has lost more than {LOSS:.0%} of its speed beside scipy, or is slower than scipy.

The compiled integer model (`Datapath.compute`, with its check of the codes) and scipy's `sosfilt` in double precision,
behind NumPy's polynomial where there is a calibration, on the same {SAMPLES:,} random samples. Rates are millions of
samples a second of processor time, over all channels; the fastest of several runs in turn counts.

{table(rows)}
"""


def losses(old: list[Rates], new: list[Rates]) -> list[str]:
    """Say which models have lost speed beside scipy, or are slower."""
    faults = []
    for before, after in zip(old, new, strict=True):
        least = max(1.0, (1 - LOSS) * before.ratio)
        if after.ratio < least:
            name = f"{after.example}, {after.core}, {after.channels} channels"
            faults.append(f"{name}: the model must reach {least:.2f} of scipy's speed, not {after.ratio:.2f}")
    return faults


BENCHMARK = Benchmark(name="model", row=Rates, measure=measure, section=section, tables=table, losses=losses)

if __name__ == "__main__":
    BENCHMARK.main(__doc__, repeats=10)
