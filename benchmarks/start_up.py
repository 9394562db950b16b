"""CPU time of commands and imports that need no design, and of the demo: `python -m benchmarks.start_up`.

The least of several runs counts, in seconds of user and system time: what else the machine does is not measured.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
EXAMPLE = "examples/audio_lowpass.toml"
RUNS = 5

COMMANDS: dict[str, tuple[str, ...]] = {
    "python alone": (sys.executable, "-c", "pass"),
    "import sosmith": (sys.executable, "-c", "import sosmith"),
    **{
        f"./run {line}": ("./run", *line.split())
        for line in (
            "--version",
            "--help",
            "design --help",
            "simulate --help",
            "spectrum --help",
            "design none.toml",
            f"generate {EXAMPLE} --board none",
            f"simulate {EXAMPLE} --trace none",
            f"emulate {EXAMPLE}",
        )
    },
}


def cpu_seconds(command: tuple[str, ...], cache: str | None = None) -> float:
    """User and system time of a command and its children, with the user's cache folder in `cache`; no output."""
    environment = os.environ if cache is None else os.environ | {"XDG_CACHE_HOME": cache}
    before = os.times()
    subprocess.run(
        command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False
    )
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    """Print one line for each command."""
    cpu_seconds(COMMANDS["./run --version"])  # sets everything up, if need be
    for name, command in COMMANDS.items():
        print(f"{min(cpu_seconds(command) for _ in range(RUNS)):6.2f} s  {name}", flush=True)
    with tempfile.TemporaryDirectory(prefix="sosmith-") as folder:
        for name in ("the first ./run demo", "the second ./run demo"):
            print(f"{cpu_seconds(('./run', 'demo', '-o', f'{folder}/demo'), folder):6.2f} s  {name}", flush=True)


if __name__ == "__main__":
    main()
