"""The door to Rocq for a chain of filters: its stages' theorems, and that their errors add up to the chain's bound.

Each stage has a file of theorems of its own, as a single core has. One more file joins them: what a stage gives is what
the next one takes, no port between limits anything, and of each error at most the claimed share reaches the end.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.chain.chain_file import ChainCertificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.bound import why_no_bound
from sosmith.verify.rocq.check import GIVEN, OF_CHAINS, Progress, RocqVerdict, Theorems, data_text, makefile, theorems
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.joints import Stage, joining_claims
from sosmith.verify.rocq.kernel import LIBRARY, compile_theories, ending, mark, run_kernel, theory_texts

WHOLE = "Whole"
"""Name of the file with the theorems that join the stages."""


def check_chain_in_rocq(
    chain: ChainCertificate,
    groups: Sequence[Sequence[Certificate]],
    progress: Progress = lambda step, done, total: None,
    *,
    seconds: float = 0.0,
) -> RocqVerdict:
    """Have Rocq's kernel check the claims of a chain and of its stages.

    Parameters
    ----------
    chain : ChainCertificate
    groups : sequence of sequence of Certificate
        Those of each stage's cores.
    progress : callable
        Called with the step, the number of theorems accepted, and of all.
    seconds : float
        Time that this may take, in s; 0 for any.

    Raises
    ------
    SpecificationError
        If the chain is not one that theorems are written of.
    RejectedError
        If a claim is not accepted, or not within the time.
    ToolError
        If `coqc` is missing or fails.
    """
    progress("theorems", 0, 0)
    stages = _stages(chain, groups)
    made = [theorems(stage.certificate) for stage in stages]
    whole = list(joining_claims(chain, stages))
    theories = _theories(made)
    end = time.monotonic() + seconds if seconds else None
    total, done, axioms, version = sum(len(each.claims) for each in made) + len(whole), 0, set[str](), ""
    words: dict[str, str] = {}
    with TemporaryDirectory() as name:
        folder = Path(name)
        try:
            for file, text in _texts(chain, stages, made, whole).items():
                (folder / file).write_text(text, encoding="utf-8")
        except OSError as error:
            raise ToolError(f"{folder}: the theories must be written there, which failed: {error.strerror}") from None
        compile_theories(folder, theories, end)
        parts = [(stage.file, each.claims, each.ended) for stage, each in zip(stages, made, strict=True)]
        labels = [f"{entry.name}: " for entry in chain.stages]
        for (file, claims, ended), label in zip([*parts, (WHOLE, whole, None)], [*labels, ""], strict=True):
            left = max(end - time.monotonic(), 0.1) if end is not None else 0.0
            try:
                accepted = run_kernel(folder, claims, file, left, partial(_told, progress, done, total), ())
            except RejectedError as error:
                raise RejectedError(f"{label}{error}; {ended}" if ended is not None else f"{label}{error}") from None
            if ended is not None:
                raise RejectedError(f"{label}{ended}")
            done += len(claims)
            axioms |= set(accepted.axioms)
            version = accepted.version
            words |= {f"{label}{claim.name}": claim.words for claim in claims}
    unchecked = [f"{label}{part}" for label, each in zip(labels, made, strict=True) for part in each.unchecked]
    return RocqVerdict(version, words, tuple(sorted(axioms)), GIVEN, (*unchecked, *_unchecked(chain)))


def _told(progress: Progress, before: int, total: int, done: int, _: int) -> None:
    """Report theorems that were accepted, `before` of which are those of other files."""
    progress("Rocq", before + done, total)


def chain_texts(chain: ChainCertificate, groups: Sequence[Sequence[Certificate]]) -> dict[str, str]:
    """Return theories, theorems and a Makefile by their file names; errors are those of `check_chain_in_rocq`."""
    stages = _stages(chain, groups)
    made = [theorems(stage.certificate) for stage in stages]
    for entry, each in zip(chain.stages, made, strict=True):
        if each.ended is not None:
            raise RejectedError(f"{entry.name}: {each.ended}")
    texts = _texts(chain, stages, made, list(joining_claims(chain, stages)))
    names = [*_theories(made), *(stage.file for stage in stages), WHOLE]
    return texts | {"Makefile": makefile(names)}


def _theories(made: Sequence[Theorems]) -> tuple[str, ...]:
    """Return all theories that the stages rest on, in their order, and the chain's."""
    largest = max((each.theories for each in made), key=len)
    return (*largest, *OF_CHAINS)


def _texts(
    chain: ChainCertificate, stages: Sequence[Stage], made: Sequence[Theorems], whole: Sequence[Claim]
) -> dict[str, str]:
    texts = theory_texts(_theories(made))
    for stage, each in zip(stages, made, strict=True):
        texts[f"{stage.file}.v"] = data_text(each)
    parts = [f"(* {claim.words}. *)\n{claim.text}{mark(claim)}" for claim in whole]
    head = f"""\
(* Written from the certificate of the chain {chain.name}: how the theorems of its stages join. *)
Require Import Bool ZArith Reals List Lia Lra. Import ListNotations.
From {LIBRARY} Require Import Definitions Streams Responses Gains Exact Bound Downsampling {" ".join(OF_CHAINS)}.
From {LIBRARY} Require {" ".join(stage.file for stage in stages)}.
Open Scope Z_scope.
"""
    texts[f"{WHOLE}.v"] = "\n".join([head, *parts, ending([claim.name for claim in whole])])
    return texts


def _unchecked(chain: ChainCertificate) -> Iterator[str]:
    if chain.folding:
        yield "what folds in the chain as a whole"


def _stages(chain: ChainCertificate, groups: Sequence[Sequence[Certificate]]) -> list[Stage]:
    """Return the stages of a chain that theorems are written of.

    Raises
    ------
    SpecificationError
        If one of them is none of these.
    """
    stages, last = [], groups[-1][0].output.lsb
    for k, (entry, cores) in enumerate(zip(chain.stages, groups, strict=True)):
        why = _why_not(cores)
        if why is not None:
            raise SpecificationError(
                "--rocq must have a chain of filters of which none interpolates or has a CIC decimator before it, not "
                f"one whose stage {entry.name} {why}: give it with the certificate of each stage instead"
            )
        stages.append(Stage(k, cores[0], cores[0].output.lsb / last, entry.error / last, entry.gain))
    return stages


def _why_not(cores: Sequence[Certificate]) -> str | None:
    core = cores[0]
    if len(cores) > 1:
        return "interpolates"
    if core.decimation is not None:
        return "has one"
    if core.ideal.polynomial is not None:
        return "is a polynomial"
    why = why_no_bound(core)
    return None if why is None else f"has no theorem on its error, as {why}"
