"""What is kept of a choice among realizations: the same choice with one proof, and none on the word of a file."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.realizations import kept_formats
from sosmith.gen.specification.specification import Specification, from_text
from sosmith.gen.word_lengths import selection

PROVEN = ["proof, df1_ef1", "proof, delta", "proof, df1_ef2"]
"""What the choice comes to for the specification below; the second one is taken."""


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Specification:
    monkeypatch.setattr(kept_formats, "cache_folder", lambda: tmp_path)
    port = "bits = 10\nsigned = true\nrange = [-1.0, 1.0]"
    return from_text(
        f"""
        name = "tiny"
        sample_rate = 1.0
        [input.x]
        {port}
        [filter]
        family = "butterworth"
        kind = "lowpass"
        order = 2
        cutoff = 0.04
        [output]
        {port}
        max_error = "faithful"
        [hardware]
        architecture = "folded"
        clock = 1000.0
        """,
        Path("tiny.toml"),
    )


def designed(spec: Specification) -> tuple[CoreDesign, list[str]]:
    """Return a design, and which realizations were proven."""
    steps: list[str] = []
    made = design_core(spec, progress=steps.append)
    return made, [step for step in steps if step.startswith("proof")]


def test_the_one_taken_is_proven_again_and_no_other(spec: Specification) -> None:
    first, proven = designed(spec)
    assert (first.quantized.realization, proven) == ("delta", PROVEN)
    again, proven = designed(spec)
    assert proven == PROVEN[1:2]
    assert (again.quantized, again.reasons, again.datapath) == (first.quantized, first.reasons, first.datapath)


def test_what_a_slower_clock_leaves_no_time_for_falls_short(
    spec: Specification, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = designed(spec)
    slow = replace(spec, hardware=replace(spec.hardware, clock=Fraction(first.architecture.clocks_per_sample)))
    kept, _ = designed(slow)
    monkeypatch.setattr(kept_formats, "cache_folder", lambda: None)
    searched, _ = designed(slow)
    assert kept.reasons == searched.reasons
    assert "fall short" in kept.reasons["realization"]
    assert "fall short" not in first.reasons["realization"]


@pytest.mark.parametrize("size", [1.0, 1e9])
def test_a_size_that_is_not_so_is_no_reason(size: float, spec: Specification, monkeypatch: pytest.MonkeyPatch) -> None:
    right, _ = designed(spec)
    monkeypatch.setattr(selection, "kept_or_made", lambda key, make, to_tree, of_tree: size)
    made, proven = designed(spec)
    assert sorted(proven) == sorted(PROVEN)
    assert (made.quantized, made.reasons) == (right.quantized, right.reasons)
