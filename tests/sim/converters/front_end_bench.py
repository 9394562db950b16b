"""Runs inside the simulator: converters at the pins of a front-end, and a core that returns the number of each sample.

Reads ``job.json`` of the folder named by CONVERTERS_BENCH: ``clock`` in Hz, ``readings``, for each input ``device``,
``scale`` of its slow times and, for each channel, the ``values`` of its conversions (counts, or frames); ``nulls``, the
number of the sample from which on the null bit of an ADC is wrong; and how many ``results`` are wanted. Writes
``found.json``: the samples, the results as they were fetched, and the faults at the end.
"""

import json
import os
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from sosmith.model.converters.spi_converter import CONVERTERS
from sosmith.sim.converters.cocotb_bus import Adc, PlainConverter, SpiBus


def models(job: dict[str, Any]) -> list[Adc | PlainConverter]:
    made: list[Adc | PlainConverter] = []
    for reading in job["readings"]:
        converter = CONVERTERS[reading["device"]]
        scale = Fraction(reading["scale"])
        timing = replace(
            converter.timing,
            conversion=converter.timing.conversion * scale,
            power_up=converter.timing.power_up * scale,
        )
        values = [iter(each) for each in reading["values"]]
        for first in range(0, len(values), converter.inputs):
            mine = values[first : first + converter.inputs]
            name = f"{converter.title} {first}"
            if converter.command_bits:
                made.append(Adc(name, converter.inputs, timing, counts(mine)))
            else:
                made.append(PlainConverter(name, timing, lambda mine=mine: next(mine[0]), converter.bits))
    return made


def counts(values: list[Any]) -> Callable[[int], int]:
    return lambda channel: next(values[channel])


@cocotb.test(timeout_time=20, timeout_unit="sec")
async def front_end(dut: Any) -> None:
    folder = Path(os.environ["CONVERTERS_BENCH"])
    job = json.loads((folder / "job.json").read_text())
    samples: list[list[int]] = []
    results: list[list[int]] = []
    for port in ("rst", "s_axis_tready", "m_axis_tdata", "m_axis_tuser", "m_axis_tvalid", "i_take", "i_index", "clk"):
        getattr(dut, port).value = 0
    bus = SpiBus(dut, models(job))
    period = round(1e12 / job["clock"] / 2) * 2
    Clock(dut.clk, period, "ps", impl="gpi").start(start_high=False)
    await ClockCycles(dut.clk, 2)
    bus.start()
    cocotb.start_soon(core(dut, samples))
    while len(results) < job["results"]:
        if not int(dut.o_there.value):
            await RisingEdge(dut.o_there)
        await FallingEdge(dut.clk)
        if int(dut.o_there.value):
            results.append([int(dut.o_channel.value), int(dut.o_result.value)])
            dut.i_take.value = 1
            await FallingEdge(dut.clk)
            dut.i_take.value = 0
    faults = []
    for index in range(sum(len(reading["values"]) for reading in job["readings"])):
        dut.i_index.value = index
        await ClockCycles(dut.clk, 2)
        await FallingEdge(dut.clk)
        faults.append(int(dut.o_reading.value))
    found = {"samples": samples, "results": results, "faults": faults, "frames": bus.frames}
    (folder / "found.json").write_text(json.dumps(found))


async def core(dut: Any, samples: list[list[int]]) -> None:
    """Take samples, and return the number of each with the lowest status flag in turn."""
    while True:
        if not int(dut.s_axis_tvalid.value):
            await RisingEdge(dut.s_axis_tvalid)
        await ClockCycles(dut.clk, len(samples) % 3)
        await FallingEdge(dut.clk)
        samples.append([int(dut.s_axis_tdest.value), int(dut.s_axis_tdata.value)])
        dut.s_axis_tready.value = 1
        await FallingEdge(dut.clk)
        dut.s_axis_tready.value = 0
        await ClockCycles(dut.clk, 2)
        await FallingEdge(dut.clk)
        assert int(dut.m_axis_tready.value) == 1, "a result must be taken at once"
        dut.m_axis_tdata.value, dut.m_axis_tuser.value = len(samples) - 1, len(samples) & 1
        dut.m_axis_tvalid.value = 1
        await FallingEdge(dut.clk)
        dut.m_axis_tvalid.value = 0
