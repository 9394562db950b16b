"""Designs and verifies random specifications, for docs/speed.md: `python -m benchmarks.random_designs`.

Orders from 1 to 8, all families and kinds, 4 to 24 bits, edges from a thousandth of the sample rate on. Times are
processor time; specifications that cannot be met count with the time until they are refused. The figures are recorded
in benchmarks/random_designs.json, seed by seed: `--first` goes on where it was stopped. `--document` only writes the
section of the document from that record again. Fails if a design takes longer than it may, or its certificate is not
verified, or more slowly than it was designed.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

from benchmarks.design import designed, specification
from benchmarks.speed_page import ROOT, renew

from sosmith.gen.specification.choices import FAMILIES, KINDS
from sosmith.gen.specification.specification import from_text
from sosmith.model.errors import ShortfallError

RECORD = ROOT / "benchmarks" / "random_designs.json"

COUNT = 200
"""Specifications that are measured."""
LIMIT = 30.0
"""Seconds that a design may take."""
LEAST = 0.5
"""Seconds of a design below which its verification may take longer."""
_LOSSES = {
    "chebyshev1": "passband_loss = 0.5",
    "chebyshev2": "stopband_loss = 50.0",
    "elliptic": "passband_loss = 0.5\nstopband_loss = 50.0",
}


def random_specification(seed: int, *, max_order: int = 8, lowest: float = -3.0) -> tuple[str, str]:
    """Return the name of a specification and its TOML; edges from 10 to the power of `lowest` times the sample rate."""
    rng = random.Random(seed)
    family, kind = rng.choice(FAMILIES), rng.choice(KINDS)
    band = kind in {"bandpass", "bandstop"}
    low = 10 ** rng.uniform(lowest, -0.8 if band else -0.35)
    edges = [low, low * rng.uniform(1.3, 2.8)] if band else [low]
    cutoff = ", ".join(f"{edge:.6f}" for edge in edges)
    order, bits_in, bits_out = rng.randint(1, max_order), rng.randint(4, 24), rng.randint(4, 24)
    text = specification(
        kind, order, cutoff, family=family, bits_in=bits_in, bits_out=bits_out, losses=_LOSSES.get(family, "")
    )
    return f"{family} {kind}, order {order}, {cutoff}, {bits_in} to {bits_out} bits", text


@dataclass(frozen=True)
class Design:
    """What came of a specification.

    Attributes
    ----------
    seed : int
        What it was drawn with.
    name : str
        What it asks for.
    realization : str
        The one chosen, or why there is none.
    design, verification : float
        Seconds of processor time of the design with its certificate, and of its verification.
    """

    seed: int
    name: str
    realization: str
    design: float
    verification: float

    @property
    def refused(self) -> bool:
        """Whether it cannot be met."""
        return self.realization.startswith("refused")

    @property
    def faults(self) -> list[str]:
        """What takes longer than it may."""
        found = []
        if self.design >= LIMIT:
            found.append(f"{self.name}: the design must take less than {LIMIT:g} s, not {self.design:.1f} s")
        if self.verification >= max(self.design, LEAST):
            found.append(
                f"{self.name}: verification must take less than {self.design:.2f} s, not {self.verification:.2f} s"
            )
        return found


def measured(seed: int) -> Design:
    """Design and verify a specification."""
    name, text = random_specification(seed)
    from_text(text, Path("random.toml"))  # so that the first one does not count what is imported
    start = time.process_time()
    try:
        realization, design, verification = designed(text)
    except ShortfallError as error:
        if "certificate" in str(error):
            raise
        return Design(seed, name, f"refused ({error})", time.process_time() - start, 0.0)
    return Design(seed, name, realization, design, verification)


def recorded() -> list[Design]:
    """Read the record."""
    if not RECORD.exists():
        return []
    return [Design(**row) for row in json.loads(RECORD.read_text(encoding="utf-8"))]


def section(rows: list[Design]) -> str:
    """Return the section of the document."""
    made = [row for row in rows if not row.refused]
    slowest = max(rows, key=lambda row: row.design)
    latest = max(made, key=lambda row: row.verification / max(row.design, LEAST))
    late = [fault for row in rows for fault in row.faults]
    seeds = {row.seed for row in rows}
    missing = _ranges([seed for seed in range(1, max(COUNT, *seeds) + 1) if seed not in seeds])
    share = f"{latest.verification / max(latest.design, LEAST):.2f} ({latest.name})"
    return f"""
### Random specifications

Written by `python -m benchmarks.random_designs` from `benchmarks/random_designs.json`. Orders 1 to 8, all families and
kinds, edges from a thousandth of the sample rate on, inputs and outputs of 4 to 24 bits; seconds of processor time, of
one run each.

| | |
|---|---|
| specifications | {len(rows)} |
| seeds up to {COUNT} not measured yet, or stopped | {missing or "none"} |
| refused, as no realization meets them | {len(rows) - len(made)} |
| half of the designs take less than | {median(row.design for row in rows):.1f} s |
| all but one in twenty take less than | {sorted(row.design for row in rows)[-1 - len(rows) // 20]:.1f} s |
| slowest design | {slowest.design:.1f} s ({slowest.name}) |
| slowest verification | {max(row.verification for row in rows):.1f} s |
| verification beside a design of at least {LEAST:g} s, at most | {share} |
| above {LIMIT:g} s, or verified more slowly than designed | {len(late)} |

"""


def _ranges(numbers: list[int]) -> str:
    """Return ascending numbers as text: ``1, 3 to 5``."""
    ends: list[list[int]] = []
    for number in numbers:
        if ends and ends[-1][1] == number - 1:
            ends[-1][1] = number
        else:
            ends.append([number, number])
    return ", ".join(f"{low} to {high}" if low < high else f"{low}" for low, high in ends)


def main() -> None:
    """Measure all, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=COUNT, help="number of specifications")
    parser.add_argument("--first", type=int, default=1, help="the first one's seed")
    parser.add_argument("--document", action="store_true", help="only write the document from the record")
    options = parser.parse_args()
    rows = {row.seed: row for row in recorded()}
    for seed in range(options.first, options.first + (0 if options.document else options.count)):
        row = rows[seed] = measured(seed)
        times = f"{row.design:.2f} s, verified in {row.verification:.2f} s"
        print(f"{row.name}: {row.realization}, {times}", flush=True)
        every = [asdict(rows[seed]) for seed in sorted(rows)]
        RECORD.write_text(json.dumps(every, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    made = [rows[seed] for seed in sorted(rows)]
    renew("random_designs", section(made))
    if faults := [fault for row in made for fault in row.faults]:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
