"""An estimate of what a core takes on an FPGA, before synthesis, with the error of such estimates.

LUT4 and flip-flops are sums of `sosmith.gen.estimate.core.quantities_of`, each times a factor that is fitted to
recorded synthesis for each architecture and family of FPGA. Factors, the error on designs that the fit has not seen,
and recorded clocks are data, in ``fitted.json`` beside this file, which ``python -m benchmarks.cost_estimate`` writes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import blocks_for
from sosmith.gen.estimate.core import quantities_of
from sosmith.gen.fpga.boards import Board, find_board

FITTED = Path(__file__).with_name("fitted.json")
"""File of the factors."""

USUAL = ("ulx3s_25f", "icebreaker", "tang_nano_9k")
"""Boards for which a core without a board is estimated, one for each family; the first one's FPGA is that of
explorations."""

TITLES = {"ice40": "iCE40", "ecp5": "ECP5", "gowin": "Gowin"}
"""Families of FPGAs that are estimated, by the name that they are called by."""


class Clocks(NamedTuple):
    """Clocks that placed cores of an architecture reach on an FPGA: lowest and highest median in MHz, and how many."""

    lowest: float
    highest: float
    cores: int


class Tested(NamedTuple):
    """What was found on designs that the fit has not seen.

    Attributes
    ----------
    designs : int
        Their number.
    nine_in_ten : float
        Relative error of LUT4 that nine in ten do not exceed.
    """

    designs: int
    nine_in_ten: float

    @property
    def sentence(self) -> str:
        """How good the number of LUT4 is."""
        return f"within {100 * self.nine_in_ten:.0f} % for 9 of 10 of {self.designs} designs tested"


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What a core takes on an FPGA, before synthesis; without a serial link.

    Attributes
    ----------
    board, device : str
        Name of the board, and title of its FPGA.
    luts : int
        LUT4, also as carry cells and distributed memory, as `Device.luts` counts them.
    flip_flops : int
        Flip-flops.
    multiplier_blocks : int
        Multiplier blocks of the FPGA.
    memory_bits : int
        Bits of memories, be they block RAM or LUT4.
    clocks : Clocks or None
        Clocks of placed cores of the same architecture on the same FPGA; None if too few are recorded.
    tested : Tested
        Error of `luts`.
    """

    board: str
    device: str
    luts: int
    flip_flops: int
    multiplier_blocks: int
    memory_bits: int
    clocks: Clocks | None
    tested: Tested

    def as_dict(self) -> dict[str, Any]:
        """Return it in the types of JSON; clocks in MHz."""
        told = {**asdict(self), "tested": self.tested._asdict()}
        return told | {"clocks": None if self.clocks is None else self.clocks._asdict()}

    @property
    def sentence(self) -> str:
        """What it takes, and how good that is."""
        return f"about {self.luts:,} LUT4 on {self.device}, {self.tested.sentence}"


def estimated(architecture: Architecture, board: Board) -> Estimate | None:
    """Estimate what the datapath of `architecture` takes in the same architecture made for a board.

    Products are made of adders where its FPGA has too few multiplier blocks, and digits are as wide as these take.

    Returns
    -------
    Estimate or None
        None for an FPGA of another family than `TITLES`.
    """
    if board.device.family not in TITLES:
        return None
    made = on_board(architecture, board)
    found = quantities_of(made, board.device)
    fitted = _fitted()
    of = fitted["factors"][architecture.measured_as()][board.device.family]
    tested = fitted["tested"][board.device.family]
    clocks = fitted["clocks"].get(architecture.name, {}).get(board.device.title)
    return Estimate(
        board=board.name,
        device=board.device.title,
        luts=round(total(found, of["luts"])),
        flip_flops=round(total(found, of["flip_flops"])),
        multiplier_blocks=round(found["blocks"]),
        memory_bits=round(found["memory_bits"]),
        clocks=None if clocks is None else Clocks(*clocks),
        tested=Tested(*tested),
    )


def usual_estimates(architecture: Architecture, board: Board | None = None) -> tuple[Estimate, ...]:
    """Estimate for a board, or without one for those of `USUAL`; empty if its family of FPGA is not estimated."""
    boards = [find_board(name) for name in USUAL] if board is None else [board]
    found = [estimated(architecture, each) for each in boards]
    return tuple(each for each in found if each is not None)


def on_board(architecture: Architecture, board: Board) -> Architecture:
    """Return the hardware that an architecture makes of the same datapath for a board."""
    before = None if architecture.calibration is None else on_board(architecture.calibration, board)
    return replace(
        architecture,
        blocks=blocks_for(architecture.blocks.available, board)._replace(asked=architecture.blocks.asked),
        digit_bits=architecture.digit_bits_on(board),
        calibration=before,
    )


def luts_of(found: Mapping[str, float], architecture: str, family: str) -> float:
    """Return the LUT4 that quantities of an architecture, by its name, come to in a family of FPGAs."""
    return total(found, _fitted()["factors"][architecture][family]["luts"])


def total(found: Mapping[str, float], factors: Mapping[str, float]) -> float:
    """Return the sum of quantities times their factors."""
    return sum(amount * factors.get(name, 0.0) for name, amount in found.items())


@cache
def _fitted() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(FITTED.read_text(encoding="utf-8"))
    return content
