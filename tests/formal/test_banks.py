"""No sample is computed from a mixed bank: none from one that changes, or that is being written, while it is in work.

Proven in two halves, because a load takes thousands of clocks. The reload port never writes once the bank has been
swapped, until it has seen that the other bank is free; and with any port that does so, the core keeps the rule.
"""

from pathlib import Path
from types import ModuleType

import pytest
from amaranth.hdl import Assert, Module, Signal
from tests.formal.prover import Proof, broken, prove
from tests.formal.small import limiter

from sosmith.hdl import reload
from sosmith.hdl.cores import folded
from sosmith.model.dataflow.folding.fold import program


class WritesFreeBanks(Proof):
    """Since the last clock at which `shadow_free` was high, the bank has not been swapped when a word is written."""

    def state(self, m: Module) -> None:
        """State it."""
        d = self.design
        fresh, before = Signal(), Signal()
        still_free = Signal()
        m.d.comb += fresh.eq(d.shadow_free | (still_free & (d.bank == before)))
        m.d.proof += [before.eq(d.bank), still_free.eq(fresh & ~self.reset)]
        with m.If(self.started & d.write_enable):
            m.d.comb += Assert(still_free & (d.bank == before))


class AnyPort(reload.ReloadPort):
    """A reload port that swaps and writes whenever it likes, within what `WritesFreeBanks` proves of the real one."""

    def __init__(self, depth: int, *, bits: int, design: int, protected: bool, lock: bool) -> None:
        super().__init__(depth, bits=bits, design=design, protected=protected, lock=lock)
        self.swaps, self.writes = Signal(), Signal()

    def elaborate(self, platform: object) -> Module:
        """Build it."""
        m = Module()
        bank, before, still_free, fresh = (Signal(reset_less=True) for _ in range(4))
        m.d.comb += [self.bank.eq(bank), fresh.eq(self.shadow_free | (still_free & (bank == before)))]
        m.d.sync += [bank.eq(bank ^ (self.swaps & self.may_swap)), before.eq(bank), still_free.eq(fresh)]
        m.d.comb += self.write_enable.eq(self.writes & still_free & (bank == before))
        return m


class OneBank(Proof):
    """From one instruction of a sample to the next its bank stays, and words are written to the other one meanwhile."""

    def __init__(self, module: ModuleType) -> None:
        ports = []
        module.ReloadPort = lambda *given, **named: ports.append(AnyPort(*given, **named)) or ports[-1]
        made = program(limiter(), 3)
        super().__init__(module.FoldedCore(limiter(), made, serial=False, fingerprint=1))
        self.ports = ports
        self.swaps, self.writes = self.free(1, "swaps"), self.free(1, "writes")

    def state(self, m: Module) -> None:
        """State it."""
        (port,) = self.ports
        m.d.comb += [port.swaps.eq(self.swaps), port.writes.eq(self.writes)]
        bank, fetched = self.inside["bank"], self.inside["valid1"]  # an instruction was fetched the clock before
        before, written = Signal(), Signal()
        m.d.proof += [before.eq(bank), written.eq(port.write_enable & (bank != port.bank))]
        with m.If(self.started & fetched):
            m.d.comb += [Assert(bank == before), Assert(~written)]


@pytest.mark.slow
def test_a_sample_in_work_keeps_its_bank(tmp_path: Path) -> None:
    assert prove(OneBank(broken(folded, "kept.eq(port.bank)", "kept.eq(port.bank)")), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("port.shadow_free.eq(~control.busy | (kept == port.bank))", "port.shadow_free.eq(1)"),
        ("kept.eq(port.bank)", "kept.eq(~port.bank)"),
    ],
)
def test_a_core_that_mixes_banks_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(OneBank(broken(folded, right, wrong)), tmp_path) == "FAIL"


@pytest.mark.slow
def test_the_reload_port_writes_free_banks_only(tmp_path: Path) -> None:
    assert prove(WritesFreeBanks(reload.ReloadPort(1, bits=1)), tmp_path) == "PASS"


@pytest.mark.slow
def test_a_reload_port_that_does_not_wait_is_found_out(tmp_path: Path) -> None:
    module = broken(reload, "& ~self.pending & self.shadow_free", "& ~self.pending")
    assert prove(WritesFreeBanks(module.ReloadPort(1, bits=1)), tmp_path) == "FAIL"
