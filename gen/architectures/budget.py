"""Time and multiplier blocks that there are for a core, and whether an architecture keeps up."""

from __future__ import annotations

import decimal
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.model.errors import ShortfallError


@dataclass(frozen=True, kw_only=True)
class Budget:
    """Time and multiplier blocks available to the hardware.

    Attributes
    ----------
    clock, sample_rate : Fraction
        Clock frequency and sample rate of each channel, in Hz.
    channels : int
        Number of channels.
    reload : bool
        Whether the hardware's constants can be loaded.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    blocks : Blocks
        Multiplier blocks.
    decimate : int
        Samples for each result.
    samples_per_clock : int
        Samples in a beat of the streams.
    hold : bool
        Whether each result behind a decimator is handed out once for each of its samples.
    reload_lock : bool
        Whether loading can be locked until a reset.
    reload_registers : bool
        Whether there are registers for that; otherwise pins, for registers elsewhere.
    """

    clock: Fraction
    sample_rate: Fraction
    channels: int = 1
    reload: bool = False
    protect: str = "none"
    blocks: Blocks = NO_LIMIT
    decimate: int = 1
    samples_per_clock: int = 1
    hold: bool = False
    reload_lock: bool = False
    reload_registers: bool = True

    @property
    def adders(self) -> bool:
        """Whether no product by a constant may take a multiplier block in the parallel architecture."""
        return self.blocks.available == 0 and not self.reload

    @property
    def cycles(self) -> int:
        """Clocks available for one result of one channel, or for one beat of them."""
        return int(self.clock * self._at_once / (self.sample_rate * self.channels))

    @property
    def _at_once(self) -> int:
        """Samples that a result, or a beat of them, stands for."""
        return self.decimate * self.samples_per_clock

    def check(self, architecture: Architecture) -> None:
        """Check that `architecture` keeps up.

        Raises
        ------
        ShortfallError
            If the architecture takes more clocks than available; gives the highest rate that it can achieve.
        """
        needed = architecture.cycles_per_result
        if needed <= self.cycles:
            return
        most, wanted = _distinct_texts(self.clock * self._at_once / (needed * self.channels), self.sample_rate)
        many = f" with {self.channels:,} channels" if self.channels > 1 else ""
        per = "a sample" if self._at_once == 1 else f"for {self._at_once} samples"
        raise ShortfallError(
            f"the {architecture.name} architecture takes {needed:,} clock{'s' * (needed > 1)} {per}: at a clock of "
            f"{_in_full(self.clock, 12)} Hz{many} the sample rate must be at most {most} Hz, not {wanted} Hz"
        )


def _distinct_texts(most: Fraction, wanted: Fraction) -> tuple[str, str]:
    """Texts of two rates with enough digits to tell them apart; `most` is rounded down, so that it is achievable."""
    for digits in range(6, 17):
        context = decimal.Context(prec=digits, rounding=decimal.ROUND_FLOOR)
        floor = context.divide(decimal.Decimal(most.numerator), decimal.Decimal(most.denominator))
        texts = f"{floor:,f}", _in_full(wanted, digits)
        if texts[0] != texts[1]:
            break
    return texts


def _in_full(rate: Fraction, digits: int) -> str:
    """Text of a rate with so many significant digits, and without an exponent."""
    return f"{decimal.Decimal(f'{float(rate):.{digits}g}'):,f}"
