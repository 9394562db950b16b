"""Measures how long designs and their verification take, for docs/speed.md: `python -m benchmarks.design`.

Every specification is designed with `auto` for realization and architecture in a fresh process, and its certificate is
verified by the independent method. All times are processor time, and the fastest of several runs counts. Beside each
design, the same process computes the filter's impulse response sample by sample in Python integers, as it would be
without block recursions: the ratio of the two does not depend much on the machine. The figures are recorded in
benchmarks/design.json; `--document` only writes the section of the document from that record again. `--check` writes
nothing, and fails if a design has lost more than 25 % of its recorded speed beside that recursion, takes longer than it
may, or is verified more slowly than it was designed.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command `sosmith` does, before NumPy is imported

from benchmarks.speed_page import Benchmark

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.verify.verification import verify

ORDERS = (2, 4, 8, 12)
CUTOFFS = ("0.0001", "0.001", "0.01", "0.1")
BAND = "0.0026, 0.0052"
GOALS = {("lowpass", 8, "0.0001"): 10.0, ("bandpass", 6, BAND): 8.0, ("lowpass", 12, "0.001"): 30.0}
"""Seconds that a design may take."""
CASES = [("lowpass", order, cutoff) for order in ORDERS for cutoff in CUTOFFS] + [("bandpass", 6, BAND)]
"""Kind, order, and edges as fractions of the sample rate."""
LOSS = 0.25
"""Share of the recorded ratio that may be lost."""
SAMPLES = 1_000_000
"""Steps of the recursion in Python integers."""

SPECIFICATION = """
name = "measured"
sample_rate = 1.0
[input.x]
bits = {bits_in}
signed = true
range = [-1.0, 1.0]
[filter]
family = "{family}"
kind = "{kind}"
method = "bilinear"
order = {order}
cutoff = {cutoff}
{losses}
[output]
bits = {bits_out}
signed = true
range = [-1.0, 1.0]
unit = ""
max_error = "faithful"
[hardware]
realization = "auto"
architecture = "auto"
clock = 1000.0
reload = false
"""


@dataclass(frozen=True)
class Times:
    """Processor time of one design, in seconds.

    Attributes
    ----------
    kind, order, cutoff : str, int, str
        The filter, Butterworth; its order, or that of its prototype in a band-pass; edges as fractions of the sample
        rate.
    realization : str
        The one chosen.
    design, verification : float
        Time of the design with its certificate, and of its verification.
    recursion : float
        Time of `SAMPLES` steps of one section's recursion in Python integers.
    """

    kind: str
    order: int
    cutoff: str
    realization: str
    design: float
    verification: float
    recursion: float

    @property
    def name(self) -> str:
        """What is designed."""
        return f"{self.kind}, order {self.order}, {self.cutoff}"

    @property
    def ratio(self) -> float:
        """Speed of the design beside that of the recursion."""
        return self.recursion / self.design


def specification(kind: str, order: int, cutoff: str, **other: object) -> str:
    """Return a specification, TOML; Butterworth with 16 bits in and out unless `other` says otherwise."""
    edges = f"[{cutoff}]" if "," in cutoff else cutoff
    default: dict[str, object] = {"family": "butterworth", "bits_in": 16, "bits_out": 16, "losses": ""}
    return SPECIFICATION.format(kind=kind, order=order, cutoff=edges, **(default | other))


def goal_of(row: Times) -> float:
    """Seconds that a design may take."""
    return GOALS.get((row.kind, row.order, row.cutoff), math.inf)


def seconds(work: Callable[[], object]) -> float:
    """Measure the processor time of something."""
    start = time.process_time()
    work()
    return time.process_time() - start


def designed(text: str) -> tuple[str, float, float]:
    """Design and verify; return the realization, and the seconds of both."""
    spec = from_text(text, Path("measured.toml"))
    start = time.process_time()
    made = design_core(spec)
    proof = certificate(made.quantized, spec.max_error)
    between = time.process_time()
    verify(proof)
    return made.quantized.realization, between - start, time.process_time() - between


def recursion() -> None:
    """Compute `SAMPLES` samples of a section's response in Python integers of 100 bits."""
    first, second = 1 << 100, 0
    a1, a2 = (1 << 17) - 37, (1 << 16) - 35
    for _ in range(SAMPLES):
        first, second = (a1 * first - a2 * second) >> 16, first


def measured(case: tuple[str, int, str]) -> Times:
    """Measure one case once, in this process."""
    realization, design, verification = designed(specification(*case))
    return Times(*case, realization, design, verification, seconds(recursion))


def measure(repeats: int) -> list[Times]:
    """Measure every case in fresh processes, one after the other."""
    rows = []
    with ProcessPoolExecutor(max_workers=1, max_tasks_per_child=1) as processes:
        for case in CASES:
            runs = [processes.submit(measured, case).result() for _ in range(repeats)]
            rows.append(
                Times(
                    *case,
                    runs[0].realization,
                    *(min(getattr(run, part) for run in runs) for part in ("design", "verification", "recursion")),
                )
            )
            print(f"{rows[-1].name}: {rows[-1].design:.1f} s", flush=True)
    return rows


def table(rows: list[Times]) -> str:
    """Return the times as a table in Markdown."""
    lines = [
        "| filter | order | cutoff | chosen | design, s | goal, s | verification, s | beside the recursion |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        goal = goal_of(row)
        figures = (f"{row.design:.2f}", "" if goal == math.inf else f"{goal:g}", f"{row.verification:.2f}")
        name = f"{row.kind} | {row.order} | {row.cutoff} | {row.realization}"
        lines.append(f"| {name} | {' | '.join(figures)} | {row.ratio:.3f} |")
    return "\n".join(lines) + "\n"


def section(rows: list[Times]) -> str:
    """Return the section of the document."""
    return f"""
## Design

Written by `python -m benchmarks.design` from the times that it records in `benchmarks/design.json`. `--check` measures
again and fails if a design has lost more than {LOSS:.0%} of its speed beside a recursion in Python integers, takes
longer than its goal, or is verified more slowly than it was designed.

Butterworth filters with 16 bits in and out, faithful, designed with `auto` for realization and architecture; the order
of a band-pass is that of its prototype, and cutoffs are fractions of the sample rate. Times are seconds of processor
time, of the fastest of several runs in fresh processes: those of the design with its certificate, and those of its
verification by the independent method. The recursion is {SAMPLES:,} steps of one section in Python integers.

{table(rows)}
"""


def losses(old: list[Times], new: list[Times]) -> list[str]:
    """Say which designs have lost speed beside the recursion, and which take too long."""
    faults = [
        f"{before.name}: the design must reach {(1 - LOSS) * before.ratio:.3f} of the recursion's speed, "
        f"not {after.ratio:.3f}"
        for before, after in zip(old, new, strict=True)
        if after.ratio < (1 - LOSS) * before.ratio
    ]
    for row in new:
        if row.design >= goal_of(row):
            faults.append(f"{row.name}: the design must take less than {goal_of(row):g} s, not {row.design:.1f} s")
        if row.verification >= row.design:
            faults.append(
                f"{row.name}: verification must take less than the design's {row.design:.2f} s, "
                f"not {row.verification:.2f} s"
            )
    return faults


BENCHMARK = Benchmark(name="design", row=Times, measure=measure, section=section, tables=table, losses=losses)

if __name__ == "__main__":
    BENCHMARK.main(__doc__, repeats=3)
