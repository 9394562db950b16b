"""One co-simulation from design to report: hardware, integer model and golden chain on the same input codes."""

from __future__ import annotations

import fcntl
import hashlib
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.synthesis import Netlist, synthesize
from sosmith.gen.output.core_facts import CoreFacts, InterfaceFacts, core_facts
from sosmith.gen.output.generate import generate
from sosmith.gen.output.vectors import Vectors, vector_files, whole_beats
from sosmith.gen.report.evidence import Alternative, Evidence
from sosmith.gen.report.input_ranges import input_ranges
from sosmith.gen.report.provenance import provenance_of
from sosmith.gen.report.recursion import recursion_of
from sosmith.gen.report.run import Run, run_of
from sosmith.gen.specification.choices import ERROR_FEEDBACK
from sosmith.gen.word_lengths.other_realization import with_realization
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.arrays import Codes, side_by_side
from sosmith.model.errors import SpecificationError
from sosmith.model.reference.accuracy import peak, sum_of_squares
from sosmith.model.text_files import write_contents, write_files
from sosmith.model.traces.trace import Trace
from sosmith.sim.cosimulate import CosimulationResult, cosimulate, first_copies
from sosmith.sim.gate_level import with_cell_models
from sosmith.sim.simulator_bench import SimulatorBench
from sosmith.sim.simulators import check_name
from sosmith.verify.certificate_file import Certificate

_BLOCK = 1 << 20  # results that are compared at a time

Progress = Callable[[str, int, int], None]
"""Called with the name of the step, the amount done and the total; the total is 0 if it is not known."""

Hardware = Callable[[str, Codes, Callable[[int, int], None]], CosimulationResult]
"""Hardware with a core: takes its SystemVerilog, codes of shape (samples, channels, inputs), and whom to tell."""


def simulate(
    design: CoreDesign,
    traces: Sequence[Trace],
    directory: Path,
    *,
    simulator: str = "verilator",
    seed: int = 1,
    idle: float = 0.3,
    stall: float = 0.3,
    waves: bool = False,
    gates: Board | None = None,
    vectors: Path | None = None,
    hardware: Hardware | None = None,
    date: str | None = None,
    uncertainty: dict[str, Any] | None = None,
    facts: CoreFacts | None = None,
    claims: Certificate | None = None,
    progress: Progress = lambda step, done, total: None,
) -> Evidence:
    """Generate the core into `directory`, run `traces` through it, and compare it with model and golden chain.

    There is one trace for each channel, all of the same length. With `gates`, the simulation runs the netlist
    synthesized for that board; with `hardware`, that runs the core, and nothing is simulated. With `vectors`, what went
    in and what came out is written to that file, in the format of its suffix
    (`sosmith.gen.output.vectors.vector_files`). `uncertainty` is the budget of the instrument, in the types of JSON,
    for the report; None where there is none. `facts` and `claims` are what `sosmith.gen.output.generate.generate`
    takes.

    Raises
    ------
    ShortfallError
        If the hardware breaks the stream protocol.
    ToolError
        If a tool is missing or fails.
    SpecificationError
        If there is no such simulator or format of vectors, or the folder cannot be written or is in use by another run.
    """
    started = time.monotonic()
    check_name(simulator, netlist=gates is not None)
    with alone_in(directory):
        for stale in ("report.json", "report.html"):  # of a run of another core, in case this run fails
            (directory / stale).unlink(missing_ok=True)
        facts = facts or core_facts(design)
        paths = generate(
            design, directory, lambda step: progress(f"generating {step}", 0, 0), facts=facts, claims=claims
        )
        source, netlist = directory / f"{design.datapath.name}.sv", None
        codes = side_by_side([trace.codes for trace in traces])
        sent = whole_beats(codes, facts.interface.inputs)
        if hardware is not None:
            result = _results_of(hardware, source, sent, facts.interface, progress)
        else:
            folder = directory / "simulation"
            if gates is not None:
                folder = directory / "gates" / gates.name
                source, netlist = _gate_level(design, source, gates, folder, progress)
            bench = SimulatorBench(
                source=source,
                interface=facts.interface,
                build_dir=folder,
                simulator=simulator,
                seed=seed,
                idle=idle,
                stall=stall,
                waves=waves,
                announce=lambda step: progress(step, 0, 0),
            )
            result = cosimulate(
                bench,
                facts.interface,
                sent,
                seed=seed,
                progress=lambda done, total: progress("co-simulating", done, total),
            )
    if vectors is not None:
        progress("writing the vectors", 0, 0)
        taken = _taken(sent if vectors.suffix == ".hex" else codes, result, facts.interface)
        if hardware is not None:  # which has a result for each sample
            taken = replace(taken, responses=taken.responses[: len(sent)], status=taken.status[: len(sent)])
        write_contents(vectors.parent, vector_files(vectors, taken, facts.interface, design.spec.sample_rate))
    progress("comparing", 0, 0)
    run = run_of(design, traces, result.codes[:, :, 0], result.status, cycles=result.cycles)
    # The run holds them in less memory, of which ten million samples take much.
    result = replace(result, codes=result.codes[:0].copy(), status=result.status[:0].copy())
    del sent
    return Evidence(
        facts=facts,
        run=run,
        simulator=result.simulator,
        seed=seed,
        tools=result.tools if netlist is None else {**result.tools, "yosys": netlist.version},
        wall_seconds=time.monotonic() - started,
        cycles_per_second=result.cycles_per_second,
        gates=netlist,
        recursions=tuple(recursion_of(section.name, section.graph) for section in design.quantized.sections),
        alternatives=_alternatives(design.quantized, run),
        uncertainty=uncertainty,
        provenance=provenance_of(design, traces, netlist),
        specification=design.spec.path.name,
        files={path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths},
        date=date,
        input_ranges=input_ranges(traces),
    )


def _results_of(
    hardware: Hardware, source: Path, sent: Codes, interface: InterfaceFacts, progress: Progress
) -> CosimulationResult:
    """Return the results of hardware, which has one for each sample, each of them once."""
    text = source.read_text(encoding="utf-8")
    return first_copies(
        hardware(text, sent, lambda done, total: progress("running", done, total)), interface.samples_per_result
    )


def _gate_level(
    design: CoreDesign, source: Path, board: Board, folder: Path, progress: Progress
) -> tuple[Path, Netlist]:
    """Synthesize a core for a board into a folder; return what is simulated instead of its source, and the netlist."""
    progress(f"synthesizing for {board.title}", 0, 0)
    netlist = synthesize(source, design.datapath.name, board, folder)
    return with_cell_models(netlist, scrambled=not design.spec.hardware.reload), netlist


@contextmanager
def alone_in(directory: Path) -> Iterator[None]:
    """Lock `directory`, made if missing, so that no second run can mix its files with those of this one."""
    write_files(directory, {})
    handle = os.open(directory, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise SpecificationError(
                f"{directory}: the output folder must be free, not in use by another run; choose one with -o"
            ) from None
        yield
    finally:
        os.close(handle)


def _taken(codes: Codes, result: CosimulationResult, interface: InterfaceFacts) -> Vectors:
    """Return the vectors of a run with these samples; results are those that they bring."""
    results, copies = -(-len(codes) // interface.samples_per_result), interface.copies_per_result
    return Vectors(
        stimuli=codes,
        responses=np.repeat(result.codes[:results, :, 0], copies, axis=0),
        status=np.repeat(result.status[:results], copies, axis=0),
    )


def _alternatives(quantized: Quantized, run: Run) -> list[Alternative]:
    """Run the integer model of every other realization on the same input, with the same word lengths."""
    if quantized.realization not in ERROR_FEEDBACK or not quantized.sections:
        return []
    rows = []
    for realization in ERROR_FEEDBACK:
        if realization == quantized.realization:
            continue
        other = with_realization(quantized, realization).datapath
        codes, golden = other.compute(run.codes).reshape(-1), run.golden.reshape(-1)
        peaks, squares = [], []
        for start in range(0, len(codes), _BLOCK):
            error = other.output.decode(codes[start : start + _BLOCK])
            error -= golden[start : start + _BLOCK]
            peaks.append(peak(error))
            squares.append(sum_of_squares(error))
        rms = math.sqrt(math.fsum(squares) / len(codes))
        rows.append(Alternative(name=realization, max_abs=max(peaks), rms=rms))
    return rows
