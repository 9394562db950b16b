"""Cores between peers of another maker."""

import json
import sys
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from cocotb_tools.runner import Icarus
from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import load
from sosmith.hdl.plan.streams import fields
from sosmith.sim.simulators import PLAIN_ASSERTIONS


@cache
def made_of(architecture: str, realization: str, channels: int) -> CoreDesign:
    spec = load(EXAMPLES / "audio_lowpass.toml")
    third_order = replace(spec.filter, order=3)
    hardware = replace(spec.hardware, architecture=architecture, realization=realization, clock=Fraction(10**10))
    return design_core(replace(spec, filter=third_order, channels=channels, hardware=hardware))


def run(folder: Path, source: str, name: str, job: dict[str, Any]) -> list[list[int]]:
    """Simulate; return the channel, word and status of everything received."""
    (folder / "core.sv").write_text(source)
    (folder / "job.json").write_text(json.dumps(job))
    runner = Icarus()
    runner.build(
        sources=[folder / "core.sv"],
        hdl_toplevel=name,
        build_dir=folder / "build",
        timescale=("1ns", "1ps"),
        always=True,
    )
    with patch.object(sys, "path", [str(EXAMPLES.parent), *sys.path]):  # where the simulator's Python looks
        runner.test(
            test_module="tests.sim.peers.peers_bench",
            hdl_toplevel=name,
            build_dir=folder / "build",
            test_dir=folder,
            extra_env={"PEERS_BENCH": str(folder), "COCOTB_LOG_LEVEL": "WARNING", **PLAIN_ASSERTIONS},
            timescale=("1ns", "1ps"),
        )
    received: list[list[int]] = json.loads((folder / "received.json").read_text())
    return received


def stimulus(made: CoreDesign, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Codes of every channel, (samples, channels, inputs), and the channels in any order, with some rails."""
    channels, ports = made.spec.channels, made.datapath.inputs
    rng = np.random.default_rng(17)
    codes = np.stack([rng.integers(p.lowest, p.highest + 1, (samples, channels)) for p in ports], axis=2)
    codes[::5, 0] = [port.lowest for port in ports]
    codes[2::7, -1] = [port.highest for port in ports]
    return codes, rng.permutation(np.repeat(np.arange(channels), samples))


def words(made: CoreDesign, codes: np.ndarray, order: np.ndarray) -> list[list[int]]:
    turns = [0] * made.spec.channels
    found = []
    for channel in order.tolist():
        word = 0
        for field, code in zip(fields(made.datapath.inputs), codes[turns[channel], channel].tolist(), strict=True):
            word |= code % (1 << field.padded) << field.offset
        turns[channel] += 1
        found.append([channel, word])
    return found


def expected(made: CoreDesign, codes: np.ndarray, order: np.ndarray) -> list[list[int]]:
    results, status = made.datapath.compute(codes), made.datapath.compute_status(codes)
    turns = [0] * made.spec.channels
    bits = 8 * made.datapath.output.bytes
    found = []
    for channel in order.tolist():
        turn = turns[channel]
        turns[channel] += 1
        found.append([channel, int(results[turn, channel]) % (1 << bits), int(status[turn, channel])])
    return found
