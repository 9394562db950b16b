"""Runs inside the simulator: audio converters at the pins of a front-end, and a core that returns each sample.

Reads ``job.json`` of the folder named by CONVERTERS_BENCH: ``clock`` in Hz; ``adcs`` and ``dacs``, the names of the
devices; ``words``, for each ADC its left and right words; ``frames``, how many frames there are. Writes ``found.json``:
the samples, and the words that each DAC got, on the I2S and on an SPI.
"""

import json
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
from sosmith.model.converters.spi_dac import SPI_DACS
from sosmith.sim.converters.cocotb_bus import Dac, SpiBus
from sosmith.sim.converters.i2s_bus import I2sBus


@cocotb.test(timeout_time=20, timeout_unit="sec")
async def front_end(dut: Any) -> None:
    folder = Path(os.environ["CONVERTERS_BENCH"])
    job = json.loads((folder / "job.json").read_text())
    samples: list[list[int]] = []
    for port in ("rst", "s_axis_tready", "m_axis_tdata", "m_axis_tuser", "m_axis_tvalid", "i_take", "i_index", "clk"):
        getattr(dut, port).value = 0
    spi_dacs = [Dac(f"MCP4921 {n}", SPI_DACS[name].timing) for n, name in enumerate(job["dacs"]) if name in SPI_DACS]
    adcs, dacs = ([I2S_CONVERTERS[name] for name in job[kind] if name in I2S_CONVERTERS] for kind in ("adcs", "dacs"))
    bus = I2sBus(dut, adcs, dacs, [iter([(left, right) for left, right in words]) for words in job["words"]])
    Clock(dut.clk, round(1e12 / job["clock"] / 2) * 2, "ps", impl="gpi").start(start_high=False)
    await ClockCycles(dut.clk, 1)
    bus.start()
    if spi_dacs:
        miso = SimpleNamespace(value=0)
        SpiBus(SimpleNamespace(sck=dut.dac_sck, mosi=dut.dac_mosi, cs_n=dut.dac_cs_n, miso=miso), spi_dacs).start()
    cocotb.start_soon(core(dut, samples))
    while bus.frames < job["frames"]:
        await FallingEdge(dut.lrck)
    found = {"samples": samples, "heard": bus.heard, "written": [dac.words for dac in spi_dacs]}
    (folder / "found.json").write_text(json.dumps(found))


async def core(dut: Any, samples: list[list[int]]) -> None:
    """Take samples, and return each."""
    while True:
        if not int(dut.s_axis_tvalid.value):
            await RisingEdge(dut.s_axis_tvalid)
        await ClockCycles(dut.clk, len(samples) % 3)
        await FallingEdge(dut.clk)
        samples.append([int(dut.s_axis_tdest.value), int(dut.s_axis_tdata.value)])
        dut.s_axis_tready.value = 1
        await FallingEdge(dut.clk)
        dut.s_axis_tready.value = 0
        await ClockCycles(dut.clk, 20)
        await FallingEdge(dut.clk)
        dut.m_axis_tdata.value = samples[-1][1]
        dut.m_axis_tvalid.value = 1
        await FallingEdge(dut.clk)
        dut.m_axis_tvalid.value = 0
