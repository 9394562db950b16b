"""The report: its measures against independent computations, its verdicts, and the page's promises."""

from __future__ import annotations

import doctest
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal
from tests.gen.report.evidences import (
    F7,
    LSB,
    OUTPUT,
    Array,
    Page,
    bandpass,
    changed,
    evidence,
    facts,
    page_of,
    plain,
    rounded,
)
from tests.gen.report.pictures import without_pictures

from sosmith.gen import quantity
from sosmith.gen.facts.design_tables import ErrorUnit
from sosmith.gen.filter import response, step_response
from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.output.core_facts import (
    CoefficientFacts,
    NodeFormat,
    SectionFacts,
    SettlingFacts,
)
from sosmith.gen.report.evidence import Alternative, Evidence
from sosmith.gen.report.figures import filter_plots, painting, run_plots
from sosmith.gen.report.largest_error import close_up, error_limits
from sosmith.gen.report.mask import mask_shortfalls
from sosmith.gen.report.page import render_page
from sosmith.gen.report.report import summarise, write_report


def masked(order: int, **changes: Any) -> FilterFacts:
    """Low-pass with the mask of the paper's Table 9 (10 Hz, 0.02 dB, 45 Hz, 60 dB)."""
    sos = signal.butter(order, 14.17, fs=100, output="sos")
    known: dict[str, Any] = {
        "ideal_sos": sos,
        "quantized_sos": sos,
        "passband_edge": (10.0,),
        "stopband_edge": (45.0,),
        "passband_loss": 0.02,
        "stopband_loss": 60.0,
    }
    return facts(**(known | changes))


CASES: dict[str, Callable[[], Evidence]] = {
    "instrument": evidence,
    "failing": lambda: evidence(wrong=3, error_bound=0.00001),
    "plain": plain,
    "bandpass": bandpass,
}


@pytest.fixture(scope="module", params=CASES, name="built")
def build(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path, dict[str, Any]]:
    """Name, folder and summary of each case, written once for all tests."""
    directory = tmp_path_factory.mktemp(request.param) / "made" / "on the way"
    return request.param, directory, write_report(CASES[request.param](), directory)


# the summary


@pytest.mark.slow
def test_summary_has_the_keys_of_the_contract(built: tuple[str, Path, dict[str, Any]]) -> None:
    """CONTRACT.md, section "The report"."""
    _, directory, _ = built
    report = json.loads((directory / "report.json").read_text(encoding="utf-8"))
    assert report.keys() >= {
        "name", "samples", "channels", "cycles", "simulator", "seed", "bit_exact", "mismatches", "error",
        "sqnr_db", "frequency_response", "accuracy_percent", "cycles_per_second", "wall_seconds", "passed",
    }  # fmt: skip
    assert report.keys() >= {
        "core", "scenario", "realization", "architecture", "lsb", "range", "max_error", "first_mismatch",
        "latency_cycles", "cycles_per_sample", "alternatives", "limit_cycles", "tools", "sosmith_version", "shortfalls",
        "notes",
    }  # fmt: skip
    assert report["error"].keys() >= {"max_abs", "rms", "bound", "unit", "max_lsb", "mean", "proven", "parts"}
    assert report["frequency_response"].keys() >= {"max_deviation_db_passband", "stopband_attenuation_db"}
    assert report["accuracy_percent"].keys() == {"unfiltered", "golden", "hardware"}


@without_pictures
def test_gates_are_told_with_what_does_not_fit(tmp_path: Path) -> None:
    cells = {"SB_LUT4": 952, "SB_MAC16": 13}
    run = evidence(gates=Netlist(find_board("icebreaker"), tmp_path / "netlist.v", cells, "0.70"))
    summary = summarise(run)
    assert (summary["gates"], summary["passed"]) == ("icebreaker", True)
    assert summary["notes"][0] == "The netlist takes more than the iCEBreaker has: 13 SB_MAC16 of 8."
    words = " ".join(Page(page_of(run)).words)
    assert "the netlist for the iCEBreaker, iCE40 UP5K: 952 SB_LUT4, 13 SB_MAC16" in words
    assert "gate by gate" in words
    assert summarise(evidence())["gates"] is None


@pytest.mark.sweep(1)
def test_file_holds_the_summary(built: tuple[str, Path, dict[str, Any]]) -> None:
    _, directory, summary = built
    assert json.loads((directory / "report.json").read_text(encoding="utf-8")) == summary


def test_error_is_hardware_minus_golden() -> None:
    run = evidence()
    error = summarise(run)["error"]
    assert error["max_abs"] == pytest.approx(np.abs(run.run.hardware - run.run.golden).max(), rel=1e-15)
    assert error["rms"] == pytest.approx(np.sqrt(np.mean((run.run.hardware - run.run.golden) ** 2)), rel=1e-12)
    assert error["mean"] == pytest.approx(np.mean(run.run.hardware - run.run.golden), rel=1e-12)
    assert error["max_lsb"] == pytest.approx(error["max_abs"] / LSB)
    assert error["unit"] == "mm"


def test_figures_of_the_run() -> None:
    run = evidence()
    summary = summarise(run)
    assert (summary["cycles"], summary["latency_cycles"], summary["range"]) == (9007, 23, [0.0, 16 - LSB])
    noise = np.round(run.run.golden / LSB) * LSB - run.run.golden
    louder = changed(run, hardware=run.run.golden + 10000 * noise)  # so much that hardware and golden differ in power
    ratio = np.sum(run.run.golden**2) / np.sum((10000 * noise) ** 2)
    assert summarise(louder)["sqnr_db"] == pytest.approx(10 * math.log10(ratio), abs=1e-9)


def test_accuracy_counts_only_the_readings() -> None:
    """Equation 7 by hand: hardware 1 % off at the one reading, wild elsewhere."""
    ones = np.ones(4)
    run = evidence(
        time=np.arange(4.0), golden=ones, hardware=np.array([9.0, 9.0, 1.01, 9.0]), truth=ones,
        unfiltered=1.2 * ones, reading=np.array([False, False, True, False]),
    )  # fmt: skip
    assert summarise(run)["accuracy_percent"] == pytest.approx({"unfiltered": 80.0, "golden": 100.0, "hardware": 99.0})


def test_accuracy_leaves_out_the_settling_of_a_start_from_zero() -> None:
    settling = SettlingFacts(samples=2, seconds=0.5, limit=0.25)
    ones = np.ones(4)
    run = evidence(
        time=np.arange(4.0), golden=ones, hardware=np.array([9.0, 9.0, 1.01, 0.99]), truth=ones,
        unfiltered=1.2 * ones, reading=None, settling=settling, unsettled=np.arange(4) < 2,
    )  # fmt: skip
    summary = summarise(run)
    assert summary["accuracy_percent"] == pytest.approx({"unfiltered": 80.0, "golden": 100.0, "hardware": 99.0})
    assert summary["true_error"]["readings"] == 2
    assert summary["true_error"]["max_abs"] == pytest.approx(0.01)
    assert summary["start_up"] == {"samples": 2, "seconds": 0.5, "limit": 0.25}
    marked = changed(run, reading=np.array([False, True, True, True]))
    assert summarise(marked)["accuracy_percent"] != summary["accuracy_percent"]


@pytest.mark.parametrize(
    "changes",
    [
        {"truth": None},
        {"truth": np.zeros(3000)},
        {"reading": np.zeros(3000, dtype=bool)},
        {"reading": None, "unsettled": np.ones(3000, dtype=bool)},
    ],
)
def test_accuracy_is_null_where_it_has_no_meaning(changes: dict[str, Any]) -> None:
    measured = summarise(evidence(**changes))["accuracy_percent"]
    assert measured == {"unfiltered": None, "golden": None, "hardware": None}


@pytest.mark.slow
@without_pictures
def test_json_has_no_infinities(tmp_path: Path) -> None:
    """Hardware equal to golden has no finite ratio of signal to error."""
    run = evidence(cycles_per_second=math.inf)
    write_report(changed(run, hardware=run.run.golden), tmp_path)
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert report["sqnr_db"] is None
    assert report["cycles_per_second"] is None
    assert "no error at all" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_summary_of_a_core_without_filter() -> None:
    assert set(summarise(plain())["frequency_response"].values()) == {None}


# the verdict


def shortfalls(run: Evidence) -> list[str]:
    """Shortfalls, after a look at whether `passed` agrees with them."""
    summary = summarise(run)
    assert summary["passed"] == (summary["shortfalls"] == [])
    found: list[str] = summary["shortfalls"]
    return found


def test_a_good_run_passes() -> None:
    assert shortfalls(evidence()) == []


def test_a_mismatch_falls_short() -> None:
    run = evidence(wrong=3)
    assert shortfalls(run) == [
        "The hardware differs from the integer model at 3 of 3,000 samples, first at sample 1,500."
    ]
    assert not summarise(run)["bit_exact"]


def test_an_error_over_the_limit_falls_short() -> None:
    assert shortfalls(evidence(error_bound=0.0001)) == ["The largest error is 122 nm, over the limit of 100 nm."]


def test_an_error_over_the_allowance_falls_short() -> None:
    assert shortfalls(evidence(max_error=0.00011)) == [
        "The largest error is 122 nm, more than the 110 nm that the specification allows."
    ]


def test_an_error_equal_to_its_limits_passes() -> None:
    run = evidence()
    largest = float(np.abs(run.run.error).max())
    equal = evidence(error_bound=largest, max_error=largest)
    assert shortfalls(equal) == []
    assert summarise(equal)["notes"] == []
    less = math.nextafter(largest, 0)
    assert len(shortfalls(evidence(error_bound=less, max_error=less))) == 2


def test_a_mask_that_is_met_passes() -> None:
    assert shortfalls(evidence(filter=masked(7))) == []


def test_a_passband_loss_falls_short() -> None:
    """Order 5 at the same cut-off: 10 log10(1 + (tan(.1 pi) / tan(.1417 pi))^10) = 0.131 dB at 10 Hz."""
    ratio = math.tan(math.pi * 0.1) / math.tan(math.pi * 0.1417)
    loss = 10 * math.log10(1 + ratio**10)
    assert shortfalls(evidence(filter=masked(5))) == [
        f"The passband loss is {loss:.4f} dB, more than the 0.02 dB allowed."
    ]


def test_a_stopband_attenuation_falls_short() -> None:
    run = evidence(filter=masked(2, passband_edge=(1.0,)))
    attenuation = 10 * math.log10(1 + (math.tan(math.pi * 0.45) / math.tan(math.pi * 0.1417)) ** 4)
    assert shortfalls(run) == [f"The stopband attenuation is {attenuation:.3f} dB, less than the 60 dB asked for."]


def test_a_stopband_may_miss_its_mask_by_the_tolerance() -> None:
    attenuation = summarise(evidence(filter=masked(7)))["frequency_response"]["stopband_attenuation_db"]
    assert shortfalls(evidence(filter=masked(7, stopband_loss=attenuation + 0.0009))) == []
    assert len(shortfalls(evidence(filter=masked(7, stopband_loss=attenuation + 0.0011)))) == 1


def test_losses_without_edges_are_no_mask() -> None:
    """They shape an elliptic filter of given order and cutoff; where they hold is not said."""
    assert shortfalls(evidence(filter=facts(passband_loss=0.01, stopband_loss=500.0))) == []


def test_a_rising_passband_falls_short() -> None:
    louder = masked(7).ideal_sos.copy()
    louder[0, :3] *= 10 ** (0.05 / 20)
    assert shortfalls(evidence(filter=masked(7, quantized_sos=louder))) == [
        "The passband rises 0.0500 dB above the level of the ideal filter."
    ]


def test_the_mask_is_held_against_the_quantized_filter() -> None:
    """An ideal filter that meets its mask excuses nothing, and one that misses it condemns nothing."""
    good, poor = masked(7).ideal_sos, masked(2).ideal_sos
    loss, attenuation = (
        10 * math.log10(1 + (math.tan(math.pi * edge) / math.tan(math.pi * 0.1417)) ** 4) for edge in (0.1, 0.45)
    )
    assert shortfalls(evidence(filter=masked(7, ideal_sos=good, quantized_sos=poor))) == [
        f"The passband loss is {loss:.4f} dB, more than the 0.02 dB allowed.",
        f"The stopband attenuation is {attenuation:.3f} dB, less than the 60 dB asked for.",
    ]
    assert shortfalls(evidence(filter=masked(7, ideal_sos=poor, quantized_sos=good))) == []


def test_a_mask_met_with_equality_passes() -> None:
    """A Chebyshev filter touches its mask; rounding its coefficients to 20 bits tips it by a hair."""
    sos = signal.cheby1(5, 0.5, 10, fs=100, output="sos")
    run = evidence(
        filter=facts(ideal_sos=sos, quantized_sos=rounded(sos, 20), passband_edge=(10.0,), passband_loss=0.5)
    )
    assert 0.5 < summarise(run)["frequency_response"]["passband_loss_db"] < 0.501
    assert shortfalls(run) == []


def test_an_unstable_filter_falls_short() -> None:
    """The bare verdict: no mask is needed to see that this filter cannot be."""
    unstable = F7.copy()
    unstable[1, 5] = 1.0001
    assert shortfalls(evidence(filter=facts(quantized_sos=unstable))) == [
        "The filter with its integer coefficients is unstable: a pole lies at radius 1.00005."
    ]


def test_a_pole_on_the_unit_circle_falls_short() -> None:
    measures = replace(response.measure_response(facts()), largest_pole_radius=1.0)
    assert mask_shortfalls(facts(), measures) == [
        "The filter with its integer coefficients is unstable: a pole lies at radius 1.00000."
    ]
    assert mask_shortfalls(facts(), replace(measures, largest_pole_radius=math.nextafter(1, 0))) == []


def test_notes_say_that_the_limit_is_wider_than_asked() -> None:
    assert summarise(evidence())["notes"] == []
    assert summarise(evidence(max_error=0.00015))["notes"] == [
        "The error limit 200 nm is wider than the 150 nm that the specification allows: "
        "other inputs could exceed the allowance."
    ]


# the frequency response


def test_group_delay_at_dc_of_the_paper() -> None:
    """Sum of 2 sin of the pole angles over the pre-warped cut-off: 4.494 / 1.626 rad/s = 2.76 s.

    The bilinear transformation keeps the delay at DC, and 1.626 rad/s is the cut-off of `F7` pre-warped.
    """
    angles = np.pi * (2 * np.arange(1, 8) - 1) / 14
    cutoff = 200 * math.tan(math.pi * 0.2587803 / 100)
    expected = float(np.sum(np.sin(angles))) / cutoff
    assert expected == pytest.approx(2.764, abs=5e-4)
    delay = response.group_delay(F7, np.array([0.0, 1e-6]), 100.0)
    assert delay == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    "sos",
    [
        signal.butter(5, 10, fs=100, output="sos"),
        signal.cheby1(4, 1, (8, 20), btype="bandpass", fs=100, output="sos"),
        signal.bessel(6, 12, btype="highpass", fs=100, output="sos"),
        np.array([[0.9, 0.4, 0.1, 1.0, -0.5, 0.2], [2.0, 0.5, 0.0, 1.0, 0.3, 0.0]]),
    ],
    ids=["butterworth", "chebyshev bandpass", "bessel highpass", "no zeros on the circle"],
)
def test_response_agrees_with_scipy(sos: Array) -> None:
    """Reliable in scipy too: poles well inside, frequencies off the zeros at 0 and at Nyquist."""
    frequency = np.linspace(3, 45, 50)
    delay = sum(signal.group_delay((section[:3], section[3:]), w=frequency, fs=100)[1] for section in sos)
    assert response.group_delay(sos, frequency, 100.0) == pytest.approx(np.asarray(delay) / 100, abs=1e-9)
    _, gain = signal.sosfreqz(sos, worN=frequency, fs=100)
    expected = 20 * np.log10(np.abs(gain))
    assert response.magnitude_db(sos, frequency, 100.0) == pytest.approx(expected, abs=1e-8)
    assert response.complex_response(sos, frequency, 100.0) == pytest.approx(gain, abs=1e-9)


def test_group_delay_where_the_response_vanishes() -> None:
    """A zero on the unit circle without linear phase: the delay does not exist there."""
    section = np.array([[1.0, -0.5, -0.5, 1.0, 0.0, 0.0]])
    delay = response.group_delay(section, np.array([0.0, 25.0]), 100.0)
    assert np.isnan(delay[0])
    assert np.isfinite(delay[1])


def test_group_delay_at_a_zero_of_linear_phase() -> None:
    """All zeros of `F7` lie at Nyquist; half a sample each goes on there as if nothing had happened."""
    delay = response.group_delay(F7, np.array([49.9, 50.0]), 100.0)
    assert delay[1] == pytest.approx(delay[0], rel=1e-4)


def test_magnitude_has_a_floor() -> None:
    assert response.magnitude_db(F7, np.array([50.0]), 100.0) == pytest.approx(response.FLOOR_DB)


def test_poles_and_zeros_leave_out_the_origin() -> None:
    first_order = np.array([[0.5, 0.5, 0.0, 1.0, -0.9, 0.0]])
    assert response.poles(first_order).tolist() == pytest.approx([0.9])
    assert response.zeros(first_order).tolist() == pytest.approx([-1.0])


@pytest.mark.parametrize(
    ("taps", "frame"), [([1, 2, 1], (1.25, 0)), ([1, -2.5, 1], (2.2, 0)), ([1, -10.1, 1], (3.0, 1))]
)
def test_zeros_outside_of_the_unit_circle_are_drawn_or_counted(taps: list[float], frame: tuple[float, int]) -> None:
    """An FIR filter with linear phase has one at 1/z for each at z."""
    sos = np.array([[*taps, 1.0, 0.0, 0.0]])
    facts = response.FilterFacts(sample_rate=1.0, ideal_sos=sos, quantized_sos=sos)
    assert filter_plots.plane_frame(facts) == pytest.approx(frame)
    assert (", 1 zero farther out" in filter_plots.pole_zero_figure(facts)) == bool(frame[1])


def test_poles_and_zeros_are_roots_the_larger_of_two_real_ones_first() -> None:
    sos = np.array([[2.0, -3.0, 1.0, 1.0, 0.75, 0.125], [4.0, 4.0, 2.0, 1.0, -1.0, 0.5]])
    assert response.zeros(sos).tolist() == [1.0, 0.5, -0.5 + 0.5j, -0.5 - 0.5j]
    assert response.poles(sos).tolist() == [-0.5, -0.25, 0.5 + 0.5j, 0.5 - 0.5j]


def test_zeros_of_many_taps_and_no_poles() -> None:
    fir = np.array([[2.0, -7.0, 7.0, -2.0, 1.0, 0.0, 0.0, 0.0]])
    assert sorted(response.zeros(fir).tolist(), key=abs) == pytest.approx([0.5, 1.0, 2.0], abs=1e-12)
    assert response.poles(fir).tolist() == []
    assert response.measure_response(facts(ideal_sos=fir, quantized_sos=fir)).largest_pole_radius == 0.0


@pytest.mark.parametrize("kind", ["lowpass", "highpass", "bandpass", "bandstop"])
def test_a_cutoff_of_the_stopband_leaves_the_passband_to_the_response(kind: str) -> None:
    """It reaches as far as the gain is above 0.707, to the nearest frequencies of the grid on that side."""
    edges = (20.0,) if kind.endswith("pass") and kind != "bandpass" else (10.0, 30.0)
    sos = signal.cheby2(3, 40, edges if len(edges) == 2 else edges[0], kind, output="sos", fs=100)
    bands = response.passbands(facts(kind=kind, ideal_sos=sos, cutoff=edges, cutoff_of_stopband=True))
    step = 100 / 2 / 4000
    fine = np.linspace(0, 50, 200_001)
    gains = np.abs(signal.freqz_sos(sos, fine, fs=100)[1])
    inside = np.flatnonzero(np.diff(np.concatenate([[0], gains >= gains.max() / math.sqrt(2), [0]])))
    wanted = [(fine[a], fine[b - 1]) for a, b in inside.reshape(-1, 2)]
    assert len(bands) == len(wanted) == (2 if kind == "bandstop" else 1)
    for (low, high), (least, most) in zip(bands, wanted, strict=True):
        assert least - 1e-3 <= low <= least + step
        assert most - step <= high <= most + 1e-3


def test_stopband_attenuation_an_octave_beyond_the_cutoff() -> None:
    """Butterworth: 10 log10(1 + (tan(pi 2 fc/fs) / tan(pi fc/fs))^14), the smallest in the stopband."""
    ratio = math.tan(2 * math.pi * 0.2587803 / 100) / math.tan(math.pi * 0.2587803 / 100)
    measures = response.measure_response(facts(quantized_sos=F7))
    assert measures.stopband_attenuation_db == pytest.approx(10 * math.log10(1 + ratio**14), abs=1e-6)
    assert measures.passband_loss_db == pytest.approx(10 * math.log10(2), abs=1e-6)
    assert measures.max_deviation_db_passband == 0.0


def test_deviation_in_the_passband() -> None:
    for change in (0.25, -0.25):
        other = F7.copy()
        other[0, :3] *= 10 ** (change / 20)
        measures = response.measure_response(facts(quantized_sos=other))
        assert measures.max_deviation_db_passband == pytest.approx(0.25, abs=1e-9)


def test_a_deviation_beyond_the_passband_does_not_count() -> None:
    measures = response.measure_response(
        masked(7, passband_edge=(1.0,), quantized_sos=signal.butter(2, 14.17, fs=100, output="sos"))
    )
    assert 0 < measures.max_deviation_db_passband < 1e-4


def test_the_level_is_that_of_the_passband() -> None:
    """A resonance far above it at 25 Hz does not lift the level."""
    sos = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.81]])
    filter_facts = facts(ideal_sos=sos, quantized_sos=sos, cutoff=None, passband_edge=(1.0,))
    (at_the_edge,) = response.magnitude_db(sos, np.array([1.0]), 100.0)
    assert response.passband_level_db(filter_facts) == pytest.approx(at_the_edge, abs=1e-12)
    assert at_the_edge < -5


@pytest.mark.parametrize(
    ("kind", "cutoff", "passing", "stopping"),
    [
        ("lowpass", (10.0,), [(0.0, 10.0)], [(20.0, 50.0)]),
        ("lowpass", (30.0,), [(0.0, 30.0)], [(40.0, 50.0)]),
        ("highpass", (10.0,), [(10.0, 50.0)], [(0.0, 5.0)]),
        ("bandpass", (8.0, 12.0), [(8.0, 12.0)], [(0.0, 4.0), (24.0, 50.0)]),
        ("bandstop", (8.0, 12.0), [(0.0, 8.0), (12.0, 50.0)], [(9.0, 11.0)]),
    ],
)
def test_bands(
    kind: str, cutoff: tuple[float, ...], passing: list[response.Band], stopping: list[response.Band]
) -> None:
    filter_facts = facts(kind=kind, cutoff=cutoff)
    assert response.passbands(filter_facts) == passing
    assert response.stopbands(filter_facts) == stopping


def test_given_sections_have_a_passband_but_no_stopband() -> None:
    measures = response.measure_response(facts(cutoff=None, quantized_sos=F7))
    assert measures.stopband_attenuation_db is None
    assert 2.9 < measures.passband_loss_db <= 10 * math.log10(2)


def test_frequencies_reach_well_below_the_cutoff() -> None:
    for filter_facts in (facts(), facts(cutoff=None)):
        grid = response.frequency_grid(filter_facts)
        assert grid[0] < 0.01
        assert grid[-1] == 50.0


def test_measures_are_taken_everywhere_and_at_every_edge() -> None:
    """A peak of the stop band between its edge and Nyquist counts, and so does an edge between two even steps."""
    filter_facts = facts(kind="bandpass", cutoff=(8.0123, 12.0456), stopband_edge=(4.0789, 44.0321))
    grid = response.measurement_grid(filter_facts)
    assert (grid[0], grid[-1]) == (0.0, 50.0)
    assert np.diff(grid).max() <= 50 / 4000 * (1 + 1e-9)
    assert {8.0123, 12.0456, 4.0789, 44.0321} <= set(grid.tolist())


# the page


@pytest.mark.slow
def test_same_evidence_gives_the_same_bytes(built: tuple[str, Path, dict[str, Any]], tmp_path: Path) -> None:
    case, directory, _ = built
    write_report(CASES[case](), tmp_path)
    for name in ("report.json", "report.html"):
        assert (tmp_path / name).read_bytes() == (directory / name).read_bytes()


@pytest.mark.sweep(1)
def test_page_needs_nothing_from_elsewhere(built: tuple[str, Path, dict[str, Any]]) -> None:
    content = (built[1] / "report.html").read_text(encoding="utf-8")
    page = Page(content)
    assert page.open == []
    assert not {"link", "img", "iframe", "image"} & set(page.tags)
    assert page.tags.count("script") == 2  # the samples, and the one that draws them
    references = [value for name, value in page.attributes if name in ("src", "href", "xlink:href")]
    assert all(value.startswith("#") for value in references)
    assert not re.search(r"https?:|url\((?!#)|@import", content)
    assert len(content.encode()) < 1_000_000


@pytest.mark.sweep(1)
def test_references_inside_the_page_lead_somewhere(built: tuple[str, Path, dict[str, Any]]) -> None:
    content = (built[1] / "report.html").read_text(encoding="utf-8")
    page = Page(content)
    targets = re.findall(r"url\(#([^)]*)\)", content)
    targets += [value[1:] for name, value in page.attributes if name == "href"]
    identifiers = [value for name, value in page.attributes if name == "id"]
    assert targets
    assert set(targets) <= set(identifiers)
    assert len(identifiers) == len(set(identifiers))


@pytest.mark.sweep(1)
def test_every_colour_of_a_figure_follows_the_page(built: tuple[str, Path, dict[str, Any]]) -> None:
    """No colour of its own, which would vanish on a dark page; nothing left of the placeholders."""
    content = (built[1] / "report.html").read_text(encoding="utf-8")
    figures = "".join(re.findall(r"<svg.*?</svg>", content, flags=re.DOTALL))
    assert not re.search(r"#[0-9a-f]{6}\b(?!\))", re.sub(r'(href|id)="[^"]*"', "", figures))
    style = content[: content.index("</style>")]
    for role in painting.ROLES:
        assert style.count(f"--{role}:") == 2


@pytest.mark.sweep(1)
def test_page_says_the_verdict_first(built: tuple[str, Path, dict[str, Any]]) -> None:
    case, directory, _ = built
    content = (directory / "report.html").read_text(encoding="utf-8")
    kind, verdict = ("fail", "Falls short") if case == "failing" else ("pass", "Passed")
    start = content[: content.index("<dl")]
    assert f"<strong>{verdict}</strong>" in start
    assert f'<div class="verdict {kind}">' in start


@without_pictures
def test_page_shows_numbers_with_units() -> None:
    content = " ".join(Page(page_of(evidence())).words)
    for words in ("122\u00a0nm", "0.500\u00a0LSB", "200\u00a0nm", "−66,026,473", "Q7.14", "5.048", "3.01 dB"):
        assert words in content


@without_pictures
def test_parts_of_the_limit_that_count_for_nothing_are_left_out() -> None:
    """A part may be the width of a ball, with dozens of zeros behind the point."""
    rows = page_of(evidence(error_parts={"output": LSB / 2, "start": 2.6e-76 * LSB, "coefficients": LSB / 10_000}))
    table = rows[rows.index("What the limit is made of") :]
    assert re.findall(r'<tr><th scope="row">(.*?)</th>', table)[:3] == ["output", "coefficients", "sum"]
    assert [word for word in Page(rows).words if "0.0000" in word] == []


@without_pictures
def test_texts_are_escaped_once(tmp_path: Path) -> None:
    """The name of a board stands in the verdict and in the facts about the run."""
    board = replace(find_board("icebreaker"), title="<Ice> & 'Breaker'")
    page = page_of(evidence(gates=Netlist(board, tmp_path / "netlist.v", {"SB_LUT4": 952}, "0.70")))
    words = " ".join(Page(page).words)
    assert "The simulated netlist for the <Ice> & 'Breaker' agrees with its integer model" in words
    assert "the netlist for the <Ice> & 'Breaker', iCE40 UP5K: 952 SB_LUT4" in words
    assert "&amp;lt;" not in page


@pytest.mark.slow
def test_texts_from_outside_are_escaped() -> None:
    """Every text that the page takes, each with markup and its own mark, appears in words and not as markup."""
    nasty = "<script>alert('{}')</script>&amp;\"$x$"
    marks = iter(range(100))

    def text() -> str:
        return nasty.format(next(marks))

    run = evidence(
        name=text(), core=text(), description=text(), scenario=text(), output=replace(OUTPUT, unit=text()),
        simulator=text(), realization=text(), architecture=text(), reasons={"why": text()}, tools={text(): text()},
        error_parts={text(): 0.1},
        formats=(NodeFormat(stage=text(), node=text(), format=text(), low=0.0, high=1.0, unit=text()),),
        sections=(
            SectionFacts(
                name=text(), coefficients=(CoefficientFacts(name=text(), integer=1, frac=0, value=1.0),)
            ),
        ),
        alternatives=(Alternative(name=text(), max_abs=0.4, rms=0.1),),
    )  # fmt: skip
    page = Page(page_of(run))
    assert page.tags.count("script") == 2
    assert page.open == []
    words = "".join(page.words).replace("\u00a0", " ")
    for number in range(next(marks) - 1):
        assert nasty.format(number)[:26] in words


@pytest.mark.slow
def test_a_dollar_sign_in_a_figure_is_no_formula() -> None:
    assert "output in $x^2$" in Page(page_of(evidence(output=replace(OUTPUT, unit="$x^2$")))).words


@pytest.mark.slow
@without_pictures
def test_page_shows_what_rounding_keeps_up() -> None:
    words = " ".join(Page(page_of(evidence())).words).replace("\u00a0", " ")
    start = words.index("What rounding can keep up by itself")
    rows = " ".join(words[start:].split())
    assert "section 0 30.0 0.123 0 0 not needed" in rows
    assert "section 1 none, proven 0 61.0 0.250 1, 0.3333" in rows
    assert "What rounding can keep up by itself" not in page_of(plain())


@pytest.mark.sweep(1)
@pytest.mark.parametrize("off", [1e-6, -1e-6])
def test_a_delay_beyond_all_bounds_is_not_framed(off: float) -> None:
    """A zero that rounding has moved off z = -1 delays the nothing that is left at Nyquist by any time at all."""
    ideal = signal.butter(1, 1000, fs=48000, output="sos")
    moved = ideal * [1, 1 + off, 1, 1, 1, 1]
    drawn, same = (
        Page(
            filter_plots.delay_figure(facts(ideal_sos=ideal, quantized_sos=sos, sample_rate=48000.0, cutoff=(1000.0,)))
        ).words
        for sos in (moved, ideal)
    )
    assert "group delay in µs" in drawn
    assert drawn == same


@pytest.mark.slow
def test_this_design_is_not_its_own_alternative() -> None:
    known = evidence().alternatives
    itself = Alternative(name="df1_ef2", max_abs=0.1, rms=0.1)
    assert page_of(evidence(alternatives=(*known, itself))) == page_of(evidence())


@pytest.mark.sweep(1)
@without_pictures
@pytest.mark.parametrize(("length", "unfolded"), [(24, True), (25, False)])
def test_many_formats_are_folded_up(length: int, unfolded: bool) -> None:
    formats = [NodeFormat(stage="stage", node=f"n{i}", format="Q1.15", low=-1.0, high=1.0) for i in range(length)]
    page = Page(page_of(evidence(formats=formats)))
    assert page.words.count("stage") == 2  # title of the column, and of the first row only
    assert page.words.count("Q1.15") == length
    assert (("open", "") in page.attributes) == unfolded


@pytest.mark.slow
@pytest.mark.parametrize("length", [1, 2, 7])
def test_a_handful_of_samples_makes_a_page(length: int) -> None:
    run = plain(time=np.arange(float(length)), golden=np.zeros(length), hardware=np.zeros(length))
    assert Page(page_of(run)).open == []


@without_pictures
def test_a_limit_far_outside_is_named_instead_of_drawn() -> None:
    run = evidence(error_bound=0.5, max_error=1.0)
    assert error_limits(run)[0] == []
    assert "Too far out to draw: limit ±500\u00a0µm and allowed by the specification ±1,000\u00a0µm." in page_of(run)


def test_thinning_keeps_peaks() -> None:
    values = np.random.default_rng(3).standard_normal(100_003)
    values[77_777] = 100.0
    values[50_001] = -100.0
    time, thin = painting.envelope(np.arange(100_003.0), values, 500)
    assert len(thin) <= 1000
    assert thin.max() == 100.0
    assert thin.min() == -100.0
    assert time[np.argmax(thin)] == 77_777
    assert np.all(np.diff(time) > 0)


def test_thinning_leaves_short_traces_alone() -> None:
    values = np.arange(1000.0)
    assert painting.envelope(values, values, 500)[1] is values


def test_close_up_holds_the_largest_error() -> None:
    for worst in (0, 5, 1500, 2999):
        hardware = evidence().run.golden.copy()
        hardware[worst] += 1
        near = close_up(evidence(hardware=hardware))
        assert near.stop - near.start == 60
        assert near.start <= worst < near.stop


# files


@pytest.mark.slow
@without_pictures
def test_a_page_that_fails_leaves_the_old_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither file is written before both are made."""
    write_report(evidence(), tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def fail(*_: object) -> str:
        raise RuntimeError("no picture")

    monkeypatch.setattr(run_plots, "trace_figure", fail)
    with pytest.raises(RuntimeError, match=r"^no picture$"):
        write_report(evidence(seed=8), tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
@without_pictures
def test_the_verdict_tells_the_signal_from_the_arithmetic() -> None:
    run = evidence()
    summary = summarise(run)
    off = quantity.quantity(summary["true_error"]["max_abs"], run.facts.unit).replace(" ", "\u00a0")
    bound = ErrorUnit.of(run.facts, "\u00a0").amount(run.facts.error_bound)
    assert summary["true_error"]["max_abs"] > run.facts.error_bound
    sentence = f"The output is off by up to {off} from the true value, and the hardware adds at most {bound} of that:"
    assert sentence in render_page(run, summary)
    unknown = evidence(truth=None)
    assert "from the true value, and" not in render_page(unknown, summarise(unknown))


@pytest.mark.sweep(1)
@without_pictures
@pytest.mark.parametrize("off", [0, 1])
def test_a_bound_of_zero_is_told(off: int) -> None:
    """A pure delay: nothing is rounded, and one wrong code is over the limit."""
    exact = LSB * np.arange(3000.0)
    hardware = exact + LSB * off * (np.arange(3000) == 7)
    run = evidence(error_bound=0.0, golden=exact, hardware=hardware)
    summary = summarise(run)
    assert summary["error"]["bound"] == 0
    assert summary["passed"] is not bool(off)
    page = render_page(run, summary)
    assert f"{off}\u00a0LSB, the proven limit 0\u00a0nm" in page.replace(".00\u00a0LSB", "\u00a0LSB")
    if off:
        assert summary["shortfalls"][0] == "The largest error is 244 nm, over the limit of 0 mm."
    else:
        assert "stays within 0\u00a0nm of the exact calculation; the proven limit is 0\u00a0nm." in page
        assert "no error at all" in page


# refusals


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"error_bound": math.nan}, "error_bound must be at least 0 and finite, not nan"),
        ({"error_bound": -1.0}, "error_bound must be at least 0 and finite, not -1.0"),
        ({"max_error": math.inf}, "max_error must be positive and finite, not inf"),
        (
            {"hardware": np.zeros((2, 2, 2))},
            "hardware must have the shape (n,) or (n, channels) with n >= 1, not (2, 2, 2)",
        ),
        ({"hardware": np.zeros((2, 2))}, "time must have the shape (2,), not (3000,)"),
        ({"hardware": np.zeros((3000, 2))}, "golden must have the shape (3000, 2), not (3000,)"),
        ({"truth": np.zeros(2)}, "truth must have the shape (3000,), not (2,)"),
        ({"golden": np.full(3000, np.nan)}, "golden must be finite, not NaN or infinite"),
    ],
)
def test_evidence_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        evidence(**changes)


@pytest.mark.parametrize("shape", [(1,), (1, 1), (2, 1), (1, 2)])
def test_evidence_may_be_as_little_as_one_sample(shape: tuple[int, ...]) -> None:
    arrays = dict.fromkeys(("golden", "truth", "hardware", "unfiltered"), np.ones(shape))
    one = evidence(**arrays, time=np.zeros(shape[0]), reading=np.ones(shape, dtype=bool))
    assert one.run.error.tolist() == np.zeros(shape).tolist()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "allpass"}, "kind must be one of lowpass, highpass, bandpass, bandstop, not 'allpass'"),
        ({"cutoff": (1.0, 2.0)}, "cutoff of a lowpass must hold 1 frequencies, not (1.0, 2.0)"),
        (
            {"ideal_sos": np.zeros((2, 5))},
            "ideal_sos must have the shape (n_sections, 6) or that of an FIR filter, not (2, 5)",
        ),
    ],
)
def test_filter_facts_refuse(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        facts(**changes)


# numbers for people


@pytest.mark.parametrize("module", [quantity, response, step_response])
def test_examples_in_docstrings(module: Any) -> None:
    results = doctest.testmod(module)
    assert results.attempted > 0
    assert results.failed == 0


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (0.9999, "mm", "1.00 mm"),
        (0.00099996, "mm", "1.00 µm"),
        (1e-3, "m", "1.00 mm"),
        (16.0, "mm", "16.0 mm"),
        (-2500.0, "mm", "−2.50 m"),
        (1500.0, "kHz", "1.50 MHz"),
        (2.0, "cm", "2.00 cm"),
        (0.5, "", "0.500"),
        (123456.0, "", "123,456"),
        (1.5e7, "", "15.0 × 10⁶"),
        (0.004, "degC", "4.00 × 10⁻³ °C"),
        (math.nan, "mm", "—"),
        (None, "mm", "—"),
    ],
)
def test_quantities(value: float | None, unit: str, words: str) -> None:
    assert quantity.quantity(value, unit) == words


def test_an_error_of_nothing_has_no_power_of_ten() -> None:
    shown = [ErrorUnit(*quantity.scale(4e-4, unit)) for unit in ("", "degC", "mm")]
    assert [unit.amount(0.0) for unit in shown] == ["0", "0 °C", "0 nm"]
    assert [unit.amount(1e-4) for unit in shown] == ["100 × 10⁻⁶", "100 × 10⁻⁶ °C", "100 nm"]


def test_the_worst_channel_has_the_largest_error_of_either_sign() -> None:
    golden = np.zeros((4, 3))
    hardware = golden.copy()
    hardware[2, 1] = 2 * LSB
    arrays = {"golden": golden, "time": np.arange(4) / 100, "truth": None, "reading": None, "unfiltered": None}
    several = evidence(**arrays, hardware=hardware)
    assert several.run.worst_channel == 1
    hardware[0, 2] = -3 * LSB
    assert several.run.worst_channel == 2
    assert several.run.of_channel(1).worst_channel == 0


@pytest.mark.slow
@without_pictures
def test_several_channels_are_measured_together_and_the_worst_is_shown() -> None:
    one = evidence()
    arrays = {
        name: np.stack([getattr(one.run, name)] * 3, axis=1)
        for name in ("golden", "truth", "reading", "unfiltered")
        if getattr(one.run, name) is not None
    }
    hardware = np.stack([one.run.hardware] * 3, axis=1)
    hardware[100, 1] += 2 * LSB
    several = evidence(hardware=hardware, **arrays)
    assert several.run.worst_channel == 1
    low = hardware.copy()
    low[200, 2] -= 3 * LSB  # an error below zero is an error too
    assert changed(several, hardware=low).run.worst_channel == 2
    shown = several.shown
    assert shown.run.shown_channel == 1
    assert shown.run.hardware.tolist() == hardware[:, 1].tolist()
    summary = summarise(several)
    assert summary["error"]["max_abs"] == np.abs(several.run.error).max() > summarise(one)["error"]["max_abs"]
    assert summary["error"]["rms"] == pytest.approx(np.sqrt(np.mean(several.run.error**2)))
    # the run's cycles over the samples of all channels, 3 times 3,000
    assert summary["cycles_per_sample"] == pytest.approx(9007 / 9000, rel=1e-15)
    assert summarise(one)["cycles_per_sample"] == pytest.approx(9007 / 3000, rel=1e-15)
    page = render_page(several, summary)
    assert "All pictures show channel 1, the one of 3 with the largest error" in page
    assert "All pictures show" not in render_page(one, summarise(one))
