"""Runs `coqc` on theories and on what was written from a certificate, and reads which theorems its kernel accepted."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from sosmith.model.errors import ToolError
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.claims import Claim

THEORIES = (
    "Definitions",
    "Streams",
    "Responses",
    "Decimation",
    "Angles",
    "Waves",
    "Forms",
    "Folding",
    "Gains",
    "Graph",
    "Ranges",
    "Linear",
    "Rows",
    "Cascade",
    "Settling",
    "Start",
    "Calibration",
    "Exact",
    "Bound",
    "Downsampling",
    "Rates",
    "Chain",
)
"""The general theories, in the order in which they are compiled."""

LIBRARY = "Sosmith"
"""Logical name of all of them."""

STANDARD = {
    "ClassicalDedekindReals.sig_forall_dec",
    "ClassicalDedekindReals.sig_not_dec",
    "FunctionalExtensionality.functional_extensionality_dep",
}
"""Axioms of the standard library's real numbers."""

_MISSING = (
    "the option --rocq must find coqc, the compiler of Rocq, which is not installed: on Debian and Ubuntu, "
    "apt-get install --no-install-recommends coq"
)


@dataclass(frozen=True)
class Accepted:
    """What the kernel accepted.

    Attributes
    ----------
    version : str
        Of Rocq.
    axioms : tuple of str
        All that the theorems rest on, by their names; none that is not in `STANDARD`.
    """

    version: str
    axioms: tuple[str, ...]


def theory_texts(theories: Sequence[str] = THEORIES) -> dict[str, str]:
    """Return general theories by their file names."""
    folder = files(__package__) / "theories"
    return {f"{name}.v": (folder / f"{name}.v").read_text(encoding="utf-8") for name in theories}


def run_kernel(
    folder: Path,
    claims: Sequence[Claim],
    name: str,
    seconds: float = 0.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
    theories: Sequence[str] = THEORIES,
) -> Accepted:
    """Compile the theories and `name`.v in a folder that holds them.

    Parameters
    ----------
    folder : Path
    claims : sequence of Claim
        The theorems in `name`.v, in order, each followed by `mark`; behind all of them what prints their axioms.
    seconds : float
        Time that all of it may take, in s; 0 for any.
    progress : callable
        Called with the number of theorems accepted so far, and of all.
    theories : sequence of str
        Those that are compiled before it, in this order; none if all that it requires are.

    Raises
    ------
    RejectedError
        If a theorem is not accepted, rests on an axiom that is not one of the reals', or takes too long.
    ToolError
        If `coqc` is missing, or does not compile a theory.
    """
    compiler = _compiler()
    end = time.monotonic() + seconds if seconds else None
    shown = subprocess.run([compiler, "--print-version"], capture_output=True, text=True, check=False).stdout.split()
    compile_theories(folder, theories, end)
    said, status = _compile(compiler, folder, f"{name}.v", end, lambda text: progress(_count(text), len(claims)))
    accepted, printed = _count(said), _HEADS.split(said)[1:]
    if status or accepted != len(claims) or not printed:
        refused = claims[min(accepted, len(claims) - 1)]
        raise RejectedError(f"Rocq must accept {refused.name} ({refused.words}), and says: {_brief(said)}")
    axioms = sorted({axiom for block in printed for axiom in _AXIOM.findall(block)})
    others = [axiom for axiom in axioms if axiom not in STANDARD]
    if others:
        raise RejectedError(f"the theorems must rest on the axioms of the real numbers alone, not on {others[0]}")
    return Accepted(shown[0] if shown else "", tuple(axioms))


def compile_theories(folder: Path, theories: Sequence[str] = THEORIES, end: float | None = None) -> None:
    """Compile theories in a folder that holds them, until the monotonic time `end`.

    Raises
    ------
    RejectedError
        If it takes longer.
    ToolError
        If `coqc` is missing, or does not compile one.
    """
    for theory in theories:
        said, status = _compile(_compiler(), folder, f"{theory}.v", end)
        if status:
            raise ToolError(f"coqc must compile the theory {theory}.v, and says: {_brief(said)}")


def _compiler() -> str:
    found = shutil.which("coqc")
    if found is None:
        raise ToolError(_MISSING)
    return found


def _compile(
    compiler: str,
    folder: Path,
    file: str,
    end: float | None,
    heard: Callable[[str], None] = lambda text: None,
) -> tuple[str, int]:
    """Compile a file; return what was said, and the status. No process is left, however the wait ends."""
    command = [compiler, "-q", "-w", "none", "-Q", ".", LIBRARY, file]
    output = folder / f"{file}.out"
    with output.open("wb") as sink:
        process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            while process.poll() is None:
                if end is not None and time.monotonic() > end:
                    raise RejectedError("Rocq must check the certificate within the time that is allowed, and does not")
                heard(output.read_text(encoding="utf-8", errors="replace"))
                try:
                    process.wait(0.2)
                except subprocess.TimeoutExpired:
                    continue
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    text = output.read_text(encoding="utf-8", errors="replace")
    output.unlink()
    return text, process.returncode


ACCEPTED = "accepted by the kernel:"
"""What is printed behind each theorem, before its name."""

_HEADS = re.compile("^(?:Axioms:|Closed under the global context)$", re.MULTILINE)
_AXIOM = re.compile(r"^([A-Za-z_][\w.']*)(?: :|$)", re.MULTILINE)


def mark(claim: Claim) -> str:
    """Write what tells behind a theorem that it was accepted: by one tactic that uses it, which else fails as well."""
    return f'Goal True. pose proof {claim.name}; idtac "{ACCEPTED} {claim.name}". Abort.\n'


def ending(names: Sequence[str]) -> str:
    """Write what prints the axioms that the theorems of these names rest on."""
    together = ", ".join(names)
    head = "(* The axioms that all of this rests on. *)"
    return f"{head}\nDefinition all_claims := ({together}).\nPrint Assumptions all_claims.\n"


def _count(said: str) -> int:
    return len(re.findall(f"^{ACCEPTED}", said, re.MULTILINE))


def _brief(said: str) -> str:
    """Return the message of an error in one line."""
    _, _, message = said.partition("\nError:") if "\nError:" in said else ("", "", said)
    text = " ".join(message.split())
    return text if len(text) <= 160 else f"{text[:157]}..."
