"""Quantities of hardware that an estimate is made from, such as bits of sums and of choices, known before synthesis.

Each is counted in LUT4 where one LUT4 does the work of a bit, so that the factors of a fit are about 1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port

Quantities = Counter[str]
"""Amount of each quantity by its name."""

LUT_INPUTS = 4
"""Inputs of a LUT4."""

_COLUMN = 3
"""Check bits that most data bits belong to, where a wrong bit can be corrected."""


def tree(inputs: int) -> int:
    """Return the LUT4 that join so many signals into one: each takes four and leaves one."""
    return -(-max(0, inputs - 1) // (LUT_INPUTS - 1))


def check_bits(bits: int, protect: str) -> int:
    """Return the check bits of a word: parity, or enough for a column of each bit with an odd number of ones."""
    if protect == "none":
        return 0
    checks = 3 if protect == "correct" else 1
    while protect == "correct" and 2 ** (checks - 1) - checks < bits:
        checks += 1
    return checks


def of_check_bits(bits: int, protect: str, *, written: bool = True) -> Quantities:
    """Count what makes check bits where a word is written, compares them where it is read, and corrects a bit."""
    checks = check_bits(bits, protect)
    if not checks:
        return Counter()
    joined = bits if checks == 1 else _COLUMN * bits // checks
    made: Quantities = Counter({"parities": checks * ((1 + written) * tree(joined) + 1)})
    return made + Counter({"corrected": bits * (1 + tree(checks)) if checks > 1 else 0})


def of_kept(bits: int) -> Quantities:
    """Count what corrects a wrong bit in what a core keeps between samples; the registers of check bits alone."""
    return of_check_bits(bits, "correct") + Counter({"registers": check_bits(bits, "correct")})


def parity(code: int) -> int:
    """Return the parity of a word."""
    return code.bit_count() % 2


def of_inputs(ports: Sequence[Port], calibrated: Sequence[tuple[int, int]]) -> Quantities:
    """Count what finds codes at the ends of their ranges, and outside a calibration where its range is known."""
    made: Quantities = Counter()
    for port in ports:
        made["logic"] += 2 * tree(port.bits)
    for port, (low, high) in zip(ports, calibrated, strict=False):
        made["compared"] += port.bits * ((low > port.lowest) + (high < port.highest))
    return made


def of_output_buffer(bits: int) -> Quantities:
    """Count the buffer of two words beside a pipeline."""
    return Counter({"chosen": bits, "registers": 2 * bits + 2})


def flags_of(datapath: Datapath) -> int:
    """Return the number of flags of a result: two of inputs, one of its limits, those of wear, one while it settles."""
    return 3 + 2 * bool(datapath.wear) + datapath.settles
