"""Makes the files and pictures that must not depend on the machine, into a folder: for comparison between machines.

Run as a script: ``python -m tests.machines.made_files FOLDER [SUBJECT ...]`` makes all subjects, or those named.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from click.testing import CliRunner

from sosmith.cli import cli

ROOT = Path(__file__).parents[2]

_PLAIN = """
name = "{name}"
sample_rate = {rate}
channels = {channels}
input.x = {{ bits = 16, signed = true, range = [-1.0, 1.0] }}
[filter]
{filter}
[output]
bits = 16
signed = true
range = [-2.0, 2.0]
unit = ""
max_error = "faithful"
[hardware]
realization = "{realization}"
clock = 48.0e6
"""

_FITTED = """
name = "fitted"
sample_rate = 100.0
input.voltage = {{ bits = 16, range = [0.0, 10.0] }}
input.temperature = {{ bits = 12, range = [0.0, 128.0] }}
calibration.data = "{data}"
[filter]
family = "chebyshev1"
kind = "lowpass"
order = 3
cutoff = 5.0
passband_loss = 0.1
[output]
bits = 16
range = [0.0, 16.0]
unit = "mm"
max_error = 0.0005
"""


def _plain(name: str, keys: str, realization: str, rate: float = 1000.0, channels: int = 1) -> str:
    lines = "\n".join(part.strip() for part in keys.split(";"))
    return _PLAIN.format(name=name, filter=lines, realization=realization, rate=rate, channels=channels)


def _specifications() -> dict[str, str]:
    """Return specifications that between them use every family, kind, method and realization."""
    band = 'kind = "bandpass"; order = 3; cutoff = [100.0, 180.0]'
    made = {
        "elliptic_band_pass": (f'family = "elliptic"; {band}; passband_loss = 0.5; stopband_loss = 40.0', "df1"),
        "chebyshev2_band_stop": (
            'family = "chebyshev2"; kind = "bandstop"; order = 2; cutoff = [200.0, 300.0]; stopband_loss = 30.0',
            "df2t",
        ),
        "bessel_high_pass": ('family = "bessel"; kind = "highpass"; order = 4; cutoff = 50.0', "df1_ef1"),
        "minimum_order": (
            'family = "elliptic"; kind = "lowpass"; passband_edge = 50.0; stopband_edge = 90.0; passband_loss = 0.2;'
            "stopband_loss = 45.0",
            "auto",
        ),
        "band_stop_by_edges": (
            'family = "butterworth"; kind = "bandstop"; passband_edge = [100.0, 400.0]; stopband_edge = [180.0, 230.0];'
            "passband_loss = 1.0; stopband_loss = 25.0",
            "df1",
        ),
        "minimum_noise": ('family = "butterworth"; kind = "lowpass"; order = 4; cutoff = 8.0', "state_space"),
        "normal_form": (
            'family = "chebyshev1"; kind = "lowpass"; order = 3; cutoff = 20.0; passband_loss = 0.3',
            "normal",
        ),
        "wave_lattice": (
            'family = "elliptic"; kind = "lowpass"; order = 5; cutoff = 100.0; passband_loss = 0.5;'
            "stopband_loss = 50.0",
            "lattice_wdf",
        ),
        "sampled_impulse": (
            'family = "butterworth"; kind = "lowpass"; method = "impulse_invariant"; order = 5; cutoff = 20.0',
            "df1_ef2",
        ),
        "delta_operator": ('family = "butterworth"; kind = "lowpass"; order = 3; cutoff = 1.0', "delta"),
        "given_sections": (
            "sos = [[0.25, 0.0, -0.25, 1.0, -0.9, 0.6], [0.3, 0.1, 0.3, 1.0, -1.1, 0.7]]",
            "auto",
        ),
    }
    texts = {name: _plain(name, keys, realization) for name, (keys, realization) in made.items()}
    texts["three_channels"] = _plain(
        "three_channels", 'family = "butterworth"; kind = "lowpass"; order = 2; cutoff = 30.0', "auto", channels=3
    )
    texts["fitted"] = _FITTED.format(data=(ROOT / "examples/measurements/march.csv").as_posix())
    return texts


SPECIFICATIONS = _specifications()
EXAMPLES = tuple(sorted(path.stem for path in (ROOT / "examples").glob("*.toml")))


_SPEED = re.compile(r"(?<=>)[\d.,]+\u00a0\w+ clock(?=<)|(?<= in )[^<]*(?=<br>the whole run)|(?<=comparing, took )[^<]*")
"""What a page tells of the duration of the simulation."""


def _print(*arguments: str) -> str:
    """Carry out a command; return what it prints on stdout."""
    result = CliRunner(env={"COLUMNS": "100"}).invoke(cli, arguments)
    if result.exit_code:
        raise RuntimeError(f"{' '.join(arguments)}: {result.output}{result.exception!r}")
    return result.stdout


def _specification(name: str, folder: Path) -> str:
    if name in EXAMPLES:
        return str(ROOT / "examples" / f"{name}.toml")
    path = folder / f"{name}.toml"
    path.write_text(SPECIFICATIONS[name], encoding="utf-8")
    return str(path)


def _design(name: str, folder: Path) -> None:
    """Make all generated files of a specification, and what `design` prints of it."""
    path = _specification(name, folder)
    _print("generate", path, "-o", str(folder / name))
    (folder / name / "design.txt").write_text(_print("design", path, "--json"), encoding="utf-8")


def _report(name: str, folder: Path) -> None:
    """Make the report of a short co-simulation, and its page, without the speed in them."""
    with tempfile.TemporaryDirectory() as scratch:
        _print("simulate", _specification(name, folder), "--seconds", "0.005", "-o", scratch)
        report = json.loads((Path(scratch) / "report.json").read_text(encoding="utf-8"))
        page = (Path(scratch) / "report.html").read_text(encoding="utf-8")
    for key in ("cycles_per_second", "wall_seconds"):
        del report[key]
    (folder / "report.json").write_text(json.dumps(report, indent=1), encoding="utf-8")
    (folder / "report.html").write_text(_SPEED.sub("", page), encoding="utf-8")


def _paper(folder: Path) -> None:
    _print("paper", "-o", str(folder / "paper.md"))


def _commands(folder: Path) -> None:
    """Make the pictures and documents that commands draw."""
    examples = ROOT / "examples"
    vehicle = _print("vehicle", "--json", "--plot", str(folder / "vehicle.svg"))
    (folder / "vehicle.json").write_text(vehicle, encoding="utf-8")
    wheel = str(examples / "wear/wheel.csv")
    limits = ["--initial", "1.5", "--warning", "7", "--limit", "9", "--sensor-range", "10.5"]
    wear = _print("wear", wheel, *limits, "--json", "--plot", str(folder / "wear.svg"))
    (folder / "wear.json").write_text(wear, encoding="utf-8")


SUBJECTS: dict[str, Callable[[Path], None]] = {
    **{name: (lambda folder, name=name: _design(name, folder)) for name in (*EXAMPLES, *SPECIFICATIONS)},
    "report": lambda folder: _report("audio_lowpass", folder),
    "paper": _paper,
    "commands": _commands,
}


def make(folder: Path, *subjects: str) -> None:
    """Make `subjects`, or all, into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for subject in subjects or SUBJECTS:
        SUBJECTS[subject](folder)


if __name__ == "__main__":
    make(Path(sys.argv[1]), *sys.argv[2:])
