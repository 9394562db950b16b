"""What one run of a chain gave."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.model.arrays import Codes, Values


@dataclass(frozen=True, kw_only=True)
class ChainRun:
    """The results of one run of a chain.

    Attributes
    ----------
    codes : int64 array, shape (samples, channels, inputs)
        What went in.
    received, expected : int64 array, shape (results, channels)
        What came out, and what the integer models give.
    mismatches : int
        Results of which a code or a flag differs.
    golden : float array, shape (results, channels)
        The exact results in double precision, in the unit of the output.
    cycles : int
        Clocks from the end of reset to the last result.
    simulator : str
        Its name.
    tools : dict of str to str
        Versions by name.
    seed : int
        Of the handshakes.
    cycles_per_second, wall_seconds : float
        Speed, and how long all of it took.
    scenario : str
        Name of the trace.
    """

    codes: Codes
    received: Codes
    expected: Codes
    mismatches: int
    golden: Values
    cycles: int
    simulator: str
    tools: dict[str, str]
    seed: int
    cycles_per_second: float
    wall_seconds: float
    scenario: str = ""
