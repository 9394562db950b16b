"""Swaps: nothing leaves the ranges proven for them, whatever the input, and what they leave behind fades in time."""

from functools import cache

import numpy as np
import pytest
from tests.gen.designs import zero_design
from tests.gen.reload.swaps import RESIDUE, during, left_behind, moved, worst_input
from tests.model.reload.swapping import compute_swapping

from sosmith.gen.reload import transient as module
from sosmith.gen.reload.other_constants import with_constants
from sosmith.gen.reload.transient import transient
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import RangeError
from sosmith.model.errors import ShortfallError

REALIZATIONS = ("df1", "df1_ef2", "df2t", "delta", "normal", "lattice_wdf")
RATIOS = ("0.5", "1.2")


@cache
def sets(realization: str, ratio: str) -> tuple[Quantized, Quantized]:
    """Make a design and the same with another cutoff, in formats in which states carry over."""
    made = zero_design("audio_lowpass.toml", realization=realization)
    own = with_constants(made.quantized, None, None, room=2)
    return own, with_constants(made.quantized, moved(made, ratio), None, finer=2, room=2)


def swapped(active: Quantized, other: Quantized, during: Datapath) -> None:
    """Run the worst input through a swap, either way round, with all ranges checked."""
    swap, samples = 300, 420
    codes = worst_input(active, other, swap, samples)
    for way in (codes, -1 - codes):
        compute_swapping(active.datapath, [(swap, during)], way)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_nothing_leaves_the_ranges_that_are_proven_for_a_swap(realization: str, ratio: str) -> None:
    active, other = sets(realization, ratio)
    swapped(active, other, during(active, other))


def test_without_its_own_proof_a_swap_does_leave_ranges() -> None:
    active, other = sets("df1_ef2", "0.5")
    with pytest.raises(RangeError):
        swapped(active, other, other.datapath)


def test_the_answer_to_the_differences_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    active, other = sets("df1_ef2", "0.5")
    monkeypatch.setattr(module, "added", lambda equations, answer: equations)
    broken = during(active, other)
    with pytest.raises(RangeError):
        swapped(active, other, broken)


def test_a_swap_to_the_same_set_needs_hardly_more_than_the_set() -> None:
    active, _ = sets("df1_ef2", "2")
    for section, ranges in zip(active.sections, transient(active, active).ranges, strict=True):
        for node in section.graph.nodes:
            if node.name in ranges:
                low, high = ranges[node.name]
                assert high - low <= 1.01 * (node.high - node.low) + 2 * 2.0**node.frac


@pytest.mark.slow
def test_a_transient_ends_when_it_is_said_to() -> None:
    """After it, the swapped run is within two rounding bounds of one that had the new set from the beginning."""
    active, other = sets("df1_ef2", "0.8")
    length = transient(active, other).samples
    swap, samples = 300, 300 + length + 200
    codes = worst_input(active, other, swap, samples)
    after = np.array(compute_swapping(active.datapath, [(swap, during(active, other))], codes))
    always = other.datapath.compute(codes)
    assert other.proof is not None
    most = 2 * (float(other.proof.rounding.magnitude) + RESIDUE) + 1
    difference = np.abs(after - always)[swap:]
    assert difference[length:].max() <= most
    assert difference[: length // 8].max() > 100 * most


@pytest.mark.sweep(1)
@pytest.mark.parametrize("realization", ["df1_ef2", "df2t", "delta", "normal"])
def test_a_transient_lasts_as_long_as_the_states_are_remembered(realization: str) -> None:
    """Until the old states have faded, and then for as many samples as a section has states; but hardly longer."""
    active, other = sets(realization, "1.2")
    found = transient(active, other).samples
    faded = 1 + int(np.flatnonzero(left_behind(active, other, found + 100) > RESIDUE)[-1])
    states = len(other.sections[-1].graph.delays)
    assert faded + states <= found <= faded + states + 1


def test_other_states_are_refused() -> None:
    active, _ = sets("df1_ef2", "2")
    other, _ = sets("df1", "2")
    with pytest.raises(ShortfallError, match=r"^the states of section\d must be \[.*\], not \[.*\]$"):
        transient(active, other)
