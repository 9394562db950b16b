"""The folded and serial architectures: one multiply-accumulate unit that runs a datapath's program.

Several ranks work on as many instructions at once: fetch, read, multiply, accumulate; the program keeps an
instruction that reads a word far enough from the one that stores it (`sosmith.model.program.HAZARD`). In the folded
architecture both memories have a register behind them, for speed. In the serial one they have none, for size, the
multiplication is done by shifts and additions in the accumulator, and the ranks wait for it.
"""

from __future__ import annotations

from dataclasses import dataclass

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, Mux, ResetSignal, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory

from sosmith.hdl.axi_stream import channel_bits, core_members, extended, fields, input_flags, status_word
from sosmith.model.datapath import Datapath
from sosmith.model.graph import Op
from sosmith.model.program import Do, Instruction, Place, Program
from sosmith.model.status import Flag

_FOLDED_RANKS, _SERIAL_RANKS = 5, 3

_DO_BITS = 4


def latency_cycles(program: Program, *, serial: bool) -> int:
    """Clocks from the edge that accepts a sample to the edge that can hand it on; in serial, at most so many."""
    return program.serial_cycles + _SERIAL_RANKS if serial else len(program.instructions) + _FOLDED_RANKS


@dataclass(frozen=True)
class Addresses:
    """Where a program's words lie in the memory: first the states of every channel, then what all channels share.

    An instruction has an index and, as its top bit, whether it is among the shared words. The places of a channel's
    states are a power of two, so that the channel's number stands beside the index and nothing has to be added.

    Attributes
    ----------
    program : Program
        Whose words they are.
    channels : int
        Number of channels.
    """

    program: Program
    channels: int

    @property
    def _state_bits(self) -> int:
        return max(self.program.states - 1, 0).bit_length()

    @property
    def _shared_bits(self) -> int:
        return (self.program.words - self.program.states - 1).bit_length()

    @property
    def instruction_bits(self) -> int:
        """Width of an instruction's address."""
        return max(self._state_bits, self._shared_bits) + 1

    @property
    def bits(self) -> int:
        """Width of an address of the memory."""
        return max(self._state_bits + channel_bits(self.channels), self._shared_bits) + 1

    @property
    def depth(self) -> int:
        """Words of the memory."""
        return (1 << self.bits - 1) + self.program.words - self.program.states

    def encoded(self, address: int) -> int:
        """Address of the program as instructions have it."""
        shared = address - self.program.states
        return address if shared < 0 else shared | 1 << self.instruction_bits - 1

    def of(self, encoded: Value, channel: Value) -> Value:
        """Address of the memory from that of an instruction and the channel's number."""
        is_shared = encoded[-1]
        if self.channels == 1:
            return encoded
        state, shared = Cat(encoded[: self._state_bits], channel), encoded[: self._shared_bits]
        return Cat(Mux(is_shared, shared, state) | Const(0, self.bits - 1), is_shared)


class FoldedCore(wiring.Component):
    """A datapath on one multiply-accumulate unit, for any number of channels in any order.

    Latency: `latency_cycles`. Throughput: one sample of one channel in one clock more. After reset it first clears its
    memory, one word a clock. A sample of a channel that does not exist is taken and dropped.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    program : Program
        How.
    serial : bool
        Whether to multiply by shifts and additions instead of a hardware multiplier.
    channels : int
        Number of channels.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As of `sosmith.hdl.core.Core`.
    """

    def __init__(self, datapath: Datapath, program: Program, *, serial: bool, channels: int = 1) -> None:
        self.datapath = datapath
        self.program = program
        self.serial = serial
        self.channels = channels
        self._addresses = Addresses(program, channels)
        super().__init__(core_members(datapath.inputs, datapath.output, channels))

    def elaborate(self, platform: object) -> Module:
        """Build the unit around its two memories."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        advance, clearing, start = Signal(), Signal(init=1), Signal()
        channel = self._channel(m, start)
        counter, fetching = self._control(m, advance, clearing, start)
        ranks = self._fetch(m, advance, counter, fetching)
        data = Signal(signed(self._word), reset_less=True)
        total = self._accumulate(m, advance, ranks, data)
        self._remember(m, (advance, clearing, start), (counter, total, data, channel), ranks)
        self._hand_out(m, (advance, start), ranks, data)
        return m

    @property
    def _word(self) -> int:
        return self.program.digit_bits + 1

    def _channel(self, m: Module, start: Signal) -> Signal:
        """Take a sample where its channel exists; return the channel's number while it is computed."""
        accept = self.s_axis_tvalid & self.s_axis_tready
        channel = Signal(channel_bits(self.channels), reset_less=True)
        if self.channels == 1:
            m.d.comb += start.eq(accept)
        else:
            m.d.comb += [start.eq(accept & (self.s_axis_tdest < self.channels)), self.m_axis_tdest.eq(channel)]
            with m.If(start):
                m.d.sync += channel.eq(self.s_axis_tdest)
        return channel

    def _control(self, m: Module, advance: Signal, clearing: Signal, start: Signal) -> tuple[Signal, Signal]:
        """Count through the words to clear after reset, and through the program for each sample."""
        count, words = len(self.program.instructions), self._addresses.depth
        counter, fetching = Signal(range(max(count, words))), Signal()
        with m.If(clearing):
            m.d.sync += counter.eq(counter + 1)
            with m.If(counter == words - 1):
                m.d.sync += [clearing.eq(0), counter.eq(0)]
        with m.Elif(start):
            m.d.sync += fetching.eq(1)
        with m.Elif(fetching & advance):
            m.d.sync += counter.eq(counter + 1)
            with m.If(counter == count - 1):
                m.d.sync += [fetching.eq(0), counter.eq(0)]
        busy = Signal()
        with m.If(start):
            m.d.sync += busy.eq(1)
        with m.If(self.m_axis_tvalid & self.m_axis_tready):
            m.d.sync += busy.eq(0)
        m.d.comb += self.s_axis_tready.eq(~(busy | clearing))
        return counter, fetching

    def _fetch(self, m: Module, advance: Signal, counter: Signal, fetching: Signal) -> list[_Rank]:
        """Read the program; return the ranks, the first one holding what has just been read."""
        instructions = self.program.instructions
        code = [_encoded(instruction, self._addresses, self._word) for instruction in instructions]
        address_bits = self._addresses.instruction_bits
        m.submodules.program = rom = Memory(shape=_DO_BITS + address_bits + self._word, depth=len(code), init=code)
        fetch = rom.read_port()
        m.d.comb += [fetch.addr.eq(counter), fetch.en.eq(advance)]
        valid = Signal(name="valid1")
        ranks = [_Rank(fetch.data, valid, address_bits)]
        with m.If(advance):
            m.d.sync += valid.eq(fetching)
            for k in range(2, _SERIAL_RANKS + 1 if self.serial else _FOLDED_RANKS + 1):
                word = Signal(len(fetch.data), name=f"instruction{k}", reset_less=True)
                valid = Signal(name=f"valid{k}")
                m.d.sync += [word.eq(ranks[-1].word), valid.eq(ranks[-1].valid)]
                ranks.append(_Rank(word, valid, address_bits))
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
        values: tuple[Signal, Signal, Signal, Signal],
        ranks: list[_Rank],
    ) -> None:
        """Read the words that instructions are about, and write those that they store."""
        (advance, clearing, start), (counter, total, data, channel) = control, values
        first, last = ranks[0 if self.serial else 1], ranks[-1]
        addresses = self._addresses
        # After reset, states are 0 and the word of ones is 1; so may be the others that channels share.
        initial = [address >> addresses.bits - 1 for address in range(addresses.depth)]
        m.submodules.words = ram = Memory(shape=self._word, depth=addresses.depth, init=initial)
        read, write = ram.read_port(), ram.write_port()
        m.d.comb += [read.addr.eq(addresses.of(first.address, channel)), read.en.eq(advance)]
        if self.serial:
            m.d.comb += data.eq(read.data)
        else:
            with m.If(advance):
                m.d.sync += data.eq(read.data)
        sample = self._input_digits()
        supply = Signal(self._word * len(sample), reset_less=True)
        take = last.does(Do.TAKE)
        with m.If(start):
            m.d.sync += supply.eq(Cat(*sample))
        with m.Elif(advance & last.valid & take):
            m.d.sync += supply.eq(supply >> self._word)
        top = total[self._word - 1] & last.does(Do.FINISH)
        digit = Mux(take, supply[: self._word], Cat(total[: self._word - 1], top))
        stores = take | last.does(Do.STORE) | last.does(Do.FINISH)
        m.d.comb += [
            write.addr.eq(Mux(clearing, counter, addresses.of(last.address, channel))),
            write.data.eq(Mux(clearing, counter[addresses.bits - 1], digit)),
            write.en.eq(clearing | (advance & last.valid & stores)),
        ]

    def _hand_out(self, m: Module, control: tuple[Signal, Signal], ranks: list[_Rank], data: Signal) -> None:
        """Collect the digits of the result; the last instruction of a program gives the last one."""
        advance, start = control
        *_, following, present, _ = ranks
        given = Signal(self._word * self.program.output.digits, reset_less=True)
        with m.If(advance & present.valid & present.does(Do.GIVE)):
            m.d.sync += given.eq(Cat(given[self._word :], data))
        with m.If(advance & present.valid & ~following.valid):
            m.d.sync += self.m_axis_tvalid.eq(1)
        with m.If(self.m_axis_tvalid & self.m_axis_tready):
            m.d.sync += self.m_axis_tvalid.eq(0)
        code, saturated = self._limited(given)
        flags: dict[Flag, Value] = {Flag.OUTPUT_SATURATED: saturated}
        for flag, value in input_flags(self.datapath, self.s_axis_tdata).items():
            flags[flag] = held = Signal(name=flag.name.lower(), reset_less=True)
            with m.If(start):
                m.d.sync += held.eq(value)
        m.d.comb += [
            self.m_axis_tdata.eq(extended(code, self.datapath.output.bytes * 8)),
            self.m_axis_tuser.eq(status_word(flags)),
        ]

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

    def _limited(self, given: Value) -> tuple[Value, Value]:
        """Return the output code from its digits, limited to the port's range, and whether it had to be."""
        bits, count, output = self.program.digit_bits, self.program.output.digits, self.datapath.output
        digits = [given[(bits + 1) * k : (bits + 1) * k + bits] for k in range(count)]
        value = Cat(*digits, given[-1]).as_signed()
        stage = self.datapath.stages[-1].graph
        last = stage.nodes[stage.outputs[0]]
        code: Value = value
        below: Value = Const(0, 1)
        above: Value = Const(0, 1)
        if last.op is Op.CLAMP:
            below, above = value < last.low, value > last.high
            code = Mux(below, Const(last.low), Mux(above, Const(last.high), value))
        cut = code[: output.bits]
        return (cut.as_signed() if output.signed else cut), below | above


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


def _encoded(instruction: Instruction, addresses: Addresses, word: int) -> int:
    do, address, constant = instruction
    upper = addresses.encoded(address) | (constant % (1 << word)) << addresses.instruction_bits
    return list(Do).index(do) | upper << _DO_BITS
