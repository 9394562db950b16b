"""The door to Rocq: from a certificate to theorems that its kernel has accepted, and what is not among them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from sosmith.model.errors import ToolError
from sosmith.verify.certificate_file import Certificate, Operation, StageEntry
from sosmith.verify.rocq.bound import bound_claims, why_no_bound
from sosmith.verify.rocq.cascade import cascade_of
from sosmith.verify.rocq.claims import Claim, gain_claims
from sosmith.verify.rocq.flat import flattened
from sosmith.verify.rocq.kernel import LIBRARY, THEORIES, run_kernel, theory_texts
from sosmith.verify.rocq.ranges import graph_definitions, range_claims
from sosmith.verify.rocq.start import start_of

DATA = "Claims"
"""Name of the file with a certificate's own theorems."""

_MAKEFILE = f"""\
# Checks the claims with Rocq (coqc of version 8.16 or later) and prints the axioms that each rests on.
FILES = {" ".join(f"{name}.v" for name in (*THEORIES, DATA))}

all:
\tfor file in $(FILES); do coqc -Q . {LIBRARY} $$file || exit 1; done

clean:
\trm -f *.vo *.vok *.vos *.glob .*.aux

.PHONY: all clean
"""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class RocqVerdict:
    """What Rocq's kernel accepted of a certificate.

    Attributes
    ----------
    version : str
        Of Rocq.
    claims : dict of str to str
        What each theorem says, by its name.
    axioms : tuple of str
        What they rest on: at most the axioms of the standard library's real numbers.
    unchecked : tuple of str
        What of the certificate Rocq did not check.
    """

    version: str
    claims: dict[str, str]
    axioms: tuple[str, ...]
    unchecked: tuple[str, ...]


def rocq_texts(certificate: Certificate) -> dict[str, str]:
    """Return theories, theorems and a Makefile by their file names.

    Raises
    ------
    RejectedError
        If the certificate's claims cannot be written as theorems.
    """
    return _texts(*theorems(certificate)[:2])


def check_in_rocq(
    certificate: Certificate, progress: Progress = lambda step, done, total: None, *, seconds: float = 0.0
) -> RocqVerdict:
    """Have Rocq's kernel check a certificate's claims.

    Parameters
    ----------
    certificate : Certificate
        As read from its file.
    progress : callable
        Called with the step, the number of theorems accepted, and of all.
    seconds : float
        Time that this may take, in s; 0 for any.

    Raises
    ------
    RejectedError
        If a claim is not accepted, or not within the time.
    ToolError
        If `coqc` is missing or fails.
    """
    progress("theorems", 0, 0)
    definitions, claims, unchecked = theorems(certificate)
    with TemporaryDirectory() as name:
        folder = Path(name)
        try:
            for file, text in _texts(definitions, claims).items():
                (folder / file).write_text(text, encoding="utf-8")
        except OSError as error:
            raise ToolError(f"{folder}: the theories must be written there, which failed: {error.strerror}") from None
        accepted = run_kernel(folder, claims, DATA, seconds, lambda done, total: progress("Rocq", done, total))
    words = {claim.name: claim.words for claim in claims}
    return RocqVerdict(accepted.version, words, accepted.axioms, unchecked)


def head(theories: Sequence[str] = THEORIES) -> str:
    """Return how a file of theorems begins that requires these theories."""
    return f"""\
(* Written from a certificate: its claims as theorems. The theories beside it say what they mean. *)
Require Import ZArith Reals List Lra. Import ListNotations.
From {LIBRARY} Require Import {" ".join(theories)}.
Open Scope Z_scope.
"""


def theorems(certificate: Certificate) -> tuple[str, list[Claim], tuple[str, ...]]:
    """Return definitions, all theorems in their order, and what none of them is about."""
    claims = list(gain_claims(certificate))
    why = _why_no_ranges(certificate.stages)
    if why is not None:
        return "", claims, (f"ranges: {why}", "error bound: no ranges are proven")
    graph = flattened(certificate)
    cascade = cascade_of(graph) if certificate.claims.sections else None
    start = start_of(graph)
    claims += range_claims(graph, cascade, start)
    unchecked = [
        "parts of the error budget, each on its own",
        "the ideal filter: its coefficients are those of the certificate",
    ]
    why = why_no_bound(certificate)
    if why is not None or cascade is None:
        unchecked = [f"error bound: {why}", *unchecked[1:]]
    else:
        claims += bound_claims(certificate, cascade, start)
    if certificate.decimation is not None:
        unchecked.append("decimator and what is before it")
    return graph_definitions(graph), claims, tuple(unchecked)


def _why_no_ranges(stages: Sequence[StageEntry]) -> str | None:
    """Why theorems cannot be written for the ranges of these stages; None if they can."""
    for stage in stages:
        for node in stage.nodes if stage.role not in {"section", "start"} else ():
            of = stage.nodes[node.operands[0]] if node.op is Operation.BOUND else node
            if of.low < node.low or of.high > node.high:
                return f"{stage.name} limits a range by something else than peak gains"
    return None


def _texts(definitions: str, claims: list[Claim]) -> dict[str, str]:
    parts = [f"(* {claim.words}. *)\n{claim.text}Print Assumptions {claim.name}.\n" for claim in claims]
    return theory_texts() | {f"{DATA}.v": "\n".join([head(), definitions, *parts]), "Makefile": _MAKEFILE}
