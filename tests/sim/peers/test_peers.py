"""Every architecture, realization and number of channels between an AXI4-Stream source and sink of another maker."""

from pathlib import Path

import pytest
from amaranth.hdl import Module, Value
from tests.sim.peers.peer_runs import expected, made_of, run, stimulus, words
from tests.suite.extras import needs

from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.hdl.check_bits import CheckBits
from sosmith.hdl.cores.folded import FoldedCore

pytestmark = needs("cocotbext.axi")

UNFOLDABLE = {"normal", "lattice_wdf"}
SAMPLES = {"parallel": 120, "folded": 24, "serial": 8}
"""Samples of each channel, fewer where each takes longer."""

FAST = {
    *(("parallel", "df1_ef2", 12), ("parallel", "df1_ef2", 20), ("parallel", "lattice_wdf", 3)),
    *(("folded", "delta", 3), ("serial", "df2t", 3)),
}
CASES = [
    pytest.param(*case, marks=[] if case in FAST else [pytest.mark.slow])
    for architecture in SAMPLES
    for realization in SECTIONS
    for channels in (1, 3, 12, 20)
    for case in [(architecture, realization, channels)]
    if architecture == "parallel" or realization not in UNFOLDABLE
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("architecture", "realization", "channels"), CASES)
def test_peers_of_another_maker(architecture: str, realization: str, channels: int, tmp_path: Path) -> None:
    made = made_of(architecture, realization, channels)
    codes, order = stimulus(made, SAMPLES[architecture])
    source = to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))
    job = {"words": words(made, codes, order), "dest": channels > 1, "seed": channels}
    found = run(tmp_path, source, made.datapath.name, job)
    wanted = expected(made, codes, order)
    assert found == wanted
    assert len({status for _, _, status in wanted}) > 1  # rails were met


@pytest.mark.slow
def test_a_sample_of_a_channel_that_does_not_exist_is_dropped(tmp_path: Path) -> None:
    for architecture in ("parallel", "folded"):
        made = made_of(architecture, "df1_ef2", 3)
        codes, order = stimulus(made, 6)
        source = to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))
        sent = words(made, codes, order)
        # Behind each sample one that no channel is there for; their outputs would be the ones missing at the end.
        stray = [pair for word in sent for pair in (word, [3 + word[1] % 250, word[1]])]
        folder = tmp_path / architecture
        folder.mkdir()
        received = run_some(folder, source, made.datapath.name, stray, len(sent))
        assert received == expected(made, codes, order)


def run_some(folder: Path, source: str, name: str, sent: list[list[int]], wanted: int) -> list[list[int]]:
    """Simulate; return the first `wanted` words received."""
    return run(folder, source, name, {"words": sent, "dest": True, "seed": 1, "wanted": wanted})


class OneMemory(FoldedCore):
    """A core whose channels all have the same words."""

    def _memory(
        self, m: Module, check: CheckBits, read: tuple[Value, Value], write: tuple[Value, Value, Value]
    ) -> Value:
        bits = (self.program.words - 1).bit_length()
        return super()._memory(m, check, (read[0][:bits], read[1]), (write[0][:bits], *write[1:]))


@pytest.mark.slow
def test_a_mixed_up_channel_is_noticed(tmp_path: Path) -> None:
    made = made_of("folded", "delta", 3)
    codes, order = stimulus(made, 6)
    assert made.architecture.program is not None
    broken = OneMemory(made.datapath, made.architecture.program, serial=False, channels=3)
    source = to_verilog(to_rtlil(broken, made.datapath.name))
    job = {"words": words(made, codes, order), "dest": True, "seed": 1}
    assert run(tmp_path, source, made.datapath.name, job) != expected(made, codes, order)
