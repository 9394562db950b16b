"""Other constants for a core that starts from its first sample: what is held through a swap, and what is refused."""

from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES
from tests.gen.reload.swaps import moved
from tests.model.reload.swapping import compute_swapping

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.proof.cascade_proof import quantized_response
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.reload.first_samples import check_samples, first_samples, held_codes, samples_of
from sosmith.gen.reload.other_constants import with_constants
from sosmith.gen.reload.register_writes import reload_json
from sosmith.gen.reload.reload import check_swap, other_set, own_set, room_of
from sosmith.gen.reload.transient import transient
from sosmith.gen.specification.specification import load
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.gen.word_lengths.input_stage import InputStage, Start, starting_like
from sosmith.gen.word_lengths.quantize import gain_at_zero
from sosmith.gen.word_lengths.quantized import START, Quantized
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.reload.constants import with_ranges
from sosmith.model.sections.output import FirstSample


@cache
def hardware(example: str, architecture: str) -> CoreDesign:
    spec = load(EXAMPLES / f"{example}.toml")
    wanted = replace(spec.hardware, architecture=architecture, reload=True, start="steady", realization="df1_ef2")
    return design_core(replace(spec, hardware=wanted))


def scaled(design: CoreDesign, ratio: str) -> Polynomial:
    polynomial = design.quantized.polynomial
    assert polynomial is not None
    return Polynomial(tuple(tuple(Fraction(ratio) * c for c in row) for row in polynomial.coefficients))


def during(made: CoreDesign, active: Quantized, other: Quantized) -> Datapath:
    """Return the other set with the ranges that are proven for the swap."""
    held = first_samples(made.quantized)
    found = transient(active, other, held).ranges
    before = len(other.datapath.stages) - len(found) - 2
    return with_ranges(other.datapath, [*[{}] * before, held_codes(other, held), *found, {}])


@pytest.mark.slow
@pytest.mark.parametrize("example", ["audio_lowpass", "flange_wear_bench"])
def test_nothing_leaves_its_range_whatever_is_held(example: str) -> None:
    """First samples, and all others, at the ends of the codes: before, during and after swaps there and back."""
    made = hardware(example, "folded")
    own = with_constants(made.quantized, None, None, room=room_of(made))
    if made.quantized.polynomial is None:
        other = with_constants(made.quantized, moved(made, "1.05"), None, room=room_of(made))
    else:
        other = with_constants(made.quantized, None, scaled(made, "1.03"), room=room_of(made))
    for ranges in transient(own, other, first_samples(made.quantized)).ranges:
        for low, high in (ends for name, ends in ranges.items() if name in {"x", "v"}):
            assert -low == pytest.approx(high, rel=1e-5)  # the first sample may be at either end
    ways = [during(made, own, other), during(made, other, own)]
    rng = np.random.default_rng(1)
    for first in (0, 1):
        ends = np.array([[port.lowest, port.highest] for port in made.datapath.inputs])
        chosen = rng.integers(2, size=(300, 1)).repeat(rng.integers(1, 20, 300), axis=0)[:400]
        chosen[0] = first
        codes = np.where(chosen == 1, ends[:, 1], ends[:, 0])
        results = compute_swapping(own.datapath, [(150, ways[0]), (290, ways[1])], codes)
        assert len(results) == 400


@pytest.mark.parametrize("architecture", ["parallel", "folded"])
def test_a_calibration_of_about_the_same_range_is_loaded_and_another_is_refused(architecture: str) -> None:
    made = hardware("flange_wear_bench", architecture)
    own, near, far = (
        own_set(made),
        *(
            other_set(made, polynomial=scaled(made, ratio), max_error=3 * made.spec.max_error)
            for ratio in ("1.03", "1.35")
        ),
    )
    swap = check_swap(made, own, near)
    assert swap.samples > 0
    assert swap.use < 1
    sentence = (
        r"the calibration's values must stay within 0\.\.14\.\d+ mm, the range of first samples that may be held, "
        r"not 0\.\d+\.\.15\.\d+: stop the samples and reset the core before the first one with the new set"
    )
    for pair in ((own, far), (far, own)):
        with pytest.raises(ShortfallError, match=f"^{sentence}$"):
            check_swap(made, *pair)
    assert check_swap(made, None, far).samples == 0


def test_first_samples_stay_on_their_side_of_zero() -> None:
    made = hardware("flange_wear_bench", "folded").quantized
    (low, high), (least, most) = samples_of(made), first_samples(made)
    assert 0 <= least < low
    assert most == high + (high - low) / 4
    check_samples(made, (low, high))
    plain_filter = hardware("audio_lowpass", "folded").quantized
    assert first_samples(plain_filter) == samples_of(plain_filter)


@pytest.mark.slow
def test_the_error_of_a_set_counts_first_samples_of_others() -> None:
    """If its gain at zero frequency is off by a rounding, and they may lie further away than its own."""
    spec = load(EXAMPLES / "flange_wear_bench.toml")
    ripple = replace(spec.filter, family="chebyshev1", order=2, passband_loss=Fraction(1))
    wanted = replace(spec.hardware, architecture="folded", start="steady", reload=True)
    made = design_core(replace(spec, filter=ripple, hardware=wanted)).quantized
    assert made.first_sample is not None
    assert not made.first_sample.is_plain
    own = with_constants(made, None, None)
    assert made.filter is not None
    off = abs(
        quantized_response([linear_models(section.graph) for section in made.sections]).at_zero_frequency
        - gain_at_zero(made.filter)
    )
    low, high = samples_of(made)
    held = first_samples(made)
    least = off * (held[1] - held[0] - (high - low))
    assert off > 0
    assert least <= own.budget[START] <= least + made.budget[START] * 2


def test_a_gain_that_the_hardware_cannot_give_is_refused() -> None:
    stage = InputStage(stages=(), output=Range(0, -128, 127), error=Fraction(0))
    plain_gain = FirstSample(range=stage.output, gain=1, gain_frac=0)
    for gain, held, have in ((2, plain_gain, "1"), (0, plain_gain, "1"), (1, None, "0")):
        with pytest.raises(
            ShortfallError, match=f"^the gain at zero frequency must be {have}, as the hardware has it, not {gain}$"
        ):
            starting_like(stage, Fraction(gain), held)
    made = starting_like(stage, Fraction(3, 4), FirstSample(range=stage.output, gain=5, gain_frac=3))
    assert made.start == Start(first_sample=FirstSample(range=stage.output, gain=6, gain_frac=3), error=Fraction(0))


@pytest.mark.parametrize("architecture", ["parallel", "folded"])
def test_a_core_that_judges_wear_restarts_and_takes_any_set(architecture: str) -> None:
    """A calibration that is refused where first samples are held needs no proof of a swap here."""
    plain = hardware("flange_wear_bench", architecture)
    limits = WearSpec(initial=(Fraction(1),), warning=Fraction(4), limit=Fraction(6))
    made = design_core(replace(plain.spec, wear=limits))
    assert (plain.architecture.restarts, made.architecture.restarts) == (False, True)
    assert made.architecture.fingerprint != plain.architecture.fingerprint
    assert core_facts(made).reload.restarts
    far = other_set(made, polynomial=scaled(made, "1.35"), max_error=3 * made.spec.max_error)
    for pair in ((own_set(made), far), (far, own_set(made))):
        assert check_swap(made, *pair).samples == 0
    tree = reload_json(made, check_swap(made, own_set(made), far), 1)
    assert (tree["restarts"], tree["transient_samples"]) == (True, 0)
    assert tree["error_after_transient"] == tree["error_bound"]
    assert not design_core(made.spec, core="calibration").architecture.restarts  # it has no states
