"""Reloads at random moments under random back-pressure: every sample is computed with one set, and the right one."""

import json
import os
import random
import sys
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from amaranth.hdl import Module
from cocotb_tools.runner import Icarus, Verilator
from tests.gen.designs import EXAMPLES
from tests.model.reload.swapping import compute_swapping

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.design import design
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.reload.other_constants import with_constants
from sosmith.gen.reload.register_writes import register_writes
from sosmith.gen.reload.reload import OtherSet, other_set, room_of
from sosmith.gen.specification.specification import load
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.hdl.cores.folded import FoldedCore
from sosmith.hdl.plan.streams import fields
from sosmith.model.polynomial import Polynomial
from sosmith.sim.simulators import find_simulator

RATIOS = ("0.8", "0.9", "1.1", "1.2")
"""Cutoffs of the sets over that of the core."""

ARCHITECTURES = ("parallel", "folded", "serial")

WORN = "worn"
"""The bench's instrument with limits of wear: a core that restarts with what is loaded."""


@cache
def hardware_in(architecture: str, example: str, channels: int = 1, start: str = "zero") -> CoreDesign:
    spec = load(EXAMPLES / f"{'flange_wear_bench' if example == WORN else example}.toml")
    if example == WORN:
        limits = WearSpec(initial=(Fraction(1),), warning=Fraction(4), limit=Fraction(6))
        spec = replace(spec, name=WORN, wear=limits)
    hardware = replace(
        spec.hardware, architecture=architecture, realization="df1_ef2", clock=Fraction(10**9), reload=True, start=start
    )
    return design_core(replace(spec, filter=replace(spec.filter, order=2), channels=channels, hardware=hardware))


@cache
def sets_for(architecture: str, example: str, start: str) -> list[OtherSet]:
    """Make other sets for the hardware: of filters, or of polynomials where it has one."""
    made = hardware_in(architecture, example, start=start)
    allowed = 4 * made.spec.max_error
    if made.quantized.polynomial is not None:
        rows = made.quantized.polynomial.coefficients
        scaled = [Polynomial(tuple(tuple(Fraction(ratio) * c for c in row) for row in rows)) for ratio in RATIOS]
        return [other_set(made, polynomial=polynomial, max_error=allowed) for polynomial in scaled]
    wanted = made.spec.filter
    assert wanted.cutoff is not None
    filters = [
        design(replace(wanted, cutoff=tuple(f * Fraction(ratio) for f in wanted.cutoff)), float(made.spec.sample_rate))
        for ratio in RATIOS
    ]
    return [other_set(made, ideal=ideal, max_error=allowed) for ideal in filters]


def writes_of(made: CoreDesign, other: OtherSet, version: int, *, wrong: bool) -> list[tuple[int, int]]:
    *writes, (register, crc) = register_writes(made, other, version)
    pairs = [(register.address, word) for register, word in writes]
    return [*pairs, (register.address, crc ^ (wrong << version % 32))]


def run(
    folder: Path,
    made: CoreDesign,
    source: str,
    count: int,
    seed: int,
    simulator: str = "icarus",
) -> tuple[dict[str, Any], list[int]]:
    """Simulate `count` loads, one in eight with a wrong CRC; return the outcome and which set each load has.

    Samples are random.
    """
    pace = random.Random(seed)
    sets = sets_for(made.architecture.name, made.spec.name, made.spec.hardware.start)
    chosen = [pace.randrange(len(sets)) for _ in range(count)]
    wrong = [pace.randrange(8) == 0 for _ in range(count)]
    loads = [
        [writes_of(made, sets[kind], version + 1, wrong=bad), not bad]
        for version, (kind, bad) in enumerate(zip(chosen, wrong, strict=True))
    ]
    rng = np.random.default_rng(seed)
    ports = fields(made.datapath.inputs)
    columns = [rng.integers(f.port.lowest // 2, f.port.highest // 2, 256).tolist() for f in ports]
    codes = list(zip(*columns, strict=True))
    channels = made.spec.channels
    dests = rng.integers(channels, size=len(codes)).tolist() if channels > 1 else []
    job = {
        "dests": dests,
        "words": [
            sum(code % (1 << f.padded) << f.offset for f, code in zip(ports, sample, strict=True)) for sample in codes
        ],
        "loads": loads,
        "seed": seed,
        "folded": made.architecture.program is not None,
        "behind": False,
    }
    (folder / "core.sv").write_text(source)
    (folder / "job.json").write_text(json.dumps(job))
    tool = find_simulator(simulator, folder / "bin")
    # Where the simulator's Python looks, and where its programs are.
    with patch.object(sys, "path", [str(EXAMPLES.parent), *sys.path]), patch.dict(os.environ, tool.environment):
        runner = Icarus() if simulator == "icarus" else Verilator()
        runner.build(
            sources=[folder / "core.sv"],
            hdl_toplevel=made.datapath.name,
            build_dir=folder / "build",
            build_args=[] if simulator == "icarus" else ["-Wno-fatal", "-O3"],
            timescale=("1ns", "1ps"),
            always=True,
        )
        runner.test(
            test_module="tests.sim.reload_bench",
            hdl_toplevel=made.datapath.name,
            build_dir=folder / "build",
            test_dir=folder,
            extra_env={"RELOAD_BENCH": str(folder), "COCOTB_LOG_LEVEL": "WARNING"},
            timescale=("1ns", "1ps"),
        )
    outcome: dict[str, Any] = json.loads((folder / "outcome.json").read_text())
    assert outcome["refused"] == [number for number, bad in enumerate(wrong) if bad]
    assert outcome["accepted"] == [number for number, bad in enumerate(wrong) if not bad]
    taken = range(len(outcome["swaps"]))
    samples = [codes[k % len(codes)] for k in taken]
    sent = [dests[k % len(codes)] if dests else 0 for k in taken]
    return outcome | {"samples": samples, "dests": sent}, chosen


def expected(made: CoreDesign, outcome: dict[str, Any], chosen: list[int]) -> list[int]:
    """Return the output words in the order of the samples; each channel has its own states, and all one bank."""
    found = [0] * len(outcome["samples"])
    for channel in range(made.spec.channels):
        numbers = [number for number, dest in enumerate(outcome["dests"]) if dest == channel]
        for number, code in zip(numbers, _of_channel(made, outcome, chosen, numbers), strict=True):
            found[number] = code % (1 << 8 * made.datapath.output.bytes)
    return found


def _of_channel(made: CoreDesign, outcome: dict[str, Any], chosen: list[int], numbers: list[int]) -> list[int]:
    sets = sets_for(made.architecture.name, made.spec.name, made.spec.hardware.start)
    swaps, before = [], 0
    for turn, number in enumerate(numbers):
        swapped = outcome["swaps"][number]
        if swapped != before:
            swaps.append((turn, sets[chosen[outcome["accepted"][swapped - 1]]].quantized.datapath))
            before = swapped
    # A program keeps states with more fraction bits than the datapath has; in these, others take over.
    first = with_constants(made.quantized, None, None, room=room_of(made)).datapath
    return compute_swapping(first, swaps, np.array([outcome["samples"][number] for number in numbers]))


def verilog(made: CoreDesign) -> str:
    return to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))


MAX_IN_ICARUS = 100
"""Loads that Icarus simulates in seconds; more of them are for Verilator."""

COUNTS = [
    *(pytest.param(name, "audio_lowpass", 1, 60, id=f"{name}-60") for name in ARCHITECTURES),
    *(pytest.param(name, "audio_lowpass", 3, 40, id=f"{name}-3-channels") for name in ARCHITECTURES),
    pytest.param("parallel", "audio_lowpass", 20, 40, id="parallel-20-channels"),
    *(pytest.param(name, "flange_wear_bench", 1, 20, id=f"{name}-calibration") for name in ("parallel", "folded")),
    pytest.param("parallel", "flange_wear_bench", 20, 20, id="parallel-calibration-20-channels"),
    pytest.param("parallel", WORN, 1, 20, id="parallel-restarts"),
    *(
        pytest.param(name, WORN, 3, 20, id=f"{name}-restarts-3-channels", marks=pytest.mark.slow)
        for name in ARCHITECTURES
    ),
    *(
        pytest.param(name, "audio_lowpass", channels, count, id=f"{name}-{channels}-{count}", marks=pytest.mark.slow)
        for name in ARCHITECTURES
        for channels, count in ((1, 10_000), (12, 500), (20, 500))
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("architecture", "example", "channels"),
    [
        *((name, "audio_lowpass", channels) for name in ARCHITECTURES for channels in (1, 3)),
        ("parallel", "flange_wear_bench", 1),
        ("folded", "flange_wear_bench", 3),
    ],
)
def test_first_samples_are_held_through_reloads(architecture: str, example: str, channels: int, tmp_path: Path) -> None:
    made = hardware_in(architecture, example, channels, "steady")
    outcome, chosen = run(tmp_path, made, verilog(made), 40, 40)
    assert [word for _, word in outcome["received"]] == expected(made, outcome, chosen)


@pytest.mark.slow
@pytest.mark.parametrize(("architecture", "example", "channels", "count"), COUNTS)
def test_reloads_at_any_moment(architecture: str, example: str, channels: int, count: int, tmp_path: Path) -> None:
    made = hardware_in(architecture, example, channels)
    simulator = "verilator" if count > MAX_IN_ICARUS else "icarus"
    outcome, chosen = run(tmp_path, made, verilog(made), count, count, simulator)
    assert outcome["swaps"][-1] == len(outcome["accepted"])
    assert len(set(outcome["swaps"])) > count // 2  # most sets were used by a sample
    assert [word for _, word in outcome["received"]] == expected(made, outcome, chosen)
    assert [dest for dest, _ in outcome["received"]] == outcome["dests"]


@pytest.mark.slow
def test_a_sample_that_sees_two_banks_is_noticed(tmp_path: Path) -> None:
    """Break the core: what a sample uses follows the swap at once."""

    def careless(core: FoldedCore, m: Module, *control: Any) -> Any:
        found = original(core, m, *control)
        assert found is not None
        return found._replace(bank=found.port.bank)

    original = FoldedCore._reload
    made = hardware_in("folded", "audio_lowpass")
    with patch.object(FoldedCore, "_reload", careless):
        source = verilog(made)
    outcome, chosen = run(tmp_path, made, source, 60, seed=60)
    assert [word for _, word in outcome["received"]] != expected(made, outcome, chosen)
