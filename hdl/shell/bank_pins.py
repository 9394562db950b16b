"""Pins at which the constants of a core are loaded, where the registers are elsewhere and belong to several cores.

::

    reload_write, reload_address, reload_data ----> write_enable, write_address, write_data ----> idle bank
    reload_bank ----------------------------------> bank
    shadow_free ----------------------------------> reload_free
    begun ----------------------------------------> reload_begun

`sosmith.hdl.shared_registers` drives them. It must not change `reload_bank` while some of the cores have chosen the
bank of a sample and others have not. Latency: none.
"""

from __future__ import annotations

from amaranth.hdl import Module, Signal, Value
from amaranth.lib.wiring import In, Out

from sosmith.model.reload.registers import BANK_INPUTS


def bank_members(words: int, bits: int, *, protected: bool) -> dict[str, In | Out]:
    """Return the members of a core with `words` words of `bits` bits in a bank."""
    widths = (1, max(1, (words - 1).bit_length()), bits, 1)
    members = {name: In(width) for name, width in zip(BANK_INPUTS, widths, strict=False)}
    given: dict[str, In | Out] = {"reload_free": Out(1), "reload_begun": Out(1)}
    if protected:
        given |= {"reload_corrected": Out(1), "reload_failed": Out(1), BANK_INPUTS[-1]: In(1)}
    return members | given


class BankPins:
    """What a core sees of the registers, as of a `sosmith.hdl.reload.ReloadPort`: the attributes are named as there.

    Parameters
    ----------
    words, bits : int
        Words of a bank, and bits of each.
    """

    def __init__(self, words: int, bits: int) -> None:
        self.write_enable = Signal()
        self.write_address = Signal(range(words))
        self.write_data = Signal(bits)
        self.bank = Signal(name="bank_given")
        self.may_swap = Signal()
        self.shadow_free = Signal()
        self.corrected = Signal()
        self.failed = Signal(name="found_failed")
        self.acknowledge = Signal(name="acknowledged")

    def join(self, m: Module, core: object, begun: Value) -> None:
        """Connect them to the pins of a core; `begun` says that a sample not taken yet has chosen its bank."""
        pins = {
            "reload_write": self.write_enable,
            "reload_address": self.write_address,
            "reload_data": self.write_data,
            "reload_bank": self.bank,
            "reload_acknowledge": self.acknowledge,
        }
        m.d.comb += [own.eq(getattr(core, pin)) for pin, own in pins.items() if hasattr(core, pin)]
        given = {
            "reload_free": self.shadow_free,
            "reload_begun": begun,
            "reload_corrected": self.corrected,
            "reload_failed": self.failed,
        }
        m.d.comb += [getattr(core, pin).eq(value) for pin, value in given.items() if hasattr(core, pin)]
