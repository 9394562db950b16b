"""Has the kernel of Rocq check edited certificates and random designs: `python -m benchmarks.rocq`.

Of a small certificate numbers are edited one by one, at random, and those edits are taken that our verifier rejects:
Rocq must reject them too. Random designs of all families, kinds and realizations must be accepted. `--edits` and
`--designs` say how many; seeds are fixed, and of what is not asked for, with 0, the record stays. The counts go to
benchmarks/rocq.json and into the table of docs/assurance.md. Status 1 if an edit is accepted or a design is not. Needs
coqc and coqtop.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.random_designs import random_specification
from pydantic import ValidationError
from tests.gen.word_lengths.filters import butterworth, plain
from tests.verify.certificate_edits import PLACE, all_edits, edited, is_rejected
from tests.verify.rocq.small import library

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.specification.choices import FIR_FAMILIES, KINDS
from sosmith.gen.specification.specification import from_text
from sosmith.model.errors import SosmithError
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.check import Theorems, head, theorems
from sosmith.verify.rocq.kernel import ACCEPTED, LIBRARY, THEORIES, mark

RECORD = Path(__file__).with_suffix(".json")
DOCUMENT = Path(__file__).resolve().parent.parent / "docs" / "assurance.md"
PART = re.compile("(?<=<!-- rocq -->\n).*(?=<!-- end of rocq -->)", re.DOTALL)
EDITS, DESIGNS = 500, 20
_ORDERS = (1, 2, 3)
"""Those of the filters whose certificates are edited, one after another."""
_MAX_ORDER, _LOWEST = 4, -1.3
_END = "end_of_answer"
_ROWS = {
    "edits": {
        "tried": "single numbers edited in a small certificate, each rejected by `sosmith verify`",
        "no theorem": "of these, refused before Rocq: no theorem can be written",
        "refused": "of these, refused by the kernel of Rocq",
        "accepted": "of these, accepted by it",
    },
    "designs": {
        "tried": "random designs",
        "accepted": "of these, accepted by the kernel of Rocq, each with its error bound",
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


class Kernel:
    """One process of Rocq with the compiled theories."""

    def __init__(self, folder: Path) -> None:
        library(folder)
        command = ["coqtop", "-q", "-w", "none", "-Q", ".", LIBRARY]
        self._process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self._said(f"Set Silent.\n{head(THEORIES)}Definition {_END} := 0.\n")

    def accepts(self, made: Theorems) -> bool:
        """Tell whether all theorems are accepted; ends at the first that is not."""
        self._said(f"Definition fresh := 0.\n{made.definitions}\n")
        accepted = all(
            f"{ACCEPTED} {claim.name}" in self._said(f"{claim.text}\n{mark(claim)}") for claim in made.claims
        )
        self._said("Reset fresh.\n")  # which also leaves the open proof of what is refused
        return accepted

    def _said(self, text: str) -> list[str]:
        """Return the lines that Rocq answers with."""
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None
        assert stdout is not None
        stdin.write(f"{text}Print {_END}.\n")
        stdin.flush()
        lines: list[str] = []
        for line in stdout:
            if line.startswith(f"{_END} = "):
                return lines
            lines.append(line.rstrip())
        raise RuntimeError("coqtop must answer, and has ended")


def edit_counts(kernel: Kernel, count: int) -> tuple[dict[str, Any], list[str]]:
    """Try edits that our verifier rejects; return counts, and what Rocq accepted."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    _see_accepted(kernel)
    for place, new, read in rejected_edits():
        if counts["tried"] == count:
            break
        counts["tried"] += 1
        try:
            made = theorems(read)
        except RejectedError:
            counts["no theorem"] += 1
            continue
        accepted = kernel.accepts(made)
        wrong += [f"{'.'.join(map(str, place))} = {new}"] if accepted else []
        counts["accepted" if accepted else "refused"] += 1
        print(dict(counts), file=sys.stderr, flush=True)
    _see_accepted(kernel)
    return counts, wrong


def rejected_edits() -> Iterator[tuple[PLACE, Any, Certificate]]:
    """Yield edits of the certificates of `_ORDERS` in a random order, those that our verifier rejects."""
    for order in _ORDERS:
        tree: Any = json.loads(certificate_text(_certificate(order)))
        every = all_edits(tree)
        random.Random(39).shuffle(every)
        for place, new in every:
            changed = edited(tree, place, new)
            try:
                read = Certificate.model_validate(changed)
            except ValidationError:
                continue
            if is_rejected(changed):
                yield place, new, read


def _certificate(order: int) -> Certificate:
    quantized = plain(butterworth(order, 0.2), "df1", steady=True)
    return certificate(quantized, quantized.datapath.output.lsb)


def _see_accepted(kernel: Kernel) -> None:
    """Raise RuntimeError unless certificates without an edit are accepted, before and after all that are refused."""
    for order in _ORDERS:
        if not kernel.accepts(theorems(_certificate(order))):
            raise RuntimeError(f"the certificate of order {order} must be accepted without an edit")


def random_design(seed: int, realization: str) -> tuple[str, str]:
    """Return the name of a specification with this realization and its TOML; of an FIR filter if that is for these."""
    name, text = random_specification(seed, max_order=_MAX_ORDER, lowest=_LOWEST)
    if realization.startswith("fir"):
        rng = random.Random(f"fir {seed}")
        family, kind = rng.choice(FIR_FAMILIES), rng.choice(KINDS)
        name = f"{family} {kind}"
        text = re.sub(r"(?<=\[filter\]\n).*?(?=\[output\])", _fir_table(rng, family, kind), text, flags=re.DOTALL)
    return f"{name}, {realization}", text.replace('"auto"', f'"{realization}"', 1)


def _fir_table(rng: random.Random, family: str, kind: str) -> str:
    low, width = rng.uniform(0.05, 0.2), rng.uniform(0.05, 0.2)
    one, other = [low], [0.5 - low if family == "halfband" else low + width]
    if kind in {"bandpass", "bandstop"}:
        top = rng.uniform(other[0] + 0.02, 0.4)
        one, other = [low, min(0.49, top + width)], [other[0], top]
    inside = kind in {"lowpass", "bandstop"}
    edges = {"passband_edge": one if inside else other, "stopband_edge": other if inside else one}
    lines = [f"{key} = [{', '.join(f'{edge:.4f}' for edge in ends)}]\n" for key, ends in edges.items()]
    head = f'family = "{family}"\nkind = "{kind}"\n'
    return "".join([head, *lines, "passband_loss = 0.5\nstopband_loss = 40.0\n"])


def draws(count: int) -> Iterator[tuple[str, Certificate]]:
    """Draw designs that can be met: the realizations in turn, then families and kinds that had no turn yet."""
    names, had = list(REALIZATIONS), Counter[str]()
    for index, first in enumerate(range(0, 1000 * count, 1000)):
        realization = names[index % len(names)]
        found = []
        for seed in range(first, first + 1000):
            name, text = random_design(seed, realization)
            family, kind = name.replace(",", "").split()[:2]
            found.append((had[family] + had[kind], seed, name, text, (family, kind)))
        for _, _, name, text, words in sorted(found):
            try:
                spec = from_text(text, Path("random.toml"))
                made = certificate(design_core(spec).quantized, spec.max_error)
            except SosmithError:
                continue
            had.update(words)
            yield name, made
            break


def design_counts(kernel: Kernel, count: int) -> tuple[dict[str, Any], list[str]]:
    """Have random designs checked; return counts with the designs by name, and what was not accepted."""
    verdicts: dict[str, bool] = {}
    for name, made in draws(count):
        start = time.monotonic()
        written = theorems(made)
        verdicts[name] = kernel.accepts(written) and not written.unchecked
        print(f"{name}: {verdicts[name]}, {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
    counts = {"tried": len(verdicts), "accepted": sum(verdicts.values()), "names": list(verdicts)}
    return counts, [name for name, accepted in verdicts.items() if not accepted]


def _recorded() -> dict[str, dict[str, Any]]:
    return json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--edits", type=int, default=EDITS)
    parser.add_argument("--designs", type=int, default=DESIGNS)
    chosen = parser.parse_args()
    made: dict[str, dict[str, Any]] = {}
    wrong: list[str] = []
    for part, try_all, count in (("edits", edit_counts, chosen.edits), ("designs", design_counts, chosen.designs)):
        if count:
            with TemporaryDirectory() as folder:
                made[part], found = try_all(Kernel(Path(folder)), count)
            wrong += found
    for line in wrong:
        print(line)
    both = _recorded() | made
    record = {part: both[part] for part in _ROWS if part in both}
    print(table(record), end="")
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    text = DOCUMENT.read_text(encoding="utf-8")
    DOCUMENT.write_text(PART.sub(lambda _: table(record), text), encoding="utf-8")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
