"""The top of a board on an Amaranth platform: its clock, its UART, and as many LEDs as it has.

::

    platform                         top, a SystemVerilog module
    default_clk --> sync ----------> clk
                    its reset -----> rst
    uart 0: rx --------------------> rx
            tx <-------------------- tx
    led 0, 1, .. <------------------ leds 3
    spi 0: sck, mosi, cs_n n <------ sck, mosi, cs_n n    with converters on an SPI
           miso -------------------> miso
    i2s 0: mclk, lrck, bclk 2 <----- mclk, lrck, bclk     with converters on an I2S: clocks for DACs and for ADCs
           dout n <--------------- dout n
           din n ----------------> din n
    dacs 0: dac_sck, .. <----------- dac_sck, dac_mosi, dac_cs_n n

With a PLL, ``sync`` is its clock, and the reset is high until it has locked::

    default_clk --> Pll --> sync --> clk
                    locked --[2]---> rst

No latency: wires only. The platform inverts what its board inverts, and makes the reset; on an ECP5 it makes none, as
all registers start with their initial values.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from amaranth.build import Platform, ResourceError
from amaranth.hdl import Cat, ClockDomain, ClockSignal, Elaboratable, Instance, Module, ResetSignal, Signal, Value
from amaranth.lib import io

from sosmith.hdl.boards.pll import Pll
from sosmith.hdl.bus.link import LEDS

SPI = "converters"
"""Name of the resource with the pins of the converters on an SPI."""

AUDIO = "i2s"
"""Name of the resource with the pins of the converters on an I2S."""

DACS = "dacs"
"""Name of the resource with the pins of DACs on an SPI."""

CLOCKS = ("mclk", "lrck", "bclk")
"""Pins of converters that are there twice."""

INPUTS = ("miso", "din")
"""Pins of converters that are inputs of the board."""


class OnPlatform(Elaboratable):
    """A board's top as a black box, connected to the resources ``uart`` and ``led`` of the platform that elaborates it.

    Parameters
    ----------
    top : str
        Name of a module with the ports of `sosmith.hdl.boards.board_top.BoardTop`, which the platform has as a file.
    converters : mapping of str to tuple of str
        Its pins of converters, by the name of the platform's resource that has them: `SPI`, `AUDIO`, `DACS`. A pin is
        there twice where the resource has two for it.
    pll : Pll or None
        What makes the clock; None for that of the platform.
    """

    def __init__(
        self, top: str, *, converters: Mapping[str, tuple[str, ...]] | None = None, pll: Pll | None = None
    ) -> None:
        self.top, self.converters, self.pll = top, converters or {}, pll

    def elaborate(self, platform: Platform) -> Module:
        """Request the resources."""
        m = Module()
        uart = platform.request("uart", 0, dir="-")
        m.submodules.rx = rx = io.Buffer("i", uart.rx)
        m.submodules.tx = tx = io.Buffer("o", uart.tx)
        leds = Signal(LEDS)
        bus: dict[str, Value] = {}
        if self.pll is not None:
            self.own_clock(m, platform, self.pll)
        for resource, names in self.converters.items():
            self.connect(m, platform.request(resource, 0, dir="-"), names, bus)
        m.submodules.board = Instance(
            self.top,
            i_clk=ClockSignal(),
            i_rst=ResetSignal(allow_reset_less=True),
            i_rx=rx.i,
            o_tx=tx.o,
            o_leds=leds,
            **bus,
        )
        for number, led in enumerate(leds):
            try:
                port = platform.request("led", number, dir="-")
            except ResourceError:
                break
            m.submodules[f"led{number}"] = buffer = io.Buffer("o", port)
            m.d.comb += buffer.o.eq(led)
        return m

    def own_clock(self, m: Module, platform: Platform, pll: Pll) -> None:
        """Make the clock with a PLL."""
        m.domains.sync = ClockDomain()
        locked = Signal()
        # A reset-less domain would not wait; these two are set by their initial values.
        waiting = Signal(2, init=0b11, reset_less=True)
        pin = platform.request(platform.default_clk, dir="-")
        if pll.family == "ice40":  # its PLL has the pin to itself
            source: Any = pin.io
        else:
            m.submodules.clock = buffer = io.Buffer("i", pin)
            source = buffer.i
        m.submodules.pll = pll.instance(source, ClockSignal(), locked)
        m.d.sync += waiting.eq(Cat(~locked, waiting[0]))
        m.d.comb += ResetSignal().eq(waiting[1])

    def connect(self, m: Module, pins: Any, names: tuple[str, ...], bus: dict[str, Value]) -> None:
        """Connect pins of converters."""
        for name in sorted(names, key=INPUTS.__contains__):
            if name in INPUTS:
                m.submodules[name] = inward = io.Buffer("i", getattr(pins, name))
                bus[f"i_{name}"] = inward.i
                continue
            m.submodules[name] = outward = io.Buffer("o", getattr(pins, name))
            if name in CLOCKS:
                level = Signal(name=name)
                m.d.comb += outward.o.eq(level.replicate(len(outward.o)))
                bus[f"o_{name}"] = level
            else:
                bus[f"o_{name}"] = outward.o
