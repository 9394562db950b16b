"""Samples through the LiteX wrapper in LiteX's own simulation: its platform, its clock, its Verilator program."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest
from tests.gen.output.packages.made import called, spoil, unpacked
from tests.suite.extras import needs

pytestmark = needs("litex")

SCRIPT = """
from litex.build.generic_platform import Pins
from litex.build.sim import SimPlatform
from litex.build.sim.config import SimConfig
from migen import Cat, ClockDomain, Display, Finish, If, Memory, Module, Signal
import {name}_litex as wrapper

STIMULI, RESPONSES = {stimuli!r}, {responses!r}

class Top(Module):
    def __init__(self, platform):
        self.clock_domains.cd_sys = ClockDomain("sys", reset_less=False)
        clocks = Signal(16)
        self.submodules.core = core = wrapper.{Name}(platform)
        count = len(STIMULI)
        sent, received, wrong, result = Signal(16), Signal(16), Signal(16), Signal((16, True))
        stimuli, responses = Memory(16, count, init=STIMULI), Memory(24, count, init=RESPONSES)
        given, expected = stimuli.get_port(async_read=True), responses.get_port(async_read=True)
        self.specials += stimuli, responses, given, expected
        self.comb += [
            self.cd_sys.clk.eq(platform.request("sys_clk")), self.cd_sys.rst.eq(clocks < 4),
            given.adr.eq(sent), expected.adr.eq(received),
            core.sink.x.eq(given.dat_r), core.sink.valid.eq((clocks >= 8) & (sent != count) & (clocks[:2] != 0)),
            core.source.ready.eq(clocks[:3] != 0), result.eq(core.source.{output}),
        ]
        self.sync += [
            If(core.sink.valid & core.sink.ready, sent.eq(sent + 1)),
            If(
                core.source.valid & core.source.ready,
                received.eq(received + 1),
                If(expected.dat_r != Cat(result, core.source.flags), wrong.eq(wrong + 1)),
            ),
            If(received == count, Display("%d samples, %d mismatches", received, wrong), Finish()),
            If(clocks == 0xFFFF, Display("the core is stuck"), Finish()),
        ]
        self.sync.always += clocks.eq(clocks + 1)
        self.clock_domains.cd_always = ClockDomain("always", reset_less=True)
        self.comb += self.cd_always.clk.eq(self.cd_sys.clk)

platform = SimPlatform("SIM", [("sys_clk", 0, Pins(1)), ("sys_rst", 0, Pins(1))])
config = SimConfig()
config.add_clocker("sys_clk", freq_hz=1_000_000)
platform.build(Top(platform), sim_config=config, build_dir="sim", interactive=False, verbose=True)
"""


def missing() -> str:
    """Say what LiteX's simulation needs and is not here."""
    if not all(Path("/usr/include", header).exists() for header in ("json-c/json.h", "event2/event.h", "zlib.h")):
        return "LiteX's simulation needs the Debian packages libjson-c-dev, libevent-dev and zlib1g-dev"
    if importlib.util.find_spec("pythondata_misc_tapcfg") is None:
        return "LiteX's simulation needs pythondata-misc-tapcfg"
    return ""


def simulated(folder: Path) -> str:
    """Run the first samples of the bench in LiteX's simulation, and return what it prints."""
    stimuli, responses = (
        [int(line.replace("_", ""), 16) for line in (folder / "bench" / f"plain_{what}.hex").read_text().split()[:300]]
        for what in ("stimuli", "responses")
    )
    (folder / "python" / "run.py").write_text(
        SCRIPT.format(name="plain", Name="Plain", output="y", stimuli=stimuli, responses=responses), encoding="utf-8"
    )
    result = called(sys.executable, "run.py", at=folder / "python", simulator="verilator")
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.mark.slow
@pytest.mark.skipif(bool(missing()), reason=missing())
def test_samples_pass_through_litexs_simulation(tmp_path: Path) -> None:
    folder = unpacked("plain", tmp_path)
    assert re.search(r"\b300 samples, +0 mismatches", simulated(folder))


@pytest.mark.slow
@pytest.mark.skipif(bool(missing()), reason=missing())
def test_litexs_simulation_sees_a_changed_core(tmp_path: Path) -> None:
    folder = unpacked("plain", tmp_path)
    assert spoil(folder / "core" / "plain.sv", r"\* \$signed\(12'(h)([0-9a-f]+)\)") >= 2
    found = re.search(r"\b300 samples, +(\d+) mismatches", simulated(folder))
    assert found
    assert int(found[1]) > 0
