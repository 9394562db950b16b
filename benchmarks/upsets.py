"""Turns bits over in protected cores and records what becomes of it: `python -m benchmarks.upsets`.

Each run starts from reset with the same samples and turns over one bit, or two of one word, at a random clock. The
outcome goes to benchmarks/upsets.json and into the tables of docs/assurance.md. `--check` writes nothing: it runs a
share of the campaign and ends with status 1 if an upset in a memory, or in a register that holds a state, was silent.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from benchmarks import upset_simulation
from benchmarks.upset_simulation import Fate, Target
from rich.progress import Progress

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.core import design_core
from sosmith.gen.output.core_facts import StreamFacts
from sosmith.gen.specification.specification import load
from sosmith.hdl.plan.streams import dest_width, fields
from sosmith.sim.stream_packing import pack, random_order

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "upsets.json"
DOCUMENT = ROOT / "docs" / "assurance.md"
KINDS = {
    "memories": 10_000,
    "two bits of a word in memories": 2_000,
    "states in registers": 10_000,
    "other registers": 2_000,
}
"""What is hit, and how many runs each core gets."""

CHECKED = 300
"""The same with `--check`."""

CLOCKS = {"parallel": 1, "folded": 4, "serial": 16}
"""About how much longer a sample takes: a core gets fewer of them accordingly, so that all runs are about as long."""

SAMPLES = 192
TABLE = re.compile(r"(?<=<!-- upsets -->\n).*?(?=<!-- end of upsets -->)", re.DOTALL)


class Core(NamedTuple):
    """A core of the campaign."""

    example: str
    architecture: str
    channels: int
    protect: str
    reload: bool = False

    @property
    def title(self) -> str:
        """What it is, for a table."""
        channels = f", {self.channels} channels" if self.channels > 1 else ""
        return f"{self.example}, {self.architecture}{channels}{', reloadable' if self.reload else ''}"

    def built(self) -> Architecture:
        """Design it."""
        spec = load(ROOT / "examples" / f"{self.example}.toml")
        hardware = replace(
            spec.hardware,
            architecture=self.architecture,
            realization="df1_ef2",
            clock=Fraction(10**9),
            protect=self.protect,
            reload=self.reload,
        )
        return design_core(replace(spec, channels=self.channels, hardware=hardware)).architecture


CORES = tuple(
    Core(*core, protect, reload)
    for core, reload in (
        (("audio_lowpass", "folded", 1), False),
        (("flange_wear_bench", "folded", 4), True),
        (("flange_wear_locomotive", "serial", 3), False),
        (("audio_lowpass", "parallel", 1), False),
        (("audio_lowpass", "parallel", 4), True),
        (("flange_wear_bench", "parallel", 20), False),
    )
    for protect in ("detect", "correct")
)


def places_of(target: Target, kind: str) -> tuple[upset_simulation.Place, ...]:
    """Return the places of a kind; two bits are told only where one is corrected."""
    if kind == "memories":
        return target.memories
    if kind == "states in registers":
        return target.states
    if kind == "other registers":
        return target.registers
    # A bit that is there three times is outvoted if two of them are wrong.
    return tuple(place for place in target.memories if "reload_port" not in place.name) if target.corrects else ()


def built(core: Core, folder: Path) -> Target:
    """Build a core with random samples."""
    architecture = core.built()
    ports = architecture.datapath.inputs
    samples = max(4, SAMPLES // CLOCKS[core.architecture] // core.channels)
    chance = np.random.default_rng(1)
    codes = np.stack([chance.integers(p.lowest, p.highest + 1, (samples, core.channels)) for p in ports], axis=2)
    facts = StreamFacts(fields=fields(ports), dest_width=dest_width(core.channels))
    return upset_simulation.build(architecture, pack(codes, random_order(samples, core.channels, 1), facts), folder)


def campaign(cores: tuple[Core, ...], most: int | None) -> list[dict[str, Any]]:
    """Run the campaign, with at most so many runs of a kind; return a row for each core and kind of place."""
    wanted = {kind: runs if most is None else min(runs, most) for kind, runs in KINDS.items()}
    rows = []
    with Progress() as bar, tempfile.TemporaryDirectory() as folder:
        task = bar.add_task("upsets", total=len(cores) * sum(wanted.values()))
        for number, core in enumerate(cores):
            bar.update(task, description=f"{core.title}, {core.protect}")
            target = built(core, Path(folder) / str(number))
            for seed, (kind, runs) in enumerate(wanted.items()):
                places = places_of(target, kind)
                if places:
                    found = target.run(
                        places, runs, seed, double=kind.startswith("two"), progress=lambda *_: bar.advance(task)
                    )
                    bits = sum(place.depth * place.width for place in places)
                    rows.append(
                        {**core._asdict(), "kind": kind, "bits": bits, "runs": runs, **upset_simulation.counted(found)}
                    )
                else:
                    bar.advance(task, runs)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a table of Markdown."""
    fates = [fate.value for fate in Fate]
    lines = [f"| core | `protect` | hit | bits | runs | {' | '.join(fates)} |", "|---" * (5 + len(fates)) + "|"]
    for row in rows:
        core = Core(*(row[name] for name in Core._fields))
        counts = " | ".join(f"{row[fate]:,}" for fate in fates)
        lines.append(
            f"| {core.title} | {core.protect} | {row['kind']} | {row['bits']:,} | {row['runs']:,} | {counts} |"
        )
    return "".join(f"{line}\n" for line in lines)


def silent(rows: list[dict[str, Any]]) -> int:
    """Count the upsets that must not be silent, but were."""
    return sum(row["silent"] + row["lost"] for row in rows if row["kind"] != "other registers")


def main() -> None:
    """Run the campaign, and write or check."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.upsets", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; status 1 if an upset was silent")
    parser.add_argument("--runs", type=int, help=f"most runs for a core and a kind [default: all; {CHECKED} to check]")
    asked = parser.parse_args()
    rows = campaign(CORES, asked.runs or (CHECKED if asked.check else None))
    sys.stdout.write(table(rows))
    if not asked.check:
        RECORD.write_text("".join(["[\n", ",\n".join(json.dumps(row) for row in rows), "\n]\n"]), encoding="utf-8")
        text = DOCUMENT.read_text(encoding="utf-8")
        DOCUMENT.write_text(TABLE.sub(lambda _: table(rows), text), encoding="utf-8")
    sys.exit(1 if silent(rows) else 0)


if __name__ == "__main__":
    main()
