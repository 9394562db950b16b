"""Status flags of a sample, one bit each, that go with its output code."""

from __future__ import annotations

from enum import IntEnum

STATUS_BITS = 8
"""Width of ``tuser``, a whole byte; bits without a flag are 0."""


class Flag(IntEnum):
    """Number of the bit of each flag."""

    INPUT_AT_RAIL = 0
    OUTSIDE_CALIBRATION = 1
    OUTPUT_SATURATED = 2
    WEAR_WARNING = 3
    WEAR_CRITICAL = 4
    SETTLING = 5
    FAULT = 6

    @property
    def meaning(self) -> str:
        """The meaning of the flag, in a sentence."""
        return _MEANINGS[self]


_MEANINGS = {
    Flag.INPUT_AT_RAIL: "an input code is the lowest or the highest of its range",
    Flag.OUTSIDE_CALIBRATION: "an input is outside the range of the calibration's measurements",
    Flag.OUTPUT_SATURATED: "the output was limited to its range",
    Flag.WEAR_WARNING: "the wear has reached the warning",
    Flag.WEAR_CRITICAL: "the wear has reached its limit, or the end of the sensor's range",
    Flag.SETTLING: "the filter started from zero and has not settled yet; wear is not judged",
    Flag.FAULT: "a bit in the hardware was found wrong and could not be corrected, for this sample or an earlier one",
}
