"""The latency that each architecture states, measured on its hardware."""

from collections.abc import Callable

import pytest
from tests.formal.small import limiter, resonator
from tests.gen.designs import example_design
from tests.hdl.axi_stream.adders import A, B, adder
from tests.hdl.axi_stream.stream_bench import run

from sosmith.hdl.cores.folded import FoldedCore
from sosmith.hdl.cores.parallel import Core
from sosmith.hdl.plan import folded_clocks, parallel_clocks
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.fold import program


def worn() -> Datapath:
    """Make a datapath with limits of wear of each channel, which are read from a memory."""
    return adder((A, B), ((3, 4), (5, 6), (7, 8)))


def taken(made: Core | FoldedCore) -> set[int]:
    """Clocks from the edge that finds a sample to the edge that hands its result on, of some samples."""
    ports = made.datapath.inputs
    codes = [[port.lowest for port in ports], [0] * len(ports), [port.highest for port in ports]]
    return {result.clocks for result in run(made, [(k % made.channels, sample) for k, sample in enumerate(codes)])}


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("make", "channels"),
    [(limiter, 1), (limiter, 3), (resonator, 1), (resonator, 2), (resonator, 8), (resonator, 17), (worn, 3)],
)
def test_parallel(make: Callable[[], Datapath], channels: int) -> None:
    datapath = make()
    assert taken(Core(datapath, channels)) == {parallel_clocks.latency_cycles(datapath, channels)}


@pytest.mark.slow
def test_a_protected_core_waits_for_a_scrub_at_most() -> None:
    """Of a sample's own channel: one has come at a clock at which it does, another at one at which it does not."""
    states = [parallel_clocks.latency_cycles(resonator(), 2, protect=protect) for protect in ("none", "correct")]
    assert states[1] == states[0] + 1
    assert taken(Core(resonator(), 2, protect="correct")) == {*states}


@pytest.mark.sweep(1)
@pytest.mark.parametrize("realization", ["df1_ef2", "df2t", "lattice_wdf"])
def test_parallel_filters(realization: str) -> None:
    datapath = example_design("audio_lowpass.toml", realization=realization).datapath
    assert taken(Core(datapath)) == {parallel_clocks.latency_cycles(datapath)}


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("make", "channels"), [(limiter, 1), (resonator, 1), (resonator, 3), (worn, 3)])
def test_folded(make: Callable[[], Datapath], channels: int) -> None:
    made = program(make(), 3)
    assert taken(FoldedCore(make(), made, serial=False, channels=channels)) == {
        folded_clocks.latency_cycles(made, serial=False)
    }


@pytest.mark.sweep(1)
@pytest.mark.parametrize("make", [limiter, resonator, worn])
def test_serial_takes_no_longer_than_it_states(make: Callable[[], Datapath]) -> None:
    """Small factors take fewer clocks than the bound allows for, but not many."""
    made = program(make(), 3)
    stated = folded_clocks.latency_cycles(made, serial=True)
    assert 0.8 * stated <= max(taken(FoldedCore(make(), made, serial=True, channels=3))) <= stated
