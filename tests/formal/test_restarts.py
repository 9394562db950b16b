"""A core that judges wear begins anew with what is loaded: no state, and no sample, goes over from one set to another.

The reload port swaps whenever it likes, to constants that are the same: what is proven is about the states.
"""

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest
from amaranth.hdl import Module, Signal
from tests.formal.prover import broken, prove
from tests.formal.small import leaky, limiter
from tests.formal.stream_rules import DIGIT_BITS, StreamRules

from sosmith.hdl import reload
from sosmith.hdl.cores import folded
from sosmith.hdl.cores import parallel as core
from sosmith.hdl.plan import parallel_clocks
from sosmith.model.dataflow.folding.fold import program


class AnySwap(reload.ReloadPort):
    """A reload port that asks for a swap whenever it likes, and waits until it may, as the real one does."""

    def __init__(self, depth: int, *, bits: int = 32, design: int, protected: bool, lock: bool) -> None:
        super().__init__(max(depth, 1), bits=bits, design=design, protected=protected, lock=lock)
        self.asks = Signal()

    def elaborate(self, platform: object) -> Module:
        """Build it."""
        m = Module()
        with m.If(self.pending & self.may_swap):
            m.d.sync += self.pending.eq(0)
        with m.Elif(self.asks):
            m.d.sync += self.pending.eq(1)
        return m


class RestartRules(StreamRules):
    """The rules of the streams, and each result is that of the samples since the last reset or swap."""

    def __init__(self, module: ModuleType, *, is_folded: bool = False, serial: bool = False) -> None:
        self.ports = ports = list[AnySwap]()

        class Port(AnySwap):
            """One that is remembered."""

            def __init__(self, depth: int, *, bits: int = 32, design: int, protected: bool, lock: bool) -> None:
                super().__init__(depth, bits=bits, design=design, protected=protected, lock=lock)
                ports.append(self)

        module.ReloadPort = Port
        if is_folded:
            made = replace(limiter(), wear=((0, 1),))
            design = module.FoldedCore(made, program(made, DIGIT_BITS), serial=serial, fingerprint=1)
            super().__init__(design, 1, datapath=made, source_waits=True)
        else:
            made = replace(leaky(), wear=((0, 1),))
            super().__init__(module.Core(made, 1, 1), parallel_clocks.latency_cycles(made) + 1, datapath=made)
        self.asks = self.free(1, "asks")

    def state(self, m: Module) -> None:
        """State them."""
        (port,) = self.ports
        m.d.comb += port.asks.eq(self.asks)
        self.cleared = port.pending & port.may_swap
        super().state(m)


@pytest.mark.slow
def test_a_parallel_core_begins_anew(tmp_path: Path) -> None:
    assert prove(RestartRules(broken(core, "swap.may.eq(parts.empty)", "swap.may.eq(parts.empty)")), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("stage.clear.eq(clears)", "stage.clear.eq(0)"),
        pytest.param("swap.may.eq(parts.empty)", "swap.may.eq(1)", marks=pytest.mark.slow),
        pytest.param("[swap.pending])]", "[Const(0, 1)])]", marks=pytest.mark.slow),
    ],
)
def test_a_parallel_core_that_keeps_states_or_lets_samples_in_is_found_out(
    right: str, wrong: str, tmp_path: Path
) -> None:
    assert prove(RestartRules(broken(core, right, wrong)), tmp_path) == "FAIL"


@pytest.mark.slow
@pytest.mark.sweep(1)
@pytest.mark.parametrize("serial", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_folded_core_begins_anew(serial: bool, tmp_path: Path) -> None:
    module = broken(folded, "waits = waits | swaps.pending", "waits = waits | swaps.pending")
    assert prove(RestartRules(module, is_folded=True, serial=serial), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("swaps.pending & swaps.may_swap", "Const(0, 1)"),
        pytest.param("waits = waits | swaps.pending", "waits = waits | Const(0, 1)", marks=pytest.mark.slow),
        pytest.param("~control.busy & ~control.clearing if self.restarts else 1", "1", marks=pytest.mark.slow),
    ],
)
def test_a_folded_core_that_keeps_words_or_goes_on_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(RestartRules(broken(folded, right, wrong), is_folded=True), tmp_path) == "FAIL"
