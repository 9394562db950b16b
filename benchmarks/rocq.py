"""Has the kernel of Rocq check edited certificates and random designs: `python -m benchmarks.rocq`.

Of small certificates numbers are edited one by one, at random, and those edits are taken that our verifier rejects:
the kernel of Rocq must refuse a theorem of them too. Random designs of all families, kinds and realizations must be
accepted (`benchmarks.rocq_designs`), each within `--seconds` of processor time. `--edits` and `--random` say how many;
`--resume` goes on where it was stopped. `--examples` takes the time of two examples. Seeds are fixed; with `--seed`
other edits are tried, and counted on the screen alone. Of what is not asked for, with 0, the record stays. The counts
go to benchmarks/rocq.json and into the table of docs/assurance.md. Status 1 if the kernel does not refuse an edit, or
does not accept a design. Needs coqc and coqtop.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import resource
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from itertools import islice, zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from benchmarks.rocq_designs import draws
from pydantic import ValidationError
from tests.verify.certificate_edits import PLACE, all_edits, edited, is_rejected
from tests.verify.rocq.small import BOTH, DECIMATED, SETTLING, designed, library, small

from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.check import Theorems, head, theorems
from sosmith.verify.rocq.kernel import ACCEPTED, LIBRARY, THEORIES, mark

RECORD = Path(__file__).with_suffix(".json")
DOCUMENT = Path(__file__).resolve().parent.parent / "docs" / "assurance.md"
EXAMPLES_FOLDER = DOCUMENT.parent.parent / "examples"
PART = re.compile("(?<=<!-- rocq -->\n).*(?=<!-- end of rocq -->)", re.DOTALL)
EXAMPLES = ("audio_lowpass", "flange_wear_locomotive")
EDITS, DESIGNS, SECONDS, SEED = 500, 20, 600, 39
_ORDERS = (1, 2, 3)
"""Those of the filters whose certificates are edited, one after another."""
_GRAPHS = ("core_is_well_formed", "ahead_is_well_formed")
_END = "end_of_answer"
_ROWS = {
    "edits": {
        "tried": "single numbers edited in a small certificate, each rejected by `sosmith verify`",
        "refused": "of these, refused by the kernel of Rocq",
        "graph": "of the refused, at the theorem that the nodes are a graph in its stages",
        "accepted": "of these, accepted by it",
        "no theorem": "of these, refused before Rocq: a theorem cannot be written, and the kernel accepts all others",
        "no certificate": "edits passed over among them, since what they leave is not a certificate by its format",
    },
    "designs": {
        "tried": "random designs",
        "accepted": "of these, accepted by the kernel of Rocq, each with its error bound",
    },
    "examples": {
        name: f"seconds of processor time of `sosmith verify --rocq` for {name}, the theories included"
        for name in EXAMPLES
    },
}


def table(record: dict[str, dict[str, Any]]) -> str:
    """Return the counts as a table in Markdown."""
    rows = [
        f"| {words} | {record[part].get(key, 0)} |\n"
        for part, shown in _ROWS.items()
        if part in record
        for key, words in shown.items()
    ]
    return "".join(["| what | count |\n|---|---:|\n", *rows])


class EndedError(RuntimeError):
    """A process of Rocq has ended."""


class Kernel:
    """One process of Rocq with the compiled theories."""

    def __init__(self, folder: Path, seconds: int | None = None) -> None:
        library(folder)
        command = ["coqtop", "-q", "-w", "none", "-Q", ".", LIBRARY]
        self._process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        if seconds is not None:
            resource.prlimit(self._process.pid, resource.RLIMIT_CPU, (seconds, seconds))
        self._said(f"Set Silent.\n{head(THEORIES)}Definition {_END} := 0.\n")

    def refused(self, made: Theorems) -> str | None:
        """Return the name of the first theorem that is not accepted; None if all are.

        Raises
        ------
        EndedError
            If the process ends, as it does when its processor time has been used.
        """
        self._said(f"Definition fresh := 0.\n{made.definitions}\n")
        names = (
            claim.name
            for claim in made.claims
            if f"{ACCEPTED} {claim.name}" not in self._said(f"{claim.text}\n{mark(claim)}")
        )
        refused = next(names, None)
        self._said("Reset fresh.\n")  # which also leaves the open proof of what is refused
        return refused

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def _said(self, text: str) -> list[str]:
        """Return the lines that Rocq answers with."""
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None
        assert stdout is not None
        lines: list[str] = []
        try:
            stdin.write(f"{text}Print {_END}.\n")
            stdin.flush()
        except BrokenPipeError:
            raise EndedError("coqtop must take theorems, and has ended") from None
        for line in stdout:
            if line.startswith(f"{_END} = "):
                return lines
            lines.append(line.rstrip())
        raise EndedError("coqtop must answer, and has ended")


class Edit(NamedTuple):
    """A certificate with one number edited, and how many edits before it left no certificate."""

    place: PLACE
    new: Any
    read: Certificate
    passed: int


def edit_counts(kernel: Kernel, count: int, seed: int, *, resume: bool) -> list[str]:
    """Try edits that our verifier rejects; record the counts, and return what the kernel did not refuse."""
    counts = Counter[str](_recorded().get("edits", {}) if resume and seed == SEED else {})
    wrong: list[str] = []
    _see_accepted(kernel)
    for edit in islice(rejected_edits(seed), counts["tried"], count):
        verdict, name = verdict_of(kernel, edit.read)
        counts.update(("tried", verdict, *(["graph"] if name in _GRAPHS else [])))
        counts["no certificate"] += edit.passed
        what = f"{edit.read.name}: {'.'.join(map(str, edit.place))} = {edit.new}: {verdict}"
        wrong += [what] if verdict != "refused" else []
        print(dict(counts), what, name or "", file=sys.stderr, flush=True)
        if seed == SEED:
            _record({"edits": dict(counts)})
    _see_accepted(kernel)
    return wrong


def verdict_of(kernel: Kernel, certificate: Certificate) -> tuple[str, str | None]:
    """Return what becomes of a certificate, by its key in the table, and the name of the theorem that is refused."""
    try:
        made = theorems(certificate)
    except RejectedError:
        return "no theorem", None
    refused = kernel.refused(made)
    if refused is not None:
        return "refused", refused
    whole = made.ended is None and any(claim.name == "error_is_bounded" for claim in made.claims)
    return "accepted" if whole else "no theorem", None


def rejected_edits(seed: int = SEED) -> Iterator[Edit]:
    """Yield edits of the small certificates in turn, in a random order, those that our verifier rejects."""
    every = (_rejected(certificate, seed) for certificate in _certificates())
    return (found for turn in zip_longest(*every) for found in turn if found is not None)


def _rejected(certificate: Certificate, seed: int) -> Iterator[Edit]:
    tree: Any = json.loads(certificate_text(certificate))
    every = all_edits(tree)
    random.Random(seed).shuffle(every)
    passed = 0
    for place, new in every:
        changed = edited(tree, place, new)
        try:
            read = Certificate.model_validate(changed)
        except ValidationError:
            passed += 1
            continue
        if is_rejected(changed):
            yield Edit(place, new, read, passed)
            passed = 0


def _certificates() -> list[Certificate]:
    """Return those that are edited: from the first sample, from zero, behind a decimator, with a calibration."""
    return [*(small(order=order, steady=True) for order in _ORDERS), *map(designed, (SETTLING, DECIMATED, BOTH))]


def _see_accepted(kernel: Kernel) -> None:
    """Raise RuntimeError unless certificates without an edit are accepted, before and after all that are refused."""
    for certificate in _certificates():
        if verdict_of(kernel, certificate) != ("accepted", None):
            raise RuntimeError(f"the certificate of {certificate.name} must be accepted without an edit")


def design_counts(folder: Path, count: int, seconds: int, *, resume: bool) -> list[str]:
    """Have random designs checked; record the verdicts by name, and return those that were not accepted."""
    verdicts: dict[str, str] = _recorded().get("designs", {}).get("verdicts", {}) if resume else {}
    for draw, made in draws(count, tuple(verdicts)):
        kernel = Kernel(folder, seconds)
        try:
            verdict, _ = verdict_of(kernel, made)
        except EndedError:
            verdict = f"not within {seconds} s of processor time"
        kernel.close()
        verdicts[draw.name] = verdict
        print(f"{draw.name}: {verdict}", file=sys.stderr, flush=True)
        _record({"designs": _designs(verdicts)})
    return [f"{name}: {verdict}" for name, verdict in verdicts.items() if verdict != "accepted"]


def _designs(verdicts: dict[str, str]) -> dict[str, Any]:
    accepted = sum(verdict == "accepted" for verdict in verdicts.values())
    return {"tried": len(verdicts), "accepted": accepted, "verdicts": verdicts}


def example_times(folder: Path) -> None:
    """Record the processor time that `sosmith verify --rocq` takes for the examples, on one core, in s."""
    code = "import sys; from sosmith.cli import main; sys.exit(main())"
    times = {}
    for name in EXAMPLES:
        spec = EXAMPLES_FOLDER / f"{name}.toml"
        subprocess.run([sys.executable, "-c", code, "generate", str(spec), "-o", str(folder)], check=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        line = [sys.executable, "-c", code, "verify", str(folder / f"{name}.certificate.json"), "--rocq", "--partial"]
        subprocess.run(line, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times[name] = round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        print(f"{name}: {times[name]} s", file=sys.stderr, flush=True)
    _record({"examples": times})


def _recorded() -> dict[str, dict[str, Any]]:
    return json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}


def _record(made: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Put counts into the record and into the document."""
    both = _recorded() | made
    record = {part: both[part] for part in _ROWS if part in both}
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    text = DOCUMENT.read_text(encoding="utf-8")
    DOCUMENT.write_text(PART.sub(lambda _: table(record), text), encoding="utf-8")
    return record


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edits", type=int, default=EDITS, help="number of edits")
    parser.add_argument(
        "--seed", type=int, default=SEED, help="of the order of the edits; of another one than this, none is recorded"
    )
    parser.add_argument("--random", type=int, default=DESIGNS, help="number of random designs")
    parser.add_argument("--resume", action="store_true", help="go on behind what the record has")
    parser.add_argument("--seconds", type=int, default=SECONDS, help="processor time for a design")
    parser.add_argument("--examples", action="store_true", help="take the time of two examples")
    chosen = parser.parse_args()
    wrong: list[str] = []
    with TemporaryDirectory() as name:
        folder = Path(name)
        if chosen.edits:
            wrong += edit_counts(Kernel(folder), chosen.edits, chosen.seed, resume=chosen.resume)
        if chosen.random:
            wrong += design_counts(folder, chosen.random, chosen.seconds, resume=chosen.resume)
        if chosen.examples:
            example_times(folder)
    print("\n".join(wrong))
    print(table(_recorded()), end="")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
