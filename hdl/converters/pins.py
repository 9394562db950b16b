"""The pins of a board's converters, as members of components.

::

    SPI: sck, mosi, miso, cs_n n        with a chip select for each converter
    I2S: mclk, bclk, lrck, din n, dout n    with a data line for each ADC and each DAC
    SPI of DACs: dac_sck, dac_mosi, dac_cs_n n

No latency: wires only.
"""

from __future__ import annotations

from amaranth.lib.wiring import In, Out

from sosmith.model.converters.schedule import Schedule


def converter_pins(schedule: Schedule) -> dict[str, In | Out]:
    """Return the pins that the converters of a schedule have, seen from the board."""
    members: dict[str, In | Out] = {}
    if selects := sum(schedule.selects):
        members |= {"sck": Out(1), "mosi": Out(1), "miso": In(1), "cs_n": Out(selects)}
    if schedule.frame is not None:
        members |= {"mclk": Out(1), "bclk": Out(1), "lrck": Out(1)}
    if lines_in := sum(schedule.lines_in):
        members["din"] = In(lines_in)
    if schedule.lines_out:
        members["dout"] = Out(schedule.lines_out)
    if schedule.dac_selects:
        members |= {"dac_sck": Out(1), "dac_mosi": Out(1), "dac_cs_n": Out(schedule.dac_selects)}
    return members
