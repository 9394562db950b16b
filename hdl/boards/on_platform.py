"""The top of a board on an Amaranth platform: its clock, its UART, and as many LEDs as it has.

::

    platform                         top, a SystemVerilog module
    default_clk --> sync ----------> clk
                    its reset -----> rst
    uart 0: rx --------------------> rx
            tx <-------------------- tx
    led 0, 1, .. <------------------ leds 3
    spi 0: sck, mosi, cs_n n <------ sck, mosi, cs_n n    with converters
           miso -------------------> miso

No latency: wires only. The platform inverts what its board inverts, and makes the reset; on an ECP5 it makes none, as
all registers start with their initial values.
"""

from __future__ import annotations

from amaranth.build import Platform, ResourceError
from amaranth.hdl import ClockSignal, Elaboratable, Instance, Module, ResetSignal, Signal, Value
from amaranth.lib import io

from sosmith.hdl.bus.link import LEDS

SPI = "converters"
"""Name of the resource with the pins of the converters."""


class OnPlatform(Elaboratable):
    """A board's top as a black box, connected to the resources ``uart`` and ``led`` of the platform that elaborates it.

    Parameters
    ----------
    top : str
        Name of a module with the ports of `sosmith.hdl.boards.board_top.BoardTop`, which the platform has as a file.
    converters : bool
        Whether it has an SPI; the platform then has the resource `SPI`, with a pin for each chip select.
    """

    def __init__(self, top: str, *, converters: bool = False) -> None:
        self.top, self.converters = top, converters

    def elaborate(self, platform: Platform) -> Module:
        """Request the resources."""
        m = Module()
        uart = platform.request("uart", 0, dir="-")
        m.submodules.rx = rx = io.Buffer("i", uart.rx)
        m.submodules.tx = tx = io.Buffer("o", uart.tx)
        leds = Signal(LEDS)
        bus: dict[str, Value] = {}
        if self.converters:
            pins = platform.request(SPI, 0, dir="-")
            for name in ("sck", "mosi", "cs_n"):
                m.submodules[name] = outward = io.Buffer("o", getattr(pins, name))
                bus[f"o_{name}"] = outward.o
            m.submodules.miso = inward = io.Buffer("i", pins.miso)
            bus["i_miso"] = inward.i
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
