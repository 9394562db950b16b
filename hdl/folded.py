"""The folded and serial architectures: one multiply-accumulate unit that runs a datapath's program.

Several ranks work on as many instructions at once: fetch, read, multiply, accumulate; the program keeps an
instruction that reads a word far enough from the one that stores it (`sosmith.model.program.HAZARD`). In the folded
architecture both memories have a register behind them, for speed. In the serial one they have none, for size, the
multiplication is done by shifts and additions in the accumulator, and the ranks wait for it.
"""

from __future__ import annotations

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, Mux, ResetSignal, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory

from sosmith.hdl.axi_stream import core_members, extended, fields
from sosmith.model.datapath import Datapath
from sosmith.model.graph import Op
from sosmith.model.program import Do, Instruction, Place, Program

_FOLDED_RANKS, _SERIAL_RANKS = 5, 3

_DO_BITS = 4


def latency_cycles(program: Program, *, serial: bool) -> int:
    """Clocks from the edge that accepts a sample to the edge that can hand it on; in serial, at most so many."""
    return program.serial_cycles + _SERIAL_RANKS if serial else len(program.instructions) + _FOLDED_RANKS


class FoldedCore(wiring.Component):
    """A datapath on one multiply-accumulate unit.

    Latency: `latency_cycles`. Throughput: one sample in one clock more. After reset it first clears its memory, one
    word a clock.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    program : Program
        How.
    serial : bool
        Whether to multiply by shifts and additions instead of a hardware multiplier.

    Members
    -------
    aclk, aresetn, s_axis_tdata, s_axis_tvalid, s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tready
        As of `sosmith.hdl.core.Core`.
    """

    def __init__(self, datapath: Datapath, program: Program, *, serial: bool) -> None:
        self.datapath = datapath
        self.program = program
        self.serial = serial
        super().__init__(core_members(datapath.inputs, datapath.output))

    def elaborate(self, platform: object) -> Module:
        """Build the unit around its two memories."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        advance, clearing, accept = Signal(), Signal(init=1), Signal()
        m.d.comb += accept.eq(self.s_axis_tvalid & self.s_axis_tready)
        counter, fetching = self._control(m, advance, clearing, accept)
        ranks = self._fetch(m, advance, counter, fetching)
        data = Signal(signed(self._word), reset_less=True)
        total = self._accumulate(m, advance, ranks, data)
        self._remember(m, (advance, clearing, accept), (counter, total, data), ranks)
        self._hand_out(m, advance, ranks, data)
        return m

    @property
    def _word(self) -> int:
        return self.program.digit_bits + 1

    @property
    def _address_bits(self) -> int:
        return max((self.program.words - 1).bit_length(), 1)

    def _control(self, m: Module, advance: Signal, clearing: Signal, accept: Signal) -> tuple[Signal, Signal]:
        """Count through the words to clear after reset, and through the program for each sample."""
        count, words = len(self.program.instructions), self.program.words
        counter, fetching = Signal(range(max(count, words))), Signal()
        with m.If(clearing):
            m.d.sync += counter.eq(counter + 1)
            with m.If(counter == words - 1):
                m.d.sync += [clearing.eq(0), counter.eq(0)]
        with m.Elif(accept):
            m.d.sync += fetching.eq(1)
        with m.Elif(fetching & advance):
            m.d.sync += counter.eq(counter + 1)
            with m.If(counter == count - 1):
                m.d.sync += [fetching.eq(0), counter.eq(0)]
        busy = Signal()
        with m.If(accept):
            m.d.sync += busy.eq(1)
        with m.If(self.m_axis_tvalid & self.m_axis_tready):
            m.d.sync += busy.eq(0)
        m.d.comb += self.s_axis_tready.eq(~(busy | clearing))
        return counter, fetching

    def _fetch(self, m: Module, advance: Signal, counter: Signal, fetching: Signal) -> list[_Rank]:
        """Read the program; return the ranks, the first one holding what has just been read."""
        instructions = self.program.instructions
        code = [_encoded(instruction, self._address_bits, self._word) for instruction in instructions]
        m.submodules.program = rom = Memory(
            shape=_DO_BITS + self._address_bits + self._word, depth=len(code), init=code
        )
        fetch = rom.read_port()
        m.d.comb += [fetch.addr.eq(counter), fetch.en.eq(advance)]
        valid = Signal(name="valid1")
        ranks = [_Rank(fetch.data, valid, self._address_bits)]
        with m.If(advance):
            m.d.sync += valid.eq(fetching)
            for k in range(2, _SERIAL_RANKS + 1 if self.serial else _FOLDED_RANKS + 1):
                word = Signal(len(fetch.data), name=f"instruction{k}", reset_less=True)
                valid = Signal(name=f"valid{k}")
                m.d.sync += [word.eq(ranks[-1].word), valid.eq(ranks[-1].valid)]
                ranks.append(_Rank(word, valid, self._address_bits))
        return ranks

    def _accumulate(self, m: Module, advance: Signal, ranks: list[_Rank], data: Signal) -> Signal:
        """Multiply `data`, which the last rank but one is about, and add the product up at the last."""
        *_, present, last = ranks
        operand = Signal(signed(self._word), reset_less=True)
        factor = Signal(signed(self._word))
        total = Signal(signed(self.program.accumulator_bits))
        m.d.comb += factor.eq(Mux(present.does(Do.PRODUCT), operand, present.constant))
        with m.If(advance & present.does(Do.OPERAND)):
            m.d.sync += operand.eq(data)
        multiplies = last.valid & (last.does(Do.MULTIPLY) | last.does(Do.PRODUCT))
        if self.serial:
            self._multiply_serially(m, total, (data, factor), (advance, multiplies))
        else:
            product = Signal(signed(2 * self._word), reset_less=True)
            m.d.comb += advance.eq(1)
            m.d.sync += product.eq(data * factor)
            with m.If(multiplies):
                m.d.sync += total.eq(total + product)
        with m.If(advance & last.valid & (last.does(Do.STORE) | last.does(Do.DROP))):
            m.d.sync += total.eq(total >> self.program.digit_bits)
        with m.If(advance & last.valid & last.does(Do.FINISH)):
            m.d.sync += total.eq(0)
        return total

    def _remember(
        self,
        m: Module,
        control: tuple[Signal, Signal, Signal],
        values: tuple[Signal, Signal, Signal],
        ranks: list[_Rank],
    ) -> None:
        """Read the words that instructions are about, and write those that they store."""
        (advance, clearing, accept), (counter, total, data) = control, values
        first, last = ranks[0 if self.serial else 1], ranks[-1]
        m.submodules.words = ram = Memory(shape=self._word, depth=self.program.words, init=self.program.reset())
        read, write = ram.read_port(), ram.write_port()
        m.d.comb += [read.addr.eq(first.address), read.en.eq(advance)]
        if self.serial:
            m.d.comb += data.eq(read.data)
        else:
            with m.If(advance):
                m.d.sync += data.eq(read.data)
        sample = self._input_digits()
        supply = Signal(self._word * len(sample), reset_less=True)
        take = last.does(Do.TAKE)
        with m.If(accept):
            m.d.sync += supply.eq(Cat(*sample))
        with m.Elif(advance & last.valid & take):
            m.d.sync += supply.eq(supply >> self._word)
        top = total[self._word - 1] & last.does(Do.FINISH)
        digit = Mux(take, supply[: self._word], Cat(total[: self._word - 1], top))
        stores = take | last.does(Do.STORE) | last.does(Do.FINISH)
        m.d.comb += [
            write.addr.eq(Mux(clearing, counter, last.address)),
            write.data.eq(Mux(clearing, ~counter.any(), digit)),  # the word ONE is the first
            write.en.eq(clearing | (advance & last.valid & stores)),
        ]

    def _hand_out(self, m: Module, advance: Signal, ranks: list[_Rank], data: Signal) -> None:
        """Collect the digits of the result; the last instruction of a program gives the last one."""
        *_, following, present, _ = ranks
        given = Signal(self._word * self.program.output.digits, reset_less=True)
        with m.If(advance & present.valid & present.does(Do.GIVE)):
            m.d.sync += given.eq(Cat(given[self._word :], data))
        with m.If(advance & present.valid & ~following.valid):
            m.d.sync += self.m_axis_tvalid.eq(1)
        with m.If(self.m_axis_tvalid & self.m_axis_tready):
            m.d.sync += self.m_axis_tvalid.eq(0)
        m.d.comb += self.m_axis_tdata.eq(extended(self._limited(given), self.datapath.output.bytes * 8))

    def _multiply_serially(
        self, m: Module, total: Signal, factors: tuple[Value, Value], control: tuple[Signal, Value]
    ) -> None:
        """Add a product to `total` bit by bit of its second factor, the lowest first, as long as there are any.

        What is left of a negative factor ends as -1: one subtraction. The first factor moves up at each bit.
        """
        word = self.program.digit_bits + 1
        advance, multiplies = control
        shifted = Signal(signed(2 * word), reset_less=True)
        left = Signal(signed(word), reset_less=True)
        done = Signal()
        m.d.comb += [done.eq((left == -1) | ~left[1:].any()), advance.eq(~multiplies | done)]
        with m.If(multiplies & left[0]):
            m.d.sync += total.eq(Mux(left == -1, total - shifted, total + shifted))
        m.d.sync += [shifted.eq(shifted << 1), left.eq(left >> 1)]
        with m.If(advance):
            m.d.sync += [shifted.eq(factors[0]), left.eq(factors[1])]

    def _input_digits(self) -> list[Value]:
        """Digits of the input sample, in the order in which the program takes them."""
        graph = self.datapath.stages[0].graph
        digits: list[Value] = []
        ports = zip(fields(self.datapath.inputs), graph.inputs, self.program.inputs, strict=True)
        for field, index, place in ports:
            code = self.s_axis_tdata[field.offset : field.offset + field.port.bits]
            padded = Cat(Const(0, place.frac - graph.nodes[index].frac), code)
            digits += self._split(padded, place, sign=padded[-1] if field.port.signed else Const(0, 1))
        return digits

    def _split(self, value: Value, place: Place, sign: Value) -> list[Value]:
        bits = self.program.digit_bits
        whole = Cat(value, *([sign] * max(0, bits * place.digits + 1 - len(value))))
        low = [Cat(whole[bits * k : bits * (k + 1)], Const(0, 1)) for k in range(place.digits - 1)]
        return [*low, whole[bits * (place.digits - 1) : bits * place.digits + 1]]

    def _limited(self, given: Value) -> Value:
        """Return the output code from its digits, limited to the port's range where the datapath limits it."""
        bits, count = self.program.digit_bits, self.program.output.digits
        digits = [given[(bits + 1) * k : (bits + 1) * k + bits] for k in range(count)]
        value = Cat(*digits, given[-1]).as_signed()
        stage = self.datapath.stages[-1].graph
        last = stage.nodes[stage.outputs[0]]
        if last.op is Op.CLAMP:
            low, high = Const(last.low), Const(last.high)
            value = Mux(value < low, low, Mux(value > high, high, value))
        code = value[: self.datapath.output.bits]
        return code.as_signed() if self.datapath.output.signed else code


class _Rank:
    """An instruction on its way, and whether there is one."""

    def __init__(self, word: Value, valid: Value, address_bits: int) -> None:
        self.word = word
        self.valid = valid
        self.address = word[_DO_BITS : _DO_BITS + address_bits]
        self.constant = word[_DO_BITS + address_bits :].as_signed()

    def does(self, do: Do) -> Value:
        """Whether it does `do`."""
        return self.word[:_DO_BITS] == list(Do).index(do)


def _encoded(instruction: Instruction, address_bits: int, word: int) -> int:
    do, address, constant = instruction
    return list(Do).index(do) | address << _DO_BITS | (constant % (1 << word)) << (_DO_BITS + address_bits)
