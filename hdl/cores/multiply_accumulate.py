"""The unit that runs a folded core's program: a multiplier, or shifts and additions instead, and an accumulator."""

from __future__ import annotations

from typing import NamedTuple

from amaranth.hdl import Cat, Module, Mux, Signal, Value, signed

from sosmith.hdl.instruction import PipelinedInstruction
from sosmith.model.dataflow.program import CARRIES, CLEARS, PRODUCTS, Opcode, Program

_STAYS_APART = {"keep": 1}
"""Attribute of a register that Yosys 0.70 (`ice40_dsp`) would take into both of the MAC16 that it lies between.

One of them then misses in its netlist.
"""


class MultiplyAccumulate(NamedTuple):
    """Such a unit.

    Attributes
    ----------
    program : Program
        What it runs.
    serial : bool
        Whether to multiply by shifts and additions instead of a hardware multiplier.
    reloads : bool
        Whether other programs can be loaded.
    """

    program: Program
    serial: bool
    reloads: bool

    @property
    def word(self) -> int:
        """Width of a word."""
        return self.program.digit_bits + 1

    def fill(
        self,
        m: Module,
        advance: Signal,
        stages: tuple[PipelinedInstruction, PipelinedInstruction],
        values: tuple[list[Signal], Signal],
    ) -> None:
        """Multiply in the last pipeline stage but one, add up in the last.

        Parameters
        ----------
        m : Module
        advance : Signal
            Driven here: whether the pipeline moves at this clock.
        stages : pair of PipelinedInstruction
            The instruction whose words have just been read, and that of the last stage.
        values : list of Signal, and Signal
            The words read, one or two, and what is added up, which is driven here.
        """
        reading, last = stages
        (read, *second), added = values
        chosen = Signal(signed(self.word))
        total = self._total(m, added, advance, last)
        m.d.comb += chosen.eq(reading.constant)
        if self.reloads or any(i.opcode is Opcode.OPERAND for i in self.program.instructions):
            operand = Signal(signed(self.word), reset_less=True)
            with m.If(reading.has(*PRODUCTS)):
                m.d.comb += chosen.eq(operand)
            with m.If(advance & reading.has(Opcode.OPERAND)):
                m.d.sync += operand.eq(read)
        if self.serial:
            self._multiply_serially(m, (total, added), (read, chosen), (advance, last.valid))
            return
        product = self._product(m, "", read, chosen)
        if second:
            other = self._product(m, "second_", second[0], reading.second_constant)
            products = Signal(signed(2 * self.word + 1), reset_less=True)
            m.d.sync += products.eq(product + other)
            product = products
        m.d.comb += [advance.eq(1), added.eq(total + product)]

    def _product(self, m: Module, prefix: str, word: Value, factor_read: Value) -> Value:
        """Return the product of a word that has been read and a factor, two clocks later.

        Nothing else reads these registers, so that they can be those inside a multiplier block.
        """
        data, factor = (
            Signal(signed(self.word), name=f"{prefix}{name}", reset_less=True) for name in ("data", "factor")
        )
        product = Signal(
            signed(2 * self.word), name=f"{prefix}product", reset_less=True, attrs=_STAYS_APART if prefix else {}
        )
        m.d.sync += [data.eq(word), factor.eq(factor_read), product.eq(data * factor)]
        return product

    def _total(self, m: Module, added: Signal, advance: Signal, last: PipelinedInstruction) -> Value:
        """Return what is left of the sum before the last instruction.

        Its upper bits are kept as they were added up, and shifted by a digit a clock later: they are the last that the
        carry chain reaches, and the sign would have far to go from there. Its lower bits are shifted at once, since
        the carry chain begins with them.
        """
        bits = self.program.digit_bits
        split = (bits + 1) // 2
        low = Signal(split, name="total_low")
        high = Signal(signed(len(added) - split), name="total_high")
        carries = Signal()
        carried = Signal(reset_less=True)
        m.d.comb += carries.eq(advance & last.has(*CARRIES))
        m.d.sync += [low.eq(Mux(carries, added >> bits, added)), high.eq(added >> split), carried.eq(carries)]
        with m.If(~last.valid | (advance & last.has(*CLEARS))):
            m.d.sync += [low.eq(0), high.eq(0)]
        total = Signal(signed(len(added)))
        m.d.comb += total.eq(Cat(low, Mux(carried, high >> bits, high)))
        return total

    def _multiply_serially(
        self,
        m: Module,
        sums: tuple[Value, Signal],
        factors: tuple[Value, Value],
        control: tuple[Signal, Value],
    ) -> None:
        """Add a product to `total`, one clock for each bit of the second factor, the lowest first, until none is left.

        What is left of a negative factor ends as -1, which takes one subtraction. The first factor is shifted up at
        each clock.
        """
        (total, added), (advance, multiplies) = sums, control
        shifted = Signal(signed(2 * self.word), reset_less=True)
        left = Signal(signed(self.word), reset_less=True)
        done = Signal()
        multiple = Signal(signed(2 * self.word))
        m.d.comb += [
            multiple.eq(Mux(left[0], shifted, 0)),
            done.eq((left == -1) | ~left[1:].any()),
            advance.eq(~multiplies | done),
            added.eq(Mux(left == -1, total - multiple, total + multiple)),
        ]
        m.d.sync += [shifted.eq(shifted << 1), left.eq(left >> 1)]
        with m.If(advance):
            m.d.sync += [shifted.eq(factors[0]), left.eq(factors[1])]
