"""The board's end of the link: carries out the requests in the receiver's buffers, and writes the responses.

::

    FrameReceiver                                              FrameSender
    o_data 8 ----+--> type, sequence number, body              i_data 8
       ^         |                                                ^
       |         +-----> CheckedBytes --(CRC right?)              | o_write
    [address] 8  |            ^   +-------------------------------+
    [end] 8      |            |
                 |            +-- type, number | identity 8 | counters 8 | [word] low byte | status | CRC
                 |
                 +---> [word] >> 8, as wide as the widest of sample, result and register
                          |      ^
                          v      |
             s_axis_tdata, s_axil_*  m_axis_tdata and m_axis_tuser, or o_result of a front-end; s_axil_rdata

    idle -> length -> check, tail -> verdict -> kind -> number -> type, sequence -> body -> .. -> status, crc -> stop
      ^                                 |                  |                                                      |
      +--- dropped, or sent again ------+------------------+------------------------------------------------------+

One sample is in the core at a time. Every state waits for `CheckedBytes`, 9 clocks for each byte of a request, and of a
response.
"""

from __future__ import annotations

from dataclasses import dataclass

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory, ReadPort
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.axi_lite import slave_members
from sosmith.hdl.bus.checked_bytes import CheckedBytes
from sosmith.hdl.bus.frame_receiver import BLOCK_RAM, LENGTH_ADDRESS
from sosmith.model.converters.spi_converter import ReadingFault
from sosmith.model.dataflow.status import STATUS_BITS
from sosmith.model.link.packing import Packing
from sosmith.model.link.protocol import (
    BLOCK_BYTES,
    CRC_BYTES,
    HEAD_BYTES,
    MAX_BODY,
    RESPONSE,
    VERSION,
    WORD_BYTES,
    Counter,
    Status,
    Type,
    samples_per_message,
)
from sosmith.model.reload.registers import BITS

WINDOW = 2
"""Requests that may be without a response: one for each buffer of the receiver and of the sender."""


MAX_CHANNELS = 256
"""A channel is one byte."""

MAX_SAMPLE_BYTES = MAX_BODY - 1
"""A sample and its channel fit a message."""

MAX_READINGS = MAX_BODY - 1
"""A byte for each fits a message."""


@dataclass(frozen=True, kw_only=True)
class Face:
    """The faces of a core, as far as the link has to know them.

    Attributes
    ----------
    sample_bytes, result_bytes : int
        Bytes of ``s_axis_tdata`` and of ``m_axis_tdata``.
    channels : int
        Number of channels, 1 to 256.
    address_bits : int
        Address lines of ``s_axil_*``; 0 without registers.
    readings : int
        Inputs of all channels that a front-end reads from converters; 0 for a core that is fed over the link.
    packing : Packing or None
        The form of packed results; None for a link without them.
    results : int
        Results of each sample; more than 1 for a core that is fed over the link, without packed results.
    """

    sample_bytes: int
    result_bytes: int
    channels: int = 1
    address_bits: int = 0
    readings: int = 0
    packing: Packing | None = None
    results: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.channels <= MAX_CHANNELS:
            raise ValueError(f"channels must be 1 to {MAX_CHANNELS}, not {self.channels}")
        if not 1 <= self.sample_bytes <= MAX_SAMPLE_BYTES:
            raise ValueError(f"sample_bytes must be 1 to {MAX_SAMPLE_BYTES}, not {self.sample_bytes}")
        if not 0 <= self.readings <= MAX_READINGS:
            raise ValueError(f"readings must be 0 to {MAX_READINGS}, not {self.readings}")
        if self.results > 1 and (self.readings or self.packing is not None):
            raise ValueError(f"results must be 1 with converters or packed results, not {self.results}")
        if self.samples < 1:
            most = (MAX_BODY - 1) // self.response_bytes
            raise ValueError(f"results must be 1 to {most}, as many as fit a message, not {self.results}")

    @property
    def response_bytes(self) -> int:
        """Bytes of a result with its status flags."""
        return self.result_bytes + 1

    @property
    def samples(self) -> int:
        """How many samples fit a message."""
        return samples_per_message(self.sample_bytes, self.results * self.response_bytes)

    @property
    def polled(self) -> int:
        """How many results fit the answer to a ``POLL``, behind their channel."""
        return (MAX_BODY - 2) // self.response_bytes

    @property
    def types(self) -> int:
        """The highest type of a request."""
        if self.packing is not None:
            return Type.POLL_PACKED if self.readings else Type.SAMPLES_PACKED
        return Type.CONVERTERS if self.readings else Type.COUNTERS

    @property
    def word_bytes(self) -> int:
        """Bytes of the widest of a sample, a result with its flags, and a register."""
        return max(self.sample_bytes, self.response_bytes, WORD_BYTES if self.address_bits else 0)


def core_side(face: Face) -> dict[str, In | Out]:
    """Return the members that face a core, from the other side: streams without ``m_axis_tdest``, and registers.

    With converters, those of `sosmith.hdl.converters.front_end.FrontEnd` that face the link stand for the streams.
    """
    members: dict[str, In | Out] = (
        _results(face)
        if face.readings
        else {
            "s_axis_tdata": Out(8 * face.sample_bytes),
            "s_axis_tdest": Out(8),
            "s_axis_tvalid": Out(1),
            "s_axis_tready": In(1),
            "m_axis_tdata": In(8 * face.result_bytes),
            "m_axis_tuser": In(STATUS_BITS),
            "m_axis_tvalid": In(1),
            "m_axis_tready": Out(1),
        }
    )
    if face.address_bits:
        members = members | {name: member.flip() for name, member in slave_members(face.address_bits).items()}
    return members


def _results(face: Face) -> dict[str, In | Out]:
    return {
        "o_result": In(8 * face.response_bytes),
        "o_channel": In(8),
        "o_there": In(1),
        "o_settled": In(1),
        "o_missed": In(1),
        "i_take": Out(1),
        "i_index": Out(8),
        "o_reading": In(len(ReadingFault)),
        "o_new": In(1),
        "o_status": In(STATUS_BITS),
    }


class CommandEngine(wiring.Component):
    """Carries out requests and writes responses, by the rules of docs/protocol.md.

    Throughput: 9 clocks for each byte of a request, for its CRC, and 9 for each of its response; for each sample,
    besides, two for each of its bytes and the core's latency. Of a packed result, each bit takes a clock besides.

    Parameters
    ----------
    face : Face
        The core's faces.
    memory : bytes
        What ``IDENTITY`` gives: a power of two of bytes, at least `BLOCK_BYTES`.

    Members
    -------
    i_full, o_address, i_data, o_release
        The oldest message, of a `sosmith.hdl.bus.frame_receiver.FrameReceiver`.
    o_begin, o_slot, o_data, o_write, o_code, o_stop, o_again, o_both, i_unsent
        The responses, for a `sosmith.hdl.bus.frame_sender.FrameSender`.
    o_events : Out(8)
        For each counter, high for one clock to count one; those of the receiver are not among them.
    o_count, i_count, i_settled
        Counter to be read, its value, and whether that is valid, for a
        `sosmith.hdl.bus.fault_counters.FaultCounters`.
    o_reset : Out(1)
        High for one clock: a session begins, reset the core.
    o_accepted : Out(1)
        High for one clock for each request that is carried out.
    s_axis_*, m_axis_*, s_axil_*
        The core's faces, seen from the other side; ``tdest`` has 8 bits, and ``m_axis_tdest`` is not needed. With
        converters, what a `sosmith.hdl.converters.front_end.FrontEnd` has for the link stands for the streams.
    """

    def __init__(self, face: Face, memory: bytes) -> None:
        if len(memory) < BLOCK_BYTES or len(memory).bit_count() != 1:
            raise ValueError(f"memory must be a power of two from {BLOCK_BYTES} on, not {len(memory)} bytes")
        self.face = face
        self.memory = memory
        members = {
            "i_full": In(1),
            "o_address": Out(8),
            "i_data": In(8),
            "o_release": Out(1),
            "o_begin": Out(1),
            "o_slot": Out(1),
            "o_data": Out(8),
            "o_write": Out(1),
            "o_code": Out(1),
            "o_stop": Out(1),
            "o_again": Out(1),
            "o_both": Out(1),
            "i_unsent": In(2),
            "o_events": Out(len(Counter)),
            "o_count": Out(range(len(Counter))),
            "i_count": In(8),
            "i_settled": In(1),
            "o_reset": Out(1),
            "o_accepted": Out(1),
        }
        super().__init__(members | core_side(face))

    def elaborate(self, platform: object) -> Module:
        """Build the state machine."""
        m = Module()
        m.submodules.bytes = unit = CheckedBytes()
        m.submodules.identity = rom = Memory(shape=8, depth=len(self.memory), init=self.memory, attrs=BLOCK_RAM)
        identity = rom.read_port()
        machine = _Machine(m, self, unit, identity)
        # Every state waits until the last byte is through.
        with m.If(~unit.o_busy), m.FSM(name="engine"):
            machine.check()
            machine.judge()
            machine.begin()
            machine.tell()
            if self.face.readings:
                machine.poll()
            if self.face.address_bits or not self.face.readings:
                machine.load()
            if not self.face.readings:
                machine.feed()
            machine.give()
            if self.face.packing is not None:
                machine.pack(self.face.packing)
            if self.face.address_bits:
                machine.access()
            machine.end_of_response()
        if self.face.readings:
            m.d.comb += self.o_events[Counter.MISSED].eq(self.o_missed)
            with m.If(self.o_missed):
                m.d.sync += machine.gap.eq(1)
        return m


class _Machine:
    """The registers of the state machine, and its states in groups."""

    def __init__(self, m: Module, engine: CommandEngine, unit: CheckedBytes, identity: ReadPort) -> None:
        self.m, self.engine, self.unit, self.face, self.identity = m, engine, unit, engine.face, identity
        self.address = Signal(8)
        self.ahead = Signal(8)  # in the message; what it is in the next clock
        self.crc_start = Signal(8)  # where the CRC of the message begins
        self.count = Signal(range(max(BLOCK_BYTES, engine.face.readings)))
        self.word = Signal(8 * engine.face.word_bytes, reset_less=True)
        self.kind = Signal(range(engine.face.types + 1))
        self.unknown = Signal()
        self.status = Signal(3)
        self.expected = Signal(8)
        self.retained = Signal(2)  # the next number; responses that can be sent again
        self.left = Signal(range(engine.face.results))  # results of the sample that are still to come
        self.gap = Signal()  # a result was given up since the channel of the first one was told
        self.target = Signal(8)  # channel, address of a register, or block of the identity
        # Of packed results, the bits of the byte that is being filled, and their number.
        self.shifted = Signal(8, reset_less=True)
        self.bits = Signal(3)
        m.d.sync += self.address.eq(self.ahead)
        m.d.comb += [
            self.ahead.eq(self.address),
            engine.o_address.eq(self.ahead),
            engine.o_data.eq(unit.o_data),
            engine.o_write.eq(unit.o_write),
            engine.o_slot.eq(engine.i_data[0]),
            engine.o_count.eq(self.count),
            identity.addr.eq(Cat(self.count[: (BLOCK_BYTES - 1).bit_length()], self.target)),
        ]
        if self.face.readings:
            m.d.comb += engine.i_index.eq(self.count)
        else:
            m.d.comb += [
                engine.s_axis_tdata.eq(self.word[-8 * self.face.sample_bytes :]),
                engine.s_axis_tdest.eq(self.target if self.face.channels > 1 else 0),
            ]
        if self.face.address_bits:
            m.d.comb += [
                engine.s_axil_awaddr.eq(self.target),
                engine.s_axil_araddr.eq(self.target),
                engine.s_axil_wdata.eq(self.word[-BITS:]),
                engine.s_axil_wstrb.eq(-1),
            ]

    def put(self, byte: Value | int) -> None:
        """Append a byte to the response."""
        self.m.d.comb += [self.unit.i_start.eq(1), self.unit.i_write.eq(1), self.unit.i_data.eq(byte)]

    def happens(self, counter: Counter) -> None:
        """Count a fault."""
        self.m.d.comb += self.engine.o_events[counter].eq(1)

    def go(self, address: Value | int) -> None:
        """Look at another address of the message in the next clock."""
        self.m.d.comb += self.ahead.eq(address)

    def counted(self, last: Value | int) -> Value:
        """Count up to `last` and return to 0; return whether this is the last."""
        final = self.count == last
        self.m.d.sync += self.count.eq(Mux(final, 0, self.count + 1))
        return final

    def answer(self, status: Status) -> None:
        """Go on to the end of the response."""
        self.m.d.sync += self.status.eq(status)
        self.m.next = "status"

    def drop(self) -> None:
        """Be done with the message."""
        self.m.d.comb += self.engine.o_release.eq(1)
        self.m.next = "idle"

    def check(self) -> None:
        """Compare the CRC."""
        m, engine, unit = self.m, self.engine, self.unit
        with m.State("idle"):
            self.go(LENGTH_ADDRESS)
            with m.If(engine.i_full):
                m.next = "length"
        with m.State("length"):
            m.d.sync += self.crc_start.eq(engine.i_data - CRC_BYTES)
            m.d.comb += unit.i_clear.eq(1)
            self.go(0)
            m.next = "check"
        with m.State("check"):
            at_end = self.address == self.crc_start
            m.d.comb += [unit.i_start.eq(1), unit.i_data.eq(engine.i_data), unit.i_turn.eq(at_end)]
            self.go(self.address + 1)
            with m.If(at_end):
                m.d.sync += self.count.eq(1)
                m.next = "tail"
        with m.State("tail"):
            m.d.comb += [unit.i_start.eq(1), unit.i_data.eq(engine.i_data), unit.i_turn.eq(1)]
            self.go(self.address + 1)
            with m.If(self.counted(CRC_BYTES - 1)):
                m.next = "verdict"
        with m.State("verdict"):
            self.go(0)
            m.next = "kind"
            with m.If(unit.o_wrong):
                self.happens(Counter.CRC)
                self.drop()

    def judge(self) -> None:
        """Look at type and sequence number: a new request, one to be answered again, or neither."""
        m, engine = self.m, self.engine
        with m.State("kind"):
            m.d.sync += [self.kind.eq(engine.i_data), self.unknown.eq(engine.i_data[len(self.kind) :].any())]
            self.go(1)
            m.next = "number"
        with m.State("number"):
            ahead = Signal(8)
            m.d.comb += ahead.eq(engine.i_data - self.expected)
            one_back, two_back = ahead == 0xFF, ahead == 0xFE
            known = (one_back & self.retained.any()) | (two_back & self.retained[1])
            nothing_unsent = engine.i_unsent == 0
            with m.If((self.kind == Type.OPEN) & ~self.unknown), m.If(nothing_unsent):
                m.d.comb += [engine.o_accepted.eq(1), engine.o_reset.eq(1)]
                m.d.sync += self.retained.eq(1)
            with m.Elif((ahead == 0) & self.retained.any()), m.If(~engine.i_unsent[1]):
                m.d.comb += engine.o_accepted.eq(1)
                m.d.sync += self.retained.eq(WINDOW)
            with m.Elif(known), m.If(nothing_unsent):
                m.d.comb += [engine.o_again.eq(1), engine.o_both.eq(two_back)]
                self.happens(Counter.REPEATED)
                self.drop()
            with m.Else():
                self.happens(Counter.SEQUENCE)
                self.drop()
            with m.If(engine.o_accepted):
                m.d.comb += [engine.o_begin.eq(1), self.unit.i_clear.eq(1)]
                m.d.sync += self.expected.eq(engine.i_data + 1)
                self.go(0)
                m.next = "type"

    def begin(self) -> None:
        """Begin the response, and look at type, length and channel."""
        m, engine = self.m, self.engine
        with m.State("type"):
            self.put(engine.i_data | RESPONSE)
            self.go(1)
            m.next = "sequence"
        with m.State("sequence"):
            self.put(engine.i_data)
            self.go(HEAD_BYTES)
            m.next = "body"
        with m.State("body"):
            m.d.sync += self.target.eq(engine.i_data)
            self.go(HEAD_BYTES + 1)
            self.answer(Status.UNKNOWN)
            with m.If(~self.unknown), m.Switch(self.kind):
                for type_, (fits, state) in self._requests().items():
                    with m.Case(type_):
                        m.next = state
                        if type_ in {Type.SAMPLES, Type.SAMPLES_PACKED} and self.face.channels < MAX_CHANNELS:
                            with m.If(engine.i_data >= self.face.channels):
                                self.answer(Status.CHANNEL)
                        with m.If(~fits):
                            self.answer(Status.LENGTH)

    def _requests(self) -> dict[Type, tuple[Value, str]]:
        """For each request that is known, whether its length is right, and its first state."""
        none, one = self.crc_start == HEAD_BYTES, self.crc_start == HEAD_BYTES + 1
        known: dict[Type, tuple[Value, str]] = {Type.OPEN: (none, "version"), Type.IDENTITY: (one, "fetch")}
        if self.face.readings:
            known |= {Type.POLL: (none, "poll"), Type.CONVERTERS: (none, "reading")}
        else:
            known[Type.SAMPLES] = self._few(self.face.samples), "load"
        known[Type.COUNTERS] = none, "counters"
        if self.face.packing is not None and self.face.readings:
            known[Type.POLL_PACKED] = none, "poll"
        elif self.face.packing is not None:
            known[Type.SAMPLES_PACKED] = self._few(self.face.packing.per_message(self.face.sample_bytes)), "load"
        if self.face.address_bits:
            known |= {Type.READ: (one, "read address"), Type.WRITE: (~none, "load")}
        return known

    def _few(self, samples: int) -> Value:
        """Whether the body has a channel, and no more samples than these."""
        longest = HEAD_BYTES + 1 + samples * self.face.sample_bytes
        there = self.crc_start != HEAD_BYTES
        return there & (self.crc_start <= longest) if longest < HEAD_BYTES + MAX_BODY else there

    def _packs(self) -> Value:
        """Whether the request wants packed results."""
        return (self.kind == Type.SAMPLES_PACKED) | (self.kind == Type.POLL_PACKED)

    def tell(self) -> None:
        """Answer what concerns the link itself."""
        m, engine = self.m, self.engine
        with m.State("version"):
            self.put(VERSION)
            m.next = "window"
        with m.State("window"):
            self.put(WINDOW)
            self.answer(Status.OK)
        with m.State("fetch"):
            m.next = "identity"
        with m.State("identity"):
            self.put(self.identity.data)
            with m.If(self.counted(BLOCK_BYTES - 1)):
                self.answer(Status.OK)
        with m.State("counters"), m.If(engine.i_settled):
            self.put(engine.i_count)
            with m.If(self.counted(len(Counter) - 1)):
                self.answer(Status.OK)

    def load(self) -> None:
        """Take the next sample or word of the body, byte by byte; at its end, the status."""
        m, engine = self.m, self.engine
        writes = self.kind == Type.WRITE
        last: Value | int = self.face.sample_bytes - 1
        if self.face.address_bits:
            last = Mux(writes, WORD_BYTES - 1, last)
        with m.State("load"):
            with m.If(self.address == self.crc_start):
                m.d.sync += self.count.eq(0)
                self.answer(Status.OK)
                with m.If(self.count != 0):
                    self.answer(Status.LENGTH)
            with m.Else():
                m.d.sync += self.word.eq(Cat(self.word[8:], engine.i_data))
                self.go(self.address + 1)
                with m.If(self.counted(last)):
                    m.next = "write address" if self.face.readings else "feed"
                    if self.face.address_bits:
                        with m.If(writes):
                            m.next = "write address"

    def poll(self) -> None:
        """Fetch the oldest results of a front-end, or the faults of its readings."""
        m, engine = self.m, self.engine
        packing, most = self.face.packing, self.face.polled
        packed = most if packing is None else packing.per_message()
        limit: Value | int = most if packing is None else Mux(self._packs(), packed, most)
        fetched = Signal(range(max(packed, most) + 1))
        with m.State("poll"):
            self.put(engine.o_channel)
            m.d.sync += [fetched.eq(0), self.gap.eq(0)]
            m.next = "more"
        with m.State("more"), m.If(engine.o_settled):
            with m.If(~engine.o_there | self.gap | (fetched == limit)):
                self.answer(Status.OK)
            with m.Else():
                m.d.comb += engine.i_take.eq(1)
                m.d.sync += fetched.eq(fetched + 1)
                self.took(engine.o_result)
        with m.State("reading"):  # its faults are there at the next clock
            m.next = "faults"
        with m.State("faults"):
            self.put(engine.o_reading)
            m.next = "reading"
            with m.If(self.counted(self.face.readings - 1)):
                self.answer(Status.OK)

    def feed(self) -> None:
        """Give the core a sample, and wait for its result, or for each of its results."""
        m, engine = self.m, self.engine
        with m.State("feed"):
            m.d.comb += engine.s_axis_tvalid.eq(1)
            with m.If(engine.s_axis_tready):
                if self.face.results > 1:
                    m.d.sync += self.left.eq(self.face.results - 1)
                m.next = "result"
        with m.State("result"):
            m.d.comb += engine.m_axis_tready.eq(1)
            with m.If(engine.m_axis_tvalid):
                self.took(Cat(engine.m_axis_tdata, engine.m_axis_tuser))
                if self.face.channels > 1:
                    following: Value = Mux(self.target == self.face.channels - 1, 0, self.target + 1)
                    if self.face.results > 1:
                        following = Mux(self.left.any(), self.target, following)
                    m.d.sync += self.target.eq(following)

    def took(self, result: Value) -> None:
        """Take a result with its status, to append it to the response."""
        m, packing = self.m, self.face.packing
        m.d.sync += self.word.eq(result)
        m.next = "give"
        if packing is not None:
            status = result[8 * self.face.result_bytes :]
            with m.If(self._packs()):
                m.d.sync += self.word.eq(Cat(result[: packing.port.bits], *(status[flag] for flag in packing.flags)))
                m.next = "pack"

    def pack(self, packing: Packing) -> None:
        """Append the bits of a result to the byte that is being filled, one a clock."""
        m = self.m
        with m.State("pack"):
            self.fill(self.word[0])
            m.d.sync += self.word.eq(self.word[1:])
            with m.If(self.counted(packing.bits - 1)):
                m.next = "more" if self.face.readings else "load"

    def fill(self, bit: Value | int) -> None:
        """Append a bit."""
        byte = Cat(self.shifted[1:], bit)
        self.m.d.sync += [self.shifted.eq(byte), self.bits.eq(self.bits + 1)]
        with self.m.If(self.bits.all()):
            self.put(byte)

    def give(self) -> None:
        """Append a result, or the word of a register."""
        m = self.m
        reads = self.kind == Type.READ
        last: Value | int = self.face.response_bytes - 1
        if self.face.address_bits:
            last = Mux(reads, WORD_BYTES - 1, last)
        with m.State("give"):
            self.put(self.word[:8])
            m.d.sync += self.word.eq(self.word[8:])
            with m.If(self.counted(last)):
                m.next = "more" if self.face.readings else "load"
                if self.face.results > 1:
                    with m.If(self.left != 0):
                        m.d.sync += self.left.eq(self.left - 1)
                        m.next = "result"
                if self.face.address_bits:
                    with m.If(reads):
                        m.next = "status"

    def access(self) -> None:
        """Write or read a register."""
        m, engine = self.m, self.engine
        with m.State("write address"):
            m.d.comb += engine.s_axil_awvalid.eq(1)
            with m.If(engine.s_axil_awready):
                m.next = "write"
        with m.State("write"):
            m.d.comb += engine.s_axil_wvalid.eq(1)
            with m.If(engine.s_axil_wready):
                m.next = "response"
        with m.State("response"):
            m.d.comb += engine.s_axil_bready.eq(1)
            with m.If(engine.s_axil_bvalid):
                m.next = "load"
                with m.If(engine.s_axil_bresp[1]):
                    self.answer(Status.REFUSED)
        with m.State("read address"):
            m.d.comb += engine.s_axil_arvalid.eq(1)
            with m.If(engine.s_axil_arready):
                m.next = "read"
        with m.State("read"):
            m.d.comb += engine.s_axil_rready.eq(1)
            with m.If(engine.s_axil_rvalid):
                refused = Mux(engine.s_axil_rresp[1], Status.REFUSED, Status.OK)
                m.d.sync += [self.word.eq(engine.s_axil_rdata), self.status.eq(refused)]
                m.next = "give"

    def end_of_response(self) -> None:
        """Append the status and the CRC, and end the response."""
        m, engine = self.m, self.engine
        with m.State("status"):
            with m.If(self.bits != 0):
                self.fill(Const(0, 1))
            with m.Else():
                self.put(self.status)
                with m.If(self.status != Status.OK):
                    self.happens(Counter.REFUSED)
                m.next = "crc"
        with m.State("crc"):
            self.put(0)
            m.d.comb += self.unit.i_turn.eq(1)
            with m.If(self.counted(CRC_BYTES - 1)):
                m.next = "written"
        with m.State("written"):  # the sender takes the last byte at this clock
            m.next = "code"
        with m.State("code"):
            m.d.comb += engine.o_code.eq(1)
            m.next = "stop"
        with m.State("stop"):
            m.d.comb += engine.o_stop.eq(1)
            self.drop()
