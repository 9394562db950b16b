"""The filter from spectra: edges and losses by the stated rule, on signals whose spectra are known."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sosmith.gen.filter.design import minimum_order
from sosmith.gen.filter.response import magnitude_db
from sosmith.instrument.spectrum.prediction import Content, told_apart
from sosmith.instrument.spectrum.proposal import (
    PARTS_OF_DISTURBANCE,
    Proposal,
    _highest_pass_edge,
    _mask,
    propose,
)
from sosmith.instrument.spectrum.report import ripple
from sosmith.instrument.spectrum.settings import SpectrumSettings, Wish
from sosmith.instrument.spectrum.spectra import Array, spectrum
from sosmith.instrument.spectrum.trial import try_filter
from sosmith.model.errors import ShortfallError, SpecificationError

SETTINGS = SpectrumSettings()
BENCH_RATE = 6.0  # Hz: the paper's section 4


def waves(rate: float, seconds: float, frequencies: Array, rms: float, seed: int) -> Array:
    """Sine waves of equal amplitude and random phase, with this rms all together."""
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(frequencies))
    time = np.arange(round(rate * seconds)) / rate
    amplitude = rms * math.sqrt(2 / len(frequencies))
    return np.asarray(np.sum(amplitude * np.sin(2 * np.pi * frequencies * time[:, None] + phase), axis=1))


def content(wanted: Array, disturbance: Array, rate: float, name: str = "trace") -> Content:
    return Content(
        name=name,
        wanted=spectrum(wanted, rate, SETTINGS),
        disturbance=spectrum(disturbance, rate, SETTINGS),
        has_truth=True,
    )


def values_of(proposal: Proposal) -> dict[str, float]:
    return {choice.key: choice.value for choice in proposal.choices}


def paper_bench() -> tuple[Array, Array]:
    """Wanted signal up to 0.1 Hz and disturbance from 0.9 Hz on, as the paper reads its figure 10.

    The rms values are those that the losses of section 4.1, 0.1 and 40 dB, take to a share of 1 um.
    """
    share = 0.001
    wanted = waves(BENCH_RATE, 4000, np.linspace(0.01, 0.1, 19), share / (1 - 10 ** (-0.1 / 20)), 1)
    return wanted, waves(BENCH_RATE, 4000, np.linspace(0.9, 2.9, 41), share * 100, 2)


def test_the_papers_spectra_give_the_papers_choice() -> None:
    wanted, disturbance = paper_bench()
    one = content(wanted, disturbance, BENCH_RATE)
    made = propose([one], Wish(tolerance=0.004, coverage=2), BENCH_RATE)
    width = 4 * one.disturbance.step  # a line of the window of Hann is four frequencies wide
    assert made.needed == pytest.approx(0.1, abs=width)
    equal = _mask([one], made.wish, made.wish.share)
    assert equal is not None
    for stop, passing, stopping in (equal, made.choices[1:]):
        assert stop.value == pytest.approx(0.9, abs=width)
        assert stop.value < 0.9
        assert passing.value == pytest.approx(0.1, rel=0.02)
        assert stopping.value <= 40.2
    assert equal[2].value == pytest.approx(40, abs=0.2)
    more = 10 ** ((equal[2].value - made["stopband_loss"]) / 20)
    assert more in [pytest.approx(part, abs=1e-3) for part in PARTS_OF_DISTURBANCE]


def test_what_the_wanted_signal_does_not_need_goes_to_the_disturbance() -> None:
    """A slow ramp needs nothing: the filter of the same order delays by a third less than with equal shares."""
    rate, time = 100.0, np.arange(30_000) / 100.0
    wanted = 1e-5 * time
    disturbance = 0.5 * np.sin(2 * np.pi * 1.2 * time) + 0.3 * np.sin(2 * np.pi * 2 * time)
    one = content(wanted, disturbance, rate)
    wish = Wish(tolerance=0.2)
    made = propose([one], wish, rate)
    equal = _mask([one], wish, wish.share)
    assert equal is not None
    edge = _highest_pass_edge(made.filter.order, *(choice.value for choice in equal), rate)
    assert made["passband_edge"] > 1.4 * edge
    assert 0.8 * wish.tolerance < wish.coverage * made.predictions[0].rms <= wish.tolerance


def test_with_the_papers_pass_edge_the_order_is_that_of_its_equation() -> None:
    one = content(*paper_bench(), BENCH_RATE)
    made = propose([one], Wish(tolerance=0.004, passband=0.1, passband_loss=0.1), BENCH_RATE)
    assert made["passband_edge"] == 0.1
    warp = [math.tan(math.pi * made[key] / BENCH_RATE) for key in ("stopband_edge", "passband_edge")]
    losses = [10 ** (made[key] / 10) - 1 for key in ("stopband_loss", "passband_loss")]
    assert made.filter.order == math.ceil(math.log(math.sqrt(losses[0] / losses[1])) / math.log(warp[0] / warp[1])) == 3


@pytest.mark.parametrize(("delta", "loss"), [(0.0648, 23.769), (0.0165, 35.65), (0.001, 60.0), (0.129, 17.79)])
def test_the_papers_table_8_is_the_ripple_in_decibels(delta: float, loss: float) -> None:
    motion = waves(100, 40, np.array([49.0]), delta / math.sqrt(2), 1)
    found, attenuation = ripple(spectrum(motion, 100, SETTINGS), 45.0)
    assert found == pytest.approx(delta, rel=0.01)
    assert attenuation == pytest.approx(loss, abs=0.1)


def test_both_edges_are_the_outermost_that_leave_their_shares() -> None:
    rate, noise = 20.0, np.random.default_rng(1).normal(size=(2, 16_000))
    one = content(0.006 * np.cumsum(noise[0]), 0.1 * noise[1], rate)  # both fall or stay over all frequencies
    made = propose([one], Wish(tolerance=0.12), rate)
    share = 0.12 / 4
    equal = _mask([one], made.wish, share)
    assert equal is not None
    assert one.wanted is not None
    step = one.wanted.step
    needed, stop = round(made.needed / step), round(equal[0].value / step)

    def rms(density: Array) -> float:
        return math.sqrt(float(np.sum(density)) * step)

    assert rms(one.wanted.density[needed + 1 :]) <= share < rms(one.wanted.density[needed:])
    assert rms(one.disturbance.density[1 : stop + 1]) <= share < rms(one.disturbance.density[1 : stop + 2])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_proposal_keeps_the_error_within_the_tolerance(seed: int) -> None:
    generator = np.random.default_rng(seed)
    rate, tolerance = 50.0, 0.05
    truth = waves(rate, 800, generator.uniform(0.005, 0.08, 5), 0.3, seed)
    motion = waves(rate, 800, generator.uniform(1, 20, 8), 0.4, seed + 10)
    measured = truth + motion + generator.normal(0, 0.05, len(truth)) + 0.1  # with an offset
    made = propose([content(truth, measured - truth, rate)], Wish(tolerance=tolerance), rate)
    trial = try_filter(measured, truth, None, made)
    assert trial is not None
    assert trial.offset_before == pytest.approx(0.1, abs=0.01)
    assert trial.before == pytest.approx(made.predictions[0].unfiltered, rel=0.05)
    assert 2 * trial.after <= tolerance
    assert trial.after == pytest.approx(made.predictions[0].rms, rel=0.15)


def test_the_response_meets_the_mask_and_no_lower_order_would() -> None:
    one = content(*paper_bench(), BENCH_RATE)
    made = propose([one], Wish(tolerance=0.004), BENCH_RATE)
    value = values_of(made)
    edges = np.array([value["passband_edge"], value["stopband_edge"]])
    gain = magnitude_db(made.filter.sos, edges, BENCH_RATE)
    assert gain[0] >= -value["passband_loss"] - 1e-9
    assert gain[1] <= -value["stopband_loss"] + 1e-9
    assert minimum_order(*(value[c.key] for c in made.choices), BENCH_RATE)[0] == made.filter.order
    assert made.needed <= value["passband_edge"]
    # five digits less a hair: the passband edge is as high as the order allows
    assert minimum_order(value["passband_edge"] * 1.0002, *list(value.values())[1:], BENCH_RATE)[0] > made.filter.order


def test_the_delay_at_zero_frequency_is_the_lag_behind_a_ramp() -> None:
    one = content(*paper_bench(), BENCH_RATE)
    made = propose([one], Wish(tolerance=0.004), BENCH_RATE)
    ramp = np.arange(2000) / BENCH_RATE
    trial = try_filter(ramp, ramp, np.arange(2000) > 1900, made)
    assert trial is not None
    assert -trial.offset_after == pytest.approx(made.delay, rel=1e-6)


def test_several_traces_are_satisfied_together() -> None:
    rate = 20.0
    slow = waves(rate, 800, np.array([0.02]), 0.3, 1)
    first = content(slow, waves(rate, 800, np.array([1.0]), 0.1, 2), rate, "first")
    second = content(slow, waves(rate, 800, np.array([4.0]), 0.4, 3), rate, "second")
    wish = Wish(tolerance=0.1)
    both = propose([first, second], wish, rate)
    alone = [propose([one], wish, rate) for one in (first, second)]
    assert both["stopband_edge"] == min(one["stopband_edge"] for one in alone) == alone[0]["stopband_edge"]
    assert all(one.rms <= 0.05 for one in both.predictions)
    assert "(first)" in both.choices[1].reason
    assert "(second)" in both.choices[3].reason
    assert all(2 * one.rms <= 0.1 for one in both.predictions)


def test_without_truth_the_pass_edge_tells_what_is_wanted() -> None:
    rate = 20.0
    measured = spectrum(
        waves(rate, 800, np.array([0.05]), 0.3, 1) + waves(rate, 800, np.array([2.0]), 0.2, 2), rate, SETTINGS
    )
    wish = Wish(tolerance=0.1, passband=0.1)
    made = propose([told_apart("trace", measured, 0.1)], wish, rate)
    assert wish.coverage * made.predictions[0].rms <= wish.tolerance
    assert made["stopband_loss"] < 20 * math.log10(0.2 / 0.025)
    # as motion alone, the slow part disturbs too, and lies below any passband edge of 0.1 Hz
    motion = Content(name="trace", wanted=None, disturbance=measured, has_truth=False)
    with pytest.raises(ShortfallError, match=r"^tolerance must be at least about 0\.6\d+ for a Butterworth"):
        propose([motion], wish, rate)


@pytest.mark.slow
def test_the_smallest_tolerance_named_is_one_that_will_do() -> None:
    generator = np.random.default_rng(1)
    rate = 20.0
    one = content(waves(rate, 800, np.array([0.5, 1.0]), 0.3, 1), generator.normal(0, 0.1, 16_000), rate)
    with pytest.raises(ShortfallError) as caught:
        propose([one], Wish(tolerance=0.02), rate)
    named = re.match(r"tolerance must be at least about ([\d.]+) for", str(caught.value))
    assert named
    assert float(named[1]) > 0.02
    propose([one], Wish(tolerance=float(named[1])), rate)
    with pytest.raises(ShortfallError):
        propose([one], Wish(tolerance=0.95 * float(named[1])), rate)


def test_no_filter_for_a_disturbance_that_is_within_the_tolerance() -> None:
    one = content(*paper_bench(), BENCH_RATE)
    message = (
        "the disturbance must be worth a filter: without one, 2 times its 0.1 rms is well within the tolerance of 1"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(message)}$"):
        propose([one], Wish(tolerance=1.0), BENCH_RATE)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"tolerance": 0.0}, "tolerance must be a positive number, not 0"),
        ({"coverage": math.nan}, "coverage must be a positive number, not nan"),
        ({"passband": -1.0}, "passband must be a positive number of Hz, not -1"),
        ({"passband_loss": 0.0}, "passband-loss must be a positive number of dB, not 0"),
        ({"passband": 3.0}, "passband must be above 0 and below half the sample rate, 3 Hz, not 3 Hz"),
    ],
)
def test_refusals(given: dict[str, Any], message: str) -> None:
    one = content(*paper_bench(), BENCH_RATE)
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        propose([one], Wish(**({"tolerance": 0.004} | given)), BENCH_RATE)


def test_the_pass_loss_must_be_below_the_stop_loss() -> None:
    one = content(*paper_bench(), BENCH_RATE)
    with pytest.raises(
        SpecificationError, match=r"^passband-loss must be below the (39\.9|40\.0)\d+ dB of the stop band, not 60$"
    ):
        propose([one], Wish(tolerance=0.004, passband_loss=60.0), BENCH_RATE)


@pytest.mark.slow
def test_what_is_slower_than_the_spectra_is_part_of_the_error() -> None:
    one = content(*paper_bench(), BENCH_RATE)
    wish = Wish(tolerance=0.004)
    quick = propose([one], wish, BENCH_RATE)
    room = math.sqrt(0.002**2 - quick.predictions[0].rms ** 2)
    some = propose([replace(one, slow=0.9 * room)], wish, BENCH_RATE)
    assert some.predictions[0].rms == pytest.approx(math.hypot(quick.predictions[0].rms, 0.9 * room))
    more = propose([replace(one, slow=1.05 * room)], wish, BENCH_RATE)
    assert more.filter.order > quick.filter.order  # what is left of the rest has to be less
    assert 2 * more.predictions[0].rms <= 0.004
    with pytest.raises(ShortfallError, match=r"^tolerance must be at least about 0\.00\d+ for a Butterworth"):
        propose([replace(one, slow=0.0019999)], wish, BENCH_RATE)
    message = (
        "tolerance must be above 2 times the 0.003 rms of the disturbance that is slower than segments of 500 s, "
        "which counts as let through, not 0.004: longer segments may tell it apart"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(message)}$"):
        propose([replace(one, slow=0.003)], wish, BENCH_RATE)


def test_motion_alone_needs_a_passband_edge() -> None:
    motion = spectrum(waves(20, 800, np.array([2.0]), 0.2, 2), 20, SETTINGS)
    message = "the passband edge must be given, by --passband in Hz or --time-constant in s, if no trace has its truth"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        propose([Content(name="m", wanted=None, disturbance=motion, has_truth=False)], Wish(), 20)
