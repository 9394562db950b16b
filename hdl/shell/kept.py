"""What a core keeps from one sample to the next beside its states, such as where it is in its turn.

::

    name_next ..  ----> [name] ..                          a register for each field, if nothing guards them

    name_next ..  ----> check bits ----> [kept_word] --> check bits --> name ..    else one word, mended at each clock
          ^                                                  |   |
          +--- name, if it is not loaded --------------------+   +----> kept_syndrome

A wrong bit here would change all that follows, and no parity could say what it was. So the word has check bits that
correct it, even where wrong bits are only detected elsewhere. Latency: one clock.
"""

from __future__ import annotations

from collections.abc import Mapping

from amaranth.hdl import Cat, Module, Signal, Value

from sosmith.hdl.check_bits import CheckBits
from sosmith.hdl.status import NEVER


class Kept:
    """Registers with a name each, or fields of one word with check bits.

    Parameters
    ----------
    m : Module
        Where they are.
    sizes : mapping of str to int
        Width of each by its name, in bits. All are 0 from a reset on.
    guarded : bool
        Whether they have check bits.

    Attributes
    ----------
    values : dict of str to Signal
        What they hold.
    corrected, failed : Value
        Whether a wrong bit is corrected at this clock, and whether there are two.
    """

    def __init__(self, m: Module, sizes: Mapping[str, int], *, guarded: bool) -> None:
        self._m = m
        self.values = {name: Signal(bits, name=name) for name, bits in sizes.items()}
        self._domain, self._loaded = "sync", self.values
        self.corrected = self.failed = NEVER
        if not guarded:
            return
        check = CheckBits(sum(sizes.values()), "correct")
        word = Signal(check.width, name="kept_word")
        read = check.read(m, word, "kept")
        self.corrected, self.failed = read.corrected, read.failed
        self._domain = "comb"
        self._loaded = {name: Signal(bits, name=f"{name}_next") for name, bits in sizes.items()}
        m.d.comb += Cat(*self.values.values()).eq(read.data)
        m.d.comb += [self._loaded[name].eq(value) for name, value in self.values.items()]
        m.d.sync += word.eq(check.written(Cat(*self._loaded.values())))

    def load(self, name: str, value: Value | int) -> None:
        """Have a field take over a value at the next clock, under the conditions that are open in the module."""
        self._m.d[self._domain] += self._loaded[name].eq(value)
