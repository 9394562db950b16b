"""Chains on boards: what the link is told, what goes into the FPGA, and a result for each sample."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.gen.chain.chains import GUARDED, PLAIN, stimulus
from tests.gen.chain.rising import UP
from tests.gen.fpga.stubs import REPORT, Stub

import sosmith
from sosmith.gen.chain.board import chain_item, modules, results_and_copies
from sosmith.gen.chain.generate import chain_texts
from sosmith.gen.chain.rates import Rate
from sosmith.gen.chain.top import chain_interface, top_text
from sosmith.gen.fpga import bitstream
from sosmith.gen.output.board_top import board_verilog
from sosmith.gen.output.identity import BoardItem, identity
from sosmith.gen.output.vectors import whole_beats
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.model.errors import SpecificationError
from sosmith.model.link.identity import Identity
from sosmith.sim.cosimulate import cosimulate
from sosmith.sim.simulator_bench import SimulatorBench

CLOCK = Fraction(12_000_000)


@pytest.fixture(scope="module")
def chain() -> sosmith.Chain:
    return sosmith.design_chain(PLAIN)


@pytest.fixture(scope="module")
def guarded() -> sosmith.Chain:
    return sosmith.design_chain(GUARDED | {"channels": 1})


def test_the_identity_is_that_of_the_whole(chain: sosmith.Chain) -> None:
    item = chain_item(chain.core)
    told = identity(item, item.verilog, baud=1_000_000, clock=12e6)
    assert (told.name, told.core, told.architecture) == ("rx", "chain", "parallel_folded")
    assert (told.sample_rate, told.channels, told.reload) == (8000.0, 1, None)
    assert [port.name for port in told.input_ports] == ["x"]
    assert told.output_port == chain.core.stages[-1].output
    assert item.verilog == top_text(chain.core)


@pytest.mark.slow
def test_flags_that_a_result_can_have(chain: sosmith.Chain, guarded: sosmith.Chain) -> None:
    assert chain_item(chain.core).possible == (0, 2)
    assert chain_item(guarded.core).possible == tuple(range(7))
    unloaded = replace(guarded.core, stages=guarded.core.stages[:2])
    assert chain_item(unloaded).possible == (0, 2, 5, 6)


@pytest.mark.slow
def test_a_board_reaches_the_registers_of_one_stage(guarded: sosmith.Chain) -> None:
    item = chain_item(guarded.core)
    told = identity(item, "", baud=1_000_000, clock=12e6)
    assert told.reload is not None
    assert told.reload.design == guarded.core.stages[2].design.architecture.fingerprint
    assert re.search(r"^ +\.s_axil_out_awaddr\(\w+\),$", board_verilog(item, clock=CLOCK), re.MULTILINE)
    twice = replace(guarded.core, stages=(*guarded.core.stages, guarded.core.stages[2]))
    with pytest.raises(SpecificationError) as refused:
        chain_item(twice)
    assert str(refused.value) == (
        "specification: reload must be true of at most one stage on a board, whose link reaches the registers of one "
        "core, not of out, out"
    )


def test_the_cores_go_into_the_fpga_as_they_are_generated(chain: sosmith.Chain) -> None:
    texts = chain_texts(chain.core)
    top = board_verilog(chain_item(chain.core), clock=CLOCK)
    assert top.endswith(modules(chain.core))
    for name in ("rx_slow", "rx_double", "rx_out", "rx"):
        assert texts[f"{name}.sv"] in top
    assert re.search(r"^module rx_board\(", top, re.MULTILINE)


def source_of(item: BoardItem, folder: Path) -> Path:
    """Write what stands in a board, but for the link."""
    source = folder / "whole.sv"
    source.write_text(to_verilog(to_rtlil(item.component(), "whole")) + item.make_modules(), encoding="ascii")
    return source


@pytest.mark.slow
def test_every_sample_has_a_result(chain: sosmith.Chain, tmp_path: Path) -> None:
    """What stands in the board, with random handshakes; the bench compares all copies of a result."""
    item, factor = chain_item(chain.core), chain.factor
    source = source_of(item, tmp_path)
    face = chain_interface(chain.core)
    interface = replace(face, name="whole", latency_cycles=face.latency_cycles + 1, copies_per_result=factor)
    codes = stimulus(chain, 300, 1)
    bench = SimulatorBench(
        source=source, interface=interface, build_dir=tmp_path, simulator="icarus", seed=1, idle=0.3, stall=0.3
    )
    sent = whole_beats(codes[:, :, None], interface.inputs)
    got = cosimulate(bench, interface, sent, seed=1)
    results, status = chain.core.compute_with_status(codes[:, :, None])
    assert np.array_equal(got.codes[:, :, 0], results)
    assert np.array_equal(got.status, status)


SEVERAL = {"three": PLAIN | {"channels": 3}, "guarded": GUARDED}


@pytest.mark.parametrize("name", ["three", pytest.param("guarded", marks=pytest.mark.slow)])
def test_every_sample_of_several_channels_has_the_result_of_its_own(name: str, tmp_path: Path) -> None:
    """In the order of the samples, whose channels come in turn and in any order."""
    chain = sosmith.design_chain(SEVERAL[name])
    item, samples = chain_item(chain.core), 120
    source = source_of(item, tmp_path)
    face = chain_interface(chain.core)
    interface = replace(face, name="whole", latency_cycles=item.latency_cycles, samples_per_result=1)
    codes = stimulus(chain, samples, 1)
    bench = SimulatorBench(
        source=source, interface=interface, build_dir=tmp_path, simulator="icarus", seed=1, idle=0.3, stall=0.3
    )
    got = cosimulate(bench, interface, whole_beats(codes[:, :, None], interface.inputs), seed=1)
    results, status = chain.core.compute_with_status(codes[:, :, None])
    last = np.arange(samples) // chain.factor
    assert np.array_equal(got.codes[:, :, 0], results[last])
    assert np.array_equal(got.status, status[last])
    assert got.cycles <= codes.size * item.cycles_per_sample * 2


@pytest.mark.slow
def test_a_build_says_what_the_chain_takes(
    chain: sosmith.Chain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bitstream, "find_tool", lambda name: Stub(name, [], REPORT, None))
    made = chain.build("icestick", folder=tmp_path)
    assert made.bitstream.name == "rx_board_icestick.bin"
    assert (made.summary["name"], made.summary["architecture"]) == ("rx", "parallel_folded")
    assert made.summary["samples_per_second"] == 12e6 / chain_item(chain.core).cycles_per_sample
    assert (tmp_path / "rx_board.sv").read_text(encoding="ascii") == board_verilog(chain_item(chain.core), clock=CLOCK)
    project = chain.project("arty_a7", folder=tmp_path / "project")
    assert project["bitstream"] is None
    assert {Path(name).suffix for name in project["project"]["files"]} >= {".tcl", ".xdc"}


RISING = UP | {"stage": [UP["stage"][0], UP["stage"][2] | {"interpolate": 2}]}


@pytest.mark.parametrize(
    ("stages", "channels", "results", "factor"),
    [
        ([{"interpolate": 3}], 3, 3, 1),
        ([{"interpolate": 4}, {"decimate": 2}], 3, 2, 1),
        ([{"decimate": 2}, {"interpolate": 4}], 1, 2, 1),
        ([{"decimate": 4}, {"interpolate": 2}], 1, 1, 2),
        ([{"interpolate": 2}, {"decimate": 4}], 3, 1, 2),
        ([{"interpolate": 2}, {"decimate": 4}, {"interpolate": 2}], 1, 1, 1),
        ([{"decimate": 2}, {"decimate": 2}], 3, 1, 4),
    ],
)
def test_how_many_results_a_sample_has(stages: list[dict[str, int]], channels: int, results: int, factor: int) -> None:
    rates = [Rate(stage.get("interpolate", 1), stage.get("decimate", 1)) for stage in stages]
    assert results_and_copies(rates, channels, 2, "x.toml") == (results, factor)


@pytest.mark.parametrize(
    ("stages", "channels", "sentence"),
    [
        (
            [(3, 1), (1, 2)],
            1,
            "x.toml: interpolate and decimate must make the rate a whole multiple or a whole part on a board, whose "
            "link returns as many results for each sample, not 3 / 2 of it",
        ),
        (
            [(1, 2), (4, 1)],
            2,
            "x.toml: interpolate must not stand behind decimate on a board with several channels: a sample there "
            "brings results that leave with later samples, which may be those of another channel",
        ),
        (
            [(2, 1), (1, 4), (2, 1)],
            3,
            "x.toml: interpolate must not stand behind decimate on a board with several channels: a sample there "
            "brings results that leave with later samples, which may be those of another channel",
        ),
        (
            [(64, 1), (2, 1)],
            1,
            "x.toml: interpolate must give at most 80 results for each sample on a board, as many as fit a message of "
            "the link, not 128",
        ),
    ],
)
def test_chains_that_the_link_has_no_results_for(stages: list[tuple[int, int]], channels: int, sentence: str) -> None:
    with pytest.raises(SpecificationError) as refused:
        results_and_copies([Rate(*stage) for stage in stages], channels, 2, "x.toml")
    assert str(refused.value) == sentence


def test_the_identity_says_how_many_results_a_sample_has(rising: sosmith.Chain) -> None:
    item = chain_item(rising.core)
    about = identity(item, "", baud=1_000_000, clock=12e6)
    assert (about.results, about.samples, about.packed) == (4, 20, None)
    assert (about.sample_rate, about.result_rate) == (8000.0, 32000.0)
    assert Identity.of_memory(about.memory) == about


@pytest.fixture(scope="module")
def rising() -> sosmith.Chain:
    return sosmith.design_chain(RISING)
