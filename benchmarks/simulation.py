"""Measures how fast co-simulations run and are built, for docs/speed.md: `python -m benchmarks.simulation`.

The locomotive's instrument runs in four benches, in turn: the bench of `sosmith simulate` in Verilator and in CXXRTL,
the one in Verilator with its loop in Python, and a bare C++ loop around Verilator's model that checks the same rules
(`benchmarks/bare_loop.cpp`). All times are processor time, and the fastest of several runs counts. The figures are
recorded in benchmarks/simulation.json; `--document` only writes the section of the document from that record again.
`--check` writes nothing, and fails if the bench has lost more than 15 % of its recorded speed beside the bare loop, or
if a build takes longer than it may.
"""

from __future__ import annotations

import resource
import secrets
import subprocess
import tempfile
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.speed_page import ROOT, Benchmark

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.core_facts import InterfaceFacts, core_facts
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import load
from sosmith.sim.beats import Beats
from sosmith.sim.bench import BenchRun
from sosmith.sim.cxxrtl_model import build_cxxrtl
from sosmith.sim.simulator_bench import SimulatorBench, optional_signals, ports_of
from sosmith.sim.simulators import find_simulator
from sosmith.sim.stream_packing import pack, random_order
from sosmith.sim.verilated_model import Builder, Model

EXAMPLE = "flange_wear_locomotive"
SAMPLES = {"parallel": (1_000_000, 20_000), "folded": (60_000, 1_500)}
"""Samples in the compiled loop and the bare one, and in Python."""
LOSS = 0.15
"""Share of the recorded ratio that may be lost."""
BUILD = 4.0
"""Seconds that building for a new core may take once the cache has Verilator's library."""
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
    bare, bench, python, cxxrtl : float
        Clocks a second: of the bare loop, of the bench in Verilator, of that with its loop in Python, and of the bench
        in CXXRTL.
    build, cxxrtl_build : float
        Seconds that building for the core takes, for Verilator and for CXXRTL.
    """

    architecture: str
    samples: int
    clocks: int
    bare: float
    bench: float
    python: float
    cxxrtl: float
    build: float
    cxxrtl_build: float

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


def build_seconds(source: Path, interface: InterfaceFacts, folder: Path) -> tuple[float, float]:
    """Measure how long building takes for a core that the cache does not have, for Verilator and for CXXRTL."""
    new = folder / "new.sv"
    # A comment would not make it new to the cache.
    text = f"{source.read_text(encoding='utf-8')}\nmodule new_{secrets.token_hex()};\nendmodule\n"
    new.write_text(text, encoding="utf-8")
    signals = tuple(optional_signals(interface))
    model = Model(source=new, top=interface.name, ports=tuple(ports_of(interface)), signals=signals, waves=False)
    tool = find_simulator("verilator", folder / "bin")
    with (folder / "build.log").open("w", encoding="utf-8") as log:
        builder = Builder(tool.version, tool.environment, folder, log)
        started = _children_seconds()
        builder.build(model, folder / "new")
        between = _children_seconds()
        build_cxxrtl(new, interface.name, signals, tool.environment, folder, folder / "new.so")
        return between - started, _children_seconds() - between


def _children_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measured(architecture: str, repeats: int, folder: Path) -> Speeds:
    """Measure one core in all benches."""
    made = design(architecture)
    facts = core_facts(made)
    generate(made, folder, lambda step: None, facts=facts)
    source = folder / f"{made.datapath.name}.sv"

    def run(sent: Beats, **options: Any) -> BenchRun:
        bench = SimulatorBench(source=source, interface=facts.interface, build_dir=folder, seed=SEED, **options)
        return bench.run(sent, lambda done, total: None)

    def speed(found: BenchRun) -> float:
        return found.cycles / found.seconds

    long, short = SAMPLES[architecture]
    sent = beats(made, facts.interface, long)
    bare = build_bare(source, made.datapath.name, folder)
    patience = facts.interface.latency_cycles + facts.interface.reset_cycles
    speeds: dict[str, list[float]] = {"bare": [], "bench": [], "cxxrtl": []}
    for _ in range(repeats):
        speeds["bare"].append(bare_speed(bare, sent, patience))
        found = run(sent)
        speeds["bench"].append(speed(found))
        speeds["cxxrtl"].append(speed(run(sent, simulator="cxxrtl")))
    builds = [build_seconds(source, facts.interface, folder) for _ in range(repeats)]
    build, cxxrtl_build = (min(times) for times in zip(*builds, strict=True))
    return Speeds(
        architecture=architecture,
        samples=long,
        clocks=found.cycles,
        **{name: max(each) for name, each in speeds.items()},
        python=speed(run(beats(made, facts.interface, short), compiled=False)),
        build=build,
        cxxrtl_build=cxxrtl_build,
    )


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
        "| architecture | samples | clocks | bare loop | bench | beside the bare loop | loop in Python | CXXRTL |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        bare, bench, cxxrtl = (f"{speed / 1e6:.2f}" for speed in (row.bare, row.bench, row.cxxrtl))
        figures = (bare, bench, f"{row.ratio:.2f}", f"{row.python / 1e6:.3f}", cxxrtl)
        lines.append(f"| {row.architecture} | {row.samples:,} | {row.clocks:,} | {' | '.join(figures)} |")
    return "\n".join(lines) + "\n"


def build_table(rows: list[Speeds]) -> str:
    """Return how long building takes as a table in Markdown."""
    lines = ["| architecture | for Verilator, s | for CXXRTL, s |", "|---|---|---|"]
    lines += [f"| {row.architecture} | {row.build:.1f} | {row.cxxrtl_build:.1f} |" for row in rows]
    return "\n".join(lines) + "\n"


def tables(rows: list[Speeds]) -> str:
    """Return both tables."""
    return f"{table(rows)}\n{build_table(rows)}"


def section(rows: list[Speeds]) -> str:
    """Return the section of the document."""
    return f"""
## Co-simulation

Written by `python -m benchmarks.simulation` from the figures that it records in `benchmarks/simulation.json`. `--check`
measures again and fails if the bench has lost more than {LOSS:.0%} of its speed beside the bare loop, or if a build for
Verilator takes more than {BUILD:g} s.

The instrument of {EXAMPLE} gets random samples with 30 % of the clocks idle and 30 % stalled, in bursts, and every
clock is checked. The bare loop is C++ around Verilator's model with the same checks (`benchmarks/bare_loop.cpp`): no
cocotb, no Python. The bench is that of `sosmith simulate`, and the loop in Python is the same bench as it runs in
Icarus and with `--waves`. Speeds are millions of clocks a second of processor time, on one core of the machine, for the
same core; the fastest of several runs in turn counts.

{table(rows)}
Building for a core that was never simulated before, once the cache has Verilator's library, takes this much processor
time:

{build_table(rows)}
"""


def losses(old: list[Speeds], new: list[Speeds]) -> list[str]:
    """Say which cores have lost speed beside the bare loop, and which take too long to build."""
    faults = [
        f"{before.architecture}: the bench must reach {(1 - LOSS) * before.ratio:.2f} of the bare loop's speed, "
        f"not {after.ratio:.2f}"
        for before, after in zip(old, new, strict=True)
        if after.ratio < (1 - LOSS) * before.ratio
    ]
    return faults + [
        f"{row.architecture}: building for Verilator must take at most {BUILD:g} s, not {row.build:.1f} s"
        for row in new
        if row.build > BUILD
    ]


BENCHMARK = Benchmark(name="simulation", row=Speeds, measure=measure, section=section, tables=tables, losses=losses)

if __name__ == "__main__":
    BENCHMARK.main(__doc__, repeats=5)
