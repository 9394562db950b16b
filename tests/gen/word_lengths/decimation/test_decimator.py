"""A decimated filter from specification to proof: what it costs beside the direct one, and where it is refused."""

import math
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.gen.word_lengths.decimated import locomotive, locomotive_spec, locomotive_text

from sosmith.gen.core import design_core
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.decimation_facts import direct_design, rate_costs
from sosmith.gen.output.manifest import manifest
from sosmith.gen.specification.specification import from_text
from sosmith.gen.word_lengths.decimation.decimator import pre_stage_of
from sosmith.gen.word_lengths.quantized import DECIMATION
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.interface.design import Design
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.port import Port
from sosmith.model.reference.golden import entering_filter, filtered


@pytest.mark.slow
def test_the_locomotive_costs_less_than_without() -> None:
    """The same proven millimetres with fewer clocks and less memory, and a delay at most a tenth longer."""
    made = locomotive()
    direct = direct_design(made)
    ours, theirs = rate_costs(made), rate_costs(direct)
    assert direct.datapath.decimator is None
    assert ours.architecture == theirs.architecture == "folded"
    assert made.quantized.bound * made.datapath.output.lsb <= made.spec.max_error
    assert ours.bound <= theirs.bound <= float(made.spec.max_error)
    assert ours.clocks_per_sample * 10 < theirs.clocks_per_sample
    assert ours.memory_bits is not None
    assert theirs.memory_bits is not None
    assert ours.memory_bits + ours.decimator_bits < theirs.memory_bits
    assert ours.delay <= 1.1 * theirs.delay
    assert theirs.clocks_per_sample == direct.architecture.cycles_per_sample


@pytest.mark.slow
def test_the_decimator_is_a_row_of_the_budget() -> None:
    made = locomotive()
    decimator, output = made.datapath.decimator, made.datapath.output
    assert decimator is not None
    share = made.quantized.budget[DECIMATION]
    assert decimator.rounding / output.lsb < share < 2 * decimator.rounding / output.lsb
    assert share <= (made.spec.max_error / output.lsb - Fraction(1, 2)) / 32
    assert made.quantized.bound == sum(made.quantized.budget.values())


@pytest.mark.slow
def test_facts_for_programs() -> None:
    made = locomotive()
    tree = manifest(core_facts(made))
    found = tree["decimation"]
    clocks = made.architecture.cycles_per_result
    assert (found["factor"], found["stages"], found["width"], found["dropped"]) == (16, 4, 32, 10)
    assert found["cycles_per_result"] == clocks
    assert tree["cycles_per_sample"] == -(-clocks // 16)
    assert [(band["low"], band["high"]) for band in found["aliasing"][:2]] == [
        pytest.approx((6.25 * k - 0.2587802, 6.25 * k + 0.2587802)) for k in (1, 2)
    ]
    assert found["aliasing"][-1]["high"] == 50
    assert max(band["gain_db"] for band in found["aliasing"]) == pytest.approx(-109.06, abs=0.01)
    assert found["worst_aliasing"] <= float(made.spec.max_error)
    assert [(band["whole_low"], band["whole_high"]) for band in found["aliasing"]] == [
        (6.25 * k - 3.125, min(6.25 * k + 3.125, 50)) for k in range(1, 9)
    ]
    assert max(band["largest_db"] for band in found["aliasing"]) == found["largest_db"]
    assert found["largest_db"] == pytest.approx(-111.9, abs=0.01)
    assert found["aliasing"][0]["largest_at"] == pytest.approx(0.2655, abs=1e-3)
    # The amplitude of a sine over all codes of the input, 16 mm from end to end.
    assert found["largest"] == pytest.approx(8 * (1 - 2**-16) * 10 ** (found["largest_db"] / 20), rel=1e-9)
    assert found["direct_largest_db"] == pytest.approx(
        -20 * 7 * math.log10(math.tan(math.pi / 32) / math.tan(math.pi * 0.002587802)), abs=0.01
    )
    assert made.reasons["architecture"] == (
        f"folded: the smallest that keeps up; takes {clocks} of 1,920,000 clocks for 16 samples"
    )


@pytest.mark.parametrize("scenario", ["worst_case", "worst_case_errors", "noise"])
def test_no_input_exceeds_the_bound(scenario: str) -> None:
    made = locomotive()
    quantized, datapath = made.quantized, made.datapath
    assert quantized.filter is not None
    (trace,) = traces_for(made, scenario, seed=1)
    exact = filtered(
        entering_filter(trace.codes, datapath, None), quantized.filter.sos, datapath.output, steady=quantized.steady
    )
    error = np.abs(datapath.output.decode(datapath.compute(trace.codes)) - exact).max()
    bound = float(quantized.bound * datapath.output.lsb)
    assert 0.5 * bound < error <= bound


def test_a_constant_is_there_from_the_first_result_on() -> None:
    datapath = locomotive().datapath
    codes = np.full((100, 1), 12345)
    assert datapath.compute(codes).tolist() == [12345] * 7


def test_the_response_from_the_input_on() -> None:
    """A sine at the input, folded or not, comes out with the gain that is told."""
    design = Design(locomotive())
    port, output = design.core.datapath.inputs[0], design.core.datapath.output
    frequencies = np.array([0.1, 0.25, 1.0, 6.25 - 0.2])
    gains = abs(design.frequency_response(frequencies))
    assert gains[0] == pytest.approx(1, abs=0.001)
    assert gains[1] == pytest.approx((1 + (0.25 / 0.2587802) ** 14) ** -0.5, abs=1e-3)
    time = np.arange(40_000) / 100
    sine = port.decode(port.encode(8 + 7.9 * np.sin(2 * np.pi * frequencies[1] * time)))
    result = design.run(clearance_in=sine)[1000:]
    assert len(result) == 1500
    assert (result.max() - result.min()) / 2 / 7.9 == pytest.approx(gains[1], abs=2e-3)
    assert gains[3] < float(design.core.spec.max_error / output.lsb) / 2**15


@pytest.mark.slow
def test_what_is_not_worth_it_is_not_decimated() -> None:
    spec = locomotive_spec()
    wanted = replace(spec, filter=replace(spec.filter, order=2, cutoff=(Fraction(20),)))
    made = design_core(wanted, core="filter")
    assert made.datapath.decimator is None
    assert made.reasons["decimation"] == (
        "none: no power of two has a delay at most 10 % longer and a gain within 0.1 dB"
    )
    assert made.quantized.bound == direct_design(made).quantized.bound
    assert manifest(core_facts(made))["decimation"] is None
    assert Design(made).rate_costs == {}


def refused(sentence: str, error: type[Exception] = SpecificationError) -> pytest.RaisesExc[Exception]:
    return pytest.raises(error, match=f"^{re.escape(sentence)}$")


def test_a_calibration_alone_is_not_decimated() -> None:
    assert design_core(locomotive_spec(), core="calibration").datapath.decimator is None


def test_a_board_wants_a_result_for_each_sample(tmp_path: Path) -> None:
    made = locomotive()
    sentence = (
        "locomotive.toml: filter.hold must be true with filter.decimate = 16 on a board, which returns a result for "
        "each sample, not false"
    )
    with refused(sentence):
        Design(made).build("icebreaker", folder=tmp_path)
    with refused(sentence):
        Design(made).board()


def test_an_input_as_wide_as_can_be() -> None:
    spec = locomotive_spec("16")
    x = Port.from_range("x", 32, Fraction(0), Fraction(16))
    pre_stage, _ = pre_stage_of(spec.filter, spec.sample_rate, (x,), spec.output, spec.max_error)
    assert pre_stage is not None
    assert pre_stage.decimator.output.bits == 32
    sharp = Port.from_range("y", 32, Fraction(0), Fraction(16))
    sentence = (
        "the rounding behind the decimator must take at most half of the error allowed, not 0.791 output LSB with "
        "32 bits: raise output.max_error or output.bits"
    )
    with refused(sentence, ShortfallError):
        pre_stage_of(spec.filter, spec.sample_rate, (x,), sharp, Fraction(16, 2**32))


def test_a_factor_that_lets_too_much_fold_is_refused() -> None:
    text = locomotive_text("64").replace("max_error = 0.00025", "max_error = 1e-6")
    text = text.replace("[output]\nbits = 16", "[output]\nbits = 30")
    sentence = (
        "filter.decimate must be so small that a full-scale sine which folds into the pass band is at "
        "most output.max_error with 12 stages of at most 63 bits, not 64"
    )
    with refused(sentence, ShortfallError):
        design_core(from_text(text, Path("locomotive.toml")), core="filter")


def test_no_lattice_behind_a_decimator() -> None:
    spec = locomotive_spec("16")
    sentence = (
        "locomotive.toml: the realization must be another one with filter.decimate = 16, not lattice_wdf: with its "
        "droop corrected, the filter is no sum of two allpass filters"
    )
    with refused(sentence):
        design_core(spec, core="filter", realization="lattice_wdf")


@pytest.mark.slow
def test_a_clock_that_is_too_slow() -> None:
    spec = locomotive_spec("16", "folded")
    slow = replace(spec, hardware=replace(spec.hardware, clock=Fraction(500), realization="df2t"))
    sentence = (
        "the folded architecture takes 118 clocks for 16 samples: at a clock of 500 Hz the sample rate must be at most "
        "67.7966 Hz, not 100 Hz"
    )
    with refused(sentence, ShortfallError):
        design_core(slow, core="filter")
