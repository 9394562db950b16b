"""The door to Rocq: from a certificate to theorems that its kernel has accepted, and what is not among them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from sosmith.model.errors import ToolError
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.decimation import calibration_alone, handed_on
from sosmith.verify.rocq.bound import bound_claims, why_no_bound
from sosmith.verify.rocq.cascade import cascade_of
from sosmith.verify.rocq.claims import Claim, gain_claims
from sosmith.verify.rocq.entry import graph_ahead
from sosmith.verify.rocq.flat import FlatGraph, flattened
from sosmith.verify.rocq.folding import folding_claims
from sosmith.verify.rocq.kernel import LIBRARY, THEORIES, ending, mark, run_kernel, theory_texts
from sosmith.verify.rocq.ranges import core_definitions, graph_claim, range_claims, tight_claim
from sosmith.verify.rocq.settling import counter_of
from sosmith.verify.rocq.start import start_of

DATA = "Claims"
"""Name of the file with a certificate's own theorems."""

_FOLDING = ("Angles", "Waves", "Forms", "Folding")
"""Theories that only claims of a decimator rest on."""

OF_CHAINS = ("Rates", "Chain")
"""Those that the theorems of a chain rest on, beside those of its stages."""

_LAST = "error_is_bounded"
"""The theorem that all others are for."""

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

    Of a wrong certificate there may be theorems missing; then the last line asks for them, which Rocq refuses.

    Raises
    ------
    RejectedError
        If there is nothing that a theorem could be about, or all that is missing is behind the error bound.
    """
    made = theorems(certificate)
    if made.ended is None:
        return _texts(made)
    if any(claim.name == _LAST for claim in made.claims):
        raise RejectedError(made.ended)
    return _texts(made, (_LAST,))


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
        try:
            accepted = run_kernel(
                folder, made.claims, DATA, seconds, lambda done, total: progress("Rocq", done, total), made.theories
            )
        except RejectedError as error:
            raise RejectedError(f"{error}; {made.ended}" if made.ended is not None else str(error)) from None
    if made.ended is not None:
        raise RejectedError(made.ended)
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
    ended : str or None
        Why there are no more theorems, where one that the others need is wrong. That one is the kernel's to refuse; if
        it accepts all that there are, this is why the certificate is rejected.
    """

    definitions: str
    claims: list[Claim]
    unchecked: tuple[str, ...]
    theories: tuple[str, ...]
    ended: str | None


def theorems(certificate: Certificate) -> Theorems:
    """Write all theorems of a certificate, or of a wrong one those that can be written.

    Raises
    ------
    RejectedError
        If there is nothing that a theorem could be about.
    """
    behind = handed_on(certificate)
    graph = flattened(behind)
    claims: list[Claim] = []
    ended = None
    try:
        for claim in _claims(certificate, behind, graph):
            claims.append(claim)
    except RejectedError as error:
        ended = str(error)
    beside = OF_CHAINS if certificate.decimation is not None else (*_FOLDING, *OF_CHAINS)
    theories = tuple(name for name in THEORIES if name not in beside)
    return Theorems(core_definitions(graph), claims, tuple(_unchecked(certificate)), theories, ended)


def _claims(certificate: Certificate, behind: Certificate, graph: FlatGraph) -> Iterator[Claim]:
    """Write theorem by theorem, each of which may need those before it to be true."""
    graphs = [graph]
    yield graph_claim(graph, "core", "ports")
    alone = calibration_alone(certificate)
    if alone is not None and why_no_bound(certificate) is None:
        ahead, claim = graph_ahead(alone)
        graphs.append(ahead)
        yield claim
    for one in graphs:
        one.check()
    yield from gain_claims(certificate)
    cascade = cascade_of(graph) if certificate.claims.sections else None
    start, counter = start_of(graph), counter_of(certificate, graph)
    yield tight_claim()
    if start is not None:
        yield start.claim()
    if counter is not None:
        yield counter.claim()
    yield from range_claims(graph, cascade, start, counter)
    if why_no_bound(certificate) is not None:
        return
    if cascade is None:
        raise RejectedError("an exact filter must have a section that computes it, not none")
    yield from bound_claims(certificate, behind, cascade, start, counter)
    yield from folding_claims(certificate)


def _unchecked(certificate: Certificate) -> Iterator[str]:
    """Name the claims that no theorem is about."""
    why = why_no_bound(certificate)
    if why is not None:
        yield f"error bound: {why}"
    if certificate.claims.online is not None:
        yield "the units of sections in on-line arithmetic"
    if why is not None and certificate.decimation is not None:
        yield "what folds into the pass band at the decimator"


def data_text(made: Theorems, missing: Sequence[str] = ()) -> str:
    """Return the file of a certificate's own theorems."""
    parts = [f"(* {claim.words}. *)\n{claim.text}{mark(claim)}" for claim in made.claims]
    names = [*(claim.name for claim in made.claims), *missing]
    return "\n".join([head(made.theories), made.definitions, *parts, ending(names)])


def _texts(made: Theorems, missing: Sequence[str] = ()) -> dict[str, str]:
    data = {f"{DATA}.v": data_text(made, missing)}
    return theory_texts(made.theories) | data | {"Makefile": makefile((*made.theories, DATA))}


def makefile(names: Sequence[str]) -> str:
    """Return a Makefile that compiles files in this order."""
    return f"""\
# Checks the claims with Rocq (coqc of version 8.16 or later) and prints the axioms that each rests on.
FILES = {" ".join(f"{name}.v" for name in names)}

all:
\tfor file in $(FILES); do coqc -Q . {LIBRARY} $$file || exit 1; done

clean:
\trm -f *.vo *.vok *.vos *.glob .*.aux

.PHONY: all clean
"""
