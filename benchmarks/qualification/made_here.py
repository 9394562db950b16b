"""What a qualification makes on the machine: the examples, generated and verified, and the bill of materials."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from benchmarks.qualification.requirements import ROOT

AUDIT = ROOT / ".venv" / "audit"
"""The environment of requirements/audit.txt, which the bill needs."""


def example(name: str, folder: Path) -> dict[str, Any]:
    """Generate an example, and return what `verify --spec --files --json` says of it."""
    spec = ROOT / "examples" / f"{name}.toml"
    _sosmith("generate", str(spec), "-o", str(folder))
    certificate = folder / f"{name}.certificate.json"
    said = _sosmith("verify", str(certificate), "--spec", str(spec), "--files", str(folder), "--partial", "--json")
    tree: dict[str, Any] = json.loads(said)
    return tree


def bill() -> str:
    """Return the bill of materials in CycloneDX, made in an environment of its own.

    Raises
    ------
    OSError
        If that environment cannot be set up.
    """
    python = sys.executable if find_spec("cyclonedx") else str(AUDIT / "bin" / "python")
    target = AUDIT.with_name("components.cdx.json")
    try:
        if python != sys.executable and not Path(python).exists():
            subprocess.run([sys.executable, "-m", "venv", "--clear", str(AUDIT)], check=True)
            install = [python, "-m", "pip", "install", "-q", "--no-deps", "--require-hashes"]
            subprocess.run([*install, "-r", "requirements/audit.txt"], cwd=ROOT, check=True)
        subprocess.run([python, "requirements/bill.py", str(target)], cwd=ROOT, check=True)
    except subprocess.CalledProcessError as error:
        raise OSError(f"the bill of materials could not be made: {error}") from None
    return target.read_text(encoding="utf-8")


def _sosmith(*arguments: str) -> str:
    code = "import sys; from sosmith.cli import main; sys.exit(main())"
    line = [sys.executable, "-c", code, *arguments]
    return subprocess.run(line, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
