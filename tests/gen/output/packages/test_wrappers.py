"""The wrappers for Amaranth, LiteX and cocotb: samples pass through them as through the core itself."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.gen.output.packages.made import called, design_of, unpacked
from tests.suite.extras import needs

from sosmith.gen.output.core_facts import StreamFacts
from sosmith.gen.output.packages.facts import package_facts
from sosmith.gen.output.pins import Pin
from sosmith.model.port import Port
from sosmith.model.reload.registers import MAGIC

AMARANTH = """
from amaranth.back import verilog
from amaranth.hdl import ClockDomain, ClockSignal, Module, ResetSignal, Signal, Value
import {name}_amaranth as wrapper

m, pins = Module(), {{name: Signal(width, name=name) for name, width in {pins!r}.items()}}
m.domains.sync = ClockDomain()
m.submodules.core = core = wrapper.{Name}()
m.d.comb += [ClockSignal().eq(pins["aclk"]), ResetSignal().eq(~pins["aresetn"])]
m.d.comb += [
    core.i.valid.eq(pins["s_axis_tvalid"]), core.i.payload.codes.eq(pins["s_axis_tdata"]),
    pins["s_axis_tready"].eq(core.i.ready),
    pins["m_axis_tvalid"].eq(core.o.valid), pins["m_axis_tdata"].eq(core.o.payload.code.as_value()),
    pins["m_axis_tuser"].eq(Value.cast(core.o.payload.flags)), core.o.ready.eq(pins["m_axis_tready"]),
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
            *[pins["m_axis_tdata"][low:low + n].eq(wide(getattr(source, field))) for field, low, n in {outputs!r}],
        ]
        if "s_axis_tdest" in pins:
            self.comb += [sink.channel.eq(pins["s_axis_tdest"]), pins["m_axis_tdest"].eq(source.channel)]

def wide(code):
    return Cat(code, Replicate(code[len(code) - 1], 16)) if code.signed else code

top = Top()
print(convert(top, ios=set(top.pins.values()), name="wrapped"))
"""
MAKERS = {"amaranth": AMARANTH, "litex": LITEX}
EVERY_MAKER = [pytest.param(maker, marks=needs(maker)) for maker in MAKERS]


def pins_of(name: str) -> tuple[Pin, ...]:
    return package_facts(design_of(name).core).pins


def placed(stream: StreamFacts) -> list[tuple[str, int, Port]]:
    """Return name, lowest bit and port of each quantity of a beat, samples with a number behind the name."""
    if stream.lanes == 1:
        return [(field.port.name, field.offset, field.port) for field in stream.fields]
    (field,) = stream.fields
    return [(f"{field.port.name}_{k}", 16 * k, field.port) for k in range(stream.lanes)]


def wrapped(maker: str, name: str, folder: Path) -> str:
    """Return the Verilog that a library makes of its wrapper, with the pins of the core."""
    interface = design_of(name).facts.interface
    script = MAKERS[maker].format(
        name=name,
        Name=name.capitalize(),
        pins={pin.name: pin.width for pin in pins_of(name) if pin.bus != "s_axil"},
        inputs=[(name, low, port.bits) for name, low, port in placed(interface.inputs)],
        outputs=[(name, low, 8 * port.bytes) for name, low, port in placed(interface.outputs)],
    )
    result = subprocess.run(
        [sys.executable, "-c", script], cwd=folder / "python", capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ["plain", "gauge", "wide", "held"])
@pytest.mark.parametrize("maker", EVERY_MAKER)
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
    assert re.search(r"^PASS: \d+ (samples|beats|results), 0 mismatches$", result.stdout, re.MULTILINE), (
        result.stdout + result.stderr
    )


@pytest.mark.slow
@pytest.mark.parametrize("maker", EVERY_MAKER)
def test_wrappers_of_a_reloadable_core_have_its_bus(maker: str, tmp_path: Path) -> None:
    folder = unpacked("tunable", tmp_path)
    text = wrapped(maker, "tunable", folder)
    for pin in pins_of("tunable"):
        assert re.search(rf"\.{pin.name}\s*\(", text), pin.name


@needs("litex")
@pytest.mark.parametrize(
    ("name", "registers"),
    [
        ("gauge", ["channel", "count", "flags", "result", "temperature", "voltage"]),
        ("wide", ["count", "flags", *(f"result_{k}" for k in range(8)), *(f"x_{k}" for k in range(8))]),
    ],
)
def test_litex_registers_of_the_soc(name: str, registers: list[str], tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    script = (
        f"from migen import ClockDomain, Module\nfrom litex.gen.fhdl.verilog import convert\nimport {name}_litex\n"
        f"core = {name}_litex.{name.capitalize()}(with_csr=True)\n"
        "print(*sorted(csr.name for csr in core.get_csrs()))\n"
        "core.clock_domains.cd_sys = ClockDomain('sys')\n"
        "text = str(convert(core, ios={core.cd_sys.clk, core.cd_sys.rst}))\n"
        "assert 'count_status + 1' in text, text\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], cwd=folder / "python", capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == registers


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
        *sent, last = values if isinstance(values, list) else [values]
        for each in sent:
            await core.send(**each)
        await core.send(**last)
        found = await core.receive()
        results += found if isinstance(found, list) else [found]
    registers = []
    if hasattr(core, "read_register"):
        registers = [await core.read_register(0), await core.write_register(0, 1), await core.write_register(16, 77)]
    with open("../../results.json", "w") as file:
        json.dump([[[r.channel, r.code, r.value, sorted(r.flags)] for r in results], registers], file)
"""


WAVE = [0.5, -1.0, -1.0, 0.999, 0.25, -0.125, 0.0, 0.75, -0.5, 1.0, 0.5, 0.5, 0.5, -0.25, 0.875, 0.375]
SENT: dict[str, list[object]] = {
    "plain": [{"x": x} for x in WAVE[:4]],
    "gauge": [{"voltage": 5.0, "temperature": 20.5, "channel": c} for c in (0, 1, 0, 0, 1)],
    "tunable": [{"x": x} for x in (2.5, 0.0, 5.0)],
    "wide": [{"x": WAVE[:8]}, {"x": WAVE[8:]}],
    "sparse": [{"x": WAVE[0]}, *([{"x": x} for x in WAVE[n : n + 4]] for n in (1, 5, 9))],
    "held": [{"x": x} for x in WAVE[:6]],
}
"""What is sent before each result is received: a beat, or several."""


def driven(name: str, folder: Path) -> tuple[list[tuple[int, int, float, list[str]]], list[object]]:
    """Drive the core with its cocotb driver; return results (channel, code, value, flags) and what registers say."""
    (folder / "values.json").write_text(json.dumps(SENT[name]), encoding="utf-8")
    (folder / "python" / "drive.py").write_text(DRIVE.format(name=name, Name=name.capitalize()), encoding="utf-8")
    result = called(sys.executable, "-c", RUNNER.format(name=name), at=folder / "python")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "FAIL=0" in result.stdout, result.stdout
    results, registers = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    return results, registers


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ["plain", "gauge", "tunable"])
def test_cocotb_drives_the_core_in_physical_units(name: str, tmp_path: Path) -> None:
    folder, design = unpacked(name, tmp_path), design_of(name)
    results, registers = driven(name, folder)
    values: list[Any] = SENT[name]
    for channel in range(design.specification.channels):
        given = [v for v in values if v.get("channel", 0) == channel]
        expected = design.run(**{key: [v[key] for v in given] for key in given[0] if key != "channel"})
        assert [value for c, _, value, _ in results if c == channel] == expected.reshape(len(given), -1)[:, 0].tolist()
    if name == "plain":
        assert ["input_at_rail" in flags for *_, flags in results] == [False, True, True, True]
    assert registers == ([[MAGIC, True], False, True] if name == "tunable" else [])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "samples", "copies"), [("wide", 16, 1), ("sparse", 13, 1), ("held", 6, 4)])
def test_cocotb_gets_the_results_of_a_beat_or_of_several_samples(
    name: str, samples: int, copies: int, tmp_path: Path
) -> None:
    folder, design = unpacked(name, tmp_path), design_of(name)
    results, _ = driven(name, folder)
    expected = design.run(x=WAVE[:samples]).repeat(copies)[: len(results)]
    assert len(results) == {"wide": 16, "sparse": 4, "held": 6}[name]
    assert [value for _, _, value, _ in results] == expected.tolist()
    rails = [abs(x) >= 0.999 for x in WAVE]
    told = {"wide": rails, "sparse": [False, True, False, True], "held": [False] * 4 + [True] * 2}[name]
    assert ["input_at_rail" in flags for *_, flags in results] == told
