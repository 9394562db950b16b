"""The steps of one multiplier that computes an FIR filter from samples in a ring, and their clocks.

A step adds two samples of one magnitude of tap, or takes one alone, and multiplies by the coefficient. Coefficients are
integers on one grid, the finest that any of them needs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port
from sosmith.model.reload.constants import SPARE_BITS
from sosmith.model.sections.fir import FirSection, Form

PIPELINE = 4
"""Clocks from the address of a step to its product's place in the sum: step, taps, sum of two, product."""


@dataclass(frozen=True)
class TapStep:
    """A product.

    Attributes
    ----------
    coefficient : int
        In units of ``2**-frac`` of `TapSteps`.
    first : int
        Delay in samples of a tap.
    second : int or None
        That of the other one; None if there is none.
    sign : int
        Sign of the second one, 1 or -1.
    part : int
        Which digit of their sum is multiplied, 0 for all of it.
    shift : int
        Digits by which the product is moved up.
    """

    coefficient: int
    first: int
    second: int | None = None
    sign: int = 1
    part: int = 0
    shift: int = 0


@dataclass(frozen=True)
class TapSteps:
    """All steps of a filter.

    Attributes
    ----------
    section : FirSection
        In a form that keeps samples: direct, or symmetric; of one tap, in any.
    loadable : bool
        Whether other coefficients can be loaded: then the steps are the same for all.
    """

    section: FirSection
    loadable: bool = False

    def __post_init__(self) -> None:
        if self.section.form is Form.TRANSPOSED and self.section.length > 1:
            raise ValueError("form must be one that keeps samples, not transposed")

    @property
    def frac(self) -> int:
        """Fraction bits of all coefficients."""
        return max(product.frac for product in self.section.products)

    @cached_property
    def steps(self) -> tuple[TapStep, ...]:
        """The products; a tap alone counts twice with half of its coefficient, if all such can and none is loaded."""
        steps: list[TapStep] = []
        for product in self.section.products:
            coefficient = product.coefficient << self.frac - product.frac
            taps = list(product.taps)
            while taps:
                (first, sign), *rest = taps
                if rest and self.section.form is Form.SYMMETRIC:
                    second, other = rest.pop(0)
                    steps.append(TapStep(sign * coefficient, first, second, sign * other))
                else:
                    steps.append(TapStep(sign * coefficient, first))
                taps = rest
        alone = [step for step in steps if step.second is None]
        if not self.loadable and len(alone) < len(steps) and not any(step.coefficient % 2 for step in alone):
            return tuple(
                replace(step, coefficient=step.coefficient // 2, second=step.first) if step.second is None else step
                for step in steps
            )
        return tuple(steps)

    @property
    def pairs(self) -> bool:
        """Whether any step adds two samples."""
        return any(step.second is not None for step in self.steps)

    @property
    def factor_bits(self) -> int:
        """Bits of a coefficient, with its sign, and one to spare for others."""
        sizes = ((-c - 1 if c < 0 else c).bit_length() for c in (step.coefficient for step in self.steps))
        return 1 + max(sizes) + (SPARE_BITS if self.loadable else 0)

    def pair_bits(self, port: Port) -> int:
        """Bits of a sum or a difference of two samples, or of one sample if no step adds two, with its sign."""
        return port.bits + self.pairs + (not port.signed)

    @property
    def words(self) -> int:
        """Samples that the ring of a channel holds, a power of two from 2 on."""
        return max(2, 1 << (self.section.length - 1).bit_length())


@dataclass(frozen=True)
class StepsInTurn:
    """The steps of filters that one multiplier computes one after the other, from the same samples.

    Coefficients are on the finest grid of all. Where a multiplier block is too narrow for a product, factors have
    digits, and a tap takes a step for each two of them.

    Attributes
    ----------
    filters : tuple of TapSteps
        At least one.
    port : Port
        Format of the samples.
    block : int or None
        Bits of an operand of the block, with its sign, that each product must fit; None for whole products.
    """

    filters: tuple[TapSteps, ...]
    port: Port
    block: int | None = None

    @property
    def frac(self) -> int:
        """Fraction bits of all coefficients."""
        return max(each.frac for each in self.filters)

    @property
    def pairs(self) -> bool:
        """Whether any step adds two samples."""
        return any(each.pairs for each in self.filters)

    @property
    def pair_bits(self) -> int:
        """Bits of a sum or a difference of two samples, or of one sample if no step adds two, with its sign."""
        return max(each.pair_bits(self.port) for each in self.filters)

    @property
    def digit_bits(self) -> int:
        """Bits of a digit but the top one, which has a sign too."""
        return (self.block or self.pair_bits) - 1

    @property
    def parts(self) -> int:
        """Digits of a sum of two samples."""
        return 1 if self.block is None else max(1, -(-(self.pair_bits - 1) // self.digit_bits))

    @cached_property
    def rounds(self) -> tuple[tuple[TapStep, ...], ...]:
        """The steps of each filter."""
        return tuple(
            tuple(
                replace(step, coefficient=digit, part=part, shift=part + place)
                for step in each.steps
                for place, digit in enumerate(self._digits(step.coefficient << self.frac - each.frac))
                for part in range(self.parts)
            )
            for each in self.filters
        )

    def _digits(self, coefficient: int) -> list[int]:
        """Split a coefficient into as few digits as it needs, the lowest first; only the top one has a sign."""
        digits = list[int]()
        while self.block is not None and not -(1 << self.digit_bits) <= coefficient < 1 << self.digit_bits:
            digits.append(coefficient & (1 << self.digit_bits) - 1)
            coefficient >>= self.digit_bits
        return [*digits, coefficient]

    @property
    def shifts(self) -> int:
        """Digits by which a product is moved up at most."""
        return max(step.shift for steps in self.rounds for step in steps)

    @property
    def factor_bits(self) -> int:
        """Bits of a coefficient, or of a digit of one, with its sign; with those to spare where others are loaded."""
        whole = max(each.factor_bits + self.frac - each.frac for each in self.filters)
        return whole if self.block is None else min(whole, self.block)

    @property
    def data_bits(self) -> int:
        """Bits of what a coefficient is multiplied by, with its sign."""
        return self.pair_bits if self.parts == 1 else self.digit_bits + 1

    @property
    def words(self) -> int:
        """Samples that the ring of a channel holds."""
        return max(each.words for each in self.filters)

    @property
    def last_steps(self) -> tuple[int, ...]:
        """Number of the clock at which each sum is complete, from the first step of its filter on."""
        return tuple(len(steps) + PIPELINE for steps in self.rounds)

    def cycles_per_result(self, factor: int, channels: int) -> int:
        """Clocks between results of a channel, or between all results of two samples, each of `factor` samples."""
        return factor * (1 + (channels > 1)) + sum(last + 1 for last in self.last_steps)

    def latency_cycles(self, channels: int, turn: int = 0) -> int:
        """Most clocks from the edge that accepts a sample to the edge that can output its result number `turn`.

        With several channels, that of the first sample of one, which fills the ring.
        """
        filled = self.words + 2 if channels > 1 else 0
        return filled + sum(last + 1 for last in self.last_steps[: turn + 1]) + 1

    def reset_cycles(self, channels: int) -> int:
        """Clocks after a reset until a sample on offer is accepted: while the ring is filled, or channels cleared."""
        return channels if channels > 1 else self.words


def tap_steps(datapath: Datapath, *, loadable: bool = False) -> TapSteps:
    """Return the steps of a datapath that is one FIR filter, for hardware whose coefficients are `loadable` or not.

    Raises
    ------
    ValueError
        If it has anything before its filter, or that keeps no samples.
    """
    section, *others = datapath.stages
    if not isinstance(section, FirSection) or len(others) != 1:
        raise ValueError(f"stages must be an FIR filter and the output, not {len(datapath.stages)}")
    return TapSteps(section, loadable)
