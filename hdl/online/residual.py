"""The residual of on-line arithmetic in carry-save form, and the selection of a digit at each step.

With 8 fraction bits; what is left of the point counts modulo 4::

                      2 word     2 carries   increment
                      2.8 |        2.8 |      2.8 |
                          +-----> 3:2 <-----------+      no carry goes further than one bit
                                 |     |
              total, lower 6 bits|     |carry, lower 6 bits
              upper 4 bits  +----+     +----+  upper 4 bits
                            +-----> + <-----+            top: 2.2, the estimate
                                    |
                                 select ---> [digit]
                                    |
                  top - 4 digit ----+---> [word], upper 4 bits; its lower 6 bits: total
                                          [carries]: lower 6 bits of carry

A step takes one clock, in which the longest path is one full adder, a sum of four bits and the selection, whatever the
width of the residual is.
"""

from __future__ import annotations

from dataclasses import dataclass

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value

from sosmith.hdl.online.digits import digit
from sosmith.model.sections.online import TOP_BITS, OnlineSection


@dataclass(frozen=True)
class Residual:
    """The residual of a unit, and the digit that was selected last.

    Attributes
    ----------
    section : OnlineSection
        What the unit computes.
    word, carries : Signal
        Registers of `residual_bits` of the section, and of as many without the top: the residual is their sum, modulo
        4.
    digit : Signal
        The digit.
    name : str
        Name of the unit.
    """

    section: OnlineSection
    word: Signal
    carries: Signal
    digit: Signal
    name: str

    @classmethod
    def of(cls, section: OnlineSection, name: str) -> Residual:
        """Make the registers."""
        bits = section.residual_bits
        return cls(
            section,
            Signal(bits, name=f"{name}_word"),
            Signal(bits - TOP_BITS, name=f"{name}_carries"),
            digit(f"{name}_selected"),
            name,
        )

    def step(self, m: Module, increment: Value, selects: Value, clear: Value) -> Signal:
        """Make one step a clock; return the digit. With `clear`, the residual starts again at 0."""
        bits = self.section.residual_bits
        low = bits - TOP_BITS
        a = Cat(Const(0, 1), self.word)[:bits]
        b = Cat(Const(0, 1), self.carries, Const(0, TOP_BITS))[:bits]
        total = Signal(bits, name=f"{self.name}_total")
        carry = Signal(bits, name=f"{self.name}_carry")
        top = Signal(TOP_BITS, name=f"{self.name}_top")
        m.d.comb += [
            total.eq(a ^ b ^ increment),
            carry.eq(Cat(Const(0, 1), a & b | a & increment | b & increment)),
            top.eq(total[low:] + carry[low:]),
        ]
        plus, minus = Signal(name=f"{self.name}_plus"), Signal(name=f"{self.name}_minus")
        ups = [u for u in range(1 << TOP_BITS) if self.section.select(u) > 0]
        downs = [u for u in range(1 << TOP_BITS) if self.section.select(u) < 0]
        m.d.comb += [plus.eq(top.matches(*ups)), minus.eq(top.matches(*downs))]
        left = top - (Cat(Const(0, 2), plus, Const(0, 1)) - Cat(Const(0, 2), minus, Const(0, 1)))
        m.d.sync += [
            self.word.eq(Cat(total[:low], Mux(selects, left[:TOP_BITS], top))),
            self.carries.eq(carry[:low]),
            self.digit.eq(Mux(selects, Cat(plus, minus), 0)),
        ]
        with m.If(clear):
            m.d.sync += [self.word.eq(0), self.carries.eq(0), self.digit.eq(0)]
        return self.digit
