"""The wrappers for Amaranth, LiteX and cocotb: samples pass through them as through the core itself."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests.gen.output.packages.made import SPECIFICATIONS, called, design_of, unpacked

from sosmith.gen.output.packages.facts import package_facts
from sosmith.gen.output.pins import Pin
from sosmith.model.reload.registers import MAGIC

AMARANTH = """
from amaranth.back import verilog
from amaranth.hdl import ClockDomain, ClockSignal, Module, ResetSignal, Signal
import {name}_amaranth as wrapper

m, pins = Module(), {{name: Signal(width, name=name) for name, width in {pins!r}.items()}}
m.domains.sync = ClockDomain()
m.submodules.core = core = wrapper.{Name}()
m.d.comb += [ClockSignal().eq(pins["aclk"]), ResetSignal().eq(~pins["aresetn"])]
m.d.comb += [
    core.i.valid.eq(pins["s_axis_tvalid"]), core.i.payload.codes.eq(pins["s_axis_tdata"]),
    pins["s_axis_tready"].eq(core.i.ready),
    pins["m_axis_tvalid"].eq(core.o.valid), pins["m_axis_tdata"].eq(core.o.payload.code),
    pins["m_axis_tuser"].eq(core.o.payload.flags), core.o.ready.eq(pins["m_axis_tready"]),
]
if "s_axis_tdest" in pins:
    m.d.comb += [
        core.i.payload.channel.eq(pins["s_axis_tdest"]), pins["m_axis_tdest"].eq(core.o.payload.channel),
    ]
print(verilog.convert(m, name="wrapped", ports=[*pins.values()], emit_src=False, strip_internal_attrs=True))
"""

LITEX = """
from litex.gen.fhdl.verilog import convert
from migen import Cat, ClockDomain, Module, Replicate, Signal
import {name}_litex as wrapper

class Top(Module):
    def __init__(self):
        self.pins = pins = {{name: Signal(width, name=name) for name, width in {pins!r}.items()}}
        self.clock_domains.cd_sys = ClockDomain("sys")
        self.submodules.core = core = wrapper.{Name}()
        sink, source = core.sink, core.source
        self.comb += [
            self.cd_sys.clk.eq(pins["aclk"]), self.cd_sys.rst.eq(~pins["aresetn"]),
            sink.valid.eq(pins["s_axis_tvalid"]), pins["s_axis_tready"].eq(sink.ready),
            pins["m_axis_tvalid"].eq(source.valid), source.ready.eq(pins["m_axis_tready"]),
            pins["m_axis_tuser"].eq(source.flags),
            *[getattr(sink, field).eq(pins["s_axis_tdata"][low:low + bits]) for field, low, bits in {inputs!r}],
            pins["m_axis_tdata"].eq(wide(source.{output})),
        ]
        if "s_axis_tdest" in pins:
            self.comb += [sink.channel.eq(pins["s_axis_tdest"]), pins["m_axis_tdest"].eq(source.channel)]

def wide(code):
    return Cat(code, Replicate(code[len(code) - 1], 16)) if code.signed else code

top = Top()
print(convert(top, ios=set(top.pins.values()), name="wrapped"))
"""
MAKERS = {"amaranth": AMARANTH, "litex": LITEX}


def pins_of(name: str) -> tuple[Pin, ...]:
    return package_facts(design_of(name).core).pins


def wrapped(maker: str, name: str, folder: Path) -> str:
    """Return the Verilog that a library makes of its wrapper, with the pins of the core."""
    interface = design_of(name).facts.interface
    script = MAKERS[maker].format(
        name=name,
        Name=name.capitalize(),
        pins={pin.name: pin.width for pin in pins_of(name) if pin.bus != "s_axil"},
        inputs=[(field.port.name, field.offset, field.port.bits) for field in interface.inputs.fields],
        output=interface.outputs.fields[0].port.name,
    )
    result = subprocess.run(
        [sys.executable, "-c", script], cwd=folder / "python", capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.mark.parametrize("name", ["plain", "gauge"])
@pytest.mark.parametrize("maker", MAKERS)
def test_the_bench_passes_with_the_wrapper_around_the_core(maker: str, name: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    bench = folder / "bench" / f"{name}_bench.sv"
    text = bench.read_text(encoding="utf-8")
    assert text.count(f"  {name} dut (") == 1
    bench.write_text(text.replace(f"  {name} dut (", "  wrapped dut ("), encoding="utf-8")
    sv = folder / "core" / f"{name}.sv"
    with sv.open("a", encoding="utf-8") as file:
        file.write(wrapped(maker, name, folder))
    result = called("make", "icarus", at=folder / "bench")
    assert re.search(r"^PASS: \d+ samples, 0 mismatches$", result.stdout, re.MULTILINE), result.stdout + result.stderr


@pytest.mark.parametrize("maker", MAKERS)
def test_wrappers_of_a_reloadable_core_have_its_bus(maker: str, tmp_path: Path) -> None:
    folder = unpacked("tunable", tmp_path)
    text = wrapped(maker, "tunable", folder)
    for pin in pins_of("tunable"):
        assert re.search(rf"\.{pin.name}\s*\(", text), pin.name


def test_litex_registers_of_the_soc(tmp_path: Path) -> None:
    folder = unpacked("gauge", tmp_path)
    script = (
        "from migen import ClockDomain, Module\nfrom litex.gen.fhdl.verilog import convert\nimport gauge_litex\n"
        "core = gauge_litex.Gauge(with_csr=True)\n"
        "print(*sorted(csr.name for csr in core.get_csrs()))\n"
        "core.clock_domains.cd_sys = ClockDomain('sys')\n"
        "text = str(convert(core, ios={core.cd_sys.clk, core.cd_sys.rst}))\n"
        "assert 'count_status + 1' in text, text\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], cwd=folder / "python", capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ["channel", "count", "flags", "result", "temperature", "voltage"]


RUNNER = """
import os, sys
sys.path.insert(0, os.getcwd())
from cocotb_tools.runner import get_runner
runner = get_runner("icarus")
runner.build(
    sources=["../core/{name}.sv"], hdl_toplevel="{name}", build_dir="build", timescale=("1ns", "1ps"), always=True
)
results = runner.test(hdl_toplevel="{name}", test_module="drive", build_dir="build", results_xml="results.xml")
"""
DRIVE = """
import json
import cocotb
from cocotb.clock import Clock
from {name}_cocotb import {Name}Driver

@cocotb.test()
async def drive(dut):
    Clock(dut.aclk, 10, unit="ns").start()
    core = {Name}Driver(dut)
    await core.start()
    results = []
    for values in json.load(open("../../values.json")):
        await core.send(**values)
        results.append(await core.receive())
    registers = []
    if hasattr(core, "read_register"):
        registers = [await core.read_register(0), await core.write_register(0, 1), await core.write_register(16, 77)]
    with open("../../results.json", "w") as file:
        json.dump([[[r.channel, r.code, r.value, sorted(r.flags)] for r in results], registers], file)
"""


@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_cocotb_drives_the_core_in_physical_units(name: str, tmp_path: Path) -> None:
    folder, design = unpacked(name, tmp_path), design_of(name)
    values = {
        "plain": [{"x": x} for x in (0.5, -1.0, -1.0, 0.999)],
        "gauge": [{"voltage": 5.0, "temperature": 20.5, "channel": c} for c in (0, 1, 0, 0, 1)],
        "tunable": [{"x": x} for x in (2.5, 0.0, 5.0)],
    }[name]
    (folder / "values.json").write_text(json.dumps(values), encoding="utf-8")
    (folder / "python" / "drive.py").write_text(DRIVE.format(name=name, Name=name.capitalize()), encoding="utf-8")
    result = called(sys.executable, "-c", RUNNER.format(name=name), at=folder / "python")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "FAIL=0" in result.stdout, result.stdout
    results, registers = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    for channel in range(design.specification.channels):
        given = [v for v in values if v.get("channel", 0) == channel]
        expected = design.run(**{key: [v[key] for v in given] for key in given[0] if key != "channel"})
        assert [value for c, _, value, _ in results if c == channel] == expected.reshape(len(given), -1)[:, 0].tolist()
    if name == "plain":
        assert ["input_at_rail" in flags for *_, flags in results] == [False, True, True, True]
    assert registers == ([[MAGIC, True], False, True] if name == "tunable" else [])
