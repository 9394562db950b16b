"""On a board, a core that was locked once is not loaded again, however often a session of the link resets it."""

from pathlib import Path
from typing import Any

import pytest
from amaranth.hdl import Assert, Assume, ClockSignal, Module, Signal
from tests.formal.prover import Proof, broken, prove

from sosmith.hdl.boards import lock_keeper
from sosmith.hdl.reload import ReloadPort
from sosmith.model.reload.registers import ADDRESS_BITS, LOCKING_STATUS, STATUS


class StaysLocked(Proof):
    """Since a write of ``STATUS`` was answered without an error, without a reset of the board: nothing is loaded.

    The reset of the design is that of a session, at any clock. Of the link it is assumed that it holds an address until
    the write is answered.
    """

    def __init__(self, module: Any = lock_keeper, *, with_sessions: bool = False) -> None:
        super().__init__(ReloadPort(1, bits=1, lock=True))
        self.keeper = module.LockKeeper(ADDRESS_BITS)
        self._inputs = [each for each in self._inputs if each is not self.design.s_axil_awaddr]
        self.target, self.board_reset = self.free(ADDRESS_BITS, "target"), self.free(1, "board_reset")
        self.with_sessions = with_sessions

    def state(self, m: Module) -> None:
        """State it."""
        d, keeper = self.design, self.keeper
        m.submodules.keeper = keeper
        answered = d.s_axil_bvalid & d.s_axil_bready
        m.d.comb += [
            keeper.clk.eq(ClockSignal("proof")),
            keeper.rst.eq(self.board_reset | (self.reset & self.with_sessions)),
            keeper.i_target.eq(self.target),
            d.s_axil_awaddr.eq(keeper.o_target),
            keeper.i_answered.eq(answered),
            keeper.i_response.eq(d.s_axil_bresp),
            keeper.i_data.eq(d.s_axil_rdata),
        ]
        with m.If(~self.started):
            m.d.comb += Assume(self.board_reset)
        waiting, held = Signal(), Signal(ADDRESS_BITS)
        m.d.proof += [
            waiting.eq((waiting | d.s_axil_awvalid & d.s_axil_awready) & ~answered & ~self.reset),
            held.eq(self.target),
        ]
        with m.If(waiting):
            m.d.comb += Assume(self.target == held)
        at_status = self.target[2:] == STATUS.index
        closed, before = Signal(), Signal()
        m.d.proof += [
            closed.eq((closed | answered & ~d.s_axil_bresp[1] & at_status) & ~self.board_reset),
            before.eq(d.bank),
        ]
        with m.If(self.started & closed):
            m.d.comb += [
                Assert(~self.inside["loading"]),
                Assert(~d.pending),
                Assert(~d.write_enable),
                Assert(d.bank == before),
                Assert(~at_status | (keeper.o_data & LOCKING_STATUS.field("LOCKED").mask).any()),
            ]


@pytest.mark.slow
def test_a_locked_board_keeps_its_coefficients(tmp_path: Path) -> None:
    assert prove(StaysLocked(), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("index.matches(VERSION.index, DATA.index, CRC.index)", "index.matches(DATA.index, CRC.index)"),
        ("self.i_answered & ~self.i_response[1] & at_status", "self.i_answered & ~self.i_response[1] & loads"),
        ("shut.eq(1)", "shut.eq(~shut)"),
        ("Mux(shut & loads, ID.address, self.i_target)", "self.i_target"),
        ("Mux(shut & at_status,", "Mux(shut & loads,"),
    ],
    ids=["a version", "another register", "a second write", "no other address", "not read"],
)
def test_a_keeper_that_lets_something_through_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(StaysLocked(broken(lock_keeper, right, wrong)), tmp_path) == "FAIL"


@pytest.mark.slow
def test_a_keeper_that_a_session_resets_is_found_out(tmp_path: Path) -> None:
    assert prove(StaysLocked(with_sessions=True), tmp_path) == "FAIL"
