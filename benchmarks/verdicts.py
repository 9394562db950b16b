"""Verifies a core of every architecture with every option: `python -m benchmarks.verdicts`.

Each core is designed and generated from a specification of its own, and then `verify` holds its certificate against the
specification and the files. What is proven and what not, and the seconds of CPU time of both, go to
benchmarks/verdicts.json and into the table of docs/assurance.md; `--check` writes nothing. A refusal ends it with its
traceback.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
import tempfile
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import load
from sosmith.interface.certificate import Certificate
from sosmith.model.errors import ShortfallError, SpecificationError

ROOT = Path(__file__).resolve().parent.parent
RECORD = Path(__file__).with_suffix(".json")
DOCUMENT = ROOT / "docs" / "assurance.md"
PART = re.compile(r"(?<=<!-- verdicts -->\n).*?(?=<!-- end of verdicts -->)", re.DOTALL)

_WORDS = """
name = "smooth"
sample_rate = 100.0
channels = {channels}
input.voltage = {{ bits = 12, range = [0.0, 10.0] }}
input.temperature = {{ bits = 10, range = [0.0, 128.0] }}
calibration.coefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]
filter = {{ family = "butterworth", kind = "lowpass", order = {order}, cutoff = {cutoff}{filter} }}
output = {{ bits = 12, range = [0.0, 16.0], unit = "mm", max_error = 0.01 }}
hardware.architecture = "{architecture}"
"""
_FILTER = """
name = "smooth"
sample_rate = 100.0
channels = {channels}
input.x = {{ bits = 12, signed = true, range = [-1.0, 1.0] }}
filter = {{ family = "butterworth", kind = "lowpass", order = {order}, cutoff = {cutoff}{filter} }}
output = {{ bits = 12, signed = true, range = [-1.0, 1.0], unit = "", max_error = 0.002 }}
hardware.architecture = "{architecture}"
"""
_OPTIONS: dict[str, dict[str, Any]] = {
    "": {},
    "3 channels": {"channels": 3},
    "from zero": {"more": 'hardware.start = "zero"\n'},
    "decimated": {"order": 2, "cutoff": 1.0, "filter": ", decimate = 8"},
    "decimated, held": {"order": 2, "cutoff": 1.0, "filter": ", decimate = 8, hold = true"},
    "loadable": {"more": "hardware.reload = true\n"},
    "upsets detected": {"more": 'hardware.protect = "detect"\n'},
    "upsets corrected": {"more": 'hardware.protect = "correct"\n'},
}
_ONLY_PARALLEL: dict[str, dict[str, Any]] = {
    "2 samples a clock": {"words": _FILTER, "more": "hardware.samples_per_clock = 2\n"},
    "look-ahead": {
        "words": _FILTER,
        "more": 'hardware.start = "zero"\nhardware.pipeline = "look-ahead"\nhardware.clock = 100.0e6\n',
    },
    "shared adders": {"more": "hardware.multipliers = 0\n"},
}


def _text(
    architecture: str,
    *,
    words: str = _WORDS,
    channels: int = 1,
    order: int = 3,
    cutoff: float = 10.0,
    filter: str = "",
    more: str = "",
) -> str:
    given = {"channels": channels, "order": order, "cutoff": cutoff, "filter": filter, "architecture": architecture}
    return words.format(**given) + more


def specifications() -> dict[str, str]:
    """Return a specification of each core by what the core is."""
    found = {}
    for architecture in ("parallel", "folded", "serial", "online"):
        options = _OPTIONS | (_ONLY_PARALLEL if architecture == "parallel" else {})
        words = {"words": _FILTER} if architecture == "online" else {}
        for name, option in options.items():
            found[f"{architecture}, {name}".removesuffix(", ")] = _text(architecture, **words | option)
    return found


def verdict(text: str) -> dict[str, Any]:
    """Make a core, and verify it; return what is not proven and why, and the seconds of both.

    Returns
    -------
    dict
        ``refused``, the sentence, of a core that there cannot be. Of others ``status``, ``proven`` with names of parts,
        ``missing`` with the reason by part, ``making`` and ``verifying`` in s of CPU time.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        spec = folder / "spec.toml"
        spec.write_text(text, encoding="utf-8")
        start = _seconds()
        try:
            generate(design_core(load(spec)), folder / "out")
        except (SpecificationError, ShortfallError) as error:
            return {"refused": str(error).removeprefix(f"{spec}: ")}
        made = _seconds()
        (path,) = (folder / "out").glob("*.certificate.json")
        proof = Certificate.load(path).verify(spec=spec, files=folder / "out")
        ended = _seconds()
        return {
            "status": 4 if proof.missing else 0,
            "proven": [part for part, found in proof.scope.items() if found.asked and part not in proof.missing],
            "missing": {part: found.why for part, found in proof.missing.items()},
            "making": round(made - start, 1),
            "verifying": round(ended - made, 1),
        }


def _seconds() -> float:
    """CPU time of this process and its children, in s."""
    return sum(os.times()[:4])


def campaign(names: Sequence[str] = ()) -> dict[str, Any]:
    """Verify the cores with these names, all without any; return the record."""
    found = {}
    # A process for each, as a command is: nothing that one core has left is there for the next one.
    with get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for name, text in specifications().items():
            if not names or name in names:
                found[name] = pool.apply(verdict, (text,))
                print(f"{name}: {found[name]}", file=sys.stderr, flush=True)
    return found


def table(record: dict[str, Any]) -> str:
    """Return the record as a table in Markdown."""
    lines = [
        "| core | status | proven | not proven | design and generation, s | verify, s |",
        "|---|---:|---:|---|---:|---:|",
    ]
    lines += [
        f"| {name} | {found['status']} | {len(found['proven'])} | {_reasons(found['missing'])} | {found['making']} | "
        f"{found['verifying']} |"
        for name, found in record.items()
        if "refused" not in found
    ]
    missing = [f"- {name}: {found['refused']}" for name, found in record.items() if "refused" in found]
    lines += ["", "Cores that there cannot be:", "", *missing] if missing else []
    return "".join(f"{line}\n" for line in lines)


def _reasons(missing: dict[str, str]) -> str:
    """Return the parts that have the same reason together."""
    parts: dict[str, list[str]] = {}
    for part, why in missing.items():
        parts.setdefault(why, []).append(part)
    return "; ".join(f"{', '.join(names)}: {why}" for why, names in parts.items())


def main() -> None:
    """Run what the arguments ask for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.verdicts", description=__doc__)
    parser.add_argument("--check", action="store_true", help="without a record")
    parser.add_argument("names", nargs="*", help="cores, by their names in the table; all without any")
    asked = parser.parse_args()
    record = campaign(asked.names)
    print(table(record), end="")
    if not asked.check and not asked.names:
        RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        text = DOCUMENT.read_text(encoding="utf-8")
        DOCUMENT.write_text(PART.sub(lambda _: table(record), text), encoding="utf-8")


if __name__ == "__main__":
    main()
