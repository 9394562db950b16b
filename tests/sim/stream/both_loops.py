"""The bench with its loop in Python and with the compiled one, in turn, on a core's faults; a cocotb test runs it too.

Reads ``cases.json`` of a folder, a list of what `faulty.sv` is set to and of the bench's configuration, and writes
``outcomes.json``: for each case and each loop the rule broken, the clocks, and what came out. The cocotb test does so
in the folder named by BOTH_LOOPS.
"""

import json
import os
from pathlib import Path
from typing import Any

import cocotb

from sosmith.sim.stream.bench import StreamBench, run_bench
from sosmith.sim.stream.cocotb_pins import CocotbPins
from sosmith.sim.stream.pins import Pins
from sosmith.sim.stream.rules import ProtocolError


@cocotb.test()
async def both_loops(dut: Any) -> None:
    await run_cases(CocotbPins(dut), Path(os.environ["BOTH_LOOPS"]))


async def run_cases(pins: Pins, folder: Path) -> None:
    outcomes = []
    for case in json.loads((folder / "cases.json").read_text(encoding="utf-8")):
        outcomes.append([await outcome(pins, folder, case, compiled=compiled) for compiled in (False, True)])
    (folder / "outcomes.json").write_text(json.dumps(outcomes), encoding="utf-8")


async def outcome(pins: Pins, folder: Path, case: dict[str, Any], *, compiled: bool) -> list[Any]:
    pins.write("fault", 0)
    for _ in range(2):  # forgets what came before
        await pins.clock()
    pins.write("fault", case["fault"])
    pins.write("work", case["work"])
    (folder / "bench.json").write_text(json.dumps(case["bench"] | {"compiled": compiled}), encoding="utf-8")
    bench, failure = StreamBench(pins, folder), None
    try:
        await run_bench(bench)
    except ProtocolError as error:
        failure = str(error)
    received = bench.received
    return [failure, bench.clocks, received.tdest.tolist(), received.tdata.tolist(), received.tuser.tolist()]
