"""Datapaths that take over from each other: the same as one alone where nothing changes, and continuous at rest."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from tests.gen.designs import example_design
from tests.model.reload.swapping import compute_swapping

from sosmith.gen.filter.design import design
from sosmith.gen.reload.other_constants import with_constants
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import RangeError


def pair(realization: str) -> tuple[Datapath, Datapath]:
    """Make the audio low-pass, and the same with its cutoff a tenth lower in the same formats."""
    made = example_design("audio_lowpass.toml", realization=realization)
    assert made.spec.filter.cutoff is not None
    lower = replace(made.spec.filter, cutoff=tuple(value * Fraction(9, 10) for value in made.spec.filter.cutoff))
    ideal = design(lower, float(made.spec.sample_rate))
    return made.datapath, with_constants(made.quantized, ideal, None).datapath


def test_swaps_to_itself_change_nothing() -> None:
    first, _ = pair("df1_ef2")
    codes = np.random.default_rng(1).integers(-30000, 30000, (50, 1))
    assert compute_swapping(first, [(0, first), (20, first), (20, first)], codes) == first.compute_exact(codes)


def test_a_swap_acts_from_its_sample_on() -> None:
    first, other = pair("df1_ef2")
    codes = np.random.default_rng(1).integers(-30000, 30000, (60, 1))
    alone = first.compute_exact(codes)
    assert compute_swapping(first, [(0, other)], codes) == other.compute_exact(codes)
    for at in (20, 21):
        swapped = compute_swapping(first, [(at, other)], codes)
        assert swapped[:at] == alone[:at]
        assert swapped[at:] != alone[at:]
    assert compute_swapping(first, [(20, other)], codes) != compute_swapping(first, [(21, other)], codes)
    assert compute_swapping(first, [(20, first), (20, other)], codes) == compute_swapping(first, [(20, other)], codes)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("realization", ["df1", "df1_ef1", "df1_ef2"])
def test_direct_form_i_is_continuous_at_rest(realization: str) -> None:
    """Its states are samples: where input and output stand still, another filter of the same gain moves nothing."""
    first, other = pair(realization)
    codes = np.full((2600, 1), 12345)
    results = np.array(compute_swapping(first, [(2000, other)], codes))
    assert np.ptp(results[1900:]) <= 1


@pytest.mark.slow
def test_a_state_of_another_filter_may_leave_the_ranges_that_are_proven_from_reset() -> None:
    """The proofs do not cover a swap: with rails as input and twice the cutoff, values come out of their ranges."""
    made = example_design("audio_lowpass.toml", realization="df1_ef2")
    assert made.spec.filter.cutoff is not None
    higher = replace(made.spec.filter, cutoff=tuple(2 * value for value in made.spec.filter.cutoff))
    other = with_constants(made.quantized, design(higher, float(made.spec.sample_rate)), None).datapath
    port = made.datapath.inputs[0]
    codes = np.where(np.arange(400) // 78 % 2, port.highest, port.lowest).reshape(-1, 1)
    other.compute_exact(codes)

    def swapped_anywhere() -> None:
        for at in range(100, 300, 9):
            compute_swapping(made.datapath, [(at, other)], codes)

    with pytest.raises(RangeError, match=r"^(v|taps_A1|taps_A2) must be in -\d+\.\.\d+, not -?\d+$"):
        swapped_anywhere()


def test_states_must_be_the_same() -> None:
    first, _ = pair("df1_ef2")
    another = example_design("audio_lowpass.toml", realization="df2t").datapath
    with pytest.raises(ValueError, match=r"^states must be \[.*\], not \[.*\]$"):
        compute_swapping(first, [(0, another)], np.zeros((1, 1), dtype=np.int64))
