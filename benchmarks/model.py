"""Measures how fast the compiled integer model is beside scipy in double precision: `python -m benchmarks.model`.

Both compute the same channels of the same random codes on one core, in turn. A rate is that of the fastest of several
runs, in samples a second over all channels; where the core has a calibration, scipy's side evaluates the polynomial in
NumPy before it filters.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import signal

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import load
from sosmith.model.arrays import Codes, Values

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
CORES = (("audio_lowpass", "filter"), ("flange_wear_bench", "filter"), ("flange_wear_bench", "instrument"))
CHANNELS = (1, 2, 8)


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
            start = time.perf_counter()
            side(codes)
            durations.append(time.perf_counter() - start)
    ours, theirs = (samples * channels / min(durations) for durations in seconds)
    return ours, theirs


def measure(samples: int, repeats: int) -> list[Rates]:
    """Measure every core with every number of channels, about `samples` samples in all each time."""
    rows = []
    for example, core in CORES:
        design = design_core(load(EXAMPLES / f"{example}.toml"), core=core)
        for channels in CHANNELS:
            rates = measured(design, channels, max(1, samples // channels), repeats)
            rows.append(Rates(example, core, channels, *rates))
    return rows


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=2_000_000, help="samples in one run, over all channels")
    parser.add_argument("--repeats", type=int, default=10, help="runs, of which the fastest counts")
    parser.add_argument("--json", action="store_true", help="print JSON, rates in samples a second")
    options = parser.parse_args()
    rows = measure(options.samples, options.repeats)
    if options.json:
        print(json.dumps([asdict(row) for row in rows], indent=2))
        return
    table = Table(title="Million samples a second on one core, over all channels")
    for name in ("specification", "core", "channels", "integer model", "scipy", "ratio"):
        table.add_column(name, justify="left" if name in {"specification", "core"} else "right")
    for row in rows:
        figures = [f"{row.model / 1e6:.1f}", f"{row.scipy / 1e6:.1f}", f"{row.model / row.scipy:.2f}"]
        table.add_row(row.example, row.core, str(row.channels), *figures)
    Console().print(table)


if __name__ == "__main__":
    main()
