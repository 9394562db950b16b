"""A decimated instrument from specification to proof: the calibration before the decimator, and what it costs."""

import re
import tomllib
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES
from tests.gen.word_lengths.decimated import INSTRUMENT, locomotive, locomotive_spec, locomotive_text, small
from tests.gen.word_lengths.multirate import exact_results, worst_error

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.decimation import Decimation
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.decimation_facts import direct_design, rate_costs
from sosmith.gen.output.manifest import manifest
from sosmith.gen.specification.specification import from_text, from_tree
from sosmith.gen.word_lengths.decimation import decimator as decimator_module
from sosmith.gen.word_lengths.decimation.calibration import calibration_before_decimator
from sosmith.gen.word_lengths.quantized import CALIBRATION, DECIMATION
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.instrument.uncertainty.instrument_budget import instrument_of
from sosmith.model.dataflow.graph import Op
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.reference.golden import entering_filter, filtered


def whole(decimate: str = '"auto"', architecture: str = "auto") -> CoreDesign:
    return locomotive(decimate, architecture, "instrument")


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["worst_case", "worst_case_errors"])
def test_no_input_exceeds_the_bound(scenario: str) -> None:
    made = whole()
    (trace,) = traces_for(made, scenario, seed=1)
    bound = float(made.quantized.bound)
    assert made.quantized.bound * made.datapath.output.lsb <= made.spec.max_error
    assert 0.5 * bound < worst_error(made, trace.codes) <= bound


@pytest.mark.slow
def test_random_codes_and_constants_stay_within_the_bound() -> None:
    made = whole()
    rng = np.random.default_rng(5)
    codes = np.concatenate([rng.integers(0, 65536, (3000, 2)), np.repeat(rng.integers(0, 65536, (6, 2)), 800, axis=0)])
    assert worst_error(made, codes) <= float(made.quantized.bound)


@pytest.mark.slow
def test_the_golden_chain_is_the_exact_one() -> None:
    made = whole()
    quantized, datapath = made.quantized, made.datapath
    codes = np.random.default_rng(2).integers(0, 65536, (2000, 2))
    assert quantized.filter is not None
    values = entering_filter(codes, datapath, quantized.polynomial)
    golden = filtered(values, quantized.filter.sos, datapath.output, steady=True) / float(datapath.output.lsb)
    assert np.abs(golden - exact_results(made, codes)).max() < 1e-8
    assert len(entering_filter(codes[:0], datapath, quantized.polynomial)) == 0


@pytest.mark.slow
def test_a_constant_is_there_from_the_first_result_on() -> None:
    datapath = whole().datapath
    assert len(set(datapath.compute(np.tile([12345, 23456], (100, 1))).tolist())) == 1


def test_the_calibration_is_a_row_of_the_budget() -> None:
    made = whole()
    quantized, ahead, output = made.quantized, made.quantized.calibration, made.datapath.output
    assert ahead is not None
    port = ahead.datapath.output
    # The filter's peak gain is between one and two.
    least = ahead.bound * port.lsb / output.lsb
    assert least < quantized.budget[CALIBRATION] < 2 * least
    assert quantized.budget[CALIBRATION] <= (made.spec.max_error / output.lsb - Fraction(1, 2)) / 4
    assert list(quantized.budget)[:2] == [CALIBRATION, DECIMATION]
    assert quantized.bound == sum(quantized.budget.values())


@pytest.mark.slow
def test_nothing_is_limited_before_the_decimator() -> None:
    """The port takes all that the polynomial can give, also where that is far outside the output's range."""
    tree = tomllib.loads(INSTRUMENT.format(extra=""), parse_float=Decimal)
    tree["calibration"]["coefficients"] = [[Decimal(-30), Decimal("0.5")], [Decimal(9)], [Decimal("-1.5")]]
    made = design_core(from_tree(tree, Path("slight.toml")))
    ahead, output = made.datapath.calibration, made.datapath.output
    assert ahead is not None
    assert not [node for stage in ahead.stages for node in stage.graph.nodes if node.op is Op.CLAMP]
    assert ahead.output.signed
    assert ahead.output.lsb < output.lsb
    low, high = (code * ahead.output.lsb for code in ahead.result_range)
    assert low < -80 < 16 < high
    codes = np.random.default_rng(3).integers(0, 1 << 10, (1500, 2))
    codes[700:1000] = [1023, 0]
    codes[1000:1300] = [300, 1023]
    exact = exact_results(made, codes)
    assert (exact.min(), exact.max()) == (output.lowest, output.highest)  # what is limited at the end
    assert worst_error(made, codes) <= float(made.quantized.bound)


@pytest.mark.slow
def test_the_locomotive_costs_less_than_without() -> None:
    made = whole()
    ours, theirs = rate_costs(made), rate_costs(direct_design(made))
    ahead, behind = made.architecture.calibration, made.architecture
    assert ahead is not None
    assert ours.architecture == theirs.architecture == "folded"
    assert ours.clocks_per_sample == ahead.cycles_per_sample  # which is the slower of the two
    assert ours.clocks_per_sample * 3 < theirs.clocks_per_sample
    assert ahead.program is not None
    assert behind.program is not None
    words = ahead.program.words + behind.program.words
    assert ours.memory_bits == words * 16
    assert theirs.memory_bits is not None
    assert ours.memory_bits < theirs.memory_bits
    assert ours.bound <= theirs.bound <= float(made.spec.max_error)


@pytest.mark.slow
def test_facts_for_programs() -> None:
    made = whole()
    tree = manifest(core_facts(made))
    found, ahead = tree["decimation"], made.architecture.calibration
    assert ahead is not None
    told = found["calibration"]
    assert told["architecture"] == "folded"
    assert told["cycles_per_sample"] == ahead.cycles_per_sample == tree["cycles_per_sample"]
    assert found["cycles_per_result"] == 16 * ahead.cycles_per_sample
    assert (told["bits"], told["lsb"]) == (20, 2**-16)
    assert (told["low"], told["high"]) == pytest.approx((0.699, 11.491), abs=0.001)
    assert told["error"] <= float(made.quantized.budget[CALIBRATION] * made.datapath.output.lsb)
    assert tree["formats"][0]["stage"] == "row_power1"
    clocks = ahead.cycles_per_sample
    assert made.reasons["calibration before the decimator"] == (
        f"folded: the smallest that keeps up; takes {clocks} of 120,000 clocks a sample"
    )
    assert "calibration" not in manifest(core_facts(locomotive()))["decimation"]


def test_what_folds_is_counted_over_the_calibrations_range() -> None:
    made = whole()
    ahead, found = made.datapath.calibration, manifest(core_facts(made))["decimation"]
    assert ahead is not None
    low, high = ahead.result_range
    span = float((high - low) * ahead.output.lsb)
    worst = 10 ** (max(band["passing_db"] for band in found["aliasing"]) / 20) * span / 2
    assert found["worst_aliasing"] == pytest.approx(worst, rel=1e-6)
    assert worst <= float(made.spec.max_error)


def at_clock(clock: int, **changes: Any) -> CoreDesign:
    spec = locomotive_spec("4")
    return design_core(replace(spec, hardware=replace(spec.hardware, clock=Fraction(clock), **changes)))


@pytest.mark.slow
def test_each_has_the_smallest_architecture_that_keeps_up() -> None:
    """The filter has four times as long as the calibration."""
    made = at_clock(3500, realization="df2t")
    assert made.architecture.calibration is not None
    assert (made.architecture.calibration.name, made.architecture.name) == ("parallel", "folded")
    assert made.reasons["calibration before the decimator"] == (
        "parallel: before the decimator, the folded architecture takes 41 clocks a sample: at a clock of 3,500 Hz the "
        "sample rate must be at most 85.3658 Hz, not 100 Hz"
    )
    assert rate_costs(made).architecture == "parallel, folded"
    assert made.architecture.cycles_per_result == 137
    slower = at_clock(800, realization="df2t")
    assert rate_costs(slower).architecture == "parallel"
    with refused(
        "before the decimator, the folded architecture takes 41 clocks a sample: at a clock of 3,500 Hz the "
        "sample rate must be at most 85.3658 Hz, not 100 Hz"
    ):
        at_clock(3500, architecture="folded")


@pytest.mark.slow
def test_multipliers_are_shared_out() -> None:
    """Of a single multiplier block the calibration takes all there is, so that the filter shifts and adds."""
    made = at_clock(12_000_000, multipliers=1)
    assert made.architecture.calibration is not None
    assert made.architecture.calibration.name == "folded"
    assert made.architecture.calibration.multiplier_blocks == 1
    assert made.architecture.name == "serial"
    both = at_clock(12_000_000, multipliers=2)
    assert (both.architecture.name, both.architecture.multiplier_blocks) == ("folded", 1)


def refused(sentence: str) -> pytest.RaisesExc[Exception]:
    return pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$")


def test_a_result_too_wide_for_a_port() -> None:
    inputs = [Port.from_range(name, 16, Fraction(0), Fraction(1)) for name in ("voltage", "temperature")]
    output = Port.from_range("y", 16, Fraction(0), Fraction(1), unit="mm")
    polynomial = Polynomial.from_numbers([["5000", "0"], ["-7000"]])
    made = calibration_before_decimator("wide", inputs, polynomial, output, Fraction(1, 2))
    assert made.datapath.output.bits == 31
    with refused(
        "what the calibration gives to the decimator must have at most 32 bits, not 33: raise output.max_error or "
        "narrow the ranges of the inputs"
    ):
        calibration_before_decimator("wide", inputs, polynomial, output, Fraction(1, 8))


def test_registers_too_wide_for_the_models() -> None:
    spec = locomotive_spec("16")
    x = Port.from_range("x", 20, Fraction(0), Fraction(1))
    found = Decimation(factor=64, stages=8, sample_rate=spec.sample_rate, edge=Fraction(1, 4))
    with refused("the registers of the decimator must have at most 63 bits, not 68: lower filter.decimate"):
        decimator_module._rounded(x, found, coarsest=Fraction(1), allowed=Fraction(1))


@pytest.mark.slow
@pytest.mark.parametrize("hold", [False, True])
def test_wear_is_judged_behind_the_filter(hold: bool) -> None:
    wear = "\n[wear]\ninitial = 4.0\nwarning = 1.4\nlimit = 1.8\n"
    text = locomotive_text(architecture="folded", hold=hold) + wear
    made = design_core(from_text(text, Path("locomotive.toml")))
    assert len(made.datapath.wear) == 1
    ahead, decimator = made.datapath.calibration, made.datapath.decimator
    assert ahead is not None
    assert decimator is not None
    assert not ahead.wear
    codes = np.concatenate([np.tile([c, 20000], (3000, 1)) for c in (20000, 30000, 40000)])
    status, results = made.datapath.compute_status(codes), made.datapath.compute(codes)
    ((warning, critical),) = made.datapath.wear
    assert ((status >> 3 & 1).astype(bool) == (results >= warning)).all()
    assert ((status >> 4 & 1).astype(bool) == (results >= critical)).all()
    assert set((status >> 3 & 3).tolist()) == {0, 1, 3}
    assert made.architecture.copies_per_result == (16 if hold else 1)


def test_the_uncertainty_is_that_of_the_whole_chain() -> None:
    """Its delay is that of decimator and filter; of white noise, the lower rate lets as much through."""
    stated = """
[calibration.uncertainty]
voltage = [0.0, 10.0]
temperature = [0.0, 128.0]
covariance = [[1e-6, 0, 0, 0, 0], [0, 1e-9, 0, 0, 0], [0, 0, 1e-7, 0, 0], [0, 0, 0, 1e-10, 0], [0, 0, 0, 0, 1e-8]]
systematic = 0.001

[uncertainty]
noise = 0.01
clearance_rate = 0.001
motion = [[0.25, 1.0], [6.0, 1.0]]
"""
    found = {}
    for decimate in ('decimate = "auto"\n', ""):
        text = locomotive_text().replace('decimate = "auto"\n', decimate) + stated
        instrument = instrument_of(from_text(text, Path("locomotive.toml")))
        assert instrument is not None
        budget = instrument.budget(np.array([5.0]), np.array([20.0]))
        found[bool(decimate)] = {one.source: one.contribution[0] for one in budget.contributions}
    ours, theirs = found[True], found[False]
    assert ours["delay of a moving reading"] / theirs["delay of a moving reading"] == pytest.approx(1.088, abs=0.002)
    assert ours["sensor noise"] == pytest.approx(theirs["sensor noise"], rel=0.01)
    assert ours["motion at 0.25 Hz"] == pytest.approx(theirs["motion at 0.25 Hz"], rel=0.01)
    assert 0 < ours["motion at 6 Hz"] < 1e-5


@pytest.mark.slow
def test_another_calibration_exceeds_the_bound() -> None:
    """A coefficient that is half an LSB wrong is found by the exact reference."""
    made = small()
    quantized, datapath = made.quantized, made.datapath
    assert quantized.calibration is not None
    assert quantized.polynomial is not None
    codes = np.random.default_rng(4).integers(0, 1 << 10, (4000, 2))
    assert worst_error(made, codes) <= float(quantized.bound)
    (first, *more), *rows = quantized.polynomial.coefficients
    wrong = Polynomial(((first + datapath.output.lsb / 2, *more), *rows))
    other = calibration_before_decimator("slight_ahead", datapath.inputs, wrong, datapath.output, Fraction(1, 16))
    ahead = replace(other.datapath, output=quantized.calibration.datapath.output)
    assert other.datapath.output.lsb == ahead.output.lsb
    changed = replace(quantized, datapath=replace(datapath, calibration=ahead))
    assert worst_error(replace(made, quantized=changed), codes) > float(quantized.bound)


@pytest.mark.slow
def test_a_fitted_calibration_says_what_is_outside_of_it() -> None:
    """The codes that its measurements covered are judged before the decimator, of every sample."""
    text = re.sub(r"calibration\.coefficients = .*", 'calibration.data = "april.csv"', INSTRUMENT.format(extra=""))
    made = design_core(from_text(text, EXAMPLES / "measurements" / "slight.toml"))
    ahead, datapath = made.datapath.calibration, made.datapath
    assert ahead is not None
    assert made.architecture.calibration is not None
    assert made.architecture.calibration.datapath == ahead
    assert ahead.calibrated == datapath.calibrated != ((0, 1023), (0, 1023))
    (_, highest), (_, warmest) = datapath.calibrated
    assert highest < 1023 or warmest < 1023
    inside = [low + 1 for low, _ in datapath.calibrated]
    codes = np.tile(inside, (21, 1))
    codes[6] = [highest + 1 if highest < 1023 else inside[0], warmest + 1 if warmest < 1023 else inside[1]]
    assert (datapath.compute_status(codes) >> 1 & 1).tolist() == [0, 0, 1, 0, 0, 0]
    assert len(datapath.behind_decimator.calibrated) == 1
