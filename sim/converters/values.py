"""What the converters of a virtual board give: the values of a trace, as they would read them."""

from __future__ import annotations

import numpy as np

from sosmith.model.arrays import Codes
from sosmith.model.converters.schedule import Schedule

_COMMANDS = {2: (3, 0), 4: (4, 1)}
"""By the inputs of an ADC: bits behind the start bit of a command, and clocks more to sample."""

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
        frames = reading.frames(codes[:: schedule.intervals[number], :, number])
        for select in range(selects):
            mine = frames[:, select * converter.inputs : (select + 1) * converter.inputs]
            unused = converter.inputs - mine.shape[1]
            mine = np.pad(mine, ((0, 0), (0, unused)))
            wanted, wait = (0, 0) if converter.step is not None else _COMMANDS[converter.inputs]
            lines.append(f"{wanted} {wait} {converter.inputs} {len(mine)}")
            lines += [" ".join(map(str, row)) for row in mine.tolist()]
    return "\n".join(lines) + "\n"


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
