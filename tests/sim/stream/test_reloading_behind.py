"""Reloads of filters that decimate at random moments: each result is computed with one set, the right one."""

import json
import os
import random
import sys
import zlib
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from cocotb_tools.runner import Icarus
from tests.formal.prover import broken
from tests.gen.designs import EXAMPLES
from tests.model.reload.swapping import compute_swapping

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.reload.other_constants import with_constants
from sosmith.gen.reload.register_writes import register_writes
from sosmith.gen.reload.reload import OtherSet, room_of, set_for
from sosmith.gen.specification.specification import Specification, from_text
from sosmith.hdl.cores import ring
from sosmith.sim.simulators import find_simulator

LOADS = 12


def specification(architecture: str, channels: int, start: str, cutoff: float, error: float) -> Specification:
    text = f"""
name = "rx"
sample_rate = 8000.0
channels = {channels}
input.x = {{ bits = 8, signed = true, range = [-1.0, 1.0] }}
output = {{ bits = 12, signed = true, range = [-2.0, 2.0], max_error = {error} }}
hardware = {{ architecture = "{architecture}", reload = true, start = "{start}", realization = "df1_ef2" }}
[filter]
family = "butterworth"
kind = "lowpass"
order = 2
cutoff = {cutoff}
decimate = 4
"""
    return from_text(text, Path("rx.toml"))


@cache
def hardware(architecture: str, channels: int, start: str) -> tuple[CoreDesign, list[OtherSet]]:
    made = design_core(specification(architecture, channels, start, 100.0, 0.004))
    others = [set_for(made, specification(architecture, channels, start, cutoff, 0.2)) for cutoff in (98.0, 102.0)]
    return made, others


def simulated(made: CoreDesign, sets: list[OtherSet], folder: Path) -> tuple[dict[str, Any], dict[str, Any], list[int]]:
    """Return what was sent, what came, and which set each load has."""
    channels = made.spec.channels
    seed = zlib.crc32(f"{made.architecture.name} {channels} {made.spec.hardware.start}".encode())
    pace, rng = random.Random(seed), np.random.default_rng(seed)
    chosen = [pace.randrange(len(sets)) for _ in range(LOADS)]
    writes = [register_writes(made, sets[kind], version + 1) for version, kind in enumerate(chosen)]
    job = {
        "words": (rng.integers(-64, 64, 256) % 256).tolist(),
        "dests": rng.integers(channels, size=256).tolist() if channels > 1 else [],
        "loads": [[[(register.address, word) for register, word in each], True] for each in writes],
        "seed": seed,
        "folded": made.architecture.program is not None,
        "behind": made.datapath.decimator is not None,
    }
    (folder / "core.sv").write_text(to_verilog(to_rtlil(made.architecture.component(), "rx")))
    (folder / "job.json").write_text(json.dumps(job))
    tool, runner = find_simulator("icarus", folder / "bin"), Icarus()
    places: dict[str, Any] = {"hdl_toplevel": "rx", "build_dir": folder / "build", "timescale": ("1ns", "1ps")}
    with patch.object(sys, "path", [str(EXAMPLES.parent), *sys.path]), patch.dict(os.environ, tool.environment):
        runner.build(sources=[folder / "core.sv"], always=True, **places)
        environment = {"RELOAD_BENCH": str(folder), "COCOTB_LOG_LEVEL": "WARNING"}
        runner.test(test_module="tests.sim.reload_bench", test_dir=folder, extra_env=environment, **places)
    return job, json.loads((folder / "outcome.json").read_text()), chosen


@pytest.mark.slow
@pytest.mark.sweep(2)
@pytest.mark.parametrize("start", ["steady", "zero"])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_reloads_at_any_moment(architecture: str, channels: int, start: str, tmp_path: Path) -> None:
    made, sets = hardware(architecture, channels, start)
    job, outcome, chosen = simulated(made, sets, tmp_path)
    taken, decimator = outcome["taken"], made.datapath.decimator
    assert decimator is not None
    codes = np.resize(np.array(job["words"], dtype=np.uint8).view(np.int8), taken).astype(np.int64)
    dests = np.resize(np.array(job["dests"] or [0]), taken)
    swaps: list[int] = outcome["swaps"]
    assert swaps[-1] == LOADS
    assert len(set(swaps)) > LOADS // 2
    # Results in the order of the samples that complete them.
    places = {channel: np.flatnonzero(dests == channel)[:: decimator.factor] for channel in range(made.spec.channels)}
    order = np.sort(np.concatenate(list(places.values()))).tolist()
    assert len(swaps) == len(order)
    first = with_constants(made.quantized, None, None, room=room_of(made)).datapath.behind_decimator
    wanted = dict.fromkeys(order, 0)
    for channel, own in places.items():
        entering = decimator.compute(codes[dests == channel])[:, np.newaxis]
        used = [swaps[order.index(place)] for place in own.tolist()]
        steps = [
            (turn, sets[chosen[now - 1]].quantized.datapath.behind_decimator)
            for turn, (before, now) in enumerate(zip([0, *used], used, strict=False))
            if now != before
        ]
        wanted |= zip(own.tolist(), compute_swapping(first, steps, entering), strict=True)
    received = [(int(dests[place]), wanted[place] % (1 << 16)) for place in order]
    assert [tuple(pair) for pair in outcome["received"]] == received


def fir(channels: int, start: str, taps: tuple[float, ...], error: float) -> Specification:
    text = f"""
name = "rx"
sample_rate = 8000.0
channels = {channels}
input.x = {{ bits = 8, signed = true, range = [-1.0, 1.0] }}
output = {{ bits = 12, signed = true, range = [-2.0, 2.0], max_error = {error} }}
filter = {{ taps = {list(taps)}, decimate = 3 }}
hardware = {{ reload = true, start = "{start}" }}
"""
    return from_text(text, Path("rx.toml"))


def results_of_taps(channels: int, start: str, folder: Path) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return what came of a core with several sets of taps, and what had to."""
    made = design_core(fir(channels, start, (0.1, 0.2, 0.31, 0.2, 0.1), 0.001))
    others = ((0.11, 0.15, 0.4, 0.15, 0.11), (0.05, 0.22, 0.5, 0.22, 0.05), (-0.1, 0.12, 0.3, 0.12, -0.1))
    sets = [set_for(made, fir(channels, start, taps, 0.01)) for taps in others]
    job, outcome, chosen = simulated(made, sets, folder)
    down, taken = made.datapath.downsampler, outcome["taken"]
    assert down is not None
    codes = np.resize(np.array(job["words"], dtype=np.uint8).view(np.int8), taken).astype(np.int64)
    dests = np.resize(np.array(job["dests"] or [0]), taken)
    swaps: list[int] = outcome["swaps"]
    assert swaps[-1] == LOADS
    wanted: dict[int, int] = {}
    for channel in range(channels):
        places = np.flatnonzero(dests == channel)
        entering = down.preceded(codes[places][:, np.newaxis])
        used = [swaps[place] for place in places.tolist()]
        steps = [
            (turn + down.filled, sets[chosen[now - 1]].quantized.datapath)
            for turn, (before, now) in enumerate(zip([0, *used], used, strict=False))
            if now != before
        ]
        first = with_constants(made.quantized, None, None).datapath
        results = compute_swapping(first, steps, entering)[down.filled :: down.factor]
        wanted |= zip(places[:: down.factor].tolist(), results, strict=True)
    received = [(int(dests[place]), wanted[place] % (1 << 16)) for place in sorted(wanted)]
    return [(dest, word) for dest, word in outcome["received"]], received


@pytest.mark.slow
@pytest.mark.sweep(2)
@pytest.mark.parametrize("start", ["steady", "zero"])
@pytest.mark.parametrize("channels", [1, 3])
def test_taps_are_loaded_at_any_moment(channels: int, start: str, tmp_path: Path) -> None:
    found, wanted = results_of_taps(channels, start, tmp_path)
    assert found == wanted


@pytest.mark.slow
def test_a_result_of_two_banks_is_noticed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    right, wrong = "return port, used", "return port, port.bank"
    monkeypatch.setattr(ring, "RingCore", broken(ring, right, wrong).RingCore)
    found, wanted = results_of_taps(1, "zero", tmp_path)
    assert found != wanted
