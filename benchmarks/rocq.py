"""Has the kernel of Rocq check edited certificates and random designs: `python -m benchmarks.rocq`.

Of a small certificate numbers are edited one by one, at random, and those edits are taken that our verifier rejects:
Rocq must reject them too. Random designs of all families, kinds and realizations must be accepted. `--edits` and
`--designs` say how many; seeds are fixed. Prints the counts. Status 1 if an edit is accepted or a design is not. Needs
coqc and coqtop.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.random_designs import random_specification
from pydantic import ValidationError
from tests.gen.word_lengths.filters import butterworth, plain
from tests.verify.certificate_edits import all_edits, edited, is_rejected

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.specification.specification import from_text
from sosmith.model.errors import SosmithError
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.check import head, theorems
from sosmith.verify.rocq.kernel import ACCEPTED, LIBRARY, THEORIES, compile_theories, mark, theory_texts

EDITS, DESIGNS = 500, 20
_AT_ONCE = 20
_ROWS = {
    "edits": "single numbers edited in a small certificate, of which our verifier rejects each",
    "edits, no theorem": "refused before Rocq, since no theorem can be written for it",
    "edits, refused by the kernel": "refused by the kernel of Rocq",
    "edits, accepted": "accepted",
    "designs": "random designs of all families, kinds and realizations",
    "designs, accepted": "accepted by the kernel, each with its error bound",
}


def table(counts: dict[str, int]) -> str:
    """Return the counts as a table in Markdown."""
    return "| | count |\n|---|---:|\n" + "".join(
        f"| {words} | {counts.get(key, 0)} |\n" for key, words in _ROWS.items()
    )


class Kernel:
    """Rocq with the theories compiled once, in a folder that exists as long as this does."""

    def __init__(self) -> None:
        self._folder = TemporaryDirectory()
        for name, text in theory_texts().items():
            (Path(self._folder.name) / name).write_text(text, encoding="utf-8")
        compile_theories(Path(self._folder.name))

    def accepts(self, certificates: Sequence[Certificate]) -> list[bool]:
        """Tell of which certificates all theorems are accepted; RejectedError if one cannot be written."""
        made = [theorems(one) for one in certificates]
        parts = ["Set Silent.\n", head(THEORIES)]
        for one in made:
            # What is refused leaves its proof open, so that nothing behind it is accepted; the reset ends that.
            body = "\n".join([one.definitions, *(claim.text + mark(claim) for claim in one.claims)])
            parts.append(f'Definition fresh := 0.\n{body}\nReset fresh.\nGoal True. idtac "next". Abort.\n')
        command = ["coqtop", "-q", "-w", "none", "-Q", ".", LIBRARY]
        run = subprocess.run(
            command, input="\n".join(parts), cwd=self._folder.name, capture_output=True, text=True, check=False
        )
        said = re.split("^next$", run.stdout, flags=re.MULTILINE)
        if len(said) != len(made) + 1:
            raise RuntimeError(f"coqtop must come through {len(made)} certificates, not {len(said) - 1}")
        return [
            len(re.findall(f"^{ACCEPTED}", text, re.MULTILINE)) == len(one.claims)
            for text, one in zip(said, made, strict=False)
        ]


def edit_counts(kernel: Kernel, count: int) -> tuple[Counter[str], list[str]]:
    """Try edits that our verifier rejects; return counts, and what Rocq accepted."""
    quantized = plain(butterworth(1, 0.2), "df1", steady=True)
    tree: Any = json.loads(certificate_text(certificate(quantized, quantized.datapath.output.lsb)))
    every = all_edits(tree)
    random.Random(39).shuffle(every)
    counts: Counter[str] = Counter()
    waiting: list[tuple[str, Certificate]] = []
    wrong: list[str] = []
    if not all(kernel.accepts([Certificate.model_validate(tree)])):
        raise RuntimeError("the certificate must be accepted before it is edited")
    for place, new in every:
        if counts["edits"] == count:
            break
        changed = edited(tree, place, new)
        if not is_rejected(changed):
            continue
        try:
            read = Certificate.model_validate(changed)
        except ValidationError:
            continue
        counts["edits"] += 1
        try:
            theorems(read)
        except RejectedError:
            counts["edits, no theorem"] += 1
            continue
        waiting.append((f"{'.'.join(map(str, place))} = {new}", read))
        if len(waiting) == _AT_ONCE or counts["edits"] == count:
            wrong += _judged(kernel, waiting, counts)
            waiting = []
    wrong += _judged(kernel, waiting, counts)
    return counts, wrong


def _judged(kernel: Kernel, waiting: list[tuple[str, Certificate]], counts: Counter[str]) -> list[str]:
    if not waiting:
        return []
    wrong = []
    for (name, _), accepted in zip(waiting, kernel.accepts([read for _, read in waiting]), strict=True):
        counts["edits, accepted" if accepted else "edits, refused by the kernel"] += 1
        wrong += [name] if accepted else []
    print(f"{counts['edits']} edits, accepted: {counts['edits, accepted']}", file=sys.stderr, flush=True)
    return wrong


def design_counts(kernel: Kernel, count: int) -> tuple[Counter[str], list[str]]:
    """Have random designs checked, the realizations in turn; return counts, and what was not accepted."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    names = list(REALIZATIONS)
    for seed in range(10_000):
        if counts["designs"] == count:
            break
        name, text = random_specification(seed)
        realization = names[seed % len(names)]
        try:
            spec = from_text(text.replace('"auto"', f'"{realization}"', 1), Path("random.toml"))
            made = certificate(design_core(spec).quantized, spec.max_error)
        except SosmithError:
            continue
        counts["designs"] += 1
        accepted = kernel.accepts([made])[0] and not theorems(made).unchecked
        counts["designs, accepted"] += accepted
        wrong += [] if accepted else [f"seed {seed}: {name}, {realization}"]
        print(f"seed {seed}: {name}, {realization}: {accepted}", file=sys.stderr, flush=True)
    return counts, wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--edits", type=int, default=EDITS)
    parser.add_argument("--designs", type=int, default=DESIGNS)
    chosen = parser.parse_args()
    kernel = Kernel()
    counts, wrong = edit_counts(kernel, chosen.edits)
    more, others = design_counts(kernel, chosen.designs)
    counts += more
    for line in wrong + others:
        print(line)
    print(table(counts), end="")
    sys.exit(bool(wrong or others))


if __name__ == "__main__":
    main()
