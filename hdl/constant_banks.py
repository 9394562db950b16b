"""Two banks of registers for the constants of the parallel architecture: samples use one while the other is filled.

::

                                      bank 0                bank 1
    write_address --> word =? ---> [bank0_constant0]    [bank1_constant0] --+
    write_data    --- 32 --------> [bank0_constant1]    [bank1_constant1] --+--> Mux(bank of the sample) --> stage
    write_bank    --------------->  ..                   ..               --+        `chosen`

A constant wider than 32 bits is written in several words, the lowest first. A write takes one clock; the constants can
be used in every clock. With parity, each word of each bank has one more register, which is compared in every clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from amaranth.hdl import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.reload.constants import Constant, packed, values_of

_WORD_BITS = 32

Pair = tuple[Value, Value]
"""A constant in the first bank and in the second."""

NO_CONSTANTS: Mapping[int, Pair] = MappingProxyType({})
"""For a stage without loadable constants."""


class ConstantBanks(wiring.Component):
    """The loadable constants of a datapath, twice.

    The first bank starts with the constants of the datapath, the second with zeros; a reset changes neither. Latency: a
    word is there one clock after its write. Throughput: one word per clock.

    Parameters
    ----------
    datapath : Datapath
        The datapath.
    loadable : tuple of Constant
        Its loadable constants.
    parity : bool
        Whether each word has a parity bit.

    Members
    -------
    write_enable : In(1)
        Whether a word is written at this clock.
    write_bank : In(1)
        Number of the bank that is written.
    write_address : In
        Number of the word in the bank.
    write_data : In(32)
        The word.
    wrong : Out(2)
        Whether a bit of the first bank is wrong, and of the second; only with parity.
    """

    def __init__(self, datapath: Datapath, loadable: tuple[Constant, ...], *, parity: bool = False) -> None:
        self.parity = parity
        values = values_of(datapath, loadable)
        self.loadable = loadable
        self.words = len(packed(values, loadable))
        self._registers = [
            tuple(
                Signal(signed(c.bits), name=f"bank{bank}_constant{k}", init=init, reset_less=True)
                for bank, init in ends
            )
            for k, (c, value) in enumerate(zip(loadable, values, strict=True))
            for ends in [((0, value), (1, 0))]
        ]
        members = {
            "write_enable": In(1),
            "write_bank": In(1),
            "write_address": In(range(self.words)),
            "write_data": In(_WORD_BITS),
        }
        super().__init__(members | {"wrong": Out(2)} if parity else members)

    def of_stage(self, stage: int) -> dict[int, Pair]:
        """Return the constants of stage number `stage`, by node."""
        pairs = zip(self.loadable, self._registers, strict=True)
        return {constant.node: (first, second) for constant, (first, second) in pairs if constant.stage == stage}

    def elaborate(self, platform: object) -> Module:
        """Build the logic that writes the registers."""
        m = Module()
        word = 0
        wrong: tuple[list[Value], list[Value]] = ([], [])
        for k, (constant, pair) in enumerate(zip(self.loadable, self._registers, strict=True)):
            for low in range(0, constant.bits, _WORD_BITS):
                high = min(low + _WORD_BITS, constant.bits)
                for bank, register in enumerate(pair):
                    writes = self.write_enable & (self.write_bank == bank) & _is(self.write_address, word)
                    with m.If(writes):
                        m.d.sync += register.eq(Cat(register[:low], self.write_data[: high - low], register[high:]))
                    if self.parity:
                        init = (register.init >> low & ((1 << (high - low)) - 1)).bit_count() % 2
                        parity = Signal(
                            name=f"bank{bank}_constant{k}_parity{low // _WORD_BITS}", init=init, reset_less=True
                        )
                        with m.If(writes):
                            m.d.sync += parity.eq(self.write_data[: high - low].xor())
                        wrong[bank].append(register[low:high].xor() ^ parity)
                word += 1
        if self.parity:
            m.d.comb += self.wrong.eq(Cat(*(Cat(*bank).any() for bank in wrong)))
        return m


def _is(address: Value, word: int) -> Value:
    """Whether `address` is `word`, without ``==``: Yosys writes ``== 0`` as ``!``, of which Verilator warns."""
    return Cat(bit if word >> k & 1 else ~bit for k, bit in enumerate(address)).all()


def chosen(pair: Pair, bank: Value) -> Value:
    """Return the constant of `bank`."""
    first, second = pair
    return Mux(bank, second, first).as_signed()
