"""Two words in registers, where a memory of two words takes more logic: the states of two channels.

::

                              +-> name_clear0, name_write0 --> +------------+
    clear, clear_address -----|                       +------> | name_word0 |---> 0 +-----+
    write, write_address -----|     data -------------|        +------------+       | Mux |--> what is read, at once
                              |                       +------> +------------+ ----> +-----+
                              +-> name_clear1, name_write1 --> | name_word1 |     1    ^
                                                               +------------+       address

An ECP5 takes 6 LUT4 for 4 bits of LUT RAM, and one for each bit that is cleared on its way in. A register has an input
that clears it, so that these two words take one LUT4 for a bit of both.
"""

from __future__ import annotations

from amaranth.hdl import Module, Mux, Shape, Signal, Value


def two_words(
    m: Module,
    shape: Shape,
    name: str,
    *,
    address: Value,
    write: Value,
    write_address: Value,
    data: Value,
    clear: Value,
    clear_address: Value,
) -> Value:
    """Keep two words in registers; return the one at `address`, without a clock.

    At each clock, one word takes over `data` if `write` is high; while `clear` is high, one becomes 0 instead. Before
    the first clock, both are 0, which a reset does not change.

    Parameters
    ----------
    m : Module
        Where the registers are.
    shape : Shape
        That of a word.
    name : str
        What the names of the nets begin with.
    address, write_address, clear_address : Value
        One bit: which word is read, written and cleared.
    write, clear : Value
        One bit.
    data : Value
        What is written.
    """
    writing, where = Signal(name=f"{name}_write"), Signal(name=f"{name}_write_address")
    m.d.comb += [writing.eq(write & ~clear), where.eq(write_address)]
    words = []
    for k in range(2):
        word = Signal(shape, name=f"{name}_word{k}", reset_less=True)
        clears, writes = Signal(name=f"{name}_clear{k}"), Signal(name=f"{name}_write{k}")
        m.d.comb += [
            clears.eq(clear & (clear_address if k else ~clear_address)),
            writes.eq(writing & (where if k else ~where)),
        ]
        with m.If(clears):  # before what is written, and not within it, or Yosys clears by logic
            m.d.sync += word.eq(0)
        with m.Elif(writes):
            m.d.sync += word.eq(data)
        words.append(word)
    return Mux(address, words[1], words[0])
