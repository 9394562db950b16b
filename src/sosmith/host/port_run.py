"""A run of the accuracy suite on a board: the same codes, compared with the same integer model, over a serial port."""

from __future__ import annotations

import time

import numpy as np

from sosmith.host.board import Board
from sosmith.host.identity_check import check_design
from sosmith.model.arrays import Codes
from sosmith.sim.bench import Progress
from sosmith.sim.cosimulate import CosimulationResult


def run_on(board: Board, verilog: str, codes: Codes, progress: Progress) -> CosimulationResult:
    """Run `codes`, shape (samples, channels, inputs), through the core of a board, whose session has just begun.

    The clocks of the result are those that the board had, by its stated clock, in the time that the run took, the
    line included.

    Raises
    ------
    ShortfallError
        If the core was not made from the SystemVerilog `verilog`.
    SpecificationError, LinkError
        As `Board.run_codes`.
    """
    check_design(board.identity, verilog)
    started = time.monotonic()
    results = board.run_codes(codes, progress)
    seconds = time.monotonic() - started
    shape = (len(codes), -1)
    return CosimulationResult(
        codes=results.codes.reshape(shape)[:, :, np.newaxis],
        status=results.status.reshape(shape),
        cycles=round(seconds * board.identity.clock),
        wall_seconds=seconds,
        cycles_per_second=board.identity.clock,
        simulator="board",
        tools={"board made with sosmith": board.identity.sosmith},
    )
