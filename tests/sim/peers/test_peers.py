"""Every architecture, realization and number of channels between an AXI4-Stream source and sink of another maker."""

import json
import sys
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from amaranth.hdl import Module, Value
from cocotb_tools.runner import Icarus
from tests.extras import needs
from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.specification.specification import load
from sosmith.hdl.check_bits import CheckBits
from sosmith.hdl.folded import FoldedCore
from sosmith.hdl.plan.streams import fields
from sosmith.sim.simulators import PLAIN_ASSERTIONS

pytestmark = needs("cocotbext.axi")

UNFOLDABLE = {"normal", "lattice_wdf"}
SAMPLES = {"parallel": 120, "folded": 24, "serial": 8}
"""Samples of each channel, fewer where each takes longer."""

FAST = {
    *(("parallel", "df1_ef2", 12), ("parallel", "df1_ef2", 20), ("parallel", "lattice_wdf", 3)),
    *(("folded", "delta", 3), ("serial", "df2t", 3)),
}
CASES = [
    pytest.param(*case, marks=[] if case in FAST else [pytest.mark.slow])
    for architecture in SAMPLES
    for realization in REALIZATIONS
    for channels in (1, 3, 12, 20)
    for case in [(architecture, realization, channels)]
    if architecture == "parallel" or realization not in UNFOLDABLE
]


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


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("architecture", "realization", "channels"), CASES)
def test_peers_of_another_maker(architecture: str, realization: str, channels: int, tmp_path: Path) -> None:
    made = made_of(architecture, realization, channels)
    codes, order = stimulus(made, SAMPLES[architecture])
    source = to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))
    job = {"words": words(made, codes, order), "dest": channels > 1, "seed": channels}
    found = run(tmp_path, source, made.datapath.name, job)
    wanted = expected(made, codes, order)
    assert found == wanted
    assert len({status for _, _, status in wanted}) > 1  # rails were met


def test_a_sample_of_a_channel_that_does_not_exist_is_dropped(tmp_path: Path) -> None:
    for architecture in ("parallel", "folded"):
        made = made_of(architecture, "df1_ef2", 3)
        codes, order = stimulus(made, 6)
        source = to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))
        sent = words(made, codes, order)
        # Behind each sample one that no channel is there for; their outputs would be the ones missing at the end.
        stray = [pair for word in sent for pair in (word, [3 + word[1] % 250, word[1]])]
        folder = tmp_path / architecture
        folder.mkdir()
        received = run_some(folder, source, made.datapath.name, stray, len(sent))
        assert received == expected(made, codes, order)


def run_some(folder: Path, source: str, name: str, sent: list[list[int]], wanted: int) -> list[list[int]]:
    """Simulate; return the first `wanted` words received."""
    return run(folder, source, name, {"words": sent, "dest": True, "seed": 1, "wanted": wanted})


class OneMemory(FoldedCore):
    """A core whose channels all have the same words."""

    def _memory(
        self, m: Module, check: CheckBits, read: tuple[Value, Value], write: tuple[Value, Value, Value]
    ) -> Value:
        bits = (self.program.words - 1).bit_length()
        return super()._memory(m, check, (read[0][:bits], read[1]), (write[0][:bits], *write[1:]))


def test_a_mixed_up_channel_is_noticed(tmp_path: Path) -> None:
    made = made_of("folded", "delta", 3)
    codes, order = stimulus(made, 6)
    assert made.architecture.program is not None
    broken = OneMemory(made.datapath, made.architecture.program, serial=False, channels=3)
    source = to_verilog(to_rtlil(broken, made.datapath.name))
    job = {"words": words(made, codes, order), "dest": True, "seed": 1}
    assert run(tmp_path, source, made.datapath.name, job) != expected(made, codes, order)
