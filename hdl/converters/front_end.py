"""The front-end of a board: reads the converters at the sample rate, feeds the core, and keeps its results.

::

                       +-----------+  frame 32
    miso ------------->|           |----> offset + gain * reading --> in range, no fault?
    sck, mosi, cs_n <--| SpiReader |                                     |         |
                       +-----------+                                     v         v
    [phase] --tick--> scan: input 0, channels 0, 1, ..; input 1, ..   [codes]   [faults] 5 --> o_reading
                       |                                              and       for each input
                       v                                              held?     and channel
    feed: channels 0, 1, .. <--------------------------------------------+
      |
      +--> s_axis_*  core  m_axis_* --> flag `fault` if a code is held --> ResultQueue --> o_result, o_there

    tick -> due -> read -> frame -> scale -> judge -> .. -> fetch -> offer -> result -> .. -> tick

A code whose reading is bad is held: the last good one is fed again, and its result has the flag `fault`. A converter
that takes its time is not asked before, and its last code is fed until then. Latency, from the tick to the last result:
at most `sosmith.model.converters.spi_schedule.Schedule.clocks`, and that of the core for each channel.
"""

from __future__ import annotations

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, Mux, ResetSignal, Shape, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory, ReadPort, WritePort
from amaranth.lib.wiring import In, Out

from sosmith.hdl.converters.result_queue import ResultQueue
from sosmith.hdl.converters.spi_reader import COMMAND_BITS, SpiReader
from sosmith.model.converters.spi_converter import THERMOCOUPLE_FAULTS, ReadingFault
from sosmith.model.converters.spi_reading import Reading
from sosmith.model.converters.spi_schedule import Schedule
from sosmith.model.dataflow.status import STATUS_BITS, Flag

_START = 15
"""Clocks of the core's reset after configuration."""


class FrontEnd(wiring.Component):
    """Reads converters and feeds a core with their codes.

    Parameters
    ----------
    schedule : Schedule
        What is read when.
    result_bytes : int
        Bytes of ``m_axis_tdata``.

    Members
    -------
    clk, rst : In(1)
        Clock, and reset, synchronous, active high; it may be tied to 0.
    sck, mosi, miso, cs_n
        The SPI: all converters of input 0, in the order of channels, have the lowest bits of ``cs_n``.
    aresetn : Out(1)
        Reset of the core.
    s_axis_*, m_axis_*
        The core's streams, seen from the other side, with 8 bits of ``s_axis_tdest``.
    o_result, o_channel, o_there, o_settled, o_missed, i_take
        The results, each with its status above it, as those of a `ResultQueue`.
    i_index : In(8)
        Which reading's faults to tell: ``channel * inputs + input``.
    o_reading : Out(5)
        The faults of that reading, one clock later: bits as `sosmith.model.converters.spi_converter.ReadingFault`.
    o_new, o_status : Out(1), Out(8)
        High for one clock for each result; its status.
    """

    def __init__(self, schedule: Schedule, *, result_bytes: int) -> None:
        self.schedule, self.result_bytes = schedule, result_bytes
        result = 8 * result_bytes + STATUS_BITS
        super().__init__(
            {
                "clk": In(1),
                "rst": In(1),
                "sck": Out(1),
                "mosi": Out(1),
                "miso": In(1),
                "cs_n": Out(sum(schedule.selects)),
                "aresetn": Out(1),
                "s_axis_tdata": Out(8 * sum(reading.port.bytes for reading in schedule.readings)),
                "s_axis_tdest": Out(8),
                "s_axis_tvalid": Out(1),
                "s_axis_tready": In(1),
                "m_axis_tdata": In(8 * result_bytes),
                "m_axis_tuser": In(STATUS_BITS),
                "m_axis_tvalid": In(1),
                "m_axis_tready": Out(1),
                "o_result": Out(result),
                "o_channel": Out(8),
                "o_there": Out(1),
                "o_settled": Out(1),
                "o_missed": Out(1),
                "i_take": In(1),
                "i_index": In(8),
                "o_reading": Out(len(ReadingFault)),
                "o_new": Out(1),
                "o_status": Out(STATUS_BITS),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the scan."""
        plan = self.schedule
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.clk), ResetSignal("sync").eq(self.rst)]
        m.submodules.reader = reader = SpiReader(half=plan.half, deselect=plan.deselect, selects=sum(plan.selects))
        m.submodules.queue = queue = ResultQueue(len(self.o_result), plan.channels)
        starting = Signal(range(_START + 1), init=_START)
        with m.If(starting != 0):
            m.d.sync += starting.eq(starting - 1)
        m.d.comb += [
            self.sck.eq(reader.sck),
            self.mosi.eq(reader.mosi),
            reader.miso.eq(self.miso),
            self.cs_n.eq(reader.cs_n),
            self.aresetn.eq(~self.rst & (starting == 0)),
            queue.i_take.eq(self.i_take),
            self.o_result.eq(queue.o_result),
            self.o_channel.eq(queue.o_channel),
            self.o_there.eq(queue.o_there),
            self.o_settled.eq(queue.o_settled),
            self.o_missed.eq(queue.o_missed),
        ]
        _Scan(m, self, reader, queue).build()
        return m


class _Scan:
    """The registers of the scan, and its states in groups."""

    def __init__(self, m: Module, front: FrontEnd, reader: SpiReader, queue: ResultQueue) -> None:
        self.m, self.front, self.reader, self.queue, self.plan = m, front, reader, queue, front.schedule
        self.channel = Signal(range(max(2, self.plan.channels)))
        self.last = self.channel == self.plan.channels - 1
        self.stores, self.fetches = zip(*map(self.memory, range(len(self.plan.readings))), strict=True)
        m.submodules.faults = faults = Memory(shape=len(ReadingFault), depth=256, init=[])
        self.store_faults = faults.write_port()
        fetch = faults.read_port()
        m.d.comb += [fetch.addr.eq(front.i_index), front.o_reading.eq(fetch.data)]

    def memory(self, number: int) -> tuple[WritePort, ReadPort]:
        """Make the memory of an input's codes: the code, and above it whether it is held."""
        port = self.plan.readings[number].port
        memory = Memory(shape=port.bits + 1, depth=max(2, self.plan.channels), init=[])
        self.m.submodules[f"codes_{port.name}"] = memory
        store = memory.write_port()
        fetch = memory.read_port()
        self.m.d.comb += [store.addr.eq(self.channel), fetch.addr.eq(self.channel)]
        return store, fetch

    def build(self) -> None:
        """Make all states."""
        tick = self.tick()
        with self.m.FSM(name="scan"):
            with self.m.State("wait"), self.m.If(tick):
                self.m.next = "due 0"
            first = 0
            for number, (reading, selects) in enumerate(zip(self.plan.readings, self.plan.selects, strict=True)):
                self.scan(number, reading, first, selects)
                first += selects
            self.feed()

    def tick(self) -> Value:
        """Return what is high for one clock at each sample."""
        m, period = self.m, self.plan.period
        step, modulus = period.denominator, period.numerator
        phase = Signal(range(modulus))
        wraps = phase >= modulus - step
        m.d.sync += phase.eq(Mux(wraps, phase - (modulus - step), phase + step))
        waiting = Signal(range(self.plan.first + 1), init=self.plan.first)
        with m.If(wraps & (waiting != 0)):
            m.d.sync += waiting.eq(waiting - 1)
        return wraps & (waiting == 0)

    def scan(self, number: int, reading: Reading, first: int, selects: int) -> None:
        """Read an input for all channels; the chip selects of its converters are `selects`, from `first` on."""
        m, reader, converter = self.m, self.reader, reading.converter
        after = f"due {number + 1}" if number + 1 < len(self.plan.readings) else "fetch"
        interval = self.plan.intervals[number]
        with m.State(f"due {number}"):
            m.next = f"read {number}"
            if interval > 1:
                left = Signal(range(interval), name=f"left{number}")
                m.d.sync += left.eq(Mux(left == 0, interval - 1, left - 1))
                with m.If(left != 0):
                    m.next = after
        with m.State(f"read {number}"):
            place = converter.inputs.bit_length() - 1
            command = converter.command << COMMAND_BITS - converter.command_bits
            shift = converter.channel_place + COMMAND_BITS - converter.command_bits
            asked = (self.channel[:place] << shift) | command if place else Const(command, COMMAND_BITS)
            m.d.comb += [
                reader.i_start.eq(1),
                reader.i_select.eq((Const(1, 1) << self.channel[place:] if selects > 1 else 1) << first),
                reader.i_command.eq(asked),
                reader.i_bits.eq(converter.bits),
            ]
            m.next = f"frame {number}"
        with m.State(f"frame {number}"), m.If(reader.o_done):
            m.next = f"scale {number}"
        raw = reader.o_frame[converter.low : converter.low + converter.width]
        exact = reading.gain * (raw.as_signed() if converter.signed else raw) + reading.offset
        code = Signal(signed(Shape.cast(exact.shape()).width + 1), name=f"code{number}")
        with m.State(f"scale {number}"):
            m.d.sync += code.eq(exact)
            m.next = f"judge {number}"
        with m.State(f"judge {number}"):
            found = self.faults(reading, code)
            good = Signal(name=f"good{number}")
            held = self.fetches[number].data[: reading.port.bits]
            inputs = len(self.plan.readings)
            m.d.comb += [
                good.eq(~found.any()),
                self.stores[number].en.eq(1),
                self.stores[number].data.eq(Cat(Mux(good, code[: reading.port.bits], held), ~good)),
                self.store_faults.en.eq(1),
                self.store_faults.addr.eq(self.channel * inputs + number),
                self.store_faults.data.eq(found),
            ]
            m.next = f"read {number}"
            self.next_channel(after)

    def faults(self, reading: Reading, code: Signal) -> Value:
        """Return the faults of the frame that was read, a bit for each."""
        frame, converter = self.reader.o_frame, reading.converter
        bits: list[Value] = [Const(0, 1)] * len(ReadingFault)
        wrong = Cat(frame[bit] for bit in converter.zeros).any()
        if converter.summary is not None:
            told = Cat(frame[bit] for bit in range(len(THERMOCOUPLE_FAULTS)))
            for bit, fault in enumerate(THERMOCOUPLE_FAULTS):
                bits[fault] = frame[bit]
            wrong = wrong | (frame[converter.summary] & ~told.any())
        bits[ReadingFault.FRAME] = wrong
        bits[ReadingFault.RANGE] = (code < reading.port.lowest) | (code > reading.port.highest)
        return Cat(bits)

    def feed(self) -> None:
        """Give the core a sample of each channel, and keep its results."""
        m, front = self.m, self.front
        codes = [fetch.data[:-1] for fetch in self.fetches]
        ports = [reading.port for reading in self.plan.readings]
        held = Cat(fetch.data[-1] for fetch in self.fetches).any()
        fields = []
        for code, port in zip(codes, ports, strict=True):
            field = Signal(8 * port.bytes, name=f"field_{port.name}")
            m.d.comb += field.eq(code.as_signed() if port.signed else code)
            fields.append(field)
        m.d.comb += [
            front.s_axis_tdata.eq(Cat(fields)),
            front.s_axis_tdest.eq(self.channel),
            front.o_status.eq(front.m_axis_tuser | (held << Flag.FAULT)),
            front.o_new.eq(self.queue.i_push),
            self.queue.i_result.eq(Cat(front.m_axis_tdata, front.o_status)),
        ]
        with m.State("fetch"):
            m.next = "offer"
        with m.State("offer"):
            m.d.comb += front.s_axis_tvalid.eq(1)
            with m.If(front.s_axis_tready):
                m.next = "result"
        with m.State("result"):
            m.d.comb += front.m_axis_tready.eq(1)
            with m.If(front.m_axis_tvalid):
                m.d.comb += self.queue.i_push.eq(1)
                m.next = "fetch"
                self.next_channel("wait")

    def next_channel(self, after: str) -> None:
        """Go on to the next channel; behind the last one, to a state."""
        m = self.m
        m.d.sync += self.channel.eq(self.channel + 1)
        with m.If(self.last):
            m.d.sync += self.channel.eq(0)
            m.next = after
