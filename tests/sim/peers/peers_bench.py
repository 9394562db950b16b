"""Runs inside the simulator: cocotbext-axi's source and sink as the peers of a core, at a random pace.

Reads ``job.json`` of the folder named by PEERS_BENCH: ``words`` as [channel, data], ``dest`` whether there is a
``tdest``, ``seed``, and ``wanted``, how many come out, if not all. Writes ``received.json``: [channel, data, status]
of each word, in the order received.
"""

import itertools
import json
import os
import random
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge
from cocotbext.axi import AxiStreamBus, AxiStreamFrame, AxiStreamSink, AxiStreamSource


@cocotb.test(timeout_time=200, timeout_unit="ms")
async def peers(dut: Any) -> None:
    folder = Path(os.environ["PEERS_BENCH"])
    job = json.loads((folder / "job.json").read_text())
    Clock(dut.aclk, 10, "ns").start()
    dut.aresetn.value = 0
    # Without byte_lanes a peer without tkeep takes the whole word for one lane.
    lanes = {"byte_lanes": 1}
    source = AxiStreamSource(
        AxiStreamBus.from_prefix(dut, "s_axis"), dut.aclk, dut.aresetn, reset_active_level=False, **lanes
    )
    sink = AxiStreamSink(
        AxiStreamBus.from_prefix(dut, "m_axis"), dut.aclk, dut.aresetn, reset_active_level=False, **lanes
    )
    pace = random.Random(job["seed"])
    for _ in range(5):
        await RisingEdge(dut.aclk)
    dut.aresetn.value = 1
    source.set_pause_generator(pace.random() < 0.3 for _ in itertools.count())
    sink.set_pause_generator(pace.random() < 0.3 for _ in itertools.count())
    for channel, word in job["words"]:
        await source.send(AxiStreamFrame(tdata=[word], tdest=[channel] if job["dest"] else None))
    received = []
    for _ in range(job.get("wanted", len(job["words"]))):
        frame = await sink.recv()
        (word,) = frame.tdata
        received.append([_only(frame.tdest) if job["dest"] else 0, int(word), _only(frame.tuser)])
    (folder / "received.json").write_text(json.dumps(received))


def _only(values: Any) -> int:
    """Value of a side signal of a frame of one word."""
    return int(values[0] if isinstance(values, list) else values)
