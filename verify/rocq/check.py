"""The door to Rocq: from a certificate to theorems that its kernel has accepted, and what is not among them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from sosmith.model.errors import ToolError
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.decimation import handed_on
from sosmith.verify.rocq.bound import bound_claims, why_no_bound
from sosmith.verify.rocq.cascade import cascade_of
from sosmith.verify.rocq.claims import Claim, gain_claims
from sosmith.verify.rocq.flat import flattened
from sosmith.verify.rocq.folding import folding_claims
from sosmith.verify.rocq.kernel import LIBRARY, THEORIES, ending, mark, run_kernel, theory_texts
from sosmith.verify.rocq.ranges import core_definitions, range_claims, tight_claim
from sosmith.verify.rocq.settling import counter_of
from sosmith.verify.rocq.start import start_of

DATA = "Claims"
"""Name of the file with a certificate's own theorems."""

_FOLDING = ("Angles", "Waves", "Forms", "Folding")
"""Theories that only claims of a decimator rest on."""

GIVEN = ("the certificate's graph, exact filter and exact calibration: that these are the specified ones is not of it",)
"""What the theorems are about, and do not question."""

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
    given : tuple of str
        What the theorems do not ask about: what is held against what.
    unchecked : tuple of str
        What of the certificate Rocq did not check.
    """

    version: str
    claims: dict[str, str]
    axioms: tuple[str, ...]
    given: tuple[str, ...]
    unchecked: tuple[str, ...]


def rocq_texts(certificate: Certificate) -> dict[str, str]:
    """Return theories, theorems and a Makefile by their file names.

    Raises
    ------
    RejectedError
        If the certificate's claims cannot be written as theorems.
    """
    return _texts(theorems(certificate))


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
    made = theorems(certificate)
    with TemporaryDirectory() as name:
        folder = Path(name)
        try:
            for file, text in _texts(made).items():
                (folder / file).write_text(text, encoding="utf-8")
        except OSError as error:
            raise ToolError(f"{folder}: the theories must be written there, which failed: {error.strerror}") from None
        accepted = run_kernel(
            folder, made.claims, DATA, seconds, lambda done, total: progress("Rocq", done, total), made.theories
        )
    words = {claim.name: claim.words for claim in made.claims}
    return RocqVerdict(accepted.version, words, accepted.axioms, GIVEN, made.unchecked)


def head(theories: Sequence[str] = THEORIES) -> str:
    """Return how a file of theorems begins that requires these theories."""
    return f"""\
(* Written from a certificate: its claims as theorems. The theories beside it say what they mean. *)
Require Import ZArith Reals List Lia Lra. Import ListNotations.
From {LIBRARY} Require Import {" ".join(theories)}.
Open Scope Z_scope.
"""


@dataclass(frozen=True)
class Theorems:
    """What is written of a certificate.

    Attributes
    ----------
    definitions : str
        What the theorems are about, as text of Rocq.
    claims : list of Claim
        In their order.
    unchecked : tuple of str
        What of the certificate none of them is about.
    theories : tuple of str
        What they rest on, in the order in which it is compiled.
    """

    definitions: str
    claims: list[Claim]
    unchecked: tuple[str, ...]
    theories: tuple[str, ...]


def theorems(certificate: Certificate) -> Theorems:
    """Write all theorems of a certificate.

    Raises
    ------
    RejectedError
        If its claims cannot be written as theorems.
    """
    behind = handed_on(certificate)
    graph = flattened(behind)
    claims = list(gain_claims(certificate))
    unchecked = list(_beside(certificate))
    cascade = cascade_of(graph) if certificate.claims.sections else None
    start, counter = start_of(graph), counter_of(certificate, graph)
    claims.append(tight_claim())
    if counter is not None:
        claims.append(counter.claim())
    claims += range_claims(graph, cascade, start, counter)
    why = why_no_bound(certificate)
    if why is not None or cascade is None:
        unchecked.insert(0, f"error bound: {why}")
        if certificate.decimation is not None:
            unchecked.append("what folds into the pass band at the decimator")
    else:
        claims += bound_claims(certificate, behind, cascade, start, counter)
        claims += folding_claims(certificate)
    theories = tuple(name for name in THEORIES if certificate.decimation is not None or name not in _FOLDING)
    return Theorems(core_definitions(graph), claims, tuple(unchecked), theories)


def _beside(certificate: Certificate) -> Iterator[str]:
    """Name the claims that no theorem is about."""
    if certificate.claims.online is not None:
        yield "the units of sections in on-line arithmetic"


def _texts(made: Theorems) -> dict[str, str]:
    parts = [f"(* {claim.words}. *)\n{claim.text}{mark(claim)}" for claim in made.claims]
    text = "\n".join([head(made.theories), made.definitions, *parts, ending(made.claims)])
    return theory_texts(made.theories) | {f"{DATA}.v": text, "Makefile": _makefile(made.theories)}


def _makefile(theories: Sequence[str]) -> str:
    return f"""\
# Checks the claims with Rocq (coqc of version 8.16 or later) and prints the axioms that each rests on.
FILES = {" ".join(f"{name}.v" for name in (*theories, DATA))}

all:
\tfor file in $(FILES); do coqc -Q . {LIBRARY} $$file || exit 1; done

clean:
\trm -f *.vo *.vok *.vos *.glob .*.aux

.PHONY: all clean
"""
