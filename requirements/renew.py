"""Writes the files beside it: from pyproject.toml and the versions in constraints.txt, with hashes of all their files.

To be called after a change of either, with uv in the path: `python requirements/renew.py`. Each file holds what the
files that it stands on do not: `./run` installs the first ones up to its level.
"""

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = "hatchling\neditables\nsetuptools\nsetuptools-scm\nwheel\n"
"""What this package, and those that come as source only, are built with."""
AUDIT = "pip-audit\n"
"""What looks for known weaknesses, in an environment of its own."""
LEVELS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "base": ((), ("build",)),
    "boards": (("boards",), ("build", "base")),
    "test": (("test",), ("build", "base", "boards")),
    "docs": (("docs",), ("build", "base", "boards", "test")),
    "mutation": (("mutation",), ("build", "base", "boards", "test")),
}
"""Extras of each file, and the files that it stands on."""
_LINUX = re.compile(r" (?:; |and )sys_platform == 'linux'")


def compiled(source: str, extras: tuple[str, ...], given: str | None = None) -> dict[str, str]:
    """Return the lines of each package by its name."""
    command = ["uv", "pip", "compile", source, "--constraints", "constraints.txt", "--universal", "--quiet"]
    command += ["--python-version", "3.11", "--generate-hashes", "--no-header", "--no-annotate"]
    command += [word for extra in extras for word in ("--extra", extra)]
    text = subprocess.run(command, input=given, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT).stdout
    return {one.split("==")[0]: _LINUX.sub("", one) for one in re.split(r"\n(?=\S)", text.strip())}


def main() -> None:
    """Write all files."""
    found = {"build": compiled("-", (), BUILD), "audit": compiled("-", (), AUDIT)}
    for level, (extras, below) in LEVELS.items():
        lower = {name for one in below for name in found[one]}
        found[level] = {name: text for name, text in compiled("pyproject.toml", extras).items() if name not in lower}
    for level, packages in found.items():
        path = Path(__file__).with_name(f"{level}.txt")
        path.write_text("".join(f"{text}\n" for text in packages.values()), encoding="utf-8")


if __name__ == "__main__":
    main()
