"""Small cores of every architecture, with their files: what is attacked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import load

NAME = "tiny"
_WORDS = """
name = "tiny"
sample_rate = 100.0
input.x = { bits = 4, signed = true, range = [-1.0, 1.0] }
output = { bits = 4, signed = true, range = [-1.0, 1.0], unit = "", max_error = 0.13 }
"""
_INSTRUMENT = """
name = "tiny"
sample_rate = 100.0
input.voltage = { bits = 4, range = [0.0, 1.0] }
input.temperature = { bits = 4, range = [0.0, 1.0] }
calibration.coefficients = [[0.125, 0.25], [0.5]]
output = { bits = 5, range = [0.0, 1.0], unit = "mm", max_error = 0.1 }
"""
_ZERO = 'hardware.start = "zero"\n'
_LOCK = "hardware.reload = true\nhardware.reload_lock = true\n"
_PLAIN = 'filter = { family = "butterworth", kind = "lowpass", order = 1, cutoff = 20.0 }\n'
_TAPS = "filter = { taps = [0.25, 0.5, 0.25], decimate = 2 }\n"
_SLOW = 'filter = { family = "butterworth", kind = "lowpass", order = 1, cutoff = 2.0, decimate = 4 }\n'


def _hardware(architecture: str, more: str = "") -> str:
    return f'hardware.architecture = "{architecture}"\n{more}'


SPECIFICATIONS = {
    "parallel": _WORDS + _PLAIN + _hardware("parallel"),
    "parallel, from zero": _WORDS + _PLAIN + _ZERO + _hardware("parallel"),
    "parallel, a calibration before it": _INSTRUMENT + _PLAIN + _ZERO + _hardware("parallel"),
    "parallel, 2 samples a clock": _WORDS + _PLAIN + _hardware("parallel", "hardware.samples_per_clock = 2\n"),
    "parallel, look-ahead": _WORDS
    + _PLAIN
    + _ZERO
    + _hardware("parallel", 'hardware.clock = 100.0e6\nhardware.pipeline = "look-ahead"\n'),
    "parallel, 3 channels": "channels = 3\n" + _WORDS + _PLAIN + _hardware("parallel"),
    "parallel, 20 channels": "channels = 20\n" + _WORDS + _PLAIN + _ZERO + _hardware("parallel"),
    "parallel, decimated": _WORDS + _SLOW + _hardware("parallel"),
    "parallel, a calibration before a decimator": _INSTRUMENT + _SLOW + _hardware("parallel"),
    "folded": _WORDS + _PLAIN + _hardware("folded"),
    "folded, 3 channels": "channels = 3\n" + _WORDS + _PLAIN + _hardware("folded"),
    "folded, a calibration before it": _INSTRUMENT + _PLAIN + _hardware("folded"),
    "folded, FIR that decimates": _WORDS + _TAPS + _hardware("folded"),
    "folded, 2 channels of FIR that decimates": "channels = 2\n" + _WORDS + _TAPS + _hardware("folded"),
    "folded, decimated": _WORDS + _SLOW + _hardware("folded"),
    "serial": _WORDS + _PLAIN + _hardware("serial"),
    "parallel, protected": _WORDS + _PLAIN + _hardware("parallel", 'hardware.protect = "correct"\n'),
    "parallel, loadable": _WORDS + _PLAIN + _hardware("parallel", "hardware.reload = true\n"),
    "folded, loadable": _WORDS + _PLAIN + _hardware("folded", "hardware.reload = true\n"),
    "parallel, lockable": _WORDS + _PLAIN + _hardware("parallel", _LOCK),
    "folded, lockable": _WORDS + _PLAIN + _hardware("folded", _LOCK),
    "online": _WORDS + _PLAIN + _ZERO + _hardware("online"),
}
"""Specifications by what their cores are; of the last six, and of "folded, decimated", `verify` says that
their hardware is not proven, or a part of it."""

CLOCKS = {"parallel": 240, "folded": 800, "serial": 1600, "online": 1600}
"""Clocks of a simulation, by the first word."""


@dataclass(frozen=True)
class Core:
    """A core with its files."""

    kind: str
    folder: Path
    words: str

    @property
    def text(self) -> str:
        """Its SystemVerilog."""
        return (self.folder / f"{NAME}.sv").read_text(encoding="ascii")

    @property
    def certificate(self) -> Path:
        """Its certificate."""
        return self.folder / f"{NAME}.certificate.json"

    @property
    def clocks(self) -> int:
        """Clocks of a simulation."""
        return CLOCKS[self.kind.partition(",")[0]]


def made(kind: str, folder: Path) -> Core:
    """Design a core and write its files."""
    words = SPECIFICATIONS[kind]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "spec.toml").write_text(words, encoding="utf-8")
    generate(design_core(load(folder / "spec.toml")), folder)
    return Core(kind, folder, words)
