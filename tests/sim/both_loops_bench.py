"""Runs inside the simulator: the bench with its loop in Python and with the compiled one, in turn, on a core's faults.

Reads ``cases.json`` of the folder named by BOTH_LOOPS, a list of what `faulty.sv` is set to and of the bench's
configuration, and writes ``outcomes.json``: for each case and each loop the rule broken, the clocks, and what came out.
"""

import json
import os
from pathlib import Path
from typing import Any

import cocotb
from cocotb.triggers import ClockCycles

from sosmith.sim.stream_bench import StreamBench, run_bench, start_clock
from sosmith.sim.stream_rules import ProtocolError


@cocotb.test()
async def both_loops(dut: Any) -> None:
    folder = Path(os.environ["BOTH_LOOPS"])
    start_clock(dut)
    outcomes = []
    for case in json.loads((folder / "cases.json").read_text(encoding="utf-8")):
        outcomes.append([await outcome(dut, folder, case, compiled=compiled) for compiled in (False, True)])
    (folder / "outcomes.json").write_text(json.dumps(outcomes), encoding="utf-8")


async def outcome(dut: Any, folder: Path, case: dict[str, Any], *, compiled: bool) -> list[Any]:
    dut.fault.value = 0
    await ClockCycles(dut.aclk, 2)  # forgets what came before
    dut.fault.value, dut.work.value = case["fault"], case["work"]
    (folder / "bench.json").write_text(json.dumps(case["bench"] | {"compiled": compiled}), encoding="utf-8")
    bench, failure = StreamBench(dut, folder), None
    try:
        await run_bench(bench)
    except ProtocolError as error:
        failure = str(error)
    received = bench.received
    return [failure, bench.clocks, received.tdest.tolist(), received.tdata.tolist(), received.tuser.tolist()]
