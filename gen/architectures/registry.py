"""The registry of architectures: what hardware a datapath can get.

Each architecture is a class of its own, registered once, here; its terms stand in
`sosmith.gen.specification.combinations`. Search, proof, report, comparison and exploration ask the class.
"""

from __future__ import annotations

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.architectures.budget import Budget
from sosmith.gen.architectures.cic import Cic
from sosmith.gen.architectures.folded import Folded
from sosmith.gen.architectures.folded_fir import FoldedFir, NarrowFir
from sosmith.gen.architectures.multiplexed import Multiplexed
from sosmith.gen.architectures.online import Online
from sosmith.gen.architectures.parallel import Parallel
from sosmith.gen.architectures.polyphase import Polyphase
from sosmith.gen.architectures.serial import Serial
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.choices import AUTO
from sosmith.gen.specification.combinations import CHANNELS, CIC_DECIMATE, FIR_DECIMATE, FOLDED, PARALLEL, Option, Terms
from sosmith.model.dataflow.datapath import Datapath

SMALLEST_FIRST: tuple[type[Architecture], ...] = (Serial, Folded, Multiplexed, Parallel, Online)
"""All architectures by the hardware that they take where multiplications are many: no multiplier block, one, many."""

ARCHITECTURES: dict[str, type[Architecture]] = {each.terms.name: each for each in SMALLEST_FIRST}
"""All architectures that a specification can name, by name, the smallest first."""

MEASURED = tuple(name for name, each in ARCHITECTURES.items() if each.measured_as() == name)
"""Those of which synthesized cores say what they take, and not those of another one."""


def candidates(
    wanted: str, blocks: Blocks, options: tuple[Option, ...] = (), *, rings: bool = False, cycles: int = 0
) -> tuple[type[Architecture], ...]:
    """Architectures to try for the one that the specification asks for beside `options`, the smallest first.

    `rings` says that the core is an FIR filter whose samples a ring of memory can hold, which takes fewer clocks than a
    program in the folded architecture; `cycles`, how many clocks there are for each result, 0 for any.
    """
    folded: tuple[type[Architecture], ...] = (NarrowFir, FoldedFir) if blocks.asked is None else (NarrowFir,)
    ways: tuple[tuple[Terms, tuple[type[Architecture], ...]], ...] = ()
    if CIC_DECIMATE in options and CHANNELS not in options:  # adders alone, without a multiplier or memory
        ways = ((PARALLEL, (Cic,)), (FOLDED, folded))
    elif CIC_DECIMATE in options:  # the adders have more memories than one multiplier and rings
        ways = ((FOLDED, folded), (PARALLEL, (Cic,)))
    elif FIR_DECIMATE in options:
        ways = ((FOLDED, folded), (PARALLEL, (Polyphase,)))
    if ways:
        return tuple(
            each for terms, own in ways if wanted in {AUTO, terms.name} and terms.takes(options) for each in own
        )
    if wanted != AUTO:
        kinds: tuple[type[Architecture], ...] = (ARCHITECTURES[wanted],)
    else:
        quick = [each for each in SMALLEST_FIRST if not cycles or each.least_clocks <= cycles]
        kinds = tuple(each for each in quick if each.is_tried(blocks) and each.terms.takes(options))
    if not rings:
        return kinds
    return tuple(each for kind in kinds for each in (folded if kind is Folded else (kind,)))


def fitting(
    kind: type[Architecture],
    budget: Budget,
    datapath: Datapath,
    board: Board | None = None,
    *,
    look_ahead: bool = False,
    calibration: Architecture | None = None,
) -> Architecture:
    """Return the hardware that an architecture makes of `datapath`, for a board if there is one.

    `calibration` is the hardware of the calibration before its decimator.

    Raises
    ------
    ShortfallError
        If the datapath cannot be folded, or the architecture does not keep up.
    """
    architecture = kind(
        datapath,
        budget.channels,
        budget.reload,
        budget.protect,
        kind.digit_bits_on(board),
        budget.blocks,
        budget.samples_per_clock,
        look_ahead,
        budget.hold,
        calibration,
        budget.reload_lock,
        budget.reload_registers,
        float(budget.clock),
        budget.cycles,
    )
    budget.check(architecture)
    architecture.check_blocks()
    if budget.reload:
        architecture.check_registers()
    return architecture


def reason_for(architecture: Architecture, budget: Budget, *, asked: bool, board: Board | None, refused: str) -> str:
    """Explain the choice of an architecture; `refused` says why a smaller one was rejected, if one was tried."""
    smallest = "the smallest that keeps up"
    if board is not None:
        there = f"{board.device.multipliers} multipliers" if board.device.multipliers else "no multipliers"
        smallest += f" on {board.name}, whose {board.device.title} has {there}"
    why = "asked for in the specification" if asked else refused or smallest
    return architecture.reason(why, budget.cycles)
