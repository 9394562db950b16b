"""Models of audio converters on an I2S under cocotb; they fail the test where a data sheet is not kept to.

::

    mclk, bclk, lrck --> I2sBus: checks the times --> din n    wrong until the output is valid
    dout n ------------> words of the DACs

Figures of timing are those of `sosmith.model.converters.i2s_converter`, which names the data sheets. What the models
do at which edge is written here once more, from the data sheets, and shares nothing with the hardware.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

import cocotb
from cocotb.triggers import First, Timer, ValueChange
from cocotb.utils import get_sim_time

from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.converters.spi_converter import ns

_WIDTH = 24
_MCLK_FRAMES = 2
"""Frames for which MCLK is watched."""


class I2sBus:
    """The I2S of a front-end, with an ADC at each bit of ``din`` and a DAC at each of ``dout``.

    Parameters
    ----------
    dut : handle
        With the ports ``mclk``, ``bclk`` and ``lrck``, and ``din`` and ``dout`` as there are converters.
    adcs, dacs : sequence of I2sConverter
        The converters.
    words : sequence of iterator
        For each ADC, the left and the right word of each frame; the last ones stay.
    """

    def __init__(
        self,
        dut: Any,
        adcs: Sequence[I2sConverter],
        dacs: Sequence[I2sConverter],
        words: Sequence[Iterator[tuple[int, int]]],
    ) -> None:
        self.dut, self.adcs, self.dacs, self._words = dut, adcs, dacs, words
        self.heard: list[list[tuple[int, int]]] = [[] for _ in dacs]
        """Left and right words of each complete frame that each DAC got."""
        self.frames = 0
        """Frames that have begun."""
        self._levels = {"mclk": 0, "bclk": 0, "lrck": 1, "dout": 0}
        self._changed: dict[str, float | None] = dict.fromkeys(self._levels)
        self._rise: float | None = None
        self._fall: float | None = None
        self._place, self._slot, self._bits, self._taken_lrck = 0, 0, 0, 1
        self._sending = [(0, 0)] * len(adcs)
        self._received = [[0, 0] for _ in dacs]
        self._mclks, self._frame_began = 0, 0.0
        self._mclk_rise: float | None = None
        self._mclk_high = 0.0
        self._change = 0
        if adcs:
            dut.din.value = 0

    def start(self) -> None:
        """Begin to watch."""
        cocotb.start_soon(self._watch())

    async def _watch(self) -> None:
        names = ["mclk", "bclk", "lrck", *(["dout"] if self.dacs else [])]
        while True:
            awaited = names if self.frames <= _MCLK_FRAMES else names[1:]
            await First(*(ValueChange(getattr(self.dut, name)) for name in awaited))
            await Timer(1, "ps")  # all that changes at the same clock has done so
            levels = {name: getattr(self.dut, name).value for name in names}
            if all(level.is_resolvable for level in levels.values()):
                self._step({name: int(level) for name, level in levels.items()}, float(get_sim_time("ns")))

    def _step(self, levels: dict[str, int], now: float) -> None:
        before, self._levels = self._levels, {"dout": 0, **levels}
        changed = {name for name, level in self._levels.items() if level != before[name]}
        if "mclk" in changed and self.frames <= _MCLK_FRAMES:
            self._mclk(now)
        if "lrck" in changed:
            self._lrck(now)
        if "dout" in changed and self._rise is not None:
            for dac in self.dacs:
                _least(f"data of the {dac.title} must be stable behind BCLK", dac.timing.hold, now - self._rise)
        for name in changed:
            self._changed[name] = now
        if "bclk" in changed:
            (self._bclk_rises if self._levels["bclk"] else self._bclk_falls)(now, "lrck" in changed)

    def _mclk(self, now: float) -> None:
        if self._levels["mclk"]:
            if self._mclk_rise is not None:
                share = self._mclk_high / (now - self._mclk_rise)
                assert 0.45 <= share <= 0.55, f"MCLK must be high for 45 to 55 % of the time, not {100 * share:.1f} %"
            self._mclk_rise = now
            self._mclks += 1
        elif self._mclk_rise is not None:
            self._mclk_high = now - self._mclk_rise

    def _lrck(self, now: float) -> None:
        for device in (*self.adcs, *self.dacs):
            if self._rise is not None:
                _least(f"LRCK of the {device.title} must be stable behind BCLK", device.timing.after, now - self._rise)
        if self._levels["lrck"]:
            return
        if self.frames:
            rate = Fraction(10**9) / Fraction(now - self._frame_began).limit_denominator(1000)
            for device in (*self.adcs, *self.dacs) if self.frames <= _MCLK_FRAMES else ():
                assert device.allows(self._mclks, rate), (
                    f"MCLK of the {device.title} must be one that it allows at {float(rate):,.0f} Hz, not "
                    f"{self._mclks} times that"
                )
            assert self._bits == 64, f"a frame must have 64 periods of BCLK, not {self._bits}"
        self._sending = [next(words, last) for words, last in zip(self._words, self._sending, strict=True)]
        self._mclks, self._bits, self._frame_began = 0, 0, now
        self.frames += 1

    def _bclk_rises(self, now: float, _: bool) -> None:
        self._pulse("low", self._fall, now)
        for device in (*self.adcs, *self.dacs):
            timing = device.timing
            if (moved := self._changed["lrck"]) is not None:
                _least(f"LRCK of the {device.title} must be stable before BCLK rises", timing.before, now - moved)
            if device.is_dac and (moved := self._changed["dout"]) is not None:
                _least(f"data of the {device.title} must be stable before BCLK rises", timing.setup, now - moved)
        self._rise = now
        self._bits += 1
        lrck = self._levels["lrck"]
        self._slot = 0 if lrck != self._taken_lrck else self._slot + 1
        self._taken_lrck = lrck
        if not 1 <= self._slot <= _WIDTH or not self.frames:
            return
        for number, words in enumerate(self._received):
            bit = self._levels["dout"] >> number & 1
            words[lrck] = (words[lrck] << 1 | bit) & (1 << _WIDTH) - 1
            if lrck and self._slot == _WIDTH:
                self.heard[number].append((_signed(words[0]), _signed(words[1])))

    def _bclk_falls(self, now: float, new_word: bool) -> None:
        self._pulse("high", self._rise, now)
        self._fall = now
        self._place = 0 if new_word else self._place + 1
        bits = 0
        for number, words in enumerate(self._sending):
            word = words[self._levels["lrck"]]
            if 1 <= self._place <= _WIDTH:
                bits |= (word >> _WIDTH - self._place & 1) << number
        self._drive(bits)

    def _pulse(self, level: str, since: float | None, now: float) -> None:
        if since is None:
            return
        for device in (*self.adcs, *self.dacs):
            least = device.timing.pulse
            if device.timing.pulse_mclk and self._mclk_high:
                least = max(least, device.timing.pulse_mclk * Fraction(2 * self._mclk_high) * ns)
            _least(f"BCLK of the {device.title} must be {level}", least, now - since)

    def _drive(self, bits: int) -> None:
        """Change the output; until it is valid it is the other level."""
        if not self.adcs:
            return
        self._change += 1
        self.dut.din.value = bits ^ (1 << len(self.adcs)) - 1
        valid = max(adc.timing.valid for adc in self.adcs)
        cocotb.start_soon(self._settle(bits, self._change, round(float(valid / ns) * 1000)))

    async def _settle(self, bits: int, change: int, picoseconds: int) -> None:
        await Timer(picoseconds, "ps")
        if change == self._change:
            self.dut.din.value = bits


def _signed(word: int) -> int:
    return word - (1 << _WIDTH) if word >> (_WIDTH - 1) else word


def _least(what: str, seconds: Any, measured: float) -> None:
    """Check a time: `seconds` exact, `measured` in ns."""
    least = float(seconds / ns)
    assert measured >= least - 0.01, f"{what} for {least:,.0f} ns, not for {measured:,.0f} ns"
