"""Signed digits in hardware: what a digit is, the way from a word to digits, and from digits to a word.

A digit is two bits, one of which is 1 for the digit 1 and the other for -1::

    digit     plus   minus
      1         1      0
      0         0      0
     -1         0      1
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import reduce
from itertools import product
from operator import and_

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value


def digit(name: str) -> Signal:
    """Make a register for a digit: bit 0 is plus, bit 1 minus."""
    return Signal(2, name=name)


def line(m: Module, source: Value, clocks: int, name: str) -> list[Value]:
    """Return a digit after 0, 1, .. clocks, through as many registers."""
    taps = [source]
    for k in range(clocks):
        register = digit(f"{name}_after{k + 1}")
        m.d.sync += register.eq(taps[-1])
        taps.append(register)
    return taps


def multiples(digits: Sequence[Value], factors: Sequence[Fraction], bits: int, frac: int) -> Value:
    """Return the sum of one or two digits times their factors, as a word of `bits` bits with `frac` fraction bits.

    Each bit of it is a function of the digits' bits, no more than one LUT4.
    """
    word: Value = Const(0, bits)
    for signs in product((0, 1, -1), repeat=len(digits)):
        total = sum((f * s for f, s in zip(factors, signs, strict=True)), Fraction(0)) * 2**frac
        if total:
            here = reduce(and_, (_is(of, sign) for of, sign in zip(digits, signs, strict=True)))
            word = word | Mux(here, Const(int(total) & ((1 << bits) - 1), bits), 0)
    return word


def _is(of: Value, sign: int) -> Value:
    """Whether a digit is 1, 0 or -1."""
    return ~of.any() if sign == 0 else of[int(sign < 0)]


def with_multiple(word: Value, of: Value, factor: Fraction, frac: int) -> Value:
    """Return `word` plus a digit times a factor, in as many bits.

    The multiple is free of logic: each of its bits is plus or minus, and minus is also what completes a two's
    complement.
    """
    bits = len(word)
    code = int(factor * 2**frac)
    plus, minus = of[0], of[1]
    multiple = Cat(*(plus if code >> k & 1 else minus for k in range(bits)))
    return (Cat(Const(1, 1), word) + Cat(minus, multiple))[1 : bits + 1]


def shifted_out(m: Module, load: Value, word: Value, name: str) -> Value:
    """Return the digits of a two's complement word, the sign's first; it is loaded at the clock with `load`."""
    register = Signal(len(word), name=name)
    top = Signal(name=f"{name}_top")
    m.d.sync += [register.eq(Mux(load, word, register << 1)), top.eq(load)]
    return Cat(register[-1] & ~top, register[-1] & top)


def on_the_fly(m: Module, of: Value, clear: Value, bits: int, name: str) -> Signal:
    """Return the word of the digits that have come since `clear`, modulo its width, without a carry.

    Of the number so far there is one register for it and one for one less; a digit is appended to one of them
    (Ercegovac and Lang)::

        digit     number             one less
          1       number, 1          number, 0
          0       number, 0          one less, 1
         -1       one less, 1        one less, 0
    """
    number, less = Signal(bits, name=name), Signal(bits, name=f"{name}_less", init=(1 << bits) - 1)
    plus, minus = of[0], of[1]
    m.d.sync += [
        number.eq(Cat(plus | minus, Mux(minus, less, number)[:-1])),
        less.eq(Cat(~(plus | minus), Mux(plus, number, less)[:-1])),
    ]
    with m.If(clear):
        m.d.sync += [number.eq(0), less.eq((1 << bits) - 1)]
    return number
