"""Once a core is locked, nothing changes its coefficients until a reset: no word is written, no bank becomes active."""

from pathlib import Path

import pytest
from amaranth.hdl import Assert, Module, Signal
from tests.formal.prover import Proof, broken, prove

from sosmith.hdl import reload


class StaysLocked(Proof):
    """Since the clock at which `locked` was seen, without a reset: no write, no swap, and it stays."""

    def state(self, m: Module) -> None:
        """State it."""
        d = self.design
        closed, before = Signal(), Signal()
        m.d.proof += [closed.eq(d.locked & ~self.reset), before.eq(d.bank)]
        with m.If(self.started & closed):
            m.d.comb += [Assert(d.locked), Assert(~d.pending), Assert(~d.write_enable), Assert(d.bank == before)]


def port(module: object = reload) -> reload.ReloadPort:
    return module.ReloadPort(1, bits=1, lock=True)  # type: ignore[attr-defined, no-any-return]


@pytest.mark.slow
def test_a_locked_core_keeps_its_coefficients(tmp_path: Path) -> None:
    assert prove(StaysLocked(port()), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("(writable & ~self.locked)", "writable"),
        ("& ~loading & ~self.pending", "& ~loading"),
        ("self.locked.eq(1)", "self.locked.eq(~self.locked)"),
    ],
    ids=["writes", "a swap that is pending", "a second write"],
)
def test_a_lock_that_lets_something_through_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(StaysLocked(port(broken(reload, right, wrong))), tmp_path) == "FAIL"
