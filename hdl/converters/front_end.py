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

With an I2S, its frame makes the tick, and what it brought is read without a frame of the SPI; a DAC gets the results::

    din n ----------------------> +-----------+  o_left, o_right --> offset + gain * word --> ..
    mclk, bclk, lrck, dout n <--- | I2sMaster |  o_tick
                                  +-----------+  i_left, i_right <-- offset + gain * code, within range <-- m_axis_*

    frame   |  n: ADC sends    |  n + 1: core       |  n + 2: DAC gets   |
            |  samples         |  computes          |  results           |

DACs on an SPI have it to themselves, and get the results as soon as that of the last channel is there::

    m_axis_* --> offset + gain * code, within range --> [result0], [result1], .. --> SpiReader --> dac_sck, dac_mosi,
                                                                                                   dac_cs_n n

A code whose reading is bad is held: the last good one is fed again, and its result has the flag `fault`. A converter
that takes its time is not asked before, and its last code is fed until then. Latency, from the tick to the last result:
at most `sosmith.model.converters.schedule.Schedule.clocks`, and that of the core for each channel; from an ADC to a
DAC, at the pins of the I2S: `sosmith.model.converters.i2s_frame.LATENCY` frames.
"""

from __future__ import annotations

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, Mux, ResetSignal, Shape, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory, ReadPort, WritePort
from amaranth.lib.wiring import In, Out

from sosmith.hdl.converters.i2s_master import I2sMaster
from sosmith.hdl.converters.pins import converter_pins
from sosmith.hdl.converters.result_queue import ResultQueue
from sosmith.hdl.converters.spi_reader import COMMAND_BITS, SpiReader
from sosmith.model.converters.dac_writing import Writing
from sosmith.model.converters.i2s_converter import MAX_WIDTH, I2sConverter
from sosmith.model.converters.reading import Reading
from sosmith.model.converters.schedule import Schedule
from sosmith.model.converters.spi_converter import THERMOCOUPLE_FAULTS, Converter, ReadingFault
from sosmith.model.converters.spi_dac import DAC_FRAME_BITS, SpiDac
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
        The SPI, if there is one: all converters of input 0, in the order of channels, have the lowest bits of ``cs_n``.
    mclk, bclk, lrck, din, dout
        The I2S, if there is one: all ADCs of input 0 have the lowest bits of ``din``, and a DAC has two channels.
    dac_sck, dac_mosi, dac_cs_n
        The SPI of DACs, if there is one, in the order of channels.
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
                **converter_pins(schedule),
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
        reader = self.spi(m) if sum(plan.selects) else None
        audio = self.i2s(m) if plan.frame is not None else None
        m.submodules.queue = queue = ResultQueue(len(self.o_result), plan.channels)
        starting = Signal(range(_START + 1), init=_START)
        with m.If(starting != 0):
            m.d.sync += starting.eq(starting - 1)
        m.d.comb += [
            self.aresetn.eq(~self.rst & (starting == 0)),
            queue.i_take.eq(self.i_take),
            self.o_result.eq(queue.o_result),
            self.o_channel.eq(queue.o_channel),
            self.o_there.eq(queue.o_there),
            self.o_settled.eq(queue.o_settled),
            self.o_missed.eq(queue.o_missed),
        ]
        _Scan(m, self, reader, audio, queue).build()
        return m

    def spi(self, m: Module) -> SpiReader:
        """Make the reader of the SPI."""
        plan = self.schedule
        m.submodules.reader = reader = SpiReader(half=plan.half, deselect=plan.deselect, selects=sum(plan.selects))
        m.d.comb += [
            self.sck.eq(reader.sck),
            self.mosi.eq(reader.mosi),
            reader.miso.eq(self.miso),
            self.cs_n.eq(reader.cs_n),
        ]
        return reader

    def i2s(self, m: Module) -> I2sMaster:
        """Make the master of the I2S."""
        plan = self.schedule
        assert plan.frame is not None
        m.submodules.i2s = i2s = I2sMaster(plan.frame, lines_in=sum(plan.lines_in), lines_out=plan.lines_out)
        m.d.comb += [self.mclk.eq(i2s.mclk), self.bclk.eq(i2s.bclk), self.lrck.eq(i2s.lrck)]
        if i2s.lines_in:
            m.d.comb += i2s.din.eq(self.din)
        if i2s.lines_out:
            m.d.comb += self.dout.eq(i2s.dout)
        return i2s


class _Scan:
    """The registers of the scan, and its states in groups."""

    def __init__(
        self, m: Module, front: FrontEnd, reader: SpiReader | None, audio: I2sMaster | None, queue: ResultQueue
    ) -> None:
        self.m, self.front, self.reader, self.audio, self.queue = m, front, reader, audio, queue
        self.plan = front.schedule
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
            for number, reading in enumerate(self.plan.readings):
                self.scan(number, reading)
            self.feed()
        if self.plan.writing is not None:
            self.write(self.plan.writing)

    def tick(self) -> Value:
        """Return what is high for one clock at each sample."""
        m = self.m
        wraps = self.phase() if self.audio is None else self.audio.o_tick
        waiting = Signal(range(self.plan.first + 1), init=self.plan.first)
        with m.If(wraps & (waiting != 0)):
            m.d.sync += waiting.eq(waiting - 1)
        return wraps & (waiting == 0)

    def phase(self) -> Value:
        """Return what is high for one clock in each period, on average as long as it has to be."""
        m, period = self.m, self.plan.period
        step, modulus = period.denominator, period.numerator
        phase = Signal(range(modulus))
        wraps = phase >= modulus - step
        m.d.sync += phase.eq(Mux(wraps, phase - (modulus - step), phase + step))
        return wraps

    def scan(self, number: int, reading: Reading) -> None:
        """Read an input for all channels."""
        m = self.m
        after = f"due {number + 1}" if number + 1 < len(self.plan.readings) else "fetch"
        interval = self.plan.intervals[number]
        with m.State(f"due {number}"):
            m.next = f"read {number}"
            if interval > 1:
                left = Signal(range(interval), name=f"left{number}")
                m.d.sync += left.eq(Mux(left == 0, interval - 1, left - 1))
                with m.If(left != 0):
                    m.next = after
        if isinstance(reading.converter, I2sConverter):
            frame = self.take(number)
            converter: Converter | I2sConverter = reading.converter
            low = MAX_WIDTH - converter.width
        else:
            frame = self.ask(number, reading.converter)
            converter = reading.converter
            low = converter.low
        raw = frame[low : low + converter.width]
        exact = reading.gain * (raw.as_signed() if converter.signed else raw) + reading.offset
        code = Signal(signed(Shape.cast(exact.shape()).width + 1), name=f"code{number}")
        with m.State(f"scale {number}"):
            m.d.sync += code.eq(exact)
            m.next = f"judge {number}"
        with m.State(f"judge {number}"):
            faults = self.faults(reading, frame, code)
            good = Signal(name=f"good{number}")
            last_good = self.fetches[number].data[: reading.port.bits]
            inputs = len(self.plan.readings)
            m.d.comb += [
                good.eq(~faults.any()),
                self.stores[number].en.eq(1),
                self.stores[number].data.eq(Cat(Mux(good, code[: reading.port.bits], last_good), ~good)),
                self.store_faults.en.eq(1),
                self.store_faults.addr.eq(self.channel * inputs + number),
                self.store_faults.data.eq(faults),
            ]
            m.next = f"read {number}"
            self.next_channel(after)

    def ask(self, number: int, converter: Converter) -> Value:
        """Read a frame over the SPI; return where it then stands."""
        m, reader = self.m, self.reader
        assert reader is not None
        first, selects = sum(self.plan.selects[:number]), self.plan.selects[number]
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
        return reader.o_frame

    def take(self, number: int) -> Value:
        """Take a word that the I2S brought; return where it then stands."""
        m, audio = self.m, self.audio
        assert audio is not None
        first = sum(self.plan.lines_in[:number]) * MAX_WIDTH
        words = (audio.o_left[first:], audio.o_right[first:])
        word = Signal(MAX_WIDTH, name=f"word{number}")
        with m.State(f"read {number}"):
            for channel in range(self.plan.channels):
                with m.If(self.channel == channel):
                    m.d.sync += word.eq(words[channel % 2].word_select(channel // 2, MAX_WIDTH))
            m.next = f"scale {number}"
        return word

    def faults(self, reading: Reading, frame: Value, code: Signal) -> Value:
        """Return the faults of the frame that was read, a bit for each."""
        converter = reading.converter
        bits: list[Value] = [Const(0, 1)] * len(ReadingFault)
        wrong = Cat(frame[bit] for bit in converter.zeros).any()
        if converter.summary is not None:
            reasons = Cat(frame[bit] for bit in range(len(THERMOCOUPLE_FAULTS)))
            for bit, fault in enumerate(THERMOCOUPLE_FAULTS):
                bits[fault] = frame[bit]
            wrong = wrong | (frame[converter.summary] & ~reasons.any())
        bits[ReadingFault.FRAME] = wrong
        bits[ReadingFault.RANGE] = (code < reading.port.lowest) | (code > reading.port.highest)
        return Cat(bits)

    def feed(self) -> None:
        """Give the core a sample of each channel, and keep its results."""
        m, front = self.m, self.front
        codes = [fetch.data[:-1] for fetch in self.fetches]
        ports = [reading.port for reading in self.plan.readings]
        repeated = Cat(fetch.data[-1] for fetch in self.fetches).any()
        fields = []
        for code, port in zip(codes, ports, strict=True):
            field = Signal(8 * port.bytes, name=f"field_{port.name}")
            m.d.comb += field.eq(code.as_signed() if port.signed else code)
            fields.append(field)
        m.d.comb += [
            front.s_axis_tdata.eq(Cat(fields)),
            front.s_axis_tdest.eq(self.channel),
            front.o_status.eq(front.m_axis_tuser | (repeated << Flag.FAULT)),
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

    def write(self, writing: Writing) -> None:
        """Give the DACs each result as it comes; the last channel of an odd number has both sides of its DAC."""
        m, front, converter = self.m, self.front, writing.converter
        result = Signal(Shape(writing.port.bits, writing.port.signed))
        place = Signal.like(self.channel)
        new = Signal()
        m.d.sync += [result.eq(front.m_axis_tdata), place.eq(self.channel), new.eq(self.queue.i_push)]
        exact = writing.gain * result + writing.offset
        word = Mux(exact > converter.highest, converter.highest, Mux(exact < converter.lowest, converter.lowest, exact))
        width = converter.width
        words = [Signal(width, name=f"result{channel}") for channel in range(self.plan.channels)]
        for channel, register in enumerate(words):
            with m.If(new & (place == channel)):
                m.d.sync += register.eq(word)
        if isinstance(converter, SpiDac):
            self.send(converter, words, new & (place == self.plan.channels - 1))
        elif self.audio is not None:
            left, right = words[::2], [*words[1::2], *words[-1:]]
            m.d.comb += [self.audio.i_left.eq(Cat(left)), self.audio.i_right.eq(Cat(right[: len(left)]))]

    def send(self, converter: SpiDac, words: list[Signal], whole: Value) -> None:
        """Send the words of all channels to DACs on an SPI, one after another, once the last one is there."""
        m, front, plan = self.m, self.front, self.plan
        m.submodules.writer = writer = SpiReader(
            half=plan.dac_half, deselect=plan.dac_deselect, selects=plan.dac_selects, command_bits=DAC_FRAME_BITS
        )
        m.d.comb += [
            front.dac_sck.eq(writer.sck),
            front.dac_mosi.eq(writer.mosi),
            front.dac_cs_n.eq(writer.cs_n),
            writer.i_bits.eq(DAC_FRAME_BITS),
        ]
        with m.FSM(name="send"):
            with m.State("wait"), m.If(whole):
                m.next = "start 0"
            for channel, word in enumerate(words):
                with m.State(f"start {channel}"):
                    m.d.comb += [
                        writer.i_start.eq(1),
                        writer.i_select.eq(1 << channel),
                        writer.i_command.eq(Cat(word, Const(converter.command, DAC_FRAME_BITS - converter.width))),
                    ]
                    m.next = f"frame {channel}"
                with m.State(f"frame {channel}"), m.If(writer.o_done):
                    m.next = f"start {channel + 1}" if channel + 1 < len(words) else "wait"

    def next_channel(self, after: str) -> None:
        """Go on to the next channel; behind the last one, to a state."""
        m = self.m
        m.d.sync += self.channel.eq(self.channel + 1)
        with m.If(self.last):
            m.d.sync += self.channel.eq(0)
            m.next = after
