"""A chain in a simulator, whose stage that interpolates is loaded at random moments: what it gives, and should give."""

import json
import os
import random
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from cocotb_tools.runner import Icarus, Verilator
from tests.gen.designs import EXAMPLES
from tests.model.reload.swapping import compute_swapping

import sosmith
from sosmith.gen.chain.board import modules
from sosmith.gen.chain.top import chain_interface
from sosmith.sim.simulators import find_simulator


def run(
    folder: Path, chain: sosmith.Chain, sets: Sequence[sosmith.ChainReload], count: int, simulator: str = "icarus"
) -> tuple[list[tuple[int, int]], list[tuple[int, int]], dict[str, Any]]:
    """Load sets into the last stage, one load in eight with a wrong CRC; return results and what they should be.

    Both are pairs of channel and word. The outcome of the bench has the number of swaps before each sample.
    """
    design, pace, rng = chain.core, random.Random(count), np.random.default_rng(count)
    *early, last = design.stages
    chosen = [pace.randrange(len(sets)) for _ in range(count)]
    wrong = [pace.randrange(8) == 0 for _ in range(count)]
    loads = [[_writes(sets[kind], bad), not bad] for kind, bad in zip(chosen, wrong, strict=True)]
    (port,), channels = design.spec.base.inputs, design.spec.base.channels
    codes = rng.integers(port.lowest, port.highest, 256, endpoint=True).tolist()
    dests = rng.integers(channels, size=len(codes)).tolist() if channels > 1 else []
    name, several = last.spec.name, len(last.cores) > 1
    at = f"stage_{name}"
    job = {
        "words": [code % (1 << chain_interface(design).inputs.width) for code in codes],
        "dests": dests,
        "loads": loads,
        "seed": count,
        "behind": False,
        "folded": last.design.architecture.program is not None,
        "chain": {
            "registers": f"s_axil_{name}",
            "port": f"{at}_registers" if several else at,
            "core": f"{at}_p0" if several else at,
            "taken": ["gated_tvalid", f"stage_{early[-1].spec.name}_tready"] if early else [],
        },
    }
    outcome = _simulated(folder, design.name, modules(design), job, simulator)
    assert outcome["refused"] == [number for number, bad in enumerate(wrong) if bad]
    assert outcome["accepted"] == [number for number, bad in enumerate(wrong) if not bad]
    received = [(channel, word) for channel, word in outcome["received"]]
    return received, _expected(chain, sets, chosen, outcome, codes, dests), outcome


def _writes(loaded: sosmith.ChainReload, wrong: bool) -> list[list[int]]:
    *writes, (address, crc) = loaded.writes["writes"]
    return [*writes, [address, crc ^ wrong]]


def _simulated(folder: Path, name: str, source: str, job: dict[str, Any], simulator: str) -> dict[str, Any]:
    (folder / "chain.sv").write_text(source)
    (folder / "job.json").write_text(json.dumps(job))
    tool = find_simulator(simulator, folder / "bin")
    with patch.object(sys, "path", [str(EXAMPLES.parent), *sys.path]), patch.dict(os.environ, tool.environment):
        runner = Icarus() if simulator == "icarus" else Verilator()
        runner.build(
            sources=[folder / "chain.sv"],
            hdl_toplevel=name,
            build_dir=folder / "build",
            build_args=[] if simulator == "icarus" else ["-Wno-fatal", "-O1"],
            timescale=("1ns", "1ps"),
            always=True,
        )
        runner.test(
            test_module="tests.sim.reload_bench",
            hdl_toplevel=name,
            build_dir=folder / "build",
            test_dir=folder,
            extra_env={"RELOAD_BENCH": str(folder), "COCOTB_LOG_LEVEL": "WARNING"},
            timescale=("1ns", "1ps"),
        )
    outcome: dict[str, Any] = json.loads((folder / "outcome.json").read_text())
    return outcome


def _expected(
    chain: sosmith.Chain,
    sets: Sequence[sosmith.ChainReload],
    chosen: Sequence[int],
    outcome: dict[str, Any],
    codes: Sequence[int],
    dests: Sequence[int],
) -> list[tuple[int, int]]:
    """Return the results of all samples: each channel has states of its own, and all have one bank."""
    *early, last = chain.core.stages
    taken = outcome["taken"]
    sent = [codes[k % len(codes)] for k in range(taken)]
    at = [dests[k % len(codes)] if dests else 0 for k in range(taken)]
    results: list[list[tuple[int, int]]] = [[] for _ in range(taken)]
    for channel in range(chain.core.spec.base.channels):
        numbers = [number for number, dest in enumerate(at) if dest == channel]
        values = np.array([sent[number] for number in numbers], dtype=np.int64)[:, None, None]
        for stage in early:
            values = stage.compute_with_status(values)[0][:, :, None]
        swapped = [outcome["swaps"][number] for number in numbers]
        turns = [turn for turn, count in enumerate(swapped) if count != ([0, *swapped][turn])]
        for k, core in enumerate(last.cores):
            swaps = [
                (turn, sets[chosen[outcome["accepted"][swapped[turn] - 1]]]._swap.swaps[k].new_set.quantized.datapath)
                for turn in turns
            ]
            for number, code in zip(numbers, compute_swapping(core.datapath, swaps, values[:, 0]), strict=True):
                results[number].append((channel, code % (1 << 8 * core.datapath.output.bytes)))
    return [pair for each in results for pair in each]
