"""One run of a chain: codes in and out, and what the integer models and the exact filters say of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.golden import golden_chain
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
        Clocks from the end of reset to the last result; 0 without hardware.
    simulator : str
        Its name; empty without hardware.
    tools : dict of str to str
        Versions by name.
    seed : int
        Of the handshakes.
    cycles_per_second, wall_seconds : float
        Speed, and how long all of it took.
    """

    codes: Codes
    received: Codes
    expected: Codes
    mismatches: int
    golden: Values
    cycles: int = 0
    simulator: str = ""
    tools: dict[str, str] = field(default_factory=dict)
    seed: int = 0
    cycles_per_second: float = 0.0
    wall_seconds: float = 0.0


def run_of(
    design: ChainDesign,
    codes: Codes,
    received: Codes | None = None,
    status: npt.NDArray[np.uint8] | None = None,
) -> ChainRun:
    """Compare what hardware computed with the integer models and the exact result.

    Parameters
    ----------
    design : ChainDesign
    codes : int64 array, shape (samples, channels, inputs)
    received, status : arrays, shape (results, channels)
        Codes and flags that came out; by default those of the integer models themselves, without hardware.
    """
    expected, flags = design.compute_with_status(codes)
    if received is None or status is None:
        received, status = expected, flags
    return ChainRun(
        codes=codes,
        received=received,
        expected=expected,
        mismatches=int(np.count_nonzero((received != expected) | (status != flags))),
        golden=golden_chain(design, codes),
    )
