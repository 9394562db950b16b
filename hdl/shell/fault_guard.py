"""Scrubbing of a core's memories, and what follows when a wrong bit cannot be corrected.

::

    idle ----+-- scrubs ---> [address] + 1 ---> [read_address]     bits
             |       |
             |       +-----> [read]
             |
    failed --|--> [fault] -------------------> fault, until a reset or `acknowledge`
         |   +-----+
         |         v
         +--> [broken] ---> and ---> restart, which ends `broken`

Latency: `fault` rises one clock after `failed`. Throughput: one address at each clock that is idle.
"""

from __future__ import annotations

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class FaultGuard(wiring.Component):
    """Scrubs memories while a core is idle, keeps in mind that a fault was found, and asks for a restart.

    Parameters
    ----------
    address_bits : int
        Width of the address, at least 1; the guard goes through all addresses again and again.

    Members
    -------
    idle : In(1)
        Whether the memories' ports are free, and a restart may begin at the next clock.
    failed : In(1)
        Whether a wrong bit was found at this clock that could not be corrected.
    acknowledge : In(1)
        Ends `fault`, unless one is found or a restart begins at this clock.
    scrubs : Out(1)
        Whether `address` is to be read at this clock.
    address : Out(address_bits)
        Address to scrub.
    read : Out(1)
        Whether an address was scrubbed at the last clock, so that its word is there.
    read_address : Out(address_bits)
        That address.
    broken : Out(1)
        Whether a restart is due: no sample may start.
    restart : Out(1)
        High for one clock: states are cleared from the next one on.
    fault : Out(1)
        Whether a fault was found since the last reset or `acknowledge`.
    """

    def __init__(self, address_bits: int) -> None:
        super().__init__(
            {
                "idle": In(1),
                "failed": In(1),
                "acknowledge": In(1),
                "scrubs": Out(1),
                "address": Out(address_bits),
                "read": Out(1),
                "read_address": Out(address_bits),
                "broken": Out(1),
                "restart": Out(1),
                "fault": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        broken = Signal()
        m.d.comb += [
            self.scrubs.eq(self.idle & ~broken),
            self.restart.eq(self.idle & broken),
            self.broken.eq(broken),
        ]
        m.d.sync += [self.read.eq(self.scrubs), self.read_address.eq(self.address)]
        with m.If(self.scrubs):
            m.d.sync += self.address.eq(self.address + 1)
        with m.If(self.acknowledge):
            m.d.sync += self.fault.eq(0)
        with m.If(self.failed):
            m.d.sync += [self.fault.eq(1), broken.eq(1)]
        with m.If(self.restart):  # the flag once more: `broken` may itself have been turned over
            m.d.sync += [broken.eq(0), self.fault.eq(1)]
        return m
