"""Upsets: turns bits over in the memories and registers of a simulated core, and tells what became of them.

::

    core ----> core.sv --> Verilator --> core <-- samples, and for each run: place, element, bit, clock
                             ^            |
          memories, registers: public     +--> beats --> the same? flagged? --> Upset

Each run starts from reset, with the same samples and the same random handshakes; only the upset differs. The first run
has none.
"""

from __future__ import annotations

import random
import re
import subprocess
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.model.errors import ToolError
from sosmith.sim.beats import Beats
from sosmith.sim.simulators import find_simulator
from sosmith.sim.verilated_model import Builder

_MAIN = Path(__file__).parent / "upset_simulation.cpp"
_MODULE = re.compile(r"^module (\S+?)\s*\((.*?)^endmodule", re.MULTILINE | re.DOTALL)
_MEMORY = re.compile(r"^\s*reg (?:\[\S+\] )?(\S+)\s+\[\d+:\d+\];", re.MULTILINE)
_LOADED = re.compile(r"^\s*(?:if \(.*?\) |else )*(\S+?)(?:\s*\[[^]]*\])?\s*<=", re.MULTILINE)
_SYNDROME = re.compile(r"^\s*wire (?:\[\S+\] )?((?!(?:any|not|odd)_)\S+_syndrome) ?;", re.MULTILINE)
"""Signals, and not what is made of them, that are not 0 when a word was read that has a wrong bit."""


class Fate(StrEnum):
    """What became of an upset."""

    MASKED = "masked"  # every beat is as without it, and nobody noticed
    CORRECTED = "corrected"  # the same, though the wrong bit was read
    DETECTED = "detected"  # the flag rose no later than with the first beat that differs, and stayed
    SILENT = "silent"  # a beat differs that is not flagged
    LOST = "lost"  # beats are missing


class Place(NamedTuple):
    """A memory or a register: its name, the number of its words, and their width in bits."""

    name: str
    depth: int
    width: int


class Hit(NamedTuple):
    """Where and when an upset hits.

    Attributes
    ----------
    place : Place
        The memory or register.
    element, bit : int
        Its word, and the bit of it.
    other : int
        Another bit of the same word that is hit; -1 for none.
    clock : int
        Clock since the reset; -1 for never.
    later : int
        Clocks from then until the other bit is hit.
    """

    place: Place
    element: int
    bit: int
    other: int
    clock: int
    later: int = 0


class Upset(NamedTuple):
    """A run with an upset.

    Attributes
    ----------
    hit : Hit
        What was hit.
    fate : Fate
        What became of it.
    wrong, flagged : int or None
        First beat that differs from the run without an upset, and first one with the flag `fault`.
    """

    hit: Hit
    fate: Fate
    wrong: int | None
    flagged: int | None


@dataclass(frozen=True)
class Target:
    """A built core, in which bits can be turned over.

    Attributes
    ----------
    program, samples : Path
        The simulation, and the file of its input beats.
    beats : int
        Number of beats of results.
    places : tuple of Place
        Its memories and registers, by name.
    numbers : dict of str to int
        Numbers of the places in the simulation, by name.
    clocks : int
        Clocks of a run without an upset.
    corrects : bool
        Whether the core corrects wrong bits in its memories.
    """

    program: Path
    samples: Path
    beats: int
    places: tuple[Place, ...]
    numbers: dict[str, int]
    clocks: int
    corrects: bool

    @property
    def memories(self) -> tuple[Place, ...]:
        """The places with several words, and the registers in which the states of two channels are."""
        return tuple(place for place in self.places if place.depth > 1 or re.search(r"_word[01]$", place.name))

    @property
    def states(self) -> tuple[Place, ...]:
        """The registers that have a parity bit, and these bits, and what is kept with check bits."""
        names = {place.name for place in self.places}
        bare = [place for place in self.places if {f"{place.name}_parity", f"{place.name}_parity0"} & names]
        return tuple(bare) + tuple(place for place in self.places if re.search(r"_parity\d*$|\.kept_word$", place.name))

    @property
    def registers(self) -> tuple[Place, ...]:
        """The other registers."""
        others = {*self.states, *self.memories}
        return tuple(place for place in self.places if place not in others)

    def run(
        self,
        places: Sequence[Place],
        runs: int,
        seed: int,
        *,
        double: bool = False,
        progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> list[Upset]:
        """Run the core `runs` times, each time with one bit of `places` turned over; every bit is equally likely.

        Parameters
        ----------
        places : sequence of Place
            What may be hit.
        runs : int
            Number of runs.
        seed : int
            Of the random places and clocks.
        double : bool
            Whether to turn over another bit of the same word, too, in places with more than one.
        progress : callable
            Called with the number of runs done and their total.

        Raises
        ------
        ToolError
            If the simulation fails.
        """
        chance = random.Random(seed)
        weights = [place.depth * place.width for place in places]
        hits: list[Hit] = []
        for place in chance.choices(places, weights, k=runs):
            bits = chance.sample(range(place.width), 2 if double and place.width > 1 else 1)
            element, clock = chance.randrange(place.depth), chance.randrange(self.clocks)
            hits.append(Hit(place, element, bits[0], bits[1] if bits[1:] else -1, clock))
        return self.hit(hits, progress)

    def hit(self, hits: Sequence[Hit], progress: Callable[[int, int], None] = lambda done, total: None) -> list[Upset]:
        """Run the core once for each hit; progress and errors as in `run`."""
        found: list[Upset] = []
        for hit, line in zip(hits, self.lines(hits), strict=True):
            found.append(self._judged(hit, line))
            progress(len(found), len(hits))
        return found

    def lines(self, hits: Sequence[Hit], *, full: bool = False) -> Iterator[str]:
        """Yield the program's line for each hit, with all beats if `full`."""
        flips = self.samples.with_name("flips.txt")
        rows = (" ".join(map(str, (self.numbers[hit.place.name], *hit[1:]))) for hit in hits)
        flips.write_text("".join(f"{row}\n" for row in rows), encoding="utf-8")
        command = [str(self.program), "runs", str(self.samples), str(self.beats), str(flips), *["full"] * full]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            next(process.stdout)
            yield from process.stdout
        if process.returncode:
            raise ToolError(f"the simulation of upsets must end with status 0, not {process.returncode}")

    def _judged(self, hit: Hit, line: str) -> Upset:
        came, noticed, wrong, flagged, silent = map(int, line.split()[:5])
        if silent >= 0:
            fate = Fate.SILENT
        elif came < self.beats:
            fate = Fate.LOST
        elif flagged >= 0:
            fate = Fate.DETECTED
        else:
            fate = Fate.CORRECTED if noticed and self.corrects else Fate.MASKED
        return Upset(hit, fate, None if wrong < 0 else wrong, None if flagged < 0 else flagged)


def build(architecture: Architecture, sent: Beats, folder: Path) -> Target:
    """Build a core in Verilator so that its memories and registers can be changed.

    Parameters
    ----------
    architecture : Architecture
        The core.
    sent : Beats
        Its input beats, at most 64 bits wide.
    folder : Path
        Where everything is written.

    Raises
    ------
    ToolError
        If Verilator or a compiler is missing or fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tool = find_simulator("verilator", folder / "bin")
    name = architecture.datapath.name
    text = to_verilog(to_rtlil(architecture.component(), name))
    (folder / "core.sv").write_text(text, encoding="utf-8")
    rows = zip(sent.tdest.tolist(), sent.tdata.tolist(), strict=True)
    (folder / "samples.txt").write_text("".join(f"{dest:x} {data:x}\n" for dest, data in rows), encoding="utf-8")
    program, source, main = folder.resolve() / "core", (folder / "core.sv").resolve(), _MAIN.resolve()
    with (folder / "build.log").open("w", encoding="utf-8") as log:
        try:
            Builder(tool.version, tool.environment, folder.resolve() / "build", log).build_program(
                source, name, main, main, program, control=_public(text), define="DEST" * (architecture.channels > 1)
            )
        except subprocess.CalledProcessError as error:
            raise ToolError(f"{Path(error.cmd[0]).name} must build the core, not fail: see {log.name}") from None
    listed = _output([str(program), "places"]).splitlines()
    lines = [line.split(" ", 2) for line in listed]
    numbers = {found: number for number, (_, _, found) in enumerate(lines)}
    places = sorted(Place(found, int(depth), int(width)) for depth, width, found in lines if depth != "0")
    (folder / "none.txt").write_text("", encoding="utf-8")
    samples = (folder / "samples.txt").resolve()
    beats = _results(architecture, sent)
    clocks = int(_output([str(program), "runs", str(samples), str(beats), str(folder.resolve() / "none.txt")]))
    return Target(program, samples, beats, tuple(places), numbers, clocks, architecture.protect == "correct")


def _results(architecture: Architecture, sent: Beats) -> int:
    """Count the beats of results: one for each sample, or some for each of those that bring any."""
    counts = [int((sent.tdest == channel).sum()) for channel in range(architecture.channels)]
    share, copies = architecture.datapath.samples_per_result, architecture.copies_per_result
    return sum(-(-count // share) * copies for count in counts)


def counted(upsets: Sequence[Upset]) -> dict[str, int]:
    """Count the fates, those that did not occur as well."""
    found = Counter(upset.fate for upset in upsets)
    return {fate.value: found[fate] for fate in Fate}


def _output(command: list[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ToolError(f"the simulation of upsets must end with status 0, not {done.returncode}: {done.stderr[-500:]}")
    return done.stdout


def _public(text: str) -> str:
    """Return Verilator's control file that makes all memories and registers of a core public."""
    lines = ["`verilator_config"]
    for module, body in _MODULE.findall(text):
        names = {*_MEMORY.findall(body), *_LOADED.findall(body), *_SYNDROME.findall(body)}
        patterns = sorted(re.sub(r"\W", "*", name.removeprefix("\\")) for name in names)
        lines += [f'public_flat_rw -module "{module}" -var "{pattern}"' for pattern in patterns]
    return "\n".join([*lines, ""])
