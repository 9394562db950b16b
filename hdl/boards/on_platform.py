"""The top of a board on an Amaranth platform: its clock, its UART, and as many LEDs as it has.

::

    platform                         top, a SystemVerilog module
    default_clk --> sync ----------> clk
                    its reset -----> rst
    uart 0: rx --------------------> rx
            tx <-------------------- tx
    led 0, 1, .. <------------------ leds 3

No latency: wires only. The platform inverts what its board inverts, and makes the reset; on an ECP5 it makes none, as
all registers start with their initial values.
"""

from __future__ import annotations

from amaranth.build import Platform, ResourceError
from amaranth.hdl import ClockSignal, Elaboratable, Instance, Module, ResetSignal, Signal
from amaranth.lib import io

from sosmith.hdl.bus.link import LEDS


class OnPlatform(Elaboratable):
    """A board's top as a black box, connected to the resources ``uart`` and ``led`` of the platform that elaborates it.

    Parameters
    ----------
    top : str
        Name of a module with the ports of `sosmith.hdl.boards.board_top.BoardTop`, which the platform has as a file.
    """

    def __init__(self, top: str) -> None:
        self.top = top

    def elaborate(self, platform: Platform) -> Module:
        """Request the resources."""
        m = Module()
        uart = platform.request("uart", 0, dir="-")
        m.submodules.rx = rx = io.Buffer("i", uart.rx)
        m.submodules.tx = tx = io.Buffer("o", uart.tx)
        leds = Signal(LEDS)
        m.submodules.board = Instance(
            self.top, i_clk=ClockSignal(), i_rst=ResetSignal(allow_reset_less=True), i_rx=rx.i, o_tx=tx.o, o_leds=leds
        )
        for number, led in enumerate(leds):
            try:
                port = platform.request("led", number, dir="-")
            except ResourceError:
                break
            m.submodules[f"led{number}"] = buffer = io.Buffer("o", port)
            m.d.comb += buffer.o.eq(led)
        return m
