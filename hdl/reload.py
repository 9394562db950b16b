"""The reload port: new contents for a core's idle bank over AXI4-Lite, checked by a CRC, swapped between samples.

::

                  +-------------+  o_word 32                                  bits
    s_axil_* <--->| SerialSlave |---------------------------------> write_data ----> idle bank of the core
      32          +-------------+                    [taken] -----> write_address, write_enable
                    |  ^ i_bit
              o_bit |  +---------------- words: ID, LAYOUT, DESIGN, VERSION of each bank, bit by bit
                    v  |
                  +-----------+ o_bit
                  | SerialCrc |----> = ? ----> [pending] ---- may_swap ----> [bank] ----> bank
                  +-----------+        [outcome]

    VERSION -----> DATA, once for each word -----> CRC -----> pending -----> bank changes, between two samples
"""

from __future__ import annotations

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.axi_lite import SerialSlave, forward_slave, slave_members
from sosmith.hdl.bus.serial_crc import SerialCrc
from sosmith.model.reload.registers import (
    ADDRESS_BITS,
    BITS,
    CRC,
    DATA,
    DESIGN,
    FAULTS,
    ID,
    INTERFACE,
    LAYOUT,
    MAGIC,
    MAX_WORDS,
    PROTECTED_REGISTERS,
    REGISTERS,
    STATUS,
    VERSION,
    Outcome,
    Register,
)


class ReloadPort(wiring.Component):
    """Fills the idle bank of a core, and makes it the active one if its contents have arrived without an error.

    The registers are those of `sosmith.model.reload.registers`. A load is a write of ``VERSION``, one of ``DATA`` for
    each word of the bank, and one of ``CRC``. A refused write ends it. Only a load with all its words and the right CRC
    asks for a swap: `pending` is then high until a clock in which `may_swap` is high.

    With a lock, once ``STATUS`` is written, each write of ``VERSION``, ``DATA`` and ``CRC`` is refused until a reset.
    That write is refused itself during a load and while a swap is pending: neither bank nor version changes afterwards.

    A reset ends a load, drops a pending swap, and opens the lock. It changes neither the active bank nor its version,
    because it could not restore the memories: the core goes on with the set that it has.

    Latency and throughput: those of `sosmith.hdl.bus.axi_lite.SerialSlave`.

    Parameters
    ----------
    depth : int
        Words of a bank, 1 to 65535.
    bits : int
        Used bits of a word, 1 to 32.
    design : int
        Fingerprint of the core, which ``DESIGN`` reads.
    protected : bool
        Whether there is a register ``FAULTS``, and the memory of the words that are read has each bit three times.
    lock : bool
        Whether it can be locked.

    Members
    -------
    s_axil_awaddr, .., s_axil_rready
        AXI4-Lite slave of `sosmith.model.reload.registers.ADDRESS_BITS` address lines.
    write_enable : Out(1)
        High for one clock for each word.
    write_address : Out(range(depth))
        Number of the word in the idle bank.
    write_data : Out(bits)
        The word.
    bank : Out(1)
        The active bank: that of a sample accepted in this clock.
    pending : Out(1)
        Whether a swap is due. The core must allow it within finite time.
    may_swap : In(1)
        Whether `bank` may change at the end of this clock.
    shadow_free : In(1)
        Whether no sample inside the core uses the idle bank. While it is low, no load can begin.
    corrected, failed : In(1)
        Whether a wrong bit was found at this clock that was corrected, and one that could not be; only if protected.
    acknowledge : Out(1)
        High for one clock when ``FAULTS`` is written; only if protected.
    locked : Out(1)
        Whether nothing can be loaded until a reset; only with a lock.
    """

    def __init__(
        self, depth: int, *, bits: int = BITS, design: int = 0, protected: bool = False, lock: bool = False
    ) -> None:
        if not 1 <= depth <= MAX_WORDS:
            raise ValueError(f"depth must be 1 to {MAX_WORDS}, not {depth!r}")
        if not 1 <= bits <= BITS:
            raise ValueError(f"bits must be 1 to {BITS}, not {bits!r}")
        self.depth = depth
        self.bits = bits
        self.design = design
        self.protected = protected
        self.lock = lock
        members = {
            **slave_members(ADDRESS_BITS),
            "write_enable": Out(1),
            "write_address": Out(range(depth)),
            "write_data": Out(bits),
            "bank": Out(1),
            "pending": Out(1),
            "may_swap": In(1),
            "shadow_free": In(1),
        }
        if protected:
            members |= {"corrected": In(1), "failed": In(1), "acknowledge": Out(1)}
        if lock:
            members |= {"locked": Out(1)}
        super().__init__(members)

    def elaborate(self, platform: object) -> Module:
        """Build the slave, the CRC, the control of a load, and what can be read."""
        m = Module()
        m.submodules.slave = slave = SerialSlave(ADDRESS_BITS)
        forward_slave(m, self, slave)
        m.submodules.checksum = crc = SerialCrc()
        turns = _is_at(slave, CRC)
        writes = slave.o_writes & ~_is_at(slave, FAULTS) if self.protected else slave.o_writes
        m.d.comb += [
            crc.i_clear.eq(slave.o_start & _writes(slave, VERSION)),
            crc.i_shift.eq(slave.o_shift & (writes | turns)),
            crc.i_turn.eq(turns),
            crc.i_bit.eq(slave.o_bit),
        ]
        bank = Signal(reset_less=True)
        m.d.comb += self.bank.eq(bank)
        with m.If(self.pending & self.may_swap):
            m.d.sync += [bank.eq(~bank), self.pending.eq(0)]
        loading, outcome = self._load(m, slave, crc)
        self._read(m, slave, crc, bank, Cat(loading, outcome))
        return m

    def _load(self, m: Module, slave: SerialSlave, crc: SerialCrc) -> tuple[Signal, Signal]:
        """Control a load from its beginning to its end; return whether one is going on, and how the last one ended."""
        loading = Signal()
        outcome = Signal(Outcome)
        taken = Signal(range(self.depth + 1))
        complete = taken == self.depth
        writable = (
            (_is_at(slave, VERSION) & ~self.pending & self.shadow_free)
            | (_is_at(slave, DATA) & loading & ~complete)
            | (_is_at(slave, CRC) & loading & complete)
        )
        readable = (slave.o_index < len(PROTECTED_REGISTERS if self.protected else REGISTERS)) & ~_is_at(slave, DATA)
        if self.lock:
            writable = self._lockable(m, slave, writable, loading)
        if self.protected:
            writable = writable | _is_at(slave, FAULTS)
        m.d.comb += slave.i_refuse.eq(~Mux(slave.o_writes, writable, readable))
        with m.If(slave.o_start & _writes(slave, VERSION)):
            m.d.sync += [loading.eq(1), taken.eq(0)]
        m.d.comb += [
            self.write_enable.eq(slave.o_start & _writes(slave, DATA)),
            self.write_address.eq(taken),
            self.write_data.eq(slave.o_word),
        ]
        with m.If(self.write_enable):
            m.d.sync += taken.eq(taken + 1)
        with m.If(slave.o_refused & slave.o_writes & loading):
            m.d.sync += [loading.eq(0), outcome.eq(Outcome.BROKEN_OFF)]
        right = Signal()
        with m.If(slave.o_start):
            m.d.sync += right.eq(1)
        with m.If(slave.o_shift & (slave.o_bit != crc.o_bit)):
            m.d.sync += right.eq(0)
        with m.If(slave.o_last & _writes(slave, CRC)):
            m.d.comb += slave.i_fail.eq(~right)
            m.d.sync += [loading.eq(0), self.pending.eq(right)]
            m.d.sync += outcome.eq(Mux(right, Outcome.ACCEPTED, Outcome.WRONG_CRC))
        return loading, outcome

    def _lockable(self, m: Module, slave: SerialSlave, writable: Value, loading: Signal) -> Value:
        """Add the lock; return which writes are taken besides those that count nothing."""
        with m.If(slave.o_start & _writes(slave, STATUS)):
            m.d.sync += self.locked.eq(1)
        locks = _is_at(slave, STATUS) & ~loading & ~self.pending
        return (writable & ~self.locked) | locks

    def _read(self, m: Module, slave: SerialSlave, crc: SerialCrc, bank: Signal, load: Value) -> None:
        """Answer reads bit by bit: constants and versions from a memory, the rest a clock late as these are."""
        seen_bank = Signal()
        seen_pending = Signal()  # a swap must not show in the middle of a read
        with m.If(slave.o_check):
            m.d.sync += [seen_bank.eq(bank), seen_pending.eq(self.pending)]
        copies = 3 if self.protected else 1
        init = [(word >> bit & 1) * ((1 << copies) - 1) for word in self._rows() for bit in range(BITS)]
        m.submodules.words = words = Memory(shape=copies, depth=len(init), init=init, attrs={"ram_style": "block"})
        store = words.write_port()
        fetch = words.read_port()
        m.d.comb += [
            store.addr.eq(Cat(slave.o_count, slave.o_index ^ ~bank)),
            store.data.eq(slave.o_bit.replicate(copies)),
            store.en.eq(slave.o_shift & _writes(slave, VERSION)),
            fetch.addr.eq(Cat(slave.o_count, slave.o_index ^ (_is_at(slave, VERSION) & seen_bank))),
        ]
        locked: Value = self.locked if self.lock else Const(0, 1)
        status = Cat(load[0], seen_pending, seen_bank, locked, load[1:], Const(0, 2))
        other = Signal()
        m.d.sync += other.eq(_bit_of(status, slave.o_count[:3]) & ~slave.o_count[3:].any())
        with m.If(_is_at(slave, CRC)):
            m.d.sync += other.eq(crc.o_bit)
        stored: Value = fetch.data
        if self.protected:
            first, second, third = fetch.data
            stored = (first & second) | (second & third) | (first & third)
            faults = self._faults(m, slave)
            with m.If(_is_at(slave, FAULTS)):
                m.d.sync += other.eq(faults)
        now = _is_at(slave, STATUS) | _is_at(slave, CRC)
        if self.protected:
            now = now | _is_at(slave, FAULTS)
        m.d.comb += slave.i_bit.eq(Mux(now, other, stored))

    def _faults(self, m: Module, slave: SerialSlave) -> Value:
        """Count the faults; return the bit of ``FAULTS`` that is read."""
        counts: list[Value] = []
        m.d.comb += self.acknowledge.eq(slave.o_start & _writes(slave, FAULTS))
        for name, event in (("CORRECTED", self.corrected), ("UNCORRECTED", self.failed)):
            field = FAULTS.field(name)
            count = Signal(field.bits, name=name.lower())
            seen = Signal(field.bits, name=f"seen_{name.lower()}")  # a count must not change in the middle of a read
            with m.If(slave.o_check):
                m.d.sync += seen.eq(count)
            with m.If(event & ~count.all()):
                m.d.sync += count.eq(count + 1)
            with m.If(self.acknowledge):
                m.d.sync += count.eq(event)
            counts.append(seen)
        return _bit_of(Cat(*counts), slave.o_count)

    def _rows(self) -> list[int]:
        """Return the words of that memory: a row for each register, and two for the version, one for each bank."""
        assert VERSION.index % 2 == 0  # the bank is the lowest bit of the row
        assert VERSION.index + 1 == DATA.index  # which cannot be read
        layout = INTERFACE << LAYOUT.field("INTERFACE").low | self.depth << LAYOUT.field("WORDS").low
        rows = [0] * (1 << (ADDRESS_BITS - 2))
        rows[ID.index], rows[LAYOUT.index], rows[DESIGN.index] = MAGIC, layout, self.design
        return rows


def _is_at(slave: SerialSlave, register: Register) -> Value:
    return slave.o_index == register.index


def _writes(slave: SerialSlave, register: Register) -> Value:
    return slave.o_writes & _is_at(slave, register)


def _bit_of(word: Value, index: Value) -> Value:
    """Return a bit of `word`, whose width must be a power of two."""
    bits = list(word)
    for select in index:
        bits = [Mux(select, high, low) for low, high in zip(bits[::2], bits[1::2], strict=True)]
    (bit,) = bits
    return bit
