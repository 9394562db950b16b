"""Co-simulation of a chain: the top with all cores, against the integer models of the stages in series."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.generate import generate_chain
from sosmith.gen.chain.report.run import ChainRun, run_of
from sosmith.gen.chain.top import chain_interface
from sosmith.gen.output.vectors import whole_beats
from sosmith.model.arrays import Codes
from sosmith.model.text_files import write_files
from sosmith.sim.cosimulate import cosimulate
from sosmith.sim.simulation import alone_in
from sosmith.sim.simulator_bench import SimulatorBench
from sosmith.sim.simulators import check_name

Progress = Callable[[str, int, int], None]


def simulate_chain(
    design: ChainDesign,
    codes: Codes,
    directory: Path,
    *,
    simulator: str = "verilator",
    seed: int = 1,
    idle: float = 0.3,
    stall: float = 0.3,
    waves: bool = False,
    progress: Progress = lambda step, done, total: None,
) -> ChainRun:
    """Write a chain's files into `directory`, run codes of shape (samples, channels, inputs) through it, and compare.

    Raises
    ------
    ShortfallError
        If the hardware breaks a rule of the streams.
    ToolError
        If a tool is missing or fails.
    SpecificationError
        If there is no such simulator, or the folder cannot be written or is in use by another run.
    """
    started = time.monotonic()
    check_name(simulator, netlist=False)
    with alone_in(directory):
        for stale in ("report.json", "report.html"):
            (directory / stale).unlink(missing_ok=True)
        generate_chain(design, directory, lambda step: progress(f"generating {step}", 0, 0))
        interface = chain_interface(design)
        folder = directory / "simulation"
        (source,) = write_files(folder, {f"{design.name}_whole.sv": whole_text(design, directory)})
        bench = SimulatorBench(
            source=source,
            interface=interface,
            build_dir=folder,
            simulator=simulator,
            seed=seed,
            idle=idle,
            stall=stall,
            waves=waves,
            announce=lambda step: progress(step, 0, 0),
        )
        sent = whole_beats(codes, interface.inputs)
        result = cosimulate(
            bench, interface, sent, seed=seed, progress=lambda done, total: progress("co-simulating", done, total)
        )
    progress("comparing", 0, 0)
    return replace(
        run_of(design, codes, result.codes[:, :, 0], result.status),
        cycles=result.cycles,
        simulator=result.simulator,
        tools=dict(result.tools),
        seed=seed,
        cycles_per_second=result.cycles_per_second,
        wall_seconds=time.monotonic() - started,
    )


def whole_text(design: ChainDesign, directory: Path) -> str:
    """Return the SystemVerilog of a chain in one text: the cores' and the top's, as they were written."""
    names = [*(module for stage in design.stages for module in stage.modules), design.name]
    return "\n".join((directory / f"{name}.sv").read_text(encoding="utf-8") for name in names)
