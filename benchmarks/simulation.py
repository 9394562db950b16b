"""Measures how fast co-simulations run, and writes docs/speed.md: `python -m benchmarks.simulation`.

The locomotive's instrument runs on one core of the machine in three benches, in turn: the bench of `sosmith simulate`,
the same with its loop in Python, and a bare C++ loop around Verilator's model that checks the same rules
(`benchmarks/bare_loop.cpp`). The fastest of several runs counts. The figures are recorded in
benchmarks/simulation.json; `--document` only writes the document from that record again. `--check` writes nothing, and
fails if the bench has lost more than 15 % of its recorded speed beside the bare loop.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.core_facts import InterfaceFacts, core_facts
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import load
from sosmith.sim.beats import Beats
from sosmith.sim.bench import BenchRun
from sosmith.sim.simulator_bench import SimulatorBench
from sosmith.sim.simulators import find_simulator
from sosmith.sim.stream_packing import pack, random_order

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "simulation.json"
DOCUMENT = ROOT / "docs" / "speed.md"
EXAMPLE = "flange_wear_locomotive"
SAMPLES = {"parallel": (1_000_000, 20_000), "folded": (60_000, 1_500)}
"""Samples in the compiled loop and the bare one, and in Python."""
LOSS = 0.15
"""Share of the recorded ratio that may be lost."""
SEED = 1


@dataclass(frozen=True)
class Speeds:
    """Speeds of one core.

    Attributes
    ----------
    architecture : str
        Its architecture.
    samples, clocks : int
        Size of the run, in samples and clocks of the bench.
    bare, bench, python : float
        Clocks a second: of the bare loop, of the bench, and of the bench with its loop in Python.
    """

    architecture: str
    samples: int
    clocks: int
    bare: float
    bench: float
    python: float

    @property
    def ratio(self) -> float:
        """Speed of the bench beside that of the bare loop."""
        return self.bench / self.bare


def design(architecture: str) -> CoreDesign:
    """Design the instrument in one architecture."""
    spec = load(ROOT / "examples" / f"{EXAMPLE}.toml")
    hardware = replace(spec.hardware, architecture=architecture, clock=Fraction(10**9))
    return design_core(replace(spec, hardware=hardware))


def beats(made: CoreDesign, interface: InterfaceFacts, samples: int) -> Beats:
    """Random codes of all inputs."""
    rng = np.random.default_rng(SEED)
    codes = [rng.integers(port.lowest, port.highest + 1, (samples, 1)) for port in made.datapath.inputs]
    return pack(np.stack(codes, axis=-1), random_order(samples, 1, SEED), interface.inputs)


def build_bare(source: Path, top: str, folder: Path) -> Path:
    """Build the bare loop around a core; return the program."""
    tool = find_simulator("verilator", folder / "bin")

    def run(*command: str) -> str:
        return subprocess.run(
            command,
            cwd=folder,
            env=tool.environment,
            check=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ).stdout

    root = Path(run("verilator", "--getenv", "VERILATOR_ROOT").strip()) / "include"
    run(
        "verilator",
        "-cc",
        "-O3",
        "--x-initial",
        "unique",
        "-Wno-fatal",
        "--prefix",
        "Vtop",
        "--top-module",
        top,
        str(source),
    )
    files = [*sorted((folder / "obj_dir").glob("*.cpp")), ROOT / "benchmarks" / "bare_loop.cpp"]
    files += [root / "verilated.cpp", root / "verilated_threads.cpp"]
    includes = [f"-I{place}" for place in (folder / "obj_dir", root, root / "vltstd")]
    run("g++", "-O2", "-pthread", "-DVM_TRACE=0", *includes, "-o", "bare", *map(str, files))
    return folder / "bare"


def bare_speed(program: Path, sent: Beats, patience: int) -> float:
    """Run the bare loop; return its clocks a second."""
    words = program.parent / "words.bin"
    sent.tdata.tofile(words)
    command = [str(program), str(words), str(len(sent)), str(patience), str(SEED)]
    clocks, seconds, _ = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return int(clocks) / float(seconds)


def measured(architecture: str, repeats: int, folder: Path) -> Speeds:
    """Measure one core in all benches."""
    made = design(architecture)
    facts = core_facts(made)
    generate(made, folder, lambda step: None, facts=facts)
    source = folder / f"{made.datapath.name}.sv"

    def run(sent: Beats, *, compiled: bool) -> BenchRun:
        bench = SimulatorBench(source=source, interface=facts.interface, build_dir=folder, seed=SEED, compiled=compiled)
        return bench.run(sent, lambda done, total: None)

    long, short = SAMPLES[architecture]
    sent = beats(made, facts.interface, long)
    bare = build_bare(source, made.datapath.name, folder)
    patience = facts.interface.latency_cycles + facts.interface.reset_cycles
    speeds: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeats):
        speeds[0].append(bare_speed(bare, sent, patience))
        found = run(sent, compiled=True)
        speeds[1].append(found.cycles / found.seconds)
    slow = run(beats(made, facts.interface, short), compiled=False)
    return Speeds(architecture, long, found.cycles, max(speeds[0]), max(speeds[1]), slow.cycles / slow.seconds)


def measure(repeats: int) -> list[Speeds]:
    """Measure every core."""
    rows = []
    for architecture in SAMPLES:
        with tempfile.TemporaryDirectory(prefix="sosmith-") as folder:
            rows.append(measured(architecture, repeats, Path(folder)))
    return rows


def table(rows: list[Speeds]) -> str:
    """Return the speeds as a table in Markdown."""
    lines = [
        "| architecture | samples | clocks | bare loop | bench | beside the bare loop | loop in Python |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        speeds = (f"{speed / 1e6:.2f}" for speed in (row.bare, row.bench))
        figures = (*speeds, f"{row.ratio:.2f}", f"{row.python / 1e6:.3f}")
        lines.append(f"| {row.architecture} | {row.samples:,} | {row.clocks:,} | {' | '.join(figures)} |")
    return "\n".join(lines) + "\n"


def document(rows: list[Speeds]) -> str:
    """Return the document."""
    return f"""# How fast it runs

## Co-simulation

Written by `python -m benchmarks.simulation` from the figures that it records in `benchmarks/simulation.json`. `--check`
measures again and fails if the bench has lost more than {LOSS:.0%} of its speed beside the bare loop.

The instrument of {EXAMPLE} gets random samples with 30 % of the clocks idle and 30 % stalled, in bursts, and every
clock is checked. The bare loop is C++ around Verilator's model with the same checks (`benchmarks/bare_loop.cpp`): no
cocotb, no Python. The bench is that of `sosmith simulate`, and the loop in Python is the same bench as it runs in
Icarus and with `--waves`. Speeds are millions of clocks a second on one core of the machine, in the same model of the
same core; the fastest of several runs in turn counts.

{table(rows)}"""


def recorded() -> list[Speeds]:
    """Read the recorded figures."""
    return [Speeds(**row) for row in json.loads(RECORD.read_text(encoding="utf-8"))]


def losses(old: list[Speeds], new: list[Speeds]) -> list[str]:
    """Say which cores have lost speed beside the bare loop."""
    return [
        f"{before.architecture}: the bench must reach {(1 - LOSS) * before.ratio:.2f} of the bare loop's speed, "
        f"not {after.ratio:.2f}"
        for before, after in zip(old, new, strict=True)
        if after.ratio < (1 - LOSS) * before.ratio
    ]


def main() -> None:
    """Measure and write, or check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5, help="runs, of which the fastest counts")
    parser.add_argument("--check", action="store_true", help="fail if the bench has become slower")
    parser.add_argument("--document", action="store_true", help="only write the document from the record")
    options = parser.parse_args()
    rows = recorded() if options.document else measure(options.repeats)
    print(table(rows), end="")
    if options.check:
        if faults := losses(recorded(), rows):
            sys.exit("\n".join(faults))
        return
    if not options.document:
        RECORD.write_text(json.dumps([asdict(row) for row in rows], indent=2) + "\n", encoding="utf-8")
    DOCUMENT.write_text(document(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
