"""How a datapath becomes hardware: every operation at once, or one unit for all of them."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from amaranth.lib.wiring import Component

from sosmith.hdl import core, folded
from sosmith.model.datapath import Datapath
from sosmith.model.errors import ShortfallError
from sosmith.model.program import FoldingError, Program, program

DIGIT_BITS = 15
"""Of a digit: products of 16 bits, signed, fit one block of an iCE40 UltraPlus as well as one of an ECP5."""


@dataclass(frozen=True)
class Architecture:
    """A datapath and the kind of hardware that computes it.

    Attributes
    ----------
    name : str
        "parallel": every operation has its own hardware. "folded": one multiplier and one accumulator run a program.
        "serial": the same without a multiplier block.
    datapath : Datapath
        What is computed.
    """

    name: str
    datapath: Datapath

    @cached_property
    def program(self) -> Program | None:
        """What one unit runs; None in the parallel architecture.

        Raises
        ------
        ShortfallError
            If the datapath cannot be folded.
        """
        if self.name == "parallel":
            return None
        try:
            return program(self.datapath, DIGIT_BITS)
        except FoldingError as error:
            raise ShortfallError(f"the realization must suit the {self.name} architecture: {error}") from None

    @property
    def latency_cycles(self) -> int:
        """Clocks from the edge that accepts a sample to the edge that can hand it on; in serial, at most so many."""
        if self.program is None:
            return core.latency_cycles(self.datapath)
        return folded.latency_cycles(self.program, serial=self.name == "serial")

    @property
    def cycles_per_sample(self) -> int:
        """Clocks from one sample to the next at the highest rate; in serial, at most so many."""
        return 1 if self.program is None else self.latency_cycles + 1

    def component(self) -> Component:
        """Make the hardware, whose top module's name is that of the datapath."""
        if self.program is None:
            return core.Core(self.datapath)
        return folded.FoldedCore(self.datapath, self.program, serial=self.name == "serial")


def chosen(wanted: str, datapath: Datapath, *, clock: Fraction, sample_rate: Fraction) -> tuple[Architecture, str]:
    """Take the architecture that is asked for; return it and why.

    Parameters
    ----------
    wanted : str
        As in the specification.
    datapath : Datapath
        What is to be computed.
    clock, sample_rate : Fraction
        Hz.

    Raises
    ------
    ShortfallError
        If the datapath cannot be folded, or the architecture cannot keep up with the sample rate.
    """
    if wanted == "auto":
        return Architecture("parallel", datapath), "parallel: what is taken unless another is asked for"
    architecture = Architecture(wanted, datapath)
    needed = architecture.cycles_per_sample
    if needed * sample_rate > clock:
        most = float(clock / needed)
        raise ShortfallError(
            f"the {wanted} architecture takes {needed:,} clocks a sample: at a clock of {float(clock):,.0f} Hz the "
            f"sample rate must be at most {most:,.6g} Hz, not {float(sample_rate):,.6g} Hz"
        )
    if architecture.program is None:
        return architecture, "parallel: asked for in the specification"
    available = int(clock / sample_rate)
    return architecture, f"{wanted}: asked for in the specification; takes {needed:,} of {available:,} clocks a sample"
