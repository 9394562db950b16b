"""What the converters of a virtual board give: the values of a trace, as they would read them."""

from __future__ import annotations

import numpy as np

from sosmith.model.arrays import Codes
from sosmith.model.converters.i2s_converter import MAX_WIDTH, I2sConverter
from sosmith.model.converters.schedule import Schedule

_COMMANDS = {2: (3, 0, 13), 4: (4, 1, 13)}
"""By the inputs of an ADC: bits behind the start bit of a command, clocks more to sample, and bits of the answer."""

MAX_SELECTS = 64
"""Most chip selects of a virtual board."""


def values_text(schedule: Schedule, codes: Codes) -> str:
    """Return the file that ``pins.h`` reads.

    Parameters
    ----------
    schedule : Schedule
        When the front-end reads which converter.
    codes : ndarray of int, shape (samples, channels, inputs)
        Codes of the inputs; the converters read the nearest values below.
    """
    lines = [str(sum(schedule.selects))]
    for number, (reading, selects) in enumerate(zip(schedule.readings, schedule.selects, strict=True)):
        converter = reading.converter
        if isinstance(converter, I2sConverter):
            continue
        frames = reading.frames(codes[:: schedule.intervals[number], :, number])
        for select in range(selects):
            mine = frames[:, select * converter.inputs : (select + 1) * converter.inputs]
            unused = converter.inputs - mine.shape[1]
            mine = np.pad(mine, ((0, 0), (0, unused)))
            wanted, wait, bits = _COMMANDS[converter.inputs] if converter.command_bits else (0, 0, converter.bits)
            lines.append(f"{wanted} {wait} {bits} {converter.inputs} {len(mine)}")
            lines += [" ".join(map(str, row)) for row in mine.tolist()]
    lines += [*_audio_lines(schedule, codes), str(schedule.dac_selects)]
    return "\n".join(lines) + "\n"


def _audio_lines(schedule: Schedule, codes: Codes) -> list[str]:
    """Return the words of the ADCs on the I2S, a frame in each line."""
    words = []
    for number, (reading, lines) in enumerate(zip(schedule.readings, schedule.lines_in, strict=True)):
        if lines:
            frames = reading.frames(codes[:, :, number]) << MAX_WIDTH - reading.converter.width
            words.append(np.pad(frames, ((0, 0), (0, 2 * lines - schedule.channels))))
    rows = np.concatenate(words, axis=1) if words else np.zeros((0, 0), np.int64)
    first = f"{sum(schedule.lines_in)} {schedule.lines_out} {len(rows)}"
    return [first, *(" ".join(map(str, row)) for row in rows.tolist())]


def words_of(text: str, schedule: Schedule) -> Codes:
    """Return the words that DACs got, from the file that ``pins.h`` writes.

    Parameters
    ----------
    text : str
        The file.
    schedule : Schedule
        When the front-end reads which converter.

    Returns
    -------
    ndarray of int, shape (frames or samples, channels)
        The words.
    """
    rows = np.array([line.split() for line in text.splitlines()], np.int64)
    if schedule.dac_selects:
        return rows
    words = rows.reshape(len(rows), 2 * schedule.lines_out)[:, : schedule.channels]
    return words - (words >> (MAX_WIDTH - 1) << MAX_WIDTH)


def fed_codes(schedule: Schedule, codes: Codes) -> Codes:
    """Return the codes that the front-end feeds to the core, of the same shape, when all readings are good.

    Parameters are those of `values_text`.
    """
    fed = np.empty_like(codes)
    for number, reading in enumerate(schedule.readings):
        repeats = schedule.intervals[number]
        for channel in range(schedule.channels):
            read, _ = reading.held(reading.frames(codes[::repeats, channel, number]).tolist())
            fed[:, channel, number] = np.repeat(read, repeats)[: len(codes)]
    return fed
