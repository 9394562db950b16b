"""What folds at a decimator: gains that are proven, and none that is edited by one unit in its last digit."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tests.verify.certificate_edits import is_rejected
from tests.verify.rocq.small import DECIMATED, GRID, checked, designed, needs_coqc

from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.check import theorems
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.kernel import STANDARD

NAMES = ("decimator_folds", "filter_folds", "droop_is_corrected")
_NEEDED = r"^Definition (?:decimator_|exact_sections)\b.*?\.$"
"""What their statements need."""


def folding(made: Certificate) -> list[Claim]:
    """Return the theorems on what folds, the first one behind what they need of the others."""
    claims = theorems(made).claims
    needed = re.findall(_NEEDED, "".join(claim.text for claim in claims), re.DOTALL | re.MULTILINE)
    first, *others = (claim for claim in claims if claim.name in NAMES)
    return [replace(first, text="\n".join([*needed, first.text])), *others]


@pytest.mark.slow
@needs_coqc
def test_what_is_claimed_of_a_decimator(tmp_path: Path) -> None:
    made = designed(DECIMATED)
    claims = folding(made)
    assert tuple(claim.name for claim in claims) == NAMES
    assert checked(made, tmp_path, claims) <= STANDARD


def gain(part: str, band: int, units: int) -> Callable[[Any], None]:
    """Claim so many units of the grid more."""

    def edit(tree: Any) -> None:
        entry = tree["decimation"][part]
        if part == "aliasing":
            entry[band] = str(Fraction(entry[band]) + units * GRID)
        else:
            entry[band]["gain"] = str(Fraction(entry[band]["gain"]) + units * GRID)

    return edit


def place(part: str, step: Fraction) -> Callable[[Any], None]:
    """Say that the largest gain is reached elsewhere."""

    def edit(tree: Any) -> None:
        entry = tree["decimation"][part][0]
        entry["at"] = str(Fraction(entry["at"]) + step)

    return edit


def other(key: str, step: Fraction) -> Callable[[Any], None]:
    """Change a number of the decimator."""

    def edit(tree: Any) -> None:
        tree["decimation"][key] = str(Fraction(tree["decimation"][key]) + step)

    return edit


def fewer(tree: Any) -> None:
    """Claim nothing of the last band."""
    tree["decimation"]["bands"].pop()


EDITS = {
    "aliasing, less": (gain("aliasing", 0, -1), "decimator_folds"),
    "aliasing, more": (gain("aliasing", 1, 1), "decimator_folds"),
    "edge": (other("edge", Fraction(1, 1 << 20)), "decimator_folds"),
    "passing, less": (gain("passing", 1, -1), "filter_folds"),
    "passing, more": (gain("passing", 0, 1), "filter_folds"),
    "passing, elsewhere": (place("passing", Fraction(-1, 1 << 20)), "filter_folds"),
    "passing, outside": (place("passing", Fraction(1, 4)), "filter_folds"),
    "bands, less": (gain("bands", 0, -1), "filter_folds"),
    "bands, more": (gain("bands", 1, 1), "filter_folds"),
    "bands, between places": (place("bands", Fraction(1, 1 << 33)), "filter_folds"),
    "bands, fewer": (fewer, "filter_folds"),
    "correction": (other("correction", Fraction(1, 1 << 10)), "droop_is_corrected"),
}


@needs_coqc
@pytest.mark.sweep(3)
@pytest.mark.parametrize("edit", EDITS)
def test_what_our_verifier_rejects_is_refused(edit: str, tmp_path: Path) -> None:
    change, name = EDITS[edit]
    tree = json.loads(certificate_text(designed(DECIMATED)))
    change(tree)
    assert is_rejected(tree)
    made = Certificate.model_validate(tree)
    with pytest.raises(RejectedError, match=f"^Rocq must accept {name} \\("):
        checked(made, tmp_path, folding(made))


@pytest.mark.slow
@needs_coqc
@pytest.mark.parametrize("name", ["passing_gains", "band_gains"])
def test_a_gain_that_is_exceeded_has_no_proof(name: str, tmp_path: Path) -> None:
    made = designed(DECIMATED)
    first, second, _ = folding(made)
    # Without the check that it follows from its place, which would refuse it as well; it has a 1024th to spare.
    bare = re.sub(r"^Lemma .*?^Proof.*?Qed\.$", "", second.text, flags=re.DOTALL | re.MULTILINE)
    assert bare.count("Qed.") == 1
    less = re.sub(
        rf"(?<=Definition {name} : list ratio := \[)\((\d+), (\d+)\)",
        lambda found: f"({int(found[1]) * 1022}, {int(found[2]) * 1024})",
        first.text,
    )
    assert less != first.text
    assert checked(made, tmp_path, [first, replace(second, text=bare)]) <= STANDARD
    with pytest.raises(RejectedError, match=r"^Rocq must accept filter_folds \("):
        checked(made, tmp_path, [replace(first, text=less), replace(second, text=bare)])
