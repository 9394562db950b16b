"""Designs and verifies random specifications, and tells the slowest: `python -m benchmarks.random_designs`.

Orders from 1 to 8, all families and kinds, 4 to 24 bits, edges from a thousandth of the sample rate on. Times are
processor time; specifications that cannot be met count with the time until they are refused. Fails if a design takes
longer than it may, or its certificate is not verified, or more slowly than it was designed.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from pathlib import Path

from benchmarks.design import designed, specification

from sosmith.gen.specification.choices import FAMILIES, KINDS
from sosmith.gen.specification.specification import from_text
from sosmith.model.errors import ShortfallError

LIMIT = 30.0
"""Seconds that a design may take."""
LEAST = 0.5
"""Seconds of a design below which its verification may take longer."""
_LOSSES = {
    "chebyshev1": "passband_loss = 0.5",
    "chebyshev2": "stopband_loss = 50.0",
    "elliptic": "passband_loss = 0.5\nstopband_loss = 50.0",
}


def random_specification(seed: int) -> tuple[str, str]:
    """Return the name of a specification and its TOML."""
    rng = random.Random(seed)
    family, kind = rng.choice(FAMILIES), rng.choice(KINDS)
    band = kind in {"bandpass", "bandstop"}
    low = 10 ** rng.uniform(-3, -0.8 if band else -0.35)
    edges = [low, low * rng.uniform(1.3, 2.8)] if band else [low]
    cutoff = ", ".join(f"{edge:.6f}" for edge in edges)
    order, bits_in, bits_out = rng.randint(1, 8), rng.randint(4, 24), rng.randint(4, 24)
    text = specification(
        kind, order, cutoff, family=family, bits_in=bits_in, bits_out=bits_out, losses=_LOSSES.get(family, "")
    )
    return f"{seed}: {family} {kind}, order {order}, {cutoff}, {bits_in} to {bits_out} bits", text


def measured(text: str) -> tuple[str, float, float]:
    """Design and verify; return the realization or why there is none, and the seconds of both."""
    from_text(text, Path("random.toml"))  # so that the first one does not count what is imported
    start = time.process_time()
    try:
        return designed(text)
    except ShortfallError as error:
        if "certificate" in str(error):
            raise
        return f"refused ({error})", time.process_time() - start, 0.0


def main() -> None:
    """Measure all, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200, help="number of specifications")
    parser.add_argument("--first", type=int, default=1, help="the first one's seed")
    options = parser.parse_args()
    faults, slowest = [], (0.0, "")
    for seed in range(options.first, options.first + options.count):
        name, text = random_specification(seed)
        realization, design, verification = measured(text)
        print(f"{name}: {realization}, {design:.2f} s, verified in {verification:.2f} s", flush=True)
        slowest = max(slowest, (design, name))
        if design >= LIMIT:
            faults.append(f"{name}: the design must take less than {LIMIT:g} s, not {design:.1f} s")
        if verification >= max(design, LEAST):
            faults.append(f"{name}: verification must take less than {design:.2f} s, not {verification:.2f} s")
    print(f"slowest of {options.count}: {slowest[1]}, {slowest[0]:.1f} s")
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
