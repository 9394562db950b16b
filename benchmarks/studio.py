"""Measures how fast the studio leads to a proven design, for docs/speed.md: `python -m benchmarks.studio`.

Each example is opened with `sosmith studio`. As soon as its response is there, the cutoff is changed, as a page does
it, and the proof of the changed design is waited for; then it is changed once more. Times are of a clock on the wall,
for the first proof from the start of the command, so the machine must have nothing else to do; the least of several
runs counts. Processor time is that of all processes of the studio when the first proof is there. The figures are
recorded in benchmarks/studio.json; `--document` only writes the section of the document from that record again.
`--check` writes nothing, and fails if an example takes longer than the goal.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.speed_page import ROOT, Benchmark
from websockets.sync.client import ClientConnection, connect

import sosmith

EXAMPLES = ("audio_lowpass", "flange_wear_bench", "flange_wear_locomotive")
FACTORS = (1.07, 1.13)
"""The cutoff beside that of the example."""
GOAL = 3.0
"""Seconds from opening to a proven design of a changed cutoff, on two cores."""
PATIENCE = 300.0
"""Seconds to wait for what must come."""


@dataclass(frozen=True)
class Times:
    """How long an example takes, in s.

    Attributes
    ----------
    example : str
        Name of the specification.
    response : float
        From the start of the command until the response is shown.
    proven : float
        From the start of the command until the design with the changed cutoff is proven.
    again : float
        From a second change until its design is proven.
    processor : float
        Processor time of all processes of the studio until the first proof was done.
    """

    example: str
    response: float
    proven: float
    again: float
    processor: float


def processor_seconds(pid: int) -> float:
    """Processor time so far of a process and all that descend from it."""
    parents: dict[int, int] = {}
    ticks: dict[int, int] = {}
    for place in Path("/proc").glob("[0-9]*"):
        try:
            fields = (place / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended meanwhile
        parents[int(place.name)], ticks[int(place.name)] = int(fields[1]), int(fields[11]) + int(fields[12])
    family = {pid}
    while more := {each for each, parent in parents.items() if parent in family} - family:
        family |= more
    return sum(ticks.get(each, 0) for each in family) / os.sysconf("SC_CLK_TCK")


def change(page: ClientConnection, cutoff: float) -> None:
    """Change the cutoff, as the page does, and wait until the changed design is proven."""
    page.send(json.dumps({"do": "change", "changes": {"filter.cutoff": cutoff}, "n": 1}))
    seen: dict[str, Any] = {}
    while seen.get("preview", {}).get("spec", {}).get("filter", {}).get("cutoff") != cutoff:
        seen |= json.loads(page.recv(PATIENCE))
    while seen["proof"]["state"] != "proven":
        seen |= json.loads(page.recv(PATIENCE))


def run(example: str) -> Times:
    """Measure one example once."""
    path = ROOT / "examples" / f"{example}.toml"
    cutoff = sosmith.Specification.load(path).as_dict()["filter"]["cutoff"]
    start = time.monotonic()
    command = [sys.executable, "-m", "sosmith.cli", "studio", str(path), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            assert process.stdout is not None
            with connect(process.stdout.readline().strip().replace("http", "ws") + "live") as page:
                seen: dict[str, Any] = {}
                while "stages" not in seen.get("preview", {}):
                    seen |= json.loads(page.recv(PATIENCE))
                response = time.monotonic() - start
                change(page, round(cutoff * FACTORS[0], 6))
                proven, processor = time.monotonic() - start, processor_seconds(process.pid)
                begun = time.monotonic()
                change(page, round(cutoff * FACTORS[1], 6))
                again = time.monotonic() - begun
        finally:
            process.terminate()
    return Times(example, *(round(value, 2) for value in (response, proven, again, processor)))


def measure(repeats: int) -> list[Times]:
    """Measure every example; of each figure the least of several runs counts."""
    rows = []
    for example in EXAMPLES:
        runs = [run(example) for _ in range(repeats)]
        names = ("response", "proven", "again", "processor")
        rows.append(Times(example, *(min(getattr(each, name) for each in runs) for name in names)))
    return rows


def table(rows: list[Times]) -> str:
    """Return the times as a table in Markdown."""
    lines = [
        "| specification | response shown, s | changed cutoff proven, s | changed again, s | processor time, s |",
        "|---|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            f"| {row.example} | {row.response:.1f} | {row.proven:.1f} | {row.again:.1f} | {row.processor:.1f} |"
        )
    return "\n".join(lines) + "\n"


def section(rows: list[Times]) -> str:
    """Return the section of the document."""
    slow = [row.example for row in rows if row.proven > GOAL]
    kept = f"not reached for {' and '.join(slow)}" if slow else "reached for all of them"
    return f"""
## The studio

Written by `python -m benchmarks.studio` from the figures that it records in `benchmarks/studio.json`. `--check`
measures again and fails if an example takes longer than {GOAL:g} s.

`sosmith studio` opens an example; as soon as its response is shown, the cutoff is changed, and then once more. Seconds
of a clock on the wall: the first two from the start of the command, the third from the second change. The processor
time is that of all processes until the first proof, partly on two cores at once. The goal, {GOAL:g} s from opening to a
proven design of a changed cutoff on two cores, is {kept} here.

{table(rows)}
"""


def losses(old: list[Times], new: list[Times]) -> list[str]:
    """Say which examples take longer than the goal."""
    return [
        f"{row.example}: a changed cutoff must be proven within {GOAL:g} s of opening, not {row.proven:.1f} s"
        for row in new
        if row.proven > GOAL
    ]


BENCHMARK = Benchmark(name="studio", row=Times, measure=measure, section=section, tables=table, losses=losses)

if __name__ == "__main__":
    BENCHMARK.main(__doc__, repeats=3)
