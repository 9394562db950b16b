r"""Models of converters on an SPI in a simulator under cocotb; they fail the test where a data sheet is not kept to.

::

    cs_n n, sck, mosi --> SpiBus: one model for each chip select --> miso
                            checks the times, tells the models       pulled up; wrong until the output is valid

Figures of timing are those of `sosmith.model.converters.spi_converter`, which names the data sheets. What the models
say in which clock is written here once more, from the data sheets, and shares nothing with the hardware.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import cocotb
from cocotb.triggers import First, Timer, ValueChange
from cocotb.utils import get_sim_time

from sosmith.model.converters.spi_converter import Timing, ns

PULLED_UP = 1
"""Level of a line that nothing drives."""


class Adc:
    """An MCP3202 (two inputs) or an MCP3204 (four).

    Parameters
    ----------
    name : str
        Name in messages.
    inputs : int
        2 or 4.
    timing : Timing
        Limits.
    counts : callable
        Gives the next count, 0 to 4095, of an analog input.
    """

    def __init__(self, name: str, inputs: int, timing: Timing, counts: Callable[[int], int]) -> None:
        self.name, self.timing = name, timing
        self.null = 0
        """The null bit: 1 for a converter that is broken."""
        self._inputs, self._counts = inputs, counts
        # Behind the start bit: SGL/DIFF, ODD/SIGN and MSBF, or SGL/DIFF, D2, D1 and D0 and a clock more to sample.
        self._wanted = {2: 3, 4: 4}[inputs]
        self._wait = {2: 0, 4: 1}[inputs]
        self.clocks = 1 + self._wanted + self._wait + 1 + 12

    def select(self) -> None:
        """Begin a frame."""
        self._started, self._waited = False, 0
        self._configuration: list[int] = []
        self._output: list[int] | None = None

    def rise(self, bit: int) -> None:
        """Take a bit of the command."""
        if not self._started:
            self._started = bit == 1
        elif len(self._configuration) < self._wanted:
            self._configuration.append(bit)
            if len(self._configuration) == self._wanted:
                self._sample()
        else:
            self._waited += 1

    def _sample(self) -> None:
        single, *rest = self._configuration
        assert single == 1, f"the {self.name} must be asked for a single input, not for a difference"
        if self._inputs == 2:
            channel, order = rest
            assert order == 1, f"the {self.name} must be asked for the highest bit first, not for both orders"
        else:
            channel = rest[1] << 1 | rest[2]  # D2 is not looked at
        count = self._counts(channel)
        assert 0 <= count < 4096
        self._output = [self.null, *(count >> bit & 1 for bit in reversed(range(12)))]

    def fall(self) -> int | None:
        """Return the output behind a falling edge, None for one that is not driven."""
        if self._output is None or self._waited < self._wait:
            return None
        return self._output.pop(0) if self._output else 0

    def first(self) -> int | None:
        """Return the output behind the falling edge of CS."""
        return None


class PlainConverter:
    """A MAX31855 or an AD7476A, which take no command.

    Parameters
    ----------
    name : str
        Name in messages.
    timing : Timing
        Limits.
    frames : callable
        Gives the bits of the next conversion; `thermocouple_frame` makes those of a MAX31855.
    clocks : int
        How many these are.
    """

    def __init__(self, name: str, timing: Timing, frames: Callable[[], int], clocks: int = 32) -> None:
        self.name, self.timing, self._frames, self.clocks = name, timing, frames, clocks

    def select(self) -> None:
        """Begin a frame; a conversion that goes on is lost."""
        self._frame, self._left = self._frames(), self.clocks

    def rise(self, bit: int) -> None:
        """There is no command."""

    def first(self) -> int | None:
        """Return the highest bit."""
        return self.fall()

    def fall(self) -> int | None:
        """Return the next bit."""
        self._left -= 1
        return self._frame >> self._left & 1 if self._left >= 0 else 0


class Dac:
    """A MCP4921.

    Parameters
    ----------
    name : str
        Name in messages.
    timing : Timing
        Limits.
    """

    clocks = 16

    def __init__(self, name: str, timing: Timing) -> None:
        self.name, self.timing = name, timing
        self.words: list[int] = []
        """The words that it got."""

    def select(self) -> None:
        """Begin a frame."""
        self._bits: list[int] = []

    def rise(self, bit: int) -> None:
        """Take a bit."""
        self._bits.append(bit)
        if len(self._bits) == self.clocks:
            ignored, _, single, on = self._bits[:4]
            assert (ignored, single, on) == (0, 1, 1), f"the {self.name} must be written to with gain 1, and on"
            self.words.append(sum(level << 11 - place for place, level in enumerate(self._bits[4:])))

    def first(self) -> int | None:
        """Drive nothing."""
        return None

    def fall(self) -> int | None:
        """Drive nothing."""
        return None


def thermocouple_frame(
    quarters: int, *, cold: int = 25 * 16, opened: bool = False, ground: bool = False, supply: bool = False
) -> int:
    """Return the frame of a MAX31855 for a temperature in 0.25 degC and that of the cold junction in 0.0625 degC."""
    faults = opened | ground << 1 | supply << 2
    return (quarters & 0x3FFF) << 18 | (faults != 0) << 16 | (cold & 0xFFF) << 4 | faults


class SpiBus:
    """The SPI of a front-end, with a model at each chip select.

    Parameters
    ----------
    dut : handle
        With the ports ``sck``, ``mosi``, ``miso`` and ``cs_n``.
    models : sequence of Adc, PlainConverter or Dac
        In the order of ``cs_n``; None where no converter is.
    """

    def __init__(self, dut: Any, models: Sequence[Adc | PlainConverter | Dac | None]) -> None:
        self.dut, self.models = dut, models
        self.frames = [0] * len(models)
        """Complete frames of each converter."""
        self._cs, self._sck, self._mosi = (1 << len(models)) - 1, 0, 0
        self._cs_time: list[float | None] = [None] * len(models)
        self._rise: float | None = None
        self._fall: float | None = None
        self._mosi_time: float | None = None
        self._rises = 0
        self._change = 0
        dut.miso.value = PULLED_UP

    def start(self) -> None:
        """Begin to watch."""
        cocotb.start_soon(self._watch())

    async def _watch(self) -> None:
        dut = self.dut
        while True:
            await First(ValueChange(dut.cs_n), ValueChange(dut.sck), ValueChange(dut.mosi))
            await Timer(1, "ps")  # all that changes at the same clock has done so
            if not (dut.cs_n.value.is_resolvable and dut.sck.value.is_resolvable and dut.mosi.value.is_resolvable):
                continue
            self._changed(float(get_sim_time("ns")))

    def _changed(self, now: float) -> None:
        dut = self.dut
        cs, sck, mosi = int(dut.cs_n.value), int(dut.sck.value), int(dut.mosi.value)
        if mosi != self._mosi:
            self._moved(now)
        for number, model in enumerate(self.models):
            if (cs ^ self._cs) >> number & 1 and model is not None:
                (self._deselected if cs >> number & 1 else self._selected)(number, model, sck, now)
        selected = [model for number, model in enumerate(self.models) if not cs >> number & 1]
        assert len(selected) <= 1, f"at most one converter must be selected, not {len(selected)}"
        if sck != self._sck and selected and selected[0] is not None:
            (self._rose if sck else self._fell)(selected[0], mosi, now)
        self._cs, self._sck, self._mosi = cs, sck, mosi

    def _selected(self, number: int, model: Adc | PlainConverter | Dac, sck: int, now: float) -> None:
        assert sck == 0, f"SCK must be low when the {model.name} is selected, not high"
        timing, before = model.timing, self._cs_time[number]
        if before is not None:
            _least(f"CS of the {model.name} must be high", timing.deselect, now - before)
            _least(f"CS of the {model.name} must be high to end a conversion", timing.conversion, now - before)
        else:
            _least(f"the {model.name} must be left alone behind power-up", timing.power_up, now)
        self._cs_time[number], self._rise, self._fall, self._rises = now, None, None, 0
        model.select()
        self._drive(model.first(), timing)

    def _deselected(self, number: int, model: Adc | PlainConverter | Dac, sck: int, now: float) -> None:
        assert self._rises == model.clocks, (
            f"a frame of the {model.name} must have {model.clocks} clocks, not {self._rises}"
        )
        self._cs_time[number] = now
        self.frames[number] += 1
        self._drive(None, None)

    def _rose(self, model: Adc | PlainConverter | Dac, mosi: int, now: float) -> None:
        timing = model.timing
        if self._rise is None:
            begun = max(time for time in self._cs_time if time is not None)
            _least(f"CS of the {model.name} must be low before SCK rises", timing.select, now - begun)
        else:
            assert self._fall is not None
            frequency = 1e9 / (now - self._rise)
            assert frequency <= float(timing.clock) * 1.000001, (
                f"SCK of the {model.name} must have at most {float(timing.clock):,.0f} Hz, not {frequency:,.0f} Hz"
            )
            _least(f"SCK of the {model.name} must be low", timing.low, now - self._fall)
        if self._mosi_time is not None:
            _least(f"MOSI must be stable before SCK of the {model.name} rises", timing.setup, now - self._mosi_time)
        self._rise, self._model = now, model
        self._rises += 1
        model.rise(mosi)

    def _fell(self, model: Adc | PlainConverter | Dac, mosi: int, now: float) -> None:
        assert self._rise is not None
        _least(f"SCK of the {model.name} must be high", model.timing.high, now - self._rise)
        self._fall = now
        self._drive(model.fall(), model.timing)

    def _moved(self, now: float) -> None:
        if self._rise is not None and self._sck:
            _least(
                f"MOSI must be stable behind a rising SCK of the {self._model.name}",
                self._model.timing.hold,
                now - self._rise,
            )
        self._mosi_time = now

    def _drive(self, level: int | None, timing: Timing | None) -> None:
        """Change the output; until it is valid it is the other level."""
        self._change += 1
        final = PULLED_UP if level is None else level
        if timing is None or not timing.valid:
            self.dut.miso.value = final
            return
        self.dut.miso.value = 1 - final
        cocotb.start_soon(self._settle(final, self._change, round(float(timing.valid / ns) * 1000)))

    async def _settle(self, level: int, change: int, picoseconds: int) -> None:
        await Timer(picoseconds, "ps")
        if change == self._change:
            self.dut.miso.value = level


def _least(what: str, seconds: Any, measured: float) -> None:
    """Check a time: `seconds` exact, `measured` in ns."""
    least = float(seconds / ns)
    assert measured >= least - 0.01, f"{what} for {least:,.0f} ns, not for {measured:,.0f} ns"
